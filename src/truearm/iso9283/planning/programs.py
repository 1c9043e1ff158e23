"""Measuring programs of tests by ISO 9283 in a robot's language, and the record of their slow run."""

from __future__ import annotations

import datetime
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, counted, refusals_of
from truearm.engine.base.files import exists, read_bytes
from truearm.engine.base.manifest import hash_of, sets_in
from truearm.engine.base.units import IN_PROGRAMS
from truearm.engine.base.writing import same_place
from truearm.engine.command.driving import cell_argument
from truearm.engine.command.split import MAKER
from truearm.engine.motion.cell import Cell
from truearm.engine.motion.collisions import CollisionCheck
from truearm.engine.motion.constraints import Constraints, allowed, joint_window, limits_of, refuse_clearance_of
from truearm.engine.motion.tour import distance_words
from truearm.engine.motion.touring import nearest_on
from truearm.engine.programs.fake_targets import nominal_robot
from truearm.engine.programs.joint_speeds import (
    JOINT_SPEED_ASSUMED,
    counts_comments,
    counts_notices,
    first_share,
    joint_shares,
    refuse_unknown_counts,
    speed_notices,
)
from truearm.engine.programs.new_program import (
    LONGEST_COMMENT,
    CircleMove,
    JointMove,
    MotionProgram,
    ProgramStep,
    Remark,
    StraightMove,
    Wait,
)
from truearm.engine.programs.program import Language
from truearm.engine.programs.urscript.new import FASTEST
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.branches import branch_rule
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import homogeneous
from truearm.iso9283.planning.criteria import TESTS, PerformancePlan, PlannedPose, PlannedTest, visited
from truearm.iso9283.planning.plan_file import plan_text
from truearm.iso9283.planning.result import WrittenPrograms
from truearm.iso9283.planning.routes import SLOW_RUN, Route, Routes, check_slow_run, slow_run_text

# A program begins and ends in P1, slowly. Before each measured pose the robot stops, and stands for the dwell.

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
    programs = _Programs(plan, dwell, mark, slow, language)
    first: list[MotionProgram] = []
    faster: list[MotionProgram] = []
    for test in plan.tests:
        share = min(slow, _SLOW_SPEED / (plan.rated_velocity * programs.pace(test)))
        first += programs.of(test, share)
        if test.id != "compliance":
            faster += [
                program
                for other in test.velocities
                if abs(other - share) > 1e-9
                for program in programs.of(test, other)
            ]
    return MeasuringPrograms(tuple(first), tuple(faster), slow, {**programs.moves, **programs.routes.driven})


def driven_ways(plan: PerformancePlan) -> Mapping[str, Array]:
    """Return the ways between the stops of all tests, as :attr:`MeasuringPrograms.ways` has them.

    Raises:
        InputError: If a move cannot be made: with the move.
    """
    # A second cycle begins where the first has ended; the others go the same ways.
    twice = replace(plan, tests=tuple(replace(test, cycles=min(2, test.cycles)) for test in plan.tests))
    programs = _Programs(twice, 0.0, "", 1.0, "")
    for test in twice.tests:
        _Steps(programs, test, 1.0).run()
    return {**programs.moves, **programs.routes.driven}


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

    def route(self, test: str, place: str, follow: Callable[[], Route]) -> Route:
        """Return a way, which is followed where it is first asked for."""
        if (test, place) not in self.known:
            self.known[test, place] = follow()
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

    def _cycle(self, number: int, prefix: str = "") -> None:
        self.steps.append(Remark(f"{prefix}cycle {number + 1} of {self.test.cycles}"))

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


#: A message names no more ways.
_MOST_NAMED: Final = 3


@dataclass(frozen=True, eq=False)
class StatedCell:
    """A cell in which tests are driven."""

    robot: Robot  #: With its target, within the limits of the constraints.
    cell: Cell  #: Floor, boxes, and the room to keep.
    check: CollisionCheck  #: Of that room.
    #: rules, where: what else holds at every pose and on every path, and the file that says so.
    rules: Constraints | None
    where: str

    def unclear(self, joints: Array) -> str:
        """Return what is not kept at joint positions ``(n, joints)``, in words; nothing if all is."""
        own = bool(self.robot.targets)
        fulfilled = allowed(self.robot, Postures(joints), self.rules, self.where, seen_from_the_origin=own)
        broken = [name for name, rows in fulfilled.items() if not rows.all()]
        if broken:
            return f"{', '.join(broken)} of the constraints"
        distances = self.check.distances(joints)
        if not distances.size or distances.min() >= self.check.need:
            return ""
        return self._near(int(np.unravel_index(int(np.argmin(distances)), distances.shape)[0]), float(distances.min()))

    def unsuited(self, plan: PerformancePlan) -> str:
        """Return which ways of a plan cannot be driven, in words; nothing if all can."""
        try:
            ways = driven_ways(plan)
        except InputError as error:
            return f"{error.what} ({error.where})"
        near = {}
        for name, joints in ways.items():
            looked = self.check.ways(joints[:-1], joints[1:])
            if len(looked.distance) and looked.distance.min() < self.cell.clearance:
                at = int(np.argmin(looked.distance))
                near[name] = (float(looked.distance[at]), int(looked.worst[at]))
        if not near:
            return ""
        worst = sorted(near, key=lambda name: near[name][0])
        distance, number = near[worst[0]]
        named = "; ".join(worst[:_MOST_NAMED]) + ("; and others" if len(near) > _MOST_NAMED else "")
        return (
            f"{len(near)} of {counted(len(ways), 'way')} are not clear ({named}; nearest "
            f"{self._near(number, distance)})"
        )

    def words(self, plan: PerformancePlan) -> str:
        """Say what all ways of a plan keep, that is suited."""
        distances: dict[str, float] = {}
        ways = driven_ways(plan).values()
        for joints in ways:
            for pair, distance in nearest_on(self.check, joints).items():
                distances[pair] = min(distance, distances.get(pair, math.inf))
        nearest_first = dict(sorted(distances.items(), key=lambda item: item[1]))
        near = distance_words(nearest_first, self.cell.floor, self.cell.surface, self.check.connected)
        return f"On all {counted(len(ways), 'way')} the arm stays {near}." if near else ""

    def _near(self, number: int, distance: float) -> str:
        return f"{self.check.words(number)}, {max(distance, 0.0) * 1e3:.0f} mm"


def stated_cell(robot: Robot, rules: Constraints | None, place: str, clearance: float | None) -> StatedCell | None:
    """Return the cell that was stated; None if none was.

    Args:
        robot: With the target that is measured.
        rules, place: Constraints as for plans of measurements, and the file that says so.
        clearance: Room to keep [m]; None for 50 mm.

    Raises:
        InputError: If a box holds the base, limits leave a joint nothing, or a length cannot be.
    """
    if rules is None and clearance is None:
        return None
    cell = cell_argument(robot, rules, place, None, False, clearance)
    joint_window(robot, rules, place)  # refuses limits that leave nothing
    refuse_clearance_of(robot, rules, place)
    low, high = limits_of(robot, rules, place)
    joints = tuple(
        joint if not np.isfinite([a, b]).all() else replace(joint, limits=(float(a), float(b)))
        for joint, a, b in zip(robot.joints, low, high, strict=True)
    )
    arm = replace(robot, joints=joints)
    return StatedCell(arm, cell, CollisionCheck(arm, cell), rules, place)


#: Where programs are, in the folder of the plan.
_FOLDER: Final = "programs"
#: Characters of the plan's hash by which programs name it.
_MARK: Final = 12
#: What stands for the share of the joints' speed in languages that do not say it.
_JOINT_SPEEDS: Final = {
    "RAPID": "joint motions have the share of the rated velocity, of the tip",
    "URScript": "the leading joint goes so fast that one joint has the share. Accelerations are URScript's own, "
    "1.4 rad/s^2 and 1.2 m/s^2: on a short line the robot may not come to the velocity; state the acceleration a in "
    "the program where it shall",
}


def written_programs(
    plan: PerformancePlan,
    language: Language,
    dwell: float,
    slow_run: Path | None,
    warnings: list[Notice],
    *,
    cell_unknown: bool = True,
) -> WrittenPrograms:
    """Return the programs of a plan as texts: the slow ones, and the faster ones where the slow run is recorded.

    What is to be said of them is added to `warnings`; of ways near floor and links only where the cell is unknown.
    """
    refuse_unknown_counts(plan.robot, language.name)
    text = plan_text(plan)
    with refusals_of("program"):
        programs = measuring_programs(plan, dwell, hash_of(text.encode())[:_MARK], language.name)
        slow = _texts(programs.slow, language)
        faster = {} if slow_run is None else _texts(programs.faster, language)
    record = None
    if slow_run is None:
        record = slow_run_text(text, slow)
    else:
        with refusals_of("slow_run"):
            check_slow_run(slow_run, text, slow, datetime.date.today())
    robot = plan.robot
    if robot.maker and not language.runs_on(robot.maker):
        warnings.append(MAKER(f"{robot.name} is of {robot.maker}, and programs were written in {language.name}."))
    warnings += [*counts_notices(robot), *_speed_notices(robot, language)]
    if cell_unknown:
        warnings += _near(plan.robot, programs.ways)
    count = len(programs.slow) + (0 if slow_run is None else len(programs.faster))
    return WrittenPrograms(language.name, {**slow, **faster}, record, count, programs.share)


def _speed_notices(robot: Robot, language: Language) -> list[Notice]:
    """Return what is to be said of the speed of joint motions."""
    notices = []
    if language.name in _JOINT_SPEEDS:
        words = f"{language.name} says no share of the joints' speed: {_JOINT_SPEEDS[language.name]}."
        notices.append(JOINT_SPEED_ASSUMED(words))
    if language.name == "RAPID":
        return notices
    assumed = "in the slow run joint motions are so slow that the tip keeps to 250 mm/s with the joints of fast arms"
    if language.name == "URScript":
        assumed = f"100 % is taken for {math.degrees(FASTEST):.0f} deg/s"
    return [*notices, *speed_notices(robot, assumed)]


def _texts(programs: Sequence[MotionProgram], language: Language) -> dict[str, str]:
    assert language.motion is not None
    return {f"{_FOLDER}/{name}": text for program in programs for name, text in language.motion(program).items()}


WAYS_NEAR: Final = Rule(
    "ways-near",
    "warning",
    "on some ways of the measuring programs the arm comes within 50 mm of a floor at the height of its base, or of "
    "its own links; the message names the nearest",
    cure="Look at these ways first, or state `constraints` or `clearance`: then they are kept clear.",
)


def _near(robot: Robot, ways: Mapping[str, Array]) -> list[Notice]:
    """Return what is to be said of ways on which the arm comes near the floor or itself."""
    cell = cell_argument(robot, None, "")
    check = CollisionCheck(robot, cell)
    looked = {name: check.ways(joints[:-1], joints[1:]) for name, joints in ways.items() if len(joints) > 1}
    near = {name: at for name, at in looked.items() if at.distance.min() < cell.clearance}
    if not near:
        return []
    worst = min(near, key=lambda name: float(near[name].distance.min()))
    at = int(np.argmin(near[worst].distance))
    distance = max(float(near[worst].distance[at]), 0.0)
    return [
        WAYS_NEAR(
            f"On {len(near)} of {len(looked)} ways the arm comes within {cell.clearance * 1e3:g} mm of the floor or of "
            f"itself, nearest on {worst}: {check.words(int(near[worst].worst[at]))}, {distance * 1e3:.0f} mm."
        )
    ]


def refuse_losing_slow_run(folder: Path, slow_run: Path | None) -> None:
    """Refuse a folder in which somebody has recorded a slow run, unless that is what was given."""
    path = folder / SLOW_RUN
    if slow_run is not None or not exists(path):
        return
    written = {file_set.files[SLOW_RUN] for file_set in sets_in(folder) if SLOW_RUN in file_set.files}
    if hash_of(read_bytes(path)) not in written:
        raise InputError(
            "somebody has filled in this record of a slow run, and it would be lost",
            parameter="out",
            where=str(path),
            cure="Give it as `slow_run`, or choose another folder.",
        )


def refuse_stale(folder: Path, names: Collection[str], slow_run: Path | None) -> None:
    """Refuse a folder with programs or a record of another plan, that would stay beside this one.

    Args:
        names: Of the files that are written.
        slow_run: The record that was given: it may be there.
    """
    written = [name for file_set in sets_in(folder) for name in file_set.files]
    for name in written:
        is_slow_run = name == SLOW_RUN and slow_run is not None and same_place(folder / name, slow_run)
        theirs = name == SLOW_RUN or name.startswith(f"{_FOLDER}/")
        if theirs and not is_slow_run and name not in names and exists(folder / name):
            raise InputError(
                "programs of another plan are there, and would stay beside this one",
                parameter="out",
                where=str(folder),
                came=name,
                cure="Choose another folder, or remove that plan with its programs.",
            )
