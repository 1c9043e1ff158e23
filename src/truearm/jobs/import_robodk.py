"""Measurements from the tables of RoboDK's robot calibration."""

from __future__ import annotations

from pathlib import Path

from truearm.errors import InputError, refusals_of
from truearm.files import path_argument
from truearm.jobs.arguments import JOINTS_OF, choice_argument, file_for
from truearm.measurement.readers.canonical import csv_text
from truearm.measurement.readers.robodk import DECIMALS, DELIMITERS, AngleUnit, Decimal, Delimiter, read_robodk
from truearm.modeling.controller import JointsOf
from truearm.results.imported import ImportedRoboDK
from truearm.writing import write_text


def import_robodk(
    file: str | Path,
    *,
    angle_unit: AngleUnit | None = None,
    joints_are: JointsOf = "model",
    delimiter: Delimiter = "comma",
    decimal: Decimal = "point",
    out: str | Path | None = None,
) -> ImportedRoboDK:
    """Read the calibration or validation measurements that RoboDK exports as CSV.

    Parameters
    ----------
    file
        The table: six joints, the measured point and the tool's point of each measurement, or poses instead of points.
    angle_unit
        Unit of the angles of poses, ``deg`` or ``rad``; None for points.
    joints_are
        Whose joint positions they are: the ``model``'s, or as the robot's ``controller`` shows them.
    delimiter
        What stands between columns: ``comma``, ``semicolon`` or ``tab``.
    decimal
        The decimal sign: ``point``, or ``comma`` beside another delimiter.
    out
        Canonical CSV file to write; None writes nothing.

    Raises
    ------
    InputError
        If the file cannot be used; the message names the line and the column.
    """
    table = path_argument(file, "file")
    if angle_unit is not None:
        choice_argument(angle_unit, "angle_unit", dict.fromkeys(("deg", "rad")))
    whose = choice_argument(joints_are, "joints_are", JOINTS_OF)
    between = choice_argument(delimiter, "delimiter", DELIMITERS)
    if choice_argument(decimal, "decimal", DECIMALS) == between:
        raise InputError(
            "commas cannot stand between columns and in numbers",
            parameter="decimal",
            came="comma",
            allowed="point, or another `delimiter`",
        )
    target = None if out is None else file_for(out, table)
    with refusals_of("file"):
        read = read_robodk(table, angle_unit, whose, delimiter, decimal)
    if target is not None:
        write_text(target, csv_text(read.data))
    return ImportedRoboDK(read.data, read.tool_points, target, read.missing)
