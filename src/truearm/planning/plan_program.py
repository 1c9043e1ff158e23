"""The measuring program of a plan: its texts, and what to know of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from truearm.engine.base.errors import Notice, counted
from truearm.engine.base.units import IN_PROGRAMS, from_si
from truearm.engine.document.document import Block, detail, lines_of, say
from truearm.engine.document.records import notice_summaries
from truearm.engine.motion.tour import Stop, Tour
from truearm.engine.programs.joint_speeds import (
    counts_comments,
    fastest_point,
    first_shares,
    joint_rates,
    joint_shares,
    known_speeds,
    turned,
)
from truearm.engine.programs.new_program import (
    Carried,
    InputWait,
    JointMove,
    MotionProgram,
    Pause,
    ProgramStep,
    Remark,
    Wait,
    number,
)
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.kinematics import reach
from truearm.engine.robot.robot import Robot

# Joints go evenly, all at once, as the ways were checked, see :mod:`truearm.engine.programs.joint_speeds` for how fast.

#: Name of the program; every language takes it.
PROGRAM: Final = "MEASURE"
#: What stands before the label of a configuration in its comment.
MEASURED: Final = "Measure"
#: Labels of as many characters fit into every comment of every language.
LONGEST_LABEL: Final = 21
#: While it speeds up and slows down, a robot is slower than on average, by less than so long [s].
_RAMPS: Final = 0.5
#: Share, speed of the tip, time and angular velocity of a joint motion.
_Pace = tuple[float, float, float | None, float]


@dataclass(frozen=True)
class Driving:
    """How a program drives through a plan."""

    speed: float = 0.25  #: Of no target and of the flange is higher [m/s].
    share: float = 0.1  #: Of the fastest that the joints go, at most.
    dwell: float = 2.0  #: How long the robot stands in each configuration [s].
    #: What it waits for after that: nothing more (``time``), a digital ``input``, or the ``operator``.
    wait: Literal["time", "input", "operator"] = "time"
    input: str = ""  #: Number or name of the digital input.
    longest: float = 300.0  #: How long it is waited for [s].

    @property
    def words(self) -> str:
        """What it waits for, in words."""
        if self.wait == "input":
            return f"input {self.input}, {number(self.longest, 2)} s"
        return self.wait


def plan_program(tour: Tour, robot: Robot, language: str, driving: Driving, mark: str) -> tuple[MotionProgram, float]:
    """Return the program that drives a tour, and the highest speed of a target or the flange in it [m/s].

    That is higher than was asked for where a language has no share low enough for the fastest joints.

    Args:
        tour: Whose ways were checked.
        robot: With its targets and what it carries.
        language: Its name; languages say speeds in different ways.
        driving: How fast, and for what it waits.
        mark: By which the plan is known, for a comment.
    """
    shown = robot.controller.from_model(tour.joints)
    first, speed = _first_move(robot, language, driving)
    moves, fastest = [first], max(speed, driving.speed)
    for k in range(len(shown) - 1):
        move, speed = _move(robot, language, driving, tour.joints[k : k + 2], shown[k : k + 2])
        moves.append(move)
        fastest = max(fastest, speed)
    targets: list[Array] = []
    numbers: dict[bytes, int] = {}
    steps: list[ProgramStep] = []
    for stop, joints, move in zip(tour.stops, shown, moves, strict=True):
        key = joints.tobytes()
        if key not in numbers:
            numbers[key] = len(targets)
            targets.append(joints)
        steps += [Remark(_called(stop)), JointMove(numbers[key], *move)]
        if stop.kind == "measure":
            steps += _stand(str(stop.label), driving)
    carried = _carried(robot)
    program = MotionProgram(
        PROGRAM,
        robot.name,
        np.array(targets),
        tuple(joint.kind == "prismatic" for joint in robot.joints),
        None,
        None,
        _notes(robot, carried, driving, fastest, mark),
        tuple(steps),
        carried,
    )
    return program, fastest


def _called(stop: Stop) -> str:
    if stop.kind == "measure":
        return f"{MEASURED} {stop.label}"
    return {"home": "Home", "via": "On the way", "approach": "Approach"}[stop.kind]


def _stand(label: str, driving: Driving) -> list[ProgramStep]:
    stands: list[ProgramStep] = [Wait(driving.dwell)]
    if driving.wait == "input":
        stands.append(InputWait(driving.input, driving.longest, label))
    elif driving.wait == "operator":
        stands.append(Pause(label))
    return stands


def _first_move(robot: Robot, language: str, driving: Driving) -> tuple[_Pace, float]:
    """Return the pace of the move to the safe configuration, from nobody knows where, and the highest speed in it."""
    far = max(reach(robot, name) for name in (None, *(target.name for target in robot.targets)))
    slow, _ = joint_rates(robot)
    turning = min(driving.share * float(slow.min()), driving.speed / far)
    turning = math.radians(math.floor(100.0 * math.degrees(turning)) / 100.0)  # RAPID says two decimals
    shares, speed = first_shares(robot, language, driving.share, driving.speed)
    return (shares, driving.speed, None, turning), speed if language != "RAPID" else 0.0


def _move(robot: Robot, language: str, driving: Driving, joints: Array, shown: Array) -> tuple[_Pace, float]:
    """Return the pace of a move of all joints ``(2, joints)``, and the highest speed of a point of the arm [m/s].

    The angular velocity is of no meaning where the time is said.
    """
    slow, _ = joint_rates(robot)
    shares, speed = joint_shares(robot, language, joints, shown, driving.share, driving.speed)
    _, most = turned(joints, shown)
    along = fastest_point(robot, joints)
    seconds = max(float((most / slow).max()) / driving.share, along / driving.speed) + _RAMPS
    pace = (shares, driving.speed, math.ceil(100.0 * seconds) / 100.0, driving.share * float(slow.min()))
    return pace, speed if language != "RAPID" else 0.0


def shown_speed(speed: float) -> str:
    """Return a speed in mm/s, rounded up."""
    return number(math.ceil(1e4 * speed - 1e-6) / 10.0, 1)


def _carried(robot: Robot) -> Carried:
    """Return what the controller is told of the tool: its tip is the target that is farthest from the flange."""
    flange = robot.controller.flange
    places = {target.name: np.array(robot.tool_place(target.name).translation) for target in robot.targets}
    name = max(places, key=lambda target: float(np.linalg.norm(places[target])), default="")

    def of_controller(point: Array) -> tuple[float, float, float]:
        x, y, z = ((point - np.array(flange.translation)) @ flange.rotation).tolist()
        return x, y, z

    tip = of_controller(places[name]) if name else (0.0, 0.0, 0.0)
    return Carried(name, tip, robot.payload.mass, of_controller(np.array(robot.payload.cog)))


def _notes(robot: Robot, carried: Carried, driving: Driving, fastest: float, mark: str) -> tuple[str, ...]:
    def at(point: tuple[str, ...]) -> str:
        return "X {} Y {} Z {} mm".format(*point)

    return (
        *((IN_PROGRAMS,) if robot.simulated else ()),
        "Measuring program of a plan",
        f"Robot {robot.name}",
        f"Plan {mark}",
        f"Tip: target {carried.name} at" if carried.name else "Tip: the flange",
        at(carried.tip_mm),
        f"Load {number(carried.mass, 3)} kg at",
        at(carried.cog_mm),
        f"At most {shown_speed(fastest)} mm/s and {number(100 * driving.share, 2)} %",
        *_speed_comments(robot),
        f"Dwell {number(driving.dwell, 2)} s, wait: {driving.words}",
        *counts_comments(robot),
        "Not verified, no safety function",
        "First run: step by step,",
        "at reduced speed, nobody near",
        "Go to Home by hand before it",
    )


def _speed_comments(robot: Robot) -> tuple[str, ...]:
    """Return how fast joints go at 100 %, where that is known, in lines that every language takes."""
    speeds = known_speeds(robot)
    if speeds is None:
        return ()
    turning = all(joint.kind == "revolute" for joint in robot.joints)
    numbers = [
        f"{from_si(speed, 'deg' if joint.kind == 'revolute' else 'mm'):.0f}"
        for speed, joint in zip(speeds, robot.joints, strict=True)
    ]
    return (f"of the joints' {'deg/s' if turning else 'deg/s, mm/s'}:", " ".join(numbers))


#: What is written beside a program: the plan as CSV, its page, all stops, and what the operator takes along.
TABLE: Final = "plan.csv"
PLAN_PAGE: Final = "plan.html"
WAYS: Final = "plan-ways.csv"
SHEET: Final = "sheet.html"
#: Characters of a plan's hash by which program and sheet name it.
MARK: Final = 12
#: What the robot waits for, in words.
_WAITS: Final = {
    "time": "",
    "input": ", then for input {} up to {} s",
    "operator": ", then until the operator starts it again",
}
#: Where languages have the load that do not set it themselves.
_BY_HAND: Final = {"FANUC LS": "Payload schedule 1", "INFORM": "Tool file 0", "VAL3": "The tool flange"}


@dataclass(frozen=True, eq=False)
class PlanProgram:
    """A program that drives a plan."""

    language: str  #: Its name.
    files: Mapping[str, str]  #: Texts by their names in the folder of the plan.
    tour: Tour  #: What it drives.
    driving: Driving  #: How fast, and for what it waits.
    carried: Carried  #: What it tells the controller of the tool.
    fastest: float  #: Highest speed of a target or the flange [m/s].
    mark: str = ""  #: The first digits of the plan's hash, by which program and sheet name it.
    warnings: tuple[Notice, ...] = ()  #: What to know about it.
    speeds: str = ""  #: How fast the joints go at 100 %, in words; empty where it is not known.

    @property
    def answer(self) -> list[str]:
        """What it does, in words."""
        return lines_of(self.blocks())

    def blocks(self) -> Iterator[Block]:
        """Give what it does, what it waits for, and what the controller is told, in mm, s, kg and percent."""
        driving, carried = self.driving, self.carried
        approached = any(stop.kind == "approach" for stop in self.tour.stops)
        measured = self.tour.measured
        way = f"{counted(len(measured), 'configuration')} from Home and back"
        yield say(
            f"Measuring program in {self.language}: {way}{', each approached from one side' if approached else ''}.",
            language=self.language,
            files=list(self.files),
            order=[stop.label for stop in measured],
            approached=approached,
        )
        if approached:
            yield say(
                "In the data the column order counts these stops, too: 2, 4, 6 and so on. With configurations numbered "
                "1, 2, 3 every direction of approach would be wrong."
            )
        waits = _WAITS[driving.wait].format(driving.input, number(driving.longest, 2))
        share = 100.0 * driving.share
        yield detail(
            f"At most {shown_speed(self.fastest)} mm/s and {number(share, 2)} % of the joints' "
            f"speed{f' ({self.speeds})' if self.speeds else ''}; it stands for {number(driving.dwell, 2)} s{waits}.",
            speed_mm_s=1e3 * self.fastest,
            joint_speed_percent=share,
            joint_speeds=self.speeds or None,
            dwell_s=driving.dwell,
            wait=driving.words,
        )
        yield detail(
            self._load_words,
            tip=carried.name or None,
            tip_mm=[1e3 * v for v in carried.tip],
            load_kg=carried.mass,
            load_cog_mm=[1e3 * v for v in carried.cog],
        )
        yield say(
            "It is not verified and no safety function: run it step by step first, at reduced speed, nobody near.",
            warnings=notice_summaries(self.warnings),
        )

    @property
    def _load_words(self) -> str:
        """What the controller is told of the tool, or has to be told by hand."""
        carried = self.carried
        load = f"{number(carried.mass, 3)} kg at ({', '.join(carried.cog_mm)}) mm"
        if self.language in _BY_HAND:
            return f"{_BY_HAND[self.language]} on the controller must hold {load}: programs do not set it."
        tip = f"target {carried.name}" if carried.name else "the flange"
        return f"It tells the controller of {tip} at ({', '.join(carried.tip_mm)}) mm and of {load}."
