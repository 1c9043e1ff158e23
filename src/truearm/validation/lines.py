"""The line test: seven directions of a box, with and without compensation through joint errors."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.engine.base.errors import InputError, refusals_of
from truearm.engine.base.units import Marked, parts_of
from truearm.engine.base.writing import output_file, write_text
from truearm.engine.command.arguments import (
    file_for,
    files_of,
    joints_argument,
    readings_argument,
    robot_argument,
)
from truearm.engine.data.dataset import Dataset
from truearm.engine.document.document import Block, Words, each, say
from truearm.engine.document.records import Record
from truearm.engine.fit.fit import place
from truearm.engine.motion.cube import DIRECTIONS, SevenLines, seven_lines, usable_joints
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.conventions.convention import JOINT
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.inverse.pose_solver import JointSolutions
from truearm.engine.robot.lines import at_zero
from truearm.engine.robot.parts import Target
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.robot.urdf_writing import counting, joint_cells, joint_headings
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin

if TYPE_CHECKING:
    from truearm.validation.jobs import TestLines

# Off-line compensation through the model with inverted joint errors (KR5 paper, equation 11).
#
# The robot with errors is ``A1 E1 A2 E2 ..``. At the nominal joint positions ``A1 inv(E1) A2 inv(E2) ..`` is as far
# from the wanted pose as the real robot, on the other side: it is the fake target. The nominal robot's joint positions
# for the fake target bring the real robot to the pose, up to terms of second order in the errors. (Solving the inverse
# kinematics of the inverted model for the pose itself would double the error.)

#: The convention whose robots have joint errors.
CONVENTION: Final = "joint-errors"


@dataclass(frozen=True, eq=False)
class FakeTargets:
    """What to command so that the real robot reaches wanted poses."""

    position: Array  #: position, rotation: the fake targets in the base frame, ``(n, 3)`` [m] and ``(n, 3, 3)``.
    rotation: Array
    solutions: JointSolutions  #: The nominal robot's joint positions for them, with a status each.


def design(robot: Robot) -> Robot:
    """Return the robot without joint errors, in its own base frame.

    Raises:
        InputError: If it is not described by joint errors.
    """
    return replace(_checked(robot).with_frames(IDENTITY, {}), known={}, effect_names=())


def inverted(robot: Robot) -> Robot:
    """Return the robot ``A1 inv(E1) A2 inv(E2) ..``, as combinations of translations, in its own base frame.

    Calibrated joint zeros count as errors too.

    Raises:
        InputError: If the robot is not described by joint errors.
    """
    joints = []
    for number, (joint, link) in enumerate(zip(_checked(robot).joints, robot.link_elements, strict=True), 1):
        zero = robot.parameters[f"{JOINT}_{number}"]
        P, E = at_zero(robot, link[:6]), at_zero(robot, link[6:11])
        M = P @ _about_z(zero.nominal - zero.value) @ np.linalg.inv(E)
        row = {
            **dict(zip("xyz", M[:3, 3].tolist(), strict=True)),
            "rx": math.atan2(-M[1, 2], M[2, 2]),
            "ry": math.atan2(M[0, 2], math.hypot(M[0, 0], M[0, 1])),
            JOINT: math.atan2(-M[0, 1], M[0, 0]) + zero.nominal,
        }
        joints.append(replace(joint, row=row))
    arm = replace(robot, convention_name="translations", joints=tuple(joints), known={}, effect_names=(), truths={})
    return arm.with_frames(IDENTITY, {})


def fake_targets(robot: Robot, joints: Array) -> FakeTargets:
    """Return fake targets, and the joint positions to command, for nominal joint positions ``(n, joints)`` [rad].

    Args:
        robot: With identified joint errors.
        joints: Joint positions at which the nominal robot is at the wanted poses.
    """
    position, rotation = inverted(robot).world_poses(joints)
    return FakeTargets(position, rotation, inverse(design(robot), position, rotation, seed=joints))


def _checked(robot: Robot) -> Robot:
    if robot.convention_name != CONVENTION or any(joint.kind != "revolute" for joint in robot.joints):
        raise InputError(
            "the robot is not described by joint errors of turning joints",
            where=robot.name,
            came=robot.convention_name,
            allowed=CONVENTION,
            cure="'truearm axes' writes joint-errors.yaml; 'truearm convert' converts a robot without errors.",
        )
    return robot


def _about_z(angle: float) -> Array:
    matrix = np.eye(4)
    matrix[0, 0] = matrix[1, 1] = math.cos(angle)
    matrix[1, 0], matrix[0, 1] = math.sin(angle), -math.sin(angle)
    return matrix


# The line test before and after compensation, on a twin or from data (KR5 paper, section 4.2 and equation 21).
@dataclass(frozen=True, eq=False)
class LineErrors:
    """How far a robot is from the poses of a line test."""

    lines: SevenLines  #: The poses.
    error: Array  #: Distance from each pose ``(7 k,)`` [m], the mean over repetitions; NaN where it was not measured.

    def largest(self, direction: str) -> float:
        """Return the largest error on a line [m]."""
        return float(np.nanmax(self.error[self.lines.rows(direction)]))

    def mean(self, direction: str) -> float:
        """Return the mean error on a line [m]."""
        return float(np.nanmean(self.error[self.lines.rows(direction)]))

    def figures(self, direction: str) -> dict[str, float]:
        """Return both as JSON holds them [mm]."""
        return {"mean": self.mean(direction) * 1e3, "max": self.largest(direction) * 1e3}


def on_twin(
    lines: SevenLines, twin: Twin, joints: Array, scatter: float, repeats: int, rng: np.random.Generator
) -> LineErrors:
    """Let a twin go to joint positions and see how far its flange is from the poses, in its own base frame.

    Args:
        joints: Joint positions that are commanded, ``(7 k, joints)`` [rad].
        scatter: Standard deviation of each coordinate of a repetition: the robot's and the instrument's [m].
        repeats: How often each pose is measured.
    """
    base = twin.robot.base
    base_frame = np.eye(4)
    base_frame[:3, :3], base_frame[:3, 3] = base.rotation, base.translation
    flange = _flange_of(twin, joints)
    true = np.array([(np.linalg.inv(base_frame) @ T)[:3, 3] for T in flange])
    seen = true + rng.normal(0.0, 1.0, (repeats, *true.shape)) * scatter
    return LineErrors(lines, np.asarray(np.linalg.norm(seen - lines.position, axis=2).mean(axis=0)))


def _flange_of(twin: Twin, joints: Array) -> list[Array]:
    """Return ``T_world_flange`` ``(4, 4)`` of a twin at joint positions ``(n, joints)``."""
    flange = replace(twin, robot=replace(twin.robot, targets=(Target("flange", (1.0, 0.0, 0.0, 0.0)),)))
    return [posture.targets["flange"] for posture in flange.postures(joints)]


def from_data(lines: SevenLines, robot: Robot, data: Dataset) -> LineErrors:
    """Return errors that were measured.

    Args:
        robot: Where it stands before the instrument, with the targets on its flange: the poses are taken there.
        data: Configurations called as the poses are, ``x-1`` to ``xyz-11``; a repetition is another reading of the
            same.

    Raises:
        InputError: If a configuration has another name, a target is not known, or a line was not measured at all.
    """
    base = robot.base
    of = {label: i for i, label in enumerate(lines.labels)}
    unknown = [label for label in data.labels if label not in of]
    if unknown:
        raise InputError(
            "the configuration is not a pose of the line test",
            where=data.source,
            came=unknown[0],
            allowed=f"{lines.labels[0]} to {lines.labels[-1]}",
            cure="Name configurations as the plan of 'truearm lines' does.",
        )
    sums, counts = np.zeros(len(lines.labels)), np.zeros(len(lines.labels))
    for index, name in enumerate(data.targets):
        at = robot.target(name)
        offset = np.array([robot.values[at.parameter(axis)] for axis in "xyz"])
        wanted = (lines.position + lines.rotation @ offset) @ base.rotation.T + base.translation
        for reading in np.flatnonzero((data.target == index) & data.has_position):
            pose = of[data.labels[int(data.configuration[reading])]]
            sums[pose] += float(np.linalg.norm(data.position[reading] - wanted[pose]))
            counts[pose] += 1
    for direction in DIRECTIONS:
        if not counts[lines.rows(direction)].any():
            raise InputError(
                "a line was not measured", where=data.source, came=f"no pose of line {direction}", allowed="all seven"
            )
    with np.errstate(invalid="ignore"):
        return LineErrors(lines, sums / counts)


def reduction(before: LineErrors, after: LineErrors, direction: str) -> float:
    """Return by how much the largest error of a line fell [percent]."""
    return 100.0 * (1.0 - after.largest(direction) / before.largest(direction))


@dataclass(frozen=True, eq=False, repr=False)
class LineTest(Record):
    """A line test of a robot."""

    robot: Robot  #: The nominal robot.
    poses: SevenLines  #: The poses, line after line.
    joints: Array  #: Joint positions to command, of the model, ``(7 k, joints)`` [rad or m].
    compensated: bool  #: Whether `joints` are compensated for joint errors.
    before: LineErrors | None  #: Errors without compensation; None where nothing was measured and no truth was named.
    after: LineErrors | None  #: Errors with compensation; None where it was not tried.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    #: Whose joint positions the file holds: the ``model``'s, or those that the ``controller`` shows.
    joints_are: JointsOf = "model"
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def blocks(self) -> Iterator[Block]:
        """Give the errors of each line of poses, in mm."""
        reached = f"The robot can go to all {len(self.poses.labels)} poses."
        yield say(reached if self.before is None else "", poses=len(self.poses.labels))
        yield each("lines", (self._line(direction, self.before) for direction in DIRECTIONS if self.before))

    def written_at(self, out: str) -> str:
        """Return the line that says which file holds the joint positions."""
        kind = "compensated" if self.compensated else "nominal"
        shown = " as the controller shows them (axis_i)" if self.joints_are == "controller" else ""
        return f"{out}: {len(self.joints)} configurations, {kind} joint positions{shown}."

    def _line(self, direction: str, before: LineErrors) -> Words:
        figures = before.figures(direction)
        words = f"{direction:<4} mean {figures['mean']:.3f}  max {figures['max']:.3f} mm"
        if self.after is None:
            return say(words, direction=direction, before_mm=figures)
        after, reduced = self.after.figures(direction), reduction(before, self.after, direction)
        words += f"   compensated mean {after['mean']:.3f}  max {after['max']:.3f} mm   max reduced by {reduced:.1f} %"
        return say(words, direction=direction, before_mm=figures, after_mm=after, reduction_percent=reduced)

    def csv_text(self) -> str:
        """Return the plan as CSV: one configuration a pose, joint positions in deg, those of sliding joints in mm."""
        joints, controller = self.robot.joints, counting(self.robot, self.joints_are)
        heading = ["configuration", *joint_headings(joints, controller)]
        cells = joint_cells(self.joints, joints, controller)
        rows = [[label, *row] for label, row in zip(self.poses.labels, cells, strict=True)]
        return "\n".join(",".join(row) for row in [heading, *rows]) + "\n"

    def save(self, file: str | Path) -> None:
        """Write the plan as a CSV file."""
        write_text(output_file(file, self.inputs), self.csv_text())


def tested(asked: TestLines) -> LineTest:
    """Plan the test, compensate it, and compare it with a twin or with measurements."""
    inputs = files_of(asked.robot, asked.joint_errors, asked.truth, asked.data)
    path = None if asked.out is None else file_for(asked.out, *inputs)
    nominal = robot_argument(asked.robot)
    errors = None if asked.joint_errors is None else robot_argument(asked.joint_errors, "joint_errors")
    with refusals_of("size"):
        poses = seven_lines(asked.centre, asked.size)
    joints_are = joints_argument(asked.joints, nominal)
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
    if asked.truth is not None:
        rng = np.random.default_rng(asked.seed)
        with refusals_of("truth"):
            twin = truth_twin(nominal, asked.truth, rng)
        before = on_twin(poses, twin, at_poses, asked.noise, asked.repeats, rng)
        after = None if errors is None else on_twin(poses, twin, commanded, asked.noise, asked.repeats, rng)
    elif asked.data is not None:
        measured = readings_argument(nominal, asked.data)
        with refusals_of("data"):
            before = from_data(poses, _placed(nominal, errors, measured), measured)
    marks = parts_of((nominal, errors, measured)) if asked.truth is None else ("data",)
    line_test = LineTest(nominal, poses, commanded, errors is not None, before, after, inputs, joints_are, marks)
    if path is not None:
        line_test.save(path)
    return line_test


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
