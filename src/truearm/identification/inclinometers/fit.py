"""Clearance tilt, backlash and compliance of every joint from what changes when loads change.

The first of the two stages of Patel, section 4.4.1: joint effects from inclinometers, geometry from poses after that.
Readings are compared in pairs of postures, and only their differences are used. Between two loads on an arm that keeps
its joint positions nothing but the joint effects differ: where an instrument sits, its zero, joint zeros and twists all
cancel to first order. Where the arm moves between two postures, as it must if gravity is the only load, they do not
cancel (a twist of 0.1 deg comes back as 0.017 deg after a turn by 10 deg, many times the resolution), so joint zeros,
twists and the seats of the instruments are unknowns beside the effects, known beforehand as well as their priors say,
and are forgotten afterwards.

Inclinometers do not see a turn about a vertical axis. Poses of a target do: pairs of them, under two loads at the same
joint positions, are compared in the same way (the document's joint 1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.identification.inclinometers.inclination import (
    DECIDING_MOMENTS,
    STEEPEST,
    change_derivatives,
    decided,
    inclinations_of,
    readable,
)
from truearm.identification.solving.solver import solve
from truearm.identification.start_values.frames import initial_frames
from truearm.measurement.dataset import Dataset, IntArray
from truearm.measurement.inclinometer import InclinometerReadings, Pairs
from truearm.modeling.chain import Array
from truearm.modeling.parameters import FreeParameters, Parameter
from truearm.modeling.robot import Robot

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
        found = [self.robot.parameters[name] for name in self.names]
        return self.robot.with_parameters(replace(p.restarted(p.value), prior=p.deviation or p.prior) for p in found)


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
    found = [
        replace(p, value=float(v), deviation=float(d), informed=float(np.clip(1.0 - (d / p.prior) ** 2, 0.0, 1.0)))
        for p, v, d in zip(effects, solution.vector, deviation, strict=False)
    ]
    return TiltingFit(
        robot=robot.with_effects(TILTING).with_parameters(found),
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
        poses, found = self.poses, {}
        clear = np.asarray(decided(self.robot, poses.postures, upright=False).all(axis=1))
        for index, name in enumerate(poses.targets):
            reading = np.full(poses.configurations, -1)
            mine = np.flatnonzero((poses.target == index) & poses.has_position & clear[poses.configuration])
            reading[poses.configuration[mine]] = mine
            pair = reading.reshape(-1, 2)
            found[name] = pair[(pair >= 0).all(axis=1)]
        if not any(len(pair) for pair in found.values()):
            raise InputError("no pair of poses can be used", where=poses.source, allowed=DECIDING_MOMENTS)
        return found

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
        found = []
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
            found.append(((r / sigma).reshape(-1), rows.reshape(-1, len(self._names))))
        return found


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
