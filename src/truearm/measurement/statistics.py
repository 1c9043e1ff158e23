"""Error statistics: how far predictions are from readings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truearm.measurement.dataset import Dataset
from truearm.measurement.observations import compared
from truearm.measurement.sighting import Sighting
from truearm.modeling.chain import Array, ForwardKinematics
from truearm.modeling.parameters import SCALE
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
    """Errors of a robot model on a dataset."""

    configurations: int  #: Number of configurations judged.
    #: Predicted minus measured position of each reading [m], ``(readings, 3)``, NaN where nothing was read.
    position_errors: Array
    #: Rotation vector from the measured to the predicted orientation [rad], likewise; None without any. A target that
    #: the robot knows only as a point has no orientation to be judged.
    orientation_errors: Array | None
    #: Predicted minus measured distance from a fixture, or height over one [m], ``(readings,)``, NaN where none was
    #: read; None without any.
    length_errors: Array | None = None

    @property
    def position_norms(self) -> Array:
        """Error of each position that was read [m]."""
        return _norms(self.position_errors)

    @property
    def orientation_norms(self) -> Array:
        """Error of each orientation that was read [rad]."""
        return _norms(self.orientation_errors) if self.orientation_errors is not None else np.zeros(0)

    @property
    def length_norms(self) -> Array:
        """Error of each distance or height that was read, without sign [m]."""
        return (
            np.zeros(0) if self.length_errors is None else np.abs(self.length_errors[np.isfinite(self.length_errors)])
        )

    @property
    def position(self) -> Spread | None:
        """Statistics over single readings [m], None without any."""
        norms = self.position_norms
        return Spread.of(norms) if len(norms) else None

    @property
    def orientation(self) -> Spread | None:
        """Statistics over single readings [rad], None without any."""
        norms = self.orientation_norms
        return Spread.of(norms) if len(norms) else None

    @property
    def length(self) -> Spread | None:
        """Statistics over single distances and heights [m], None without any."""
        norms = self.length_norms
        return Spread.of(norms) if len(norms) else None


def _norms(errors: Array) -> Array:
    return np.asarray(np.linalg.norm(errors[np.isfinite(errors).all(axis=1)], axis=1))


def errors_of(robot: Robot, data: Dataset) -> Errors:
    """Compare a robot with data taken in the frames that the robot knows.

    Args:
        robot: With base, targets and fixtures.
        data: Readings of those.
    """
    count = len(data.target)
    position = np.full((count, 3), np.nan)
    orientation = np.full((count, 3), np.nan) if data.quaternion is not None else None
    length = np.full((count, 1), np.nan) if data.distance is not None or data.height is not None else None
    errors = {"position": position, "orientation": orientation, "distance": length, "height": length}
    at = robot.loaded(data.postures)
    kinematics: dict[str, ForwardKinematics] = {}
    for target, fixture, observation, readings in compared(data):
        into = errors[observation.name]
        if into is None or (observation.name == "orientation" and robot.target(target).quaternion is None):
            continue
        if target not in kinematics:
            kinematics[target] = robot.forward_kinematics(at, target)
        beside = None if fixture is None else robot.fixture_kinematics(fixture)
        scale = robot.values.get(SCALE, 0.0) if data.scale_sigma is not None else 0.0
        seen = Sighting(kinematics[target], data.configuration[readings], beside, scale)
        into[readings] = observation.residual(seen, data, readings)
    return Errors(data.configurations, position, orientation, None if length is None else length[:, 0])
