"""Measurements as the tables of RoboDK's robot calibration."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from truearm.errors import InputError, did_you_mean, refusals_of
from truearm.jobs.arguments import joints_argument, new_file_for, readings_argument, robot_argument
from truearm.measurement.controller_joints import in_controller_joints
from truearm.measurement.dataset import Dataset
from truearm.measurement.readers.robodk import robodk_csv
from truearm.modeling.controller import JointsOf
from truearm.modeling.robot import Robot
from truearm.results.exported_measurements import ExportedMeasurements
from truearm.writing import write_new_text


def export_robodk(
    robot: Robot | str | Path,
    data: Dataset | str | Path,
    *,
    joints: JointsOf | None = None,
    out: str | Path | None = None,
) -> ExportedMeasurements:
    """Write measurements as RoboDK's robot calibration has them.

    Parameters
    ----------
    robot
        A robot with the targets of the data on its tool, or what :func:`truearm.load_robot` takes: a calibrated one, or
        one whose file has a tool with targets of these names.
    data
        Positions, or poses, in the instrument's frame, or a canonical CSV file.
    joints
        Whose joint positions the file holds: the ``model``'s, or as the ``controller`` shows them; None for the
        controller's where the robot file says that they differ.
    out
        File to write, which must not exist yet; None writes nothing.

    Raises
    ------
    InputError
        If the robot has not six turning joints or not these targets, or the data are no positions.
    """
    file = None if out is None else new_file_for(out)
    arm = robot_argument(robot)
    if [joint.kind for joint in arm.joints] != ["revolute"] * 6:
        raise InputError(
            "RoboDK calibrates arms of six turning joints",
            parameter="robot",
            where=arm.name,
            cure="Use the canonical CSV.",
        )
    joints_are = joints_argument(joints, arm)
    readings = readings_argument(arm, data)
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
    rotations = [turned.T @ known[name].matrix()[0] for name in readings.targets]
    shown = in_controller_joints(arm, readings) if joints_are == "controller" else readings
    text = robodk_csv(shown, points, rotations)
    if file is not None:
        write_new_text(file, text)
    return ExportedMeasurements(
        text, readings.configurations, len(text.splitlines()) - 1, joints_are, file, readings.simulated_from
    )
