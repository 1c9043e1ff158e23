"""The measuring program of a plan: what was asked for, checked before anything is computed, and the program."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, Literal

from truearm.engine.base.errors import InputError, Notice, Rule
from truearm.engine.base.manifest import hash_of, sets_in
from truearm.engine.base.units import as_number
from truearm.engine.command.arguments import folder_for, numbers_argument
from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.external_force import RATING_UNKNOWN
from truearm.engine.programs import PROGRAM_LANGUAGES
from truearm.engine.programs.joint_speeds import (
    counts_notices,
    joint_rates,
    known_speeds,
    refuse_unknown_counts,
    speed_notices,
    speed_words,
    stated_speeds,
)
from truearm.engine.programs.new_program import LONGEST_WAIT
from truearm.engine.programs.program import Language
from truearm.engine.programs.urscript.new import FASTEST
from truearm.engine.robot.library.wider_limits import wider_limits_notices
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import DEFAULT_TOOL
from truearm.planning.choosing import plan_csv
from truearm.planning.plan_program import (
    LONGEST_LABEL,
    MARK,
    PLAN_PAGE,
    SHEET,
    TABLE,
    WAYS,
    Driving,
    PlanProgram,
    plan_program,
    shown_speed,
)
from truearm.planning.result import Plan

#: A message names no more targets.
_MOST_NAMED: Final = 6


OVERLOAD: Final = Rule(
    "overload",
    "warning",
    "the flange carries more than the `rated_load` of the robot file",
    cure="Check the unit and the tool of `payload` before anything is driven.",
    gravity=2,
)


def load_notices(robot: Robot) -> list[Notice]:
    """Return what to know of a load above that for which the arm is rated, or of an arm whose rating is not known."""
    mass = robot.payload.mass
    if robot.rated_load is None:
        if mass <= 0.0:
            return []
        return [
            RATING_UNKNOWN(
                f"The flange carries {mass:g} kg, and the robot file does not say for how much {robot.name} is rated "
                "(rated_load): see that it may carry that."
            )
        ]
    if mass <= robot.rated_load:
        return []
    return [OVERLOAD(f"The flange carries {mass:g} kg, and {robot.name} is rated for {robot.rated_load:g} kg.")]


TOOL_ASSUMED: Final = Rule(
    "tool-assumed",
    ("note", "warning"),
    "nobody said what the flange carries, or which targets are measured: the program tells the controller of what "
    "the message names. Targets: those of the first of the robot file's `tools`; of a file of readings (`from`) "
    "where these have them; else three reflectors about 150 mm apart, as of no robot. Load: that of the same tool, "
    "else 0 kg; where the robot file has targets, always 0 kg. A wrong load can stop the robot or let it give way",
)


def targets_notices(robot: Robot, stated: Robot, device: str = "") -> list[Notice]:
    """Return what to know of targets that a plan without a program has assumed.

    Args:
        robot: With the targets.
        stated: The robot as the user has it.
        device: What measures, where that was said.
    """
    if stated.targets:
        return []
    return [
        TOOL_ASSUMED(
            "Nobody said the targets of the flange: what is measured, and kept clear, is assumed, "
            f"{_taken(robot, stated, device, weighed=True)}. State the targets in the robot file."
        )
    ]


def assumed_notices(robot: Robot, stated: Robot, device: str = "", *, weighed: bool) -> list[Notice]:
    """Return what to know of the load and the targets that a program has taken for those that nobody said.

    Args:
        robot: With the targets, and what it carries.
        stated: The robot as the user has it.
        device: What measures, where that was said.
        weighed: Whether the user said what it carries.
    """
    unsaid = [word for word, known in (("the load", weighed), ("the targets", bool(stated.targets))) if not known]
    if not unsaid:
        return []
    cures = ["A wrong load can stop the robot or let it give way: state `payload`."] if not weighed else []
    cures += [] if stated.targets else ["State the targets in the robot file."]
    return [
        TOOL_ASSUMED(
            f"Nobody said {' and '.join(unsaid)} of the flange: the program tells the controller of what is "
            f"assumed, {_taken(robot, stated, device, weighed=weighed)}. {' '.join(cures)}",
            "warning",
        )
    ]


def _taken(robot: Robot, stated: Robot, device: str, *, weighed: bool) -> str:
    """Say which load and targets a plan has taken for those that nobody said, and whence."""
    taken = [] if weighed else [f"{robot.payload.mass:g} kg at {_at(robot.payload.cog)} mm"]
    if stated.targets:
        return taken[0]
    places = {target.name: robot.tool_place(target.name).translation for target in robot.targets}
    name, tool = next(iter(stated.tools.items()), ("", DEFAULT_TOOL))
    taken += [f"target {target} at {_at(place)} mm" for target, place in [*places.items()][:_MOST_NAMED]]
    whence = f"the first tool of the robot file, {name}" if name else "three reflectors about 150 mm apart"
    if places != dict(tool.targets):
        whence = f"as of the device {device}" if device else "targets where the readings have them"
    return f"{', '.join(taken)}{', and others' if len(places) > _MOST_NAMED else ''} ({whence})"


def _at(point: tuple[float, float, float]) -> str:
    return f"({', '.join(f'{1e3 * v:.4g}' for v in point)})"


#: What the languages are called as arguments.
_NAMES: Final = ("rapid", "krl", "fanuc", "urscript", "inform", "val3")
#: Programs have no more axes.
_AXES: Final = 6
#: A speed that is higher by less is the same.
_CLOSE: Final = 1.0 + 1e-6
_BY_ROWS: Final = "Plan without it, and drive the rows of plan-ways.csv."
#: No lower and no higher speed of a tip is meant [m/s].
_SPEEDS: Final = (1e-3, 5.0)
_WAITS: Final = "time; input N or input N,SECONDSs; operator"
#: Input by its number, or by its name.
_INPUT: Final = re.compile(r"([0-9]{1,5}|[A-Za-z][A-Za-z0-9_]{0,31})")
#: Languages whose inputs have names.
_NAMED_INPUTS: Final = ("RAPID",)
#: Numbers of the digital inputs, where a language has them: standard ones of a UR, as many as KUKA has at most.
_INPUTS: Final = {"URScript": (0, 7), "KRL": (1, 8192)}
#: Devices that see the arm, or are fixed to it, while it is driven.
_SEEN: Final = (
    "tracker",
    "measurement-arm",
    "optical-cmm-planar",
    "optical-cmm-spatial",
    "markers",
    "strings",
    "stereo",
    "five-lasers",
)
#: What labels may be made of in every language's comments and messages.
_LABEL: Final = re.compile(r"[A-Za-z0-9_.+-]([A-Za-z0-9 _.+-]*[A-Za-z0-9_.+-])?")


@dataclass(frozen=True)
class ProgramWanted:
    """A measuring program that was asked for."""

    name: str  #: What the language is called as an argument.
    language: Language  #: In which it is written.
    driving: Driving  #: How fast it goes, and for what it waits.
    approach: bool  #: Whether every joint comes to each configuration from one side.

    def check(self, robot: Robot, device: str | None = None) -> None:
        """Refuse a robot that this language's programs cannot drive, and a device to which it is not driven.

        Raises:
            InputError: If the maker's controllers do not speak it, the arm has more than six joints, its controller is
                known to count them otherwise and the robot file does not say how, or the device is touched.
        """
        if robot.maker and not self.language.runs_on(robot.maker):
            known = [name for name in _NAMES if PROGRAM_LANGUAGES[name].runs_on(robot.maker)]
            raise InputError(
                f"the controllers of {robot.maker} do not speak {self.language.name}",
                parameter="program",
                where=robot.name,
                came=self.name,
                allowed=", ".join(known) or "none of the languages that programs are written in",
                cure=f"Take `program={known[0]}`." if known else _BY_ROWS,
            )
        if len(robot.joints) > _AXES:
            raise InputError(
                "programs are written for arms of up to six joints",
                parameter="program",
                where=robot.name,
                came=f"{len(robot.joints)} joints",
                cure=_BY_ROWS,
            )
        refuse_unknown_counts(robot, self.language.name)
        if device is not None and device not in _SEEN:
            raise InputError(
                "an arm is brought to what it touches by hand, not by a program",
                parameter="program, device",
                came=device,
                allowed=", ".join(_SEEN),
                cure="Plan without a program.",
            )

    def check_readings(self, data: Dataset) -> None:
        """Refuse configurations at which something was touched."""
        if data.fixtures:
            raise InputError(
                "the arm may touch what these readings are against, and is brought there by hand",
                parameter="program, candidates_from",
                where=data.source,
                came=", ".join(data.fixtures),
                cure="Plan without a program.",
            )

    def check_labels(self, labels: Sequence[str]) -> None:
        """Refuse labels that comments of a program cannot have."""
        for label in labels:
            if len(label) > LONGEST_LABEL or not _LABEL.fullmatch(label):
                raise InputError(
                    "a configuration cannot be called so in a program",
                    parameter="candidates_from",
                    came=label,
                    allowed=f"up to {LONGEST_LABEL} letters, digits, blanks and _ . + -",
                    cure="Rename it in the file.",
                )


def program_wanted(
    program: str | None, *, approach: bool, speed: Any, dwell: float | None, wait: str | None
) -> ProgramWanted | None:
    """Return the program that was asked for; None for none.

    Raises:
        InputError: If the speed or the wait is none that it can have.
    """
    if program is None:
        return None
    language = PROGRAM_LANGUAGES[program]
    fast, share = _speed(speed)
    kind, signal, longest = _wait(wait, language)
    driving = Driving(fast, share, Driving().dwell if dwell is None else dwell, kind, signal, longest)
    return ProgramWanted(program, language, driving, approach)


FASTER_THAN_ASKED: Final = Rule(
    "faster-than-asked",
    "warning",
    "`krl` and `fanuc` say shares in whole percent, rounded down, and at 1 % the fastest arms go faster than "
    "`speed`; so may their first move (that of an LR Mate 251.6 mm/s instead of 250). Less than 1 % cannot be "
    "said, and a share is one of the joints' speed however short the way, so that parts of a move are no slower; the "
    "override of the pendant makes it slower. Head and sheet have that speed",
    cure="Set the override of the controller lower, or state a higher `speed`.",
)


def with_program(planned: Plan, wanted: ProgramWanted, stated: Robot, device: str = "", *, weighed: bool) -> Plan:
    """Return a plan with the program that drives it.

    Args:
        planned: Whose ways were checked; its robot has targets and what it carries, maybe assumed.
        wanted: What was asked for.
        stated: The robot as the user has it.
        device: What measures, where that was said.
        weighed: Whether the user said what it carries.
    """
    language, robot, tour = wanted.language, planned.made.robot, planned.tour
    assert tour is not None
    wanted.check_labels([str(stop.label) for stop in tour.measured])
    mark = hash_of(plan_csv(planned.made, planned.joints_are).encode())[:MARK]
    program, fastest = plan_program(tour, robot, language.name, wanted.driving, mark)
    assert language.motion is not None
    assert program.carried is not None
    notices = [*_notices(language, robot, stated, device, weighed=weighed), *tour.notices]
    speeds = known_speeds(robot)
    if fastest > _CLOSE * wanted.driving.speed:
        notices.insert(
            0,
            FASTER_THAN_ASKED(
                f"{language.name} says no share below 1 %: {'' if speeds else 'where joints are as fast as any, '}"
                f"a target goes at up to {shown_speed(fastest)} mm/s."
            ),
        )
    texts = dict(language.motion(program))
    written = PlanProgram(
        language.name,
        texts,
        tour,
        wanted.driving,
        program.carried,
        fastest,
        mark,
        tuple(notices),
        speed_words(speeds, robot) if speeds else "",
    )
    return replace(planned, program=written)


def refuse_other_programs(folder: Path, names: Collection[str], *read: object) -> None:
    """Refuse a folder with programs that are not of this plan: they would be lost, or stay beside it.

    Args:
        folder: In which the plan is written.
        names: Of the files of its program.
        read: What the job was given.
    """
    folder_for(names, folder, *read, ours=True)
    for file_set in sets_in(folder):
        others = [name for name in file_set.files if name not in (TABLE, PLAN_PAGE, WAYS, SHEET, *names)]
        if TABLE in file_set.files and others:
            raise InputError(
                "the program of another plan is there, and would stay beside this one",
                parameter="out",
                where=str(folder),
                came=others[0],
                cure="Choose another folder, or remove that plan.",
            )


def _speed(value: Any) -> tuple[float, float]:
    usual = Driving()
    if value is None:
        return usual.speed, usual.share
    allowed = "the speed of the tip, and with it a share of the joints' speed"
    single = not isinstance(value, Sequence) or isinstance(value, str)
    values = [value] if single else list(value)
    if len(values) not in (1, 2):
        raise InputError("one or two numbers belong here", parameter="speed", came=len(values), allowed=allowed)
    speed, *shares = numbers_argument(values, "speed", len(values), allowed)
    low, high = _SPEEDS
    if not low <= speed <= high:
        raise InputError(
            "no tip goes so slowly or so fast when it is measured",
            parameter="speed",
            came=f"{1e3 * speed:g} mm/s",
            allowed=f"{1e3 * low:g} to {1e3 * high:g} mm/s",
        )
    share = shares[0] if shares else usual.share
    if not 0.01 <= share <= 1.0:
        raise InputError(
            "this is no share of the joints' speed", parameter="speed", came=f"{100 * share:g} %", allowed="1 to 100 %"
        )
    return speed, share


def _wait(value: str | None, language: Language) -> tuple[Literal["time", "input", "operator"], str, float]:
    longest = Driving().longest
    if value is None or value == "time":
        return "time", "", longest
    if value == "operator":
        return "operator", "", longest
    if not value.startswith("input "):
        raise InputError("there is no such wait", parameter="wait", came=value, allowed=_WAITS)
    name, comma, time = (part.strip() for part in value.removeprefix("input ").partition(","))
    if not _INPUT.fullmatch(name):
        raise InputError("this is no digital input", parameter="wait", came=value, allowed=_WAITS)
    if not name.isdigit() and language.name not in _NAMED_INPUTS:
        raise InputError(
            f"digital inputs have numbers in {language.name}", parameter="wait", came=name, allowed="input 3"
        )
    if name.isdigit() and language.name in _INPUTS:
        low, high = _INPUTS[language.name]
        if not low <= int(name) <= high:
            raise InputError(
                f"{language.name} has no such digital input",
                parameter="wait",
                came=name,
                allowed=f"input {low} to input {high}",
            )
    if comma:
        seconds = as_number(time.removesuffix("s").strip()) if time.endswith("s") else None
        if seconds is None:
            raise InputError("this is no time", parameter="wait", came=time, allowed="input 3,300s")
        longest = seconds
        if not 0.0 < longest <= LONGEST_WAIT:
            allowed = f"above 0, up to {LONGEST_WAIT:g} s"
            raise InputError("an input is waited for a while", parameter="wait", came=time, allowed=allowed)
    return "input", name, longest


def _notices(language: Language, robot: Robot, stated: Robot, device: str, *, weighed: bool) -> list[Notice]:
    notices = [*load_notices(robot), *counts_notices(robot)]
    notices += wider_limits_notices(robot)
    notices += assumed_notices(robot, stated, device, weighed=weighed)
    return [*notices, *speed_notices(robot, "" if known_speeds(robot) else _assumed(language, robot))]


def _assumed(language: Language, robot: Robot) -> str:
    """Say what was taken for the joints' speed where it is not known."""
    slow, fast = joint_rates(robot)
    unknown = [speed is None for speed in stated_speeds(robot)]
    if language.name == "URScript":
        words = f"100 % is taken for {math.degrees(FASTEST):.0f} deg/s"
    elif language.name == "RAPID":
        slowest = math.degrees(slow[unknown].min())
        words = f"moves take so long that joints of {slowest:.0f} deg/s and more keep to the share"
    else:
        rates = [fast[unknown][0], fast[unknown][-1]]
        highest = " and ".join(dict.fromkeys(f"{math.degrees(rate):.0f}" for rate in rates))
        words = f"shares are so low that the tip keeps to its speed with joints of up to {highest} deg/s"
    return (
        f"{words}. It may go more slowly than it could; `speed` makes it faster, and so may max_speed of each joint in "
        "the robot file"
    )
