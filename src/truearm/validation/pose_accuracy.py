"""How well a robot comes to poses, from three or more points of its tool (Nubiola, 3.5; ISO 9283, 7.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import rigid_motion, rotation_vector


@dataclass(frozen=True, eq=False)
class PoseErrors:
    """Errors of poses."""

    position: Array  #: Of the flange's origin [m], ``(n,)``.
    orientation: Array  #: Angle by which the flange is turned [rad], ``(n,)``.
    points: Array  #: Of each point [m], ``(n, points)``.


def pose_errors(on_flange: Array, wanted: Array, reached: Array) -> PoseErrors:
    """Compare poses, each given by the same points of the tool.

    Args:
        on_flange: The points in the flange frame [m], ``(points, 3)``.
        wanted, reached: Where they should be and where they are, in one frame [m], ``(n, points, 3)``.

    Raises:
        InputError: If the shapes differ.
    """
    if wanted.shape != reached.shape or wanted.ndim != 3 or wanted.shape[1:] != on_flange.shape:
        raise InputError(
            "the poses have different shapes",
            where="poses",
            came=f"{wanted.shape} and {reached.shape}",
            allowed=f"(n, {len(on_flange)}, 3) both",
        )
    (R, p), (Q, q) = rigid_motion(on_flange, wanted), rigid_motion(on_flange, reached)
    return PoseErrors(
        position=np.asarray(np.linalg.norm(q - p, axis=1)),
        orientation=np.asarray(np.linalg.norm(rotation_vector(np.swapaxes(R, 1, 2) @ Q), axis=1)),
        points=np.asarray(np.linalg.norm(reached - wanted, axis=2)),
    )


def repeatability(places: Array) -> float:
    """Return the positioning repeatability RP [m] of places ``(repetitions, 3)`` that should be one (ISO 9283, 7.2.2).

    It is the mean distance from the middle of all places, plus three standard deviations of that distance.

    Raises:
        InputError: If there are fewer than two.
    """
    if len(places) < 2:
        raise InputError("repeatability needs two repetitions or more", where="places", came=len(places))
    away = np.linalg.norm(places - places.mean(axis=0), axis=1)
    return float(away.mean() + 3.0 * away.std(ddof=1))
