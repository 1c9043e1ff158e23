"""Mapping files: what the columns of somebody's table mean."""

from __future__ import annotations

import codecs
import re
from datetime import datetime
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints, model_validator
from pydantic import field_validator as validator_of

from truearm.engine.base.errors import InputError, counted, is_one_line
from truearm.engine.data.readers.cells import Layout
from truearm.engine.robot.controller import JointsOf

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
    def _one_source(self) -> OrderEntry:
        if sum(value is not None for value in (self.by, self.column, self.columns)) != 1:
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
                "this is no format of times", came=time, allowed="iso, or signs of Python such as %d.%m.%Y %H:%M:%S"
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


class ConfigurationEntry(Entry):
    """Where the label of the configuration is."""

    column: Column | None = None
    each: Literal["row"] | None = None

    @model_validator(mode="after")
    def _one_source(self) -> ConfigurationEntry:
        if (self.column is None) == (self.each is None):
            raise ValueError("give either column: NAME, or each: row for one configuration a row")
        return self


#: What a compiled pattern may take [bytes]; one for names takes a few thousand.
_PATTERN_MEMORY: Final = 1 << 15


def name_pattern(pattern: str) -> Any:
    r"""Return a pattern that finds what it finds in a time that grows with the text alone, whatever the pattern is.

    RE2 knows no look-ahead, look-behind and repeated groups (``\1``), which take a time without bound.
    """
    import re2

    options = re2.Options()
    options.log_errors = False
    options.max_mem = _PATTERN_MEMORY
    try:
        return re2.compile(pattern, options)
    except UnicodeEncodeError:
        raise InputError("the pattern holds half a character", allowed="whole characters") from None
    except re2.error as error:
        reason = error.args[0] if error.args else ""
        reason = reason.decode("utf-8", "replace") if isinstance(reason, bytes) else str(reason)
        raise InputError(
            f"this is not a regular expression that can be used ({reason})",
            came=pattern,
            allowed="the syntax of RE2: no look-ahead, no look-behind, no reference to a group",
        ) from None


class NamesEntry(Entry):
    """A column whose text holds the label of the configuration, the name of the target, or both."""

    column: Column
    pattern: str
    others: Literal["refuse", "skip"] = "refuse"

    @validator_of("pattern")
    @classmethod
    def _compiles(cls, pattern: str) -> str:
        groups = set(name_pattern(pattern).groupindex)
        if not groups or groups - {"configuration", "target"}:
            raise InputError(
                "the pattern has other named groups",
                came=pattern,
                allowed="(?P<configuration>..), (?P<target>..) or both",
            )
        return pattern

    @property
    def groups(self) -> tuple[str, ...]:
        """Return what the pattern finds."""
        return tuple(name_pattern(self.pattern).groupindex)


class ReadingEntry(Entry):
    """The columns of one target; several of them make a wide table."""

    target: PointName | None = None
    target_column: Column | None = None
    x: Column
    y: Column
    z: Column
    qw: Column | None = None
    qx: Column | None = None
    qy: Column | None = None
    qz: Column | None = None
    angles: AnglesEntry | None = None
    rotation_vector: RotationVectorEntry | None = None
    sigma: SigmaColumns | None = None
    sigma_rot: SigmaRotColumns | None = None

    @model_validator(mode="after")
    def _whole_orientation(self) -> ReadingEntry:
        if None in (q := [self.qw, self.qx, self.qy, self.qz]) and any(q):
            raise ValueError("give all of qw, qx, qy, qz, or none of them")
        if sum([any(q), self.angles is not None, self.rotation_vector is not None]) > 1:
            raise ValueError("an orientation comes from one place: qw to qz, angles, or rotation_vector")
        if self.sigma_rot is not None and not self.has_orientation:
            raise ValueError("sigma_rot is given, and there is no orientation: qw to qz, angles, or rotation_vector")
        return self

    @property
    def has_orientation(self) -> bool:
        """Whether there are columns of an orientation."""
        return bool(self.quaternion) or self.angles is not None or self.rotation_vector is not None

    @property
    def turned(self) -> dict[str, str]:
        """Return the columns of the orientation in whatever way, nothing if there is none."""
        for name, entry in (("angles", self.angles), ("rotation_vector", self.rotation_vector)):
            if entry is not None:
                return {f"{name}.columns[{number}]": column for number, column in enumerate(entry.columns, 1)}
        return self.quaternion

    @property
    def deviations(self) -> dict[str, str]:
        """Return the columns of deviations."""
        return {
            f"{name}.columns[{number}]": column
            for name, entry in (("sigma", self.sigma), ("sigma_rot", self.sigma_rot))
            if entry is not None
            for number, column in enumerate(entry.columns, 1)
        }

    @property
    def position(self) -> dict[str, str]:
        """Return the columns of the position."""
        return {"x": self.x, "y": self.y, "z": self.z}

    @property
    def quaternion(self) -> dict[str, str]:
        """Return the columns of the quaternion, nothing if there is none."""
        named = {"qw": self.qw, "qx": self.qx, "qy": self.qy, "qz": self.qz}
        return {name: column for name, column in named.items() if column is not None}


class JointsEntry(Entry):
    """The columns of the joints, in the order of the robot, in the table or in a second file.

    Without columns the second file has those of the canonical CSV.
    """

    columns: list[Column] = Field(default=[], min_length=1)
    unit: Literal["deg", "rad", "mm", "m", "um", "in"] | None = None
    units: list[Literal["deg", "rad", "mm", "m", "um", "in"]] | None = None
    are: JointsOf | None = None
    file: Text | None = None
    key: Column | None = None
    layout: LayoutEntry | None = None

    @model_validator(mode="after")
    def _consistent(self) -> JointsEntry:
        if not self.columns:
            if self.file is None:
                raise ValueError("give columns: for joints in the table, or file: for those of a second file")
            fields = [name for name in ("unit", "units", "are", "key", "layout") if name in self.model_fields_set]
            if fields:
                raise InputError(
                    "without columns, the second file has the columns of the canonical CSV, which say this",
                    came=", ".join(fields),
                    cure="Name the columns of the joints as well, or leave this out.",
                )
            return self
        if (self.unit is None) == (self.units is None):
            raise ValueError("give either unit: for all joints, or units: with one for each joint")
        if self.units is not None and len(self.units) != len(self.columns):
            raise InputError(
                f"there are {counted(len(self.columns), 'column')} and {counted(len(self.units), 'unit')}",
                came=", ".join(self.units),
                allowed="units with one for each column, or unit for all of them",
            )
        if self.file is None and (self.key is not None or self.layout is not None):
            raise ValueError("key and layout belong to a second file; name it with file:")
        return self

    @property
    def unit_of_each(self) -> list[str]:
        """Return the unit of each joint."""
        return [*self.units] if self.units is not None else [str(self.unit)] * len(self.columns)


def _yes_or_no(value: object) -> object:
    return {"yes": True, "no": False}.get(value, value) if isinstance(value, str) else value


class MappingFile(Entry):
    """Schema ``truearm-mapping/1``. A table is read with ``joints`` alone; a plan that is measured has its own."""

    truearm: Literal["truearm-mapping/1"]
    layout: LayoutEntry = LayoutEntry()
    configuration: ConfigurationEntry | None = None
    names: NamesEntry | None = None
    length_unit: Literal["mm", "m", "um", "in"]
    readings: list[ReadingEntry] = Field(min_length=1)
    references: list[Text] = Field(default=[])
    joints: JointsEntry | None = None
    sigma: SigmaEntry | None = None
    sigma_rot: SigmaRotEntry | None = None
    missing: list[Text] = Field(default=[])
    order: OrderEntry | None = None
    visit: VisitEntry | None = None
    temperature: TemperatureEntry | None = None
    dwell: DwellEntry | None = None
    confirmed: Annotated[bool, BeforeValidator(_yes_or_no)] = True

    @model_validator(mode="after")
    def _everything_once(self) -> MappingFile:
        groups = () if self.names is None else self.names.groups
        if (self.configuration is not None) == ("configuration" in groups):
            raise ValueError(
                "the configuration must come from one place: the entry configuration, or the group "
                "(?P<configuration>..) in the pattern of names"
            )
        for number, entry in enumerate(self.readings, 1):
            sources = [entry.target is not None, entry.target_column is not None, "target" in groups]
            if sum(sources) != 1:
                raise ValueError(
                    f"the target of readings[{number}] must come from one place: target, target_column, or "
                    "the group (?P<target>..) in the pattern of names"
                )
        fixed = [entry.target for entry in self.readings]
        if len(fixed) > 1 and (None in fixed or len(set(fixed)) < len(fixed)):
            raise ValueError("several readings a row need target: with a different name in each of them")
        if self.sigma_rot is not None and not any(entry.has_orientation for entry in self.readings):
            raise ValueError(
                "sigma_rot is given, and no reading has an orientation (qw to qz, angles, rotation_vector)"
            )
        for name in ("sigma", "sigma_rot"):
            if getattr(self, name) is not None and any(getattr(entry, name) for entry in self.readings):
                raise ValueError(f"{name} is given for all readings, and again for some: keep one of them")
        self._refuse_columns_used_twice()
        return self

    def _refuse_columns_used_twice(self) -> None:
        """Refuse numbers that are taken from one column for two things: a data-entry error that would go unnoticed."""
        used = [
            (column, f"readings[{number}].{name}")
            for number, entry in enumerate(self.readings, 1)
            for name, column in (entry.position | entry.turned).items()
        ]
        shared = {  # one column may hold the deviations of several targets
            (column, name.partition(".")[0]): f"readings[{number}].{name}"
            for number, entry in enumerate(self.readings, 1)
            for name, column in entry.deviations.items()
        }
        used += [(column, entry) for (column, _), entry in shared.items()]
        if self.temperature is not None:
            used.append((self.temperature.column, "temperature.column"))
        if self.visit is not None:
            used.append((self.visit.column, "visit.column"))
        of_joints = [] if self.joints is None else self.joints.columns
        joints = [(column, f"joints.columns[{number}]") for number, column in enumerate(of_joints, 1)]
        for group in [[*used, *joints]] if self.joints is None or self.joints.file is None else [used, joints]:
            first: dict[str, str] = {}
            for column, entry in group:
                if column in first:
                    raise InputError(
                        f"a column is used twice, for {first[column]} and for {entry}",
                        came=column,
                        cure="Name the right column for one of them.",
                    )
                first[column] = entry
