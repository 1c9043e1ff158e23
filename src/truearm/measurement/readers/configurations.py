"""Where an arm stands or shall stand, without readings: the table of a plan."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.files import read_text
from truearm.measurement.dataset import Dataset
from truearm.measurement.readers.canonical import read_csv, refuse_other_separators
from truearm.measurement.readers.cells import Layout, lines_of, read_cells
from truearm.measurement.readers.rows import Readings, dataset_of, found_configurations
from truearm.modeling.formats.joint_columns import JOINT_COLUMN, joint_names
from truearm.units import ANGLE_UNITS, LENGTH_UNITS, checked_unit

_HEADING: Final = re.compile(r"(?P<name>[^\[]*?)\s*(?:\[(?P<unit>[^\]]*)\])?")
_LABEL: Final = "configuration"
#: Further columns of plans: where to stop before, in which order, under which pull, and what is read.
_BESIDE: Final = re.compile(r"approach_[1-9][0-9]{0,3}|order|force_[xyz]|reads")
#: What nobody has seen.
_UNSEEN: Final = "unseen"


def read_configurations(path: Path) -> Dataset:
    """Read configurations: of a canonical CSV, or of a table without readings that a plan has.

    Such a table has the columns ``configuration`` and ``joint_i`` or ``axis_i``, a row a configuration. Its columns
    ``approach_i``, ``order``, ``force_x`` to ``force_z`` and ``reads`` say nothing of where the arm stands.

    Returns
    -------
    Dataset
        Of a plan with one missing reading for each configuration.

    Raises
    ------
    InputError
        If the file is neither of them, or a cell cannot be used.
    """
    text = read_text(path)
    first = next((number, line) for number, line in enumerate(lines_of(text), 1) if line.strip())
    heads = {one.strip().strip('"').partition("[")[0].strip() for one in first[1].split(",")}
    if "target" in heads or not any(JOINT_COLUMN.fullmatch(name) for name in heads):
        return read_csv(path)
    refuse_other_separators(text, f"{path}, line {first[0]}")
    cells = read_cells(text, str(path), Layout(header=first[0]))
    columns: dict[str, tuple[int, str]] = {}
    for place, heading in enumerate(cells.names):
        where = f"{path}, line {first[0]}, column {place + 1}"
        match = _HEADING.fullmatch(heading)
        name = match["name"] if match else heading
        if name in columns:
            raise InputError(f"the column {name} appears twice", where=where, came=heading, cure="Remove one of them.")
        if JOINT_COLUMN.fullmatch(name):
            unit = checked_unit(match and match["unit"], (*ANGLE_UNITS, *LENGTH_UNITS), f"{where}, {heading}")
        elif name == _LABEL or _BESIDE.fullmatch(name):
            unit = ""
        else:
            raise InputError(
                "the column is not known in a table of configurations without readings",
                where=where,
                came=heading,
                allowed="configuration, joint_1 [deg] .. or axis_1 [deg] .., and further columns of a plan",
                cure="Rename it, or leave it out; readings have the column target, too.",
            )
        columns[name] = (place, unit)
    if _LABEL not in columns:
        raise InputError(
            "the column configuration is missing", where=f"{path}, line {first[0]}", cure="Add it: a name in each row."
        )
    joints_are, names = joint_names(columns, f"{path}, line {first[0]}")
    labels = cells.texts(columns[_LABEL][0])
    places, units = zip(*(columns[name] for name in names), strict=True)
    found = found_configurations(cells, labels, places, units, joints_are)
    return dataset_of(
        Readings(
            source=str(path),
            lines=cells.lines,
            configuration=found.of_row,
            targets=(_UNSEEN,) * len(labels),
            reference=np.zeros(len(labels), bool),
            position=np.full((len(labels), 3), np.nan),
        ),
        found,
    )
