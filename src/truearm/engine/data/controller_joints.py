"""Measurements at joint positions as a controller shows them, and as a robot's model has them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from truearm.engine.data.checks import check_joints
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.chain import Array
from truearm.engine.robot.postures import approach_of
from truearm.engine.robot.robot import Robot


def in_model_joints(robot: Robot, data: Dataset) -> Dataset:
    """Return data of a robot with the joint positions of its model.

    Every job that compares a robot with measurements takes them through here.

    Raises:
        InputError: If the joints are not the robot's, or are its controller's and its file does not say how that counts
            them.
    """
    check_joints(robot, data)
    if data.joints_are != "controller":
        return data
    robot.controller.check_counts(robot.name, f"{data.source}, column axis_1")
    return _with_joints(data, robot.controller.to_model(data.joints), "converted")


def in_controller_joints(robot: Robot, data: Dataset) -> Dataset:
    """Return data of a robot with the joint positions that its controller shows.

    Raises:
        InputError: If the joints are not the robot's, or its file does not say how its controller counts them.
    """
    check_joints(robot, data)
    if data.joints_are == "controller":
        return data
    robot.controller.check_counts(robot.name)
    return _with_joints(data, robot.controller.from_model(data.joints), "controller")


def _with_joints(data: Dataset, joints: Array, kind: str) -> Dataset:
    """Return data at other joint positions; where each joint came from follows from the order of measurement."""
    order = None if data.number is None else np.asarray(np.round(data.number), np.int64)
    return replace(
        data,
        joints=joints,
        joints_are=kind,
        approach=None if order is None or data.approach is None else approach_of(joints, order),
        references=None if data.references is None else _with_joints(data.references, joints, kind),
    )
