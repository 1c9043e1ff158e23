"""Mapping files: what the columns of somebody's table mean."""

from __future__ import annotations

import codecs
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints, model_validator
from pydantic import field_validator as validator_of

from truearm.errors import InputError
from truearm.measurement.readers.cells import Layout
from truearm.modeling.controller import JointsOf
from truearm.printable import is_one_line
from truearm.shown import counted

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


class _Entry(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class LayoutEntry(_Entry):
    """How the text of a file is laid out; what is left out describes a plain CSV with a header."""

    delimiter: Literal["comma", "semicolon", "tab", "whitespace"] = "comma"
    decimal: Literal["point", "comma"] = "point"
    header: Annotated[Line | None, BeforeValidator(_none_as_null)] = 1
    first_row: Line | None = None
    comment: Text | None = None
    encoding: str = "utf-8"

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
    def layout(self) -> Layout:
        """Return it as the reader of cells takes it."""
        decimal = "," if self.decimal == "comma" else "."
        return Layout(_DELIMITERS[self.delimiter], decimal, self.header, self.first_row, self.comment)


class ConfigurationEntry(_Entry):
    """Where the label of the configuration is."""

    column: Column | None = None
    each: Literal["row"] | None = None

    @model_validator(mode="after")
    def _one(self) -> ConfigurationEntry:
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


class NamesEntry(_Entry):
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


class ReadingEntry(_Entry):
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

    @model_validator(mode="after")
    def _whole_quaternion(self) -> ReadingEntry:
        if None in (q := [self.qw, self.qx, self.qy, self.qz]) and any(q):
            raise ValueError("give all of qw, qx, qy, qz, or none of them")
        return self

    @property
    def position(self) -> dict[str, str]:
        """Return the columns of the position."""
        return {"x": self.x, "y": self.y, "z": self.z}

    @property
    def quaternion(self) -> dict[str, str]:
        """Return the columns of the quaternion, nothing if there is none."""
        named = {"qw": self.qw, "qx": self.qx, "qy": self.qy, "qz": self.qz}
        return {name: column for name, column in named.items() if column is not None}


class JointsEntry(_Entry):
    """The columns of the joints, in the order of the robot, in the table or in a second file."""

    columns: list[Column] = Field(min_length=1)
    unit: Literal["deg", "rad", "mm", "m", "um", "in"] | None = None
    units: list[Literal["deg", "rad", "mm", "m", "um", "in"]] | None = None
    are: JointsOf | None = None
    file: Text | None = None
    key: Column | None = None
    layout: LayoutEntry | None = None

    @model_validator(mode="after")
    def _consistent(self) -> JointsEntry:
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


class SigmaEntry(_Entry):
    """A standard deviation for all positions."""

    value: Positive
    unit: Literal["mm", "m", "um", "in"]


class SigmaRotEntry(_Entry):
    """A standard deviation for all orientations."""

    value: Positive
    unit: Literal["mrad", "rad", "deg"]


class MappingFile(_Entry):
    """Schema ``truearm-mapping/1``."""

    truearm: Literal["truearm-mapping/1"]
    layout: LayoutEntry = LayoutEntry()
    configuration: ConfigurationEntry | None = None
    names: NamesEntry | None = None
    length_unit: Literal["mm", "m", "um", "in"]
    readings: list[ReadingEntry] = Field(min_length=1)
    references: list[Text] = []
    joints: JointsEntry
    sigma: SigmaEntry | None = None
    sigma_rot: SigmaRotEntry | None = None

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
        if self.sigma_rot is not None and not any(entry.quaternion for entry in self.readings):
            raise ValueError("sigma_rot is given, and no reading has an orientation (qw, qx, qy, qz)")
        self._refuse_columns_used_twice()
        return self

    def _refuse_columns_used_twice(self) -> None:
        """Refuse numbers that are taken from one column for two things: a slip that would go unnoticed."""
        used = [
            (column, f"readings[{number}].{name}")
            for number, entry in enumerate(self.readings, 1)
            for name, column in (entry.position | entry.quaternion).items()
        ]
        joints = [(column, f"joints.columns[{number}]") for number, column in enumerate(self.joints.columns, 1)]
        for group in [[*used, *joints]] if self.joints.file is None else [used, joints]:
            first: dict[str, str] = {}
            for column, entry in group:
                if column in first:
                    raise InputError(
                        f"a column is used twice, for {first[column]} and for {entry}",
                        came=column,
                        cure="Name the right column for one of them.",
                    )
                first[column] = entry
