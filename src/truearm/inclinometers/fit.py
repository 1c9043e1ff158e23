"""Tilt, backlash and stiffness of the joints from inclinometers, and what to know about them."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, Notice, Rule, counted, listed
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.inclinations import Inclinations, InclinometerReadings, Instruments, Pairs
from truearm.engine.diagnose.advice import NOT_CONVERGED
from truearm.engine.fit.frames import initial_frames
from truearm.engine.fit.solver import solve
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import FreeParameters, Parameter
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot

#: Axes steeper than this are left out: a vertical one does not see small turns [rad].
STEEPEST: Final = math.radians(60.0)
#: Moments about, and across, an axis below these leave open where a joint leans [N m]: friction holds it, or the error
#: of the moment decides.
UNDECIDED: Final = (0.2, 0.05)
DECIDING_MOMENTS: Final = (
    f"moments above {UNDECIDED[0]:g} N m about and {UNDECIDED[1]:g} N m across the axis of every joint"
)
_UPRIGHT: Final = 0.01  # sine of the angle between gravity and an axis


def inclinations_of(
    robot: Robot, q: Array | Postures, seats: Array | None = None, instruments: Instruments | None = None
) -> Array:
    """Return the angles of the instruments' axes above the horizontal, ``(n, instruments, 3)`` [rad].

    Args:
        seats: Small turns about x, y and z from where each instrument is mounted to how it sits, ``(instruments, 3)``
            [rad]; none if None.
        instruments: One on each link, aligned with its frame, if None.
    """
    return np.asarray(np.arcsin(np.clip(_axes(robot, q, seats, instruments) @ upwards(robot), -1.0, 1.0)))


def inclination_derivatives(
    robot: Robot,
    q: Array | Postures,
    names: Sequence[str],
    seats: Array | None = None,
    instruments: Instruments | None = None,
) -> Array:
    """Return the derivative of :func:`inclinations_of` by parameters and then by seats.

    An axis `a` that turns with angular velocity w rises by ``w . (a x up) / cos(inclination)``. That ratio has no
    limit for a vertical axis, where 0 is returned: see how steep an axis is before trusting it.

    Returns:
        derivatives: ``(n, instruments, 3, len(names) + 3 * instruments)``, seats instrument by instrument.
    """
    at = robot.loaded(q)
    mounted = instruments or Instruments.on_every_link(len(robot.joints))
    axes, up = _axes(robot, at, seats, mounted), upwards(robot)
    levers = np.cross(axes, up)
    cosine = np.linalg.norm(levers, axis=-1, keepdims=True)
    levers = np.where(cosine > 1e-9, levers / np.maximum(cosine, 1e-9), 0.0)  # (n, instruments, 3, xyz)
    kinematics = robot.forward_kinematics(at)
    ends, links = link_ends(robot), np.array(mounted.links)
    n, count = len(at), len(mounted)
    derivatives = np.zeros((n, count, 3, len(names) + 3 * count))
    for column, moved in enumerate(_moved_elements(robot, at, names)):
        by_parameter = derivatives[..., column]
        for element, rate in moved.items():
            beyond = np.flatnonzero(links >= bisect_right(ends, element))  # on links that the element turns
            turning = kinematics.axis(element).T * np.broadcast_to(rate, n)[:, None]
            by_parameter[:, beyond] += np.einsum("nlkx,nx->nlk", levers[:, beyond], turning)
    for number, (link, mount) in enumerate(zip(mounted.links, mounted.mounts, strict=True)):
        first = len(names) + 3 * number
        derivatives[:, number, :, first : first + 3] = levers[:, number] @ kinematics.matrix(ends[link]) @ mount
    return derivatives


def readable(robot: Robot, pairs: Pairs, instruments: Instruments | None = None) -> NDArray[np.bool_]:
    """Return which changes of inclination can be used, ``(n, instruments, 3)``.

    The axis stands within 60 deg of the horizontal in both postures, and the loads decide to which side every joint up
    to the link leans. A joint whose axis stands upright does not matter.
    """
    mounted = instruments or Instruments.on_every_link(len(robot.joints))
    usable = np.ones((len(pairs), len(mounted), 3), dtype=bool)
    for posture in (pairs.first, pairs.second):
        at = robot.loaded(posture)
        usable &= np.abs(inclinations_of(robot, at, instruments=mounted)) <= STEEPEST
        clear = np.logical_and.accumulate(decided(robot, at, upright=True), axis=1)
        usable &= clear[:, np.array(mounted.links)][..., None]
    return usable


def decided(robot: Robot, posture: Postures, *, upright: bool) -> NDArray[np.bool_]:
    """Return whether the loads decide to which side each joint leans, ``(n, joints)``.

    Args:
        upright: Whether a joint may turn to either side about an axis along gravity, which inclinometers do not see.
    """
    at = robot.loaded(posture)
    kinematics, up = robot.forward_kinematics(at), upwards(robot)
    clear = np.ones((len(at), len(robot.joints)), dtype=bool)
    for joint in robot.layout.turning:
        x, y, z = at.joint_loads[joint, 3:]
        stands = np.linalg.norm(np.cross(kinematics.axis(robot.moving[joint]).T, up), axis=1) < _UPRIGHT
        clear[:, joint] = (np.abs(z) > UNDECIDED[0]) | (upright & stands)
        clear[:, joint] &= np.hypot(x, y) > UNDECIDED[1]
    return clear


def change_derivatives(
    robot: Robot, pairs: Pairs, names: Sequence[str], seats: Array | None = None, instruments: Instruments | None = None
) -> Array:
    """Return the derivative of changes of inclination by parameters and seats.

    Returns:
        derivatives: ``(n, instruments, 3, len(names) + 3 * instruments)``.
    """
    first, second = (inclination_derivatives(robot, p, names, seats, instruments) for p in (pairs.first, pairs.second))
    return np.asarray(second - first)


def link_ends(robot: Robot) -> list[int]:
    """Return the index of the element of the trunk right behind each link's frame."""
    ends = accumulate((len(link) for link in robot.moved_links), initial=len(robot.base_elements))
    return list(ends)[1:]


def _moved_elements(robot: Robot, at: Postures, names: Sequence[str]) -> list[dict[int, Array | float]]:
    """Return for each parameter the turns of the trunk it moves, and how fast."""
    elements = robot.trunk.elements
    places = {e.parameter: i for i, e in enumerate(elements) if e.parameter is not None}
    rates = {n: r for effect in robot.effects for n, r in effect.derivative(at, robot.values).items()}
    moved: list[dict[int, Array | float]] = []
    for name in names:
        by_variable: dict[int, Array | float] = {robot.moving[v]: rate for v, rate in rates.get(name, {}).items()}
        by_place: dict[int, Array | float] = {places[name]: 1.0} if name in places else {}
        moved.append({i: rate for i, rate in (by_place | by_variable).items() if elements[i].turns})
    return moved


def _axes(
    robot: Robot, q: Array | Postures, seats: Array | None, instruments: Instruments | None
) -> NDArray[np.float64]:
    """Return the instruments' axes in the world, as rows ``(n, instruments, 3, xyz)``."""
    mounted = instruments or Instruments.on_every_link(len(robot.joints))
    kinematics, ends = robot.forward_kinematics(q), link_ends(robot)
    R = np.stack([kinematics.matrix(ends[link]) for link in mounted.links], axis=1) @ mounted.mounts
    if seats is not None:
        R = R @ _turns(seats)
    return np.asarray(np.swapaxes(R, -1, -2))


def _turns(seats: Array) -> Array:
    """Return the rotations of small rotation vectors ``(links, 3)``."""
    x, y, z = seats.T
    zero = np.zeros(len(seats))
    S = np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), -1, 0)
    return np.asarray(np.eye(3) + S + 0.5 * S @ S)  # a seat of 0.01 rad leaves 2e-7


def upwards(robot: Robot) -> Array:
    """Return the unit vector against gravity in the world."""
    down = robot.base.rotation @ np.array(robot.gravity)
    return np.asarray(-down / np.linalg.norm(down))


# Clearance tilt, backlash and compliance of every joint from what changes when loads change.
#
# The first of the two stages of Patel, section 4.4.1: joint effects from inclinometers, geometry from poses after that.
# Readings are compared in pairs of postures, and only their differences are used. Between two loads on an arm that
# keeps its joint positions nothing but the joint effects differ: where an instrument sits, its zero, joint zeros and
# twists all cancel to first order. Where the arm moves between two postures, as it must if gravity is the only load,
# they do not cancel (a twist of 0.1 deg comes back as 0.017 deg after a turn by 10 deg, many times the resolution), so
# joint zeros, twists and the seats of the instruments are unknowns beside the effects, known beforehand as well as
# their priors say, and are forgotten afterwards.
#
# Inclinometers do not see a turn about a vertical axis. Poses of a target do: pairs of them, under two loads at the
# same joint positions, are compared in the same way (the document's joint 1).

#: What the first stage identifies.
TILTING: Final = ("compliance", "backlash", "clearance")
#: What the model leaves out of a change of inclination where all is well: what tilts do to the loads, one standard
#: deviation [rad].
_MODEL: Final = math.radians(1.5e-4)
#: How well an instrument is aligned with its link, one standard deviation [rad].
SEAT: Final = math.radians(0.5)


@dataclass(frozen=True, eq=False)
class TiltingFit:
    """What pairs of postures tell about the joints."""

    #: The robot with the effects `compliance`, `backlash` and `clearance` at the values found, with deviations and
    #: informed shares. Everything else is as it was given.
    robot: Robot
    names: tuple[str, ...]  #: Of the effects' parameters, in the order of `covariance`.
    #: Of the effects' parameters [SI], ``(parameters, parameters)``; what is not known about geometry and seats is in
    #: it.
    covariance: Array
    #: How much larger the changes that are left are than their declared deviations, 1 at least. The covariance contains
    #: it.
    excess: float
    converged: bool  #: Whether the last step was too small to matter.
    #: What is left of each change of inclination [rad], ``(n, instruments, 3)``; NaN where one was not used.
    left: Array
    seats: Array  #: Small turns from where each instrument is mounted to how it sits [rad], ``(instruments, 3)``.

    @property
    def with_priors(self) -> Robot:
        """The robot with these values, their deviations as priors, for a fit that frees them again."""
        parameters = [self.robot.parameters[name] for name in self.names]
        return self.robot.with_parameters(
            replace(p.restarted(p.value), prior=p.deviation or p.prior) for p in parameters
        )


def calibrate_tilting(robot: Robot, readings: InclinometerReadings, poses: Dataset | None = None) -> TiltingFit:
    """Find compliance, backlash and clearance of every joint.

    Args:
        robot: Nominal, or as far as it is known. The effects are looked for anew, within their priors; joint zeros and
            twists are uncertain by their priors.
        readings: Changes of inclination.
        poses: Positions of targets in pairs: configurations 0 and 1, 2 and 3 and so on have the same joint positions
            under two loads. Base and targets are found from them.

    Raises:
        InputError: For changes or poses none of which can be used, and for poses that are not in pairs or declare no
            deviation.
    """
    start = robot.with_effects(TILTING)
    start = start.with_parameters(p.restarted() for p in start.parameters.values() if p.group in TILTING)
    if poses is not None:
        _check_pairs(poses)
        if not poses.has_position.any():
            raise InputError("there is no position reading", where=poses.source, cure="Fill in x, y and z.")
        start = initial_frames(start, poses)
    problem = _Problem(start, readings, poses)
    solution = solve(problem)
    effects, prior = tilting_parameters(start)[0], problem.free.prior
    count = len(effects)
    _, s, Vt = np.linalg.svd(np.concatenate([solution.jacobian * prior, np.eye(len(prior))]), full_matrices=False)
    share = (Vt.T / s**2) @ Vt  # of the priors' variances that is left
    freedom = np.count_nonzero(solution.residual) - (len(prior) - np.trace(share))
    excess = max(1.0, math.sqrt(float(solution.residual @ solution.residual) / max(freedom, 1.0)))
    spread = np.minimum(excess, 1.0 / np.sqrt(np.diag(share)))  # no value is worse known than before
    covariance = (share * np.outer(prior * spread, prior * spread))[:count, :count]
    deviation = np.sqrt(np.diag(covariance))
    parameters = [
        replace(p, value=float(v), deviation=float(d), informed=float(np.clip(1.0 - (d / p.prior) ** 2, 0.0, 1.0)))
        for p, v, d in zip(effects, solution.vector, deviation, strict=False)
    ]
    return TiltingFit(
        robot=robot.with_effects(TILTING).with_parameters(parameters),
        names=tuple(p.name for p in effects),
        covariance=covariance,
        excess=excess,
        converged=solution.converged,
        left=np.where(problem.used, problem.at(solution.vector).left, np.nan),
        seats=solution.vector[-3 * len(readings.mounted) :].reshape(-1, 3),
    )


@dataclass(frozen=True, eq=False)
class _Problem:
    """What is left of all changes, per deviation, as the solver asks for it; three rows for each link and each point.

    `used` marks the changes of inclination that can be used; the others are rows of zeros.
    """

    robot: Robot
    readings: InclinometerReadings
    poses: Dataset | None
    priors: bool = True

    @cached_property
    def free(self) -> FreeParameters:
        """Effects, then joint zeros and twists, then three turns for the seat of each instrument."""
        effects, angles = tilting_parameters(self.robot)
        seats = [
            Parameter.plain(f"seat_{number}_{axis}", "rad", "target", 0.0, SEAT)
            for number in range(1, len(self.readings.mounted) + 1)
            for axis in "xyz"
        ]
        return FreeParameters((*effects, *angles, *seats))

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        used = np.isfinite(self.readings.change) & readable(self.robot, self.readings.pairs, self.readings.mounted)
        if not used.any():
            raise InputError(
                "no change of inclination can be used",
                where="inclinometer readings",
                came=f"{np.isfinite(self.readings.change).sum()} changes",
                allowed=f"axes within {math.degrees(STEEPEST):g} deg of the horizontal, and {DECIDING_MOMENTS}",
            )
        return used

    @cached_property
    def deviations(self) -> Array:
        """Standard deviation of each change, with what the model leaves out [rad]."""
        return np.hypot(self.readings.deviations, _MODEL)

    @cached_property
    def pairs(self) -> dict[str, IntArray]:
        """For each target of the poses, the readings that are compared, ``(pairs, 2)``."""
        if self.poses is None:
            return {}
        poses, pairs = self.poses, {}
        clear = np.asarray(decided(self.robot, poses.postures, upright=False).all(axis=1))
        for index, name in enumerate(poses.targets):
            reading = np.full(poses.configurations, -1)
            rows = np.flatnonzero((poses.target == index) & poses.has_position & clear[poses.configuration])
            reading[poses.configuration[rows]] = rows
            pair = reading.reshape(-1, 2)
            pairs[name] = pair[(pair >= 0).all(axis=1)]
        if not any(len(pair) for pair in pairs.values()):
            raise InputError("no pair of poses can be used", where=poses.source, allowed=DECIDING_MOMENTS)
        return pairs

    @property
    def components(self) -> NDArray[np.intp]:
        points = sum(len(pair) for pair in self.pairs.values())
        return np.full(self.used.size // 3 + points, 3)

    def at(self, vector: Array) -> _Evaluation:
        return _Evaluation(self, vector)

    def prior_rows(self, vector: Array) -> tuple[Array, Array]:
        weight = 1.0 / self.free.prior
        return (vector - self.free.start) * weight, weight


@dataclass(frozen=True, eq=False)
class _Evaluation:
    problem: _Problem
    vector: Array

    @cached_property
    def residual(self) -> Array:
        p = self.problem
        change = np.where(p.used, self.left, 0.0) / p.deviations
        return np.concatenate([change.reshape(-1), *(r for r, _ in self._displacements)])

    @cached_property
    def left(self) -> Array:
        """What is left of the changes of inclination [rad], ``(n, instruments, 3)``."""
        mounted = self.problem.readings.mounted
        first, second = (
            inclinations_of(self._robot, q, self._seats, mounted) for q in (self._pairs.first, self._pairs.second)
        )
        return np.asarray(second - first - self.problem.readings.change)

    @cached_property
    def jacobian(self) -> Array:
        p = self.problem
        change = change_derivatives(self._robot, self._pairs, self._names, self._seats, p.readings.mounted)
        change = change / p.deviations[..., None]
        change[~p.used] = 0.0
        points = [np.pad(J, ((0, 0), (0, self._seats.size))) for _, J in self._displacements]
        return np.concatenate([change.reshape(-1, len(self.vector)), *points])

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return self.problem.free.names[: -3 * len(self.problem.readings.mounted)]

    @cached_property
    def _robot(self) -> Robot:
        return self.problem.robot.with_values(dict(zip(self._names, map(float, self.vector), strict=False)))

    @cached_property
    def _pairs(self) -> Pairs:
        """The postures with their loads."""
        pairs = self.problem.readings.pairs
        return Pairs(self._robot.loaded(pairs.first), self._robot.loaded(pairs.second))

    @cached_property
    def _seats(self) -> Array:
        return self.vector[len(self._names) :].reshape(-1, 3)

    @cached_property
    def _displacements(self) -> list[tuple[Array, Array]]:
        """What is left of the displacements of each target, per deviation, and its derivative by parameters."""
        poses = self.problem.poses
        if poses is None or poses.sigma is None:
            return []
        at = self._robot.loaded(poses.postures)
        displacements = []
        for name, pair in self.problem.pairs.items():
            before, after = poses.configuration[pair].T
            kinematics = self._robot.forward_kinematics(at, name)
            sigma = np.hypot(*poses.sigma[pair].T)[:, None]
            p, J = (
                kinematics.position.T,
                np.moveaxis(self._robot.position_jacobian(kinematics, at, self._names), (0, 2), (2, 0)),
            )
            r = (p[after] - p[before]) - (poses.position[pair[:, 1]] - poses.position[pair[:, 0]])
            rows = (J[after] - J[before]) / sigma[..., None]
            displacements.append(((r / sigma).reshape(-1), rows.reshape(-1, len(self._names))))
        return displacements


def tilting_parameters(robot: Robot) -> tuple[list[Parameter], list[Parameter]]:
    """Return what inclinometers are asked for, and the angles of the geometry that they are not asked for."""
    every = robot.parameters.values()
    effects = [p for p in every if p.group in TILTING]
    return effects, [p for p in every if p.group in ("joint zero", "geometry") and p.unit == "rad"]


def _check_pairs(poses: Dataset) -> None:
    joints = poses.joints
    if len(joints) % 2 or not np.array_equal(joints[::2], joints[1::2]):
        raise InputError(
            "these poses are not in pairs",
            where=poses.source,
            allowed="two configurations after each other with the same joint positions, under two loads",
        )
    if poses.sigma is None:
        raise InputError("the poses declare no standard deviation", where=poses.source, cure="Fill in sigma.")


#: Share of the prior variance that readings remove of a constant that they see: a quarter of the deviation is left.
SEEN: Final = 1.0 - 0.25**2
#: Larger than declared by so much, changes hold something that the model does not know; or nothing that it knows.
_SCATTER: Final = 2.0
_WRONG: Final = 10.0
#: So many deviations below zero a spring, a play or a gap cannot be.
_BELOW: Final = 3.0
#: Sine of the angle between gravity and an axis that stands upright whatever the posture.
_UPRIGHT_JUDGING: Final = 0.05


def seen(parameter: Parameter) -> bool:
    """Return whether readings told a constant, and not its prior alone."""
    return (parameter.informed or 0.0) >= SEEN


def check_tilting(start: Robot, fit: TiltingFit, read: Inclinations, *, pushed: bool) -> tuple[Notice, ...]:
    """Return what to know about the first stage.

    Args:
        start: The robot before.
        pushed: Whether poses under loads were given beside the inclinations.
    """
    return (
        *_not_converged(fit),
        *_below_zero(fit),
        *_scatter(fit, read),
        *_unseen(start, fit, pushed=pushed),
        *_unpaired(read),
    )


def _not_converged(fit: TiltingFit) -> list[Notice]:
    if fit.converged:
        return []
    message = "The solver's steps did not become small. Check forces, payloads, masses and joint positions."
    return [NOT_CONVERGED(message)]


TILTING_BELOW_ZERO: Final = Rule(
    "tilting-below-zero",
    "error",
    "a tilt, a play or a compliance is negative by more than 3 deviations: signs of forces or joints, masses, or "
    "pairs are wrong",
    cure="Check the signs of forces and joints, the masses in the robot file, and which configurations were compared.",
)


def _below_zero(fit: TiltingFit) -> list[Notice]:
    parameters = [fit.robot.parameters[name] for name in fit.names]
    below = [p.name for p in parameters if p.value < -_BELOW * (p.deviation or math.inf)]
    if not below:
        return []
    return [TILTING_BELOW_ZERO(f"{listed(below)}: found to be negative, which no spring, play or gap is.")]


INCLINATIONS_SCATTER: Final = Rule(
    "inclinations-scatter",
    ("warning", "error"),
    "what is left of the changes is more than 2 (10: error) times as large as declared: an instrument moved, a force "
    "or payload is not as stated, or bearings and links give way",
)


def _scatter(fit: TiltingFit, read: Inclinations) -> list[Notice]:
    if fit.excess <= _SCATTER:
        return []
    used = np.isfinite(fit.left)
    squares = np.where(used, fit.left, 0.0) ** 2
    left = np.sqrt(squares.sum(axis=(0, 2)) / np.maximum(used.sum(axis=(0, 2)), 1))
    worst = int(np.argmax(left))
    return [
        INCLINATIONS_SCATTER(
            f"What is left of the changes of inclination is {fit.excess:.1f} times as large as their declared "
            f"deviations, most on {read.instruments.names[worst]} ({math.degrees(float(left[worst])):.2g} deg): an "
            "instrument moved, a force or payload is not as stated, or bearings and links give way too. Deviations are "
            "widened by that.",
            "error" if fit.excess > _WRONG else "warning",
        )
    ]


UPRIGHT_UNSEEN: Final = Rule(
    "upright-unseen",
    "warning",
    "backlash and compliance of a joint whose axis stands upright were not seen: push the flange sideways",
)
TILTING_UNSEEN: Final = Rule(
    "tilting-unseen",
    "warning",
    "no load that was read tells these constants well: three quarters of their deviation or less were removed",
    cure="Read inclinometers behind these joints where the moment about or across their axes turns round; 'truearm "
    "plan' with the device inclinometers chooses such postures.",
)


def _unseen(start: Robot, fit: TiltingFit, *, pushed: bool) -> list[Notice]:
    unseen = [name for name in fit.names if not seen(fit.robot.parameters[name])]
    upright = set(_upright(start))
    by_poses = [name for name in unseen if _number(name) in upright and not name.startswith("clearance")]
    others = [name for name in unseen if name not in by_poses]
    notices = []
    if by_poses:
        cure = (
            "The poses under loads do not tell them either: push the flange sideways, one way and the other."
            if pushed
            else "They come from poses: at the same joint positions push the flange sideways, one way and the other, "
            "and give the poses of both as `pushed`."
        )
        notices.append(
            UPRIGHT_UNSEEN(
                f"{_stay(by_poses)}: gravity does not turn a joint whose axis stands "
                f"upright, and inclinometers do not see its turn. {cure}"
            )
        )
    if others:
        notices.append(TILTING_UNSEEN(f"{_stay(others)}: no change of load that was read tells them well."))
    return notices


def _stay(names: Sequence[str]) -> str:
    return f"{listed(names)} {'stays about as it was' if len(names) == 1 else 'stay about as they were'} believed"


def _number(name: str) -> int:
    return int(name.rpartition("_")[2])


def _upright(robot: Robot) -> Iterable[int]:
    """Return the numbers of the joints whose axis stands upright wherever the arm moves."""
    at = robot.random_configurations(50, np.random.default_rng(0))
    kinematics, up = robot.forward_kinematics(at), upwards(robot)
    for joint in robot.layout.turning:
        across = np.linalg.norm(np.cross(kinematics.axis(robot.moving[joint]).T, up), axis=1)
        if across.max() < _UPRIGHT_JUDGING:
            yield joint + 1


UNPAIRED: Final = Rule("unpaired", "note", "configurations without a partner were left out")


def _unpaired(read: Inclinations) -> list[Notice]:
    if not read.unpaired:
        return []
    return [
        UNPAIRED(
            f"{counted(len(read.unpaired), 'configuration')} ({listed(read.unpaired)}) had no partner and "
            f"{'was' if len(read.unpaired) == 1 else 'were'} left out: those of the orders 1 and 2, 3 and 4 and so on "
            "are compared."
        )
    ]
