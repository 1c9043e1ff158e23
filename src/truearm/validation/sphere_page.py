"""The page of sphere tests: the error of every reading, before and after (Nubiola, figures 2.13 to 2.16)."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING

import numpy as np

from truearm.engine.base.units import without_mark
from truearm.engine.document.document import Document, answer, pictured, tabled
from truearm.engine.document.drawing import AFTER, BEFORE, Figure, axis, figure, rounded

if TYPE_CHECKING:
    from truearm.validation.sphere import OneSphere, SphereTest, SphereTests


def sphere_page(tests: SphereTests) -> str:
    """Return the page."""
    rows = []
    for sphere in tests.spheres:
        for name, test in (("nominal", sphere.before), ("calibrated" if sphere.before else "this robot", sphere.after)):
            if test is not None:
                figures = (f"{value * 1e3:.3f}" for value in (test.mean, test.deviation, test.largest))
                rows.append((f"{sphere.target} about {sphere.fixture}, {name}", str(len(sphere.lengths)), *figures))
    heading = ("sphere", "readings", "mean [mm]", "deviation [mm]", "largest [mm]")
    return Document(
        f"Ballbar on a sphere: {tests.robot.title}",
        [
            answer([without_mark(tests.lines())[0].replace(":", ".")], tests.warnings),
            tabled("Errors of the distance", heading, tuple(rows)),
            *[
                pictured(
                    f"sphere{number}",
                    f"{sphere.target} about {sphere.fixture}",
                    "Measured less predicted distance of each reading, in the order of the file.",
                    _errors(sphere),
                )
                for number, sphere in enumerate(tests.spheres)
            ],
        ],
        tests.command,
        subtitle=f"Measurements of {tests.source}.",
    ).html(tests)


def _errors(sphere: OneSphere) -> Figure:
    traces = []
    if sphere.before is not None:
        traces.append(_trace("nominal", sphere.before, BEFORE))
    traces.append(_trace("calibrated" if sphere.before is not None else "this robot", sphere.after, AFTER))
    return figure(traces, 340, xaxis=axis("reading"), yaxis=axis("error of the distance [mm]"))


def _trace(name: str, test: SphereTest, colour: str) -> Figure:
    return {
        "type": "scatter",
        "mode": "lines+markers",
        "name": html.escape(name),
        "x": np.arange(1, len(test.errors) + 1).tolist(),
        "y": rounded(test.errors * 1e3, 5),
        "line": {"color": colour, "width": 1.2},
        "marker": {"color": colour, "size": 5},
        "hovertemplate": f"{html.escape(name)}, reading %{{x}}: %{{y:.3f}} mm<extra></extra>",
    }
