"""Parts of a validation as JSON and the command show them: orientations by their angles, errors by their distance."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.validation.orientation_errors import OrientationErrors
from truearm.validation.region_distances import RegionDistances, Span

#: The parts of an orientation error, by their names.
PARTS: Final = ("rx", "ry", "rz", "phi", "theta", "psi")


def orientation_summary(found: OrientationErrors) -> dict[str, Any]:
    """Return orientation errors by their parts, as JSON holds them, in deg."""
    return {
        "readings": len(found.reading),
        "rotation_vector": {name: _figures(column) for name, column in zip(PARTS[:3], found.vector.T, strict=True)},
        "zxz": {name: _figures(column) for name, column in zip(PARTS[3:], found.zxz.T, strict=True)},
        "zxz_left_out": found.locked,
    }


def _figures(values: Array) -> dict[str, float] | None:
    known = np.degrees(values[np.isfinite(values)])
    if not len(known):
        return None
    sizes = np.abs(known)
    return {
        "mean": float(known.mean()),
        "mean_size": float(sizes.mean()),
        "rms": float(np.sqrt(np.mean(known**2))),
        "max": float(sizes.max()),
    }


def orientation_lines(found: OrientationErrors | None) -> list[str]:
    """Return the mean size of each part of the orientation errors."""
    if found is None:
        return []
    summary = orientation_summary(found)
    vector = "  ".join(f"{name} {part['mean_size']:.4f}" for name, part in summary["rotation_vector"].items())
    angles = "  ".join(
        f"{name.capitalize()} {'–' if part is None else format(part['mean_size'], '.4f')}"
        for name, part in summary["zxz"].items()
    )
    left_out = f" (Phi and Psi without {found.locked} readings near Theta 0 or 180)" if found.locked else ""
    return [
        "  orientation, mean sizes in the base frame: "
        f"rotation vector  {vector} deg; ZXZ angles  {angles} deg{left_out}"
    ]


def distance_summary(found: RegionDistances) -> dict[str, Any]:
    """Return errors by the distance from where the robot was calibrated, as JSON holds them, in mm and deg."""
    growth = found.growth
    return {
        "training_configurations": found.training,
        "tip_mm": [_span(span, 1e3) for span in found.spans(found.tip)],
        "joints_deg": [_span(span, math.degrees(1.0)) for span in found.spans(found.joints)],
        "middle_mm": [_span(span, 1e3) for span in found.spans(found.middle)],
        "grows": None if growth is None else growth[2],
    }


def _span(span: Span, scale: float) -> dict[str, Any]:
    return {
        "from": span.low * scale,
        "to": span.high * scale,
        "readings": span.readings,
        "mean_mm": span.mean * 1e3,
        "max_mm": span.largest * 1e3,
    }


def distance_lines(found: RegionDistances | None) -> list[str]:
    """Return how far the readings lie from where the robot was calibrated, and what the error does with that."""
    if found is None:
        return []
    away = f"{found.tip.min() * 1e3:.0f} to {found.tip.max() * 1e3:.0f} mm"
    turned = np.degrees(found.joints[np.isfinite(found.joints)])
    words = f"From the nearest of {found.training} training configurations: tips {away}"
    if len(turned):
        words += f", joints {turned.min():.0f} to {turned.max():.0f} deg"
    growth = found.growth
    if growth is not None:
        near, far, _ = growth
        words += f"; mean error {near.mean * 1e3:.3f} mm in the nearest third, {far.mean * 1e3:.3f} mm in the farthest"
    return [words]
