"""Split moves of FANUC programs.

A segment of a move is the same instruction to a position that is added to /POS, with the frame, tool and CONFIG of the
move's own. It ends with CNT100, so that the robot does not stop there, and leaves out what is to happen once (TB, TA,
DB, DA). The lines after it are numbered anew, and LINE_COUNT with them; jumps go to labels and stay.

A move is left whole where segments of it would do something else: with a speed in seconds; with options other than
those and ACC and PTH; to positions with external axes or other motion groups; arcs and splines (A, S).
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

from truearm.compensation.programs.fanuc_ls.text import LINE_COUNT, LsFile, Position
from truearm.compensation.programs.lines import line_end, replaced
from truearm.compensation.programs.numbers import rewritten
from truearm.compensation.programs.program import Edit, Move, Program, ProgramTarget, Split, SplitEdits

_WORD: Final = r"(?:[^\s\[\];]|\[[^\[\]\n]*\])+"
#: Speed, termination, options that last, options that happen once.
_REST: Final = re.compile(
    rf"[ \t]++({_WORD})[ \t]++(?:FINE|(?:CNT|CR)[ \t]*+(?:\d+|A?R\[[^\[\]\n]*\]))"
    rf"((?:[ \t]++(?:ACC[ \t]*+(?:\d+|A?R\[[^\[\]\n]*\])|PTH))*)(?:[ \t]++(?:T[AB]|D[AB])[ \t]++{_WORD})*[ \t]*+;",
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
    """A file with split moves."""

    def __init__(self, program: Program, source: int) -> None:
        self._program, self._source = program, source
        self._raw = program.sources[source].text
        self._file = LsFile(program.sources[source])
        self._taught = {position.number: position for position in self._file.taught()}
        self._last = max(int(found[1]) for found in _REFERRED.finditer(self._raw))
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
        raw, rest = self._raw, _REST.fullmatch(self._file.text, move.target_text[1], move.statement[1])
        if rest is None or _SECONDS.search(rest[1]) or move.kind == "joint":
            return None
        after = f"{raw[rest.start() : rest.end(1)]} CNT100{rest[2]}    ;"
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
        carried_ends = [found.end() for found in _CARRIED_END.finditer(text, *self._file.instructions)]
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
