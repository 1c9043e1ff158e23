"""Error statistics, and the motion of the robot's table as reference points show it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from truearm.engine.data.checks import clean_references
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import Sighting, compared
from truearm.engine.robot.chain import Array, ForwardKinematics
from truearm.engine.robot.parameters import SCALE
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import quaternion_from_rotation, rigid_motion, rotation_from_quaternion


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


_UNMOVED = 1e-4  # references that keep their distances better than this moved together [m]


@dataclass(frozen=True)
class TableMotion:
    """What the table's motion did to the readings of the targets."""

    removed: float  #: Root mean square by which it moved them [m].
    #: Mean square of the error that the noise of the reference points leaves in readings from which the motion was
    #: taken out [m^2].
    left: float
    freedom: int  #: Degrees of freedom behind that noise.


def without_table_motion(data: Dataset) -> Dataset:
    """Return the data as if the table had stood still.

    At each configuration with three or more reference points that kept their distances, the rigid motion from
    there to their mean places (Kabsch 1976) is applied to the readings of the targets. Other configurations stay.
    """
    position, oriented = data.position.copy(), data.has_orientation
    quaternion = None if data.quaternion is None else data.quaternion.copy()
    moved = False
    for rows, R, shift, _, _ in _motions(data):
        position[rows] = position[rows] @ R.T + shift
        if quaternion is not None:
            turned = rows[oriented[rows]]
            quaternion[turned] = quaternion_from_rotation(R @ rotation_from_quaternion(quaternion[turned]))
        moved = True
    return replace(data, position=position, quaternion=quaternion) if moved else data


def table_motion(data: Dataset) -> TableMotion | None:
    """Return what the table's motion did, of readings from which it was taken out; None where it was not measured."""
    moved, noise, freedom, spread, read = 0.0, 0.0, 0, 0.0, 0
    for rows, R, shift, usual, misfit in _motions(data):
        places = data.position[rows][data.has_position[rows]]
        noise += float(misfit.ravel() @ misfit.ravel())
        freedom += misfit.size - 6
        if not len(places):
            continue
        moved += float(np.sum(((places - shift) @ R - places) ** 2))
        arms = usual - usual.mean(axis=0)
        inertia = np.eye(3) * np.sum(arms**2) - arms.T @ arms
        away = places - usual.mean(axis=0)
        # A place moves by the mean of the points' noise, and by the turn that their noise makes, times its arm.
        turned = np.linalg.pinv(inertia, hermitian=True)
        lever = np.sum(away**2) * np.trace(turned) - np.einsum("ni,ij,nj->", away, turned, away)
        spread += 3.0 * len(places) / len(usual) + float(lever)
        read += len(places)
    if not read or freedom < 1:
        return None
    return TableMotion(math.sqrt(moved / read), noise / freedom * spread / read, freedom)


def _motions(data: Dataset) -> Iterator[tuple[NDArray[np.intp], Array, Array, Array, Array]]:
    """Go through the configurations at which the table's motion is known.

    Yields:
        Indices of the readings there; rotation and shift from there to where the reference points are on average; those
        places ``(k, 3)``, and what the motion leaves of the points, ``(k, 3)``.
    """
    points = clean_references(data)
    if points is None:
        return
    present = np.asarray(np.isfinite(points).all(axis=2))
    complete = np.asarray(present.all(axis=1))
    if points.shape[1] < 3 or not complete.any():
        return
    usual = points[complete].mean(axis=0)
    order = np.argsort(data.configuration, kind="stable")
    first = np.searchsorted(data.configuration[order], np.arange(data.configurations + 1)).tolist()
    for c in np.flatnonzero(present.sum(axis=1) >= 3).tolist():
        seen = present[c]
        R, shift = rigid_motion(points[c, seen], usual[seen])
        misfit = points[c, seen] @ R.T + shift - usual[seen]
        if np.linalg.norm(misfit, axis=1).max() <= _UNMOVED:
            yield order[first[c] : first[c + 1]], R, shift, usual[seen], misfit
