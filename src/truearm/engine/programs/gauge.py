"""What calibration cannot know of base and flange, and how it is kept out of programs.

After a calibration the shift of the base against joint 1, and of the tool against joint 6, is arbitrary: readings of a
target say where the target is, and not where the robot's base plate and its flange are. Written into a program, that
shift would move all of it. So unless somebody says where a program's tool and frames really are, the identified flange
is taken to be where it agrees best with the nominal one all over the workspace, and the base to be where the
corrections of the program have no part that a motion of all targets together would make. A work object that was
located by points with the uncorrected robot is in its place then.

How far the real flange may be from there is part of what is expected of targets: no reading tells it, but the other
links tell how accurately the arm is made.

A calibration that held the base, or targets on the flange, knows them: then the identified base is the real one, and a
held target stays where it is on the flange.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.engine.fit.fit import Fit
from truearm.engine.programs.fake_targets import matrices, nominal_robot
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.kinematics import reach
from truearm.engine.robot.parameters import PRIOR, Group, Unit
from truearm.engine.robot.proof import BASE, FLANGE
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rotation_from_vector, rotation_vector

#: Share of the largest below which a singular value is none.
_RANK: Final = 1e-6
#: Configurations on which flange and base are compared.
_CONFIGURATIONS: Final = 300
_ROUNDS: Final = 8
#: The common part of the corrections counts as zero below this [m, rad].
_ZERO: Final = 1e-10
#: What a turn of a tool counts as beside a shift of its tip [m]. Work objects are located by points: orientations tell
#: only how targets are turned together that are all in one place or on one line.
_TOOL: Final = 1e-3
#: Share of its prior variance up to which a combination of parameters was told by a calibration; so many of them say
#: how accurate an arm is.
_MOST_LEFT: Final = 0.1
_LEAST_DETERMINED: Final = 4


def best_agreement(robot: Robot) -> tuple[Array, Array]:
    """Return where the base and flange of the nominal robot are in the identified ones.

    The weighted squares of the differences of both robots' flange poses, at random configurations within the limits,
    are least; an angle counts as what it moves at the length of the arm.

    Args:
        robot: Calibrated.

    Returns:
        base, flange: ``T_base_nominalbase`` and ``T_flange_nominalflange``, ``(4, 4)`` each [m].
    """
    base, flange, _ = _agreement(robot, nominal_robot(robot), not base_fixed(robot), _flange_freedom(robot))
    return base, flange


def base_fixed(robot: Robot) -> bool:
    """Return whether the calibration of a robot held its base."""
    return robot.proof is not None and BASE in robot.proof.held


def flange_fixed(robot: Robot) -> bool:
    """Return whether targets that the calibration of a robot held say where its flange is."""
    return robot.proof is not None and not _flange_freedom(robot).shape[1]


def fixed_by(fit: Fit) -> tuple[str, ...]:
    """Return how a proof says what a fit has held."""
    held = fit.fixed.names(fit.robot)
    targets = [name for name in held if fit.robot.parameters[name].group == "target"]
    names = [BASE] if fit.fixed.base is not None else []
    if not _freedom_beside(fit.robot, targets).shape[1]:
        names.append(FLANGE)
    return (*names, *targets)


def _flange_freedom(robot: Robot) -> Array:
    """Return the motions of a flange that leave the targets held on it where they are, ``(6, k)``."""
    fixed = () if robot.proof is None else robot.proof.held
    return np.zeros((6, 0)) if FLANGE in fixed else _freedom_beside(robot, fixed)


def _freedom_beside(robot: Robot, fixed: Sequence[str]) -> Array:
    rows = [np.zeros((1, 6))]
    for target in robot.targets:
        if target.parameter("x") in fixed:
            x, y, z = (robot.values[target.parameter(axis)] for axis in "xyz")
            rows.append(np.column_stack([np.eye(3), [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]]))
        if target.parameter("rx") in fixed:
            rows.append(np.eye(3, 6, 3))
    _, s, Vt = np.linalg.svd(np.concatenate(rows), full_matrices=True)
    return np.asarray(Vt[int((s > _RANK).sum()) :].T)


def disagreement(robot: Robot, nominal: Robot) -> float:
    """Return how far the flange of a nominal robot is from the identified one where both agree best [m], on average."""
    return _agreement(robot, nominal, True, np.eye(6))[2]


def _agreement(robot: Robot, nominal: Robot, base_moves: bool, freedom: Array) -> tuple[Array, Array, float]:
    """Return where base and flange of a nominal robot agree best with the identified ones, and what is left [m].

    Args:
        base_moves: Whether the base may differ.
        freedom: Motions by which the flange may, ``(6, k)``.
    """
    joints = robot.random_configurations(_CONFIGURATIONS, np.random.default_rng(0))
    nominal_poses, real_poses = matrices(nominal, joints), np.linalg.inv(robot.base.matrix) @ matrices(robot, joints)
    weight = np.repeat([1.0, reach(nominal, None)], 3)
    base, before_flange = np.eye(4), np.eye(4)
    for _ in range(_ROUNDS):
        expected = base @ nominal_poses @ before_flange
        missed = np.concatenate(
            [real_poses[:, :3, 3] - expected[:, :3, 3], turns_between(expected, real_poses)], axis=1
        )
        rows = np.concatenate([_by_base(expected)[:, :, : 6 * base_moves], _by_flange(expected) @ freedom], axis=2)
        if not rows.shape[2]:
            break
        rows = (rows * weight[:, None]).reshape(-1, rows.shape[2])
        step, *_ = np.linalg.lstsq(rows, (missed * weight).ravel(), rcond=None)
        if base_moves:
            base = _small(step[:6]) @ base
        before_flange = before_flange @ _small(freedom @ step[6 * base_moves :])
    left = real_poses[:, :3, 3] - (base @ nominal_poses @ before_flange)[:, :3, 3]
    return base, np.asarray(np.linalg.inv(before_flange)), float(np.linalg.norm(left, axis=1).mean())


def flange_rates(robot: Robot, names: Sequence[str]) -> Array:
    """Return how the flange of :func:`best_agreement` moves with parameters of the identified robot.

    Args:
        names: Of the parameters; those of the base count for nothing.

    Returns:
        rates: ``(6, parameters)``: translation and rotation vector of the flange in its own axes [m, rad per unit].
    """
    joints = robot.random_configurations(_CONFIGURATIONS, np.random.default_rng(0))
    poses = matrices(robot, joints)
    moved = np.concatenate(robot.jacobians(robot.forward_kinematics(joints), joints, names), axis=1)
    moved[[robot.parameters[name].group == "base" for name in names]] = 0.0
    weight = np.repeat([1.0, reach(nominal_robot(robot), None)], 3)
    freedom, base_moves = _flange_freedom(robot), not base_fixed(robot)
    if not freedom.shape[1]:
        return np.zeros((6, len(names)))
    rows = np.concatenate([_by_base(poses)[:, :, : 6 * base_moves], _by_flange(poses) @ freedom], axis=2)
    right = (np.moveaxis(moved, 2, 0) * weight).swapaxes(1, 2).reshape(-1, len(names))
    explained, *_ = np.linalg.lstsq((rows * weight[:, None]).reshape(-1, rows.shape[2]), right, rcond=None)
    return np.asarray(freedom @ explained[6 * base_moves :])


def flange_spread(robot: Robot, *, taught: bool = False) -> Array:
    """Return how far the real flange may be from where it is taken to be, which no reading tells.

    It is made as accurately as the links are. So each of its six motions has the prior of a length, an angle or a joint
    zero, times what the calibration found of how far these are from nominal in units of their priors. Along and about
    the last axis the errors of two links add. Beside it, a flange that is turned on its bearings is where it should be:
    half of them are taken for such. Targets that were held on the flange leave what they do not determine.

    Args:
        robot: Calibrated.
        taught: Whether the tool was found with this robot before its calibration: what the robot missed then is as
            large, and no target that was held says it.

    Returns:
        spread: ``(6, 6)``: translation and rotation vector of the flange in its own axes [m, rad], by independent
            numbers of deviation 1, one for each; see :func:`flange_draws`.
    """
    length, angle = _identified_accuracy(robot, "geometry", "m"), _identified_accuracy(robot, "geometry", "rad")
    zero = _identified_accuracy(robot, "joint zero", "rad")
    size = np.array([length, length, 2.0 * length, angle, angle, 2.0 * zero]) / math.sqrt(2.0)
    freedom = np.eye(6) if taught else _flange_freedom(robot)
    within = (freedom / size[:, None] ** 2).T
    return np.asarray(freedom @ np.linalg.solve(within @ freedom, within) * size)


def flange_draws(count: int) -> Array:
    """Return draws of the numbers of :func:`flange_spread`, ``(6, count)``: in half of them it is on the last axis."""
    rng = np.random.default_rng(1)
    drawn = rng.standard_normal((6, count))
    drawn[[0, 1, 3, 4]] *= math.sqrt(2.0) * rng.integers(0, 2, count)
    return drawn


def _identified_accuracy(robot: Robot, group: Group, unit: Unit) -> float:
    """Return the deviation from nominal of the parameters of a kind, as far as a calibration told them [m or rad].

    It is their prior where the calibration told less than four of them, or nothing is known of how well it did.
    """
    prior = robot.priors.get(unit, PRIOR[group, unit])
    nominal = nominal_robot(robot).parameters
    names = [] if robot.proof is None else [n for n in robot.proof.names if n in nominal]
    names = [n for n in names if (nominal[n].group, nominal[n].unit) == (group, unit)]
    if robot.proof is None or len(names) < _LEAST_DETERMINED:
        return prior
    rows = [robot.proof.names.index(name) for name in names]
    moved = np.array([robot.values[name] - nominal[name].value for name in names]) / prior
    left, axes = np.linalg.eigh(robot.proof.covariance[np.ix_(rows, rows)] / prior**2)
    determined = left < _MOST_LEFT
    if determined.sum() < _LEAST_DETERMINED:
        return prior
    return prior * max(float(np.sqrt(np.mean((axes[:, determined].T @ moved) ** 2))), _RANK)


def base_shift(corrected: Callable[[Array], tuple[Array, Array]], start: Array) -> Array:
    """Return where the nominal base has to be in the identified one for the corrections to have no common part.

    Args:
        corrected: For a base ``(4, 4)`` the tips of targets before and after their correction, in the nominal base
            frame, ``(n, 4, 4)`` each; of no targets at all if none can be corrected.
        start: A base near to it.

    Returns:
        base: ``T_base_nominalbase``, ``(4, 4)``. The :func:`common_motion` of the changes is zero.
    """
    base = start
    for _ in range(_ROUNDS):
        tips, new_tips = corrected(base)
        if not len(tips):
            break
        places = tips[:, :3, 3]
        moved, turned = (new_tips[:, :3, 3] - places)[:, :, None], turns_between(tips, new_tips)[:, :, None]
        motion = common_motion([(places, moved, turned)])
        if max(np.abs(motion.moved).max(), np.abs(motion.turned).max()) < _ZERO:
            break
        centre = np.eye(4)
        centre[:3, 3] = motion.middle
        # Base and correction move alike: where the base goes, the answers, and with them what is written, go as well.
        step = _small(-np.concatenate([motion.moved[:, 0], motion.turned[:, 0]]))
        base = centre @ step @ np.linalg.inv(centre) @ base
    return base


@dataclass(frozen=True, eq=False)
class CommonMotion:
    """The motions of one rigid body that are nearest to those of many targets."""

    moved: Array  #: moved, turned: motion of the middle [m], and rotation vector, ``(3, k)`` each.
    turned: Array
    middle: Array  #: Of the targets, ``(3,)`` [m].

    def of(self, places: Array) -> Array:
        """Return what it does to places ``(n, 3)``: ``(n, 3, k)`` [m]."""
        return np.asarray(self.moved + np.cross(self.turned, (places - self.middle)[:, :, None], axis=-2))


def common_motion(parts: Iterable[tuple[Array, Array, Array]]) -> CommonMotion:
    """Return the motions that all targets have in common, by least squares.

    Args:
        parts: Of the targets: places ``(n, 3)`` [m], motions [m] and rotation vectors [rad], ``(n, 3, k)`` each.
            Targets of all parts together share the motions.
    """
    count, place, moments = 0, np.zeros(3), np.zeros((3, 3))
    moved: Array | float = 0.0
    turned: Array | float = 0.0
    for places, motions, turns in parts:
        count += len(places)
        place = place + places.sum(axis=0)
        moments += places.T @ places
        moved = moved + motions.sum(axis=0)
        turned = turned + (np.cross(places[:, :, None], motions, axis=-2) + _TOOL**2 * turns).sum(axis=0)
    middle, mean = place / count, np.asarray(moved / count)
    spread = moments - count * np.outer(middle, middle)
    inertia = (np.trace(spread) + count * _TOOL**2) * np.eye(3) - spread
    turn = np.asarray(turned) - count * np.cross(middle[:, None], mean, axis=0)
    return CommonMotion(mean, np.linalg.solve(inertia, turn), middle)


def turns_between(start: Array, end: Array) -> Array:
    """Return the rotation vectors ``(n, 3)`` [rad], in outer axes, from poses ``(n, 4, 4)`` to others."""
    return rotation_vector(end[:, :3, :3] @ start[:, :3, :3].swapaxes(1, 2))


def _by_base(poses: Array) -> Array:
    """Return what small motions of the base, in its own axes, make of poses ``(n, 4, 4)``: ``(n, 6, 6)``."""
    rows = np.zeros((len(poses), 6, 6))
    rows[:, :3, :3] = rows[:, 3:, 3:] = np.eye(3)
    x, y, z = poses[:, :3, 3].T
    rows[:, 0, 4], rows[:, 0, 5] = z, -y
    rows[:, 1, 3], rows[:, 1, 5] = -z, x
    rows[:, 2, 3], rows[:, 2, 4] = y, -x
    return rows


def _by_flange(poses: Array) -> Array:
    """Return what small motions of the flange, in its own axes, make of poses ``(n, 4, 4)``: ``(n, 6, 6)``."""
    rows = np.zeros((len(poses), 6, 6))
    rows[:, :3, :3] = rows[:, 3:, 3:] = poses[:, :3, :3]
    return rows


def _small(motion: Array) -> Array:
    """Return the transform ``(4, 4)`` of a translation and a rotation vector ``(6,)``."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_from_vector(motion[3:])
    matrix[:3, 3] = motion[:3]
    return matrix
