"""Poses to measure in the cube of ISO 9283: points on its diagonal planes, joints that reach them, and their order.

The points are shared evenly among the four diagonal planes and fill each of them from edge to edge
(:meth:`~truearm.planning.poses.iso9283.DiagonalPlane.spread`). The corners of the largest cube lie on the boundary
of the workspace, so some points come near to it. The standard asks for points, an arm of five joints cannot be asked
for orientations as well, and a calibration learns most from orientations that differ: each point is reached from the
nearest of many random configurations, in the orientation that comes of it. Whether the arm touches itself or its
surroundings is not looked at.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.inverse import PoseStatus, inverse
from truearm.modeling.robot import Robot
from truearm.planning.choosing.ordering import all_moving_order, smallest_moves
from truearm.planning.poses.iso9283 import Cube
from truearm.planning.poses.tip import Tip

#: Poses of the set (Patel, section 4.4.2).
POSES: Final = 118
#: What every joint moves at least from one pose to the next [rad; m for sliding joints].
LEAST_MOVE: Final = math.radians(2.0)
#: Random configurations, and how many of those nearest to a point are tried one after the other.
_STARTS: Final = 5_000
_DRAWS: Final = 6
_ORDERS: Final = 10


@dataclass(frozen=True, eq=False)
class PosePlan:
    """Poses to measure, in the order in which to measure them."""

    cube: Cube  #: They lie on its diagonal planes.
    points: Array  #: Where the tip goes, in the base frame [m], ``(n, 3)``.
    approach: Array  #: Direction of the tip's z axis there, ``(n, 3)``.
    plane: tuple[str, ...]  #: Name of the diagonal plane of each point.
    joints: Array  #: Joint positions that reach the points [rad or m], ``(n, joints)``.
    target: str | None  #: Name of the target that goes there; the flange if None.

    @property
    def smallest_move(self) -> float:
        """Smallest move of any joint between consecutive poses [rad or m]; infinite for a single pose."""
        return float(smallest_moves(self.joints).min(initial=np.inf))


def plan_poses(
    robot: Robot,
    cube: Cube,
    *,
    target: str | None = None,
    count: int = POSES,
    least_move: float = LEAST_MOVE,
    seed: int = 0,
) -> PosePlan:
    """Return poses on the diagonal planes of a cube, ordered so that all joints move from one to the next.

    Args:
        robot: The arm.
        cube: From :func:`truearm.planning.poses.largest_cube.largest_cube`, or of one's own choice.
        target: Name of the target that goes to the points; the flange if None.
        count: How many poses.
        least_move: What every joint moves at least from one pose to the next [rad; m for sliding joints].
        seed: For the random configurations; the same seed gives the same poses.

    Raises:
        InputError: If the count is not positive, a point is not reached, or no order was found in which all joints
            move.
    """
    if isinstance(count, bool) or count < 1:
        raise InputError("at least one pose is needed", where="count", came=count, allowed="1 or more")
    if not (math.isfinite(least_move) and least_move >= 0):
        raise InputError("a move must not be negative", where="least move", came=least_move, allowed="0 or more")
    shares = [count // 4 + (plane < count % 4) for plane in range(4)]
    points = np.concatenate([plane.spread(share) for plane, share in zip(cube.planes, shares, strict=True)])
    names = np.repeat([plane.name for plane in cube.planes], shares)
    rng = np.random.default_rng(seed)
    joints = _joints_at_all(robot, points, target, rng)
    order = moving_order(robot, joints, points, target, least_move, rng)
    approach = Tip(robot, target).at(joints[order]).rotation[:, :, 2]
    return PosePlan(cube, points[order], approach, tuple(names[order].tolist()), joints[order], target)


def moving_order(
    robot: Robot,
    joints: Array,
    points: Array,
    target: str | None,
    least_move: float,
    rng: np.random.Generator,
    *,
    again: bool = True,
) -> NDArray[np.intp]:
    """Return an order of poses in which all joints move from one to the next, ``(n,)``.

    Args:
        joints: Joint positions at the poses ``(n, joints)``. Where no order was found they are changed, if `again`
            allows it.
        points: Where the tip goes [m], ``(n, 3)``.
        target: Name of the target that goes there; the flange if None.
        least_move: What every joint moves at least [rad; m for sliding joints].
        again: Whether poses may be reached anew, in other orientations.

    Raises:
        InputError: If no such order was found.
    """
    stuck = np.zeros(0, dtype=np.intp)
    for _ in range(_ORDERS):
        order = all_moving_order(joints, least_move)
        stuck = order[1:][smallest_moves(joints[order]) < least_move]
        if not len(stuck):
            return order
        if not again:
            break
        anew, reached = joints_at(robot, points[stuck], target, rng)
        joints[stuck[reached]] = anew[reached]
    raise InputError(
        "no order of the poses was found in which all joints move",
        where=robot.name,
        came=f"{len(stuck)} of {len(joints) - 1} moves too small for {math.degrees(least_move):.3g} deg in every joint",
        cure="Ask for a smaller least move or fewer poses." if again else "Leave the orientation free.",
    )


def joints_at(
    robot: Robot, points: Array, target: str | None, rng: np.random.Generator
) -> tuple[Array, NDArray[np.bool_]]:
    """Return joint positions that bring a tip to points in any orientation, away from singular postures if possible.

    Each point is reached from the nearest of many random configurations.

    Args:
        points: In the base frame [m], ``(n, 3)``.
        target: Name of the target that goes there; the flange if None.

    Returns:
        joints: Joint positions within the limits ``(n, joints)`` [rad or m]; of no meaning where a point is not
            reached.
        reached: ``(n,)``.
    """
    joints = np.zeros((len(points), len(robot.joints)))
    regular, reached = np.zeros((2, len(points)), dtype=bool)
    turning = [joint.kind == "revolute" for joint in robot.joints]
    starts = robot.random_configurations(_STARTS, rng)
    starts[:, turning] = (starts[:, turning] + np.pi) % (2 * np.pi) - np.pi  # a second turn teaches nothing
    near = cKDTree(Tip(robot, target).positions(starts)).query(points, _DRAWS)[1]
    for draw in range(_DRAWS):
        left = np.flatnonzero(~regular)
        if not len(left):
            break
        start = starts[np.asarray(near)[left, draw]]
        found = inverse(robot, points[left], target=target, orientation="free", seed=start)
        usable = np.array([status.usable for status in found.status])
        joints[left[usable]] = found.joints[usable]
        reached[left[usable]] = True
        regular[left] = [status is PoseStatus.REACHED for status in found.status]
    return joints, reached


def _joints_at_all(robot: Robot, points: Array, target: str | None, rng: np.random.Generator) -> Array:
    joints, reached = joints_at(robot, points, target, rng)
    if not reached.all():
        missed = points[~reached]
        raise InputError(
            "the arm does not reach all points of the cube within its limits",
            where=robot.name,
            came=f"{len(missed)} of {len(points)} points out of reach, such as {np.round(missed[0] * 1e3, 1)} mm",
            cure="Take a smaller cube or another centre; largest_cube finds one.",
        )
    return joints
