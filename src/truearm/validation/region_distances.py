"""How far readings lie from where the robot was calibrated, and what the error does with that distance.

Three distances are told. That of the tip: from a target to the nearest place at which this target was measured in the
training configurations, both by the calibrated robot [m]. That of the posture: the largest difference of a joint to the
training configuration where this is least; a turn more or less is the same posture [rad]. And that from the middle:
from the target to the mean of all its places in training, which is what Nubiola's figure 4.7 plots (there, the middle
of the measuring device).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import Errors
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot

#: Rows that are compared with all training configurations at once.
_ROWS: Final = 500
#: Configurations below which thirds are not compared.
_LEAST: Final = 12
#: Standard errors by which the farthest third must be worse than the nearest, and how many times.
_SURE: Final = 3.0
_WORSE: Final = 1.5


@dataclass(frozen=True)
class Span:
    """Readings within a span of distances."""

    low: float  #: low, high: of the distances [m or rad].
    high: float
    readings: int  #: How many.
    mean: float  #: mean, largest: of the errors [m].
    largest: float


@dataclass(frozen=True, eq=False)
class RegionDistances:
    """Distances of readings from where the robot was calibrated, with their errors."""

    reading: NDArray[np.intp]  #: Indices of the readings, ``(n,)``.
    error: Array  #: Position error, or that of a distance or height, without sign [m], ``(n,)``.
    tip: Array  #: From the nearest place of the target in training [m], ``(n,)``.
    #: Largest difference of a revolute joint from the training configuration where it is least [rad], ``(n,)``; NaN for
    #: an arm without revolute joints.
    joints: Array
    middle: Array  #: From the mean of the target's places in training [m], ``(n,)``.
    configuration: NDArray[np.intp]  #: Of each reading, ``(n,)``.
    training: int  #: How many training configurations the robot knows.

    def spans(self, distance: Array, count: int = 5) -> tuple[Span, ...]:
        """Return spans of a distance ``(n,)`` with about equally many readings each, nearest first."""
        known = np.flatnonzero(np.isfinite(distance))
        order = known[np.argsort(distance[known], kind="stable")]
        parts = [part for part in np.array_split(order, min(count, max(len(order) // 3, 1))) if len(part)]
        return tuple(
            Span(
                float(distance[part[0]]),
                float(distance[part[-1]]),
                len(part),
                float(self.error[part].mean()),
                float(self.error[part].max()),
            )
            for part in parts
        )

    @property
    def growth(self) -> tuple[Span, Span, bool] | None:
        """The nearest and the farthest third by the tip, and whether the latter is worse by more than chance.

        None of too few configurations.
        """
        if len(np.unique(self.configuration)) < _LEAST:
            return None
        near, *_, far = self.spans(self.tip, 3)
        order = np.argsort(self.tip, kind="stable")
        thirds = np.array_split(order, 3)
        errors = [self._standard_error(part) for part in (thirds[0], thirds[-1])]
        sure = far.mean - near.mean > _SURE * math.hypot(*errors) and far.mean > _WORSE * near.mean
        return near, far, sure

    def _standard_error(self, part: NDArray[np.intp]) -> float:
        """Return the standard error of the mean error of some readings, by the scatter of their configurations."""
        at = np.unique(self.configuration[part], return_inverse=True)[1]
        sums = np.bincount(at, self.error[part] - self.error[part].mean())
        count = len(sums)
        return math.inf if count < 2 else math.sqrt(count / (count - 1) * float(sums @ sums)) / len(part)


def region_distances(robot: Robot, data: Dataset, errors: Errors) -> RegionDistances | None:
    """Return how far readings lie from where a robot was calibrated; None where it does not know, or nothing was read.

    Args:
        robot: Calibrated: its proof holds where it was measured.
        errors: Of the robot on the data.
    """
    if robot.proof is None or not robot.proof.measured or len(robot.proof.measured[0]) != len(robot.joints):
        return None
    norms = np.linalg.norm(errors.position_errors, axis=1)
    if errors.length_errors is not None:
        norms = np.where(np.isfinite(norms), norms, np.abs(errors.length_errors))
    reading = np.flatnonzero(np.isfinite(norms))
    if not len(reading):
        return None
    training = np.array(robot.proof.measured)
    tip, middle = np.empty(len(reading)), np.empty(len(reading))
    for index in np.unique(data.target[reading]).tolist():
        known = robot.forward(training, target=data.targets[index])[0]
        mine = np.flatnonzero(data.target[reading] == index)
        places = robot.forward(data.postures, target=data.targets[index])[0][data.configuration[reading[mine]]]
        for part in np.array_split(np.arange(len(mine)), -(-len(mine) // _ROWS)):
            apart = places[part][:, None] - known
            tip[mine[part]] = np.sqrt(np.einsum("nkx,nkx->nk", apart, apart).min(axis=1))
        middle[mine] = np.linalg.norm(places - known.mean(axis=0), axis=1)
    return RegionDistances(
        reading,
        norms[reading],
        tip,
        _of_postures(robot, data.joints, training)[data.configuration[reading]],
        middle,
        data.configuration[reading],
        len(training),
    )


def _of_postures(robot: Robot, joints: Array, training: Array) -> Array:
    """Return the largest difference of a revolute joint from the nearest training configuration [rad], ``(n,)``."""
    turning = [i for i, joint in enumerate(robot.joints) if joint.kind == "revolute"]
    if not turning:
        return np.full(len(joints), np.nan)
    found = np.empty(len(joints))
    for part in np.array_split(np.arange(len(joints)), -(-len(joints) // _ROWS)):
        apart = joints[part][:, None, turning] - training[:, turning]
        found[part] = np.abs((apart + np.pi) % (2.0 * np.pi) - np.pi).max(axis=2).min(axis=1)
    return found
