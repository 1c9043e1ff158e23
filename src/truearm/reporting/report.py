"""The report of a calibration: one HTML file that needs nothing else, not even a network."""

from __future__ import annotations

import json
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version as installed_version
from importlib.resources import files
from pathlib import Path
from typing import Final

import numpy as np
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from numpy.typing import NDArray

from truearm.identification.fit import Fit
from truearm.identification.selection import Selection
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import Errors
from truearm.modeling.chain import Array
from truearm.modeling.parts import GRAVITY
from truearm.notices import Notice
from truearm.reporting.drawing import AFTER, BEFORE, Figure
from truearm.reporting.figures import correlation_map, histogram, residuals, workspace
from truearm.reporting.tables import (
    SpreadRow,
    noise_rows,
    noise_sentence,
    parameter_rows,
    parameter_sentence,
    spread_rows,
    strongest_pairs,
)
from truearm.version import __version__

_FRAMES: Final = ("base", "target")
#: A reading whose weight is less than this share of the median weight was not believed.
_DOUBTED: Final = 0.5
#: Characters that could end a script element or a line of JavaScript, as JSON escapes them.
_UNSAFE: Final = {ord(c): f"\\u{ord(c):04x}" for c in "<>&\u2028\u2029"}


@dataclass(frozen=True, eq=False)
class Report:
    """What a report tells about.

    Attributes
    ----------
    fit
        Made from the training part alone.
    data
        All readings.
    training, held_out
        Indices of the configurations of each part; `held_out` may be empty.
    nominal
        Errors of the uncalibrated robot on the held-out part; on the training part if nothing was held out.
    train
        Errors of the calibrated robot on the training part.
    validation
        Errors of the calibrated robot on the held-out part; None if nothing was held out.
    warnings
        What to know about the result.
    command
        How to run it again.
    history
        What was done, in one line with the hash of the data.
    selection
        How the model was chosen, if it was not named.
    """

    fit: Fit
    data: Dataset
    training: NDArray[np.intp]
    held_out: NDArray[np.intp]
    nominal: Errors
    train: Errors
    validation: Errors | None
    warnings: Sequence[Notice]
    command: str
    history: str
    selection: Selection | None = None

    @property
    def judged(self) -> Errors:
        """Errors of the calibrated robot on the part that `nominal` is about."""
        return self.train if self.validation is None else self.validation

    @cached_property
    def judged_part(self) -> Dataset:
        """The readings of that part."""
        return self.data.of_configurations(self.training if self.validation is None else self.held_out)

    @property
    def position(self) -> tuple[SpreadRow, ...]:
        """Position errors [mm]: before and after, then those of the training part."""
        return spread_rows(self.nominal, self.train, self.validation, "position")

    @property
    def orientation(self) -> tuple[SpreadRow, ...]:
        """Orientation errors [mrad], likewise; empty where none was read."""
        return spread_rows(self.nominal, self.train, self.validation, "orientation")

    def figures(self) -> dict[str, Figure]:
        """Return the pictures by the name of their place on the page."""
        nominal, judged = self.nominal, self.judged
        drawn = {}
        if len(judged.position_norms):
            drawn["position-histogram"] = histogram(
                nominal.position_norms * 1e3, judged.position_norms * 1e3, "mm", "position error"
            )
        if len(judged.orientation_norms):
            drawn["orientation-histogram"] = histogram(
                nominal.orientation_norms * 1e3, judged.orientation_norms * 1e3, "mrad", "orientation error"
            )
        if len(judged.position_norms):
            drawn["workspace"] = workspace(
                self.judged_part, self.fit.robot.base, _millimetres(nominal), _millimetres(judged)
            )
        parts = [("training", self.training, _millimetres(self.train))]
        if self.validation is not None:
            parts.append(("held out", self.held_out, _millimetres(self.validation)))
        drawn["residuals"] = residuals(self.data, parts, self._doubted())
        drawn["correlations"] = correlation_map(self.fit)
        return drawn

    def _doubted(self) -> NDArray[np.bool_]:
        """Return which training readings a robust loss left less than half the weight of a typical one.

        The weights of ``l1`` are 1 over the residual, so a weight says something only beside the others.
        """
        weight = self.fit.weight
        doubted: NDArray[np.bool_] = weight < _DOUBTED * np.nanmedian(weight)
        return doubted


def report_html(report: Report) -> str:
    """Return the report as one HTML page that holds its scripts and data."""
    fit = report.fit
    rows = parameter_rows(fit)
    figures = report.figures()
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    page = environment.from_string((files(__package__) / "report.html.jinja").read_text("utf-8"))
    return page.render(
        report=report,
        fit=fit,
        source=Path(report.data.source).name,
        robot_rows=[row for row in rows if row.group not in _FRAMES],
        frame_rows=[row for row in rows if row.group in _FRAMES],
        parameter_sentence=parameter_sentence(rows),
        pairs=strongest_pairs(fit),
        noise_rows=noise_rows(fit),
        noise_sentence=noise_sentence(fit),
        doubted=int(report._doubted().sum()),
        drawn=set(figures),
        heights={name: figure["layout"]["height"] for name, figure in figures.items()},
        figures=Markup(json_for_script(figures)),
        plotly=Markup(_plotly()),
        versions={
            "truearm": __version__,
            "Python": platform.python_version(),
            "NumPy": np.__version__,
            "SciPy": installed_version("scipy"),
        },
        standing=GRAVITY,
        colours={"before": BEFORE, "after": AFTER},
    )


def json_for_script(value: object) -> str:
    """Return JSON that can stand inside a script element whatever its texts hold."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False, ensure_ascii=False).translate(_UNSAFE)


def _plotly() -> str:
    """Return Plotly's own script, which its package brings along."""
    return (files("plotly") / "package_data" / "plotly.min.js").read_text("utf-8")


def _millimetres(errors: Errors) -> Array:
    """Return the position error of each reading, NaN where none was read."""
    norms: Array = np.linalg.norm(errors.position, axis=1) * 1e3
    return norms
