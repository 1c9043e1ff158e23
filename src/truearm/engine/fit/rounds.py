"""From a nominal robot and training data to the values of its free parameters, in rounds.

Each round solves the whitened problem; then the deviations of the readings, the loads at every joint and, without
priors, the choice of the parameters that are held are found anew at the solution, until they agree with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import OBSERVATIONS
from truearm.engine.fit.bounds import Bounds, bound_vectors
from truearm.engine.fit.fixed_places import NOTHING_FIXED, FixedPlaces
from truearm.engine.fit.likelihood import Linearised, Visits, WhitenedProblem, Whitening
from truearm.engine.fit.losses import Loss, norms_of, scale_of, weighed_together
from truearm.engine.fit.models import Model
from truearm.engine.fit.problem import (
    NOISE_FLOOR,
    SETUP,
    Evaluation,
    Problem,
    Redundancy,
    check_circumstances,
    check_solvable,
    find_redundancies,
    gauge_freedoms,
)
from truearm.engine.fit.relevance import NO_SIZES, Sizes, with_sizes
from truearm.engine.fit.solver import SMALL, Solution, solve
from truearm.engine.fit.start_values import start_from_readings, unanchored
from truearm.engine.fit.variance_components import Components, CovariancePart, beyond_chance, variance_components
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.joint_curve import JointCurve
from truearm.engine.robot.effects.warm_up import LEFT, RATE, share_left
from truearm.engine.robot.parameters import SCALE, FreeParameters
from truearm.engine.robot.robot import Robot

Redundant = Literal["prior", "drop", "none"]

#: Noise assumed for readings that declare none, until their own residuals say better [m, rad].
_FIRST_NOISE: Final = {observation.name: 1e-4 for observation in OBSERVATIONS}
#: Share of the equations that parameters may use up, for what a robust loss leaves to tell the noise.
_LARGEST_SHARE_SPENT: Final = 0.8
#: Numbers that parameters must leave for a least-squares fit to tell the noise: with fewer, no noise at all and
#: parameters that meet every reading are as likely as any.
_FEWEST_LEFT: Final = 2.0
_LEAST_WIDENED: Final = 1e-12
#: What the variances of readings with declared deviations are counted under.
DECLARED: Final = "declared"
#: Rounds until deviations and loads agree with the solution; each leaves a hundredth of the loads' error or less.
_ROUNDS: Final = 6
_SETTLED: Final = 0.02  # largest relative change of a deviation that changes nothing
#: Information of the readings on a direction, by that of the priors, that is none.
_UNSEEN: Final = 1e-3
#: Relative change of the size of an effect that changes nothing, and the last step of solutions meanwhile [priors].
_SIZES_SETTLED: Final = 0.1
_COARSE: Final = 0.01
#: No joint errs by so much from visit to visit [rad or m], a tenth of a degree: it is an effect.
_NO_JOINT: Final = 1.7e-3
#: Coordinates that say where a target is.
_COORDINATES: Final = 3
#: By how much joints may bend otherwise under other loads, while sizes are found and at last [rad or m].
_LOADS_ARE_NEAR: Final = 1e-6
_LOADS_AGREE: Final = 1e-8


@dataclass(frozen=True, eq=False)
class Solved:
    """The values that the data give to the free parameters, before anything is said about their worth."""

    start: Robot  #: The robot before: frames in closed form, nominal parameters.
    #: The problem of the last round, at whose deviations and loads the solution is one. Deviations that neither the
    #: file declares nor the readings tell are those that are assumed at first.
    problem: Problem
    solution: Solution  #: Its solution, with the steps of all rounds.
    redundancies: tuple[Redundancy, ...]  #: Parameters held because the data cannot tell them apart.
    #: Lowest and highest value of every free parameter [SI], where there are bounds.
    limits: tuple[Array, Array] | None
    #: Variances of the readings and of the joints' errors at the solution; None for losses other than the linear one.
    components: Components | None
    fixed: FixedPlaces = NOTHING_FIXED  #: Places that were known.
    sizes: Sizes = NO_SIZES  #: How large the effects are expected to be, where the data tell.

    @property
    def robot(self) -> Robot:
        """The robot with the values found."""
        values = dict(zip(self.problem.free.names, self.solution.vector.tolist(), strict=True))
        return in_the_middle(self.start.with_values(values), self.problem.data)


def find_parameters(
    robot: Robot,
    data: Dataset,
    model: Model,
    *,
    loss: Loss = "linear",
    redundancy: Redundant = "prior",
    bounds: Bounds | None = None,
    bounds_file: str = "bounds",
    fixed: FixedPlaces = NOTHING_FIXED,
    small: float = SMALL,
    shared: bool = True,
    near: Solved | None = None,
    rough: bool = False,
) -> Solved:
    """Find the free parameters of a robot from training data.

    It is what :func:`truearm.engine.fit.fit.identify` does first, with the same parameters and refusals.

    Args:
        shared: Whether errors of the joints that the readings of a visit share are looked for, with the linear loss.
        near: A solution from the same data, of a robot that is the same but for further parameters of effects. The
            search begins at its values and variances. The robot given is its start with those. Without further ones
            the sizes of effects stay as they are.
        rough: Whether to end when the sizes of effects are found, a hundredth of a prior from the solution.
    """
    robot = robot.marked(data.simulated)
    start = start_from_readings(model.prepared(robot), data, fixed) if near is None else model.prepared(robot)
    check_circumstances(start, data, model.effects)
    free = fixed.free_of(unanchored(model.free(start), data), start)
    if redundancy != "prior":  # what is known of an instrument's scale is a prior: without any it is exact
        free = free.without([SCALE])
    check_bounds = _checked(model, start, free, data.source, redundancy, fixed, bounds, bounds_file)
    problem = Problem(start, data, free, dict(_FIRST_NOISE), priors=redundancy == "prior")
    if near is not None:
        problem = _begun_at(problem, near)
    check_solvable(problem)
    dropped: tuple[Redundancy, ...] = ()
    if redundancy == "drop":
        dropped = find_redundancies(problem, free.start)
    steps = 0
    for _ in range(6):
        out = [r.dropped for r in dropped]
        if check_bounds is not None:
            _check_dropped(out, free, check_bounds, bounds_file)
        retained = problem.free.without(out)
        limits = None if check_bounds is None else _limits_of(check_bounds, free, retained)
        solution, reduced, components, sizes = _solve_with_noise(
            replace(problem, free=retained),
            loss,
            limits,
            small,
            shared=shared and redundancy != "none",
            weighed=model.weighed,
            near=near,
            rough=rough,
        )
        steps += solution.steps
        if redundancy != "drop":
            break
        # What is redundant at the nominal robot need not be at the real one: look again there.
        values = dict(zip(retained.names, solution.vector, strict=True))
        at_solution = FreeParameters(
            tuple(replace(p, value=float(values.get(p.name, p.nominal))) for p in free.parameters)
        )
        problem = replace(problem, free=at_solution, noise=reduced.noise)
        dropped = find_redundancies(problem, at_solution.start, out)
        if [r.dropped for r in dropped] == out:
            break
    else:
        solution = replace(solution, converged=False)
        dropped = tuple(r for r in dropped if r.dropped in out)
    if limits is not None and check_bounds is not None:
        limits = _limits_of(check_bounds, free, reduced.free)
    if reduced.priors and "size" in gauge_freedoms(data, fixed):
        solution = _not_shrunk(reduced, solution, limits)
    return Solved(start, reduced, replace(solution, steps=steps), dropped, limits, components, fixed, sizes)


def _checked(
    model: Model,
    start: Robot,
    free: FreeParameters,
    source: str,
    redundancy: Redundant,
    fixed: FixedPlaces,
    bounds: Bounds | None,
    bounds_file: str,
) -> tuple[Array, Array] | None:
    """Refuse what cannot be found; return the lowest and highest value of every free parameter, if there are bounds."""
    if redundancy != "prior" and (model.weighed or JointCurve.name in model.effects):
        raise InputError(
            "the data tell how large joint effects are, which needs priors"
            if model.weighed
            else "curves of joints are found with priors, whose size the data tell",
            parameter="redundancy",
            where=f"model {model.name}",
            came=redundancy,
            allowed="prior",
            cure="Leave out `redundancy`, or name a model."
            if model.weighed
            else f"Leave out `redundancy`, or the joint effect {JointCurve.name}.",
        )
    if not free.names:
        raise InputError(
            "everything that this model frees is held, so there is nothing to find",
            parameter="hold",
            where=source,
            came=f"model {model.name}",
            cure="Hold less, or name a model that frees the robot's own parameters.",
        )
    limits = None
    if bounds is not None:
        for name in (*bounds.within, *bounds.between):
            if name in fixed.names(start):
                raise InputError(
                    "the parameter has bounds, and it is held",
                    parameter="bounds",
                    where=bounds_file,
                    came=name,
                    cure="Remove its bounds, or do not hold it.",
                )
        tried = start.with_effects(model.tried).parameters.values()
        limits = bound_vectors(bounds, free, bounds_file, tried)
    if redundancy == "none" and bounds is None and not fixed:
        raise InputError(
            "without priors, bounds and places that are held nothing tells base and joints apart",
            parameter="redundancy",
            came="none",
            cure="Give `bounds`, `hold` what is known, or use `redundancy=drop`, which holds what is redundant.",
        )
    return limits


def _not_shrunk(problem: Problem, solution: Solution, limits: tuple[Array, Array] | None) -> Solution:
    """Return a solution with the size that the priors say, where no length was measured.

    A robot that is smaller by a share makes all residuals smaller by that share. So such readings pull the size down by
    the sum of their squares, the more the more there are, although they do not know it: the target was at the fixture,
    and the joints were read. As a density of the joints a likelihood of n numbers is proportional to
    ``size^n exp(-size^2 chi^2 / 2)``, which is largest where the residuals are as large as declared, and so broad, by
    ``1 / sqrt(2 n)``, that the priors alone decide. They do along all directions of which the readings say nothing but
    what is in proportion to the residuals.
    """
    prior, evaluation = problem.free.prior, evaluated(problem, solution)
    is_length = np.concatenate([np.full(b.rows, b.observation.unit == "m") for b in problem.blocks])
    residual = np.where(is_length, evaluation.residual, 0.0)
    triangle = np.zeros((0, len(prior) + 1))
    for rows, part in evaluation.portions():
        both = np.column_stack([part.jacobian * prior, residual[rows]])
        triangle = np.asarray(np.linalg.qr(np.concatenate([triangle, both]), mode="r"), dtype=np.float64)
    A, r = triangle[:, :-1], triangle[:, -1]
    _, s, Vt = np.linalg.svd(A - np.outer(r, r @ A) / max(float(r @ r), 1e-300), full_matrices=True)
    unseen = Vt[int((s**2 > _UNSEEN).sum()) :]
    vector = solution.vector - prior * (unseen.T @ (unseen @ ((solution.vector - problem.free.nominal) / prior)))
    vector = vector if limits is None else np.clip(vector, *limits)
    return replace(solution, vector=vector, at=problem.at(vector))


def _begun_at(problem: Problem, near: Solved) -> Problem:
    """Return a problem that begins at the values and the noise of a solution."""
    known = dict(zip(near.problem.free.names, map(float, near.solution.vector), strict=True))
    values = {name: value for name, value in known.items() if name in problem.free.names}
    started = FreeParameters(tuple(replace(p, value=values.get(p.name, p.value)) for p in problem.free.parameters))
    return replace(
        problem,
        robot=problem.robot.with_values(values),
        free=started,
        noise=near.problem.noise,
        widened=near.problem.widened,
    )


def in_the_middle(robot: Robot, data: Dataset) -> Robot:
    """Return a robot that predicts what has no place in an order as in the middle of the session that was measured."""
    if data.number is None or LEFT not in robot.parameters:
        return robot
    return robot.with_values({LEFT: float(share_left(data.number, robot.values[RATE]).mean())})


def _check_dropped(dropped: list[str], free: FreeParameters, limits: tuple[Array, Array], where: str) -> None:
    for name, p, low, high in zip(free.names, free.parameters, *limits, strict=True):
        if name in dropped and not low <= p.nominal <= high:
            raise InputError(
                "the bounds exclude the nominal value of a redundant parameter, at which `redundancy=drop` holds it",
                where=f"{where}, {name}",
                cure="Leave this bound out, or use `redundancy=prior`.",
            )


def _limits_of(limits: tuple[Array, Array], free: FreeParameters, retained: FreeParameters) -> tuple[Array, Array]:
    places = [free.names.index(name) for name in retained.names]
    return limits[0][places], limits[1][places]


def _solve_with_noise(
    problem: Problem,
    loss: Loss,
    limits: tuple[Array, Array] | None,
    small: float,
    *,
    shared: bool,
    weighed: bool,
    near: Solved | None,
    rough: bool,
) -> tuple[Solution, Problem, Components | None, Sizes]:
    """Solve; then again with what the solution says of deviations, of the sizes of effects and of the loads.

    Deviations are estimated where they are not declared. Declared ones are widened where the residuals are larger than
    they, and errors of the joints that a visit's readings share, allow: believed to the letter, readings that the
    model cannot follow would overrule every prior, for the sake of directions that they hardly observe. Where the
    readings turn out not to tell a deviation, all is solved once more with it as it was declared, or assumed.
    """
    untold: frozenset[str] = frozenset()
    while True:
        result = _solve_in_rounds(
            problem, loss, limits, small, shared=shared, untold=untold, weighed=weighed, near=near, rough=rough
        )
        more = _untold(result[1], result[2]) - untold
        if not more:
            return result
        untold |= more


def _untold(problem: Problem, components: Components | None) -> frozenset[str]:
    """Return what estimated variances are counted under that the readings do not tell.

    Of declared deviations it is no estimate that would make them smaller.
    """
    if components is None:
        return frozenset()
    names, _ = factors_of(problem)
    determined = [
        problem.widened**2 * factor >= 1.0 if name == DECLARED else freedom >= _FEWEST_LEFT
        for name, factor, freedom in zip(
            names, components.weighing.factors.tolist(), components.freedom.tolist(), strict=True
        )
    ]
    return frozenset(
        name
        for name, estimated, is_determined in zip(names, components.estimated, determined, strict=True)
        if estimated and not is_determined
    )


def _solve_in_rounds(
    problem: Problem,
    loss: Loss,
    limits: tuple[Array, Array] | None,
    small: float,
    *,
    shared: bool,
    untold: frozenset[str],
    weighed: bool,
    near: Solved | None,
    rough: bool,
) -> tuple[Solution, Problem, Components | None, Sizes]:
    """Solve in rounds, with the deviations of what is `untold` as they are."""
    every, within = problem, limits
    sizes = Sizes.of(problem, every=weighed, near=None if near is None else near.sizes)
    known = near is not None and sizes.place.keys() == near.sizes.place.keys()
    if sizes:
        problem = replace(problem, free=sizes.fitted(problem.free))
        limits = _within(within, every.free, problem.free)
    before = None if near is None else near.components
    joints = np.zeros(len(problem.robot.joints)) if before is None else before.weighing.joints
    looking = bool(sizes) and not known  # at how large the effects are; from then on their sizes stay as they are
    step = _COARSE if looking or rough else small
    solution = solve_with_joints(problem, joints, loss, limits, step)
    steps = solution.steps
    components, hidden = before if known else None, False
    most = _ROUNDS + (_ROUNDS if sizes else 0)
    for number in range(most):
        if loss == "linear" and shared:
            components = estimated_components(problem, solution, limits, components, untold, each=weighed)
            hidden = looking and number == 0 and bool(np.any(components.weighing.joints > _NO_JOINT**2))
            if hidden:  # what effects do that have no size yet
                components = estimated_components(problem, solution, limits, untold=untold, joints=False)
            next_problem, change, joints = _with_components(problem, components, joints)
        else:
            next_problem, change = _with_scale(problem, solution, loss)
        values = dict(zip(problem.free.names, map(float, solution.vector), strict=True))
        started = FreeParameters(tuple(replace(p, value=values[p.name]) for p in problem.free.parameters))
        next_problem = replace(next_problem, robot=problem.robot.with_values(values), free=started)
        if looking:
            hold = components is not None and components.holds and joints.any()
            crowd = 1.0 if hold else max(1.0, problem.rows / (_COORDINATES * len(np.unique(problem.visits))))
            next_problem, sizes, more, joints = with_sizes(
                next_problem, every.free, sizes, joints, solution.weight, crowd
            )
            limits = _within(within, every.free, next_problem.free)
            change = max(change, more * _SETTLED / _SIZES_SETTLED)
        agree = _LOADS_ARE_NEAR if looking else _LOADS_AGREE
        if change < _SETTLED and _load_shift(problem, next_problem) < agree:
            if rough or not looking:
                break
            looking, step = False, small
        if hidden or len(next_problem.free.names) > len(problem.free.names):
            components = None  # with curves it is asked again whether the joints err
        problem = next_problem
        if number == most - _ROUNDS:
            looking, step = False, _COARSE if rough else small
        solution = solve_with_joints(problem, joints, loss, limits, step)
        steps += solution.steps
    return replace(solution, steps=steps), problem, components, sizes


def _within(
    limits: tuple[Array, Array] | None, free: FreeParameters, retained: FreeParameters
) -> tuple[Array, Array] | None:
    return None if limits is None else _limits_of(limits, free, retained)


def solve_with_joints(
    problem: Problem,
    joints: Array,
    loss: Loss,
    limits: tuple[Array, Array] | None,
    small: float,
) -> Solution:
    """Solve with the variances of the joints' errors as they are; residual and Jacobian are the readings' own."""
    if not joints.any():
        return solve(problem, loss, limits, small)
    shared = problem.at(problem.free.start).by_joints * np.sqrt(joints)
    solution = solve(WhitenedProblem(problem, Whitening(Visits(problem.visits), shared)), loss, limits, small)
    return replace(solution, at=problem.at(solution.vector))


def evaluated(problem: Problem, solution: Solution) -> Evaluation:
    """Return the problem at its solution."""
    return solution.at if isinstance(solution.at, Evaluation) else problem.at(solution.vector)


def estimated_components(
    problem: Problem,
    solution: Solution,
    limits: tuple[Array, Array] | None,
    before: Components | None = None,
    untold: frozenset[str] = frozenset(),
    *,
    each: bool = False,
    joints: bool = True,
) -> Components:
    """Estimate the variances of readings and joints at a solution, those of :func:`factors_of` and of joints.

    Joints of a kind are alike, or `each` is by itself, where every effect is in the model. Or no joint errs, without
    `joints`.

    Declared deviations are widened if residuals are larger than chance allows (1 in 1000), or were before. Variances
    that are `untold` stay as they are.
    """
    names, of_row = factors_of(problem)
    uncertain = ~bound_by(solution, problem.free, limits)
    prior = problem.free.prior
    evaluation = evaluated(problem, solution)
    at = Linearised(
        residual=solution.residual,
        by_parameters=lambda: (
            (rows, part.jacobian[:, uncertain] * prior[uncertain]) for rows, part in evaluation.portions()
        ),
        by_joints=evaluation.by_joints,
        offset=((solution.vector - problem.free.nominal) / prior)[uncertain],
        priors=problem.priors,
        visits=Visits(problem.visits),
        standings=Visits(problem.standings),
        factor=of_row,
        triangle=evaluation.triangle[:, uncertain] * prior[uncertain],
    )
    kinds = np.array([joint.kind for joint in problem.robot.joints])
    alike = [np.flatnonzero(kinds == kind) for kind in dict.fromkeys(kinds.tolist())]
    if each:
        alike = [np.array([i]) for i in range(len(kinds))]
    alike = alike if joints else []
    free = [name not in (DECLARED, SETUP, *untold) for name in names]
    least = np.array(
        [(NOISE_FLOOR / problem.noise[n]) ** 2 if f else _LEAST_WIDENED for f, n in zip(free, names, strict=True)]
    )
    if before is not None:
        components = variance_components(at, before.estimated, least, alike, before)
    else:
        components = variance_components(at, free, least, alike)
        if DECLARED in names and DECLARED not in untold:
            place = names.index(DECLARED)
            if beyond_chance(float(components.squares[place]), max(float(components.freedom[place]), 1e-3)):
                free[place] = True
                components = variance_components(at, free, least, alike)

    def worth() -> tuple[Array, tuple[CovariancePart, ...]]:
        covariance, parts = components.worth
        whole = CovariancePart(covariance, np.inf).among(uncertain).covariance
        return whole, tuple(part.among(uncertain) for part in parts)

    return replace(components, found_worth=worth)


def factors_of(problem: Problem) -> tuple[list[str], NDArray[np.intp]]:
    """Return what the variances of readings are counted under, and the index of that for each equation.

    Each observation without declared deviations, all that are declared together, and what is known of fixtures.
    """
    of_block = [
        DECLARED if block.declared and problem.kind(block) != SETUP else problem.kind(block) for block in problem.blocks
    ]
    names = list(dict.fromkeys(of_block))
    sizes = [block.rows for block in problem.blocks]
    return names, np.repeat(np.array([names.index(name) for name in of_block], dtype=np.intp), sizes)


def bound_by(solution: Solution, free: FreeParameters, limits: tuple[Array, Array] | None) -> NDArray[np.bool_]:
    """Return which parameters stopped at a bound, ``(parameters,)``."""
    if limits is None:
        return np.zeros(len(solution.vector), dtype=bool)
    near = 1e-9 * free.prior
    return np.asarray((solution.vector <= limits[0] + near) | (solution.vector >= limits[1] - near))


def _with_components(problem: Problem, components: Components, joints: Array) -> tuple[Problem, float, Array]:
    """Return the problem with the deviations found, how much these changed, and the variances of the joints' errors."""
    names, _ = factors_of(problem)
    noise, widened = dict(problem.noise), problem.widened
    for name, factor in zip(names, components.weighing.factors.tolist(), strict=True):
        if name == DECLARED:
            widened = max(1.0, widened * factor**0.5)
        elif name != SETUP:
            noise[name] = max(noise[name] * factor**0.5, NOISE_FLOOR)
    next_problem = replace(problem, noise=noise, widened=widened)
    before, after = np.sqrt(joints), np.sqrt(components.weighing.joints)
    change = float(np.max(np.abs(after - before) / np.maximum(np.maximum(after, before), 1e-300), initial=0.0))
    return next_problem, max(change, _noise_change(problem, next_problem)), components.weighing.joints


def _with_scale(problem: Problem, solution: Solution, loss: Loss) -> tuple[Problem, float]:
    """Return the problem with the robust deviations of the residuals, and how much these changed."""
    undeclared = {problem.kind(b) for b in problem.blocks if not b.declared}
    noise = dict(problem.noise)
    estimates = estimated_noise(problem, solution, loss)
    known = {name: estimates[name] for name in estimates if name not in undeclared}
    wider = excess_of(known) if known and not problem.data.anchored else 1.0
    for name, (estimate, _) in estimates.items():
        if name in undeclared:
            noise[name] = max(estimate * noise[name], NOISE_FLOOR)
    next_problem = replace(problem, noise=noise, widened=problem.widened * wider)
    return next_problem, _noise_change(problem, next_problem)


def _noise_change(before: Problem, after: Problem) -> float:
    """Return the largest relative change of a deviation."""
    changes = [abs(float(np.log(after.noise[name] / before.noise[name]))) for name in before.noise]
    return max(*changes, after.widened / before.widened - 1.0, 0.0)


def _load_shift(before: Problem, after: Problem) -> float:
    """Return how far joint variables move if the loads are those of another solution [rad or m]."""
    if before.postures.loads is None:
        return 0.0
    values = after.robot.values
    moved = after.robot.variables(after.postures, values) - after.robot.variables(before.postures, values)
    return float(np.abs(moved).max())


def estimated_noise(problem: Problem, solution: Solution, loss: Loss) -> dict[str, tuple[float, float]]:
    """Return for each observation the deviation of its whitened residuals, and the degrees of freedom behind it."""
    kinds = np.concatenate([[problem.kind(b)] * b.rows for b in problem.blocks])
    components = weighed_together(loss, problem.components)
    of_norms = kinds[np.cumsum(components) - 1]
    norms = norms_of(solution.residual, components)
    spent = informed_rows(problem, solution)
    estimates = {}
    for name in dict.fromkeys(kinds.tolist()):
        if name == SETUP:
            continue
        of_kind = solution.residual[kinds == name]
        freedom = len(of_kind) * max(1.0 - spent / problem.rows, 1e-3)
        if loss == "linear":
            estimates[name] = (float(np.sqrt(np.sum(of_kind**2) / freedom)), freedom)
        else:
            of_name = of_norms == name
            scale = scale_of(loss, norms[of_name], components[of_name], spent * float(of_name.mean()))
            if spent > _LARGEST_SHARE_SPENT * problem.rows:
                scale = max(scale, 1.0)  # nearly all are met whatever the noise: it stays as it was assumed
            estimates[name] = (scale, freedom)
    return estimates


def assumed_noise(problem: Problem, components: Components | None, spent: float) -> tuple[str, ...]:
    """Return the observations whose deviation is neither declared nor told by the readings: it is as assumed.

    Args:
        spent: As :func:`informed_rows` returns it.
    """
    names, _ = factors_of(problem)
    undeclared = [name for name in names if name not in (DECLARED, SETUP)]
    if components is not None:
        estimated = dict(zip(names, components.estimated, strict=True))
        return tuple(name for name in undeclared if not estimated[name])
    met = spent > _LARGEST_SHARE_SPENT * problem.rows
    return tuple(name for name in undeclared if met and problem.noise[name] == _FIRST_NOISE[name])


def informed_rows(problem: Problem, solution: Solution) -> float:
    """Return how many parameters' worth of residual the fit used up."""
    prior = problem.free.prior
    if not problem.priors:
        return float(len(prior))
    s2 = np.linalg.svd(evaluated(problem, solution).triangle * prior, compute_uv=False) ** 2
    return float(np.sum(s2 / (s2 + 1.0)))


def excess_of(noise: dict[str, tuple[float, float]]) -> float:
    """Return the ratio of residuals to declared deviations if it is too large for chance (1 in 1000), else 1."""
    freedom = sum(dof for _, dof in noise.values())
    ratio = sum(deviation**2 * dof for deviation, dof in noise.values()) / freedom
    return float(np.sqrt(ratio)) if beyond_chance(ratio * freedom, freedom) else 1.0
