"""The parameters of a robot as objects, and how a tip follows them."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from truearm.engine.base.arrays import finite_number
from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array, Element, ForwardKinematics
from truearm.engine.robot.parts import Fixture, Target
from truearm.engine.robot.postures import Postures

if TYPE_CHECKING:
    from truearm.engine.robot.robot import Robot
    from truearm.engine.robot.robot_data import RobotData


# Vectors of parameters exist only inside solvers, in the order of :class:`FreeParameters`.

#: What parameters of the rigid robot and of what stands beside it describe.
Group = Literal["base", "joint zero", "geometry", "target", "fixture"]
Unit = Literal["m", "rad", "1", "rad/(N m)", "m/N", "rad/(N m)^2", "rad/(N m)^3", "1/K"]

#: Where things stand: nobody measured them before, and every fit finds them anew.
PLACES: Final[tuple[Group, ...]] = ("base", "target", "fixture")

#: The parameter that says how much longer than it reads an instrument's unit of length is, and its group.
SCALE: Final = "instrument_scale"
SCALE_GROUP: Final = "scale"

#: What a nominal value is believed to be good for (one standard deviation) unless the robot file says otherwise.
#: Machined links and mastered joints are good to about 1 mm and 0.1 deg; where robot and reflectors stand is unknown.
PRIOR: Final[Mapping[tuple[str, str], float]] = {
    ("base", "m"): 1.0,
    ("base", "rad"): 1.0,
    ("target", "m"): 1.0,
    ("target", "rad"): 1.0,
    ("fixture", "m"): 1.0,
    ("fixture", "rad"): 1.0,
    ("joint zero", "m"): 1e-3,
    ("joint zero", "rad"): math.radians(0.1),
    ("geometry", "m"): 1e-3,
    ("geometry", "rad"): math.radians(0.1),
}


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of the robot model."""

    name: str  #: Stable and the same in files, reports and messages: ``theta_offset_2``, ``base_x``.
    unit: Unit  #: SI unit of all values here.
    #: What the parameter describes, a :data:`Group` or a joint effect by its name; models free whole groups.
    group: str
    nominal: float  #: Value before calibration.
    value: float  #: Current value.
    prior: float  #: Standard deviation of the nominal value.
    deviation: float | None = None  #: Standard deviation of the current value, where it was identified.
    #: Share of the prior variance that the data removed, 0 to 1, where it was identified.
    informed: float | None = None

    def __post_init__(self) -> None:
        """Refuse what is no number, and a standard deviation below zero."""
        finite_number(self.nominal, "nominal", where=self.name)
        finite_number(self.value, "value", where=self.name)
        finite_number(self.prior, "prior", where=self.name, lowest=0.0)
        if self.deviation is not None:
            finite_number(self.deviation, "deviation", where=self.name, lowest=0.0)
        if self.informed is not None:
            finite_number(self.informed, "informed", where=self.name)

    @classmethod
    def plain(cls, name: str, unit: Unit, group: str, nominal: float, prior: float) -> Parameter:
        """Make a parameter at its nominal value."""
        return cls(name, unit, group, nominal, nominal, prior)

    def restarted(self, nominal: float | None = None) -> Parameter:
        """Return the parameter as before any identification, at `nominal` if that is given."""
        start = self.nominal if nominal is None else nominal
        return replace(self, nominal=start, value=start, deviation=None, informed=None)


def parameter(name: str, unit: Unit, group: Group, nominal: float, priors: Mapping[str, float]) -> Parameter:
    """Make a parameter at its nominal value, with the prior of its group.

    Args:
        priors: The robot file's own priors by SI unit, used for geometry and joint zeros.
    """
    prior = PRIOR[group, unit]
    if group in ("geometry", "joint zero"):
        prior = priors.get(unit, prior)
    return Parameter.plain(name, unit, group, nominal, prior)


@dataclass(frozen=True)
class FreeParameters:
    """The parameters a solver may change, in the one order that its vectors have."""

    parameters: tuple[Parameter, ...]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names in vector order."""
        return tuple(p.name for p in self.parameters)

    @property
    def start(self) -> Array:
        """Current values."""
        return np.array([p.value for p in self.parameters])

    @property
    def nominal(self) -> Array:
        """Centres of the priors."""
        return np.array([p.nominal for p in self.parameters])

    @property
    def prior(self) -> Array:
        """Standard deviations of the priors."""
        return np.array([p.prior for p in self.parameters])

    def values(self, vector: Array) -> dict[str, float | Array]:
        """Name the entries of a vector ``(parameters,)``, or, each as ``(trials, 1)``, of many vectors."""
        if vector.ndim == 1:
            return dict(zip(self.names, map(float, vector), strict=True))
        return dict(zip(self.names, vector.T[:, :, None], strict=True))

    def without(self, names: Iterable[str]) -> FreeParameters:
        """Return the others."""
        dropped = set(names)
        return FreeParameters(tuple(p for p in self.parameters if p.name not in dropped))


#: Of a balancer's factor, for differences: far below what a play takes up, far above rounding.
_STEP: Final = 1e-6


def all_parameters(robot: RobotData) -> Mapping[str, Parameter]:
    """Return all parameters by name: base, joints, effects, targets, fixtures."""
    zeros = {f"{robot.convention.zero(j.kind)}_{i}" for i, j in enumerate(robot.joints, 1)}
    parameters: dict[str, Parameter] = {}

    def add(name: str, unit: Unit, group: Group, nominal: float) -> None:
        if name in parameters:
            raise InputError(
                "two parameters of the robot would have the same name", where=name, cure="Rename the target or fixture."
            )
        parameters[name] = robot.known.get(name) or parameter(name, unit, group, nominal, robot.priors)

    for element in robot.trunk.elements:
        if element.parameter is not None:
            name = element.parameter
            group: Group = "joint zero" if name in zeros else "geometry"
            add(name, _unit(element), "base" if name.startswith("base_") else group, element.value)
    for effect in robot.effects:
        for plain in effect.parameters:
            if plain.name in parameters:
                raise InputError(
                    "two joint effects of the robot have the same parameter",
                    where=f"{robot.name}, {plain.name}",
                    came=", ".join(e.name for e in robot.effects if plain.name in [p.name for p in e.parameters]),
                    cure="They are forms of one effect: take one of them.",
                )
            parameters[plain.name] = robot.known.get(plain.name, plain)
    beside: tuple[tuple[Group, Sequence[Target | Fixture]], ...] = (
        ("target", robot.targets),
        ("fixture", robot.fixtures),
    )
    for group_of, parts in beside:
        for element in (element for part in parts for element in part.chain.elements):
            if element.parameter is not None:
                add(element.parameter, _unit(element), group_of, element.value)
    if SCALE in robot.known:
        parameters[SCALE] = robot.known[SCALE]
    return parameters


def effect_rates(
    robot: Robot, q: Array | Postures, names: Sequence[str], values: Mapping[str, float | Array]
) -> dict[str, Mapping[int, Array]]:
    """Return the derivative of the chain's variables by those of some parameters that belong to joint effects."""
    asked = set(names)
    effects = [effect for effect in robot.effects if not asked.isdisjoint(p.name for p in effect.parameters)]
    if not effects:
        return {}
    at = robot.loaded(q)
    relieved = at.relieved(values)
    rates = {n: rate for effect in effects for n, rate in effect.derivative(relieved, values).items() if n in asked}
    return rates | (_balancer_rates(robot, at, asked, values) if at.relief else {})


def _balancer_rates(
    robot: Robot, at: Postures, asked: Collection[str], values: Mapping[str, float | Array]
) -> dict[str, Mapping[int, Array]]:
    """Return the derivative of the chain's variables by factors of balancers: of what joints do under loads."""

    def under(name: str, more: float) -> dict[int, Array]:
        relieved = at.relieved({**values, name: np.asarray(values[name]) + more})
        moved: dict[int, Array] = {}
        for effect in robot.effects:
            if effect.loaded:
                for variable, part in effect.deflection(relieved, values).items():
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
        whole: The trunk, run through :func:`~truearm.engine.robot.chain.together` for all of them.
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
