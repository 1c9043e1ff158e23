"""What is kept clear of what, and how much room there is between the two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truearm.modeling.chain import Array
from truearm.planning.constraints.segments import box_distance, segment_distance
from truearm.planning.driving.arm_capsules import Capsule
from truearm.planning.driving.cell import Cell


@dataclass(frozen=True)
class Piece:
    """A capsule without what is next to one of its ends, as shares of the length of each of its lines."""

    capsule: Capsule  #: With its lines.
    first: float = 0.0  #: first, last: where the piece begins and ends: 0 at the start of a line, 1 at its end.
    last: float = 1.0
    whole: frozenset[int] = frozenset()  #: Which lines begin at their start all the same.

    def lines(self) -> list[tuple[int, int, float, float]]:
        """Return for each line the points at its ends, and the shares between which it counts."""
        return [
            (start, end, 0.0 if k in self.whole else self.first, self.last)
            for k, (start, end) in enumerate(self.capsule.lines)
        ]


@dataclass(frozen=True)
class Room:
    """What is kept clear of what: the floor, a box, or another link."""

    what: str  #: The floor, a box or the links: by what postures are rejected and distances are said.
    words: str  #: What comes near what.
    piece: Piece | None = None  #: piece, other: the link, and the other one of two; no link for the floor.
    other: Piece | None = None
    point: int = 0  #: point, radius: what is kept above the floor, and its thickness [m].
    radius: float = 0.0
    box: int = 0  #: Number of the box.


class Measure:
    """Measures rooms at points of an arm.

    Lines side by side stand for a plate, a point of which is not farther than the gap from one of them. So the plate is
    not nearer than the root of the squares of their distance less that of the gap: the shortest way to the inside of a
    plate is at right angles to it, and its sides are lines themselves.
    """

    def __init__(self, rooms: Sequence[Room], cell: Cell) -> None:
        self.cell, self.count = cell, len(rooms)
        floor = [(k, room.point, room.radius) for k, room in enumerate(rooms) if room.piece is None]
        self._floor = [np.array(column) for column in zip(*floor, strict=True)] if floor else None
        boxed: dict[int, list[int]] = {}
        for k, room in enumerate(rooms):
            if room.piece is not None and room.other is None:
                boxed.setdefault(room.box, []).append(k)
        self._boxes = {}
        for number, places in boxed.items():
            pieces = [piece for piece in (rooms[k].piece for k in places) if piece is not None]
            self._boxes[number] = _Lines(
                places,
                [[(line,) for line in piece.lines()] for piece in pieces],
                [piece.capsule.gap for piece in pieces],
                [piece.capsule.radius for piece in pieces],
            )
        pairs = [(k, r.piece, r.other) for k, r in enumerate(rooms) if r.piece is not None and r.other is not None]
        self._pairs = None
        if pairs:
            self._pairs = _Lines(
                [k for k, _, _ in pairs],
                [_between(one, other) for _, one, other in pairs],
                [0.0 if _level(one, other) else one.capsule.gap + other.capsule.gap for _, one, other in pairs],
                [one.capsule.radius + other.capsule.radius for _, one, other in pairs],
            )

    def __call__(self, points: Array) -> Array:
        """Return the rooms at points ``(points, 3, n)`` [m], ``(rooms, n)``; below zero they touch."""
        found = np.empty((self.count, points.shape[2]))
        if self._floor is not None:
            rows, point, radius = self._floor
            assert self.cell.floor is not None
            found[rows] = points[point, 2] - radius[:, None] - self.cell.floor
        for number, lines in self._boxes.items():
            box = self.cell.boxes[number]
            found[lines.rows] = lines.least(box_distance(*lines.ends(points, 0), box.low, box.high))
        if self._pairs is not None:
            lines = self._pairs
            found[lines.rows] = lines.least(segment_distance(*lines.ends(points, 0), *lines.ends(points, 1)))
        return found


_Line = tuple[int, int, float, float]


class _Lines:
    """Lines, or pairs of lines, that stand for pieces, or pairs of pieces: one group of them each."""

    def __init__(
        self, rows: list[int], lines: list[list[tuple[_Line, ...]]], gaps: list[float], radii: list[float]
    ) -> None:
        self.rows = np.array(rows)
        self._first = np.cumsum([0, *(len(group) for group in lines[:-1])])
        self._square, self._radius = np.array(gaps)[:, None] ** 2, np.array(radii)[:, None]
        every = [line for group in lines for line in group]
        # By side, then start, end, first and last, each with one number a line.
        self._sides = [
            [np.array(column) for column in zip(*(line[side] for line in every), strict=True)]
            for side in range(len(every[0]))
        ]

    def ends(self, points: Array, side: int) -> tuple[Array, Array]:
        """Return both ends of the lines, each ``(lines, 3, n)``."""
        start, end, first, last = self._sides[side]
        origin = points[start]
        along = points[end] - origin
        return origin + first[:, None, None] * along, origin + last[:, None, None] * along

    def least(self, apart: Array) -> Array:
        """Return the room by the distances of lines, ``(groups, n)``."""
        nearest = np.minimum.reduceat(apart, self._first, axis=0)
        return np.asarray(np.sqrt(np.maximum(nearest**2 - self._square, 0.0)) - self._radius)


def _level(one: Piece, other: Piece) -> bool:
    """Return whether plates lie along the same axes, so that they are as far apart as lines across these."""
    a, b = one.capsule, other.capsule
    return a.across is not None and b.across is not None and a.joints == b.joints


def _between(one: Piece, other: Piece) -> list[tuple[_Line, ...]]:
    a, b = one.capsule.across, other.capsule.across
    if a is not None and b is not None and _level(one, other):
        return [((*a, one.first, one.last), (*b, other.first, other.last))]
    return [(a_line, b_line) for a_line in one.lines() for b_line in other.lines()]
