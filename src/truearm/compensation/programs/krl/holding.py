"""The tool and the base that hold where a KRL program moves: ``$TOOL``, ``$BASE``, ``FDAT_ACT``, ``BAS`` and ``WITH``.

What ``BAS`` does is written in the controller's own bas.src: ``INITMOV`` takes base 0 and tool 1.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.compensation.programs.krl.aggregates import POSE, Aggregate, aggregate
from truearm.compensation.programs.krl.lines import Statement, Text, short
from truearm.compensation.programs.krl.names import (
    BASE_DATA,
    REFERENCE,
    TOOL_DATA,
    FrameData,
    Names,
    Variable,
    closing,
    literal_index,
    number_of,
)
from truearm.modeling.orientations import ZYX_ANGLES
from truearm.modeling.transform import Transform

#: Words of statements that set the tool or the base.
SETTERS: Final = frozenset({"$TOOL", "$BASE", "$IPO_MODE", "FDAT_ACT", "BAS"})
_EQUALS: Final = re.compile(r"\s*+=\s*+")
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
        for data, found in ((TOOL_DATA, self.tools), (BASE_DATA, self.bases)):
            listed = names.find(data, ("",))
            for index, variable in listed.elements.items() if listed and listed.elements else ():
                numbers = _single(variable)
                if numbers is not None:
                    found[index] = transform(numbers)

    def set_by(self, text: Text, statement: Statement, scopes: Sequence[str]) -> Holding:
        """Return what a statement sets; its word is one of :data:`SETTERS`."""
        flat = text.flat
        word, _, after, stop = statement
        if word == "BAS":
            return self._bas(text, after, stop)
        equals = _EQUALS.match(flat, after, stop)
        if equals is None:  # of a component, such as $TOOL.X
            unknown = Setting(problem=f"{word} is changed in part")
            both = word == "FDAT_ACT"
            return Holding(
                unknown if both or word == "$TOOL" else None,
                unknown if both or word == "$BASE" else None,
            )
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
        found = self._names.find_frame_data(f"F{name[1:].upper()}", scopes) if name[:1] in "Xx" else None
        return self._of(found) if found else None

    def _assigned(self, text: Text, what: str, begin: int, end: int, scopes: Sequence[str]) -> Holding:
        written = text.flat[begin:end].strip()
        by_data = _FROM_FRAME_DATA.fullmatch(written)
        if by_data:
            found = self._by_frame_data(by_data[1], scopes)
            if what == "$IPO_MODE":
                return Holding(stationary=found.stationary)
            return Holding(tool=found.tool) if what == "$TOOL" else Holding(base=found.base)
        if what == "$IPO_MODE":
            return Holding(stationary=written.upper() != "#BASE")
        if what == "$TOOL":
            return Holding(tool=self._frame(text, TOOL_DATA, begin, end, scopes))
        return Holding(base=self._frame(text, BASE_DATA, begin, end, scopes))

    def _by_frame_data(self, written: str, scopes: Sequence[str]) -> Holding:
        name = written.strip()
        found = self._names.find_frame_data(name.upper(), scopes)
        if found is None:
            unknown = Setting(problem=f"{short(name)}, which gives its tool and base, is not declared in this program")
            return Holding(unknown, unknown, False)
        return self._of(found)

    def _of(self, data: FrameData) -> Holding:
        found = self._by_data.get(data)
        if found is None:
            tool, base = self._numbered(TOOL_DATA, data.tool), self._numbered(BASE_DATA, data.base)
            found = self._by_data[data] = Holding(tool, base, data.stationary)
        return found

    def _frame(self, text: Text, data: str, begin: int, end: int, scopes: Sequence[str]) -> Setting:
        what, found = ("tool", self.tools) if data == TOOL_DATA else ("base", self.bases)
        computed = Setting(problem=f"the {what} is computed")
        flat = text.flat
        if flat[begin : begin + 1] == "{" and closing(flat, begin, end) == end:
            numbers = aggregate(text, begin, end)
            if numbers.form is not POSE or numbers.problem:
                return computed
            values = ",".join(f"{name} {value:.10g}" for name, value in zip("XYZABC", numbers.values, strict=True))
            name = f"${what.upper()}={{{values}}}"
            found[name] = transform(numbers)
            return Setting(name)
        reference = REFERENCE.fullmatch(flat, begin, end)
        if reference is None or reference[3]:
            return _MOVED if _EXTERNAL.match(flat, begin, end) else computed
        key, index = reference[1].upper(), reference[2]
        if index is None and key in _OWN and (what == "base" or key == "$NULLFRAME"):
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
        found[variable.name] = transform(numbers_or_none)
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
        what = "tool" if data == TOOL_DATA else "base"
        listed = self._names.find(data, ("",))
        element = listed.elements.get(name) if listed and listed.elements and name else None
        if name is None or (element is not None and _single(element) is None):
            return Setting(problem=f"the {what} is computed")
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
