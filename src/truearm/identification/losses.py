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
_MEDIAN_OF_ONE: Final = 0.6745
# Where a loss starts to doubt a reading, in robust deviations of one coordinate: beyond the 95th percentile of the
# norm of three normal components for Huber, at its root mean square and a bit for Cauchy.
_HUBER: Final = 2.80
_CAUCHY: Final = 3.0


def norms_of(residual: Array, components: NDArray[np.intp]) -> Array:
    """Return the norm of each whitened reading, ``(readings,)``.

    A reading of one number is worth as many times more as makes its median that of three: the thresholds below hold for
    both.

    Parameters
    ----------
    residual
        Whitened, ``(rows,)``.
    components
        Number of consecutive rows of each reading, one to three.
    """
    first = np.concatenate([[0], np.cumsum(components)[:-1]])
    norms: Array = np.sqrt(np.add.reduceat(residual**2, first))
    norms[components == 1] *= MEDIAN_NORM / _MEDIAN_OF_ONE
    return norms


def robust_scale(norms: Array) -> float:
    """Return the deviation of one coordinate estimated from the median norm of the readings."""
    return float(np.median(norms)) / MEDIAN_NORM


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
