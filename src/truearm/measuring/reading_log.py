"""The log of a session on disk, and what a campaign was measured with."""

from __future__ import annotations

import csv
import io
import os
import zlib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import BaseModel, Field, StringConstraints

from truearm.engine.base.errors import InputError, Notice, Rule, is_one_line, printable
from truearm.engine.base.files import read_bytes, read_yaml, reason_of
from truearm.engine.base.units import as_number, sized_si, to_si, written
from truearm.engine.base.writing import lock, synchronise
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot_file.entries import STRICT, Number
from truearm.measuring.session import REASONS, Entry, Reading

# What a file says of instrument and air, all of it optional::
#
#     truearm: truearm-about/1
#     units: {length: mm, temperature: degC, pressure: hPa, humidity: percent}
#     instrument: {name: tracker of the hall, serial: "750123"}
#     robot: {serial: "120-501234"}
#     reflector: {radius: 19.05, offset: 0.0}
#     environment:
#       - {at: start, temperature: 20.4, pressure: 1013.2, humidity: 45}
#
# Nothing is computed from it: instruments correct for air and reflector themselves.

#: What can be meant, by the names of the figures: lowest, highest, and the unit for messages.
_AIR: Final = {
    "temperature": (-40.0, 80.0, "degC"),
    "pressure": (500.0, 1200.0, "hPa"),
    "humidity": (0.0, 100.0, "percent"),
}
_LARGEST_REFLECTOR: Final = 0.2
_Text = Annotated[str, StringConstraints(min_length=1, max_length=200, strip_whitespace=True)]


class _Units(BaseModel):
    model_config = STRICT

    length: Literal["mm", "m", "um", "in"] = "mm"
    temperature: Literal["degC"] = "degC"
    pressure: Literal["hPa"] = "hPa"
    humidity: Literal["percent"] = "percent"


class _Device(BaseModel):
    model_config = STRICT

    name: _Text | None = None
    serial: _Text | None = None


class _Reflector(BaseModel):
    model_config = STRICT

    radius: Number
    offset: Number | None = None


class _Air(BaseModel):
    model_config = STRICT

    at: _Text
    temperature: Number | None = None
    pressure: Number | None = None
    humidity: Number | None = None


class AboutFile(BaseModel):
    """Schema ``truearm-about/1``."""

    model_config = STRICT

    truearm: Literal["truearm-about/1"]
    units: _Units
    instrument: _Device = _Device()
    robot: _Device = _Device()
    reflector: _Reflector | None = None
    environment: list[_Air] = Field(default=[], max_length=1000)


@dataclass(frozen=True)
class Air:
    """The air at one time: when, in words, then degC, hPa and percent; None for what nobody read."""

    at: str
    temperature: float | None = None
    pressure: float | None = None
    humidity: float | None = None


NOT_SAID: Final = Rule(
    "not-said",
    "note",
    "serial numbers, reflector or air that nobody said",
    cure="Whoever repeats the measurement needs it; give `about`.",
    gravity=0,
)


@dataclass(frozen=True)
class About:
    """What a campaign was measured with; None for what nobody said."""

    instrument: str | None = None  #: instrument, instrument_serial, robot_serial: name and serial numbers.
    instrument_serial: str | None = None
    robot_serial: str | None = None
    #: reflector_radius, reflector_offset: of the reflector, and of its centre from where the nest holds it [m].
    reflector_radius: float | None = None
    reflector_offset: float | None = None
    environment: tuple[Air, ...] = ()  #: The air, as often as it was read.

    @property
    def missing(self) -> list[str]:
        """What nobody said."""
        values = {
            "serial number of the instrument": self.instrument_serial,
            "serial number of the robot": self.robot_serial,
            "radius of the reflector": self.reflector_radius,
            "offset of the reflector": self.reflector_offset,
            **{
                f"{name} of the air": next((v for a in self.environment if (v := getattr(a, name)) is not None), None)
                for name in _AIR
            },
        }
        return [name for name, value in values.items() if value is None]

    @property
    def fixed(self) -> dict[str, Any]:
        """What stays the same as long as a plan is measured."""
        return {
            "instrument_serial": self.instrument_serial,
            "robot_serial": self.robot_serial,
            "reflector_radius": self.reflector_radius,
            "reflector_offset": self.reflector_offset,
        }

    def rows(self) -> list[tuple[str, str]]:
        """Return it as a table of names and values with their units."""
        rows = [
            ("instrument", self.instrument or "not said"),
            ("serial number of the instrument", self.instrument_serial or "not said"),
            ("serial number of the robot", self.robot_serial or "not said"),
            ("radius of the reflector", _millimetres(self.reflector_radius)),
            ("offset of the reflector", _millimetres(self.reflector_offset)),
        ]
        for air in self.environment:
            figures = [f"{value:g} {_AIR[name][2]}" for name in _AIR if (value := getattr(air, name)) is not None]
            rows.append((f"air, {air.at}", ", ".join(figures) or "not said"))
        return rows if self.environment else [*rows, ("air", "not said")]

    def notices(self) -> list[Notice]:
        """Name what nobody said."""
        if not self.missing:
            return []
        return [NOT_SAID(f"Nobody said: {', '.join(self.missing)}.")]


def _millimetres(length: float | None) -> str:
    return "not said" if length is None else f"{length * 1e3:g} mm"


def read_about(path: Path) -> About:
    """Read a file of the schema above.

    Raises:
        InputError: If an entry is not known, or a number cannot be meant.
    """
    return about_of(read_yaml(path, AboutFile), str(path))


def about_of(content: AboutFile, where: str) -> About:
    """Return what the entries of a file say.

    Raises:
        InputError: If a number cannot be meant.
    """
    texts = (content.instrument.name, content.instrument.serial, content.robot.serial)
    for text in (*texts, *(air.at for air in content.environment)):
        if text is not None and not is_one_line(text):
            raise InputError("one line of text belongs here", where=where, came=text)
    radius = offset = None
    if content.reflector is not None:
        radius = sized_si(content.reflector.radius, content.units.length, f"{where}, reflector.radius")
        if not 0.0 < radius <= _LARGEST_REFLECTOR:
            raise InputError(
                "no reflector is so small or so large",
                where=f"{where}, reflector.radius",
                came=f"{radius * 1e3:g} mm",
                allowed=f"above 0, up to {_LARGEST_REFLECTOR * 1e3:g} mm",
            )
        if content.reflector.offset is not None:
            offset = sized_si(content.reflector.offset, content.units.length, f"{where}, reflector.offset")
    for number, air in enumerate(content.environment, 1):
        for name, (low, high, unit) in _AIR.items():
            value = getattr(air, name)
            if value is not None and not low <= value <= high:
                raise InputError(
                    "no hall has such air",
                    where=f"{where}, environment[{number}].{name}",
                    came=f"{value:g} {unit}",
                    allowed=f"{low:g} to {high:g} {unit}",
                )
    return About(
        *texts,
        radius,
        offset,
        tuple(Air(air.at, air.temperature, air.pressure, air.humidity) for air in content.environment),
    )


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
_NOT_EDITED: Final = "A log is not edited: put back the file as it was, or begin in another folder."
_EVENTS: Final = ("reading", "aside", "left")


# The log of a session on disk: every reading is there before the next one is asked for.
#
# A line is appended and synchronised at a time, with a checksum at its end. So whatever stops the machine leaves whole
# lines and, at most, a part of one: that reading was not confirmed to anybody, and its part is cut off when the
# measuring goes on. A line that is not the last and whose checksum does not fit was changed by somebody, and is
# refused.
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
                synchronise([self.path])
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
        if not lock(self._stream.fileno(), wait=False):
            raise InputError(
                "another process is measuring into this folder",
                where=str(self.path.parent),
                cure="End it, or choose another `out`.",
            )

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
        whole, _, partial = content.rpartition(b"\n")
        header, *lines = whole.split(b"\n") if whole else [_HEADER.encode()]
        if header != _HEADER.encode():
            raise InputError("this is no log of readings", where=f"{self.path}, line 1", cure="Choose another `out`.")
        texts = [_unsealed(line) for line in lines]
        bad = next((number for number, text in enumerate(texts, 2) if text is None), None)
        if bad is not None:
            raise InputError(
                "this line is not as it was written",
                where=f"{self.path}, line {bad}",
                cure=_NOT_EDITED,
            )
        entries = tuple(self._entry(str(text), number) for number, text in enumerate(texts, 2))
        for number, entry in enumerate(entries, 1):
            if entry.number != number:
                raise InputError(
                    "lines before this one are missing, or stand there twice",
                    where=f"{self.path}, line {number + 1}",
                    came=f"number {entry.number}",
                    allowed=f"number {number}",
                    cure=_NOT_EDITED,
                )
        return len(partial), entries

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


def _unwritable(path: Path, error: OSError) -> InputError:
    return InputError(f"the log cannot be written ({reason_of(error)})", where=str(path), cure="Choose another `out`.")
