"""Ways of the tip in tests by ISO 9283 as moves of the robot, and the record of the slow run."""

from __future__ import annotations

import datetime
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np
from pydantic import BaseModel

from truearm.engine.base.errors import InputError, Words
from truearm.engine.base.files import read_yaml
from truearm.engine.base.manifest import hash_of
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.branch_search import beyond_limits, nearest_turns
from truearm.engine.robot.inverse.branches import BRANCHES, ClosedForm, branch_rule
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.entries import STRICT
from truearm.engine.robot.transform import rotation_vector
from truearm.iso9283.planning.criteria import TURNS, PlannedPath, PlannedPose, Way, weave_corners

# Ways of the tip in tests by ISO 9283 as moves of the robot, with the joint positions at their ends.
#
# A robot that goes evenly in all joints from one target to another stays within the limits if both targets lie there. A
# straight move or an arc is followed by inverse kinematics: the arm must reach every point, and no joint may turn far
# between two neighbouring points.
#
# Programs command the controller's flange. Where the orientation is kept, flange and tip go the same way. Where it
# changes, a straight move of the flange is no straight move of the tip, and the way is cut into short ones.

#: Radius about a corner within which the robot may leave the way where it does not stop [m]; of a weave, in strokes.
ZONE: Final = 2e-3
_WEAVE_ZONE: Final = 0.05
#: A zone has this share of the shorter of its moves at the most.
_ZONE_SHARE: Final = 0.4
#: Tests in which a path is run without a stop at its corners.
_BLENDED: Final = ("CR", "AT-reorientation")
#: Points of a straight move that are followed lie no further apart [m].
_APART: Final = 0.01
_ON_ARC: Final = 16
#: No joint turns, or slides, further between two of them [rad or m].
_LARGEST_MOVE: Final = 0.35
#: How far the tip may leave its line where the orientation changes [m].
_BESIDE: Final = 1e-5


@dataclass(frozen=True, eq=False)
class Leg:
    """One move along a route."""

    joints: Array  #: At its end [rad or m], ``(joints,)``.
    via: Array | None = None  #: At the point that an arc passes; None for a straight move.
    pace: float = 1.0  #: Speed of the flange, in that of the path.


@dataclass(frozen=True, eq=False)
class Route:
    """Moves one after the other."""

    start: Array  #: Joint positions where it begins, ``(joints,)``.
    legs: tuple[Leg, ...]  #: Its moves.
    zone: float  #: How near the end of a move the next may begin [m]; 0 for stops.


class Routes:
    """Ways of a robot's tip that it can go.

    Args:
        robot: As the controller knows it.
        target: Name of what goes along them; None for the flange.
        near: Joint positions in whose posture they are followed, ``(joints,)``.

    Attributes:
        driven: Joint positions on every way that was followed, close to each other, ``(n, joints)``, by the name of the
            way.
    """

    def __init__(self, robot: Robot, target: str | None, near: Array) -> None:
        self.robot, self.target, self._near = robot, target, near
        self.driven: dict[str, Array] = {}
        rule = branch_rule(robot)
        self._rule = rule if rule is not None and ClosedForm(robot, target).known else None

    def check(self, name: str, joints: Array) -> None:
        """Refuse joint positions beyond a limit."""
        far = np.flatnonzero(beyond_limits(self.robot, joints))
        if len(far):
            raise InputError(
                "a joint would go beyond its limits",
                where=name,
                came=f"{self.robot.joints[int(far[0])].name}",
                cure="Plan again, in a smaller cube or elsewhere.",
            )

    def straight(self, name: str, start: PlannedPose, end: Array) -> Route:
        """Return the way from a pose of the tip to a position ``(3,)`` [m], with the orientation of the pose."""
        return self._lines(name, np.array([start.position, end]), start.rotation, 0.0, 1.0, start.joints)

    def of(self, test: str, path: PlannedPath) -> Route:
        """Return the way along a planned path in a test."""
        name = f"{test}, {path.name}"
        if test == "AT-reorientation":
            return self._turning(name, path)
        if path.kind == "circle":
            way = Way(path)
            distance = np.linspace(0.0, way.length, 4 * _ON_ARC + 1)
            joints = self._followed([name] * len(distance), way.position(distance), way.rotation(distance))[::_ON_ARC]
            radius = float(np.linalg.norm(path.points[1] - path.points[0]))
            return Route(joints[0], (Leg(joints[2], joints[1]), Leg(joints[4], joints[3])), min(ZONE, 0.1 * radius))
        if path.kind == "weave":
            corners, longer = weave_corners(path)
            return self._lines(name, corners, path.rotation, _WEAVE_ZONE * path.stroke, longer)
        return self._lines(name, path.points, path.rotation, ZONE if test in _BLENDED else 0.0, 1.0)

    def _lines(
        self, name: str, corners: Array, rotation: Array, zone: float, pace: float, near: Array | None = None
    ) -> Route:
        """Return straight moves from corner to corner ``(k, 3)``, with one orientation."""
        lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        pieces = np.maximum(2, np.ceil(lengths / _APART)).astype(int)
        marks = np.concatenate([[0], np.cumsum(pieces)])
        places = np.interp(np.arange(marks[-1] + 1), marks, np.arange(len(corners)))
        positions = np.column_stack([np.interp(places, np.arange(len(corners)), column) for column in corners.T])
        moves = np.maximum(1, np.ceil(places - 1e-9)).astype(int)
        names = [f"{name}, move {move}" for move in moves] if len(lengths) > 1 else [name] * len(places)
        turned = np.broadcast_to(rotation, (len(places), 3, 3))
        joints = self._followed(names, positions, turned, near)[marks]
        legs = tuple(Leg(joint, pace=pace) for joint in joints[1:])
        return Route(joints[0], legs, min(zone, _ZONE_SHARE * float(lengths.min())))

    def _turning(self, name: str, path: PlannedPath) -> Route:
        """Return the way along a path on which the orientation alternates."""
        way = Way(path, reoriented=True)
        if path.other is None:
            raise InputError("this path has one orientation, and another is needed", where=name)
        turned = float(np.linalg.norm(rotation_vector((path.other @ path.rotation.T)[None])[0]))
        flange, tip = (
            self.robot.forward(self._near, frame="controller", target=frame)[0] for frame in (None, self.target)
        )
        lever = float(np.linalg.norm(tip - flange))
        count = max(1, math.ceil(turned * math.sqrt(lever / (8.0 * _BESIDE))))
        finer = max(1, math.ceil(way.length / (TURNS * count * _APART)))
        distance = np.linspace(0.0, way.length, TURNS * count * finer + 1)
        names = [f"{name}, move {max(1, math.ceil(k / finer))}" for k in range(len(distance))]
        joints = self._followed(names, way.position(distance), way.rotation(distance))[::finer]
        places = self.robot.forward(joints, frame="controller")[0]
        lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
        paces = lengths / (way.length / (TURNS * count))
        legs = tuple(Leg(joint, pace=float(pace)) for joint, pace in zip(joints[1:], paces, strict=True))
        return Route(joints[0], legs, min(ZONE, _ZONE_SHARE * float(lengths.min())))

    def _followed(self, names: list[str], positions: Array, rotations: Array, near: Array | None = None) -> Array:
        """Return joint positions ``(n, joints)`` at points of a way, in the posture in which it begins.

        Where it cannot be gone, the move is refused.
        """
        near = self._near if near is None else near
        first = inverse(self.robot, positions[0], rotations[0], target=self.target, seed=near)
        start = first.joints[0]
        branch = None
        if self._rule is not None and first.status[0].usable:
            branch = BRANCHES[int(self._rule.numbers(self.robot.forward_kinematics(start[None]))[0])]
        joint_solutions = inverse(self.robot, positions, rotations, target=self.target, seed=start, branch=branch)
        for row, status in enumerate(joint_solutions.status):
            if not status.usable:
                raise InputError(
                    "the robot cannot go this way",
                    where=names[row],
                    came=status.value,
                    cure="Plan again, in a smaller cube or elsewhere.",
                )
        joints = joint_solutions.joints.copy()
        for row in range(1, len(joints)):
            joints[row] = nearest_turns(self.robot, joints[row : row + 1], joints[row - 1])[0]
        steps = np.abs(np.diff(joints, axis=0)).max(axis=1)
        far = np.flatnonzero(steps > _LARGEST_MOVE)
        if len(far):
            raise InputError(
                "the arm would have to change its posture on this way",
                where=names[int(far[0]) + 1],
                cure="Plan again, in a smaller cube or elsewhere.",
            )
        self.driven[names[0].partition(", move ")[0]] = joints
        return joints


SLOW_RUN: Final = "slow-run.yaml"
_SCHEMA: Final = "truearm-slow-run/1"


# The record of the slow run: programs at the full velocity are written only after the slow ones were run to their end.
#
# ::
#
#     truearm: truearm-slow-run/1
#     plan: 5d2f...
#     completed: no
#     by: ''
#     date: ''
#     programs:
#       programs/AP_10.mod: 8c1e...
#
# The operator fills in ``completed: yes``, who ran the programs, and the day on which they did (2026-11-23). Plan and
# programs are known by their hashes (SHA-256), so that a record is of this plan and these programs alone.
class SlowRunFile(BaseModel):
    """Schema ``truearm-slow-run/1``."""

    model_config = STRICT
    truearm: Literal["truearm-slow-run/1"]
    plan: str
    completed: Literal["yes", "no"]
    by: str
    date: datetime.datetime | datetime.date | str
    programs: dict[str, str]


def slow_run_text(plan: str, programs: Mapping[str, str]) -> str:
    """Return the record of a slow run that is still to be done.

    Args:
        plan: Text of the plan file.
        programs: Texts of the slow programs, by their names.
    """
    lines = [
        "# Run every program below at its velocity from its first motion to its last, with nobody in reach of the",
        "# robot. Then say so here: completed: yes, by: who, date: the day, as 2026-11-23.",
        f"truearm: {_SCHEMA}",
        f"plan: {hash_of(plan.encode())}",
        "completed: no",
        "by: ''",
        "date: ''",
        "programs:",
        *(f"  {name}: {hash_of(text.encode())}" for name, text in programs.items()),
    ]
    return "\n".join(lines) + "\n"


def check_slow_run(path: Path, plan: str, programs: Mapping[str, str], today: datetime.date) -> None:
    """Refuse a record that is not of a completed slow run of a plan and its programs.

    Args:
        path: The record.
        plan, programs: As for :func:`slow_run_text`.
        today: A run of a later day is not done yet; a day more is allowed, as dates differ around the world.

    Raises:
        InputError: If it is of another plan or of other programs, not completed, does not say by whom and when, or
            names a day that is no date or still to come.
    """
    record = read_yaml(path, SlowRunFile)
    if record.plan != hash_of(plan.encode()):
        raise InputError(
            "the slow run was of another plan",
            where=f"{path}, plan",
            came=record.plan[:12],
            allowed=hash_of(plan.encode())[:12],
            cure="Run the slow programs of this plan.",
        )
    wanted = {name: hash_of(text.encode()) for name, text in programs.items()}
    if record.programs != wanted:
        other = next(name for name in {**wanted, **record.programs} if wanted.get(name) != record.programs.get(name))
        raise InputError(
            "the slow run was of other programs",
            where=f"{path}, programs",
            came=other,
            cure="Plan with the same language and dwell, or run the slow programs again.",
        )
    if record.completed != "yes":
        raise InputError(
            "the slow run is not completed, so no faster programs are written",
            where=f"{path}, completed",
            came=record.completed,
            allowed="yes",
            cure="Run every slow program to its end, and say so.",
        )
    for name, value in (("by", record.by), ("date", str(record.date))):
        if not value.strip():
            raise InputError(
                "the record does not say by whom and when the slow run was done",
                where=f"{path}, {name}",
                cure="Fill it in.",
            )
    day = _day(record.date, f"{path}, date")
    if day > today + datetime.timedelta(days=1):
        raise InputError(
            "the day of the slow run is still to come",
            where=f"{path}, date",
            came=Words(day.isoformat()),
            allowed=f"{today.isoformat()}, or earlier",
            cure="State the day on which the slow programs were run to their end.",
        )


def _day(date: datetime.datetime | datetime.date | str, place: str) -> datetime.date:
    """Return the day that a record names."""
    if isinstance(date, datetime.datetime):
        return date.date()
    if isinstance(date, datetime.date):
        return date
    try:
        return datetime.date.fromisoformat(date.strip())
    except ValueError:
        raise InputError(
            "the day of the slow run is no date",
            where=place,
            came=date,
            allowed="year-month-day, such as 2026-11-23",
            cure="State the day on which the slow programs were run to their end.",
        ) from None
