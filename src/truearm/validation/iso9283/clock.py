"""Times of samples that were written with few decimals: what is not known of them, and an even clock through them.

A time rounded to q is off by up to q / 2, with a standard deviation of q / sqrt(12), and a tip with the velocity v is
elsewhere by v times that: 0.3 mm at 1 m/s for a millisecond. Instruments sample evenly, so that the times before they
were rounded lie on a straight line over the number of the sample, if one line leaves no time further off than rounding
does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array

#: Decimals of a second that a file may have; more are no rounding that matters.
_DECIMALS: Final = 6
#: Times are rounded if their resolution is more than this share of the time between two samples.
_ROUNDED: Final = 0.01
#: Steps differ by this share of themselves and more by rounding alone where a time is of no use by itself.
_COARSE: Final = 0.25
#: Of an even clock rounded times are off within a range of one resolution, and a little of its fit.
_RANGE: Final = 1.05
#: So often the range of slopes is cut by a third.
_CUTS: Final = 30
#: Fewer samples do not show that a clock is even.
_LEAST: Final = 10


@dataclass(frozen=True, eq=False)
class Clock:
    """When the samples of a record were taken."""

    time: Array  #: [s], ``(n,)``: on an even clock where rounded times allow for one, otherwise as they were written.
    #: To which they were rounded [s]; 0 where that is nothing beside the time between two samples.
    resolution: float = 0.0
    even: bool = False  #: Whether they are those of an even clock.
    pace: float = 0.0  #: Standard deviation of how much faster or slower that clock is, as a share.

    @property
    def sigma(self) -> float:
        """Standard deviation of the time of a sample among those about it [s]."""
        return 0.0 if self.even else self.resolution / float(np.sqrt(12.0))

    @property
    def is_coarse(self) -> bool:
        """Whether steps from one time to the next say little of how long they took."""
        return self.sigma > 0.0 and self.resolution > _COARSE * float(np.diff(self.time).mean())


def clock_of(time: Array) -> Clock:
    """Return the clock of a record.

    Args:
        time: As written [s], not decreasing, ``(n,)``.
    """
    if len(time) < _LEAST:
        return Clock(time)
    resolution = _resolution(time)
    step = float(time[-1] - time[0]) / (len(time) - 1)
    steps = np.diff(time)
    if not resolution > _ROUNDED * step:
        return Clock(time)
    usual = float(np.median(steps))
    whole = steps / max(usual, resolution)
    if steps.min() > 0.5 * resolution and np.abs(whole - np.round(whole)).max() < 0.01 * resolution / usual:
        return Clock(time, even=True)  # steps of one size: the clock is even as it is written
    single = steps[steps < 1.5 * usual] if usual > 0 else steps
    for size in (step, float(single.mean()) if len(single) else step):
        number = np.arange(len(time)) if size == step else np.concatenate([[0.0], np.cumsum(np.round(steps / size))])
        even = _even(time, number, resolution)
        if even is not None:
            return Clock(even, resolution, True, resolution / (step * len(time) ** 1.5))
    return Clock(time, resolution)


def _resolution(time: Array) -> float:
    """Return the decimal place to which times are written [s]; 0 for more than six decimals."""
    for decimals in range(_DECIMALS):
        scaled = time * 10.0**decimals
        if np.abs(scaled - np.round(scaled)).max() < 1e-9 * max(float(np.abs(scaled).max()), 1e2):
            return float(10.0**-decimals)
    return 0.0


def _even(time: Array, number: NDArray[np.intp] | Array, resolution: float) -> Array | None:
    """Return evenly spaced times within the resolution of those that are written; None if there are none."""
    if len(np.unique(number)) < len(number):
        return None
    off = time - time[0]
    slope, begin = np.polyfit(number, off, 1)
    if float(np.ptp(off - slope * number)) > _RANGE * resolution:  # of all lines the one that leaves the least range
        low, high = (slope + sign * 4.0 * resolution / number[-1] for sign in (-1.0, 1.0))
        for _ in range(_CUTS):
            third = (high - low) / 3.0
            one, other = (float(np.ptp(off - b * number)) for b in (low + third, high - third))
            low, high = (low, high - third) if one < other else (low + third, high)
        slope = 0.5 * (low + high)
        left = off - slope * number
        begin = 0.5 * (left.min() + left.max())
    if slope <= 0 or float(np.ptp(off - slope * number)) > _RANGE * resolution:
        return None
    return np.asarray(time[0] + begin + slope * number)
