"""A finished calibration: the fit, and the proof on configurations it has not seen."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from truearm.calibration.parts import (
    SOUND,
    Part,
    Residuals,
    ResultKeptError,
    budget_block,
    curve_block,
    proof_of,
    residuals_of,
    simulated_block,
    sound_result,
)
from truearm.calibration.zones import ZONES_FILE, ZoneChoice, robot_file_of, zone_files
from truearm.engine.base.errors import InputError, Notice, counted, did_you_mean, has_error, listed
from truearm.engine.base.units import SHOWN_AS, Marked, from_si
from truearm.engine.base.writing import output_folder, write_files
from truearm.engine.command.reading import Excluded, excluded_block
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import Errors
from truearm.engine.diagnose.curves import FittedCurve, fitted_curves
from truearm.engine.diagnose.error_budget import ErrorBudget, error_budget
from truearm.engine.diagnose.expected_error import ExpectedError, error_by_order, expected_error, moved_by_order
from truearm.engine.diagnose.gain import NO_GAIN, Repeatability, repeatability
from truearm.engine.diagnose.least_error import Kind, LeastError, least_errors
from truearm.engine.diagnose.next_step import NextStep
from truearm.engine.diagnose.simulated_calibrations import SimulatedCalibrations
from truearm.engine.document.document import Block, detail, each, json_of, leaves_of, say, under
from truearm.engine.document.records import Record
from truearm.engine.document.summaries import (
    error_line,
    errors_summary,
    expected_blocks,
    least_block,
    noise_blocks,
    shares_block,
)
from truearm.engine.document.tables import parameter_lines
from truearm.engine.fit.every_effect import Shares
from truearm.engine.fit.fit import Fit, Status
from truearm.engine.fit.zones import ZoneVerdict, flange_places
from truearm.engine.robot.effects.joint_curve import JointCurve
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.seal import sealed
from truearm.engine.robot.robot_file.writing import robot_text

#: What a calibration writes into its folder.
RESULT_FILES: Final = ("calibrated.yaml", "result.json", "report.html", "calibrated.urdf")
#: Share of the expected error from which what the order of measurement does is said beside it.
_BY_ORDER: Final = 0.2


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(Record):
    """A finished calibration: the fit, and the proof on configurations it has not seen."""

    fit: Fit  #: Made from the training part alone.
    #: Errors of the uncalibrated robot on the held-out part, base and targets fitted on the training part. If nothing
    #: was held out, on the training part.
    nominal: Errors
    train: Errors  #: Errors of the calibrated robot on the training part.
    validation: Errors | None  #: Errors of the calibrated robot on the held-out part; None if nothing was held out.
    expected: ExpectedError  #: The error of the targets' positions to expect over the workspace.
    warnings: tuple[Notice, ...]  #: What to know about the result, in plain words.
    data: Dataset  #: All readings.
    training: NDArray[np.intp]  #: training, held_out: indices of the configurations of each part.
    held_out: NDArray[np.intp]
    command: str  #: How to run it again.
    history: str  #: What was done, in one line with the hash of the data.
    urdf: bytes | None = None  #: The user's own URDF, if that is where the robot came from.
    shares: Shares | None = None  #: What every effect does, where all are in the model; else None.
    because: str = ""  #: Why the model is this one; empty if it was named.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    without: tuple[str, ...] = ()  #: Labels of the configurations that were left out; `data` does not have them.
    excluded: tuple[Excluded, ...] = ()  #: Readings that were excluded; `data` have none there.
    notes: dict[str, str] = field(default_factory=dict)  #: What the user noted, by its name.
    next: tuple[NextStep, ...] = ()  #: What to do next, three steps at most, the most useful first.
    #: Calibrations that were simulated for intervals; None if none were asked for.
    monte_carlo: SimulatedCalibrations | None = None
    zones: ZoneChoice | None = None  #: What became of zones of the workspace; None if none were asked for.

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """``data``, or ``robot`` where it was calibrated with simulated measurements before."""
        return self.data.simulated_from or self.fit.robot.simulated_from

    @cached_property
    def robot(self) -> Robot:
        """The calibrated robot, base and targets included, with what the calibration knows about it."""
        training = self.data.of_configurations(self.training)
        proof = proof_of(self.fit, self.status, self.warnings, self.expected, training)
        calibrated = replace(self.fit.robot, history=(*self.fit.robot.history, self.history), tools={}, truths={})
        return sealed(calibrated, proof)

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """The identified parameters by their names, in SI units, each with its deviation."""
        return self.robot.parameters

    def __str__(self) -> str:
        """Return the report of the fit: its figures, and every parameter with what it is worth."""
        return "\n".join([*self.lines(), "", *parameter_lines(self.fit)])

    @cached_property
    def repeatability(self) -> Repeatability | None:
        """How well the robot comes back to a posture; None if too few were visited again."""
        return repeatability(self.data, self.fit.sigma.get("position", 0.0))

    @cached_property
    def least(self) -> Mapping[Kind, LeastError]:
        """The mean errors of the held-out readings that exact parameters would leave, of each kind where it is known.

        Empty where nothing was held out. What a fit leaves that did not end well says nothing of it.
        """
        if self.validation is None:
            return {}
        judged, fit = self.data.of_configurations(self.held_out), self.fit if self.status.value in SOUND else None
        return least_errors(self.fit.robot, self.data, judged, fit, self.expected.joint_error)

    @cached_property
    def budget(self) -> ErrorBudget | None:
        """What limits the accuracy: the mean square of the errors by its sources; None if there is nothing to part."""
        held_out = self.data.of_configurations(self.held_out) if len(self.held_out) else None
        training = self.data.of_configurations(self.training)
        return error_budget(self.fit, self.data, training, held_out, self.expected)

    @cached_property
    def _by_order(self) -> float:
        """How far the held-out predictions lie from those that do not know the order of measurement [m]."""
        return error_by_order(self.fit.robot, self.data.of_configurations(self.held_out))

    @cached_property
    def curves(self) -> tuple[FittedCurve, ...]:
        """The curves of the joints, where the model has some; see the effect ``joint-curve``."""
        return fitted_curves(self.fit, self.data.of_configurations(self.training))

    @property
    def status(self) -> Status:
        """How the fit ended, or that what it found cannot be this robot."""
        unlike = any(notice.code == Status.IMPLAUSIBLE.value for notice in self.warnings)
        return Status.IMPLAUSIBLE if unlike else self.fit.status

    @property
    def finished(self) -> bool:
        """Whether its figures can be believed: it converged or has a value at a bound, and no notice is an error."""
        return self.status.value in SOUND and not has_error(self.warnings)

    @property
    def faults(self) -> tuple[str, ...]:
        """What keeps it from replacing a sound result: a bad status, errors and ``no-gain``, by their codes."""
        codes = [self.status.value] if self.status.value not in SOUND else []
        codes += [notice.code for notice in self.warnings if notice.level == "error" or notice.code == NO_GAIN.code]
        return tuple(dict.fromkeys(codes))

    @property
    def advice(self) -> str:
        """What to do about the status and errors, in words; what to do next is in `next`."""
        if self.status is Status.CONVERGED and has_error(self.warnings):
            return "See the errors before you use the result."
        return self.status.advice

    def blocks(self) -> Iterator[Block]:
        """Give the figures people look for, the held-out error first, in mm and mrad."""
        status, sound = f"Status: {self.status.value}. {self.advice}".rstrip(), self.status is Status.CONVERGED
        if not sound or self.advice:
            yield say(status)
        unseen, trained = self.validation, counted(self.train.configurations, "training configuration")
        before, after = f"  nominal     {error_line(self.nominal)}", f"  calibrated  {error_line(self.train)}"
        if unseen is None:
            yield say(f"Nothing was held out; on the {trained}:", before, after, validation=None)
        else:
            yield say(
                f"On {counted(unseen.configurations, 'configuration')} the fit has not seen:",
                before,
                f"  calibrated  {error_line(unseen, self.least)}",
                validation=errors_summary(unseen),
            )
            yield detail(f"On the {trained}:", after)
        yield say(nominal=errors_summary(self.nominal), train=errors_summary(self.train))
        if self.because:
            yield detail(f"Model: {self.fit.model.name}, because {self.because}")
        if self.fit.fixed:
            yield detail(f"Held at known places: {listed(self.fit.fixed.words)}", held=list(self.fit.fixed.words))
        if self.without:
            left_out = f"{counted(len(self.without), 'configuration')} ({listed(self.without)})"
            yield say(f"Left out: {left_out}", without=list(self.without))
        if self.excluded:
            yield excluded_block(self.excluded)
        yield detail("" if self.advice or not sound else status, status=self.status.value)
        yield from expected_blocks(self.expected)
        if unseen is not None and self._by_order > _BY_ORDER * self.expected.overall.mean:
            yield say(
                "  this one programs see: the held-out error knows the order of measurement, which moves the targets "
                f"by {self._by_order * 1e3:.3f} mm"
            )
        for leaf in leaves_of(self._further()):
            yield replace(leaf, in_json={})
        if unseen is not None:
            yield least_block(unseen, self.least)
        if self.not_in_urdf:
            yield detail(self.urdf_words, not_in_urdf=self.not_in_urdf)
        if self.notes:
            yield say(notes=self.notes)

    def _further(self) -> Iterator[Block]:
        """Give what only ``result.json`` holds the figures of."""
        if self.curves:
            yield each("curves", ([curve_block(curve)] for curve in self.curves))
        yield under("noise", noise_blocks(self.fit, self.repeatability))
        yield budget_block(self.budget)
        if self.monte_carlo is not None:
            yield simulated_block(self.monte_carlo, self.robot)
        if self.zones is not None:
            yield under("zones", self.zones.blocks())
        if self.shares is not None:
            yield shares_block(self.shares)
        if self.fit.model.name == "frames":
            yield detail(*self._target_lines())

    def result(self) -> dict[str, Any]:
        """Return what ``result.json`` holds: the summary and every parameter but those of curves, which it sums up."""
        return {
            "truearm": "truearm-result/1",
            **self.summary(),
            "command": self.command,
            "history": self.history,
            "model": {
                "name": self.fit.model.name,
                "effects": list(self.fit.model.effects),
                **({"because": self.because} if self.because else {}),
            },
            "parameters": list(self._parameters()),
            **json_of(self._further()),
        }

    def residuals(self) -> Residuals:
        """Return what the calibrated robot leaves of every reading: training first, then held out."""
        parts: list[tuple[Part, Dataset, Errors]] = [
            ("training", self.data.of_configurations(self.training), self.train)
        ]
        if self.validation is not None:
            parts.append(("held out", self.data.of_configurations(self.held_out), self.validation))
        return residuals_of(parts)

    def plot(self, picture: str = "residuals") -> Any:
        """Return one of the report's pictures as a ``plotly.graph_objects.Figure``, to be shown or changed.

        Parameters
        ----------
        picture
            ``residuals`` (configuration by configuration), ``limits-of-accuracy``, ``expected-error``, ``workspace``,
            ``correlations``, and ``position-histogram``, ``orientation-histogram`` or ``length-histogram`` where such
            readings were held out.

        Raises
        ------
        InputError
            If the calibration has no such picture.
        """
        import plotly.graph_objects as go

        from truearm.calibration.report import Report

        drawn = Report(self).figures()
        if not isinstance(picture, str) or picture not in drawn:
            raise InputError(
                "the calibration has no such picture",
                parameter="picture",
                came=picture if isinstance(picture, str) else type(picture).__name__,
                allowed=", ".join(drawn),
                cure=did_you_mean(picture, drawn) if isinstance(picture, str) else None,
            )
        return go.Figure(data=drawn[picture]["data"], layout=drawn[picture]["layout"])

    def _target_lines(self) -> list[str]:
        """Return where the targets are on the flange, with their deviations."""
        text = []
        for target in self.robot.targets:
            parameters = [self.robot.parameters[target.parameter(axis)] for axis in "xyz"]
            place = ", ".join(f"{p.value * 1e3:.3f}" for p in parameters)
            known = ", ".join("?" if p.deviation is None else f"{p.deviation * 1e3:.2g}" for p in parameters)
            text.append(f"Target {target.name} on the flange: ({place}) mm, deviations ({known}) mm")
        return text

    def _parameters(self) -> Sequence[dict[str, Any]]:
        rows = []
        for p in self.robot.parameters.values():
            if p.group == JointCurve.name:
                continue
            unit = SHOWN_AS[p.unit]
            rows.append(
                {
                    "name": p.name,
                    "unit": unit,
                    "nominal": from_si(p.nominal, unit),
                    "value": from_si(p.value, unit),
                    "deviation": None if p.deviation is None else from_si(p.deviation, unit),
                    "informed": p.informed,
                    "status": self.fit.parameter_status(p.name),
                }
            )
        return rows

    @property
    def written(self) -> tuple[str, ...]:
        """Names of the files that are written: those of every calibration, and of the zones that are kept."""
        zone_names = [] if self.zones is None else [robot_file_of(verdict.box.name) for verdict in self.zones.kept]
        return (*RESULT_FILES, *([ZONES_FILE] if zone_names else []), *zone_names)

    @property
    def not_in_urdf(self) -> list[str]:
        """Names of the joint effects that ``calibrated.urdf`` lacks: geometry and joint zeros are all that it holds."""
        fit = self.fit

        def is_told(names: list[str]) -> bool:
            return any(name in fit.free.names and fit.parameter_status(name) != "uninformed" for name in names)

        effects = [(effect.name, [p.name for p in effect.parameters]) for effect in fit.robot.effects]
        return [name for name, parameters in effects if not fit.model.weighed or is_told(parameters)]

    @property
    def urdf_words(self) -> str:
        """What the URDF lacks, in words."""
        holds = "calibrated.urdf holds the geometry and the joint zeros, calibrated.yaml everything."
        return f"{holds} Not in the URDF: {', '.join(self.not_in_urdf)}."

    def written_at(self, out: str) -> str:
        """Return the line that says which files hold it."""
        lacks = " (the URDF without joint effects)" if self.not_in_urdf else ""
        return f"{super().written_at(out)}{lacks}"

    def zone_robot(self, verdict: ZoneVerdict) -> Robot:
        """Return the calibrated robot of a zone, with what is known about it.

        Raises
        ------
        InputError
            If it has none.
        """
        fit = verdict.fit
        if fit is None or self.zones is None:
            raise InputError("this zone has no model of its own", parameter="verdict", came=verdict.box.name)
        training = self.data.of_configurations(self.training)
        inside = np.flatnonzero(verdict.box.holds(flange_places(self.fit.start, training.postures), self.zones.overlap))
        part = training.of_configurations(inside)
        expected = expected_error(fit, by_order=moved_by_order(fit.robot, part))
        proof = proof_of(fit, fit.status, self.warnings, expected, part)
        line = f"{self.history}, zone {verdict.box.name}"
        return sealed(replace(fit.robot, history=(*fit.robot.history, line), tools={}, truths={}), proof)

    def save(
        self, folder: str | Path, progress: Callable[[str], None] = lambda _: None, *, replace: bool = False
    ) -> tuple[Path, ...]:
        """Write ``calibrated.yaml``, ``result.json``, ``report.html`` and ``calibrated.urdf`` into a folder.

        Zones that are kept add ``zones.yaml`` and ``zone-NAME.yaml`` of each.

        An earlier result stays until the new files are complete on disk; only then are they put in its place.

        Parameters
        ----------
        replace
            Whether a sound result in the folder is replaced by this one even if this one has :attr:`faults`.

        Returns
        -------
        The files written.

        Raises
        ------
        InputError
            If they cannot be written there; a :class:`truearm.calibration.parts.ResultKeptError` if a sound result
            would be lost.
        """
        from truearm.calibration.report import report_html
        from truearm.engine.robot.urdf import calibrated_urdf
        from truearm.engine.robot.urdf_writing import urdf_text

        folder = output_folder(folder, self.written, self.inputs, ours=True)
        standing = sound_result(folder) if self.faults and not replace else None
        if standing is not None:
            raise ResultKeptError(self, standing, folder)
        progress("drawing the report")
        urdf = calibrated_urdf(self.urdf, self.robot)[0] if self.urdf else urdf_text(self.robot)[0]
        files: dict[str, str | bytes] = {
            "calibrated.yaml": robot_text(self.robot),
            "result.json": json.dumps(self.result(), indent=2, allow_nan=False) + "\n",
            "report.html": report_html(self),
            "calibrated.urdf": urdf,
            **zone_files(self.zones, self.robot, self.zone_robot),
        }
        progress("writing the files")
        write_files(folder, files, self.command)
        return tuple(folder / name for name in files)
