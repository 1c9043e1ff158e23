"""Sets of poses by name: those of ISO 9283 in a cube (Patel, sections 3.4 and 4.4.2), and those on a sphere.

========== ==============================================================================================
set        poses
========== ==============================================================================================
p1-p5      P1 to P5 of ISO 9283 on one diagonal plane
iso-cube   the centre of the cube and its corners C1 to C8
diagonal   points that fill one diagonal plane evenly
118        points that fill all four diagonal planes, in an order in which every joint moves between two of them
sphere     points that fill the upper half of a sphere evenly, on a short way, for a ballbar (Nubiola, section 2.6.3)
========== ==============================================================================================

Where no orientation is asked for, each point is reached in the orientation that comes of a random configuration near
to it: a calibration learns most from orientations that differ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.motion.cube import Cube
from truearm.engine.motion.joint_motion import Tip
from truearm.engine.motion.largest_cube import LEAST_MOVE, POSES, joints_at, moving_order
from truearm.engine.motion.ordering import short_order, smallest_moves
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.robot import Robot

#: Every set by its name, and how many poses it has where that can be chosen.
POSE_SETS: Final[dict[str, int | None]] = {"p1-p5": None, "iso-cube": None, "diagonal": 25, "118": POSES, "sphere": 50}
#: The golden angle: points on a sphere that turn on by it from one to the next lie evenly.
_GOLDEN_ANGLE: Final = math.pi * (3.0 - math.sqrt(5.0))


@dataclass(frozen=True, eq=False)
class PoseSet:
    """Poses that a robot can go to, in the order in which to go to them."""

    name: str  #: Of the set.
    labels: tuple[str, ...]  #: Of each pose.
    position: Array  #: position, rotation: of the tip in the robot's base frame, ``(n, 3)`` [m] and ``(n, 3, 3)``.
    rotation: Array
    joints: Array  #: Joint positions that reach them [rad or m], ``(n, joints)``.
    planes: tuple[str, ...]  #: Name of the diagonal plane of each pose; empty for poses on none.
    target: str | None  #: Name of the target that goes there; the flange if None.
    missed: tuple[str, ...]  #: Labels of the poses that the robot cannot go to, and are not among these.
    cube: Cube | None  #: In which the poses lie; None for those on a sphere.

    @property
    def smallest_move(self) -> float:
        """Smallest move of any joint between consecutive poses [rad or m]; infinite for a single pose."""
        return float(smallest_moves(self.joints).min(initial=np.inf))


def pose_set(
    robot: Robot,
    name: str,
    cube: Cube,
    *,
    plane: str = "C1-C2-C7-C8",
    count: int | None = None,
    target: str | None = None,
    rotation: Array | None = None,
    least_move: float = LEAST_MOVE,
    seed: int = 0,
) -> PoseSet:
    """Return a set of poses, and which of them the robot cannot go to.

    Args:
        robot: The arm.
        name: One of :data:`POSE_SETS`.
        cube: Where the poses lie. A sphere is about its centre, and half its side is the radius.
        plane: Name of the diagonal plane, for sets on one plane.
        count: How many poses, for sets that leave it open; their own number if None.
        target: Name of the target that goes to the poses; the flange if None.
        rotation: Orientation of the tip at all poses, ``(3, 3)``; any if None.
        least_move: What every joint moves at least from one pose to the next in the set 118 [rad; m for sliding
            joints].
        seed: For the random configurations; the same seed gives the same poses.

    Raises:
        InputError: If there is no such set or plane, the number of poses is fixed, none of them is reached, or no order
            was found in which all joints move.
    """
    if name not in POSE_SETS:
        raise InputError("there is no such set of poses", where="set", came=name, allowed=", ".join(POSE_SETS))
    labels, points, planes = _points(name, cube, plane, _count(name, count))
    rng = np.random.default_rng(seed)
    joints, reached = _joints(robot, points, target, rotation, rng)
    if not reached.any():
        raise InputError(
            "the robot can go to none of these poses",
            where=robot.name,
            came=f"set {name} about {_shown(cube.centre)}, {cube.side * 1e3:.5g} mm",
            cure="Take another centre, a smaller side or another orientation.",
        )
    rows = np.flatnonzero(reached)
    if name == "118":
        positions = joints[rows]
        order = moving_order(robot, positions, points[rows], target, least_move, rng, again=rotation is None)
        joints[rows] = positions  # poses may have been reached anew
        rows = rows[order]
    elif name == "sphere":
        rows = rows[short_order(joints[rows])]
    tip = Tip(robot, target).at(joints[rows])
    missed = tuple(labels[k] for k in np.flatnonzero(~reached))
    return PoseSet(
        name,
        tuple(labels[k] for k in rows),
        tip.position,
        tip.rotation,
        joints[rows],
        tuple(planes[k] for k in rows) if planes else (),
        target,
        missed,
        None if name == "sphere" else cube,
    )


def _count(name: str, count: int | None) -> int:
    usual = POSE_SETS[name]
    if count is None:
        return usual or 0
    if usual is None:
        raise InputError(
            f"the set {name} has a number of poses of its own",
            where="count",
            came=count,
            allowed="a count for diagonal, 118 and sphere",
        )
    return count


def _points(name: str, cube: Cube, plane: str, count: int) -> tuple[list[str], Array, list[str]]:
    """Return labels, places and diagonal planes of the poses of a set."""
    if name == "sphere":
        k = np.arange(count)
        up = (k + 0.5) / count
        turn, out = k * _GOLDEN_ANGLE, np.sqrt(1.0 - up**2)
        unit = np.stack([out * np.cos(turn), out * np.sin(turn), up], axis=1)
        return [str(i + 1) for i in k], cube.centre + cube.side / 2 * unit, []
    if name == "iso-cube":
        return ["P1", *(f"C{i}" for i in range(1, 9))], np.concatenate([cube.centre[None], cube.corners]), []
    if name == "p1-p5":
        return [f"P{i}" for i in range(1, 6)], cube.plane(plane).measuring_points, [plane] * 5
    if name == "diagonal":
        return [str(i + 1) for i in range(count)], cube.plane(plane).spread(count), [plane] * count
    shares = [count // 4 + (number < count % 4) for number in range(4)]
    parts = [diagonal.spread(share) for diagonal, share in zip(cube.planes, shares, strict=True)]
    names = [diagonal.name for diagonal, share in zip(cube.planes, shares, strict=True) for _ in range(share)]
    return [str(i + 1) for i in range(count)], np.concatenate(parts), names


def _joints(
    robot: Robot, points: Array, target: str | None, rotation: Array | None, rng: np.random.Generator
) -> tuple[Array, NDArray[np.bool_]]:
    if rotation is None:
        return joints_at(robot, points, target, rng)
    turned = np.broadcast_to(rotation, (len(points), 3, 3))
    joint_solutions = inverse(robot, points, turned, target=target)
    return joint_solutions.joints, np.array([status.usable for status in joint_solutions.status])


def _shown(point: Array) -> str:
    return "(" + ", ".join(f"{value * 1e3:.5g}" for value in point) + ") mm"
