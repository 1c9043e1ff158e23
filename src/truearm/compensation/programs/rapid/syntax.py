"""The structure of RAPID: modules, routines, declarations and instructions.

Source: ABB, Technical reference manual, RAPID Kernel (3HAC050946-001): sections on lexical elements, data declarations,
statements, routine declarations and task modules (scope rules).

No line ends a statement, only ``;`` does, and the words that open and close blocks stand without any. So the text is
taken apart at the semicolons, and what stands before an instruction in its part are such words.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from truearm.compensation.programs.program import Source
from truearm.compensation.programs.rapid.listing import Datum, Instruction, Listing, Scope, Writing
from truearm.errors import InputError

_NAME: Final = r"[^\W\d]\w*+"
_WORD: Final = re.compile(rf"\s*+({_NAME})\s*+")
_DECLARED: Final = re.compile(
    rf"(?:(?:LOCAL|TASK)\s++)?+({_NAME})\s++({_NAME})\s*+(?:\{{([^{{}}]*+)\}}\s*+)?+(:=)?+", re.I
)
_HEAD: Final = {
    "module": re.compile(rf"({_NAME})\s*+(?:\([^()]*+\))?+"),
    "proc": re.compile(rf"({_NAME})\s*+\(([^()]*+)\)"),
    "func": re.compile(rf"{_NAME}\s++({_NAME})\s*+\(([^()]*+)\)"),
    "trap": re.compile(rf"({_NAME})\s*+(?:\(([^()]*+)\))?+"),
}
_PARAMETER: Final = re.compile(rf"\b({_NAME})\s++({_NAME})\s*+(?:\{{[^{{}}]*+\}}\s*+)?+(?=[,|)\\]|\Z)")
_THEN: Final = re.compile(r"\bTHEN\b", re.I)
_DO: Final = re.compile(r"\bDO\b", re.I)
_CASE: Final = re.compile(r"(?=\b(?:CASE|DEFAULT|ENDTEST)\b)", re.I)
_COLON: Final = re.compile(r":(?!=)")
_ENDRECORD: Final = re.compile(r"\bENDRECORD\b", re.I)
_LIST: Final = re.compile(r"(?:\([^()]*+\))?+")
#: The block words after which the same part goes on, with what of theirs is passed over.
_PASSED: Final = {
    "for": _DO,
    "while": _DO,
    "elseif": _THEN,
    "test": _CASE,
    "case": _COLON,
    "default": _COLON,
    "error": _LIST,
    "backward": _LIST,
    **dict.fromkeys(("else", "endif", "endfor", "endwhile", "endtest", "undo"), _LIST),
}
_LEAVING: Final = frozenset(("goto", "return", "raise", "retry", "trynext", "exit", "exitcycle", "connect", "alias"))
_MEMBER: Final = rf"(?:\s*+\.\s*+(?:{_NAME})|\s*+\{{[^{{}}]*+\}})*+"
_ASSIGNED: Final = re.compile(rf"({_MEMBER})\s*+:=")
_ASSIGNED_AFTER_IF: Final = re.compile(rf"(?<!\\)\b({_NAME})({_MEMBER})\s*+:=")
_CHANGING: Final = frozenset(("add", "incr", "decr", "clear"))
_CHANGED: Final = re.compile(rf"({_NAME})({_MEMBER})")


class _Walk:
    """One walk through a file, statement after statement."""

    def __init__(self, listing: Listing, source: int, motions: frozenset[str], quiet: frozenset[str]) -> None:
        self.listing, self.source, self.code = listing, source, listing.codes[source]
        self.motions, self.quiet = motions, quiet
        self.module: Scope | None = None
        self.outside: Scope = {}
        self.routine: Scope | None = None
        self.closing, self.opened = "", 0  # what closes the routine, and where it was opened
        self.modules, self.module_place = 0, 0
        self.in_record = False
        self.stretch = 1 + (listing.instructions[-1].stretch if listing.instructions else 0)
        one = "|".join(sorted(motions))
        self.motion_after_if = re.compile(rf"(?<![\\.\w])(?:{one})\b(?=\s*+[^\s:(=<>,)])", re.I)

    def run(self) -> None:
        code, start = self.code, 0
        while start < len(code):
            stop = code.find(";", start)
            stop = len(code) if stop < 0 else stop
            self._part(start, stop)
            start = stop + 1
        if self.module is not None:
            raise self._refusal(self.module_place, "a MODULE has no ENDMODULE")
        if not self.modules:
            raise self._refusal(0, "there is no MODULE")

    def _refusal(self, place: int, what: str) -> InputError:
        return self.listing.refusal(self.source, place, what)

    def _part(self, place: int, stop: int) -> None:
        code, local = self.code, False
        if self.in_record:
            found = _ENDRECORD.search(code, place, stop)
            if found is None:
                return None
            self.in_record, place = False, found.end()
        while found := _WORD.match(code, place, stop):
            word, place = found[1].lower(), found.end()
            if word in self.motions:
                return self._instruction(found, stop)
            if word in ("const", "var", "pers"):
                return self._declaration(place, stop, local)
            if word in ("local", "task"):
                local = word == "local"
                continue
            if word in self.quiet and code[found.end() : found.end() + 1] != ":":
                return None
            if word in _CHANGING and (changed := _CHANGED.match(code, place, stop)):
                return self._written(changed[1], changed[2], changed.start())
            if word not in _PASSED and (assigned := _ASSIGNED.match(code, found.end(1), stop)):
                return self._written(found[1], assigned[1], found.start(1))
            # From here on the robot may be elsewhere than the instruction before has sent it.
            self.stretch += 1
            if word in _HEAD:
                place = self._open(word, found.start(1), place, stop)
            elif word in ("endproc", "endfunc", "endtrap", "endmodule"):
                self._close(word, found.start(1))
            elif word == "record":
                closed = _ENDRECORD.search(code, place, stop)
                if closed is None:
                    self.in_record = True
                    return None
                place = closed.end()
            elif word == "if":
                then = _THEN.search(code, place, stop)
                if then is None:
                    return self._after_if(place, stop)
                place = then.end()
            elif word in _PASSED:
                passed = _PASSED[word].search(code, place, stop)
                if passed is None:
                    return None
                place = passed.end()
            elif word in _LEAVING:
                return None
            elif colon := _COLON.match(code, place, stop):
                place = colon.end()
            else:
                return self._instruction(found, stop)
        if code[place:stop].strip():
            self.stretch += 1
        return None

    def _instruction(self, word: re.Match[str], stop: int, guarded: bool = False) -> None:
        if self.routine is None or stop == len(self.code):
            return
        group = word.lastindex or 0
        self.listing.instructions.append(
            Instruction(
                word[group], self.source, word.start(group), word.end(group), stop,
                *self._scopes(), self.stretch, guarded,
            )
        )  # fmt: skip

    def _scopes(self) -> tuple[Scope, Scope]:
        outside = self.outside
        return outside if self.routine is None else self.routine, outside if self.module is None else self.module

    def _after_if(self, place: int, stop: int) -> None:
        motion = self.motion_after_if.search(self.code, place, stop)
        if motion is not None:
            self._instruction(motion, stop, guarded=True)
        elif assigned := _ASSIGNED_AFTER_IF.search(self.code, place, stop):
            self._written(assigned[1], assigned[2], assigned.start())
        self.stretch += 1

    def _written(self, name: str, member: str, place: int) -> None:
        self.listing.writings.append(Writing(name, member, self.source, place, *self._scopes()))

    def _declaration(self, place: int, stop: int, local: bool) -> None:
        found = _DECLARED.match(self.code, place, stop)
        if found is None:
            return
        local = local or self.code[place : place + 5].lower() == "local"
        datum = Datum(found[1].lower(), found[2], self.source, found.start(2), size=found[3])
        if found[4]:
            datum.start, datum.stop = found.end(), stop
        self.listing.data.append(datum)
        if self.routine is not None:
            self._declare(self.routine, datum)
        elif local and self.module is not None:
            self._declare(self.module, datum)
        else:
            self._declare(self.listing.shared, datum)

    @staticmethod
    def _declare(scope: Scope, datum: Datum) -> None:
        other = scope.setdefault(datum.name.lower(), datum)
        if other is not datum:
            other.twice = datum.twice = True

    def _open(self, word: str, start: int, place: int, stop: int) -> int:
        found = _HEAD[word].match(self.code, place, stop)
        if found is None:
            raise self._refusal(start, f"the head of a {word.upper()} is incomplete")
        if self.routine is not None:
            raise self._refusal(self.opened, f"a routine has no {self.closing.upper()}")
        if word == "module":
            if self.module is not None:
                raise self._refusal(self.module_place, "a MODULE has no ENDMODULE")
            self.module, self.module_place = {}, start
            self.modules += 1
            return found.end()
        self.routine, self.closing, self.opened = {}, f"end{word}", start
        self.listing.routines.add(found[1].lower())
        for one in _PARAMETER.finditer(found[2] or ""):
            name = one[2].lower()
            self.routine[name] = Datum(one[1].lower(), one[2], self.source, start, parameter=True)
        return found.end()

    def _close(self, word: str, place: int) -> None:
        if word == "endmodule":
            if self.routine is not None:
                raise self._refusal(self.opened, f"a routine has no {self.closing.upper()}")
            if self.module is None:
                raise self._refusal(place, "an ENDMODULE closes no MODULE")
            self.module = None
        elif self.routine is None or self.closing != word:
            raise self._refusal(place, f"an {word.upper()} closes nothing that is open")
        else:
            self.routine = None


def listing_of(sources: Sequence[Source], motions: frozenset[str], quiet: frozenset[str]) -> Listing:
    """Take the files of a program apart.

    Args:
        motions: First words, in lower case, of instructions that move the robot.
        quiet: First words, in lower case, of instructions that do not.

    Raises:
        InputError: If a string, a bracket, a routine or a module is not closed.
    """
    listing = Listing(tuple(sources))
    for source in range(len(sources)):
        listing.take(source)
        _Walk(listing, source, motions, quiet).run()
    listing.notewritings()
    return listing
