"""Which configurations of a robot can be measured with the hexapod device, at one place or several."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from truearm.errors import InputError, refusals_of, wrong_kind
from truearm.jobs.arguments import (
    array_argument,
    file_for,
    flag_argument,
    joints_argument,
    length_argument,
    lengths_argument,
    name_argument,
    robot_argument,
    whole_argument,
)
from truearm.measurement.hexapod.poses import distinct as distinct_poses
from truearm.measurement.hexapod.poses import poses
from truearm.measurement.readers.rows import QUATERNION_TOLERANCE, unit_quaternions
from truearm.modeling.controller import JointsOf
from truearm.modeling.inverse.branches import BRANCHES
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform
from truearm.planning.hexapod.clearance import ARM_RADIUS
from truearm.planning.hexapod.reachable import attached_anew, reachable_at_places
from truearm.planning.hexapod.tool import with_cups
from truearm.results.hexapod import HexapodPlan
from truearm.writing import same_place, write_files

#: More attachments than anybody compares.
_MOST_ATTACHMENTS: Final = 50


def hexapod_plan(
    robot: Robot | str | Path,
    fixture: Transform | Sequence[float] | Sequence[Transform | Sequence[float]],
    *,
    out: str | Path | None = None,
    steps: str | Path | None = None,
    tool: str | None = None,
    distinct: bool = False,
    branches: Sequence[str] = (),
    fourth_cup: bool = False,
    attachments: int = 1,
    arm_radius: float = ARM_RADIUS,
    joints: JointsOf | None = None,
) -> HexapodPlan:
    """Plan which configurations of a robot can be measured with the base fixture at one place or several.

    Parameters
    ----------
    robot
        A robot, or what :func:`truearm.load_robot` takes, with six joints that are solved in closed form.
    fixture
        The base fixture in the robot's base frame: a transform; x, y, z of B1 [m] and a turn about z [rad]; or x, y, z
        [m] and a quaternion w, x, y, z. Several of them are places where it stands one after the other.
    out
        CSV file for the sheet to fill in; None writes nothing.
    steps
        Text file for the same step by step, to print.
    tool
        Name of a tool of the robot file, with the three cups as its targets; its first if None.
    distinct
        Leave out near-equal poses.
    branches
        Only branches whose names begin so, such as ``front-up``; all of them if empty.
    fourth_cup
        Plan for a fourth cup below the three others, and poses on all four sides.
    attachments
        How often the tool is attached. After each time but the first, five configurations of the last place are
        measured again, which tells how well the tool changer repeats the cups.
    arm_radius
        Of the arm's links, for the room at the bars [m].
    joints
        Whose joint positions the files hold: the ``model``'s, or as the ``controller`` shows them; None for the
        controller's where the robot file says that they differ.

    Raises
    ------
    InputError
        If the robot has no such tool or no closed form, or can reach none of the poses with the fixture at a place.
    """
    places = _places_argument(fixture)
    wanted_branches = _branches_argument(branches)
    radius = length_argument(arm_radius, "arm_radius", 0.0)
    four_cups = flag_argument(fourth_cup, "fourth_cup")
    times = whole_argument(attachments, "attachments", 1, _MOST_ATTACHMENTS)
    only_distinct = flag_argument(distinct, "distinct")
    sheet = None if out is None else file_for(out, robot)
    text = None if steps is None else file_for(steps, robot, parameter="steps")
    if sheet is not None and text is not None and same_place(sheet, text):
        raise InputError("the sheet and the steps must be different files", parameter="steps", came=str(text))
    name = None if tool is None else name_argument(tool, "tool")
    loaded = robot_argument(robot)
    joints_are = joints_argument(joints, loaded)
    with refusals_of("tool"):
        arm, cups = with_cups(loaded, name)
        wanted = poses(cups)
    with refusals_of("robot"):
        found = reachable_at_places(
            arm,
            places,
            distinct_poses(wanted) if only_distinct else wanted,
            arm_radius=radius,
            branches=wanted_branches,
            fourth_cup=four_cups,
        )
    plan = HexapodPlan(arm, attached_anew(found, times), joints_are)
    files = {sheet: plan.sheet_text(), text: plan.steps_text()}
    written = {file.absolute(): content for file, content in files.items() if file is not None}
    if written:
        write_files(next(iter(written)).parent, {str(file): content for file, content in written.items()})
    return plan


def _places_argument(fixture: object) -> tuple[Transform, ...]:
    places = list(fixture) if isinstance(fixture, np.ndarray) and fixture.ndim == 2 else fixture
    if isinstance(places, list | tuple) and places and all(_is_place(one) for one in places):
        return tuple(_fixture_argument(one) for one in places)
    return (_fixture_argument(fixture),)


def _is_place(one: object) -> bool:
    return isinstance(one, Transform | np.ndarray | list | tuple)


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


def _branches_argument(branches: object) -> tuple[str, ...]:
    if isinstance(branches, str) or not isinstance(branches, Sequence):
        raise wrong_kind("a sequence of names belongs here", branches, "branches", ", ".join(BRANCHES))
    return tuple(name_argument(name, "branches") for name in branches)
