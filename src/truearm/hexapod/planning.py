"""Which configurations can be measured with the hexapod device: the plan, its sheet and its steps."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from truearm.engine.base.errors import InputError, refusals_of
from truearm.engine.base.writing import same_place, write_files
from truearm.engine.command.arguments import (
    array_argument,
    file_for,
    joints_argument,
    lengths_argument,
    robot_argument,
)
from truearm.engine.data.hexapod import distinct, poses
from truearm.engine.data.readers.rows import QUATERNION_TOLERANCE, unit_quaternions
from truearm.engine.robot.transform import Transform
from truearm.hexapod.reachable import attached_anew, reachable_at_places, with_cups
from truearm.hexapod.results import HexapodPlan

if TYPE_CHECKING:
    from truearm.hexapod.jobs import PlanHexapod


def planned(asked: PlanHexapod) -> HexapodPlan:
    """Plan which configurations can be measured, and write the sheet and the steps that are asked for."""
    sheet, steps = _files(asked)
    loaded = robot_argument(asked.robot)
    joints_are = joints_argument(asked.joints, loaded)
    with refusals_of("tool"):
        arm, cups = with_cups(loaded, asked.tool)
        wanted = poses(cups)
    with refusals_of("robot"):
        reachable = reachable_at_places(
            arm,
            places_argument(asked.fixture),
            distinct(wanted) if asked.distinct else wanted,
            arm_radius=asked.arm_radius,
            branches=asked.branches,
            fourth_cup=asked.fourth_cup,
        )
    plan = HexapodPlan(arm, attached_anew(reachable, asked.attachments), joints_are)
    files = {sheet: plan.sheet_text(), steps: plan.steps_text()}
    written = {file: content for file, content in files.items() if file is not None}
    if written:
        folder = next(iter(written)).absolute().parent
        write_files(folder, {str(file.absolute()): content for file, content in written.items()})
    return replace(plan, files=tuple(written))


def _files(asked: PlanHexapod) -> tuple[Path | None, Path | None]:
    """Return where the sheet and the steps are written."""
    sheet = None if asked.out is None else file_for(asked.out, asked.robot)
    steps = None if asked.steps is None else file_for(asked.steps, asked.robot, parameter="steps")
    if sheet is not None and steps is not None and same_place(sheet, steps):
        raise InputError("the sheet and the steps must be different files", parameter="steps", came=str(steps))
    return sheet, steps


def places_argument(fixture: object) -> tuple[Transform, ...]:
    """Return where the base fixture stands, one place or several."""
    places = list(fixture) if isinstance(fixture, np.ndarray) and fixture.ndim == 2 else fixture
    if isinstance(places, list | tuple) and places and all(_is_place(place) for place in places):
        return tuple(_fixture_argument(place) for place in places)
    return (_fixture_argument(fixture),)


def _is_place(value: object) -> bool:
    return isinstance(value, Transform | np.ndarray | list | tuple)


def _fixture_argument(fixture: object) -> Transform:
    if isinstance(fixture, Transform):
        _fixture_argument([*fixture.translation, *fixture.quaternion])
        return fixture
    allowed = "x, y, z and a turn about z, or x, y, z and a quaternion w, x, y, z"
    numbers = array_argument(fixture, "fixture", ("n",), allowed).tolist()
    if len(numbers) not in (4, 7):
        raise InputError("the fixture has 4 or 7 numbers", parameter="fixture", came=len(numbers), allowed=allowed)
    x, y, z = lengths_argument(numbers[:3], "fixture", 3)
    if len(numbers) == 4:
        half = numbers[3] / 2
        return Transform((x, y, z), (math.cos(half), 0.0, 0.0, math.sin(half)))
    length = math.sqrt(sum(part * part for part in numbers[3:]))
    if abs(length - 1.0) > QUATERNION_TOLERANCE:
        raise InputError(
            "the quaternion (w, x, y, z) does not have length 1",
            parameter="fixture",
            came=f"length {length:.6g}",
            allowed=f"1 within {QUATERNION_TOLERANCE:g}",
            cure="Check the order of its numbers, and that all digits are there.",
        )
    w, i, j, k = unit_quaternions(np.array([numbers[3:]]), "fixture", [1])[0].tolist()
    return Transform((x, y, z), (w, i, j, k))
