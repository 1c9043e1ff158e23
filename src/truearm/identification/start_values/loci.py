"""Places in closed form: points from distances, centres from points about them, planes under points."""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.transform import Transform

#: Heights that fit worse than this on one side of a plane belong to the other [m].
_WRONG_SIDE_ERROR: Final = 5e-3


def point_at_distances(anchors: Array, lengths: Array, side: float) -> Array:
    """Return the point at these distances from known points, on one side of them if they lie in a plane.

    Args:
        anchors: Known points [m], ``(n, 3)``, three or more.
        lengths: Distances from them [m], ``(n,)``.
        side: 1 or -1: on which side of three points, or of points in a plane.
    """
    centre = anchors.mean(axis=0)
    a = anchors - centre
    _, s, Vt = np.linalg.svd(a)
    flat = len(anchors) < 4 or s[2] < 1e-3 * s[0]
    axes = Vt[:2] if flat else Vt
    rows = np.column_stack([2.0 * a @ axes.T, -np.ones(len(a))])
    solved = np.linalg.lstsq(rows, np.sum(a * a, axis=1) - lengths**2, rcond=None)[0]
    inside = solved[:-1] @ axes
    if not flat:
        return np.asarray(centre + inside)
    above = np.sqrt(max(float(solved[-1] - inside @ inside), 0.0))
    return np.asarray(centre + inside + side * above * np.cross(Vt[0], Vt[1]))


def plane_under(points: Array, heights: Array, flange: Array) -> Transform:
    """Return a frame in the plane over which points ``(n, 3)`` have these heights.

    The flange is on its upper side, unless the heights clearly say otherwise: where the robot was led along the plane
    they are its own errors, which an uncalibrated robot explains on either side.
    """
    middle = points.mean(axis=0)
    h = heights - heights.mean()
    normal = normals_of((points - middle)[None], h)[0]
    off = (points - middle) @ -normal - h
    if float(normal @ (flange - points).mean(axis=0)) < 0.0 and float(np.sqrt(np.mean(off**2))) < _WRONG_SIDE_ERROR:
        normal = -normal
    x = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
    x /= np.linalg.norm(x)
    return Transform.from_matrix(np.column_stack([x, np.cross(normal, x), normal]), middle - heights.mean() * normal)


def normals_of(points: Array, heights: Array) -> Array:
    """Return for sets of points about their middle ``(g, n, 3)`` the normals ``(g, 3)`` along which they rise so."""
    _, _, Vt = np.linalg.svd(points, full_matrices=False)
    flat = Vt[:, -1]
    if not heights.any():
        return flat
    gram = np.swapaxes(points, 1, 2) @ points
    lift = np.swapaxes(points, 1, 2) @ heights
    ridge = 1e-12 * np.trace(gram, axis1=1, axis2=2) + 1e-30  # readings may be of one place
    steep = np.linalg.solve(gram + ridge[:, None, None] * np.eye(3), lift[..., None])[..., 0]
    steep = steep / np.maximum(np.linalg.norm(steep, axis=1, keepdims=True), 1e-300)
    choices = np.stack([flat, -flat, steep], axis=1)
    off = np.einsum("gni,gci->gcn", points, choices) - heights
    chosen = np.argmin(np.sum(off**2, axis=2), axis=1)
    return np.asarray(choices[np.arange(len(choices)), chosen])


def centres_of(points: Array, distances: Array) -> Array:
    """Return for sets of points ``(g, n, 3)`` the centres ``(g, 3)`` from which they lie at these distances.

    ``|x|^2 - d^2 = 2 c x - |c|^2`` is linear in the centre and in its square, which is left free. Points that nearly
    lie in a plane say so only within it; the square then tells how far from it the centre is, on either side. Of the
    three centres the one that fits best is returned.
    """
    middle = points.mean(axis=1, keepdims=True)
    x = points - middle
    right = np.sum(x * x, axis=2) - distances**2
    _, axes = np.linalg.eigh(np.swapaxes(x, 1, 2) @ x)
    choices = [_solved(x, right)[:, :3]]
    flat = _solved(x @ axes[:, :, 1:], right)
    beside = np.sqrt(np.maximum(flat[:, 2] - np.sum(flat[:, :2] ** 2, axis=1), 0.0))
    for side in (1.0, -1.0):
        choices.append(np.einsum("gij,gj->gi", axes, np.column_stack([side * beside, flat[:, :2]])))
    centres = np.stack(choices, axis=1)
    off = np.linalg.norm(x[:, None] - centres[:, :, None], axis=3) - distances
    chosen = np.argmin(np.sum(off**2, axis=2), axis=1)
    return np.asarray(middle[:, 0] + centres[np.arange(len(centres)), chosen])


def _solved(x: Array, right: Array) -> Array:
    """Return what solves ``2 c x - s = right`` best, for sets of points ``(g, n, k)``: c and s, ``(g, k + 1)``."""
    rows = np.concatenate([2.0 * x, -np.ones((*x.shape[:2], 1))], axis=2)
    gram = np.swapaxes(rows, 1, 2) @ rows
    gram = gram + 1e-9 * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.diag([*np.ones(x.shape[2]), 0.0])
    return np.asarray(np.linalg.solve(gram, np.swapaxes(rows, 1, 2) @ right[..., None])[..., 0])
