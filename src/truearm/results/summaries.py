"""Figures as JSON and the command show them, in mm and mrad."""

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
        ("position_mm", errors.position, 1e3),
        ("orientation_mrad", errors.orientation, 1e3),
        ("length_mm", errors.length, 1e3),
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


def error_line(errors: Errors) -> str:
    """Return the statistics of one set of errors as a line."""
    parts = []
    kinds = ((errors.position, "mm"), (errors.orientation, "mrad"), (errors.length, "mm of length"))
    for spread, unit in kinds:
        if spread is not None:
            mean, rms, p95, largest = (value * 1e3 for value in (spread.mean, spread.rms, spread.p95, spread.max))
            parts.append(f"mean {mean:.3f}  rms {rms:.3f}  95 % {p95:.3f}  max {largest:.3f} {unit}")
    return "   ".join(parts) if parts else "no readings"
