"""What an earlier calibration knows of the parameters that a fit leaves as they are.

They are as uncertain as before. The parameters that are found make up for their errors where it was measured: so they
are off with them, by as much as they follow (the covariance of considered parameters: Schmidt 1966; Bierman 1977,
"Factorization methods for discrete sequential estimation", chapter 8).
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from truearm.engine.fit.likelihood import Visits
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.relevance import moments_of
from truearm.engine.fit.variance_components import CovariancePart
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import PLACES, SCALE_GROUP
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.seal import is_intact


def with_proof_of_its_values(robot: Robot) -> Robot:
    """Return a robot whose proof, where the values were changed since, keeps only what speaks against it."""
    if robot.proof is None or is_intact(robot):
        return robot
    return replace(robot, proof=replace(robot.proof, names=(), deviations=(), factor=()))


def known_before(robot: Robot, found: Collection[str]) -> tuple[str, ...]:
    """Return the names of the arm's parameters that an earlier calibration knows and a fit leaves as they are.

    Args:
        found: Names of those that it finds, or weighs.
    """
    if robot.proof is None:
        return ()
    aside = (*PLACES, SCALE_GROUP)
    return tuple(n for n in robot.proof.names if n not in found and robot.parameters[n].group not in aside)


def part_known_before(
    problem: Problem, names: tuple[str, ...], joints: Array, weight: Array, certain: NDArray[np.bool_]
) -> CovariancePart:
    """Return what errors that were known before add to the covariance: of these parameters, and of joints at a visit.

    Args:
        problem: At a solution, whose values its free parameters have.
        names: Of these parameters.
        joints: Variances of the joints' errors that readings are weighed by [rad^2 or m^2], ``(joints,)``.
        weight: What the loss leaves of each reading.
        certain: Which of the free parameters are held at a bound, ``(free,)``.

    Returns:
        The part [SI] of the free parameters and, behind them, of these.
    """
    proof = problem.robot.proof
    assert proof is not None
    count, found = len(problem.free.names), np.flatnonzero(~certain)
    parameters = (*problem.free.parameters, *(problem.robot.parameters[name] for name in names))
    size = np.array([p.prior for p in parameters])
    products = moments_of(problem, parameters, joints, weight).products[:-1, :-1]
    information = products[np.ix_(found, found)] + np.eye(len(found)) * problem.priors
    unseen = np.sqrt(np.maximum(np.square(proof.joint_error or np.zeros(len(joints))) - joints, 0.0))
    root = proof.root[[proof.names.index(name) for name in names]] / size[count:, None]
    pulls = np.hstack([products[found, count:] @ root, _pulls_of_joints(problem, unseen, weight)[found]])
    moved = np.zeros((len(parameters), pulls.shape[1]))
    moved[found] = -np.linalg.lstsq(information, pulls, rcond=None)[0]
    moved[count:, : root.shape[1]] = root
    moved *= size[:, None]
    return CovariancePart(moved @ moved.T, np.inf)


def _pulls_of_joints(problem: Problem, joints: Array, weight: Array) -> Array:
    """Return how errors of the joints at each visit pull the free parameters, per prior, ``(free, visits joints)``.

    Args:
        joints: Deviations of these errors [rad or m], ``(joints,)``.
        weight: What the loss leaves of each reading.
    """
    evaluation = problem.at(problem.free.start)
    weights = np.repeat(weight, problem.components)[:, None]
    by_visit = Visits(problem.visits).products(
        evaluation.jacobian * problem.free.prior * weights, evaluation.by_joints * joints
    )
    return np.moveaxis(by_visit, 0, 1).reshape(len(problem.free.names), -1)
