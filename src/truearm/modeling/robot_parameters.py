"""The parameters of a robot, and how a tip follows them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from truearm.errors import InputError
from truearm.modeling.chain import Array, Element, ForwardKinematics
from truearm.modeling.fixtures import Fixture
from truearm.modeling.parameters import Group, Parameter, Unit, parameter
from truearm.modeling.parts import Target
from truearm.modeling.postures import Postures

if TYPE_CHECKING:
    from truearm.modeling.robot import Robot
    from truearm.modeling.robot_data import RobotData


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
    return found


def by_parameters(
    robot: Robot,
    kinematics: ForwardKinematics,
    by_elements: Callable[[Sequence[int | None]], Array],
    q: Array | Postures,
    names: Sequence[str],
    values: Mapping[str, float | Array],
) -> Array:
    """Return a derivative by parameters, from that by the elements of a chain.

    Parameters
    ----------
    by_elements
        The derivative by the elements with these indices, zero for None: the Jacobian of position or orientation.
    """
    places = [kinematics.places.get(name) for name in names]
    derivative = by_elements(places)
    if robot.effects and None in places:
        at = robot.loaded(q)
        rates = {n: r for effect in robot.effects for n, r in effect.derivative(at, values).items() if n in names}
        needed = sorted({variable for rate in rates.values() for variable in rate})
        by_variable = dict(zip(needed, by_elements([robot.moving[v] for v in needed]), strict=True))
        for i, name in enumerate(names):
            for variable, rate in rates.get(name, {}).items():
                derivative[i] += rate * by_variable[variable]
    return derivative


def _unit(element: Element) -> Unit:
    return "rad" if element.turns else "m"
