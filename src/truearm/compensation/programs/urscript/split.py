"""Split linear and circular moves of URScript: the same call before itself, once for each point on the way.

The robot would stop at every point without a blend radius, and blends must not overlap (script manual, movej: a move
whose blend overlaps with another one is skipped). So the points on the way get a small radius, and a move is left
whole where its own radius, or the one it comes with, does not fit into its segments; where a time is given for it;
where it goes to a target in a frame that the call does not name; and where its end is known to the robot alone.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

from truearm.compensation.programs.lines import indentation, line_end, replaced
from truearm.compensation.programs.numbers import NUMBER, written
from truearm.compensation.programs.program import Edit, Move, Program, ProgramTarget, Split, SplitEdits
from truearm.compensation.programs.urscript.text import Text, Value

#: Blend radius at the points on the way [m]; less where segments are short.
_RADIUS: Final = 0.001
#: Which argument is the time, and which the blend radius.
_TIME: Final = {"movej": 3, "movel": 3}
_BLEND: Final = {"movej": 4, "movel": 4, "movec": 4, "movep": 3, "optimovej": 3, "optimovel": 3}
_WORD: Final = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_DECIMALS: Final = 6


def split_moves(program: Program, splits: Sequence[Split]) -> SplitEdits:
    """Split moves."""
    texts: dict[int, _Blends] = {}
    edits: list[Edit] = []
    whole: list[int] = []
    for split in splits:
        source = program.moves[split.move].source
        if source not in texts:
            texts[source] = _Blends(Text(program.sources[source]))
        made = _edits(program, split, texts[source])
        edits += made
        whole += [] if made else [split.move]
    return SplitEdits(edits, whole)


class _Blends:
    """A text, and what it says of times and blend radii."""

    def __init__(self, text: Text) -> None:
        self.text = text
        self._known: dict[str, float | None] = {}

    def call(self, move: Move) -> tuple[str, int]:
        """Return the function of a move and its opening bracket."""
        word = _WORD.match(self.text.code, move.statement[0])
        return "" if word is None else word[0], self.text.code.index("(", move.statement[0])

    def number(self, argument: Value | None) -> float | None:
        """Return the number that an argument is, the largest that its variable gets, 0 for none; None if computed."""
        if argument is None:
            return 0.0
        word = self.text.code[argument.start : argument.stop]
        if word not in self._known:
            self._known[word] = self._found(word)
        return self._known[word]

    def _found(self, word: str) -> float | None:
        if re.fullmatch(NUMBER, word, re.ASCII):
            return float(word)
        if not _WORD.fullmatch(word):
            return None
        assigned = re.findall(rf"(?<![\w.]){word}[ \t]*=(?!=)[ \t]*([^\n]*)", self.text.code)
        values = [float(one) for one in map(str.rstrip, assigned) if re.fullmatch(NUMBER, one, re.ASCII)]
        return max(values) if values and len(values) == len(assigned) else None

    def radius(self, move: Move) -> float | None:
        """Return the blend radius of a move; None if it is computed."""
        function, opened = self.call(move)
        if function not in _BLEND:
            return 0.0
        return self.number(self.text.argument(opened, _BLEND[function], "r"))


def _edits(program: Program, split: Split, blends: _Blends) -> list[Edit]:
    """Return the edits that split a move; none if it stays whole."""
    move, text = program.moves[split.move], blends.text
    target = program.targets[move.target]
    function, opened = blends.call(move)
    if move.kind == "joint" or move.target_text == (0, 0) or not split.points:
        return []
    if function in _TIME and blends.number(text.argument(opened, _TIME[function], "t")) != 0.0:
        return []
    radius = _radius(program, split, blends)
    if radius is None:
        return []
    start, stop = move.statement
    blend = text.argument(opened, _BLEND[function], "r")
    copies = []
    for numbers, via in split.points:
        parts = [(*move.target_text, _written(numbers, target))]
        if move.via_text is not None and via is not None:
            parts.append((*move.via_text, _written(via, target)))
        place = (stop - 1, stop - 1) if blend is None else (blend.start, blend.stop)
        parts.append((*place, f", r={radius}" if blend is None else radius))
        copies.append(replaced(text.source.text, start, stop, parts))
    between = line_end(text.source.text, start) + indentation(text.source.text, start)
    edits = [Edit(move.source, start, start, "".join(copy + between for copy in copies))]
    if move.via_text is not None and split.last_via is not None:
        edits.append(Edit(move.source, *move.via_text, _written(split.last_via, target)))
    return edits


def _radius(program: Program, split: Split, blends: _Blends) -> str | None:
    """Return the blend radius of the points on the way, as it is written; None if there is no room for any."""
    move = program.moves[split.move]
    own = blends.radius(move)
    before = program.moves[split.move - 1] if split.move else None
    follows = before is not None and (before.source, before.routine) == (move.source, move.routine)
    coming = blends.radius(before) if before is not None and follows else 0.0
    if own is None or coming is None:
        return None
    target = program.targets[move.target]
    shortest = math.inf
    if target.form.kind == "pose":
        points = [numbers[:3] for numbers, _ in split.points]
        if target.parent is None:
            points.append(target.values[:3])
        shortest = min((math.dist(a, b) for a, b in pairwise(points)), default=math.inf)
    radius = min(_RADIUS, shortest / 4)
    room = shortest - radius if math.isfinite(shortest) else _RADIUS
    if max(own, coming) > room:
        return None
    return written(radius, _DECIMALS)


def _written(numbers: Sequence[float], target: ProgramTarget) -> str:
    return f"{'p' if target.form.kind == 'pose' else ''}[{', '.join(written(v, _DECIMALS) for v in numbers)}]"
