"""What a KRL program declares, and tool and base of its moves: ``$TOOL``, ``$BASE``, ``FDAT_ACT``, ``BAS``, ``WITH``.

What ``BAS`` does is written in the controller's own bas.src: ``INITMOV`` takes base 0 and tool 1.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from truearm.engine.programs.krl.lines import POSE, Aggregate, Statement, Text, aggregate, short
from truearm.engine.robot.transform import ZYX_ANGLES, Transform

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
        variable = self.elements.get(index)
        if variable is None:
            variable = Variable(f"{self.name}[{index}]", self.type, self.module)
            variable.computed = self.computed
            self.elements[index] = variable
        return variable

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
            variable = self._variables.get((scope, name))
            if variable is not None:
                return variable
        return None

    def find_frame_data(self, name: str, scopes: Sequence[str]) -> FrameData | None:
        """Return what an FDAT says, None if there is none of the name."""
        for scope in scopes:
            frame_data = self._frame_data.get((scope, name))
            if frame_data is not None:
                return frame_data
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


#: Words of statements that set the tool or the base.
SETTERS: Final = frozenset({"$TOOL", "$BASE", "$IPO_MODE", "FDAT_ACT", "BAS"})
_EQUALS_HOLDING: Final = re.compile(r"\s*+=\s*+")
_BAS: Final = re.compile(r"\s*+\(\s*+#\s*+(\w++)\s*+(?:,\s*+([^()]*+))?+\)", re.ASCII)
_FROM_FRAME_DATA: Final = re.compile(
    r"(?:STOOL2?|SBASE|SIPO_MODE)\s*+\(\s*+(\$?\w++)(?:\s*+\.\s*+(?:TOOL_NO|BASE_NO|IPO_FRAME))?+\s*+\)",
    re.ASCII | re.IGNORECASE,
)
_WITH_PART: Final = re.compile(r"(\$TOOL|\$BASE|\$IPO_MODE)\s*+=\s*+", re.ASCII | re.IGNORECASE)
#: How a move goes over into the next, at its end.
_BLENDING: Final = re.compile(r"(?<!\s)(?:\s++C_\w++)++\Z", re.ASCII | re.IGNORECASE)
_EXTERNAL: Final = re.compile(r"(?:EK|EB|EB_ABS|LK)\s*+\(", re.ASCII | re.IGNORECASE)
_OWN: Final = frozenset({"$NULLFRAME", "$WORLD", "$ROBROOT"})


@dataclass(frozen=True, slots=True)
class Setting:
    """The tool or the base that holds."""

    name: str = ""  #: Its name, empty for the flange or the robot's own base.
    problem: str | None = None  #: Why it is not known, None if it is.
    default: bool = False  #: Whether it is only what a program starts with.


@dataclass(frozen=True, slots=True)
class Holding:
    """What holds at a move: tool, base, and whether the tool stands still and the robot holds the work.

    In what a routine leaves behind, None is what it does not set.
    """

    tool: Setting | None = None
    base: Setting | None = None
    stationary: bool | None = None

    def then(self, later: Holding) -> Holding:
        """Return what holds after something else was set."""
        if later.tool and later.base and later.stationary is not None:
            return later
        stationary = self.stationary if later.stationary is None else later.stationary
        return Holding(later.tool or self.tool, later.base or self.base, stationary)

    def after_stranger(self, name: str) -> Holding:
        """Return what holds after a routine of another program was called."""
        problem = f"{short(name)}, which is not in this program, may set the %s"
        tool, base = self.tool, self.base
        if tool is not None and tool.default:
            tool = Setting(problem=problem % "tool")
        if base is not None and base.default:
            base = Setting(problem=problem % "base")
        return replace(self, tool=tool, base=base)

    @property
    def problem(self) -> str | None:
        """Why places cannot be corrected here."""
        if self.stationary:
            return "the tool stands still and the robot holds the work (#TCP)"
        problems = [setting.problem for setting in (self.tool, self.base) if setting is not None and setting.problem]
        return problems[0] if problems else None


#: Base on an external axis, a conveyor or another robot.
_MOVED: Final = Setting(problem="the base is moved by an external axis")
_START: Final = Holding(Setting("1", default=True), Setting("", default=True), False)


class Frames:
    """Finds what statements set, and keeps the tools and the bases that the program defines."""

    def __init__(self, names: Names) -> None:
        self._names = names
        self._by_data: dict[FrameData, Holding] = {}
        self.tools: dict[str, Transform] = {}
        self.bases: dict[str, Transform] = {}
        for data, transforms in ((TOOL_DATA, self.tools), (BASE_DATA, self.bases)):
            listed = names.find(data, ("",))
            for index, variable in listed.elements.items() if listed and listed.elements else ():
                numbers = _single(variable)
                if numbers is not None:
                    transforms[index] = transform(numbers)

    def set_by(self, text: Text, statement: Statement, scopes: Sequence[str]) -> Holding:
        """Return what a statement sets; its word is one of :data:`SETTERS`."""
        flat = text.flat
        word, _, after, stop = statement
        if word == "BAS":
            return self._bas(text, after, stop)
        equals = _EQUALS_HOLDING.match(flat, after, stop)
        if equals is None:  # of a component, such as $TOOL.X
            unknown = Setting(problem=f"{word} is changed in part")
            both = word == "FDAT_ACT"
            return Holding(unknown if both or word == "$TOOL" else None, unknown if both or word == "$BASE" else None)
        if word != "FDAT_ACT":
            return self._assigned(text, word, equals.end(), stop, scopes)
        if flat[equals.end() : equals.end() + 1] == "{":
            return self._of(FrameData.read(flat, equals.end(), stop))
        return self._by_frame_data(flat[equals.end() : stop], scopes)

    def set_with(self, text: Text, begin: int, stop: int, scopes: Sequence[str]) -> Holding:
        """Return what a WITH sets for one move or one spline."""
        holding = Holding()
        blending = _BLENDING.search(text.flat, begin, stop)
        stop = blending.start() if blending else stop
        part = _WITH_PART.search(text.flat, begin, stop)
        while part is not None:
            end = closing(text.flat, part.end(), stop)
            holding = holding.then(self._assigned(text, part[1].upper(), part.end(), end, scopes))
            part = _WITH_PART.search(text.flat, end, stop)
        return holding

    def of_inline_form(self, name: str, scopes: Sequence[str]) -> Holding | None:
        """Return what an inline form sets for its place; with XP1 goes FP1. None if there is no such FDAT."""
        frame_data = self._names.find_frame_data(f"F{name[1:].upper()}", scopes) if name[:1] in "Xx" else None
        return self._of(frame_data) if frame_data else None

    def _assigned(self, text: Text, variable: str, begin: int, end: int, scopes: Sequence[str]) -> Holding:
        written = text.flat[begin:end].strip()
        by_data = _FROM_FRAME_DATA.fullmatch(written)
        if by_data:
            holding = self._by_frame_data(by_data[1], scopes)
            if variable == "$IPO_MODE":
                return Holding(stationary=holding.stationary)
            return Holding(tool=holding.tool) if variable == "$TOOL" else Holding(base=holding.base)
        if variable == "$IPO_MODE":
            return Holding(stationary=written.upper() != "#BASE")
        if variable == "$TOOL":
            return Holding(tool=self._frame(text, TOOL_DATA, begin, end, scopes))
        return Holding(base=self._frame(text, BASE_DATA, begin, end, scopes))

    def _by_frame_data(self, written: str, scopes: Sequence[str]) -> Holding:
        name = written.strip()
        frame_data = self._names.find_frame_data(name.upper(), scopes)
        if frame_data is None:
            unknown = Setting(problem=f"{short(name)}, which gives its tool and base, is not declared in this program")
            return Holding(unknown, unknown, False)
        return self._of(frame_data)

    def _of(self, data: FrameData) -> Holding:
        holding = self._by_data.get(data)
        if holding is None:
            tool, base = self._numbered(TOOL_DATA, data.tool), self._numbered(BASE_DATA, data.base)
            holding = self._by_data[data] = Holding(tool, base, data.stationary)
        return holding

    def _frame(self, text: Text, data: str, begin: int, end: int, scopes: Sequence[str]) -> Setting:
        kind, transforms = ("tool", self.tools) if data == TOOL_DATA else ("base", self.bases)
        computed = Setting(problem=f"the {kind} is computed")
        flat = text.flat
        if flat[begin : begin + 1] == "{" and closing(flat, begin, end) == end:
            numbers = aggregate(text, begin, end)
            if numbers.form is not POSE or numbers.problem:
                return computed
            values = ",".join(f"{name} {value:.10g}" for name, value in zip("XYZABC", numbers.values, strict=True))
            name = f"${kind.upper()}={{{values}}}"
            transforms[name] = transform(numbers)
            return Setting(name)
        reference = REFERENCE.fullmatch(flat, begin, end)
        if reference is None or reference[3]:
            return _MOVED if _EXTERNAL.match(flat, begin, end) else computed
        key, index = reference[1].upper(), reference[2]
        if index is None and key in _OWN and (kind == "base" or key == "$NULLFRAME"):
            return Setting()
        if index is not None:
            number = number_of(literal_index(index) or "") if key == data else None
            return self._numbered(data, number) if number else computed
        if key.startswith("$"):
            return computed
        variable = self._names.find(key, scopes)
        if variable is None:
            return Setting(reference[1])
        numbers_or_none = _single(variable)
        if numbers_or_none is None:
            return computed
        transforms[variable.name] = transform(numbers_or_none)
        return Setting(variable.name)

    def _bas(self, text: Text, after: int, stop: int) -> Holding:
        call = _BAS.match(text.flat, after, stop)
        command = call[1].upper() if call else ""
        if command == "INITMOV":
            return _START
        if command not in ("TOOL", "BASE", "EX_BASE"):
            return Holding()
        name = number_of((call[2] or "").strip()) if call else None
        if command == "TOOL":
            return Holding(tool=self._numbered(TOOL_DATA, name))
        if command == "EX_BASE":
            return Holding(base=_MOVED)
        return Holding(base=self._numbered(BASE_DATA, name))

    def _numbered(self, data: str, name: str | None) -> Setting:
        kind = "tool" if data == TOOL_DATA else "base"
        listed = self._names.find(data, ("",))
        element = listed.elements.get(name) if listed and listed.elements and name else None
        if name is None or (element is not None and _single(element) is None):
            return Setting(problem=f"the {kind} is computed")
        return Setting(name)


def _single(variable: Variable) -> Aggregate | None:
    """Return the one place that a name stands for, None if it gets others or is computed."""
    if variable.computed or len(variable.values) != 1:
        return None
    numbers = variable.values[0].numbers
    return numbers if numbers.form is POSE and numbers.problem is None else None


def transform(numbers: Aggregate) -> Transform:
    """Return a frame as a transform."""
    values = np.array([numbers.values])
    matrix = ZYX_ANGLES.matrices(values[:, 3:] * POSE.angle)[0]
    return Transform.from_matrix(matrix, values[0, :3] * POSE.length)
