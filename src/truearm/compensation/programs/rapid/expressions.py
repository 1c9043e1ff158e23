"""The words that name targets in a RAPID program, and where the numbers behind them are."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import prod
from typing import Final, NamedTuple

from truearm.compensation.programs.program import ANY_POSTURE, Configuration, Form
from truearm.compensation.programs.rapid.arguments import Arguments, arguments_of, trimmed
from truearm.compensation.programs.rapid.data import (
    JOINTTARGET,
    JOINTTARGET_TEXT,
    NUMBER_TEXT,
    OFFS,
    RELTOOL,
    ROBTARGET,
    ROBTARGET_TEXT,
    absent,
    configuration,
    external_axis_moved,
    why_no_target,
)
from truearm.compensation.programs.rapid.frames import Use
from truearm.compensation.programs.rapid.listing import Datum, Instruction, Listing

TARGET_TEXTS: Final = {"robtarget": ROBTARGET_TEXT, "jointtarget": JOINTTARGET_TEXT}
_REFERENCE: Final = re.compile(r"([^\W\d]\w*+)\s*+(?:\{([^{}]*+)\})?+")
_CALL: Final = re.compile(r"(Offs|RelTool)\s*+\(", re.I)
_WHOLE: Final = re.compile(r"\s*+\d++\s*+(?:,\s*+\d++\s*+)*+")
#: Offsets of offsets are followed so deep.
_DEEPEST: Final = 4

Span = tuple[int, int]


@dataclass(slots=True, eq=False)
class Candidate:
    """What may become a target: its numbers, the tool and frame that it is used with, and what speaks against it."""

    source: int
    place: int
    name: str
    form: Form
    values: tuple[float, ...] = ()
    places: tuple[Span | None, ...] = ()
    configuration: Configuration = ANY_POSTURE
    parent: Candidate | None = None
    use: Use | None = None
    reason: str | None = None
    used: bool = False
    empty: bool = False
    index: int = -1


class Found(NamedTuple):
    """What an expression for a target means: one target or any of several, and whether it is no more than that."""

    candidates: list[Candidate]
    exact: bool


class Expressions:
    """The targets that a program declares and writes out, and what its expressions for targets mean.

    Attributes:
        candidates: All of them, each after the one that it is an offset from.
        elements: Those that are declared, one a datum or one an element of an array.
    """

    def __init__(self, listing: Listing) -> None:
        self.listing = listing
        self.candidates: list[Candidate] = []
        self.elements: dict[Datum, list[Candidate]] = {}
        self._names: dict[Datum, dict[str, Candidate]] = {}

    def declare(self, datum: Datum) -> None:
        """Take a robtarget or jointtarget, or an array of them, that is declared."""
        code, pattern = self.listing.codes[datum.source], TARGET_TEXTS[datum.type]
        if datum.size is None:
            found = pattern.fullmatch(code, *trimmed(code, datum.start, datum.stop))
            made = [self._written_out(datum.source, found, datum, datum.name)]
        else:
            made = self._array(datum, pattern)
        self.elements[datum] = made
        for candidate in made:
            candidate.empty = datum.start == datum.stop
            if datum.twice:
                candidate.reason = "is declared more than once"
            elif datum.written:
                candidate.reason = f"gets its numbers while the program runs, in line {datum.written}"
            elif candidate.empty:
                candidate.reason = "has no numbers in the program"
            elif not candidate.values:
                candidate.reason = why_no_target(code[datum.start : datum.stop])

    def _array(self, datum: Datum, pattern: re.Pattern[str]) -> list[Candidate]:
        code = self.listing.codes[datum.source]
        made: list[Candidate] = []
        sizes = _sizes(datum.size or "")
        rest = datum.start
        for found in pattern.finditer(code, datum.start, datum.stop):
            if code[rest : found.start()].strip(" \t\r\n[],"):
                break
            rest = found.end()
            index = _index_name(len(made), sizes)
            made.append(self._written_out(datum.source, found, datum, f"{datum.name}{{{index}}}"))
        if made and (sizes is None or len(made) == prod(sizes)) and not code[rest : datum.stop].strip(" \t\r\n]"):
            return made
        del self.candidates[len(self.candidates) - len(made) :]
        return [self._written_out(datum.source, None, datum, datum.name)]

    def _written_out(
        self, source: int, found: re.Match[str] | None, datum: Datum | None, name: str, joints: bool = False
    ) -> Candidate:
        joints = datum.type == "jointtarget" if datum else joints
        form, count = (JOINTTARGET, 6) if joints else (ROBTARGET, 7)
        if found is None:
            candidate = Candidate(source, datum.place if datum else 0, name, form)
        else:
            groups = found.groups()
            values = tuple(map(float, groups[:count]))
            posture = ANY_POSTURE if joints else configuration(*groups[7:])
            place = datum.place if datum and datum.size is None else found.start(1)
            candidate = Candidate(source, place, name, form, values, found.regs[1 : count + 1], posture)
            if joints and absent(values):
                candidate.reason = "does not say where all joints of the robot are (9E9)"
            elif not joints and external_axis_moved(found[0]):
                candidate.reason = "has an external axis that is not at zero, and may carry the robot or move the work"
        self.candidates.append(candidate)
        return candidate

    def target(self, at: Instruction, text: Span, joints: bool, depth: int = 0) -> Found | str:
        """Return what the words for a target mean, or why they mean none that can be corrected."""
        code, (start, stop) = self.listing.codes[at.source], text
        if code.startswith("[", start, stop):
            found = (JOINTTARGET_TEXT if joints else ROBTARGET_TEXT).fullmatch(code, start, stop)
            if found is None:
                return why_no_target(code[start:stop])
            return Found([self._written_out(at.source, found, None, "", joints)], True)
        reference = _REFERENCE.fullmatch(code, start, stop)
        if reference is not None:
            return self._reference(at, reference, "jointtarget" if joints else "robtarget")
        call = _CALL.match(code, start, stop)
        if call is None or joints or depth == _DEEPEST or code[stop - 1] != ")":
            return "is not written in the text" if code[start:stop] == "*" else "is computed"
        if call[1].lower() in self.listing.routines:
            return "is computed"
        return self._offset(at, call, stop, depth)

    def _reference(self, at: Instruction, reference: re.Match[str], type: str) -> Found | str:
        name, index = reference.groups()
        datum = self.listing.find(name, at)
        if datum is None:
            return f"is not declared in this program: {name}"
        if datum.parameter:
            return f"is a parameter of the routine: {name}"
        if datum.type != type:
            return f"is no {type}: {name}"
        elements = self.elements[datum]
        if (index is None) != (datum.size is None):
            return f"is not understood: {name} is {'no' if datum.size is None else 'an'} array"
        if index is None or (len(elements) == 1 and elements[0].name == datum.name):
            return Found(elements, True)
        if _WHOLE.fullmatch(index) is None:
            return Found(elements, False)
        wanted = f"{datum.name}{{{','.join(str(int(part.strip()[-9:])) for part in index.split(','))}}}"
        chosen = [element for element in (self._by_name(datum, elements).get(wanted),) if element is not None]
        return Found(chosen, True) if chosen else f"is not declared in this program: {wanted}"

    def _by_name(self, datum: Datum, elements: list[Candidate]) -> dict[str, Candidate]:
        if datum not in self._names:
            self._names[datum] = {element.name: element for element in elements}
        return self._names[datum]

    def _offset(self, at: Instruction, call: re.Match[str], stop: int, depth: int) -> Found | str:
        code = self.listing.codes[at.source]
        arguments = arguments_of(code, call.end(), stop - 1)
        turned = call[1].lower() == "reltool"
        if len(arguments.needed) != 4:
            return "is computed"
        inner = self.target(at, arguments.needed[0], False, depth + 1)
        if isinstance(inner, str):
            return inner
        parent = only(inner)
        numbers = self._literals(at.source, arguments, turned)
        if parent is None or not inner.exact or numbers is None:
            return Found(inner.candidates, False)
        values, places = numbers
        form = RELTOOL if turned else OFFS
        candidate = Candidate(at.source, arguments.needed[1][0], "", form, values, places, parent=parent)
        self.candidates.append(candidate)
        return Found([candidate], True)

    def _literals(
        self, source: int, arguments: Arguments, turned: bool
    ) -> tuple[tuple[float, ...], tuple[Span | None, ...]] | None:
        """Return the numbers of an offset and their places, None if one is no number."""
        code = self.listing.codes[source]
        spans: list[Span | None] = list(arguments.needed[1:])
        if turned:
            spans += [arguments.options.get(name) for name in ("rx", "ry", "rz")]
        if any(span is not None and NUMBER_TEXT.fullmatch(code, *span) is None for span in spans):
            return None
        return tuple(float(code[span[0] : span[1]]) if span else 0.0 for span in spans), tuple(spans)


def only(found: Found | None) -> Candidate | None:
    """Return the target that was found if it can be no other."""
    return found.candidates[0] if found is not None and len(found.candidates) == 1 else None


def _sizes(text: str) -> tuple[int, ...] | None:
    """Return the sizes of an array, None if they are names."""
    return tuple(int(part.strip()[-9:]) for part in text.split(",")) if _WHOLE.fullmatch(text) else None


def _index_name(place: int, sizes: tuple[int, ...] | None) -> str:
    parts = []
    for size in reversed((sizes or (0,))[1:]):
        place, index = divmod(place, max(size, 1))
        parts.append(index + 1)
    return ",".join(str(part) for part in [place + 1, *reversed(parts)])
