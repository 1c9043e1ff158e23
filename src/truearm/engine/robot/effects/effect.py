"""What every joint effect can be asked."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.engine.robot.conventions.convention import JointKind
from truearm.engine.robot.parameters import Parameter, Unit
from truearm.engine.robot.postures import Postures

#: A derivative of the chain's variables: by parameter, and for each the variables it moves.
Rates = Mapping[str, Mapping[int, Array]]
#: What an effect moves the tip by, a root mean square, from which it is counted [m].
MATTERS: Final = 1e-6


@dataclass(frozen=True)
class Layout:
    """The variables of a robot's chain: joints, two tilts behind and three slides before each of them, and lengths."""

    kinds: tuple[JointKind, ...]  #: Kind of each joint; variable i moves joint i, from 0.
    #: Joint (from 0) and nominal value [m] of each slide of fixed length along the links.
    lengths: tuple[tuple[int, float], ...] = ()
    #: How often each joint's gear errs in a turn, each with no number, one or several; may be left out.
    transmission_periods: tuple[tuple[int, ...], ...] = ()
    balancers: int = 0  #: How many springs and gas cylinders relieve the joints.

    @property
    def joints(self) -> range:
        """The variables of the joints."""
        return range(len(self.kinds))

    @property
    def turning(self) -> tuple[int, ...]:
        """The revolute joints."""
        return tuple(i for i in self.joints if self.kinds[i] == "revolute")

    def tilt(self, joint: int) -> tuple[int, int]:
        """Return the variables of the tilts of a joint about its x and its y, which turns with the joint."""
        first = len(self.kinds) + 2 * joint
        return first, first + 1

    def length(self, number: int) -> int:
        """Return the variable that is added to entry `number` of `lengths`."""
        return 3 * len(self.kinds) + number

    def shift(self, joint: int) -> tuple[int, int, int]:
        """Return the variables of the slides of a joint along its own axes, as they are before it turns."""
        first = 3 * len(self.kinds) + len(self.lengths) + 3 * joint
        return first, first + 1, first + 2


@dataclass(frozen=True)
class Effect(ABC):
    """Small deflections of the joints: about or along their own axes, across them, or of the links' lengths.

    Args:
        layout: The variables of the robot's chain.
    """

    layout: Layout
    name: ClassVar[str]  #: As files and models spell it; also the group of its parameters.
    #: loaded, ordered, warmed: whether it depends on loads, on the order in which configurations were reached, on the
    #: temperature.
    loaded: ClassVar[bool] = False
    ordered: ClassVar[bool] = False
    warmed: ClassVar[bool] = False
    falls: ClassVar[bool] = False  #: Whether it depends on the direction of gravity, whatever the loads.
    #: tilts, stretches, shifts: whether it tilts joints, changes lengths, or moves the axes of joints.
    tilts: ClassVar[bool] = False
    stretches: ClassVar[bool] = False
    shifts: ClassVar[bool] = False
    #: Whether its parameters are springs, plays or gaps: nobody may state a negative one, and one that a fit finds is
    #: told.
    non_negative: ClassVar[bool] = False
    #: Whether it belongs to the kinematics of the rigid arm. Values far from nominal then mean another robot, other
    #: units or another order of the joints.
    kinematic: ClassVar[bool] = False
    #: Whether it is tried as an explanation of what a fit leaves; others are left to those who ask for them.
    selectable: ClassVar[bool] = True
    #: Name of the effect that it says how something differs from: a model without that one would have it stand in for
    #: it. Empty where there is none.
    part_of: ClassVar[str] = ""
    #: Whether the Python file of a robot computes it, see :mod:`truearm.robot_files.formats`.
    exportable: ClassVar[bool] = False

    @property
    @abstractmethod
    def parameters(self) -> tuple[Parameter, ...]:
        """Its parameters, at the values at which it does nothing; none where the robot has nothing that it moves."""

    @abstractmethod
    def deflection(self, at: Postures, values: Mapping[str, float | Array]) -> Mapping[int, Array]:
        """Return what is added to each variable that it moves [rad or m], each ``(n,)`` or ``(trials, n)``.

        Args:
            at: The postures, with their loads where the effect depends on them.
            values: Parameter values, each a number or ``(trials, 1)``.
        """

    @abstractmethod
    def derivative(self, at: Postures, values: Mapping[str, float | Array]) -> Rates:
        """Return, for each parameter, its derivative of the variables it moves. Loads are held."""

    def parameter(self, name: str, unit: Unit, prior: float, nominal: float = 0.0) -> Parameter:
        """Make a parameter of its own, at the value at which it does nothing."""
        return Parameter.plain(name, unit, self.name, nominal, prior)


@dataclass(frozen=True)
class LinearEffect(Effect):
    """An effect whose deflection is a sum of parameters times shapes that depend on the posture alone."""

    @cached_property
    def _nothing(self) -> Mapping[str, float]:
        """The value of each parameter at which it does nothing."""
        return {p.name: p.nominal for p in self.parameters}

    @abstractmethod
    def shapes(self, at: Postures) -> Rates:
        """Return what one unit of each parameter does to the variables it moves, each ``(n,)``."""

    def deflection(self, at: Postures, values: Mapping[str, float | Array]) -> Mapping[int, Array]:
        """Return the sum of parameters, counted from where they do nothing, times shapes."""
        moved: dict[int, Array] = {}
        for name, shape in self.shapes(at).items():
            amount = np.asarray(values[name]) - self._nothing[name]
            for variable, part in shape.items():
                moved[variable] = moved[variable] + amount * part if variable in moved else amount * part
        return moved

    def derivative(self, at: Postures, values: Mapping[str, float | Array]) -> Rates:
        """Return the shapes."""
        return self.shapes(at)


def effort(at: Postures, layout: Layout, joint: int) -> Array:
    """Return the load that turns a revolute joint forward [N m], or pushes a prismatic one [N], ``(n,)``."""
    return np.asarray(at.joint_loads[joint, 5 if layout.kinds[joint] == "revolute" else 2])
