"""Measuring programs of tests by ISO 9283 in a robot's language, and the record of their slow run."""

from __future__ import annotations

import datetime
import math
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from truearm.compensation.iso9283.programs import measuring_programs
from truearm.compensation.iso9283.slow_run import SLOW_RUN, check_slow_run, slow_run_text
from truearm.compensation.joint_counts import counts_notices, refuse_unknown_counts
from truearm.compensation.joint_speeds import speed_notices
from truearm.compensation.programs.motion_program import MotionProgram
from truearm.compensation.programs.program import Language
from truearm.compensation.programs.urscript.measuring import FASTEST
from truearm.errors import InputError, refusals_of
from truearm.files import exists, read_bytes
from truearm.jobs.driving import cell_argument
from truearm.manifest import hash_of, sets_in
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.planning.driving.collisions import CollisionCheck
from truearm.planning.iso9283.plan_file import plan_text
from truearm.planning.iso9283.planned import PerformancePlan
from truearm.results.iso9283_plan import WrittenPrograms
from truearm.writing import same_place

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
        found = measuring_programs(plan, dwell, hash_of(text.encode())[:_MARK], language.name)
        slow = _texts(found.slow, language)
        faster = {} if slow_run is None else _texts(found.faster, language)
    record = None
    if slow_run is None:
        record = slow_run_text(text, slow)
    else:
        with refusals_of("slow_run"):
            check_slow_run(slow_run, text, slow, datetime.date.today())
    robot = plan.robot
    if robot.maker and not language.runs_on(robot.maker):
        warnings.append(
            Notice("maker", f"{robot.name} is of {robot.maker}, and programs were written in {language.name}.")
        )
    warnings += [*counts_notices(robot), *_speed_notices(robot, language)]
    if cell_unknown:
        warnings += _near(plan.robot, found.ways)
    count = len(found.slow) + (0 if slow_run is None else len(found.faster))
    return WrittenPrograms(language.name, {**slow, **faster}, record, count, found.share)


def _speed_notices(robot: Robot, language: Language) -> list[Notice]:
    """Return what is to be said of the speed of joint motions."""
    found = []
    if language.name in _JOINT_SPEEDS:
        words = f"{language.name} says no share of the joints' speed: {_JOINT_SPEEDS[language.name]}."
        found.append(Notice("joint-speed-assumed", words, "note"))
    if language.name == "RAPID":
        return found
    assumed = "in the slow run joint motions are so slow that the tip keeps to 250 mm/s with the joints of fast arms"
    if language.name == "URScript":
        assumed = f"100 % is taken for {math.degrees(FASTEST):.0f} deg/s"
    return [*found, *speed_notices(robot, assumed)]


def _texts(programs: Sequence[MotionProgram], language: Language) -> dict[str, str]:
    assert language.motion is not None
    return {f"{_FOLDER}/{name}": text for one in programs for name, text in language.motion(one).items()}


def _near(robot: Robot, ways: Mapping[str, Array]) -> list[Notice]:
    """Return what is to be said of ways on which the arm comes near the floor or itself."""
    cell = cell_argument(robot, None, "")
    check = CollisionCheck(robot, cell)
    looked = {name: check.ways(joints[:-1], joints[1:]) for name, joints in ways.items() if len(joints) > 1}
    near = {name: at for name, at in looked.items() if at.room.min() < cell.clearance}
    if not near:
        return []
    worst = min(near, key=lambda name: float(near[name].room.min()))
    at = int(np.argmin(near[worst].room))
    room = max(float(near[worst].room[at]), 0.0)
    return [
        Notice(
            "ways-near",
            f"On {len(near)} of {len(looked)} ways the arm comes within {cell.clearance * 1e3:g} mm of the floor or of "
            f"itself, nearest on {worst}: {check.words(int(near[worst].worst[at]))}, {room * 1e3:.0f} mm. Look at "
            "these ways first, or state `constraints` or `clearance`: then they are kept clear.",
        )
    ]


def refuse_losing_slow_run(folder: Path, slow_run: Path | None) -> None:
    """Refuse a folder in which somebody has recorded a slow run, unless that is what was given."""
    path = folder / SLOW_RUN
    if slow_run is not None or not exists(path):
        return
    written = {one.files[SLOW_RUN] for one in sets_in(folder) if SLOW_RUN in one.files}
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
    written = [name for one in sets_in(folder) for name in one.files]
    for name in written:
        given = name == SLOW_RUN and slow_run is not None and same_place(folder / name, slow_run)
        theirs = name == SLOW_RUN or name.startswith(f"{_FOLDER}/")
        if theirs and not given and name not in names and exists(folder / name):
            raise InputError(
                "programs of another plan are there, and would stay beside this one",
                parameter="out",
                where=str(folder),
                came=name,
                cure="Choose another folder, or remove that plan with its programs.",
            )
