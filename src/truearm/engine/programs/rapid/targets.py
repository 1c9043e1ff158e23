"""The targets of a RAPID program: where their numbers are, and which tool and work object they are used with."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import prod
from typing import Final, NamedTuple

from truearm.engine.programs.program import ANY_POSTURE, Configuration, Form, Move, Program, ProgramTarget, Skipped
from truearm.engine.programs.rapid.data import (
    DISPLACING,
    JOINTTARGET,
    JOINTTARGET_TEXT,
    MOTIONS,
    NUMBER_TEXT,
    OFFS,
    RELTOOL,
    ROBTARGET,
    ROBTARGET_TEXT,
    Motion,
    RefusedPoseError,
    absent,
    configuration,
    external_axis_moved,
    frame_of,
    load_of,
    tool_of,
    why_no_target,
    wrong_number,
)
from truearm.engine.programs.rapid.syntax import Arguments, Datum, Instruction, Listing, arguments_of, trimmed
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.transform import Transform

_IDENTIFIER: Final = re.compile(r"[^\W\d]\w*+")

Use = tuple[str, str]
Reader = Callable[[str, int, int], tuple[Transform | None, str | None]]


class _Kind:
    """Tools, or work objects."""

    def __init__(self, listing: Listing, type: str, plain: str, predefined: str, reader: Reader) -> None:
        self.listing, self.type, self.plain, self.predefined, self.reader = listing, type, plain, predefined, reader
        self.declared: dict[str, list[Datum]] = {}
        for datum in listing.data:
            if datum.type == type:
                self.declared.setdefault(datum.name.lower(), []).append(datum)
        self.spelling: dict[str, str] = {}

    def named(self, at: Instruction, text: str) -> tuple[str, str | None]:
        """Return the name that a move's word means, and why targets with it are left as they are."""
        if _IDENTIFIER.fullmatch(text) is None:
            return "", f"is used with a {self.plain} that is computed"
        datum = self.listing.find(text, at)
        folded = text.lower()
        if folded == self.predefined and (datum is None or (datum.type == self.type and not datum.parameter)):
            return "", None  # the module BASE of every controller declares it
        if datum is None:
            return self.spelling.setdefault(folded, text), None
        if datum.parameter:
            return "", f"is used with a {self.plain} that is a parameter of the routine: {text}"
        if datum.type != self.type:
            return "", f"is used with {text}, which is no {self.plain}"
        if len(self.declared[datum.name.lower()]) > 1:
            return "", f"is used with the {self.plain} {text}, which is declared more than once"
        try:
            _, against = self._read(datum)
        except RefusedPoseError as error:
            raise self.listing.refusal(datum.source, datum.place, error.what, error.came, error.allowed) from None
        return datum.name, against and f"is used with the {self.plain} {text}, which {against}"

    def _read(self, datum: Datum) -> tuple[Transform | None, str | None]:
        return self.reader(self.listing.codes[datum.source], datum.start, datum.stop)

    def unchanged(self) -> Iterator[Datum]:
        """Go through those that the program defines once and does not change."""
        return (data[0] for data in self.declared.values() if len(data) == 1 and not data[0].written)

    def defined(self) -> dict[str, Transform]:
        """Return those that the program defines and does not change, by name."""
        frames: dict[str, Transform] = {}
        for datum in self.unchanged():
            try:
                transform, _ = self._read(datum)
            except RefusedPoseError:  # of one that no move uses: those that are used are refused before
                continue
            if transform is not None:
                frames[datum.name] = transform
        return frames


class Frames:
    """The tools and work objects of a program."""

    def __init__(self, listing: Listing) -> None:
        self._tools = _Kind(listing, "tooldata", "tool", "tool0", tool_of)
        self._frames = _Kind(listing, "wobjdata", "work object", "wobj0", frame_of)
        self._known: dict[tuple[str, str | None, int, int], tuple[Use, str | None]] = {}

    def use(self, at: Instruction, tool: str, frame: str | None) -> tuple[Use, str | None]:
        """Return the tool and work object that a move's words for them mean, and why its targets are left as they are.

        Args:
            frame: None for a move without one.
        """
        key = (tool, frame, id(at.routine), id(at.module))
        known = self._known.get(key)
        if known is None:
            named, against = self._tools.named(at, tool)
            framed, against_frame = ("", None) if frame is None else self._frames.named(at, frame)
            known = self._known[key] = ((named, framed), against or against_frame)
        return known

    def defined(self) -> tuple[dict[str, Transform], dict[str, Transform]]:
        """Return the tools and the frames that the program defines, by name."""
        return self._tools.defined(), self._frames.defined()

    def loads(self) -> dict[str, Payload]:
        """Return what the robot carries with each tool, by name, where the program says it."""
        codes = self._tools.listing.codes
        loads = {datum.name: load_of(codes[datum.source], datum.start, datum.stop) for datum in self._tools.unchanged()}
        return {name: load for name, load in loads.items() if load is not None}


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


class Meaning(NamedTuple):
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
            match = pattern.fullmatch(code, *trimmed(code, datum.start, datum.stop))
            candidates = [self._written_out(datum.source, match, datum, datum.name)]
        else:
            candidates = self._array(datum, pattern)
        self.elements[datum] = candidates
        for candidate in candidates:
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
        items: list[Candidate] = []
        sizes = _sizes(datum.size or "")
        end = datum.start
        for match in pattern.finditer(code, datum.start, datum.stop):
            if code[end : match.start()].strip(" \t\r\n[],"):
                break
            end = match.end()
            index = _index_name(len(items), sizes)
            items.append(self._written_out(datum.source, match, datum, f"{datum.name}{{{index}}}"))
        if items and (sizes is None or len(items) == prod(sizes)) and not code[end : datum.stop].strip(" \t\r\n]"):
            return items
        del self.candidates[len(self.candidates) - len(items) :]
        return [self._written_out(datum.source, None, datum, datum.name)]

    def _written_out(
        self, source: int, match: re.Match[str] | None, datum: Datum | None, name: str, joints: bool = False
    ) -> Candidate:
        joints = datum.type == "jointtarget" if datum else joints
        form, count = (JOINTTARGET, 6) if joints else (ROBTARGET, 7)
        if match is None:
            candidate = Candidate(source, datum.place if datum else 0, name, form)
        else:
            groups = match.groups()
            values = tuple(map(float, groups[:count]))
            posture = ANY_POSTURE if joints else configuration(*groups[7:])
            place = datum.place if datum and datum.size is None else match.start(1)
            candidate = Candidate(source, place, name, form, values, match.regs[1 : count + 1], posture)
            if joints and absent(values):
                candidate.reason = "does not say where all joints of the robot are (9E9)"
            elif not joints and external_axis_moved(match[0]):
                candidate.reason = "has an external axis that is not at zero, and may carry the robot or move the work"
        self.candidates.append(candidate)
        return candidate

    def target(self, at: Instruction, text: Span, joints: bool, depth: int = 0) -> Meaning | str:
        """Return what the words for a target mean, or why they mean none that can be corrected."""
        code, (start, stop) = self.listing.codes[at.source], text
        if code.startswith("[", start, stop):
            match = (JOINTTARGET_TEXT if joints else ROBTARGET_TEXT).fullmatch(code, start, stop)
            if match is None:
                return why_no_target(code[start:stop])
            return Meaning([self._written_out(at.source, match, None, "", joints)], True)
        reference = _REFERENCE.fullmatch(code, start, stop)
        if reference is not None:
            return self._reference(at, reference, "jointtarget" if joints else "robtarget")
        call = _CALL.match(code, start, stop)
        if call is None or joints or depth == _DEEPEST or code[stop - 1] != ")":
            return "is not written in the text" if code[start:stop] == "*" else "is computed"
        if call[1].lower() in self.listing.routines:
            return "is computed"
        return self._offset(at, call, stop, depth)

    def _reference(self, at: Instruction, reference: re.Match[str], type: str) -> Meaning | str:
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
            return Meaning(elements, True)
        if _WHOLE.fullmatch(index) is None:
            return Meaning(elements, False)
        wanted = f"{datum.name}{{{','.join(str(int(part.strip()[-9:])) for part in index.split(','))}}}"
        chosen = [element for element in (self._by_name(datum, elements).get(wanted),) if element is not None]
        return Meaning(chosen, True) if chosen else f"is not declared in this program: {wanted}"

    def _by_name(self, datum: Datum, elements: list[Candidate]) -> dict[str, Candidate]:
        if datum not in self._names:
            self._names[datum] = {element.name: element for element in elements}
        return self._names[datum]

    def _offset(self, at: Instruction, call: re.Match[str], stop: int, depth: int) -> Meaning | str:
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
            return Meaning(inner.candidates, False)
        values, places = numbers
        form = RELTOOL if turned else OFFS
        candidate = Candidate(at.source, arguments.needed[1][0], "", form, values, places, parent=parent)
        self.candidates.append(candidate)
        return Meaning([candidate], True)

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


def only(target: Meaning | None) -> Candidate | None:
    """Return the target that was found if it can be no other."""
    return target.candidates[0] if target is not None and len(target.candidates) == 1 else None


def _sizes(text: str) -> tuple[int, ...] | None:
    """Return the sizes of an array, None if they are names."""
    return tuple(int(part.strip()[-9:]) for part in text.split(",")) if _WHOLE.fullmatch(text) else None


def _index_name(place: int, sizes: tuple[int, ...] | None) -> str:
    parts = []
    for size in reversed((sizes or (0,))[1:]):
        place, index = divmod(place, max(size, 1))
        parts.append(index + 1)
    return ",".join(str(part) for part in [place + 1, *reversed(parts)])


_NAME: Final = re.compile(r"(?<![\\.\w])[^\W\d]\w*+(?!\s*+[.(])")
#: With these a move cannot be done in several.
_WHOLE_MOVES: Final = frozenset(("t", "id", "conc", "inpos"))
#: What puts a load on the tool or changes it: an instruction, an argument of a move, a component that is assigned.
_LOADING: Final = re.compile(r"\bGripLoad\b|\\TLoad\s*:=|\.\s*tload\s*(?:\.\s*\w+\s*)?:=|\bLoadId\b", re.I)


class _Pending(NamedTuple):
    at: Instruction
    motion: Motion
    target: Candidate | None
    via: Candidate | None
    exact: bool
    target_text: Span
    via_text: Span | None
    whole: bool


class Finder:
    """Finds the targets of a program."""

    def __init__(self, listing: Listing) -> None:
        self.listing = listing
        self.frames = Frames(listing)
        self.expressions = Expressions(listing)
        self.pending: list[_Pending] = []
        self.skipped: list[Skipped] = []
        self.unknown: Counter[str] = Counter()
        self.spelling: dict[str, str] = {}
        #: Tools and frames of all moves to poses, and tools of all moves; None for one that is not known.
        self.uses: set[Use | None] = set()
        self.tools: set[str | None] = set()
        self.displaced = 0
        self._marked: set[tuple[int, Use, str | None]] = set()

    def program(self, language: str) -> Program:
        """Return what was found."""
        for datum in self.listing.data:
            if datum.type in TARGET_TEXTS:
                self.expressions.declare(datum)
            elif datum.type not in ("tooldata", "wobjdata") and datum.start < datum.stop:
                self._inside(datum.source, datum.start, datum.stop, f"{datum.name} is of type {datum.type}")
        for at in self.listing.instructions:
            folded = at.word.lower()
            own = folded in self.listing.routines
            motion = None if own else MOTIONS.get(folded)
            if motion is not None:
                self._move(at, motion)
            elif folded in DISPLACING and not own:
                self.displaced = self.displaced or self.listing.line(at.source, at.start)
            else:
                self._other(at, own)
        targets = self._targets()
        moves = self._moves()
        tools, frames = self.frames.defined()
        return Program(
            language,
            self.listing.sources,
            tuple(targets),
            tuple(moves),
            tools,
            frames,
            tuple(sorted(self.skipped, key=lambda entry: (entry.source, entry.line))),
            dict(self.unknown),
            self.frames.loads(),
            any(
                _LOADING.search(part)
                for code in self.listing.codes
                for part in code.split(";")
                if "load" in part.lower()
            ),
        )

    def _skip(self, source: int, place: int, reason: str) -> None:
        self.skipped.append(Skipped(source, self.listing.line(source, place), reason))

    def _inside(self, source: int, start: int, stop: int, reason: str) -> None:
        code = self.listing.codes[source]
        for pattern in TARGET_TEXTS.values():
            for match in pattern.finditer(code, start, stop):
                self._skip(source, match.start(), f"a target that is written out is left as it is: {reason}")

    # Instructions

    def _other(self, at: Instruction, own: bool) -> None:
        code, word = self.listing.codes[at.source], at.word
        if own:
            self._inside(at.source, at.arguments, at.stop, f"{word} is a routine of the program")
            return
        self.unknown[self.spelling.setdefault(word.lower(), word)] += 1
        self._inside(at.source, at.arguments, at.stop, f"{word} is an instruction that is not known")
        for name in _NAME.finditer(code, at.arguments, at.stop):
            datum = self.listing.find(name[0], at)
            if datum is not None:
                self._mark(
                    self.expressions.elements.get(datum, []), ("", ""), f"is used by {at.word}, which is not known"
                )

    def _move(self, at: Instruction, motion: Motion) -> None:
        code = self.listing.codes[at.source]
        arguments = arguments_of(code, at.arguments, at.stop)
        needed = arguments.needed
        if len(needed) <= max(motion.target + 1, motion.tool):
            self._skip(at.source, at.start, f"{at.word} has too few arguments")
            self.pending.append(_Pending(at, motion, None, None, False, (0, 0), None, True))
            return
        tool, frame = needed[motion.tool], None if motion.joints else arguments.options.get("wobj")
        use, against = self.frames.use(at, code[slice(*tool)], code[slice(*frame)] if frame else None)
        self.tools.add(None if against else use[0])
        if not motion.joints:
            self.uses.add(None if against else use)
        if motion.searches and len(needed) > 4:
            self._mark_computed(at, needed[1])
        target_text = needed[motion.target]
        target = self._used(at, target_text, motion.joints, use, against)
        via_text = None if motion.via is None else needed[motion.via]
        via = None if via_text is None else self._used(at, via_text, False, use, against)
        exact = target is not None and target.exact and (via_text is None or (via is not None and via.exact))
        whole = (
            not motion.splittable or at.guarded or not exact or not _WHOLE_MOVES.isdisjoint(arguments.options)
        )  # fmt: skip
        self.pending.append(
            _Pending(at, motion, only(target), only(via), exact and not motion.searches, target_text, via_text, whole)
        )

    def _mark_computed(self, at: Instruction, text: Span) -> None:
        datum = self.listing.find(self.listing.codes[at.source][slice(*text)], at)
        if datum is not None:
            line = self.listing.line(at.source, at.start)
            reason = f"gets its numbers while the program runs, in line {line}"
            self._mark(self.expressions.elements.get(datum, []), ("", ""), reason)

    def _used(self, at: Instruction, text: Span, joints: bool, use: Use, against: str | None) -> Meaning | None:
        target = self.expressions.target(at, text, joints)
        if isinstance(target, str):
            self._skip(at.source, text[0], f"the target of {at.word} {target}")
            return None
        self._mark(target.candidates, use, against)
        return target

    def _mark(self, candidates: list[Candidate], use: Use, against: str | None) -> None:
        """Note a use of targets, and of those that they are offsets from."""
        if len(candidates) > 1:  # an array, which may be long and used in many places
            mark = (id(candidates), use, against)
            if mark in self._marked:
                return
            self._marked.add(mark)
        for candidate in candidates:
            link: Candidate | None = candidate
            while link is not None:
                link.used = True
                if against is not None:
                    link.reason = link.reason or against
                elif link.use is None:
                    link.use = use
                elif link.use != use:
                    link.reason = link.reason or "is used with more than one tool or work object"
                link = link.parent

    # Results

    def _targets(self) -> list[ProgramTarget]:
        if self.displaced:
            for candidate in self.expressions.candidates:
                if candidate.form is not JOINTTARGET:
                    candidate.reason = (
                        candidate.reason or f"may be displaced by the program, which does so in line {self.displaced}"
                    )
        usable = []
        # A target comes after the one that it is an offset from.
        for candidate in self.expressions.candidates:
            if candidate.parent is not None and candidate.parent.reason is not None:
                candidate.reason = candidate.reason or "is an offset from a target that is left as it is"
            if candidate.use is None and candidate.reason is None:
                self._use_the_only(candidate)
            if candidate.reason is None:
                wrong = wrong_number(candidate.form, candidate.values)
                if wrong is not None:
                    place = next((span[0] for span in candidate.places if span), candidate.place)
                    raise self.listing.refusal(candidate.source, place, wrong[0], wrong[1], wrong[2])
                usable.append(candidate)
            elif candidate.used or not candidate.empty:
                self._skip(
                    candidate.source,
                    candidate.place,
                    f"{candidate.name or 'a target that is written out'} {candidate.reason}",
                )
        usable.sort(key=lambda target: (target.source, target.place))
        for index, candidate in enumerate(usable):
            candidate.index = index
        line = self.listing.line
        return [
            ProgramTarget(
                target.source, line(target.source, target.place), target.name, target.form, target.values,
                target.places, *(target.use or ("", "")), target.configuration,
                target.parent.index if target.parent else None, target.form is RELTOOL,
            )
            for target in usable
        ]  # fmt: skip

    def _use_the_only(self, candidate: Candidate) -> None:
        if candidate.form is JOINTTARGET and len(self.tools) == 1 and (tool := next(iter(self.tools))) is not None:
            candidate.use = (tool, "")
        elif candidate.form is ROBTARGET and len(self.uses) == 1 and (use := next(iter(self.uses))) is not None:
            candidate.use = use
        elif self.tools:
            candidate.reason = "is used by no move, and it is not known which tool and work object it is meant for"
        else:
            candidate.reason = "is used by no move of the program"

    def _moves(self) -> list[Move]:
        moves: list[Move] = []
        number, stretch, broken = -1, -1, True
        for move in self.pending:
            target, via = move.target, move.via
            if target is None or target.index < 0:
                broken = True
                continue
            if broken or (not move.exact and not move.motion.searches) or move.at.stretch != stretch:
                number += 1
            stretch, broken = move.at.stretch, not move.exact
            known_via = via is not None and via.index >= 0
            whole = move.whole or (move.motion.via is not None and not known_via) or not _plain(target)
            moves.append(
                Move(
                    move.motion.kind, target.index, move.at.source, self.listing.line(move.at.source, move.at.start),
                    via.index if via is not None and known_via else None, number,
                    (0, 0) if whole else (move.at.start, move.at.stop + 1),
                    (0, 0) if whole else move.target_text,
                    None if whole else move.via_text,
                )
            )  # fmt: skip
        return moves


def _plain(target: Candidate) -> bool:
    """Return whether other numbers can stand in a target's place without its parent's being written again."""
    return target.parent is None or (target.parent.name != "" and target.parent.parent is None)
