"""How well the robot comes back to a posture, from postures that were visited again.

Readings of a target at the same joint positions, on separate visits, differ by the robot's repeatability and the noise
of the instrument; no model of the robot is needed. ISO 9283 states it as RP, the mean distance of the visits from their
barycentre plus three of its standard deviations. Here the scatter of all postures is taken together, the share of the
instrument is taken out, and RP follows from the distances of a normal distribution with that scatter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array

#: Joint positions that differ by less are the same [rad or m].
_SAME: Final = 1e-9
#: Degrees of freedom from which a scatter is worth a figure: RP is then good to about a fifth.
_LEAST_FREEDOM: Final = 10


@dataclass(frozen=True)
class Repeatability:
    """Of a robot, at the postures that were visited again."""

    rp: float  #: Pose repeatability of ISO 9283 [m].
    postures: int  #: How many were visited again.
    visits: int  #: How many visits these had together.
    #: Mean square of the visits' distances from where the posture is on average, without the instrument's noise [m^2];
    #: negative where the visits scatter less than the noise lets expect.
    square: float
    deviation: float  #: Its standard deviation [m^2].


def repeatability(data: Dataset, sigma: float) -> Repeatability | None:
    """Return the repeatability that postures visited again show; None if too few were.

    Args:
        data: Readings. Visits of a posture are configurations with the same joint positions, or visits of one
            configuration.
        sigma: Standard deviation of a coordinate [m].
    """
    read = np.flatnonzero(data.has_position)
    if not len(read):
        return None
    postures = np.unique(np.round(data.joints / _SAME), axis=0, return_inverse=True)[1].reshape(-1)
    visit = np.zeros(len(read), dtype=np.intp) if data.visit is None else data.visit[read]
    at = data.configuration[read]
    keys = np.stack([postures[at], data.target[read]])
    sets = np.unique(keys, axis=1, return_inverse=True)[1].reshape(-1)
    arrival = np.unique(np.stack([sets, at, visit]), axis=1, return_inverse=True)[1].reshape(-1)
    first = np.unique(arrival, return_index=True)[1]  # several readings on one visit say nothing of the next
    sets, at, visit, place = sets[first], at[first], visit[first], data.position[read][first]
    count = np.bincount(sets)
    again = count[sets] > 1
    freedom = int((count[count > 1] - 1).sum())
    if freedom < _LEAST_FREEDOM:
        return None
    centre = np.stack([np.bincount(sets, weights=axis) / count for axis in place.T], axis=1)
    apart = (place - centre[sets])[again]
    own = np.linalg.eigvalsh(apart.T @ apart / freedom) - sigma**2
    mean = _mean_length(np.maximum(own, 0.0))
    spread = math.sqrt(max(float(np.maximum(own, 0.0).sum()) - mean**2, 0.0))
    visits = len(np.unique(np.stack([at, visit])[:, again], axis=1).T)
    square = float(own.sum())
    posture = postures[at[again]]  # of which all targets scatter together
    beyond = np.bincount(
        posture, np.einsum("ni,ni->n", apart, apart) - (square + 3.0 * sigma**2) * freedom / len(apart)
    )
    deviation = math.sqrt(float(beyond @ beyond)) / freedom
    return Repeatability(mean + 3.0 * spread, len(np.unique(posture)), visits, square, deviation)


def _mean_length(variances: Array) -> float:
    """Return the mean length of a normal vector with variances along three axes.

    ``E sqrt(Q) = int (1 - E exp(-t Q)) t^-1.5 dt / (2 sqrt(pi))``, and ``E exp(-t Q)`` is the product of
    ``(1 + 2 t v)^-0.5`` (Mathai and Provost 1992, "Quadratic forms in random variables", section 3.2b).
    """
    largest = float(variances.max())
    if largest <= 0.0:
        return 0.0
    logs = np.linspace(-30.0, 40.0, 1401)
    t = np.exp(logs)
    missing = -np.expm1(-0.5 * np.log1p(2.0 * t[:, None] * variances / largest).sum(axis=1))
    return math.sqrt(largest) * float(np.trapezoid(missing / np.sqrt(t), logs)) / (2.0 * math.sqrt(math.pi))
