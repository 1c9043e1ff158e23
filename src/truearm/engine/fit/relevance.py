"""How large each joint effect is expected to be, where all of them stand in the model at once.

The parameters of an effect of a joint are a group: normal, of mean zero, with one variance. The variances that make the
residuals likeliest are taken, the parameters of the arm integrated out under their own priors (MacKay 1992, "Bayesian
interpolation"; automatic relevance determination). What the data do not support shrinks to nothing by itself.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from truearm.engine.fit.curves import (
    NO_CURVES,
    CurveMoments,
    curve_moments,
    factored,
    inverse_of,
    moments_without,
)
from truearm.engine.fit.problem import NOISE_FLOOR, Problem
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.compliance import Compliance
from truearm.engine.robot.effects.joint_curve import JointCurve
from truearm.engine.robot.effects.warm_up import RATE
from truearm.engine.robot.parameters import FreeParameters

# With a group of m parameters w of variance v, the data know ``g`` of them, 0 to m, so that the likelihood has its
# maximum where ``v = w'w / g``. The deviation of a group is believed to be as likely at every order of magnitude below
# a scale, and less and less beyond, as one of a half Cauchy distribution. The scale is what would make all effects
# together explain what the arm alone leaves, each its share.
#
#: Scale of the deviations of groups, by what would make all groups together explain what is left over.
_SCALE: Final = 0.3
#: Parameters that what is believed of a variance beforehand counts for.
_SPARSE: Final = 2.0
#: Information of the readings on a group that is none, and what its variance is then multiplied by in a step.
_NOTHING: Final = 0.02
_FADING: Final = 0.3
#: Deviation from which a group starts again, at least, by what it is expected to be about.
_AGAIN: Final = 0.1
#: Deviation of a group by the prior of its parameters: at least and at most.
_LEAST: Final = 1e-3
_MOST: Final = 3.0
_STEPS: Final = 60
_SETTLED: Final = 0.02


@dataclass(frozen=True, eq=False)
class Sizes:
    """The groups of a model, and how large their parameters are expected to be."""

    #: Names of the parameters of each group.
    groups: Mapping[tuple[str, ...], tuple[str, ...]] = field(default_factory=dict)
    #: Deviation of each group by the prior of its parameters, in the order of `groups`; empty before the first round.
    deviation: Array = field(default_factory=lambda: np.zeros(0))
    #: What the deviations are expected to be about, in the same units.
    scale: Array = field(default_factory=lambda: np.zeros(0))
    known: Array = field(default_factory=lambda: np.zeros(0))  #: How many of a group's parameters the data know.

    def __bool__(self) -> bool:
        return bool(self.groups)

    @classmethod
    def none_of(cls, problem: Problem) -> Self:
        """Return the groups of a problem, of which nothing is known yet."""
        groups: dict[tuple[str, ...], list[str]] = {}
        pooled = {effect.name for effect in problem.robot.effects if effect.stretches}
        own = {effect.name for effect in problem.robot.effects} - {JointCurve.name, Compliance.name}
        for p in problem.free.parameters:
            if p.group in own and p.name != RATE:
                joint = "" if p.group in pooled else re.sub(r".*_", "", p.name)
                groups.setdefault((p.group, p.unit, joint), []).append(p.name)
        return cls({key: tuple(names) for key, names in groups.items()})

    @cached_property
    def place(self) -> Mapping[str, int]:
        """Index of the group of each parameter."""
        return {name: k for k, names in enumerate(self.groups.values()) for name in names}


def with_sizes(
    problem: Problem, sizes: Sizes, joints: Array, weight: Array, priors: Mapping[str, float]
) -> tuple[Problem, Sizes, float, Array]:
    """Return a problem whose effects have the sizes that the data tell.

    Args:
        problem: At a solution, whose values its free parameters have.
        sizes: What was found before.
        joints: Variances of the joints' errors that readings are weighed by.
        weight: What the loss leaves of each reading.
        priors: The prior of every graded parameter beforehand [SI].

    Returns:
        problem, sizes, change: The largest relative change of a deviation that matters.
        joints: Their variances with the effects.
    """
    free = problem.free
    graded = np.array([name in sizes.place for name in free.names])
    own = [p for p in free.parameters if p.name in sizes.place]
    unit = np.array([priors[p.name] for p in own])
    group = np.array([sizes.place[p.name] for p in own])
    rows, moments = _moments_of(problem, graded, joints, weight)
    scale = np.append(unit / np.array([p.prior for p in own]), 1.0)
    moments = moments * np.outer(scale, scale)  # per prior beforehand
    count, first = len(sizes.groups), not len(sizes.deviation)
    if first:
        size = np.bincount(group, np.diag(moments)[:-1], count)
        least = max(float(moments[-1, -1]) * (_SCALE / _MOST) ** 2 / count, 1e-300)  # what ends at the most
        expected = np.sqrt(moments[-1, -1] / np.maximum(size, least) / count)
        sizes = replace(sizes, scale=np.clip(_SCALE * expected, _LEAST, _MOST))
    start = sizes.scale if first else np.maximum(sizes.deviation, _AGAIN * sizes.scale)  # nothing may come back
    declared = any(block.declared for block in problem.blocks)
    deviation, known, noise = _climbed(moments, rows, group, count, start, sizes.scale, noisy=not declared)
    moved = np.inf if first else np.abs(np.log(deviation / sizes.deviation)) * np.minimum(known, 1.0)
    prior = free.prior
    prior[graded] = unit * deviation[group]
    factor = max(min(1.0, float(np.sqrt(noise))), NOISE_FLOOR / min(problem.noise.values()))
    weighed = replace(
        problem,
        free=FreeParameters(tuple(replace(p, prior=float(d)) for p, d in zip(free.parameters, prior, strict=True))),
        noise={name: factor * value for name, value in problem.noise.items()},
        widened=max(1.0, problem.widened * factor),
    )
    change = float(np.max(moved, initial=0.0))
    return weighed, replace(sizes, deviation=deviation, known=known), change, joints * factor**2


def _moments_of(problem: Problem, graded: NDArray[np.bool_], joints: Array, weight: Array) -> tuple[float, Array]:
    """Return how many equations there are, and their products for graded parameters with the others integrated out.

    The rate of warm-up stays as it is: by its slope it would stand in for the lengths that warm up.
    """
    names = problem.free.names
    of = curve_moments(problem, NO_CURVES, joints, weight, 1.0)
    stays = np.array([name == RATE for name in names])
    away = np.eye(len(names) + 1)
    away[:-1, -1] = np.where(stays, -of.away, 0.0)
    others = ~graded & ~stays
    order = np.concatenate([np.flatnonzero(others), np.flatnonzero(graded), [len(names)]])
    moments = (away.T @ of.moments @ away)[np.ix_(order, order)]
    return of.rows, moments_without(moments, int(others.sum()))


def _climbed(
    moments: Array, rows: float, group: NDArray[np.intp], count: int, start: Array, scale: Array, *, noisy: bool
) -> tuple[Array, Array, float]:
    """Return the likeliest deviation of each group, what the data know of it, and the variance of the noise."""
    A, b, squares = moments[:-1, :-1], moments[:-1, -1], float(moments[-1, -1])
    sizes = np.bincount(group, minlength=count)
    known: Array = np.zeros(count)
    variance, prior = start**2, scale**2
    noise = 1.0
    for _ in range(_STEPS):
        root = np.sqrt(variance)[group]
        H = root[:, None] * A * root / noise + np.eye(len(root))
        inverse = np.linalg.inv(factored(H)[0])
        half = inverse @ (root * b) / noise
        w = root * (inverse.T @ half)
        told = np.asarray(1.0 - (inverse**2).sum(axis=0), dtype=np.float64)
        known = np.asarray(np.bincount(group, told, count))
        square = np.bincount(group, w**2, count)
        slope = known * prior - square
        new = (-slope + np.sqrt(slope**2 + 4.0 * (known + _SPARSE) * square * prior)) / (2.0 * (known + _SPARSE))
        new = np.where(known < _NOTHING * sizes, variance * _FADING, new)
        new = np.clip(new, _LEAST**2, _MOST**2)
        if noisy:
            rest = squares - 2.0 * float(b @ w) + float(w @ A @ w)
            noise = max(rest, 1e-6 * squares) / max(rows - known.sum(), 0.1 * rows)
        change = np.abs(np.log(new / variance)).max(initial=0.0)
        variance = new
        if change < _SETTLED:
            break
    return np.sqrt(variance), known, noise


#: Deviations that are tried for a group, and the largest by that found.
_LEVELS: Final = 25
_LARGER: Final = 3.0


def expected_sizes(sizes: Sizes, of: CurveMoments, curves: Array, names: Sequence[str]) -> Array:
    """Return what the variance of each parameter is expected to be, by that of its prior now, ``(names,)``.

    It is the mean of what the data leave likely of each group's variance, those of the others as they are.

    Args:
        of: The equations at the solution.
        curves: Variances of the coefficients of curves [rad^2].
        names: Of the other parameters.
    """
    expected = np.ones(len(names))
    if not sizes:
        return expected
    root = np.concatenate([expected, np.sqrt(curves)])
    C = inverse_of(root[:, None] * of.moments[:-1, :-1] * root + np.eye(len(root)))
    mean = C @ (root * of.moments[:-1, -1])
    place = np.array([sizes.place.get(name, -1) for name in names])
    for k, (now, scale) in enumerate(zip(sizes.deviation.tolist(), sizes.scale.tolist(), strict=True)):
        mine = np.flatnonzero(place == k)
        if not len(mine):
            continue
        precision = np.linalg.inv(C[np.ix_(mine, mine)])
        told, turned = np.linalg.eigh(precision - np.eye(len(mine)))
        told, pull = np.maximum(told, 0.0), (turned.T @ (precision @ mean[mine])) ** 2
        tried = _tried(max(1.0, _LARGER * now))
        larger = ((tried / now) ** 2)[:, None]
        height = 0.5 * (larger * pull / (1.0 + larger * told) - np.log1p(larger * told)).sum(axis=1)
        height += np.log(_believed(tried, scale))
        likely = np.exp(height - height.max())
        expected[mine] = float(likely @ (tried / now) / likely.sum()) ** 2
    return expected


def _tried(most: float) -> Array:
    return np.geomspace(_LEAST, most, _LEVELS)


def _believed(deviations: Array, scale: float) -> Array:
    """Return how likely deviations are beforehand, where they are tried evenly in their logarithms."""
    return np.asarray(1.0 / (1.0 + (deviations / scale) ** 2))


#: Of a model whose effects have the sizes that their priors say.
NO_SIZES: Final = Sizes()
