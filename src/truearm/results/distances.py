"""How a robot agrees with the distances between measured points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from truearm.results.record import Record
from truearm.shown import counted
from truearm.simulated import Marked
from truearm.validation.pair_distances import PairDistances

#: Bars of the histogram where a person reads, about, and signs in the longest.
_BARS: Final = 20
_LONGEST: Final = 50


@dataclass(frozen=True, eq=False, repr=False)
class Distances(Record):
    """Errors of the distances between all pairs of measured points."""

    source: str  #: The measurements, for messages.
    configurations: int  #: How many there are.
    errors: PairDistances  #: Predicted minus measured distances.
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it, in mm."""
        found = self.errors
        return {
            "configurations": self.configurations,
            "pairs": found.pairs,
            "distance_mm": {
                "mean": found.mean * 1e3,
                "deviation": found.deviation * 1e3,
                "max": found.maximum * 1e3,
            },
            "positive": found.positive,
            "histogram": {"edges_mm": self._edges(), "counts": found.counts.tolist()},
        }

    def lines(self) -> list[str]:
        """Return the statistics and a histogram."""
        found, edges = self.errors, self._edges()
        text = [
            f"{counted(found.pairs, 'distance')} between points of {counted(self.configurations, 'configuration')} of "
            f"{self.source}:",
            f"  mean {found.mean * 1e3:.3f}  deviation {found.deviation * 1e3:.3f}  max {found.maximum * 1e3:.3f} mm",
            f"  {100 * found.positive:.0f} % of the predicted distances are too long",
        ]
        step = max(1, len(found.counts) // _BARS)
        starts = range(0, len(found.counts), step)
        sums = [int(found.counts[first : first + step].sum()) for first in starts]
        for first, count in zip(starts, sums, strict=True):
            last = min(first + step, len(found.counts))
            bar = "#" * round(_LONGEST * count / max(sums))
            text.append(f"  {edges[first]:8.3f} to {edges[last]:8.3f} mm  {bar}".rstrip())
        return text

    def _edges(self) -> list[float]:
        edges: list[float] = np.round(self.errors.edges * 1e3, 9).tolist()
        return edges
