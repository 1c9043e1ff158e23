"""The whitened residual of a robot on a dataset, and its Jacobian.

Every residual is divided by its standard deviation before it is stacked, so metres never meet radians; a prior is
one more row, (value - nominal) / deviation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.measurement.dataset import Dataset
from truearm.measurement.observations import OBSERVATIONS, Observation
from truearm.modeling.chain import Array
from truearm.modeling.parameters import FreeParameters
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
    sigma
        Standard deviation of each reading [m or rad], ``(k,)``.
    """

    observation: Observation
    target: str
    readings: NDArray[np.intp]
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
                    made.append(Block(observation, name, readings, sigma))
        return tuple(made)

    @property
    def readings(self) -> int:
        """Number of readings of three rows each."""
        return sum(len(block.readings) for block in self.blocks)

    @property
    def rows(self) -> int:
        """Number of equations from readings."""
        return 3 * self.readings

    def residual(self, vector: Array) -> Array:
        """Return the whitened residual of the readings alone, ``(rows,)``."""
        return self._evaluate(vector, jacobian=False)[0]

    def linearised(self, vector: Array) -> tuple[Array, Array]:
        """Return the whitened residual ``(rows,)`` of the readings and its Jacobian ``(rows, parameters)``."""
        return self._evaluate(vector, jacobian=True)

    def prior_rows(self, vector: Array) -> tuple[Array, Array]:
        """Return the residual of the priors and the diagonal of its Jacobian, both ``(parameters,)``; zero without."""
        if not self.priors:
            return np.zeros(len(vector)), np.zeros(len(vector))
        weight = 1.0 / self.free.prior
        return (vector - self.free.nominal) * weight, weight

    def with_noise(self, noise: dict[str, float]) -> Problem:
        """Return the problem with other standard deviations for readings that declare none."""
        return replace(self, noise=noise)

    def _evaluate(self, vector: Array, *, jacobian: bool) -> tuple[Array, Array]:
        values = {**self.robot.values, **self.free.values(vector)}
        names = self.free.names
        q = self.data.joints
        variables = self.robot.variables(q, values)
        trunk = self.robot.trunk.sweep(variables, values)
        r = np.empty((self.readings, 3))
        J = np.empty((self.readings, 3, len(names))) if jacobian else np.empty((0, 3, len(names)))
        first = 0
        for name in dict.fromkeys(block.target for block in self.blocks):
            sweep = self.robot.target(name).chain.sweep(variables, values, trunk)
            if jacobian:
                linear, angular = self.robot.derivatives(sweep, q, names, values)
            for block in self.blocks:
                if block.target != name:
                    continue
                rows = slice(first, first + len(block.readings))
                first = rows.stop
                residual = block.observation.residual(sweep, self.data, block.readings)
                r[rows] = residual / block.sigma[:, None]
                if jacobian:
                    where = self.data.configuration[block.readings]
                    moved = block.observation.jacobian(residual, linear[:, :, where], angular[:, :, where])
                    J[rows] = moved / block.sigma[:, None, None]
        return r.reshape(-1), J.reshape(-1, len(names))


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
