"""What inclinometers on the links read of a robot's model, and how its parameters change that."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.measurement.inclinometer import Instruments, Pairs
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot

#: Axes steeper than this are left out: a vertical one does not see small turns [rad].
STEEPEST: Final = math.radians(60.0)
#: Moments about, and across, an axis below these leave open where a joint leans [N m]: friction holds it, or the error
#: of the moment decides.
UNDECIDED: Final = (0.2, 0.05)
DECIDING_MOMENTS: Final = (
    f"moments above {UNDECIDED[0]:g} N m about and {UNDECIDED[1]:g} N m across the axis of every joint"
)
_UPRIGHT: Final = 0.01  # sine of the angle between gravity and an axis


def inclinations_of(
    robot: Robot, q: Array | Postures, seats: Array | None = None, instruments: Instruments | None = None
) -> Array:
    """Return the angles of the instruments' axes above the horizontal, ``(n, instruments, 3)`` [rad].

    Args:
        seats: Small turns about x, y and z from where each instrument is mounted to how it sits, ``(instruments, 3)``
            [rad]; none if None.
        instruments: One on each link, aligned with its frame, if None.
    """
    return np.asarray(np.arcsin(np.clip(_axes(robot, q, seats, instruments) @ upwards(robot), -1.0, 1.0)))


def inclination_derivatives(
    robot: Robot,
    q: Array | Postures,
    names: Sequence[str],
    seats: Array | None = None,
    instruments: Instruments | None = None,
) -> Array:
    """Return the derivative of :func:`inclinations_of` by parameters and then by seats.

    An axis `a` that turns with angular velocity w rises by ``w . (a x up) / cos(inclination)``. That ratio has no
    limit for a vertical axis, where 0 is returned: see how steep an axis is before trusting it.

    Returns:
        derivatives: ``(n, instruments, 3, len(names) + 3 * instruments)``, seats instrument by instrument.
    """
    at = robot.loaded(q)
    mounted = instruments or Instruments.on_every_link(len(robot.joints))
    axes, up = _axes(robot, at, seats, mounted), upwards(robot)
    levers = np.cross(axes, up)
    cosine = np.linalg.norm(levers, axis=-1, keepdims=True)
    levers = np.where(cosine > 1e-9, levers / np.maximum(cosine, 1e-9), 0.0)  # (n, instruments, 3, xyz)
    kinematics = robot.forward_kinematics(at)
    ends, links = link_ends(robot), np.array(mounted.links)
    n, count = len(at), len(mounted)
    found = np.zeros((n, count, 3, len(names) + 3 * count))
    for column, moved in enumerate(_moved_elements(robot, at, names)):
        by_parameter = found[..., column]
        for element, rate in moved.items():
            beyond = np.flatnonzero(links >= bisect_right(ends, element))  # on links that the element turns
            turning = kinematics.axis(element).T * np.broadcast_to(rate, n)[:, None]
            by_parameter[:, beyond] += np.einsum("nlkx,nx->nlk", levers[:, beyond], turning)
    for number, (link, mount) in enumerate(zip(mounted.links, mounted.mounts, strict=True)):
        first = len(names) + 3 * number
        found[:, number, :, first : first + 3] = levers[:, number] @ kinematics.matrix(ends[link]) @ mount
    return found


def readable(robot: Robot, pairs: Pairs, instruments: Instruments | None = None) -> NDArray[np.bool_]:
    """Return which changes of inclination can be used, ``(n, instruments, 3)``.

    The axis stands within 60 deg of the horizontal in both postures, and the loads decide to which side every joint up
    to the link leans. A joint whose axis stands upright does not matter.
    """
    mounted = instruments or Instruments.on_every_link(len(robot.joints))
    usable = np.ones((len(pairs), len(mounted), 3), dtype=bool)
    for posture in (pairs.first, pairs.second):
        at = robot.loaded(posture)
        usable &= np.abs(inclinations_of(robot, at, instruments=mounted)) <= STEEPEST
        clear = np.logical_and.accumulate(decided(robot, at, upright=True), axis=1)
        usable &= clear[:, np.array(mounted.links)][..., None]
    return usable


def decided(robot: Robot, posture: Postures, *, upright: bool) -> NDArray[np.bool_]:
    """Return whether the loads decide to which side each joint leans, ``(n, joints)``.

    Args:
        upright: Whether a joint may turn to either side about an axis along gravity, which inclinometers do not see.
    """
    at = robot.loaded(posture)
    kinematics, up = robot.forward_kinematics(at), upwards(robot)
    clear = np.ones((len(at), len(robot.joints)), dtype=bool)
    for joint in robot.layout.turning:
        x, y, z = at.joint_loads[joint, 3:]
        stands = np.linalg.norm(np.cross(kinematics.axis(robot.moving[joint]).T, up), axis=1) < _UPRIGHT
        clear[:, joint] = (np.abs(z) > UNDECIDED[0]) | (upright & stands)
        clear[:, joint] &= np.hypot(x, y) > UNDECIDED[1]
    return clear


def change_derivatives(
    robot: Robot,
    pairs: Pairs,
    names: Sequence[str],
    seats: Array | None = None,
    instruments: Instruments | None = None,
) -> Array:
    """Return the derivative of changes of inclination by parameters and seats.

    Returns:
        derivatives: ``(n, instruments, 3, len(names) + 3 * instruments)``.
    """
    first, second = (inclination_derivatives(robot, p, names, seats, instruments) for p in (pairs.first, pairs.second))
    return np.asarray(second - first)


def link_ends(robot: Robot) -> list[int]:
    """Return the index of the element of the trunk right behind each link's frame."""
    ends = accumulate((len(link) for link in robot.moved_links), initial=len(robot.base_elements))
    return list(ends)[1:]


def _moved_elements(robot: Robot, at: Postures, names: Sequence[str]) -> list[dict[int, Array | float]]:
    """Return for each parameter the turns of the trunk it moves, and how fast."""
    elements = robot.trunk.elements
    places = {e.parameter: i for i, e in enumerate(elements) if e.parameter is not None}
    rates = {n: r for effect in robot.effects for n, r in effect.derivative(at, robot.values).items()}
    moved: list[dict[int, Array | float]] = []
    for name in names:
        by_variable: dict[int, Array | float] = {robot.moving[v]: rate for v, rate in rates.get(name, {}).items()}
        by_place: dict[int, Array | float] = {places[name]: 1.0} if name in places else {}
        moved.append({i: rate for i, rate in (by_place | by_variable).items() if elements[i].turns})
    return moved


def _axes(
    robot: Robot, q: Array | Postures, seats: Array | None, instruments: Instruments | None
) -> NDArray[np.float64]:
    """Return the instruments' axes in the world, as rows ``(n, instruments, 3, xyz)``."""
    mounted = instruments or Instruments.on_every_link(len(robot.joints))
    kinematics, ends = robot.forward_kinematics(q), link_ends(robot)
    R = np.stack([kinematics.matrix(ends[link]) for link in mounted.links], axis=1) @ mounted.mounts
    if seats is not None:
        R = R @ _turns(seats)
    return np.asarray(np.swapaxes(R, -1, -2))


def _turns(seats: Array) -> Array:
    """Return the rotations of small rotation vectors ``(links, 3)``."""
    x, y, z = seats.T
    zero = np.zeros(len(seats))
    S = np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), -1, 0)
    return np.asarray(np.eye(3) + S + 0.5 * S @ S)  # a seat of 0.01 rad leaves 2e-7


def upwards(robot: Robot) -> Array:
    """Return the unit vector against gravity in the world."""
    down = robot.base.rotation @ np.array(robot.gravity)
    return np.asarray(-down / np.linalg.norm(down))
