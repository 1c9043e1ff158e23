"""Samples over time of tests of performance: ``paths.csv`` and ``settling.csv``, up to a million rows.

Rows are read in blocks: what names a row is looked up in a dictionary of the few combinations that occur, and numbers
are parsed by NumPy. A block with a fault is read again cell by cell, so that the refusal names line and column.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, Words, is_one_line, nearest_names
from truearm.engine.base.files import read_bytes
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.base.units import COLUMN as SIMULATED
from truearm.engine.base.units import LENGTH_UNITS, TIME_UNITS, YES, as_number, checked_unit, from_si
from truearm.engine.data.readers.canonical import refuse_other_separators
from truearm.engine.data.readers.rows import unit_quaternions
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import rotation_from_quaternion
from truearm.iso9283.evaluating.reading import refuse_out_of_order
from truearm.iso9283.planning.records import Names, Samples, resolution_of

_POSITION: Final = ("x", "y", "z")
_QUATERNION: Final = ("qw", "qx", "qy", "qz")
_SHARES: Final = ("velocity", "load")
#: Units of the columns that have one.
_UNITS: Final = {"time": TIME_UNITS, **dict.fromkeys(_POSITION, LENGTH_UNITS), **dict.fromkeys(_SHARES, ("%",))}
_HEADING: Final = re.compile(r"(?P<name>[^\[]*?)\s*(?:\[(?P<unit>[^\]]*)\])?")
#: So many bytes are parsed at once: more takes more memory and is not faster.
_BLOCK: Final = 4_000_000
#: No coordinate and no time that is meant is larger [m, s].
_LARGEST: Final = 1e6

Place = Literal["path", "pose"]
#: Tests of which each file has rows, by what it has in place of a path: ids of
#: :data:`truearm.iso9283.planning.criteria.TESTS`.
TESTS_OF: Final[dict[Place, tuple[str, ...]]] = {
    "path": ("AT", "AT-reorientation", "CR", "AV", "WS"),
    "pose": ("t", "posing-time"),
}
#: Criteria that are evaluated from the samples of a test with another id.
_TEST_OF: Final = {
    "RT": "AT",
    "RT-reorientation": "AT-reorientation",
    "CO": "CR",
    "RV": "AV",
    "FV": "AV",
    "WF": "WS",
    "OV": "t",
}


@dataclass(frozen=True)
class _Header:
    """The columns of a file: place and unit by name, and the line they stand on."""

    source: str
    line: int
    columns: dict[str, tuple[int, str]]
    count: int

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(name for name in self.columns if name not in (*self.numbers, SIMULATED))

    @property
    def numbers(self) -> tuple[str, ...]:
        return tuple(name for name in ("time", *_POSITION, *_QUATERNION) if name in self.columns)

    def at(self, line: int, name: str) -> str:
        return f"{self.source}, line {line}, column {name}"


def read_path_samples(path: Path) -> Samples:
    """Read samples along paths, the canonical ``paths.csv``.

    Columns ``criterion``, ``path``, ``time [s]``, ``x [mm]``, ``y [mm]``, ``z [mm]``; and where they are there
    ``cycle``, ``qw`` to ``qz`` (all or none), ``velocity [%]`` and ``load [%]``. Without a cycle, in a row or at all,
    rows are a stream of a whole test. Time increases within a cycle, and within a stream.

    Raises:
        InputError: If the file cannot be read or a row cannot be used, naming line and column.
    """
    return _read(path, "path")


def read_settling_samples(path: Path) -> Samples:
    """Read samples of the way to a pose, the canonical ``settling.csv``: ``pose`` stands in place of ``path``.

    Every row has a cycle. Otherwise as :func:`read_path_samples`, and it raises the same.
    """
    return _read(path, "pose")


def _read(path: Path, place: Place) -> Samples:
    content = read_bytes(path, "samples_size")
    if b"\n" not in content:  # lines of old Macs end in a carriage return alone
        content = content.replace(b"\r", b"\n")
    source = str(path)
    header, start = _header(content, source, place)
    refuse_beyond("samples_read", content.count(b"\n") - header.line, where=source)
    keys: dict[tuple[str, ...], int] = {}
    codes, numbers, lines = [], [], []
    simulated = False
    for first, texts in _blocks(content, start, header):
        simulated = simulated or _simulated(texts, first, header)
        codes.append(_codes(texts, first, header, keys))
        numbers.append(_numbers(texts, first, header))
        lines.append(first)
    if not codes:
        raise InputError("the file holds a header and no rows", where=source, cure="Check that it was exported whole.")
    return _samples(
        header, place, keys, np.concatenate(codes), np.concatenate(numbers), np.concatenate(lines), simulated
    )


def _header(content: bytes, source: str, place: Place) -> tuple[_Header, int]:
    """Return the columns and where the rows begin."""
    start = 3 if content.startswith(b"\xef\xbb\xbf") else 0
    line = 0
    while True:
        if start >= len(content):
            raise InputError("the file is empty", where=source)
        end = content.find(b"\n", start)
        end = len(content) if end < 0 else end
        line += 1
        try:
            text = content[start:end].decode()
        except UnicodeDecodeError as error:
            raise _not_utf8(source, line) from error
        start = end + 1
        if text.strip():
            break
    refuse_other_separators(text, f"{source}, line {line}")
    refuse_beyond("columns", text.count(",") + 1, where=f"{source}, line {line}")
    try:
        names = [name.strip() for name in next(csv.reader([text], skipinitialspace=True))]
    except csv.Error as error:
        raise InputError(
            "the names of the columns cannot be read",
            where=f"{source}, line {line}",
            came=str(error),
            cure="Separate them by commas, and end every line with a line feed.",
        ) from error
    return _Header(source, line, _columns(names, f"{source}, line {line}", place), len(names)), start


def _columns(headings: Sequence[str], header: str, place: Place) -> dict[str, tuple[int, str]]:
    cycle = () if place == "path" else ("cycle",)
    needed = ("criterion", place, *cycle, "time", *_POSITION)
    units = {**dict.fromkeys(_POSITION, "mm"), "time": "s", **dict.fromkeys(_SHARES, "%")}
    known = {
        name: f"{name} [{units[name]}]" if name in units else name
        for name in dict.fromkeys((*needed, "cycle", *_QUATERNION, *_SHARES))
    }
    allowed = ", ".join(known.values())
    columns: dict[str, tuple[int, str]] = {}
    known[SIMULATED] = SIMULATED
    for number, heading in enumerate(headings):
        location = f"{header}, column {number + 1}"
        match = _HEADING.fullmatch(heading)
        name, unit = (match["name"], match["unit"]) if match else (heading, None)
        if name not in known:
            near = nearest_names(name, known, 1, 0.6)
            raise InputError(
                "the column is not known" if heading else "the column has no name",
                where=location,
                came=heading or None,
                allowed=allowed,
                cure=f"Did you mean {known[near[0]]}?" if near else "Rename it, or leave it out.",
            )
        if name in columns:
            raise InputError(f"the column {name} appears twice", where=location, cure="Remove one of them.")
        if name in _UNITS:
            unit = checked_unit(unit, _UNITS[name], f"{location}, {heading}")
        elif unit is not None:
            raise InputError(
                "this column takes no unit", where=location, came=heading, allowed=name, cure="Remove the unit."
            )
        columns[name] = (number, unit or "1")
    for name in (*needed, *(_QUATERNION if any(part in columns for part in _QUATERNION) else ())):
        if name not in columns:
            raise InputError(f"the column {name} is missing", where=header, allowed=allowed, cure=f"Add {known[name]}.")
    return columns


def _blocks(content: bytes, start: int, header: _Header) -> Iterator[tuple[NDArray[np.intp], list[str]]]:
    """Yield rows block by block: their lines in the file, and their texts; blank lines are left out."""
    line = header.line + 1
    while start < len(content):
        end = content.find(b"\n", min(start + _BLOCK, len(content)))
        end = len(content) if end < 0 else end + 1
        try:
            texts = content[start:end].decode().split("\n")
        except UnicodeDecodeError as error:
            raise _not_utf8(header.source, line + content.count(b"\n", start, start + error.start)) from error
        start = end
        if not texts[-1]:
            texts.pop()
        numbers = np.arange(line, line + len(texts))
        line += len(texts)
        if any(not text or text.isspace() for text in texts):
            filled = np.array([bool(text.strip()) for text in texts])
            texts, numbers = [text for text in texts if text.strip()], numbers[filled]
        if texts:
            yield numbers, texts


def _not_utf8(source: str, line: int) -> InputError:
    return InputError("the file is not UTF-8 text", where=f"{source}, line {line}", cure="Save it as UTF-8.")


def _cells(text: str, line: int, header: _Header) -> list[str]:
    """Return the cells of one row, quotes removed."""
    try:
        cells = [cell.strip() for cell in next(csv.reader([text], skipinitialspace=True))]
    except csv.Error as error:
        raise InputError(
            "the cells of the row cannot be read",
            where=f"{header.source}, line {line}",
            came=Words("a carriage return within it" if "\r" in text.rstrip() else str(error)),
            cure="Separate them by commas, end every line with a line feed, and close quotes.",
        ) from error
    if len(cells) != header.count:
        raise InputError(
            "the row does not have as many cells as the header",
            where=f"{header.source}, line {line}",
            came=f"{len(cells)} cells",
            allowed=f"{header.count} cells",
            cure="Check for a missing cell, for decimal commas, or for a comma in a name without quotes around it.",
        )
    return cells


def _codes(
    texts: list[str], lines: NDArray[np.intp], header: _Header, keys: dict[tuple[str, ...], int]
) -> NDArray[np.intp]:
    """Return which combination of what names a row each row has; new ones are added, and checked, as they come."""
    places = [header.columns[name][0] for name in header.labels]
    picked = itemgetter(*places)
    last = max(places) + 1
    commas = header.count - 1
    code = np.empty(len(texts), dtype=np.intp)
    beginnings: dict[str, int] = {}
    in_front = sorted(places) == list(range(last))
    for row, text in enumerate(texts):
        plain = '"' not in text and text.count(",") == commas
        if plain and in_front:  # the numbers behind are left whole, which is faster
            beginning = text.rsplit(",", commas + 1 - last)[0]
            if (known := beginnings.get(beginning)) is not None:
                code[row] = known
                continue
        key = picked(text.split(",", last) if plain else _cells(text, int(lines[row]), header))
        key = tuple(cell.strip() for cell in key)
        if key not in keys:
            _check_labels(dict(zip(header.labels, key, strict=True)), int(lines[row]), header)
            keys[key] = len(keys)
        code[row] = keys[key]
        if plain and in_front:
            beginnings[beginning] = keys[key]
    return code


def _simulated(texts: list[str], lines: NDArray[np.intp], header: _Header) -> bool:
    """Return whether a virtual instrument read any of these rows."""
    if SIMULATED not in header.columns:
        return False
    place = header.columns[SIMULATED][0]
    rows = zip(texts, lines.tolist(), strict=True)
    return any(_cells(text, line, header)[place].lower() == YES for text, line in rows)


def _check_labels(labels: dict[str, str], line: int, header: _Header) -> None:
    place: Place = "path" if "path" in labels else "pose"
    known = TESTS_OF[place]
    criterion = labels["criterion"]
    if criterion not in known:
        near = nearest_names(criterion, known, 1, 0.6)
        cure = f"Did you mean {near[0]}?" if near else "Name the test for which it was measured."
        if (test := _TEST_OF.get(criterion)) in known:
            cure = f"Name the test: {test}."
        if criterion in TESTS_OF["pose" if place == "path" else "path"]:
            cure = f"Samples of {criterion} belong into the file of {'paths' if place == 'pose' else 'settling'}."
        raise InputError(
            "there is no such test in this file",
            where=header.at(line, "criterion"),
            came=criterion or None,
            allowed=", ".join(known),
            cure=cure,
        )
    if not labels[place] or not is_one_line(labels[place]):
        raise InputError(
            "the cell is empty" if not labels[place] else "the text has a line break or another control character",
            where=header.at(line, place),
            allowed=f"the name of a {place} of the plan",
            cure="Fill the cell.",
        )
    cycle = labels.get("cycle", "")
    if not (cycle.isascii() and cycle.isdigit() and 0 < len(cycle) <= 9 and int(cycle)) and (cycle or place == "pose"):
        raise InputError(
            "this is no number of a cycle",
            where=header.at(line, "cycle"),
            came=cycle or None,
            allowed="1, 2, 3 and so on" + (", or nothing where a whole test is one stream" if place == "path" else ""),
            cure="Count the cycles of each test from 1.",
        )
    for name in _SHARES:
        if name not in labels:
            continue
        share = as_number(labels[name])
        lowest = 0.0 if name == "load" else math.ulp(0.0)
        if share is None or not lowest <= share <= 100.0:
            raise InputError(
                f"the {name} cannot be used",
                where=header.at(line, name),
                came=labels[name],
                allowed=f"percent of the rated {name}, {'0' if name == 'load' else 'above 0'} to 100",
                cure="A robot is tested up to what it is rated for: correct the cell.",
            )


def _numbers(texts: list[str], lines: NDArray[np.intp], header: _Header) -> Array:
    """Return the columns of numbers in the units of the file, ``(rows, columns)``."""
    places = [header.columns[name][0] for name in header.numbers]
    try:
        numbers = np.loadtxt(texts, delimiter=",", usecols=places, comments=None, quotechar='"', ndmin=2)
        if len(numbers) == len(texts) and (np.abs(numbers) <= _LARGEST * 1e6).all():
            return numbers
    except ValueError:
        pass
    numbers = np.empty((len(texts), len(places)))
    for row, text in enumerate(texts):
        cells = _cells(text, int(lines[row]), header)
        for column, (name, place) in enumerate(zip(header.numbers, places, strict=True)):
            number = as_number(cells[place])
            if number is None or abs(number) > _LARGEST * 1e6:
                raise InputError(
                    "the cell is empty" if not cells[place] else "a number belongs here",
                    where=header.at(int(lines[row]), name),
                    came=cells[place] or None,
                    allowed="a finite number with a decimal point",
                    cure="Leave out a sample of which a part was not read.",
                )
            numbers[row, column] = number
    return numbers


def _samples(
    header: _Header,
    place: Place,
    keys: dict[tuple[str, ...], int],
    code: NDArray[np.intp],
    numbers: Array,
    lines: NDArray[np.intp],
    simulated: bool,
) -> Samples:
    of = {name: column for column, name in enumerate(header.numbers)}
    position = np.empty((len(code), 3))
    for axis, name in enumerate(_POSITION):
        position[:, axis] = numbers[:, of[name]] / from_si(1.0, header.columns[name][1])
    time = np.ascontiguousarray(numbers[:, of["time"]]) / from_si(1.0, header.columns["time"][1])
    large = np.flatnonzero((np.abs(position) > _LARGEST).any(axis=1) | (np.abs(time) > 1e9))
    if len(large):
        raise InputError(
            "the number is too large to be plausible",
            where=f"{header.source}, line {lines[large[0]]}",
            allowed="coordinates up to 1000 km, times up to 1e9 s",
            cure="Correct the number, or its unit.",
        )
    rotation = None
    if "qw" in of:
        q = unit_quaternions(numbers[:, [of[part] for part in _QUATERNION]], header.source, lines.tolist())
        rotation = rotation_from_quaternion(q)
    order = np.argsort(code, kind="stable")
    refuse_out_of_order(header.source, time, code, order, lines)
    labels = {name: [key[number] for key in keys] for number, name in enumerate(header.labels)}

    def column(name: str) -> Names:
        few = Names.of(labels[name])
        return Names(few.names, few.code[code])

    def share(name: str) -> Array:
        few = np.array([float(text) / 100.0 for text in labels[name]]) if name in labels else np.ones(len(keys))
        return np.asarray(few[code])

    cycles = np.array([int(text or 0) for text in labels.get("cycle", [""] * len(keys))], dtype=np.intp)
    return Samples(
        criterion=column("criterion"),
        place=column(place),
        cycle=cycles[code],
        velocity=share("velocity"),
        load=share("load"),
        time=time,
        position=position,
        rotation=rotation,
        line=lines,
        source=header.source,
        resolution=_resolution(header, numbers),
        simulated=simulated,
    )


def _resolution(header: _Header, numbers: Array) -> float:
    """Return the step to which positions were rounded [m]."""
    units = {header.columns[axis][1] for axis in _POSITION}
    if len(units) > 1:
        return 0.0
    columns = numbers[:, [header.numbers.index(axis) for axis in _POSITION]]
    return resolution_of(columns, np.zeros(len(columns), dtype=np.intp)) / from_si(1.0, units.pop())
