"""The whitened residual of a robot on a dataset, and its Jacobian.

Every residual is divided by its standard deviation before it is stacked, so metres never meet radians; a prior is
one more row, (value - nominal) / deviation.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.measurement.dataset import Dataset
from truearm.measurement.observations import OBSERVATIONS, Observation
from truearm.modeling.chain import Array, Sweep
from truearm.modeling.parameters import FreeParameters
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot


@dataclass(frozen=True, eq=False)
class Block:
    """The readings of one observation kind of one target: consecutive rows of the problem.

    Attributes
    ----------
    observation
        What is compared.
    target
        Name of the target.
    readings
        Indices into the dataset, ``(k,)``.
    configurations
        Index of the configuration of each reading; all of them at once, which costs no copy, where the target was
        read at every one in order.
    sigma
        Standard deviation of each reading [m or rad], ``(k,)``.
    """

    observation: Observation
    target: str
    readings: NDArray[np.intp]
    configurations: NDArray[np.intp] | slice
    sigma: Array


@dataclass(frozen=True, eq=False)
class Problem:
    """Readings, a robot and the parameters that may change.

    Attributes
    ----------
    robot
        Gives the value of every parameter that is not free.
    data
        The readings; each target must be known to the robot.
    free
        What the solver changes.
    noise
        Standard deviation [m or rad] by observation name, for readings that declare none.
    priors
        Whether the parameters' priors are rows of the problem.
    """

    robot: Robot
    data: Dataset
    free: FreeParameters
    noise: dict[str, float]
    priors: bool = True

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """The readings, by target and observation."""
        made = []
        for index, name in enumerate(self.data.targets):
            for observation in OBSERVATIONS:
                readings = np.flatnonzero((self.data.target == index) & observation.present(self.data))
                if len(readings):
                    declared = observation.declared_sigma(self.data)
                    sigma = (
                        np.full(len(readings), self.noise[observation.name]) if declared is None else declared[readings]
                    )
                    seen = self.data.configuration[readings]
                    everywhere = np.array_equal(seen, np.arange(self.data.configurations))
                    made.append(Block(observation, name, readings, slice(None) if everywhere else seen, sigma))
        return tuple(made)

    @cached_property
    def postures(self) -> Postures:
        """The configurations, with the loads of `robot` at its own parameter values."""
        return self.robot.loaded(self.data.postures)

    @property
    def readings(self) -> int:
        """Number of readings of three rows each."""
        return sum(len(block.readings) for block in self.blocks)

    @property
    def rows(self) -> int:
        """Number of equations from readings."""
        return 3 * self.readings

    def at(self, vector: Array) -> Evaluation:
        """Compare the robot with the readings at a vector ``(parameters,)``, or at one for each of many trials."""
        return Evaluation(self, vector)

    def residual(self, vector: Array) -> Array:
        """Return the whitened residual of the readings alone, ``(rows,)``."""
        return self.at(vector).residual

    def linearised(self, vector: Array) -> tuple[Array, Array]:
        """Return the whitened residual ``(rows,)`` of the readings and its Jacobian ``(rows, parameters)``."""
        here = self.at(vector)
        return here.residual, here.jacobian

    def prior_rows(self, vector: Array) -> tuple[Array, Array]:
        """Return the residual of the priors and the diagonal of its Jacobian, both ``(parameters,)``; zero without."""
        if not self.priors:
            return np.zeros(len(vector)), np.zeros(len(vector))
        weight = 1.0 / self.free.prior
        return (vector - self.free.nominal) * weight, weight


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A problem at one vector of its free parameters. The Jacobian goes on from the sweep of the residual.

    Attributes
    ----------
    problem
        What is evaluated.
    vector
        ``(parameters,)``, or ``(trials, parameters)``, and then all that follows has the trials in front.
    """

    problem: Problem
    vector: Array

    @cached_property
    def residual(self) -> Array:
        """Whitened residual of the readings, ``(rows,)``."""
        r = np.empty((*self.vector.shape[:-1], self.problem.readings, 3))
        for block, rows in self._rows():
            raw = block.observation.residual(self._sweeps[block.target], self.problem.data, block.readings)
            np.divide(raw, block.sigma[:, None], out=r[..., rows, :])
        return r.reshape(*r.shape[:-2], -1)

    @cached_property
    def jacobian(self) -> Array:
        """Derivative of the residual, ``(rows, parameters)``."""
        problem, names = self.problem, self.problem.free.names
        r = self.residual.reshape(*self.vector.shape[:-1], -1, 3)
        # Parameter by parameter in memory: as sweeps give it, and as QR decompositions take it.
        J = np.empty((*self.vector.shape[:-1], len(names), problem.readings, 3))
        by_parameter = np.moveaxis(J, -3, 0)
        for block, rows in self._rows():
            observation, sigma = block.observation, block.sigma[:, None]
            derivative = problem.robot.linear if observation.velocity == "linear" else problem.robot.angular
            velocity = derivative(self._sweeps[block.target], problem.postures, names, self._values)
            moved = observation.jacobian(r[..., rows, :] * sigma, velocity[..., block.configurations])
            np.divide(moved, sigma, out=by_parameter[..., rows, :])
        return np.swapaxes(J.reshape(*J.shape[:-2], -1), -1, -2)

    def _rows(self) -> Iterator[tuple[Block, slice]]:
        """Go through the blocks, with the readings of the problem that each of them is."""
        first = 0
        for block in self.problem.blocks:
            yield block, slice(first, first + len(block.readings))
            first += len(block.readings)

    @cached_property
    def _values(self) -> dict[str, float | Array]:
        return {**self.problem.robot.values, **self.problem.free.values(self.vector)}

    @cached_property
    def _sweeps(self) -> dict[str, Sweep]:
        """The sweep to each target; all go on from one to the flange."""
        robot = self.problem.robot
        variables = robot.variables(self.problem.postures, self._values)
        trunk = robot.trunk.sweep(variables, self._values)
        names = dict.fromkeys(block.target for block in self.problem.blocks)
        return {name: robot.target(name).chain.sweep(variables, self._values, trunk) for name in names}


def check_circumstances(robot: Robot, data: Dataset) -> None:
    """Refuse joint effects that need to know what the data do not tell.

    Raises
    ------
    InputError
        Naming the effect and what is missing.
    """
    for effect in robot.effects:
        if effect.ordered and (data.approach is None or data.number is None):
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

    Raises
    ------
    InputError
        With the counts and what to do.
    """
    if not problem.priors and problem.rows < len(problem.free.parameters):
        raise InputError(
            "there are fewer equations than unknowns",
            where=problem.data.source,
            came=f"{problem.rows} equations for {len(problem.free.parameters)} unknown parameters",
            allowed=f"at least {-(-len(problem.free.parameters) // 3)} readings of three coordinates",
            cure="Measure more configurations, free fewer parameters, or use --redundancy prior.",
        )
