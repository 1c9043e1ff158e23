"""Entries of a mapping file that stand for themselves: layout, orientations, deviations, order and others."""

from __future__ import annotations

import codecs
import re
from datetime import datetime
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints, model_validator
from pydantic import field_validator as validator_of

from truearm.errors import InputError
from truearm.measurement.readers.cells import Layout
from truearm.printable import is_one_line

_DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "whitespace": None}


def _number_as_text(value: object) -> object:
    return str(value) if type(value) is int and abs(value) < 10**18 else value


def _none_as_null(value: object) -> object:
    return None if value == "none" else value


def _on_one_line(text: str) -> str:
    if not is_one_line(text):
        raise InputError("a name belongs here", came=text, allowed="one line of text without control characters")
    return text


Text = Annotated[str, StringConstraints(min_length=1, strip_whitespace=True)]
PointName = Annotated[Text, AfterValidator(_on_one_line)]
#: A column by its name; by its number, counted from 1, where the file has no header.
Column = Annotated[Text, BeforeValidator(_number_as_text)]
Line = Annotated[int, Field(ge=1, le=10**9, strict=True)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False, strict=True)]


class Entry(BaseModel):
    """Entries that are all known, and stay as they were read."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class LayoutEntry(Entry):
    """How a file is laid out; what is left out describes a plain CSV with a header, or a workbook of one sheet."""

    delimiter: Literal["comma", "semicolon", "tab", "whitespace"] = "comma"
    decimal: Literal["point", "comma"] = "point"
    header: Annotated[Line | None, BeforeValidator(_none_as_null)] = 1
    first_row: Line | None = None
    comment: Text | None = None
    encoding: str = "utf-8"
    sheet: Text | None = None

    @validator_of("encoding")
    @classmethod
    def _known(cls, name: str) -> str:
        try:
            return codecs.lookup(name).name
        except (LookupError, ValueError):  # ValueError: half a character, a zero byte
            raise InputError(
                "there is no such encoding", came=name, allowed="utf-8, utf-16, cp1252, latin-1 and others of Python"
            ) from None

    @model_validator(mode="after")
    def _header_first(self) -> LayoutEntry:
        if self.first_row is not None and self.first_row <= (self.header or 0):
            raise InputError(
                "first_row must be below the header",
                came=f"header {self.header}, first_row {self.first_row}",
                allowed=f"{(self.header or 0) + 1} or more for first_row",
            )
        return self

    @property
    def of_text(self) -> list[str]:
        """Return the entries that are given and that only texts have."""
        return [name for name in ("delimiter", "decimal", "comment", "encoding") if name in self.model_fields_set]

    @property
    def layout(self) -> Layout:
        """Return it as the reader of cells takes it."""
        decimal = "," if self.decimal == "comma" else "."
        return Layout(_DELIMITERS[self.delimiter], decimal, self.header, self.first_row, self.comment)


class SigmaEntry(Entry):
    """A standard deviation for all positions."""

    value: Positive
    unit: Literal["mm", "m", "um", "in"]


class SigmaRotEntry(Entry):
    """A standard deviation for all orientations."""

    value: Positive
    unit: Literal["mrad", "rad", "deg"]


class _DeviationColumns(Entry):
    """Columns of deviations: one for the whole reading, or one for each coordinate."""

    columns: list[Column] = Field(min_length=1, max_length=3)
    coverage: Annotated[float, Field(ge=1.0, le=10.0, strict=True)] = 1.0

    @validator_of("columns")
    @classmethod
    def _one_or_three(cls, columns: list[str]) -> list[str]:
        if len(columns) == 2 or len(set(columns)) < len(columns):
            raise InputError(
                "these are not one column, or one for each coordinate",
                came=", ".join(columns),
                allowed="one column, or three different ones",
            )
        return columns


class SigmaColumns(_DeviationColumns):
    """Columns with the deviations of positions."""

    unit: Literal["mm", "m", "um", "in"]


class SigmaRotColumns(_DeviationColumns):
    """Columns with the deviations of orientations."""

    unit: Literal["mrad", "rad", "deg"]


def _three(columns: list[str]) -> list[str]:
    if len(columns) != 3:
        raise InputError("three columns belong here", came=", ".join(columns) or "none", allowed="three")
    return columns


Three = Annotated[list[Column], AfterValidator(_three)]


class AnglesEntry(Entry):
    """Three columns of angles, about which axes in which order they turn, and whether the axes turn along."""

    columns: Three
    about: str
    axes: Literal["moving", "fixed"]
    unit: Literal["deg", "rad", "mrad"]

    @validator_of("about")
    @classmethod
    def _turns(cls, about: str) -> str:
        if not re.fullmatch("[xyz]{3}", about) or about[0] == about[1] or about[1] == about[2]:
            raise InputError(
                "these are no three axes",
                came=about,
                allowed="x, y and z in the order of the columns, such as zyx or zyz, none twice in a row",
            )
        return about


class RotationVectorEntry(Entry):
    """Three columns of a rotation vector: the axis, as long as the angle."""

    columns: Three
    unit: Literal["deg", "rad", "mrad"]


#: A format of times that names no day.
_DAYS: Final = ("%d", "%j", "%c", "%x", "%u", "%w", "%a", "%A")


class OrderEntry(Entry):
    """What tells the order in which configurations were measured; of two columns one has the day, one the time."""

    by: Literal["labels", "rows"] | None = None
    column: Column | None = None
    columns: list[Column] | None = None
    time: Text | None = None

    @model_validator(mode="after")
    def _one(self) -> OrderEntry:
        if sum(given is not None for given in (self.by, self.column, self.columns)) != 1:
            raise ValueError("give either by: labels, by: rows, column: NAME, or columns: [DAY, TIME]")
        if self.time is not None and self.by is not None:
            raise ValueError("time is the format of a column; name it with column:")
        if self.columns is not None:
            if len(set(self.columns)) != 2 or len(self.columns) != 2:
                raise InputError(
                    "these are not one column with the day and one with the time",
                    came=", ".join(self.columns) or "none",
                    allowed="two different columns",
                )
            if self.time is None:
                raise ValueError("two columns tell a day and a time: give their format, the two with a blank between")
        return self

    @property
    def names(self) -> dict[str, str]:
        """Return the columns that tell it, by their entries."""
        if self.columns is not None:
            return {f"columns[{number}]": column for number, column in enumerate(self.columns, 1)}
        return {} if self.column is None else {"column": self.column}

    @validator_of("time")
    @classmethod
    def _format(cls, time: str | None) -> str | None:
        if time is not None and time != "iso" and not _is_format(time):
            raise InputError(
                "this is no format of times",
                came=time,
                allowed="iso, or signs of Python such as %d.%m.%Y %H:%M:%S",
            )
        return time

    @property
    def has_day(self) -> bool:
        """Whether times of this format say on which day they were."""
        return self.time is not None and (self.time == "iso" or any(sign in self.time for sign in _DAYS))


def _is_format(time: str) -> bool:
    """Return whether a time can be read by a format, which tells at least hours and minutes or a day."""
    try:
        moment = datetime(2026, 11, 23, 14, 5, 9)
        return "%" in time and datetime.strptime(moment.strftime(time), time) != datetime(1900, 1, 1)
    except (ValueError, re.error):
        return False


class VisitEntry(Entry):
    """The column with the number of the visit on which a row was measured."""

    column: Column


class TemperatureEntry(Entry):
    """The column of the arm's temperature."""

    column: Column
    unit: Literal["degC", "degF", "K"]


class DwellEntry(Entry):
    """Columns that say how a reading was taken: scatter and settling, number of samples, breaks of the beam."""

    deviation: Column | None = None
    settling: Column | None = None
    unit: Literal["mm", "m", "um", "in"] | None = None
    samples: Column | None = None
    breaks: Column | None = None

    @model_validator(mode="after")
    def _units(self) -> DwellEntry:
        if (self.unit is None) != (self.deviation is None and self.settling is None):
            raise ValueError("unit belongs to deviation and settling: give both, or neither")
        if not self.model_fields_set:
            raise ValueError("give deviation, settling, samples or breaks")
        return self
