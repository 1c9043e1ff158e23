"""Joint positions, velocities and accelerations that a motion of the tip asks for.

A task is ``A(q) dq/dt = S t``: rows ``A = S J`` of the geometric Jacobian, chosen by a constant matrix ``S``, follow
the tip's twist ``t``. An arm with as many joints as rows has no choice. An arm with more takes, of all joint positions
that give the pose, those nearest to a reference posture ``q0``: it returns to the same joint positions when the tip
returns, which steps of least norm (``J^T (J J^T)^-1``) alone do not. With multipliers ``l`` that is

    q - q0 = A^T l

and its derivatives by time, with ``A' = S J'`` and ``M = sum_r l_r dA_r/dq``, are

    (I - M) q'  - A^T l'  = 0                        A q'  = S t
    (I - M) q'' - A^T l'' = 2 A'^T l' + M'(l) q'     A q'' = S t' - A' q'

where ``M'(l)`` is M with ``dA/dq`` replaced by its derivative by time. All are exact: for a joint i nearer to the base
than j, ``dv_j/dq_i = w_i x v_j`` and ``dw_j/dq_i = w_i x w_j`` (columns ``v``, ``w`` of the Jacobian), and
``dv_i/dq_j = dv_j/dq_i``.
"""

from __future__ import annotations

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.pose_solver import Orientation


def chosen_rows(orientation: Orientation, rotation: Array, length: float) -> Array:
    """Return the matrix S ``(3, 5 or 6, 6)`` that chooses what counts of a twist.

    Args:
        orientation: How much of the orientation counts.
        rotation: The constant orientation, ``(3, 3)``: its x and y axes are those about which the z axis can lean.
        length: Distance that weighs as much as 1 rad [m].
    """
    rows = np.eye(6)
    rows[:3] /= length
    if orientation == "axis":
        rows[3:5, 3:] = rotation[:, :2].T
    return rows[: {"free": 3, "axis": 5, "full": 6}[orientation]]


def jacobian_rates(turning: Array, columns: Array) -> Array:
    """Return the derivative of a geometric Jacobian by every joint, which is linear in each argument.

    With the Jacobian ``(n, 6, joints)`` for both it is the derivative itself. With the Jacobian's derivative by time
    once for the one and once for the other, the sum is its derivative by time.

    Returns:
        rates: ``(n, 6, joints, joints)``: row, column, joint that moves.
    """
    w, v, u = (part.swapaxes(1, 2)[:, None] for part in (turning[:, 3:], columns[:, :3], columns[:, 3:]))
    w = w.swapaxes(1, 2)  # (n, mover, 1, 3) against (n, 1, column, 3)
    joints = turning.shape[2]
    inner = np.arange(joints)[:, None] <= np.arange(joints)
    linear = np.cross(w, v) * inner[:, :, None]
    strict = inner & ~np.eye(joints, dtype=bool)
    linear = linear + (linear * strict[:, :, None]).swapaxes(1, 2)
    angular = np.cross(w, u) * strict[:, :, None]
    return np.asarray(np.concatenate([linear, angular], axis=3).transpose(0, 3, 2, 1))


def step(S: Array, J: Array, away: Array, error: Array) -> Array:
    """Return Newton's step towards the pose, and to the reference posture among the joint positions that give it.

    Args:
        S: ``(rows, 6)``.
        J: Geometric Jacobian, ``(n, 6, joints)``.
        away: Joint positions less reference posture, ``(n, joints)``.
        error: What is missing of the pose, ``(n, rows)``.
    """
    A = S @ J
    pull = _multipliers(A, away)
    return _solved(A, _bend(S, jacobian_rates(J, J), pull), (A * pull[:, :, None]).sum(1) - away, error)[0]


def velocity_and_acceleration(S: Array, J: Array, away: Array, twist: Array, change: Array) -> tuple[Array, Array]:
    """Return joint velocities and accelerations ``(n, joints)`` for a twist and its derivative by time, ``(n, 6)``."""
    A, rates, none = S @ J, jacobian_rates(J, J), np.zeros(away.shape)
    pull = _multipliers(A, away)
    M = _bend(S, rates, pull)
    velocity, pull_rate = _solved(A, M, none, twist @ S.T)
    J_rate = (rates * velocity[:, None, None, :]).sum(3)
    A_rate = S @ J_rate
    M_rate = _bend(S, jacobian_rates(J_rate, J) + jacobian_rates(J, J_rate), pull)
    right = 2 * (A_rate * pull_rate[:, :, None]).sum(1) + (M_rate * velocity[:, None, :]).sum(2)
    acceleration, _ = _solved(A, M, right, change @ S.T - (A_rate * velocity[:, None, :]).sum(2))
    return velocity, acceleration


def _multipliers(A: Array, away: Array) -> Array:
    """Return l of ``away = A^T l`` by least squares, ``(n, rows)``."""
    right = (A * away[:, None, :]).sum(2)
    return np.asarray(np.linalg.solve(A @ A.swapaxes(1, 2), right[:, :, None])[:, :, 0])


def _bend(S: Array, rates: Array, pull: Array) -> Array:
    """Return ``M = sum_r l_r dA_r/dq``, ``(n, joints, joints)``: column, joint that moves."""
    return np.asarray((rates * (pull @ S)[:, :, None, None]).sum(1))


def _solved(A: Array, M: Array, first: Array, second: Array) -> tuple[Array, Array]:
    """Return x and y of ``(I - M) x - A^T y = first``, ``A x = second``."""
    n, rows, joints = A.shape
    whole = np.zeros((n, joints + rows, joints + rows))
    whole[:, :joints, :joints] = np.eye(joints) - M
    whole[:, :joints, joints:] = -A.swapaxes(1, 2)
    whole[:, joints:, :joints] = A
    solution = np.linalg.solve(whole, np.concatenate([first, second], axis=1)[:, :, None])[:, :, 0]
    return solution[:, :joints], solution[:, joints:]
