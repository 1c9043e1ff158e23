"""What the report says in numbers: errors, parameters, correlations and noise, ready to print."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.identification.judging.expected_error import ExpectedError
from truearm.identification.solving.fit import Fit, ParameterStatus
from truearm.measurement.statistics import Errors, Spread
from truearm.reporting.numbers import significant
from truearm.results.summaries import joint_error_text
from truearm.units import SHOWN_AS, from_si

#: Decimals of a parameter value: a micrometre, two micrometres at a metre, a millionth.
_DECIMALS: Final = {
    **{"mm": 3, "deg": 4, "1": 6, "um/N": 3, "um/(m K)": 2},
    **{"mrad/(N m)": 4, "mrad/(N m)^2": 5, "mrad/(N m)^3": 7},
}
#: Correlated pairs that are listed.
_PAIRS: Final = 10
_SIGMA_SHOWN: Final = {
    **dict.fromkeys(("position", "distance", "height"), ("mm", 1e3)),
    "orientation": ("mrad", 1e3),
}
_PER: Final = {"position": "coordinate", "orientation": "rotation axis", "distance": "reading", "height": "reading"}


@dataclass(frozen=True)
class SpreadRow:
    """Errors of one robot on one part of the data, in the unit that is shown.

    Attributes
    ----------
    part
        ``held out`` or ``training``.
    robot
        ``before`` or ``after``.
    configurations, readings
        How many there are.
    figures
        Mean, root mean square, 95th percentile and maximum.
    """

    part: str
    robot: str
    configurations: int
    readings: int
    figures: tuple[float, float, float, float]

    @property
    def texts(self) -> tuple[str, ...]:
        """The figures as they are printed."""
        return tuple(significant(figure) for figure in self.figures)


def spread_rows(nominal: Errors, train: Errors, validation: Errors | None, kind: str) -> tuple[SpreadRow, ...]:
    """Return the errors of one kind, ``position`` and ``length`` in mm, ``orientation`` in mrad; none without any."""
    part = "training" if validation is None else "held out"
    cases = [(part, "before", nominal), (part, "after", train if validation is None else validation)]
    if validation is not None:
        cases.append(("training", "after", train))
    rows = []
    for part, robot, errors in cases:
        spread: Spread | None
        spread, norms = {
            "position": (errors.position, errors.position_norms),
            "orientation": (errors.orientation, errors.orientation_norms),
            "length": (errors.length, errors.length_norms),
        }[kind]
        if spread is not None:
            figures = (spread.mean * 1e3, spread.rms * 1e3, spread.p95 * 1e3, spread.max * 1e3)
            rows.append(SpreadRow(part, robot, errors.configurations, len(norms), figures))
    return tuple(rows)


@dataclass(frozen=True)
class ExpectedRow:
    """The error to expect over the workspace, as printed [mm]."""

    targets: str
    mean: str
    low: str
    high: str
    p95: str


def expected_rows(expected: ExpectedError) -> tuple[ExpectedRow, ...]:
    """Return a row for all targets together, then one for each where there are several."""
    parts = {"all": expected.overall, **(expected.targets if len(expected.targets) > 1 else {})}
    return tuple(
        ExpectedRow(name, *(significant(1e3 * figure) for figure in (of.mean, *of.interval_90, of.p95)))
        for name, of in parts.items()
    )


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
        """Write a value of this parameter."""
        text = f"{value:.{_DECIMALS[self.unit]}f}"
        return text.removeprefix("-") if float(text) == 0 else text

    @property
    def change_text(self) -> str:
        """The change with its sign, nothing where the parameter was not free."""
        if self.deviation is None:
            return ""
        text = self.fixed(self.change)
        return text if text.startswith("-") or float(text) == 0 else f"+{text}"

    @property
    def deviation_text(self) -> str:
        """The deviation, nothing where the parameter was not free."""
        return "" if self.deviation is None else significant(self.deviation, 2, _DECIMALS[self.unit] + 2)


def parameter_rows(fit: Fit) -> tuple[ParameterRow, ...]:
    """Return a row for every parameter of the robot, in the robot's order."""
    free = set(fit.free.names)
    rows = []
    for p in fit.robot.parameters.values():
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


@dataclass(frozen=True)
class Pair:
    """Two parameters and their correlation."""

    first: str
    second: str
    correlation: float


def strongest_pairs(fit: Fit) -> tuple[Pair, ...]:
    """Return the most strongly correlated pairs of free parameters, strongest first."""
    names, r = fit.free.names, fit.correlations
    rows, columns = np.triu_indices(len(names), 1)
    order = np.argsort(-abs(r[rows, columns]), kind="stable")[:_PAIRS]
    return tuple(Pair(names[i], names[j], float(r[i, j])) for i, j in zip(rows[order], columns[order], strict=True))


@dataclass(frozen=True)
class NoiseRow:
    """Standard deviation of one kind of reading."""

    kind: str
    per: str
    unit: str
    value: float

    @property
    def text(self) -> str:
        """The deviation as it is printed."""
        return significant(self.value, 3, 5)


def noise_rows(fit: Fit) -> Sequence[NoiseRow]:
    """Return the deviation of a reading for each kind of observation."""
    return [
        NoiseRow(kind, _PER[kind], _SIGMA_SHOWN[kind][0], sigma * _SIGMA_SHOWN[kind][1])
        for kind, sigma in fit.sigma.items()
    ]


def noise_sentence(fit: Fit) -> str:
    """Say what the residuals tell about the noise, and about what the readings of a configuration share."""
    sentences = [_noise(fit)]
    shared = joint_error_text(fit)
    if shared:
        sentences.append(
            f"All readings of a configuration share an error of the joints, of {shared} each: repeatability plus what "
            "the model leaves."
        )
    if fit.scattered:
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
    found: dict[str, int] = {}
    for row in rows:
        found[row.status] = found.get(row.status, 0) + 1
    words = {"at bound": "stopped at a bound", "held: redundant": "held because they are redundant"}
    sentence = ", ".join(f"{count} {words.get(status, status)}" for status, count in found.items())
    return f"{sentence}."
