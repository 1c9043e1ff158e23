"""What the hexapod device finds: the tool's cups from lengths, how well they are known, and the base fixture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from truearm.engine.base.errors import InputError, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.base.writing import same_place
from truearm.engine.command.arguments import array_argument, choice_argument, file_for, files_of, robot_argument
from truearm.engine.data.hexapod import (
    DEVICE,
    Device,
    assemblies,
    designs,
    distinct,
    near_equal,
    poses,
    side_names,
    tool_cups,
    triangle,
)
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.hexapod.places import all_solutions, cup_monte_carlo, world_frame
from truearm.hexapod.reachable import with_cups
from truearm.hexapod.results import HexapodFrame, HexapodPoses, HexapodSolution, HexapodUncertainty, SolvedPose
from truearm.hexapod.sheet import Sheet, together
from truearm.hexapod.sheet_reading import read_sheet, read_touches

if TYPE_CHECKING:
    from truearm.hexapod.jobs import FindFixture, KnowCups, SolveCups


def enumerated() -> HexapodPoses:
    """Count designs, assemblies and poses of the device, and list the poses that teach much the same."""
    hexapod_poses = poses()
    return HexapodPoses(
        len(designs()), len(list(assemblies())), hexapod_poses, distinct(hexapod_poses), near_equal(hexapod_poses)
    )


def known(asked: KnowCups) -> HexapodUncertainty:
    """Say how well the tool's cups are known."""
    rng = np.random.default_rng(asked.seed)
    solutions = all_solutions()
    drawn = tuple(cup_monte_carlo(number, asked.trials, rng) for number in solutions)
    return HexapodUncertainty(tuple(solutions.values()), drawn)


def solved(asked: SolveCups) -> HexapodSolution:
    """Find the tool's cups of one pose, or of sheets, and write those as measurements."""
    device = replace(DEVICE, reach=asked.reach)
    if asked.legs is not None:
        return HexapodSolution((_one_pose(asked, device),), (), None)
    sheets = _sheets_argument(asked.sheet)
    inputs = files_of(*sheets)
    path = None if asked.out is None else file_for(asked.out, *inputs)
    with refusals_of("sheet"):
        whole = together(
            [item if isinstance(item, Sheet) else read_sheet(path_argument(item, "sheet"), device) for item in sheets]
        )
    hexapod_solution = _of_sheet(whole, inputs, with_data=path is not None)
    if path is not None:
        hexapod_solution.save(path)
    return hexapod_solution


def _of_sheet(whole: Sheet, inputs: tuple[Path, ...], *, with_data: bool) -> HexapodSolution:
    """Return the cups of a sheet, as measurements too if it can be or if that is asked for."""
    measured, cups = whole.measured.tolist(), whole.cups()
    with refusals_of("sheet"):
        data = whole.dataset() if with_data or (whole.configurations is not None and measured) else None
    solved_poses = tuple(
        SolvedPose(
            whole.labels[row],
            whole.designs[row],
            whole.solutions[row],
            cups[row],
            place=whole.places[row] if whole.places else "",
            side=whole.sides[row],
        )
        for row in measured
    )
    left_out = tuple(label for row, label in enumerate(whole.labels) if row not in measured)
    return HexapodSolution(solved_poses, left_out, data, inputs, whole.attached())


def _sheets_argument(sheet: object) -> tuple[object, ...]:
    if isinstance(sheet, Sheet | str | Path) or not isinstance(sheet, Sequence):
        return (sheet,)
    if not sheet:
        raise InputError("there is no sheet", parameter="sheet", allowed="one or more")
    files = [file.absolute() for file in files_of(*sheet)]
    twice = [file for number, file in enumerate(files) if any(same_place(file, other) for other in files[:number])]
    if twice:
        raise InputError("the sheet is given twice", parameter="sheet", came=str(twice[0]), cure="Give it once.")
    return tuple(sheet)


def _one_pose(asked: SolveCups, device: Device) -> SolvedPose:
    """Return the cups at one pose of nominal or measured sides."""
    chosen = poses()[(asked.pose or 1) - 1]
    lengths = np.array(asked.legs)
    for names, values, nominal, parameter in (
        (chosen.design.leg_names, lengths.tolist(), device.leg, "legs"),
        (side_names("B"), asked.base_sides, device.base, "base_sides"),
        (side_names("T"), asked.tool_sides, device.tool, "tool_sides"),
    ):
        with refusals_of(parameter):
            for name, value in zip(names, values, strict=True):
                device.check(nominal, value, name, None)
    with refusals_of("base_sides"):
        triangle(asked.base_sides, "B")
    with refusals_of("legs"):
        cups = tool_cups(chosen.design, chosen.solution, asked.base_sides, asked.tool_sides, lengths)
    return SolvedPose("", chosen.design, chosen.solution, cups)


def fixture_found(asked: FindFixture) -> HexapodFrame:
    """Find the base fixture from the joint positions at its cups and the distances between them."""
    device, sides = replace(DEVICE, reach=asked.reach), np.array(asked.base_sides)
    with refusals_of("base_sides"):
        for name, side in zip(side_names("B"), sides.tolist(), strict=True):
            device.check(device.base, side, name, None)
    loaded = robot_argument(asked.robot)
    with refusals_of("tool"):
        arm, _ = with_cups(loaded, asked.tool)
    joints = _touches_argument(asked.touches, arm)
    cups = {target.name: target.name for target in arm.targets}
    cup = arm.targets[0].name if asked.cup is None else choice_argument(asked.cup, "cup", cups)
    position, _ = arm.world_poses(joints, cup)
    stand = arm.base
    points = (position - np.array(stand.translation)) @ stand.rotation
    with refusals_of("touches"):
        return HexapodFrame(world_frame(points, sides), loaded.simulated_from)


def _touches_argument(touches: object, robot: Robot) -> Array:
    if isinstance(touches, str | Path):
        with refusals_of("touches"):
            return read_touches(path_argument(touches, "touches"), robot)
    allowed = f"joint positions at B1, B2 and B3, or a CSV file: shape (3, {len(robot.joints)})"
    return array_argument(touches, "touches", (3, len(robot.joints)), allowed)
