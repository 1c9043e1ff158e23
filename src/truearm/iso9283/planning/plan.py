"""Tests of a robot by ISO 9283, planned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from truearm.engine.base.errors import InputError, Rule, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.command.arguments import (
    files_of,
    folder_beside,
    folder_for,
    robot_argument,
)
from truearm.engine.command.driving import constraints_argument, replaced_notices, tip_argument
from truearm.engine.motion.touring import cell_notices
from truearm.engine.programs import PROGRAM_LANGUAGES
from truearm.engine.robot.library.wider_limits import wider_limits_notices
from truearm.engine.robot.robot import Robot
from truearm.iso9283.planning.choosing import performance_plan
from truearm.iso9283.planning.criteria import TEST_OF, TESTS
from truearm.iso9283.planning.plan_file import PLAN, read_cube
from truearm.iso9283.planning.programs import refuse_losing_slow_run, refuse_stale, stated_cell, written_programs
from truearm.iso9283.planning.result import PLAN_FILES, Iso9283Plan

if TYPE_CHECKING:
    from truearm.iso9283.jobs import PlanTests

#: Rated velocity along a path where none is stated [m/s].
_ASSUMED_VELOCITY = 1.0


RATED_VELOCITY_ASSUMED: Final = Rule(
    "rated-velocity-assumed",
    "note",
    "100 % was taken for 1000 mm/s along a path",
    cure="State the rated velocity of your robot with `velocity`.",
)


def planned(asked: PlanTests) -> Iso9283Plan:
    """Plan the tests, and write what they are done with."""
    given_cube = None if asked.cube == "auto" else path_argument(asked.cube, "cube")
    record = None if asked.slow_run is None else path_argument(asked.slow_run, "slow_run")
    inputs = (asked.robot, given_cube, record, asked.constraints)
    folder = None if asked.out is None else folder_beside(PLAN_FILES, PLAN, asked.out, *inputs)
    rules = constraints_argument(asked.constraints)
    arm, target = tip_argument(robot_argument(asked.robot), asked.target, asked.tip, "be measured")
    warnings = wider_limits_notices(arm)
    rated = _rated_load(arm, asked.load)
    if asked.velocity is None:
        warnings.append(RATED_VELOCITY_ASSUMED(f"100 % is taken for {_ASSUMED_VELOCITY * 1e3:g} mm/s along a path."))
    place = str(asked.constraints) if isinstance(asked.constraints, str | Path) else "constraints"
    cell = stated_cell(arm, rules, place, asked.clearance)
    with refusals_of("cube"):
        whole = None if given_cube is None else read_cube(given_cube)
    with refusals_of("cube" if whole is not None else "robot"):
        plan = performance_plan(
            arm if cell is None else cell.robot,
            target=target,
            tests=_tests(asked.criteria),
            cube=whole,
            plane=asked.plane,
            rated_load=rated,
            rated_velocity=asked.velocity or _ASSUMED_VELOCITY,
            velocities=_shares(asked.velocities),
            loads=_shares(asked.loads),
            limit_band=asked.limit_band,
            hours=asked.hours,
            ahead=asked.ahead,
            nearest=asked.nearest,
            floor=asked.lowest,
            unclear=None if cell is None else cell.unclear,
            unsuited=None if cell is None else cell.unsuited,
        )
    clear_of = "" if cell is None else cell.words(plan)
    if cell is not None:
        warnings += cell_notices(cell.check)
    plan = replace(plan, robot=arm)
    programs = None
    if asked.program is not None:
        language = PROGRAM_LANGUAGES[asked.program]
        programs = written_programs(
            plan, language, 2.0 if asked.dwell is None else asked.dwell, record, warnings, cell_unknown=cell is None
        )
    iso9283_plan = Iso9283Plan(plan, asked.again, tuple(warnings), files_of(*inputs), programs, clear_of)
    return iso9283_plan if folder is None else _written(iso9283_plan, folder, record, inputs)


def _written(plan: Iso9283Plan, folder: Path, record: Path | None, inputs: Sequence[object]) -> Iso9283Plan:
    """Write the plan, and return it with what is to be known about what it replaced."""
    contents = plan.contents()
    refuse_losing_slow_run(folder, record)
    if plan.programs is not None:
        folder_for(tuple(contents), folder, *inputs, ours=True)
    refuse_stale(folder, tuple(contents), record)
    replaced = replaced_notices(folder, PLAN, contents[PLAN])
    plan.save(folder)
    return replace(plan, warnings=(*plan.warnings, *replaced))


def _tests(criteria: Sequence[str]) -> tuple[str, ...]:
    """Return the tests that criteria are measured in, in their usual order."""
    tests = set(TESTS) if "all" in criteria else {TEST_OF[criterion] for criterion in criteria}
    return tuple(test for test in TESTS if test in tests)


def _rated_load(arm: Robot, load: float | None) -> float:
    if load is None and arm.rated_load is None:
        raise InputError(
            "the robot file does not state the rated load",
            parameter="load",
            where=arm.name,
            allowed="a mass above 0 [kg]",
            cure="Give it as `load`, or state rated_load in the robot file.",
        )
    return load or arm.rated_load or 0.0


def _shares(percent: Sequence[float]) -> tuple[float, ...]:
    """Return percent as shares, each once."""
    return tuple(dict.fromkeys(value / 100.0 for value in percent))
