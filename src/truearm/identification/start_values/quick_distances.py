"""How well a robot fits distances from points nobody measured, without a fit of the robot: quick enough to try slips.

The place t of the target on the flange and the centres c are the only unknowns of ``|p_i + R_i t - c_f| = d_i``. Places
on a coarse grid around the flange, each with its centres in closed form, are starts; Levenberg's steps go on from the
best few of them at once.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.identification.start_values.loci import centres_of
from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot

#: How far from the flange a target is looked for, and in what steps [m].
_REACH: Final = 0.45
_STEP: Final = 0.15
#: Places that are gone on from, and steps.
_PLACES_KEPT: Final = 12
_STEPS: Final = 40
#: A weak pull towards the start keeps what nothing determines where it is, beside readings of 1 m.
_PULL: Final = 1e-6


def quick_misfit(robot: Robot, data: Dataset) -> float | None:
    """Return the median size of what the distances are off by [m], where targets and points fit best.

    Each target has points of its own, and what is known of the distances between them does not count: with it they are
    off by more. None unless readings are distances of targets from points nobody measured, and nothing else.

    Args:
        robot: Nominal; its base is the world, and its own targets do not count.
    """
    distance = _distances_alone(data)
    if distance is None:
        return None
    p, R = robot.world_poses(data.postures)
    off = []
    for target in np.unique(data.target).tolist():
        mine = np.flatnonzero(data.target == target)
        _, of = np.unique(data.against[mine], return_inverse=True)
        where = data.configuration[mine]
        off.append(_off_by(p[where], R[where], of, distance[mine]))
    return float(np.median(np.abs(np.concatenate(off))))


def _distances_alone(data: Dataset) -> Array | None:
    """Return the distances if readings are distances of targets from points nobody measured, and nothing else."""
    if (
        data.fixture is not None
        and data.distance is not None
        and data.height is None
        and data.quaternion is None
        and not data.has_position.any()
        and (data.setup is None or not data.setup.has_position.any())
        and bool((np.isfinite(data.distance) & (data.against >= 0)).all())
    ):
        return data.distance
    return None


def _off_by(p: Array, R: Array, of: NDArray[np.intp], d: Array) -> Array:
    """Return what the distances of one target are off by [m], ``(n,)``; `of` is the point of each."""
    steps = np.arange(-_REACH, _REACH + 1e-9, _STEP)
    grid = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    tips = p + np.einsum("nij,gj->gni", R, grid)
    centres, cost = np.empty((len(grid), int(of.max()) + 1, 3)), np.zeros(len(grid))
    for index in range(centres.shape[1]):
        mine = of == index
        centres[:, index] = centres_of(tips[:, mine], d[mine])
        cost += np.sum((np.linalg.norm(tips[:, mine] - centres[:, index, None], axis=2) - d[mine]) ** 2, axis=1)
    best = np.argsort(cost)[:_PLACES_KEPT]
    settled = np.abs(_settled(p, R, of, d, grid[best], centres[best]))
    return np.asarray(settled[np.argmin(np.median(settled, axis=1))])


def _settled(p: Array, R: Array, of: NDArray[np.intp], d: Array, target: Array, centres: Array) -> Array:
    """Return what is left of the distances ``(starts, n)`` [m] where steps from the starts end."""
    starts, fixtures, _ = centres.shape
    one = np.eye(fixtures)[of]
    damping = np.full(starts, 1e-3)

    def seen(target: Array, centres: Array) -> tuple[Array, Array]:
        away = p + np.einsum("nij,gj->gni", R, target) - centres[:, of]
        far = np.linalg.norm(away, axis=2)
        return far - d, away / np.maximum(far, 1e-12)[..., None]

    off, along = seen(target, centres)
    for _ in range(_STEPS):
        by_target = np.einsum("gni,nij->gnj", along, R)
        by_centres = -(one[None, :, :, None] * along[:, :, None, :]).reshape(starts, len(d), -1)
        J = np.concatenate([by_target, by_centres], axis=2)
        transposed = J.swapaxes(1, 2)
        normal = transposed @ J
        size = normal.diagonal(axis1=1, axis2=2)
        normal = normal + np.eye(normal.shape[1]) * (damping[:, None] * size + _PULL)[:, None, :]
        step = -np.linalg.solve(normal, transposed @ off[..., None])[..., 0]
        there, centred = target + step[:, :3], centres + step[:, 3:].reshape(centres.shape)
        now_off, now_along = seen(there, centred)
        better = (now_off**2).sum(axis=1) < (off**2).sum(axis=1)
        damping = np.where(better, np.maximum(damping / 10, 1e-9), np.minimum(damping * 10, 1e6))
        if not better.any() or np.abs(step).max() < 1e-7:
            break
        target, centres = np.where(better[:, None], there, target), np.where(better[:, None, None], centred, centres)
        off = np.where(better[:, None], now_off, off)
        along = np.where(better[:, None, None], now_along, along)
    return off
