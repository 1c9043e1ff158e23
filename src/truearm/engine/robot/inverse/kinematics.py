"""Inverse kinematics of the robot as it is: joint positions for poses, with every joint effect of the model.

An arm of six joints whose nominal axes allow it is solved in closed form first, on all branches; from there damped
Newton steps go to the calibrated model. Any other arm, and any task that leaves part of the orientation free, is solved
by the same steps from several starts, the seed first.

Poses are matrices of the tip, in the robot's base frame unless the world is asked for. The base frame is where
calibration left it: base and first joint can share an offset in many ways, and both must be of the same robot file.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truearm.engine.base.arrays import axes, number_array
from truearm.engine.base.errors import InputError, did_you_mean
from truearm.engine.robot.chain import Array
from truearm.engine.robot.frames import Frame, checked_joints, frame_and_tip
from truearm.engine.robot.inverse.branch_search import REACHED, BranchSearch, Candidates
from truearm.engine.robot.inverse.branches import BRANCHES, ClosedForm, branch_number, branch_rule
from truearm.engine.robot.inverse.pose_solver import (
    ORIENTATIONS,
    JointSolutions,
    Orientation,
    PoseStatus,
    PoseTask,
    smallest_singular_value,
)
from truearm.engine.robot.transform import IDENTITY, quaternion_from_rotation, rotation_from_quaternion

if TYPE_CHECKING:
    from truearm.engine.robot.robot import Robot

#: A rotation matrix may be off by this much, as by rounding; it is then made exact.
ROTATION_TOLERANCE: Final = 1e-6
#: Below this singular value [reach lengths, rad] a posture is called near-singular: there 0.1 mm may take 2 deg.
NEAR_SINGULAR: Final = 5e-3
#: Starts of an arm without closed form: around the seed [rad], then anywhere within the limits.
_SPREAD_AROUND_SEED: Final = 0.3
_ROUNDS: Final = 4
_STARTS_A_ROUND: Final = 4
#: Steps at most to a pose beside its seed: five are enough for nearly all.
_STEPS_BESIDE: Final = 10


def inverse(
    robot: Robot,
    positions: ArrayLike,
    rotations: ArrayLike | None = None,
    *,
    target: str | None = None,
    frame: Frame = "base",
    branch: str | None = None,
    seed: ArrayLike | None = None,
    orientation: Orientation = "full",
) -> JointSolutions:
    """Return joint positions that bring the flange, or a target, to poses.

    The arm is at rest; what depends on the way it came, on temperature or on an external force is left out.

    Parameters
    ----------
    robot
        With the parameter values and joint effects that shall hold.
    positions
        [m], ``(n, 3)``, or ``(3,)`` of one pose.
    rotations
        Rotation matrices, ``(n, 3, 3)``, or ``(3, 3)`` of one pose; None with ``orientation="free"``.
    target
        Name of the target that shall be there; the flange if None. A target without orientation has the flange's.
    frame
        What the poses are given in: ``base``, the robot's base; ``world``, the instrument's frame; or ``controller``,
        the base frame of its controller, in which the flange is the controller's, too.
    branch
        A branch by name, ``all``, or None for the one nearest to the seed that lies within the limits.
    seed
        Joint positions ``(joints,)`` or ``(n, joints)`` [rad or m] near which the answer shall lie; zero if None.
    orientation
        ``full``; ``axis`` if only the direction of the z axis counts, as for an arm of five joints; ``free`` if only
        the position does.

    Raises
    ------
    InputError
        If an array has the wrong shape or a NaN, a matrix is no rotation, the arm has fewer than three joints, or the
        branch has no such name or the arm no named branches.
    """
    if len(robot.joints) < 3:
        raise InputError(
            "inverse kinematics needs an arm of three joints or more",
            parameter="robot",
            where=robot.name,
            came=len(robot.joints),
        )
    task = _task(robot, positions, rotations, target, frame, orientation)
    near, turned = _seed(task.robot, seed, task.position.shape[1])
    rule = branch_rule(robot) if orientation == "full" else None
    form = ClosedForm(robot, target) if rule is not None else None
    if rule is not None and form is not None and form.known:
        number = branch_number(branch) if branch not in (None, "all") else None
        search = BranchSearch(task, near, turned, rule, form)
        pool = search.every_branch() if branch == "all" else search.one_branch(number)
        return _answer(task, pool, pool.every_branch() if branch == "all" else pool.best(number), number)
    if branch is not None:
        raise InputError(
            "branches have no names for this robot or pose",
            parameter="branch",
            came=branch,
            allowed="no branch: the answer nearest to the seed is taken",
            cure="Named branches need six turning joints with a closed form, and the whole orientation.",
        )
    return _by_starts(task, near, turned)


def inverse_beside(robot: Robot, positions: Array, rotations: Array, seed: Array) -> JointSolutions:
    """Return what steps from the seeds lead to, for poses of the flange in the robot's base frame.

    A fraction of the work of :func:`inverse`, and as good where a pose is reached beside its seed and away from
    singular postures; nothing is looked for elsewhere.
    """
    task = _task(robot, positions, rotations, None, "base", "full")
    near, turned = _seed(robot, seed, len(positions))
    pool = Candidates(task, near, branch_rule(robot))
    pool.add(np.arange(len(near)), turned, most=_STEPS_BESIDE)
    return _answer(task, pool, pool.best(None), None)


# -- by starts --------------------------------------------------------------------------------------------


def _by_starts(task: PoseTask, seed: Array, turned: Array) -> JointSolutions:
    robot, rng = task.robot, np.random.default_rng(0)
    pool = Candidates(task, seed, None)
    everyone = np.arange(len(seed))
    pool.add(everyone, turned)
    for number in range(_ROUNDS):
        missing = np.repeat(everyone[~pool.satisfied(None)], _STARTS_A_ROUND)
        if not len(missing):
            break
        if number:
            starts = robot.random_configurations(len(missing), rng)
        else:
            starts = turned[missing] + _SPREAD_AROUND_SEED * rng.standard_normal((len(missing), len(robot.joints)))
        pool.add(missing, starts)
    return _answer(task, pool, pool.best(None), None)


# -- the answer -------------------------------------------------------------------------------------------


def _answer(task: PoseTask, pool: Candidates, rows: NDArray[np.intp], wanted: int | None) -> JointSolutions:
    pose, joints = pool.pose[rows], pool.joints[rows]
    numbers, reached, beyond = pool.number[rows], pool.reached[rows], pool.beyond[rows]
    position_error, orientation_error = pool.position_error[rows], pool.orientation_error[rows]
    if task.robot.effects:
        # A joint that is all but balanced can come to rest on either side of its play, and the arm elsewhere; and no
        # joint positions may turn the joints as the steps found, with a gain near zero for example.
        part, at_rest = task.of(pose), task.robot.variables(joints, task.robot.values)
        position, angle = part.distances(part.error(part.forward_kinematics(at_rest)))
        loaded = any(effect.loaded for effect in task.robot.effects)
        meets = (position <= REACHED) & (angle <= REACHED)
        position_error = np.where(meets & (not loaded), position_error, position)
        orientation_error = np.where(meets & (not loaded), orientation_error, angle)
        reached = reached & meets
    if task.orientation == "free":
        orientation_error = np.full(len(rows), np.nan)
    singular_value = smallest_singular_value(task.of(pose), pool.variables[:, rows])
    status = np.full(len(rows), PoseStatus.REACHED, dtype=object)
    status[singular_value < NEAR_SINGULAR] = PoseStatus.NEAR_SINGULAR
    status[beyond.any(axis=1)] = PoseStatus.BEYOND_LIMIT
    if wanted is not None:
        status[numbers != wanted] = PoseStatus.BRANCH_LOST
    status[~reached] = PoseStatus.UNREACHABLE
    return JointSolutions(
        poses=task.position.shape[1],
        pose=pose,
        joints=joints,
        status=tuple(status.tolist()),
        branch=tuple(BRANCHES[number] if number >= 0 else "" for number in numbers.tolist()),
        position_error=position_error,
        orientation_error=orientation_error,
        beyond=beyond,
        singular_value=singular_value,
        joint_names=tuple(joint.name for joint in task.robot.joints),
    )


# -- the question -----------------------------------------------------------------------------------------


def _task(
    robot: Robot,
    positions: ArrayLike,
    rotations: ArrayLike | None,
    target: str | None,
    frame: Frame,
    orientation: Orientation,
) -> PoseTask:
    p = _array(positions, "positions", 3)
    if target is not None:
        robot.target(target)  # refuses an unknown one
    base, tip = frame_and_tip(robot, frame, target)
    if not isinstance(orientation, str) or orientation not in ORIENTATIONS:
        raise InputError(
            "there is no such choice",
            parameter="orientation",
            came=orientation,
            allowed=", ".join(ORIENTATIONS),
            cure=did_you_mean(orientation, ORIENTATIONS) if isinstance(orientation, str) else None,
        )
    if orientation != "full" and tip != IDENTITY:
        raise InputError(
            "the controller's flange is not the model's, so a part of a pose of it says nothing of the other",
            parameter="orientation",
            came=orientation,
            allowed="full in the frame controller",
            cure="Give whole poses, name a target, or use `frame=base`.",
        )
    if rotations is None:
        if orientation != "free":
            raise InputError(
                "the poses have no orientation",
                parameter="rotations",
                allowed="rotation matrices, (n, 3, 3)",
                cure="Give them, or ask for the position alone: `orientation=free`.",
            )
        R = np.broadcast_to(np.eye(3), (len(p), 3, 3))
    else:
        R = _rotations(rotations, len(p))
    if frame != "world":
        if tip != IDENTITY:
            R = R @ tip.rotation.T
            p = p - R @ np.array(tip.translation)
        p, R = p @ base.rotation.T + np.array(base.translation), base.rotation @ R
    x, y, z = np.ascontiguousarray(R.transpose(2, 1, 0))
    return PoseTask(robot, target, orientation, np.ascontiguousarray(p.T), (x, y, z), reach(robot, target))


def _array(value: ArrayLike, parameter: str, *shape: int) -> Array:
    """Return an array of one row a pose; a single pose may come without its axis."""
    return number_array([value] if axes(value) == len(shape) else value, parameter, ("n", *shape))


def _rotations(value: ArrayLike, count: int) -> Array:
    R = _array(value, "rotations", 3, 3)
    if len(R) != count:
        raise InputError(
            "there are not as many rotations as positions", parameter="rotations", came=len(R), allowed=f"{count}"
        )
    off = np.abs(R.swapaxes(1, 2) @ R - np.eye(3)).max(axis=(1, 2), initial=0.0)
    wrong = np.flatnonzero((off > ROTATION_TOLERANCE) | (np.linalg.det(R) < 0))
    if len(wrong):
        row = int(wrong[0])
        left = off[row] <= ROTATION_TOLERANCE
        raise InputError(
            "the matrix is a reflection, not a rotation"
            if left
            else "the matrix is not a rotation: its columns are not orthonormal",
            parameter="rotations",
            where=f"rotations, row {row}",
            came=f"determinant {np.linalg.det(R[row]):.6g}" if left else f"R'R off from 1 by {off[row]:.3g}",
            allowed="determinant 1" if left else f"within {ROTATION_TOLERANCE:g}",
            cure="Check rows against columns, and that no digits were lost.",
        )
    return rotation_from_quaternion(quaternion_from_rotation(R))


def _seed(robot: Robot, seed: ArrayLike | None, count: int) -> tuple[Array, Array]:
    """Return joint positions, and what they turn the joints by [rad or m], ``(n, joints)`` each."""
    joints = len(robot.joints)
    values = checked_joints(robot, np.zeros(joints) if seed is None else seed, "seed")
    if len(values) not in (1, count):
        raise InputError(
            "there are not as many seeds as poses", parameter="seed", came=len(values), allowed=f"1 or {count}"
        )
    turned = robot.variables(values, robot.values)[:joints].T
    return np.broadcast_to(values, (count, joints)), np.broadcast_to(turned, (count, joints))


def reach(robot: Robot, target: str | None) -> float:
    """Return the length of the stretched arm from its first joint [m]."""
    kinematics = robot.rigid.forward_kinematics(np.zeros((1, len(robot.joints))), target)
    places = [i for i, element in enumerate(kinematics.elements) if element.variable is not None]
    points = [*(kinematics.origin(i)[:, 0] for i in places), kinematics.position[:, 0]]
    return float(sum(np.linalg.norm(b - a) for a, b in pairwise(points)))
