"""Were the targets of a configuration read on separate visits, although the data call it one arrival.

The robot then stopped anew for every target, and what the joints missed by differs from reading to reading. It still
looks like errors of joints: it grows with the distance from their axes. So the likelihood in which all readings of a
configuration share the errors of the joints is compared with the one in which each reading has its own.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.identification.judging.arrival_likelihood import ArrivalLikelihood
from truearm.identification.judging.left_over import LeftOver
from truearm.notices import Notice

#: Twice the difference of the logarithms of both likelihoods from which separate visits are believed. They have the
#: same parameters, so it is the difference of their Bayesian information criteria; beyond 10 it is very strong (Kass
#: and Raftery 1995, "Bayes factors", section 3.2), and noise that is no sphere has given 15.
_LEAST_GAIN: Final = 20.0
#: Variance that errors of the joints make of that of the noise, at least: below it nothing depends on arrivals.
_LEAST_SHARE: Final = 0.5
#: Configurations with two readings or more, without which nothing is said.
_LEAST_SHARED: Final = 8


def check_separate_visits(left: LeftOver) -> list[Notice]:
    """Return a notice if the readings of a configuration do not share the errors of the joints that they show."""
    data = left.problem.data
    several = np.bincount(data.configuration[data.has_reading]) > 1
    if data.visit is not None or int(several.sum()) < _LEAST_SHARED:
        return []
    together, apart = ArrivalLikelihood.of(left), ArrivalLikelihood.of(left, each_reading=True)
    variances, each = apart.largest()
    if apart.share_of_joints(variances) < _LEAST_SHARE:
        return []
    shared = max(together.largest()[1], together.largest(together.factors)[1])
    if 2.0 * (each - shared) < _LEAST_GAIN:
        return []
    return [
        Notice(
            "separate-visits",
            "The readings of a configuration err as joints err, but each by itself, where readings of one arrival "
            "share the errors of the joints. So the targets were read on separate visits: the robot left and came back "
            "between them. Add the column `visit`, with the number of the visit on which each reading was taken; "
            "without it the expected error and all intervals are too small.",
        )
    ]
