"""A folder into which an instrument's software writes files of readings, or appends rows to them."""

from __future__ import annotations

import codecs
import hashlib
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, counted
from truearm.engine.base.files import read_bytes
from truearm.engine.base.units import as_number, to_si
from truearm.engine.data.readers.cells import Cells, lines_of, read_cells
from truearm.engine.data.readers.mapping import MappingFile
from truearm.engine.data.readers.measuring_order import moments
from truearm.engine.data.readers.row_values import place_of
from truearm.engine.data.readers.rows import QUATERNION_TOLERANCE
from truearm.engine.data.readers.table import MappedRows, mapped_rows, read_mapping
from truearm.engine.robot.chain import Array
from truearm.measuring.session import Reading, Session
from truearm.measuring.sources import Incoming

#: Files of other endings are not read: pictures, databases, what is still being written.
SUFFIXES: Final = (".csv", ".txt", ".asc", ".dat", ".tsv")
#: How long to wait before the folder is looked at again [s].
_PAUSE: Final = 0.1
_MARK: Final = 12
#: So many files are watched.
MOST_FILES: Final = 2000
#: So many broken rows are named; others are counted.
_NAMED: Final = 5


@dataclass
class _File:
    """How far a file was read."""

    taken: int = 0  #: How many of its lines.
    digest: bytes = b""  #: Of their text.
    state: tuple[int, int] = (-1, -1)  #: Its size and time when it was read last.
    again: bool = True  #: Whether it was replaced, so that rows that are known by their text are passed over.
    open_end: bool = False  #: Whether its last line has no end.


@dataclass
class _Counts:
    broken: list[str] = field(default_factory=list)
    replaced: list[str] = field(default_factory=list)
    not_read: dict[str, str] = field(default_factory=dict)


ROWS_BROKEN: Final = Rule("rows-broken", "warning", "rows that could not be read")
FILE_REPLACED: Final = Rule("file-replaced", "warning", "rows that were read are no longer in their file")
NOT_READ: Final = Rule("not-read", "note", "what is not read in the folder", gravity=0)
LINE_WITHOUT_END: Final = Rule(
    "line-without-end", "warning", "the last line of a file has no line break, and is not read", gravity=0
)


class WatchedFolder:
    """A source of readings: the rows of the files in a folder, as a mapping reads them.

    Only whole lines are read, those that end with a line break. A row that cannot be read is named, and the others are
    kept. Rows that a log holds already are passed over, so that measuring can go on.

    Args:
        folder: That is watched, without the folders in it.
        mapping: Its mapping file, or the name of a preset. The joint positions are those of the plan.
        labels: Of the plan, for tables in which every row is a configuration of its own.
        clock: What time it is [s].

    Raises:
        InputError: If there is no such folder, or the mapping cannot be used here.
    """

    kind: Final = "watch"

    def __init__(
        self, folder: Path, mapping: Path, labels: tuple[str, ...], clock: Callable[[], float] = time.time
    ) -> None:
        if not folder.is_dir():
            raise InputError(
                "there is no such folder",
                parameter="watch",
                came=str(folder),
                cure="Make it, or name the folder into which the instrument's software writes.",
            )
        self.folder, self.mapping, self.content = folder, mapping, read_mapping(mapping)
        _refuse_other_mappings(self.content, mapping)
        self._labels, self._clock = labels, clock
        self._files: dict[str, _File] = {}
        self._known: set[tuple[str, str]] | None = None
        self._messages: list[str] = []
        self._counts = _Counts()

    @property
    def names(self) -> tuple[str, ...] | None:
        """Names of the points that the mapping fixes; None if the rows name them."""
        fixed = [entry.target for entry in self.content.readings]
        return None if None in fixed else tuple(str(name) for name in fixed)

    @property
    def _pattern(self) -> str:
        return f"{self.mapping}, names.pattern"

    @property
    def waiting(self) -> str:
        """For what it waits."""
        return f"rows in {self.folder}"

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What could not be read."""
        notices = []
        counts = self._counts
        if counts.broken:
            others = len(counts.broken) - _NAMED
            more = f" and {others} more" if others > 0 else ""
            notices.append(
                ROWS_BROKEN(
                    f"{counted(len(counts.broken), 'row')} could not be read: {' '.join(counts.broken[:_NAMED])}{more}"
                )
            )
        if counts.replaced:
            notices.append(
                FILE_REPLACED(
                    f"{', '.join(dict.fromkeys(counts.replaced))}: rows that were read are no longer there, or have "
                    "changed. What was read stays as it was; rows that differ count as new."
                )
            )
        if counts.not_read:
            words = "; ".join(f"{name}: {why.rstrip('.')}" for name, why in sorted(counts.not_read.items())[:_NAMED])
            others = len(counts.not_read) - _NAMED
            notices.append(
                NOT_READ(f"Not read in {self.folder}: {words}{f' and {others} more' if others > 0 else ''}.")
            )
        open_ends = [name for name, file in self._files.items() if file.open_end]
        if open_ends:
            notices.append(
                LINE_WITHOUT_END(
                    f"The last line of {', '.join(open_ends)} has no line break at its end and is not read: it may be "
                    "half of a row."
                )
            )
        return tuple(notices)

    def poll(self, session: Session, seconds: float) -> list[Incoming]:
        """Return the readings of new rows, waiting for the first at most some time."""
        if self._known is None:
            self._known = {(e.reading.origin, e.reading.mark) for e in session.entries if e.reading is not None}
        until = time.monotonic() + seconds
        while True:
            incomings = [Incoming(reading) for reading in self._new()]
            left = until - time.monotonic()
            if incomings or left <= 0:
                return incomings
            time.sleep(min(_PAUSE, left))

    def messages(self) -> list[str]:
        """Return what could not be read since it was asked last."""
        messages, self._messages = self._messages, []
        return messages

    def close(self) -> None:
        """Nothing is held."""

    def _new(self) -> list[Reading]:
        readings: list[Reading] = []
        for path, state in self._listed_files():
            file = self._files.setdefault(path.name, _File())
            if file.state != state:
                try:
                    readings += self._rows(path, file)
                except InputError as error:
                    self._not_read(path.name, str(error))
                file.state = state
        return readings

    def _listed_files(self) -> list[tuple[Path, tuple[int, int]]]:
        """Return the files that are read with their size and time, the oldest first."""
        files: list[tuple[Path, tuple[int, int]]] = []
        try:
            paths = sorted(self.folder.iterdir())
        except OSError:
            self._not_read(".", "the folder is gone")
            return []
        for path in paths:
            name = path.name
            if name.startswith("."):
                continue
            try:
                state = path.lstat()
                why = (
                    "a link"
                    if path.is_symlink()
                    else "no file"
                    if not path.is_file()
                    else f"ends with none of {', '.join(SUFFIXES)}"
                    if path.suffix.lower() not in SUFFIXES
                    else "too many files"
                    if len(files) >= MOST_FILES
                    else ""
                )
            except OSError:  # it is gone again
                continue
            if why:
                self._not_read(name, why)
            else:
                files.append((path, (state.st_size, state.st_mtime_ns)))
        return sorted(files, key=lambda file: (file[1][1], file[0].name))

    def _not_read(self, name: str, why: str) -> None:
        if self._counts.not_read.get(name) != why:
            self._counts.not_read[name] = why
            self._messages.append(f"{name} is not read: {why}")

    def _rows(self, path: Path, file: _File) -> list[Reading]:
        """Return the readings of the lines of a file that are new."""
        lines = self._lines(path, file)
        self._counts.not_read.pop(path.name, None)
        if file.taken > len(lines) or (file.taken and _digest(lines[: file.taken]) != file.digest):
            self._counts.replaced.append(path.name)
            self._messages.append(f"{path.name}: rows that were read are no longer there, or have changed")
            file.taken, file.again = 0, True
        layout = self.content.layout
        first = max(file.taken, layout.header or 0, (layout.first_row or 1) - 1)
        new = [number for number in range(first, len(lines)) if self._is_row(lines[number])]
        if len(lines) < (layout.header or 0) or not new:
            return []
        readings = self._parsed(path, lines, new)
        seen = self._known or set()
        if file.again:  # in this run every row counts once, by its place
            readings = [reading for reading in readings if (reading.origin, reading.mark) not in seen]
            marks = {(origin.partition(", line ")[0], mark) for origin, mark in seen}
            readings = [r for r in readings if (path.name, r.mark) not in marks]
        seen |= {(reading.origin, reading.mark) for reading in readings}
        self._known = seen
        file.taken, file.digest, file.again = len(lines), _digest(lines), False
        return readings

    def _lines(self, path: Path, file: _File) -> list[str]:
        """Return the whole lines of a file."""
        content = read_bytes(path)
        encoding = self.content.layout.encoding
        decoder = codecs.getincrementaldecoder("utf-8-sig" if encoding == "utf-8" else encoding)()
        try:
            text = decoder.decode(content)
        except UnicodeError as error:
            raise InputError(
                f"the file is not {encoding} text",
                where=path.name,
                cure="Name its encoding in the mapping (layout.encoding), such as cp1252 or utf-16.",
            ) from error
        lines = [*lines_of(text)]
        file.open_end = bool(lines) and not lines[-1].endswith(("\n", "\r")) and self._is_row(lines[-1])
        return lines[:-1] if lines and not lines[-1].endswith(("\n", "\r")) else lines

    def _is_row(self, line: str) -> bool:
        comment = self.content.layout.comment
        return bool(line.strip()) and not (comment is not None and line.lstrip().startswith(comment))

    def _parsed(self, path: Path, lines: list[str], new: list[int]) -> list[Reading]:
        """Return the readings of some lines; of those that cannot be read together every one is tried by itself."""
        try:
            return self._readings(path, lines, new)
        except InputError as error:
            if str(error.where).startswith(f"{self.mapping},"):  # of the columns: then no row can be read
                raise
        readings: list[Reading] = []
        for number in new:
            try:
                readings += self._readings(path, lines, [number])
            except InputError as error:
                self._counts.broken.append(str(error))
                self._messages.append(str(error))
        return readings

    def _readings(self, path: Path, lines: list[str], new: list[int]) -> list[Reading]:
        content, layout = self.content, self.content.layout
        chosen = {*new, *(() if layout.header is None else (layout.header - 1,))}
        last = max(chosen, default=-1)
        bare = ((line.rstrip("\r\n") if number in chosen else "") for number, line in enumerate(lines[: last + 1]))
        text = "".join(f"{line}\n" for line in bare)
        cells = read_cells(text, path.name, layout.layout)
        try:
            rows = mapped_rows(cells, content, self.mapping)
        except InputError as error:
            if content.names is not None and content.names.others == "skip" and error.where == self._pattern:
                return []
            raise
        marks = {number + 1: _mark(lines[number]) for number in new}
        ordinals = {}
        if rows.labels is None:
            first = max(layout.header or 0, (layout.first_row or 1) - 1)
            all_rows = [number + 1 for number in range(first, len(lines)) if self._is_row(lines[number])]
            ordinals = {line: place for place, line in enumerate(all_rows)}
        return _readings_of(rows, content, self.mapping, marks, self._time(rows.cells), self._labels, ordinals)

    def _time(self, cells: Cells) -> Array:
        """Return when each row was measured [s], ``(rows,)``: by its column of times, or when it was found."""
        order = self.content.order
        if order is None or order.time is None:
            return np.full(len(cells.lines), self._clock())
        places = [place_of(cells, column, self.mapping, f"order.{name}") for name, column in order.names.items()]
        return moments(cells, places, order)


def _readings_of(
    rows: MappedRows,
    content: MappingFile,
    mapping: Path,
    marks: dict[int, str],
    times: Array,
    labels: tuple[str, ...],
    ordinals: dict[int, int],
) -> list[Reading]:
    """Return the readings of rows; an empty one of a point that a wide row has beside others is none."""
    cells, entries = rows.cells, len(content.readings)
    dwell = _dwell(cells, content, mapping)
    turned = None if rows.quaternion is None else _unit(rows.quaternion, cells)
    readings = []
    for number, name in enumerate(rows.targets):
        row = number // entries
        line = cells.lines[row]
        if rows.labels is not None:
            label = rows.labels[row]
        else:  # row n is the nth configuration
            place = ordinals[line]
            label = labels[place] if place < len(labels) else f"row {place + 1}"
        position = rows.position[number]
        if name in content.references and np.isnan(position).any():
            continue
        quaternion = None if turned is None or np.isnan(turned[number]).any() else turned[number]
        readings.append(
            Reading(
                name=name,
                time=float(times[row]),
                position=np.where(np.isnan(position).any(), np.nan, position),
                quaternion=quaternion,
                label=label,
                sigma=_known_number(rows.sigma, number),
                sigma_rot=None if quaternion is None else _known_number(rows.sigma_rot, number),
                origin=f"{cells.source}, line {line}",
                mark=f"{marks[line]}/{number % entries}",
                **{key: values[row] for key, values in dwell.items()},  # type: ignore[arg-type]
            )
        )
    return readings


def _known_number(values: Array | None, number: int) -> float | None:
    return None if values is None or np.isnan(values[number]) else float(values[number])


def _unit(quaternions: Array, cells: Cells) -> Array:
    """Return quaternions of length 1 ``(n, 4)``, or refuse others."""
    length = np.sqrt((quaternions**2).sum(axis=1, keepdims=True))
    off = np.flatnonzero(np.abs(length[:, 0] - 1.0) > QUATERNION_TOLERANCE)
    if len(off):
        line = cells.lines[int(off[0]) // (len(quaternions) // len(cells.lines))]
        raise InputError(
            "the quaternion does not have length 1",
            where=f"{cells.source}, line {line}",
            came=f"{length[off[0], 0]:g}",
            allowed=f"1 within {QUATERNION_TOLERANCE:g}",
        )
    return np.asarray(quaternions / length)


def _dwell(cells: Cells, content: MappingFile, mapping: Path) -> dict[str, list[float | int | None]]:
    """Return what a table says of how its rows were measured."""
    entry = content.dwell
    if entry is None:
        return {}
    columns: dict[str, list[float | int | None]] = {}
    for name in ("deviation", "settling", "samples", "breaks"):
        column = getattr(entry, name)
        if column is None:
            continue
        place = place_of(cells, column, mapping, f"dwell.{name}")
        values: list[float | int | None] = []
        for row, text in enumerate(cells.columns[place]):
            number = None if text in ("", *(cells.absent or ())) else as_number(text.replace(cells.decimal, "."))
            whole = name in ("samples", "breaks")
            is_sound = number is not None and number >= 0 and (not whole or number == int(number))
            if text not in ("", *(cells.absent or ())) and not is_sound:
                raise InputError(
                    "a count belongs here" if whole else "a length belongs here",
                    where=cells.place(row, place),
                    came=text,
                    allowed="a whole number, 0 or more" if whole else "a number, 0 or more",
                )
            if number is None:
                values.append(0 if name == "breaks" else None)
            else:
                values.append(int(number) if whole else to_si(number, str(entry.unit)))
        columns[name] = values
    return columns


def _refuse_other_mappings(content: MappingFile, mapping: Path) -> None:
    """Refuse mappings of tables that are not read while they grow."""
    if content.layout.sheet is not None:
        raise InputError(
            "a workbook is not read while it is written",
            where=f"{mapping}, layout.sheet",
            cure="Let the software write text, or import the workbook when all is measured.",
        )
    if content.joints is not None and content.joints.file is None:
        raise InputError(
            "the joint positions are those of the plan, and the mapping takes them from the table",
            where=f"{mapping}, joints",
            allowed="no entry joints, or joints: {file: plan.csv}",
            cure="Leave joints out; or import the table when all is measured.",
        )


def _digest(lines: list[str]) -> bytes:
    # Without line breaks: of one of two characters the first may come before the second.
    return hashlib.sha256("\n".join(line.rstrip("\r\n") for line in lines).encode("utf-8", "surrogatepass")).digest()


def _mark(line: str) -> str:
    return hashlib.sha256(line.strip().encode("utf-8", "surrogatepass")).hexdigest()[:_MARK]
