"""The IRB 120 as Nubiola models and drives it, for the studies of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.engine.fit.models import Model, named_model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot


@dataclass(frozen=True)
class Region:
    """A box of joint positions."""

    low: tuple[float, ...]  #: low, high: lowest and highest position of each joint [deg].
    high: tuple[float, ...]

    @property
    def limits(self) -> tuple[Array, Array]:
        """Lowest and highest position of each joint [rad], ``(joints,)`` each."""
        return np.radians(self.low), np.radians(self.high)

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Return configurations drawn evenly from the region [rad], ``(count, joints)``."""
        return np.asarray(rng.uniform(*self.limits, (count, len(self.low))))


#: Of the IRB 120: Nubiola, section 2.5; upper ends of joints 2 and 3 are the robot's own limits.
REGION: Final = Region((-90, 0, -80, -150, -90, -180), (90, 110, 70, 150, 90, 180))
#: Hayati's beta between axes 2 and 3 of the IRB 120 of study irb120-faro [rad]: the elastic model finds 0.0372 deg from
#: all 500 configurations, with a standard deviation of 0.0009 deg. Nubiola prints none of his arm.
BETA: Final = math.radians(0.037)
#: Frees what the document's Table 2.2 does, and Hayati's beta.
ELASTIC: Final[Model] = named_model("elastic")


def without_beta(robot: Robot) -> Robot:
    """Return an IRB 120 without Hayati's beta between its parallel axes 2 and 3 (Nubiola, Table 2.2).

    It is the document's own model: nothing tilts axis 3 sideways against axis 2.
    """
    third = robot.joints[2]
    row = {column: value for column, value in third.row.items() if column != "beta"}
    return replace(robot, joints=(*robot.joints[:2], replace(third, row=row), *robot.joints[3:]))
