"""A corrected path as a program: which of its samples become targets, and what the controller is told of them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final, Literal

import numpy as np

from truearm.compensation.corrected_path import CorrectedPath
from truearm.compensation.programs import LANGUAGES
from truearm.compensation.programs.new_program import NAME, NewProgram
from truearm.compensation.programs.program import Language
from truearm.errors import InputError
from truearm.modeling.inverse.branches import branch_rule
from truearm.modeling.robot import Robot
from truearm.modeling.transform import homogeneous

#: What the targets of a program are.
TargetKind = Literal["joints", "poses"]
#: What each language is called as an option.
BY_NAME: Final[Mapping[str, Language]] = {
    re.sub(r"[^a-z0-9]+", "-", language.name.lower()): language for language in LANGUAGES
}
_AXES: Final = 6


def path_program(path: CorrectedPath, robot: Robot, name: str, *, targets: TargetKind, spacing: float) -> NewProgram:
    """Return the targets of a program that follows a corrected path.

    Parameters
    ----------
    path
        With its corrected joint positions.
    robot
        For whom it is.
    name
        Of the program.
    targets
        ``joints``, or ``poses``: those that the controller's robot has with the corrected joint positions.
    spacing
        Time from one target to the next [s], or a little more.

    Raises
    ------
    InputError
        If the name cannot be one in every language, or the arm has more or fewer than six joints and poses are wanted,
        or more than six.
    """
    if not re.fullmatch(NAME, name):
        raise InputError(
            "a program cannot be called so in every language",
            where="name",
            came=name,
            allowed="a letter, then up to 31 letters, digits and underscores",
        )
    count = len(robot.joints)
    if count > _AXES or (targets == "poses" and count < _AXES):
        raise InputError(
            "programs are written for arms of six joints, or fewer with joint positions as targets",
            where=robot.name,
            came=f"{count} joints, targets: {targets}",
            cure="Take the CSV of the joint positions." if count > _AXES else "Write joint positions.",
        )
    rows = _chosen(path.motion.time, path.planned.section, spacing)
    joints = path.joints[path.best][rows]
    time = path.motion.time[rows]
    apart = np.diff(path.planned.trajectory.distance[rows], prepend=0.0)
    durations = np.concatenate([[0.0], np.diff(time)])
    poses, branches = None, None
    if targets == "poses":
        position, rotation = path.nominal.forward(joints, frame="controller")
        poses = homogeneous(rotation, position)
        rule = branch_rule(path.nominal)
        if rule is not None:
            branches = tuple(rule.numbers(path.nominal.forward_kinematics(joints)).tolist())
    return NewProgram(
        name,
        robot.name,
        robot.controller.from_model(joints),
        tuple(joint.kind == "prismatic" for joint in robot.joints),
        poses,
        branches,
        durations,
        np.divide(apart, durations, out=np.zeros_like(apart), where=durations > 0.0),
        apart,
        path.calibrated,
    )


def _chosen(time: np.ndarray, section: np.ndarray, spacing: float) -> np.ndarray:
    """Return the samples that become targets: the first, the ends of sections, and others at least `spacing` apart."""
    ends = np.append(np.flatnonzero(np.diff(section)), len(time) - 1)
    kept = [0]
    for end in ends.tolist():
        for row in range(kept[-1] + 1, end):
            far = time[row] - time[kept[-1]] >= spacing - 1e-9
            if far and time[end] - time[row] >= 0.5 * spacing:
                kept.append(row)
        if end > kept[-1]:
            kept.append(end)
    return np.array(kept)
