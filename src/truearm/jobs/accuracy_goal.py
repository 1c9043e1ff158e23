"""Where a robot shall be accurate: the targets of a program, poses, or a region."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from truearm.arrays import axes
from truearm.errors import InputError, refusals_of
from truearm.files import path_argument
from truearm.jobs.arguments import array_argument
from truearm.measurement.readers.poses import read_poses
from truearm.modeling.chain import Array
from truearm.modeling.inverse import inverse
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot
from truearm.modeling.transform import rotation_from_quaternion
from truearm.shown import counted, listed

#: Places that are looked at, evenly among all.
_MOST: Final = 500
#: Configurations of a region that are looked at, and how many are drawn to find them.
_IN_REGION, _DRAWN, _AT_ONCE = 200, 400_000, 20_000


@dataclass(frozen=True, eq=False)
class AccuracyGoal:
    """Where a robot shall be accurate."""

    postures: Postures  #: The configurations there.
    words: str  #: What that is: ``at the 40 targets of part.mod``.


def accuracy_goal(
    robot: Robot,
    accurate_at: object,
    region: object,
    tools: str | Path | None,
    frames: str | Path | None,
    rng: np.random.Generator,
) -> AccuracyGoal | None:
    """Return where a robot shall be accurate, None if nothing was said of that.

    Args:
        accurate_at: A program, a CSV file of poses of the flange in the base frame, or joint positions of the model
            ``(n, joints)`` [rad or m].
        region: Lowest and highest x, y and z of the flange in the base frame [m].
        tools, frames: Where tools and frames of a program are, see :mod:`truearm.compensation.cell`.

    Raises:
        InputError: If both are given, a file cannot be read, or the robot reaches none of it.
    """
    if accurate_at is not None and region is not None:
        raise InputError(
            "the robot can be planned for places or for a region",
            parameter="accurate_at, region",
            cure="Leave one of them out.",
        )
    if accurate_at is None and (tools is not None or frames is not None):
        raise InputError(
            "only a program needs to know where its tools and frames are",
            parameter="tools" if tools is not None else "frames",
            cure="Give the program, or leave it out.",
        )
    if region is not None:
        return _in_region(robot, _box(region), rng)
    if accurate_at is None:
        return None
    if not isinstance(accurate_at, str | Path):
        count = len(robot.joints)
        given = array_argument(accurate_at, "accurate_at", ("n", count), f"joint positions, (n, {count}), or a file")
        return _goal(given, "at the given configurations")
    path = path_argument(accurate_at, "accurate_at")
    with refusals_of("accurate_at"):
        if path.suffix.lower() == ".csv":
            return _at_poses(robot, path)
        return _at_targets(robot, path, tools, frames)


def _goal(joints: Array, words: str) -> AccuracyGoal:
    some = np.unique(np.linspace(0, len(joints) - 1, min(len(joints), _MOST)).astype(int))
    chosen = joints[some]
    if len(some) < len(joints):
        words += f" (judged at {len(some)} of them)"
    return AccuracyGoal(Postures(chosen, approach=np.ones_like(chosen), number=np.zeros(len(chosen))), words)


def _at_poses(robot: Robot, path: Path) -> AccuracyGoal:
    read = read_poses(path)
    rotations = None if read.quaternion is None else rotation_from_quaternion(read.quaternion)
    found = inverse(robot, read.position, rotations, orientation="free" if rotations is None else "full")
    lost = [label for label, usable in zip(read.labels, found.usable, strict=True) if not usable]
    if lost:
        raise InputError(
            f"the robot cannot go to {counted(len(lost), 'pose')}",
            where=str(path),
            came=listed(lost),
            cure="Look at them with 'truearm ik', and leave them out.",
        )
    return _goal(found.joints, f"at the {counted(len(found.joints), 'pose')} of {path.name}")


def _at_targets(robot: Robot, path: Path, tools: str | Path | None, frames: str | Path | None) -> AccuracyGoal:
    from truearm.compensation.cell import Cell, read_frames, read_tools
    from truearm.compensation.fake_targets import controllers_robot
    from truearm.compensation.program_files import language_called, program_files, read_programs
    from truearm.compensation.resolved_program import ResolvedProgram

    programs = read_programs(program_files([path], again=True))
    language = language_called(programs[0].language)
    with refusals_of("tools"):
        tool_file = None if tools is None else path_argument(tools, "tools")
        placed = read_tools(robot, tool_file, language.flange)
    with refusals_of("frames"):
        frame_file = None if frames is None else path_argument(frames, "frames")
        cell = Cell(placed, read_frames(robot, frame_file, language.base))
    believed = controllers_robot(robot)
    joints = np.concatenate([ResolvedProgram(robot, believed, program, cell).joints for program in programs])
    found = joints[~np.isnan(joints).any(axis=1)]
    if not len(found):
        raise InputError(
            "the robot reaches none of the targets",
            where=str(path),
            came=counted(len(joints), "target"),
            cure="Check that it is this robot's program, and say where its tools and frames are.",
        )
    of = "" if len(found) == len(joints) else f" of {len(joints)}"
    return _goal(found, f"at the {len(found)}{of} targets of {path.name}")


def _box(region: object) -> Array:
    allowed = "lowest and highest x, y and z in m, (3, 2)"
    if isinstance(region, str) or axes(region) != 2:
        raise InputError("a box belongs here", parameter="region", came=str(region), allowed=allowed)
    box = array_argument(region, "region", (3, 2), allowed)
    for name, (low, high) in zip("xyz", box, strict=True):
        if not low < high:
            raise InputError(
                f"the region has no extent along {name}",
                parameter="region",
                came=f"{low * 1e3:g} to {high * 1e3:g} mm",
                cure="The lower one comes first.",
            )
    return box


def _in_region(robot: Robot, box: Array, rng: np.random.Generator) -> AccuracyGoal:
    base = robot.base
    found: list[Array] = []
    low, high = box.T
    for _ in range(_DRAWN // _AT_ONCE):
        drawn = robot.random_configurations(_AT_ONCE, rng)
        place = (robot.rigid.world_poses(drawn)[0] - np.array(base.translation)) @ base.rotation
        found.append(drawn[((place >= low) & (place <= high)).all(axis=1)])
        if sum(map(len, found)) >= _IN_REGION:
            break
    inside = np.concatenate(found)[:_IN_REGION]
    corners = ", ".join(f"{name} {a * 1e3:g} to {b * 1e3:g}" for name, (a, b) in zip("xyz", box, strict=True))
    if not len(inside):
        raise InputError(
            "the flange does not reach this region",
            parameter="region",
            came=f"{corners} mm in the base frame",
            cure="Move it; 'truearm show' says where the flange is at joint positions.",
        )
    return _goal(inside, f"in the region {corners} mm")
