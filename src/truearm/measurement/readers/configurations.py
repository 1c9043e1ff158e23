"""Where an arm stands or shall stand, without readings: the table of a plan."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.files import read_text
from truearm.measurement.dataset import Dataset
from truearm.measurement.readers.canonical import read_csv, refuse_other_separators
from truearm.measurement.readers.cells import Cells, Layout, lines_of, read_cells
from truearm.measurement.readers.rows import Configurations, Readings, dataset_of, found_configurations
from truearm.measurement.readers.stops import STOP_COLUMN, stops_in
from truearm.modeling.formats.joint_columns import JOINT_COLUMN, joint_names
from truearm.units import ANGLE_UNITS, LENGTH_UNITS, checked_unit

_HEADING: Final = re.compile(r"(?P<name>[^\[]*?)\s*(?:\[(?P<unit>[^\]]*)\])?")
_LABEL: Final = "configuration"
#: Further columns of plans: in which order, under which pull, and what is read.
_BESIDE: Final = re.compile(r"order|force_[xyz]|reads")
#: What nobody has seen.
_UNSEEN: Final = "unseen"


def read_configurations(path: Path) -> Dataset:
    """Read configurations: of a canonical CSV, or of a table without readings that a plan has.

    Such a table has the columns ``configuration`` and ``joint_i`` or ``axis_i``, a row a configuration. Its columns
    ``approach_i``, ``order``, ``force_x`` to ``force_z`` and ``reads`` say nothing of where the arm stands.

    Returns:
        Dataset: Of a plan with one missing reading for each configuration.

    Raises:
        InputError: If the file is neither of them, or a cell cannot be used.
    """
    table = _table_of(path)
    if table is None:
        return read_csv(path)
    return _unseen(table.cells, _found(table))


def read_stops(path: Path) -> Dataset | None:
    """Read where the arm stops right before each configuration of a plan, ``approach_i`` of its table.

    Returns:
        Dataset: With these joint positions, counted as those of the configurations; None where the file does not have
            them.

    Raises:
        InputError: If some of its columns are missing or have no unit, or a cell cannot be used.
    """
    table = _table_of(path)
    stops = None if table is None else stops_in(table.cells, _found(table))
    return None if table is None or stops is None else _unseen(table.cells, stops)


@dataclass(frozen=True)
class _Table:
    """Cells of a table of configurations, place and unit of each column by its name, and where these stand."""

    cells: Cells
    columns: Mapping[str, tuple[int, str]]
    where: str


def _table_of(path: Path) -> _Table | None:
    """Return the table of a plan; None for a canonical CSV."""
    text = read_text(path)
    first = next((number, line) for number, line in enumerate(lines_of(text), 1) if line.strip())
    heads = {one.strip().strip('"').partition("[")[0].strip() for one in first[1].split(",")}
    if "target" in heads or not any(JOINT_COLUMN.fullmatch(name) for name in heads):
        return None
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
        elif name == _LABEL or STOP_COLUMN.fullmatch(heading) or _BESIDE.fullmatch(name):
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
    return _Table(cells, columns, f"{path}, line {first[0]}")


def _found(table: _Table) -> Configurations:
    joints_are, names = joint_names(table.columns, table.where)
    places, units = zip(*(table.columns[name] for name in names), strict=True)
    labels = table.cells.texts(table.columns[_LABEL][0])
    return found_configurations(table.cells, labels, places, units, joints_are)


def _unseen(cells: Cells, found: Configurations) -> Dataset:
    """Return joint positions with a missing reading at each."""
    n = len(found.of_row)
    return dataset_of(
        Readings(
            source=cells.source,
            lines=cells.lines,
            configuration=found.of_row,
            targets=(_UNSEEN,) * n,
            reference=np.zeros(n, bool),
            position=np.full((n, 3), np.nan),
        ),
        found,
    )
