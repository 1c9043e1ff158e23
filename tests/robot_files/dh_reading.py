"""Reads DH tables that were written as CSV, to hold them against the robot that was written."""

from __future__ import annotations

import csv

from truearm.engine.base.units import to_si
from truearm.engine.robot.conventions.convention import JointKind
from truearm.engine.robot.dh_table import DHRow, DHTable, TableConvention
from truearm.engine.robot.transform import Transform


def read_dh(text: str, form: TableConvention) -> DHTable:
    """Return the table of a CSV text; its base and flange are the identity where it has none."""
    lines = [line for line in csv.reader(line for line in text.splitlines() if not line.startswith("#")) if line]
    end = next((k for k, line in enumerate(lines) if line[0] == "frame"), len(lines))
    units = dict(heading.rstrip("]").split(" [") for heading in lines[0][2:])
    rows = []
    for joint, type_, *cells in lines[1:end]:
        kind: JointKind = "prismatic" if type_ == "prismatic" else "revolute"
        numbers = (to_si(float(cell), unit) for cell, unit in zip(cells, units.values(), strict=True))
        rows.append(DHRow(joint, kind, **dict(zip(units, numbers, strict=True))))
    places = {"base": Transform(), "flange": Transform()}
    for name, *cells in lines[end + 1 :]:
        x, y, z = (to_si(float(cell), "mm") for cell in cells[:3])
        w, i, j, k = map(float, cells[3:])
        places[name] = Transform((x, y, z), (w, i, j, k))
    return DHTable(form, tuple(rows), places["base"], places["flange"])
