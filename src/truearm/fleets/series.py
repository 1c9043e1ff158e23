"""A whole series simulated: robots drawn from their priors, measured, calibrated, and judged by their truth.

Every robot has random numbers of its own, spawned from the seed by its number, and is calibrated as if it were alone:
so what is found of it depends neither on the robots beside it nor on who computes it. A worker imports no more than
this file needs, because that takes as long as some hundred robots.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic_core import to_json

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import Spread
from truearm.engine.fit.models import FRAMES, Model, named_model
from truearm.engine.fit.problem import Problem
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import PLACES
from truearm.engine.robot.robot import Robot

Status = Literal["calibrated", "failed"]

#: Columns of the parameters that may be the same for all robots of a part, and stand in its first line once.
_SHARED: Final = ("name", "unit", "nominal", "prior")


@dataclass(frozen=True)
class Accuracy:
    """Position errors of a robot at configurations that its calibration has not seen [m]."""

    mean: float  #: mean, rms, max: of their lengths.
    rms: float
    max: float
    n: int  #: How many.

    @classmethod
    def of_each(cls, errors: Array) -> list[Accuracy]:
        """Summarise error norms of several robots, ``(robots, k)``, k at least 1."""
        means, squares, largest = errors.mean(axis=1), np.mean(errors**2, axis=1), errors.max(axis=1)
        figures = zip(means.tolist(), np.sqrt(squares).tolist(), largest.tolist(), strict=True)
        return [cls(*three, errors.shape[1]) for three in figures]

    @classmethod
    def of_spread(cls, spread: Spread, n: int) -> Accuracy:
        """Take over what a calibration says of its errors."""
        return cls(spread.mean, spread.rms, spread.max, n)

    def content(self) -> dict[str, float | int]:
        """Return it as JSON holds it, in mm."""
        return {"mean_mm": self.mean * 1e3, "rms_mm": self.rms * 1e3, "max_mm": self.max * 1e3, "n": self.n}

    @classmethod
    def read(cls, content: Mapping[str, Any]) -> Accuracy:
        """Read what :meth:`content` returned."""
        return cls(content["mean_mm"] / 1e3, content["rms_mm"] / 1e3, content["max_mm"] / 1e3, content["n"])


@dataclass(frozen=True)
class FoundParameter:
    """A parameter of one robot of a fleet, in SI units."""

    unit: str  #: Of all its values.
    value: float  #: value, deviation: as it was identified, and the standard deviation of that.
    deviation: float
    nominal: float  #: nominal, prior: value before, and the standard deviation of that.
    prior: float
    truth: float | None = None  #: True value of a simulated robot; None of others.


@dataclass(frozen=True)
class FoundParameters(Mapping[str, FoundParameter]):
    """The parameters of one robot by their names, kept as columns: of ten thousand robots no object each is made."""

    name: tuple[str, ...] = ()  #: name, unit: of each.
    unit: tuple[str, ...] = ()
    #: nominal, prior, value, deviation: of each, in SI units, see :class:`FoundParameter`.
    nominal: tuple[float, ...] = ()
    prior: tuple[float, ...] = ()
    value: tuple[float, ...] = ()
    deviation: tuple[float, ...] = ()
    truth: tuple[float, ...] | None = None  #: True values of a simulated robot; None of others.

    @classmethod
    def of(cls, parameters: Mapping[str, FoundParameter]) -> FoundParameters:
        """Return parameters, of which all or none have a truth, as columns."""
        those = [*parameters.values()]
        truths = tuple(p.truth for p in those if p.truth is not None)
        return cls(
            tuple(parameters),
            tuple(p.unit for p in those),
            tuple(p.nominal for p in those),
            tuple(p.prior for p in those),
            tuple(p.value for p in those),
            tuple(p.deviation for p in those),
            truths if truths else None,
        )

    def __getitem__(self, name: str) -> FoundParameter:
        """Return one of them."""
        try:
            i = self.name.index(name)
        except ValueError:
            raise KeyError(name) from None
        truth = None if self.truth is None else self.truth[i]
        return FoundParameter(self.unit[i], self.value[i], self.deviation[i], self.nominal[i], self.prior[i], truth)

    def __iter__(self) -> Iterator[str]:
        """Return their names."""
        return iter(self.name)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.name)

    @property
    def shared(self) -> dict[str, tuple[Any, ...]]:
        """Columns that other robots may have too, as JSON holds them."""
        return {column: getattr(self, column) for column in _SHARED}

    def content(self, shared: Mapping[str, Any]) -> dict[str, tuple[Any, ...]]:
        """Return them as JSON holds them, column by column, without those of `shared`."""
        columns = {} if shared == self.shared else self.shared
        columns |= {"value": self.value, "deviation": self.deviation}
        return columns if self.truth is None else {**columns, "truth": self.truth}

    @classmethod
    def read(cls, content: Mapping[str, Any], shared: Mapping[str, Any]) -> FoundParameters:
        """Read what :meth:`content` returned.

        Raises:
            ValueError: If columns are missing or not equally long, or a name is there twice.
        """
        if not content:  # of a robot that could not be calibrated
            return cls()
        columns = {kind: tuple(column) for kind, column in {**shared, **content}.items()}
        if len({*map(len, columns.values())}) > 1:
            raise ValueError("columns of different lengths")
        parameters = cls(**columns)
        if (
            not len(parameters.name)
            == len({*parameters.name})
            == len(parameters.unit)
            == len(parameters.prior)
            == len(parameters.value)
        ):
            raise ValueError("columns are missing, or names are there twice")
        return parameters


@dataclass(frozen=True)
class Row:
    """One robot of a fleet."""

    name: str  #: Of the robot in the fleet.
    status: Status  #: Whether it was calibrated.
    message: str = ""  #: Why not; empty if it was.
    #: Serial number or name of the machine: rows of one machine are measurements of it at several times.
    of: str | None = None
    date: str | None = None  #: When it was measured (ISO 8601).
    #: held_out, nominal: errors of the calibrated and of the nominal robot at configurations not seen, as an instrument
    #: reads them.
    held_out: Accuracy | None = None
    nominal: Accuracy | None = None
    #: Errors of the calibrated robot there without the instrument's noise; None of measured robots.
    truth: Accuracy | None = None
    parameters: FoundParameters = field(default_factory=FoundParameters)  #: Those identified, by name.
    fit_status: str | None = None  #: How the fit ended.
    notices: tuple[str, ...] = ()  #: Codes of what there is to know about it.
    seconds: float = 0.0  #: How long it took; no result depends on it.
    robot: str = ""  #: Name of the robot: robots of one name are compared with one another.
    errors: tuple[str, ...] = ()  #: Those of `notices` that are of the level error.
    drawn: bool = True  #: Whether priors drew the parameters towards nominal.
    #: Of the parameters, in priors: the rows of the lower triangle one after the other; empty where it is not kept.
    covariance: tuple[float, ...] = ()
    simulated: bool = False  #: Whether its measurements are marked as those of a virtual instrument.
    temperature: float | None = None  #: Mean of the arm while it was measured [degC]; None if it was not recorded.

    @property
    def machine(self) -> str:
        """The machine that was measured: rows of one machine are measurements of it at several times."""
        return self.of or self.name

    def content(self, shared: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Return it as JSON holds it, without what `shared` says of its parameters already."""
        return {
            "name": self.name,
            "status": self.status,
            "message": self.message,
            "of": self.of,
            "date": self.date,
            "held_out": None if self.held_out is None else self.held_out.content(),
            "nominal": None if self.nominal is None else self.nominal.content(),
            "truth": None if self.truth is None else self.truth.content(),
            "parameters": self.parameters.content(shared or {}),
            "fit_status": self.fit_status,
            "notices": [*self.notices],
            "seconds": self.seconds,
            "robot": self.robot,
            "errors": [*self.errors],
            **({} if self.drawn else {"drawn": False}),
            **({"covariance": [*self.covariance]} if self.covariance else {}),
            **({"simulated": True} if self.simulated else {}),
            **({} if self.temperature is None else {"temperature": self.temperature}),
        }

    @classmethod
    def read(cls, content: Mapping[str, Any], shared: Mapping[str, Any] | None = None) -> Row:
        """Read what :meth:`content` returned."""

        def accuracy(name: str) -> Accuracy | None:
            return None if content[name] is None else Accuracy.read(content[name])

        return cls(
            name=content["name"],
            status=content["status"],
            message=content["message"],
            of=content["of"],
            date=content["date"],
            held_out=accuracy("held_out"),
            nominal=accuracy("nominal"),
            truth=accuracy("truth"),
            parameters=FoundParameters.read(content["parameters"], shared or {}),
            fit_status=content["fit_status"],
            notices=tuple(content["notices"]),
            seconds=content["seconds"],
            robot=content["robot"],
            errors=tuple(content["errors"]),
            drawn=content.get("drawn", True),
            covariance=tuple(content.get("covariance", ())),
            simulated=content.get("simulated", False),
            temperature=content.get("temperature"),
        )


def part_text(
    rows: Sequence[Row], shared: Mapping[str, Any], written: Sequence[str] = (), changed: Sequence[str] = ()
) -> str:
    """Return robots as a part holds them, behind its first line and before its hash.

    Args:
        shared: Columns that the parameters of all robots have, see :attr:`FoundParameters.shared`.
        written: Files that were written of them, from the folder of the fleet.
        changed: Robots whose files changed while they were computed: they are computed again by the next run.
    """
    first = to_json({"shared": shared, "written": [*written], "changed": [*changed]})
    lines = [first, *(to_json(row.content(shared)) for row in rows)]
    return b"\n".join([*lines, b""]).decode()


# How good would a calibration be: many simulated ones at once, as one array computation.
#
# Each trial draws true parameter values from the priors, measures them with noise of its own, and is calibrated by
# Gauss-Newton from the nominal values. The trials are a leading axis of the parameter values, which the chain and the
# problem carry through, so a step is a few array operations on a block of trials that fits the processor's cache.
# The normal equations are good enough here, scaled by the priors and with noise in the data: what rounding leaves of
# one step, the next one removes, because the gradient is formed anew from the residuals.
_BLOCK: Final = 9_000  # readings swept together, so that their Jacobian stays in the cache
_STEPS: Final = 12
_SMALL: Final = 1e-9  # priors


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """Simulated calibrations of one robot at one set of configurations."""

    problem: Problem  #: The calibration of the nominal robot from readings of itself.
    #: How far the readings of each trial lie from those, in their standard deviations, ``(trials, rows)``.
    readings: Array
    #: truth, estimate, deviation: true values of the problem's free parameters, identified values, and the standard
    #: deviations that the calibration states for these [SI], each ``(trials, parameters)``. Base and targets are true
    #: at the robot's own values.
    truth: Array
    estimate: Array
    deviation: Array
    converged: NDArray[np.bool_]  #: Whether the steps of a trial settled, ``(trials,)``.
    #: Distance from the true to the predicted position at configurations that no calibration saw [m], ``(trials,
    #: targets, configurations)``.
    position_error: Array

    @property
    def informed(self) -> Array:
        """Share of the prior variance that the data removed, ``(trials, parameters)``."""
        return 1.0 - (self.deviation / self.problem.free.prior) ** 2

    def dataset(self, trial: int) -> Dataset:
        """Return the readings of a trial as a calibration of its own would get them."""
        nominal = self.problem.data
        if nominal.sigma is None:
            raise ValueError("the readings have no standard deviation")
        moved = self.readings[trial].reshape(-1, 3) * nominal.sigma[:, None]
        return replace(nominal, source=f"trial {trial + 1}", position=nominal.position + moved)


def monte_carlo(
    robot: Robot, q: Array, model: Model, sigma: float, trials: int, rng: np.random.Generator, held_out: Array
) -> MonteCarlo:
    """Simulate calibrations from position readings of all targets of a robot.

    Args:
        robot: The nominal robot, with its targets; its priors say what true robots are like.
        q: Joint positions of the calibration, ``(configurations, joints)``.
        model: Which parameters are free. Those of joints and links are drawn, base and targets are only identified.
        sigma: Standard deviation of each measured coordinate [m].
        trials: Number of calibrations.
        held_out: Joint positions at which the calibrated robots are judged, ``(configurations, joints)``.
    """
    problem = of_itself(model.prepared(robot), q, model, sigma)
    free = problem.free
    drawn = np.array([p.group not in ("base", "target") for p in free.parameters])
    truth = free.nominal + free.prior * drawn * rng.standard_normal((trials, len(free.names)))
    readings = rng.standard_normal((trials, problem.rows))
    estimate, deviation = np.empty_like(truth), np.empty_like(truth)
    converged = np.empty(trials, dtype=bool)
    size = max(1, _BLOCK // len(problem.components))
    for block in (slice(first, first + size) for first in range(0, trials, size)):
        readings[block] += problem.at(truth[block]).residual
        estimate[block], deviation[block], converged[block] = calibrated(problem, readings[block])
    errors = [_position_errors(problem, truth, estimate, held_out, target.name) for target in robot.targets]
    return MonteCarlo(problem, readings, truth, estimate, deviation, converged, np.stack(errors, axis=1))


def of_itself(robot: Robot, q: Array, model: Model, sigma: float) -> Problem:
    """Return the calibration of a robot from what an instrument without noise reads of it."""
    positions = [robot.world_poses(q, target.name)[0] for target in robot.targets]
    data = Dataset(
        source="simulation",
        labels=tuple(str(i + 1) for i in range(len(q))),
        joints=np.asarray(q, float),
        joint_kinds=tuple(joint.kind for joint in robot.joints),
        targets=tuple(target.name for target in robot.targets),
        configuration=np.tile(np.arange(len(q)), len(positions)),
        target=np.repeat(np.arange(len(positions)), len(q)),
        position=np.concatenate(positions),
        sigma=np.full(len(q) * len(positions), sigma),
    )
    return Problem(robot, data, model.free(robot), {})


def calibrated(problem: Problem, readings: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Calibrate many robots at once, each as if it were alone: whatever stands beside it, to the last digit.

    Args:
        readings: As in :class:`MonteCarlo`.

    Returns:
        Estimates and deviations [SI], ``(trials, parameters)``, and whether they settled, ``(trials,)``.
    """
    nominal, prior = problem.free.nominal, problem.free.prior
    x = np.tile(nominal, (len(readings), 1))
    information = np.empty((*x.shape, x.shape[1]))
    before = np.empty(len(x))
    going = np.arange(len(x))
    for number in range(_STEPS):
        # All begin at the nominal values: one Jacobian serves the first step of them all.
        prediction = problem.at(x[going] if number else nominal[None])
        r, J = prediction.residual - readings[going], prediction.jacobian
        Jt = np.swapaxes(J, 1, 2)
        information[going] = (Jt @ J) * np.outer(prior, prior) + np.eye(len(prior))
        gradient = (Jt @ r[:, :, None])[:, :, 0] * prior + (x[going] - nominal) / prior
        step = -np.linalg.solve(information[going], gradient[:, :, None])[:, :, 0]
        x[going] += step * prior
        size = np.abs(step).max(axis=1)
        settled = size < _SMALL
        if number:  # what the next step would be, at most
            settled |= size * size < _SMALL * before[going]
        before[going] = size
        going = going[~settled]
        if not len(going):
            break
    left = np.zeros(len(x), dtype=bool)
    left[going] = True
    variance = np.diagonal(np.linalg.inv(information), axis1=1, axis2=2)
    return x, prior * np.sqrt(variance), ~left


def _position_errors(problem: Problem, truth: Array, estimate: Array, q: Array, target: str) -> Array:
    robot, free = problem.robot, problem.free
    apart = np.empty((len(truth), len(q)))
    size = max(1, _BLOCK // len(q))
    for block in (slice(first, first + size) for first in range(0, len(truth), size)):
        true, estimated = (
            robot.forward_kinematics(q, target, {**robot.values, **free.values(vectors[block])}).position
            for vectors in (truth, estimate)
        )
        apart[block] = np.linalg.norm(estimated - true, axis=0)
    return apart


#: Readings of robots calibrated together, so that their Jacobians stay in the processor's cache.
_TOGETHER: Final = 9_000


@dataclass(frozen=True)
class ExperimentEntry:
    """The experiment that is asked for: many robots simulated, calibrated and judged."""

    robot: str  #: What :func:`truearm.load_robot` takes, files from the manifest's folder.
    count: int  #: Simulated robots.
    #: How many configurations each is measured at, drawn within the limits; or the file of them.
    configurations: int | Path
    targets: int  #: How many targets the instrument sees.
    model: str  #: Which parameters are drawn and identified.
    noise: float  #: Standard deviation of each coordinate [m].
    held_out: int  #: Configurations that judge.
    seed: int  #: Of everything.

    def name(self, number: int) -> str:
        """Return the name of a simulated robot, counted from 0."""
        return f"robot-{number + 1:0{len(str(self.count))}}"


@dataclass(frozen=True, eq=False)
class Experiment:
    """An experiment that is ready to be done, here or elsewhere."""

    asked: ExperimentEntry  #: What the manifest says.
    robot: Robot  #: The nominal robot with its targets.
    joints: Array  #: Joint positions at which each robot is measured, ``(configurations, joints)`` [rad or m].
    held_out: Array  #: Joint positions at which it is judged, likewise.


class Series:
    """Robots of an experiment, calibrated by the part; what all of them share is made once."""

    def __init__(self, experiment: Experiment) -> None:
        self.experiment = experiment
        model = named_model(experiment.asked.model)
        robot = model.prepared(experiment.robot)
        self.problem = of_itself(robot, experiment.joints, model, experiment.asked.noise)
        self.frames = Problem(robot, self.problem.data, FRAMES.free(robot), {})
        self.drawn = np.array([p.group not in PLACES for p in self.problem.free.parameters])

    @cached_property
    def _of_arm(self) -> tuple[list[int], FoundParameters]:
        """The places of the arm's parameters among those identified, and what is the same of every robot's."""
        free = self.problem.free.parameters
        columns = np.flatnonzero(self.drawn).tolist()
        those = [free[k] for k in columns]
        return columns, FoundParameters(
            tuple(p.name for p in those),
            tuple(p.unit for p in those),
            tuple(p.nominal for p in those),
            tuple(p.prior for p in those),
        )

    @property
    def shared(self) -> dict[str, Any]:
        """What is the same of every robot's parameters, column by column."""
        return self._of_arm[1].shared

    def rows(self, numbers: Sequence[int]) -> list[Row]:
        """Return what is found of some robots, counted from 0."""
        size = max(1, _TOGETHER // len(self.problem.components))
        return [row for first in range(0, len(numbers), size) for row in self._rows(numbers[first : first + size])]

    def _rows(self, numbers: Sequence[int]) -> list[Row]:
        began = time.perf_counter()
        experiment, free = self.experiment, self.problem.free
        judged = (len(experiment.robot.targets), 3, len(experiment.held_out))
        truth = np.tile(free.nominal, (len(numbers), 1))
        readings = np.empty((len(numbers), self.problem.rows))
        noise = np.empty((len(numbers), *judged))
        prior = free.prior
        for i, number in enumerate(numbers):
            rng = np.random.default_rng(np.random.SeedSequence(experiment.asked.seed, spawn_key=(1, number)))
            truth[i, self.drawn] += (prior * rng.standard_normal(len(prior)))[self.drawn]
            readings[i] = rng.standard_normal(self.problem.rows)
            noise[i] = experiment.asked.noise * rng.standard_normal(judged)
        readings += self.problem.at(truth).residual
        estimates, deviation, settled = calibrated(self.problem, readings)
        placed, _, _ = calibrated(self.frames, readings)
        true, calibrated_there = (self._positions(self.problem, vectors) for vectors in (truth, estimates))
        nominal_there = self._positions(self.frames, placed)
        errors = {
            "held_out": calibrated_there - true - noise,
            "nominal": nominal_there - true - noise,
            "truth": calibrated_there - true,
        }
        accuracies = {
            name: Accuracy.of_each(np.linalg.norm(apart, axis=2).reshape(len(numbers), -1))
            for name, apart in errors.items()
        }
        seconds = (time.perf_counter() - began) / len(numbers)
        columns, shared = self._of_arm
        rows = []
        for i, number in enumerate(numbers):
            name = experiment.asked.name(number)
            if not settled[i]:
                rows.append(
                    Row(name, "failed", "the calibration did not settle", seconds=seconds, robot=experiment.robot.name)
                )
                continue
            parameters = replace(
                shared,
                value=tuple(estimates[i, columns].tolist()),
                deviation=tuple(deviation[i, columns].tolist()),
                truth=tuple(truth[i, columns].tolist()),
            )
            rows.append(
                Row(
                    name,
                    "calibrated",
                    held_out=accuracies["held_out"][i],
                    nominal=accuracies["nominal"][i],
                    truth=accuracies["truth"][i],
                    parameters=parameters,
                    fit_status="converged",
                    seconds=seconds,
                    robot=experiment.robot.name,
                )
            )
        return rows

    def _positions(self, problem: Problem, vectors: Array) -> Array:
        """Return where targets are at the configurations that judge, ``(robots, targets, 3, configurations)`` [m]."""
        values = {**problem.robot.values, **problem.free.values(vectors)}
        names = [target.name for target in self.experiment.robot.targets]
        at = [problem.robot.forward_kinematics(self.experiment.held_out, name, values).position for name in names]
        return np.stack([np.broadcast_to(np.moveaxis(p, 0, 1), (len(vectors), 3, p.shape[-1])) for p in at], axis=1)
