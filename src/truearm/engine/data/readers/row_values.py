"""What the rows of a table of any make hold, found by the columns that a mapping names."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final, Literal

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, counted, nearest_names
from truearm.engine.base.units import as_number, sized_si
from truearm.engine.data.dataset import IntArray
from truearm.engine.data.readers.cells import Cells, column_letters
from truearm.engine.data.readers.mapping import (
    AnglesEntry,
    JointsEntry,
    MappingFile,
    ReadingEntry,
    SigmaColumns,
    SigmaRotColumns,
    TemperatureEntry,
)
from truearm.engine.data.readers.rows import Configurations
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import quaternion_from_rotation, rotation_from_vector, turned_about


def quaternions_of_angles(angles: Array, entry: AnglesEntry) -> Array:
    """Return the quaternions (w, x, y, z) of angles ``(rows, 3)`` [rad], NaN where one is missing.

    Turns about axes that move along are multiplied from the left to the right, about fixed ones from the right to the
    left.
    """

    def rotations(whole: Array) -> Array:
        first, second, third = (
            turned_about("xyz".index(axis), column) for axis, column in zip(entry.about, whole.T, strict=True)
        )
        return np.asarray(first @ second @ third if entry.axes == "moving" else third @ second @ first)

    return _complete_quaternions(angles, rotations)


def quaternions_of_vectors(vectors: Array) -> Array:
    """Return the quaternions (w, x, y, z) of rotation vectors ``(rows, 3)`` [rad], NaN where one is missing."""
    return _complete_quaternions(vectors, rotation_from_vector)


def _complete_quaternions(numbers: Array, rotations: Callable[[Array], Array]) -> Array:
    whole = np.isfinite(numbers).all(axis=1)
    converted = np.full((len(numbers), 4), np.nan)
    if whole.any():
        converted[whole] = quaternion_from_rotation(rotations(numbers[whole]))
    return converted


#: Deviations of the coordinates of a reading are called uneven if they are so many times apart in half of all.
_UNEVEN: Final = 2.0
#: A full turn, and a little for rounding [rad]; and in how many rows joints that are degrees are beyond.
_FULL_TURN: Final = 2.0 * np.pi + 0.01
_OFTEN: Final = 0.5
#: A unit behind a name.
_IN_BRACKETS: Final = re.compile(r"[\[({].*")
#: Temperatures of an arm that are meant [degC].
_TEMPERATURES: Final = (-100.0, 200.0)
#: What is taken off a temperature, and by what the rest is multiplied, to have degC.
_SCALES: Final[Mapping[str, tuple[float, float]]] = {"degC": (0.0, 1.0), "degF": (32.0, 5.0 / 9.0), "K": (273.15, 1.0)}


def place_of(cells: Cells, column: str, mapping: Path, entry: str) -> int:
    """Return where a column is, or refuse a name that is not there or not unique."""
    count = cells.names.count(column)
    if count == 1:
        return cells.names.index(column)
    where, cure = f"{mapping}, {entry}", "Check the header line and the delimiter."
    if count:
        places = " and ".join(column_letters(n) if cells.sheet else str(n + 1) for n in _places(cells, column))
        what = f"{cells.source} has {count} columns of this name, columns {places}"
        cure = "Give each its own name, or let columns go by number (layout.header: none, and layout.first_row)."
    else:
        what = f"{cells.source} has no such column"
        with_unit = [name for name in cells.names if _IN_BRACKETS.sub("", name).strip() == column]
        near = with_unit or (nearest_names(column, cells.names, 1) if cells.header is not None else [])
        cure = f"Did you mean {near[0]}?" if near else cure
    raise InputError(what, where=where, came=column, allowed=", ".join(name for name in cells.names if name), cure=cure)


def _places(cells: Cells, column: str) -> list[int]:
    return [place for place, name in enumerate(cells.names) if name == column]


def numbers_of(
    cells: Cells, columns: Mapping[str, str], unit: str, mapping: Path, entry: str, *, deviation: bool = False
) -> Array:
    """Return columns of numbers [SI], ``(rows, columns)``, NaN where nothing is."""
    places = [place_of(cells, column, mapping, f"{entry}.{name}") for name, column in columns.items()]
    return np.column_stack([cells.numbers(place, unit, missing=True, deviation=deviation) for place in places])


def refuse_second_header(cells: Cells, content: MappingFile) -> None:
    """Refuse a table whose first row below the header holds no number where all numbers belong: more headings."""
    columns = [column for entry in content.readings for column in (entry.position | entry.turned).values()]
    if content.joints is not None and content.joints.file is None:
        columns += content.joints.columns
    places = [cells.names.index(column) for column in columns if column in cells.names]
    texts = [cells.columns[place][0].replace(",", ".") for place in places]
    absent = {"", *(cells.absent or ())}
    other = next((place for place, text in zip(places, texts, strict=True) if text not in absent), None)
    if other is None or any(as_number(text) is not None for text in texts) or len(cells.lines) < 2:
        return
    raise InputError(
        "this row holds no numbers, like a second line of headings"
        if cells.header is not None
        else "this row holds no numbers, like a line of headings",
        where=cells.place(0, other),
        came=cells.columns[other][0],
        allowed="one line of headings, then rows of numbers",
        cure="Name the line of headings (layout.header) and the first line with data (layout.first_row).",
    )


def quaternions(cells: Cells, content: MappingFile, mapping: Path) -> Array | None:
    """Return the orientation of each reading as a quaternion, ``(rows times readings, 4)``; None without any."""
    if not any(entry.has_orientation for entry in content.readings):
        return None
    parts = [_turned(cells, entry, mapping, f"readings[{n}]") for n, entry in enumerate(content.readings, 1)]
    return np.stack(parts, axis=1).reshape(-1, 4)


def _turned(cells: Cells, entry: ReadingEntry, mapping: Path, name: str) -> Array:
    if entry.angles is not None:
        angles = numbers_of(cells, entry.turned, entry.angles.unit, mapping, name)
        return quaternions_of_angles(angles, entry.angles)
    if entry.rotation_vector is not None:
        return quaternions_of_vectors(numbers_of(cells, entry.turned, entry.rotation_vector.unit, mapping, name))
    if entry.quaternion:
        return numbers_of(cells, entry.quaternion, "1", mapping, name)
    return np.full((len(cells.lines), 4), np.nan)


def deviations(cells: Cells, content: MappingFile, mapping: Path, name: Literal["sigma", "sigma_rot"]) -> Array | None:
    """Return the standard deviation of each reading [m, rad], ``(rows times readings,)``; None if there is none.

    Of three columns it is the root of the mean square, which keeps the variance of the whole.
    """
    value = getattr(content, name)
    if value is not None:
        sigma = sized_si(value.value, value.unit, f"{mapping}, {name}.value", deviation=True)
        return np.full(len(cells.lines) * len(content.readings), sigma)
    entries: list[SigmaColumns | SigmaRotColumns | None] = [getattr(entry, name) for entry in content.readings]
    if not any(entries):
        return None
    parts = []
    for number, entry in enumerate(entries, 1):
        if entry is None:
            parts.append(np.full(len(cells.lines), np.nan))
            continue
        columns = {f"columns[{n}]": column for n, column in enumerate(entry.columns, 1)}
        each = numbers_of(cells, columns, entry.unit, mapping, f"readings[{number}].{name}", deviation=True)
        parts.append(np.sqrt(np.mean(each**2, axis=1)) / entry.coverage)
    return np.stack(parts, axis=1).reshape(-1)


SIGMA_UNEVEN: Final = Rule(
    "sigma-uneven",
    "note",
    "deviations of the three coordinates of a reading, or of its three angles, that are twice apart or more in half "
    "of the readings: a tracker knows distances better than angles. Of their mean square the root is taken, so that "
    "the variance of the whole stays; the best coordinate counts less than it could",
)


def uneven_deviations(cells: Cells, content: MappingFile, mapping: Path) -> list[Notice]:
    """Say if deviations of the three coordinates of a reading are far apart: a reading has one for all of them."""
    notices: list[Notice] = []
    for name, whole in (("sigma", "x, y and z"), ("sigma_rot", "the three angles")):
        ratios = []
        for number, reading in enumerate(content.readings, 1):
            entry: SigmaColumns | SigmaRotColumns | None = getattr(reading, name)
            if entry is None or len(entry.columns) != 3:
                continue
            columns = {f"columns[{n}]": column for n, column in enumerate(entry.columns, 1)}
            each = numbers_of(cells, columns, entry.unit, mapping, f"readings[{number}].{name}", deviation=True)
            each = each[np.isfinite(each).all(axis=1)]
            ratios.append(each.max(axis=1) / each.min(axis=1))
        apart = np.concatenate([*ratios, np.zeros(0)])
        if not len(apart) or np.median(apart) < _UNEVEN:
            continue
        notices.append(
            SIGMA_UNEVEN(
                f"The deviations of {whole} of one reading are {np.median(apart):.2g} times apart in half of the "
                f"readings or more, and up to {apart.max():.2g} times. Data have one {name} for all three, the root of "
                "their mean square: the best coordinate counts less than it could, and the worst one more."
            )
        )
    return notices


def unlikely_radians(
    cells: Cells, content: MappingFile, entry: JointsEntry, joints: Cells | None, mapping: Path
) -> list[Notice]:
    """Say if numbers that are read as radians go beyond a full turn, as degrees do.

    An angle of an orientation never needs to. A joint may, so that half of the rows must have one.

    Args:
        entry: What the mapping says of the joints.
        joints: The table that has the columns that it names; None if it names none.
    """
    notices: list[Notice] = []
    for number, reading in enumerate(content.readings, 1):
        for name, turned in (("angles", reading.angles), ("rotation_vector", reading.rotation_vector)):
            if turned is not None and turned.unit == "rad":
                read = numbers_of(cells, reading.turned, turned.unit, mapping, f"readings[{number}]")
                large = np.nanmax(np.abs(read), axis=1, initial=0.0)
                if (large > _FULL_TURN).any():
                    notices.append(
                        _of_radians(
                            large, f"orientations ({', '.join(turned.columns)})", f"readings[{number}].{name}.unit"
                        )
                    )
    turning = [column for column, unit in zip(entry.columns, entry.unit_of_each, strict=True) if unit == "rad"]
    if joints is not None and turning:
        named = {f"columns[{n}]": column for n, column in enumerate(turning, 1)}
        of_unit = "joints.unit" if entry.units is None else "joints.units"
        large = np.abs(numbers_of(joints, named, "rad", mapping, "joints")).max(axis=1)
        if float(np.mean(large > _FULL_TURN)) >= _OFTEN:
            notices.append(_of_radians(large, f"joints ({', '.join(turning)})", of_unit))
    return notices


RADIANS_UNLIKELY: Final = Rule(
    "radians-unlikely",
    "warning",
    "angles of orientations beyond a full turn where the mapping says `rad`, or joints beyond one in half of the "
    "rows: they look like degrees. Degrees that all are below 6 cannot be told from radians; [`truearm "
    "check`](check.md) with the robot tries the units of the joints",
    gravity=2,
)


def _of_radians(large: Array, subject: str, entry: str) -> Notice:
    rows = int(np.sum(large > _FULL_TURN))
    return RADIANS_UNLIKELY(
        f"The angles of {subject} are read as radians and go beyond a full turn in {rows} of "
        f"{counted(len(large), 'row')}, up to {large.max():.4g}: they look like degrees. Correct {entry} in the "
        "mapping, if they are."
    )


def called_in(content: MappingFile) -> dict[str, str]:
    """Return what the table calls the columns of deviations and quaternions, for messages."""
    names: dict[str, list[str]] = {"sigma": [], "sigma_rot": [], "quaternion": []}
    for entry in content.readings:
        names["quaternion"] += entry.quaternion.values()
        for name, column in entry.deviations.items():
            names[name.partition(".")[0]].append(column)
    return {name: " ".join(dict.fromkeys(columns)) for name, columns in names.items() if columns}


def temperatures(
    cells: Cells, configurations: Configurations, of_row: IntArray, entry: TemperatureEntry, mapping: Path
) -> Array:
    """Return the mean temperature of each configuration's rows [degC], ``(configurations,)``."""
    place = place_of(cells, entry.column, mapping, "temperature.column")
    offset, factor = _SCALES[entry.unit]
    values = (cells.values(place) - offset) * factor
    low, high = _TEMPERATURES
    off = np.flatnonzero((values < low) | (values > high))
    if len(off):
        raise InputError(
            "no arm is that cold or warm",
            where=cells.place(int(off[0]), place),
            came=cells.columns[place][int(off[0])],
            allowed=f"{low / factor + offset:g} to {high / factor + offset:g} {entry.unit}",
            cure="Correct the number, or its unit (temperature.unit in the mapping).",
        )
    count = len(configurations.labels)
    known = np.isfinite(values)
    rows = np.bincount(of_row[known], minlength=count)
    without = np.flatnonzero(rows == 0)
    if len(without):
        own = np.flatnonzero(of_row == without[0])
        raise InputError(
            f"the configuration {configurations.labels[without[0]]!r} has no temperature, and others have one",
            where=cells.place(int(own[0]), place) if len(own) else f"{mapping}, temperature.column",
            allowed="a temperature for each configuration, or none at all",
            cure="Fill the cell, or leave temperature out of the mapping.",
        )
    return np.asarray(np.bincount(of_row[known], values[known], count) / rows)
