"""Staubli VAL3: the variables of a data file (``.dtx``), and frames and tools, which are chains of fathers."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, field
from typing import Final, Literal
from xml.parsers import expat

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.programs.program import BYTE_ORDER_MARK, LARGEST, NUMBER, Lines, Source
from truearm.engine.robot.transform import IDENTITY, MOVING_XYZ_ANGLES, Transform

# Two formats are in use. In that of VAL3 7 and later, ``Data`` names a variable and ``Value`` one of its elements;
# numbers that are zero need not be written. In that of VAL3 5 and 6 every type has a section, and the numbers of an
# element are in a tag of their own.
FRAME: Final = ("x", "y", "z", "rx", "ry", "rz")
#: Numbers of an element of each type.
NUMBERS: Final = {
    **dict.fromkeys(("frame", "tool", "pointRx", "pointRs"), FRAME),
    "jointRx": ("j1", "j2", "j3", "j4", "j5", "j6"),
    "jointRs": ("j1", "j2", "j3", "j4"),
}
#: What the old format calls the types.
_OLD_TYPES: Final = {
    **{"frame": "frame", "tool": "tool", "point": "pointRx", "pointRs": "pointRs"},
    **{"joint": "jointRx", "jointRs": "jointRs"},
}
_OLD_FATHERS: Final = frozenset(("fFather", "tFather", "pFather"))
_OLD_NUMBERS: Final = frozenset(("tfValue", "ttValue", "tpValue", "jointValue", "jointRsValue"))
_OLD_POSTURES: Final = frozenset(("cpValue",))

_TAG: Final = re.compile(r"<[^\s/>]+(?:\s+[\w:.-]+\s*=\s*(?:\"[^\"]*\"|'[^']*'))*+")
_NAME: Final = re.compile(r"<[^\s/>]+")
_ATTRIBUTE: Final = re.compile(r"\s([\w:.-]+)\s*=\s*(?:\"([^\"]*)\"|'([^']*)')")
#: Nearly every element of the new format, as the makers' tools write it.
_VALUE: Final = re.compile(
    rf'<Value key="([\d,]{{1,20}})" x="((?>{NUMBER}))" y="((?>{NUMBER}))" z="((?>{NUMBER}))"'
    rf' rx="((?>{NUMBER}))" ry="((?>{NUMBER}))" rz="((?>{NUMBER}))"(?=[ />])'
)
_NUMBER: Final = re.compile(rf"\s*((?>{NUMBER}))\s*")

Attributes = dict[str, str]


@dataclass(slots=True)
class Element:
    """An element of a variable."""

    key: str  #: Its index in the variable, as text without blanks.
    line: int  #: In the file, from 1.
    #: values, places: its numbers in the order of :data:`NUMBERS`, and where they stand; an empty place is where one
    #: could stand.
    values: tuple[float, ...]
    places: tuple[tuple[int, int], ...]
    father: str  #: Reference to the frame or tool that it is relative to, empty for none.
    posture: tuple[str, ...] = ()  #: Words for the shoulder, elbow and wrist, those that are written.


@dataclass
class Variable:
    """A variable that the robot's positions depend on."""

    name: str
    type: str
    source: int
    line: int
    elements: dict[str, Element] = field(default_factory=dict)


def parse(source: Source, started: Callable[[str, Attributes, int], None], ended: Callable[[str, int], None]) -> None:
    """Go through the tags of a file, or refuse it if it is not well-formed.

    Args:
        started, ended: Called with the name of a tag, the attributes of a starting one, and the place where the tag
            begins.
    """
    text = source.text
    skipped = len(BYTE_ORDER_MARK) if text.startswith(BYTE_ORDER_MARK) else 0
    # Every character is a byte here, and markup is ASCII in every encoding that a file may have.
    parser = expat.ParserCreate("iso-8859-1")
    parser.StartElementHandler = lambda name, attributes: started(
        name.rpartition(":")[2], attributes, parser.CurrentByteIndex + skipped
    )
    parser.EndElementHandler = lambda name: ended(name.rpartition(":")[2], parser.CurrentByteIndex + skipped)
    try:
        parser.Parse(text[skipped:].encode("latin-1"), True)
    except expat.ExpatError as error:
        reason = expat.errors.messages[error.code]
        source.refuse(error.lineno, f"the file is not complete or not well-formed: {reason}")


def variables_of(source: Source, index: int, lines: Lines) -> list[Variable]:
    """Read the variables of a data file that matter here, in the order of the text."""
    reader = _Reader(source, index, lines)
    parse(source, reader.started, reader.ended)
    return reader.variables


class _Reader:
    """Takes the tags of a data file, in either format."""

    def __init__(self, source: Source, index: int, lines: Lines) -> None:
        self.variables: list[Variable] = []
        self._source, self._index, self._lines = source, index, lines
        self._variable: Variable | None = None
        self._father, self._key = "", "0"

    def started(self, name: str, attributes: Attributes, place: int) -> None:
        variable = self._variable
        if name == "Value":
            if variable is not None:
                key = key_of(attributes.get("key", "0"))
                self._add(variable, key, place, attributes.get("fatherId", ""), _posture(attributes))
        elif name == "Data":
            self._begin(attributes, attributes.get("type", ""), place)
        elif variable is None:
            if name in _OLD_TYPES and "name" in attributes:
                self._begin(attributes, _OLD_TYPES[name], place)
        elif name in _OLD_FATHERS:
            self._father = _old_father(attributes)
        elif name in _OLD_NUMBERS:
            self._add(variable, self._key, place, self._father, ())
        elif name in _OLD_POSTURES:
            if variable.elements:
                next(reversed(variable.elements.values())).posture = _posture(attributes)
        elif "index" in attributes and name.startswith("value"):
            self._key = key_of(attributes["index"])

    def ended(self, name: str, place: int) -> None:
        del place
        if name == "Data" or name in _OLD_TYPES:
            self._variable = None

    def _begin(self, attributes: Attributes, type_: str, place: int) -> None:
        self._father, self._key = "", "0"
        self._variable = None
        if type_ in NUMBERS and attributes.get("name"):
            self._variable = Variable(attributes["name"], type_, self._index, self._lines.number(place))
            self.variables.append(self._variable)

    def _add(self, variable: Variable, key: str, place: int, father: str, posture: tuple[str, ...]) -> None:
        line = self._lines.number(place)
        if key in variable.elements:
            self._source.refuse(line, f"{variable.name}[{key}] is given twice")
        fast = _VALUE.match(self._source.text, place) if NUMBERS[variable.type] is FRAME else None
        if fast is not None:
            values, places = tuple(map(float, fast.groups()[1:])), fast.regs[2:]
            if max(map(abs, values)) > LARGEST:
                self._source.refuse(line, f"{variable.name} has a number out of all proportion", came=values)
        else:
            values, places = self._numbers(variable, place, line)
        variable.elements[key] = Element(key, line, values, places, father, posture)

    def _numbers(
        self, variable: Variable, place: int, line: int
    ) -> tuple[tuple[float, ...], tuple[tuple[int, int], ...]]:
        text = self._source.text
        tag = _TAG.match(text, place)
        stop = tag.end() if tag is not None else place
        written: dict[str, tuple[str, int]] = {}
        named = _NAME.match(text, place)
        after = named.end() if named is not None else place
        for match in _ATTRIBUTE.finditer(text, place, stop):
            quoted = 2 if match[2] is not None else 3
            written[match[1]] = match[quoted], match.start(quoted)
        if "key" in written:
            after = written["key"][1] + len(written["key"][0]) + 1
        values: list[float] = []
        places: list[tuple[int, int]] = []
        for name in NUMBERS[variable.type]:
            if name not in written:
                values.append(0.0)
                places.append((after, after))
                continue
            number, start = written[name]
            number_match = _NUMBER.fullmatch(number)
            if number_match is None:
                self._source.refuse(line, f"{name} of {variable.name} is no number", came=number)
            value = float(number_match[1])
            if abs(value) > LARGEST:
                self._source.refuse(line, f"{name} of {variable.name} is out of all proportion", came=number)
            values.append(value)
            places.append((start + number_match.start(1), start + number_match.end(1)))
            after = start + len(number) + 1
        return tuple(values), tuple(places)


def key_of(text: str) -> str:
    """Return an index as it is compared: without blanks."""
    return "".join(text.split())


def _posture(attributes: Attributes) -> tuple[str, ...]:
    return tuple([attributes[part] for part in ("shoulder", "elbow", "wrist") if part in attributes])


def _old_father(attributes: Attributes) -> str:
    name = attributes.get("name", "")
    alias = attributes.get("alias", "")
    index = key_of(attributes.get("fatherIndex", "0"))
    return f"{alias}:{name}[{index}]" if alias else f"{name}[{index}]" if name else ""


#: What the chains end at.
_GROUND: Final = {"frame": "world", "tool": "flange"}

#: Of an application: its variables by name, the names of those that its programs change, and its unit of length [m].
Application = tuple[Mapping[str, Variable], Set[str], float]


def name_of(variable: str, key: str) -> str:
    """Return the name of an element: of the first one, that of its variable."""
    return variable if key == "0" else f"{variable}[{key}]"


def father_of(element: Element, type_: Literal["frame", "tool"]) -> str:
    """Return the name of what an element is relative to, empty for the robot's own base or flange."""
    name = element.father.removesuffix("[0]")
    return "" if name == _GROUND[type_] else name


def transforms(
    type_: Literal["frame", "tool"], sources: Sequence[Source], applications: Sequence[Application]
) -> dict[str, Transform]:
    """Return the frames or tools by name, without those that a program changes or that rest on unknown ones."""
    by_name: dict[str, Transform] = {}
    for application in applications:
        for bare, variable in application[0].items():
            if variable.type != type_ or bare == _GROUND[type_]:
                continue
            for key, element in variable.elements.items():
                name = name_of(bare, key)
                transform = _chained(type_, sources, application, name)
                if transform is not None and by_name.setdefault(name, transform) != transform:
                    raise InputError(
                        f"{name} is not the same in two applications",
                        where=sources[variable.source].where(element.line),
                        cure="Correct the applications one by one.",
                    )
    return by_name


def _chained(
    type_: Literal["frame", "tool"], sources: Sequence[Source], application: Application, name: str
) -> Transform | None:
    """Return the product of a frame or tool and its fathers."""
    variables, changed, length = application
    chain: list[Transform] = []
    seen: set[str] = set()
    while name:
        bare, _, key = name.partition("[")
        variable = variables.get(bare)
        element = variable.elements.get(key.rstrip("]") or "0") if variable is not None else None
        if variable is None or element is None or variable.type != type_ or not element.father or bare in changed:
            return None
        if name in seen:
            sources[variable.source].refuse(element.line, f"{name} is its own father")
        seen.add(name)
        chain.append(_transform(element, length))
        name = father_of(element, type_)
    product = IDENTITY
    for transform in reversed(chain):
        product = _product(product, transform)
    return product


def _transform(element: Element, length: float) -> Transform:
    numbers = np.array(element.values)
    R = MOVING_XYZ_ANGLES.matrices(np.radians(numbers[None, 3:]))[0]
    return Transform.from_matrix(R, numbers[:3] * length)


def _product(first: Transform, second: Transform) -> Transform:
    R = first.rotation
    return Transform.from_matrix(R @ second.rotation, np.array(first.translation) + R @ np.array(second.translation))
