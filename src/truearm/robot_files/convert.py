"""A robot in another convention or for other programs, and measurements for RoboDK."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, counted, did_you_mean, refusals_of
from truearm.engine.base.units import Marked
from truearm.engine.base.writing import write_new_text
from truearm.engine.command.arguments import (
    joints_argument,
    new_file_for,
    readings_argument,
    robot_argument,
)
from truearm.engine.command.split import faults_of
from truearm.engine.data.controller_joints import in_controller_joints
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.robodk import robodk_csv
from truearm.engine.document.document import Block, Words, say
from truearm.engine.document.records import Record, joints_lines
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.conversion import converted
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.wrench import refuse_pushed
from truearm.robot_files.formats import FORMATS

if TYPE_CHECKING:
    from truearm.robot_files.jobs import ConvertRobot, ExportRobot, ExportToRobodk


LEFT_OUT: Final = Rule("left-out", "warning", "what the robot file in the other convention cannot hold")


@dataclass(frozen=True, eq=False, repr=False)
class ConvertedRobot(Record):
    """A robot in another kinematic convention, every pose the same."""

    robot: Robot  #: In the other convention. Its history ends with what was done.
    file: Path | None = None  #: Its robot file; None if none was written.

    def blocks(self) -> Iterator[Block]:
        """Give what was done."""
        robot, step = self.robot, self.robot.history[-1]
        yield _of_file(
            self.file, f"{robot.name}, {step}.", robot=robot.name, convention=robot.convention_name, history=step
        )


def _of_file(file: Path | None, words: str, **fields: Any) -> Words:
    """Return a line about a file that was written, or about its content where none was."""
    return say(words if file is None else f"{file}: {words}", file=None if file is None else str(file), **fields)


def converted_robot(asked: ConvertRobot) -> ConvertedRobot:
    """Convert a robot, and write it."""
    file = None if asked.out is None else new_file_for(asked.out)
    with refusals_of("robot"):
        robot = converted(robot_argument(asked.robot), asked.convention)
    if file is not None:
        write_new_text(file, robot_text(robot))
    return ConvertedRobot(robot, file)


@dataclass(frozen=True, eq=False, repr=False)
class ExportedRobot(Record):
    """A robot for other programs, and what the format cannot hold."""

    robot: Robot  #: The robot.
    format: str  #: Name of the format.
    text: str  #: Content of the file.
    frames: str  #: Which frames its numbers refer to.
    left_out: tuple[str, ...]  #: What the format cannot hold, one sentence each.
    file: Path | None = None  #: The file; None if none was written.
    told: tuple[Notice, ...] = ()  #: What speaks against the calibration of the robot.

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know about it: what the format cannot hold, and what speaks against the calibration."""
        return (*(LEFT_OUT(message) for message in self.left_out), *self.told)

    @property
    def finished(self) -> bool:
        """Whether it was exported, whatever speaks against the calibration."""
        return True

    def blocks(self) -> Iterator[Block]:
        """Give what was written."""
        words = f"{self.robot.name} as {self.format}. {self.frames}"
        yield _of_file(self.file, words, format=self.format, frames=self.frames)


def exported_robot(asked: ExportRobot) -> ExportedRobot:
    """Write a robot for other programs."""
    file = None if asked.out is None else new_file_for(asked.out)
    robot = robot_argument(asked.robot)
    refuse_pushed(robot)
    with refusals_of("robot"):
        export = FORMATS[asked.format](robot)
    if file is not None:
        write_new_text(file, export.text)
    return ExportedRobot(
        robot, asked.format, export.text, export.frames, export.left_out, file, tuple(faults_of(robot))
    )


@dataclass(frozen=True, eq=False, repr=False)
class ExportedMeasurements(Record):
    """Measurements for other programs."""

    text: str  #: Content of the file.
    configurations: int  #: configurations, readings: how many there are.
    readings: int
    joints_are: JointsOf  #: Whose joint positions the file holds.
    file: Path | None = None  #: The file; None if none was written.
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def blocks(self) -> Iterator[Block]:
        """Give what was written."""
        many = f"{counted(self.configurations, 'configuration')}, {counted(self.readings, 'reading')}"
        yield _of_file(self.file, many, configurations=self.configurations, readings=self.readings)
        yield say(*joints_lines(self.joints_are), joints_are=self.joints_are)


def exported_measurements(asked: ExportToRobodk) -> ExportedMeasurements:
    """Write measurements for RoboDK."""
    file = None if asked.out is None else new_file_for(asked.out)
    arm = robot_argument(asked.robot)
    if [joint.kind for joint in arm.joints] != ["revolute"] * 6:
        raise InputError(
            "RoboDK calibrates arms of six turning joints",
            parameter="robot",
            where=arm.name,
            cure="Use the canonical CSV.",
        )
    joints_are = joints_argument(asked.joints, arm)
    readings = readings_argument(arm, asked.data)
    points, rotations = _on_flange(arm, readings)
    shown = in_controller_joints(arm, readings) if joints_are == "controller" else readings
    text = robodk_csv(shown, points, rotations)
    if file is not None:
        write_new_text(file, text)
    return ExportedMeasurements(
        text, readings.configurations, len(text.splitlines()) - 1, joints_are, file, readings.simulated_from
    )


def _on_flange(arm: Robot, readings: Dataset) -> tuple[list[Array], list[Array]]:
    """Return where the targets of measurements are on the flange, and how they are turned there.

    Raises:
        InputError: If the robot has no such targets on its tool, or these are no positions.
    """
    with refusals_of("data"):
        if not readings.has_position.any() or (readings.against >= 0).any():
            raise InputError(
                "RoboDK's table holds positions in the instrument's frame",
                where=readings.source,
                cure="Export data that have them, without fixtures.",
            )
        seen = (
            arm if arm.targets or not arm.tools else arm.with_frames(arm.base, next(iter(arm.tools.values())).targets)
        )
        known = {target.name: seen.forward_kinematics(np.zeros((1, 6)), target.name) for target in seen.targets}
        for name in readings.targets:
            if name not in known:
                raise InputError(
                    "the robot has no target of this name on its tool",
                    where=readings.source,
                    came=name,
                    allowed=", ".join(known) or None,
                    cure=did_you_mean(name, list(known)) or "Give the calibrated robot.",
                )
    flange = seen.forward_kinematics(np.zeros((1, 6)))
    turned = flange.matrix()[0]
    points = [turned.T @ (known[name].position[:, 0] - flange.position[:, 0]) for name in readings.targets]
    return points, [turned.T @ known[name].matrix()[0] for name in readings.targets]
