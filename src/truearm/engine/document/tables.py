"""What the report says in numbers: errors, parameters, correlations and noise, ready to print."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Final

import numpy as np

from truearm.engine.base.units import SHOWN_AS, from_si
from truearm.engine.data.dataset import IntArray
from truearm.engine.data.statistics import Errors, Spread
from truearm.engine.diagnose.expected_error import ExpectedError
from truearm.engine.diagnose.narrow_data import own_parameters, same_motion
from truearm.engine.document.document import Cell, Table
from truearm.engine.document.drawing import decimals_of, deserved, significant, student_975
from truearm.engine.document.summaries import BOOTSTRAPPED, joint_error_text
from truearm.engine.fit.fit import Fit, ParameterStatus
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.joint_curve import JointCurve

#: Decimals of a parameter value: a micrometre, two micrometres at a metre, a millionth.
_DECIMALS: Final = {
    **{"mm": 3, "deg": 4, "1": 6, "um/N": 3, "um/(m K)": 2},
    **{"mrad/(N m)": 4, "mrad/(N m)^2": 5, "mrad/(N m)^3": 7},
}
#: Width of an interval of 90 % in standard deviations.
_WIDTH_90: Final = 3.29
#: Correlated pairs that are listed.
_PAIRS: Final = 10
_SIGMA_SHOWN: Final = {**dict.fromkeys(("position", "distance", "height"), ("mm", 1e3)), "orientation": ("mrad", 1e3)}
_PER: Final = {"position": "coordinate", "orientation": "rotation axis", "distance": "reading", "height": "reading"}


@dataclass(frozen=True)
class SpreadRow:
    """Errors of one robot on one part of the data, in the unit that is shown."""

    part: str  #: ``held out`` or ``training``.
    robot: str  #: ``before`` or ``after``.
    configurations: int  #: configurations, readings: how many there are.
    readings: int
    figures: tuple[float, float, float, float]  #: Mean, root mean square, 95th percentile and maximum.
    #: Standard error of the mean, by the scatter of the configurations; None of fewer than two.
    deviation: float | None = None

    @property
    def texts(self) -> tuple[str, ...]:
        """The figures as they are printed, with the digits that the mean deserves."""
        return tuple(deserved(figure, self.deviation) for figure in self.figures)

    @property
    def interval(self) -> tuple[str, str] | None:
        """Where the mean over configurations that are drawn alike lies with 95 %, as printed; None if not known."""
        if self.deviation is None or self.configurations < 2:
            return None
        wide = student_975(self.configurations - 1) * self.deviation
        return deserved(max(self.figures[0] - wide, 0.0), self.deviation), deserved(
            self.figures[0] + wide, self.deviation
        )


def spread_rows(
    nominal: Errors, train: Errors, validation: Errors | None, kind: str, configuration: tuple[IntArray, IntArray]
) -> tuple[SpreadRow, ...]:
    """Return the errors of one kind, ``position`` and ``length`` in mm, ``orientation`` in mrad; none without any.

    Args:
        configuration: Of each reading of the training part, and of the part that is judged.
    """
    part = "training" if validation is None else "held out"
    cases = [(part, "before", nominal, configuration[1])]
    cases.append((part, "after", train if validation is None else validation, configuration[1]))
    if validation is not None:
        cases.append(("training", "after", train, configuration[0]))
    rows = []
    for part, robot, errors, of in cases:
        spread: Spread | None
        spread, values = {
            "position": (errors.position, errors.position_errors),
            "orientation": (errors.orientation, errors.orientation_errors),
            "length": (errors.length, errors.length_errors),
        }[kind]
        if spread is not None and values is not None:
            norms = np.linalg.norm(values.reshape(len(values), -1), axis=1)
            figures = (spread.mean * 1e3, spread.rms * 1e3, spread.p95 * 1e3, spread.max * 1e3)
            read = np.isfinite(norms)
            error = standard_error(norms[read] * 1e3, of[read])
            rows.append(SpreadRow(part, robot, errors.configurations, int(read.sum()), figures, error))
    return tuple(rows)


def standard_error(values: Array, configuration: IntArray) -> float | None:
    """Return the standard error of a mean whose values hang together within configurations; None of fewer than two."""
    _, at = np.unique(configuration, return_inverse=True)
    count = int(at.max(initial=-1)) + 1
    if count < 2:
        return None
    sums = np.bincount(at.reshape(-1), values - values.mean())
    return float(np.sqrt(count / (count - 1) * np.sum(sums**2)) / len(values))


def expected_rows(expected: ExpectedError) -> list[tuple[str, str, str, str, str]]:
    """Return target, mean, ends of the interval and 95 % [mm], for all together, then for each if there are several."""
    parts = {"all": expected.overall, **(expected.targets if len(expected.targets) > 1 else {})}
    rows = []
    for name, of in parts.items():
        mean, low, high, p95 = (
            deserved(1e3 * figure, 1e3 * (of.interval_90[1] - of.interval_90[0]) / _WIDTH_90)
            for figure in (of.mean, *of.interval_90, of.p95)
        )
        rows.append((name, mean, low, "or more" if expected.lower_bound else high, p95))
    return rows


def parameters_table(rows: Sequence[ParameterRow]) -> Table:
    """Return the table of parameters of a page, which can be sorted."""
    heading = ("parameter", "group", "unit", "start", "estimate", "change", "deviation", "informed", "status")
    cells: list[tuple[str | Cell, ...]] = []
    for row in rows:
        share = None if row.informed is None else f"{100 * row.informed:.0f}"
        cells.append(
            (
                Cell(row.name, code=True),
                row.group,
                row.unit,
                Cell(row.fixed(row.start), row.start),
                Cell(row.known(row.estimate), row.estimate),
                Cell(row.change_text, row.change),
                Cell(row.deviation_text, -1 if row.deviation is None else row.deviation),
                Cell("" if share is None else f"{share} %", -1 if row.informed is None else row.informed, share=share),
                row.status,
            )
        )
    marks = tuple(row.status.replace(" ", "-").replace(":", "") for row in rows)
    return Table(heading, cells, texts=(1, 2, 8), look="parameters sortable", wide=True, marks=marks)


def spread_table(rows: Sequence[SpreadRow], kind: str, unit: str) -> Table:
    """Return the table of the errors of one kind, before and after."""
    cells: list[tuple[str | Cell, ...]] = [
        (
            row.part,
            Cell("nominal, before" if row.robot == "before" else "calibrated, after", chip=row.robot),
            str(row.configurations),
            str(row.readings),
            *(Cell(text, figure) for text, figure in zip(row.texts, row.figures, strict=True)),
        )
        for row in rows
    ]
    heading = ("part", "robot", "configurations", "readings", "mean", "RMS", "95 % below", "maximum")
    return Table(heading, cells, texts=(1,), caption=f"{kind} error of single readings [{unit}]", look="spread")


@dataclass(frozen=True)
class ParameterRow:
    """One parameter in the unit that is shown, as numbers for sorting and as text."""

    name: str
    group: str
    unit: str
    start: float
    estimate: float
    deviation: float | None
    informed: float | None
    fit_status: ParameterStatus

    @property
    def status(self) -> str:
        """The status as it is printed."""
        return {"dropped": "held: redundant"}.get(self.fit_status, self.fit_status.replace("-", " "))

    @property
    def change(self) -> float:
        """Estimate minus start."""
        return self.estimate - self.start

    def fixed(self, value: float) -> str:
        """Write a nominal value of this parameter, or one that was not free."""
        return self._with(value, _DECIMALS[self.unit])

    def known(self, value: float) -> str:
        """Write an estimate of this parameter, with the digits that its deviation deserves."""
        most = _DECIMALS[self.unit] + 1
        known = self.deviation is not None and self.deviation > 0.0
        return self._with(value, decimals_of(self.deviation or 0.0, most) if known else _DECIMALS[self.unit])

    @staticmethod
    def _with(value: float, decimals: int) -> str:
        text = f"{value:.{decimals}f}"
        return text.removeprefix("-") if float(text) == 0 else text

    @property
    def change_text(self) -> str:
        """The change with its sign, nothing where the parameter was not free."""
        if self.deviation is None:
            return ""
        text = self.known(self.change)
        return text if text.startswith("-") or float(text) == 0 else f"+{text}"

    @property
    def deviation_text(self) -> str:
        """The deviation, nothing where the parameter was not free."""
        return "" if self.deviation is None else significant(self.deviation, 2, _DECIMALS[self.unit] + 2)


def parameter_rows(fit: Fit) -> tuple[ParameterRow, ...]:
    """Return a row for every parameter of the robot, in the robot's order, but for the hundreds of joint curves."""
    free = set(fit.free.names)
    rows = []
    for p in fit.robot.parameters.values():
        if p.group == JointCurve.name:
            continue
        unit, was_free = SHOWN_AS[p.unit], p.name in free
        rows.append(
            ParameterRow(
                name=p.name,
                group=p.group,
                unit=unit,
                start=from_si(fit.start.parameters[p.name].value, unit),
                estimate=from_si(p.value, unit),
                deviation=from_si(p.deviation, unit) if was_free and p.deviation is not None else None,
                informed=p.informed if was_free else None,
                fit_status=fit.parameter_status(p.name),
            )
        )
    return tuple(rows)


def untold(fit: Fit, row: ParameterRow) -> bool:
    """Return whether the data tell next to nothing of a parameter that a model with every effect has."""
    return fit.model.weighed and row.group in fit.model.effects and row.fit_status == "uninformed"


def parameter_lines(fit: Fit) -> list[str]:
    """Return the parameters in columns: name, nominal, value, deviation, unit, and what the value is worth.

    Those that :func:`untold` is about are counted.
    """
    worth = {"identified": "", "at-bound": "at a bound", "uninformed": "not told by the data"}
    rows = [("parameter", "nominal", "value", "deviation", "unit", "")]
    told = [row for row in parameter_rows(fit) if not untold(fit, row)]
    for row in told:
        nominal = from_si(fit.robot.parameters[row.name].nominal, row.unit)
        status = worth.get(row.fit_status, row.fit_status.replace("-", " "))
        rows.append((row.name, row.fixed(nominal), row.known(row.estimate), row.deviation_text, row.unit, status))
    wide = [max(len(row[k]) for row in rows) for k in range(5)]
    lines = [
        "  ".join(
            [row[0].ljust(wide[0]), *(row[k].rjust(wide[k]) for k in (1, 2, 3)), row[4].ljust(wide[4]), row[5]]
        ).rstrip()
        for row in rows
    ]
    more = len(parameter_rows(fit)) - len(told)
    return [*lines, *([f"and {more} of joint effects of which the data tell next to nothing"] if more else [])]


def strongest_pairs(fit: Fit) -> list[tuple[Cell, Cell, str]]:
    """Return the most strongly correlated pairs of the arm's own parameters as rows, strongest first.

    Where base, targets and fixtures are goes with the arm's first and last links in every calibration. So do lengths
    along parallel axes, of which only the sum moves anything. Such pairs say nothing about these data.
    """
    names, r = fit.free.names, fit.correlations
    own = own_parameters(fit)
    rows, columns = (np.array(own, dtype=np.intp)[part] for part in np.triu_indices(len(own), 1))
    order = np.argsort(-abs(r[rows, columns]), kind="stable")
    pairs = ((int(rows[k]), int(columns[k])) for k in order.tolist())
    of_convention = same_motion(fit)
    strongest = islice((pair for pair in pairs if pair not in of_convention), _PAIRS)
    return [(Cell(names[i], code=True), Cell(names[j], code=True), f"{float(r[i, j]):+.3f}") for i, j in strongest]


def noise_table(fit: Fit) -> Table:
    """Return the deviation of a reading for each kind of observation."""
    source = "declared in the data" if fit.declared else "estimated from residuals"
    rows = []
    for kind, sigma in fit.sigma.items():
        unit, scale = _SIGMA_SHOWN[kind]
        rows.append((kind, Cell(f"{significant(sigma * scale, 3, 5)} {unit}", sigma * scale), _PER[kind], source))
    return Table(("reading", "standard deviation", "per", "source"), rows, texts=(2, 3))


def noise_sentence(fit: Fit) -> str:
    """Say what the residuals tell about the noise, and about what the readings of a configuration share."""
    sentences = [_noise(fit)]
    shared = joint_error_text(fit)
    if shared:
        sentences.append(
            f"All readings of a configuration share an error of the joints, of {shared} each: repeatability plus what "
            "the model leaves."
        )
    if fit.bootstrap:
        sentences.append(f"The deviations of the parameters follow from {fit.bootstrap} {BOOTSTRAPPED}.")
    elif fit.scattered:
        sentences.append("The deviations of the parameters follow from the scatter of the configurations.")
    return " ".join(sentences)


def _noise(fit: Fit) -> str:
    if not fit.declared:
        more = ", not only the noise of the instrument" if not fit.joint_error.any() else " and is not shared"
        return (
            "The file does not declare all deviations of its readings, so they were estimated from the training "
            f"residuals. They contain whatever the model cannot express{more}."
        )
    if fit.excess > 1.0:
        return (
            f"The training residuals are {fit.excess:.2f} times as large as the declared deviations allow: the "
            f"robot does something that the {fit.model.name} model cannot express, or the declared deviations are "
            "too small. The deviations of the parameters allow for it."
        )
    if fit.joint_error.any() and not fit.scattered:
        return "The training residuals are no larger than the declared deviations and errors of the joints allow."
    return "The training residuals are no larger than the declared deviations allow; nothing was widened."


def parameter_sentence(rows: Sequence[ParameterRow]) -> str:
    """Count the parameters by how they ended."""
    counts: dict[str, int] = {}
    for row in rows:
        counts[row.status] = counts.get(row.status, 0) + 1
    words = {
        "at bound": "stopped at a bound",
        "held: redundant": "held because they are redundant",
        "held": "held at known places",
    }
    sentence = ", ".join(f"{count} {words.get(status, status)}" for status, count in counts.items())
    return f"{sentence}."
