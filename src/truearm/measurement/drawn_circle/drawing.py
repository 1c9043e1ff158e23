"""What a drawn circle says of the configurations in which the robot drew it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.measurement.drawn_circle.scan import ScannedCircle
from truearm.modeling.chain import Array

#: More than a sprung pencil gives way [m], and more than two turns [rad]: other units were meant.
_TRAVEL: Final = 0.05
_TURNS: Final = 4 * math.pi


@dataclass(frozen=True, eq=False)
class DrawnCircle:
    """Where the pencil's point was, in the frame at the centre of the circle with its z out of the paper."""

    source: str  #: The scanned file.
    joints: Array  #: Joint positions [rad or m], ``(n, joints)``.
    angle: Array  #: Direction from the centre [rad], ``(n,)``.
    radius: Array  #: Distance from the centre in the plane of the paper [m], ``(n,)``; NaN where the line is missing.
    height: Array  #: Over the paper [m], ``(n,)``.

    @property
    def distance(self) -> Array:
        """Distance from the centre of the circle [m], ``(n,)``; NaN where the line is missing."""
        return np.hypot(self.radius, self.height)


def drawn_circle(scan: ScannedCircle, angle: Array, joints: Array, height: Array) -> DrawnCircle:
    """Put scan and potentiometer together, configuration by configuration.

    Args:
        scan: The circle on the page.
        angle: At which directions of the circle the robot was read [rad], ``(n,)``, from the page's x towards y. A
            degree of error matters little: it moves a radius by its slope only.
        joints: Joint positions there [rad or m], ``(n, joints)``.
        height: Of the tool over the paper by the potentiometer, along the pencil [m], ``(n,)``.

    Raises:
        InputError: If the arrays do not belong together, are not finite or in other units, or the line is missing at
            every angle.
    """
    angle, joints, height = (np.asarray(values, dtype=np.float64) for values in (angle, joints, height))
    if angle.ndim != 1 or not len(angle) or height.shape != angle.shape or joints.ndim != 2 or not joints.shape[1]:
        raise InputError(
            "angles, joint positions and heights do not belong together",
            came=", ".join(str(values.shape) for values in (angle, joints, height)),
            allowed="(n,), (n, joints) and (n,)",
        )
    if len(joints) != len(angle):
        raise InputError(
            "there are not as many joint positions as angles", where="joints", came=len(joints), allowed=str(len(angle))
        )
    for name, values in (("angle", angle), ("joints", joints), ("height", height)):
        if not np.isfinite(values).all():
            row = int(np.argwhere(~np.isfinite(values))[0, 0])
            raise InputError("a number is missing", where=f"{name}, row {row}", came=values[row], cure="Leave it out.")
    for name, values, most, allowed in (
        ("angle", angle, _TURNS, "two turns either way, in rad"),
        ("height", height, _TRAVEL, f"{1e3 * _TRAVEL:g} mm either way, in m"),
    ):
        if np.abs(values).max() > most:
            row = int(np.abs(values).argmax())
            raise InputError(
                "the number is too large",
                where=f"{name}, row {row}",
                came=float(values[row]),
                allowed=allowed,
                cure="Convert it to SI units.",
            )
    radius = _between(scan.profile, angle)
    if np.isnan(radius).all():
        raise InputError(
            "the line is missing at every angle", where=scan.source, cure="Check where the page's x axis was."
        )
    return DrawnCircle(source=scan.source, joints=joints, angle=angle, radius=radius, height=height)


def _between(profile: Array, angle: Array) -> Array:
    """Return the profile at angles [rad], linear between its sectors, NaN beside a missing one."""
    sectors = len(profile)
    place = angle * (sectors / (2 * math.pi))
    below = np.floor(place + 1e-9)
    share = np.maximum(place - below, 0.0)
    low, high = (profile[(below + more).astype(int) % sectors] for more in (0, 1))
    on_one = share < 1e-6
    return np.asarray(np.where(on_one, low, (1 - share) * low + share * np.where(on_one, 0.0, high)))
