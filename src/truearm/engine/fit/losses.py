"""How much a reading counts, by how far off it is.

A loss acts on whole readings (the norm of their whitened residuals), not on single coordinates: a target caught
by mistake is wrong in all of them. Only ``l1-components`` adds up single coordinates, and so depends on how the axes of
the instrument lie. Each is solved by iterated reweighting (Holland and Welsch 1977).
"""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.engine.robot.chain import Array

Loss = Literal["linear", "huber", "cauchy", "l1", "l1-components"]
LOSSES: Final[tuple[Loss, ...]] = ("linear", "huber", "cauchy", "l1", "l1-components")
#: Those that are sums of absolute values.
ABSOLUTE: Final[tuple[Loss, ...]] = ("l1", "l1-components")

#: Median norm of three independent standard normal components.
MEDIAN_NORM: Final = 1.5382
#: The 95th percentile of the norm of three normal components by that of one.
_OF_ONE: Final = 2.7955 / 1.9600
#: The median of one, times that.
_MEDIAN_OF_ONE: Final = 0.6745 * _OF_ONE
#: Share of the median below which an l1 reading counts as met.
_L1_MET: Final = 1e-4
# Where a loss starts to doubt a reading, in robust deviations of one coordinate: beyond the 95th percentile of the
# norm of three normal components for Huber, at its root mean square and a bit for Cauchy.
_HUBER: Final = 2.80
_CAUCHY: Final = 3.0


def weighed_together(loss: Loss, components: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return how many consecutive rows a loss weighs as one: those of a reading, or each alone."""
    return np.ones(int(components.sum()), dtype=np.intp) if loss == "l1-components" else components


def norms_of(residual: Array, components: NDArray[np.intp]) -> Array:
    """Return the norm of each whitened reading, ``(readings,)``.

    Those of one number are multiplied so that 95 of 100 good ones stay below what 95 of 100 good readings of three do:
    the thresholds hold for both.

    Args:
        residual: Whitened, ``(rows,)``.
        components: Number of consecutive rows of each reading, one to three.
    """
    first = np.concatenate([[0], np.cumsum(components)[:-1]])
    norms: Array = np.sqrt(np.add.reduceat(residual**2, first))
    norms[components == 1] *= _OF_ONE
    return norms


def robust_scale(norms: Array, components: NDArray[np.intp]) -> float:
    """Return the deviation of one coordinate estimated from the median of the norms, as from :func:`norms_of`."""
    return float(np.median(norms / np.where(components == 1, _MEDIAN_OF_ONE, MEDIAN_NORM)))


def meets_exactly(loss: Loss, components: NDArray[np.intp]) -> bool:
    """Return whether a fit meets as many numbers exactly as it has parameters: sums of absolute single numbers."""
    return loss in ABSOLUTE and bool(np.all(components == 1))


def scale_of(loss: Loss, norms: Array, components: NDArray[np.intp], spent: float) -> float:
    """Return the deviation of one coordinate that a fit leaves.

    Args:
        norms: As from :func:`norms_of`, of what the loss weighs together.
        spent: How many coordinates the parameters used up: a sum of absolute single numbers leaves so many at zero, and
            those say nothing of the noise.
    """
    if meets_exactly(loss, components):
        smallest = np.argsort(norms)[min(int(spent), len(norms) - 1) :]
        return robust_scale(norms[smallest], components[smallest])
    return robust_scale(norms, components)


def weights(loss: Loss, norms: Array, scale: float) -> Array:
    """Return the weight of each reading's squared residual, ``(readings,)``.

    Args:
        norms: Norm of each whitened reading.
        scale: Robust deviation of one coordinate; for sums of absolute values the norm below which a reading counts as
            met.
    """
    if loss == "huber":
        return np.minimum(1.0, _HUBER * scale / np.maximum(norms, 1e-300))
    if loss == "cauchy":
        return 1.0 / (1.0 + (norms / (_CAUCHY * scale)) ** 2)
    if loss in ABSOLUTE:
        return 1.0 / np.maximum(norms, scale)
    return np.ones_like(norms)


def scales_of_pulls(loss: Loss, residual: Array, components: NDArray[np.intp], parameters: int) -> tuple[float, float]:
    """Return the robust deviation of one coordinate, and the norm below which a reading counts as met, of readings."""
    if loss == "linear":
        return 1.0, 1.0
    components = weighed_together(loss, components)
    norms = norms_of(residual, components)
    scale = max(scale_of(loss, norms, components, parameters), 1e-300)
    return scale, scale if loss not in ABSOLUTE else _L1_MET * float(np.median(norms)) + 1e-300


def pulls(
    loss: Loss,
    residual: Array,
    jacobian: Array,
    components: NDArray[np.intp],
    scales: tuple[float, float] | None = None,
) -> tuple[Array, Array]:
    """Return what each equation pulls the parameters with, and the square root of what it tells of them.

    The first is its residual times its weight times its derivative. The second squared is the derivative of that
    by the parameters: a reading that a loss holds back follows the parameters across the line to its prediction, and
    along it less or not at all. Where a loss pushes a reading away (Cauchy), it counts as not following. For sums of
    absolute values of single numbers, whose pull only jumps, it is the density of the residuals at zero, of a normal
    distribution with their median.

    Args:
        residual, jacobian: Whitened, ``(rows,)`` and ``(rows, parameters)``.
        components: Number of consecutive rows of each reading.
        scales: Those of :func:`scales_of_pulls` of all readings, where these are a part of them.

    Returns:
        pull, root: Each ``(rows, parameters)``.
    """
    if loss == "linear":
        return residual[:, None] * jacobian, jacobian
    scale, met = scales or scales_of_pulls(loss, residual, components, jacobian.shape[1])
    components = weighed_together(loss, components)
    norms = norms_of(residual, components)
    across = weights(loss, norms, met)
    if loss == "huber":
        along = np.where(norms < _HUBER * scale, 1.0, 0.0)
    elif loss == "cauchy":
        far = (norms / (_CAUCHY * scale)) ** 2
        along = np.maximum(1.0 - far, 0.0) / (1.0 + far) ** 2
    else:
        single = components == 1
        along = np.where(single, np.sqrt(2.0 / np.pi) / (_OF_ONE * scale), 0.0)
    first = np.concatenate([[0], np.cumsum(components)[:-1]])
    length = np.sqrt(np.add.reduceat(residual**2, first))
    towards = residual / np.repeat(np.maximum(length, 1e-300), components)
    radial = np.repeat(np.add.reduceat(towards[:, None] * jacobian, first, axis=0), components, axis=0)
    more = np.repeat(np.sqrt(along) - np.sqrt(across), components)
    root = np.repeat(np.sqrt(across), components)[:, None] * jacobian + (more * towards)[:, None] * radial
    return (np.repeat(across, components) * residual)[:, None] * jacobian, root
