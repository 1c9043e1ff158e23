"""How far an excursion goes: the top of a parabola through the samples about the largest of them."""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.modeling.chain import Array

#: The parabola goes through the samples within this share of the excursion's width at half its height, which of an
#: oscillation is a third of a period.
TOP: Final = 1 / 6
#: A top is beyond the larger of so few samples by less than this share if a period has eight, and by no more standard
#: deviations of noise besides; of more samples the largest is beyond the top.
_FEW: Final = 4
_BETWEEN: Final = 0.1
_NOISE: Final = 3.0


def top_of(time: Array, away: Array, peak: int, sigma: float) -> tuple[float, float]:
    """Return how far an excursion goes [m], and its width at half its height [s].

    Noise makes the largest of many samples too large, and the top may lie between two samples: a parabola through the
    samples about the largest knows both.

    Parameters
    ----------
    time, away
        Of the samples [s], ``(n,)``, and from where [m], ``(n, 3)``: of the excursion, and of nothing that goes
        further.
    peak
        Which sample is the furthest.
    sigma
        Noise of each coordinate [m].
    """
    along = away @ (away[peak] / np.linalg.norm(away[peak]))
    half = 0.5 * along[peak]
    first = int(np.flatnonzero(np.append(True, along[:peak] < half))[-1])
    below = np.flatnonzero(along[peak:] < half)
    last = peak + int(below[0]) if len(below) else len(along) - 1
    first = max(first - 1, 0)
    width = float(time[last] - time[first] - 0.5 * (time[last] - time[last - 1] + time[first + 1] - time[first]))
    near = np.flatnonzero(np.abs(time - time[peak]) <= TOP * width)
    near = near if len(near) >= 3 else np.arange(max(peak - 1, 0), min(peak + 2, len(time)))
    largest = float(along[near].max())
    most = largest if len(near) > _FEW else (1.0 + _BETWEEN) * largest + _NOISE * sigma
    if len(near) < 3:
        return float(along[peak]), width
    t = (time[near] - time[peak]) / max(float(np.abs(time[near] - time[peak]).max()), 1e-12)
    a, b, c = np.polyfit(t, along[near], 2)
    if a >= 0 or abs(b) > -2 * a:
        return float(along[near].mean() if len(near) > 3 else along[peak]), width
    return min(float(c - b * b / (4 * a)), most), width
