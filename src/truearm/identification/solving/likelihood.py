"""The restricted likelihood of variances, with its slopes, from products of few numbers by arrival.

See :mod:`truearm.identification.solving.variance_components` for the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.identification.solving.arrivals import Arrivals
from truearm.modeling.chain import Array

#: Share of the largest information that is added where a matrix is singular but for rounding, in turn.
_MORE: Final = (0.0, 1e-15, 1e-13, 1e-11)
#: How many parameters are so few that all directions are looked at.
_FEW: Final = 100
#: Of very many parameters: information of the readings on a direction, by that of the priors, that is none.
_UNSEEN: Final = 1e-3


@dataclass(frozen=True, eq=False)
class Linearised:
    """A fit linearised at its solution.

    Attributes
    ----------
    residual
        Divided by the deviations assumed so far, ``(rows,)``.
    by_parameters
        Its derivative, per prior, ``(rows, parameters)``.
    by_joints
        Its derivative by the errors of the joints, ``(rows, joints)``.
    offset
        How far the parameters are from the centres of their priors, in priors, ``(parameters,)``.
    priors
        Whether they have any.
    arrivals
        Which equations share a draw of the joints' errors.
    factor
        Index of the factor by which the variance of each equation may differ from the one assumed, ``(rows,)``.
    """

    residual: Array
    by_parameters: Array
    by_joints: Array
    offset: Array
    priors: bool
    arrivals: Arrivals
    factor: NDArray[np.intp]

    @property
    def directions(self) -> Array:
        """Directions of the parameters, per prior, that the readings as assumed know to one, ``(parameters, p)``.

        Of very many parameters these are the directions that readings tell something about.
        """
        return self._directions[0]

    @property
    def unseen(self) -> Array:
        """The other directions, per prior, of which the priors alone know something, ``(parameters, others)``."""
        return self._directions[1]

    @cached_property
    def _directions(self) -> tuple[Array, Array]:
        A = self.by_parameters
        rows = np.concatenate([A, np.eye(A.shape[1])]) if self.priors else A
        _, s, Vt = np.linalg.svd(np.asarray(np.linalg.qr(rows, mode="r"), dtype=np.float64), full_matrices=False)
        every = np.asarray(Vt.T / np.maximum(s, 1e-12 * s[:1]))
        if not self.priors or len(s) <= _FEW:
            return every, every[:, :0]
        seen = s**2 - 1.0 > _UNSEEN
        return every[:, seen], every[:, ~seen]


class Moments:
    """Products of the equations by arrival and factor: all that the likelihood needs of them."""

    def __init__(self, at: Linearised, factors: int) -> None:
        self.at = at
        Q = at.by_parameters @ at.directions
        z = (at.by_parameters @ at.offset if at.priors else 0.0) - at.residual
        self.known = at.directions.T @ at.directions if at.priors else np.zeros((Q.shape[1], Q.shape[1]))
        self.rows = np.bincount(at.factor, minlength=factors).astype(float)
        self.Q, self.z = Q, z
        every = np.column_stack([at.by_joints, Q, z])
        k = at.by_joints.shape[1]
        by_arrival, whole = [], []
        for index in range(factors):
            mine = every if factors == 1 else np.where((at.factor == index)[:, None], every, 0.0)
            by_arrival.append(at.arrivals.products(mine[:, :k], mine))
            whole.append(mine[:, k:].T @ mine[:, k:])
        products = np.stack(by_arrival) if factors > 1 else by_arrival[0][None]
        sums = np.stack(whole)
        self.M = products[..., :k]  # (factors, arrivals, joints, joints)
        self.T = products[..., k:-1]  # (factors, arrivals, joints, parameters)
        self.t = products[..., -1]
        self.C, self.c, self.q = sums[:, :-1, :-1], sums[:, :-1, -1], sums[:, -1, -1]


def _root(information: Array) -> Array:
    """Return the Cholesky factor of an information, with as little more as rounding asks for where little is known."""
    size = float(np.abs(np.diag(information)).max())
    for more in _MORE:
        try:
            return np.asarray(np.linalg.cholesky(information + more * size * np.eye(len(information))))
        except np.linalg.LinAlgError:
            continue
    values, vectors = np.linalg.eigh(information)
    rows = (vectors * np.sqrt(np.maximum(values, _MORE[-1] * size))).T
    return np.asarray(np.linalg.qr(rows, mode="r"), dtype=np.float64).T


class Likelihood:
    """The likelihood at some variances, with its slopes."""

    def __init__(self, of: Moments, factors: Array, joints: Array) -> None:
        self.of, self.factors, self.joints = of, factors, joints
        by = 1.0 / factors
        self.M, self.T, self.t = (np.tensordot(by, part, 1) for part in (of.M, of.T, of.t))
        root = np.sqrt(joints)
        inner = np.eye(len(joints)) + root[:, None] * self.M * root
        self.E = root[:, None] * np.linalg.inv(inner) * root
        ET = self.E @ self.T
        p = self.T.shape[2]
        whole = np.tensordot(by, of.C, 1) - self.T.reshape(-1, p).T @ ET.reshape(-1, p)
        self.whole = whole
        self._curvatures: dict[int | tuple[int, ...], Array] = {}
        self.L = _root(whole + of.known)
        b = by @ of.c - np.einsum("akp,ak->p", ET, self.t)
        self.found = np.linalg.solve(self.L.T, np.linalg.solve(self.L, b))
        self.ET = ET
        left = float(by @ of.q - np.einsum("ak,akl,al->", self.t, self.E, self.t) - b @ self.found)
        logs = float(of.rows @ np.log(factors)) + float(np.linalg.slogdet(inner)[1].sum())
        self.likelihood = -0.5 * (logs + 2.0 * float(np.log(np.abs(np.diag(self.L))).sum()) + left)

    @cached_property
    def inverse(self) -> Array:
        """Covariance of the parameters, in the directions that the moments are counted in, ``(p, p)``."""
        root = np.linalg.solve(self.L, np.eye(len(self.L)))
        return np.asarray(root.T @ root)

    @cached_property
    def _parts(self) -> tuple[Array, Array, Array, Array]:
        u = self.t - self.T @ self.found
        e = (self.E @ u[..., None])[..., 0]
        Lm = np.eye(len(self.joints)) - self.M @ self.E
        return e, (Lm @ u[..., None])[..., 0], Lm @ self.M, Lm @ self.T

    def curvature(self, kind: NDArray[np.intp] | int) -> Array:
        """Return ``A' V^-1 V_i V^-1 A`` for the variance of joints, or that of a factor, ``(p, p)``."""
        key = kind if isinstance(kind, int) else tuple(kind.tolist())
        if key not in self._curvatures:
            self._curvatures[key] = self._curvature(kind)
        return self._curvatures[key]

    def _curvature(self, kind: NDArray[np.intp] | int) -> Array:
        of, p = self.of, self.T.shape[2]
        if not isinstance(kind, int):
            N = self._parts[3][:, kind].reshape(-1, p)
            return np.asarray(N.T @ N)
        if len(self.factors) == 1:  # all of them, each times its variance, are the information
            rest = self.whole
            for variance in np.unique(self.joints[self.joints > 0.0]).tolist():
                rest = rest - variance * self.curvature(np.flatnonzero(self.joints == variance))
            return np.asarray(rest / self.factors[0])
        cross = of.T[kind].reshape(-1, p).T @ self.ET.reshape(-1, p)
        inner = self.ET.reshape(-1, p).T @ (of.M[kind] @ self.ET).reshape(-1, p)
        return np.asarray((of.C[kind] - cross - cross.T + inner) / self.factors[kind] ** 2)

    def slopes(self, kinds: Sequence[NDArray[np.intp] | int]) -> tuple[Array, Array, Array]:
        """Return ``z' P V_i P z`` and ``tr(P V_i)`` for variances, each ``(m,)``, and the information ``(m, m)``.

        Half their difference is the slope of the likelihood.

        Parameters
        ----------
        kinds
            Joints that share a variance, or the index of a factor.
        """
        of, count = self.of, len(kinds)
        e, g, LM, N = self._parts
        squares, traces = np.empty(count), np.empty(count)
        shifts = np.empty((count, self.T.shape[2]))  # A' V^-1 V_i P z
        inner = np.empty((count, *g.shape))  # G' V^-1 V_i P z
        inside: dict[int, Array] = {}
        for i, kind in enumerate(kinds):
            if isinstance(kind, int):
                v = self.factors[kind]
                h = (of.t[kind] - of.T[kind] @ self.found - (of.M[kind] @ e[..., None])[..., 0]) / v**2
                r = float(of.q[kind] - 2.0 * of.c[kind] @ self.found + self.found @ of.C[kind] @ self.found) / v**2
                r -= float(np.sum(e * (h + (of.t[kind] - of.T[kind] @ self.found) / v**2)))
                squares[i] = r
                traces[i] = of.rows[kind] / v - float(np.sum(self.E * of.M[kind])) / v**2
                shifts[i] = (of.c[kind] - of.C[kind] @ self.found - np.einsum("akp,ak->p", of.T[kind], e)) / v**2
                shifts[i] -= np.einsum("akp,ak->p", self.ET, h)
                inner[i] = h - (self.M @ (self.E @ h[..., None]))[..., 0]
                inside[i] = h
            else:
                squares[i] = float(np.sum(g[:, kind] ** 2))
                traces[i] = float(np.sum(LM[:, kind, kind]))
                shifts[i] = np.einsum("akp,ak->p", N[:, kind], g[:, kind])
                inner[i] = np.einsum("akl,al->ak", LM[:, :, kind], g[:, kind])
            traces[i] -= float(np.sum(self.inverse * self.curvature(kind)))
        information = np.empty((count, count))
        moved = np.linalg.solve(self.L, shifts.T)
        for i, kind in enumerate(kinds):
            for j, other in enumerate(kinds):
                if not isinstance(other, int):
                    value = float(np.sum(inner[i][:, other] * g[:, other]))
                elif not isinstance(kind, int):
                    value = float(np.sum(inner[j][:, kind] * g[:, kind]))
                else:
                    value = -float(np.einsum("ak,akl,al->", inside[i], self.E, inside[j]))
                    value += squares[i] / self.factors[kind] if kind == other else 0.0
                information[i, j] = 0.5 * (value - float(moved[:, i] @ moved[:, j]))
        return squares, traces, information
