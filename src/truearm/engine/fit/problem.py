"""The whitened residual of a robot on a dataset, its Jacobian, and parameters that cannot be told apart."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.base.limits import limit, refuse_beyond
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.dataset_fields import drawn_from
from truearm.engine.data.observations import OBSERVATIONS, Observation, Sighting, compared
from truearm.engine.data.parting import postures_of
from truearm.engine.fit.fixed_places import NOTHING_FIXED, FixedPlaces
from truearm.engine.robot.chain import Array, ForwardKinematics, together
from truearm.engine.robot.parameters import (
    SCALE,
    FreeParameters,
    Parameter,
    by_parameters,
    by_parameters_together,
    effect_rates,
)
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot

# Every residual is divided by its standard deviation before it is stacked, so metres never meet radians; a prior is
# one more row, (value - nominal) / deviation.

#: What the residuals of readings of the fixtures themselves are called.
SETUP: Final = "setup"
#: Derivatives that are in memory at once where those of all readings are not needed together.
_AT_ONCE: Final = 2_000_000

#: Deviation that readings are taken to have at least [m, rad].
NOISE_FLOOR: Final = 1e-9
#: Equations of a problem, all of them or those with these indices.
Rows = slice | NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Block:
    """The readings of one observation kind of one target from one fixture: consecutive rows of the problem."""

    observation: Observation  #: What is compared.
    data: Dataset  #: Where the readings are: the problem's data, or what is known of its fixtures.
    target: str  #: Name of the target; of a fixture in what is known of fixtures.
    fixture: str | None  #: Name of the fixture it is measured against; None for the instrument's frame.
    readings: NDArray[np.intp]  #: Indices into `data`, ``(k,)``.
    #: Index of the configuration of each reading; all of them at once, which costs no copy, where the target was read
    #: at every one in order.
    configurations: NDArray[np.intp] | slice
    sigma: Array  #: Standard deviation of each reading [m or rad], ``(k,)``.

    @property
    def declared(self) -> bool:
        """Whether the file declares the deviations."""
        return self.observation.declared_sigma(self.data) is not None

    @property
    def rows(self) -> int:
        """Number of equations."""
        return len(self.readings) * self.observation.components


@dataclass(frozen=True, eq=False)
class Problem:
    """Readings, a robot and the parameters that may change."""

    robot: Robot  #: Gives the value of every parameter that is not free.
    data: Dataset  #: The readings; each target must be known to the robot.
    free: FreeParameters  #: What the solver changes.
    noise: dict[str, float]  #: Standard deviation [m or rad] by observation name, for readings that declare none.
    priors: bool = True  #: Whether the parameters' priors are rows of the problem.
    widened: float = 1.0  #: How many times larger than declared the deviations of the readings are taken.

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """The readings, by target, fixture and observation; then what is known of the fixtures."""
        parts = [self.data] if self.data.setup is None else [self.data, self.data.setup]
        return tuple(block for part in parts for block in self._blocks_of(part))

    def _blocks_of(self, data: Dataset) -> Iterator[Block]:
        for target, fixture, observation, readings in compared(data):
            sigma = observation.declared_sigma(data)
            wider = self.widened if data is self.data else 1.0
            known = np.full(len(readings), self.noise[observation.name]) if sigma is None else wider * sigma[readings]
            seen = data.configuration[readings]
            everywhere = np.array_equal(seen, np.arange(data.configurations))
            yield Block(observation, data, target, fixture, readings, slice(None) if everywhere else seen, known)

    @cached_property
    def placed(self) -> tuple[tuple[Block, slice], ...]:
        """The blocks, with the equations of the problem that each of them is."""
        ends = np.cumsum([block.rows for block in self.blocks]).tolist()
        return tuple((block, slice(end - block.rows, end)) for block, end in zip(self.blocks, ends, strict=True))

    def kind(self, block: Block) -> str:
        """Return the name under which the deviations of a block are counted."""
        return block.observation.name if block.data is self.data else SETUP

    @cached_property
    def postures(self) -> Postures:
        """The configurations, with the loads of `robot` at its own parameter values."""
        return self.robot.loaded(self.data.postures)

    @cached_property
    def components(self) -> NDArray[np.intp]:
        """Number of equations of each reading, ``(readings,)``."""
        return np.concatenate([np.full(len(b.readings), b.observation.components) for b in self.blocks])

    @cached_property
    def rows(self) -> int:
        """Number of equations from readings."""
        return sum(block.rows for block in self.blocks)

    @cached_property
    def visits(self) -> NDArray[np.intp]:
        """Index of the visit that each equation belongs to, ``(rows,)``.

        Readings of one configuration are of one visit, unless the data tell its visits apart. What is
        known of a fixture is of none, and stands alone.
        """
        data = self.data
        visited = data.configuration
        if data.visit is not None:
            visited = np.unique(np.stack([visited, data.visit]), axis=1, return_inverse=True)[1].reshape(-1)
        numbers, first = [], int(visited.max(initial=-1)) + 1
        for block in self.blocks:
            if block.data is data:
                of_readings = visited[block.readings]
            else:
                of_readings = first + np.arange(len(block.readings))
                first += len(block.readings)
            numbers.append(np.repeat(of_readings, block.observation.components))
        return (
            np.unique(np.concatenate(numbers), return_inverse=True)[1].reshape(-1) if numbers else np.zeros(0, np.intp)
        )

    @cached_property
    def portions(self) -> tuple[tuple[Rows, Problem], ...]:
        """The problem in parts of whole configurations, with the equations that each of them is.

        There is one, the problem itself, where few enough derivatives are in it. What is known of fixtures is in the
        first.
        """
        n = self.data.configurations
        most = max(1, min(_AT_ONCE, limit("derivatives") // 2))  # a portion of whole configurations is a little larger
        count = min(-(-self.rows * len(self.free.names) // most), n)
        if count < 2:
            return ((slice(None), self),)
        edges = np.linspace(0, n, count + 1).astype(int).tolist()
        return tuple(self._between(first, end) for first, end in pairwise(edges))

    def _between(self, first: int, end: int) -> tuple[Rows, Problem]:
        """Return the configurations from one to before another as a problem, with its equations."""
        data = self.data.of_configurations(np.arange(first, end))
        part = replace(self, data=data if first == 0 else replace(data, setup=None))
        part.__dict__["postures"] = self.postures.between(first, end)
        rows = []
        for block, place in self.placed:
            if block.data is self.data:
                at = self.data.configuration[block.readings]
                readings = np.flatnonzero((at >= first) & (at < end))
            else:
                readings = np.arange(len(block.readings) if first == 0 else 0)
            size = block.observation.components
            rows.append((place.start + size * readings[:, None] + np.arange(size)).reshape(-1))
        return np.concatenate(rows), part

    @cached_property
    def standings(self) -> NDArray[np.intp]:
        """Index of the posture that each equation belongs to, ``(rows,)``: visits at which the joints stand alike.

        What the model cannot follow is the same there. Configurations that were drawn to count twice stand alone. So do
        visits that the data tell apart, and all where the problem comes in portions.
        """
        data = self.data
        drawn = any(drawn_from(label) != label for label in data.labels)
        if drawn or data.visit is not None or len(self.portions) > 1:
            return self.visits
        posture = postures_of(data.joints, data.joint_kinds)
        of_blocks = [
            np.repeat(posture[block.data.configuration[block.readings]], block.observation.components)
            if block.data is data
            else np.full(block.rows, -1)
            for block in self.blocks
        ]
        at = np.concatenate([np.zeros(0, np.intp), *of_blocks])
        return np.unique(np.where(at < 0, len(posture) + self.visits, at), return_inverse=True)[1].reshape(-1)

    @cached_property
    def times_visited(self) -> NDArray[np.intp]:
        """How often the joints came to the posture of each reading, ``(readings,)``."""
        pairs = np.unique(np.stack([self.standings, self.visits]), axis=1)[0]
        return np.asarray(np.bincount(pairs)[self.standings[np.cumsum(self.components) - 1]])

    def at(self, vector: Array) -> Evaluation:
        """Compare the robot with the readings at a vector ``(parameters,)``, or at one for each of many trials."""
        return Evaluation(self, vector)

    def residual(self, vector: Array) -> Array:
        """Return the whitened residual of the readings alone, ``(rows,)``."""
        return self.at(vector).residual

    def linearised(self, vector: Array) -> tuple[Array, Array]:
        """Return the whitened residual ``(rows,)`` of the readings and its Jacobian ``(rows, parameters)``."""
        evaluation = self.at(vector)
        return evaluation.residual, evaluation.jacobian

    def prior_rows(self, vector: Array) -> tuple[Array, Array]:
        """Return the residual of the priors and the diagonal of its Jacobian, both ``(parameters,)``; zero without."""
        if not self.priors:
            return np.zeros(len(vector)), np.zeros(len(vector))
        nominal, weight = self._priors
        return (vector - nominal) * weight, weight

    @cached_property
    def _priors(self) -> tuple[Array, Array]:
        return self.free.nominal, 1.0 / self.free.prior


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A problem at one vector of its free parameters. The Jacobian reuses the forward kinematics of the residual."""

    problem: Problem  #: What is evaluated.
    vector: Array  #: ``(parameters,)``, or ``(trials, parameters)``, and then all that follows has the trials in front.

    def portions(self) -> Iterator[tuple[Rows, Evaluation]]:
        """Go through the problem part by part, each with its equations: then not all derivatives are in memory."""
        for rows, part in self.problem.portions:
            yield rows, self if part is self.problem else Evaluation(part, self.vector)

    @cached_property
    def residual(self) -> Array:
        """Whitened residual of the readings, ``(rows,)``."""
        r = np.empty((*self.vector.shape[:-1], self.problem.rows))
        if len(self.problem.portions) > 1:
            for rows, part in self.portions():
                r[..., rows] = part.residual
            return r
        for block, rows in self.problem.placed:
            raw = block.observation.residual(self._sightings[rows.start], block.data, block.readings)
            np.divide(raw, block.sigma[:, None], out=self._by_reading(r[..., rows], block))
        return r

    @cached_property
    def jacobian(self) -> Array:
        """Derivative of the residual, ``(rows, parameters)``."""
        names = self.problem.free.names
        # Parameter by parameter in memory: as forward kinematics gives it, and as QR decompositions take it.
        shape = (*self.vector.shape[:-1], len(names), self.problem.rows)
        refuse_beyond("parameters", len(names), where=self.problem.data.source)
        refuse_beyond("derivatives", math.prod(shape), where=self.problem.data.source)
        J = np.empty(shape)
        by_parameter = np.moveaxis(J, -2, 0) if J.ndim > 2 else J
        for block, rows in self.problem.placed:
            observation, sigma = block.observation, block.sigma[:, None]
            seen = self._sightings[rows.start]
            velocity = self._velocity(block)
            raw = self._by_reading(self.residual[..., rows], block) * sigma
            turned = seen.position_jacobian if observation.velocity == "linear" else seen.orientation_jacobian
            moved = observation.jacobian(seen, raw, turned(velocity, names))
            written = self._by_reading(by_parameter[..., rows], block)
            for k in range(observation.components):  # reading after reading is how it is stored, not how it is swept
                np.divide(moved[..., k], block.sigma, out=written[..., k])
        return np.swapaxes(J, -1, -2)

    @cached_property
    def triangle(self) -> Array:
        """Triangle of the derivatives, whose products with each other are theirs, ``(parameters, parameters)``.

        With fewer equations than parameters it has as many rows as equations.
        """
        triangle = np.zeros((0, len(self.problem.free.names)))
        for _, part in self.portions():
            rows = part.jacobian if not len(triangle) else np.concatenate([part.jacobian, triangle])
            triangle = np.asarray(np.linalg.qr(rows, mode="r"), dtype=np.float64)
        return triangle

    @cached_property
    def by_joints(self) -> Array:
        """Derivative of the residual by errors of the joints, behind all their deflections, ``(rows, joints)``.

        Zero for what is known of fixtures.
        """
        robot = self.problem.robot
        joints = robot.moving[: len(robot.joints)]
        by_joint = np.zeros((len(joints), self.problem.rows))
        if len(self.problem.portions) > 1:
            for part_rows, part in self.portions():
                by_joint[:, part_rows] = part.by_joints.T
            return by_joint.T
        moved = self._together.position_jacobian(joints)
        places = {name: k for k, name in enumerate(self._kinematics)}
        for block, rows in self.problem.placed:
            if block.data is not self.problem.data:
                continue
            observation, sigma = block.observation, block.sigma[:, None]
            seen = self._sightings[rows.start]
            raw = self._by_reading(self.residual[rows], block) * sigma
            if observation.velocity == "linear":
                velocity = seen.position_jacobian(moved[:, :, places[block.target]], ())
            else:
                kinematics = self._kinematics[block.target]
                velocity = seen.orientation_jacobian(kinematics.orientation_jacobian(joints), ())
            np.divide(observation.jacobian(seen, raw, velocity), sigma, out=self._by_reading(by_joint[:, rows], block))
        return by_joint.T

    @staticmethod
    def _by_reading(rows: Array, block: Block) -> Array:
        """Return a view of some equations ``(..., rows)`` as ``(..., readings, components)``."""
        return rows.reshape(*rows.shape[:-1], len(block.readings), block.observation.components)

    @cached_property
    def _values(self) -> dict[str, float | Array]:
        return {**self.problem.robot.values, **self.problem.free.values(self.vector)}

    @cached_property
    def _sightings(self) -> dict[int, Sighting]:
        """What each block is about, by its first equation."""
        return {
            rows.start: Sighting(
                self._kinematics[block.target] if block.data is self.problem.data else self._fixtures[block.target],
                block.configurations,
                None if block.fixture is None else self._fixtures[block.fixture],
                self._scale if block.data is self.problem.data else 0.0,
            )
            for block, rows in self.problem.placed
        }

    @cached_property
    def _scale(self) -> float | Array:
        """How much longer than it reads the instrument's unit of length is, where that is not known exactly."""
        return self._values.get(SCALE, 0.0) if self.problem.data.scale_sigma is not None else 0.0

    @cached_property
    def _kinematics(self) -> dict[str, ForwardKinematics]:
        """Forward kinematics to each target, whose positions are known from one sweep."""
        if self._ends:
            self._together  # noqa: B018
        return self._ends

    @cached_property
    def _ends(self) -> dict[str, ForwardKinematics]:
        """Forward kinematics to each target; all go on from one to the flange."""
        robot = self.problem.robot
        variables = robot.variables(self.problem.postures, self._values)
        trunk = robot.trunk.forward_kinematics(variables, self._values)
        blocks = [block for block in self.problem.blocks if block.data is self.problem.data]
        names = dict.fromkeys(block.target for block in blocks)
        return {name: robot.target(name).chain.forward_kinematics(variables, self._values, trunk) for name in names}

    @cached_property
    def _together(self) -> ForwardKinematics:
        """The way to the flange, run through for all targets."""
        return together([*self._ends.values()])

    @cached_property
    def _fixtures(self) -> dict[str, ForwardKinematics]:
        data = self.problem.data
        names = dict.fromkeys((*data.fixtures, *(() if data.setup is None else data.setup.targets)))
        return {name: self.problem.robot.fixture_kinematics(name, self._values) for name in names}

    def _velocity(self, block: Block) -> Array:
        """Return how a block's target moves in the world with each parameter; blocks of one target share it."""
        problem, names, moves = self.problem, self.problem.free.names, block.observation.velocity
        if block.data is not problem.data:
            kinematics = self._fixtures[block.target]
            places = [kinematics.places.get(name) for name in names]
            return (
                kinematics.position_jacobian(places) if moves == "linear" else kinematics.orientation_jacobian(places)
            )
        if moves == "linear":
            return self._linear[:, :, list(self._kinematics).index(block.target)]
        known = self._angular
        if block.target not in known:
            known.clear()  # blocks come target by target: more would only fill memory
            kinematics = self._kinematics[block.target]
            known[block.target] = by_parameters(
                problem.robot, kinematics, kinematics.orientation_jacobian, names, self._rates
            )
        return known[block.target]

    @cached_property
    def _linear(self) -> Array:
        """How all targets move in the world with each parameter, ``(parameters, 3, targets, ..., n)``."""
        names = self.problem.free.names
        return by_parameters_together(self.problem.robot, self._together, self._kinematics, names, self._rates)

    @cached_property
    def _rates(self) -> dict[str, Mapping[int, Array]]:
        problem = self.problem
        return effect_rates(problem.robot, problem.postures, problem.free.names, self._values)

    @cached_property
    def _angular(self) -> dict[str, Array]:
        return {}


def check_circumstances(robot: Robot, data: Dataset, freed: Collection[str]) -> None:
    """Refuse joint effects that need to know what the data do not tell.

    Args:
        freed: Names of the effects that are found from the data. Of others an unknown order is an error of predictions.

    Raises:
        InputError: Naming the effect and what is missing.
    """
    for effect in robot.effects:
        if effect.ordered and effect.name in freed and (data.approach is None or data.number is None):
            raise InputError(
                f"the effect {effect.name} needs the order in which the configurations were measured",
                where=data.source,
                came="configurations that are not numbered",
                cure="Number the configurations 1, 2, 3 .. in the order of measurement, or choose another model.",
            )
        if effect.warmed and data.temperature is None:
            raise InputError(
                f"the effect {effect.name} needs the temperature of the arm",
                where=data.source,
                cure="Add the column temperature [degC], or choose another model.",
            )


def check_solvable(problem: Problem) -> None:
    """Refuse fewer equations than unknowns where no prior helps.

    Raises:
        InputError: With the counts and what to do.
    """
    if not problem.priors and problem.rows < len(problem.free.parameters):
        raise InputError(
            "there are fewer equations than unknowns",
            where=problem.data.source,
            came=f"{problem.rows} equations for {len(problem.free.parameters)} unknown parameters",
            allowed=f"at least {-(-len(problem.free.parameters) // 3)} readings of three coordinates",
            cure="Measure more configurations, free fewer parameters, or use `redundancy=prior`.",
        )


_ORDER: Final = ("base", "fixture", "target", "", "joint zero", "geometry")  # "" is every joint effect
_INDEPENDENT_SHARES: Final = (
    1e-1,
    1e-2,
    1e-3,
    1e-4,
    1e-5,
    1e-6,
    1e-7,
)  # share of a column outside the span of the others
_LEAST_MEMBER: Final = 1e-9  # priors per prior below which a parameter takes no part in a combination
_SHOWN: Final = 0.02
_LEAST_INFORMATION: Final = 0.3  # readings that tell a parameter no better than to three priors do not tell it
_UNOBSERVED: Final = 1e-8  # share of the best observed direction
_NEGLIGIBLE: Final = 1e-6  # share of the largest effect of a parameter
_NEGLIGIBLE_UP_TO_GAUGE: Final = 1e-3  # the same up to gauge freedoms: noise hides the size of everything
_LEAST_INVOLVED: Final = 0.1  # share of a parameter in the lost directions


# Which parameters cannot be told apart, and in which combination (Nubiola, section 2.5.1; Patel, section 2.3).
#
# Columns are looked at in a fixed order (base, targets, joint zeros, geometry from base to tip), first for those
# that stand well apart from the earlier ones, then for those that stand less and less apart; what the others span
# exactly is redundant, and its coordinates in them are the combination. Taking the first that fits in one pass would
# keep, between two axes that are nearly parallel, the slide that is almost spanned and hold the tilt that is not:
# the classical weakness of DH parameters again. A column of whitened readings that is shorter than a third of a prior
# tells nothing either. Columns are scaled by the parameters' priors, that is to physical
# size, never by their own norm alone: a column of rounding noise must stay noise.
@dataclass(frozen=True)
class Redundancy:
    """A direction in which the parameters can move without changing any reading."""

    dropped: str  #: The parameter that is held at its nominal value.
    members: dict[str, float]  #: Coefficient of each parameter that takes part, in SI units, 1 for `dropped`.
    combination: str  #: The direction in words, for example ``d_3 - d_2``.


class Linearisable(Protocol):
    """A whitened problem, such as :class:`truearm.engine.fit.problem.Problem`."""

    @property
    def free(self) -> FreeParameters:
        """What may change."""

    def linearised(self, vector: Array) -> tuple[Array, Array]:
        """Return the whitened residual ``(rows,)`` at a vector and its Jacobian ``(rows, parameters)``."""


def find_redundancies(problem: Linearisable, vector: Array, fixed: Sequence[str] = ()) -> tuple[Redundancy, ...]:
    """Return the redundant parameters of a problem at `vector`, with their combinations.

    Args:
        fixed: Parameters that are redundant elsewhere. If as many are redundant here, these stay fixed.
    """
    A = _columns(problem, vector)
    names = problem.free.names
    independent = independent_columns(A, range(len(names)), problem.free)
    dropped = [i for i in _in_order(problem.free) if i not in independent]
    if fixed:
        others = [i for i, name in enumerate(names) if name not in fixed]
        if len(independent) == len(others) == len(independent_columns(A, others, problem.free)):
            independent, dropped = others, [names.index(name) for name in fixed]
    if not dropped:
        return ()
    # The direction bends: a parameter may take part only away from `vector`, so one prior along it is looked at too.
    combinations = _combinations(A, dropped, independent)
    along = vector + problem.free.prior * combinations.sum(axis=0)
    away = _combinations(_columns(problem, along), dropped, independent)
    return tuple(
        _redundancy(problem.free, i, at, elsewhere)
        for i, at, elsewhere in zip(dropped, combinations, away, strict=True)
    )


def _columns(problem: Linearisable, vector: Array) -> Array:
    """Return the derivative per prior, or its triangle where the problem comes in portions: their angles are alike."""
    if isinstance(problem, Problem) and len(problem.portions) > 1:
        return problem.at(vector).triangle * problem.free.prior
    return problem.linearised(vector)[1] * problem.free.prior


def _in_order(free: FreeParameters) -> list[int]:
    return sorted(range(len(free.parameters)), key=lambda i: _ORDER.index(_place(free.parameters[i].group)))


def _place(group: str) -> str:
    return group if group in _ORDER else ""


def independent_columns(A: Array, among: Iterable[int], free: FreeParameters) -> list[int]:
    """Return columns of a whitened Jacobian, per prior, that span all of those `among`.

    The ones that stand well apart come first.
    """
    norms = np.linalg.norm(A, axis=0)
    left = [i for i in _in_order(free) if i in set(among) and norms[i] > 1e-12 * norms.max()]
    rests = {i: A[:, i].copy() for i in left}
    independent: list[int] = []
    for apart in _INDEPENDENT_SHARES:
        for i in list(left):
            size = float(np.linalg.norm(rests[i]))
            if size <= max(apart * norms[i], _LEAST_INFORMATION):
                continue
            direction = rests[i] / size
            independent.append(i)
            left.remove(i)
            for k in left:  # twice, against rounding
                rests[k] -= direction * (direction @ rests[k])
                rests[k] -= direction * (direction @ rests[k])
    return independent


def _combinations(A: Array, dropped: Sequence[int], independent: Sequence[int]) -> Array:
    """Return the directions, in priors, that move each dropped parameter by one and change no reading."""
    directions = np.zeros((len(dropped), A.shape[1]))
    directions[np.arange(len(dropped)), list(dropped)] = 1.0
    directions[:, list(independent)] = -np.linalg.lstsq(A[:, list(independent)], A[:, list(dropped)], rcond=None)[0].T
    return directions


def _redundancy(free: FreeParameters, dropped: int, combination: Array, away: Array) -> Redundancy:
    involved = [dropped]
    involved += [
        i for i in range(len(combination)) if i != dropped and max(abs(combination[i]), abs(away[i])) > _LEAST_MEMBER
    ]
    members = {free.names[i]: float(combination[i] * free.prior[i] / free.prior[dropped]) for i in involved}
    return Redundancy(free.names[dropped], members, in_words(members, free))


def in_words(members: dict[str, float], free: FreeParameters, *, summed: bool = False) -> str:
    """Name the members that matter, a millimetre weighed against a tenth of a degree.

    Args:
        members: By how much each parameter moves in a direction [SI].
        free: All of them, with their units.
        summed: Whether they are the factors of a sum instead, in units of the first one.
    """
    by_name: dict[str, Parameter] = dict(zip(free.names, free.parameters, strict=True))
    usual = {n: (1e-3 if by_name[n].unit == "m" else 1.75e-3) ** (1 if summed else -1) for n in members}
    size = {n: abs(c) * usual[n] for n, c in members.items()}
    largest = max(size.values())
    first = by_name[next(iter(members))].unit
    words = ""
    for name, coefficient in members.items():
        if size[name] < _SHOWN * largest:
            continue
        factor = abs(coefficient)
        if abs(factor - 1) < 0.02:
            text = name
        else:
            mixed = (first, by_name[name].unit) if summed else (by_name[name].unit, first)
            units, scale = {("m", "rad"): (" mm/rad", 1e3), ("rad", "m"): (" rad/mm", 1e-3)}.get(mixed, ("", 1.0))
            text = f"{factor * scale:.3g}{units}·{name}"
        sign = "-" if coefficient < 0 else "+"
        words += f" {sign} {text}" if words else text
    return words


def unobservable_parameters(
    robot: Robot, data: Dataset, free: FreeParameters, seed: int = 0, fixed: FixedPlaces = NOTHING_FIXED
) -> tuple[str, ...]:
    """Return parameters in directions that the data do not observe although poses elsewhere depend on them.

    The unobserved directions are tried on configurations drawn from the robot's limits. A direction that changes
    nothing there either is a matter of convention (d_2 against d_3) and harmless; one that does is a loss of rank: the
    data are too alike.

    Predictions are compared up to the gauge freedoms: a rigid motion of everything where no reading locates the robot,
    and a change of its size where no length was measured either. See :func:`gauge_freedoms`.

    Args:
        free: The parameters to look at; all others are held.
        fixed: Places that are known. A fixture among them locates the robot.
    """
    free = free.without([SCALE])  # as much as is known of it beforehand is enough
    if not free.names:
        return ()
    noise = {observation.name: 1.0 for observation in OBSERVATIONS}
    plain = Problem(robot, _unit_noise(data), free, noise, priors=False)
    _, s, Vt = np.linalg.svd(plain.at(free.start).triangle * free.prior, full_matrices=True)
    unobserved = Vt[int((s > _UNOBSERVED * s[0]).sum()) :]
    if len(unobserved) == 0:
        return ()
    gauge = gauge_freedoms(data, fixed)
    q = robot.loaded(robot.random_configurations(40, np.random.default_rng(seed)))
    effects = np.zeros((0, len(free.names)))
    for target in robot.targets:
        kinematics = robot.forward_kinematics(q, target.name)
        parts = [robot.position_jacobian(kinematics, q, free.names)]
        if target.quaternion is not None:
            parts.append(robot.orientation_jacobian(kinematics, q, free.names))
        moved = [part.reshape(len(free.names), -1).T * free.prior for part in parts]
        if gauge:
            moved = gauge_motion_removed(gauge, robot, kinematics, moved)
        effects = np.concatenate([effects, *moved])
    _, strength, turned = np.linalg.svd(effects @ unobserved.T, full_matrices=False)
    largest = np.linalg.norm(effects, axis=0)
    least = _NEGLIGIBLE * largest.max()
    if gauge:
        own = [p.group not in ("base", "target", "fixture") for p in free.parameters]
        least = _NEGLIGIBLE_UP_TO_GAUGE * max(largest[own], default=0.0)
    lost = turned[: len(strength)][strength > least] @ unobserved
    involved = np.linalg.norm(lost, axis=0) > _LEAST_INVOLVED
    return tuple(name for name, is_in in zip(free.names, involved.tolist(), strict=True) if is_in)


def gauge_freedoms(data: Dataset, fixed: FixedPlaces = NOTHING_FIXED) -> tuple[str, ...]:
    """Return the motions of everything that no reading observes: of the ``base``, and a change of ``size``."""
    if data.anchored or fixed.locates(data):
        return ()
    if data.distance is not None or (data.setup is not None and data.setup.distance is not None):
        return ("base",)
    if any(any(place.translation) for place in fixed.targets.values()):  # it is a length on the flange
        return ("base",)
    for fixture in range(len(data.fixtures)):
        lengths = data.position if data.height is None else np.column_stack([data.position, data.height])
        of_fixture = lengths[data.against == fixture]
        if any(len(np.unique(column[np.isfinite(column)])) > 1 for column in of_fixture.T):
            return ("base",)
    return "base", "size"


def gauge_motion_removed(
    gauge: Sequence[str], robot: Robot, kinematics: ForwardKinematics, moved: Sequence[Array]
) -> list[Array]:
    """Remove from moves of a target what a motion of the whole robot does, and a change of its size.

    Args:
        gauge: From :func:`gauge_freedoms`.
        robot, kinematics: The robot, and its forward kinematics to the target at n configurations.
        moved: How it moves [m], and turns if that is asked too, by each parameter, ``(3 n, parameters)`` each.
    """
    columns = gauge_motions(gauge, robot, kinematics)[: len(moved)]
    together = np.concatenate(columns)
    Q = np.linalg.qr(together)[0]
    every = np.concatenate(moved)
    return [every - Q @ (Q.T @ every)]


def gauge_motions(gauge: Sequence[str], robot: Robot, kinematics: ForwardKinematics) -> tuple[Array, Array]:
    """Return how a motion of the whole robot moves a target [m], and turns it, ``(3 n, motions)`` each.

    Parameters are those of :func:`gauge_motion_removed`.
    """
    base = [f"base_{axis}" for axis in ("x", "y", "z", "rx", "ry", "rz")]
    places = [kinematics.places[name] for name in base]
    moved = kinematics.position_jacobian(places).reshape(6, -1).T
    turned = kinematics.orientation_jacobian(places).reshape(6, -1).T
    if "size" in gauge:
        grown = (kinematics.position - np.array(robot.base.translation)[:, None]).reshape(-1, 1)
        return np.column_stack([moved, grown]), np.column_stack([turned, np.zeros_like(grown)])
    return moved, turned


def _unit_noise(data: Dataset) -> Dataset:
    setup = None if data.setup is None else replace(data.setup, sigma=np.ones(len(data.setup.target)))
    return replace(data, sigma=None, sigma_rot=None, setup=setup)
