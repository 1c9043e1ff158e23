"""A ballbar between the tool and a fixed ball: how far the tool is from the sphere it was sent to (Nubiola, 2.6.3).

One end of the bar is at a target of the tool, the other at a ball on the table. Whatever the robot does, the bar reads
the distance between the two; the robot's model predicts it. No tracker is needed, and no common frame but the centre.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot

_STEPS: Final = 50
_SETTLED: Final = 1e-12


@dataclass(frozen=True, eq=False)
class SphereTest:
    """Errors of distances from the centre of a sphere."""

    errors: Array  #: Measured minus predicted distance of each reading [m], ``(n,)``.
    centre: Array  #: The centre that was used, in the robot's world [m], ``(3,)``.

    @property
    def mean(self) -> float:
        """Mean of the signed errors [m]."""
        return float(self.errors.mean())

    @property
    def deviation(self) -> float:
        """Standard deviation of the errors about their mean [m]."""
        return float(self.errors.std(ddof=1))

    @property
    def largest(self) -> float:
        """Largest absolute error [m]."""
        return float(np.abs(self.errors).max())


def sphere_test(
    robot: Robot, joints: ArrayLike | Postures, lengths: ArrayLike, target: str, centre: ArrayLike | None = None
) -> SphereTest:
    """Compare lengths that a ballbar read with those that a model predicts.

    Args:
        robot: The model to judge.
        joints: Joint positions at which the bar was read [rad or m], ``(n, joints)``, or postures.
        lengths: What the bar read [m], ``(n,)``; NaN where it was beyond its range, which is left out.
        target: The target of the tool at which the bar is attached.
        centre: The fixed ball in the robot's world [m], ``(3,)``: where the model says the robot was when it was
            taught. If None, the centre that makes the sum of squared errors least; an error in teaching then does not
            count.

    Raises:
        InputError: If there are not as many lengths as configurations, fewer than two are left, or fewer than five to
            find the centre from; or if they lie so that it cannot be found.
    """
    q = joints if isinstance(joints, Postures) else Postures(np.asarray(joints, float))
    read = np.asarray(lengths, float)
    if read.shape != (len(q),):
        raise InputError(
            "every configuration needs one length",
            where="lengths",
            came=f"{read.shape} for {len(q)} configurations",
            allowed=f"({len(q)},)",
        )
    inside = np.isfinite(read)
    needed = 2 if centre is not None else 5
    if inside.sum() < needed:
        raise InputError(
            "too few lengths within the range of the ballbar",
            where="lengths",
            came=int(inside.sum()),
            allowed=f"{needed} or more",
            cure="Send the tool to more points of the sphere." if inside.all() else "Calibrate the robot first.",
        )
    points, _ = robot.world_poses(q.at(np.flatnonzero(inside)), target)
    middle = _centre(points, read[inside]) if centre is None else np.asarray(centre, float)
    return SphereTest(read[inside] - np.linalg.norm(points - middle, axis=1), middle)


def _centre(points: Array, lengths: Array) -> Array:
    """Return the point whose distances from others are nearest to given ones, by least squares."""
    # Differences of squared distances are linear in the centre: a start that needs no guess.
    about = points.mean(axis=0)
    p = points - about
    size = float(np.linalg.norm(p, axis=1).max())
    A = np.column_stack([2 * p / size, np.ones(len(p))])
    spread = np.linalg.svd(A, compute_uv=False)
    if not spread[-1] > 1e-6 * spread[0]:
        raise InputError(
            "the centre cannot be found: the points lie in one plane",
            where="centre",
            cure="Give the centre, or spread the points over the sphere.",
        )
    centre = np.linalg.lstsq(A, ((p**2).sum(axis=1) - lengths**2) / size, rcond=None)[0][:3]
    for _ in range(_STEPS):
        away = p - centre
        distance = np.linalg.norm(away, axis=1)
        step = np.linalg.lstsq(-away / distance[:, None], lengths - distance, rcond=None)[0]
        centre = centre + step
        if math.sqrt(step @ step) < _SETTLED:
            break
    return np.asarray(centre + about)
