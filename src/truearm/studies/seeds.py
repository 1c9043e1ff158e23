"""The frame of every study: the loop over seeds, and figures of what the seeds found."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from truearm.studies import Progress

Outcome = TypeVar("Outcome")


@dataclass(frozen=True)
class Seed:
    """One repetition of a study.

    Attributes
    ----------
    number
        0, 1, 2 and so on.
    of
        How many seeds there are.
    what
        What one of them is called when progress is shown.
    progress
        Called with a few words at each step.
    """

    number: int
    of: int
    progress: Progress
    what: str = "seed"

    def generator(self) -> np.random.Generator:
        """Return the random numbers of this seed, from their beginning."""
        return np.random.default_rng(self.number)

    def step(self, words: str = "") -> None:
        """Say which seed runs, and with `words` what it does."""
        self.progress(f"{self.what} {self.number + 1} of {self.of}{': ' if words else ''}{words}")


def over_seeds(
    seeds: int, progress: Progress, one: Callable[[Seed], Outcome], what: str = "seed"
) -> tuple[Outcome, ...]:
    """Do something once a seed.

    Parameters
    ----------
    seeds
        How often.
    progress
        Called with a few words at each seed.
    one
        Returns the record of one seed's outcome.
    what
        What one seed is called when progress is shown.

    Returns
    -------
    What `one` returned, in the order of the seeds.
    """
    outcomes = []
    for number in range(seeds):
        seed = Seed(number, seeds, progress, what)
        seed.step()
        outcomes.append(one(seed))
    return tuple(outcomes)


def median_of(outcomes: Iterable[Outcome], figure: Callable[[Outcome], float]) -> float:
    """Return the median over the seeds of one figure of their outcomes."""
    return float(np.median([figure(outcome) for outcome in outcomes]))
