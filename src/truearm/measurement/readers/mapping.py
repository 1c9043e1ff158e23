"""Mapping files: what the columns of somebody's table mean."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import BeforeValidator, Field, model_validator
from pydantic import field_validator as validator_of

from truearm.errors import InputError
from truearm.measurement.readers.mapping_entries import (
    AnglesEntry,
    Column,
    DwellEntry,
    Entry,
    LayoutEntry,
    OrderEntry,
    PointName,
    RotationVectorEntry,
    SigmaColumns,
    SigmaEntry,
    SigmaRotColumns,
    SigmaRotEntry,
    TemperatureEntry,
    Text,
    VisitEntry,
)
from truearm.modeling.controller import JointsOf
from truearm.shown import counted


class ConfigurationEntry(Entry):
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
            given = [name for name in ("unit", "units", "are", "key", "layout") if name in self.model_fields_set]
            if given:
                raise InputError(
                    "without columns, the second file has the columns of the canonical CSV, which say this",
                    came=", ".join(given),
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
        """Refuse numbers that are taken from one column for two things: a slip that would go unnoticed."""
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
