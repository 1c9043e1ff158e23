"""Which parameters cannot be told apart, and in which combination (Nubiola, section 2.5.1; Patel, section 2.3).

Columns are looked at in a fixed order (base, targets, joint zeros, geometry from base to tip), first for those
that stand well apart from the earlier ones, then for those that stand less and less apart; what the others span
exactly is redundant, and its coordinates in them are the combination. Taking the first that fits in one pass would
keep, between two axes that are nearly parallel, the slide that is almost spanned and hold the tilt that is not:
the classical weakness of DH parameters again. A column of whitened readings that is shorter than a third of a prior
tells nothing either. Columns are scaled by the parameters' priors, that is to physical
size, never by their own norm alone: a column of rounding noise must stay noise.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Protocol

import numpy as np

from truearm.identification.held import NOTHING_HELD, Held
from truearm.identification.solving.problem import Problem
from truearm.measurement.dataset import Dataset
from truearm.measurement.observations import OBSERVATIONS
from truearm.modeling.chain import Array, ForwardKinematics
from truearm.modeling.parameters import SCALE, FreeParameters, Parameter
from truearm.modeling.robot import Robot

_ORDER: Final = ("base", "fixture", "target", "", "joint zero", "geometry")  # "" is every joint effect
_INDEPENDENT_SHARES: Final = (
    1e-1,
    1e-2,
    1e-3,
    1e-4,
    1e-5,
    1e-6,
    1e-7,
)  # share of a column outside the span of the others
_LEAST_MEMBER: Final = 1e-9  # priors per prior below which a parameter takes no part in a combination
_SHOWN: Final = 0.02
_LEAST_INFORMATION: Final = 0.3  # readings that tell a parameter no better than to three priors do not tell it
_UNOBSERVED: Final = 1e-8  # share of the best observed direction
_NEGLIGIBLE: Final = 1e-6  # share of the largest effect of a parameter
_NEGLIGIBLE_UP_TO_GAUGE: Final = 1e-3  # the same up to gauge freedoms: noise hides the size of everything
_LEAST_INVOLVED: Final = 0.1  # share of a parameter in the lost directions


@dataclass(frozen=True)
class Redundancy:
    """A direction in which the parameters can move without changing any reading."""

    dropped: str  #: The parameter that is held at its nominal value.
    members: dict[str, float]  #: Coefficient of each parameter that takes part, in SI units, 1 for `dropped`.
    combination: str  #: The direction in words, for example ``d_3 - d_2``.


class Linearisable(Protocol):
    """A whitened problem, such as :class:`truearm.identification.solving.problem.Problem`."""

    @property
    def free(self) -> FreeParameters:
        """What may change."""

    def linearised(self, vector: Array) -> tuple[Array, Array]:
        """Return the whitened residual ``(rows,)`` at a vector and its Jacobian ``(rows, parameters)``."""


def find_redundancies(problem: Linearisable, vector: Array, held: Sequence[str] = ()) -> tuple[Redundancy, ...]:
    """Return the redundant parameters of a problem at `vector`, with their combinations.

    Args:
        held: Parameters that are redundant elsewhere. If as many are redundant here, these stay the ones that are held.
    """
    A = _columns(problem, vector)
    names = problem.free.names
    kept = independent_columns(A, range(len(names)), problem.free)
    dropped = [i for i in _in_order(problem.free) if i not in kept]
    if held:
        rest = [i for i, name in enumerate(names) if name not in held]
        if len(kept) == len(rest) == len(independent_columns(A, rest, problem.free)):
            kept, dropped = rest, [names.index(name) for name in held]
    if not dropped:
        return ()
    # The direction bends: a parameter may take part only away from `vector`, so one prior along it is looked at too.
    here = _combinations(A, dropped, kept)
    along = vector + problem.free.prior * here.sum(axis=0)
    away = _combinations(_columns(problem, along), dropped, kept)
    return tuple(_redundancy(problem.free, i, at, there) for i, at, there in zip(dropped, here, away, strict=True))


def _columns(problem: Linearisable, vector: Array) -> Array:
    """Return the derivative per prior, or its triangle where the problem comes in portions: their angles are alike."""
    if isinstance(problem, Problem) and len(problem.portions) > 1:
        return problem.at(vector).triangle * problem.free.prior
    return problem.linearised(vector)[1] * problem.free.prior


def _in_order(free: FreeParameters) -> list[int]:
    return sorted(range(len(free.parameters)), key=lambda i: _ORDER.index(_place(free.parameters[i].group)))


def _place(group: str) -> str:
    return group if group in _ORDER else ""


def independent_columns(A: Array, among: Iterable[int], free: FreeParameters) -> list[int]:
    """Return columns of a whitened Jacobian, per prior, that span all of those `among`.

    The ones that stand well apart come first.
    """
    norms = np.linalg.norm(A, axis=0)
    left = [i for i in _in_order(free) if i in set(among) and norms[i] > 1e-12 * norms.max()]
    rests = {i: A[:, i].copy() for i in left}
    kept: list[int] = []
    for apart in _INDEPENDENT_SHARES:
        for i in list(left):
            size = float(np.linalg.norm(rests[i]))
            if size <= max(apart * norms[i], _LEAST_INFORMATION):
                continue
            direction = rests[i] / size
            kept.append(i)
            left.remove(i)
            for k in left:  # twice, against rounding
                rests[k] -= direction * (direction @ rests[k])
                rests[k] -= direction * (direction @ rests[k])
    return kept


def _combinations(A: Array, dropped: Sequence[int], kept: Sequence[int]) -> Array:
    """Return the directions, in priors, that move each dropped parameter by one and change no reading."""
    directions = np.zeros((len(dropped), A.shape[1]))
    directions[np.arange(len(dropped)), list(dropped)] = 1.0
    directions[:, list(kept)] = -np.linalg.lstsq(A[:, list(kept)], A[:, list(dropped)], rcond=None)[0].T
    return directions


def _redundancy(free: FreeParameters, dropped: int, here: Array, away: Array) -> Redundancy:
    involved = [dropped]
    involved += [i for i in range(len(here)) if i != dropped and max(abs(here[i]), abs(away[i])) > _LEAST_MEMBER]
    members = {free.names[i]: float(here[i] * free.prior[i] / free.prior[dropped]) for i in involved}
    return Redundancy(free.names[dropped], members, in_words(members, free))


def in_words(members: dict[str, float], free: FreeParameters) -> str:
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


def unobservable_parameters(
    robot: Robot, data: Dataset, free: FreeParameters, seed: int = 0, held: Held = NOTHING_HELD
) -> tuple[str, ...]:
    """Return parameters in directions that the data do not observe although poses elsewhere depend on them.

    The unobserved directions are tried on configurations drawn from the robot's limits. A direction that changes
    nothing there either is a matter of convention (d_2 against d_3) and harmless; one that does is a loss of rank: the
    data are too alike.

    Predictions are compared up to the gauge freedoms: a rigid motion of everything where no reading locates the robot,
    and a change of its size where no length was measured either. See :func:`gauge_freedoms`.

    Args:
        free: The parameters to look at; all others are held.
        held: Places that are known. A fixture among them locates the robot.
    """
    free = free.without([SCALE])  # as much as is known of it beforehand is enough
    if not free.names:
        return ()
    noise = {observation.name: 1.0 for observation in OBSERVATIONS}
    plain = Problem(robot, _unit_noise(data), free, noise, priors=False)
    _, s, Vt = np.linalg.svd(plain.at(free.start).triangle * free.prior, full_matrices=True)
    unobserved = Vt[int((s > _UNOBSERVED * s[0]).sum()) :]
    if len(unobserved) == 0:
        return ()
    gauge = gauge_freedoms(data, held)
    q = robot.loaded(robot.random_configurations(40, np.random.default_rng(seed)))
    effects = np.zeros((0, len(free.names)))
    for target in robot.targets:
        kinematics = robot.forward_kinematics(q, target.name)
        parts = [robot.position_jacobian(kinematics, q, free.names)]
        if target.quaternion is not None:
            parts.append(robot.orientation_jacobian(kinematics, q, free.names))
        moved = [part.reshape(len(free.names), -1).T * free.prior for part in parts]
        if gauge:
            moved = gauge_motion_removed(gauge, robot, kinematics, moved)
        effects = np.concatenate([effects, *moved])
    _, strength, turned = np.linalg.svd(effects @ unobserved.T, full_matrices=False)
    largest = np.linalg.norm(effects, axis=0)
    least = _NEGLIGIBLE * largest.max()
    if gauge:
        own = [p.group not in ("base", "target", "fixture") for p in free.parameters]
        least = _NEGLIGIBLE_UP_TO_GAUGE * max(largest[own], default=0.0)
    lost = turned[: len(strength)][strength > least] @ unobserved
    involved = np.linalg.norm(lost, axis=0) > _LEAST_INVOLVED
    return tuple(name for name, is_in in zip(free.names, involved.tolist(), strict=True) if is_in)


def gauge_freedoms(data: Dataset, held: Held = NOTHING_HELD) -> tuple[str, ...]:
    """Return the motions of everything that no reading observes: of the ``base``, and a change of ``size``."""
    if data.anchored or held.locates(data):
        return ()
    if data.distance is not None or (data.setup is not None and data.setup.distance is not None):
        return ("base",)
    if any(any(place.translation) for place in held.targets.values()):  # it is a length on the flange
        return ("base",)
    for fixture in range(len(data.fixtures)):
        lengths = data.position if data.height is None else np.column_stack([data.position, data.height])
        mine = lengths[data.against == fixture]
        if any(len(np.unique(column[np.isfinite(column)])) > 1 for column in mine.T):
            return ("base",)
    return "base", "size"


def gauge_motion_removed(
    gauge: Sequence[str], robot: Robot, kinematics: ForwardKinematics, moved: Sequence[Array]
) -> list[Array]:
    """Remove from moves of a target what a motion of the whole robot does, and a change of its size.

    Args:
        gauge: From :func:`gauge_freedoms`.
        robot, kinematics: The robot, and its forward kinematics to the target at n configurations.
        moved: How it moves [m], and turns if that is asked too, by each parameter, ``(3 n, parameters)`` each.
    """
    columns = gauge_motions(gauge, robot, kinematics)[: len(moved)]
    together = np.concatenate(columns)
    Q = np.linalg.qr(together)[0]
    every = np.concatenate(moved)
    return [every - Q @ (Q.T @ every)]


def gauge_motions(gauge: Sequence[str], robot: Robot, kinematics: ForwardKinematics) -> tuple[Array, Array]:
    """Return how a motion of the whole robot moves a target [m], and turns it, ``(3 n, motions)`` each.

    Parameters are those of :func:`gauge_motion_removed`.
    """
    base = [f"base_{axis}" for axis in ("x", "y", "z", "rx", "ry", "rz")]
    places = [kinematics.places[name] for name in base]
    moved = kinematics.position_jacobian(places).reshape(6, -1).T
    turned = kinematics.orientation_jacobian(places).reshape(6, -1).T
    if "size" in gauge:
        grown = (kinematics.position - np.array(robot.base.translation)[:, None]).reshape(-1, 1)
        return np.column_stack([moved, grown]), np.column_stack([turned, np.zeros_like(grown)])
    return moved, turned


def _unit_noise(data: Dataset) -> Dataset:
    setup = None if data.setup is None else replace(data.setup, sigma=np.ones(len(data.setup.target)))
    return replace(data, sigma=None, sigma_rot=None, setup=setup)
