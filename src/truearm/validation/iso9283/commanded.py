"""The commanded path by its arc length: points, tangents, orientations, and the foot of a point on it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from truearm.modeling.chain import Array
from truearm.planning.iso9283.planned import PlannedPath
from truearm.planning.iso9283.way import Way


@dataclass(frozen=True, eq=False)
class CommandedPath:
    """A planned path by its arc length, going on before its begin and behind its end, and the feet of points on it.

    A weave is taken along the line in its middle.
    """

    way: Way  #: The path by the distance travelled.

    @classmethod
    def of(cls, path: PlannedPath, *, reoriented: bool = False) -> Self:
        """Return the path of a plan, and whether the orientation alternates on it."""
        return cls(Way(path, reoriented))

    @property
    def path(self) -> PlannedPath:
        """The plan."""
        return self.way.path

    @property
    def length(self) -> float:
        """From begin to end [m]."""
        return self.way.length

    @property
    def starts(self) -> Array:
        """Arc length at each end of a side [m], ``(k,)``. A circle has one side."""
        return self.way.corners

    @cached_property
    def vertices(self) -> Array:
        """Ends of the sides [m], ``(k, 3)``."""
        return self.way.position(self.way.corners)

    @cached_property
    def centre(self) -> Array:
        """Of a circle [m], ``(3,)``."""
        return np.asarray(self.path.points[0])

    @cached_property
    def radius(self) -> float:
        """Of a circle [m]; 0 of others."""
        circle = self.path.kind == "circle"
        return float(np.linalg.norm(self.path.points[1] - self.path.points[0])) if circle else 0.0

    @property
    def closed(self) -> bool:
        """Whether it ends where it begins."""
        return bool(np.linalg.norm(self.vertices[-1] - self.vertices[0]) < 1e-9)

    @property
    def extent(self) -> float:
        """Diameter of a circle, longest distance between two vertices of others [m]."""
        if self.radius:
            return 2 * self.radius
        return float(np.linalg.norm(self.vertices[:, None] - self.vertices[None], axis=2).max())

    def points(self, along: Array) -> Array:
        """Return the points at arc lengths ``(n,)`` [m], ``(n, 3)``.

        Before the begin and after the end it is straight on; round again on a circle.
        """
        if self.radius:
            return self.way.position(along % self.length)
        beyond = along - np.clip(along, 0.0, self.length)
        return np.asarray(self.way.position(along) + beyond[:, None] * self.way.direction(along))

    def tangents(self, along: Array) -> Array:
        """Return unit vectors along the path at arc lengths ``(n,)``, ``(n, 3)``."""
        return self.way.direction(along % self.length if self.radius else along)

    def rotations(self, along: Array) -> Array:
        """Return the commanded orientations at arc lengths ``(n,)``, ``(n, 3, 3)``."""
        return self.way.rotation(along)

    def feet(self, points: Array, near: Array, within: float) -> Array:
        """Return the arc length of the foot of each point ``(n, 3)`` on the path, ``(n,)`` [m].

        Args:
            near: About where the foot is [m], ``(n,)``: what tells apart the begin and the end of a closed path.
            within: So far from there at most [m].
        """
        if self.radius:
            out, onward = (self.vertices[0] - self.centre) / self.radius, self.way.direction(np.zeros(1))[0]
            away = points - self.centre
            turn = 2 * math.pi * self.radius
            found = self.radius * np.arctan2(away @ onward, away @ out)
            return np.asarray(found + turn * np.round((near - found) / turn))
        best, foot = np.full(len(points), np.inf), np.array(near)
        last = len(self.vertices) - 2
        for side in range(last + 1):
            begin, end = self.starts[side], self.starts[side + 1]
            direction = (self.vertices[side + 1] - self.vertices[side]) / (end - begin)
            low = np.full(len(points), -np.inf) if side == 0 else np.maximum(begin, near - within)
            high = np.full(len(points), np.inf) if side == last else np.minimum(end, near + within)
            low, high = np.maximum(low, near - within), np.minimum(high, near + within)
            at = np.clip(begin + (points - self.vertices[side]) @ direction, low, np.maximum(low, high))
            away = points - self.vertices[side] - (at - begin)[:, None] * direction
            distance = np.where(low <= high, (away**2).sum(axis=1), np.inf)
            nearer = distance < best
            best, foot = np.where(nearer, distance, best), np.where(nearer, at, foot)
        return foot
