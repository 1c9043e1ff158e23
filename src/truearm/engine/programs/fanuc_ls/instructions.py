"""The instructions of a FANUC program (/MN): its moves, how they use the positions, and split moves."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

from truearm.engine.programs.fanuc_ls.text import LINE_COUNT, LsFile, Position, Statement
from truearm.engine.programs.program import (
    Edit,
    Move,
    MoveKind,
    Program,
    ProgramTarget,
    Skipped,
    Split,
    SplitEdits,
    line_end,
    replaced,
    rewritten,
)

#: A reference: to a position by its number, such as P[3:approach]; or its word and what is between its brackets.
_REFERENCE: Final = r"(P\[[ \t]*+0*(\d{1,9})[ \t]*+(?::[^\[\]\n]*)?\]|([A-Z]\w*)\[((?:[^\[\]\n]|\[[^\[\]\n]*\])*)\])"
_MOVE: Final = re.compile(rf"[ \t]*+([JLCAS])[ \t]++@?[ \t]*+{_REFERENCE}", re.IGNORECASE)
_SECOND: Final = re.compile(rf"[\s:@]*+{_REFERENCE}", re.IGNORECASE)
_SECOND_LINE: Final = re.compile(rf"\n[ \t]*+:?[ \t]*+@?[ \t]*+{_REFERENCE}", re.IGNORECASE)
_BRACKETS: Final = re.compile(r"\[[^\[\]]*\]")
_OPTION: Final = re.compile(r"\b(INC|RTCP|COORD|(?:TOOL_)?OFFSET|VOFFSET|(?:QUICK_)?SKIP)\b", re.IGNORECASE)
#: What most moves end with.
_NO_OPTION: Final = re.compile(
    r"[ \t]++\d+(?:%|[cm]m/(?:sec|min))[ \t]++(?:FINE|CNT\d+)[ \t]*+(?:ACC\d+[ \t]*+)?;$", re.IGNORECASE
)
_COMMENT: Final = re.compile(r"[ \t]*+(?:!|//|--)")
_COMMENT_LINE: Final = re.compile(rf"[ \t]*+\d*[ \t]*+:{_COMMENT.pattern}")
_WORD: Final = re.compile(r"[ \t]*+\(*([$A-Z]\w*)", re.IGNORECASE)
#: What sets the active user frame or tool: which of the two, of which groups, the number if it is one.
_ACTIVE: Final = re.compile(
    r"(?:U|\$MNU)(FRAME|TOOL)_?NUM[ \t]*+(?:\[([^\]\n]*)\][ \t]*+)?=(?:[ \t]*+(\d{1,3})[ \t]*+(?:;|$))?",
    re.IGNORECASE | re.MULTILINE,
)

#: The shape of arcs (A) and splines (S) is decided by their neighbours.
_KINDS: Final[Mapping[str, MoveKind]] = {"J": "joint", "L": "linear", "C": "circular", "A": "circular", "S": "circular"}
#: Options with which the numbers of a position are no place of the tool in a frame that stands still.
_NO_PLACE: Final = {
    "INC": "is a step (INC) and no place",
    "RTCP": "is reached with a tool that stands still (RTCP)",
    "COORD": "is in a frame that another motion group moves (COORD)",
}
#: Where a program may come from elsewhere.
_JOINING: Final = frozenset({"LBL", "ELSE", "ENDIF", "FOR", "ENDFOR"})
_KNOWN: Final = re.compile(
    r"(?:[AGDRSUW][IO]|[PSA]?R|RSR|F|M|PL|TIMER|MESSAGE|UALM|PAYLOAD|UFRAME|UTOOL|(?:JOINT|LINEAR)_MAX_SPEED)[ \t]*+\["
    r"|(?:WAIT|IF|SELECT|JMP|CALL|RUN|END|ABORT|PAUSE|MONITOR|OVERRIDE|U(?:FRAME|TOOL)_NUM|(?:ERROR|RESUME)_PROG)\b"
    r"|(?:(?:TOOL_|V)?OFFSET|SKIP)[ \t]++CONDITION\b|(?:UN)?LOCK[ \t]++PREG\b|COL[ \t]++(?:DETECT|GUARD)\b|\$",
    re.IGNORECASE,
)

#: A tool or user frame that the program itself puts elsewhere.
_PLACED: Final = re.compile(r"\s*+(U(?:FRAME|TOOL)[ \t]*+\[[^\]\r\n]*+\])[ \t]*+=", re.IGNORECASE)
#: Numbers of the active user frame and tool; None if a number is not known.
Active = tuple[str | None, str | None]


class Step(NamedTuple):
    """A move instruction."""

    #: kind, statement, target_text, via_text, routine: as in :class:`~truearm.engine.programs.program.Move`.
    kind: MoveKind
    statement: tuple[int, int]
    target: str  #: target, via: numbers of its positions; empty where a position is not of this program.
    target_text: tuple[int, int]
    via: str
    via_text: tuple[int, int] | None
    routine: int


class Instructions:
    """What the instructions of a file say.

    Attributes:
        steps: The moves to positions of the program, in the order of the text.
        skipped: The moves to other places.
        unknown: How often an instruction occurs that is not known, by its first word.
        no_place: Positions, by number, whose numbers are no place of the tool in a frame that stands still, and why. By
            the empty number if a move is such that may go to any of them.
        active: What is active at the moves to a position, by its number; None where they differ.
        everywhere: What is ever active in the program: numbers of user frames, numbers of tools.
        routine: The last routine.
    """

    def __init__(self, file: LsFile, source: int, routine: int) -> None:
        self.steps: list[Step] = []
        self.skipped: list[Skipped] = []
        self.unknown: Counter[str] = Counter()
        self.no_place: dict[str, str] = {}
        self.active: dict[str, Active] = {}
        self.everywhere: tuple[set[str | None], set[str | None]] = (set(), set())
        self.routine = routine
        self._file, self._source = file, source
        self._holds: Active = (None, None)
        text = file.text
        for active in _ACTIVE.finditer(text, *file.instructions):
            line = text.rfind("\n", 0, active.start()) + 1
            if _COMMENT_LINE.match(text, line) is None and _is_first_group(active):
                self.everywhere[_slot(active)].add(active[3])
        for statement in file.statements():
            move = _MOVE.match(text, statement.start, statement.stop)
            if move is not None:
                self._move(statement, move)
            elif (placed := _PLACED.match(text, statement.start, statement.stop)) is not None:
                self._skip(statement.start, f"{placed[1]} is set here, so where its targets are is not known")
            elif _COMMENT.match(text, statement.start, statement.stop) is None:
                self._other(text[statement.start : statement.stop])

    def _skip(self, place: int, reason: str) -> None:
        self.skipped.append(Skipped(self._source, self._file.line(place), reason))

    def _no_target(self, place: int, word: str, inside: str) -> str:
        """Skip a reference that is to no position by its number; return the empty number."""
        shown = f"{word}[{inside}]"
        if word.upper() == "P":
            self._skip(place, f"which position {shown} is, is known only when the program runs")
        elif word.upper() == "PR":
            self._skip(place, f"{shown} is a position register, set elsewhere")
        else:
            self._skip(place, f"{shown} is no position of this program")
        return ""

    def _move(self, statement: Statement, move: re.Match[str]) -> None:
        text, stop = self._file.text, statement.stop
        target, target_text = move[3] or self._no_target(move.start(2), move[4], move[5]), move.span(2)
        via, via_text = "", None
        if move[1] in "Cc":
            second = _SECOND.match(text, move.end(), stop) or _SECOND_LINE.search(text, move.end(), stop)
            via, via_text = target, target_text
            if second is None:
                self._skip(move.start(2), "the circle has one position only")
                target = ""
            else:
                target = second[2] or self._no_target(second.start(1), second[3], second[4])
                target_text = second.span(1)
        options: set[str] = set()
        plain = via_text is None and _NO_OPTION.match(text, move.end(), stop)
        if not plain and _OPTION.search(text, move.end(), stop):
            options = {word.upper() for word in _OPTION.findall(_BRACKETS.sub("[]", text[move.end() : stop]))}
        for number in (target, via):
            if number:
                frame, tool = self.active.setdefault(number, self._holds)
                if (frame, tool) != self._holds:
                    active_frame, active_tool = self._holds
                    agreed = frame if frame == active_frame else None, tool if tool == active_tool else None
                    self.active[number] = agreed
        for option in options & _NO_PLACE.keys():
            self.no_place |= dict.fromkeys(filter(None, (target, via)), _NO_PLACE[option])
            if not target and (move[4] or "").upper() == "P":
                self.no_place[""] = _NO_PLACE[option]
        self.routine += bool(options)
        if target:
            span = (move.start(1), stop)
            kind = _KINDS[move[1].upper()]
            self.steps.append(Step(kind, span, target, target_text, via, via_text, self.routine))
        self.routine += bool(options) or not target

    def _other(self, words: str) -> None:
        for active in _ACTIVE.finditer(words):
            if _is_first_group(active):
                alone = not words[: active.start()].strip()
                self._hold(_slot(active), active[3] if alone else None)
        match = _WORD.match(words)
        word = match[1].upper() if match else ""
        if word in _JOINING:
            self.routine += 1
            for slot in (0, 1):
                if len(self.everywhere[slot]) > 1:
                    self._hold(slot, None)
        elif match and _KNOWN.match(words, match.start(1)) is None:
            self.unknown[match[1]] += 1
            self.routine += 1
        elif "CALL" in words.upper():
            self.routine += 1

    def _hold(self, slot: int, number: str | None) -> None:
        frame, tool = self._holds
        self._holds = (frame, number) if slot else (number, tool)


def _is_first_group(active: re.Match[str]) -> bool:
    return active[2] is None or "1" in re.findall(r"\d+", active[2])


def _slot(active: re.Match[str]) -> int:
    return int(active[1].upper() == "TOOL")


_EACH_WORD: Final = r"(?:[^\s\[\];]|\[[^\[\]\n]*\])+"
#: Speed, termination, options that last, options that happen once.
_TAIL: Final = re.compile(
    rf"[ \t]++({_EACH_WORD})[ \t]++(?:FINE|(?:CNT|CR)[ \t]*+(?:\d+|A?R\[[^\[\]\n]*\]))"
    rf"((?:[ \t]++(?:ACC[ \t]*+(?:\d+|A?R\[[^\[\]\n]*\])|PTH))*)(?:[ \t]++(?:T[AB]|D[AB])[ \t]++{_EACH_WORD})*[ \t]*+;",
    re.IGNORECASE,
)
_SECONDS: Final = re.compile(r"(?<!/)sec$", re.IGNORECASE)
_BETWEEN: Final = re.compile(r"[\s:@]*+")
_REFERRED: Final = re.compile(r"\bP\[[ \t]*+(\d{1,9})", re.IGNORECASE)
#: The end of instructions that a move carries along, which are numbered from 1.
_CARRIED_END: Final = re.compile(r"^[ \t]*+-{4,}[ \t]*+;", re.MULTILINE)
_BLANK: Final = re.compile(r"[ \t]*+")


class _Segment(NamedTuple):
    """What the segments of a move say before, between and after their references."""

    before: str
    between: str
    after: str


# A segment of a move is the same instruction to a position that is added to /POS, with the frame, tool and CONFIG of
# the move's own. It ends with CNT100, so that the robot does not stop there, and leaves out what is to happen once (TB,
# TA, DB, DA). The lines after it are numbered anew, and LINE_COUNT with them; jumps go to labels and stay.
#
# A move is left whole where segments of it would do something else: with a speed in seconds; with options other than
# those and ACC and PTH; to positions with external axes or other motion groups; arcs and splines (A, S).
def split_moves(program: Program, splits: Sequence[Split]) -> SplitEdits:
    """Split moves."""
    edits: list[Edit] = []
    whole: list[int] = []
    for source in range(len(program.sources)):
        chosen = [split for split in splits if program.moves[split.move].source == source]
        if chosen:
            file = _SplitFile(program, source)
            edits += file.edits(chosen)
            whole += file.whole
    return SplitEdits(edits, whole)


class _SplitFile:
    def __init__(self, program: Program, source: int) -> None:
        self._program, self._source = program, source
        self._raw = program.sources[source].text
        self._file = LsFile(program.sources[source])
        self._taught = {position.number: position for position in self._file.taught()}
        self._last = max(int(match[1]) for match in _REFERRED.finditer(self._raw))
        self._line_end = line_end(self._raw)
        self._added: list[str] = []
        #: Moves that stay whole.
        self.whole: list[int] = []

    def edits(self, splits: Sequence[Split]) -> list[Edit]:
        """Return the edits of the file."""
        edits: list[Edit] = []
        inserted: dict[int, list[str]] = {}
        for split in sorted(splits, key=lambda split: self._program.moves[split.move].statement):
            move = self._program.moves[split.move]
            target = self._program.targets[move.target]
            position = self._taught[target.name[2:-1].partition(":")[0]]
            segment = self._segment(move)
            if segment is None or not position.alone or position.external:
                self.whole.append(split.move)
                continue
            words: list[str] = []
            for point, via in split.points:
                middle = "" if via is None else self._new(target, position, via) + segment.between
                words.append(segment.before + middle + self._new(target, position, point) + segment.after)
            inserted[move.statement[1]] = words
            if split.last_via is not None and move.via_text is not None:
                edits.append(Edit(self._source, *move.via_text, self._new(target, position, split.last_via)))
        edits += self._numbered(inserted)
        if self._added:
            end = self._file.positions[1]
            edits.append(Edit(self._source, end, end, "".join(self._added)))
        return sorted(edits, key=lambda edit: edit.start)

    def _segment(self, move: Move) -> _Segment | None:
        raw, tail = self._raw, _TAIL.fullmatch(self._file.text, move.target_text[1], move.statement[1])
        if tail is None or _SECONDS.search(tail[1]) or move.kind == "joint":
            return None
        after = f"{raw[tail.start() : tail.end(1)]} CNT100{tail[2]}    ;"
        if move.kind == "linear":
            return _Segment(raw[move.statement[0] : move.target_text[0]], "", after)
        if move.via_text is None:
            return None
        between = raw[move.via_text[1] : move.target_text[0]]
        if _BETWEEN.fullmatch(between) is None:
            return None
        return _Segment(raw[move.statement[0] : move.via_text[0]], between, after)

    def _new(self, target: ProgramTarget, like: Position, numbers: Sequence[float]) -> str:
        """Add a position and return the reference to it."""
        self._last += 1
        name = f"P[{self._last}]"
        cuts = [(*like.name, name)]
        for place, text, unit, value in zip(like.places, like.texts, like.units, numbers, strict=True):
            cuts.append((*place, rewritten(text, value, target.form.decimals[0 if unit == "mm" else 1])))
        self._added += [replaced(self._raw, like.start, like.stop, cuts), self._line_end]
        return name

    def _numbered(self, inserted: Mapping[int, Sequence[str]]) -> list[Edit]:
        """Return the edits that insert instructions before others, by where these end, and number the lines anew."""
        raw, text = self._raw, self._file.text
        edits: list[Edit] = []
        shift = 0
        carried_ends = [match.end() for match in _CARRIED_END.finditer(text, *self._file.instructions)]
        carried_until, first = 0, True
        for statement in self._file.statements():
            start, stop = text.rfind("\n", 0, statement.number[0]) + 1, statement.number[1]
            digits = raw[slice(*statement.number)]
            if digits == "1" and not first and carried_ends and carried_ends[-1] > stop:
                carried_until = carried_ends[bisect_right(carried_ends, stop)]
            if stop < carried_until:
                continue
            first = False
            words = inserted.get(statement.stop, ())
            if not words and not (shift and digits):
                continue
            heads = [
                str(int(digits) + shift + i).rjust(stop - start) if digits else raw[start:stop]
                for i in range(len(words) + 1)
            ]
            blank = _BLANK.match(raw, statement.start)
            gap = raw[stop : blank.end() if blank else statement.start]
            lines = [head + gap + line + self._line_end for head, line in zip(heads, words, strict=False)]
            edits.append(Edit(self._source, start, stop, "".join(lines) + heads[-1]))
            shift += len(words)
        count = LINE_COUNT.search(text, 0, self._file.instructions[0])
        if shift and count:
            edits.append(Edit(self._source, *count.span(1), str(int(count[1]) + shift)))
        return edits
