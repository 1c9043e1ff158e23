"""The report of a calibration: one HTML file that needs nothing else, not even a network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from truearm.calibration.figures import (
    budget_figure,
    budget_table,
    coverage_figure,
    curve_figure,
    curve_name,
    curves_table,
    intervals_table,
    shares_figure,
    shares_table,
    workspace_budget_figure,
    zones_figure,
    zones_table,
)
from truearm.calibration.parts import simulated_block
from truearm.engine.base.errors import worst_first
from truearm.engine.diagnose.expected_error import expected_map
from truearm.engine.document.document import (
    Alert,
    Block,
    Document,
    Facts,
    Folded,
    Lead,
    Picture,
    Points,
    Section,
    Table,
    Warned,
    Words,
    lines_of,
    pictured,
)
from truearm.engine.document.figures import correlation_map, expected_error_map, histogram, residuals, workspace
from truearm.engine.document.summaries import expected_of, least_words
from truearm.engine.document.tables import (
    SpreadRow,
    expected_rows,
    noise_sentence,
    noise_table,
    parameter_rows,
    parameter_sentence,
    parameters_table,
    spread_rows,
    spread_table,
    strongest_pairs,
    untold,
)
from truearm.engine.robot.parts import GRAVITY

if TYPE_CHECKING:
    from truearm.calibration.result import Calibration
    from truearm.engine.data.dataset import Dataset
    from truearm.engine.data.statistics import Errors
    from truearm.engine.diagnose.next_step import NextStep
    from truearm.engine.document.drawing import Figure
    from truearm.engine.fit.fit import Fit
    from truearm.engine.robot.chain import Array

_FRAMES: Final = ("base", "target", "fixture")
#: Notes that every certificate has a line for, and what it is called.
_NOTED: Final = {"serial": "Serial number", "date": "Date", "instrument": "Instrument", "operator": "Operator"}
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
        if run.shares is not None:
            drawn["shares"] = shares_figure(run.shares)
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
    run, fit = calibration, calibration.fit
    report = Report(run)
    drawn = report.figures()
    source = Path(run.data.source).name
    return Document(
        f"Calibration of {fit.robot.title} – {source}",
        [
            _warnings(run),
            _before_and_after(report, drawn),
            *_limits(run, drawn),
            _expected(run, drawn),
            *_workspace(run, drawn),
            _residuals(report, drawn),
            *_curves(run, drawn),
            *_zones(run, drawn),
            *_shares(run, drawn),
            _parameters(run),
            *_monte_carlo(run, drawn),
            _correlations(fit, drawn),
            Section("Noise", [noise_table(fit), Words(noise_sentence(fit))], "noise"),
        ],
        run.command,
        headline=f"Calibration of {fit.robot.title}",
        subtitle=f"Data: {source}",
        history=(
            run.history,
            *(f"Earlier: {line}" for line in fit.robot.history),
            f"The solver took {fit.steps} steps.",
        ),
        cover=[Facts(_certified(run), "certified"), _result(report)],
    ).html(run)


def _certified(run: Calibration) -> list[tuple[str, str | Sequence[NextStep]]]:
    """Return what the first page says of robot, data and model; what nobody noted is filled in by hand."""
    robot = run.fit.robot
    facts: list[tuple[str, str | Sequence[NextStep]]] = [("Robot", f"{robot.title} (`{robot.name}`)")]
    facts += [(shown, run.notes.get(name, "")) for name, shown in _NOTED.items()]
    facts += [(name.capitalize(), note) for name, note in run.notes.items() if name not in _NOTED]
    facts.append(("Status", run.status.value))
    if run.advice:
        facts.append(("What to do", run.advice))
    if run.next:
        facts.append(("Next", run.next))
    because = f" (because {run.because})" if run.because else ""
    facts.append(("Model", f"{run.fit.model.name}: {run.fit.model.summary}{because}"))
    if robot.payload.mass:
        place = ", ".join(f"{v * 1000:g}" for v in robot.payload.cog)
        facts.append(("Payload", f"{robot.payload.mass:g} kg at ({place}) mm on the flange"))
    if robot.gravity != GRAVITY:
        fall = ", ".join(f"{v:g}" for v in robot.gravity)
        facts.append(("Free fall", f"({fall}) m/s² in the robot's base frame"))
    facts.append(("Configurations", f"{len(run.training)} for training, {len(run.held_out)} held out"))
    if run.without:
        facts.append(("Left out", ", ".join(run.without)))
    if run.excluded:
        rows = (
            f"{excluded.row.configuration}/{excluded.row.target} ({excluded.part}): {excluded.row.reason}"
            for excluded in run.excluded
        )
        facts.append(("Excluded", "; ".join(rows)))
    facts.append(("Targets", ", ".join(run.data.targets)))
    if run.data.fixtures:
        facts.append(("Measured against", ", ".join(f"{fixture.name} ({fixture.kind})" for fixture in robot.fixtures)))
    return facts


def _result(report: Report) -> Section:
    """Return the answer: errors before and after, and the error to expect elsewhere."""
    run = report.calibration
    held_out = run.validation is not None
    blocks: list[Block] = []
    if not held_out:
        words = (
            "Every error below is one of the training readings: it says how well the model follows the data it was "
            "made from, not how accurate the robot is elsewhere."
        )
        blocks.append(Alert("Nothing was held out.", words))
    spreads = [
        (rows, kind, unit, words)
        for rows, kind, unit, words in (
            (report.position, "position", "mm", "Position"),
            (report.orientation, "orientation", "mrad", "Orientation"),
            (report.length, "length", "mm", "Length (distance or height)"),
        )
        if rows
    ]
    leads = [
        _lead(run, rows, kind, unit, held_out=held_out) for rows, kind, unit, _ in spreads if rows[0].robot == "before"
    ]
    part = "held-out" if held_out else "training"
    blocks += leads or [Alert("", f"The {part} part holds no reading to compare with.")]
    blocks.append(_lead_elsewhere(run))
    blocks += [spread_table(rows, words, unit) for rows, _, unit, words in spreads]
    blocks.append(
        Words(
            "Before is the nominal robot with base and targets fitted to the training part; after is the calibrated "
            "robot. Both are compared with the same readings.",
            quiet=True,
        )
    )
    notices = worst_first(run.warnings)
    blocks += [Warned(notice) for notice in notices if notice.level == "error"]
    others = [notice.code for notice in notices if notice.level != "error"]
    if others:
        blocks.append(Words(f"Warnings and notes, explained below: {', '.join(others)}.", quiet=True))
    return Section("", blocks, "result")


def _lead(run: Calibration, rows: Sequence[SpreadRow], kind: str, unit: str, *, held_out: bool) -> Lead:
    before, after = rows[:2]
    judged = (
        f"{after.configurations} "
        f"{'configurations that the fit has not seen' if held_out else 'training configurations'}"
    )
    words = ""
    if after.interval:
        low, high = after.interval
        words += f"Of configurations drawn alike the mean lies between {low} and {high} {unit} with 95 %. "
    if run.validation is not None:
        words += "".join(f"{said} " for of, said in least_words(run.validation, run.least).items() if of == kind)
    words += (
        f"95 % of the readings are below {after.texts[2]} {unit} (before: {before.texts[2]} {unit}); the largest is "
        f"{after.texts[3]} {unit} (before: {before.texts[3]} {unit})."
    )
    lines = [Words(f"Mean {kind} error on the {judged}, before → after."), Words(words, quiet=True)]
    return Lead(lines, after.texts[0], before.texts[0], unit, kind)


def _lead_elsewhere(run: Calibration) -> Lead:
    expected = run.expected
    _, mean, low, high, p95 = expected_rows(expected)[0]
    span = f"{low} mm or more" if expected.lower_bound else f"between {low} and {high} mm"
    of = expected_of(expected)
    quantile = (
        f"The 95 % quantile of the positions is {p95} mm, by what is known."
        if expected.lower_bound
        else f"95 % of the positions are expected below {p95} mm."
    )
    larger = f" The errors may be larger: {'; '.join(expected.omissions)}." if expected.lower_bound else ""
    return Lead(
        [
            Words(
                "Mean position error to expect over the whole workspace; with a probability of 90 % this robot's is "
                f"{span}."
            ),
            Words(
                f"{quantile} {of[0].upper()}{of[1:]}; joint positions anywhere within their limits; without the noise "
                f"and the systematic errors of the instrument.{larger}",
                quiet=True,
            ),
        ],
        mean,
        unit="mm",
        name="expected",
    )


def _warnings(run: Calibration) -> Section:
    notices = worst_first(run.warnings)
    grave = sum(notice.level == "error" for notice in notices)
    blocks: list[Block] = []
    if grave:
        blocks.append(Words(f"{grave} {'error stands' if grave == 1 else 'errors stand'} on the first page."))
    blocks += [Warned(notice) for notice in notices[grave:]]
    return Section("Errors, warnings and notes", blocks or [Words("None.")], "warnings")


def _before_and_after(report: Report, drawn: dict[str, Figure]) -> Section:
    part = "Training" if report.calibration.validation is None else "Held-out"
    names = ("position-histogram", "orientation-histogram", "length-histogram")
    pictures = [Picture(name, drawn[name]) for name in names if name in drawn]
    return Section(f"{part} error before and after", pictures or [Words("There is no reading to show.")])


def _limits(run: Calibration, drawn: dict[str, Figure]) -> list[Section]:
    budget = run.budget
    if budget is None:
        return []
    together = (
        f"Together they are the mean square of the held-out {budget.kind} errors. All shares but the remainder are "
        "known without the held-out readings; the remainder is what these differ by."
    )
    if not budget.held_out:
        together = (
            "Nothing was held out, so together they are what to expect of readings at configurations like the training "
            "ones."
        )
    words = (
        "Squares of errors from independent sources add up: each bar begins where the one before ends. "
        f"{together} A share that came out negative is drawn back, in red."
    )
    picture = Picture("limits-of-accuracy", drawn["limits-of-accuracy"])
    blocks: list[Block] = [Words(words), picture, budget_table(budget)]
    if "limits-over-the-workspace" in drawn:
        over = "Over the whole workspace, without the noise of a reading, the same sources make the error to expect:"
        blocks += [Words(over), Picture("limits-over-the-workspace", drawn["limits-over-the-workspace"])]
    return [Section("What limits the accuracy", blocks, "limits")]


def _expected(run: Calibration, drawn: dict[str, Figure]) -> Section:
    shared = " and from what readings of a visit share" if run.expected.by_joint_error else ""
    words = (
        "Error of the targets' positions to expect, in the robot's base frame, mean over the joint positions that "
        f"bring them into a cell. It follows from the covariance of the parameters{shared}, without the noise of a "
        "reading. The dots are where the training readings were taken: far from them the model may be known less well. "
        "Values beyond the end of the scale have its last colour."
    )
    rows = expected_rows(run.expected)
    heading = ("target", "mean [mm]", "90 % from", "to [mm]", "95 % below [mm]")
    targets = [Table(heading, rows, name="expected-targets")] if len(rows) > 1 else []
    picture = Picture("expected-error", drawn["expected-error"])
    return Section("Expected error over the workspace", [Words(words), picture, *targets], "expected")


def _workspace(run: Calibration, drawn: dict[str, Figure]) -> list[Section]:
    if "workspace" not in drawn:
        return []
    words = (
        f"Where the {'training' if run.validation is None else 'held-out'} readings were taken, in the robot's base "
        "frame, coloured by their error. Errors beyond the end of the scale have its last colour."
    )
    return [pictured("workspace", "Errors over the workspace", words, drawn["workspace"])]


def _residuals(report: Report, drawn: dict[str, Figure]) -> Section:
    words = (
        "Error of the calibrated robot at each configuration, mean over its "
        f"{'targets' if report.position else 'readings'}. A trend or a step is a sign that something moved or warmed "
        "up during the measurement."
    )
    light = int(report._down_weighted().sum())
    if light:
        readings = "reading" if light == 1 else "readings"
        words += f" The robust loss gave {light} training {readings} less than half the weight of a typical one."
    return pictured("residuals", "Residuals, configuration by configuration", words, drawn["residuals"])


def _curves(run: Calibration, drawn: dict[str, Figure]) -> list[Section]:
    if not run.curves:
        return []
    words = (
        "What each joint turns beyond its position, over its range or over one turn: the errors of its gear and of its "
        "encoder. The band is what the fit knows of it, with 95 %. On simulated robots it held 97 % of the true curve, "
        "91 % where teeth are worn, and 84 % where all joints were measured through 90° only. Short lines at the "
        "bottom are the training configurations. Where the ground is grey there are none; the band may end beyond the "
        "picture."
    )
    pictures = [Picture(name, drawn[name]) for name in map(curve_name, run.curves)]
    return [Section("Curves of the joints", [Words(words), *pictures, curves_table(run.curves)], "curves")]


def _zones(run: Calibration, drawn: dict[str, Figure]) -> list[Section]:
    if run.zones is None:
        return []
    answer = lines_of(run.zones.blocks())[0]
    words = (
        f"{answer} A zone has a model of its own that starts at the values of the whole, and is kept where it is "
        "better on its held-out readings by more than two standard errors of the difference. The nominal flange says "
        "in which zone a configuration is."
    )
    pictures = [Picture("zone-errors", drawn["zone-errors"])] if "zone-errors" in drawn else []
    return [Section("Zones of the workspace", [Words(words), *pictures, zones_table(run.zones)], "zones")]


def _shares(run: Calibration, drawn: dict[str, Figure]) -> list[Section]:
    if run.shares is None:
        return []
    words = (
        "Every joint effect that robot and data say something of is in the model. How large each may be, the data "
        "tell: what they do not support shrinks to nothing. The table says by how much each effect moves the targets "
        "at the training configurations, and how many of its parameters the data tell. Effects may stand in for each "
        "other where the data do not tell them apart."
    )
    blocks: list[Block] = [Words(words), Picture("shares", drawn["shares"]), shares_table(run.shares)]
    return [Section("What every effect does", blocks, "choice")]


def _parameters(run: Calibration) -> Section:
    fit = run.fit
    rows = parameter_rows(fit)
    own, frames = ([row for row in rows if (row.group in _FRAMES) is of_frames] for of_frames in (False, True))
    idle, own = ([row for row in own if untold(fit, row) is so] for so in (True, False))
    words = (
        f"{parameter_sentence(rows)} Deviation is one standard deviation of the estimate. Informed is the share of the "
        "prior's variance that the readings removed: near 0 %, the value is its prior and was not measured (grey). "
        "Click a heading to sort."
    )
    blocks: list[Block] = [Words(words)]
    if run.not_in_urdf:
        blocks.append(Words(run.urdf_words, quiet=True))
    if fit.redundancies:
        combined = (
            "Moving the parameters together along these directions hardly changes any predicted reading, so the first "
            "one of each is held at its nominal value. At configurations like the measured ones predictions hardly "
            "depend on them."
        )
        entries = [f"`{redundancy.dropped}` held: `{redundancy.combination}`" for redundancy in fit.redundancies]
        blocks.append(Points("Redundant combinations", combined, entries, "redundancies"))
    turn = ", ".join(f"{number:.6f}" for number in fit.robot.base_quaternion)
    base = (
        "The base stands in the instrument's frame at `base_x`, `base_y`, `base_z`, turned by the quaternion (w, x, y, "
        f"z) = ({turn}) and then by the small angles `base_rx`, `base_ry`, `base_rz`. Their start is the closed-form "
        "placement of the nominal robot."
    )
    summary = f"Base, targets and fixtures ({len(frames)} parameters)"
    blocks.append(parameters_table(own))
    if idle:
        words = f"Joint effects of which the data tell next to nothing ({len(idle)} parameters)"
        blocks.append(Folded(words, [parameters_table(idle)]))
    blocks.append(Folded(summary, [Words(base, quiet=True), parameters_table(frames)]))
    return Section("Parameters", blocks, "parameters")


def _monte_carlo(run: Calibration, drawn: dict[str, Figure]) -> list[Section]:
    simulated = run.monte_carlo
    if simulated is None or "coverage" not in drawn:
        return []
    sentence = lines_of([simulated_block(simulated, run.fit.robot)])[0]
    words = (
        f"{sentence}. Each simulated calibration measures the calibrated robot again, with noise and "
        "joint errors as they were found, and begins from a nominal robot that is off as the priors say "
        f"(seed {simulated.seed}). A dot is the share of them in which the linear interval of a "
        "parameter held the truth; where the intervals are right, 95 of 100 dots lie between the dotted lines."
    )
    table = intervals_table(simulated, run.fit.robot)
    summary = f"Intervals of 95 %, linear and by Monte Carlo ({len(table.rows)} parameters)"
    picture = Picture("coverage", drawn["coverage"])
    return [Section("Intervals by Monte Carlo", [Words(words), picture, Folded(summary, [table])], "monte-carlo")]


def _correlations(fit: Fit, drawn: dict[str, Figure]) -> Section:
    subject = (
        "free parameters"
        if fit.model.name == "frames"
        else "arm's free parameters, without base and targets, which go with the arm's ends in every calibration"
    )
    words = (
        f"Between the estimates of the {subject}. Strongly correlated parameters are known well only together; more "
        "varied configurations separate them."
    )
    blocks: list[Block] = [Words(words), Picture("correlations", drawn["correlations"])]
    pairs = strongest_pairs(fit)
    if pairs:
        caption = "The strongest pairs, without those that move the arm alike everywhere"
        blocks.append(Table(("parameter", "parameter", "correlation"), pairs, texts=(1,), caption=caption))
    return Section("Correlations", blocks, "correlation")


def _millimetres(errors: Errors) -> Array:
    """Return the error of each position, distance or height, NaN where none was read."""
    norms: Array = np.linalg.norm(errors.position_errors, axis=1) * 1e3
    return (
        norms
        if errors.length_errors is None
        else np.where(np.isfinite(norms), norms, np.abs(errors.length_errors) * 1e3)
    )
