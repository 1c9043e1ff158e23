"""The outline of a KRL program: its routines with the steps that matter here, and everything that it declares."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, Literal

from truearm.engine.base.errors import InputError
from truearm.engine.programs.krl.lines import Statement, Text
from truearm.engine.programs.krl.names import POSITION_TYPES, SETTERS, Assigned, Names

StepKind = Literal["move", "lost", "set", "spline", "end of spline", "trigger", "assign", "call"]

MOVES: Final = frozenset({"PTP", "SPTP", "LIN", "SLIN", "SPL", "CIRC", "SCIRC"})
#: After these the place before the next move is not the one before them in the text.
_LOSING: Final = (
    "LOOP ENDLOOP FOR ENDFOR WHILE ENDWHILE REPEAT UNTIL ELSE ENDIF SWITCH CASE DEFAULT ENDSWITCH GOTO RESUME "
    "PTP_REL LIN_REL CIRC_REL SPTP_REL SLIN_REL SCIRC_REL SPL_REL"
)
#: Known, and of no meaning here.
_QUIET_WORDS: Final = (
    "IF WAIT HALT CONTINUE EXIT RETURN INTERRUPT BRAKE PULSE ANIN ANOUT DIGIN CCLOSE COPEN CREAD CWRITE CIOCTL SREAD "
    "SWRITE EXT EXTFCT IMPORT SIGNAL STRUC ENUM INT REAL BOOL CHAR STRING CONST_VEL TIME_BLOCK STOP ASYPTP ASYCONT "
    "ASYSTOP ASYCANCEL ON_ERROR_PROCEED CHANNEL PDAT_ACT LDAT_ACT SET_CD_PARAMS RESET_CD_PARAMS"
)
_QUIET: Final = frozenset(_QUIET_WORDS.split())
_OPENING: Final = frozenset({"DEF", "DEFFCT", "GLOBAL"})
_DECLARING: Final = POSITION_TYPES | {"DECL", "GLOBAL", "CONST"}
_KINDS: Final[dict[str, StepKind]] = {
    **dict.fromkeys(MOVES, "move"),
    **dict.fromkeys(_LOSING.split(), "lost"),
    **dict.fromkeys(SETTERS, "set"),
    "SPLINE": "spline",
    "PTP_SPLINE": "spline",
    "ENDSPLINE": "end of spline",
    "TRIGGER": "trigger",
}
_ROUTINE: Final = re.compile(
    r"(?:GLOBAL\s++)?+(?:DEF|DEFFCT\s++\w++(?:\s*+\[[^\]\n]*+\])?+)\s++(\w++)", re.ASCII | re.IGNORECASE
)
_NO_DECLARATION: Final = re.compile(r"GLOBAL\s++(?:INTERRUPT)\b", re.ASCII | re.IGNORECASE)
_FOLLOWING: Final = re.compile(r"\S")
_SETS_TOOL: Final = re.compile(r"\s*+\(\s*+#\s*+(?:INITMOV|TOOL)\b", re.ASCII | re.IGNORECASE)
_SETS_BASE: Final = re.compile(r"\s*+\(\s*+#\s*+(?:INITMOV|BASE|EX_BASE)\b", re.ASCII | re.IGNORECASE)


#: A statement that matters: what it does, and for an assignment what got which value.
Step = tuple[StepKind, Statement, Assigned | None]


@dataclass(frozen=True, slots=True)
class Routine:
    """A routine: its steps, and where the names in it are looked for, the nearest place first."""

    text: Text
    scopes: tuple[str, ...]
    steps: list[Step] = field(default_factory=list)


class Outline:
    """What the texts of a program contain.

    Attributes:
        names: All that they declare.
        routines: In the order of the texts.
        by_name: The same, by module and name; by an empty module, all.
        unknown: Instructions that are neither KRL nor a routine of the program, by their first word.
        sets_tool, sets_base: Indices of the texts that set the tool or the base somewhere.
    """

    def __init__(self, texts: Sequence[Text]) -> None:
        self.names = Names()
        self.routines: list[Routine] = []
        self.by_name: dict[tuple[str, str], Routine] = {}
        self.sets_tool: set[int] = set()
        self.sets_base: set[int] = set()
        # Data first, so that a program knows the types of the names that it uses.
        for text in sorted(texts, key=lambda text: "DEFDAT" not in text.flat.upper()):
            self._read(text)
        self.routines.sort(key=lambda routine: routine.text.index)
        self.unknown = Counter(
            statement[0]
            for routine in self.routines
            for kind, statement, _ in routine.steps
            if kind == "call" and self.called(statement[0], routine) is None
        )

    def called(self, name: str, caller: Routine) -> Routine | None:
        """Return the routine of a name, None if it is not in this program."""
        return self.by_name.get((caller.text.module, name)) or self.by_name.get(("", name))

    def _read(self, text: Text) -> None:
        opened: Statement | None = None
        routine: Routine | None = None
        data_scopes = (text.module, "")
        for statement in text.statements():
            word, start, _, stop = statement
            if word in ("END", "ENDFCT", "ENDDAT"):
                if opened is None or (word == "ENDDAT") != (routine is None):
                    raise text.refusal(f"{word} ends what did not begin", start)
                opened = routine = None
                continue
            named = _ROUTINE.match(text.flat, start, stop) if word in _OPENING else None
            if named is not None or word == "DEFDAT":
                if opened is not None:
                    raise self._not_ended(text, opened)
                opened = statement
                if named is not None:
                    routine = self._begin(text, named[1].upper())
            elif opened is None:
                if word in MOVES:
                    raise text.refusal("a move stands outside of DEF and END", start, word)
            elif routine is None:
                if word in _DECLARING:
                    self.names.declare(text, start, stop, data_scopes)
                elif word not in _QUIET:
                    self.names.assigned(text, start, stop, data_scopes)
            else:
                self._step(text, routine, statement)
        if opened is not None:
            raise self._not_ended(text, opened)

    def _begin(self, text: Text, name: str) -> Routine:
        routine = Routine(text, (f"{text.module} {len(self.routines)}", text.module, ""))
        self.routines.append(routine)
        self.by_name[text.module, name] = routine
        self.by_name.setdefault(("", name), routine)
        return routine

    def _not_ended(self, text: Text, opened: Statement) -> InputError:
        word, start, _, stop = opened
        end = {"DEFDAT": "ENDDAT", "DEFFCT": "ENDFCT"}.get(word, "END")
        return text.refusal(f"this has no {end}", start, text.flat[start:stop], cure="Is the file cut off?")

    def _step(self, text: Text, routine: Routine, statement: Statement) -> None:
        word, start, after, stop = statement
        flat = text.flat
        kind = _KINDS.get(word)
        if kind is not None:
            if kind != "set" or self._sets(text, word, after, stop):
                routine.steps.append((kind, statement, None))
            return
        if word in _QUIET:
            return
        if word in _DECLARING:
            if not _NO_DECLARATION.match(flat, start, stop):
                self.names.declare(text, start, stop, routine.scopes)
            return
        mark = _FOLLOWING.search(flat, after, stop)
        if mark is not None and mark[0] in "=[.":
            assigned = None if word.startswith("$") else self.names.assigned(text, start, stop, routine.scopes)
            if assigned is not None:
                routine.steps.append(("assign", statement, assigned))
        else:
            routine.steps.append(("lost" if mark is not None and mark[0] == ":" else "call", statement, None))

    def _sets(self, text: Text, word: str, after: int, stop: int) -> bool:
        """Return whether a statement sets the tool, the base or both, and note that the text does."""
        both, is_bas = word == "FDAT_ACT", word == "BAS"
        tool = both or word == "$TOOL" or (is_bas and _SETS_TOOL.match(text.flat, after, stop) is not None)
        base = both or word == "$BASE" or (is_bas and _SETS_BASE.match(text.flat, after, stop) is not None)
        if tool:
            self.sets_tool.add(text.index)
        if base:
            self.sets_base.add(text.index)
        return tool or base or word == "$IPO_MODE"
