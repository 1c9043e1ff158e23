"""How the instrument was tied to the robot's base: without it no pose can be compared with its command.

A file says it::

    truearm: truearm-alignment/1
    units: {length: mm, angle: deg}
    kind: base-features
    position: [1500.2, -310.4, 12.1]
    quaternion: [1, 0, 0, 0]
    sigma: 0.03
    sigma_rot: 0.002

``position`` and ``quaternion`` are of the instrument's frame in the robot's base frame, ``sigma`` and ``sigma_rot`` the
standard deviations of each coordinate and each angle, as they are at the origin of the base. ``base-features`` were
measured on the robot's foot; ``controller-frame`` is a frame that the controller was taught. Both tell how far the
robot is from its commands in a frame that others can find again. A best fit of the attained poses to the commanded ones
hides what pose accuracy measures, and is not what the standard asks for.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np
from pydantic import BaseModel

from truearm.engine.base.errors import InputError, Words, refusals_at
from truearm.engine.base.files import read_yaml
from truearm.engine.base.units import sized_si
from truearm.engine.motion.cube import Cube
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot_file.entries import STRICT, Number, Triple
from truearm.engine.robot.transform import Transform, rigid_motion

SCHEMA: Final = "truearm-alignment/1"
Kind = Literal["base-features", "controller-frame", "best-fit"]
#: How far a quaternion's length may be from 1.
_TOLERANCE: Final = 1e-3
#: Poses that nearly lie on a line leave a turn about it open: their second extent over the first.
_LINE: Final = 1e-3


@dataclass(frozen=True)
class Alignment:
    """How the instrument was tied to the robot's base."""

    kind: Kind  #: Of what.
    T_base_instrument: Transform  #: The instrument's frame in the robot's base frame.
    sigma: float  #: Standard deviation of each coordinate at `about` [m].
    sigma_rot: float  #: Of each angle [rad].
    #: The point of the base frame that the tie is known best at: the origin of the base, the middle of the poses for a
    #: best fit [m].
    about: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def is_standard(self) -> bool:
        """Whether it is one that the standard knows."""
        return self.kind != "best-fit"

    def in_base(self, position: Array) -> Array:
        """Return positions ``(n, 3)`` of the instrument's frame in the base frame [m]."""
        place = self.T_base_instrument
        return np.asarray(position @ place.rotation.T + np.array(place.translation))

    def turned_to_base(self, rotation: Array) -> Array:
        """Return rotations ``(n, 3, 3)`` of the instrument's frame in the base frame."""
        return np.asarray(self.T_base_instrument.rotation @ rotation)

    def covariance_at(self, position: Array) -> Array:
        """Return what the tie leaves open of a position ``(3,)`` in the base frame: its covariance ``(3, 3)`` [m^2].

        ``sigma^2 I + sigma_rot^2 (|r|^2 I - r r^T)``, r the lever from :attr:`about`.
        """
        lever = position - np.array(self.about)
        return np.asarray(
            self.sigma**2 * np.eye(3) + self.sigma_rot**2 * ((lever @ lever) * np.eye(3) - np.outer(lever, lever))
        )


class _Units(BaseModel):
    model_config = STRICT

    length: Literal["mm", "m", "um"]
    angle: Literal["deg", "rad", "mrad"]


class _AlignmentFile(BaseModel):
    """Schema ``truearm-alignment/1``."""

    model_config = STRICT

    truearm: Literal["truearm-alignment/1"]
    units: _Units
    kind: Literal["base-features", "controller-frame"]
    position: Triple
    quaternion: tuple[Number, Number, Number, Number]
    sigma: Number
    sigma_rot: Number


def read_alignment(path: Path) -> Alignment:
    """Read a file of the schema above.

    Raises:
        InputError: If the file cannot be used: an entry that is missing or not known, a quaternion that does not have
            length 1, or a standard deviation that is not above zero.
    """
    content = read_yaml(path, _AlignmentFile)
    units = content.units
    q = np.array(content.quaternion)
    length = float(np.linalg.norm(q))
    if abs(length - 1.0) > _TOLERANCE:
        raise InputError(
            "the quaternion (w, x, y, z) does not have length 1",
            where=f"{path}, quaternion",
            came=f"length {length:.6g}",
            allowed=f"1 within {_TOLERANCE:g}",
            cure="Check the order of its numbers, and that all digits were written.",
        )
    x, y, z = (sized_si(value, units.length, f"{path}, position") for value in content.position)
    with refusals_at(f"{path}, sigma"):
        sigma = sized_si(content.sigma, units.length, deviation=True)
    with refusals_at(f"{path}, sigma_rot"):
        sigma_rot = sized_si(content.sigma_rot, units.angle, deviation=True)
    qw, qx, qy, qz = (float(part) for part in q / length)
    return Alignment(content.kind, Transform((x, y, z), (qw, qx, qy, qz)), sigma, sigma_rot)


def refuse_implausible(tie: Alignment, cube: Cube, measured: Array, location: str) -> None:
    """Refuse a tie with which what was measured does not lie near the cube of the tests.

    Args:
        cube: In which all poses and paths lie.
        measured: Positions in the instrument's frame [m], ``(n, 3)``.
        location: The file of the tie.

    Raises:
        InputError: If half of the positions lie farther from the cube's centre than its side. The message says which
            mistake would explain it: another unit, or the pose of the base in the instrument's frame.
    """
    middle = np.median(measured, axis=0)

    def away(place: Transform) -> float:
        return float(np.abs(place.rotation @ middle + np.array(place.translation) - cube.centre).max())

    instrument_pose = tie.T_base_instrument
    if not away(instrument_pose) > cube.side:
        return
    x, y, z = instrument_pose.translation
    w, i, j, k = instrument_pose.quaternion
    cures = [
        (
            Transform((f * x, f * y, f * z), instrument_pose.quaternion),
            f"Is the position in {unit}? Then say so under units.",
        )
        for f, unit in ((1e3, "m where the file says mm"), (1e-3, "mm where the file says m"))
    ]
    inverse = Transform.from_matrix(
        instrument_pose.rotation.T, -instrument_pose.rotation.T @ np.array(instrument_pose.translation)
    )
    cures += [
        (inverse, "Is this the base in the instrument's frame? The instrument's frame in the base frame belongs here."),
        (
            Transform(instrument_pose.translation, (k, w, i, j)),
            "Does the quaternion begin with x? It begins with w: w, x, y, z.",
        ),
    ]
    fitting = [cure for place, cure in cures if away(place) <= cube.side / 2]
    raise InputError(
        "with this tie of the instrument to the base, what was measured lies far from the cube of the tests",
        where=location,
        came=Words(f"{away(instrument_pose) * 1e3:.4g} mm from its centre"),
        allowed=f"up to {cube.side * 1e3:.4g} mm",
        cure=fitting[0] if fitting else "Check its numbers and units, and those of the files that were measured.",
    )


def best_fit(attained: Array, commanded: Array) -> Alignment:
    """Return the tie that brings attained barycentres nearest to their commands, in the sum of squares.

    Its standard deviations are those that the distances which remain leave open.

    Args:
        attained: Barycentres in the instrument's frame [m], ``(k, 3)``.
        commanded: In the base frame [m], ``(k, 3)``.

    Raises:
        InputError: For fewer than three poses, or poses on a line.
    """
    k = len(attained)
    middle = commanded.mean(axis=0)
    extent = np.linalg.svd(commanded - middle, compute_uv=False) if k >= 3 else np.zeros(3)
    if not extent[1] > _LINE * extent[0]:
        raise InputError(
            "a best fit needs three poses or more that do not lie on a line",
            parameter="alignment",
            came=f"{k} pose{'s' * (k != 1)}",
            allowed="P1 to P5 of the test AP",
            cure="Measure all poses, or tie the instrument to the robot's base.",
        )
    R, p = rigid_motion(attained, commanded)
    left = attained @ R.T + p - commanded
    deviation = math.sqrt(float((left**2).sum()) / (3 * k - 6))
    # Each angle is known from the levers at right angles to it; the least known one counts.
    lever = math.sqrt(float(extent[1] ** 2 + extent[2] ** 2))
    return Alignment(
        "best-fit",
        Transform.from_matrix(R, p),
        deviation / math.sqrt(k),
        deviation / lever,
        (float(middle[0]), float(middle[1]), float(middle[2])),
    )
