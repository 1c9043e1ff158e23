"""The largest cube in front of an arm (ISO 9283), and poses to measure on its diagonal planes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.motion.cube import Cube
from truearm.engine.motion.joint_motion import Tip
from truearm.engine.motion.ordering import all_moving_order, smallest_moves
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.branch_search import limits
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.inverse.pose_solver import PoseStatus
from truearm.engine.robot.robot import Robot

# Poses to measure in the cube of ISO 9283: points on its diagonal planes, joints that reach them, and their order.
#
# The points are shared evenly among the four diagonal planes and fill each of them from edge to edge
# (:meth:`~truearm.engine.motion.cube.DiagonalPlane.spread`). The corners of the largest cube lie on the boundary
# of the workspace, so some points come near to it. The standard asks for points, an arm of five joints cannot be asked
# for orientations as well, and a calibration learns most from orientations that differ: each point is reached from the
# nearest of many random configurations, in the orientation that comes of it. Whether the arm touches itself or its
# surroundings is not looked at.

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
        cube: From :func:`truearm.engine.motion.largest_cube.largest_cube`, or of one's own choice.
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
    from scipy.spatial import cKDTree

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
        joint_solutions = inverse(robot, points[left], target=target, orientation="free", seed=start)
        usable = np.array([status.usable for status in joint_solutions.status])
        joints[left[usable]] = joint_solutions.joints[usable]
        reached[left[usable]] = True
        regular[left] = [status is PoseStatus.REACHED for status in joint_solutions.status]
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


Direction = Literal["+x", "-x", "+y", "-y"]
DIRECTIONS: Final = ("+x", "-x", "+y", "-y")

_SAMPLES: Final = 50_000
#: A point is near to a sample within this [reach lengths].
_NEAR_SAMPLE: Final = 0.06
#: Spacing of the lattice of centres and sides [reach lengths].
_LATTICE: Final = 1 / 12
#: The search goes from the first step to the second, and for the best from there to the third [reach lengths].
_STEPS: Final = (1 / 16, 1 / 64, 1 / 500)
_FINALISTS: Final = 5
#: Cubes of the lattice from which it is made.
_STARTS_LARGEST_CUBE: Final = 24
_MOVES: Final = np.array([(ahead, up, 0.5) for ahead, up in product((0, -1, 1), repeat=2)])
#: Places on each diagonal plane that have to be reached, from edge to edge; and of its corners alone.
_PLACES: Final = np.linspace(-1.0, 1.0, 9)
_CORNERS: Final = np.array([-1.0, 1.0])
#: Newton's steps from so many of the nearest samples, their damping, and when a point is met [reach lengths].
_SEEDS: Final = 4
_MOST_STEPS: Final = 12
_DAMPING: Final = 1e-3
_REACHED: Final = 1e-6


# Where the tip gets to is first looked up among many random configurations: a point counts as reached if the tip came
# near to it. The best cubes of a coarse lattice are then moved and grown in ever smaller steps, while damped Newton's
# steps from the nearest of those configurations reach a grid of points on the diagonal planes, edges and corners
# included, within the joint limits and in any orientation.
def largest_cube(
    robot: Robot, *, target: str | None = None, ahead: Direction = "+x", nearest: float = 0.0, floor: float = 0.0
) -> Cube:
    """Return the largest cube in front of an arm on whose diagonal planes it reaches every point of a 9 x 9 grid.

    The cube is centred on the plane that holds the z axis of the base frame and the direction `ahead`. Whether the arm
    touches itself, its tool or its surroundings is not looked at: `nearest` and `floor` keep the cube away from base
    and table. Of many local searches the best one counts; the largest cube there is may be a hundredth larger.

    Args:
        robot: The arm.
        target: Name of the target that shall reach the points; the flange if None.
        ahead: Direction from the base in which work is done.
        nearest: How far ahead of the base's origin the cube begins at the nearest [m].
        floor: How high above the base's origin it begins at the lowest [m].

    Raises:
        InputError: If the arm reaches no cube in this direction.
    """
    if ahead not in DIRECTIONS:
        raise InputError("there is no such direction", where="ahead", came=ahead, allowed=", ".join(DIRECTIONS))
    for name, bound in (("nearest", nearest), ("floor", floor)):
        if not math.isfinite(bound):
            raise InputError("a bound of the cube must be a finite number", where=name, came=bound)
    return _Search(robot, target, ahead, nearest, floor).largest()


class _Search:
    def __init__(self, robot: Robot, target: str | None, ahead: Direction, nearest: float, floor: float) -> None:
        from scipy.spatial import cKDTree

        self._robot, self._nearest, self._floor = robot, nearest, floor
        self._ahead = np.zeros(3)
        self._ahead["xy".index(ahead[1])] = 1.0 if ahead[0] == "+" else -1.0
        self._joints = robot.random_configurations(_SAMPLES, np.random.default_rng(0))
        self._limits, self._tip = limits(robot), Tip(robot, target)
        tips = self._tip.positions(self._joints)
        self._length = float(np.linalg.norm(tips, axis=1).max())  # the reach
        self._tree = cKDTree(tips)

    def largest(self) -> Cube:
        """Return the largest cube that was found."""
        places = self._starts()
        if len(places):
            places = self._grown(self._shrunk(places), *_STEPS[:2])
            best = np.argsort(-places[:, 2], kind="stable")[:_FINALISTS]
            places = self._grown(places[best], *_STEPS[1:])
        if not len(places):
            raise InputError(
                "the arm reaches no cube in this direction",
                where=self._robot.name,
                came=f"from {self._nearest * 1e3:g} mm ahead and {self._floor * 1e3:g} mm up",
                cure="Choose another direction or floor, or give centre and side of the cube.",
            )
        return self._cube(places[int(np.argmax(places[:, 2]))])

    def _starts(self) -> Array:
        """Return distance ahead, height and side of large cubes of a lattice near to samples everywhere, well apart."""
        step = _LATTICE * self._length
        near: list[Array] = []
        for side in np.arange(2, 16) * step:
            lattice = product(np.arange(0, 13) * step, np.arange(-12, 13) * step, [side])
            places = np.array(list(lattice))
            places = places[self._allowed(places)]
            distance, _ = self._tree.query(self._points(places), distance_upper_bound=_NEAR_SAMPLE * self._length)
            near = [*places[np.isfinite(distance).all(axis=1)], *near]
        starts: list[Array] = []
        for place in near:
            if all(np.abs(place - other).max() > 1.5 * step for other in starts):
                starts.append(place)
        return np.array(starts[:_STARTS_LARGEST_CUBE])

    def _shrunk(self, places: Array) -> Array:
        """Return those cubes that are reached when they are made a little smaller."""
        for _ in range(4):
            places[~self._reached(places), 2] -= _STEPS[0] * self._length / 2
        return places[self._reached(places)]

    def _grown(self, places: Array, first: float, last: float) -> Array:
        """Return cubes moved and grown as far as steps lead, from the first size down to the last [reach lengths]."""
        size = np.full(len(places), first * self._length)
        while (active := np.flatnonzero(size > last * self._length)).size:
            tried = places[active, None] + _MOVES * size[active, None, None]
            good = self._reached(tried.reshape(-1, 3)).reshape(tried.shape[:2])
            better = good.any(axis=1)
            places[active[better]] = tried[better, good[better].argmax(axis=1)]
            size[active[~better]] /= 2
        return places

    def _reached(self, places: Array) -> NDArray[np.bool_]:
        """Return which cubes are reached, corners first, because they are where most fail."""
        left = np.flatnonzero(self._allowed(places))
        for grid in (_CORNERS, _PLACES):
            left = left[self._all_reached(self._points(places[left], grid))]
        reached = np.zeros(len(places), dtype=bool)
        reached[left] = True
        return reached

    def _all_reached(self, points: Array) -> NDArray[np.bool_]:
        """Return of which rows ``(n, points, 3)`` all points are reached."""
        wanted = points.reshape(-1, 3)
        missed = np.arange(len(wanted))
        for nearest in range(1, _SEEDS + 1):
            sample = np.asarray(self._tree.query(wanted[missed], [nearest])[1])[:, 0]
            missed = missed[~self._met(wanted[missed], self._joints[sample])]
        lost = np.zeros(len(wanted), dtype=bool)
        lost[missed] = True
        return np.asarray(~lost.reshape(points.shape[:2]).any(axis=1))

    def _met(self, wanted: Array, q: Array) -> NDArray[np.bool_]:
        """Return which points ``(n, 3)`` damped Newton's steps reach from the joints `q`, held within the limits."""
        met = np.zeros(len(wanted), dtype=bool)
        going = np.arange(len(wanted))
        for _ in range(_MOST_STEPS):
            position, linear = self._tip.moved(q)
            error = wanted[going] - position
            left = np.linalg.norm(error, axis=1) > _REACHED * self._length
            met[going[~left]] = True
            going, q, error, J = going[left], q[left], error[left], linear[left]
            normal = J @ J.swapaxes(1, 2) + (_DAMPING * self._length) ** 2 * np.eye(3)
            q = np.clip(q + (J * np.linalg.solve(normal, error[:, :, None])).sum(1), *self._limits)
        return met

    def _allowed(self, places: Array) -> NDArray[np.bool_]:
        """Return which cubes ``(n, 3)`` lie beyond what is nearest and above the floor."""
        ahead, height, side = places.T
        slack = 1e-9 * self._length
        return np.asarray((ahead - side / 2 >= self._nearest - slack) & (height - side / 2 >= self._floor - slack))

    def _points(self, places: Array, grid: Array = _PLACES) -> Array:
        """Return the points at a grid on the diagonal planes of cubes, ``(n, points, 3)``."""
        unit = Cube(np.zeros(3), 1.0)
        u, v = (axis.ravel() for axis in np.meshgrid(grid, grid))
        shape = np.concatenate([plane.points(u, v) for plane in unit.planes])
        ahead, height, side = places.T
        centre = np.multiply.outer(ahead, self._ahead) + np.multiply.outer(height, [0.0, 0.0, 1.0])
        return np.asarray(centre[:, None] + side[:, None, None] * shape)

    def _cube(self, place: Array) -> Cube:
        return Cube(place[0] * self._ahead + np.array([0.0, 0.0, place[1]]), float(place[2]))
