"""Parts of a calibration's result: error budget, curves, simulated intervals, residuals, and its proof."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Words, listed
from truearm.engine.base.files import read_text
from truearm.engine.base.units import SHOWN_AS, Marked, from_si, parts_of
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import Errors
from truearm.engine.diagnose.curves import FittedCurve
from truearm.engine.diagnose.error_budget import ErrorBudget, Share
from truearm.engine.diagnose.expected_error import ExpectedError
from truearm.engine.diagnose.gain import NO_GAIN
from truearm.engine.diagnose.position_errors import covariance_root, uncertain_names
from truearm.engine.diagnose.simulated_calibrations import PredictedError, SimulatedCalibrations
from truearm.engine.document.document import Block, detail, say
from truearm.engine.document.records import Record
from truearm.engine.fit.fit import Fit, Status
from truearm.engine.programs.gauge import fixed_by
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.joint_curve import JointCurve
from truearm.engine.robot.loads import joint_efforts
from truearm.engine.robot.parameters import PLACES
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.proof import HELD, Proof
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from truearm.calibration.result import Calibration


#: What the sources are called where people read.
_SOURCES: Final = {
    "instrument": "instrument noise",
    "table": "table motion",
    "repeatability": "repeatability",
    "model": "what the model cannot express",
    "parameters": "uncertain parameters",
    "remainder": "remainder",
}
_APPARENT: Final = "apparent noise"

#: Many times the shares is not called the same, however uncertain: outliers make anything uncertain.
_ALIKE: Final = 3.0
#: Standard deviations of a share beyond which it is more than chance.
_SURE: Final = 2.0
#: Part of all shares from which one is told that may be chance.
_LARGE: Final = 0.25


def name_of(share: Share) -> str:
    """Return what a source is called: noise of readings without declared deviations need not be the instrument's."""
    return _APPARENT if share.apparent else _SOURCES[share.source]


def _summaries(shares: Sequence[Share], total: float) -> list[dict[str, Any]]:
    return [
        {
            "source": share.source,
            "square_mm2": None if share.square is None else share.square * 1e6,
            "square_deviation_mm2": None if share.square is None else share.deviation * 1e6,
            "rms_mm": None if share.rms is None else share.rms * 1e3,
            "part": None if share.square is None or total <= 0.0 else share.square / total,
            "words": share.words,
        }
        for share in shares
    ]


def _sum(shares: Sequence[Share]) -> float:
    return sum(share.square or 0.0 for share in shares)


def budget_block(budget: ErrorBudget | None) -> Block:
    """Return what limits the accuracy: the shares that are more than chance, or large, the largest first.

    JSON holds squares in mm^2, which add up, and their roots in mm.
    """
    if budget is None:
        return detail(limits_of_accuracy=None)
    places = min(max(3, 1 - math.floor(math.log10(max(budget.rms * 1e3, 1e-9)))), 6)
    subject = "held out" if budget.held_out else "to expect at configurations like these"
    shares = sum(share.square or 0.0 for share in budget.shares if share.source != "remainder")
    shown = [
        share
        for share in budget.shares
        if share.source != "remainder" and (_is_sure(share) or (share.square or 0.0) > _LARGE * max(shares, 0.0))
    ]
    shown.sort(key=lambda share: -(share.square or 0.0))
    parts = [
        f"{name_of(share)} {'' if _is_sure(share) else 'perhaps '}{(share.rms or 0.0) * 1e3:.{places}f} mm"
        for share in shown
    ]
    together = math.sqrt(max(shares, 0.0))
    comparison = "the same within its uncertainty" if budget.held_out else "which is their sum"
    if budget.held_out and not (budget.remainder_is_chance and budget.square < _ALIKE * shares):
        left = next(share for share in budget.shares if share.source == "remainder").rms or 0.0
        comparison = f"in squares {abs(left) * 1e3:.{places}f} mm {'more' if left > 0.0 else 'less'} than they explain"
    for share in budget.shares:
        if share.square is not None and share.source != "remainder" and share.square < -_SURE * share.deviation:
            comparison += f"; {name_of(share)} takes {abs(share.rms or 0.0) * 1e3:.{places}f} mm away, see the report"
    return detail(
        f"What limits the accuracy: {', '.join(parts) or 'nothing that is more than chance'}; all shares together, in "
        f"squares, {together * 1e3:.{places}f} mm, {subject} {budget.rms * 1e3:.{places}f} mm, {comparison}",
        limits_of_accuracy={
            "of": "held-out" if budget.held_out else "expected",
            "kind": budget.kind,
            "configurations": budget.configurations,
            "readings": budget.readings,
            "rms_mm": budget.rms * 1e3,
            "square_mm2": budget.square * 1e6,
            "square_deviation_mm2": budget.deviation * 1e6,
            "shares": _summaries(budget.shares, budget.square),
            "table_motion_removed_mm": None if budget.removed is None else budget.removed * 1e3,
            "workspace": None if budget.workspace is None else _summaries(budget.workspace, _sum(budget.workspace)),
        },
    )


def _is_sure(share: Share) -> bool:
    return share.square is not None and share.square > _SURE * share.deviation


def curve_block(curve: FittedCurve) -> Block:
    """Return size, strongest periods and measured ranges of a curve; told are amplitudes of half of the strongest."""
    *others, last = [group.range for group in curve.strongest if 2.0 * group.amplitude >= curve.strongest[0].amplitude]
    periods = f"{', '.join(others)} and {last}" if others else last
    return detail(
        f"Joint {curve.number}: curve of {math.degrees(curve.rms):#.2g} +- "
        f"{math.degrees(curve.rms_deviation):.1g} deg rms, strongest at {periods} "
        f"{'period' if periods == '1' else 'periods'} a turn",
        joint=curve.number,
        rms_mdeg=mdeg(curve.rms),
        rms_deviation_mdeg=mdeg(curve.rms_deviation),
        strongest=[
            {"periods": [group.lowest, group.highest], "amplitude_mdeg": mdeg(group.amplitude)}
            for group in curve.strongest
        ],
        measured_deg=[[math.degrees(low), math.degrees(high)] for low, high in curve.measured],
    )


def mdeg(angle: float) -> float:
    """Return an angle [rad] in millidegrees."""
    return 1e3 * math.degrees(angle)


def simulated_block(simulated: SimulatedCalibrations, robot: Robot) -> Block:
    """Return what simulated calibrations say of intervals, those by Monte Carlo beside the linear ones."""
    content: dict[str, Any] = {"trials": simulated.asked, "settled": simulated.settled, "seed": simulated.seed}
    if not simulated.settled:
        return say(f"Monte Carlo: none of {simulated.asked} simulated calibrations converged", monte_carlo=content)
    coverage, error, words = arm_coverage(simulated, robot), simulated.held_out, ""
    if error is not None:
        ends, linear = (
            " to ".join(f"{end * 1e3:.3f}" for end in pair) for pair in (error.interval_90, error.linear_interval_90)
        )
        words = (
            f"; uncertain parameters move unseen positions by {error.mean * 1e3:.3f} mm on average "
            f"(90 %: {ends}; linear: {error.linear_mean * 1e3:.3f}, {linear})"
        )
    content |= {
        "coverage": coverage,
        "predictions_mm": {"held_out": _predicted(error), "workspace": _predicted(simulated.workspace)},
        "parameters": _interval_rows(simulated, robot),
    }
    return say(
        f"Monte Carlo: in {simulated.settled} simulated calibrations {100.0 * coverage:.1f} % of the linear 95 % "
        f"intervals held the truth{words}",
        monte_carlo=content,
    )


def _interval_rows(simulated: SimulatedCalibrations, robot: Robot) -> list[dict[str, Any]]:
    rows = []
    for name, deviation, linear, interval, of_linear, coverage in zip(
        simulated.names,
        simulated.deviation.tolist(),
        simulated.linear_deviation.tolist(),
        simulated.interval_95.tolist(),
        simulated.linear_interval_95.tolist(),
        simulated.coverage.tolist(),
        strict=True,
    ):
        if robot.parameters[name].group == JointCurve.name:
            continue
        unit = SHOWN_AS[robot.parameters[name].unit]
        rows.append(
            {
                "name": name,
                "unit": unit,
                "deviation": from_si(deviation, unit),
                "linear_deviation": from_si(linear, unit),
                "interval_95": [from_si(end, unit) for end in interval],
                "linear_interval_95": [from_si(end, unit) for end in of_linear],
                "coverage": coverage,
            }
        )
    return rows


def _predicted(error: PredictedError | None) -> dict[str, Any] | None:
    if error is None:
        return None
    return {
        "mean": error.mean * 1e3,
        "interval_90": [end * 1e3 for end in error.interval_90],
        "linear_mean": error.linear_mean * 1e3,
        "linear_interval_90": [end * 1e3 for end in error.linear_interval_90],
    }


def arm_coverage(simulated: SimulatedCalibrations, robot: Robot) -> float:
    """Return the share of linear intervals that held the truth, over the arm's parameters; of all if it has none.

    Terms of joint curves do not count: each is a part of a curve.
    """
    own = np.array([robot.parameters[name].group not in (*PLACES, JointCurve.name) for name in simulated.names])
    return float(simulated.coverage[own if own.any() else ~own].mean())


# The result that is in a folder already: a sound one is not replaced by one that is not, unless that is asked for.

#: Ends of a fit with which a result can be sound.
SOUND: Final = (Status.CONVERGED.value, Status.AT_BOUND.value)
#: Warnings that speak against a result; the second is of earlier versions.
_WARNINGS: Final = (NO_GAIN.code, "not-better")


class ResultKeptError(InputError):
    """A result that is not sound would have replaced a sound one; nothing was written.

    Args:
        calibration: The new result. It can be saved in another folder.
        standing: The figures of the sound one, in words.
        folder: Where that is.
    """

    def __init__(self, calibration: Calibration, standing: str, folder: Path) -> None:
        new = said_of(calibration.summary(), calibration.faults)
        super().__init__(
            "a sound result is in this folder, and the new one is not sound. Nothing was written",
            parameter="out",
            where=str(folder),
            came=Words(f"{new}; in the folder: {standing}"),
            cure="Choose another `out`, or replace the sound result with `replace`.",
        )
        self.result = calibration


def sound_result(folder: Path) -> str | None:
    """Return the figures of the sound result in a folder, in words; None if there is none.

    A result is sound if its fit ended well, without an error and not without a gain over the nominal robot. The robot
    file says so, and ``result.json`` if that is of a calibration.
    """
    proof, summary = None, dict[str, Any]()
    with suppress(InputError):
        proof = read_robot(folder / "calibrated.yaml").proof
    with suppress(InputError, ValueError, RecursionError):
        content = json.loads(read_text(folder / "result.json"))
        if isinstance(content, dict) and content.get("truearm") == "truearm-result/1":
            summary = content
    status = summary.get("status") if proof is None else proof.status
    warnings = summary.get("warnings", ())
    bad = any(notice["level"] == "error" or notice["code"] in _WARNINGS for notice in warnings)
    if status not in SOUND or bad or (proof is not None and proof.errors):
        return None
    return said_of({**summary, "status": status}, [])


def said_of(summary: dict[str, Any], faults: Sequence[str]) -> str:
    """Return the status, what speaks against a result and its error on unseen configurations, in words.

    Args:
        summary: As ``result.json`` begins.
        faults: Codes of what speaks against it.
    """
    text = listed([summary["status"], *(fault for fault in faults if fault != summary["status"])])
    for kind in ("position_mm", "length_mm"):
        figures = (summary.get("validation") or {}).get(kind)
        if figures:
            return f"{text}, unseen configurations off by {figures['mean']:.3f} mm on average"
    return f"{text}, nothing held out" if "validation" in summary else text


#: What concerns every program: its controller may not have the nominal values of the file, or nothing was gained.
_REPEATED: Final = ("far-from-nominal", "no-gain")


def proof_of(
    fit: Fit,
    status: Status,
    warnings: Sequence[Notice],
    expected: ExpectedError,
    training: Dataset,
) -> Proof:
    """Return what a calibration knows about its result.

    What spoke against an earlier calibration speaks against parameters of the arm that this one has left as they were.

    Args:
        fit: Of the training part.
        status: How it ended, or that what it found cannot be this robot.
        warnings: All notices of the calibration.
        expected: The error to expect over the workspace.
        training: The training part.
    """
    ended, before = status.value, fit.before
    errors = [notice for notice in warnings if notice.level == "error"]
    repeated = [notice for notice in warnings if notice.code in _REPEATED]
    fixed = [*fixed_by(fit)]
    names, root = uncertain_names(fit), covariance_root(fit, fit.covariance_with_unfitted)
    region = list(zip(training.joints.min(axis=0).tolist(), training.joints.max(axis=0).tolist(), strict=True))
    measured = training.joints.tolist()
    loads = loads_of(fit.robot, training.postures)
    if before is not None:
        ended = before.status if ended in SOUND else ended
        errors += [error for error in before.errors if error.code not in [e.code for e in errors]]
        repeated += [warning for warning in before.warnings if not repeated]
        region = [(min(a, c), max(b, d)) for (a, b), (c, d) in zip(region, before.region or region, strict=True)]
        measured = [*before.measured, *measured] if before.measured else []
        # By older versions nothing is known of the loads before.
        pairs = zip(loads, before.loads, strict=True) if before.loads else ()
        loads = [(min(a, c), max(b, d)) for (a, b), (c, d) in pairs]
        fixed += [word for word in before.held if word in HELD and word not in fixed]
    return Proof.of(
        ended,
        errors,
        region,
        expected.joint_error,
        [fit.robot.parameters[name] for name in names],
        root @ root.T,
        warnings=repeated,
        lower_bound=expected.lower_bound,
        held=fixed,
        measured=measured,
        joint_units=["deg" if joint.kind == "revolute" else "mm" for joint in fit.robot.joints],
        loads=loads,
    )


def loads_of(robot: Robot, postures: Postures) -> list[tuple[float, float]]:
    """Return the lowest and highest load about, or along, each joint's axis in some postures [N m or N]."""
    efforts = joint_efforts(robot, postures)
    return list(zip(efforts.min(axis=0).tolist(), efforts.max(axis=0).tolist(), strict=True))


Part = Literal["training", "held out"]
Kind = Literal["position", "orientation", "length"]

#: Rows shown where a person reads.
_SHOWN = 10


class Residual(NamedTuple):
    """One row: what was read of a target at a configuration, and by how much the prediction differs."""

    configuration: str  #: configuration, target: by their names.
    target: str
    part: Part  #: Whether the fit has seen it: ``training`` or ``held out``.
    kind: Kind  #: ``position`` [m], ``orientation`` [rad] or ``length`` (a distance or a height) [m].
    #: Predicted minus measured, ``(3,)``: a vector in the instrument's frame (or the fixture's); for an orientation the
    #: rotation vector from measured to predicted; for a length that number and two NaN.
    error: Array
    norm: float  #: Length of it.


@dataclass(frozen=True, eq=False, repr=False)
class Residuals(Record):
    """What a calibrated robot leaves of every reading, in the order of the data: training first, then held out."""

    #: configuration, target, part, kind: of each row, see :class:`Residual`, ``(rows,)``.
    configuration: NDArray[np.str_]
    target: NDArray[np.str_]
    part: NDArray[np.str_]
    kind: NDArray[np.str_]
    error: Array  #: Predicted minus measured [m, rad], ``(rows, 3)``.
    norm: Array  #: Length of it [m, rad], ``(rows,)``.
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def __len__(self) -> int:
        return len(self.norm)

    def __iter__(self) -> Iterator[Residual]:
        columns = (self.configuration, self.target, self.part, self.kind, self.norm)
        rows = zip(*(column.tolist() for column in columns), strict=True)
        for (configuration, target, part, kind, norm), error in zip(rows, self.error, strict=True):
            yield Residual(configuration, target, part, kind, error, norm)

    def blocks(self) -> Iterator[Block]:
        """Give every row, in mm and mrad, and in words the largest, worst first."""
        yield say(
            f"{len(self)} residuals; the largest of each kind:",
            residuals=[
                {
                    "configuration": row.configuration,
                    "target": row.target,
                    "part": row.part,
                    "kind": row.kind,
                    "error": [None if np.isnan(value) else value * 1e3 for value in row.error.tolist()],
                    "norm": row.norm * 1e3,
                }
                for row in self
            ],
        )
        for kind, unit in (("position", "mm"), ("orientation", "mrad"), ("length", "mm")):
            rows = np.flatnonzero(self.kind == kind)
            for row in rows[np.argsort(-self.norm[rows], kind="stable")][:_SHOWN].tolist():
                reading = f"{self.configuration[row]}/{self.target[row]}"
                yield say(f"  {kind:<11} {reading:<16} {self.part[row]:<8} {self.norm[row] * 1e3:.3f} {unit}")

    def to_pandas(self) -> Any:
        """Return the rows as a pandas DataFrame, the error in columns ``ex``, ``ey``, ``ez``; pandas is needed for it.

        Raises:
            ImportError: If pandas is not installed.
        """
        from pandas import DataFrame

        return DataFrame(
            {
                "configuration": self.configuration,
                "target": self.target,
                "part": self.part,
                "kind": self.kind,
                **{f"e{axis}": self.error[:, k] for k, axis in enumerate("xyz")},
                "norm": self.norm,
            }
        )


def residuals_of(parts: Iterable[tuple[Part, Dataset, Errors]]) -> Residuals:
    """Return the residuals of the parts of a campaign, readings that were not made left out.

    Args:
        parts: Of each its name, its readings and their errors.
    """
    parts, names = [*parts], list[tuple[str, str, Part, Kind]]()
    errors = [np.zeros((0, 3))]
    for part, data, part_errors in parts:
        length = None
        if part_errors.length_errors is not None:
            length = np.full((len(part_errors.length_errors), 3), np.nan)
            length[:, 0] = part_errors.length_errors
        kinds: tuple[tuple[Kind, Array | None], ...] = (
            ("position", part_errors.position_errors),
            ("orientation", part_errors.orientation_errors),
            ("length", length),
        )
        for kind, values in kinds:
            if values is None:
                continue
            rows = np.flatnonzero(np.isfinite(values[:, 0]))
            errors.append(values[rows])
            names += [
                (data.labels[c], data.targets[t], part, kind)
                for c, t in zip(data.configuration[rows].tolist(), data.target[rows].tolist(), strict=True)
            ]
    error = np.concatenate(errors)
    configuration, target, part_of, kind_of = np.array(names, dtype=np.str_).reshape(-1, 4).T
    return Residuals(
        configuration,
        target,
        part_of,
        kind_of,
        error,
        np.sqrt(np.nansum(error**2, axis=1)),
        parts_of(data for _, data, _ in parts),
    )
