"""Where the robot and its targets are, in closed form, before anything is identified.

With the nominal flange poses (R_c, p_c) a reading of target t at configuration c is
``y = R (R_c t + p_c) + p``; turned back by the base, ``R' y - p_c = R_c t + R' p``. For a given R this is linear
in the target t and in u = R' p with a matrix that does not depend on R, so both can be projected out once and for
all: what is left is ``|M vec(R) - m|^2``, nine numbers on the rotations, which a coarse look at all rotations and
a few Newton steps solve. Measured orientations add rows to it: the axis about which a target turned between
two configurations is the axis about which the flange turned, seen from the instrument.
No start needs to be given by hand, and the number of joints does not matter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.fit.fixed_places import NOTHING_FIXED, FixedPlaces
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rotation_from_quaternion

#: Weight of one radian against one metre in the search for the base's orientation: an arm's length.
_ARM = 0.3


@dataclass(frozen=True, eq=False)
class _Placement:
    """Where the data say that the robot stands, and its targets on the flange."""

    base: Transform  #: Of the robot in the instrument's frame.
    targets: dict[str, Transform | Array]  #: Places on the flange by name, in the order of the data's targets.
    #: What no place explains of each position reading [m], ``(readings, 3)``, in the axes of the base.
    left_over: Array


def initial_frames(robot: Robot, data: Dataset, fixed: FixedPlaces = NOTHING_FIXED) -> Robot:
    """Return the robot placed where the data say it stands, with the data's targets on its flange.

    Args:
        robot: Its kinematic parameters are used as they are; its own base and targets are left out of account.
        data: At least one position reading; orientations are used where present.
        fixed: Places that are known: those are not found, and the others agree with them.

    Raises:
        InputError: If no target has a position.
    """
    placement = _placements([robot.with_frames(Transform(), {})], [data], fixed)[0]
    return robot.with_frames(placement.base, placement.targets)  # type: ignore[arg-type]


def placed_errors(robot: Robot, tried: Sequence[Dataset]) -> list[Array]:
    """Return how far position readings are from the robot placed by :func:`initial_frames` [m], ``(readings,)`` each.

    Args:
        robot: At the origin, with no targets.
        tried: Data that the robot is placed by one after the other; many of them together take little longer than one.
    """
    return _left_over(_placements([robot] * len(tried), tried, NOTHING_FIXED))


def errors_of_placed(robots: Sequence[Robot], data: Dataset) -> list[Array]:
    """Return how far position readings are from each of some robots placed by them [m], ``(readings,)`` each.

    Args:
        robots: At the origin, with no targets; many of them together take little longer than one.
        data: What each of them is placed by, as :func:`initial_frames` does.
    """
    return _left_over(_placements(robots, [data] * len(robots), NOTHING_FIXED))


def _left_over(placements: Sequence[_Placement]) -> list[Array]:
    return [np.asarray(np.linalg.norm(placement.left_over, axis=1)) for placement in placements]


def _placements(robots: Sequence[Robot], tried: Sequence[Dataset], fixed: FixedPlaces) -> list[_Placement]:
    """Return where each of the data say that its robot stands, which is at the origin and has no targets."""
    rows = [_rows(placed, data, fixed) for placed, data in zip(robots, tried, strict=True)]
    if not rows:
        return []
    if fixed.base is not None:
        return [_placed(own, fixed.base.rotation, data, fixed) for own, data in zip(rows, tried, strict=True)]
    G, g = np.array([own.M.T @ own.M for own in rows]), np.array([own.M.T @ own.m for own in rows])
    bases = _nearest_rotations(G, g)
    return [_placed(own, base, data, fixed) for own, base, data in zip(rows, bases, tried, strict=True)]


@dataclass(frozen=True, eq=False)
class _Rows:
    """What the readings of some data say of the base's rotation, and with it of the places."""

    M: Array  #: M, m: ``M vec(R) = m`` for the rotation alone, ``(rows, 9)`` and ``(rows,)``.
    m: Array
    turned: Array  #: turned, left, known: ``turned vec(R) = left + known x`` for targets and base x.
    left: Array
    known: Array
    centre: Array  #: Mean of the readings [m].
    R: Array  #: Of the flange ``(configurations, 3, 3)``.
    seen: list[int]  #: seen, found: targets that were read, and those whose place is not known.
    searched: list[int]
    #: Configurations and rotations of the orientation readings of each target.
    rotations: Mapping[int, tuple[IntArray, Array]]


def _rows(placed: Robot, data: Dataset, fixed: FixedPlaces) -> _Rows:
    p, R = placed.world_poses(data.postures)
    with_position = data.has_position
    if not with_position.any():
        raise InputError("there is no position reading", where=data.source, cure="Fill in x, y and z.")
    readings = np.flatnonzero(with_position)
    seen = np.unique(data.target[readings]).tolist()
    refuse_beyond("parameters", 3 * len(seen) + 3, where=data.source)
    refuse_beyond("derivatives", len(readings) * 3 * (3 * len(seen) + 3), where=data.source)
    configuration, target = data.configuration[readings], data.target[readings]
    centre = data.position[readings].mean(axis=0)
    y = data.position[readings] - centre

    # R' y - p_c = R_c t + u: left side linear in the nine entries of R, right side in the targets and u.
    left = p[configuration]
    fixed_targets = {t: fixed.targets[data.targets[t]] for t in seen if data.targets[t] in fixed.targets}
    for t, place in fixed_targets.items():
        of_target = target == t
        left[of_target] += R[configuration[of_target]] @ np.array(place.translation)
    searched = [t for t in seen if t not in fixed_targets]
    blocks = np.zeros((len(readings), 3, 3 * len(searched) + 3))
    for column, t in enumerate(searched):
        of_target = target == t
        blocks[of_target, :, 3 * column : 3 * column + 3] = R[configuration[of_target]]
    blocks[:, :, -3:] = np.eye(3)
    known = blocks.reshape(-1, blocks.shape[2])
    entries = np.zeros((len(readings), 3, 9))
    for i in range(3):
        entries[:, i, i::3] = y  # (R' y)_i = sum_j R_ji y_j with vec(R) row by row
    turned = entries.reshape(-1, 9)
    left = left.reshape(-1)
    basis = _column_space(known)
    M = turned - basis @ (basis.T @ turned)
    m = left - basis @ (basis.T @ left)

    rotations = {t: _orientations(data, t) for t in seen}
    for t, (where_t, Y) in rotations.items():
        if t in fixed_targets:  # R' Y = R_c Q with Q known
            M = np.concatenate([M, _ARM * _turned_back(Y)])
            m = np.concatenate([m, _ARM * (R[where_t] @ fixed_targets[t].rotation).reshape(-1)])
            continue
        before, after = _turn_axes(R[where_t]), _turn_axes(Y)
        rows = np.zeros((len(before), 3, 9))
        for i in range(3):
            rows[:, i, 3 * i : 3 * i + 3] = before
        M = np.concatenate([M, _ARM * rows.reshape(-1, 9)])
        m = np.concatenate([m, _ARM * after.reshape(-1)])

    return _Rows(M, m, turned, left, known, centre, R, seen, searched, rotations)


def _placed(rows: _Rows, base: Array, data: Dataset, fixed: FixedPlaces) -> _Placement:
    """Return the places that go best with a rotation of the base."""
    known, centre, R, rotations = rows.known, rows.centre, rows.R, rows.rotations
    right = rows.turned @ base.reshape(-1) - rows.left
    if fixed.base is not None:  # u = R' (p - centre) with p known: it goes to the right side
        right -= np.tile(base.T @ (np.array(fixed.base.translation) - centre), len(right) // 3)
        known = known[:, :-3]
    solution = np.zeros(0)
    if known.shape[1]:
        solution = np.asarray(np.linalg.lstsq(known, right, rcond=1e-10)[0], dtype=np.float64)
    places: dict[str, Transform | Array] = {}
    for t in set(rows.seen) - set(rows.searched):
        place = fixed.targets[data.targets[t]]
        places[data.targets[t]] = place if len(rotations[t][0]) else np.array(place.translation)
    for column, t in enumerate(rows.searched):
        point = solution[3 * column : 3 * column + 3]
        where_t, Y = rotations[t]
        if len(where_t):
            on_flange = np.swapaxes(R[where_t], 1, 2) @ (base.T @ Y)
            U, _, Vt = np.linalg.svd(on_flange.mean(axis=0))
            places[data.targets[t]] = Transform.from_matrix(U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt, point)
        else:
            places[data.targets[t]] = point
    places = {name: places[name] for name in (data.targets[t] for t in rows.seen)}
    stands = fixed.base or Transform.from_matrix(base, base @ solution[-3:] + centre)
    return _Placement(stands, places, (right - known @ solution).reshape(-1, 3))


def _turned_back(Y: Array) -> Array:
    """Return the rows that the nine entries of R are multiplied by in R' Y, for rotations Y ``(n, 3, 3)``."""
    rows = np.zeros((len(Y), 3, 3, 9))  # (R' Y)_ik = sum_j R_ji Y_jk with vec(R) row by row
    for i in range(3):
        rows[:, i, :, i::3] = np.swapaxes(Y, 1, 2)
    return rows.reshape(-1, 9)


def _column_space(A: Array) -> Array:
    U, s, _ = np.linalg.svd(A, full_matrices=False)
    return U[:, s > 1e-10 * s[0]]


def _orientations(data: Dataset, target: int) -> tuple[IntArray, Array]:
    """Return configuration indices and rotations of the orientation readings of a target."""
    readings = np.flatnonzero(data.has_orientation & (data.target == target))
    if data.quaternion is None or len(readings) == 0:
        return np.zeros(0, dtype=np.intp), np.zeros((0, 3, 3))
    return data.configuration[readings], rotation_from_quaternion(data.quaternion[readings])


def _turn_axes(R: Array) -> Array:
    """Return sin(angle) times the axis of the turns between neighbours and against the first."""
    pairs = np.concatenate([R[1:] @ np.swapaxes(R[:-1], 1, 2), R[1:] @ R[:1].swapaxes(1, 2)])
    return 0.5 * np.stack(
        [pairs[:, 2, 1] - pairs[:, 1, 2], pairs[:, 0, 2] - pairs[:, 2, 0], pairs[:, 1, 0] - pairs[:, 0, 1]], axis=1
    )


def _nearest_rotations(G: Array, g: Array) -> Array:
    """Minimise r' G r - 2 g' r over the rotations, r = vec(R) row by row, for every G ``(n, 9, 9)``: ``(n, 3, 3)``."""
    candidates = _even_rotations(1500)
    best = candidates[np.argsort(_cost(G, g, candidates), axis=1)[:, :24]]
    costs = _cost(G, g, best)
    left = np.arange(len(G))  # those that have not come to rest
    for _ in range(50):
        step = _newton_step(G[left], g[left], best[left])
        size = np.linalg.norm(step, axis=2, keepdims=True)
        step *= np.minimum(1.0, 0.5 / np.maximum(size, 1e-300))
        moved = best[left] @ _rotations(step)
        moved_costs = _cost(G[left], g[left], moved)
        better = moved_costs <= costs[left]
        best[left] = np.where(better[..., None, None], moved, best[left])
        costs[left] = np.where(better, moved_costs, costs[left])
        left = left[np.where(better, size[..., 0], 0.0).max(axis=1) >= 1e-12]
        if len(left) == 0:
            break
    nearest = best[np.arange(len(G)), np.argmin(costs, axis=1)][:, None]
    last = _newton_step(G, g, nearest)  # the cost is flat to rounding where the slope is not yet
    flat = np.linalg.norm(last, axis=2)[..., None, None] < _FLAT
    return np.asarray(np.where(flat, nearest @ _rotations(last), nearest)[:, 0])


#: Angle about a minimum within which rounding hides how the cost changes, amply [rad].
_FLAT = 1e-6


def _newton_step(G: Array, g: Array, R: Array) -> Array:
    """Return rotation vectors w, ``(n, k, 3)``, that lead from rotations R by R exp(w) to where the slope is zero.

    With ``A = R' mat(G r - g)`` half the second derivative of the cost by w is ``D' G D + sym(A) - tr(A) I``, D the
    columns of d vec(R) / dw. Where it is not positive, its eigenvalues are taken without their signs, so that every
    step goes downhill.
    """
    # R exp(w): the columns of d vec(R) / dw are vec(R [e_k]x)
    D = np.ascontiguousarray((R[:, :, None] @ _GENERATORS).reshape(*R.shape[:2], 3, 9).swapaxes(2, 3))
    Dt = D.swapaxes(2, 3)
    slope = R.reshape(*R.shape[:2], 9) @ G - g[:, None]
    A = R.swapaxes(2, 3) @ slope.reshape(R.shape)
    bend = (A + A.swapaxes(2, 3)) / 2 - np.trace(A, axis1=2, axis2=3)[..., None, None] * _IDENTITY
    curvature, V = np.linalg.eigh(Dt @ (G[:, None] @ D) + bend)
    curvature = np.abs(curvature)
    curvature += 1e-9 * curvature.sum(axis=2, keepdims=True) + 1e-300
    return np.asarray(-(V @ ((V.swapaxes(2, 3) @ (Dt @ slope[..., None])) / curvature[..., None]))[..., 0])


_IDENTITY = np.eye(3)
_GENERATORS = np.array(
    [
        [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
        [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [-1.0, 0.0, 0.0]],
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    ]
)


def _cost(G: Array, g: Array, R: Array) -> Array:
    """Return the cost of rotations ``(k, 3, 3)``, or ``(n, k, 3, 3)``, for every G: ``(n, k)``."""
    r = R.reshape(*R.shape[:-2], 9)
    return np.asarray(((r @ G - 2 * g[:, None]) * r).sum(axis=2))


def _rotations(w: Array) -> Array:
    """Return the rotations with rotation vectors `w`, ``(..., 3)``."""
    angle = np.linalg.norm(w, axis=-1, keepdims=True)
    q = np.concatenate([np.cos(angle / 2), 0.5 * np.sinc(angle / (2 * np.pi)) * w], axis=-1)
    return rotation_from_quaternion(q)


@cache
def _even_rotations(count: int) -> Array:
    """Spread rotations evenly over all of them (super-Fibonacci spiral, Alexa 2022), ``(count, 3, 3)``."""
    phi, psi = np.sqrt(2.0), 1.533751168755204288118041
    s = np.arange(count) + 0.5
    t = s / count
    d = 2 * np.pi * s
    alpha, beta = d / phi, d / psi
    inner, outer = np.sqrt(t), np.sqrt(1 - t)
    q = np.stack([inner * np.sin(alpha), inner * np.cos(alpha), outer * np.sin(beta), outer * np.cos(beta)], axis=1)
    return rotation_from_quaternion(q)
