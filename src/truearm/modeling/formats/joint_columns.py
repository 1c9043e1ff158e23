"""Joint positions in the columns of a file: ``joint_i`` of the model, or ``axis_i`` as the controller shows them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Final

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.controller import Controller, JointsOf
from truearm.modeling.parts import Joint
from truearm.modeling.robot import Robot
from truearm.units import written

#: What columns are called, before their numbers.
COLUMN: Final[dict[JointsOf, str]] = {"model": "joint", "controller": "axis"}

#: A column of joint positions, with its number.
JOINT_COLUMN: Final = re.compile(r"(joint|axis)_([1-9][0-9]{0,3})")


def joint_names(names: Iterable[str], where: str) -> tuple[JointsOf, list[str]]:
    """Return whose joint positions the columns of a file hold, and those columns in their order.

    Raises:
        InputError: If there are columns of both kinds, or none, or a number is missing.
    """
    found = sorted((int(match[2]), match[1]) for name in names if (match := JOINT_COLUMN.fullmatch(name)))
    kinds = dict.fromkeys(kind for _, kind in found)
    if len(kinds) > 1:
        raise InputError(
            "a file has joint positions of one kind",
            where=where,
            came=", ".join(f"{kind}_{number}" for number, kind in found),
            allowed="axis_1, axis_2, .. as the controller shows them, or joint_1, joint_2, .. of the robot's model",
            cure="Keep the columns of one kind.",
        )
    kind = next(iter(kinds), COLUMN["model"])
    there_are = {number for number, _ in found}
    for number in range(1, max(there_are, default=1) + 1):
        if number not in there_are:
            raise InputError(
                f"the column {kind}_{number} is missing",
                where=where,
                came=", ".join(f"{kind}_{n}" for n, _ in found) or None,
                allowed=f"{kind}_1, {kind}_2, .. without a gap",
                cure=f"Add {kind}_{number} [deg], or with the unit it has, or renumber.",
            )
    return next(whose for whose, name in COLUMN.items() if name == kind), [f"{kind}_{number}" for number, _ in found]


def counting(robot: Robot, joints_are: JointsOf) -> Controller | None:
    """Return the controller whose joint positions are meant; None for the model's."""
    return robot.controller if joints_are == "controller" else None


def joint_headings(joints: Sequence[Joint], controller: Controller | None = None, name: str | None = None) -> list[str]:
    """Return the names of the columns of joint positions, with their units.

    Args:
        joints: Of the robot.
        controller: Who shows them; None for the model's.
        name: What they are called before their numbers, ``joint`` or ``axis`` if None.
    """
    called = name or COLUMN["model" if controller is None else "controller"]
    return [f"{called}_{number} [{unit}]" for number, unit in enumerate(_units(joints), 1)]


def joint_cells(values: Array, joints: Sequence[Joint], controller: Controller | None = None) -> list[list[str]]:
    """Return the cells of joint positions of the model ``(n, joints)`` [rad or m], in deg or mm, row by row."""
    shown = values if controller is None else controller.from_model(values)
    units = _units(joints)
    return [[repr(written(value, unit)) for value, unit in zip(row, units, strict=True)] for row in shown.tolist()]


def _units(joints: Sequence[Joint]) -> list[str]:
    return ["deg" if joint.kind == "revolute" else "mm" for joint in joints]
