"""Error statistics: how far predictions are from readings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truearm.measurement.dataset import Dataset
from truearm.measurement.observations import Orientation, Position
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot


@dataclass(frozen=True)
class Spread:
    """Mean, root mean square, 95th percentile and maximum of a set of errors."""

    mean: float
    rms: float
    p95: float
    max: float

    @classmethod
    def of(cls, errors: Array) -> Spread:
        """Summarise error norms ``(k,)``, k at least 1."""
        return cls(
            mean=float(errors.mean()),
            rms=float(np.sqrt(np.mean(errors**2))),
            p95=float(np.percentile(errors, 95)),
            max=float(errors.max()),
        )


@dataclass(frozen=True, eq=False)
class Errors:
    """Errors of a robot model on a dataset.

    Attributes
    ----------
    configurations
        Number of configurations judged.
    position
        Predicted minus measured position of each reading [m], ``(readings, 3)``, NaN where nothing was read.
    orientation
        Rotation vector from the measured to the predicted orientation [rad], likewise; None without any. A target
        that the robot knows only as a point has no orientation to be judged.
    """

    configurations: int
    position: Array
    orientation: Array | None

    @property
    def position_norms(self) -> Array:
        """Error of each position that was read [m]."""
        return _norms(self.position)

    @property
    def orientation_norms(self) -> Array:
        """Error of each orientation that was read [rad]."""
        return _norms(self.orientation) if self.orientation is not None else np.zeros(0)

    @property
    def position_spread(self) -> Spread | None:
        """Statistics over single readings [m], None without any."""
        norms = self.position_norms
        return Spread.of(norms) if len(norms) else None

    @property
    def orientation_spread(self) -> Spread | None:
        """Statistics over single readings [rad], None without any."""
        norms = self.orientation_norms
        return Spread.of(norms) if len(norms) else None


def _norms(errors: Array) -> Array:
    return np.asarray(np.linalg.norm(errors[np.isfinite(errors).all(axis=1)], axis=1))


def errors_of(robot: Robot, data: Dataset) -> Errors:
    """Compare a robot with data taken in the frames that the robot knows.

    Parameters
    ----------
    robot
        With base and targets.
    data
        Readings of those targets.
    """
    position = np.full((len(data.target), 3), np.nan)
    orientation = np.full((len(data.target), 3), np.nan) if data.has_orientation.any() else None
    kinds = ((Position(), position), (Orientation(), orientation))
    at = robot.loaded(data.postures)
    for index, name in enumerate(data.targets):
        mine = (data.target == index) & (data.has_position | data.has_orientation)
        if not mine.any():
            continue
        sweep = robot.sweep(at, name)
        is_point = robot.target(name).quaternion is None
        for kind, errors in kinds:
            if is_point and isinstance(kind, Orientation):
                continue
            readings = np.flatnonzero(mine & kind.present(data))
            if errors is not None and len(readings):
                errors[readings] = kind.residual(sweep, data, readings)
    return Errors(data.configurations, position, orientation)
