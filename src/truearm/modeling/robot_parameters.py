"""The parameters of a robot, and how a tip follows them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array, Element, ForwardKinematics
from truearm.modeling.fixtures import Fixture
from truearm.modeling.parameters import SCALE, Group, Parameter, Unit, parameter
from truearm.modeling.parts import Target
from truearm.modeling.postures import Postures

if TYPE_CHECKING:
    from truearm.modeling.robot import Robot
    from truearm.modeling.robot_data import RobotData


#: Of a balancer's factor, for differences: far below what a play takes up, far above rounding.
_STEP: Final = 1e-6


def all_parameters(robot: RobotData) -> Mapping[str, Parameter]:
    """Return all parameters by name: base, joints, effects, targets, fixtures."""
    zeros = {f"{robot.convention.zero(j.kind)}_{i}" for i, j in enumerate(robot.joints, 1)}
    found: dict[str, Parameter] = {}

    def add(name: str, unit: Unit, group: Group, nominal: float) -> None:
        if name in found:
            raise InputError(
                "two parameters of the robot would have the same name",
                where=name,
                cure="Rename the target or fixture.",
            )
        found[name] = robot.known.get(name) or parameter(name, unit, group, nominal, robot.priors)

    for element in robot.trunk.elements:
        if element.parameter is not None:
            name = element.parameter
            group: Group = "joint zero" if name in zeros else "geometry"
            add(name, _unit(element), "base" if name.startswith("base_") else group, element.value)
    for effect in robot.effects:
        for plain in effect.parameters:
            if plain.name in found:
                raise InputError(
                    "two joint effects of the robot have the same parameter",
                    where=f"{robot.name}, {plain.name}",
                    came=", ".join(e.name for e in robot.effects if plain.name in [p.name for p in e.parameters]),
                    cure="They are forms of one effect: take one of them.",
                )
            found[plain.name] = robot.known.get(plain.name, plain)
    beside: tuple[tuple[Group, Sequence[Target | Fixture]], ...] = (
        ("target", robot.targets),
        ("fixture", robot.fixtures),
    )
    for group_of, parts in beside:
        for element in (element for part in parts for element in part.chain.elements):
            if element.parameter is not None:
                add(element.parameter, _unit(element), group_of, element.value)
    if SCALE in robot.known:
        found[SCALE] = robot.known[SCALE]
    return found


def effect_rates(
    robot: Robot, q: Array | Postures, names: Sequence[str], values: Mapping[str, float | Array]
) -> dict[str, Mapping[int, Array]]:
    """Return the derivative of the chain's variables by those of some parameters that belong to joint effects."""
    asked = set(names)
    effects = [effect for effect in robot.effects if not asked.isdisjoint(p.name for p in effect.parameters)]
    if not effects:
        return {}
    at = robot.loaded(q)
    there = at.relieved(values)
    rates = {n: rate for effect in effects for n, rate in effect.derivative(there, values).items() if n in asked}
    return rates | (_balancer_rates(robot, at, asked, values) if at.relief else {})


def _balancer_rates(
    robot: Robot, at: Postures, asked: Collection[str], values: Mapping[str, float | Array]
) -> dict[str, Mapping[int, Array]]:
    """Return the derivative of the chain's variables by factors of balancers: of what joints do under loads."""

    def under(name: str, more: float) -> dict[int, Array]:
        there = at.relieved({**values, name: np.asarray(values[name]) + more})
        moved: dict[int, Array] = {}
        for effect in robot.effects:
            if effect.loaded:
                for variable, part in effect.deflection(there, values).items():
                    moved[variable] = moved.get(variable, 0.0) + part
        return moved

    rates: dict[str, Mapping[int, Array]] = {}
    for name in (f"balancer_{number}" for number in range(1, len(robot.balancers) + 1)):
        if name in asked:
            ahead, behind = under(name, _STEP), under(name, -_STEP)
            rates[name] = {variable: (part - behind[variable]) / (2.0 * _STEP) for variable, part in ahead.items()}
    return rates


def by_parameters(
    robot: RobotData,
    kinematics: ForwardKinematics,
    by_elements: Callable[[Sequence[int | None]], Array],
    names: Sequence[str],
    rates: Mapping[str, Mapping[int, Array]],
) -> Array:
    """Return a derivative by parameters, from that by the elements of a chain.

    Args:
        by_elements: The derivative by the elements with these indices, zero for None: the Jacobian of position or
            orientation.
        rates: From :func:`effect_rates`.
    """
    derivative = by_elements([kinematics.places.get(name) for name in names])
    for i, name in enumerate(names):
        for place, factor in robot.offset_elements.get(name, ()):
            derivative[i] += factor * by_elements([place])[0]
    if rates:
        needed = sorted({variable for rate in rates.values() for variable in rate})
        by_variable = dict(zip(needed, by_elements([robot.moving[v] for v in needed]), strict=True))
        for i, name in enumerate(names):
            for variable, rate in rates.get(name, {}).items():
                derivative[i] += rate * by_variable[variable]
    return derivative


def by_parameters_together(
    robot: RobotData,
    whole: ForwardKinematics,
    ends: Mapping[str, ForwardKinematics],
    names: Sequence[str],
    rates: Mapping[str, Mapping[int, Array]],
) -> Array:
    """Return the velocity of several targets by parameters, ``(parameters, 3, targets, ..., n)``.

    Args:
        whole: The trunk, run through :func:`~truearm.modeling.chain.together` for all of them.
        ends: The forward kinematics to each target.
        rates: From :func:`effect_rates`.
    """
    derivative = by_parameters(robot, whole, whole.position_jacobian, names, rates)
    first, row = len(whole.elements), {name: i for i, name in enumerate(names)}
    for k, (target, end) in enumerate(ends.items()):
        chain = robot.target(target).chain
        own = [name for name in chain.parameters if name in row]
        derivative[[row[name] for name in own], :, k] = end.position_jacobian([first + chain.index(n) for n in own])
    return derivative


def _unit(element: Element) -> Unit:
    return "rad" if element.turns else "m"
