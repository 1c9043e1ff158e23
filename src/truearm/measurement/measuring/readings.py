"""One reading of an instrument, and what it is worth by itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.modeling.chain import Array

#: Why a reading is not kept. Every reason is the instrument's or the operator's; none asks how well a reading fits.
REASONS: Final[dict[str, str]] = {
    "beam-break": "the beam was interrupted",
    "few-samples": "too few samples were taken",
    "scatter": "it scattered too much while the arm stood",
    "not-settled": "it still moved while it was measured",
    "no-reading": "nothing was measured",
    "unknown-name": "there is no target or nest of this name",
    "unknown-configuration": "the plan has no configuration of this name",
    "measured-already": "there is a reading of it",
    "copy": "it repeats a reading taken elsewhere to the last digit",
    "operator": "the operator set it aside",
    "left-out": "it cannot be measured here",
}
#: How far two halves of a dwell may be apart by scatter alone, in deviations of a sample over the root of samples.
_HALVES: Final = 2.0
#: So many samples of a dwell can be asked for.
MOST_SAMPLES: Final = 1_000_000


@dataclass(frozen=True, eq=False)
class Reading:
    """What an instrument read of one point."""

    name: str  #: Of the target or nest.
    time: float  #: When [s], counted from any moment that is the same for all readings.
    position: Array  #: In the instrument's frame [m], ``(3,)``; NaN if nothing was measured.
    quaternion: Array | None = None  #: (w, x, y, z), ``(4,)``; None for a point.
    label: str | None = None  #: Of the configuration, as the source names it; None if it does not.
    #: sigma, sigma_rot: standard deviations that the instrument states [m], [rad]; None if it states none.
    sigma: float | None = None
    sigma_rot: float | None = None
    samples: int | None = None  #: How many were taken while the arm stood; None if it is not told.
    #: Standard deviation of a coordinate of one sample about their mean [m]: the root of the mean square over the
    #: coordinates; None if it is not told.
    deviation: float | None = None
    #: How far the mean of the second half of the samples is from that of the first [m]; None if it is not told.
    settling: float | None = None
    breaks: int = 0  #: How often the beam was interrupted.
    origin: str = ""  #: Where it comes from, such as a file and a line.
    mark: str = ""  #: By which the same row is known again; empty if it has none.

    @property
    def is_empty(self) -> bool:
        """Whether nothing was measured."""
        return not bool(np.isfinite(self.position).all())


def dwell_figures(samples: Array) -> tuple[Array, float, float]:
    """Return mean, deviation and settling of the samples of a dwell.

    Args:
        samples: Positions in the order in which they were taken [m], ``(n, 3)``, two or more.

    Returns:
        The mean ``(3,)``; the deviation of a coordinate of one sample; how far the means of the two halves are apart.
    """
    mean, half = samples.mean(axis=0), len(samples) // 2
    deviation = float(np.sqrt(samples.var(axis=0, ddof=1).mean()))
    apart = samples[len(samples) - half :].mean(axis=0) - samples[:half].mean(axis=0)
    return mean, deviation, float(np.linalg.norm(apart))


@dataclass(frozen=True)
class Quality:
    """What a reading must be by itself to be kept; None asks for nothing."""

    deviation: float | None = None  #: Largest deviation of a sample [m].
    settling: float | None = None  #: How far the means of the two halves of a dwell may be apart [m].
    samples: int = 1  #: Fewest samples.

    @classmethod
    def of_instrument(cls, sigma: float, samples: int) -> Quality:
        """Return what a reading of an instrument of a known deviation [m] is expected to be, by the number of samples.

        Three times the deviation of a sample. Of the two halves the difference has, coordinate by coordinate, the
        variance ``4 sigma^2 / samples``; five times the root of its sum is allowed.
        """
        return cls(3.0 * sigma, 5.0 * _HALVES * np.sqrt(3.0 / samples).item() * sigma, samples // 2)

    def fault(self, reading: Reading) -> tuple[str, str]:
        """Return for which reason a reading is not kept, with the figures in words; two empty texts if it is."""
        if reading.is_empty:
            return "no-reading", ""
        if reading.breaks:
            return "beam-break", f"{reading.breaks} times" if reading.breaks > 1 else ""
        if reading.samples is not None and reading.samples < self.samples:
            return "few-samples", f"{reading.samples}, {self.samples} or more are needed"
        for reason, came, most in (
            ("scatter", reading.deviation, self.deviation),
            ("not-settled", reading.settling, self.settling),
        ):
            if came is not None and most is not None and came > most:
                return reason, f"{came * 1e3:.4f} mm, up to {most * 1e3:.4f} mm is allowed"
        return "", ""

    def unasked(self, reading: Reading) -> bool:
        """Return whether nothing of how a reading was taken could be judged."""
        asked = (
            (reading.samples, self.samples if self.samples > 1 else None),
            (reading.deviation, self.deviation),
            (reading.settling, self.settling),
        )
        return not any(came is not None and most is not None for came, most in asked)
