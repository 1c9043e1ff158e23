"""What limits the accuracy: the mean square of the errors, parted by where it comes from.

Errors of independent sources add up in squares. The square of a reading's error at a configuration that the fit has not
seen is, on average, the variance of the instrument, what removing the table's motion leaves, the scatter with which the
robot comes back, what the model cannot express, and what errors of the parameters do there.

The last is ``tr(A C A')`` with the derivative A of the readings by the parameters and their covariance C. What the
model cannot express is estimated from the training part alone: least squares leave ``V - A C A'`` of the covariance V
of the readings (Seber and Lee 2003, section 3.3; with priors, where these hold), so the residuals' mean square and what
the parameters have taken of it add up to V, less what the instrument, the table and the return of the robot make. So
all shares are known without the held-out errors, and what these are larger or smaller by is a remainder of its own.

That holds for the covariance with the priors that the estimate was made with. Where the data tell how large effects
are, the covariance of the fit is wider, for they may be larger than was found; so C is then made anew.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import OBSERVATIONS, Position
from truearm.engine.data.statistics import TableMotion, table_motion
from truearm.engine.diagnose.expected_error import ExpectedError
from truearm.engine.diagnose.gain import repeatability
from truearm.engine.diagnose.position_errors import PositionErrors, covariance_root, uncertain_names
from truearm.engine.fit.fit import Fit
from truearm.engine.fit.likelihood import Visits, Whitening
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.variance_components import CovariancePart
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import FreeParameters

Source = Literal["instrument", "table", "repeatability", "model", "parameters", "remainder"]

#: Configurations and draws by which the squares over the workspace are averaged.
_CONFIGURATIONS: Final = 100
_DRAWS: Final = 200
#: Standard deviations within which a difference is chance.
_CHANCE: Final = 3.0
_LENGTHS: Final = ("distance", "height")


@dataclass(frozen=True)
class Share:
    """What one source adds to the mean square of the errors."""

    source: Source  #: Which.
    #: Mean square [m^2]; negative where a difference of estimates came out so; None where it was not measured.
    square: float | None
    deviation: float  #: Standard deviation of the square [m^2].
    words: str  #: What it was estimated from, what it may hold besides, or why it is not known.
    apparent: bool = False  #: Whether it is the scatter of readings whose deviations were not declared.

    @property
    def rms(self) -> float | None:
        """Root of the square with its sign [m]."""
        return None if self.square is None else math.copysign(math.sqrt(abs(self.square)), self.square)


@dataclass(frozen=True)
class ErrorBudget:
    """The mean square of the errors of a calibrated robot by its sources."""

    #: Whether it is that of held-out readings; else it is what readings at configurations like the training ones let
    #: expect, and there is no remainder.
    held_out: bool
    kind: Literal["position", "length"]  #: Of readings: ``position``, or ``length`` where no position was read.
    square: float  #: Mean square of the errors [m^2]: the sum of all shares.
    deviation: float  #: Standard deviation of it, by the scatter of the configurations [m^2].
    readings: int  #: readings, configurations: how many were judged.
    configurations: int
    shares: tuple[Share, ...]  #: What each source adds to it.
    #: Shares of the mean square to expect over the whole workspace, without the noise of a reading; None if it cannot
    #: be told.
    workspace: tuple[Share, ...] | None
    #: Root mean square by which the table's motion moved the readings before it was taken out of them [m]; None where
    #: it was not measured.
    removed: float | None

    @property
    def rms(self) -> float:
        """Root mean square error [m]."""
        return math.sqrt(max(self.square, 0.0))

    @property
    def remainder_is_chance(self) -> bool:
        """Whether the remainder lies within three of its standard deviations."""
        remainder = self.share("remainder")
        return abs(remainder.square or 0.0) <= _CHANCE * remainder.deviation

    def share(self, source: Source) -> Share:
        """Return what a source adds."""
        return next(share for share in self.shares if share.source == source)


@dataclass(frozen=True, eq=False)
class _Part:
    """Readings of a part of the data that are compared, in metres."""

    error: Array  #: error, variance: of each equation [m], and its variance by the instrument [m^2], ``(rows,)``.
    variance: Array
    derivative: Array  #: By the uncertain parameters, ``(rows, parameters)``.
    configuration: Array  #: Of each equation, ``(rows,)``.
    readings: int  #: How many.
    declared: bool  #: Whether all deviations are declared.

    @property
    def square(self) -> float:
        """Mean square over the readings."""
        return float(self.error @ self.error) / self.readings

    @property
    def noise(self) -> float:
        """Mean square that the instrument makes."""
        return float(self.variance.sum()) / self.readings

    @property
    def scatter(self) -> float:
        """Standard deviation of the mean square, by the scatter of the configurations."""
        at = np.unique(self.configuration, return_inverse=True)[1]
        count = int(at.max()) + 1
        if count < 2:
            return self.square
        sums = np.bincount(at, self.error**2 - self.square * self.readings / len(self.error))
        return math.sqrt(count / (count - 1) * float(sums @ sums)) / self.readings

    def moved(self, root: Array) -> tuple[float, float]:
        """Return the mean square of what errors of the parameters do, and its standard deviation.

        Args:
            root: Of the covariance of the parameters, ``(parameters, k)``.
        """
        moved = self.derivative @ root
        value = np.linalg.eigvalsh(moved.T @ moved) / self.readings
        return float(value.sum()), math.sqrt(2.0 * float(value @ value))


def error_budget(
    fit: Fit, data: Dataset, training: Dataset, held_out: Dataset | None, expected: ExpectedError | None = None
) -> ErrorBudget | None:
    """Return what limits the accuracy of a calibrated robot; None if there is nothing to compare.

    Args:
        data: All readings, the table's motion taken out.
        training: What the fit was made from.
        held_out: What it is judged by; None if nothing was held out.
        expected: The error to expect over the workspace.
    """
    kind: Literal["position", "length"] = "position" if Position().present(training).any() else "length"
    over_workspace = None if expected is None else _over_workspace(fit, expected)
    if fit.model.weighed and fit.loss == "linear":
        fit = _with_sizes_as_found(fit, training)
    seen = _part(fit, training, kind)
    judged = seen if held_out is None else _part(fit, held_out, kind)
    if seen is None or judged is None:
        return None
    covariance = np.sum([part.covariance for part in fit.covariance_parts], axis=0)
    root = covariance_root(fit, covariance)
    taken, _ = seen.moved(covariance_root(fit, covariance, with_fixed=False))
    moved, moved_deviation = judged.moved(root)
    moved_deviation = math.hypot(moved_deviation, *_of_variances(fit, judged))
    table = table_motion(data)
    left = 0.0 if table is None else table.left
    again = repeatability(data, fit.sigma.get("position", 0.0)) if kind == "position" else None
    returned = 0.0 if again is None else again.square
    beyond = seen.square + taken - seen.noise - left - returned
    shares = [
        Share(
            "instrument",
            judged.noise,
            _noise_deviation(fit, seen, judged),
            _instrument_words(fit, judged),
            apparent=not fit.declared,
        ),
        _table_share(table, kind),
        Share("repeatability", None, 0.0, "no posture was visited again: it is in what the model cannot express")
        if again is None
        else Share(
            "repeatability",
            again.square,
            again.deviation,
            f"scatter of {again.visits} visits to {again.postures} postures, without the instrument's noise",
        ),
        Share(
            "model",
            beyond,
            math.hypot(_scatter_of_all(fit, seen, taken), 0.0 if again is None else again.deviation),
            "",
        ),
        Share(
            "parameters",
            moved,
            moved_deviation,
            "from their covariance; the deviation says how far single robots lie from the average",
        ),
    ]
    shares[3] = replace(shares[3], words=_model_words(fit, shares[3], again is not None, seen))
    total = math.fsum(share.square for share in shares if share.square is not None)
    square, deviation = total, seen.scatter
    if held_out is not None:
        square, deviation = judged.square, judged.scatter
        doubt = math.hypot(deviation, *(share.deviation for share in shares))
        shares.append(Share("remainder", square - total, doubt, _remainder_words(square - total, doubt)))
    return ErrorBudget(
        held_out is not None,
        kind,
        square,
        deviation,
        judged.readings,
        len(np.unique(judged.configuration)),
        tuple(shares),
        over_workspace,
        None if table is None else table.removed,
    )


def _with_sizes_as_found(fit: Fit, training: Dataset) -> Fit:
    """Return a fit whose covariance takes every effect for as large as it was found to be."""
    noise = {observation.name: fit.sigma.get(observation.name, 1.0) for observation in OBSERVATIONS}
    problem = Problem(fit.robot, training, fit.free, noise, widened=fit.excess)
    evaluation = problem.at(np.array([fit.robot.values[name] for name in fit.free.names]))
    whitening = Whitening(Visits(problem.visits), evaluation.by_joints * fit.joint_error)
    information = np.eye(len(fit.free.names))
    for rows, part in evaluation.portions():
        J = whitening.of(rows).applied(part.jacobian * fit.free.prior)
        information += J.T @ J
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    alone = CovariancePart(covariance, math.inf).scaled(fit.free.prior)
    return replace(fit, covariance_parts=(alone,), unfitted=())


def _part(fit: Fit, data: Dataset, kind: str) -> _Part | None:
    """Return the readings of one kind with what the uncertain parameters do to them."""
    noise = {observation.name: fit.sigma.get(observation.name, 1.0) for observation in OBSERVATIONS}
    free = FreeParameters(tuple(fit.robot.parameters[name] for name in uncertain_names(fit)))
    problem = Problem(fit.robot, replace(data, setup=None), free, noise)
    evaluation = problem.at(free.start)
    wanted = ("position",) if kind == "position" else _LENGTHS
    rows, sigmas, configurations, declared, first, readings = [], [], [], True, 0, 0
    for block in problem.blocks:
        if block.observation.name in wanted:
            rows.append(np.arange(first, first + block.rows))
            sigmas.append(np.repeat(block.sigma, block.observation.components))
            configurations.append(np.repeat(data.configuration[block.readings], block.observation.components))
            declared, readings = declared and block.declared, readings + len(block.readings)
        first += block.rows
    if not readings:
        return None
    row, sigma = np.concatenate(rows), np.concatenate(sigmas)
    J = evaluation.jacobian[row] * sigma[:, None]
    return _Part(evaluation.residual[row] * sigma, sigma**2, J, np.concatenate(configurations), readings, declared)


def _noise_deviation(fit: Fit, seen: _Part, judged: _Part) -> float:
    """Return the standard deviation of the share of the instrument, by the equations behind an estimated one."""
    if judged.declared:
        return 0.0
    spent = sum(fit.robot.parameters[name].informed or 0.0 for name in fit.free.names)
    return judged.noise * math.sqrt(2.0 / max(len(seen.error) - spent, 1.0))


def _scatter_of_all(fit: Fit, seen: _Part, taken: float) -> float:
    """Return the standard deviation of the training residuals' mean square with what the parameters have taken of it.

    The residuals are of as many equations less, and where the variances were estimated from them, so is what was taken.
    """
    known = seen.declared and fit.excess == 1.0 and not fit.joint_error.any() and not fit.scattered
    return seen.scatter * math.pow(1.0 + taken / max(seen.square, 1e-30), 0.5 if known else 1.5)


def _of_variances(fit: Fit, judged: _Part) -> Iterator[float]:
    """Yield what the share of the parameters is uncertain by for each variance that was estimated."""
    for part in fit.covariance_parts:
        yield judged.moved(covariance_root(fit, part.covariance, with_fixed=False))[0] * math.sqrt(2.0 / part.freedom)


def _instrument_words(fit: Fit, judged: _Part) -> str:
    if judged.declared:
        return "as the data declare it"
    shared = ", except for what the readings of a configuration share" if fit.joint_error.any() else ""
    return f"estimated from the residuals: what the model cannot express is in it{shared}"


def _table_share(table: TableMotion | None, kind: str) -> Share:
    if table is None or kind != "position":
        return Share(
            "table", None, 0.0, "no three reference points were measured: it is in what the model cannot express"
        )
    return Share(
        "table",
        table.left,
        table.left * math.sqrt(2.0 / max(table.freedom, 1)),
        f"left by the noise of the reference points after a motion of {table.removed * 1e3:.2g} mm was taken out",
    )


def _model_words(fit: Fit, share: Share, visited: bool, seen: _Part) -> str:
    """Say what the share of the model holds besides, or why it is negative."""
    if share.square is not None and share.square < 0.0:
        if -share.square <= _CHANCE * share.deviation:
            return "negative within its uncertainty: the training residuals show nothing that the model lacks"
        if seen.declared:
            return (
                "negative: the training residuals are smaller than the declared deviations of the readings let expect"
            )
        return "negative: the priors, or a robust loss, leave smaller residuals than their covariance lets expect"
    words = "from the training residuals, with what the parameters have taken of them"
    return words if visited else f"{words}; how well the robot comes back to a posture is in it"


def _remainder_words(square: float, doubt: float) -> str:
    if abs(square) <= _CHANCE * doubt:
        return "within the uncertainty of the shares and of the held-out mean"
    if square > 0.0:
        return "not explained: the robot errs more at the held-out configurations than the training part lets expect"
    return "negative, not explained: the robot errs less at the held-out configurations than the training part says"


def _over_workspace(fit: Fit, expected: ExpectedError) -> tuple[Share, ...]:
    """Return the shares of the mean square to expect over the workspace."""
    plain = replace(fit, joint_error=np.zeros_like(fit.joint_error))
    approach = ", and the direction of approach" * bool((expected.joint_error > 1.001 * fit.joint_error).any())
    joints = fit.robot.random_configurations(_CONFIGURATIONS, np.random.default_rng(0))
    squares = np.mean(PositionErrors(plain, _DRAWS).at(joints) ** 2, axis=(1, 2))
    return (
        Share("parameters", float(squares.mean()), float(squares.std(ddof=1)), "from their covariance"),
        Share(
            "model",
            expected.by_joint_error**2,
            0.0,
            "errors of the joints that the readings of a configuration share: what the model cannot express, and "
            f"repeatability{approach}",
        ),
    )


def shown_shares(shares: Sequence[Share]) -> list[Share]:
    """Return the shares that were measured, in their order."""
    return [share for share in shares if share.square is not None]
