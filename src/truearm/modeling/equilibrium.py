"""Equilibrium: an arm bends under loads, and the loads are those of the bent arm.

Each is found from the other in turns. A round leaves a hundredth of what was missing, or half where a joint with play
is all but balanced; only postures that are not yet settled go through the next one. The few that swing to and fro take
half of each way later on. A shaft that would have to stand in the middle of its clearance never settles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array
from truearm.modeling.loads import joint_loads, relief
from truearm.modeling.postures import Postures

if TYPE_CHECKING:
    from truearm.modeling.robot import Robot

_WHOLE_ROUNDS: Final = 20
_MOST_ROUNDS: Final = 100
#: A posture that moves by less in a round [rad, m] is settled: what is left is a fraction of that.
_SETTLED: Final = 1e-12


def settled(following: Callable[[NDArray[np.intp], Array], Array], start: Array) -> Array:
    """Return where rounds from `start` ``(variables, n)`` settle to 1e-12 rad or m.

    Args:
        following: Returns what follows on some columns, given their places and what they are now.
    """
    found = np.array(start, float)
    left = np.arange(found.shape[1])
    for number in range(_MOST_ROUNDS):
        if not len(left):
            break
        before = found[:, left]
        way = following(left, before) - before
        found[:, left] = before + (way if number < _WHOLE_ROUNDS else 0.5 * way)
        left = left[np.abs(way).max(axis=0) > _SETTLED]
    return found


def postures_in_equilibrium(robot: Robot, at: Postures) -> Postures:
    """Return postures with the loads of the arm as it has bent under them."""

    def bent(rows: NDArray[np.intp], variables: Array) -> Array:
        part = at.at(rows)
        return robot.variables(replace(part, loads=_loads(robot, part, variables)), robot.values)

    straight = robot.without_deflections(at.joints.T)
    start = robot.variables(replace(at, loads=_loads(robot, at, straight)), robot.values)
    variables = settled(bent, start)
    there = replace(at, loads=_loads(robot, at, variables))
    factors = [f"balancer_{number}" for number in range(1, len(robot.balancers) + 1)]
    if not factors or factors[0] not in robot.parameters:
        return there
    return replace(there, relief=(relief(robot, variables), tuple(robot.values[name] for name in factors)))


def joint_efforts(robot: Robot, q: Array | Postures) -> Array:
    """Return the load about each turning joint's axis [N m], or along a sliding one's [N], ``(n, joints)``.

    It is that of the arm as it has bent; of a model without elastic joints, of the rigid arm.
    """
    at = robot.loaded(q)
    loads = at.loads if at.loads is not None else _loads(robot, at, robot.variables(at, robot.values))
    rows = [loads[i, 5 if joint.kind == "revolute" else 2] for i, joint in enumerate(robot.joints)]
    return np.ascontiguousarray(np.array(rows).T)


def joints_in_equilibrium(robot: Robot, variables: Array) -> Array:
    """Return the joint positions ``(joints, n)`` that lead to variables, whose loads are known from the start."""
    loads = joint_loads(robot, variables) if any(effect.loaded for effect in robot.effects) else None
    turned = variables[: len(robot.joints)]

    def corrected(rows: NDArray[np.intp], joints: Array) -> Array:
        at = Postures(joints.T, loads=None if loads is None else loads[:, :, rows])
        missing = turned[:, rows] - robot.variables(at, robot.values)[: len(joints)]
        return np.asarray(joints + missing)

    return settled(corrected, turned)


def _loads(robot: Robot, at: Postures, variables: Array) -> Array:
    rates = {"velocity": at.velocity, "acceleration": at.acceleration, "wrench": at.wrench}
    return joint_loads(robot, variables, **{name: None if rate is None else rate.T for name, rate in rates.items()})
