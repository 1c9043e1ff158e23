"""From a nominal robot and training data to an identified robot, and uncertainties by bootstrap."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.fixed_places import NOTHING_FIXED, FixedPlaces
from truearm.engine.fit.known_before import known_before, part_known_before, with_proof_of_its_values
from truearm.engine.fit.likelihood import Visits
from truearm.engine.fit.losses import ABSOLUTE, Loss, pulls, scales_of_pulls
from truearm.engine.fit.models import FRAMES, Model
from truearm.engine.fit.problem import (
    SETUP,
    Problem,
    Redundancy,
    Rows,
    find_redundancies,
    gauge_freedoms,
    in_words,
    unobservable_parameters,
)
from truearm.engine.fit.relevance import parts_with_sizes
from truearm.engine.fit.rounds import (
    Redundant,
    Solved,
    assumed_noise,
    bound_by,
    estimated_noise,
    evaluated,
    excess_of,
    factors_of,
    find_parameters,
    in_the_middle,
    informed_rows,
    solve_with_joints,
)
from truearm.engine.fit.solver import SMALL, Solution
from truearm.engine.fit.start_values import start_from_readings, unanchored
from truearm.engine.fit.variance_components import Components, CovariancePart, cluster_covariance, widening
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.warm_up import LEFT, RATE, share_left
from truearm.engine.robot.parameters import PLACES, SCALE, SCALE_GROUP, FreeParameters, Parameter
from truearm.engine.robot.proof import Proof
from truearm.engine.robot.robot import Robot

#: Configurations below which draws are too much alike.
LEAST_CONFIGURATIONS: Final = 10
#: Step of each fit that is the last, in priors or mm: deviations need no more digits.
_SMALL: Final = 1e-4


# Efron (1979): whole configurations are drawn with replacement, because readings of one share errors of the joints, and
# each draw is fitted as the readings were, under the same loss and bounds. It needs no model of the residuals, and no
# derivative of a loss that has none, such as a sum of absolute values.
def refit_draws(
    solved: Solved, loss: Loss, count: int, seed: int = 0, progress: Callable[[str], None] = lambda _: None
) -> Array:
    """Return what fits to configurations drawn anew find, ``(count, parameters)`` [SI].

    Deviations of the readings, and which parameters are held, are those of the fit.

    Args:
        solved: The fit to all training configurations, where each search begins.
        loss: Of the fit.
        count: How many draws.
        seed: Of the draws.
        progress: Called with a few words at each fit.

    Raises:
        InputError: If there are too few configurations to draw from.
    """
    problem, n = solved.problem, solved.problem.data.configurations
    if n < LEAST_CONFIGURATIONS:
        raise InputError(
            "there are too few training configurations to draw from",
            parameter="bootstrap",
            where=problem.data.source,
            came=n,
            allowed=f"{LEAST_CONFIGURATIONS} or more",
            cure="Measure more, or leave it out.",
        )
    joints = np.zeros(len(problem.robot.joints)) if solved.components is None else solved.components.weighing.joints
    values = zip(problem.free.parameters, solved.solution.vector.tolist(), strict=True)
    started = FreeParameters(tuple(replace(p, value=value) for p, value in values))
    rng = np.random.default_rng((seed, count))
    draws = np.empty((count, len(started.names)))
    for number in range(count):
        progress(f"bootstrap {_bar(number, count)} {number + 1} of {count}")
        drawn = problem.data.of_configurations(rng.integers(n, size=n))
        again = replace(problem, data=drawn, free=started)
        draws[number] = solve_with_joints(again, joints, loss, solved.limits, _SMALL).vector
    return draws


def _bar(finished: int, count: int, width: int = 20) -> str:
    """Return how much is done, drawn with characters."""
    full = width * finished // count
    return f"[{'#' * full}{'.' * (width - full)}]"


#: ``uninformed``: the data removed less than 5 % of the prior variance, so the value is still a belief.
ParameterStatus = Literal["identified", "uninformed", "at-bound", "not-determined", "dropped", "held", "fixed"]
_UNINFORMED: Final = 0.05
#: Share of the largest in a combination from which a parameter takes part in it.
_LEAST_PART: Final = 0.02


class Status(Enum):
    """How a fit ended; the value is the word in files, `advice` what to do."""

    CONVERGED = "converged"
    AT_BOUND = "at-bound"
    RANK_LOSS = "rank-loss"
    NOT_CONVERGED = "not-converged"
    IMPLAUSIBLE = "implausible"

    @property
    def advice(self) -> str:
        """What to do about it; nothing where all went well."""
        return {
            Status.CONVERGED: "",
            Status.AT_BOUND: "A parameter is at a bound. Widen the bound if it was a guess.",
            Status.RANK_LOSS: "The data are too few or too alike to determine everything that predictions "
            "depend on. Measure more configurations that move every joint, or free fewer parameters.",
            Status.NOT_CONVERGED: "The solver's steps did not become small. Check units, joint order and targets.",
            Status.IMPLAUSIBLE: "What was fitted cannot be this robot. Check units, joint order, signs and targets "
            "with 'truearm check', and that it is this robot.",
        }[self]


@dataclass(frozen=True, eq=False)
class Fit:
    """An identified robot. It knows training data only; held-out figures belong to the calibration."""

    robot: Robot  #: The robot with identified parameters, their deviations and informed shares.
    start: Robot  #: The robot before: same frames in closed form, nominal parameters.
    model: Model  #: What was free.
    status: Status  #: How the fit ended.
    free: FreeParameters  #: The parameters that were identified, in the order of `covariance`.
    #: Of the free parameters [SI], ``(parameters, parameters)``. An interval of 1.96 deviations to both sides is of 95
    #: %: where variances are known from few readings, it is as much wider as one of Student's t. Readings of a visit
    #: may hang together. Outliers that lie to one side bias a robust fit, and the covariance does not contain that.
    covariance: Array
    #: The covariance by its sources, and without what their variances are uncertain by; of the free parameters and,
    #: behind them, of the `unfitted` ones.
    covariance_parts: tuple[CovariancePart, ...]
    #: Parameters held because the data cannot tell them apart, with the combination.
    redundancies: tuple[Redundancy, ...]
    at_bound: tuple[str, ...]  #: Names of parameters at a bound.
    #: Names of parameters that the data do not determine although predictions depend on them.
    unobservable: tuple[str, ...]
    #: Motions of everything that no reading observes: ``base`` where no reading locates the robot, ``size`` where no
    #: length was measured either.
    gauge_freedoms: tuple[str, ...]
    #: Combinations of the robot's own parameters that readings without an anchor do not observe, in words such as ``d_3
    #: - d_2``; the first parameter of each keeps its nominal value.
    unobservable_combinations: tuple[str, ...]
    #: Standard deviation of a reading [m or rad] by observation, declared (root mean square) or estimated.
    sigma: dict[str, float]
    declared: bool  #: Whether the file declared all of them.
    #: How much larger the residuals are than the declared deviations allow; 1 if they agree or nothing was declared.
    #: The covariance contains it. Parameters at a bound are not uncertain in it.
    excess: float
    #: Standard deviation of the error of each joint that all readings of a visit share, ``(joints,)`` [rad or m]:
    #: repeatability plus what the model leaves. Zero where none was found.
    joint_error: Array
    joint_freedom: Array  #: Degrees of freedom behind its square, ``(joints,)``; infinite where none was found.
    #: Whether the covariance follows from the scatter of the visits: for losses other than the linear one, and where
    #: errors of the joints do not explain how the residuals of a visit hang together.
    scattered: bool
    #: What the loss left of each reading, ``(readings,)``, in the order of the dataset; NaN where none was used. For
    #: sums of absolute values, which have no full weight, relative to the median reading.
    weight: Array
    numbers: int  #: Of the readings it was made from, and of what is known of fixtures.
    spent: float  #: How many of them the parameters took up.
    #: The observations whose standard deviation was neither declared nor told by the readings.
    assumed: tuple[str, ...]
    loss: Loss  #: Of the readings.
    steps: int  #: Steps of the solver, over all stages.
    fixed: FixedPlaces = NOTHING_FIXED  #: Places that were known, and not found.
    bootstrap: int = 0  #: How many fits to configurations drawn anew the covariance follows from; 0 if from none.
    #: Parameters that are uncertain although they were not fitted: coefficients of joint curves that are zero because
    #: the data could not tell them, how warm the arm is in another session, and `as_before`.
    unfitted: tuple[str, ...] = ()
    #: Parameters of the arm that stay as an earlier calibration found them, and as uncertain.
    as_before: tuple[str, ...] = ()

    @property
    def before(self) -> Proof | None:
        """What an earlier calibration knows of the arm, where this fit leaves some of it, or all, as it was."""
        arm_is_found = any(p.group not in (*PLACES, SCALE_GROUP) for p in self.free.parameters)
        return self.start.proof if self.as_before or not arm_is_found else None

    @property
    def knows_geometry(self) -> bool:
        """Whether the geometry of the arm is uncertain, as found or as before, and does not count as exact."""
        groups = [self.robot.parameters[name].group for name in self.as_before]
        return "geometry" in (*self.model.groups, *groups)

    @property
    def found_anew(self) -> bool:
        """Whether it finds geometry that an earlier calibration knew."""
        before = () if self.start.proof is None else self.start.proof.names
        return any(p.group == "geometry" and p.name in before for p in self.free.parameters)

    def parameter_status(self, name: str) -> ParameterStatus:
        """Return how much the value of a parameter is worth."""
        if name in self.unobservable:
            return "not-determined"
        if any(name == r.dropped for r in self.redundancies):
            return "dropped"
        if name not in self.free.names:
            return "held" if name in self.fixed.names(self.robot) else "fixed"
        if name in self.at_bound:
            return "at-bound"
        informed = self.robot.parameters[name].informed
        return "uninformed" if informed is not None and informed < _UNINFORMED else "identified"

    @property
    def covariance_with_unfitted(self) -> Array:
        """Covariance of the free parameters and, behind them, of the unfitted ones [SI]."""
        if not self.unfitted:
            return self.covariance
        whole = np.sum([part.covariance for part in self.covariance_parts], axis=0)
        whole[: len(self.covariance), : len(self.covariance)] = self.covariance
        return np.asarray(whole)

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
    fixed: FixedPlaces = NOTHING_FIXED,
    bootstrap: int = 0,
    seed: int = 0,
    small: float = SMALL,
    progress: Callable[[str], None] = lambda _: None,
) -> Fit:
    """Identify a robot from training data.

    Args:
        robot: Its current parameter values are the start and the centre of the priors; its own base and targets are
            found anew from the data.
        data: Training readings.
        model: Which parameters are free.
        loss: See :mod:`truearm.engine.fit.losses`.
        redundancy: ``prior``: every parameter is kept near its nominal value as far as its prior says, so redundant
            ones do no harm. ``drop``: no priors; redundant parameters are held at nominal and named. ``none``: no
            priors, and nothing is held; what neither bounds nor the readings determine ends in ``rank-loss``.
        bounds: Limits of parameter values.
        fixed: Places that are known: they are not found.
        bootstrap: How many fits to configurations drawn anew the deviations follow from; 0: from the readings' own
            scatter.
        seed: Of those draws.
        small: Step of the solver that is the last, in priors.
        progress: Called with a few words at each of those fits.

    Raises:
        InputError: For data without positions, bounds on unknown parameters, bounds that a redundant parameter cannot
            keep, too few equations without priors, nothing to find, or too few configurations to draw from.
    """
    solved = find_parameters(
        with_proof_of_its_values(robot),
        data,
        model,
        loss=loss,
        redundancy=redundancy,
        bounds=bounds,
        bounds_file=bounds_file,
        fixed=fixed,
        small=small,
    )
    draws = refit_draws(solved, loss, bootstrap, seed, progress) if bootstrap else None
    return fit_of(solved, model, loss, draws)


def place(robot: Robot, data: Dataset, loss: Loss = "linear", fixed: FixedPlaces = NOTHING_FIXED) -> Robot:
    """Return the uncalibrated robot in the frames of the data: only base, targets and fixtures are fitted.

    Readings are weighed one by one. What an uncalibrated robot leaves is no error of the joints at a visit.
    """
    if fixed:
        start = start_from_readings(FRAMES.prepared(robot), data, fixed)
        if not fixed.free_of(unanchored(FRAMES.free(start), data), start).names:
            return start
    return find_parameters(robot, data, FRAMES, loss=loss, fixed=fixed, shared=False).robot


def fit_of(solved: Solved, model: Model, loss: Loss, draws: Array | None = None) -> Fit:
    """Return a fit from its solution: what the values that were found are worth.

    Args:
        draws: Values of the free parameters from data that were drawn anew, ``(draws, parameters)``.
    """
    problem, solution, start, limits = solved.problem, solved.solution, solved.start, solved.limits
    free, x = problem.free, solution.vector
    at_bound = bound_by(solution, free, limits)
    components, count = solved.components, len(start.joints)
    joint_error, joint_freedom = np.zeros(count), np.full(count, np.inf)
    noise = estimated_noise(problem, solution, loss)
    declared = {problem.kind(b) for b in problem.blocks if b.declared} - {SETUP}
    if components is None:
        excess = excess_of({name: noise[name] for name in noise if name in declared}) if declared else 1.0
        excess *= problem.widened
    else:
        excess, joint_error = problem.widened, np.sqrt(components.likeliest.joints)
        joint_freedom = components.likeliest.freedom
    open_ = _left_open(problem, x, limits) if not problem.priors and not solved.redundancies else []
    scattered = components is None or not components.holds
    covariance, parts, informed, unfitted = _worth(solved, loss, draws, at_bound, open_, scattered)
    if problem.data.number is not None and LEFT in start.parameters:
        share = share_left(problem.data.number, in_the_middle(solved.robot, problem.data).values[RATE])
        parts, unfitted = _with_uncertain(parts, float(share.var())), (*unfitted, LEFT)
    as_before = known_before(solved.start, {*free.names, *unfitted, *(r.dropped for r in solved.redundancies)})
    if as_before:
        covariance, parts = _beside_what_was_known(solved, as_before, covariance, parts, at_bound, scattered)
        unfitted = (*unfitted, *as_before)
    found = [*_identified(solved, covariance, informed, at_bound), *_uncertain(solved, parts, unfitted, as_before)]
    robot = in_the_middle(start.with_parameters(found), problem.data)
    dropped = tuple(robot.parameters[r.dropped] for r in solved.redundancies)
    # What is expected of these is found from the data, and their deviations say where nothing else is known.
    weighed = set(solved.sizes.place)
    looked_at = FreeParameters((*(robot.parameters[n] for n in free.names if n not in weighed), *dropped))
    unobservable = unobservable_parameters(robot, problem.data, looked_at, fixed=solved.fixed)
    unobservable = tuple(dict.fromkeys((*unobservable, *open_)))
    gauge = gauge_freedoms(problem.data, solved.fixed)
    if open_:  # along them the solver has no reason to stop
        status = Status.RANK_LOSS
    elif not solution.converged:
        status = Status.NOT_CONVERGED
    elif unobservable and not model.weighed:
        status = Status.RANK_LOSS
    elif at_bound.any():
        status = Status.AT_BOUND
    else:
        status = Status.CONVERGED
    spent = informed_rows(problem, solution)
    return Fit(
        robot=robot,
        start=start,
        model=model,
        status=status,
        free=free,
        covariance=covariance,
        covariance_parts=parts,
        redundancies=solved.redundancies,
        at_bound=tuple(n for n, bound in zip(free.names, at_bound, strict=True) if bound),
        unobservable=unobservable,
        gauge_freedoms=gauge,
        unobservable_combinations=_unobservable_combinations(problem, x, weighed) if gauge else (),
        sigma={name: _sigma_of(name, problem, components, name in declared) for name in noise},
        declared=declared == set(noise),
        excess=excess,
        joint_error=joint_error,
        joint_freedom=joint_freedom,
        scattered=scattered,
        weight=_weights(problem, solution, loss),
        numbers=problem.rows,
        spent=spent,
        assumed=assumed_noise(problem, components, spent),
        loss=loss,
        steps=solution.steps,
        fixed=solved.fixed,
        bootstrap=0 if draws is None else len(draws),
        unfitted=unfitted,
        as_before=as_before,
    )


def _identified(solved: Solved, covariance: Array, informed: Array, at_bound: NDArray[np.bool_]) -> list[Parameter]:
    """Return the fitted parameters with what was found; one at a bound has no deviation."""
    names, deviation = solved.problem.free.names, np.sqrt(np.diag(covariance))
    return [
        replace(solved.start.parameters[n], value=float(v))
        if bound
        else replace(solved.start.parameters[n], value=float(v), deviation=float(d), informed=float(i))
        for n, v, d, i, bound in zip(names, solved.solution.vector, deviation, informed, at_bound, strict=True)
    ]


def _uncertain(
    solved: Solved, parts: Sequence[CovariancePart], unfitted: Sequence[str], as_before: Sequence[str]
) -> list[Parameter]:
    """Return the parameters of effects that shrank to nothing, and those as before, with what they may be off by."""
    deviation = np.sqrt(np.diag(np.sum([part.covariance for part in parts], axis=0)))
    told = dict.fromkeys(solved.sizes.place.keys() - solved.sizes.curves.keys(), 0.0) | dict.fromkeys(as_before)
    beside = zip(unfitted, deviation[len(solved.problem.free.names) :].tolist(), strict=True)
    return [replace(solved.start.parameters[n], deviation=d, informed=told[n]) for n, d in beside if n in told]


def _sigma_of(name: str, problem: Problem, components: Components | None, is_declared: bool) -> float:
    """Return the standard deviation of the readings of a kind, root mean square [m or rad]."""
    values = np.concatenate([block.sigma for block in problem.blocks if problem.kind(block) == name])
    sigma = float(np.sqrt(np.mean(values**2)))
    if is_declared:
        return sigma / problem.widened
    if components is None:
        return sigma
    return sigma * float(np.sqrt(components.likeliest.factors[factors_of(problem)[0].index(name)]))


def _worth(
    solved: Solved, loss: Loss, draws: Array | None, at_bound: NDArray[np.bool_], open_: Sequence[str], scattered: bool
) -> tuple[Array, tuple[CovariancePart, ...], Array, tuple[str, ...]]:
    """Return the covariance of the values that were found, its parts, what the data told of each, and `unfitted`."""
    problem, solution, limits, components = solved.problem, solved.solution, solved.limits, solved.components
    free, x = problem.free, solution.vector
    if components is not None and not scattered and draws is None:
        covariance, parts = components.worth
    else:
        covariance, parts = cluster_covariance(
            lambda: _pulled(problem, solution, loss),
            Visits(problem.standings),
            ~at_bound,
            _beforehand(problem, limits, open_),
        )
    if draws is not None:
        covariance, parts = _of_draws(draws / free.prior, parts)
    covariance = covariance * np.outer(free.prior, free.prior)
    deviation = np.sqrt(np.diag(covariance))
    share = (deviation / free.prior) ** 2
    informed = np.clip(1.0 - share, 0.0, 1.0) if problem.priors else 1.0 / (1.0 + share)
    if limits is not None and not problem.priors:  # what a bound knows, no reading told
        evenly = np.abs(limits[1] - limits[0]) / np.sqrt(12.0)
        bounded = np.isfinite(evenly) & (evenly > 0.0)
        of_bounds = np.clip(1.0 - (deviation / np.where(bounded, evenly, 1.0)) ** 2, 0.0, 1.0)
        informed = np.where(bounded, np.minimum(informed, of_bounds), informed)
    parts, unfitted = tuple(part.scaled(free.prior) for part in parts), tuple[str, ...]()
    if solved.sizes:
        at_solution, joints = _at_solution(solved, scattered)
        alone = parts[0] if scattered or draws is not None else None
        erring = joints > 0.0 if components is None else components.likeliest.joints > 0.0
        unfitted, parts, told = parts_with_sizes(
            at_solution, solved.sizes, joints, erring, solution.weight / problem.times_visited, at_bound, alone
        )
        covariance = np.sum([part.covariance for part in parts], axis=0)[: len(x), : len(x)]
        informed = np.clip(told[: len(x)], 0.0, 1.0)
    return covariance, parts, informed, unfitted


def _at_solution(solved: Solved, scattered: bool) -> tuple[Problem, Array]:
    """Return the problem whose parameters have the values found, and the variances of the joints' errors there."""
    problem, components = solved.problem, solved.components
    values = dict(zip(problem.free.names, solved.solution.vector.tolist(), strict=True))
    free = FreeParameters(tuple(replace(p, value=values[p.name]) for p in problem.free.parameters))
    joints = np.zeros(len(solved.start.joints)) if components is None or scattered else components.weighing.joints
    return replace(problem, robot=problem.robot.with_values(values), free=free), joints


def _beside_what_was_known(
    solved: Solved,
    names: tuple[str, ...],
    covariance: Array,
    parts: tuple[CovariancePart, ...],
    at_bound: NDArray[np.bool_],
    scattered: bool,
) -> tuple[Array, tuple[CovariancePart, ...]]:
    """Return the covariance of the free parameters, and its parts, with that of parameters that were known before."""
    problem, joints = _at_solution(solved, scattered)
    known = part_known_before(problem, names, joints, solved.solution.weight, at_bound)
    own, n = len(parts[0].covariance), len(problem.free.names)
    place = np.arange(own + len(names))
    *others, last = (part.among(place < own) for part in parts)
    known = known.among((place < n) | (place >= own))
    return covariance + known.covariance[:n, :n], (*others, known, last)


def _with_uncertain(parts: tuple[CovariancePart, ...], variance: float) -> tuple[CovariancePart, ...]:
    """Return parts of a covariance with one more parameter behind, of a variance [SI] that no reading changes."""
    first = np.arange(len(parts[0].covariance) + 1) < len(parts[0].covariance)
    *others, last = (part.among(first) for part in parts)
    last.covariance[-1, -1] = variance
    return (*others, last)


def _weights(problem: Problem, solution: Solution, loss: Loss) -> Array:
    """Return what the loss left of each reading, ``(readings,)``; NaN where none was used."""
    used = solution.weight / np.median(solution.weight) if loss in ABSOLUTE else solution.weight
    weight = np.full(len(problem.data.target), np.nan)
    first = 0
    for block in problem.blocks:
        part = used[first : first + len(block.readings)]
        if block.data is problem.data:
            weight[block.readings] = np.fmin(weight[block.readings], part)
        first += len(block.readings)
    return weight


def _pulled(problem: Problem, solution: Solution, loss: Loss) -> Iterator[tuple[Rows, Array, Array]]:
    """Go through the equations, with what each tells of the parameters and pulls them with, per prior."""
    prior = problem.free.prior
    scales = scales_of_pulls(loss, solution.residual, problem.components, len(prior))
    for rows, part in evaluated(problem, solution).portions():
        pull, sensitivity = pulls(loss, part.residual, part.jacobian, part.problem.components, scales)
        yield rows, sensitivity * prior, pull * prior


def _beforehand(problem: Problem, limits: tuple[Array, Array] | None, left_open: Sequence[str]) -> Array:
    """Return one by the deviation of what is known of each parameter before any reading, in priors, 0 for nothing.

    Without priors a value may be anywhere between its bounds, and its deviation is that of an even distribution. What
    neither readings nor bounds determine is off by what its prior says, although the fit did not know that.
    """
    free = problem.free
    known = np.array([problem.priors or name in left_open for name in free.names], dtype=float)
    if limits is None or problem.priors:
        return known
    width = np.maximum(limits[1] - limits[0], 1e-12 * free.prior)
    return np.asarray(np.maximum(known, free.prior * np.sqrt(12.0) / width))


def _of_draws(draws: Array, parts: tuple[CovariancePart, ...]) -> tuple[Array, tuple[CovariancePart, ...]]:
    """Return the covariance of draws ``(draws, parameters)``, per prior, and its parts.

    What is known beforehand holds every draw in the same place: as for the readings' own scatter, that part is added.
    """
    scatter = CovariancePart(np.atleast_2d(np.cov(draws, rowvar=False)), float(len(draws) - 1))
    remaining = parts[-1]
    return widening(scatter.freedom) ** 2 * scatter.covariance + remaining.covariance, (scatter, remaining)


def _left_open(problem: Problem, vector: Array, limits: tuple[Array, Array] | None) -> list[str]:
    """Return parameters that neither the readings nor bounds determine, where nothing is held at nominal."""
    low, high = (np.full(len(vector), side) for side in (-np.inf, np.inf)) if limits is None else limits
    bounded = {name for name, a, b in zip(problem.free.names, low, high, strict=True) if np.isfinite(b - a)}
    size = dict(zip(problem.free.names, problem.free.prior.tolist(), strict=True))
    parameters = []
    for redundancy in find_redundancies(problem, vector):
        along = {name: abs(c) / size[name] for name, c in redundancy.members.items()}
        taking = [name for name, share in along.items() if share > _LEAST_PART * max(along.values())]
        if not bounded.intersection(taking):
            parameters += taking
    return parameters


def _unobservable_combinations(problem: Problem, vector: Array, weighed: Collection[str]) -> tuple[str, ...]:
    """Return the combinations of the robot's own parameters that the readings do not observe.

    Args:
        weighed: Parameters whose size the data tell; they stay as they are.
    """
    aside = {SCALE, *weighed}.intersection(problem.free.names)
    vector = vector[[name not in aside for name in problem.free.names]]
    problem = replace(problem, free=problem.free.without(sorted(aside)))
    beside = {p.name for p in problem.free.parameters if p.group in ("target", "fixture")}
    own = [
        {n: c for n, c in redundancy.members.items() if n not in beside}
        for redundancy in find_redundancies(problem, vector)
    ]
    return tuple(in_words(members, problem.free) for members in own if members)
