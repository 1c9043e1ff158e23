"""Where the tip is commanded to be along a planned path: place, orientation and direction by the distance travelled.

On a path on which the orientation changes, it turns from one to the other and back in :data:`TURNS` stretches of equal
length, evenly in each.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.transform import rotation_from_vector, rotation_vector
from truearm.planning.iso9283.planned import PlannedPath

#: Stretches in each of which the orientation turns from one to the other.
TURNS: Final = 4


@dataclass(frozen=True, eq=False)
class Way:
    """A planned path by the distance travelled along it.

    Of a weave it is the line in the middle: how far the tip goes aside is for those who command it.
    """

    path: PlannedPath  #: As planned.
    reoriented: bool = False  #: Whether the orientation alternates on the way.

    @cached_property
    def length(self) -> float:
        """Of the path [m]."""
        if self.path.kind == "circle":
            return float(2.0 * math.pi * np.linalg.norm(self.path.points[1] - self.path.points[0]))
        return float(self.corners[-1])

    @cached_property
    def corners(self) -> Array:
        """Distance travelled at each of the points of a polyline or a weave [m], ``(k,)``; its ends of a circle."""
        if self.path.kind == "circle":
            return np.array([0.0, self.length])
        steps = np.linalg.norm(np.diff(self.path.points, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def position(self, distance: Array) -> Array:
        """Return places at distances ``(n,)``, ``(n, 3)`` [m]; the ends before and behind the path."""
        s = np.clip(distance, 0.0, self.length)
        points = self.path.points
        if self.path.kind == "circle":
            out = points[1] - points[0]
            aside = np.cross(self.path.normal, out)
            angle = (s / np.linalg.norm(out))[:, None]
            return np.asarray(points[0] + np.cos(angle) * out + np.sin(angle) * aside)
        return np.column_stack([np.interp(s, self.corners, points[:, k]) for k in range(3)])

    def direction(self, distance: Array) -> Array:
        """Return the unit vector of travel at distances ``(n,)``, ``(n, 3)``; behind a corner at the corner itself."""
        s = np.clip(distance, 0.0, self.length)
        points = self.path.points
        if self.path.kind == "circle":
            out = points[1] - points[0]
            out = out / np.linalg.norm(out)
            aside = np.cross(self.path.normal, out)
            angle = (s / np.linalg.norm(points[1] - points[0]))[:, None]
            return np.asarray(-np.sin(angle) * out + np.cos(angle) * aside)
        steps = np.diff(points, axis=0)
        unit = steps / np.linalg.norm(steps, axis=1, keepdims=True)
        piece = np.clip(np.searchsorted(self.corners, s, side="right") - 1, 0, len(unit) - 1)
        return np.asarray(unit[piece])

    def rotation(self, distance: Array) -> Array:
        """Return orientations at distances ``(n,)``, ``(n, 3, 3)``."""
        R, other = self.path.rotation, self.path.other
        if not self.reoriented or other is None:
            return np.broadcast_to(R, (len(distance), 3, 3))
        share = TURNS * np.clip(distance, 0.0, self.length) / self.length
        turned = 1.0 - np.abs(1.0 - share % 2.0)
        vector = rotation_vector((other @ R.T)[None])[0]
        return np.asarray(rotation_from_vector(turned[:, None] * vector) @ R)

    def evenly(self, count: int) -> Array:
        """Return evenly spaced distances from end to end, every corner among them, ``(n,)`` with n at least `count`."""
        pieces = [
            np.linspace(a, b, max(2, math.ceil(count * (b - a) / self.length)), endpoint=False)
            for a, b in zip(self.corners[:-1], self.corners[1:], strict=True)
        ]
        return np.concatenate([*pieces, [self.length]])


def weave_corners(path: PlannedPath) -> tuple[Array, float]:
    """Return the corners of a weave ``(k, 3)`` [m], and how much longer its way is than the line in the middle.

    It runs in straight lines from side to side, its first and last stretch from and to the middle.
    """
    way = path.points[-1] - path.points[0]
    length = float(np.linalg.norm(way))
    along = way / length
    aside = np.cross(path.normal, along)
    half = path.wavelength / 2
    count = int(length / half + 1e-9)
    middle = (np.arange(count) + 0.5) * half
    sides = np.where(np.arange(count) % 2 == 0, 1.0, -1.0) * path.stroke / 2
    corners = path.points[0] + middle[:, None] * along + sides[:, None] * aside
    end = path.points[0] + count * half * along
    return np.concatenate([path.points[:1], corners, end[None]]), float(np.hypot(half, path.stroke) / half)
