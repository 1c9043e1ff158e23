"""What calibration cannot know of base and flange, and how it is kept out of programs.

After a calibration the shift of the base against joint 1, and of the tool against joint 6, is arbitrary: readings of a
target say where the target is, and not where the robot's base plate and its flange are. Written into a program, that
shift would move all of it. So unless somebody says where a program's tool and frames really are, the identified flange
is taken to be where it agrees best with the nominal one all over the workspace, and the base to be where the mean
correction of the program is zero.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from truearm.compensation.fake_targets import matrices, nominal_robot
from truearm.modeling.chain import Array
from truearm.modeling.inverse.kinematics import reach
from truearm.modeling.robot import Robot
from truearm.modeling.transform import rotation_from_vector, rotation_vector

#: Configurations on which flange and base are compared.
_CONFIGURATIONS: Final = 300
_ROUNDS: Final = 8
#: The mean correction counts as zero below this [m, rad].
_ZERO: Final = 1e-10


def best_agreement(robot: Robot) -> tuple[Array, Array]:
    """Return where the base and flange of the nominal robot are in the identified ones.

    The weighted squares of the differences of both robots' flange poses, at random configurations within the limits,
    are least; an angle counts as what it moves at the length of the arm.

    Parameters
    ----------
    robot
        Calibrated.

    Returns
    -------
    base, flange
        ``T_base_nominalbase`` and ``T_flange_nominalflange``, ``(4, 4)`` each [m].
    """
    nominal = nominal_robot(robot)
    joints = robot.random_configurations(_CONFIGURATIONS, np.random.default_rng(0))
    nominal_poses, real_poses = matrices(nominal, joints), np.linalg.inv(robot.base.matrix) @ matrices(robot, joints)
    weight = np.repeat([1.0, reach(nominal, None)], 3)
    base, before_flange = np.eye(4), np.eye(4)
    for _ in range(_ROUNDS):
        expected = base @ nominal_poses @ before_flange
        missed = np.concatenate(
            [real_poses[:, :3, 3] - expected[:, :3, 3], turns_between(expected, real_poses)], axis=1
        )
        rows = np.concatenate([_by_base(expected), _by_flange(expected)], axis=2)
        step, *_ = np.linalg.lstsq((rows * weight[:, None]).reshape(-1, 12), (missed * weight).ravel(), rcond=None)
        base, before_flange = _small(step[:6]) @ base, before_flange @ _small(step[6:])
    return base, np.asarray(np.linalg.inv(before_flange))


def flange_rates(robot: Robot, names: Sequence[str]) -> Array:
    """Return how the flange of :func:`best_agreement` moves with parameters of the identified robot.

    Parameters
    ----------
    names
        Of the parameters; those of the base count for nothing.

    Returns
    -------
    rates
        ``(6, parameters)``: translation and rotation vector of the flange in its own axes [m, rad per unit].
    """
    joints = robot.random_configurations(_CONFIGURATIONS, np.random.default_rng(0))
    poses = matrices(robot, joints)
    moved = np.concatenate(robot.jacobians(robot.forward_kinematics(joints), joints, names), axis=1)
    moved[[robot.parameters[name].group == "base" for name in names]] = 0.0
    weight = np.repeat([1.0, reach(nominal_robot(robot), None)], 3)
    rows = np.concatenate([_by_base(poses), _by_flange(poses)], axis=2)
    right = (np.moveaxis(moved, 2, 0) * weight).swapaxes(1, 2).reshape(-1, len(names))
    explained, *_ = np.linalg.lstsq((rows * weight[:, None]).reshape(-1, 12), right, rcond=None)
    return np.asarray(explained[6:])


def base_shift(corrected: Callable[[Array], tuple[Array, Array]], start: Array) -> Array:
    """Return where the nominal base has to be in the identified one for the mean correction of targets to be zero.

    Parameters
    ----------
    corrected
        For a base ``(4, 4)`` the tips of targets before and after their correction, in the nominal base frame,
        ``(n, 4, 4)`` each; of no targets at all if none can be corrected.
    start
        A base near to it.

    Returns
    -------
    base
        ``T_base_nominalbase``, ``(4, 4)``. The mean change of positions is zero, and so is the mean rotation vector
        of the changes of orientations.
    """
    base = start
    for _ in range(_ROUNDS):
        tips, new_tips = corrected(base)
        if not len(tips):
            break
        moved = (new_tips[:, :3, 3] - tips[:, :3, 3]).mean(axis=0)
        turned = turns_between(tips, new_tips).mean(axis=0)
        if np.abs(moved).max() < _ZERO and np.abs(turned).max() < _ZERO:
            break
        centre = np.eye(4)
        centre[:3, 3] = tips[:, :3, 3].mean(axis=0)
        # Base and correction move alike: where the base goes, the answers, and with them what is written, go as well.
        base = centre @ _small(-np.concatenate([moved, turned])) @ np.linalg.inv(centre) @ base
    return base


def turns_between(one: Array, other: Array) -> Array:
    """Return the rotation vectors ``(n, 3)`` [rad], in outer axes, from poses ``(n, 4, 4)`` to others."""
    return rotation_vector(other[:, :3, :3] @ one[:, :3, :3].swapaxes(1, 2))


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
    made = np.eye(4)
    made[:3, :3] = rotation_from_vector(motion[3:])
    made[:3, 3] = motion[:3]
    return made
