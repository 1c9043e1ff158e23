"""How well the hexapod device finds the cups of a tool."""

from __future__ import annotations

import numpy as np

from truearm.jobs.arguments import count_argument, whole_argument
from truearm.measurement.hexapod.uncertainty import all_solutions, cup_monte_carlo
from truearm.results.hexapod import HexapodUncertainty


def hexapod_uncertainty(*, trials: int = 100_000, seed: int = 0) -> HexapodUncertainty:
    """Say how well the tool's cups are known, in standard deviations of one length (Nubiola, Table 3.1).

    Parameters
    ----------
    trials, seed
        Of the Monte Carlo; 2 trials or more.

    Raises
    ------
    InputError
        If one of them is no such number.
    """
    trials, rng = count_argument(trials, "trials", 2), np.random.default_rng(whole_argument(seed, "seed"))
    solutions = all_solutions()
    drawn = tuple(cup_monte_carlo(number, trials, rng) for number in solutions)
    return HexapodUncertainty(tuple(solutions.values()), drawn)
