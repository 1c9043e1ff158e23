"""Is the calibrated robot better than the nominal one on unseen configurations, and how well does it repeat."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import Notice, Rule, counted, millimetres
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.statistics import Errors
from truearm.engine.diagnose.unmodelled import WRONG_DATA
from truearm.engine.robot.chain import Array

# Both robots predict the same readings, so their errors are compared in pairs, one pair for each posture: readings of a
# posture share its errors and are not independent. The signed-rank test (Wilcoxon 1945) needs neither normal errors nor
# errors of one size, and a few wrong readings, which both robots miss alike, do not decide it. With fewer than seven
# pairs no result of it has a probability below 1 %, so that nothing is said of so few.

NO_GAIN: Final = Rule(
    "no-gain",
    "warning",
    "at unseen configurations the calibrated robot is not significantly better than the nominal one: "
    "[more](results.md#better-than-nominal)",
    gravity=2,
    unless=frozenset({WRONG_DATA}),
)
WORSE: Final = Rule(
    "worse-than-nominal",
    "error",
    "at unseen configurations the calibrated robot is significantly worse than the nominal one: "
    "[more](results.md#better-than-nominal)",
)
#: Probability of such differences, or larger ones, where there is no difference.
_LEVEL: Final = 0.01
#: Of fewer pairs even the most extreme order of signs is more probable than that.
_FEWEST: Final = math.ceil(-math.log2(_LEVEL))
#: Worse is by more than this factor: a fit in which nothing is wrong makes a robot that is accurate already worse by
#: some hundredths, because its parameters are uncertain.
_FACTOR: Final = 1.1
#: From so many pairs on the normal distribution is close enough.
_MANY: Final = 100
#: Joint positions that differ by less are one posture [rad or m].
_SAME: Final = math.radians(0.01)


FEW_HELD_OUT: Final = Rule(
    "few-held-out",
    "note",
    "fewer than seven postures are held out: whether the calibrated robot is better is not known",
)


def check_gain(before: Errors, after: Errors, data: Dataset, *, doubted: bool = False) -> list[Notice]:
    """Say if the calibrated robot is significantly worse than the nominal one, no better, or if that is not known.

    Args:
        before, after: Errors of the nominal and of the calibrated robot on the held-out part, both with base and
            targets found from the training part.
        data: The held-out part.
        doubted: Whether base and targets of the nominal robot were found by a robust loss, because readings are
            doubted.
    """
    old, new = (_by_posture(errors, data) for errors in (before, after))
    postures = counted(len(new), "posture")
    if len(new) < _FEWEST:
        return [
            FEW_HELD_OUT(
                f"Only {postures} with readings {'is' if len(new) == 1 else 'are'} held out: whether the calibrated "
                f"robot is better than the nominal one is not known. {_FEWEST} or more can tell."
            )
        ]
    figures = (
        f"On {postures} that the fit has not seen the median error is {millimetres(float(np.median(new)))} mm with the "
        f"calibrated robot and {millimetres(float(np.median(old)))} mm with the nominal one"
        f"{', whose base and targets were found with `loss=cauchy` because readings are doubted' if doubted else ''}."
    )
    if signed_rank_probability(new - _FACTOR * old) <= _LEVEL:
        return [
            WORSE(
                f"{figures} The calibrated robot is significantly worse (more than a tenth; signed-rank test in pairs, "
                "1 %). Do not use it: readings are wrong, or too few for this model.",
                "error",
            )
        ]
    if signed_rank_probability(old - new) <= _LEVEL:
        return []
    return [
        NO_GAIN(
            f"{figures} That is no significant gain (signed-rank test in pairs, 1 %). The nominal robot is accurate "
            "already, or there are too few readings for this model, or something is wrong with them."
        )
    ]


def signed_rank_probability(differences: Array) -> float:
    """Return how probable signed ranks are that speak for positive differences as much as these do, or more.

    The distribution is that of differences which are symmetric about zero: exact for up to a hundred of them, a normal
    one for more. Differences of zero are left out, and equal ones share their ranks.

    Args:
        differences: One for each pair, ``(n,)``.
    """
    from scipy.special import ndtr  # scipy.stats.wilcoxon is the same, but takes half a second to import

    d = differences[differences != 0.0]
    if not len(d):
        return 1.0
    group, count = np.unique(np.abs(d), return_inverse=True, return_counts=True)[1:]
    ranks = (2 * np.cumsum(count) - count + 1)[group]  # twice the mean rank: whole numbers
    reached = int(ranks[d > 0.0].sum())
    if len(d) > _MANY:
        mean, deviation = ranks.sum() / 2.0, math.sqrt(float(ranks @ ranks)) / 2.0
        return float(ndtr((mean - reached + 1.0) / deviation))
    chances = np.zeros(int(ranks.sum()) + 1)
    chances[0] = 1.0
    for rank in ranks.tolist():
        chances[rank:] = (chances[rank:] + chances[: len(chances) - rank]) / 2.0
        chances[:rank] /= 2.0
    return float(chances[reached:].sum())


def _by_posture(errors: Errors, data: Dataset) -> Array:
    """Return the mean error of the positions, else of the lengths, at each posture [m], ``(postures,)``."""
    off = np.linalg.norm(errors.position_errors, axis=1)
    if errors.length_errors is not None and not np.isfinite(off).any():
        off = np.abs(errors.length_errors)
    read = np.flatnonzero(np.isfinite(off))
    joints = np.round(data.joints[data.configuration[read]] / _SAME)
    group, count = np.unique(joints, axis=0, return_inverse=True, return_counts=True)[1:]
    return np.asarray(np.bincount(group.reshape(-1), off[read]) / count)


#: Joint positions that differ by less are the same [rad or m].
_SAME_REPEATABILITY: Final = 1e-9
#: Degrees of freedom from which a scatter is worth a figure: RP is then good to about a fifth.
_LEAST_FREEDOM: Final = 10


@dataclass(frozen=True, eq=False)
class VisitedAgain:
    """Readings at postures that were visited again, one of a target on each visit."""

    readings: IntArray  #: Their indices in the data, ``(k,)``.
    visit: IntArray  #: visit, posture: which of each they are of, ``(k,)``.
    posture: IntArray
    group: IntArray  #: Which of them are of one target at one posture: they have the same number, ``(k,)``.

    @property
    def freedom(self) -> int:
        """How many of them tell something of the scatter."""
        return len(self.readings) - len(np.unique(self.group))

    @property
    def visits(self) -> int:
        """How many visits there were."""
        return len(np.unique(self.visit))

    @property
    def postures(self) -> int:
        """To how many postures."""
        return len(np.unique(self.posture))

    @property
    def count(self) -> IntArray:
        """How many readings each stands beside, itself among them, ``(k,)``."""
        return np.asarray(np.bincount(self.group)[self.group])

    def apart(self, values: Array) -> Array:
        """Return by how much values of all readings, ``(readings, c)``, differ from the mean of theirs, ``(k, c)``."""
        own = values[self.readings]
        mean = np.stack([np.bincount(self.group, weights=axis) for axis in own.T], axis=1)
        return np.asarray(own - mean[self.group] / self.count[:, None])


def visited_again(data: Dataset, read: NDArray[np.bool_]) -> VisitedAgain | None:
    """Return the readings of postures that were visited again; None if too few were.

    Args:
        data: Readings. Visits of a posture are configurations with the same joint positions, or visits of one
            configuration.
        read: Which readings count, ``(readings,)``.
    """
    chosen = np.flatnonzero(read)
    if not len(chosen):
        return None
    at, none = data.configuration[chosen], np.zeros(len(chosen), dtype=np.intp)
    postures = _numbered(np.round(data.joints / _SAME_REPEATABILITY).T)[at]
    visit = _numbered(np.stack([at, none if data.visit is None else data.visit[chosen]]))
    fixture = none if data.fixture is None else data.fixture[chosen]
    group = _numbered(np.stack([postures, data.target[chosen], fixture]))
    first = np.unique(np.stack([group, visit]), axis=1, return_index=True)[1]  # more on one visit say nothing of others
    first = first[np.bincount(group[first])[group[first]] > 1]
    again = VisitedAgain(chosen[first], visit[first], postures[first], group[first])
    return again if again.freedom >= _LEAST_FREEDOM else None


def _numbered(columns: Array | IntArray) -> IntArray:
    """Return the same number for equal columns of ``(rows, n)``, ``(n,)``."""
    return np.asarray(np.unique(columns, axis=1, return_inverse=True)[1].reshape(-1))


# Readings of a target at the same joint positions, on separate visits, differ by the robot's repeatability and the
# noise of the instrument; no model of the robot is needed. ISO 9283 states it as RP, the mean distance of the visits
# from their barycentre plus three of its standard deviations. Here the scatter of all postures is taken together, the
# share of the instrument is taken out, and RP follows from the distances of a normal distribution with that scatter.
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
        data: Readings.
        sigma: Standard deviation of a coordinate [m].
    """
    again = visited_again(data, data.has_position)
    if again is None:
        return None
    apart, freedom = again.apart(data.position), again.freedom
    own = np.linalg.eigvalsh(apart.T @ apart / freedom) - sigma**2
    mean = float(mean_length(np.maximum(own, 0.0)))
    spread = math.sqrt(max(float(np.maximum(own, 0.0).sum()) - mean**2, 0.0))
    square = float(own.sum())
    beyond = np.bincount(  # all targets of a posture scatter together
        again.posture, np.einsum("ni,ni->n", apart, apart) - (square + 3.0 * sigma**2) * freedom / len(apart)
    )
    deviation = math.sqrt(float(beyond @ beyond)) / freedom
    return Repeatability(mean + 3.0 * spread, again.postures, again.visits, square, deviation)


def mean_length(variances: Array) -> Array:
    """Return the mean length of normal vectors with variances along three axes, ``(..., 3)``.

    A normal vector is a direction on the sphere, stretched, times a length whose mean is ``sqrt(8 / pi)``; and the mean
    over the sphere of ``sqrt(x a^2 + y b^2 + z c^2)`` is ``R_G(x, y, z)`` (Carlson 1995).
    """
    from scipy.special import elliprg

    return np.asarray(math.sqrt(8.0 / math.pi) * elliprg(*np.moveaxis(variances, -1, 0)))
