"""How much a reading counts, by how far off it is.

A loss acts on whole readings (the norm of their whitened residuals), not on single coordinates: a target caught
by mistake is wrong in all of them. Each is solved by iterated reweighting (Holland and Welsch 1977).
"""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array

Loss = Literal["linear", "huber", "cauchy", "l1"]
LOSSES: Final[tuple[Loss, ...]] = ("linear", "huber", "cauchy", "l1")

#: Median norm of three independent standard normal components.
MEDIAN_NORM: Final = 1.5382
#: The 95th percentile of the norm of three normal components by that of one.
_OF_ONE: Final = 2.7955 / 1.9600
#: The median of one, times that.
_MEDIAN_OF_ONE: Final = 0.6745 * _OF_ONE
# Where a loss starts to doubt a reading, in robust deviations of one coordinate: beyond the 95th percentile of the
# norm of three normal components for Huber, at its root mean square and a bit for Cauchy.
_HUBER: Final = 2.80
_CAUCHY: Final = 3.0


def norms_of(residual: Array, components: NDArray[np.intp]) -> Array:
    """Return the norm of each whitened reading, ``(readings,)``.

    Those of one number are multiplied so that 95 of 100 good ones stay below what 95 of 100 good readings of three do:
    the thresholds hold for both.

    Parameters
    ----------
    residual
        Whitened, ``(rows,)``.
    components
        Number of consecutive rows of each reading, one to three.
    """
    first = np.concatenate([[0], np.cumsum(components)[:-1]])
    norms: Array = np.sqrt(np.add.reduceat(residual**2, first))
    norms[components == 1] *= _OF_ONE
    return norms


def robust_scale(norms: Array, components: NDArray[np.intp]) -> float:
    """Return the deviation of one coordinate estimated from the median of the norms, as from :func:`norms_of`."""
    return float(np.median(norms / np.where(components == 1, _MEDIAN_OF_ONE, MEDIAN_NORM)))


def weights(loss: Loss, norms: Array, scale: float) -> Array:
    """Return the weight of each reading's squared residual, ``(readings,)``.

    Parameters
    ----------
    norms
        Norm of each whitened reading.
    scale
        Robust deviation of one coordinate; for ``l1`` the norm below which a reading counts as met.
    """
    if loss == "huber":
        return np.minimum(1.0, _HUBER * scale / np.maximum(norms, 1e-300))
    if loss == "cauchy":
        return 1.0 / (1.0 + (norms / (_CAUCHY * scale)) ** 2)
    if loss == "l1":
        return 1.0 / np.maximum(norms, scale)
    return np.ones_like(norms)
