"""Curves of the joints in a fit: which coefficients are free, and what is expected of each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from truearm.identification.solving.arrivals import Arrivals, Whitening
from truearm.identification.solving.curve_errors import (
    CurveMoments,
    curve_covariance,
    expected_variances,
    that_matter,
)
from truearm.identification.solving.curve_stiffness import LARGEST, curve_variances, moments_without
from truearm.identification.solving.problem import Problem
from truearm.identification.solving.variance_components import CovariancePart
from truearm.modeling.chain import Array
from truearm.modeling.effects.joint_curve import JointCurve
from truearm.modeling.parameters import FreeParameters, Parameter
from truearm.modeling.robot import Robot

#: How often stiffness is found: the noise that is left without a curve is not that with it.
_ROUNDS: Final = 2
#: Equations whose products are summed at once.
_AT_ONCE: Final = 3000
#: Degrees of freedom of the level of the errors: variances of curves are known from a few dozen lines, and what errs
#: more than 60 times in a turn is in none of them. With so many the interval of the expected error holds about as
#: often as it says on twins (docs/benchmarks.md); targets of programs have as many.
_FREEDOM: Final = 12.0
#: Coordinates that say where a target is.
_COORDINATES: Final = 3


@dataclass(frozen=True, eq=False)
class Curves:
    """The curves of the joints in a fit."""

    #: Joint (from 0) and periods in a turn of every coefficient that the model has, by its name.
    places: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    variances: Mapping[str, float] = field(default_factory=dict)  #: Of the coefficients that are free [rad^2].
    #: The variance of every coefficient that has the largest likelihood [rad^2], in the order of `places`.
    likeliest: Array = field(default_factory=lambda: np.zeros(0))
    #: By what the variances of the readings are larger, for the curves' sake, than their residuals (Kish 1965): where
    #: errors of the joints at an arrival explain nothing, its readings count as one of three coordinates, and hold the
    #: curves no better.
    design_effect: float = 1.0
    #: What the curve of each joint gains in log-likelihood, by the index of the joint.
    gains: Mapping[int, float] = field(default_factory=dict)
    rounds: int = 0  #: How often stiffness is still to be found.

    def __bool__(self) -> bool:
        return bool(self.places)

    @classmethod
    def none_of(cls, problem: Problem) -> Self:
        """Return those that a problem has, of which nothing is known yet."""
        wanted = {p.name for p in problem.free.parameters if p.group == JointCurve.name}
        places = {
            name: (joint, number // 2 + 1)
            for effect in problem.robot.effects
            if isinstance(effect, JointCurve)
            for joint, names in effect.terms.items()
            for number, name in enumerate(names)
            if name in wanted
        }
        return cls(places, rounds=_ROUNDS if places else 0)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all coefficients."""
        return tuple(self.places)

    def priors_of(self, robot: Robot) -> list[Parameter]:
        """Return a robot's coefficients with what is expected of them."""
        return [replace(robot.parameters[name], prior=math.sqrt(variance)) for name, variance in self.variances.items()]


def with_stiffness(
    problem: Problem, every: FreeParameters, curves: Curves, joints: Array, weight: Array
) -> tuple[Problem, Curves, Array]:
    """Return a problem with the coefficients free that the data tell, each with what is expected of it.

    The deviations of its readings, and the variances of the joints' errors, which are returned too, are those with the
    curves.

    Args:
        problem: At a solution, whose values its free parameters have.
        every: All parameters that the model frees, in their order.
        curves: What was found before.
        joints: Variances of the joints' errors that readings are weighed by.
        weight: What the loss leaves of each reading.
    """
    names = curves.names  # all of them again: what is weak shows only where the strong curves are known
    robot = problem.robot
    coefficients = [robot.parameters[name] for name in names]
    crowd = 1.0
    if not joints.any():
        crowd = max(1.0, problem.rows / (_COORDINATES * (int(problem.arrivals.max(initial=0)) + 1)))
    of = curve_moments(problem, curves, joints, weight, crowd)
    declared = any(block.declared for block in problem.blocks)
    found = curve_variances(
        moments_without(of.moments, len(of.away) - len(names)),
        of.rows,
        of.joint,
        of.period,
        least_noise=problem.widened**-2 if declared else 0.0,
        most=LARGEST,
    )
    variances = {name: v for name, v in zip(names, found.variance.tolist(), strict=True) if v > 0.0}
    if {curves.places[name][0] for name in curves.variances} - {curves.places[name][0] for name in variances}:
        return problem, replace(curves, rounds=0), joints  # the curve of a joint that was found once is not lost again
    now = {p.name: p for p in problem.free.parameters}
    kept = [p for p in every.parameters if p.name in (variances if p.name in curves.places else now)]
    free = FreeParameters(
        tuple(
            replace(robot.parameters[p.name], prior=math.sqrt(variances[p.name]))
            if p.name in variances
            else now[p.name]
            for p in kept
        )
    )
    held = {p.name: p.nominal for p in coefficients if p.name not in variances}
    ratio = min(1.0, math.sqrt(found.noise)) if variances else 1.0
    joining = bool(variances) and not curves.variances  # what widened declared deviations may have been the curves
    left = replace(
        problem,
        robot=robot.with_values(held),
        free=free,
        noise={name: ratio * deviation for name, deviation in problem.noise.items()},
        widened=1.0 if joining else max(1.0, problem.widened * ratio),
    )
    known = replace(
        curves,
        variances=variances,
        likeliest=found.full,
        design_effect=crowd if variances else 1.0,
        gains=found.gains,
        rounds=curves.rounds - 1 if variances else 0,
    )
    return left, known, joints * ratio**2


def curve_moments(problem: Problem, curves: Curves, joints: Array, weight: Array, crowd: float) -> CurveMoments:
    """Return products of the equations of a problem, with every coefficient of the curves beside the other parameters.

    Args:
        problem: At a solution, whose values its free parameters have.
        joints: Variances of the joints' errors that readings are weighed by.
        weight: What the loss leaves of each reading.
        crowd: By what the variances of the readings are larger because they hang together.
    """
    names, robot = curves.names, problem.robot
    others = [p for p in problem.free.parameters if p.name not in curves.places]
    whole = replace(problem, free=FreeParameters((*others, *(robot.parameters[name] for name in names))))
    here = whole.at(whole.free.start)
    prior = np.array([p.prior for p in others])
    whitening = None
    if joints.any():
        whitening = Whitening(Arrivals(whole.arrivals), here.by_joints * np.sqrt(joints))
    root = np.sqrt(np.repeat(weight, whole.components) / crowd)
    away = whole.free.start - whole.free.nominal
    moments = np.zeros((len(away) + 1, len(away) + 1))
    scale = np.concatenate([prior, np.ones(len(names))])
    for equations, portion in here.portions():
        residual, jacobian, weights = portion.residual, portion.jacobian, root[equations]
        if whitening is not None:
            alone = whitening.of(equations)
            residual, jacobian = alone.applied(residual), alone.applied(jacobian)
        for first in range(0, len(residual), _AT_ONCE):
            rows = slice(first, first + _AT_ONCE)
            part = np.column_stack([jacobian[rows] * scale, jacobian[rows] @ away - residual[rows]])
            part *= weights[rows, None]
            moments += part.T @ part
    place = np.array([curves.places[name] for name in names], dtype=np.intp).reshape(-1, 2)
    size = np.sum((here.by_joints * root[:, None]) ** 2, axis=0)
    return CurveMoments(moments, whole.rows / crowd, away / scale, place[:, 0], place[:, 1], size)


def parts_with_curves(
    problem: Problem,
    curves: Curves,
    joints: Array,
    weight: Array,
    certain: NDArray[np.bool_],
    scatter: CovariancePart | None,
) -> tuple[tuple[str, ...], tuple[CovariancePart, ...]]:
    """Return what the parameters of a fit with curves are off by, and the coefficients that were not fitted.

    Args:
        problem: At the solution, whose values its free parameters have.
        joints: Variances of the joints' errors that readings are weighed by.
        weight: What the loss leaves of each reading.
        certain: Which of its free parameters are certain, ``(free,)``.
        scatter: What the readings' noise adds to the covariance of the free parameters [SI], where it follows from
            their scatter.

    Returns:
        names, parts: Of the coefficients that are zero in the fit and may not be, and the parts of the covariance [SI]
            of the free parameters and, behind them, of these.
    """
    names, free = list(curves.places), problem.free
    of = curve_moments(problem, curves, joints, weight, 1.0 if scatter is None else curves.design_effect)
    variance = expected_variances(of, curves.likeliest)
    others = [p for p in free.parameters if p.name not in curves.places]
    place = {name: k for k, name in enumerate((*(p.name for p in others), *names))}
    sure = np.zeros(len(place), dtype=bool)
    sure[[place[name] for name, one in zip(free.names, certain.tolist(), strict=True) if one]] = True
    whole, beforehand = curve_covariance(of, variance, sure)
    fitted = set(free.names)
    more = [name for name, on in zip(names, that_matter(of, variance).tolist(), strict=True) if on]
    more = [name for name in more if name not in fitted]
    order = [place[name] for name in (*free.names, *more)]
    size = np.concatenate([[p.prior for p in others], np.ones(len(names))])[order]
    if scatter is None:
        parts = [CovariancePart(whole[np.ix_(order, order)], _FREEDOM, tuple(np.flatnonzero(joints).tolist()))]
        return tuple(more), tuple(part.scaled(size) for part in parts)
    known = CovariancePart(beforehand[np.ix_(order, order)], _FREEDOM).scaled(size)
    return tuple(more), (scatter.among(np.arange(len(order)) < len(free.names)), known)


#: Of a model without any.
NO_CURVES: Final = Curves()
