"""Measuring programs: every test of a plan as a program of its own at each velocity and load.

A program begins and ends in P1, slowly. Before each measured pose the robot stops, and stands for the dwell.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.compensation.fake_targets import nominal_robot
from truearm.compensation.iso9283.routes import Route, Routes
from truearm.compensation.joint_counts import counts_comments
from truearm.compensation.joint_speeds import first_share, joint_shares
from truearm.compensation.programs.motion_program import (
    LONGEST_COMMENT,
    CircleMove,
    JointMove,
    MotionProgram,
    ProgramStep,
    Remark,
    StraightMove,
    Wait,
)
from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.inverse.branches import branch_rule
from truearm.modeling.robot import Robot
from truearm.modeling.transform import homogeneous
from truearm.planning.iso9283.criteria import TESTS
from truearm.planning.iso9283.planned import PerformancePlan, PlannedPose, PlannedTest, visited
from truearm.simulated import IN_PROGRAMS

#: The first run: no more than this share of the rated velocity, and no faster than this along paths and in joint
#: motions [m/s].
_SLOW: Final = 0.1
_SLOW_SPEED: Final = 0.25
#: Controllers take no lower speed [m/s].
_SLOWEST: Final = 1e-4
_AXES: Final = 6
#: Programs have short names, as controllers take few characters.
_NAMES: Final = {"AT-reorientation": "REORI", "posing-time": "POSING", "compliance": "COMPL"}
#: Steps in which a force grows.
_FORCES: Final = 10


@dataclass(frozen=True)
class MeasuringPrograms:
    """Programs of all tests."""

    slow: tuple[MotionProgram, ...]  #: All tests at the velocity of the first run.
    faster: tuple[MotionProgram, ...]  #: Those at the velocities of the plan.
    share: float  #: Velocity of the first run, in that of the robot; that of single tests may be lower.
    #: Joint positions of the model on every way between stops, ``(n, joints)`` [rad or m], by its name: close to each
    #: other where the tip is led, two where the joints move evenly.
    ways: Mapping[str, Array]


def measuring_programs(plan: PerformancePlan, dwell: float, mark: str, language: str = "") -> MeasuringPrograms:
    """Return the programs of a plan.

    Args:
        plan: Of the robot that the controller knows.
        dwell: How long the robot stands where it is measured [s].
        mark: By which the plan is known, for a comment.
        language: Its name: languages say speeds of joint motions in different ways.

    Raises:
        InputError: If the robot is calibrated or has more than six joints, it is not known where its controller has its
            frames and a test has straight moves, a pose that the tests need is not in the plan, or a move cannot be
            made: with the move.
    """
    robot = plan.robot
    if len(robot.joints) != _AXES:
        raise InputError(
            "programs are written for arms of six joints",
            where=robot.name,
            came=f"{len(robot.joints)} joints",
            cure="Program the poses of plan.yaml by hand.",
        )
    if _is_calibrated(robot):
        raise InputError(
            "programs of tests command what the controller knows, and this robot is calibrated",
            where=robot.name,
            cure="Plan for the nominal robot, and correct its programs with the calibrated one.",
        )
    slow = min(_SLOW, _SLOW_SPEED / plan.rated_velocity)
    made = _Programs(plan, dwell, mark, slow, language)
    first: list[MotionProgram] = []
    faster: list[MotionProgram] = []
    for test in plan.tests:
        share = min(slow, _SLOW_SPEED / (plan.rated_velocity * made.pace(test)))
        first += made.of(test, share)
        if test.id != "compliance":
            faster += [one for other in test.velocities if abs(other - share) > 1e-9 for one in made.of(test, other)]
    return MeasuringPrograms(tuple(first), tuple(faster), slow, {**made.moves, **made.routes.driven})


def driven_ways(plan: PerformancePlan) -> Mapping[str, Array]:
    """Return the ways between the stops of all tests, as :attr:`MeasuringPrograms.ways` has them.

    Raises:
        InputError: If a move cannot be made: with the move.
    """
    # A second cycle begins where the first has ended; the others go the same ways.
    twice = replace(plan, tests=tuple(replace(test, cycles=min(2, test.cycles)) for test in plan.tests))
    made = _Programs(twice, 0.0, "", 1.0, "")
    for test in twice.tests:
        _Steps(made, test, 1.0).run()
    return {**made.moves, **made.routes.driven}


def _is_calibrated(robot: Robot) -> bool:
    try:
        nominal_robot(robot)
    except InputError:
        return False
    return True


class _Programs:
    """Programs of a plan; every way is followed once."""

    def __init__(self, plan: PerformancePlan, dwell: float, mark: str, slow: float, language: str) -> None:
        self.plan, self.dwell, self.mark, self.slow, self.language = plan, dwell, mark, slow, language
        self.routes = Routes(plan.robot, plan.target, self.pose("P1", "every program").joints)
        self.known: dict[tuple[str, str], Route] = {}
        self.moves: dict[str, Array] = {}
        self.shares: dict[tuple[bytes, float], float] = {}
        self.rule = branch_rule(plan.robot)

    def pose(self, name: str, test: str) -> PlannedPose:
        """Return a pose of the plan."""
        if name not in self.plan.poses:
            raise InputError("a pose is not in the plan", where=test, came=name, allowed=", ".join(self.plan.poses))
        return self.plan.poses[name]

    def route(self, test: str, place: str, found: Callable[[], Route]) -> Route:
        """Return a way, which is followed where it is first asked for."""
        if (test, place) not in self.known:
            self.known[test, place] = found()
        return self.known[test, place]

    def joint_share(self, ways: Array | None, share: float) -> float:
        """Return the share of a joint motion in the joints' speed; in the first run the tip keeps to its speed.

        Args:
            ways: Joint positions at both ends ``(2, joints)``; None from nobody knows where.
            share: Of the velocity.
        """
        robot, speed = self.plan.robot, _SLOW_SPEED if share <= self.slow else math.inf
        if ways is None:
            return first_share(robot, self.language, share, speed)
        key = ways.tobytes(), share
        if key not in self.shares:
            shown = robot.controller.from_model(ways)
            self.shares[key], _ = joint_shares(robot, self.language, ways, shown, share, speed)
        return self.shares[key]

    def along(self, test: PlannedTest, place: str) -> Route:
        """Return the way along a path of a test."""
        return self.route(test.id, place, lambda: self.routes.of(test.id, self.plan.paths[place]))

    def pace(self, test: PlannedTest) -> float:
        """Return the highest speed of flange or tip in a test, in that of the plan; 1 where it is that."""
        if TESTS[test.id].readings != "paths":
            return 1.0
        return max(1.0, *(leg.pace for place in test.places for leg in self.along(test, place).legs))

    def of(self, test: PlannedTest, share: float) -> list[MotionProgram]:
        """Return the programs of a test at a velocity: one for each load, which differ by their name alone."""
        steps = _Steps(self, test, share)
        steps.run()
        joints = np.array(steps.targets)
        robot = self.plan.robot
        poses = None
        if any(isinstance(step, StraightMove | CircleMove) for step in steps.steps):
            position, rotation = robot.forward(joints, frame="controller")
            poses = homogeneous(rotation, position)
        rule = self.rule
        branches = None if rule is None else tuple(rule.numbers(robot.forward_kinematics(joints)).tolist())
        shown = robot.controller.from_model(joints)
        sliding = tuple(joint.kind == "prismatic" for joint in robot.joints)
        name = f"{_NAMES.get(test.id, test.id.upper())}_{_percent(share)}"
        return [
            MotionProgram(
                name if len(test.loads) == 1 else f"{name}_L{_percent(load)}",
                robot.name,
                shown,
                sliding,
                poses,
                branches,
                self._notes(test, share, load),
                tuple(steps.steps),
            )
            for load in test.loads
        ]

    def _notes(self, test: PlannedTest, share: float, load: float) -> tuple[str, ...]:
        carried = "no load" if test.id == "compliance" else f"load {load * self.plan.rated_load:g} kg"
        return (
            *((IN_PROGRAMS,) if self.plan.robot.simulated else ()),
            f"ISO 9283 {test.id}",
            f"Robot {self.plan.robot.name}",
            f"{100 * share:g} % velocity, {carried}",
            f"Plan {self.mark}",
            *counts_comments(self.plan.robot),
            "Not verified, no safety function",
            "First run: step by step,",
            "at reduced speed, nobody near",
        )


class _Steps:
    """The steps of one program."""

    def __init__(self, programs: _Programs, test: PlannedTest, share: float) -> None:
        self.programs, self.test, self.share = programs, test, share
        self.speed = share * programs.plan.rated_velocity
        self.targets: list[Array] = []
        self.steps: list[ProgramStep] = []
        self._numbers: dict[bytes, int] = {}
        self._at: tuple[str, Array] | None = None

    def run(self) -> None:
        """Add all steps of the test, from P1 to P1."""
        home = self.programs.pose("P1", self.test.id)
        self._go(home.name, home.joints, self.programs.slow)
        self._measure()
        self._go(home.name, home.joints, self.programs.slow)

    def _measure(self) -> None:
        test = self.test
        if TESTS[test.id].readings == "paths":
            self._paths()
        elif test.id == "vAP":
            self._approaches()
        elif test.id == "compliance":
            self._pushes()
        else:
            self._visits(visited(test))

    def _target(self, joints: Array) -> int:
        key = np.round(joints, 12).tobytes()
        if key not in self._numbers:
            self._numbers[key] = len(self.targets)
            self.targets.append(joints)
        return self._numbers[key]

    def _go(self, name: str, joints: Array, share: float) -> None:
        self.programs.routes.check(f"{self.test.id}, {name}", joints)
        plan, ways = self.programs.plan, None
        if self._at is not None:
            left, start = self._at
            ways = np.array([start, joints])
            self.programs.moves.setdefault(f"{self.test.id}, from {left} to {name}", ways)
        self._at = name, joints
        self.steps.append(Remark(f"To {name}"[:LONGEST_COMMENT]))
        of_joints = self.programs.joint_share(ways, share)
        self.steps.append(JointMove(self._target(joints), of_joints, share * plan.rated_velocity))

    def _stand(self) -> None:
        self.steps.append(Wait(self.programs.dwell))

    def _cycle(self, number: int, what: str = "") -> None:
        self.steps.append(Remark(f"{what}cycle {number + 1} of {self.test.cycles}"))

    def _visits(self, names: Iterable[str]) -> None:
        poses = [self.programs.pose(name, self.test.id) for name in names]
        for cycle in range(self.test.cycles):
            self._cycle(cycle)
            for pose in poses:
                self._go(pose.name, pose.joints, self.share)
                self._stand()

    def _along(self, name: str, route: Route) -> None:
        before = self._target(route.start)
        for leg in route.legs:
            end, speed = self._target(leg.joints), max(self.speed * leg.pace, _SLOWEST)
            if leg.via is None:
                self.steps.append(StraightMove(end, speed, route.zone))
            else:
                self.steps.append(CircleMove(before, self._target(leg.via), end, speed, route.zone))
            before = end
        self._at = name, route.legs[-1].joints

    def _approaches(self) -> None:
        plan, routes = self.programs.plan, self.programs.routes
        for place in self.test.places:
            pose = self.programs.pose(place, self.test.id)
            for approach in self.test.approaches:
                start = plan.starts[place, approach]
                route = self.programs.route(
                    self.test.id,
                    start.name,
                    lambda start=start, pose=pose: routes.straight(  # type: ignore[misc]
                        f"vAP, {start.name}", start, pose.position
                    ),
                )
                for cycle in range(self.test.cycles):
                    self._cycle(cycle, f"{place} {approach}, ")
                    self._go(start.name, route.start, self.share)
                    self._stand()
                    self._along(place, route)
                    self._stand()

    def _paths(self) -> None:
        test = self.test
        for place in test.places:
            route = self.programs.along(test, place)
            for cycle in range(test.cycles):
                self._cycle(cycle, f"{place}, ")
                self._go(f"start of {place}", route.start, self.share)
                self._stand()
                self._along(f"the end of {place}", route)
                self._stand()

    def _pushes(self) -> None:
        for cycle in range(self.test.cycles):
            for direction in self.test.approaches:
                self._cycle(cycle, f"{direction}, ")
                for step in range(_FORCES + 1):
                    self.steps.append(Remark(f"{direction}: {step * 100 // _FORCES} % of the rated load"))
                    self._stand()


def _percent(share: float) -> str:
    return f"{100 * share:.4g}".replace(".", "p")
