"""Single configurations that are off, and by what: a joint that was read or moved wrong, or one target.

A configuration that is left out moves the fit. What its readings are off then by, near the solution, follows from the
residuals and the share that the free parameters take of them, without another fit (mean-shift outliers: Cook and
Weisberg 1982, "Residuals and Influence in Regression", section 2.2.2). The worst configuration is left out first, then
the worst of the rest, because several of them hide each other. What the readings are off by is held against an error of
one joint (:func:`wrong_joint`), which moves all targets of the configuration together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.diagnose.unmodelled import LeftOver
from truearm.engine.robot.chain import Array

# Which joint was written down wrong at one configuration, by turning the joints one by one through all they can.
#
# A wrong sign turns a joint by so much that straight lines tell nothing: another joint whose line happens to lead the
# same way would be blamed. So the readings are predicted anew at each position that a joint may have had.

#: An error of one joint explains the readings of a configuration if it leaves less than so many times what other
#: configurations leave, or less than this share of the squares.
_AS_WELL: Final = 9.0
_EXPLAINED: Final = 1e-4
#: How much likelier one joint must be than each other one: a thousand times, as twice the logarithm.
_CLEARLY: Final = 2.0 * math.log(1e3)
#: Share of the squares that is left at most where a joint can be met by chance: by three numbers, or by its sign.
_BY_CHANCE: Final = 0.0025
_FEW_NUMBERS: Final = 3
#: Positions tried on a turn, and steps of Gauss and Newton from the best of them, each with so small a difference
#: [rad or m].
_TRIED: Final = 36
_STEPS: Final = 6
_DIFFERENCE: Final = 1e-6


@dataclass(frozen=True)
class WrongJoint:
    """A joint whose position alone explains the readings of a configuration."""

    number: int  #: From 1.
    error: float  #: What it was read too large by [rad or m].
    sign: bool  #: Whether its sign was wrong.


def wrong_joint(left: LeftOver, index: int, shift: Array, scale: float) -> WrongJoint | None:
    """Return the joint that explains what a configuration is off by, clearly better than each other joint does.

    Args:
        index: Of the configuration.
        shift: What its equations are off by from a fit without it, ``(equations,)``.
        scale: Mean square of what the other configurations leave.
    """
    total = float(shift @ shift)
    trials = _Trials(left, index, shift)
    moved = trials.nearest()
    residuals, signs = trials.residual_square(moved), trials.residual_square(-2.0 * trials.noted)
    usual = _AS_WELL * max(scale, 1e-300)
    noise = max(usual * len(shift), _EXPLAINED * total)
    by_chance = _BY_CHANCE * total
    best = int(np.argmin(signs))
    if signs[best] <= min(noise, by_chance) and _clearly(signs, best, usual, len(shift)):
        return WrongJoint(best + 1, 2.0 * float(trials.noted[best]), sign=True)
    best = int(np.argmin(residuals))
    allowed = min(noise, by_chance) if len(shift) <= _FEW_NUMBERS else noise
    if residuals[best] > allowed or not _clearly(residuals, best, usual, len(shift)):
        return None
    return WrongJoint(best + 1, -float(moved[best]), sign=False)


def _clearly(residuals: Array, best: int, usual: float, equations: int) -> bool:
    """Return whether the best explanation is so much likelier than each other one."""
    others = np.delete(residuals, best)
    square = max(usual, float(residuals[best]) / equations)
    return not len(others) or float(others.min() - residuals[best]) > _CLEARLY * square


class _Trials:
    """The equations of one configuration, with its joints elsewhere.

    Attributes:
        noted: Joint positions as they were noted: the controller's where they came as such, ``(joints,)``.
    """

    def __init__(self, left: LeftOver, index: int, shift: Array) -> None:
        self._left, self._shift = left, shift
        self._one = replace(left.problem.data, references=None).of_configurations([index])
        self._vector = np.array([left.fit.robot.values[name] for name in left.fit.free.names])
        joints = self._one.joints
        self._as_noted = self._one.joints_are == "converted"
        self.noted = left.fit.robot.controller.from_model(joints)[0] if self._as_noted else joints[0]
        self._as_given = self._equations(self.noted[None])[0]

    def residual_square(self, moved: Array) -> Array:
        """Return the sum of squares that is left with each joint moved by so much, ``(joints,)``.

        Args:
            moved: [rad or m], ``(joints,)``.
        """
        return np.asarray(np.sum(self._left_by(np.arange(len(moved)), moved) ** 2, axis=1))

    def nearest(self) -> Array:
        """Return how far each joint alone must be moved for what fits best [rad or m], ``(joints,)``."""
        kinds = self._left.problem.data.joint_kinds
        joints = np.arange(len(self.noted))
        around = np.arange(_TRIED) * (2.0 * math.pi / _TRIED)
        around[around > math.pi] -= 2.0 * math.pi
        turning = np.flatnonzero([kind == "revolute" for kind in kinds])
        moved = np.zeros(len(joints))
        if len(turning):
            r = self._left_by(np.repeat(turning, _TRIED), np.tile(around, len(turning)))
            moved[turning] = around[np.argmin(np.sum(r**2, axis=1).reshape(len(turning), _TRIED), axis=1)]
        best, least = moved, self.residual_square(moved)
        for _ in range(_STEPS):
            r = self._left_by(np.tile(joints, 2), np.concatenate([moved, moved + _DIFFERENCE]))
            value, slope = r[: len(joints)], (r[len(joints) :] - r[: len(joints)]) / _DIFFERENCE
            size = np.maximum(np.sum(slope**2, axis=1), 1e-300)
            moved = moved - np.where(size > 1e-300, np.sum(slope * value, axis=1) / size, 0.0)
            moved = np.where(np.abs(moved - best) < 1.0, moved, best)
            squares = self.residual_square(moved)
            best, least = np.where(squares < least, moved, best), np.minimum(squares, least)
        return best

    def _left_by(self, joints: NDArray[np.intp], moved: Array) -> Array:
        """Return what is left with one joint elsewhere, trial by trial, ``(trials, equations)``."""
        noted = np.tile(self.noted, (len(moved), 1))
        noted[np.arange(len(moved)), joints] += moved
        return np.asarray(self._shift + self._equations(noted) - self._as_given)

    def _equations(self, noted: Array) -> Array:
        """Return the equations of the configuration at other joint positions, ``(trials, equations)``."""
        problem = self._left.problem
        joints = self._left.fit.robot.controller.to_model(noted) if self._as_noted else noted
        data = self._one.of_configurations(np.zeros(len(noted), dtype=np.intp))
        problem = replace(problem, data=replace(data, joints=joints))
        configurations = [np.repeat(data.configuration[b.readings], b.observation.components) for b in problem.blocks]
        order = np.argsort(np.concatenate(configurations), kind="stable")
        return np.asarray(problem.residual(self._vector)[order].reshape(len(noted), -1))


#: Mean squares of a configuration, over those of the rest, from which it is off: six times as far as the others are.
_LEAST_RATIO: Final = 36.0
#: Configurations measured one after the other that are a part of the campaign and no single ones.
_LEAST_PART: Final = 3
#: Share of the squares that one target holds where it alone is off.
_ONE_TARGET: Final = 0.99
#: Largest share of the configurations that can be off one by one; where more are, something else is wrong.
_LARGEST_SHARE: Final = 0.1
#: Configurations looked at in each round, those with the largest residuals.
_LOOKED_AT: Final = 8
#: Equations beyond the parameters without which nothing is said, and as a share of the parameters.
_LEAST_FREEDOM: Final = 10
_LEAST_SHARE_OF_PARAMETERS: Final = 0.5


@dataclass(frozen=True)
class OffConfiguration:
    """A configuration whose readings are far from those of a fit without it."""

    index: int  #: In the dataset.
    #: The joint whose position alone explains the readings, clearly better than each other one; None if none does.
    joint: WrongJoint | None
    target: str  #: Name of the target that alone is off; empty if several are.
    #: How far the positions of its targets are off [m], root mean square, or that of the one target; of distances and
    #: heights likewise.
    distance: float


@dataclass(frozen=True, eq=False)
class _Rows:
    """What a fit leaves, row by row, in the order of the configurations."""

    #: residual, basis: without what the free parameters can take ``(rows,)``, and directions that they can take
    #: ``(rows, rank)``.
    residual: Array
    basis: Array
    sigma: Array  #: Standard deviation of each row [m], zero for angles, ``(rows,)``.
    target: NDArray[np.intp]  #: Index of the block that each row is of, ``(rows,)``.
    of: tuple[slice, ...]  #: Rows of each configuration.


@dataclass(frozen=True)
class Off:
    """The configurations that are off one by one."""

    configurations: tuple[OffConfiguration, ...] = ()  #: The worst first.
    #: What the fit leaves without them, over what it leaves with them: mean of the configurations' root mean squares.
    left: float = 1.0
    in_a_row: bool = False  #: Whether they were measured one after the other, so that something moved meanwhile.

    @property
    def indices(self) -> tuple[int, ...]:
        """Which they are, in the dataset."""
        return tuple(off.index for off in self.configurations)


def off_configurations(left: LeftOver) -> Off:
    """Return the configurations that are off one by one; none where too many look like that."""
    n = left.problem.data.configurations
    if left.freedom < max(_LEAST_FREEDOM, _LEAST_SHARE_OF_PARAMETERS * left.basis.shape[1]):
        return Off()
    rows = _in_order(left)
    out: list[int] = []
    most = max(1, math.floor(_LARGEST_SHARE * n))
    shift, scale = np.zeros(0), 0.0
    while True:
        taken = _rows_of(rows, out)
        residual = rows.residual.copy()
        if len(taken):
            shift = _shift(rows, taken)
            residual += rows.basis @ (rows.basis[taken].T @ shift)
            residual[taken] = 0.0
        worst, scale = _worst(rows, residual, out, taken)
        if worst is None:
            break
        if len(out) == most:
            return Off()
        out.append(worst)
    if not out:
        return Off()
    first, described = 0, []
    for index in out:
        span = rows.of[index]
        size = span.stop - span.start
        described.append(_described(left, rows, index, shift[first : first + size], scale))
        first += size
    before = _mean(rows, rows.residual, [])
    worst_first = sorted(described, key=lambda off: -off.distance)
    return Off(tuple(worst_first), _mean(rows, residual, out) / before if before else 1.0, _in_a_row(left, out))


def _in_a_row(left: LeftOver, out: list[int]) -> bool:
    """Return whether configurations were measured one after the other."""
    number = left.problem.data.number
    if number is None or len(out) < _LEAST_PART:
        return False
    place = np.argsort(np.argsort(number, kind="stable"))[out]
    return int(np.ptp(place)) == len(out) - 1


def _mean(rows: _Rows, residual: Array, without: list[int]) -> float:
    """Return the mean root mean square of the configurations."""
    parts = [residual[part] for c, part in enumerate(rows.of) if c not in without and part.stop > part.start]
    return float(np.mean([math.sqrt(float(part @ part) / len(part)) for part in parts])) if parts else 0.0


def _in_order(left: LeftOver) -> _Rows:
    """Sort the equations by configuration."""
    configuration = left.configuration
    order = np.argsort(configuration, kind="stable")
    blocks = left.problem.blocks
    sigma = np.concatenate(
        [np.repeat(b.sigma if b.observation.unit == "m" else 0.0 * b.sigma, b.observation.components) for b in blocks]
    )
    names = list(dict.fromkeys(b.target for b in blocks))
    target = np.concatenate([np.full(b.rows, names.index(b.target)) for b in blocks])
    edges = np.searchsorted(configuration[order], np.arange(left.problem.data.configurations + 1))
    return _Rows(
        left.without_parameters(left.residual)[order],
        left.basis[order],
        sigma[order],
        target[order],
        tuple(slice(a, b) for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)),
    )


def _rows_of(rows: _Rows, configurations: list[int]) -> NDArray[np.intp]:
    """Return the rows of some configurations, in the order of these."""
    parts = [np.arange(rows.of[c].start, rows.of[c].stop) for c in configurations]
    return np.concatenate(parts) if parts else np.zeros(0, np.intp)


def _shift(rows: _Rows, taken: NDArray[np.intp]) -> Array:
    """Return what rows are off by from a fit without them, ``(taken,)``."""
    Q = rows.basis[taken]
    return np.asarray(np.linalg.lstsq(np.eye(len(taken)) - Q @ Q.T, rows.residual[taken], rcond=1e-8)[0])


def _worst(rows: _Rows, residual: Array, out: list[int], taken: NDArray[np.intp]) -> tuple[int | None, float]:
    """Return the configuration that is off most, None if none is, and the mean square of what the others leave.

    Args:
        residual: What the fit without `taken` leaves, ``(rows,)``.
    """
    edges = np.array([part.start for part in rows.of])
    count = np.array([part.stop - part.start for part in rows.of])
    read = np.flatnonzero(count)
    squares = np.zeros(len(rows.of))
    squares[read] = np.add.reduceat(residual**2, edges[read])
    squares[out] = 0.0
    freedom = len(residual) - len(taken) - rows.basis.shape[1]
    others = np.setdiff1d(read, out)
    if freedom < _LEAST_FREEDOM or len(others) < 2:
        return None, 0.0
    total = float(squares.sum())
    spread = (len(residual) - len(taken)) / freedom
    usual = float(np.median(squares[others] / count[others])) * spread
    remaining = np.delete(rows.basis, taken, axis=0) if len(taken) else rows.basis
    inside = np.linalg.inv(remaining.T @ remaining) if len(taken) and len(remaining) > remaining.shape[1] else None
    best, ratio, left = None, 0.0, total / freedom
    for c in others[np.argsort(-squares[others] / count[others])][:_LOOKED_AT].tolist():
        span = rows.of[c]
        Q = rows.basis[span]
        hat = Q @ Q.T if inside is None else Q @ inside @ Q.T
        size = int(count[c])
        explained = float(residual[span] @ np.linalg.lstsq(np.eye(size) - hat, residual[span], rcond=1e-8)[0])
        unexplained = min(max(total - explained, 0.0) / max(freedom - size, 1), usual)
        if explained / size > ratio * max(unexplained, 1e-300):
            best, ratio = c, explained / size / max(unexplained, 1e-300)
    return (best if ratio > _LEAST_RATIO else None), left


def _described(left: LeftOver, rows: _Rows, index: int, shift: Array, scale: float) -> OffConfiguration:
    """Say what a configuration is off by.

    Args:
        shift: What its rows are off by from a fit without it, ``(rows of it,)``.
        scale: Mean square of what the other configurations leave.
    """
    span = rows.of[index]
    sigma, total = rows.sigma[span], float(shift @ shift)
    by_target = np.bincount(rows.target[span], shift**2)
    several = np.count_nonzero(by_target) > 1
    alone = int(np.argmax(by_target)) if several and by_target.max() > _ONE_TARGET * total else None
    names = list(dict.fromkeys(block.target for block in left.problem.blocks))
    counted = sigma > 0.0 if alone is None else (sigma > 0.0) & (rows.target[span] == alone)
    lengths = (shift * sigma)[counted]
    seen = max(len(np.unique(rows.target[span][counted])), 1)
    return OffConfiguration(
        index,
        wrong_joint(left, index, shift, scale) if alone is None else None,
        "" if alone is None else names[alone],
        math.sqrt(float(lengths @ lengths) / seen),
    )
