"""A robot's parameters from circles, and what circles cannot tell of it.

No priors are used: parameters that the circles cannot tell apart are held at their nominal values and named with the
combination, base first, so that the base lies where axes 1 and 2 are (Nubiola, section 2.3). The value of every other
parameter is then a property of the axes, whatever the held ones truly are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.identification.axes.circles import AxisCircle, AxisProblem
from truearm.identification.solving.redundancy import Redundancy, find_redundancies
from truearm.identification.solving.solver import solve
from truearm.modeling.chain import Array
from truearm.modeling.conversion import converted
from truearm.modeling.parameters import FreeParameters, Group
from truearm.modeling.robot import Robot

#: Half the width of the interval that holds a normal value in 95 of 100 cases, in deviations.
NORMAL_95: Final = 1.959964
#: A direction that moves the flange by less than this share of what its parameter alone does moves nothing.
_NO_MOTION: Final = 1e-6
_STEP: Final = 1e-2  # of a deviation, for derivatives of what is derived from axes


@dataclass(frozen=True, eq=False)
class AxisFit:
    """A robot identified from circles."""

    robot: Robot  #: With the values found and their deviations.
    free: FreeParameters  #: The parameters that were identified, in the order of `covariance`.
    covariance: Array  #: Of them [SI], ``(parameters, parameters)``.
    #: Parameters held because circles cannot tell them apart, with the combination.
    redundancies: tuple[Redundancy, ...]
    #: Those of `redundancies` whose combination moves the flange somewhere: not a matter of convention, but a loss.
    moving_flange: tuple[str, ...]
    #: Root mean square of the whitened differences between axes and circles over their degrees of freedom; None where
    #: there are no more numbers than parameters.
    residual: float | None

    def derived(self, function: Callable[[Robot], Array]) -> tuple[Array, Array]:
        """Return numbers ``(k,)`` that follow from the robot, and their standard deviations ``(k,)``.

        The covariance is carried through central differences along its own directions.
        """
        value = function(self.robot)
        spread = np.linalg.cholesky(self.covariance + 1e-30 * np.diag(np.diag(self.covariance)))
        columns = []
        for direction in spread.T:
            ends = [function(self.robot.with_values(self._values(sign * _STEP * direction))) for sign in (1.0, -1.0)]
            columns.append((ends[0] - ends[1]) / (2 * _STEP))
        return value, np.linalg.norm(np.stack(columns), axis=0)

    def combination(self, name: str) -> dict[str, float]:
        """Return what the value of an identified parameter is: a sum of true values with these factors [SI]."""
        found = {name: 1.0}
        return found | {r.dropped: -r.members[name] for r in self.redundancies if name in r.members}

    def _values(self, step: Array) -> dict[str, float]:
        return {p.name: p.value + float(s) for p, s in zip(self.free.parameters, step, strict=True)}


def fit_axes(
    robot: Robot,
    circles: Sequence[AxisCircle],
    groups: Sequence[Group] = ("base", "joint zero", "geometry"),
    known: Sequence[Redundancy] | None = None,
) -> AxisFit:
    """Identify a robot's parameters from circles.

    Args:
        robot: Where it stands, and with its axes near to the measured ones; what is held stays at its values.
        circles: One or more of every joint.
        groups: Which parameters are free; without ``base`` the robot stands where it is said to.
        known: What an earlier fit of the same runs found redundant, to spare the search in repetitions.

    Raises:
        InputError: If a joint has no circle, or one turns the other way.
    """
    missing = [i for i in range(1, len(robot.joints) + 1) if i not in {c.joint for c in circles}]
    if missing:
        raise InputError(
            "a joint was not turned alone, so that its axis is not known",
            where=robot.name,
            came=f"no run of joint {', '.join(map(str, missing))}",
            allowed="a run of every joint",
            cure="Measure it: four configurations or more while the others stand still.",
        )
    chosen = (p.restarted(p.value) for p in robot.parameters.values() if p.group in groups)
    # Of what cannot be told apart the last is held. That shall be the slides along joint axes.
    free = FreeParameters(tuple(sorted(chosen, key=lambda p: p.name.startswith("ez_"))))
    held = [r.dropped for r in known or ()]
    redundancies = tuple(known or ())
    start = robot.with_parameters(free.parameters)
    problem = AxisProblem(start, circles, free)
    for _ in range(6):
        if known is None:
            redundancies = find_redundancies(problem, problem.free.start, held)
        settled = [r.dropped for r in redundancies] == held
        held = [r.dropped for r in redundancies]
        if not problem.free.without(held).names:
            raise InputError(
                "the measured axes determine nothing of the robot",
                where=robot.name,
                cure="Check units, joint order and signs with 'truearm check ROBOT DATA.csv'.",
            )
        solution = solve(replace(problem, free=problem.free.without(held)))
        found = dict(zip(problem.free.without(held).names, solution.vector.tolist(), strict=True))
        there = tuple(replace(p, value=found.get(p.name, p.nominal)) for p in free.parameters)
        problem = replace(problem, free=FreeParameters(there))
        if settled:
            break
    if not solution.converged:
        raise InputError(
            "the robot's axes cannot be brought onto the measured ones",
            where=robot.name,
            cure="Check joint order and signs with 'truearm check ROBOT DATA.csv'.",
        )
    kept = problem.free.without(held)
    R = np.linalg.qr(solution.jacobian * kept.prior, mode="r")
    inverse = np.linalg.inv(R)
    covariance = (inverse @ inverse.T) * np.outer(kept.prior, kept.prior)
    identified = tuple(
        replace(p, deviation=math.sqrt(v)) for p, v in zip(kept.parameters, np.diag(covariance), strict=True)
    )
    made = start.with_parameters(identified)
    freedom = 4 * len(circles) - len(identified)
    square = float(solution.residual @ solution.residual)
    return AxisFit(
        robot=made,
        free=FreeParameters(identified),
        covariance=covariance,
        redundancies=redundancies,
        moving_flange=_moving_flange(made, redundancies),
        residual=math.sqrt(square / freedom) if freedom > 0 else None,
    )


def measured_axes(robot: Robot, circles: Sequence[AxisCircle]) -> AxisFit:
    """Return the axes themselves, with all joints at zero: four numbers a joint, none of them redundant.

    Args:
        robot: Where it stands, and with its axes near to the measured ones.
    """
    return fit_axes(converted(robot, "zero-reference"), circles, ("geometry",))


def _moving_flange(robot: Robot, redundancies: Sequence[Redundancy], seed: int = 0) -> tuple[str, ...]:
    """Return the held parameters whose combination moves the flange at random configurations."""
    q = robot.random_configurations(20, np.random.default_rng(seed))
    kinematics = robot.forward_kinematics(q)
    found = []
    for redundancy in redundancies:
        names = list(redundancy.members)
        weights = np.array([redundancy.members[n] for n in names])
        linear, angular = robot.jacobians(kinematics, q, names)
        for part in (linear, angular):
            together = np.tensordot(weights, part, axes=1)
            alone = max(float(np.abs(w * p).max()) for w, p in zip(weights, part, strict=True))
            if float(np.abs(together).max()) > _NO_MOTION * alone:
                found.append(redundancy.dropped)
                break
    return tuple(found)
