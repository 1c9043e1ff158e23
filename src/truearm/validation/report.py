"""What a validation says: one HTML file with errors, their parts, and how they grow with the distance."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.engine.document.document import (
    Block,
    Document,
    Facts,
    Picture,
    Section,
    Table,
    Words,
    pictured,
    warned,
)
from truearm.engine.document.drawing import AFTER, COLOURS, Figure, axis, figure, rounded, significant
from truearm.engine.document.figures import residuals
from truearm.engine.document.summaries import least_words

if TYPE_CHECKING:
    from truearm.engine.data.dataset import Dataset
    from truearm.engine.diagnose.next_step import NextStep
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


def validation_html(validation: Validation) -> str:
    """Return the page of a validation."""
    title = validation.source if validation.robot is None else validation.robot.title
    source = Path(validation.source).name
    heading = ("error", "readings", "mean", "RMS", "95 % below", "maximum")
    errors = Table(heading, _spreads(validation), caption="Errors of single readings", name="errors")
    least = [Words(said, quiet=True) for said in least_words(validation.errors, validation.least).values()]
    refit = []
    if validation.refit:
        refit = [
            Words(
                f"The {validation.refit.moved} was found anew from these readings; each configuration is judged by "
                "what is found without it."
            )
        ]
    facts: list[tuple[str, str | Sequence[NextStep]]] = [
        (key.capitalize(), note) for key, note in validation.notes.items()
    ]
    if validation.next:
        facts.append(("Next", validation.next))
    drawn = validation_figures(validation)
    over_time = (
        "Mean over the readings of each configuration. A trend or a step is a sign that something moved or warmed up "
        "during the measurement."
    )
    return Document(
        f"Validation of {title} – {source}",
        [
            *([Facts(facts)] if facts else []),
            Section("", [*warned(validation.warnings), errors, *least, *refit], "result"),
            _over_distance(validation, drawn),
            *_orientations(validation, drawn),
            *(
                [pictured("residuals", "Errors, configuration by configuration", over_time, drawn["residuals"])]
                if "residuals" in drawn
                else []
            ),
        ],
        validation.command,
        headline=f"Validation of {title}",
        subtitle=f"Data: {source}, {validation.errors.configurations} configurations",
    ).html(validation)


def _over_distance(validation: Validation, drawn: dict[str, Figure]) -> Block:
    if validation.distances is None:
        return Words(
            "The robot does not know where it was calibrated, so errors are not shown over the distance from there.",
            quiet=True,
        )
    words = (
        f"The robot knows {validation.distances.training} training configurations. The distance of a tip is that to "
        "the nearest place at which its target was in training, by the calibrated robot; that of the joints is the "
        "largest difference of a joint to the training configuration where this is least; the middle is the mean of "
        "the target's places in training. An error that grows says that the calibration should reach farther."
    )
    blocks: list[Block] = [Words(words)]
    for name, label, unit, scale in _DISTANCES:
        distance = getattr(validation.distances, name)
        if np.isfinite(distance).any():
            rows = [_span_row(span, scale) for span in validation.distances.spans(distance)]
            heading = (f"{label} [{unit}]", "readings", "mean error [mm]", "maximum [mm]")
            blocks += [Picture(f"error-over-{name}", drawn[f"error-over-{name}"]), Table(heading, rows)]
    return Section("Errors over the distance from where the robot was calibrated", blocks, "distance")


def _orientations(validation: Validation, drawn: dict[str, Figure]) -> list[Section]:
    if validation.orientations is None:
        return []
    words = (
        "In the robot's base frame, predicted minus measured [deg]. The rotation vector (rx, ry, rz) turns the "
        "measured into the predicted orientation. The ZXZ angles are Rz(Φ) Rx(Θ) Rz(Ψ) of the target; their errors are "
        "differences of angles, and small turns may change Φ and Ψ much where Θ is small."
    )
    if validation.orientations.locked:
        words += f" {validation.orientations.locked} readings with Θ within 3 deg of 0 or 180 are left out of Φ and Ψ."
    heading = ("part", "readings", "mean [deg]", "mean size", "RMS", "largest")
    table = Table(heading, _parts(validation.orientations), name="orientation-table")
    picture = Picture("orientation-parts", drawn["orientation-parts"])
    return [Section("Orientation errors by their parts", [Words(words), picture, table], "orientations")]


def validation_figures(validation: Validation) -> dict[str, Figure]:
    """Return the pictures by the name of their place on the page."""
    drawn: dict[str, Figure] = {}
    if validation.distances is not None:
        for name, label, unit, scale in _DISTANCES:
            distance = getattr(validation.distances, name)
            if np.isfinite(distance).any():
                labels = _labels(validation.data, validation.distances)
                drawn[f"error-over-{name}"] = distance_figure(
                    validation.distances, distance * scale, label, unit, labels
                )
    if validation.orientations is not None:
        drawn["orientation-parts"] = orientation_figure(validation.orientations)
    if validation.data is not None:
        errors = np.linalg.norm(validation.errors.position_errors, axis=1) * 1e3
        if validation.errors.length_errors is not None:
            errors = np.where(np.isfinite(errors), errors, np.abs(validation.errors.length_errors) * 1e3)
        if np.isfinite(errors).any():
            everything = np.arange(validation.data.configurations)
            none = np.zeros(len(errors), dtype=bool)
            drawn["residuals"] = residuals(validation.data, [("validation", everything, errors)], none)
    return drawn


def distance_figure(distances: RegionDistances, distance: Array, label: str, unit: str, labels: list[str]) -> Figure:
    """Show the error of each reading over a distance, and the mean of readings that are about as far.

    Args:
        distance: In the unit that is shown, ``(n,)``.
        labels: Of the readings.
    """
    spans = distances.spans(distance)
    low = [min(span.low for span in spans)]
    steps_x = [value for span in spans for value in (span.low, span.high)]
    steps_y = [value for span in spans for value in (span.mean * 1e3, span.mean * 1e3)]
    traces: list[Figure] = [
        {
            "type": "scattergl" if len(distance) > 3000 else "scatter",
            "mode": "markers",
            "name": "readings",
            "x": rounded(distance, 4),
            "y": rounded(distances.error * 1e3, 4),
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
        traces, 340, xaxis=axis(f"{label} [{unit}]") | begin, yaxis=axis("error [mm]") | {"rangemode": "tozero"}
    )


def _share(count: int) -> str:
    return {1: "whole", 2: "half", 3: "third", 4: "quarter", 5: "fifth"}.get(count, f"part of {count}")


def orientation_figure(errors: OrientationErrors) -> Figure:
    """Show how the parts of the orientation errors are spread, one box each."""
    columns = dict(
        zip(_ANGLES.values(), np.degrees(np.concatenate([errors.vector, errors.zxz], axis=1)).T, strict=True)
    )
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


def _labels(data: Dataset | None, distances: RegionDistances) -> list[str]:
    if data is None:
        return ["" for _ in distances.reading]
    return [
        html.escape(f"{data.labels[c]}, target {data.targets[t]}")
        for c, t in zip(
            data.configuration[distances.reading].tolist(), data.target[distances.reading].tolist(), strict=True
        )
    ]


def _spreads(validation: Validation) -> list[tuple[str, ...]]:
    rows = []
    for name, spread, count in (
        ("position [mm]", validation.position, len(validation.errors.position_norms)),
        ("orientation [mrad]", validation.orientation, len(validation.errors.orientation_norms)),
        ("distance or height [mm]", validation.length, len(validation.errors.length_norms)),
    ):
        if spread is not None:
            texts = (significant(1e3 * value) for value in (spread.mean, spread.rms, spread.p95, spread.max))
            rows.append((name, str(count), *texts))
    return rows


def _parts(errors: OrientationErrors) -> list[tuple[str, ...]]:
    rows = []
    for name, part in errors.parts.items():
        count = len(errors.reading) - (errors.locked if name in ("phi", "psi") else 0)
        texts: tuple[str, ...] = ("–",) * 4
        if part is not None:
            texts = (f"{part['mean']:+.4f}", *(f"{part[key]:.4f}" for key in ("mean_size", "rms", "max")))
        rows.append((_ANGLES[name], str(count), *texts))
    return rows


def _span_row(span: Span, scale: float) -> tuple[str, ...]:
    name = f"{significant(span.low * scale, 3, 1)} to {significant(span.high * scale, 3, 1)}"
    return name, str(span.readings), significant(span.mean * 1e3), significant(span.largest * 1e3)
