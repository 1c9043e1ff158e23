"""What a validation says: one HTML file with errors, their parts, and how they grow with the distance."""

from __future__ import annotations

import html
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.engine.base.errors import worst_first
from truearm.engine.document.drawing import AFTER, COLOURS, Figure, axis, figure, rounded, significant
from truearm.engine.document.figures import residuals
from truearm.engine.document.page import page
from truearm.validation.region import orientation_summary

if TYPE_CHECKING:
    from truearm.engine.data.dataset import Dataset
    from truearm.engine.robot.chain import Array
    from truearm.validation.region import OrientationErrors, RegionDistances, Span
    from truearm.validation.validate import Validation

_MEAN: Final = "#b3261e"
#: The distances that are drawn: place on the page, name of the axis, unit and what makes it of SI units.
_DISTANCES: Final = (
    ("tip", "distance of the tip from its nearest place in training", "mm", 1e3),
    ("joints", "largest joint difference from the nearest training configuration", "deg", 180.0 / np.pi),
    ("middle", "distance from the middle of the places in training", "mm", 1e3),
)
_ANGLES: Final = {"rx": "rx", "ry": "ry", "rz": "rz", "phi": "Φ", "theta": "Θ", "psi": "Ψ"}


@dataclass(frozen=True)
class Figures:
    """A row of a table of errors, as printed."""

    name: str
    readings: int
    texts: tuple[str, ...]


def validation_html(found: Validation) -> str:
    """Return the page of a validation."""
    distances, orientations = found.distances, found.orientations
    return page(
        Path(__file__).with_name("validation.html.jinja"),
        validation_figures(found),
        found,
        run=found,
        source=Path(found.source).name,
        title=found.source if found.robot is None else found.robot.title,
        notices=worst_first(found.warnings),
        spreads=_spreads(found),
        parts=[] if orientations is None else _parts(orientations),
        left_out=0 if orientations is None else orientations.locked,
        spans=[] if distances is None else _span_tables(distances),
        training=0 if distances is None else distances.training,
    )


def validation_figures(found: Validation) -> dict[str, Figure]:
    """Return the pictures by the name of their place on the page."""
    drawn: dict[str, Figure] = {}
    if found.distances is not None:
        for name, what, unit, scale in _DISTANCES:
            distance = getattr(found.distances, name)
            if np.isfinite(distance).any():
                labels = _labels(found.data, found.distances)
                drawn[f"error-over-{name}"] = distance_figure(found.distances, distance * scale, what, unit, labels)
    if found.orientations is not None:
        drawn["orientation-parts"] = orientation_figure(found.orientations)
    if found.data is not None:
        errors = np.linalg.norm(found.errors.position_errors, axis=1) * 1e3
        if found.errors.length_errors is not None:
            errors = np.where(np.isfinite(errors), errors, np.abs(found.errors.length_errors) * 1e3)
        if np.isfinite(errors).any():
            everything = np.arange(found.data.configurations)
            none = np.zeros(len(errors), dtype=bool)
            drawn["residuals"] = residuals(found.data, [("validation", everything, errors)], none)
    return drawn


def distance_figure(found: RegionDistances, distance: Array, what: str, unit: str, labels: list[str]) -> Figure:
    """Show the error of each reading over a distance, and the mean of readings that are about as far.

    Args:
        distance: In the unit that is shown, ``(n,)``.
        labels: Of the readings.
    """
    spans = found.spans(distance)
    low = [min(span.low for span in spans)]
    steps_x = [value for span in spans for value in (span.low, span.high)]
    steps_y = [value for span in spans for value in (span.mean * 1e3, span.mean * 1e3)]
    traces: list[Figure] = [
        {
            "type": "scattergl" if len(distance) > 3000 else "scatter",
            "mode": "markers",
            "name": "readings",
            "x": rounded(distance, 4),
            "y": rounded(found.error * 1e3, 4),
            "text": labels,
            "marker": {"color": AFTER, "size": 4, "opacity": 0.6},
            "hovertemplate": f"%{{text}}: %{{y}} mm at %{{x}} {unit}<extra></extra>",
        },
        {
            "type": "scatter",
            "mode": "lines",
            "name": f"mean of a {_share(len(spans))} of the readings",
            "x": rounded(np.array(steps_x), 4),
            "y": rounded(np.array(steps_y), 4),
            "line": {"color": _MEAN, "width": 2},
            "hovertemplate": "mean %{y} mm<extra></extra>",
        },
    ]
    begin = {"rangemode": "tozero"} if low[0] >= 0.0 else {}
    return figure(
        traces, 340, xaxis=axis(f"{what} [{unit}]") | begin, yaxis=axis("error [mm]") | {"rangemode": "tozero"}
    )


def _share(count: int) -> str:
    return {1: "whole", 2: "half", 3: "third", 4: "quarter", 5: "fifth"}.get(count, f"part of {count}")


def orientation_figure(found: OrientationErrors) -> Figure:
    """Show how the parts of the orientation errors are spread, one box each."""
    columns = dict(zip(_ANGLES.values(), np.degrees(np.concatenate([found.vector, found.zxz], axis=1)).T, strict=True))
    colours = (*COLOURS, *[AFTER] * 3)
    traces = [
        {
            "type": "box",
            "name": name,
            "y": rounded(values[np.isfinite(values)], 4),
            "marker": {"color": colour, "size": 3},
            "line": {"width": 1.4},
            "boxpoints": "outliers",
            "showlegend": False,
        }
        for (name, values), colour in zip(columns.items(), colours, strict=True)
        if np.isfinite(values).any()
    ]
    return figure(
        traces, 340, xaxis=axis("rotation vector, and ZXZ angles"), yaxis=axis("predicted minus measured [deg]")
    )


def _labels(data: Dataset | None, found: RegionDistances) -> list[str]:
    if data is None:
        return ["" for _ in found.reading]
    return [
        html.escape(f"{data.labels[c]}, target {data.targets[t]}")
        for c, t in zip(data.configuration[found.reading].tolist(), data.target[found.reading].tolist(), strict=True)
    ]


def _spreads(found: Validation) -> list[Figures]:
    rows = []
    for name, spread, count in (
        ("position [mm]", found.position, len(found.errors.position_norms)),
        ("orientation [mrad]", found.orientation, len(found.errors.orientation_norms)),
        ("distance or height [mm]", found.length, len(found.errors.length_norms)),
    ):
        if spread is not None:
            texts = tuple(significant(1e3 * value) for value in (spread.mean, spread.rms, spread.p95, spread.max))
            rows.append(Figures(name, count, texts))
    return rows


def _parts(found: OrientationErrors) -> list[Figures]:
    summary = orientation_summary(found)
    rows = []
    for name, part in {**summary["rotation_vector"], **summary["zxz"]}.items():
        count = len(found.reading) - (found.locked if name in ("phi", "psi") else 0)
        texts: tuple[str, ...] = ("–",) * 4
        if part is not None:
            texts = (f"{part['mean']:+.4f}", *(f"{part[key]:.4f}" for key in ("mean_size", "rms", "max")))
        rows.append(Figures(_ANGLES[name], count, texts))
    return rows


def _span_tables(found: RegionDistances) -> list[tuple[str, str, list[Figures]]]:
    tables = []
    for name, what, unit, scale in _DISTANCES:
        distance = getattr(found, name)
        if np.isfinite(distance).any():
            tables.append((name, f"{what} [{unit}]", [_span_row(span, scale) for span in found.spans(distance)]))
    return tables


def _span_row(span: Span, scale: float) -> Figures:
    name = f"{significant(span.low * scale, 3, 1)} to {significant(span.high * scale, 3, 1)}"
    return Figures(name, span.readings, (significant(span.mean * 1e3), significant(span.largest * 1e3)))
