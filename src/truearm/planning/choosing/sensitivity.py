"""What readings at many configurations would tell about the parameters of a model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.identification.solving.problem import Problem
from truearm.identification.solving.redundancy import gauge_motion_removed, independent_columns
from truearm.limits import refuse_beyond
from truearm.measurement.dataset import Dataset
from truearm.measurement.observations import OBSERVATIONS
from truearm.modeling.chain import Array
from truearm.modeling.parameters import PRIOR, FreeParameters
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot

#: Radius at which an angle that is read counts as a length [m].
_LEVER: Final = 0.1


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives of readings by parameters in their sizes."""

    free: FreeParameters  #: The model's parameters, base and targets among them.
    #: Physical size of each parameter [SI]: its prior, and for base, targets and fixtures, whose priors are wide
    #: because nobody measured them beforehand, that of geometry, 1 mm and 0.1 deg.
    size: Array
    #: Derivatives of the readings, in deviations of a reading per size, ``(configurations, rows, parameters)``. Three
    #: rows are a target's coordinates, or a distance or height and two zeros.
    rows: Array
    #: Information of what is known of fixtures, ``(parameters, parameters)``; None if nothing is.
    beside: Array | None = None

    @cached_property
    def known(self) -> Array:
        """Information of the priors and of what is known of fixtures, ``(parameters, parameters)``."""
        priors = np.diag((self.size / self.free.prior) ** 2)
        return priors if self.beside is None else priors + self.beside

    @cached_property
    def squares(self) -> Array:
        """Mean product of the derivatives of a coordinate, ``(configurations, parameters, parameters)``."""
        return np.asarray(self.rows.swapaxes(1, 2) @ self.rows / self.rows.shape[1])

    def identifiable(self, count: int) -> NDArray[np.intp]:
        """Return the indices of parameters that `count` average configurations can tell from all others."""
        R = np.linalg.qr(self.rows.reshape(-1, self.rows.shape[2]), mode="r")
        share = np.sqrt(count / len(self.rows))
        return np.array(sorted(independent_columns(share * R, range(len(self.size)), self.free)), dtype=np.intp)


def sensitivity(
    robot: Robot, postures: Postures, free: FreeParameters, noise: float, gauge: Sequence[str] = ()
) -> Sensitivity:
    """Return what the positions of all targets would tell.

    Args:
        robot: With targets and the model's effects, see :meth:`truearm.identification.solving.models.Model.prepared`.
        postures: Where it is read.
        free: Which parameters are asked about.
        noise: Standard deviation of a coordinate about a well identified model [m].
        gauge: What does not count: where the base is, the size of everything
            (:func:`truearm.identification.solving.redundancy.gauge_freedoms`).

    Raises:
        InputError: If the robot has no targets, or an effect of the model needs to know more than the postures tell.
    """
    check_known(robot, postures)
    refuse_beyond(
        "derivatives", len(postures) * 3 * len(robot.targets) * len(free.parameters), where=f"{robot.name}, candidates"
    )
    loaded = robot.loaded(postures)
    by_target = []
    for target in robot.targets:
        kinematics = robot.forward_kinematics(loaded, target.name)
        moves = robot.position_jacobian(kinematics, loaded, free.names)
        if gauge:
            (flat,) = gauge_motion_removed(gauge, robot, kinematics, [moves.reshape(len(moves), -1).T])
            moves = flat.T.reshape(moves.shape)
        by_target.append(moves)
    size = _size(free)
    derivative = np.concatenate(by_target, axis=1)  # (parameters, rows, configurations)
    return Sensitivity(free, size, np.ascontiguousarray(np.moveaxis(derivative, (0, 2), (2, 0))) * (size / noise))


def sensitivity_of_readings(robot: Robot, data: Dataset, free: FreeParameters, noise: float) -> Sensitivity:
    """Return what the readings of a device would tell, whatever they are.

    Args:
        robot: With its targets and the fixtures of the readings.
        data: Readings; what they say does not matter. What is known of fixtures counts as known.
        free, noise: As for :func:`sensitivity`; an angle counts as what it moves at a radius of 0.1 m.
    """
    check_known(robot, data.postures)
    kinds = {observation.name: noise for observation in OBSERVATIONS} | {"orientation": noise / _LEVER}
    plain = replace(data, sigma=None, sigma_rot=None)
    problem = Problem(robot, plain, free, kinds, priors=False)
    J = problem.linearised(free.start)[1]
    of_row = np.concatenate(
        [np.repeat(b.data.configuration[b.readings], b.observation.components) for b in problem.blocks]
    )
    known = np.concatenate([np.full(b.rows, b.data is not plain) for b in problem.blocks])
    part = np.concatenate([np.tile(np.arange(b.observation.components), len(b.readings)) for b in problem.blocks])
    size = _size(free)
    place = np.zeros(len(J), dtype=np.intp)  # of each row among those of its configuration, threes kept together
    seen = np.zeros(data.configurations, dtype=np.intp)
    for row in np.flatnonzero(~known).tolist():
        if part[row] == 0:
            seen[of_row[row]] += 3
        place[row] = seen[of_row[row]] - 3 + part[row]
    rows = np.zeros((data.configurations, int(seen.max()), len(size)))
    read = ~known
    rows[of_row[read], place[read]] = J[read] * size
    fixed = J[known] * size
    return Sensitivity(free, size, rows, fixed.T @ fixed)


def check_known(robot: Robot, postures: Postures) -> None:
    """Refuse a robot that nobody sees, and effects that need to know what no plan knows."""
    if not robot.targets:
        raise InputError("the robot has no targets, so nothing can be measured", where=robot.name)
    for effect in robot.effects:
        if effect.warmed and postures.temperature is None:
            raise InputError(
                f"the effect {effect.name} needs the temperature of the arm, which a plan does not have",
                where=robot.name,
                cure="Choose another model.",
            )


def _size(free: FreeParameters) -> Array:
    placed = ("base", "target", "fixture")
    return np.array([PRIOR["geometry", p.unit] if p.group in placed else p.prior for p in free.parameters])
