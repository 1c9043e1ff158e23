"""Measurements from any table of points."""

from __future__ import annotations

from pathlib import Path

from truearm.errors import refusals_of
from truearm.files import path_argument
from truearm.jobs.arguments import JOINTS_OF, choice_argument, file_for
from truearm.measurement.readers.canonical import csv_text
from truearm.measurement.readers.table import files_read, read_noting
from truearm.modeling.controller import JointsOf
from truearm.results.imported import Imported
from truearm.writing import write_text


def import_table(
    file: str | Path,
    mapping: str | Path,
    *,
    joints: str | Path | None = None,
    joints_are: JointsOf | None = None,
    out: str | Path | None = None,
) -> Imported:
    """Read any table of points or poses, by a mapping that says which column is what.

    Parameters
    ----------
    file
        A CSV, another delimited text, or an Excel workbook.
    mapping
        Mapping file, schema ``truearm-mapping/1``, or the name of a preset: ``spatial-analyzer`` or ``t-mac``.
    joints
        Second file with the joint positions; None for the one that the mapping names, or none.
    joints_are
        Whose joint positions they are: the ``model``'s, or as the robot's ``controller`` shows them; None for what the
        mapping says, the model's if it says nothing.
    out
        Canonical CSV file to write; None writes nothing.

    Raises
    ------
    InputError
        If a file cannot be used; the message names the line and the column.
    """
    table, columns = path_argument(file, "file"), path_argument(mapping, "mapping")
    whose = None if joints_are is None else choice_argument(joints_are, "joints_are", JOINTS_OF)
    beside = None if joints is None else path_argument(joints, "joints")
    with refusals_of("mapping"):
        read = files_read(table, columns, beside)
    target = None if out is None else file_for(out, *read)
    with refusals_of("file"):
        data, noticed = read_noting(table, columns, whose, beside)
    if target is not None:
        write_text(target, csv_text(data))
    return Imported(data, target, warnings=noticed)
