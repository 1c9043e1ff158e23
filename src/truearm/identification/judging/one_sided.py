"""Readings that a robust loss holds back, and that lie to one side.

Losses such as Huber's are right on average where outliers scatter to all sides. Outliers that lie to one side pull the
fit along, by less than they would pull least squares, and no interval contains that bias. The sides are compared by
arrival with what chance does to directions in space (Rayleigh's test; Mardia and Jupp 2000, "Directional statistics",
section 10.4.1).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.identification.solving.fit import Fit
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import errors_of
from truearm.notices import Notice

#: Weight below which a reading counts as held back.
_HELD_BACK: Final = 0.5
#: Configurations with such readings, at least.
_LEAST: Final = 8
#: Chi squared of three degrees of freedom that chance exceeds in 1 of 10 000 cases.
_BEYOND_CHANCE: Final = 21.1


def check_one_sided(fit: Fit, data: Dataset) -> list[Notice]:
    """Return a notice if positions that a loss holds back lie to one side.

    Args:
        data: What the fit was made from.
    """
    held = (np.nan_to_num(fit.weight, nan=1.0) < _HELD_BACK) & data.has_position
    if not held.any():
        return []
    off = -errors_of(fit.robot, data).position_errors[held]
    towards = off / np.maximum(np.linalg.norm(off, axis=1, keepdims=True), 1e-300)
    arrivals = np.unique(data.configuration[held], return_inverse=True)[1].reshape(-1)
    count = np.bincount(arrivals)
    if len(count) < _LEAST:
        return []
    mean = np.stack([np.bincount(arrivals, weights=axis) / count for axis in towards.T], axis=1)
    together = mean.sum(axis=0)
    if 3.0 * float(together @ together) / float(np.sum(mean**2)) < _BEYOND_CHANCE:
        return []
    shift = ", ".join(f"{v * 1e3:+.2g}" for v in np.median(off, axis=0).tolist())
    return [
        Notice(
            "outliers-one-sided",
            f"{int(held.sum())} readings at {len(count)} configurations are held back as outliers, and they lie to one "
            f"side: by ({shift}) mm in the instrument's axes, in the median. Outliers to one side pull the fit along, "
            "and the deviations of the parameters do not contain that bias. Find the cause and leave these readings "
            "out.",
        )
    ]
