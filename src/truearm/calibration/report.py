"""The report of a calibration: one HTML file that needs nothing else, not even a network."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from truearm.calibration.figures import (
    budget_figure,
    budget_rows,
    candidate_rows,
    candidates_figure,
    choice_sentence,
    confirmation_rows,
    coverage_figure,
    curve_figure,
    curve_name,
    curve_rows,
    interval_rows,
    workspace_budget_figure,
    zone_rows,
    zones_figure,
)
from truearm.calibration.parts import simulated_lines
from truearm.engine.base.errors import worst_first
from truearm.engine.diagnose.expected_error import expected_map
from truearm.engine.document.figures import correlation_map, expected_error_map, histogram, residuals, workspace
from truearm.engine.document.page import page
from truearm.engine.document.summaries import expected_of
from truearm.engine.document.tables import (
    SpreadRow,
    expected_rows,
    noise_alone,
    noise_rows,
    noise_sentence,
    parameter_rows,
    parameter_sentence,
    spread_rows,
    strongest_pairs,
)
from truearm.engine.robot.parts import GRAVITY

if TYPE_CHECKING:
    from truearm.calibration.result import Calibration
    from truearm.engine.data.dataset import Dataset
    from truearm.engine.data.statistics import Errors
    from truearm.engine.document.drawing import Figure
    from truearm.engine.robot.chain import Array

_FRAMES: Final = ("base", "target", "fixture")
#: A reading is down-weighted if its weight is less than this share of the median weight.
_DOWN_WEIGHTED: Final = 0.5
#: Positions of the map of the error to expect.
_MAPPED: Final = 4000


@dataclass(frozen=True, eq=False)
class Report:
    """What the page shows of a calibration: its tables and pictures."""

    calibration: Calibration  #: What it tells about.

    @property
    def judged(self) -> Errors:
        """Errors of the calibrated robot on the part that the nominal one is judged on."""
        run = self.calibration
        return run.train if run.validation is None else run.validation

    @cached_property
    def judged_part(self) -> Dataset:
        """The readings of that part."""
        run = self.calibration
        return run.data.of_configurations(run.training if run.validation is None else run.held_out)

    @property
    def position(self) -> tuple[SpreadRow, ...]:
        """Position errors [mm]: before and after, then those of the training part."""
        return self._spread("position")

    @property
    def orientation(self) -> tuple[SpreadRow, ...]:
        """Orientation errors [mrad], likewise; empty where none was read."""
        return self._spread("orientation")

    @property
    def length(self) -> tuple[SpreadRow, ...]:
        """Errors of distances and heights [mm], likewise; empty where none was read."""
        return self._spread("length")

    def _spread(self, kind: str) -> tuple[SpreadRow, ...]:
        run = self.calibration
        parts = run.data.of_configurations(run.training).configuration, self.judged_part.configuration
        return spread_rows(run.nominal, run.train, run.validation, kind, parts)

    def figures(self) -> dict[str, Figure]:
        """Return the pictures by the name of their place on the page."""
        run, judged = self.calibration, self.judged
        nominal = run.nominal
        drawn = {}
        if len(judged.position_norms):
            drawn["position-histogram"] = histogram(
                nominal.position_norms * 1e3, judged.position_norms * 1e3, "mm", "position error"
            )
        if len(judged.orientation_norms):
            drawn["orientation-histogram"] = histogram(
                nominal.orientation_norms * 1e3, judged.orientation_norms * 1e3, "mrad", "orientation error"
            )
        if len(judged.length_norms):
            drawn["length-histogram"] = histogram(
                nominal.length_norms * 1e3, judged.length_norms * 1e3, "mm", "error of distances and heights"
            )
        if np.isfinite(_millimetres(judged)).any():
            drawn["workspace"] = workspace(
                self.judged_part, self._tips(self.judged_part), _millimetres(nominal), _millimetres(judged)
            )
        if run.budget is not None:
            drawn["limits-of-accuracy"] = budget_figure(run.budget)
            if run.budget.workspace is not None:
                drawn["limits-over-the-workspace"] = workspace_budget_figure(run.budget.workspace)
        drawn["expected-error"] = expected_error_map(
            *expected_map(replace(run.fit, joint_error=run.expected.joint_error), _MAPPED),
            self._tips(run.data.of_configurations(run.training)),
        )
        parts = [("training", run.training, _millimetres(run.train))]
        if run.validation is not None:
            parts.append(("held out", run.held_out, _millimetres(run.validation)))
        drawn["residuals"] = residuals(run.data, parts, self._down_weighted())
        if run.monte_carlo is not None and run.monte_carlo.settled:
            drawn["coverage"] = coverage_figure(run.monte_carlo, run.fit.robot)
        for curve in run.curves:
            drawn[curve_name(curve)] = curve_figure(curve)
        if run.zones is not None and any(verdict.zone is not None for verdict in run.zones.verdicts):
            drawn["zone-errors"] = zones_figure(run.zones)
        if run.selection is not None:
            drawn["candidates"] = candidates_figure(run.selection)
        drawn["correlations"] = correlation_map(run.fit)
        return drawn

    def _tips(self, part: Dataset) -> Array:
        """Return where the target of each reading is, in the robot's base frame [m], ``(readings, 3)``."""
        robot = self.calibration.fit.robot
        seen = robot.loaded(part.postures)
        tips = np.array([robot.world_poses(seen, name)[0] for name in part.targets])
        base = robot.base
        return np.asarray((tips[part.target, part.configuration] - np.array(base.translation)) @ base.rotation)

    def _down_weighted(self) -> NDArray[np.bool_]:
        """Return which training readings a robust loss left less than half the weight of a typical one.

        The weights of ``l1`` are 1 over the residual, so a weight says something only beside the others.
        """
        weight = self.calibration.fit.weight
        down_weighted: NDArray[np.bool_] = weight < _DOWN_WEIGHTED * np.nanmedian(weight)
        return down_weighted


def report_html(calibration: Calibration) -> str:
    """Return the report as one HTML page that holds its scripts and data."""
    report, fit = Report(calibration), calibration.fit
    rows = parameter_rows(fit)
    return page(
        Path(__file__).with_name("report.html.jinja"),
        report.figures(),
        calibration,
        report=report,
        run=calibration,
        expected=calibration.expected,
        budget=calibration.budget,
        zone_lines=[] if calibration.zones is None else calibration.zones.lines(),
        choice_sentence="" if calibration.selection is None else choice_sentence(calibration.selection),
        candidate_rows=() if calibration.selection is None else candidate_rows(calibration.selection),
        confirmation_rows=() if calibration.selection is None else confirmation_rows(calibration.selection),
        zone_rows=() if calibration.zones is None else zone_rows(calibration.zones),
        simulated=calibration.monte_carlo,
        simulated_line="".join(simulated_lines(calibration.monte_carlo, fit.robot)),
        interval_rows=() if calibration.monte_carlo is None else interval_rows(calibration.monte_carlo, fit.robot),
        curve_rows=curve_rows(calibration.curves),
        curve_names=[curve_name(curve) for curve in calibration.curves],
        budget_rows=() if calibration.budget is None else budget_rows(calibration.budget),
        expected_of=expected_of(calibration.expected),
        expected_rows=expected_rows(calibration.expected),
        notices=worst_first(calibration.warnings),
        fit=fit,
        source=Path(calibration.data.source).name,
        robot_rows=[row for row in rows if row.group not in _FRAMES],
        frame_rows=[row for row in rows if row.group in _FRAMES],
        parameter_sentence=parameter_sentence(rows),
        pairs=strongest_pairs(fit),
        noise_rows=noise_rows(fit),
        noise_alone={kind: noise_alone(fit, kind) for kind in ("position", "orientation", "length")},
        noise_sentence=noise_sentence(fit),
        down_weighted=int(report._down_weighted().sum()),
        default_gravity=GRAVITY,
    )


def _millimetres(errors: Errors) -> Array:
    """Return the error of each position, distance or height, NaN where none was read."""
    norms: Array = np.linalg.norm(errors.position_errors, axis=1) * 1e3
    return (
        norms
        if errors.length_errors is None
        else np.where(np.isfinite(norms), norms, np.abs(errors.length_errors) * 1e3)
    )
