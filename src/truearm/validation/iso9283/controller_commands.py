"""What a controller commands along the planned paths of tests by ISO 9283."""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.planning.iso9283.planned import PlannedPath
from truearm.planning.iso9283.way import TURNS, weave_corners
from truearm.simulation.moving.interpolator import Commands, Pace, along_circle, along_lines

#: Radius about a corner in which a rectangle is left where corners are judged [m], and that of a weave in strokes.
ZONE: Final = 2e-3
_WEAVE_ZONE: Final = 0.05
#: Tests in which a path is run without a stop at its corners.
_BLENDED: Final = ("CR", "AT-reorientation")


def zone_of(test: str, path: PlannedPath) -> float:
    """Return the radius about corners within which the controller leaves a path [m]; 0 where it stops there."""
    if path.kind == "weave":
        return _WEAVE_ZONE * path.stroke
    return ZONE if test in _BLENDED else 0.0


def path_commands(path: PlannedPath, pace: Pace, step: float, *, reoriented: bool = False) -> Commands:
    """Return what a controller commands along a planned path.

    A weave runs in straight lines from side to side, its first and last stretch from and to the middle. Its velocity is
    that of the advance along the line in the middle, so that its frequency is the velocity over the wavelength.

    Args:
        path: In the robot's base frame.
        pace: How fast.
        step: Between two commands [s].
        reoriented: Whether the orientation alternates: from one to the other and back, as :class:`.way.Way` has it.

    Raises:
        InputError: If the orientation shall alternate and the path has one alone.
    """
    if path.kind == "circle":
        return along_circle(path.points[0], path.points[1], path.normal, path.rotation, pace, step)
    points = path.points
    if path.kind == "weave":
        points, longer = weave_corners(path)
        pace = Pace(pace.velocity * longer, pace.acceleration, pace.zone, pace.turning, pace.turning_acceleration)
    rotations = np.broadcast_to(path.rotation, (len(points), 3, 3))
    if reoriented:
        if path.other is None:
            raise InputError(
                "this path has one orientation, and another is needed for the orientation to change",
                parameter="plan",
                came=path.name,
            )
        share = np.linspace(0.0, 1.0, TURNS + 1)[:, None]
        points = points[0] + share * (points[-1] - points[0])
        rotations = np.stack([path.rotation if k % 2 == 0 else path.other for k in range(TURNS + 1)])
    return along_lines(points, rotations, pace, step)
