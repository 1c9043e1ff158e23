"""Pictures of an IRB 120 and one ballbar: the poses that it takes, and what it misses on a sphere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from papers.hexapod_device.pictures import poses_figure
from papers.irb120_hexapod.spheres import Spheres
from papers.study import Picture
from truearm.engine.data.hexapod import HexapodPose
from truearm.engine.document.drawing import AFTER, BEFORE, Figure, axis, figure, rounded_to
from truearm.hexapod.sheet import PlannedRow


def reached_picture(found: Sequence[HexapodPose], rows: Sequence[PlannedRow]) -> Picture:
    """Draw the poses that a plan takes."""
    taken = {row.pose for row in rows}
    drawn = poses_figure([("reached", AFTER, [pose for pose in found if pose.number in taken])])
    return Picture("reached", "The poses that the robot takes (Figure 3.10)", "In the fixture's frame.", drawn)


def sphere_pictures(found: Spheres) -> tuple[Picture, Picture]:
    """Draw the errors, reading after reading: with the triangular artefact, and with the spatial one."""
    words = "First seed; one nest after the other. The document's paths are not printed, so only the spread compares."
    return (
        Picture(
            "sphere",
            "Distance errors on the sphere, nests 1 and 2 of the triangular artefact (Figures 2.13 and 2.14)",
            words,
            _errors_figure(found, ("1", "2"), (("laser tracker", AFTER), ("C-Track", BEFORE))),
        ),
        Picture(
            "spatial",
            "Distance errors on the sphere, nests 1 and 3 of the spatial artefact (Figures 2.15 and 2.16)",
            words,
            _errors_figure(found, ("1", "3"), (("C-Track, spatial", BEFORE),)),
        ),
    )


def _errors_figure(found: Spheres, nests: Sequence[str], models: Sequence[tuple[str, str]]) -> Figure:
    traces: list[dict[str, Any]] = []
    for name, colour in models:
        errors = np.concatenate([found.taught[nest, name].errors for nest in nests])
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": name,
                "x": list(range(1, len(errors) + 1)),
                "y": rounded_to(1e3 * errors, 4),
                "marker": {"color": colour, "size": 5},
                "hovertemplate": f"{name}, reading %{{x}}: %{{y:.3f}} mm<extra></extra>",
            }
        )
    return figure(traces, 340, xaxis=axis("reading"), yaxis=axis("error [mm]"))
