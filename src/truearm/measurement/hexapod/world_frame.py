"""Where the base fixture stands: three cups that the robot touched, and the exact distances between them.

The robot brings one cup of its tool to each cup of the base. What it read there, and its current model, say where the
three points are; the ballbar says how far apart they are, and much better. The triangle of those distances is laid
onto the three points so that the sum of squares is least (Nubiola, 4.3 to 4.12). Its plane is that of the points, so
this is a fit in two dimensions with a closed form; the document iterates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truearm.measurement.hexapod.geometry import SIDES, triangle
from truearm.modeling.chain import Array
from truearm.modeling.transform import Transform


@dataclass(frozen=True, eq=False)
class WorldFrame:
    """The frame of the base fixture: origin B1, x to B2, z the normal on whose side B3 is at positive y."""

    frame: Transform  #: Of the fixture in the frame of the points.
    plain: Transform  #: The same without the distances: origin in the first point, x through the second.
    seen: Array  #: Distances 12, 23 and 31 between the points [m], ``(3,)``.
    residual: Array  #: How far each point is from its place in the triangle [m], ``(3, 3)``.


def plain_frame(points: Array) -> Transform:
    """Return the frame of three points ``(3, 3)``: origin in the first, x through the second, the third at +y."""
    x = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    z = np.cross(x, points[2] - points[0])
    z /= np.linalg.norm(z)
    return Transform.from_matrix(np.column_stack([x, np.cross(z, x), z]), points[0])


def world_frame(points: Array, sides: Sequence[float] | Array) -> WorldFrame:
    """Return the frame of the base fixture.

    Args:
        points: B1, B2 and B3 by the robot's model [m], ``(3, 3)``.
        sides: Measured distances 12, 23 and 31 [m], ``(3,)``.

    Raises:
        InputError: If the points lie on one line, or the distances are of no triangle.
    """
    points = np.asarray(points, float)
    seen = np.array([np.linalg.norm(points[a] - points[b]) for a, b in SIDES])
    p = triangle(seen, "B")[:, :2]
    q = triangle(sides, "B")[:, :2]
    plain = plain_frame(points)
    R = plain.rotation
    from_middle, to_middle = q - q.mean(axis=0), p - p.mean(axis=0)
    turned = (from_middle[:, 0] * to_middle[:, 1] - from_middle[:, 1] * to_middle[:, 0]).sum()
    angle = np.arctan2(turned, (from_middle * to_middle).sum())
    c, s = np.cos(angle), np.sin(angle)
    in_plane = np.array([[c, -s], [s, c]])
    shift = p.mean(axis=0) - in_plane @ q.mean(axis=0)
    R_frame = R @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    origin = points[0] + R[:, :2] @ shift
    places = origin + np.pad(q, ((0, 0), (0, 1))) @ R_frame.T
    return WorldFrame(
        frame=Transform.from_matrix(R_frame, origin),
        plain=plain,
        seen=seen,
        residual=points - places,
    )
