"""The log of a session on disk: every reading is there before the next one is asked for.

A line is appended and synchronised at a time, with a checksum at its end. So whatever stops the machine leaves whole
lines and, at most, a part of one: that reading was not confirmed to anybody, and its part is cut off when the measuring
goes on. A line that is not the last and whose checksum does not fit was changed by somebody, and is refused.
"""

from __future__ import annotations

import csv
import io
import os
import sys
import zlib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.files import read_bytes, reason_of
from truearm.measurement.measuring.readings import REASONS, Reading
from truearm.measurement.measuring.session import Entry
from truearm.modeling.chain import Array
from truearm.printable import printable
from truearm.units import as_number, to_si, written

LOG: Final = "readings.csv"
_COLUMNS: Final = (
    "number",
    "event",
    "time [s]",
    "configuration",
    "name",
    "role",
    "x [mm]",
    "y [mm]",
    "z [mm]",
    "qw",
    "qx",
    "qy",
    "qz",
    "sigma [mm]",
    "sigma_rot [mrad]",
    "samples",
    "deviation [mm]",
    "settling [mm]",
    "breaks",
    "reason",
    "words",
    "of",
    "origin",
    "mark",
    "check",
)
_HEADER: Final = ",".join(_COLUMNS)
_ROLES: Final = ("target", "nest")
_EVENTS: Final = ("reading", "aside", "left")


class ReadingLog:
    """An open log; one process at a time has it.

    Args:
        folder: In which it is, or is made.

    Raises:
        InputError: If another process measures there, the log was changed, or it cannot be written.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / LOG
        try:
            if self.path.is_symlink() or (self.path.exists() and not self.path.is_file()):
                raise InputError("a log of readings belongs here, and this is none", where=str(self.path))
            self._stream = self.path.open("ab", buffering=0)
        except OSError as error:
            raise _unwritable(self.path, error) from error
        try:
            self._lock()
            content = read_bytes(self.path)
            self.torn, self.entries = self._read(content)
            if self.torn:
                self._stream.truncate(len(content) - self.torn)
                os.fsync(self._stream.fileno())
            if len(content) == self.torn:
                self._put(_HEADER)
                _synchronise(folder)
        except BaseException:
            self._stream.close()
            raise

    def append(self, entry: Entry) -> None:
        """Write one line; when this returns it is on disk.

        Raises:
            InputError: If it cannot be written.
        """
        line = _line(entry)
        self._put(f"{line},{_check(line)}")

    def close(self) -> None:
        """Let another process have it."""
        self._stream.close()

    def _lock(self) -> None:
        if sys.platform == "win32":
            return
        import fcntl

        try:
            fcntl.flock(self._stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                "another process is measuring into this folder",
                where=str(self.path.parent),
                cure="End it, or choose another `out`.",
            ) from None
        except OSError:  # a file system without locks
            pass

    def _put(self, line: str) -> None:
        whole = f"{line}\n".encode()
        try:
            written_bytes = self._stream.write(whole)
            if written_bytes != len(whole):
                raise OSError(0, "the disk is full")
            os.fsync(self._stream.fileno())
        except OSError as error:
            raise _unwritable(self.path, error) from error

    def _read(self, content: bytes) -> tuple[int, tuple[Entry, ...]]:
        """Return how many bytes at the end are a part of a line, and the entries of the lines before."""
        whole, _, rest = content.rpartition(b"\n")
        header, *lines = whole.split(b"\n") if whole else [_HEADER.encode()]
        if header != _HEADER.encode():
            raise InputError("this is no log of readings", where=f"{self.path}, line 1", cure="Choose another `out`.")
        texts = [_unsealed(line) for line in lines]
        bad = next((number for number, text in enumerate(texts, 2) if text is None), None)
        if bad is not None:
            raise InputError(
                "this line is not as it was written",
                where=f"{self.path}, line {bad}",
                cure="A log is not edited: put back the file as it was, or begin in another folder.",
            )
        entries = tuple(self._entry(str(text), number) for number, text in enumerate(texts, 2))
        return len(rest), entries

    def _entry(self, text: str, number: int) -> Entry:
        try:
            return _entry(text)
        except (ValueError, KeyError, StopIteration) as error:
            raise InputError("this line cannot be understood", where=f"{self.path}, line {number}") from error


def _check(line: str) -> str:
    return f"{zlib.crc32(line.encode()):08x}"


def _unsealed(line: bytes) -> str | None:
    """Return a line without its checksum; None if that does not fit."""
    with suppress(UnicodeDecodeError):
        text, _, check = line.decode().rpartition(",")
        if check == _check(text):
            return text
    return None


def _line(entry: Entry) -> str:
    stream = io.StringIO()
    csv.writer(stream, lineterminator="").writerow(_cells(entry))
    return stream.getvalue()


def _cells(entry: Entry) -> Iterator[str]:
    reading = entry.reading
    yield from (str(entry.number), entry.event)
    yield "" if reading is None else repr(reading.time)
    yield from (printable(entry.label), printable(entry.name), _ROLES[entry.is_nest])
    if reading is None:
        yield from [""] * 13
    else:
        yield from (_number(value, "mm") for value in reading.position.tolist())
        turned = [np.nan] * 4 if reading.quaternion is None else reading.quaternion.tolist()
        yield from (_number(value, "1") for value in turned)
        yield from (_number(reading.sigma, "mm"), _number(reading.sigma_rot, "mrad"))
        yield "" if reading.samples is None else str(reading.samples)
        yield from (_number(reading.deviation, "mm"), _number(reading.settling, "mm"), str(reading.breaks))
    yield from (entry.reason, printable(entry.words), "" if entry.of is None else str(entry.of))
    yield from ("", "") if reading is None else (printable(reading.origin), reading.mark)


def _number(value: float | None, unit: str) -> str:
    return "" if value is None or np.isnan(value) else repr(written(value, unit))


def _entry(text: str) -> Entry:
    row = dict(zip(_COLUMNS[:-1], next(csv.reader([text], strict=True)), strict=True))
    if row["event"] not in _EVENTS or row["role"] not in _ROLES or (row["reason"] and row["reason"] not in REASONS):
        raise ValueError
    reading = None
    if row["event"] == "reading":
        quaternion = np.array([_value(row[name], "1") for name in ("qw", "qx", "qy", "qz")])
        reading = Reading(
            name=row["name"],
            time=float(row["time [s]"]),
            position=np.array([_value(row[f"{axis} [mm]"], "mm") for axis in "xyz"]),
            quaternion=quaternion if np.isfinite(quaternion).all() else None,
            label=row["configuration"] or None,
            sigma=_optional(row["sigma [mm]"], "mm"),
            sigma_rot=_optional(row["sigma_rot [mrad]"], "mrad"),
            samples=int(row["samples"]) if row["samples"] else None,
            deviation=_optional(row["deviation [mm]"], "mm"),
            settling=_optional(row["settling [mm]"], "mm"),
            breaks=int(row["breaks"]),
            origin=row["origin"],
            mark=row["mark"],
        )
    return Entry(
        number=int(row["number"]),
        event=row["event"],  # type: ignore[arg-type]
        label=row["configuration"],
        name=row["name"],
        is_nest=row["role"] == "nest",
        reading=reading,
        reason=row["reason"],
        words=row["words"],
        of=int(row["of"]) if row["of"] else None,
    )


def _optional(text: str, unit: str) -> float | None:
    return _value(text, unit) if text else None


def _value(text: str, unit: str) -> float:
    value: Array | float | None = as_number(text) if text else np.nan
    if value is None:
        raise ValueError(text)
    return to_si(float(value), unit)


def _synchronise(folder: Path) -> None:
    with suppress(OSError):  # folders cannot be opened everywhere
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _unwritable(path: Path, error: OSError) -> InputError:
    return InputError(f"the log cannot be written ({reason_of(error)})", where=str(path), cure="Choose another `out`.")
