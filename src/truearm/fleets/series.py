"""A whole series simulated: robots drawn from their priors, measured, calibrated, and judged by their truth.

Every robot has random numbers of its own, spawned from the seed by its number, and is calibrated as if it were alone:
so what is found of it depends neither on the robots beside it nor on who computes it. A worker imports no more than
this file needs, because that takes as long as some hundred robots.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.fleets.rows import Accuracy, FoundParameters, Row
from truearm.identification.judging.monte_carlo import calibrated, of_itself
from truearm.identification.solving.models import FRAMES, named_model
from truearm.identification.solving.problem import Problem
from truearm.modeling.chain import Array
from truearm.modeling.parameters import PLACES
from truearm.modeling.robot import Robot

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

    def __init__(self, made: Experiment) -> None:
        self.made = made
        model = named_model(made.asked.model)
        robot = model.prepared(made.robot)
        self.problem = of_itself(robot, made.joints, model, made.asked.noise)
        self.frames = Problem(robot, self.problem.data, FRAMES.free(robot), {})
        self.drawn = np.array([p.group not in PLACES for p in self.problem.free.parameters])

    @cached_property
    def _kept(self) -> tuple[list[int], FoundParameters]:
        """The places of the arm's parameters among those identified, and what is the same of every robot's."""
        free = self.problem.free.parameters
        kept = np.flatnonzero(self.drawn).tolist()
        those = [free[k] for k in kept]
        return kept, FoundParameters(
            tuple(p.name for p in those),
            tuple(p.unit for p in those),
            tuple(p.nominal for p in those),
            tuple(p.prior for p in those),
        )

    @property
    def shared(self) -> dict[str, Any]:
        """What is the same of every robot's parameters, column by column."""
        return self._kept[1].shared

    def rows(self, numbers: Sequence[int]) -> list[Row]:
        """Return what is found of some robots, counted from 0."""
        size = max(1, _TOGETHER // len(self.problem.components))
        return [row for first in range(0, len(numbers), size) for row in self._rows(numbers[first : first + size])]

    def _rows(self, numbers: Sequence[int]) -> list[Row]:
        began = time.perf_counter()
        made, free = self.made, self.problem.free
        judged = (len(made.robot.targets), 3, len(made.held_out))
        truth = np.tile(free.nominal, (len(numbers), 1))
        readings = np.empty((len(numbers), self.problem.rows))
        noise = np.empty((len(numbers), *judged))
        prior = free.prior
        for i, number in enumerate(numbers):
            rng = np.random.default_rng(np.random.SeedSequence(made.asked.seed, spawn_key=(1, number)))
            truth[i, self.drawn] += (prior * rng.standard_normal(len(prior)))[self.drawn]
            readings[i] = rng.standard_normal(self.problem.rows)
            noise[i] = made.asked.noise * rng.standard_normal(judged)
        readings += self.problem.at(truth).residual
        found, deviation, settled = calibrated(self.problem, readings)
        placed, _, _ = calibrated(self.frames, readings)
        true, calibrated_there = (self._positions(self.problem, vectors) for vectors in (truth, found))
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
        kept, shared = self._kept
        rows = []
        for i, number in enumerate(numbers):
            name = made.asked.name(number)
            if not settled[i]:
                rows.append(
                    Row(name, "failed", "the calibration did not settle", seconds=seconds, robot=made.robot.name)
                )
                continue
            parameters = replace(
                shared,
                value=tuple(found[i, kept].tolist()),
                deviation=tuple(deviation[i, kept].tolist()),
                truth=tuple(truth[i, kept].tolist()),
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
                    robot=made.robot.name,
                )
            )
        return rows

    def _positions(self, problem: Problem, vectors: Array) -> Array:
        """Return where targets are at the configurations that judge, ``(robots, targets, 3, configurations)`` [m]."""
        values = {**problem.robot.values, **problem.free.values(vectors)}
        names = [target.name for target in self.made.robot.targets]
        at = [problem.robot.forward_kinematics(self.made.held_out, name, values).position for name in names]
        return np.stack([np.broadcast_to(np.moveaxis(p, 0, 1), (len(vectors), 3, p.shape[-1])) for p in at], axis=1)
