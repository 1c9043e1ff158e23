"""How large each joint effect is expected to be, found from the data, and what the parameters are off by then.

The parameters of an effect of a joint are a group: normal, of mean zero, with one variance. So are the coefficients of
a joint's curve, band by band. The variances that make the residuals likeliest are taken, the parameters of the arm
integrated out under their own priors (MacKay 1992, "Bayesian interpolation"; automatic relevance determination). What
the data do not support shrinks to nothing by itself.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from truearm.engine.fit.likelihood import Visits, Whitening, lower_inverse
from truearm.engine.fit.problem import NOISE_FLOOR, Problem
from truearm.engine.fit.variance_components import CovariancePart
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.compliance import Compliance
from truearm.engine.robot.effects.joint_curve import HIGHEST, JointCurve
from truearm.engine.robot.effects.warm_up import RATE
from truearm.engine.robot.parameters import FreeParameters, Parameter

# With a group of m parameters w of variance v, the data know ``g`` of them, 0 to m, so that the likelihood has its
# maximum where ``v = w'w / g``. The deviation of a group is believed to be as likely at every order of magnitude below
# a scale, and less and less beyond, as one of a half Cauchy distribution. The scale is what would make all effects
# together explain what the arm alone leaves, each its share.
#
# Curves of the joints join in when the other effects, the noise and the errors of the joints by visit have their sizes,
# which stay while they do. From few readings curves of many periods look like such errors, and would take their place.
#
#: Scale of the deviations of groups, by what would make all groups together explain what is left over.
_SCALE: Final = 0.3
#: Parameters that what is believed of a variance beforehand counts for.
_SPARSE: Final = 2.0
#: Information of the readings on a group that is none, and what its variance is then multiplied by in a step.
_NOTHING: Final = 0.02
_FADING: Final = 0.03
#: Deviation from which a group starts again, at least, by what it is expected to be about.
_AGAIN: Final = 0.1
#: Deviation of a group by the prior of its parameters: at least and at most. A curve may be of 0.1 rad.
_LEAST: Final = 1e-3
_MOST: Final = 3.0
_MOST_OF_CURVES: Final = 1e3
#: Gain in log-likelihood from which the curve of a joint is believed. A robot has six, of ten or twenty bands.
_SIGNIFICANT: Final = 8.0
_STEPS: Final = 60
_SETTLED: Final = 0.02
#: First periods in a turn of the bands of a curve. A gear makes a few lines: a wide band would shrink them with the
#: rest, and few readings do not tell narrow ones.
BANDS: Final = (1, *range(3, HIGHEST, 3))
#: Rounds before curves join in, where other effects have sizes too.
_BEFORE_CURVES: Final = 2
#: Deviation of readings in sums of products at least [m, rad]: of smaller ones rounding is larger than what the priors
#: know.
_SUMMED_FLOOR: Final = 1e-7
#: Equations whose products are summed at once.
_AT_ONCE: Final = 3000


@dataclass(frozen=True, eq=False)
class Sizes:
    """The groups of a model, and how large their parameters are expected to be."""

    #: Names of the parameters of each group.
    groups: Mapping[tuple[str, ...], tuple[str, ...]] = field(default_factory=dict)
    priors: Mapping[str, float] = field(default_factory=dict)  #: Of these parameters, beforehand [SI].
    curves: Mapping[str, int] = field(default_factory=dict)  #: Joint (from 0) of each coefficient of curves.
    before_curves: int = 0  #: Rounds until curves join in; below zero when they have.
    #: Deviation of each group by the prior of its parameters, in the order of `groups`.
    deviation: Array = field(default_factory=lambda: np.zeros(0))
    #: What the deviations are expected to be about, in the same units; zero of a group that is not looked at yet.
    scale: Array = field(default_factory=lambda: np.zeros(0))

    def __bool__(self) -> bool:
        return bool(self.groups)

    @classmethod
    def of(cls, problem: Problem, *, every: bool, near: Sizes | None = None) -> Self:
        """Return the groups of a problem.

        Args:
            every: Whether those of all effects, or curves of the joints alone.
            near: Those of a problem with fewer parameters, whose sizes are known.
        """
        effects = problem.robot.effects
        pooled = {effect.name for effect in effects if effect.stretches}
        own = {effect.name for effect in effects} - {JointCurve.name, Compliance.name} if every else set()
        curve = {
            name: (joint, number // 2 + 1)
            for effect in effects
            if isinstance(effect, JointCurve)
            for joint, names in effect.terms.items()
            for number, name in enumerate(names)
        }
        groups: dict[tuple[str, ...], list[Parameter]] = {}
        for p in problem.free.parameters:
            if p.name in curve:
                band = str(np.searchsorted(BANDS, curve[p.name][1], side="right"))
                groups.setdefault((p.group, p.unit, str(curve[p.name][0] + 1), band), []).append(p)
            elif p.group in own and p.name != RATE:
                joint = "" if p.group in pooled else re.sub(r".*_", "", p.name)
                groups.setdefault((p.group, p.unit, joint), []).append(p)
        graded = [p for members in groups.values() for p in members]
        curves = {p.name: curve[p.name][0] for p in graded if p.name in curve}
        wait = (_BEFORE_CURVES if every else 0) if curves else -1
        begin = {key: (_LEAST if key[0] == JointCurve.name else 1.0, 0.0) for key in groups}
        if near is not None:
            begin |= dict(zip(near.groups, zip(near.deviation, near.scale, strict=True), strict=True))
        deviation, scale = np.array([begin[key] for key in groups]).reshape(-1, 2).T
        return cls(
            {key: tuple(p.name for p in members) for key, members in groups.items()},
            {p.name: p.prior for p in graded},
            curves,
            near.before_curves if near else wait,
            deviation,
            scale,
        )

    @cached_property
    def place(self) -> Mapping[str, int]:
        """Index of the group of each parameter."""
        return {name: k for k, names in enumerate(self.groups.values()) for name in names}

    def fitted(self, every: FreeParameters) -> FreeParameters:
        """Return the parameters that are fitted: all but those of groups that shrank to nothing, each with its size."""
        fitted = (p for p in every.parameters if p.name not in self.place or self._deviation_of(p) > _LEAST)
        return FreeParameters(tuple(self.sized(p) for p in fitted))

    def sized(self, parameter: Parameter) -> Parameter:
        """Return a parameter with the deviation of its group as its prior."""
        if parameter.name not in self.place:
            return parameter
        return replace(parameter, prior=self.priors[parameter.name] * self._deviation_of(parameter))

    def _deviation_of(self, parameter: Parameter) -> float:
        return float(self.deviation[self.place[parameter.name]])


def with_sizes(
    problem: Problem, every: FreeParameters, sizes: Sizes, joints: Array, weight: Array, crowd: float
) -> tuple[Problem, Sizes, float, Array]:
    """Return a problem whose effects have the sizes that the data tell, and with the curves that they tell of.

    Args:
        problem: At a solution, whose values its free parameters have.
        every: All parameters that the model frees, in their order.
        sizes: What was found before.
        joints: Variances of the joints' errors that readings are weighed by.
        weight: What the loss leaves of each reading.
        crowd: How many readings say as much as one, where something that they share explains none of how they hang
            together.

    Returns:
        problem, sizes, change: The largest relative change of a deviation that matters.
        joints: Their variances with the effects.
    """
    looking = sizes.before_curves == 0  # at all bands of the curves
    fitted = set(problem.free.names)
    aside = [
        problem.robot.parameters[name]
        for name in sizes.place
        if name not in fitted and (looking or name not in sizes.curves)
    ]
    parameters = (*problem.free.parameters, *aside)
    graded = np.array([p.name in sizes.place for p in parameters])
    own = [p for p in parameters if p.name in sizes.place]
    group = np.array([sizes.place[p.name] for p in own], dtype=np.intp)
    rows, moments = _moments_of_graded(problem, parameters, graded, joints, weight)
    scale = np.append([sizes.priors[p.name] / p.prior for p in own], 1.0)
    moments = moments * np.outer(scale, scale)  # per prior beforehand
    count = len(sizes.groups)
    present = np.bincount(group, minlength=count) > 0
    of_curves = np.array([key[0] == JointCurve.name for key in sizes.groups], dtype=bool)
    most = np.where(of_curves, _MOST_OF_CURVES, _MOST)
    first = present & (sizes.scale == 0.0)
    if first.any():
        sizes = replace(
            sizes, scale=np.where(first, _scale_of(moments, group, first, sizes.deviation, most), sizes.scale)
        )
    start = np.where(first, sizes.scale, np.maximum(sizes.deviation, _AGAIN * sizes.scale))  # nothing may come back
    start = np.where(present, start, _LEAST)
    declared = any(block.declared for block in problem.blocks)
    within = (problem.widened**-2, 1.0) if declared else (0.0, np.inf)
    moving = of_curves if looking and of_curves.any() else np.ones(count, dtype=bool)
    start = np.where(moving, start, sizes.deviation)
    scale = np.maximum(sizes.scale, _LEAST)
    deviation, known, noise, gain = _climbed(moments, rows, group, start, scale, most, within, moving)
    if looking:
        joint = np.array([int(key[2]) if curve else 0 for key, curve in zip(sizes.groups, of_curves, strict=True)])
        gains = np.array([gain(joint == j) if j else np.inf for j in range(int(joint.max(initial=0)) + 1)])
        deviation = np.where(gains[joint] < _SIGNIFICANT * crowd, _LEAST, deviation)
    moved = np.abs(np.log(deviation / sizes.deviation)) * np.minimum(known, 1.0)
    change = np.inf if first.any() or sizes.before_curves >= 0 else float(np.max(moved, initial=0.0))
    sizes = replace(sizes, deviation=deviation, before_curves=sizes.before_curves - 1)
    current = {p.name: p for p in parameters}
    free = sizes.fitted(FreeParameters(tuple(current.get(p.name, p) for p in every.parameters)))
    left = {p.name: p.nominal for p in problem.free.parameters if p.name not in set(free.names)}
    factor = max(min(1.0, float(np.sqrt(noise))), NOISE_FLOOR / min(problem.noise.values()))
    weighed = replace(
        problem,
        robot=problem.robot.with_values(left),
        free=free,
        noise={name: factor * value for name, value in problem.noise.items()},
        widened=max(1.0, problem.widened * factor),
    )
    return weighed, sizes, change, joints * factor**2


def _scale_of(
    moments: Array, group: NDArray[np.intp], first: NDArray[np.bool_], deviation: Array, most: Array
) -> Array:
    """Return what the deviations of groups that are `first` looked at are expected to be about, ``(groups,)``.

    With them the groups explain what the others leave over, which are as large as they were found to be.
    """
    new = first[group]
    root = np.concatenate([deviation[group[~new]], np.ones(int(new.sum()) + 1)])
    order = np.concatenate([np.flatnonzero(~new), np.flatnonzero(new), [len(group)]])
    left = moments_without(moments[np.ix_(order, order)] * np.outer(root, root), int((~new).sum()))
    size = np.bincount(group[new], np.diag(left)[:-1], len(first))
    share = max(float(left[-1, -1]), 0.0) / int(first.sum())
    least = np.maximum(share * (_SCALE / most) ** 2, 1e-300)  # what ends at the most
    return np.clip(_SCALE * np.sqrt(share / np.maximum(size, least)), _LEAST, most)


def _climbed(
    moments: Array,
    rows: float,
    group: NDArray[np.intp],
    start: Array,
    scale: Array,
    most: Array,
    within: tuple[float, float],
    moving: NDArray[np.bool_],
) -> tuple[Array, Array, float, Callable[[NDArray[np.bool_]], float]]:
    """Return the likeliest deviation of each group, what the data know of it, and the variance of the noise.

    Args:
        within: Lowest and highest variance of the noise.
        moving: Which groups are looked at; the others stay as they are.

    Returns:
        deviation, known, noise
        gain: By how much the logarithm of the likelihood is larger with some groups: that of the density of zero
            beforehand by the one with the data (Savage and Dickey).
    """
    A, b, squares = moments[:-1, :-1], moments[:-1, -1], float(moments[-1, -1])
    count = len(start)
    sizes = np.bincount(group, minlength=count)
    known: Array = np.zeros(count)
    variance, prior = start**2, scale**2
    noise, gone = 1.0, sizes == 0
    for _ in range(_STEPS):
        on = np.flatnonzero(~gone[group])
        of, root = group[on], np.sqrt(variance)[group[on]]
        H = A[np.ix_(on, on)]
        C = _inverse(root[:, None] * H * root / noise + np.eye(len(root)))
        mean = C @ (root * b[on]) / noise
        w = root * mean
        known = np.asarray(np.bincount(of, 1.0 - np.diag(C), count))
        square = np.bincount(of, w**2, count)
        slope = known * prior - square
        new = (-slope + np.sqrt(slope**2 + 4.0 * (known + _SPARSE) * square * prior)) / (2.0 * (known + _SPARSE))
        new = np.where(known < _NOTHING * sizes, variance * _FADING, new)
        new = np.where(moving, np.clip(new, _LEAST**2, most**2), variance)
        rest = squares - 2.0 * float(b[on] @ w) + float(w @ H @ w)
        noise = float(np.clip(max(rest, 1e-6 * squares) / max(rows - known.sum(), 0.1 * rows), *within))
        change = np.abs(np.log(new / variance)).max(initial=0.0)
        variance = new
        gone = gone | ((variance <= _LEAST**2) & (known < _NOTHING * sizes))
        if change < _SETTLED:
            break

    def gain(groups: NDArray[np.bool_]) -> float:
        mine = np.flatnonzero(groups[of])
        of_group = C[np.ix_(mine, mine)]
        pull = float(mean[mine] @ np.linalg.solve(of_group, mean[mine]))
        return 0.5 * (pull + float(np.linalg.slogdet(of_group)[1]))

    return np.sqrt(variance), known, noise, gain


@dataclass(frozen=True, eq=False)
class Moments:
    """Products of all equations at a solution."""

    #: Of the derivatives by the parameters, per prior, and of the right side, ``(parameters + 1, parameters + 1)``.
    products: Array
    rows: int  #: How many equations there are.
    away: Array  #: How far the solution is from the priors' centre, per prior, ``(parameters,)``.
    by_joint: Array  #: Sum over the equations of the square of their derivative by each joint [1/rad^2], ``(joints,)``.


def moments_of(problem: Problem, parameters: Sequence[Parameter], joints: Array, weight: Array) -> Moments:
    """Return products of the equations of a problem.

    Args:
        problem: At a solution.
        parameters: At their values there.
        joints: Variances of the joints' errors that readings are weighed by.
        weight: What the loss leaves of each reading.
    """
    noise = {name: max(deviation, _SUMMED_FLOOR) for name, deviation in problem.noise.items()}
    whole = replace(problem, noise=noise, free=FreeParameters(tuple(parameters)))
    evaluation = whole.at(whole.free.start)
    whitening = None
    if joints.any():
        whitening = Whitening(Visits(whole.visits), evaluation.by_joints * np.sqrt(joints))
    root, prior = np.sqrt(np.repeat(weight, whole.components)), whole.free.prior
    away = whole.free.start - whole.free.nominal
    products = np.zeros((len(away) + 1, len(away) + 1))
    for equations, portion in evaluation.portions():
        residual, jacobian, weights = portion.residual, portion.jacobian, root[equations]
        if whitening is not None:
            alone = whitening.of(equations)
            residual, jacobian = alone.applied(residual), alone.applied(jacobian)
        for begin in range(0, len(residual), _AT_ONCE):
            some = slice(begin, begin + _AT_ONCE)
            part = np.column_stack([jacobian[some] * prior, jacobian[some] @ away - residual[some]])
            part *= weights[some, None]
            products += part.T @ part
    by_joint = np.sum((evaluation.by_joints * root[:, None]) ** 2, axis=0)
    return Moments(products, whole.rows, away / prior, by_joint)


def _moments_of_graded(
    problem: Problem, parameters: Sequence[Parameter], graded: NDArray[np.bool_], joints: Array, weight: Array
) -> tuple[float, Array]:
    """Return how many equations there are, and their products for graded parameters with the others integrated out.

    The rate of warm-up stays as it is: by its slope it would stand in for the lengths that warm up.
    """
    of = moments_of(problem, parameters, joints, weight)
    stays = np.array([p.name == RATE for p in parameters])
    away = np.eye(len(parameters) + 1)
    away[:-1, -1] = np.where(stays, -of.away, 0.0)
    others = ~graded & ~stays
    order = np.concatenate([np.flatnonzero(others), np.flatnonzero(graded), [len(parameters)]])
    moments = (away.T @ of.products @ away)[np.ix_(order, order)]
    return of.rows, moments_without(moments, int(others.sum()))


def moments_without(moments: Array, others: int) -> Array:
    """Return products of columns of equations with the first parameters integrated out under their priors.

    Args:
        moments: Products of the derivatives, per prior, and of the residuals, ``(parameters + 1, parameters + 1)``.
        others: How many parameters these are.
    """
    shared = np.linalg.solve(_factored(moments[:others, :others] + np.eye(others)), moments[:others, others:])
    return np.asarray(moments[others:, others:] - shared.T @ shared)


def _factored(matrix: Array) -> Array:
    """Return the lower triangle by Cholesky of a matrix that is not below 1; rounding may have left it indefinite."""
    try:
        return np.asarray(np.linalg.cholesky(matrix))
    except np.linalg.LinAlgError:
        sizes, axes = np.linalg.eigh(matrix)
        return np.asarray(np.linalg.qr(np.sqrt(np.maximum(sizes, 1.0))[:, None] * axes.T)[1].T)


def _inverse(matrix: Array) -> Array:
    """Return the inverse of a matrix that is not below 1, which rounding leaves between 0 and 1."""
    half = lower_inverse(_factored(matrix))
    return np.asarray(half.T @ half)


# What a fit with sizes is off by, where these were found from the same data.
#
# Likeliest variances are too sure of themselves. What the data do not tell comes out as next to zero, and the geometry
# that takes its place counts as known. So the covariance is that of other variances: what is expected of each group's,
# over all that the data leave likely. With those the parameters have a posterior of their own. The covariance returned
# is its covariance and the square of the difference of its mean from what was fitted: the mean squared error of the
# fitted values.

#: Deviations that are tried for a group, and the largest by that found.
_LEVELS: Final = 25
_LARGER: Final = 3.0
#: Probability that a joint errs in a band of its curve at all. At one and two periods, where encoders do, it is one.
_ERRING: Final = 0.1
#: Share of the variance of the readings that all coefficients of curves which are left out may move them by together.
_NEGLIGIBLE: Final = 1e-3
#: Degrees of freedom of the level of the errors, before readings that the fit has not seen tell it
#: (:mod:`truearm.engine.diagnose.unseen`): variances of groups are found from the readings that the parameters are
#: found from, and what errs more than 60 times in a turn is in none of them.
_FREEDOM: Final = 5.0


def parts_with_sizes(
    problem: Problem,
    sizes: Sizes,
    joints: Array,
    erring: NDArray[np.bool_],
    weight: Array,
    certain: NDArray[np.bool_],
    scatter: CovariancePart | None,
) -> tuple[tuple[str, ...], tuple[CovariancePart, ...], Array]:
    """Return what the parameters of a fit with sizes are off by, and those that were not fitted.

    Args:
        problem: At the solution, whose values its free parameters have.
        joints: Variances of the joints' errors that readings are weighed by.
        erring: Which joints were found to err at a visit. If none of its curve was found, what its gears may do is in
            that.
        weight: What the loss leaves of each reading.
        certain: Which of its free parameters are certain, ``(free,)``.
        scatter: What the readings' noise adds to the covariance of the free parameters [SI], where it follows from
            their scatter.

    Returns:
        names, parts: Of the parameters that are zero in the fit and may not be, and the parts of the covariance [SI] of
            the free parameters and, behind them, of these.
        informed: Share of the expected variance of each that the readings removed.
    """
    free, fitted = problem.free.parameters, set(problem.free.names)
    aside = [sizes.sized(problem.robot.parameters[name]) for name in sizes.place if name not in fitted]
    parameters = (*free, *aside)
    of = moments_of(problem, parameters, joints, weight)
    expected = expected_sizes(sizes, of, [p.name for p in parameters])
    sure = np.append(certain, np.zeros(len(aside), dtype=bool))
    whole, beforehand, informed = _mean_squared_error(of, sure, expected)
    own = {joint for name, joint in sizes.curves.items() if name in fitted}
    size = np.array([p.prior for p in parameters])
    joint = np.array([sizes.curves.get(p.name, -1) for p in aside], dtype=np.intp)
    moved = np.where(joint < 0, np.inf, (expected * size**2)[len(free) :] * of.by_joint[joint] / 2.0)
    order = np.argsort(moved)
    matters = np.ones(len(aside), dtype=bool)
    matters[order] = np.cumsum(moved[order]) > _NEGLIGIBLE * of.rows
    possible = np.array([i < 0 or i in own or not erring[i] for i in joint.tolist()], dtype=bool)
    chosen = np.concatenate([np.arange(len(free)), len(free) + np.flatnonzero(matters & possible)])
    names = tuple(parameters[k].name for k in chosen[len(free) :].tolist())
    among, size = np.ix_(chosen, chosen), size[chosen]
    if scatter is None:
        part = CovariancePart(whole[among], _FREEDOM, tuple(np.flatnonzero(joints).tolist()))
        return names, (part.scaled(size),), informed[chosen]
    known = CovariancePart(beforehand[among], _FREEDOM).scaled(size)
    return names, (scatter.among(np.arange(len(chosen)) < len(free)), known), informed[chosen]


def _mean_squared_error(of: Moments, certain: NDArray[np.bool_], expected: Array) -> tuple[Array, Array, Array]:
    """Return the mean squared error of the fitted values, its part without readings, and what the data told of each.

    Args:
        certain: Which parameters cannot be off, ``(parameters,)``.
        expected: What the variance of each is expected to be, by its prior's, ``(parameters,)``.

    Returns:
        whole, beforehand: ``(parameters, parameters)`` each, per prior. The second is what priors leave, without the
            noise of the readings.
        informed: Share of the expected variance of each that the readings removed, ``(parameters,)``.
    """
    root = np.where(certain, 0.0, np.sqrt(expected))
    C = _inverse(root[:, None] * of.products[:-1, :-1] * root + np.eye(len(root)))
    mean = root * (C @ (root * of.products[:-1, -1]))
    off = np.where(certain, 0.0, of.away - mean)
    missing = np.outer(off, off)
    whole = root[:, None] * C * root
    return whole + missing, root[:, None] * (C @ C) * root + missing, 1.0 - np.diag(C)


def expected_sizes(sizes: Sizes, of: Moments, names: Sequence[str]) -> Array:
    """Return what the variance of each parameter is expected to be, by that of its prior now, ``(names,)``.

    It is the mean of what the data leave likely of each group's variance, those of the others as they are. Gears and
    encoders do err, and few readings do not tell: the mean square of a curve is believed to be that of its prior, which
    falls as one by the number of periods, or what it is in the joints whose readings tell, and to be in few bands.

    Args:
        of: The equations at the solution, of parameters per prior.
        names: Of the parameters.
    """
    expected = np.ones(len(names))
    if not sizes:
        return expected
    C = _inverse(of.products[:-1, :-1] + np.eye(len(names)))
    mean = C @ of.products[:-1, -1]
    place = np.array([sizes.place.get(name, -1) for name in names])
    scale = np.maximum(sizes.scale, _LEAST)
    likely: dict[int, tuple[Array, Array]] = {}
    seen = np.zeros(len(scale))
    for k, now in enumerate(sizes.deviation.tolist()):
        mine = np.flatnonzero(place == k)
        if not len(mine):
            continue
        precision = np.linalg.inv(C[np.ix_(mine, mine)])
        told, turned = np.linalg.eigh(precision - np.eye(len(mine)))
        told, pull = np.maximum(told, 0.0), (turned.T @ (precision @ mean[mine])) ** 2
        tried = np.geomspace(_LEAST, _LARGER * max(1.0, now), _LEVELS)
        larger = ((tried / now) ** 2)[:, None]
        likely[k] = tried, 0.5 * (larger * pull / (1.0 + larger * told) - np.log1p(larger * told)).sum(axis=1)
        seen[k] = float(np.mean(told / (told + now**2)))  # of parameters as large as their prior
    for band in range(1, len(BANDS) + 1):
        alike = [k for k, key in enumerate(sizes.groups) if key[0] == JointCurve.name and int(key[3]) == band]
        square = float(seen[alike] @ sizes.deviation[alike] ** 2) / max(float(seen[alike].sum()), 1e-300)
        scale[alike] = max(1.0 / BANDS[band - 1], square**0.5)
    for k, (key, (tried, height)) in enumerate(zip(sizes.groups, likely.values(), strict=True)):
        # What is believed of it, where it is tried evenly in its logarithm.
        power, believed = 1, 1.0 / (1.0 + (tried / scale[k]) ** 2)
        if key[0] == JointCurve.name:
            erring = 1.0 if key[3] == "1" else _ERRING
            power, believed = 2, tried / (1.0 + erring**2 * (tried / scale[k]) ** 4)
            believed *= erring / believed.sum()
            believed[0] += 1.0 - erring
        weight = np.exp(height - height.max()) * believed
        size = float(weight @ tried**power / weight.sum()) ** (1.0 / power)
        expected[place == k] = (size / sizes.deviation[k]) ** 2
    return expected


#: Of a model whose effects have the sizes that their priors say.
NO_SIZES: Final = Sizes()
