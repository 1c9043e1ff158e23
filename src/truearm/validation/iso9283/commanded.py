"""The commanded path by its arc length: points, tangents, orientations, and the foot of a point on it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array
from truearm.planning.iso9283.planned import PlannedPath
from truearm.planning.iso9283.way import Way


@dataclass(frozen=True, eq=False)
class CommandedPath:
    """A planned path by its arc length.

    A weave is taken along the line in its middle.

    Attributes
    ----------
    path
        The plan.
    vertices, starts
        Ends of the sides [m], ``(k, 3)``, and the arc length at each [m], ``(k,)``. A circle has one side.
    centre, radius
        Of a circle [m]; the radius is 0 of others.
    reoriented
        Whether the orientation alternates on the way.
    """

    path: PlannedPath
    vertices: Array
    starts: Array
    centre: Array
    radius: float
    reoriented: bool = False

    @classmethod
    def of(cls, path: PlannedPath, *, reoriented: bool = False) -> Self:
        """Return the path of a plan, and whether the orientation alternates on it."""
        if path.kind == "circle":
            centre, first = path.points[0], path.points[1]
            radius = float(np.linalg.norm(first - centre))
            return cls(
                path, np.stack([first, first]), np.array([0.0, 2 * math.pi * radius]), centre, radius, reoriented
            )
        steps = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
        return cls(path, path.points, np.concatenate([[0.0], np.cumsum(steps)]), np.zeros(3), 0.0, reoriented)

    @property
    def length(self) -> float:
        """From begin to end [m]."""
        return float(self.starts[-1])

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

    def _axes(self) -> tuple[Array, Array]:
        """Return unit vectors of a circle: to where it begins, and in the direction in which it begins."""
        out = (self.vertices[0] - self.centre) / self.radius
        return out, np.cross(self.path.normal, out)

    def _side(self, along: Array) -> tuple[NDArray[np.intp], Array]:
        last = len(self.starts) - 2
        side: NDArray[np.intp] = np.clip(np.searchsorted(self.starts, along, side="right") - 1, 0, last)
        ends = self.vertices[1:] - self.vertices[:-1]
        return side, (ends / np.linalg.norm(ends, axis=1)[:, None])[side]

    def points(self, along: Array) -> Array:
        """Return the points at arc lengths ``(n,)`` [m], ``(n, 3)``; straight on before the begin and after the end."""
        if self.radius:
            out, onward = self._axes()
            angle = along / self.radius
            return np.asarray(
                self.centre + self.radius * (np.outer(np.cos(angle), out) + np.outer(np.sin(angle), onward))
            )
        side, direction = self._side(along)
        return np.asarray(self.vertices[side] + (along - self.starts[side])[:, None] * direction)

    def tangents(self, along: Array) -> Array:
        """Return unit vectors along the path at arc lengths ``(n,)``, ``(n, 3)``."""
        if self.radius:
            out, onward = self._axes()
            angle = along / self.radius
            return np.asarray(np.outer(np.cos(angle), onward) - np.outer(np.sin(angle), out))
        return self._side(along)[1]

    def rotations(self, along: Array) -> Array:
        """Return the commanded orientations at arc lengths ``(n,)``, ``(n, 3, 3)``."""
        return Way(self.path, self.reoriented).rotation(along)

    def feet(self, points: Array, near: Array, within: float) -> Array:
        """Return the arc length of the foot of each point ``(n, 3)`` on the path, ``(n,)`` [m].

        Parameters
        ----------
        near
            About where the foot is [m], ``(n,)``: what tells apart the begin and the end of a closed path.
        within
            So far from there at most [m].
        """
        if self.radius:
            out, onward = self._axes()
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
