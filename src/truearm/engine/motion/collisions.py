"""How far an arm is from what it may touch: the floor, boxes and its own links; at postures and on ways between them.

A way is driven with all joints moving at once, each from one value to the other. It is looked at where it is needed:
how fast the distance of two bodies changes at most follows from the lengths between the joints that move one against
the other, so that two postures far from everything answer for what lies between them (conservative advancement: Mirtich
1996, "Impulse-based dynamic simulation of rigid body systems").
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.motion.arm_capsules import ArmCapsules, Capsule
from truearm.engine.motion.cell import FLOOR, Cell, box_distance, segment_distance
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot


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
class CollisionPair:
    """What is kept clear of what: the floor, a box, or another link."""

    thing: str  #: The floor, a box or the links: by what postures are rejected and distances are said.
    words: str  #: What comes near what.
    piece: Piece | None = None  #: piece, other: the link, and the other one of two; no link for the floor.
    other: Piece | None = None
    point: int = 0  #: point, radius: what is kept above the floor, and its thickness [m].
    radius: float = 0.0
    box: int = 0  #: Number of the box.


class Measure:
    """Measures distances at points of an arm.

    Lines side by side stand for a plate, a point of which is not farther than the gap from one of them. So the plate is
    not nearer than the root of the squares of their distance less that of the gap: the shortest way to the inside of a
    plate is at right angles to it, and its sides are lines themselves.
    """

    def __init__(self, pairs: Sequence[CollisionPair], cell: Cell) -> None:
        self.cell, self.count = cell, len(pairs)
        floor = [(k, pair.point, pair.radius) for k, pair in enumerate(pairs) if pair.piece is None]
        self._floor = [np.array(column) for column in zip(*floor, strict=True)] if floor else None
        boxed: dict[int, list[int]] = {}
        for k, pair in enumerate(pairs):
            if pair.piece is not None and pair.other is None:
                boxed.setdefault(pair.box, []).append(k)
        self._boxes = {}
        for number, places in boxed.items():
            pieces = [piece for piece in (pairs[k].piece for k in places) if piece is not None]
            self._boxes[number] = _Lines(
                places,
                [[(line,) for line in piece.lines()] for piece in pieces],
                [piece.capsule.gap for piece in pieces],
                [piece.capsule.radius for piece in pieces],
            )
        links = [(k, r.piece, r.other) for k, r in enumerate(pairs) if r.piece is not None and r.other is not None]
        self._of_links = None
        if links:
            self._of_links = _Lines(
                [k for k, _, _ in links],
                [_between(piece, other) for _, piece, other in links],
                [0.0 if _level(piece, other) else piece.capsule.gap + other.capsule.gap for _, piece, other in links],
                [piece.capsule.radius + other.capsule.radius for _, piece, other in links],
            )

    def __call__(self, points: Array) -> Array:
        """Return the distances at points ``(points, 3, n)`` [m], ``(pairs, n)``; below zero they touch."""
        distances = np.empty((self.count, points.shape[2]))
        if self._floor is not None:
            rows, point, radius = self._floor
            assert self.cell.floor is not None
            distances[rows] = points[point, 2] - radius[:, None] - self.cell.floor
        for number, lines in self._boxes.items():
            box = self.cell.boxes[number]
            distances[lines.rows] = lines.least(box_distance(*lines.ends(points, 0), box.low, box.high))
        if self._of_links is not None:
            lines = self._of_links
            distances[lines.rows] = lines.least(segment_distance(*lines.ends(points, 0), *lines.ends(points, 1)))
        return distances


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
        """Return the distances of plates by those of lines, ``(groups, n)``."""
        nearest = np.minimum.reduceat(apart, self._first, axis=0)
        return np.asarray(np.sqrt(np.maximum(nearest**2 - self._square, 0.0)) - self._radius)


def _level(piece: Piece, other: Piece) -> bool:
    """Return whether plates lie along the same axes, so that they are as far apart as lines across these."""
    a, b = piece.capsule, other.capsule
    return a.across is not None and b.across is not None and a.joints == b.joints


def _between(piece: Piece, other: Piece) -> list[tuple[_Line, ...]]:
    a, b = piece.capsule.across, other.capsule.across
    if a is not None and b is not None and _level(piece, other):
        return [((*a, piece.first, piece.last), (*b, other.first, other.last))]
    return [(a_line, b_line) for a_line in piece.lines() for b_line in other.lines()]


LINKS: Final = "links"
#: Before the name of a box.
KEPT_OUT: Final = "keep_out "
#: What is kept on top of the clearance, so that it holds between the postures that are looked at, too [m].
MARGIN: Final = 2e-3
#: A joint that changes a height by less than this for each rad does not count: its axis is upright [m].
_UPRIGHT: Final = 5e-4
#: Two places on the arm are kept apart if the way between them along the arm is so many times what they keep.
APART: Final = 3.0
#: So few postures at once that what is computed of them stays in the cache of a processor.
_AT_ONCE: Final = 1_000
_NEAR: Final = " come near each other"


@dataclass(frozen=True, eq=False)
class Checked:
    """Ways that were looked at."""

    clear: NDArray[np.bool_]  #: Whether the clearance is kept all the way, ``(n,)``.
    distance: Array  #: The smallest distance that was found [m], ``(n,)``.
    worst: NDArray[np.intp]  #: Number of what comes nearest, see :meth:`CollisionCheck.words`, ``(n,)``.


class CollisionCheck:
    """Whether an arm keeps clear of its cell and of itself.

    The first link stands with the base: only what moves is kept clear of the floor and of boxes, and of the first link
    that moves not the part next to its fixed end. Two links are kept apart without what is next to their connection:
    as much of them that the way along the arm between the rest is :data:`APART` times what they keep, their radii and
    the clearance. What no posture keeps apart is left out.

    Links between parallel axes are plates, wide enough to hold the link wherever along the axes it may lie:
    distances to them are never more than those to the link.

    Attributes:
        left_out: What no posture keeps apart, in words.
        connected: How much of the arm is left out where two links are connected, of the two of which it is most [m].

    Raises:
        InputError: If a box holds the base of the robot.
    """

    def __init__(self, robot: Robot, cell: Cell) -> None:
        self.robot, self.cell, self.arm = robot, cell, ArmCapsules(robot)
        self.need = cell.clearance + MARGIN
        self._refuse_around_base()
        self._stubs: dict[str, None] = {}
        self.connected = 0.0
        pairs = [*self._to_the_floor(), *self._to_the_boxes()]
        between = self._between_links()
        ever = set(np.flatnonzero((Measure(between, cell)(self.arm.sampled) >= self.need).any(axis=1)).tolist())
        self._pairs = [*pairs, *(pair for k, pair in enumerate(between) if k in ever)]
        self.left_out = (
            *self._stubs,
            *(pair.words.removesuffix(_NEAR) for k, pair in enumerate(between) if k not in ever),
        )
        self._measures: dict[str, Measure] = {}

    # -- at postures ---------------------------------------------------------------------------------------

    def distances(self, q: Array) -> Array:
        """Return all distances at joint positions ``(n, joints)`` [m], ``(pairs, n)``; below zero they touch.

        Args:
            q: Of the model [rad or m].
        """
        parts = [self._measure(self.arm.points(part)) for part in _parts(q)]
        return np.concatenate([np.zeros((len(self._pairs), 0)), *parts], axis=1)

    def smallest_distance(self, q: Array) -> Array:
        """Return the smallest distance at joint positions ``(n, joints)`` [m], ``(n,)``; infinite if none is near."""
        return np.asarray(self.distances(q).min(axis=0, initial=np.inf))

    def clear_of(self, q: Array) -> dict[str, NDArray[np.bool_]]:
        """Return for the floor, each box and the links at which joint positions ``(n, joints)`` they are kept clear."""
        apart = self.distances(q)
        names = np.array([pair.thing for pair in self._pairs], dtype=object)
        return {str(name): np.asarray((apart[names == name] >= self.need).all(axis=0)) for name in dict.fromkeys(names)}

    def sifted(self, q: Array) -> tuple[Array, dict[str, int]]:
        """Return those of joint positions ``(n, joints)`` where all is kept clear, and how many others what has cost.

        What takes longest is asked last, of those that are left, so each is lost to one thing alone.
        """
        names = sorted({pair.thing for pair in self._pairs}, key=lambda name: (name not in (FLOOR, LINKS), name))
        lost = dict.fromkeys(names, 0)
        for name in names:
            if name not in self._measures:
                self._measures[name] = Measure([pair for pair in self._pairs if pair.thing == name], self.cell)
        passed = [np.zeros((0, self.arm.joints))]
        for part in _parts(q):
            points, left = self.arm.points(part), np.arange(len(part))
            for name in names:
                clear = (self._measures[name](points[..., left]) >= self.need).all(axis=0)
                lost[name] += int(np.sum(~clear))
                left = left[clear]
            passed.append(part[left])
        return np.concatenate(passed), lost

    def words(self, number: int) -> str:
        """Say what comes near what."""
        return self._pairs[number].words if self._pairs else "nothing"

    # -- on ways -------------------------------------------------------------------------------------------

    def ways(self, starts: Array, ends: Array) -> Checked:
        """Look at ways from joint positions `starts` to `ends`, each ``(n, joints)``, all joints moving at once."""
        count = len(starts)
        if not self._pairs or not count:
            return Checked(np.ones(count, bool), np.full(count, np.inf), np.zeros(count, np.intp))
        at_start, at_end = self.distances(starts), self.distances(ends)
        least, worst = _least(np.concatenate([at_start[None], at_end[None]]).min(axis=0))
        way = np.arange(count)
        while len(way):
            # Ways that have failed are given up, and stretches that their ends answer for are done.
            spread = self.spread(starts, ends)
            sure = ((at_start + at_end - spread) / 2.0 >= self.cell.clearance) | (spread <= 2.0 * MARGIN)
            left = np.flatnonzero(~sure.all(axis=0) & (least[way] >= self.need))
            way, starts, ends = way[left], starts[left], ends[left]
            middle = (starts + ends) / 2.0
            at_middle = self.distances(middle)
            distance, number = _least(at_middle)
            order = np.argsort(-distance, kind="stable")
            nearer = order[distance[order] < least[way[order]]]
            least[way[nearer]], worst[way[nearer]] = distance[nearer], number[nearer]
            at_start, at_end = (
                np.concatenate([at_start[:, left], at_middle], axis=1),
                np.concatenate([at_middle, at_end[:, left]], axis=1),
            )
            starts, ends = np.concatenate([starts, middle]), np.concatenate([middle, ends])
            way = np.concatenate([way, way])
        return Checked(least >= self.need, least, worst)

    def spread(self, starts: Array, ends: Array) -> Array:
        """Return how much each distance changes at most on ways, each end ``(n, joints)`` [m], ``(pairs, n)``."""
        return np.asarray(self._speeds @ np.abs(ends - starts).T)

    @property
    def things(self) -> tuple[str, ...]:
        """What each distance is kept to: the floor, a box or the links."""
        return tuple(pair.thing for pair in self._pairs)

    @cached_property
    def _speeds(self) -> Array:
        """How fast each distance changes at most with each joint [m per rad, or m per m], ``(pairs, joints)``."""
        speeds = np.zeros((len(self._pairs), self.arm.joints))
        for k, pair in enumerate(self._pairs):
            if pair.piece is None:
                speeds[k] = self._speed_of(pair.point, 0)
                if self._upright:
                    speeds[k, 0] = 0.0
            else:
                # Joints up to the start of the one move both alike.
                moved, beyond = (pair.piece, 0) if pair.other is None else (pair.other, pair.piece.capsule.start)
                speeds[k] = np.max([self._speed_of(point, beyond) for point in moved.capsule.points], axis=0)
        return speeds

    def _speed_of(self, point: int, beyond: int) -> Array:
        """Return how fast a point moves with each joint, seen from the link that begins at point `beyond`.

        A point beside a joint is no farther from the axes that are parallel to that joint's than the joint is.
        """
        arm, speed = self.arm, np.zeros(self.arm.joints)
        at, parallel = arm.joint_of(point), arm.parallel_at(point)
        for j, joint in enumerate(arm.robot.joints):
            if beyond < j + 1 <= min(at, arm.flange):
                aside = arm.aside[point] if j + 1 < parallel else 0.0
                speed[j] = 1.0 if joint.kind == "prismatic" else arm.along[at] - arm.along[j + 1] + aside
        return speed

    @cached_property
    def _measure(self) -> Measure:
        return Measure(self._pairs, self.cell)

    @cached_property
    def _upright(self) -> bool:
        """Whether the first joint turns about the vertical, so that it changes no height."""
        if self.arm.robot.joints[0].kind != "revolute":
            return False
        at = self.arm.sample[:40]
        turned = at + np.eye(self.arm.joints)[0]
        return bool(np.abs(self.arm.points(turned)[:, 2] - self.arm.points(at)[:, 2]).max() < _UPRIGHT)

    # -- what is kept clear of what -------------------------------------------------------------------------

    def _moving(self) -> list[Capsule]:
        fixed = self.arm.fixed
        return [c for c in (*self.arm.links, *self.arm.tools) if not (c.start in fixed and c.end in fixed)]

    def _to_the_floor(self) -> list[CollisionPair]:
        if self.cell.floor is None:
            return []
        radius: dict[int, float] = {}
        for capsule in (*self.arm.links, *self.arm.tools):
            for point in capsule.points:
                radius[point] = max(radius.get(point, 0.0), capsule.radius)
        # What no joint raises or lowers is where it was mounted.
        level = np.ptp(self.arm.sampled[:, 2], axis=1) < 1e-3
        return [
            CollisionPair(FLOOR, f"{self._point(k)} comes near the {self.cell.surface}", point=k, radius=r)
            for k, r in sorted(radius.items())
            if not level[k]
        ]

    def _to_the_boxes(self) -> list[CollisionPair]:
        pairs = []
        for number, box in enumerate(self.cell.boxes):
            for capsule in self._moving():
                words = f"{self._name(capsule)} comes near the box '{box.name}'"
                pairs.append(
                    CollisionPair(f"{KEPT_OUT}{box.name}", words, self._beyond_fixed(capsule, number), box=number)
                )
        return pairs

    def _beyond_fixed(self, capsule: Capsule, box: int) -> Piece:
        """Return a capsule without what is next to its start where that stands still.

        A plate sticks out there along the axis of its joint. It counts from what is farther out on, unless that is near
        the box whatever the joints do, as over a table on which the arm stands.
        """
        if capsule.start not in self.arm.fixed:
            return Piece(capsule)
        near = capsule.radius + self.need
        first = min(1.0, near / self._length(capsule))
        starts = [start for start, _ in capsule.lines]
        out = [k for k, start in enumerate(starts) if self.arm.aside[start] + 2.0 * capsule.gap > near]
        for k in tuple(out):
            stub = Capsule(starts[k], starts[k], capsule.radius)
            if (Measure([CollisionPair("", "", Piece(stub), box=box)], self.cell)(self.arm.sampled) < self.need).all():
                out.remove(k)
                name = self.cell.boxes[box].name
                self._stubs[f"{self._name(capsule)}, next to {self._point(capsule.start)}, and the box '{name}'"] = None
        return Piece(capsule, first, whole=frozenset(out))

    def _between_links(self) -> list[CollisionPair]:
        links, pairs = self.arm.links, []
        for i, link in enumerate(links):
            for other in (*links[i + 1 :], *self.arm.tools):
                between = self.arm.along[self.arm.flange if other.tool else other.start] - self.arm.along[link.end]
                apart = APART * (link.radius + other.radius + self.need)
                if apart > between:
                    self.connected = max(self.connected, apart)
                pieces = self._without_connection(link, other, max(apart - float(between), 0.0))
                if pieces is not None:
                    words = f"{self._name(link)} and {self._name(other)}{_NEAR}"
                    pairs.append(CollisionPair(LINKS, words, *pieces))
        return pairs

    def _without_connection(self, capsule: Capsule, other: Capsule, length: float) -> tuple[Piece, Piece] | None:
        """Take away a length where two links are connected, half of each, all of the longer if one is too short."""
        long, far = self._length(capsule), self._length(other)
        taken = length / 2.0, length / 2.0
        if min(long, far) <= length / 2.0:
            taken = (length, 0.0) if long > far else (0.0, length)
        if taken[0] >= long or taken[1] >= far:
            return None
        return Piece(capsule, 0.0, 1.0 - taken[0] / long), Piece(other, taken[1] / far)

    def _length(self, capsule: Capsule) -> float:
        """Return how long a capsule is at most [m]."""
        return float(self.arm.along[capsule.end] - self.arm.along[capsule.start])

    def _name(self, capsule: Capsule) -> str:
        if capsule.tool:
            return f"what holds target '{self.arm.targets[capsule.end - self.arm.flange - 1]}'"
        start = "the base" if capsule.start == 0 else f"joint {capsule.start}"
        return f"the link from {start} to {self._point(capsule.end)}"

    def _point(self, point: int) -> str:
        point = self.arm.joint_of(point)
        if point == 0:
            return "the base"
        if point > self.arm.flange:
            return f"target '{self.arm.targets[point - self.arm.flange - 1]}'"
        return "the flange" if point == self.arm.flange else f"joint {point}"

    def _refuse_around_base(self) -> None:
        """Refuse a box that the base of the robot would stand in."""
        fixed = self.arm.sampled[list(self.arm.fixed), :, 0]
        column = fixed[0] + np.linspace(0.0, 1.0, 50)[:, None] * (fixed[-1] - fixed[0])
        for box in self.cell.boxes:
            inside = (column > box.low + 1e-3) & (column < box.high - 1e-3)
            if inside.all(axis=1).any():
                raise InputError(
                    "a box to keep out of holds the base of the robot",
                    parameter="constraints",
                    where=f"keep_out, {box.name}",
                    came=", ".join(
                        f"{axis} {low * 1e3:g} to {high * 1e3:g}"
                        for axis, low, high in zip("xyz", box.low, box.high, strict=True)
                    )
                    + " mm",
                    allowed="a box beside the base, or below it: in the base frame",
                    cure="Check its unit, and that it is in the base frame of the robot.",
                )


def _least(apart: Array) -> tuple[Array, NDArray[np.intp]]:
    number = np.argmin(apart, axis=0) if len(apart) and apart.shape[1] else np.zeros(apart.shape[1], np.intp)
    return np.asarray(np.take_along_axis(apart, number[None], axis=0)[0]), number


def _parts(q: Array) -> list[Array]:
    return [q[k : k + _AT_ONCE] for k in range(0, len(q), _AT_ONCE)]
