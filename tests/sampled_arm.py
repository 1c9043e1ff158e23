"""How near an arm comes to its cell and to itself, by points along its links: slow, and without segments or boxes."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np

from truearm.modeling.robot import Robot
from truearm.planning.driving.cell import Cell
from truearm.planning.driving.collisions import APART, MARGIN

_POINTS = 24


def sampled_room(robot: Robot, q: np.ndarray, cell: Cell, points: int = _POINTS) -> np.ndarray:
    """Return the smallest room at joint positions ``(n, joints)`` [m], ``(n,)``."""
    robot = robot.rigid
    chain = robot.forward_kinematics(q)
    world = robot.base
    places = [np.tile(world.translation, (len(q), 1))]
    places += [np.broadcast_to(chain.origin(k), chain.position.shape).T for k in robot.moving[: len(robot.joints)]]
    places.append(robot.world_poses(q)[0])
    tips = [robot.world_poses(q, target.name)[0] for target in robot.targets]
    places, tips = ([(p - world.translation) @ world.rotation for p in row] for row in (places, tips))
    steps = [np.linalg.norm(b - a, axis=1).max() for a, b in pairwise(places)]
    long = sum(steps)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    links = [
        (places[k], places[k + 1], along[k], along[k + 1], (0.06 if along[k] < long / 2 else 0.045) * long)
        for k in range(len(steps))
        if steps[k] > 1e-3
    ]
    tools = [(places[-1], tip, long, long + np.linalg.norm(tip - places[-1], axis=1).max(), 0.025) for tip in tips]
    tools = [tool for tool in tools if tool[3] - tool[2] > 1e-3]
    room = np.full(len(q), np.inf)
    for one, other in combinations([*links, *tools], 2):
        if one[2] == other[2] == long:
            continue  # two targets, or the same point of the flange
        keep = one[4] + other[4] + cell.clearance + MARGIN
        away = max(APART * keep - (other[2] - one[3]), 0.0)
        first, second = one[3] - one[2], other[3] - other[2]
        from_one, from_other = away / 2, away / 2
        if min(first, second) <= away / 2:
            from_one, from_other = (away, 0.0) if first > second else (0.0, away)
        if from_one >= first or from_other >= second:
            continue
        a = _points(one, 0.0, 1.0 - from_one / first, points)
        b = _points(other, from_other / second, 1.0, points)
        apart = np.linalg.norm(a[:, :, None] - b[:, None], axis=3).min(axis=(1, 2))
        room = np.minimum(room, apart - one[4] - other[4])
    first_moving = next(k for k, link in enumerate(links) if np.ptp(link[1], axis=0).max() > 1e-9 or len(q) == 1)
    for link in (*links[first_moving:], *tools):
        if cell.floor is not None:
            end = link[1][:, 2]
            room = np.minimum(room, end - link[4] - cell.floor)
        for box in cell.boxes:
            fixed = link is links[first_moving]
            start = min(1.0, (link[4] + cell.clearance + MARGIN) / (link[3] - link[2])) if fixed else 0.0
            p = _points(link, start, 1.0, points)
            gap = np.linalg.norm(p - np.clip(p, box.low, box.high), axis=2).min(axis=1)
            room = np.minimum(room, gap - link[4])
    return room


def _points(
    link: tuple[np.ndarray, np.ndarray, float, float, float], first: float, last: float, count: int
) -> np.ndarray:
    share = np.linspace(first, last, count)[None, :, None]
    return np.asarray(link[0][:, None] + share * (link[1] - link[0])[:, None])
