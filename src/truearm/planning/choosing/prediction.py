"""How accurate a calibration will be, before anything is measured.

The deviations of the readings give the covariance of the parameters, and that gives the error of predictions anywhere.
A fit takes readings as independent, but what a model cannot follow moves all targets of a pose alike: on the measured
IRB 120 three quarters of the variance of the residuals, with every model tried. So the covariance is that of a least
squares fit to readings that hang together, ``P (J' C J + K) P`` with ``P = (J' J + K)^-1``, where K is the information
of the priors and C the correlation of the readings.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.planning.choosing.exchange import most_informative
from truearm.planning.choosing.observability import O1
from truearm.planning.choosing.sensitivity import Sensitivity

#: Numbers of poses that are looked at, from as many as the model needs at least.
NUMBERS: Final = (8, 10, 12, 15, 18, 20, 25, 30, 35, 40, 50, 60, 80, 100, 150, 200)
#: More poses are said to be of little use where the error is within this of what no number of poses goes below.
NEAR: Final = 1.1
#: A plan that leaves an error of more than one part in this of what the robot has without it tells little.
_LITTLE: Final = 2.0
#: What is wherever the instrument and the targets were set up, by groups of parameters.
_PLACED: Final = ("base", "target", "fixture")
_POOL: Final = 500
#: Share of a reading's variance that all targets of a pose have in common (irb120-faro, docs/guide/planning.md).
_COMMON_SHARE: Final = 0.75
_DRAWS: Final = 5
#: Mean length of a vector of three normal coordinates, per deviation.
_MEAN_LENGTH: Final = math.sqrt(8.0 / math.pi)


@dataclass(frozen=True, eq=False)
class There:
    """How far the model will be off where the robot is wanted to be accurate [m], without the noise of a reading."""

    places: Array  #: Where the flange is, in the world, ``(k, 3)``.
    error: Array  #: Mean error of the targets there after the plan, ``(k,)``.
    by_o1: Array | None  #: The same after as many configurations that O1 chooses; None where the plan is O1's.


@dataclass(frozen=True, eq=False)
class Prediction:
    """Mean errors of positions that were not measured [m]."""

    floor: float  #: What no number of poses goes below: the noise of the reading that judges.
    planned: float  #: Of the plan.
    numbers: NDArray[np.intp]  #: Numbers of poses.
    chosen: Array  #: chosen, random: error after as many poses, chosen by O1 and drawn at random, ``(numbers,)``.
    random: Array
    places: Array  #: Where the flange is at random configurations, in the world, ``(k, 3)``.
    error: Array  #: Mean error of the targets there, of the model alone, without the noise of a reading, ``(k,)``.
    there: There | None = None  #: The same where the robot is wanted to be accurate; None if nothing was said of that.
    #: Mean error of the robot that is not calibrated, by the priors of what the model identifies of its joints, seen
    #: from where base and targets are known [m].
    nominal: float = 0.0

    @property
    def sufficient_number(self) -> int | None:
        """The smallest of the numbers with an error at most 10 % above the floor; None if all are too small."""
        near = self.numbers[self.chosen <= NEAR * self.floor]
        return int(near[0]) if len(near) else None

    @property
    def tells_little(self) -> bool:
        """Whether the model is left with more than half of the error that the robot has without a calibration."""
        return 0.0 < self.nominal < _LITTLE * float(self.error.mean())


def variances(candidates: Sensitivity, measured: NDArray[np.intp], elsewhere: Sensitivity) -> Array:
    """Return the mean variance of a coordinate at each configuration elsewhere, in variances of the noise, ``(k,)``.

    Args:
        candidates: What could be measured.
        measured: Which of them are.
        elsewhere: Where the model is judged, of the same parameters.
    """
    known = candidates.known
    rows = candidates.rows[measured]
    together = rows.reshape(len(rows), -1, 3, len(known)).sum(axis=1).reshape(-1, len(known))
    rows = rows.reshape(-1, len(known))
    information = rows.T @ rows
    spread = (1.0 - _COMMON_SHARE) * information + _COMMON_SHARE * (together.T @ together) + known
    root = np.linalg.solve(known + information, np.linalg.cholesky(spread))
    return np.tensordot(elsewhere.squares, root @ root.T, 2)


def model_error(candidates: Sensitivity, measured: NDArray[np.intp], elsewhere: Sensitivity, noise: float) -> Array:
    """Return the mean error of a position at each configuration elsewhere [m], of the model alone, ``(k,)``."""
    return np.asarray(_MEAN_LENGTH * noise * np.sqrt(variances(candidates, measured, elsewhere)))


def nominal_error(elsewhere: Sensitivity, noise: float) -> float:
    """Return the mean error of positions elsewhere before anything is measured, base and targets being known [m]."""
    own = np.array([p.group not in _PLACED for p in elsewhere.free.parameters], dtype=bool)
    moved = elsewhere.rows[..., own] * (elsewhere.free.prior / elsewhere.size)[own]
    return float(_MEAN_LENGTH * noise * np.mean(np.sqrt(np.mean(np.sum(moved**2, axis=2), axis=1))))


def predict(
    robot: Robot,
    candidates: Sensitivity,
    chosen: NDArray[np.intp],
    elsewhere: Sensitivity,
    q: Array,
    noise: float,
    rng: np.random.Generator,
) -> Prediction:
    """Predict the error after measuring the chosen candidates, and how it falls with their number.

    Args:
        candidates: What could be measured.
        chosen: What is.
        elsewhere: The same at the configurations `q` where the model is judged.
        noise: Standard deviation of a coordinate [m].
    """
    known = candidates.known

    def mean_error(measured: NDArray[np.intp]) -> float:
        return float(_MEAN_LENGTH * noise * np.mean(np.sqrt(1.0 + variances(candidates, measured, elsewhere))))

    count = len(candidates.rows)
    pool = rng.permutation(count)[:_POOL]
    kept = candidates.identifiable(max(NUMBERS))
    least = len(kept) / candidates.rows.shape[1]
    numbers = np.array([n for n in NUMBERS if least <= n <= len(pool)], dtype=np.intp)
    rows, known_of_kept = candidates.rows[pool][..., kept], known[np.ix_(kept, kept)]
    by_choice = [mean_error(pool[most_informative(rows, int(n), known_of_kept, O1())]) for n in numbers]
    orders = [rng.permutation(count) for _ in range(_DRAWS)]
    by_chance = [float(np.mean([mean_error(order[:n]) for order in orders])) for n in numbers]
    return Prediction(
        floor=_MEAN_LENGTH * noise,
        planned=mean_error(chosen),
        numbers=numbers,
        chosen=np.array(by_choice),
        random=np.array(by_chance),
        places=robot.world_poses(q)[0],
        error=model_error(candidates, chosen, elsewhere, noise),
        nominal=nominal_error(elsewhere, noise),
    )
