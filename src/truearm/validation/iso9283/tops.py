"""How far an excursion goes: the top of a parabola through the samples about the largest of them."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array
from truearm.validation.iso9283.smoothing import local_lines

#: The parabola goes through the samples within this share of the excursion's width at half its height, which of an
#: oscillation is a third of a period.
TOP: Final = 1 / 6
#: A top is beyond the larger of so few samples by less than this share if a period has eight, and by no more standard
#: deviations of noise besides; of more samples the largest is beyond the top.
_FEW: Final = 4
_BETWEEN: Final = 0.1
_NOISE: Final = 3.0
#: The top of a parabola through n samples has the standard deviation of one over sqrt(n), times this.
_GAIN: Final = 1.5


def top_of(time: Array, away: Array, peak: int, sigma: float) -> tuple[float, float]:
    """Return how far an excursion goes [m], and its width at half its height [s].

    Noise makes the largest of many samples too large, and the top may lie between two samples: a parabola through the
    samples about the largest knows both.

    Args:
        time, away: Of the samples [s], ``(n,)``, and from where [m], ``(n, 3)``: of the excursion, and of nothing that
            goes further.
        peak: Which sample is the furthest.
        sigma: Noise of each coordinate [m].
    """
    along = away @ (away[peak] / np.linalg.norm(away[peak]))
    width = _width(time, along, peak)
    return _top(time, along, peak, width, sigma), width


def largest_top(time: Array, away: Array, counted: NDArray[np.bool_], sigma: float) -> tuple[float, float]:
    """Return how far the largest excursion of a record goes [m], and how far noise alone would seem to go there [m].

    Where the excursion is, and how wide, is seen in positions that are smoothed over more and more of its width; how
    far it goes, by a parabola as in :func:`top_of`.

    Args:
        counted: Which samples may be the furthest, ``(n,)``.
    """
    if not counted.any() or len(time) < 3:
        return 0.0, 0.0
    step = float(np.median(np.diff(time)))
    half, smooth = 0.0, away
    while True:
        peak = int(np.where(counted, np.linalg.norm(smooth, axis=1), -1.0).argmax())
        size = float(np.linalg.norm(smooth[peak]))
        if size == 0.0:
            return 0.0, 0.0
        unit = smooth[peak] / size
        width = _width(time, smooth @ unit, peak)
        if 2.0 * half >= TOP * width or TOP * width < 2.0 * step:
            break
        half = min(max(2.0 * half, 1.5 * step), TOP * width)
        smooth = local_lines(time, away, time, half)[0]
    along = away @ unit
    count = max(2.0 * TOP * width / step, 1.0)
    places = max((time[-1] - time[0]) / max(2.0 * TOP * width, step), 2.0)
    noise = sigma * min(_GAIN / count**0.5, 1.0) * float(np.sqrt(2.0 * np.log(places)))
    return max(_top(time, along, peak, width, sigma), 0.0), noise


def _width(time: Array, along: Array, peak: int) -> float:
    """Return how long an excursion is further than half its height [s]."""
    half = 0.5 * along[peak]
    first = int(np.flatnonzero(np.append(True, along[:peak] < half))[-1])
    below = np.flatnonzero(along[peak:] < half)
    last = peak + int(below[0]) if len(below) else len(along) - 1
    first = min(max(first - 1, 0), len(time) - 2)
    last = max(last, first + 1)
    return float(time[last] - time[first] - 0.5 * (time[last] - time[last - 1] + time[first + 1] - time[first]))


def _top(time: Array, along: Array, peak: int, width: float, sigma: float) -> float:
    near = np.flatnonzero(np.abs(time - time[peak]) <= TOP * width)
    near = near if len(near) >= 3 else np.arange(max(peak - 1, 0), min(peak + 2, len(time)))
    largest = float(along[near].max())
    most = largest if len(near) > _FEW else (1.0 + _BETWEEN) * largest + _NOISE * sigma
    if len(near) < 3:
        return float(along[peak])
    t = (time[near] - time[peak]) / max(float(np.abs(time[near] - time[peak]).max()), 1e-12)
    a, b, c = np.polyfit(t, along[near], 2)
    if a >= 0 or abs(b) > -2 * a:
        return float(along[near].mean() if len(near) > 3 else along[peak])
    return min(float(c - b * b / (4 * a)), most)
