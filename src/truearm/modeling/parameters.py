"""Parameters as objects: a name, a unit, a value and what is known about it.

Vectors of parameters exist only inside solvers, in the order of :class:`FreeParameters`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, Literal

import numpy as np

from truearm.arrays import finite_number
from truearm.modeling.chain import Array

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
