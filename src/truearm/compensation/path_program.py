"""A corrected path as a program: which of its samples become targets, and what the controller is told of them."""

from __future__ import annotations

import math
import re
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.compensation.corrected_path import TIP, CorrectedPath
from truearm.compensation.programs.new_program import NAME, NewProgram
from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.inverse.branches import branch_rule
from truearm.modeling.robot import Robot
from truearm.modeling.transform import homogeneous
from truearm.planning.poses.tip import Tip

#: What the targets of a program are.
TargetKind = Literal["joints", "poses"]
_AXES: Final = 6


def path_program(path: CorrectedPath, robot: Robot, name: str, *, targets: TargetKind, spacing: float) -> NewProgram:
    """Return the targets of a program that follows a corrected path.

    Args:
        path: With its corrected joint positions.
        robot: For whom it is.
        name: Of the program.
        targets: ``joints``, or ``poses``: those that the controller's robot has with the corrected joint positions.
        spacing: Time from one target to the next [s], or a little less; that of the samples at the least.

    Raises:
        InputError: If the name cannot be one in every language, or the arm has more or fewer than six joints and poses
            are wanted, or more than six.
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
        _beside(path, rows, straight=targets == "poses"),
        robot.simulated,
    )


def _chosen(time: Array, section: NDArray[np.intp], spacing: float) -> NDArray[np.intp]:
    """Return the samples that become targets: the first, the ends of sections, and others about `spacing` apart."""
    ends = [*np.flatnonzero(np.diff(section)).tolist(), len(time) - 1]
    kept = [0]
    for end in ends:
        first = kept[-1]
        pieces = min(max(1, math.ceil(float(time[end] - time[first]) / spacing - 1e-6)), end - first)
        wanted = np.linspace(time[first], time[end], pieces + 1)[1:]
        rows = first + 1 + np.abs(time[first + 1 : end + 1, None] - wanted).argmin(axis=0)
        kept += np.unique(rows).tolist()
    return np.array(kept)


def _beside(path: CorrectedPath, rows: NDArray[np.intp], *, straight: bool) -> float:
    """Return how far a program leaves the path between its targets [m], its corners not rounded off.

    Args:
        rows: The samples that are targets.
        straight: Whether the tip goes straight from one to the next, or all joints evenly.
    """
    travelled, position = path.planned.trajectory.distance, path.planned.trajectory.position

    def between(values: Array) -> Array:
        return np.column_stack([np.interp(travelled, travelled[rows], column) for column in values[rows].T])

    if straight:
        went = between(position)
        meant = position
    else:
        joints = path.joints[path.best]
        tip = Tip(path.nominal, TIP)
        went = tip.positions(between(joints))
        meant = tip.positions(joints)
    apart = went - meant
    along = np.gradient(meant, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    return float(np.linalg.norm(apart - (apart * along).sum(axis=1, keepdims=True) * along, axis=1).max())
