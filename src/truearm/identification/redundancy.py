"""Which parameters cannot be told apart, and in which combination (Nubiola, section 2.5.1; Patel, section 2.3).

Columns are looked at in a fixed order (base, targets, joint zeros, geometry from base to tip): a column that the
earlier ones already span is redundant, and its coordinates in them are the combination. Columns are scaled by the
parameters' priors, that is to physical size, never by their own norm: a column of rounding noise must stay noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.identification.problem import Problem
from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.parameters import FreeParameters, Parameter
from truearm.modeling.robot import Robot

_ORDER: Final = ("base", "target", "gain", "joint zero", "geometry")
_SPANNED: Final = 1e-7  # share of a column outside the span of the earlier ones
_MEMBER: Final = 1e-9  # share of a prior below which a parameter takes no part in a combination
_SHOWN: Final = 0.02


@dataclass(frozen=True)
class Redundancy:
    """A direction in which the parameters can move without any reading noticing.

    Attributes
    ----------
    dropped
        The parameter that is held at its nominal value.
    members
        Coefficient of each parameter that takes part, in SI units, 1 for `dropped`.
    combination
        The direction in words, for example ``d_3 - d_2``.
    """

    dropped: str
    members: dict[str, float]
    combination: str


def find_redundancies(problem: Problem, vector: Array) -> tuple[Redundancy, ...]:
    """Return the redundant parameters of a problem at `vector`, with their combinations."""
    _, J = problem.linearised(vector)
    prior = problem.free.prior
    A = J * prior
    order = sorted(range(len(prior)), key=lambda i: _ORDER.index(problem.free.parameters[i].group))
    norms = np.linalg.norm(A, axis=0)
    nothing = 1e-12 * norms.max()
    kept: list[int] = []
    basis = np.empty((len(A), 0))
    found = []
    for i in order:
        column = A[:, i]
        rest = column - basis @ (basis.T @ column)
        rest -= basis @ (basis.T @ rest)
        left = float(np.linalg.norm(rest))
        if left > max(_SPANNED * norms[i], nothing):
            basis = np.column_stack([basis, rest / left])
            kept.append(i)
            continue
        weights = np.linalg.lstsq(A[:, kept], column, rcond=None)[0] if norms[i] > nothing else np.zeros(len(kept))
        # Moving i by one prior and the kept ones by -weights priors changes nothing; stated in SI per SI.
        members = {problem.free.names[i]: 1.0}
        members |= {
            problem.free.names[k]: float(-w * prior[k] / prior[i])
            for k, w in zip(kept, weights, strict=True)
            if abs(w) * min(1.0, prior[k] / prior[i]) > _MEMBER
        }
        found.append(Redundancy(problem.free.names[i], members, _in_words(members, problem.free)))
    return tuple(found)


def _in_words(members: dict[str, float], free: FreeParameters) -> str:
    """Name the members that matter, a millimetre weighed against a tenth of a degree."""
    by_name: dict[str, Parameter] = dict(zip(free.names, free.parameters, strict=True))
    size = {n: abs(c) / (1e-3 if by_name[n].unit == "m" else 1.75e-3) for n, c in members.items()}
    largest = max(size.values())
    words = ""
    for name, coefficient in members.items():
        if size[name] < _SHOWN * largest:
            continue
        factor = abs(coefficient)
        if abs(factor - 1) < 0.02:
            text = name
        else:
            mixed = by_name[name].unit != by_name[next(iter(members))].unit
            units = {("m", "rad"): " mm/rad", ("rad", "m"): " rad/mm"}.get(
                (by_name[name].unit, by_name[next(iter(members))].unit), ""
            )
            scale = {" mm/rad": 1e3, " rad/mm": 1e-3}.get(units, 1.0)
            text = f"{factor * scale:.3g}{units if mixed else ''}·{name}"
        sign = "-" if coefficient < 0 else "+"
        words += f" {sign} {text}" if words else text
    return words


def unseen_but_felt(robot: Robot, data: Dataset, free: FreeParameters, seed: int = 0) -> tuple[str, ...]:
    """Return parameters in directions that the data do not see although poses elsewhere depend on them.

    The directions unseen by the readings are tried on configurations drawn from the robot's limits. A direction
    that changes nothing there either is a matter of convention (d_2 against d_3) and harmless; one that does is
    a loss of rank: the data are too alike.

    Parameters
    ----------
    free
        The parameters to look at; all others are held.
    """
    noise = {"position": 1.0, "orientation": 1.0}
    plain = Problem(robot, _unit_noise(data), free, noise, priors=False)
    A = plain.linearised(free.start)[1] * free.prior
    _, s, Vt = np.linalg.svd(A, full_matrices=True)
    seen = int((s > 1e-8 * s[0]).sum()) if len(s) else 0
    unseen = Vt[seen:]
    if len(unseen) == 0:
        return ()
    q = robot.random_configurations(40, np.random.default_rng(seed))
    felt = np.zeros((0, len(free.names)))
    for target in robot.targets:
        sweep = robot.sweep(q, target.name)
        linear, angular = robot.derivatives(sweep, q, free.names)
        parts = (linear, angular) if target.quaternion is not None else (linear,)
        felt = np.concatenate([felt, *(part.reshape(len(free.names), -1).T * free.prior for part in parts)])
    strength = np.linalg.norm(felt @ unseen.T, axis=0)
    scale = np.linalg.norm(felt, axis=0).max()
    lost = [direction for direction, size in zip(unseen, strength, strict=True) if size > 1e-6 * scale]
    involved = np.any([abs(direction) > 0.1 for direction in lost], axis=0) if lost else np.zeros(0, bool)
    return tuple(name for name, is_in in zip(free.names, involved, strict=False) if is_in)


def _unit_noise(data: Dataset) -> Dataset:
    return replace(data, sigma=None, sigma_rot=None)
