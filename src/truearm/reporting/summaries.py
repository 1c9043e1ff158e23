"""Results as JSON holds them, in mm and mrad."""

from __future__ import annotations

from typing import Any

from truearm.identification.choosing.selection import Selection
from truearm.measurement.statistics import Errors, Spread


def selection_summary(selection: Selection) -> dict[str, Any]:
    """Return how a model was chosen, as JSON holds it: errors in mm."""
    return {
        "elastic_mm": selection.start * 1e3,
        "attempts": [
            {
                "round": attempt.round,
                "effect": attempt.effect,
                "error_mm": attempt.error * 1e3,
                "gain_mm": attempt.gain * 1e3,
                "standard_error_mm": attempt.standard_error * 1e3,
                "taken": attempt.taken,
            }
            for attempt in selection.attempts
        ],
    }


def errors_summary(errors: Errors) -> dict[str, Any]:
    """Return error statistics in mm and mrad, as JSON holds them."""
    made: dict[str, Any] = {"configurations": errors.configurations}
    for key, spread, scale in (
        ("position_mm", errors.position_spread, 1e3),
        ("orientation_mrad", errors.orientation_spread, 1e3),
        ("length_mm", errors.length_spread, 1e3),
    ):
        if spread is not None:
            made[key] = _scaled(spread, scale)
    return made


def _scaled(spread: Spread, scale: float) -> dict[str, float]:
    return {
        "mean": spread.mean * scale,
        "rms": spread.rms * scale,
        "p95": spread.p95 * scale,
        "max": spread.max * scale,
    }
