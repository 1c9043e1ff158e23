"""Arms brought to a place by jogging: a probe until it touches, a ball until the bar fits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.devices.device import Arm

_STEPS: Final = 40
_LONGEST_STEP: Final = 0.3  # rad or m at most in a step
_REACHED: Final = 1e-10  # m
_STARTS: Final = 24
_TOGETHER: Final = 4000
_MOST: Final = 0.8
_ROUNDS: Final = 25
_DAMPING: Final = 1e-6
#: How far from the limits the nominal robot stays [rad or m, or that share of the range]: jogging needs room.
_MARGIN: Final = 0.05

#: How many places are offered for each that is needed.
SPARE: Final = 3

Gap = Callable[[Array], Array]


def jogged(nominal: Robot, arm: Arm, target: str, joints: Array, gap: Gap) -> Array:
    """Return joint positions at which a target of the arm is where it shall be.

    The nominal robot says how to move; the arm itself says how far it still is. What the two differ by is a few
    thousandths of a move, so that a few moves do.

    Args:
        joints: Where to begin, ``(n, joints)``.
        gap: For the places of the target in the world ``(n, 3)`` the displacements that it still needs [m], ``(n, 3)``.

    Raises:
        InputError: If it does not arrive, or only beyond the limits of its joints.
    """
    low, high = _limits(nominal)
    joints = joints.copy()
    for _ in range(_STEPS):
        missing = gap(arm.frames(joints)[target][:, :3, 3])
        if float(np.abs(missing).max()) < _REACHED:
            beyond = int(((joints < low) | (joints > high)).any(axis=1).sum())
            if beyond == 0:
                return joints
            raise InputError(
                "the tool reaches the place of measurement only beyond the joint limits",
                where=nominal.name,
                came=f"{beyond} of {len(joints)} postures beyond them",
                cure="The truth is too far from the nominal robot: take another seed, or another truth.",
            )
        joints += _least(nominal.moved_point(joints, target)[1], missing)
    raise InputError(
        "the tool cannot be jogged to the place of measurement",
        where=nominal.name,
        came=f"{float(np.abs(missing).max()) * 1e3:.3g} mm missing",
        cure="The truth is too far from the nominal robot, or the postures are singular: take another seed.",
    )


def postures_at(
    nominal: Robot,
    target: str,
    goals: Array,
    count: int,
    rng: np.random.Generator,
    device: str,
    facing: Array | None = None,
    within: float = np.pi / 3,
) -> tuple[NDArray[np.intp], Array]:
    """Return postures of a robot with a target at the first of the places that it reaches, turned by chance.

    Args:
        goals: Places in the world ``(k, 3)`` [m].
        count: How many of them are needed.
        device: Name of what is there, for messages.
        facing: Directions ``(k, 3)`` in the world along which the flange's z shall point, give or take `within` [rad];
            any if None.

    Returns:
        Indices of the places ``(count,)``, and joint positions ``(count, joints)`` within the limits.

    Raises:
        InputError: If too few are within reach.
    """
    low, high = _limits(nominal)
    margin = _MARGIN * np.minimum(1.0, high - low)
    joints = np.full((len(goals), len(nominal.joints)), np.nan)
    for _ in range(_ROUNDS):
        reached = np.flatnonzero(np.isfinite(joints[:, 0]))[:count]
        if len(reached) == count:
            return reached, joints[reached]
        open_goals = np.flatnonzero(np.isnan(joints[:, 0]))[: 2 * count]
        of = np.repeat(open_goals, max(2, min(_STARTS, _TOGETHER // len(open_goals))))
        q = nominal.random_configurations(len(of), rng)
        for _ in range(_STEPS):
            place, linear = nominal.moved_point(q, target)
            missing = goals[of] - place
            far = np.linalg.norm(missing, axis=1)
            if np.mean(far < 1e-8) > _MOST:
                break
            q = q + _least(linear, missing)
        place, _ = nominal.world_poses(q, target)
        good = np.linalg.norm(goals[of] - place, axis=1) < 1e-8
        good &= ((q > low + margin) & (q < high - margin)).all(axis=1)
        if facing is not None:
            pointing = nominal.world_poses(q)[1][:, :, 2]
            good &= np.einsum("ni,ni->n", pointing, facing[of]) > np.cos(within)
        for k in np.flatnonzero(good)[::-1].tolist():
            joints[of[k]] = q[k]
    reached = np.flatnonzero(np.isfinite(joints[:, 0]))[:count]
    if len(reached) == count:
        return reached, joints[reached]
    raise InputError(
        f"{nominal.name} does not reach enough places of the device",
        where=device,
        came=f"{len(reached)} of {len(goals)} places within reach",
        allowed=f"{count} or more",
        cure="Take a device that needs less room, or widen the joint limits in the robot file.",
    )


def followed(nominal: Robot, target: str, joints: Array, places: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return how the nominal robot leads a target along paths, by the shortest joint moves.

    Args:
        joints: Where to begin, ``(n, joints)``.
        places: Of the target in the world along each path [m], ``(steps, n, 3)``; few millimetres apart.

    Returns:
        Joint positions ``(steps, n, joints)``, and which of the paths were followed to the end within the limits
        ``(n,)``.
    """
    low, high = np.array([joint.limits or (-np.inf, np.inf) for joint in nominal.joints]).T
    q, went, whole = joints, [], np.ones(len(joints), dtype=bool)
    for goal in places:
        for _ in range(_STEPS):
            place, linear = nominal.moved_point(q, target)
            missing = goal - place
            far = np.abs(missing).max(axis=1)
            if float(far.max(where=whole, initial=0.0)) < _REACHED:
                break
            q = q + _least(linear, missing)
        whole = whole & (far < _REACHED) & ((q > low + _MARGIN) & (q < high - _MARGIN)).all(axis=1)
        went.append(q)
    return np.array(went), whole


def site(nominal: Robot) -> Array:
    """Return a place in the middle of the reach, in front of the base, in the world [m]."""
    rng = np.random.default_rng(0)
    name = nominal.targets[0].name
    base = nominal.base
    tips = (nominal.world_poses(nominal.random_configurations(2000, rng), name)[0] - base.translation) @ base.rotation
    far = float(np.quantile(np.hypot(tips[:, 0], tips[:, 1]), 0.9))
    height = float(np.quantile(tips[:, 2], 0.35))
    return np.asarray(base.rotation @ np.array([0.7 * far, 0.0, height]) + base.translation)


def _limits(robot: Robot) -> tuple[Array, Array]:
    """Return the lowest and the highest position of each joint, ``(joints,)``, infinite where there is none."""
    low, high = np.array([joint.limits or (-np.inf, np.inf) for joint in robot.joints]).T
    return low, high


def _least(J: Array, missing: Array) -> Array:
    """Return the shortest joint moves ``(n, joints)`` for displacements ``(n, 3)``, each of a stride at most."""
    Jt = np.swapaxes(J, 1, 2)
    square = J @ Jt
    square = square + _DAMPING * np.trace(square, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    step = (Jt @ np.linalg.solve(square, missing[..., None]))[..., 0]
    longest = np.abs(step).max(axis=1, keepdims=True)
    return np.asarray(step * np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-300)))
