"""Joint positions at the three base cups: a CSV with ``cup`` (B1, B2, B3) and ``joint_1 [deg]`` .., one row a cup.

``axis_1 [deg]`` .. instead are joint positions as the controller shows them.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.files import read_text
from truearm.measurement.readers.canonical import refuse_other_separators
from truearm.measurement.readers.cells import Layout, lines_of, read_cells
from truearm.modeling.chain import Array
from truearm.modeling.formats.joint_columns import COLUMN, joint_names
from truearm.modeling.robot import Robot
from truearm.units import ANGLE_UNITS, LENGTH_UNITS, checked_unit

_HEADING: Final = re.compile(r"(?P<name>cup|(?:joint|axis)_[1-9][0-9]?)\s*(?:\[(?P<unit>[^\]]*)\])?")
_CUPS: Final = ("B1", "B2", "B3")


def read_touches(path: Path, robot: Robot) -> Array:
    """Return the model's joint positions at B1, B2 and B3 [rad or m], ``(3, joints)``.

    Raises:
        InputError: If the file does not hold each cup once with all joints of the robot, or they are its controller's
            and its file does not say how that counts them.
    """
    text = read_text(path)
    header = 1 + next(number for number, line in enumerate(lines_of(text)) if line.strip())
    refuse_other_separators(text, f"{path}, line {header}")
    cells = read_cells(text, str(path), Layout(header=header))
    numbers = range(1, len(robot.joints) + 1)
    known = ("cup", *(f"{kind}_{number}" for kind in COLUMN.values() for number in numbers))
    columns: dict[str, tuple[int, str]] = {}
    for place, heading in enumerate(cells.names):
        where = f"{path}, line {header}, column {place + 1}"
        match = _HEADING.fullmatch(heading)
        if match is None or match["name"] not in known or match["name"] in columns:
            raise InputError(
                "the column is not known, or appears twice", where=where, came=heading, allowed=", ".join(known)
            )
        if match["name"] == "cup":
            columns["cup"] = (place, "1")
        else:
            kind = robot.joints[int(match["name"].rpartition("_")[2]) - 1].kind
            units = ANGLE_UNITS if kind == "revolute" else LENGTH_UNITS
            columns[match["name"]] = (place, checked_unit(match["unit"], units, f"{where}, {heading}"))
    joints_are, _ = joint_names(columns, f"{path}, line {header}")
    wanted = ("cup", *(f"{COLUMN[joints_are]}_{number}" for number in numbers))
    missing = [name for name in wanted if name not in columns]
    if missing:
        raise InputError(f"the column {missing[0]} is missing", where=f"{path}, line {header}")
    labels = cells.texts(columns["cup"][0])
    if sorted(labels) != list(_CUPS):
        raise InputError(
            "every base cup is touched once", where=str(path), came=", ".join(labels), allowed=", ".join(_CUPS)
        )
    joints = np.column_stack([cells.numbers(*columns[name]) for name in wanted[1:]])
    found = np.asarray(joints[[labels.index(cup) for cup in _CUPS]])
    if joints_are == "model":
        return found
    robot.controller.check_counts(robot.name, f"{path}, column axis_1")
    return robot.controller.to_model(found)
