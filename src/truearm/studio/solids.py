"""Closed surfaces of simple solids as triangles: bent tubes, drums, boxes and balls."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.robot.chain import Array

Faces = NDArray[np.int32]
#: Corners of a circle.
_AROUND: Final = 28
#: Rings of a half ball, and points of a bend.
_RINGS, _BEND = 6, 8
#: Of two legs that are shorter than so many radii no bend is made: the tube would fold into itself.
_SHORT_LEG: Final = 1.4


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles, counter-clockwise from outside."""

    vertices: Array  #: [m], ``(vertices, 3)``.
    faces: Faces  #: Vertices of each triangle, ``(faces, 3)``.

    def moved(self, rotation: Array, translation: Array) -> Mesh:
        """Return the mesh turned and then moved."""
        return Mesh(self.vertices @ rotation.T + translation, self.faces)


def together(meshes: Iterable[Mesh]) -> Mesh:
    """Return several meshes as one."""
    vertices, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.int32)], 0
    for mesh in meshes:
        vertices.append(mesh.vertices)
        faces.append(mesh.faces + np.int32(count))
        count += len(mesh.vertices)
    return Mesh(np.concatenate(vertices), np.concatenate(faces))


def tube(path: Sequence[Array], radii: tuple[float, float], *, flat_end: bool = False) -> Mesh:
    """Return a tube along corners of a path, bent smoothly at them, with round ends.

    Args:
        path: Corners, each ``(3,)`` [m]; equal ones count once.
        radii: At the start and at the end [m].
        flat_end: Whether it ends flat at the last corner, and not in half a ball around it.
    """
    centres = _bent(_without_short_legs(_distinct(path), max(radii)), max(radii))
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(centres, axis=0), axis=1))])
    share = along / along[-1] if along[-1] > 0.0 else along
    widths = radii[0] + (radii[1] - radii[0]) * share
    tangents = _tangents(centres)
    angles = np.linspace(0.0, np.pi / 2.0, _RINGS + 1)[1:-1]
    start, end = tangents[0], tangents[-1]
    rings = [(centres[0] - radii[0] * np.cos(a) * start, radii[0] * np.sin(a), start) for a in angles]
    rings += list(zip(centres, widths.tolist(), tangents, strict=True))
    if flat_end:
        rings += [(centres[-1], radii[1] * part, end) for part in (0.97, 0.6)]
    else:
        rings += [(centres[-1] + radii[1] * np.sin(a) * end, radii[1] * np.cos(a), end) for a in angles]
    tip = centres[-1] if flat_end else centres[-1] + radii[1] * end
    return _skin(rings, centres[0] - radii[0] * start, tip)


def drum(start: Array, end: Array, radius: float) -> Mesh:
    """Return a drum with rounded edges, from one end's middle to the other's [m]."""
    axis = end - start
    length = float(np.linalg.norm(axis))
    axis = axis / length
    edge = min(0.22 * radius, 0.45 * length)
    angles = np.linspace(0.0, np.pi / 2.0, 5)
    inner = radius - edge
    near = [(start + edge * (1.0 - np.sin(a)) * axis, inner + edge * np.sin(a), axis) for a in angles]
    far = [(end - edge * (1.0 - np.cos(a)) * axis, inner + edge * np.cos(a), axis) for a in angles]
    rings = [(start, 0.5 * inner, axis), (start, 0.98 * inner, axis), *near, *far]
    rings += [(end, 0.98 * inner, axis), (end, 0.5 * inner, axis)]
    return _skin(rings, start, end)


def ball(centre: Array, radius: float) -> Mesh:
    """Return a ball."""
    return tube([centre], (radius, radius))


def box(centre: Array, axes: Array, half: Sequence[float]) -> Mesh:
    """Return a box.

    Args:
        axes: Unit vectors along its edges as columns, right-handed, ``(3, 3)``.
        half: Half of each edge [m].
    """
    signs = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    sides = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    vertices, faces = [], []
    for number, side in enumerate(sides):  # a face has its own corners, so that it looks flat
        vertices += [centre + axes @ (signs[k] * half) for k in side]
        faces += [[4 * number + a for a in (0, 1, 2)], [4 * number + a for a in (0, 2, 3)]]
    return Mesh(np.array(vertices), np.array(faces, np.int32))


def frame_about(axis: Array) -> Array:
    """Return right-handed axes ``(3, 3)``, as columns, of which the third is a unit vector."""
    other = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = np.cross(other, axis)
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(axis, x), axis], axis=1)


def _distinct(path: Sequence[Array]) -> list[Array]:
    kept = [np.asarray(path[0], float)]
    for corner in path[1:]:
        if np.linalg.norm(corner - kept[-1]) > 1e-6:
            kept.append(np.asarray(corner, float))
    return kept


def _without_short_legs(path: list[Array], radius: float) -> list[Array]:
    """Leave out inner corners of a path with a leg too short to bend, the shortest leg first."""
    path = list(path)
    while len(path) > 2:
        legs = [float(np.linalg.norm(b - a)) for a, b in pairwise(path)]
        short = int(np.argmin(legs))
        if legs[short] >= _SHORT_LEG * radius:
            break
        del path[short if short == len(path) - 2 else short + 1]
    return path


def _bent(path: list[Array], radius: float) -> Array:
    """Return points along a path whose corners are bends, by quadratic Bezier curves."""
    points = [path[0]]
    for before, corner, after in zip(path, path[1:], path[2:], strict=False):
        ends = []
        for other, last in ((before, path[0]), (after, path[-1])):
            way = other - corner
            leg = float(np.linalg.norm(way)) * (1.0 if other is last else 0.5)
            ends.append(corner + way / np.linalg.norm(way) * min(leg, 2.5 * radius))
        for t in np.linspace(0.0, 1.0, _BEND):
            points.append((1 - t) ** 2 * ends[0] + 2 * t * (1 - t) * corner + t**2 * ends[1])
    points.append(path[-1])
    return np.array(_distinct(points))


def _tangents(centres: Array) -> Array:
    if len(centres) == 1:
        return np.array([[0.0, 0.0, 1.0]])
    steps = np.diff(centres, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    tangents = np.concatenate([steps[:1], steps[:-1] + steps[1:], steps[-1:]])
    return np.asarray(tangents / np.linalg.norm(tangents, axis=1, keepdims=True))


def _skin(rings: Sequence[tuple[Array, float, Array]], first: Array, last: Array) -> Mesh:
    """Return the surface over rings (centre, radius, direction), closed by a point before and one behind them."""
    angles = np.arange(_AROUND) * (2.0 * np.pi / _AROUND)
    circle = np.stack([np.cos(angles), np.sin(angles)])
    vertices = [np.array([first])]
    x = frame_about(rings[0][2])[:, 0]
    for centre, radius, along in rings:
        x = x - (x @ along) * along  # the smallest turn from ring to ring, so that the skin is not wrung
        x = x / np.linalg.norm(x)
        y = np.cross(along, x)
        vertices.append(centre + radius * (circle[:1].T * x + circle[1:].T * y))
    vertices.append(np.array([last]))
    here = np.arange(_AROUND)
    ahead = (here + 1) % _AROUND
    faces = [np.stack([np.zeros_like(here), 1 + ahead, 1 + here], axis=1)]
    for ring in range(len(rings) - 1):
        a, b = 1 + ring * _AROUND, 1 + (ring + 1) * _AROUND
        faces += [
            np.stack([a + here, a + ahead, b + here], axis=1),
            np.stack([a + ahead, b + ahead, b + here], axis=1),
        ]
    end = 1 + (len(rings) - 1) * _AROUND
    faces.append(np.stack([np.full_like(here, end + _AROUND), end + here, end + ahead], axis=1))
    return Mesh(np.concatenate(vertices), np.concatenate(faces).astype(np.int32))
