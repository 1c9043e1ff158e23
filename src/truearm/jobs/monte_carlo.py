"""Intervals by Monte Carlo for a calibration: what is accepted, and how far the work has come."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from truearm.errors import InputError
from truearm.identification.judging.simulated_calibrations import (
    SimulatedCalibrations,
    check_linear,
    simulated_calibrations,
)
from truearm.identification.solving.bounds import Bounds
from truearm.identification.solving.fit import Fit, Status
from truearm.identification.solving.losses import Loss
from truearm.jobs.arguments import count_argument
from truearm.measurement.dataset import Dataset
from truearm.notices import Notice

#: Fewer trials than this give no interval of 95 %.
_LEAST: Final = 100
#: Length of the bar that shows how much is done.
_BAR: Final = 20


def trials_argument(value: object, loss: Loss, bounds: object) -> int | None:
    """Return how many calibrations shall be simulated; None for None.

    Raises:
        InputError: For too few or too many of them, and for fits that are no plain least squares.
    """
    if value is None:
        return None
    trials = count_argument(value, "monte_carlo", _LEAST)
    if loss != "linear":
        raise InputError(
            "calibrations are simulated by least squares, and other losses are for noise that is not normal",
            parameter="monte_carlo",
            came=f"the loss {loss}",
            cure="Leave `loss` out, or leave `monte_carlo` out: the deviations then follow from the scatter of the "
            "configurations.",
        )
    if bounds is not None:
        raise InputError(
            "calibrations are simulated without bounds",
            parameter="monte_carlo",
            came="bounds" if isinstance(bounds, Bounds) else str(bounds),
            cure="Leave `bounds` out, or leave `monte_carlo` out.",
        )
    return trials


def simulate_calibrations(
    fit: Fit,
    training: Dataset,
    held_out: Dataset | None,
    trials: int,
    *,
    priors: bool,
    seed: int,
    progress: Callable[[str], None],
) -> tuple[SimulatedCalibrations | None, list[Notice]]:
    """Return simulated calibrations, and what they say against the linear intervals.

    None are made of a fit that leaves open what predictions depend on: where base and targets are is not drawn.
    """
    if fit.status not in (Status.CONVERGED, Status.AT_BOUND):
        return None, [
            Notice(
                "not-simulated",
                f"No calibration was simulated, because this one ended with {fit.status.value}: intervals say nothing "
                "of what the data do not determine.",
                "note",
            )
        ]

    def done(count: int) -> None:
        full = _BAR * count // trials
        progress(f"simulating calibrations [{'#' * full}{'.' * (_BAR - full)}] {count} of {trials}")

    judged = training if held_out is None else held_out
    found = simulated_calibrations(fit, training, judged, trials, priors=priors, seed=seed, progress=done)
    return found, check_linear(fit, found)
