"""DH tables as CSV: one row a joint, in mm and degrees; base and flange below, where they are asked for.

Lines that start with ``#`` are comments. A table of convention ``hayati`` has a column for beta.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from truearm.errors import InputError
from truearm.files import read_text
from truearm.limits import refuse_beyond
from truearm.modeling.conventions import JOINT, JointKind
from truearm.modeling.formats.dh_table import DHRow, DHTable, TableConvention
from truearm.modeling.transform import Transform
from truearm.units import ANGLE_UNITS, LENGTH_UNITS, SHOWN_AS, as_number, checked_unit, sized_si, written

_FRAMES: Final = ("frame", "x [mm]", "y [mm]", "z [mm]", "qw", "qx", "qy", "qz")


def _columns(convention_name: TableConvention) -> dict[str, str]:
    plain = {"a": "m", "alpha": "rad", "d": "m", JOINT: "rad"}
    return {**plain, "beta": "rad"} if convention_name == "hayati" else plain


def dh_csv(table: DHTable) -> str:
    """Return the rows of a table as CSV, in mm and degrees; base and flange are not part of it."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    columns = _columns(table.convention_name)
    writer.writerow(["joint", "type", *(f"{column} [{SHOWN_AS[unit]}]" for column, unit in columns.items())])
    for row in table.rows:
        shown = (written(getattr(row, column), SHOWN_AS[unit]) for column, unit in columns.items())
        writer.writerow([row.joint, row.kind, *map(repr, shown)])
    return stream.getvalue()


def complete_dh_csv(table: DHTable, comments: Sequence[str]) -> str:
    """Return a whole table as CSV: comments, the rows, then base and flange as position and quaternion."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(_FRAMES)
    for name, place in (("base", table.base), ("flange", table.flange)):
        writer.writerow([name, *(repr(written(v, "mm")) for v in place.translation), *map(repr, place.quaternion)])
    return "".join(f"# {line}\n" for line in comments) + dh_csv(table) + "\n" + stream.getvalue()


def read_dh_csv(path: Path, convention_name: TableConvention) -> DHTable:
    """Read a DH table from a CSV file; its base and flange are the identity unless it gives them.

    The columns are ``joint``, ``a [mm]``, ``alpha [deg]``, ``d [mm]`` and ``theta_offset [deg]``, in any
    order and unit, ``beta [deg]`` in a Hayati table, and ``type`` where a joint slides. Behind the rows the frames
    ``base`` and ``flange`` may stand, under the header ``frame,x [mm],y [mm],z [mm],qw,qx,qy,qz``.

    Args:
        convention_name: The form the numbers are in; no table says it of itself.
    """
    text = read_text(path)
    refuse_beyond("entries", text.count("\n") + text.count("\r") + text.count(","), where=str(path))
    uncommented = ("" if line.startswith("#") else line for line in text.splitlines())
    try:
        lines = [
            (f"{path}, line {number}", [cell.strip() for cell in cells])
            for number, cells in enumerate(csv.reader(uncommented), 1)
            if any(cell.strip() for cell in cells)
        ]
    except csv.Error as error:
        raise InputError(f"the table cannot be read ({error})", where=str(path)) from error
    if not lines:
        raise InputError("the file holds comments and no table", where=str(path))
    known = _columns(convention_name)
    columns = _header(lines[0][1], known, lines[0][0])
    end = next((i for i, (_, cells) in enumerate(lines) if tuple(cells) == _FRAMES), len(lines))
    if end == 1:
        raise InputError("the table has no rows", where=str(path))
    rows = []
    for where, cells in lines[1:end]:
        _count(cells, len(columns), where)
        entry = dict(zip((name for name, _ in columns), cells, strict=True))
        kind: JointKind = "prismatic" if entry.get("type") == "prismatic" else "revolute"
        if entry.get("type", kind) != kind:
            raise InputError(
                "a joint has no such type",
                where=f"{where}, type",
                came=entry["type"],
                allowed="revolute, prismatic",
            )
        si = {name: _si(entry[name], unit, f"{where}, {name}") for name, unit in columns if unit}
        rows.append(DHRow(entry["joint"], kind, **si))
    table = DHTable(convention_name, tuple(rows), Transform(), Transform())
    if end == len(lines):
        return table
    places = _frames(lines[end + 1 :], str(path))
    return replace(table, base=places["base"], flange=places["flange"])


def _header(cells: Sequence[str], known: dict[str, str], where: str) -> list[tuple[str, str]]:
    """Return name and unit of each column; names without a unit have an empty one."""
    columns = []
    for cell in cells:
        name, _, rest = cell.strip().partition("[")
        name, unit = name.strip(), rest.removesuffix("]").strip()
        if name in known:
            unit = checked_unit(unit, LENGTH_UNITS if known[name] == "m" else ANGLE_UNITS, f"{where}, column {name}")
        columns.append((name, unit))
    names = [name for name, _ in columns]
    needed = ["joint", *known]
    if sorted(set(names) - {"type"}) != sorted(needed) or len(set(names)) < len(names):
        raise InputError(
            "these are not the columns of a DH table",
            where=where,
            came=", ".join(names),
            allowed=f"{', '.join(needed)}, each once, with their units in brackets; and type",
            cure="Separate the columns by commas.",
        )
    return columns


def _frames(lines: Sequence[tuple[str, Sequence[str]]], path: str) -> dict[str, Transform]:
    found = {}
    for where, cells in lines:
        _count(cells, len(_FRAMES), where)
        x, y, z = (_si(cell, "mm", f"{where}, {axis}") for cell, axis in zip(cells[1:4], "xyz", strict=True))
        w, i, j, k = (_si(cell, "1", f"{where}, quaternion") for cell in cells[4:])
        if abs(math.hypot(w, i, j, k) - 1.0) > 1e-6:
            raise InputError("a quaternion must have length 1", where=where, came=f"{math.hypot(w, i, j, k):.6g}")
        found[cells[0]] = Transform((x, y, z), (w, i, j, k))
    names = [cells[0] for _, cells in lines]
    if sorted(names) != ["base", "flange"]:
        raise InputError(
            "these are not the frames of a table",
            where=path,
            came=", ".join(names) or "none",
            allowed="base and flange, each once",
        )
    return found


def _count(cells: Sequence[str], expected: int, where: str) -> None:
    if len(cells) != expected:
        raise InputError(
            "the row does not have as many cells as the header", where=where, came=len(cells), allowed=str(expected)
        )


def _si(text: str, unit: str, where: str) -> float:
    value = as_number(text)
    if value is None:
        raise InputError("a number belongs here", where=where, came=text)
    return sized_si(value, unit, where, came=text)
