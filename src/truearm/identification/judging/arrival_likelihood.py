"""How likely the readings are if arrivals, their noise or the errors of the joints were others than the fit took.

The fit groups readings by configuration and takes declared deviations as they are. What it leaves can be asked whether
something else is more likely: by the same restricted likelihood, with the parameters integrated out at the solution
(:mod:`truearm.identification.solving.variance_components`). Twice the gain of a free variance is chi squared of one
degree of freedom (Wilks 1938).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.identification.judging.left_over import LeftOver
from truearm.identification.solving.arrivals import Arrivals
from truearm.identification.solving.likelihood import Linearised
from truearm.identification.solving.rounds import factors_of
from truearm.identification.solving.variance_components import Variances, largest_likelihood
from truearm.measurement.statistics import errors_of
from truearm.modeling.chain import Array

#: Readings that are left so many times farther off than half of them are outliers: no variance is made of these.
_OUTLIER: Final = 6.0
_LEAST: Final = 1e-12
#: Configurations that are looked at, evenly spaced; more would tell no more, and take longer than the fit.
_CONFIGURATIONS: Final = 100


@dataclass(frozen=True, eq=False)
class ArrivalLikelihood:
    """The likelihood of what a fit leaves."""

    left: LeftOver  #: What it leaves.
    at: Linearised  #: The fit linearised there, with arrivals as they are taken; outliers left out.
    factors: tuple[str, ...]  #: What the variances of readings are counted under.

    @classmethod
    def of(cls, left: LeftOver, *, each_reading: bool = False) -> ArrivalLikelihood:
        """Take the arrivals of the data, or every reading as one of its own."""
        problem, free = left.problem, left.fit.free
        values = np.array([left.fit.robot.values[name] for name in free.names])
        names, factor = factors_of(problem)
        of_reading = _readings(left)
        arrivals = of_reading if each_reading else problem.arrivals
        kept = _no_outliers(left.residual, of_reading) & _some(left)
        return cls(
            left,
            Linearised(
                residual=left.residual[kept],
                by_parameters=left.jacobian[kept] * free.prior,
                by_joints=problem.at(values).by_joints[kept],
                offset=(values - free.nominal) / free.prior,
                priors=True,
                arrivals=Arrivals(np.unique(arrivals[kept], return_inverse=True)[1].reshape(-1)),
                factor=factor[kept],
            ),
            tuple(names),
        )

    def largest(self, known: tuple[str, ...] = (), joints: Array | None = None) -> tuple[Variances, float]:
        """Return the likeliest variances, by those that the fit took, and the logarithm of their likelihood.

        Args:
            known: Factors whose variance is what the fit took.
            joints: Variances of the joints' errors where they are known, ``(joints,)``.
        """
        kinds = np.array([joint.kind for joint in self.left.fit.robot.joints])
        alike = [np.flatnonzero(kinds == kind) for kind in dict.fromkeys(kinds.tolist())]
        free = [name not in known for name in self.factors]
        return largest_likelihood(self.at, free, np.full(len(free), _LEAST), alike, joints)

    def share_of_joints(self, variances: Variances) -> float:
        """Return what errors of the joints do to the readings, by what noise does: a ratio of variances."""
        by_joints = float(np.sum(self.at.by_joints**2 @ variances.joints))
        return by_joints / max(float(np.sum(variances.factors[self.at.factor])), _LEAST)


def lever_of(left: LeftOver) -> float:
    """Return how far targets move if every turning joint errs by one, as a root mean square [m/rad]; 0 if by nothing.

    The squares of the joints add up.
    """
    problem = left.problem
    turning = np.array([joint.kind == "revolute" for joint in left.fit.robot.joints])
    values = np.array([left.fit.robot.values[name] for name in left.fit.free.names])
    by_joints, first, squares, count = problem.at(values).by_joints[:, turning], 0, 0.0, 0
    for block in problem.blocks:
        rows = by_joints[first : first + block.rows].reshape(len(block.readings), -1)
        first += block.rows
        if block.observation.name == "position":
            squares += float(np.sum((rows * block.sigma[:, None]) ** 2))
            count += len(block.readings)
    return float(np.sqrt(squares / max(count, 1)))


def joints_as_far_off(left: LeftOver) -> float:
    """Return the error of every turning joint that would move targets as far as they are left off [rad]; 0 if none can.

    As a root mean square, with the share that parameters have taken given back, and what is declared as noise taken
    out.
    """
    off = errors_of(left.fit.robot, left.problem.data).position_norms
    lever = lever_of(left)
    if not len(off) or lever <= 0.0:
        return 0.0
    off = off[off <= _OUTLIER * np.median(off)]
    spent = sum(left.fit.robot.parameters[name].informed or 0.0 for name in left.fit.free.names)
    square = float(np.mean(off**2)) / max(1.0 - spent / (3 * len(off)), 0.1)
    if any(block.declared for block in left.problem.blocks):
        square -= 3.0 * left.fit.sigma.get("position", 0.0) ** 2
    return float(np.sqrt(max(square, 0.0))) / lever


def _readings(left: LeftOver) -> NDArray[np.intp]:
    """Return the reading that each equation is of, ``(rows,)``."""
    blocks = left.problem.blocks
    return np.concatenate([np.repeat(block.readings, block.observation.components) for block in blocks])


def _some(left: LeftOver) -> NDArray[np.bool_]:
    """Return which equations are of configurations that are looked at, ``(rows,)``."""
    count = left.problem.data.configurations
    chosen = np.linspace(0, count - 1, min(count, _CONFIGURATIONS)).round().astype(np.intp)
    return np.asarray(np.isin(left.configuration, chosen))


def _no_outliers(residual: Array, of_reading: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return which equations are of readings that are not far off, ``(rows,)``."""
    squares = np.bincount(of_reading, weights=residual**2)
    rows = np.maximum(np.bincount(of_reading), 1)
    size = np.sqrt(squares / rows)
    present = np.bincount(of_reading) > 0
    return np.asarray((size <= _OUTLIER * float(np.median(size[present])))[of_reading])
