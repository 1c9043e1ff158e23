"""Straight lines through the samples within a window about each of many places: values and rates without noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array

#: So many places at once: sums begin anew with each part, which keeps them short and their rounding small.
_PART = 50_000


def local_lines(at: Array, values: Array, places: Array, half: float) -> tuple[Array, Array, NDArray[np.intp]]:
    """Return value and rate of least-squares lines through the samples within a window about each place.

    The rate of a line is that of a local polynomial of second order where samples lie evenly. Of a value that swings
    with an angular frequency w it returns the share ``3 (sin x - x cos x) / x^3`` with ``x = w half`` of the rate's
    swing (Savitzky and Golay 1964, first derivative, many samples).

    Args:
        at: Where the samples are: times or arc lengths, not decreasing, ``(n,)``.
        values: ``(n, d)``.
        places: Where lines are wanted, not decreasing, ``(m,)``.
        half: Half the window.

    Returns:
        value, rate, count: ``(m, d)``, ``(m, d)`` and how many samples each window has, ``(m,)``. Where the samples of
            a window would not tell the value better than one of them alone, both are those of the straight line between
            the samples before and after the place.
    """
    value, rate = np.empty((len(places), values.shape[1])), np.empty((len(places), values.shape[1]))
    low = np.searchsorted(at, places - half, side="left")
    high = np.searchsorted(at, places + half, side="right")
    count = high - low
    for begin in range(0, len(places), _PART):
        part = slice(begin, min(begin + _PART, len(places)))
        first, last = int(low[part].min()), int(high[part].max())
        if last <= first:
            _between(at, values, places[part], np.ones(part.stop - part.start, bool), value[part], rate[part])
            continue
        origin, offset = at[first], values[first]
        x, y = at[first:last] - origin, values[first:last] - offset
        sums = np.zeros((last - first + 1, 2 + 2 * y.shape[1]))
        sums[1:, 0], sums[1:, 1] = x, x * x
        sums[1:, 2 : 2 + y.shape[1]], sums[1:, 2 + y.shape[1] :] = y, x[:, None] * y
        np.cumsum(sums, axis=0, out=sums)
        inside = sums[high[part] - first] - sums[low[part] - first]
        n = np.maximum(count[part], 1)
        mean = inside[:, 0] / n
        spread = inside[:, 1] - n * mean * mean
        mean_y = inside[:, 2 : 2 + y.shape[1]] / n[:, None]
        along = inside[:, 2 + y.shape[1] :] - mean[:, None] * inside[:, 2 : 2 + y.shape[1]]
        away = places[part] - origin - mean
        # no value is less certain than a single sample: a cluster of samples does not tell what is beside it
        usable = (count[part] >= 2) & (spread > 1e-9 * half**2 * n) & (away**2 <= spread * (1.0 - 1.0 / n))
        with np.errstate(invalid="ignore", divide="ignore"):
            slope = along / spread[:, None]
        value[part] = offset + mean_y + slope * away[:, None]
        rate[part] = slope
        if not usable.all():
            _between(at, values, places[part], ~usable, value[part], rate[part])
    return value, rate, count


def _between(at: Array, values: Array, places: Array, chosen: NDArray[np.bool_], value: Array, rate: Array) -> None:
    """Fill in values and rates between the samples before and after some places."""
    after = np.clip(np.searchsorted(at, places[chosen], side="right"), 1, len(at) - 1)
    step = at[after] - at[after - 1]
    slope = (values[after] - values[after - 1]) / np.where(step > 0, step, np.inf)[:, None]
    value[chosen] = values[after - 1] + slope * (places[chosen] - at[after - 1])[:, None]
    rate[chosen] = slope
