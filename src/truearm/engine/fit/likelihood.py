"""The restricted likelihood of variances, with its slopes, from products of few numbers by visit.

See :mod:`truearm.engine.fit.variance_components` for the model.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.fit.problem import Evaluation, Problem, Rows
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import FreeParameters


# What readings of one visit share: the robot stops once, and every target is read with the same joint errors.
#
# With errors of the joints of variance S, the residuals of a visit, each divided by its own deviation, have the
# covariance ``V = I + G S G'``, where G is their derivative by the joints. Multiplied by ``V^-1/2`` they are
# independent again. With ``H = G S^1/2`` that is ``I - H f(H'H) H'`` for a function f of a small matrix, so no matrix
# of all rows is ever formed.
@dataclass(frozen=True, eq=False)
class Visits:
    """Equations gathered by visit."""

    of_row: NDArray[np.intp]  #: Index of the visit of each equation, ``(rows,)``, without gaps.

    @property
    def count(self) -> int:
        """Number of visits."""
        return int(self.of_row.max(initial=-1)) + 1

    @cached_property
    def alike(self) -> tuple[tuple[NDArray[np.intp], NDArray[np.intp]], ...]:
        """Visits with equally many equations: their indices ``(k,)`` and the places of their equations ``(k, m)``."""
        sizes = np.bincount(self.of_row)
        order = np.argsort(self.of_row, kind="stable")
        first = np.cumsum(sizes) - sizes
        return tuple(
            (of_size, order[first[of_size][:, None] + np.arange(size)])
            for size in np.unique(sizes).tolist()
            if len(of_size := np.flatnonzero(sizes == size))
        )

    def of(self, rows: Rows) -> Visits:
        """Return the visits of some equations: all those of some visits."""
        if isinstance(rows, slice):
            return self
        return Visits(np.unique(self.of_row[rows], return_inverse=True)[1].reshape(-1))

    def products(self, left: Array, right: Array) -> Array:
        """Return ``left' right`` of each visit, ``(visits, a, b)``, for ``(rows, a)`` and ``(rows, b)``."""
        products = np.empty((self.count, left.shape[1], right.shape[1]))
        for of_size, rows in self.alike:
            products[of_size] = np.swapaxes(left[rows], 1, 2) @ right[rows]
        return products

    def spread(self, left: Array, right: Array) -> Array:
        """Return ``left right`` of each visit, ``(rows, b)``, for ``(rows, a)`` and ``(visits, a, b)``."""
        spread = np.empty((len(left), right.shape[2]))
        for of_size, rows in self.alike:
            spread[rows] = left[rows] @ right[of_size]
        return spread


@dataclass(frozen=True, eq=False)
class Whitening:
    """Makes the residuals of a visit independent."""

    visits: Visits  #: Which equations hang together.
    shared: Array  #: Derivative of the equations by the joints, times the deviations of these, ``(rows, joints)``.

    def of(self, rows: Rows) -> Whitening:
        """Return it for some equations: all those of some visits."""
        if isinstance(rows, slice):
            return self
        return Whitening(self.visits.of(rows), self.shared[rows])

    @cached_property
    def _inner(self) -> tuple[Array, Array]:
        """Eigenvalues ``(visits, joints)`` and eigenvectors of ``shared' shared`` of each visit."""
        values, vectors = np.linalg.eigh(self.visits.products(self.shared, self.shared))
        return np.maximum(values, 0.0), vectors

    def applied(self, rows: Array) -> Array:
        """Return ``V^-1/2`` times equations ``(rows,)`` or ``(rows, columns)``."""
        root = np.sqrt(1.0 + self._inner[0])
        return self._times(rows, -1.0 / (root * (1.0 + root)))

    def undone(self, rows: Array) -> Array:
        """Return ``V^1/2`` times equations ``(rows,)`` or ``(rows, columns)``."""
        return self._times(rows, 1.0 / (1.0 + np.sqrt(1.0 + self._inner[0])))

    def _times(self, rows: Array, factor: Array) -> Array:
        flat = rows.reshape(len(rows), -1)
        vectors = self._inner[1]
        inner = (vectors * factor[:, None, :]) @ np.swapaxes(vectors, 1, 2)
        product = inner @ self.visits.products(self.shared, flat)
        return np.asarray(rows + self.visits.spread(self.shared, product).reshape(rows.shape))


@dataclass(frozen=True, eq=False)
class WhitenedProblem:
    """A problem whose equations are made independent, as :func:`truearm.engine.fit.solver.solve` takes it.

    It is for the linear loss: a reading is no longer a few consecutive equations of its own.
    """

    plain: Problem
    whitening: Whitening

    @property
    def free(self) -> FreeParameters:
        """What may change."""
        return self.plain.free

    @property
    def priors(self) -> bool:
        """Whether the parameters' priors are rows of the problem."""
        return self.plain.priors

    @property
    def components(self) -> NDArray[np.intp]:
        """Number of consecutive rows of each reading, ``(readings,)``."""
        return self.plain.components

    def at(self, vector: Array) -> WhitenedEvaluation:
        """Evaluate it at a vector ``(parameters,)``."""
        return WhitenedEvaluation(self, self.plain.at(vector))

    def prior_rows(self, vector: Array) -> tuple[Array, Array]:
        """Return the residual of the priors and the diagonal of its Jacobian, both ``(parameters,)``."""
        return self.plain.prior_rows(vector)


@dataclass(frozen=True, eq=False)
class WhitenedEvaluation:
    """A whitened problem at one vector of its free parameters."""

    problem: WhitenedProblem
    plain: Evaluation

    @property
    def vector(self) -> Array:
        """Where, ``(parameters,)``."""
        return self.plain.vector

    def portions(self) -> Iterator[tuple[Rows, WhitenedEvaluation]]:
        """Go through the problem part by part, each with its equations."""
        for rows, part in self.plain.portions():
            whitening = self.problem.whitening.of(rows)
            yield rows, WhitenedEvaluation(WhitenedProblem(part.problem, whitening), part)

    @cached_property
    def residual(self) -> Array:
        """Whitened residual of the readings, ``(rows,)``."""
        return self.problem.whitening.applied(self.plain.residual)

    @cached_property
    def jacobian(self) -> Array:
        """Derivative of the residual, ``(rows, parameters)``."""
        return self.problem.whitening.applied(self.plain.jacobian)


#: Products of parameters and joints that are kept for all visits, and that are gone through at once.
_MOST_STORED: Final = 16_000_000
_AT_ONCE: Final = 2_000_000

#: Share of the largest information that is added where a matrix is singular but for rounding, in turn.
_MORE: Final = (0.0, 1e-15, 1e-13, 1e-11)
#: Size of a matrix that is inverted as a whole.
_SMALL_MATRIX: Final = 24
#: How many parameters are so few that all directions are looked at.
_FEW: Final = 100
#: Of very many parameters: information of the readings on a direction, by that of the priors, that is none.
_UNSEEN: Final = 1e-3


@dataclass(frozen=True, eq=False)
class Linearised:
    """A fit linearised at its solution."""

    residual: Array  #: Divided by the deviations assumed so far, ``(rows,)``.
    #: Its derivative, per prior, ``(rows, parameters)``; or what goes through it, the equations of some whole visits
    #: at a time, each with their indices.
    by_parameters: Array | Callable[[], Iterable[tuple[Rows, Array]]]
    by_joints: Array  #: Its derivative by the errors of the joints, ``(rows, joints)``.
    offset: Array  #: How far the parameters are from the centres of their priors, in priors, ``(parameters,)``.
    priors: bool  #: Whether they have any.
    visits: Visits  #: Which equations share a draw of the joints' errors.
    #: Index of the factor by which the variance of each equation may differ from the one assumed, ``(rows,)``.
    factor: NDArray[np.intp]
    #: Of the derivative by the parameters, ``(k, parameters)``, where it is known: products of its columns are those of
    #: all equations.
    triangle: Array | None = None
    #: Which equations share what the model cannot follow: those of visits at which the joints stand alike; None where
    #: no visits do.
    standings: Visits | None = None

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
        size = len(self.offset)
        triangle = np.eye(size) if self.priors else np.zeros((0, size))
        for A in (A for _, A in self.parts()) if self.triangle is None else (self.triangle,):
            triangle = np.asarray(np.linalg.qr(np.concatenate([A, triangle]), mode="r"), dtype=np.float64)
        _, s, Vt = np.linalg.svd(triangle, full_matrices=False)
        every = np.asarray(Vt.T / np.maximum(s, 1e-12 * s[:1]))
        if not self.priors or len(s) <= _FEW:
            return every, every[:, :0]
        seen = s**2 - 1.0 > _UNSEEN
        seen[0] = True  # the best known one, where positions are so far off that they tell nothing
        return every[:, seen], every[:, ~seen]

    def parts(self) -> Iterable[tuple[Rows, Array]]:
        """Go through the derivative by the parameters, each part with the indices of its equations."""
        if isinstance(self.by_parameters, np.ndarray):
            return ((slice(None), self.by_parameters),)
        return self.by_parameters()

    def turned(self) -> Iterator[tuple[Rows, Array, Array]]:
        """Go through it in :attr:`directions` ``(k, p)``, with what the parameters have to explain ``(k,)``."""
        for rows, A in self.parts():
            yield rows, A @ self.directions, (A @ self.offset if self.priors else 0.0) - self.residual[rows]


class Moments:
    """Products of the equations by visit and factor: all that the likelihood needs of them."""

    def __init__(self, at: Linearised, factors: int) -> None:
        self.at = at
        joints, p = at.by_joints.shape[1], at.directions.shape[1]
        self.known = at.directions.T @ at.directions if at.priors else np.zeros((p, p))
        self.rows = np.bincount(at.factor, minlength=factors).astype(float)
        self.M = np.empty((factors, at.visits.count, joints, joints))
        self.t = np.empty((factors, at.visits.count, joints))
        self.C, self.c, self.q = np.zeros((factors, p, p)), np.zeros((factors, p)), np.zeros(factors)
        stored: list[tuple[NDArray[np.intp], Array]] = []
        fits = self.t.size * p <= _MOST_STORED
        for rows, Q, z in at.turned():
            whole = np.column_stack([Q, z])
            for index in range(factors):
                of_factor = whole if factors == 1 else whole[at.factor[rows] == index]
                square = of_factor.T @ of_factor
                self.C[index] += square[:-1, :-1]
                self.c[index] += square[:-1, -1]
                self.q[index] += square[-1, -1]
            visit, products = self._by_visit(rows, np.column_stack([at.by_joints[rows], whole]))
            self.M[:, visit], self.t[:, visit] = products[..., :joints], products[..., -1]
            if fits:
                stored.append((visit, np.ascontiguousarray(products[..., joints:-1])))
        self._stored = stored if fits else None

    def _by_visit(self, rows: Rows, every: Array) -> tuple[NDArray[np.intp], Array]:
        """Return visits, and products of their equations with the derivatives by the joints, by factor."""
        at, joints = self.at, self.at.by_joints.shape[1]
        visits, factor, factors = at.visits.of(rows), at.factor[rows], len(self.q)
        products = np.empty((factors, visits.count, joints, every.shape[1]))
        for index in range(factors):
            of_factor = every if factors == 1 else np.where((factor == index)[:, None], every, 0.0)
            products[index] = visits.products(of_factor[:, :joints], of_factor)
        return np.unique(at.visits.of_row[rows]), products

    def parts(self) -> Iterator[tuple[NDArray[np.intp], Array]]:
        """Go through the products with the derivatives by the parameters, ``(factors, k, joints, parameters)``.

        Each part comes with the indices of its visits. Where there are too many to be kept they are found anew.
        """
        most = max(1, _AT_ONCE // max(1, self.t.shape[2] * len(self.known)))
        joints = self.at.by_joints.shape[1]
        stored = self._stored
        if stored is None:
            by_joints = self.at.by_joints
            for rows, Q, _ in self.at.turned():
                visit, products = self._by_visit(rows, np.column_stack([by_joints[rows], Q]))
                yield visit, products[..., joints:]
            return
        for visit, T in stored:
            for first in range(0, len(visit), most):
                yield visit[first : first + most], T[:, first : first + most]


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


def lower_inverse(L: Array) -> Array:
    """Return the inverse of a lower triangle: NumPy has none, and that of any matrix takes six times as long."""
    half = len(L) // 2
    if half < _SMALL_MATRIX:
        return np.asarray(np.linalg.inv(L))
    inverse = np.zeros_like(L)
    first, last = lower_inverse(L[:half, :half]), lower_inverse(L[half:, half:])
    inverse[:half, :half], inverse[half:, half:] = first, last
    inverse[half:, :half] = -last @ (L[half:, :half] @ first)
    return inverse


class Likelihood:
    """The likelihood at some variances, with its slopes."""

    def __init__(self, of: Moments, factors: Array, joints: Array) -> None:
        self.of, self.factors, self.joints = of, factors, joints
        by = 1.0 / factors
        self.M, self.t = (np.tensordot(by, part, 1) for part in (of.M, of.t))
        root = np.sqrt(joints)
        inner = np.eye(len(joints)) + root[:, None] * self.M * root
        factor = np.linalg.cholesky(inner)  # its eigenvalues are one or more
        half = np.linalg.inv(factor) * root
        self.E = np.swapaxes(half, 1, 2) @ half
        whole, b = np.tensordot(by, of.C, 1), by @ of.c
        seen = (self.E @ self.t[..., None])[..., 0]
        for visit, _, T in self._parts():
            HT = half[visit] @ T
            whole -= _product(HT, HT)
            b -= _moved(T, seen[visit])
        self.whole = whole
        self._by_joints: dict[tuple[int, ...], tuple[Array, Array]] = {}
        self.L = _root(whole + of.known)
        self.estimate = np.linalg.solve(self.L.T, np.linalg.solve(self.L, b))
        left = float(by @ of.q - np.einsum("ak,akl,al->", self.t, self.E, self.t) - b @ self.estimate)
        logs = float(of.rows @ np.log(factors)) + 2.0 * float(np.linalg.slogdet(factor)[1].sum())
        self.likelihood = -0.5 * (logs + 2.0 * float(np.log(np.abs(np.diag(self.L))).sum()) + left)

    def _parts(self, *, always: bool = False) -> Iterator[tuple[NDArray[np.intp], Array, Array]]:
        """Go through the visits: indices, products with the parameters by factor, and these by their variances.

        There is nothing to go through where no joint has a variance, unless it is asked for.
        """
        if always or self.joints.any():
            for visit, by_factor in self.of.parts():
                yield visit, by_factor, np.tensordot(1.0 / self.factors, by_factor, 1)

    @cached_property
    def inverse(self) -> Array:
        """Covariance of the parameters, in the directions that the moments are counted in, ``(p, p)``."""
        root = lower_inverse(self.L)
        return np.asarray(root.T @ root)

    @cached_property
    def _seen(self) -> Array:
        """What the parameters explain of the products of each visit, ``(factors, visits, joints)``."""
        seen = np.empty_like(self.of.t)
        for visit, by_factor in self.of.parts():
            seen[:, visit] = (by_factor.reshape(-1, len(self.estimate)) @ self.estimate).reshape(by_factor.shape[:-1])
        return seen

    @cached_property
    def _small(self) -> tuple[Array, Array, Array, Array]:
        u = self.t - np.tensordot(1.0 / self.factors, self._seen, 1)
        e = (self.E @ u[..., None])[..., 0]
        Lm = np.eye(len(self.joints)) - self.M @ self.E
        return e, (Lm @ u[..., None])[..., 0], Lm @ self.M, Lm

    def curvature(self, kind: NDArray[np.intp] | int) -> Array:
        """Return ``A' V^-1 V_i V^-1 A`` for the variance of joints, or that of a factor, ``(p, p)``."""
        if not isinstance(kind, int):
            return self._of_joints(kind)[0]
        if len(self.factors) == 1:  # all of them, each times its variance, are the information
            whole = self.whole
            for variance in np.unique(self.joints[self.joints > 0.0]).tolist():
                whole = whole - variance * self.curvature(np.flatnonzero(self.joints == variance))
            return np.asarray(whole / self.factors[0])
        curvature = self.of.C[kind].copy()
        for visit, by_factor, T in self._parts():
            ET = self.E[visit] @ T
            cross = _product(by_factor[kind], ET)
            curvature += _product(ET, self.of.M[kind][visit] @ ET) - cross - cross.T
        return np.asarray(curvature / self.factors[kind] ** 2)

    def _of_joints(self, kind: NDArray[np.intp]) -> tuple[Array, Array]:
        """Return the curvature for a variance of joints, and ``A' V^-1 V_i P z``."""
        key = tuple(kind.tolist())
        if key not in self._by_joints:
            _, g, _, Lm = self._small
            p = len(self.estimate)
            curvature, shift = np.zeros((p, p)), np.zeros(p)
            for visit, _, T in self._parts(always=True):
                N = Lm[visit][:, kind] @ T
                curvature += _product(N, N)
                shift += _moved(N, g[visit][:, kind])
            self._by_joints[key] = curvature, shift
        return self._by_joints[key]

    def slopes(self, kinds: Sequence[NDArray[np.intp] | int]) -> tuple[Array, Array, Array]:
        """Return ``z' P V_i P z`` and ``tr(P V_i)`` for variances, each ``(m,)``, and the information ``(m, m)``.

        Half their difference is the slope of the likelihood.

        Args:
            kinds: Joints that share a variance, or the index of a factor.
        """
        of, count = self.of, len(kinds)
        e, g, LM, _ = self._small
        squares, traces = np.empty(count), np.empty(count)
        shifts = np.empty((count, len(self.estimate)))  # A' V^-1 V_i P z
        inner = np.empty((count, *g.shape))  # G' V^-1 V_i P z
        inside: dict[int, Array] = {}
        for i, kind in enumerate(kinds):
            if isinstance(kind, int):
                v, seen = self.factors[kind], self._seen[kind]
                h = (of.t[kind] - seen - (of.M[kind] @ e[..., None])[..., 0]) / v**2
                r = (
                    float(of.q[kind] - 2.0 * of.c[kind] @ self.estimate + self.estimate @ of.C[kind] @ self.estimate)
                    / v**2
                )
                r -= float(np.sum(e * (h + (of.t[kind] - seen) / v**2)))
                squares[i] = r
                traces[i] = of.rows[kind] / v - float(np.sum(self.E * of.M[kind])) / v**2
                shifts[i] = (of.c[kind] - of.C[kind] @ self.estimate) / v**2
                pulled = (self.E @ h[..., None])[..., 0]
                for visit, by_factor, T in self._parts():
                    shifts[i] -= _moved(by_factor[kind], e[visit]) / v**2 + _moved(T, pulled[visit])
                inner[i] = h - (self.M @ pulled[..., None])[..., 0]
                inside[i] = h
            else:
                squares[i] = float(np.sum(g[:, kind] ** 2))
                traces[i] = float(np.sum(LM[:, kind, kind]))
                shifts[i] = self._of_joints(kind)[1]
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


def _product(left: Array, right: Array) -> Array:
    """Return the sum over visits and joints of products of parameters, for two ``(visits, joints, p)``."""
    p = left.shape[-1]
    return left.reshape(-1, p).T @ right.reshape(-1, p)


def _moved(products: Array, by: Array) -> Array:
    """Return the sum over visits and joints of ``(visits, joints, p)`` times ``(visits, joints)``, ``(p,)``."""
    return products.reshape(-1, products.shape[-1]).T @ by.reshape(-1)
