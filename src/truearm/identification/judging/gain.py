"""Is the calibrated robot better than the nominal one, or worse, at configurations that the fit has not seen.

Both robots predict the same readings, so their errors are compared in pairs, one pair for each posture: readings of a
posture share its errors and are not independent. The signed-rank test (Wilcoxon 1945) needs neither normal errors nor
errors of one size, and a few wrong readings, which both robots miss alike, do not decide it. With fewer than seven
pairs no result of it has a probability below 1 %, so that nothing is said of so few.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import Errors
from truearm.modeling.chain import Array
from truearm.notices import Notice
from truearm.shown import counted, millimetres

#: The calibrated robot is no better than the nominal one, as far as unseen configurations tell.
NO_GAIN: Final = "no-gain"
#: It is significantly worse.
WORSE: Final = "worse-than-nominal"
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
            Notice(
                "few-held-out",
                f"Only {postures} with readings {'is' if len(new) == 1 else 'are'} held out: whether the calibrated "
                f"robot is better than the nominal one is not known. {_FEWEST} or more can tell.",
                "note",
            )
        ]
    figures = (
        f"On {postures} that the fit has not seen the median error is {millimetres(float(np.median(new)))} mm with the "
        f"calibrated robot and {millimetres(float(np.median(old)))} mm with the nominal one"
        f"{', whose base and targets were found with `loss=cauchy` because readings are doubted' if doubted else ''}."
    )
    if signed_rank_probability(new - _FACTOR * old) <= _LEVEL:
        return [
            Notice(
                WORSE,
                f"{figures} The calibrated robot is significantly worse (more than a tenth; signed-rank test in pairs, "
                "1 %). Do not use it: readings are wrong, or too few for this model.",
                "error",
            )
        ]
    if signed_rank_probability(old - new) <= _LEVEL:
        return []
    return [
        Notice(
            NO_GAIN,
            f"{figures} That is no significant gain (signed-rank test in pairs, 1 %). The nominal robot is accurate "
            "already, or there are too few readings for this model, or something is wrong with them.",
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
    which, count = np.unique(np.abs(d), return_inverse=True, return_counts=True)[1:]
    ranks = (2 * np.cumsum(count) - count + 1)[which]  # twice the mean rank: whole numbers
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
    which, count = np.unique(joints, axis=0, return_inverse=True, return_counts=True)[1:]
    return np.asarray(np.bincount(which.reshape(-1), off[read]) / count)
