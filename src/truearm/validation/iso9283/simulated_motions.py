"""Simulated tests by ISO 9283 in motion: the way to a pose, and paths.

A path is followed once for each velocity and load; from cycle to cycle the joints are a little elsewhere.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.transform import homogeneous
from truearm.planning.iso9283.planned import PlannedTest
from truearm.simulation.moving.arm import Motion
from truearm.simulation.moving.interpolator import Pace, joint_move
from truearm.validation.iso9283.controller_commands import path_commands, zone_of
from truearm.validation.iso9283.simulated_cell import Cell, conditions

#: The controller commands so often [s].
_STEP: Final = 1e-3
#: Each so many commands a correction is computed, and evenly changed between.
_CORRECTED: Final = 10
#: A joint that is commanded further in a millisecond has changed its posture [rad or m].
_JUMP: Final = 0.1
#: It is read before and behind a path, and behind a move that is watched [s].
_BEFORE: Final = 0.3
_BEHIND: Final = 0.5
_WATCHED: Final = 1.0


def run_settling(cell: Cell, test: PlannedTest) -> None:
    """Watch how the tip comes to rest: at a pose, or at others to which it goes from there."""
    for load, velocity in conditions(test):
        place = test.places[0]
        ways = [(cell.other(place), place)] if test.id == "t" else [(place, end) for end in test.approaches]
        for start, end in ways:
            motion = _move(cell, start, end, velocity, load, whole=test.id == "posing-time")
            for cycle in range(1, test.cycles + 1):
                cell.note(cell.settling, test.id, end, cycle, velocity, load, motion)


def _move(cell: Cell, start: str, end: str, velocity: float, load: float, *, whole: bool) -> Motion:
    fast, change = cell.drives.velocity * velocity, cell.drives.acceleration
    command = joint_move(cell.joints(start, load), cell.joints(end, load), fast, change, _STEP)
    arrived = _STEP * (len(command) - 1)
    # Of a long way its end is watched; how long the move takes is told by the whole of it.
    watched = cell.times(arrived + _WATCHED, _BEFORE)
    time = watched if whole else watched[watched >= arrived - _WATCHED]
    return cell.arm(0, load).in_motion(command, _STEP, time, cell.now + cell.ahead)


def run_paths(cell: Cell, test: PlannedTest) -> None:
    """Run each path, once for all cycles at a velocity and a load."""
    for load, velocity in conditions(test):
        for place in test.places:
            cell.say(f"{test.id}, {place} at {velocity:.0%} of the velocity")
            motion = _path_motion(cell, test, place, velocity, load)
            for cycle in range(1, test.cycles + 1):
                cell.note(cell.paths, test.id, place, cycle, velocity, load, motion)


def _path_motion(cell: Cell, test: PlannedTest, place: str, velocity: float, load: float) -> Motion:
    path = cell.plan.paths.get(place)
    if path is None:
        raise InputError(
            "the plan has no such path", parameter="plan", came=place, allowed=", ".join(cell.plan.paths) or None
        )
    reoriented, zone = test.id == "AT-reorientation", zone_of(test.id, path)
    key = (place, reoriented, zone, velocity, load)
    if key not in cell.motions:
        pace = Pace(velocity * cell.plan.rated_velocity, zone=zone)
        commands = path_commands(path, pace, _STEP, reoriented=reoriented)
        arm = cell.arm(0, load)
        frames = homogeneous(commands.rotation, commands.position)
        near = min(cell.plan.poses.values(), key=lambda p: float(np.linalg.norm(p.position - frames[0, :3, 3])))
        joints = arm.joints_for(frames, near.joints)
        if len(joints) > 1 and np.abs(np.diff(joints, axis=0)).max() > _JUMP:
            raise InputError(
                "the robot cannot run a path of the plan without changing its posture",
                parameter="plan",
                came=place,
                cure="Plan in another cube, or with another orientation.",
            )
        if cell.corrected is not None:
            joints = joints + _correction(cell, frames, joints, load)
        time = cell.times(commands.time[-1] + _BEHIND, _BEFORE)
        cell.motions[key] = arm.in_motion(joints, _STEP, time, cell.now + cell.ahead)
    return cell.motions[key]


def _correction(cell: Cell, frames: Array, joints: Array, load: float) -> Array:
    """Return what a correction adds to joint positions along a path, ``(n, joints)``."""
    assert cell.corrected is not None
    rows = np.unique(np.append(np.arange(0, len(frames), _CORRECTED), len(frames) - 1))
    added = cell.corrected(load * cell.plan.rated_load, frames[rows], joints[rows]) - joints[rows]
    every = np.arange(len(frames))
    return np.stack([np.interp(every, rows, column) for column in added.T], axis=1)
