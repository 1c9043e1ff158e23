"""How near an arm comes to its cell and to itself, by points along its links: slow, and without segments or boxes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from truearm.engine.motion.cell import Cell
from truearm.engine.motion.collisions import APART, MARGIN
from truearm.engine.robot.robot import Robot

_POINTS = 24


@dataclass
class _Link:
    """A link: its ends ``(n, 3)``, how far they are along the arm, its thickness, and drums at its ends."""

    start: np.ndarray
    end: np.ndarray
    first: float
    last: float
    radius: float
    tool: bool = False
    drum_before: tuple[np.ndarray, np.ndarray] | None = None
    drum_behind: tuple[np.ndarray, np.ndarray] | None = None

    @property
    def long(self) -> float:
        return self.last - self.first

    def points(self, from_start: float, from_end: float, count: int) -> np.ndarray:
        """Return points along the link without lengths at its ends, and along the drums at ends that are whole."""
        found = [_points(self.start, self.end, from_start / self.long, 1.0 - from_end / self.long, count)]
        if self.drum_before is not None and from_start == 0.0:
            found.append(_points(*self.drum_before, 0.0, 1.0, count))
        if self.drum_behind is not None and from_end == 0.0:
            found.append(_points(*self.drum_behind, 0.0, 1.0, count))
        return np.concatenate(found, axis=1)


def sampled_room(
    robot: Robot, q: np.ndarray, cell: Cell, points: int = _POINTS, beside: Mapping[int, float] | None = None
) -> np.ndarray:
    """Return the smallest room at joint positions ``(n, joints)`` [m], ``(n,)``.

    `beside` has joints whose axes are parallel, the first of them first: how far the link behind each truly lies along
    the axis of the first, from the origin of that [m]. The link behind the joint after them begins where the last does.
    """
    robot = robot.rigid
    links = _links(robot, q, beside or {})
    room = np.full(len(q), np.inf)
    for one, other in combinations(links, 2):
        if one.first == other.first == links[-1].first and other.tool:
            continue  # two targets, or the same point of the flange
        keep = one.radius + other.radius + cell.clearance + MARGIN
        away = max(APART * keep - (other.first - one.last), 0.0)
        from_one, from_other = away / 2, away / 2
        if min(one.long, other.long) <= away / 2:
            from_one, from_other = (away, 0.0) if one.long > other.long else (0.0, away)
        if from_one >= one.long or from_other >= other.long:
            continue
        a, b = one.points(0.0, from_one, points), other.points(from_other, 0.0, points)
        apart = np.linalg.norm(a[:, :, None] - b[:, None], axis=3).min(axis=(1, 2))
        room = np.minimum(room, apart - one.radius - other.radius)
    moves = [np.ptp(link.end, axis=0).max() > 1e-9 or len(q) == 1 for link in links]
    for k, link in enumerate(links[moves.index(True) :]):
        if cell.floor is not None:
            room = np.minimum(room, link.end[:, 2] - link.radius - cell.floor)
            if link.drum_behind is not None:
                room = np.minimum(room, link.drum_behind[1][:, 2] - link.radius - cell.floor)
        for box in cell.boxes:
            near = link.radius + cell.clearance + MARGIN if k == 0 else 0.0
            drum = link.drum_before
            sticks_out = 0.0 if drum is None else _long(drum)
            p = link.points(min(near, link.long) if sticks_out <= near else 0.0, 0.0, points)
            if drum is not None and 0.0 < near < sticks_out:
                # The drum counts from what is farther out on, too.
                p = p[:, np.flatnonzero(np.linalg.norm(p - drum[0][:, None], axis=2).min(axis=0) >= near)]
            gap = np.linalg.norm(p - np.clip(p, box.low, box.high), axis=2).min(axis=1)
            room = np.minimum(room, gap - link.radius)
    return room


def _links(robot: Robot, q: np.ndarray, beside: Mapping[int, float]) -> list[_Link]:
    chain, world = robot.forward_kinematics(q), robot.base
    places = [np.tile(world.translation, (len(q), 1))]
    places += [np.broadcast_to(chain.origin(k), chain.position.shape).T for k in robot.moving[: len(robot.joints)]]
    places.append(robot.world_poses(q)[0])
    tips = [robot.world_poses(q, target.name)[0] for target in robot.targets]
    places, tips = ([(p - world.translation) @ world.rotation for p in row] for row in (places, tips))
    steps = [np.linalg.norm(b - a, axis=1).max() for a, b in pairwise(places)]
    long = sum(steps)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    axis = chain.axis(robot.moving[min(beside) - 1]).T @ world.rotation if beside else np.zeros(3)
    for k in (*beside, max(beside) + 1) if beside else ():
        # All to the height of the first along the axis.
        places[k] = places[k] - ((places[k] - places[min(beside)]) * axis).sum(axis=1)[:, None] * axis
    links = []
    for k in range(len(steps)):
        if steps[k] <= 1e-3:
            continue
        thick = (0.06 if along[k] < long / 2 else 0.045) * long
        start, end, before, behind = places[k], places[k + 1], None, None
        if k in beside:
            here, then = beside[k] * axis, beside.get(k + 1, beside[k]) * axis
            came = beside[k - 1] * axis if k - 1 in beside else 0.0 * here
            before, behind = (start + came, start + here), (end + here, end + then)
            start, end = start + here, end + here
        elif k - 1 in beside:
            start = start + beside[k - 1] * axis
        links.append(_Link(start, end, along[k], along[k + 1], thick, False, before, behind))
    for tip in tips:
        reach = np.linalg.norm(tip - places[-1], axis=1).max()
        if reach > 1e-3:
            links.append(_Link(places[-1], tip, long, long + reach, 0.025, tool=True))
    return links


def _long(ends: tuple[np.ndarray, np.ndarray]) -> float:
    return float(np.linalg.norm(ends[1] - ends[0], axis=1).max())


def _points(start: np.ndarray, end: np.ndarray, first: float, last: float, count: int) -> np.ndarray:
    share = np.linspace(first, last, count)[None, :, None]
    return np.asarray(start[:, None] + share * (end - start)[:, None])
