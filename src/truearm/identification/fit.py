"""From a nominal robot and training data to an identified robot, with what is known about every parameter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import Final, Literal

import numpy as np

from truearm.errors import InputError
from truearm.identification.bounds import Bounds, bound_vectors
from truearm.identification.frames import initial_frames
from truearm.identification.losses import MEDIAN_NORM, Loss
from truearm.identification.models import FRAMES, Model
from truearm.identification.problem import Problem, check_solvable
from truearm.identification.redundancy import Redundancy, find_redundancies, unseen_but_felt
from truearm.identification.solver import Solution, solve
from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.parameters import FreeParameters
from truearm.modeling.robot import Robot

Redundant = Literal["prior", "drop"]

#: ``uninformed``: the data removed less than 5 % of the prior variance, so the value is still a belief.
Standing = Literal["identified", "uninformed", "at-bound", "not-determined", "dropped", "fixed"]
_UNINFORMED: Final = 0.05

#: Noise assumed for readings that declare none, until their own residuals say better [m, rad].
_FIRST_NOISE: Final = {"position": 1e-4, "orientation": 1e-4}
_NOISE_FLOOR: Final = 1e-9
# Spatial median in three dimensions against the mean, for normal noise (Brown 1983).
_L1_EFFICIENCY: Final = 0.849


class Status(Enum):
    """How a fit ended; the value is the word in files, `advice` what to do."""

    CONVERGED = "converged"
    AT_BOUND = "at-bound"
    RANK_LOSS = "rank-loss"
    NOT_CONVERGED = "not-converged"

    @property
    def advice(self) -> str:
        """What to do about it."""
        return {
            Status.CONVERGED: "Nothing: judge the fit by its held-out error.",
            Status.AT_BOUND: "A parameter stopped at a bound: widen the bound if it was a guess.",
            Status.RANK_LOSS: "The data are too alike to determine everything that predictions depend on: "
            "measure configurations that move every joint.",
            Status.NOT_CONVERGED: "The steps did not settle: check units, joint order and targets.",
        }[self]


@dataclass(frozen=True, eq=False)
class Fit:
    """An identified robot. It knows training data only; held-out figures belong to the calibration.

    Attributes
    ----------
    robot
        The robot with identified parameters, their deviations and informed shares.
    start
        The robot before: same frames in closed form, nominal parameters.
    model
        What was free.
    status
        How the fit ended.
    free
        The parameters that were identified, in the order of `covariance`.
    covariance
        Of the free parameters [SI], ``(parameters, parameters)``.
    redundancies
        Parameters held because the data cannot tell them apart, with the combination.
    at_bound, unseen
        Names of parameters at a bound, and of those that the data leave undetermined though predictions need them.
    sigma
        Standard deviation of a reading [m or rad] by observation, declared (root mean square) or estimated.
    declared
        Whether the file declared all of them.
    excess
        How much larger the residuals are than the declared deviations allow; 1 if they agree or nothing was
        declared. The covariance contains it.
    weight
        What the loss left of each reading, ``(readings,)``, in the order of the dataset; NaN where none was used.
        For ``l1``, which has no full weight, relative to the median reading.
    steps
        Steps of the solver, over all stages.
    """

    robot: Robot
    start: Robot
    model: Model
    status: Status
    free: FreeParameters
    covariance: Array
    redundancies: tuple[Redundancy, ...]
    at_bound: tuple[str, ...]
    unseen: tuple[str, ...]
    sigma: dict[str, float]
    declared: bool
    excess: float
    weight: Array
    steps: int

    def standing(self, name: str) -> Standing:
        """Return how much the value of a parameter is worth."""
        if any(name == r.dropped for r in self.redundancies):
            return "dropped"
        if name not in self.free.names:
            return "fixed"
        if name in self.unseen:
            return "not-determined"
        if name in self.at_bound:
            return "at-bound"
        informed = self.robot.parameters[name].informed
        return "uninformed" if informed is not None and informed < _UNINFORMED else "identified"

    @property
    def correlations(self) -> Array:
        """Correlation matrix of the free parameters."""
        deviation = np.sqrt(np.diag(self.covariance))
        safe = np.where(deviation > 0, deviation, 1.0)
        return np.asarray(self.covariance / np.outer(safe, safe))


def identify(
    robot: Robot,
    data: Dataset,
    model: Model,
    *,
    loss: Loss = "linear",
    redundancy: Redundant = "prior",
    bounds: Bounds | None = None,
    bounds_file: str = "bounds",
) -> Fit:
    """Identify a robot from training data.

    Parameters
    ----------
    robot
        Its current parameter values are the start and the centre of the priors; its own base and targets are
        found anew from the data.
    data
        Training readings.
    model
        Which parameters are free.
    loss
        See :mod:`truearm.identification.losses`.
    redundancy
        ``prior``: every parameter is kept near its nominal value as far as its prior says, so redundant ones
        do no harm. ``drop``: no priors; redundant parameters are held at nominal and named.
    bounds
        Limits of parameter values.

    Raises
    ------
    InputError
        For data without positions, bounds on unknown parameters, or too few equations without priors.
    """
    start = initial_frames(model.prepared(robot), data)
    free = model.free(start)
    check_bounds = None if bounds is None else bound_vectors(bounds, free, bounds_file)
    problem = Problem(start, data, free, dict(_FIRST_NOISE), priors=redundancy == "prior")
    check_solvable(problem)
    dropped: tuple[Redundancy, ...] = ()
    if redundancy == "drop":
        dropped = find_redundancies(problem, free.start)
    steps = 0
    for _ in range(6):
        held = [r.dropped for r in dropped]
        kept = problem.free.without(held)
        limits = None if check_bounds is None else _limits_of(check_bounds, free, kept)
        solution, reduced = _solve_with_noise(replace(problem, free=kept), loss, limits)
        steps += solution.steps
        if redundancy == "prior":
            break
        # What is redundant at the nominal robot need not be at the real one: look again there.
        found = dict(zip(kept.names, solution.vector, strict=True))
        there = FreeParameters(tuple(replace(p, value=float(found.get(p.name, p.nominal))) for p in free.parameters))
        problem = replace(problem, free=there)
        dropped = find_redundancies(problem, there.start, held)
        if [r.dropped for r in dropped] == held:
            break
    return _fit(reduced, solution, start, model, loss, dropped, limits, steps)


def place(robot: Robot, data: Dataset) -> Fit:
    """Fit only the base and the targets: the uncalibrated robot in the frames of the data."""
    return identify(robot, data, FRAMES)


def _limits_of(limits: tuple[Array, Array], free: FreeParameters, kept: FreeParameters) -> tuple[Array, Array]:
    places = [free.names.index(name) for name in kept.names]
    return limits[0][places], limits[1][places]


def _solve_with_noise(problem: Problem, loss: Loss, limits: tuple[Array, Array] | None) -> tuple[Solution, Problem]:
    """Solve; where the file declares no deviations, let the residuals say them and solve again."""
    solution = solve(problem, loss, limits)
    undeclared = {b.observation.name for b in problem.blocks if b.observation.declared_sigma(problem.data) is None}
    if not undeclared:
        return solution, problem
    steps = solution.steps
    for _ in range(4):
        noise = {**problem.noise}
        for name, (estimate, _) in _noise(problem, solution, loss).items():
            if name in undeclared:
                noise[name] = max(estimate * noise[name], _NOISE_FLOOR)
        change = max(abs(np.log(noise[n] / problem.noise[n])) for n in undeclared)
        started = FreeParameters(
            tuple(replace(p, value=float(v)) for p, v in zip(problem.free.parameters, solution.vector, strict=True))
        )
        problem = replace(problem.with_noise(noise), free=started)
        solution = solve(problem, loss, limits)
        steps += solution.steps
        if change < 0.02:
            break
    return replace(solution, steps=steps), problem


def _noise(problem: Problem, solution: Solution, loss: Loss) -> dict[str, tuple[float, float]]:
    """Return for each observation the deviation of its whitened residuals, and the degrees of freedom behind it."""
    norms = np.linalg.norm(solution.residual.reshape(-1, 3), axis=1)
    kinds = np.concatenate([[b.observation.name] * len(b.readings) for b in problem.blocks])
    spent = _informed_rows(problem, solution)
    found = {}
    for name in dict.fromkeys(kinds.tolist()):
        mine = norms[kinds == name]
        freedom = 3 * len(mine) * max(1.0 - spent / problem.rows, 1e-3)
        if loss == "linear":
            found[name] = (float(np.sqrt(np.sum(mine**2) / freedom)), freedom)
        else:
            found[name] = (float(np.median(mine)) / MEDIAN_NORM, freedom)
    return found


def _informed_rows(problem: Problem, solution: Solution) -> float:
    """Return how many parameters' worth of residual the fit used up."""
    prior = problem.free.prior
    s2 = np.linalg.svd(np.linalg.qr(solution.jacobian * prior, mode="r"), compute_uv=False) ** 2
    if not problem.priors:
        return float(len(prior))
    return float(np.sum(s2 / (s2 + 1.0)))


def _fit(
    problem: Problem,
    solution: Solution,
    start: Robot,
    model: Model,
    loss: Loss,
    dropped: tuple[Redundancy, ...],
    limits: tuple[Array, Array] | None,
    steps: int,
) -> Fit:
    free, x = problem.free, solution.vector
    weighted = np.ones_like(solution.weight) if loss == "l1" else solution.weight
    A = solution.jacobian * free.prior * np.repeat(np.sqrt(weighted), 3)[:, None]
    noise = _noise(problem, solution, loss)
    declared = all(b.observation.declared_sigma(problem.data) is not None for b in problem.blocks)
    excess = _excess(noise) if declared else 1.0
    spread = excess / np.sqrt(_L1_EFFICIENCY) if loss == "l1" else excess
    information = A.T @ A / spread**2 + (np.eye(len(x)) if problem.priors else 0.0)
    covariance = np.linalg.pinv(information, rcond=1e-15, hermitian=True) * np.outer(free.prior, free.prior)
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    informed = np.clip(1.0 - (deviation / free.prior) ** 2, 0.0, 1.0)
    at_bound: tuple[str, ...] = ()
    if limits is not None:
        near = 1e-9 * free.prior
        at_bound = tuple(
            n for n, v, lo, hi, e in zip(free.names, x, *limits, near, strict=True) if v <= lo + e or v >= hi - e
        )
    identified = [
        replace(start.parameters[n], value=float(v), deviation=float(d), informed=float(i))
        for n, v, d, i in zip(free.names, x, deviation, informed, strict=True)
    ]
    robot = start.with_parameters(identified)
    frames = FRAMES.free(robot)
    looked_at = (
        FreeParameters(tuple(robot.parameters[n] for n in {*frames.names, *(r.dropped for r in dropped), *free.names}))
        if dropped
        else frames
    )
    unseen = unseen_but_felt(robot, problem.data, looked_at)
    used = solution.weight / np.median(solution.weight) if loss == "l1" else solution.weight
    weight = np.full(len(problem.data.target), np.nan)
    first = 0
    for block in problem.blocks:
        part = used[first : first + len(block.readings)]
        weight[block.readings] = np.fmin(weight[block.readings], part)
        first += len(block.readings)
    if not solution.converged:
        status = Status.NOT_CONVERGED
    elif unseen:
        status = Status.RANK_LOSS
    elif at_bound:
        status = Status.AT_BOUND
    else:
        status = Status.CONVERGED
    sigma = {}
    for name in noise:
        values = np.concatenate([b.sigma for b in problem.blocks if b.observation.name == name])
        sigma[name] = float(np.sqrt(np.mean(values**2)))
    return Fit(
        robot, start, model, status, free, covariance, dropped, at_bound, unseen, sigma, declared, excess, weight, steps
    )


def _excess(noise: dict[str, tuple[float, float]]) -> float:
    """Return the ratio of residuals to declared deviations if it is too large for chance (1 in 1000), else 1.

    The quantile of chi squared is Wilson and Hilferty's (1931).
    """
    freedom = sum(dof for _, dof in noise.values())
    ratio = sum(deviation**2 * dof for deviation, dof in noise.values()) / freedom
    k = 2.0 / (9.0 * freedom)
    allowed = (1.0 - k + 3.09 * np.sqrt(k)) ** 3
    return float(np.sqrt(ratio)) if ratio > allowed else 1.0


def check_targets(training: Dataset, held_out: Dataset) -> None:
    """Refuse held-out readings of targets that the training data never saw.

    Raises
    ------
    InputError
        Naming the target.
    """
    seen = set(training.target[training.has_position].tolist())
    for index in dict.fromkeys(held_out.target[held_out.has_position | held_out.has_orientation].tolist()):
        if index not in seen:
            raise InputError(
                "a target of the held-out part has no reading in the training part",
                where=training.source,
                came=training.targets[index],
                cure="Raise --train, change --seed, or leave the target out.",
            )
