"""What would explain what a fit leaves: joint effects, free geometry, or a payload, by a linear estimate.

Near the solution of a fit, what an effect does to the readings is its derivative where it does nothing. What the free
parameters can take is taken out of the residuals and of these columns (Frisch and Waugh 1933, "Partial time regressions
as compared with individual trends"). The effect is then found from nine tenths of the configurations and judged on the
last tenth, ten times over, so that what is gained is gained on readings that the estimate has not seen. Chance may
still show a gain: of many effects the one that chance likes best is tried. So the share that an effect explains is also
held against that of as many columns of noise, with three equations a configuration at most.

A payload is found together with the compliances that it bends: their products with it are not linear, but of so few
unknowns that a few steps on sums of products cost nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.limits import limit
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import OBSERVATIONS
from truearm.engine.fit.every_effect import open_effects
from truearm.engine.fit.fit import Fit
from truearm.engine.fit.problem import Problem
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.compliance import Compliance
from truearm.engine.robot.effects.fourier import Fourier
from truearm.engine.robot.effects.joint_curve import JointCurve
from truearm.engine.robot.loads import has_weight, joint_loads
from truearm.engine.robot.parameters import FreeParameters, Parameter
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot

#: Share of the squares of a residual that rounding leaves where parameters explain all of it.
_ALL_EXPLAINED: Final = 1e-12
#: Among the codes of `Rule.unless`: an error of the data, or another robot; and wrong readings that pulled the fit
#: away, which then leaves much and expects much, whatever the model and wherever was measured.
WRONG_DATA: Final = "wrong data"
PULLED_AWAY: Final = "readings that pulled the fit away"


@dataclass(frozen=True, eq=False)
class LeftOver:
    """The whitened residuals of a fit on readings, linearised at its solution."""

    fit: Fit  #: What left them.
    problem: Problem  #: The readings; what is known of fixtures is left out.
    residual: Array  #: ``(rows,)``.
    jacobian: Array  #: Derivative by the free parameters, ``(rows, parameters)``.
    basis: Array  #: Orthonormal directions of residuals that the free parameters can take, ``(rows, rank)``.
    strength: Array  #: Singular values of the Jacobian per prior, of those directions, ``(rank,)``.
    turns: Array  #: Directions of the parameters per prior that belong to them, ``(rank, parameters)``.
    asked: Dataset  #: The readings asked about.
    #: Which of their configurations these are: all, or of very many as many as the limit of derivatives has room for,
    #: evenly spaced.
    chosen: NDArray[np.intp]

    @classmethod
    def of(cls, fit: Fit, data: Dataset) -> LeftOver:
        """Linearise a fit on readings, those it was not made from too."""
        noise = {observation.name: fit.sigma.get(observation.name, 1.0) for observation in OBSERVATIONS}
        problem, chosen = _in_part(Problem(fit.robot, replace(data, setup=None), fit.free, noise))
        r, J = problem.linearised(np.array([fit.robot.values[name] for name in fit.free.names]))
        # Of the square triangle, which is small, instead of the whole Jacobian.
        Q, R = np.linalg.qr(J * fit.free.prior)
        R = _without_size(R, Q.T @ r, float(r @ r)) if len(r) > len(fit.free.names) else R
        U, s, Vt = np.linalg.svd(R, full_matrices=False)
        significant = s > 1e-8 * s[0]
        return cls(fit, problem, r, J, Q @ U[:, significant], s[significant], Vt[significant], data, chosen)

    def without(self, configurations: Sequence[int]) -> LeftOver:
        """Return what is left without some configurations; the parameters stay, and take what they can of the rest."""
        if not configurations:
            return self
        rows = ~np.isin(self.configuration, np.array(configurations, dtype=np.intp))
        data = self.problem.data
        remaining = np.setdiff1d(np.arange(data.configurations), np.array(configurations, dtype=np.intp))
        return replace(
            self,
            problem=replace(self.problem, data=data.of_configurations(remaining)),
            residual=self.residual[rows],
            jacobian=self.jacobian[rows],
            basis=np.linalg.qr(self.basis[rows])[0],
            chosen=self.chosen[remaining],
        )

    @property
    def freedom(self) -> int:
        """Number of equations that are left when the parameters have taken what they can."""
        return len(self.residual) - int(self.basis.shape[1])

    def without_parameters(self, rows: Array) -> Array:
        """Return rows ``(rows,)`` or ``(rows, k)`` without what the free parameters can take."""
        return np.asarray(rows - self.basis @ (self.basis.T @ rows))

    @property
    def configuration(self) -> NDArray[np.intp]:
        """Configuration of each equation, ``(rows,)``."""
        return np.concatenate(
            [
                np.repeat(self.problem.data.configuration[block.readings], block.observation.components)
                for block in self.problem.blocks
            ]
        )


def _in_part(problem: Problem) -> tuple[Problem, NDArray[np.intp]]:
    """Return a problem with as many of its configurations as the limit of derivatives has room for, and which."""
    n = number = problem.data.configurations
    chosen, part, most = np.arange(n), problem, limit("derivatives")
    while number > 1 and (count := part.rows * len(part.free.names)) > most:
        number = max(1, min(number - 1, number * most // count))
        chosen = np.linspace(0, n - 1, number).round().astype(np.intp)
        part = replace(problem, data=problem.data.of_configurations(chosen))
    return part, chosen


def _without_size(R: Array, c: Array, square: float) -> Array:
    """Return the triangle of a Jacobian without the direction that shrinks everything, where no length was measured.

    Of a tip that is held at points the residual is then a length like any other: a robot without size would leave
    nothing. That is no explanation.

    Args:
        R, c: Triangle of the Jacobian per prior, and the part of the residual that its columns span.
        square: Sum of the squares of the residual.
    """
    if square == 0.0 or square - float(c @ c) > _ALL_EXPLAINED * square:
        return R
    size = np.linalg.lstsq(R, c, rcond=1e-12)[0]
    return np.asarray(R - np.outer(R @ size, size) / float(size @ size))


def chi_squared_tail(x: float, freedom: int) -> float:
    """Return the probability that chi squared of so many degrees of freedom is larger than x."""
    tail, k = (math.erfc(math.sqrt(x / 2.0)), 1) if freedom % 2 else (math.exp(-x / 2.0), 2)
    while k < freedom:
        tail += math.exp(k / 2.0 * math.log(max(x, 1e-300) / 2.0) - x / 2.0 - math.lgamma(k / 2.0 + 1.0))
        k += 2
    return tail


#: What frees the geometry and the joint zeros, and what is found of a payload.
GEOMETRY: Final = "geometry"
PAYLOAD: Final = "payload"
LOADS: Final = "loads"
#: Configurations looked at, evenly spaced; more would take longer and tell nothing new.
_MOST: Final = 150
_FOLDS: Final = 10
#: Share of what a fit leaves, as a root mean square, that must go for an effect to be named.
_LEAST_GAIN: Final = 0.05
#: Gain over its standard error, over the folds.
_LEAST_DEVIATIONS: Final = 2.0
#: An effect is believed if chance would explain as much with any of those tried less often than this.
_LARGEST_CHANCE: Final = 1e-3
#: Equations beyond the parameters, of three a configuration at most, without which nothing is said; and as a share of
#: the parameters: a fit of almost as many parameters as equations leaves nothing that could be explained.
_LEAST_FREEDOM: Final = 12
_LEAST_SHARE: Final = 0.5
#: A cause that is more likely beforehand is preferred if it gains so large a share of what the best one does. Every arm
#: gives way, and what else it does is seen better after that.
_AS_GOOD: Final = {GEOMETRY: 0.5, "compliance": 0.5, LOADS: 0.85, PAYLOAD: 0.85}
LIKELY: Final = frozenset(_AS_GOOD)
#: Share that an effect leaves, as a root mean square, from which on it hides no more what else is wrong.
HIDING: Final = 0.7
#: No arm carries more than this share of its own mass; where more comes out, its mass is not told.
_LARGEST_PAYLOAD: Final = 0.7
_STEPS: Final = 30
_FINAL_STEP: Final = 1e-6
#: What a payload may be [kg], and its moment [kg m], before anything is known.
_MASS_PRIOR: Final = 10.0
_MOMENT_PRIOR: Final = 2.0
#: The centre of gravity of a payload lies within this of the flange [m].
_FARTHEST_COG: Final = 1.0


@dataclass(frozen=True)
class Explanation:
    """What would explain what a fit leaves."""

    #: Name of a joint effect; ``geometry`` for the geometry and the joint zeros; ``payload``; or ``loads`` where the
    #: joints give way under loads that the robot file does not know.
    cause: str
    #: Root mean square that is left with it, over that without it, on configurations that the estimate has not seen.
    left: float
    chance: float  #: Probability that noise alone shows as much with any of the causes tried.
    mass: float = 0.0  #: Of the payload [kg]; zero for other causes, and where it cannot be told.
    #: Root mean square likewise with all joint effects that were tried, not with the cause alone; None where that says
    #: no more.
    together: float | None = None


def without_bending(left: LeftOver, *causes: str) -> LeftOver:
    """Return what a fit leaves when geometry and joints that give way have taken what they can, whatever loads them.

    Causes of more derivatives than there may be are left out.

    Args:
        causes: What may take its part besides.
    """
    causes = (GEOMETRY, Compliance.name, LOADS, *causes)
    problem = replace(left.problem, free=FreeParameters(()))
    robot, groups = _candidates(left, problem, causes)
    most = min(limit("parameters"), limit("derivatives") // problem.rows)
    taken: list[Parameter] = []
    for cause in dict.fromkeys(causes):
        more = groups.get(cause, ())
        taken += more if len(taken) + len(more) <= most else ()
    free = FreeParameters(tuple(taken))
    if not free.parameters:
        return left
    J = replace(problem, robot=robot, free=free).at(free.start).jacobian * free.prior
    columns = left.without_parameters(J)
    U, s, _ = np.linalg.svd(columns, full_matrices=False)
    return replace(left, basis=np.concatenate([left.basis, U[:, s > 1.0]], axis=1))


@dataclass(frozen=True, eq=False)
class _Residual:
    """What a fit leaves of some configurations."""

    problem: Problem  #: The readings, without any parameter.
    residual: Array  #: ``(rows,)``, without what the free parameters can take.
    basis: Array  #: Orthonormal directions that they can take, ``(rows, rank)``.
    fold: NDArray[np.intp]  #: Fold of each row, ``(rows,)``.
    configuration: NDArray[np.intp]  #: Of each row, ``(rows,)``.

    def without_parameters(self, columns: Array) -> Array:
        """Return columns without what the free parameters can take."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))


def explanation(left: LeftOver, without: Sequence[int] = ()) -> Explanation | None:
    """Return what best explains what a fit leaves, None if nothing does by more than chance.

    Args:
        without: Configurations of the dataset that are left out of account.
    """
    robot, groups = _candidates(left, left.problem)
    some = _some(left, without, groups)
    freedom = _freedom(left, some)
    if not _is_enough(left, freedom):
        return None
    residual = _residual_of(left, some)
    total = float(residual.residual @ residual.residual)
    if total <= 0.0:
        return None
    causes = []
    for together in _at_once(groups):
        free = FreeParameters(tuple(p for cause in together for p in groups[cause]))
        problem = replace(residual.problem, robot=robot, free=free)
        if residual.problem.postures.loads is not None:  # effects that do nothing yet leave the loads as they are
            problem.__dict__["postures"] = residual.problem.postures
        J = problem.at(free.start).jacobian * free.prior
        columns = residual.without_parameters(J)
        places = {p.name: i for i, p in enumerate(free.parameters)}
        for cause in together:
            causes.append((cause, columns[:, [places[p.name] for p in groups[cause]]], 0.0))
    causes += _payload(left, residual)
    judged = [e for e in (_judged(residual, *tried, freedom, len(causes)) for tried in causes) if e is not None]
    if not judged:
        return None
    best = min(judged, key=lambda e: e.left)
    likely = [(e, share) for cause, share in _AS_GOOD.items() for e in judged if e.cause == cause]
    found = next((e for e, share in likely if 1.0 - e.left >= share * (1.0 - best.left)), best)
    effects = [columns for cause, columns, _ in causes if cause not in (GEOMETRY, LOADS, PAYLOAD)]
    if found.cause in (GEOMETRY, LOADS, PAYLOAD) or len(effects) < 2:
        return found
    every = _judged(residual, found.cause, np.concatenate(effects, axis=1), 0.0, freedom, len(causes))
    return found if every is None or every.left >= found.left else replace(found, together=every.left)


def can_explain(left: LeftOver) -> bool:
    """Return whether there are enough readings to tell what would explain what a fit leaves."""
    return _is_enough(left, _freedom(left, _some(left, (), _candidates(left, left.problem)[1])))


def _freedom(left: LeftOver, some: NDArray[np.intp]) -> int:
    """Return the number of equations beyond the parameters, of three a configuration at most."""
    return int(np.minimum(np.bincount(left.configuration)[some], 3).sum()) - int(left.basis.shape[1])


def _is_enough(left: LeftOver, freedom: int) -> bool:
    return bool(freedom >= max(_LEAST_FREEDOM, _LEAST_SHARE * left.basis.shape[1]))


def _some(left: LeftOver, without: Sequence[int], groups: Mapping[str, tuple[Parameter, ...]]) -> NDArray[np.intp]:
    """Return the configurations looked at: no more than the derivatives by all that is tried have room for."""
    seen = np.setdiff1d(np.unique(left.configuration), np.array(without, dtype=np.intp))
    tried = max(1, sum(len(parameters) for parameters in groups.values()))
    most = min(_MOST, limit("derivatives") // (tried * int(np.bincount(left.configuration).max())))
    return seen if len(seen) <= most else seen[np.linspace(0, len(seen) - 1, most).round().astype(np.intp)]


def _at_once(groups: Mapping[str, tuple[Parameter, ...]]) -> Iterator[list[str]]:
    """Go through causes in parts of no more parameters than may be free together; one of more is left out."""
    most, part, count = limit("parameters"), list[str](), 0
    for cause, parameters in groups.items():
        if len(parameters) > most:
            continue
        if part and count + len(parameters) > most:
            yield part
            part, count = [], 0
        part.append(cause)
        count += len(parameters)
    if part:
        yield part


def _residual_of(left: LeftOver, some: NDArray[np.intp]) -> _Residual:
    """Return what a fit leaves of some configurations."""
    data = left.problem.data
    rows = np.isin(left.configuration, some)
    part = data if len(some) == data.configurations else data.of_configurations(some)
    noise = {observation.name: left.fit.sigma.get(observation.name, 1.0) for observation in OBSERVATIONS}
    problem = Problem(left.fit.robot, replace(part, setup=None), FreeParameters(()), noise)
    Q, r = left.basis, left.residual
    if not rows.all():
        Q, r = np.linalg.qr(Q[rows])[0], r[rows]
    place = np.searchsorted(some, left.configuration[rows])
    order = np.random.default_rng(0).permutation(len(some))
    return _Residual(problem, r - Q @ (Q.T @ r), Q, (order % _FOLDS)[place], place)


def _candidates(
    left: LeftOver, problem: Problem, asked: Sequence[str] | None = None
) -> tuple[Robot, dict[str, tuple[Parameter, ...]]]:
    """Return the causes that are tried, each with its parameters, and a robot that has them all.

    Args:
        asked: The causes that are wanted; all of them if None.
    """
    fit = left.fit
    robot = fit.robot
    freed = set(fit.free.names) | {r.dropped for r in fit.redundancies}
    own = [effect.name for effect in robot.effects if any(p.name in freed for p in effect.parameters)]
    closed = [*own, *fit.model.tried]
    if JointCurve.name in (*own, *fit.model.effects):
        closed += [JointCurve.name, Fourier.name]  # the curves contain it, and found what there is
    unloaded = not has_weight(robot) and problem.data.wrench is None
    names = open_effects(robot, closed, problem.data)
    if unloaded and "compliance" not in closed:
        robot, names = replace(robot, payload=Payload(1.0)), [*names, "compliance"]
    if asked is not None:
        names = [name for name in names if name in asked or (name == "compliance" and LOADS in asked)]
    robot = robot.with_effects(names)
    groups: dict[str, tuple[Parameter, ...]] = {}
    if not {"joint zero", "geometry"} <= set(fit.model.groups):
        groups[GEOMETRY] = tuple(
            p for p in robot.parameters.values() if p.group in ("joint zero", "geometry") and p.name not in freed
        )
    for name in names:
        cause = LOADS if unloaded and name == "compliance" else name
        groups[cause] = tuple(p for p in robot.parameters.values() if p.group == name)
    return robot, {cause: parameters for cause, parameters in groups.items() if parameters}


def _judged(
    residual: _Residual, cause: str, columns: Array, mass: float, freedom: int, tried: int
) -> Explanation | None:
    """Return what columns explain of the residuals, None if it is too little or chance.

    Args:
        columns: Per prior and without what the free parameters can take, ``(rows, k)``.
        mass: Of a payload [kg].
    """
    r, (rows, k) = residual.residual, columns.shape
    # The smaller of two systems: (A'A + c)^-1 A' = A' (AA' + c)^-1. Their eigenvalues differ by zeros alone.
    products = columns.T @ columns if k <= rows else columns @ columns.T
    ridge = 1.0 + 1e-9 * np.trace(products)
    system = products + ridge * np.eye(len(products))
    # What a fold is off by, estimated from the others, follows from one solution for all (Allen 1974, "The relationship
    # between variable selection and data augmentation and a method for prediction"): no system for each fold.
    parts = [np.flatnonzero(residual.fold == fold) for fold in range(_FOLDS)]
    if k <= rows:
        spread = np.linalg.solve(system, columns.T)
        left = r - columns @ (spread @ r)
        own = [np.eye(len(p)) - columns[p] @ spread[:, p] for p in parts]
    else:
        of_rows = ridge * np.linalg.inv(system)  # 1 - A (A'A + c)^-1 A'
        left = of_rows @ r
        own = [of_rows[np.ix_(p, p)] for p in parts]
    unseen = [np.linalg.solve(of, left[p]) for of, p in zip(own, parts, strict=True)]
    gains = np.array([float(r[p] @ r[p] - e @ e) for p, e in zip(parts, unseen, strict=True)])  # of squares
    total = float(r @ r)
    gain = float(gains.sum())
    error = math.sqrt(_FOLDS) * float(gains.std(ddof=1))
    remaining = math.sqrt(max(1.0 - gain / total, 0.0))
    if remaining > 1.0 - _LEAST_GAIN or gain < _LEAST_DEVIATIONS * error:
        return None
    share = min(1.0 - float(left @ left) / total, 1.0 - 1e-12)
    rank = int(np.linalg.matrix_rank(products, tol=1.0, hermitian=True))
    if freedom <= rank + _LEAST_FREEDOM // 2:
        return None
    # F of two mean squares, times its numerator's freedom, as chi squared: the denominator has many degrees.
    f = share / (1.0 - share) * (freedom - rank)
    chance = min(1.0, tried * chi_squared_tail(max(f, 0.0), max(rank, 1)))
    return Explanation(cause, remaining, chance, mass) if chance < _LARGEST_CHANCE else None


def _payload(left: LeftOver, residual: _Residual) -> Iterator[tuple[str, Array, float]]:
    """Try another payload, where compliances are free and links weigh something, as these tell them apart."""
    fit = left.fit
    robot, free = fit.robot, fit.free
    springs = [f"compliance_{i + 1}" for i in range(len(robot.joints))]
    if not all(name in robot.parameters for name in springs) or not any(link.mass for link in robot.masses):
        return
    free_springs = [i for i, name in enumerate(springs) if name in free.names]
    if not free_springs:
        return
    fixed = [k for k, name in enumerate(free.names) if name not in springs]
    rows = np.isin(left.configuration, _places(left, residual))
    Q = np.linalg.qr((left.jacobian[:, fixed] * free.prior[fixed])[rows])[0]
    evaluation = residual.problem.at(np.zeros(0))
    variables = robot.variables(residual.problem.postures, robot.values)
    bodies = [Payload(1.0), *(Payload(1.0, _unit(k)) for k in range(3))]
    unit = np.array([_turning(robot, replace(robot, masses=(), payload=body), variables) for body in bodies])
    unit[1:] -= unit[0]  # of the moment alone
    of_rows, by = residual.configuration, evaluation.by_joints
    loads = residual.problem.postures.joint_loads
    lever = np.array([loads[i, 5 if robot.joints[i].kind == "revolute" else 2] for i in range(len(robot.joints))])
    own = by * lever[:, of_rows].T  # (rows, joints)
    added = by[:, :, None] * np.moveaxis(unit[:, :, of_rows], (0, 1, 2), (2, 1, 0))  # (rows, joints, 4)
    count = len(robot.joints)
    columns = np.concatenate([own[:, free_springs], added.reshape(len(by), 4 * count)], axis=1)
    r = left.residual[rows]
    columns -= Q @ (Q.T @ columns)
    r = r - Q @ (Q.T @ r)
    start = np.array([robot.values[name] for name in springs])
    prior = np.array([robot.parameters[name].prior for name in springs])
    solution = _bilinear(columns.T @ columns, columns.T @ r, free_springs, start, prior)
    if solution is None:
        return
    compliance, load = solution
    mass = robot.payload.mass + float(load[0])
    # The moment is that of what is added to the payload.
    moment = robot.payload.mass * np.array(robot.payload.cog) + load[1:]
    if mass <= 0.0 or float(np.linalg.norm(moment)) > _FARTHEST_COG * mass:
        return
    if mass > _LARGEST_PAYLOAD * sum(link.mass for link in robot.masses):
        mass = 0.0
    scale = np.array([_MASS_PRIOR, *[_MOMENT_PRIOR] * 3])
    together = np.einsum("rja,j->ra", added, compliance) * scale
    yield PAYLOAD, residual.without_parameters(together), mass


def _places(left: LeftOver, residual: _Residual) -> NDArray[np.intp]:
    """Return the configurations of the dataset that a remainder is of."""
    labels = residual.problem.data.labels
    known = {label: i for i, label in enumerate(left.problem.data.labels)}
    return np.array([known[label] for label in labels], dtype=np.intp)


def _unit(axis: int) -> tuple[float, float, float]:
    return (float(axis == 0), float(axis == 1), float(axis == 2))


def _turning(robot: Robot, loaded: Robot, variables: Array) -> Array:
    """Return what the load of another robot turns each joint by [N m], or pushes it [N], ``(joints, n)``."""
    loads = joint_loads(loaded, variables)
    return np.array([loads[i, 5 if joint.kind == "revolute" else 2] for i, joint in enumerate(robot.joints)])


def _bilinear(G: Array, g: Array, free_springs: list[int], start: Array, prior: Array) -> tuple[Array, Array] | None:
    """Return compliances ``(joints,)`` and what to add to a payload: mass and moment ``(4,)``; None if nothing fits.

    The residual is ``r + sum_i own_i (c_i - start_i) + sum_i c_i added_i p``, and its sums of products are given.

    Args:
        G, g: Columns times columns, and times the residual; own columns of the free joints first, then four of each
            joint.
        free_springs: The joints whose compliance is free.
    """
    count, k = len(start), len(free_springs)
    c, p = start.copy(), np.zeros(4)
    scale = np.array([_MASS_PRIOR, *[_MOMENT_PRIOR] * 3])

    def weights(c: Array, p: Array) -> Array:
        return np.concatenate([(c - start)[free_springs], np.outer(c, p).reshape(-1)])

    def cost(c: Array, p: Array) -> float:
        w = weights(c, p)
        springs = ((c / prior)[free_springs] ** 2).sum()
        return float(w @ G @ w + 2.0 * w @ g + springs + ((p / scale) ** 2).sum())

    current = cost(c, p)
    for _ in range(_STEPS):
        D = np.zeros((k + 4 * count, k + 4))
        D[:k, :k] = np.eye(k)
        for place, i in enumerate(free_springs):
            D[k + 4 * i : k + 4 * i + 4, place] = p
        for i in range(count):
            D[k + 4 * i : k + 4 * i + 4, k:] = c[i] * np.eye(4)
        w = weights(c, p)
        weight = np.concatenate([1.0 / prior[free_springs] ** 2, 1.0 / scale**2])
        slope = D.T @ (G @ w + g) + weight * np.concatenate([c[free_springs], p])
        size = np.concatenate([prior[free_springs], scale])
        H = (D.T @ G @ D + np.diag(weight)) * np.outer(size, size)
        step = -size * np.linalg.solve(H, slope * size)
        for shorter in (1.0, 0.5, 0.25, 0.1, 0.01):
            c_next, p_next = c.copy(), p + shorter * step[k:]
            c_next[free_springs] += shorter * step[:k]
            next_cost = cost(c_next, p_next)
            if next_cost < current:
                break
        else:
            break
        smaller = current - next_cost
        c, p, current = c_next, p_next, next_cost
        if smaller < _FINAL_STEP * max(current, 1.0):
            break
    return (c, p) if np.isfinite(p).all() and p.any() else None
