"""The line test: seven directions of a box, with and without compensation through joint errors."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from truearm.compensation.inverse_errors import design, fake_targets
from truearm.errors import InputError, refusals_of
from truearm.files import path_argument
from truearm.identification.solving.fit import place
from truearm.jobs.arguments import (
    count_argument,
    file_for,
    files_of,
    joints_argument,
    length_argument,
    lengths_argument,
    readings_argument,
    robot_argument,
    whole_argument,
)
from truearm.measurement.dataset import Dataset
from truearm.modeling.controller import JointsOf
from truearm.modeling.robot import Robot
from truearm.modeling.transform import IDENTITY
from truearm.planning.poses.seven_lines import seven_lines, usable_joints
from truearm.results.line_test import LineTest
from truearm.simulated import parts_of
from truearm.simulation.truths import truth_twin
from truearm.validation.line_test import LineErrors, from_data, on_twin


def lines(
    robot: Robot | str | Path,
    centre: Sequence[float],
    *,
    size: Sequence[float] = (0.6, 0.8, 0.4),
    joint_errors: Robot | str | Path | None = None,
    truth: str | Path | None = None,
    data: Dataset | str | Path | None = None,
    noise: float = 0.0,
    repeats: int = 30,
    seed: int = 0,
    joints: JointsOf | None = None,
    out: str | Path | None = None,
) -> LineTest:
    """Test a robot along seven directions of a box, and compensate it off-line through its joint errors.

    Parameters
    ----------
    robot
        The nominal robot, as the controller knows it, or what :func:`truearm.load_robot` takes.
    centre, size
        Of the box in the robot's base frame [m], three numbers each.
    joint_errors
        The same robot with joint errors, or its file: joint positions are compensated with it.
    truth
        Try it on a twin, as for :func:`truearm.simulate`: ``nominal``, ``random``, a truth of the robot file, a file.
    data
        Or judge measurements: configurations named as the poses are, ``x-1`` to ``xyz-11``.
    noise
        Standard deviation of each coordinate of a repetition on the twin [m].
    repeats
        Repetitions on the twin.
    seed
        Of the noise, and of a random truth.
    joints
        Whose joint positions the file holds: the ``model``'s, or as the ``controller`` shows them; None for the
        controller's where the robot file says that they differ.
    out
        CSV file for the joint positions to command; None writes nothing.

    Raises
    ------
    InputError
        If the robot cannot go to a pose, joint errors or data are of another robot, or both truth and data are given.
    """
    middle, sides = lengths_argument(centre, "centre", 3), lengths_argument(size, "size", 3)
    scatter, repeats = length_argument(noise, "noise", 0.0), count_argument(repeats, "repeats")
    seed = whole_argument(seed, "seed")
    if truth is not None and data is not None:
        raise InputError("only one of them can be compared", parameter="truth, data", cure="Leave one out.")
    inputs = files_of(robot, joint_errors, truth, data)
    path = None if out is None else file_for(out, *inputs)
    nominal = robot_argument(robot)
    errors = None if joint_errors is None else robot_argument(joint_errors, "joint_errors")
    with refusals_of("size"):
        poses = seven_lines(middle, sides)
    joints_are = joints_argument(joints, nominal)
    with refusals_of("centre"):
        at_poses = poses.joints(nominal)
    commanded = at_poses
    if errors is not None:
        _check_design(nominal, errors)
        with refusals_of("centre"):
            commanded = usable_joints(fake_targets(errors, at_poses).solutions, poses.labels, "compensated line test")
    before: LineErrors | None = None
    after: LineErrors | None = None
    measured: Dataset | None = None
    if truth is not None:
        rng = np.random.default_rng(seed)
        with refusals_of("truth"):
            twin = truth_twin(nominal, str(path_argument(truth, "truth")), rng)
        before = on_twin(poses, twin, at_poses, scatter, repeats, rng)
        after = None if errors is None else on_twin(poses, twin, commanded, scatter, repeats, rng)
    elif data is not None:
        measured = readings_argument(nominal, data)
        with refusals_of("data"):
            before = from_data(poses, _placed(nominal, errors, measured), measured)
    marks = parts_of((nominal, errors, measured)) if truth is None else ("data",)
    found = LineTest(nominal, poses, commanded, errors is not None, before, after, inputs, joints_are, marks)
    if path is not None:
        found.save(path)
    return found


def _placed(nominal: Robot, errors: Robot | None, data: Dataset) -> Robot:
    """Return a robot with its base and the data's targets: one of those given, or placed by the data."""
    for robot in (errors, nominal):
        if robot is not None and set(data.targets) <= {target.name for target in robot.targets}:
            return robot
    return place(nominal, data)


def _check_design(nominal: Robot, errors: Robot) -> None:
    """Refuse joint errors of another robot."""
    with refusals_of("joint_errors"):
        plain = design(errors)
    q = nominal.random_configurations(5, np.random.default_rng(0))
    if len(plain.joints) == len(nominal.joints):
        apart = np.abs(plain.world_poses(q)[0] - nominal.with_frames(IDENTITY, {}).world_poses(q)[0]).max()
        if apart < 1e-6:
            return
    raise InputError(
        f"these joint errors belong to another robot than {nominal.name}",
        parameter="joint_errors",
        came=errors.name,
        cure="Give the robot that 'truearm axes' was given.",
    )
