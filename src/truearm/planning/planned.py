"""A plan of what to measure for a calibration: read, choose, find ways, write."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from truearm.engine.base.errors import InputError, refusals_of
from truearm.engine.base.files import exists, read_bytes
from truearm.engine.base.manifest import hash_of
from truearm.engine.command.arguments import (
    configurations_argument,
    device_argument,
    file_for,
    files_of,
    folder_beside,
    hashes_of,
    joints_argument,
    robot_argument,
)
from truearm.engine.command.driving import (
    cell_argument,
    constraints_argument,
    finder_argument,
    plan_files_for,
    refuse_ways_of_another,
    replaced_notices,
)
from truearm.engine.command.texts import positions_of
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.models import MODELS
from truearm.engine.motion.cell import Cell
from truearm.engine.motion.constraints import Constraints, on_principal_turn
from truearm.engine.motion.tour import sheet_beside, ways_beside
from truearm.engine.motion.touring import tour_of
from truearm.engine.programs.program_files import companions
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.parts import NO_PAYLOAD
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.planning.accuracy import accuracy_goal
from truearm.planning.choosing import (
    ERROR,
    MeasurementPlan,
    device_candidates,
    driven_candidates,
    plan_csv,
    plan_measurements,
    with_targets,
)
from truearm.planning.plan_program import PLAN_PAGE, SHEET, TABLE, WAYS
from truearm.planning.programs import (
    ProgramWanted,
    load_notices,
    program_wanted,
    refuse_other_programs,
    targets_notices,
    with_program,
)
from truearm.planning.result import PAGE, Plan

if TYPE_CHECKING:
    from truearm.engine.motion.ways import Drawn, WayFinder
    from truearm.engine.twin.devices.device import Device
    from truearm.planning.plan import PlanPoses


def plan_inputs(
    robot: object, candidates_from: object, constraints: object, accurate_at: object, tools: object, frames: object
) -> dict[str, str]:
    """Return the SHA-256 of each file that :func:`truearm.plan` is given, by its parameter, before they are read.

    Of a program in several files all count.

    Raises:
        InputError: If a file cannot be read; one that is not there has no hash.
    """
    hashes = hashes_of(
        robot=robot,
        candidates_from=candidates_from,
        constraints=constraints,
        accurate_at=accurate_at,
        tools=tools,
        frames=frames,
    )
    if isinstance(accurate_at, str | Path) and "accurate_at" in hashes:
        with refusals_of("accurate_at"):
            beside = [path for path in companions(Path(accurate_at)) if exists(path) and path.is_file()]
            if beside:
                parts = [hashes["accurate_at"], *(hash_of(read_bytes(path)) for path in sorted(beside))]
                hashes["accurate_at"] = hash_of("".join(parts).encode())
    return hashes


@dataclass(frozen=True, eq=False)
class _Read:
    inputs: tuple[object, ...]  #: What may be files, none of which is overwritten.
    hashes: dict[str, str]  #: Of these files, by their parameters.
    table: Path | None  #: Where to write; the folder of a plan with a program.
    wanted: ProgramWanted | None  #: The program.
    device: Device | None
    robot: Robot  #: With its loads.
    rules: Constraints | None
    where: str  #: The file that says them, for messages.
    cell: Cell
    joints_are: JointsOf
    driven: bool  #: Whether configurations and ways are checked.

    @property
    def named(self) -> str:
        """The instrument; empty for none."""
        return "" if self.device is None else self.device.name


@dataclass(frozen=True, eq=False)
class _Choice:
    """Among what is chosen."""

    robot: Robot  #: With the targets that are measured.
    among: Postures
    labels: tuple[str, ...] | None  #: Of configurations that were given.
    readings: Dataset | None  #: What the device reads.
    own: bool  #: Whether targets are the robot's own, or the device's.
    finder: WayFinder | None  #: None where nothing is checked.
    drawn: Drawn | None


def planned(asked: PlanPoses) -> Plan:
    """Choose the configurations, look for ways between them, and write the plan."""
    rng = np.random.default_rng(asked.seed)
    read = _read(asked)
    choice = _choice(asked, read, rng)
    asked.progress("looking where the robot shall be accurate")
    goal = accuracy_goal(
        choice.robot, asked.accurate_at, asked.region, asked.tools, asked.frames, np.random.default_rng(asked.seed)
    )
    chosen = plan_measurements(
        choice.robot,
        choice.among,
        {model.name: model for model in MODELS}[asked.model],
        poses=None if asked.poses == "auto" else asked.poses,
        rng=rng,
        objective=asked.objective or ("O1" if goal is None else ERROR),
        accurate_at=None if goal is None else goal.postures,
        noise=asked.noise,
        labels=choice.labels,
        constraints=read.rules,
        place=read.where,
        seen_from_the_origin=choice.own,
        readings=choice.readings,
        finder=choice.finder,
        drawn=choice.drawn,
        progress=asked.progress,
    )
    if read.wanted is not None and not read.wanted.approach:
        chosen = replace(chosen, before=None)
    plan = _driven(asked, read, choice, chosen, "" if goal is None else goal.words)
    return plan if read.table is None else _written(asked, read, read.table, plan)


def _read(asked: PlanPoses) -> _Read:
    """Read robot, cell and program, and find out whether ways are looked for."""
    inputs = (
        asked.robot,
        asked.candidates_from,
        asked.constraints,
        asked.accurate_at,
        asked.tools,
        asked.frames,
    )
    wanted = program_wanted(
        asked.program, approach=asked.approach, speed=asked.speed, dwell=asked.dwell, wait=asked.wait
    )
    table = None
    if asked.out is not None:
        table = _files(asked.out, *inputs) if wanted is None else _folder(asked.out, *inputs)
    device = None if asked.device is None else device_argument(asked.device)
    rules = constraints_argument(asked.constraints)
    hashes = plan_inputs(*inputs)
    asked.progress("reading the robot")
    robot = asked.loads.on(robot_argument(asked.robot))
    joints_are = joints_argument(asked.joints, robot)
    if wanted is not None:
        wanted.check(robot, asked.device)
    source = str(asked.constraints) if isinstance(asked.constraints, str | Path) else "constraints"
    cell = cell_argument(robot, rules, source, asked.floor, asked.no_floor, asked.clearance)
    # What was measured was reached: such configurations are checked where that is asked for.
    driven = asked.candidates_from is None or wanted is not None or asked.no_floor or bool(cell.boxes)
    driven = driven or any(option is not None for option in (asked.floor, asked.clearance, asked.home))
    if table is not None and not driven:
        refuse_ways_of_another(ways_beside(table))
    return _Read(inputs, hashes, table, wanted, device, robot, rules, source, cell, joints_are, driven)


def _choice(asked: PlanPoses, read: _Read, rng: np.random.Generator) -> _Choice:
    """Return among what is chosen: what was given, or is drawn."""
    labels, readings, own, finder, drawn = None, None, bool(read.robot.targets), None, None
    if read.device is not None:
        seen, readings, among = device_candidates(read.robot, read.device, asked.candidates, rng)
        own = True
    elif asked.candidates_from is not None:
        data = configurations_argument(read.robot, asked.candidates_from, "candidates_from")
        if read.wanted is not None:
            read.wanted.check_readings(data)
        seen, among, labels = with_targets(read.robot, data), data.postures, data.labels
        own = own or bool(data.has_position.any())
    else:
        seen = with_targets(read.robot)
    if read.driven:
        asked.progress("looking where the arm keeps clear")
        home = None if asked.home is None else positions_of(asked.home, read.robot, read.joints_are, "home")
        finder = finder_argument(seen, read.rules, read.where, read.cell, home)
        if asked.candidates_from is not None:
            among = replace(among, joints=on_principal_turn(seen, among.joints))
        elif read.device is None:
            among, drawn = driven_candidates(seen, asked.candidates, rng, finder)
    return _Choice(seen, among, labels, readings, own, finder, drawn)


def _driven(asked: PlanPoses, read: _Read, choice: _Choice, chosen: MeasurementPlan, words: str) -> Plan:
    """Return the plan with its ways, and with the program that drives it."""
    tour = None
    if choice.finder is not None:
        asked.progress("looking for ways that keep clear")
        tour = tour_of(choice.finder, chosen.joints, chosen.labels, chosen.before)
    weighed = asked.payload is not None or read.robot.payload != NO_PAYLOAD
    notices = load_notices(chosen.robot) if weighed else []
    if tour is not None and read.wanted is None:
        notices += targets_notices(chosen.robot, read.robot, read.named)
    plan = Plan(
        chosen,
        asked.again,
        files_of(*read.inputs),
        asked.noise,
        read.joints_are,
        words,
        tour,
        told=tuple(notices),
        hashes=read.hashes,
    )
    if read.wanted is None:
        return plan
    return with_program(plan, read.wanted, read.robot, read.named, weighed=weighed)


def _written(asked: PlanPoses, read: _Read, table: Path, plan: Plan) -> Plan:
    """Write the plan, and return it with what is to be known about what it replaced."""
    if plan.program is not None:
        refuse_other_programs(table, plan.program.files, *read.inputs)
    asked.progress("writing the files")
    location = (table.parent, table.name) if plan.program is None else (table, TABLE)
    replaced = replaced_notices(*location, plan_csv(plan.made, plan.joints_are))
    plan.save(table)
    return replace(plan, replaced=replaced)


def _files(out: object, *read: object) -> Path:
    """Return where the plan shall be written, with room for its page beside it."""
    table = file_for(out, *read)
    if table.suffix == PAGE:
        raise InputError("the plan is a CSV file", parameter="out", came=table.name, allowed="PLAN.csv")
    beside = (table.with_suffix(PAGE), ways_beside(table), sheet_beside(table))
    plan_files_for((table.name, *(file.name for file in beside)), table, *read)
    return table


def _folder(out: object, *read: object) -> Path:
    """Return the folder for a plan with its program."""
    if isinstance(out, str | Path) and Path(out).suffix.lower() in (".csv", PAGE):
        raise InputError(
            "a plan with a program needs a folder", parameter="out", came=str(out), cure="Name a folder, or no program."
        )
    return folder_beside((TABLE, PLAN_PAGE, WAYS, SHEET), TABLE, out, *read)
