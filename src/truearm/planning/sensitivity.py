"""What readings at many configurations would tell about the parameters of a model.

Every target of the robot's tool is read at every configuration, as a tracker does with several reflectors.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.identification.models import Model
from truearm.identification.redundancy import independent_columns
from truearm.modeling.chain import Array
from truearm.modeling.parameters import PRIOR, FreeParameters
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives of readings by parameters in their sizes.

    Attributes
    ----------
    free
        The model's parameters, base and targets among them.
    size
        Physical size of each parameter [SI]: its prior, and for base and targets, whose priors are wide because
        nobody measured them beforehand, that of geometry, 1 mm and 0.1 deg.
    rows
        Derivatives of the coordinates of all targets, in deviations of a reading per size,
        ``(configurations, 3 * targets, parameters)``.
    """

    free: FreeParameters
    size: Array
    rows: Array

    @cached_property
    def known(self) -> Array:
        """Information of the priors, ``(parameters, parameters)``."""
        return np.diag((self.size / self.free.prior) ** 2)

    def told_apart(self, count: int) -> NDArray[np.intp]:
        """Return the indices of parameters that `count` average configurations tell from all others."""
        R = np.linalg.qr(self.rows.reshape(-1, self.rows.shape[2]), mode="r")
        share = np.sqrt(count / len(self.rows))
        return np.array(sorted(independent_columns(share * R, range(len(self.size)), self.free)), dtype=np.intp)


def sensitivity(robot: Robot, postures: Postures, model: Model, noise: float) -> Sensitivity:
    """Return what readings would tell.

    Parameters
    ----------
    robot
        With targets and the model's effects, see :meth:`truearm.identification.models.Model.prepared`.
    postures
        Where it is read.
    model
        Which parameters are free.
    noise
        Standard deviation of a coordinate about a well identified model [m].

    Raises
    ------
    InputError
        If the robot has no targets, or an effect of the model needs to know more than the postures tell.
    """
    if not robot.targets:
        raise InputError("the robot has no targets, so nothing can be measured", where=robot.name)
    for effect in robot.effects:
        if effect.warmed and postures.temperature is None:
            raise InputError(
                f"the effect {effect.name} needs the temperature of the arm, which no plan knows",
                where=robot.name,
                cure="Choose another model.",
            )
    loaded = robot.loaded(postures)
    free = model.free(robot)
    by_target = [robot.linear(robot.sweep(loaded, target.name), loaded, free.names) for target in robot.targets]
    size = np.array([PRIOR["geometry", p.unit] if p.group in ("base", "target") else p.prior for p in free.parameters])
    derivative = np.concatenate(by_target, axis=1)  # (parameters, rows, configurations)
    return Sensitivity(free, size, np.ascontiguousarray(np.moveaxis(derivative, (0, 2), (2, 0))) * (size / noise))
