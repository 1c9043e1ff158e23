"""Which configurations to measure for a calibration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from truearm.engine.base.errors import InputError, kind_of, refusals_of
from truearm.engine.base.files import exists, read_bytes
from truearm.engine.base.manifest import hash_of
from truearm.engine.command.arguments import (
    choice_argument,
    command_argument,
    configurations_argument,
    count_argument,
    deviation_argument,
    device_argument,
    file_for,
    files_of,
    folder_beside,
    gravity_argument,
    hashes_of,
    joints_argument,
    payload_argument,
    progress_argument,
    python_call,
    robot_argument,
    whole_argument,
)
from truearm.engine.command.driving import (
    cell_argument,
    constraints_argument,
    finder_argument,
    plan_files_for,
    refuse_ways_of_another,
    replaced_notices,
)
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.design import INDICES
from truearm.engine.fit.models import MODELS
from truearm.engine.motion.constraints import Constraints, on_principal_turn
from truearm.engine.motion.tour import sheet_beside, ways_beside
from truearm.engine.motion.touring import tour_of
from truearm.engine.programs.program_files import companions
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.parts import NO_PAYLOAD, Payload
from truearm.engine.robot.robot import Robot
from truearm.planning.accuracy import accuracy_goal
from truearm.planning.choosing import (
    ERROR,
    device_candidates,
    driven_candidates,
    plan_csv,
    plan_measurements,
    with_targets,
)
from truearm.planning.plan_program import PLAN_PAGE, SHEET, TABLE, WAYS
from truearm.planning.programs import load_notices, program_wanted, refuse_other_programs, targets_notices, with_program
from truearm.planning.result import PAGE, Plan

# The files that a plan is made from, by their hashes.


def plan_inputs(
    robot: object, candidates_from: object, constraints: object, accurate_at: object, tools: object, frames: object
) -> dict[str, str]:
    """Return the SHA-256 of each file that :func:`truearm.plan` is given, by its parameter, before they are read.

    Of a program in several files all count.

    Raises:
        InputError: If a file cannot be read; one that is not there has no hash.
    """
    found = hashes_of(
        robot=robot,
        candidates_from=candidates_from,
        constraints=constraints,
        accurate_at=accurate_at,
        tools=tools,
        frames=frames,
    )
    if isinstance(accurate_at, str | Path) and "accurate_at" in found:
        with refusals_of("accurate_at"):
            beside = [path for path in companions(Path(accurate_at)) if exists(path) and path.is_file()]
            if beside:
                parts = [found["accurate_at"], *(hash_of(read_bytes(path)) for path in sorted(beside))]
                found["accurate_at"] = hash_of("".join(parts).encode())
    return found


def plan(
    robot: Robot | str | Path,
    *,
    poses: int | Literal["auto"],
    out: str | Path | None = None,
    candidates_from: Dataset | str | Path | None = None,
    objective: str | None = None,
    accurate_at: Array | str | Path | None = None,
    region: Sequence[Sequence[float]] | None = None,
    tools: str | Path | None = None,
    frames: str | Path | None = None,
    model: str = "geometric",
    candidates: int = 5000,
    device: str | None = None,
    constraints: Constraints | str | Path | None = None,
    noise: float = 1e-4,
    seed: int = 0,
    payload: Payload | str | None = None,
    gravity: Sequence[float] | None = None,
    joints: JointsOf | None = None,
    floor: float | None = None,
    no_floor: bool = False,
    clearance: float | None = None,
    home: Sequence[float] | None = None,
    program: str | None = None,
    approach: bool = False,
    speed: Sequence[float] | None = None,
    dwell: float | None = None,
    wait: str | None = None,
    command: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Plan:
    """Choose the configurations that tell most, in measuring order, and say how accurate the result will be.

    Parameters
    ----------
    robot
        Nominal or calibrated, or what :func:`truearm.load_robot` takes. Derivatives are taken at its parameter values.
    poses
        How many configurations to choose; ``auto`` lets O1 decide.
    out
        CSV file to write, with a page, the ways and a sheet beside it; with a program a folder for all of them and the
        program. None writes nothing, see :meth:`Plan.save`.
    candidates_from
        Readings, a canonical CSV file, or the table of another plan, among whose configurations to choose; None draws
        them within the limits.
    objective
        ``O1`` to ``O5``, or ``error``: the mean square error where the robot shall be accurate. None is ``error`` if
        that was said, otherwise ``O1``.
    accurate_at
        Where the robot shall be accurate: a program, a CSV file of poses of the flange in the base frame as
        :func:`truearm.inverse` takes it, or joint positions of the model ``(n, joints)`` [rad or m].
    region
        The same as a box for the flange: lowest and highest x, y and z in the base frame [m].
    tools, frames
        Files that say where tools and frames of the program are, as for :func:`truearm.compensate`.
    model
        What will be identified, one of :data:`truearm.engine.fit.models.MODELS` by name.
    candidates
        How many configurations to draw, where none are given.
    device
        Name of the instrument, of ``truearm.devices()``, which finds configurations itself; None for one that reads
        every target everywhere. For inclinometers there is :func:`truearm.plan_inclinometers`.
    constraints
        What a configuration must keep besides the robot's limits, or a constraints file.
    noise
        Standard deviation of a coordinate about a well identified model [m].
    seed
        Of the random configurations and of the prediction.
    payload, gravity
        What the robot carries (an object, or a text such as ``2.7kg,50mm,25mm,100mm``) and free fall in its base frame
        [m/s^2].
    joints
        Whose joint positions the file holds: the ``model``'s, or as the ``controller`` shows them; None for the
        controller's where the robot file says that they differ.
    floor
        Height of the floor in the base frame [m], 0 or less; None for 0. Where the robot's gravity says that it does
        not stand, only 0 is taken: the surface on which it is mounted. With a clearance it is kept by all that moves,
        as are the boxes of the constraints and the arm's own links: in every configuration, and on the ways from the
        safe one to the first, on to each other and back. Configurations that are given were reached
        once: they are checked if one of these four, a program or boxes to keep out of are said, with joints that can
        turn further than once on the turn from -180 to 180 deg.
    no_floor
        Whether there is no floor and no mounting surface.
    clearance
        Room to keep [m]; None for 50 mm.
    home
        The safe configuration in which the arm starts and ends, by the model [rad; m for prismatic joints]; None to
        find one.
    program
        Language of a program that drives the plan: ``rapid``, ``krl``, ``fanuc``, ``urscript``, ``inform`` or ``val3``;
        None writes none.
    approach
        Whether every joint comes to each configuration from one side, by a stop a little before it.
    speed
        Of no target and of the flange it is higher [m/s], and the largest share of the joints' speed; None for
        (0.25, 0.1).
    dwell
        How long the robot stands in each configuration [s]; None for 2 s.
    wait
        What it waits for after that: nothing more (``time``), ``operator``, who starts the program again, or a digital
        input with the longest time (``input 3,300s``), after which the program pauses. None for ``time``.
    command
        How to run it again, for the page; None writes the call in Python.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        For anything that cannot be used, with a message that says what to do.
    """
    progress_argument(progress)
    read = (robot, candidates_from, constraints, accurate_at, tools, frames)
    wanted_program = program_wanted(program, approach, speed, dwell, wait)
    table = None if out is None else _files(out, *read) if wanted_program is None else _folder(out, *read)
    count = _count(poses)
    if objective is not None:
        choice_argument(objective, "objective", dict.fromkeys((*INDICES, ERROR)))
    wanted = choice_argument(model, "model", {m.name: m for m in MODELS})
    deviation = deviation_argument(noise, "noise")
    number = count_argument(candidates, "candidates")
    rng = np.random.default_rng(whole_argument(seed, "seed"))
    if device is not None and candidates_from is not None:
        raise InputError(
            "a device finds its own configurations to choose from",
            parameter="device, candidates_from",
            came=f"{device} and {_named(candidates_from)}",
            cure="Leave one of them out; `constraints` narrows the choice.",
        )
    instrument = None if device is None else device_argument(device)
    rules = constraints_argument(constraints)
    carried, fall = payload_argument(payload), gravity_argument(gravity)
    call = command_argument(command) or python_call(
        "plan",
        robot,
        poses=poses,
        candidates_from=candidates_from,
        objective=objective,
        accurate_at=accurate_at,
        region=region,
        tools=tools,
        frames=frames,
        model=model,
        candidates=candidates,
        device=device,
        constraints=constraints,
        noise=noise,
        seed=seed,
        payload=carried,
        gravity=fall,
        joints=joints,
        floor=floor,
        no_floor=no_floor,
        clearance=clearance,
        home=home,
        program=program,
        approach=approach,
        speed=speed,
        dwell=dwell,
        wait=wait,
    )
    hashes = plan_inputs(robot, candidates_from, constraints, accurate_at, tools, frames)
    progress("reading the robot")
    carrying = robot_argument(robot).with_payload(carried, fall)
    joints_are = joints_argument(joints, carrying)
    if wanted_program is not None:
        wanted_program.check(carrying, None if instrument is None else instrument.name)
    where = str(constraints) if isinstance(constraints, str | Path) else "constraints"
    cell = cell_argument(carrying, rules, where, floor, no_floor, clearance)
    # What was measured was reached: such configurations are checked where that is asked for.
    driven = candidates_from is None or wanted_program is not None or no_floor
    driven = driven or bool(cell.boxes) or any(given is not None for given in (floor, clearance, home))
    if table is not None and not driven:
        refuse_ways_of_another(ways_beside(table))
    labels, readings, own, finder, drawn = None, None, bool(carrying.targets), None, None
    if instrument is not None:
        seen, readings, choice = device_candidates(carrying, instrument, number, rng)
        own = True
    elif candidates_from is not None:
        data = configurations_argument(carrying, candidates_from, "candidates_from")
        if wanted_program is not None:
            wanted_program.check_readings(data)
        seen, choice, labels = with_targets(carrying, data), data.postures, data.labels
        own = own or bool(data.has_position.any())
    else:
        seen = with_targets(carrying)
    if driven:
        progress("looking where the arm keeps clear")
        finder = finder_argument(seen, rules, where, cell, home)
        if candidates_from is not None:
            choice = replace(choice, joints=on_principal_turn(seen, choice.joints))
        elif instrument is None:
            choice, drawn = driven_candidates(seen, number, rng, finder)
    progress("looking where the robot shall be accurate")
    goal = accuracy_goal(seen, accurate_at, region, tools, frames, np.random.default_rng(seed))
    made = plan_measurements(
        seen,
        choice,
        wanted,
        poses=count,
        rng=rng,
        objective=objective or ("O1" if goal is None else ERROR),
        accurate_at=None if goal is None else goal.postures,
        noise=deviation,
        labels=labels,
        constraints=rules,
        where=where,
        seen_from_the_origin=own,
        readings=readings,
        finder=finder,
        drawn=drawn,
        progress=progress,
    )
    if wanted_program is not None and not wanted_program.approach:
        made = replace(made, before=None)
    tour = None
    if finder is not None:
        progress("looking for ways that keep clear")
        tour = tour_of(finder, made.joints, made.labels, made.before)
    words = "" if goal is None else goal.words
    named = "" if instrument is None else instrument.name
    weighed = payload is not None or carrying.payload != NO_PAYLOAD
    told = load_notices(made.robot) if weighed else []
    if tour is not None and wanted_program is None:
        told += targets_notices(made.robot, carrying, named)
    planned = Plan(made, call, files_of(*read), deviation, joints_are, words, tour, told=tuple(told), hashes=hashes)
    if wanted_program is not None:
        planned = with_program(planned, wanted_program, carrying, named, weighed=weighed)
    if table is not None:
        if planned.program is not None:
            refuse_other_programs(table, planned.program.files, *read)
        progress("writing the files")
        there = (table.parent, table.name) if planned.program is None else (table, TABLE)
        replaced = replaced_notices(*there, plan_csv(planned.made, planned.joints_are))
        planned.save(table)
        planned = replace(planned, replaced=replaced)
    return planned


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


def _count(poses: object) -> int | None:
    if isinstance(poses, str):
        if poses == "auto":
            return None
        raise InputError(
            "a number of poses belongs here", parameter="poses", came=poses, allowed="a whole number, or auto"
        )
    return count_argument(poses, "poses")


def _named(data: object) -> str:
    return str(data) if isinstance(data, str | Path) else kind_of(data)
