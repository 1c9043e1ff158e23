"""What a KRL program declares: targets, the numbers of tools and bases for inline forms, and where a name is known."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from truearm.compensation.programs.krl.aggregates import Aggregate, aggregate
from truearm.compensation.programs.krl.lines import Text

#: Types of places that a robot is sent to; a frame may be one.
TARGET_TYPES: Final = frozenset({"POS", "E3POS", "E6POS", "AXIS", "E3AXIS", "E6AXIS"})
POSITION_TYPES: Final = TARGET_TYPES | {"FRAME"}
#: The tools and the bases of the controller.
TOOL_DATA: Final = "TOOL_DATA"
BASE_DATA: Final = "BASE_DATA"
#: The module whose data all programs share.
_SHARED_MODULE: Final = "$CONFIG"

#: A name, and its index or its component if there is one.
REFERENCE: Final = re.compile(r"(\$?[A-Za-z_][\w$]*+)(?:\s*+\[([^\]\n]*+)\])?+((?:\s*+\.\s*+\w++)*+)", re.ASCII)
_TYPE: Final = re.compile(
    r"(?:DECL\s++)?+((?:(?:GLOBAL|CONST)\s++)*+)(\w++)(?:\s*+\[[^\]\n]*+\])?+\s++", re.ASCII | re.IGNORECASE
)
_NEXT: Final = re.compile(r"\s*+,\s*+")
_EQUALS: Final = re.compile(r"\s*+=(?!=)\s*+")
_INDEX: Final = re.compile(r"[\d\s,]++", re.ASCII)
_MARK: Final = re.compile(r"[{}\[\](),]")
_FDAT_PART: Final = re.compile(r"\b(TOOL_NO|BASE_NO|IPO_FRAME)\s++(#?\w++)", re.ASCII | re.IGNORECASE)


@dataclass(slots=True, eq=False)
class Taught:
    """A place as it is written, and what its moves say about it."""

    source: int  #: source, place, name: where it stands and what it is called.
    place: int
    name: str
    numbers: Aggregate  #: What is written.
    type: str | None = None  #: What it is declared as; None if nowhere, or if it stands in a move.
    tool: str = ""  #: tool, frame: that its moves have.
    frame: str = ""
    #: used, by_axes, first: whether a move goes there; one that heeds Status and Turn; one before which the posture is
    #: not known.
    used: bool = False
    by_axes: bool = False
    first: bool = False
    parent: Taught | None = None  #: What it is an offset from.
    problem: str | None = None  #: Why it cannot be corrected.
    index: int = -1  #: Of the target that it becomes.

    def trouble(self) -> str | None:
        """Return why it cannot be corrected, None if it can."""
        own = self.problem or self.numbers.problem
        if own is None and self.parent is not None and self.parent.trouble() is not None:
            return "the place that it is an offset from cannot be corrected"
        return own


@dataclass(slots=True, eq=False)
class Variable:
    """A name: every value that is written for it, and whether it is computed too."""

    name: str  #: name, type: as declared; the type is None if nowhere.
    type: str | None
    module: str  #: Where it is declared.
    values: list[Taught] = field(default_factory=list)  #: In the order of the text.
    computed: int = 0  #: Number of the line in which it gets a value that is not written, 0 for none.
    offset: bool = False  #: Whether it is used as one, and so is no target.
    elements: dict[str, Variable] | None = None  #: By index, if it is a list.

    @property
    def shared(self) -> bool:
        """Whether all programs of the controller share it."""
        return self.module == _SHARED_MODULE

    @property
    def listed(self) -> list[Variable]:
        """The elements that have an index of their own."""
        return list(self.elements.values()) if self.elements else []

    def element(self, index: str) -> Variable:
        """Return an element, whether it has a value or not."""
        if self.elements is None:
            self.elements = {}
        found = self.elements.get(index)
        if found is None:
            found = Variable(f"{self.name}[{index}]", self.type, self.module)
            found.computed = self.computed
            self.elements[index] = found
        return found

    def spoil(self, line: int) -> None:
        """Note that it gets a computed value."""
        if not self.computed:
            self.computed = line
            for element in self.listed:
                element.spoil(line)


@dataclass(frozen=True, slots=True)
class FrameData:
    """Tool and base of a move (FDAT), None if not known, and whether the tool is stationary."""

    tool: str | None = None
    base: str | None = None
    stationary: bool = False

    @classmethod
    def read(cls, flat: str, begin: int, end: int) -> FrameData:
        """Read what stands between curly brackets."""
        parts = {part[1].upper(): part[2].upper() for part in _FDAT_PART.finditer(flat, begin, end)}
        tool, base = number_of(parts.get("TOOL_NO", "")), number_of(parts.get("BASE_NO", ""))
        return cls(tool, base, parts.get("IPO_FRAME") == "#TCP")


Assigned = tuple[Variable, Taught | None]


class Names:
    """All names of a program, by where they are known: a routine, a module, or everywhere."""

    def __init__(self) -> None:
        self._variables: dict[tuple[str, str], Variable] = {}
        self._frame_data: dict[tuple[str, str], FrameData] = {}

    @property
    def variables(self) -> list[Variable]:
        """All names and all elements of lists that have an index of their own."""
        named = list(self._variables.values())
        return named + [element for variable in named for element in variable.listed]

    def find(self, name: str, scopes: Sequence[str]) -> Variable | None:
        """Return what a name means where `scopes` are known, the nearest first."""
        for scope in scopes:
            found = self._variables.get((scope, name))
            if found is not None:
                return found
        return None

    def find_frame_data(self, name: str, scopes: Sequence[str]) -> FrameData | None:
        """Return what an FDAT says, None if there is none of the name."""
        for scope in scopes:
            found = self._frame_data.get((scope, name))
            if found is not None:
                return found
        return None

    def declare(self, text: Text, start: int, stop: int, scopes: Sequence[str]) -> None:
        """Note what a declaration declares; it is known in the first of `scopes`, or everywhere if it says so."""
        flat = text.flat
        head = _TYPE.match(flat, start, stop)
        if head is None:
            return
        kind = head[2].upper()
        scope = "" if "GLOBAL" in head[1].upper() or text.module == _SHARED_MODULE else scopes[0]
        at = head.end()
        while kind == "FDAT" or kind in POSITION_TYPES:
            name = REFERENCE.match(flat, at, stop)
            if name is None:
                return
            key = scope, name[1].upper()
            at = name.end()
            equals = _EQUALS.match(flat, at, stop)
            if equals is None:
                begin = end = at
            else:
                begin = equals.end()
                end = closing(flat, begin, stop)
            at = end
            if kind == "FDAT":
                self._frame_data[key] = FrameData.read(flat, begin, end)
            else:
                variable = self._variables[key] = Variable(name[1], kind, text.module)
                if begin != end:
                    self.assign(text, name.start(), variable, begin, end)
            following = _NEXT.match(flat, at, stop) if at < stop else None
            if following is None:
                return
            at = following.end()

    def assign(self, text: Text, place: int, variable: Variable, begin: int, end: int) -> Taught | None:
        """Note the value that a name gets, and return it if it is written out."""
        flat = text.flat
        if flat[begin : begin + 1] != "{" or flat[end - 1] != "}":
            variable.spoil(text.line(place))
            return None
        taught = Taught(text.index, place, variable.name, aggregate(text, begin, end), variable.type)
        variable.values.append(taught)
        return taught

    def assigned(self, text: Text, start: int, stop: int, scopes: Sequence[str]) -> Assigned | None:
        """Note an assignment, and return what got a value and which; None if it is no place of the robot."""
        flat = text.flat
        name = REFERENCE.match(flat, start, stop)
        equals = name and _EQUALS.match(flat, name.end(), stop)
        if not name or not equals:
            return None
        key = name[1].upper()
        variable = self.find(key, scopes)
        if variable is None:
            for scope in scopes:
                if (scope, key) in self._frame_data:
                    self._frame_data[scope, key] = FrameData()
                    return None
            common = key in (TOOL_DATA, BASE_DATA)
            if not common and (name[3] or flat[equals.end() : equals.end() + 1] != "{"):
                return None
            scope = "" if common else text.module
            variable = self._variables[scope, key] = Variable(name[1], None, text.module)
        if name[2] is not None:
            index = literal_index(name[2])
            if index is None:
                variable.spoil(text.line(start))
                return variable, None
            variable = variable.element(index)
        if name[3]:
            variable.spoil(text.line(start))
            return variable, None
        begin = equals.end()
        return variable, self.assign(text, start, variable, begin, stop)


def literal_index(written: str) -> str | None:
    """Return an index as it is written in numbers, without white space; None if it is computed."""
    return "".join(written.split()) if _INDEX.fullmatch(written) else None


def number_of(written: str) -> str | None:
    """Return the name of the tool or the base of a number, None if it is not one; 0 is the flange or the world."""
    if not (written.isascii() and written.isdigit()):
        return None
    return written.lstrip("0")


def closing(flat: str, begin: int, stop: int) -> int:
    """Return where a value ends: after the bracket that closes it, or at the comma that follows."""
    if flat[begin : begin + 1] == "{":
        end = flat.find("}", begin, stop)
        if flat.find("{", begin + 1, end) < 0 <= end:
            return end + 1
    depth = 0
    for mark in _MARK.finditer(flat, begin, stop):
        if mark[0] in "{[(":
            depth += 1
        elif mark[0] != ",":
            depth -= 1
            if depth == 0 and mark[0] == "}":
                return mark.end()
        elif depth <= 0:
            return mark.start()
    return stop
