"""Parts of a validation: orientation errors, and distances from where the robot was calibrated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import Errors
from truearm.engine.document.document import Words, detail, say
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rotation_from_quaternion, rotation_from_vector

# Orientation errors in numbers that people know: a rotation vector, and ZXZ angles.
#
# A rotation vector is one turn about one axis. ZXZ angles (Phi, Theta, Psi), ``R = Rz(Phi) Rx(Theta) Rz(Psi)``, are
# those of Patel, sections 2.1.2 and 3.7, and of the Katana's controller; the document's formulas need arctangents of
# two arguments. Where Theta is nearly 0 or 180 deg, Phi and Psi turn about one axis, and only their sum or difference
# means anything: their errors are left out there.

#: Theta within this of 0 or 180 deg leaves Phi and Psi undetermined: an error is 20 times larger in them.
NEAR_LOCK: Final = math.radians(3.0)


@dataclass(frozen=True, eq=False)
class OrientationErrors:
    """Errors of orientations by their parts, predicted minus measured, in the robot's base frame."""

    reading: NDArray[np.intp]  #: Indices of the readings, ``(n,)``: those in the instrument's own frame.
    #: Rotation vector from the measured to the predicted orientation, about the axes of the robot's base [rad], ``(n,
    #: 3)``.
    vector: Array
    #: Errors of Phi, Theta and Psi [rad], within half a turn, ``(n, 3)``; Phi and Psi are NaN near 0 and 180 deg of
    #: Theta.
    zxz: Array

    @property
    def locked(self) -> int:
        """At how many readings Phi and Psi mean nothing."""
        return int(np.isnan(self.zxz[:, 0]).sum())

    @property
    def parts(self) -> dict[str, dict[str, float] | None]:
        """Mean, mean size, RMS and largest size of each part by its name [deg]; None where it means nothing."""
        columns = (*self.vector.T, *self.zxz.T)
        return {name: _figures(column) for name, column in zip(PARTS, columns, strict=True)}


def orientation_errors(robot: Robot, data: Dataset, errors: Errors) -> OrientationErrors | None:
    """Return the orientation errors of readings by their parts; None if no orientation was read.

    Args:
        errors: Of the robot on the data.
    """
    if errors.orientation_errors is None or data.quaternion is None:
        return None
    reading = np.flatnonzero(np.isfinite(errors.orientation_errors).all(axis=1) & (data.against < 0))
    if not len(reading):
        return None
    to_base = robot.base.rotation.T
    vector = errors.orientation_errors[reading]
    measured = to_base @ rotation_from_quaternion(data.quaternion[reading])
    predicted = to_base @ rotation_from_vector(vector) @ rotation_from_quaternion(data.quaternion[reading])
    before, after = zxz_angles(measured), zxz_angles(predicted)
    apart = (after - before + np.pi) % (2.0 * np.pi) - np.pi
    locked = np.minimum(np.sin(before[:, 1]), np.sin(after[:, 1])) < math.sin(NEAR_LOCK)
    apart[locked, ::2] = np.nan
    return OrientationErrors(reading, vector @ to_base.T, apart)


def zxz_angles(R: Array) -> Array:
    """Return Phi, Theta and Psi of rotations ``(n, 3, 3)`` with ``R = Rz(Phi) Rx(Theta) Rz(Psi)`` [rad], ``(n, 3)``.

    Theta is between 0 and pi. Where it is 0 or pi, Psi is 0.
    """
    sine = np.hypot(R[:, 2, 0], R[:, 2, 1])
    lock = sine < 1e-12
    theta = np.arctan2(sine, R[:, 2, 2])
    phi = np.where(lock, np.arctan2(R[:, 1, 0], R[:, 0, 0]), np.arctan2(R[:, 0, 2], -R[:, 1, 2]))
    psi = np.where(lock, 0.0, np.arctan2(R[:, 2, 0], R[:, 2, 1]))
    return np.stack([phi, theta, psi], axis=1)


# How far readings lie from where the robot was calibrated, and what the error does with that distance.
#
# Three distances are told. That of the tip: from a target to the nearest place at which this target was measured in the
# training configurations, both by the calibrated robot [m]. That of the posture: the largest difference of a joint to
# the training configuration where this is least; a turn more or less is the same posture [rad]. And that from the
# middle: from the target to the mean of all its places in training, which is what Nubiola's figure 4.7 plots (there,
# the middle of the measuring device).

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
        rows = np.flatnonzero(data.target[reading] == index)
        places = robot.forward(data.postures, target=data.targets[index])[0][data.configuration[reading[rows]]]
        for part in np.array_split(np.arange(len(rows)), -(-len(rows) // _ROWS)):
            apart = places[part][:, None] - known
            tip[rows[part]] = np.sqrt(np.einsum("nkx,nkx->nk", apart, apart).min(axis=1))
        middle[rows] = np.linalg.norm(places - known.mean(axis=0), axis=1)
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
    distances = np.empty(len(joints))
    for part in np.array_split(np.arange(len(joints)), -(-len(joints) // _ROWS)):
        apart = joints[part][:, None, turning] - training[:, turning]
        distances[part] = np.abs((apart + np.pi) % (2.0 * np.pi) - np.pi).max(axis=2).min(axis=1)
    return distances


#: The parts of an orientation error, by their names.
PARTS: Final = ("rx", "ry", "rz", "phi", "theta", "psi")


def orientation_block(errors: OrientationErrors) -> Words:
    """Return orientation errors by their parts, in deg: the mean size of each, and in JSON the other figures."""
    parts = errors.parts
    sizes = {name: "–" if part is None else f"{part['mean_size']:.4f}" for name, part in parts.items()}
    vector = "  ".join(f"{name} {sizes[name]}" for name in PARTS[:3])
    angles = "  ".join(f"{name.capitalize()} {sizes[name]}" for name in PARTS[3:])
    left_out = f" (Phi and Psi without {errors.locked} readings near Theta 0 or 180)" if errors.locked else ""
    return detail(
        "  orientation, mean sizes in the base frame: "
        f"rotation vector  {vector} deg; ZXZ angles  {angles} deg{left_out}",
        orientation_parts_deg={
            "readings": len(errors.reading),
            "rotation_vector": {name: parts[name] for name in PARTS[:3]},
            "zxz": {name: parts[name] for name in PARTS[3:]},
            "zxz_left_out": errors.locked,
        },
    )


def _figures(values: Array) -> dict[str, float] | None:
    known = np.degrees(values[np.isfinite(values)])
    if not len(known):
        return None
    sizes = np.abs(known)
    return {
        "mean": float(known.mean()),
        "mean_size": float(sizes.mean()),
        "rms": float(np.sqrt(np.mean(known**2))),
        "max": float(sizes.max()),
    }


def distance_block(distances: RegionDistances) -> Words:
    """Return how far readings lie from where the robot was calibrated, and what the error does, in mm and deg."""
    growth = distances.growth
    away = f"{distances.tip.min() * 1e3:.0f} to {distances.tip.max() * 1e3:.0f} mm"
    turned = np.degrees(distances.joints[np.isfinite(distances.joints)])
    words = f"From the nearest of {distances.training} training configurations: tips {away}"
    if len(turned):
        words += f", joints {turned.min():.0f} to {turned.max():.0f} deg"
    if growth is not None:
        near, far, _ = growth
        words += f"; mean error {near.mean * 1e3:.3f} mm in the nearest third, {far.mean * 1e3:.3f} mm in the farthest"
    return say(
        words,
        distance_from_training={
            "training_configurations": distances.training,
            "tip_mm": [_span(span, 1e3) for span in distances.spans(distances.tip)],
            "joints_deg": [_span(span, math.degrees(1.0)) for span in distances.spans(distances.joints)],
            "middle_mm": [_span(span, 1e3) for span in distances.spans(distances.middle)],
            "grows": None if growth is None else growth[2],
        },
    )


def _span(span: Span, scale: float) -> dict[str, Any]:
    return {
        "from": span.low * scale,
        "to": span.high * scale,
        "readings": span.readings,
        "mean_mm": span.mean * 1e3,
        "max_mm": span.largest * 1e3,
    }
