"""How fixed nests beside the robot seem to move while a robot is measured: instrument and floor, not the robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.measurement.measuring.session import Session
from truearm.modeling.chain import Array

#: Fewer degrees of freedom say too little of a standard deviation.
_LEAST_FREEDOMS: Final = 12


@dataclass(frozen=True, eq=False)
class NestDrift:
    """Nests in the order of their rounds."""

    names: tuple[str, ...]  #: Of the nests that were read.
    rounds: tuple[int, ...]  #: Number of each round with a reading, from 0, ``(r,)``.
    time: Array  #: Mean time of each [s], from the first reading of a nest on, ``(r,)``.
    #: Of each nest against its first reading [m], in the instrument's frame, ``(nests, r, 3)``; NaN where it was not
    #: read.
    moved: Array
    #: Standard deviation of a coordinate about the mean of its nest [m]; None where too few readings tell it.
    sigma: float | None
    freedoms: int  #: Degrees of freedom of that.

    @property
    def distance(self) -> Array:
        """How far each is from its first reading [m], ``(nests, r)``, NaN where it was not read."""
        return np.asarray(np.sqrt((self.moved**2).sum(axis=2)))

    @property
    def largest(self) -> float:
        """Of all distances [m]."""
        return float(np.nanmax(self.distance))

    @property
    def common(self) -> Array:
        """Mean over the nests of how they moved in each round [m], ``(r, 3)``: what all of them share."""
        return np.asarray(np.nanmean(self.moved, axis=0))

    def noise(self, stated: float | None = None) -> float | None:
        """Return the standard deviation of a coordinate of a reading without what all nests share [m].

        Args:
            stated: What the instrument says of itself [m]; else it is found from the nests, if enough of them were
                read.
        """
        if stated is not None:
            return stated
        read = np.isfinite(self.moved[:, :, 0])
        freedoms = 3 * int(read.sum() - read.any(axis=1).sum() - read.any(axis=0).sum() + 1)
        if freedoms < _LEAST_FREEDOMS:
            return self._from_round_to_round()
        # Nests that were read in every round: what is left of each round and each nest is scatter alone.
        left = self.moved - np.nanmean(self.moved, axis=0, keepdims=True)
        left = left - np.nanmean(left, axis=1, keepdims=True)
        spread = float(np.sqrt(np.nansum(left**2) / freedoms))
        return spread if spread > 0.0 else None

    def _from_round_to_round(self) -> float | None:
        """Return the scatter as one round follows another, the root of half the mean squared step (von Neumann 1941).

        Of a steady drift it holds what one step has of it, so it is rather too large. Steps that share a reading are
        worth two thirds of steps that share none.
        """
        steps = np.diff(self.moved, axis=1)
        known = int(np.isfinite(steps).sum())
        if 2 * known < 3 * _LEAST_FREEDOMS:
            return None
        spread = float(np.sqrt(np.nansum(steps**2) / (2.0 * known)))
        return spread if spread > 0.0 else None


def nest_drift(session: Session) -> NestDrift | None:
    """Return how the nests moved, by the readings that are kept; None before one was read."""
    kept = [entry for entry in session.kept if entry.is_nest and entry.reading is not None]
    if not kept:
        return None
    names = tuple(name for name in session.nests if any(entry.name == name for entry in kept))
    rounds = tuple(sorted({session.round_of(entry) for entry in kept}))
    place = np.full((len(names), len(rounds), 3), np.nan)
    time = np.full((len(names), len(rounds)), np.nan)
    for entry in kept:
        if entry.reading is not None:
            at = names.index(entry.name), rounds.index(session.round_of(entry))
            place[at], time[at] = entry.reading.position, entry.reading.time
    times = np.nanmean(time, axis=0)
    first = np.array([one[np.isfinite(one[:, 0])][0] for one in place])
    read = np.isfinite(place[:, :, 0])
    freedoms = 3 * int((read.sum(axis=1) - 1).sum())
    about = place - np.nanmean(place, axis=1, keepdims=True)
    sigma = None
    if freedoms >= _LEAST_FREEDOMS and (spread := float(np.sqrt(np.nansum(about**2) / freedoms))) > 0.0:
        sigma = spread
    return NestDrift(names, rounds, times - times[0], place - first[:, None], sigma, freedoms)
