"""The targets of a RAPID program: where their numbers are, and which tool and work object they are used with."""

from __future__ import annotations

import re
from collections import Counter
from typing import Final, NamedTuple

from truearm.compensation.programs.program import Move, Program, ProgramTarget, Skipped
from truearm.compensation.programs.rapid.arguments import arguments_of
from truearm.compensation.programs.rapid.data import JOINTTARGET, RELTOOL, ROBTARGET, wrong_number
from truearm.compensation.programs.rapid.expressions import TARGET_TEXTS, Candidate, Expressions, Found, Span, only
from truearm.compensation.programs.rapid.frames import Frames, Use
from truearm.compensation.programs.rapid.listing import Instruction, Listing
from truearm.compensation.programs.rapid.moves import DISPLACING, MOTIONS, Motion

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
            tuple(sorted(self.skipped, key=lambda one: (one.source, one.line))),
            dict(self.unknown),
            self.frames.loads(),
            any(_LOADING.search(code) for code in self.listing.codes),
        )

    def _skip(self, source: int, place: int, reason: str) -> None:
        self.skipped.append(Skipped(source, self.listing.line(source, place), reason))

    def _inside(self, source: int, start: int, stop: int, reason: str) -> None:
        code = self.listing.codes[source]
        for pattern in TARGET_TEXTS.values():
            for found in pattern.finditer(code, start, stop):
                self._skip(source, found.start(), f"a target that is written out is left as it is: {reason}")

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
            self._found_in_running(at, needed[1])
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

    def _found_in_running(self, at: Instruction, text: Span) -> None:
        datum = self.listing.find(self.listing.codes[at.source][slice(*text)], at)
        if datum is not None:
            line = self.listing.line(at.source, at.start)
            reason = f"gets its numbers while the program runs, in line {line}"
            self._mark(self.expressions.elements.get(datum, []), ("", ""), reason)

    def _used(self, at: Instruction, text: Span, joints: bool, use: Use, against: str | None) -> Found | None:
        found = self.expressions.target(at, text, joints)
        if isinstance(found, str):
            self._skip(at.source, text[0], f"the target of {at.word} {found}")
            return None
        self._mark(found.candidates, use, against)
        return found

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
        kept = []
        # A target comes after the one that it is an offset from.
        for one in self.expressions.candidates:
            if one.parent is not None and one.parent.reason is not None:
                one.reason = one.reason or "is an offset from a target that is left as it is"
            if one.use is None and one.reason is None:
                self._use_the_only(one)
            if one.reason is None:
                wrong = wrong_number(one.form, one.values)
                if wrong is not None:
                    place = next((span[0] for span in one.places if span), one.place)
                    raise self.listing.refusal(one.source, place, wrong[0], wrong[1], wrong[2])
                kept.append(one)
            elif one.used or not one.empty:
                self._skip(one.source, one.place, f"{one.name or 'a target that is written out'} {one.reason}")
        kept.sort(key=lambda one: (one.source, one.place))
        for index, one in enumerate(kept):
            one.index = index
        line = self.listing.line
        return [
            ProgramTarget(
                one.source, line(one.source, one.place), one.name, one.form, one.values, one.places,
                *(one.use or ("", "")), one.configuration, one.parent.index if one.parent else None,
                one.form is RELTOOL,
            )
            for one in kept
        ]  # fmt: skip

    def _use_the_only(self, one: Candidate) -> None:
        if one.form is JOINTTARGET and len(self.tools) == 1 and (tool := next(iter(self.tools))) is not None:
            one.use = (tool, "")
        elif one.form is ROBTARGET and len(self.uses) == 1 and (use := next(iter(self.uses))) is not None:
            one.use = use
        elif self.tools:
            one.reason = "is used by no move, and it is not known which tool and work object it is meant for"
        else:
            one.reason = "is used by no move of the program"

    def _moves(self) -> list[Move]:
        moves: list[Move] = []
        number, stretch, broken = -1, -1, True
        for one in self.pending:
            target, via = one.target, one.via
            if target is None or target.index < 0:
                broken = True
                continue
            if broken or (not one.exact and not one.motion.searches) or one.at.stretch != stretch:
                number += 1
            stretch, broken = one.at.stretch, not one.exact
            known_via = via is not None and via.index >= 0
            whole = one.whole or (one.motion.via is not None and not known_via) or not _plain(target)
            moves.append(
                Move(
                    one.motion.kind, target.index, one.at.source, self.listing.line(one.at.source, one.at.start),
                    via.index if via is not None and known_via else None, number,
                    (0, 0) if whole else (one.at.start, one.at.stop + 1),
                    (0, 0) if whole else one.target_text,
                    None if whole else one.via_text,
                )
            )  # fmt: skip
        return moves


def _plain(target: Candidate) -> bool:
    """Return whether other numbers can stand in a target's place without its parent's being written again."""
    return target.parent is None or (target.parent.name != "" and target.parent.parent is None)
