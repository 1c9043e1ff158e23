"""Tests of a robot by ISO 9283, planned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from truearm.engine.base.errors import InputError, Notice, Words, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.command.arguments import (
    choice_argument,
    choices_argument,
    command_argument,
    files_of,
    folder_beside,
    folder_for,
    length_argument,
    numbers_argument,
    python_call,
    robot_argument,
)
from truearm.engine.command.driving import constraints_argument, replaced_notices, tip_argument
from truearm.engine.motion.constraints import Constraints
from truearm.engine.motion.cube import PLANES
from truearm.engine.motion.largest_cube import DIRECTIONS, Direction
from truearm.engine.motion.touring import cell_notices
from truearm.engine.programs import PROGRAM_LANGUAGES
from truearm.engine.programs.new_program import LONGEST_WAIT
from truearm.engine.robot.library.wider_limits import wider_limits_notices
from truearm.engine.robot.robot import Robot
from truearm.iso9283.plan.choosing import performance_plan
from truearm.iso9283.plan.criteria import CRITERIA, TEST_OF, TESTS
from truearm.iso9283.plan.plan_file import PLAN, read_cube
from truearm.iso9283.plan.programs import refuse_losing_slow_run, refuse_stale, stated_cell, written_programs
from truearm.iso9283.plan.result import PLAN_FILES, Iso9283Plan

#: Every criterion at once; the largest cube.
ALL, AUTO = "all", "auto"
#: Rated velocities of robots along a path [m/s]: another one is in another unit.
_VELOCITIES: Final = (0.01, 20.0)
#: No test is run at so little of the rated velocity or load: such a number is a share, 0 to 1.
_LEAST_PERCENT: Final = 1.0
#: Rated velocity along a path where none is stated [m/s].
_ASSUMED_VELOCITY = 1.0


def iso9283_plan(
    robot: Robot | str | Path,
    *,
    criteria: Sequence[str] = (ALL,),
    cube: str | Path = AUTO,
    plane: str = "C1-C2-C7-C8",
    target: str | None = None,
    tip: Sequence[float] | None = None,
    load: float | None = None,
    velocity: float | None = None,
    velocities: Sequence[float] = (100.0, 50.0, 10.0),
    loads: Sequence[float] = (100.0,),
    limit_band: float = 0.1e-3,
    hours: float = 8.0,
    ahead: Direction = "+x",
    nearest: float = 0.0,
    floor: float = 0.0,
    constraints: Constraints | str | Path | None = None,
    clearance: float | None = None,
    program: str | None = None,
    dwell: float = 2.0,
    slow_run: str | Path | None = None,
    out: str | Path | None = None,
    command: str | None = None,
) -> Iso9283Plan:
    """Plan the tests of a robot's performance by ISO 9283.

    Parameters
    ----------
    robot
        The nominal robot, as the controller knows it, or what :func:`truearm.load_robot` takes.
    criteria
        Ids of criteria, in capitals or not (``ap``, ``rp``), or ``all``.
    cube
        ``auto`` for the largest that the robot can be tested in, by all criteria, or a file with one (schema
        ``truearm-cube/1``).
    plane
        Which of the cube's diagonal planes: ``C1-C2-C7-C8``, ``C2-C3-C8-C5``, ``C3-C4-C5-C6`` or ``C4-C1-C6-C7``.
    target
        Name of the target that is measured; None for the flange, or `tip`.
    tip
        What is measured, by its place in the flange frame [m].
    load
        Rated load [kg]; None for that of the robot file.
    velocity
        Rated velocity of the tip along a path, that 100 % stands for [m/s]; None for 1 m/s.
    velocities, loads
        What is tested, in percent of them, as in the files: 50, not 0.5. A load may be 0.
    limit_band
        Within which of the final pose the tip is said to stand [m].
    hours
        How long the drift is watched.
    ahead, nearest, floor
        Where the largest cube is searched, as for :func:`truearm.poses`.
    constraints
        What stands in the cell (boxes to keep out of, a floor), limits of joints and what else a configuration must
        keep, as for :func:`truearm.plan`, or its file. With these or a clearance all ways keep clear, or the plan is
        refused; the largest cube is then one in which they do.
    clearance
        Room to keep to floor, boxes and the arm's own links [m]; None for 50 mm.
    program
        Language of measuring programs: ``rapid``, ``krl``, ``fanuc``, ``urscript``, ``inform`` or ``val3``; None writes
        none.
    dwell
        How long the robot stands in them where it is measured [s].
    slow_run
        Record of the completed slow run (schema ``truearm-slow-run/1``); None writes programs at 10 % alone.
    out
        Folder for ``plan.yaml``, ``robot.yaml`` and ``sheet.html``; None writes nothing.
    command
        How to run it again, for the sheet; None writes the call in Python.

    Raises
    ------
    InputError
        If there is no such criterion, plane or target, the arm has fewer than six joints, or it cannot come to all
        poses and along all paths of the cube; for programs if it has more joints, is calibrated, or cannot make a
        move; if the slow run was of another plan, or is not completed.
    """
    tests = _tests(criteria)
    choice_argument(plane, "plane", dict.fromkeys(PLANES))
    choice_argument(ahead, "ahead", dict.fromkeys(DIRECTIONS))
    near, low = length_argument(nearest, "nearest"), length_argument(floor, "floor")
    band = _positive(limit_band, "limit_band", "the limit band is above 0", "a length above 0", "mm")
    watched = _positive(hours, "hours", "the drift is watched for a time above 0", "hours above 0")
    shares = _shares(velocities, "velocities", "velocity", may_be_zero=False)
    carried = _shares(loads, "loads", "load", may_be_zero=True)
    given_cube = None if isinstance(cube, str) and cube == AUTO else path_argument(cube, "cube")
    language = None if program is None else choice_argument(program, "program", PROGRAM_LANGUAGES)
    stands = _dwell(dwell)
    record = None if slow_run is None else path_argument(slow_run, "slow_run")
    if record is not None and language is None:
        raise InputError(
            "a slow run allows faster programs, and none are asked for",
            parameter="slow_run",
            cure="State `program`, or leave it out.",
        )
    given = (robot, given_cube, record, constraints)
    inputs = files_of(*given)
    folder = None if out is None else folder_beside(PLAN_FILES, PLAN, out, *given)
    rules = constraints_argument(constraints)
    call = command_argument(command) or python_call(
        "iso9283_plan",
        robot,
        criteria=list(criteria),
        cube=cube,
        plane=plane,
        target=target,
        tip=tip,
        load=load,
        velocity=velocity,
        velocities=list(velocities),
        loads=list(loads),
        limit_band=limit_band,
        hours=hours,
        ahead=ahead,
        nearest=nearest,
        floor=floor,
        constraints=constraints,
        clearance=clearance,
        program=program,
        dwell=dwell,
        slow_run=slow_run,
    )
    arm = robot_argument(robot)
    arm, target = tip_argument(arm, target, tip, "be measured")
    warnings = wider_limits_notices(arm)
    rated = _rated_load(arm, load, warnings)
    speed = _ASSUMED_VELOCITY
    if velocity is None:
        warnings.append(
            Notice(
                "rated-velocity-assumed",
                f"100 % is taken for {_ASSUMED_VELOCITY * 1e3:g} mm/s along a path. State the rated velocity of your "
                "robot with `velocity`.",
                "note",
            )
        )
    else:
        speed = _rated_velocity(velocity)
    where = str(constraints) if isinstance(constraints, str | Path) else "constraints"
    cell = stated_cell(arm, rules, where, clearance)
    with refusals_of("cube"):
        whole = None if given_cube is None else read_cube(given_cube)
    with refusals_of("cube" if whole is not None else "robot"):
        plan = performance_plan(
            arm if cell is None else cell.robot,
            target=target,
            tests=tests,
            cube=whole,
            plane=plane,
            rated_load=rated,
            rated_velocity=speed,
            velocities=shares,
            loads=carried,
            limit_band=band,
            hours=watched,
            ahead=ahead,
            nearest=near,
            floor=low,
            unclear=None if cell is None else cell.unclear,
            unsuited=None if cell is None else cell.unsuited,
        )
    kept = "" if cell is None else cell.words(plan)
    if cell is not None:
        warnings += cell_notices(cell.check)
    plan = replace(plan, robot=arm)
    programs = None
    if language is not None:
        programs = written_programs(plan, language, stands, record, warnings, cell_unknown=cell is None)
    found = Iso9283Plan(plan, call, tuple(warnings), inputs, programs, kept)
    if folder is not None:
        contents = found.contents()
        refuse_losing_slow_run(folder, record)
        if programs is not None:
            folder_for(tuple(contents), folder, *given, ours=True)
        refuse_stale(folder, tuple(contents), record)
        replaced = replaced_notices(folder, PLAN, contents[PLAN])
        found.save(folder)
        found = replace(found, warnings=(*found.warnings, *replaced))
    return found


def _tests(criteria: Sequence[str]) -> tuple[str, ...]:
    """Return the tests that criteria are measured in, in their usual order."""
    by_small = {name.lower(): name for name in (ALL, *CRITERIA)}
    if isinstance(criteria, Sequence) and not isinstance(criteria, str):
        criteria = [by_small.get(one.lower(), one) if isinstance(one, str) else one for one in criteria]
    wanted = choices_argument(criteria, "criteria", (ALL, *CRITERIA), "criterion")
    if not wanted:
        raise InputError("no criterion is given", parameter="criteria", allowed=", ".join((ALL, *CRITERIA)))
    tests = set(TESTS) if ALL in wanted else {TEST_OF[one] for one in wanted}
    return tuple(one for one in TESTS if one in tests)


def _rated_load(arm: Robot, load: object, warnings: list[Notice]) -> float:
    if load is not None:
        return _positive(load, "load", "the rated load is above 0", "a mass above 0 [kg]")
    if arm.rated_load is not None:
        return arm.rated_load
    raise InputError(
        "the robot file does not state the rated load",
        parameter="load",
        where=arm.name,
        allowed="a mass above 0 [kg]",
        cure="Give it as `load`, or state rated_load in the robot file.",
    )


def _rated_velocity(velocity: object) -> float:
    speed = _positive(velocity, "velocity", "the rated velocity is above 0", "a velocity above 0", "mm/s")
    least, most = _VELOCITIES
    if not least <= speed <= most:
        other = 1e3 if speed < least else 1e-3
        raise InputError(
            "no robot is rated for this velocity along a path",
            parameter="velocity",
            came=Words(f"{1e3 * speed:g} mm/s"),
            allowed=f"{1e3 * least:g} to {1e3 * most:g} mm/s",
            cure=f"Is it {1e3 * speed * other:g} mm/s? Check its unit." if least <= speed * other <= most else None,
        )
    return speed


def _positive(value: object, parameter: str, what: str, allowed: str, thousandths: str = "") -> float:
    """Return a number above 0; in the refusal it has the unit `thousandths`, of which 1000 make one."""
    (number,) = numbers_argument([value], parameter, 1, allowed)
    if number <= 0.0:
        shown = f"{1e3 * number:g} {thousandths}" if thousandths else f"{number:g}"
        raise InputError(what, parameter=parameter, came=Words(shown), allowed=allowed)
    return number


def _dwell(value: object) -> float:
    seconds = _positive(value, "dwell", "the robot stands for a time above 0", f"above 0, up to {LONGEST_WAIT:g} s")
    if seconds > LONGEST_WAIT:
        raise InputError(
            "controllers wait no longer at once",
            parameter="dwell",
            came=f"{seconds:g} s",
            allowed=f"up to {LONGEST_WAIT:g} s",
        )
    return seconds


def _shares(values: object, parameter: str, rated: str, *, may_be_zero: bool) -> tuple[float, ...]:
    """Return shares, 0 to 1, of percent of what is rated."""
    allowed = f"percent of the rated {rated}, {'0, or ' * may_be_zero}above {_LEAST_PERCENT:g} up to 100, one or more"
    count = len(values) if isinstance(values, Sequence) else 1
    percent = numbers_argument(values, parameter, count, allowed)
    if not percent:
        raise InputError(f"no {rated} is given", parameter=parameter, allowed=allowed)
    for value in percent:
        if may_be_zero and value == 0.0:
            continue
        if 0.0 < value <= _LEAST_PERCENT:
            raise InputError(
                "these are percent of the rated one, and this looks like a share",
                parameter=parameter,
                came=Words(f"{value:g} %"),
                allowed=allowed,
                cure=f"Give {100 * value:g}, not {value:g}.",
            )
        if not 0.0 < value <= 100.0:
            raise InputError(
                "these are percent of the rated one", parameter=parameter, came=Words(f"{value:g} %"), allowed=allowed
            )
    return tuple(dict.fromkeys(value / 100.0 for value in percent))
