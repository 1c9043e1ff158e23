"""Columns of the canonical CSV that are neither numbers with a unit nor names, and what their rows must agree on."""

from __future__ import annotations

import re
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.measurement.dataset import IntArray
from truearm.measurement.dataset_fields import VISITS
from truearm.measurement.readers.cells import Cells
from truearm.measurement.readers.rows import Configurations
from truearm.simulated import YES

ROLES: Final = ("target", "reference", "fixture")
#: What the order of measurement is numbered with.
_ORDER: Final = "a whole number, 0 or more, of the configuration"


def roles_of(cells: Cells, place: int | None) -> tuple[str, ...]:
    """Return the role of each row; all are targets in a file without this column."""
    if place is None:
        return ("target",) * len(cells.lines)
    roles = cells.columns[place]
    for role in dict.fromkeys(roles):
        if role not in ROLES:
            raise InputError(
                "the role is not known" if role else "the cell is empty",
                where=cells.place(roles.index(role), place),
                came=role or None,
                allowed=f"{', '.join(ROLES[:-1])} or {ROLES[-1]}",
                cure="A target is fixed to the robot's tool, a reference stands beside the robot and is measured too, "
                "a fixture is what targets are measured against.",
            )
    return roles


def check_mark(cells: Cells, place: int) -> None:
    """Refuse rows of which it is not clear whether a virtual instrument read them."""
    for row, text in enumerate(cells.columns[place]):
        if text.lower() not in ("", YES, "no"):
            raise InputError(
                "this does not say whether a virtual instrument read the row",
                where=cells.place(row, place),
                came=text,
                allowed=f"{YES}, or nothing of a real instrument",
            )


def scale_sigma_of(cells: Cells, place: int, unit: str) -> float:
    """Return the one deviation of the scale, which every row repeats."""
    found = cells.numbers(place, unit, deviation=True)
    other = np.flatnonzero(found != found[0])
    if len(other):
        raise InputError(
            "the scale is of the instrument, and there is one of it",
            where=cells.place(int(other[0]), place),
            came=cells.columns[place][int(other[0])],
            allowed=f"{cells.columns[place][0]}, as on line {cells.lines[0]}",
        )
    return float(found[0])


def order_of(cells: Cells, configurations: Configurations, place: int) -> IntArray:
    """Return the number of each configuration in the order of measurement, which its rows repeat."""
    texts = cells.texts(place)
    of: dict[int, int] = {}
    rows: list[int] = []
    for row, (text, found) in enumerate(zip(texts, configurations.of_row.tolist(), strict=True)):
        if not re.fullmatch("[0-9]{1,9}", text):
            raise InputError("this is no place in an order", where=cells.place(row, place), came=text, allowed=_ORDER)
        if found == len(rows):
            rows.append(row)
        elif int(text) != int(texts[rows[found]]):
            raise InputError(
                f"order differs from line {cells.lines[rows[found]]}, which has the same configuration",
                where=cells.place(row, place),
                came=text,
                allowed=f"{texts[rows[found]]}, as on line {cells.lines[rows[found]]}",
            )
        if of.setdefault(int(text), found) != found:
            raise InputError(
                f"the configuration {configurations.labels[of[int(text)]]!r} has this place in the order",
                where=cells.place(row, place),
                came=text,
                allowed="another number for each configuration",
            )
    return np.array([int(texts[row]) for row in rows], dtype=np.intp)


def visits_of(cells: Cells, place: int) -> IntArray:
    """Return the number of the visit that each row was read on."""
    for line, text in enumerate(texts := cells.texts(place)):
        if not re.fullmatch("[0-9]{1,9}", text):
            raise InputError("this is no number of a visit", where=cells.place(line, place), came=text, allowed=VISITS)
    return np.array([int(text) for text in texts], dtype=np.intp)
