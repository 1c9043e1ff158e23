"""What readings are off by on average even by a robot whose parameters are exact: noise, and what does not repeat.

Best is what visits to the same posture show, for no model is in it. The deviations of ``m`` normal visits from their
mean are ``sqrt(1 - 1 / m)`` times as long as those from the truth, on average.

Without such visits there is the noise that the data declare. Where the residuals are larger than that, or nothing is
declared, what a reading is off by follows from the fit: its covariance is ``sigma^2 I + J S J'``, with the noise and
the variances S of the joints' errors that the fit estimates, and the mean length of such a vector is known exactly.
Whatever the model cannot follow is in these, so they are no measure of noise and repeatability. A robust loss
estimates no errors of the joints, and then only declared noise is known.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import OBSERVATIONS, Observation
from truearm.engine.data.statistics import Errors, errors_of
from truearm.engine.diagnose.gain import mean_length, visited_again
from truearm.engine.fit.fit import Fit
from truearm.engine.fit.problem import Problem
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.robot import Robot

Kind = Literal["position", "orientation", "length"]
#: What is compared for each kind of error.
_KINDS: Final[dict[Kind, tuple[str, ...]]] = {
    "position": ("position",),
    "orientation": ("orientation",),
    "length": ("distance", "height"),
}

#: Share of declared noise from which what the fit says besides is told.
_BEYOND_DECLARED: Final = 1.02
#: What visits to fewer postures show need not hold elsewhere: farther out, errors of the joints do more.
_FEWEST_POSTURES: Final = 5


#: Visits that differ by less [m or rad] are copies, or rounding hides by how much they do.
_NOTHING: Final = 1e-12


@dataclass(frozen=True)
class LeastError:
    """The mean error that exact parameters would leave."""

    mean: float  #: [m or rad]
    #: What it follows from: ``visits`` to the same postures, the noise that the data have ``declared``, or the
    #: ``residuals`` of the fit, which hold what the model cannot follow.
    evidence: Literal["visits", "declared", "residuals"]
    declared: float | None  #: Mean error by the declared noise alone [m or rad]; None if it is not declared.
    visits: int = 0  #: visits, postures: how many visits to how many postures it follows from.
    postures: int = 0


def least_errors(
    robot: Robot, data: Dataset, judged: Dataset, fit: Fit | None = None, joint_error: Array | None = None
) -> dict[Kind, LeastError]:
    """Return the mean error that exact parameters would leave of some readings, of each kind of which it is known.

    Args:
        robot: What predicts.
        data: All readings of it: visits to the same postures are looked for among them.
        judged: The readings that it is asked of.
        fit: What the robot comes from; None if that is not known.
        joint_error: Standard deviation of the error of each joint that the residuals of the fit allow, ``(joints,)``
            [rad or m]; None for that of the fit.
    """
    errors, of, by_fit = errors_of(robot, data), errors_of(robot, judged), dict[Kind, float]()
    if fit is not None and fit.loss == "linear":
        by_fit = _by_fit(fit, judged, fit.joint_error if joint_error is None else joint_error)
    least = dict[Kind, LeastError]()
    for kind in _KINDS:
        declared = _declared(judged, kind)
        again = _of_visits(errors, data, kind, declared)
        if again is not None:
            least[kind] = again
        elif kind in by_fit and (declared is None or by_fit[kind] > _BEYOND_DECLARED * declared):
            left = {"position": of.position, "orientation": of.orientation, "length": of.length}[kind]
            at_most = by_fit[kind] if left is None else left.mean  # exact parameters leave no more than fitted ones
            least[kind] = LeastError(min(by_fit[kind], at_most), "residuals", declared)
        elif declared is not None:
            least[kind] = LeastError(declared, "declared", declared)
    return least


def _of_visits(errors: Errors, data: Dataset, kind: Kind, declared: float | None) -> LeastError | None:
    """Return what visits to the same postures show, in what the robot predicts at them; None if there were too few."""
    vectors = {
        "position": errors.position_errors,
        "orientation": errors.orientation_errors,
        "length": None if errors.length_errors is None else errors.length_errors[:, None],
    }[kind]
    again = None if vectors is None else visited_again(data, np.asarray(np.isfinite(vectors).all(axis=1)))
    if again is None or vectors is None or again.postures < _FEWEST_POSTURES:
        return None
    lengths = np.linalg.norm(again.apart(vectors), axis=1) / np.sqrt(1.0 - 1.0 / again.count)
    if np.median(lengths) < _NOTHING:
        return None
    return LeastError(float(lengths.mean()), "visits", declared, again.visits, again.postures)


def _kind(observation: Observation) -> Kind:
    return next(kind for kind, names in _KINDS.items() if observation.name in names)


def _declared(data: Dataset, kind: Kind) -> float | None:
    """Return the mean error by the declared noise alone [m or rad]; None if it is not declared or nothing was read."""
    lengths = list[Array]()
    for observation in OBSERVATIONS:
        read = observation.present(data)
        if _kind(observation) != kind or not read.any():
            continue
        sigma = observation.declared_sigma(data)
        if sigma is None:
            return None
        lengths.append(math.sqrt((8.0 if observation.components == 3 else 2.0) / math.pi) * sigma[read])
    return float(np.concatenate(lengths).mean()) if lengths else None


def _by_fit(fit: Fit, data: Dataset, joint_error: Array) -> dict[Kind, float]:
    """Return the mean error by the noise and the errors of the joints that a fit estimates, of each kind [m or rad].

    Where the residuals contradict errors of the joints and are larger than declared, they widen the noise instead.
    """
    noise = {each.name: fit.sigma.get(each.name, math.nan) for each in OBSERVATIONS}
    noise.update(dict.fromkeys(fit.assumed, math.nan))  # nothing tells it
    problem = Problem(fit.robot, replace(data, setup=None), FreeParameters(()), noise, widened=fit.excess)
    shared = np.zeros_like(joint_error) if fit.scattered and fit.excess > 1.0 else joint_error
    by_joints = problem.at(problem.free.start).by_joints * shared
    lengths = dict[Kind, list[Array]]()
    for block, rows in problem.placed:
        kind, count = _kind(block.observation), block.observation.components
        if not np.isfinite(block.sigma).all():
            lengths.setdefault(kind, []).append(block.sigma)
            continue
        J = by_joints[rows].reshape(-1, count, by_joints.shape[1])
        variances = np.zeros((len(J), 3))
        variances[:, :count] = np.linalg.eigvalsh(np.eye(count) + J @ np.swapaxes(J, 1, 2))
        lengths.setdefault(kind, []).append(block.sigma * mean_length(variances))
    means = {kind: float(np.concatenate(of_kind).mean()) for kind, of_kind in lengths.items()}
    return {kind: mean for kind, mean in means.items() if math.isfinite(mean)}
