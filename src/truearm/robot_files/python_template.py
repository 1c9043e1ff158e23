"""A toy arm of two joints in a plane: what an exported file looks like.

The writer puts the numbers of another robot in place of these, and leaves what stands below them as it is.
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

# -- the robot: m, rad, kg, N -------------------------------------------------------------------------------

JOINTS: tuple[str, ...] = ("shoulder", "elbow")
#: Whether a joint slides; the others turn.
SLIDING: tuple[bool, ...] = (False,) * 2
#: Lowest and highest joint position.
LIMITS: tuple[tuple[float, float] | None, ...] = ((-2.0, 2.0), None)
#: Where each joint stands in the frame behind the joint before, the first one in the base frame, and at last the flange
#: in the frame behind the last joint: x, y, z and roll, pitch, yaw, R = Rz(yaw) Ry(pitch) Rx(roll). A joint turns about
#: the z axis of its frame, or slides along it.
PLACES: tuple[tuple[tuple[float, float, float], tuple[float, float, float]], ...] = (
    ((0.0, 0.0, 0.0), (1.5707963267948966, 0.0, 0.0)),  # shoulder
    ((0.4, 0.0, 0.0), (0.0, 0.0, 0.0)),  # elbow
    ((0.3, 0.0, 0.0), (0.0, 0.0, 0.0)),  # flange
)
#: Free fall in the base frame.
GRAVITY: tuple[float, float, float] = (0.0, 0.0, -9.80665)
#: Number of the joint, from 0; mass and centre of gravity of its link, in the frame behind the joint.
MASSES: tuple[tuple[int, float, tuple[float, float, float]], ...] = ((0, 2.0, (0.2, 0.0, 0.0)),)
#: What the flange carries: mass, and centre of gravity in the flange frame.
PAYLOAD: tuple[float, tuple[float, float, float]] = (1.0, (0.0, 0.0, 0.0))
#: Springs and gas cylinders between two links (0 is the base, joint i carries link i + 1): link and point of both
#: anchors, pull at a distance of the anchors, that distance, and growth of the pull.
BALANCERS: tuple[
    tuple[tuple[int, tuple[float, float, float]], tuple[int, tuple[float, float, float]], float, float, float], ...
] = ()
#: Joint effects, one entry a joint. By joint positions: how far a joint turns per unit read; its Fourier series (sine
#: and cosine of the reading, then of twice the reading); the errors of its gear (periods in a turn, sine, cosine).
GAIN: tuple[float, ...] = (1.0,) * 2
FOURIER: tuple[tuple[float, float, float, float], ...] = ((0.0, 0.0, 0.0, 0.0),) * 2
TRANSMISSION: tuple[tuple[tuple[int, float, float], ...], ...] = ((),) * 2
#: The curve of each joint over a turn: sine and cosine of the reading, of twice the reading, and so on; empty for none.
CURVES: tuple[tuple[float, ...], ...] = ((),) * 2
#: By the moment M of weights about the axis (for a sliding joint the force along it): c1 M, c2 M |M|, c3 M^3; the play.
COMPLIANCE: tuple[float, ...] = (2e-05, 4e-05)
COMPLIANCE_QUADRATIC: tuple[float, ...] = (0.0,) * 2
COMPLIANCE_CUBIC: tuple[float, ...] = (0.0,) * 2
BACKLASH: tuple[float, ...] = (0.0,) * 2
#: By the moments across the axis, tilts of the joint: per moment, and to the end of a clearance.
BEARING_COMPLIANCE: tuple[float, ...] = (0.0,) * 2
CLEARANCE: tuple[float, ...] = (0.0,) * 2
#: By the direction in which gravity falls, in the joint's frame behind its turn: turns about x, y and z for each of its
#: components; empty for none.
BENDING: tuple[tuple[tuple[float, float, float], ...], ...] = ((),) * 2
#: By the weight of links further out: the joint before the link, from 0, and what a joint turns for first moments of it
#: along x, y and z of that joint's frame; empty for none.
MOMENTS: tuple[tuple[tuple[int, tuple[float, float, float]], ...], ...] = ((),) * 2
#: By the joint position, slides along x, y and z of the joint's frame before its turn: sine and cosine; empty for none.
RUN_OUT: tuple[tuple[tuple[float, float], ...], ...] = ((),) * 2
#: Whether the contact angle of clearances is taken as linear in the moments.
LINEAR_CONTACT: bool = False

#: Joint positions and the poses that truearm found for them; run this file to compare.
READINGS: tuple[tuple[float, ...], ...] = ((0.0, 0.0),)
POSITIONS: tuple[tuple[float, ...], ...] = ((0.6999999740147642, 0.0, -0.00018632634066900316),)
ROTATIONS: tuple[tuple[tuple[float, ...], ...], ...] = (
    ((0.9999999444135227, 0.00033342608035818, 0.0), (0.0, 0.0, -1.0), (-0.00033342608035818, 0.9999999444135227, 0.0)),
)

# -- kinematics, the same for every robot -------------------------------------------------------------------


def forward(q: ArrayLike) -> tuple[Array, Array]:
    """Return positions ``(n, 3)`` [m] and rotations ``(n, 3, 3)`` of the flange in the base frame.

    `q` are joint positions ``(n, joints)`` [rad, m]. The arm is at rest and bends under its weight.
    """
    return _frames(*_bent(_checked(q, (None, len(JOINTS)), "readings")))[2]


def inverse(position: ArrayLike, rotation: ArrayLike, seed: ArrayLike) -> tuple[Array, NDArray[np.bool_]]:
    """Return joint positions ``(n, joints)`` for poses of the flange, and which of them are within the joint's limits.

    Damped Newton steps lead from `seed`, joint positions ``(joints,)`` or ``(n, joints)``, to the positions ``(n, 3)``
    [m] and rotations ``(n, 3, 3)``: to the branch on which the seed lies, if it is not far away. A joint that turns
    gets the turn nearest to the seed within its limits. ValueError names the poses that were not reached.
    """
    p = _checked(position, (None, 3), "positions")
    R = _checked(rotation, (len(p), 3, 3), "rotations")
    if np.abs(R @ R.swapaxes(1, 2) - np.eye(3)).max(initial=0.0) > 1e-6 or (np.linalg.det(R) < 0.0).any():
        raise ValueError("the rotations are not all rotation matrices")
    start = _checked(np.broadcast_to(np.asarray(seed, float), (len(p), len(JOINTS))), (len(p), None), "seeds")
    q = _solved(p, R, start)
    other = _nearest_turns(q, start)
    again = (other != q).any(axis=1)
    q[again] = _solved(p[again], R[again], other[again])
    away, angle = _distances(q, p, R)
    missed = np.flatnonzero((away > 1e-9) | (angle > 1e-9))
    if len(missed):
        named = [f"{i} ({1e3 * away[i]:.3g} mm and {np.degrees(angle[i]):.3g} deg are missing)" for i in missed[:10]]
        more = f" and {len(missed) - 10} more" if len(missed) > 10 else ""
        raise ValueError(f"not reached: pose {', '.join(named)}{more}; move the pose, or give a nearer seed")
    low, high = np.array([limits or (-np.inf, np.inf) for limits in LIMITS]).T
    return q, (q >= low) & (q <= high)


# -- frames and loads


def _frames(
    turned: Array, tilted: Array, aside: Array
) -> tuple[list[tuple[Array, Array]], list[tuple[Array, Array]], tuple[Array, Array]]:
    """Return position and rotation of every joint's frame, of the frame behind it, and of the flange."""
    p, R = np.zeros((len(turned), 3)), np.broadcast_to(np.eye(3), (len(turned), 3, 3))
    joints, links = [], []
    for i, (xyz, rpy) in enumerate(PLACES):
        p, R = p + R @ xyz, R @ _rotation(2, rpy[2]) @ _rotation(1, rpy[1]) @ _rotation(0, rpy[0])
        if i == len(JOINTS):
            break
        if SLIDING[i]:
            p = p + R[:, :, 2] * turned[:, i, None]
        else:
            p = p + (R @ aside[:, i, :, None])[:, :, 0]
            R = R @ _rotation(2, turned[:, i])
        joints.append((p, R))
        if BEARING_COMPLIANCE[i] or CLEARANCE[i] or BENDING[i]:
            R = R @ _rotation(0, tilted[:, i, 0]) @ _rotation(1, tilted[:, i, 1])
        links.append((p, R))
    return joints, links, (p, R)


def _rotation(axis: int, angle: float | Array) -> Array:
    """Return the rotations about x, y or z by angles, ``(..., 3, 3)``."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.zeros((*np.shape(angle), 3, 3))
    R[..., axis, axis] = 1.0
    R[..., i, i], R[..., i, j], R[..., j, i], R[..., j, j] = c, -s, s, c
    return R


def _loads(turned: Array, tilted: Array, aside: Array) -> tuple[Array, Array, Array]:
    """Return force and moment of weights and balancers beyond each joint, in its own frame, ``(n, joints, 3)``.

    With them the axes of the joints ``(n, joints, 3, 3)``.
    """
    joints, links, flange = _frames(turned, tilted, aside)
    bodies = [(joint, mass, links[joint], cog) for joint, mass, cog in MASSES]
    bodies.append((len(JOINTS) - 1, PAYLOAD[0], flange, PAYLOAD[1]))
    force, moment = np.zeros((2, len(turned), len(JOINTS), 3))
    for i, (p, R) in enumerate(joints):
        for joint, mass, (origin, axes), cog in bodies:
            if joint >= i:
                weight = mass * np.array(GRAVITY)
                force[:, i] += weight @ R
                moment[:, i] += (np.cross(origin + axes @ cog - p, weight)[:, None, :] @ R)[:, 0]
    for (lower, fixed), (upper, moving), pull, length, growth in BALANCERS:
        held = np.array(fixed) if lower == 0 else links[lower - 1][0] + links[lower - 1][1] @ fixed
        moved = links[upper - 1][0] + links[upper - 1][1] @ moving
        away = np.linalg.norm(held - moved, axis=1)
        drawn = (held - moved) * ((pull + growth * (away - length)) / away)[:, None]
        for i, (p, R) in enumerate(joints[lower:upper], lower):
            force[:, i] += (drawn[:, None, :] @ R)[:, 0]
            moment[:, i] += (np.cross(moved - p, drawn)[:, None, :] @ R)[:, 0]
    return force, moment, np.stack([R for _, R in joints], axis=1)


# -- joint effects


def _bent(q: Array) -> tuple[Array, Array, Array]:
    """Return how far the joints turn ``(n, joints)``, tilt ``(n, joints, 2)`` and move aside ``(n, joints, 3)``.

    They are in equilibrium with their loads.
    """
    count = len(JOINTS)
    driven, aside = q + _by_position(q), np.zeros((*q.shape, 3))
    for i, waves in enumerate(RUN_OUT):
        for axis, (s, c) in enumerate(waves):
            aside[:, i, axis] = s * np.sin(q[:, i]) + c * np.cos(q[:, i])
    by_load = (COMPLIANCE, COMPLIANCE_QUADRATIC, COMPLIANCE_CUBIC, BACKLASH, BEARING_COMPLIANCE, CLEARANCE)
    if not np.any(by_load) and not any(BENDING) and not any(MOMENTS):
        return driven, np.zeros((*q.shape, 2)), aside

    def following(rows: NDArray[np.intp], now: Array) -> Array:
        turned, tilted = _by_load(*_loads(now[:, :count], now[:, count:].reshape(len(now), count, 2), aside[rows]))
        return np.concatenate([driven[rows] + turned, tilted.reshape(len(rows), 2 * count)], axis=1)

    left = np.arange(len(q))
    now = following(left, np.concatenate([q, np.zeros((len(q), 2 * count))], axis=1))
    for number in range(100):
        way = following(left, now[left]) - now[left]
        now[left] += way if number < 20 else 0.5 * way  # joints with play may swing to and fro
        left = left[np.abs(way).max(axis=1, initial=0.0) > 1e-12]
        if not len(left):
            break
    return now[:, :count], now[:, count:].reshape(len(now), count, 2), aside


def _by_position(q: Array) -> Array:
    """Return what is added to the joint positions, whatever the load."""
    s1, c1, s2, c2 = np.array(FOURIER).T
    series = s1 * np.sin(q) + c1 * np.cos(q) + s2 * np.sin(2 * q) + c2 * np.cos(2 * q)
    for i, gear in enumerate(TRANSMISSION):
        for periods, s, c in gear:
            series[:, i] += s * np.sin(periods * q[:, i]) + c * np.cos(periods * q[:, i])
    for i, curve in enumerate(CURVES):
        angles = q[:, i, None] * np.arange(1, len(curve) // 2 + 1)
        series[:, i] += np.sin(angles) @ np.array(curve[0::2]) + np.cos(angles) @ np.array(curve[1::2])
    return np.asarray((np.array(GAIN) - 1.0) * q + series)


def _by_load(force: Array, moment: Array, axes: Array) -> tuple[Array, Array]:
    """Return by how far the joints turn, or slide, and tilt under their loads."""
    m = np.where(SLIDING, force[:, :, 2], moment[:, :, 2])
    turned = np.array(COMPLIANCE) * m + np.array(COMPLIANCE_QUADRATIC) * m * np.abs(m)
    turned += np.array(COMPLIANCE_CUBIC) * m**3 + 0.5 * np.array(BACKLASH) * np.tanh(m / 0.05)
    x, y = moment[:, :, 0], moment[:, :, 1]
    across = np.hypot(x, y)
    if LINEAR_CONTACT:
        total = np.abs(x) + np.abs(y)
        contact = 0.5 * np.pi * np.abs(x) / np.where(total > 0.0, total, 1.0)
        side = np.stack([np.sign(x) * np.sin(contact), np.sign(y) * np.cos(contact)], axis=2)
    else:
        side = moment[:, :, :2] / np.where(across > 0.0, across, 1.0)[:, :, None]
    slope = np.tan(CLEARANCE)[:, None] * np.tanh(across / 0.01)[:, :, None] * side
    tilted = np.array(BEARING_COMPLIANCE)[:, None] * moment[:, :, :2] + slope / np.sqrt(1.0 + slope**2)
    down = np.array(GRAVITY) / (np.linalg.norm(GRAVITY) or 1.0)
    for i, rows in enumerate(BENDING):
        if rows:
            bent = down @ axes[:, i] @ np.array(rows).T
            tilted[:, i] += bent[:, :2]
            turned[:, i] += bent[:, 2]
    for i, links in enumerate(MOMENTS):
        for joint, of_link in links:
            turned[:, i] += np.sum(np.cross(down, axes[:, i, :, 2]) * (axes[:, joint] @ np.array(of_link)), axis=1)
    return turned, tilted


# -- steps of the inverse


def _solved(position: Array, rotation: Array, start: Array) -> Array:
    """Return where damped Newton steps from `start` end; the damping follows the error (Sugihara 2011)."""
    q, damping = start.copy(), np.ones(len(start))
    error, jacobian = _missing(q, position, rotation)
    for number in range(200):
        size = np.linalg.norm(error, axis=1)
        going = np.flatnonzero((size > 1e-11) & (damping < 1e12))
        if not len(going):
            break
        U, s, Vt = np.linalg.svd(jacobian[going], full_matrices=False)
        share = s / (s**2 + (damping[going] * size[going] ** 2 + 1e-15)[:, None])
        step = (Vt.swapaxes(1, 2) @ (share[:, :, None] * (U.swapaxes(1, 2) @ error[going, :, None])))[:, :, 0]
        step *= np.minimum(1.0, 0.5 / np.maximum(np.abs(step).max(axis=1, keepdims=True), 0.5))
        tried = q[going] + step
        e, J = _missing(tried, position[going], rotation[going])
        if number >= 8:  # few are left: those for which it matters how the joints bend on the way
            J = _by_differences(tried)
        better = np.linalg.norm(e, axis=1) < size[going]
        damping[going] = np.where(better, np.maximum(damping[going] / 5.0, 1e-6), damping[going] * 10.0)
        taken = going[better]
        q[taken], error[taken], jacobian[taken] = tried[better], e[better], J[better]
    return q


def _missing(q: Array, position: Array, rotation: Array) -> tuple[Array, Array]:
    """Return what is missing in position and orientation ``(n, 6)``, and how the rigid arm follows its joints."""
    joints, _, (p, R) = _frames(*_bent(q))
    jacobian = np.zeros((len(q), 6, len(JOINTS)))
    for i, (origin, axes) in enumerate(joints):
        if SLIDING[i]:
            jacobian[:, :3, i] = axes[:, :, 2]
        else:
            jacobian[:, :3, i] = np.cross(axes[:, :, 2], p - origin)
            jacobian[:, 3:, i] = axes[:, :, 2]
    return np.concatenate([position - p, _turn_between(R, rotation)], axis=1), jacobian


def _by_differences(q: Array) -> Array:
    """Return how the pose follows the joint positions, joint effects included, ``(n, 6, joints)``."""
    count, steps = len(JOINTS), 1e-6 * np.eye(len(JOINTS))
    p, R = forward(np.concatenate([q[:, None] + steps, q[:, None] - steps], axis=1).reshape(-1, count))
    p, R = p.reshape(-1, 2, count, 3), R.reshape(-1, 2, count, 3, 3)
    turned = _turn_between(R[:, 1].reshape(-1, 3, 3), R[:, 0].reshape(-1, 3, 3)).reshape(-1, count, 3)
    return np.concatenate([p[:, 0] - p[:, 1], turned], axis=2).swapaxes(1, 2) / 2e-6


def _turn_between(now: Array, wanted: Array) -> Array:
    """Return the rotation vectors ``(n, 3)`` that turn one orientation into another."""
    sine = 0.5 * np.cross(now, wanted, axis=1).sum(axis=2)
    size = np.linalg.norm(sine, axis=1)
    angle = np.arctan2(size, 0.5 * ((now * wanted).sum(axis=(1, 2)) - 1.0))
    vector = sine * np.where(size > 1e-9, angle / np.maximum(size, 1e-9), 1.0)[:, None]
    lost = (size <= 1e-9) & (angle > 1.0)  # half a turn: any way will do
    return np.where(lost[:, None], np.pi * now[:, :, 0], vector)


def _distances(q: Array, position: Array, rotation: Array) -> tuple[Array, Array]:
    p, R = forward(q)
    return np.linalg.norm(position - p, axis=1), np.linalg.norm(_turn_between(R, rotation), axis=1)


def _nearest_turns(q: Array, seed: Array) -> Array:
    """Return joint positions whole turns away: nearest to the seed, if they can be within the limits."""
    q = q.copy()
    for i, limits in enumerate(LIMITS):
        if not SLIDING[i]:
            turns = np.round((seed[:, i] - q[:, i]) / (2 * np.pi))
            if limits is not None:
                lowest, highest = (
                    np.ceil((limits[0] - q[:, i]) / (2 * np.pi)),
                    np.floor((limits[1] - q[:, i]) / (2 * np.pi)),
                )
                turns = np.where(lowest <= highest, np.clip(turns, lowest, highest), 0.0)
            q[:, i] += 2 * np.pi * turns
    return q


def _checked(values: ArrayLike, shape: tuple[int | None, ...], name: str) -> Array:
    array = np.asarray(values, float)
    if array.ndim != len(shape) or any(s not in (None, have) for s, have in zip(shape, array.shape, strict=True)):
        wanted = ", ".join("n" if s is None else str(s) for s in shape)
        raise ValueError(f"the {name} have shape {array.shape}; needed: ({wanted})")
    if not np.isfinite(array).all():
        raise ValueError(f"the {name} are not all finite numbers")
    return array


def self_test() -> tuple[float, float]:
    """Return the largest differences to the stored poses: of positions [m], and of entries of rotations."""
    p, R = forward(READINGS)
    return float(np.abs(p - POSITIONS).max()), float(np.abs(R - ROTATIONS).max())


if __name__ == "__main__":
    away, turned = self_test()
    print(f"{len(READINGS)} stored poses: {away:.1e} m, {turned:.1e} rad away")
    sys.exit(away > 1e-9 or turned > 1e-9)
