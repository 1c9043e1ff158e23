"""Measurements from plain matrices, one file for the joints and one a target."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from truearm.errors import refusals_of
from truearm.files import path_argument
from truearm.jobs.arguments import JOINTS_OF, choice_argument, file_for, files_argument, name_argument
from truearm.measurement.readers.canonical import csv_text
from truearm.measurement.readers.matrices import read_matrices
from truearm.modeling.controller import JointsOf
from truearm.results.imported import Imported
from truearm.writing import write_text


def import_matrices(
    joints: str | Path,
    targets: Mapping[str, str | Path],
    references: Mapping[str, str | Path] | None = None,
    *,
    angle_unit: str,
    length_unit: str,
    joints_are: JointsOf = "model",
    out: str | Path | None = None,
) -> Imported:
    """Read white-space separated matrices, one configuration a row; a row of zeros or NaN is a missing reading.

    Parameters
    ----------
    joints
        File of the joint positions, one column a joint; all joints are revolute.
    targets
        File of the positions of each target on the tool, by name; columns x, y, z.
    references
        The same for fixed points beside the robot.
    angle_unit, length_unit
        Units of the joints, ``deg`` or ``rad``, and of the positions, ``mm``, ``m``, ``um`` or ``in``.
    joints_are
        Whose joint positions they are: the ``model``'s, or as the robot's ``controller`` shows them.
    out
        Canonical CSV file to write; None writes nothing.

    Raises
    ------
    InputError
        If a file cannot be used; the message names the line and the column.
    """
    table = path_argument(joints, "joints")
    seen = files_argument(targets, "targets")
    beside = {} if references is None else files_argument(references, "references")
    units = name_argument(angle_unit, "angle_unit"), name_argument(length_unit, "length_unit")
    whose = choice_argument(joints_are, "joints_are", JOINTS_OF)
    file = None if out is None else file_for(out, table, *seen.values(), *beside.values())
    with refusals_of("joints, targets"):
        data, missing = read_matrices(table, seen, beside, *units, whose)
    if file is not None:
        write_text(file, csv_text(data))
    return Imported(data, file, missing)
