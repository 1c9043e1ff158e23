"""Ways of the tip in tests by ISO 9283 as moves of the robot, with the joint positions at their ends.

A robot that goes evenly in all joints from one target to another stays within the limits if both targets lie there. A
straight move or an arc is followed by inverse kinematics: the arm must reach every point, and no joint may turn far
between two neighbouring points.

Programs command the controller's flange. Where the orientation is kept, flange and tip go the same way. Where it
changes, a straight move of the flange is no straight move of the tip, and the way is cut into short ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.inverse import inverse
from truearm.modeling.inverse.branches import BRANCHES, branch_rule
from truearm.modeling.inverse.closed_form import ClosedForm
from truearm.modeling.inverse.turns import beyond_limits, nearest_turns
from truearm.modeling.robot import Robot
from truearm.modeling.transform import rotation_vector
from truearm.planning.iso9283.planned import PlannedPath, PlannedPose
from truearm.planning.iso9283.way import TURNS, Way, weave_corners

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
        legs = tuple(Leg(one, pace=pace) for one in joints[1:])
        return Route(joints[0], legs, min(zone, _ZONE_SHARE * float(lengths.min())))

    def _turning(self, name: str, path: PlannedPath) -> Route:
        """Return the way along a path on which the orientation alternates."""
        way = Way(path, reoriented=True)
        if path.other is None:
            raise InputError("this path has one orientation, and another is needed", where=name)
        turned = float(np.linalg.norm(rotation_vector((path.other @ path.rotation.T)[None])[0]))
        flange, tip = (self.robot.forward(self._near, frame="controller", target=one)[0] for one in (None, self.target))
        lever = float(np.linalg.norm(tip - flange))
        count = max(1, math.ceil(turned * math.sqrt(lever / (8.0 * _BESIDE))))
        finer = max(1, math.ceil(way.length / (TURNS * count * _APART)))
        distance = np.linspace(0.0, way.length, TURNS * count * finer + 1)
        names = [f"{name}, move {max(1, math.ceil(k / finer))}" for k in range(len(distance))]
        joints = self._followed(names, way.position(distance), way.rotation(distance))[::finer]
        places = self.robot.forward(joints, frame="controller")[0]
        lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
        paces = lengths / (way.length / (TURNS * count))
        legs = tuple(Leg(one, pace=float(pace)) for one, pace in zip(joints[1:], paces, strict=True))
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
        found = inverse(self.robot, positions, rotations, target=self.target, seed=start, branch=branch)
        for row, status in enumerate(found.status):
            if not status.usable:
                raise InputError(
                    "the robot cannot go this way",
                    where=names[row],
                    came=status.value,
                    cure="Plan again, in a smaller cube or elsewhere.",
                )
        joints = found.joints.copy()
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
