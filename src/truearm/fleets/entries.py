"""The robots of a fleet that were measured: entries of a manifest, or rows of a table.

A table is a CSV file with one row a robot. It has the columns ``name``, ``robot`` and ``data``; ``of`` and ``date`` if
machines were measured again; and one for each option that some robot has, where an empty cell is what the manifest says
of all. Files are named from the manifest's folder.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import BaseModel, BeforeValidator

from truearm.calibration.calibrate import Calibrate
from truearm.engine.base.errors import InputError, did_you_mean, is_one_line, nearest_names, refusals_at
from truearm.engine.base.files import exists, noted_reads, read_bytes, read_text
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.base.manifest import hash_of
from truearm.engine.base.schemas import validated
from truearm.engine.command.kinds import Gravity, Kind, Names, NumberOr, PayloadKind, Whole
from truearm.engine.command.request import Option, metavar_of
from truearm.engine.data.readers.cells import Layout, read_cells
from truearm.engine.robot.robot_file.entries import NAME, NAME_IN_WORDS, STRICT

_WHOLE: Final = re.compile(r"[0-9]{1,18}")
#: What separates several names or numbers in a cell.
_SEPARATORS: Final = re.compile(r"[;,\s]+")


#: What may be said of a robot, by its name: what :func:`truearm.calibrate` is asked for that makes its result another.
#: The entry itself says robot, data and notes.
OPTIONS: Final[Mapping[str, Option]] = {
    name: option
    for name, option in Calibrate.options()
    if option.repeated and not option.is_argument and name != "notes"
}
#: Those that name a file, from the manifest's folder.
FILES: Final = tuple(name for name, option in OPTIONS.items() if metavar_of(option).endswith("FILE"))


def _of_cell(kind: Kind, cell: str) -> Any:
    if isinstance(kind, Whole | NumberOr):
        return int(cell) if _WHOLE.fullmatch(cell) else cell
    if not isinstance(kind, Names | Gravity):
        return cell
    names = [name for name in _SEPARATORS.split(cell) if name]
    if isinstance(kind, Names):
        return names
    try:
        return [float(number) for number in names]
    except ValueError as error:
        raise InputError("numbers belong here", came=cell, allowed="0,0,-9.81") from error


def _other(kind: NumberOr) -> str:
    """Return what is allowed beside a number."""
    other = kind.metavar.partition("|")[2]
    return "a file" if other == "FILE" else other


def _types(kind: Kind) -> tuple[tuple[type, ...], str]:
    """Return the types that a value of YAML has, and what they are called."""
    if isinstance(kind, NumberOr):
        return (int, str), f"a whole number, or {_other(kind)}"
    if isinstance(kind, Whole):
        return (int,), "a whole number"
    if isinstance(kind, Names):
        return (list,), "a list of names"
    return ((list,), "three numbers") if isinstance(kind, Gravity) else ((str,), "a text")


def of_cells(cells: Mapping[str, str], place: Callable[[str], str]) -> dict[str, Any]:
    """Return the options in the cells of a row, of columns that are options; empty cells are none.

    Args:
        place: The file, line and column of a cell by its column.
    """
    options = {}
    for name, cell in cells.items():
        if cell:
            with refusals_at(place(name)):
                options[name] = _of_cell(OPTIONS[name].kind, cell)
    return options


def checked_options(options: Mapping[str, Any], folder: Path, place: Callable[[str], str]) -> dict[str, Any]:
    """Return options with whole paths, or refuse what no calibration takes, before any robot is calibrated.

    Args:
        folder: That files are named from.
        place: Where an option stands, by its name.

    Raises:
        InputError: For an option or a name that is not known, a value of another kind, and a file that is not there.
    """
    return {name: _checked(name, value, folder, place(name)) for name, value in options.items()}


def _checked(name: str, value: Any, folder: Path, place: str) -> Any:
    if name not in OPTIONS:
        raise InputError(
            "no calibration has such an option",
            where=place,
            came=name,
            allowed=", ".join(OPTIONS),
            cure=did_you_mean(name, OPTIONS),
        )
    kind = OPTIONS[name].kind
    types, words = _types(kind)
    wrong = isinstance(value, str) and isinstance(kind, NumberOr) and name not in FILES and value != _other(kind)
    if not isinstance(value, types) or isinstance(value, bool) or wrong:
        raise InputError("this is no value of this option", where=place, came=value, allowed=words)
    if name in FILES and isinstance(value, str):
        if not exists(folder / value):
            raise InputError("there is no such file", where=place, came=value, cure="Check the path.")
        return str(folder / value)
    if isinstance(kind, PayloadKind):
        with refusals_at(place):
            kind.check(value, name)
    known = getattr(kind, "known", None) or ()
    known = known() if callable(known) else known
    for entry in value if isinstance(value, list) else [value]:
        if known and entry not in known:
            raise InputError(
                "there is nothing of this name",
                where=place,
                came=entry,
                allowed=", ".join(known),
                cure=did_you_mean(str(entry), known),
            )
    return value


#: Columns of a table that are no options.
_REQUIRED: Final = ("name", "robot", "data")
_COLUMNS: Final = (*_REQUIRED, "of", "date")
_DATE: Final = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}")
_DATES: Final = "a date such as 2026-03-01"


def _as_text(value: object) -> object:
    """Return a serial number or a date, which YAML reads as such without quotes, as text."""
    return value if isinstance(value, str | bool | float | list | dict) or value is None else str(value)


Text = Annotated[str, BeforeValidator(_as_text)]


class _Entry(BaseModel):
    model_config = STRICT

    name: Text
    robot: str
    data: str
    of: Text | None = None
    date: Text | None = None
    options: dict[str, Any] = {}


@dataclass(frozen=True)
class RobotEntry:
    """A robot that was measured."""

    name: str  #: In the fleet, and of its folder.
    robot: str  #: What :func:`truearm.load_robot` takes.
    data: Path  #: Canonical CSV file.
    options: Mapping[str, Any] = field(default_factory=dict)  #: Keywords of :func:`truearm.calibrate`.
    of: str | None = None  #: Serial number or name of the machine, where it was measured several times.
    date: str | None = None  #: When (ISO 8601).
    #: SHA-256 of the files that are read for it, by their paths.
    hashes: Mapping[Path, str] = field(default_factory=dict, repr=False)
    #: Where ``robot`` and each option stand, by their names.
    places: Mapping[str, str] = field(default_factory=dict, repr=False, compare=False)

    @property
    def machine(self) -> str:
        """The machine that was measured: entries of one machine are measurements of it at several times."""
        return self.of or self.name


@dataclass(frozen=True)
class Robots:
    """The robots that a manifest names."""

    entries: tuple[RobotEntry, ...]  #: One each.
    hashes: dict[str, str]  #: SHA-256 of all files that are read, by the names that manifest and table give them.
    content: list[dict[str, Any]]  #: What is said, as JSON holds it, without where the manifest stands.


@dataclass(frozen=True)
class _PlacedEntry:
    """An entry as it was written, with where each part of it stands."""

    entry: _Entry
    place: Callable[[str], str]
    place_of_option: Callable[[str], str]


def robots_of(stated: list[Any] | str, options: Mapping[str, Any], manifest: Path) -> Robots:
    """Return the robots that a manifest names.

    Args:
        stated: A list of entries, or the name of a table.
        options: Of all robots that do not say others.

    Raises:
        InputError: Naming file and entry, or file, line and column: for two robots of one name or with the same
            readings, a file that is not there, columns and options that are not known, and a date that is none.
    """
    folder, hashes = manifest.parent.absolute(), dict[str, str]()  # workers may stand elsewhere
    if isinstance(stated, str):
        table = manifest.parent / stated
        entries, hashes[stated] = _rows(table, manifest)
    else:
        entries = [_listed(item, f"{manifest}, robots[{number}]") for number, item in enumerate(stated, 1)]
    if not entries:
        raise InputError("there are no robots", where=f"{manifest}, robots")
    refuse_beyond("robots", len(entries), where=str(manifest))
    general = checked_options(options, folder, lambda name: f"{manifest}, options.{name}")
    seen: dict[str, str] = {}
    readings: dict[str, tuple[RobotEntry, str]] = {}
    robots = []
    for placed in entries:
        entry = placed.entry
        _check_name(entry.name, placed.place("name"), seen)
        files = {entry.data: _existing(folder, entry.data, placed.place("data"))}
        robot = entry.robot
        if Path(robot).suffix:
            files[robot] = _existing(folder, robot, placed.place("robot"))
            robot = str(files[robot])
        own = checked_options(entry.options, folder, placed.place_of_option)
        files |= _named_files({**options, **entry.options}, folder)
        for name, path in files.items():
            if name not in hashes:
                hashes[name] = hash_of(read_bytes(path))
        _check_date(entry.date, placed.place("date"))
        if entry.of is not None and not (entry.of and is_one_line(entry.of)):
            raise InputError(
                "a serial number belongs here", where=placed.place("of"), came=entry.of, allowed="one line"
            )
        robot_entry = RobotEntry(
            entry.name,
            robot,
            folder / entry.data,
            {**general, **own},
            entry.of,
            entry.date,
            {path: hashes[name] for name, path in files.items()},
            {
                "robot": placed.place("robot"),
                **{name: f"{manifest}, options.{name}" for name in general},
                **{name: placed.place_of_option(name) for name in own},
            },
        )
        _check_readings(robot_entry, hashes[entry.data], placed.place("data"), readings)
        robots.append(robot_entry)
    content = [item.entry.model_dump(mode="json") | {"options": {**options, **item.entry.options}} for item in entries]
    return Robots(tuple(robots), hashes, content)


def _check_readings(robot: RobotEntry, data: str, location: str, seen: dict[str, tuple[RobotEntry, str]]) -> None:
    """Refuse readings that stand there twice: they would count as two robots, or say that nothing has changed."""
    other, place = seen.setdefault(data, (robot, location))
    if other is robot:
        return
    campaigns = other.machine == robot.machine
    raise InputError(
        f"the same readings stand for {f'two campaigns of {robot.machine}' if campaigns else 'two robots'}, "
        f"{other.name} and {robot.name}",
        where=location,
        came=robot.data.name,
        cure=f"{place} has them too. List them once, or give the right file.",
    )


def refuse_respelled(stated: list[Any], manifest: Path) -> None:
    """Refuse names and serial numbers of a list that YAML takes for numbers and writes otherwise, as 0123.

    Raises:
        InputError: Naming the entry.
    """
    names = ("name", "of")
    if not any(isinstance(row.get(name), int) for row in stated if isinstance(row, dict) for name in names):
        return
    from ruamel.yaml import YAML

    root = YAML(typ="safe", pure=True).compose(read_text(manifest, "yaml_size"))
    robots: list[Any] = next((node.value for key, node in root.value if key.value == "robots"), [])
    for number, (item, node) in enumerate(zip(stated, robots, strict=False), 1):
        written = {key.value: entry.value for key, entry in node.value} if isinstance(item, dict) else {}
        for name in names:
            if isinstance(item, dict) and isinstance(item.get(name), int) and written.get(name) != str(item[name]):
                raise InputError(
                    "without quotes this is a number, and its digits would be others",
                    where=f"{manifest}, robots[{number}].{name}",
                    came=written.get(name),
                    cure="Put it into quotes.",
                )


def _listed(content: object, place: str) -> _PlacedEntry:
    entry = validated(content, _Entry, place)
    return _PlacedEntry(entry, lambda part: f"{place}.{part}", lambda name: f"{place}.options.{name}")


def _rows(table: Path, manifest: Path) -> tuple[list[_PlacedEntry], str]:
    """Return the rows of a table, and the SHA-256 of what was read."""
    if not exists(table):
        raise InputError("there is no such file", where=f"{manifest}, robots", came=str(table), cure="Check the path.")
    with noted_reads() as noted:
        cells = read_cells(read_text(table), str(table), Layout(comment="#"))
    header = f"{table}, line {cells.header}"
    known = (*_COLUMNS, *OPTIONS)
    for name in cells.names:
        if name not in known:
            raise InputError(
                "there is no column of this name",
                where=header,
                came=name,
                allowed=", ".join(known),
                cure=did_you_mean(name, known),
            )
        if cells.names.count(name) > 1:
            raise InputError("two columns have the same name", where=header, came=name, cure="Remove one of them.")
    for name in _REQUIRED:
        if name not in cells.names:
            raise InputError("a column is missing", where=header, came=", ".join(cells.names), allowed=name)
    texts = {name: cells.texts(number, missing=name not in _REQUIRED) for number, name in enumerate(cells.names)}
    placed = []
    for row in range(len(cells.lines)):
        line = {name: column[row] for name, column in texts.items()}

        def place(name: str, row: int = row) -> str:
            if name in cells.names:
                return cells.place(row, cells.names.index(name))
            return f"{table}, line {cells.lines[row]}"

        entry = _Entry(
            **{name: line[name] for name in _COLUMNS if line.get(name)},
            options=of_cells({name: cell for name, cell in line.items() if name in OPTIONS}, place),
        )
        placed.append(_PlacedEntry(entry, place, place))
    return placed, noted[table.absolute()][0]


def _check_name(name: str, place: str, seen: dict[str, str]) -> None:
    """Refuse a name that cannot be a folder's, or that another robot has; letters may be large or small there."""
    if not re.fullmatch(NAME, name) or name.endswith("."):
        raise InputError("this cannot be a name", where=place, came=name, allowed=NAME_IN_WORDS)
    other = seen.setdefault(name.lower(), place)
    if other != place:
        raise InputError(
            "two robots have the same name",
            where=place,
            came=name,
            cure=f"{other} has it too. Give each a name of its own: measurements of one machine have the same 'of'.",
        )


def _check_date(text: str | None, place: str) -> None:
    if text is None:
        return
    try:
        if _DATE.fullmatch(text):
            date.fromisoformat(text)
            return
    except ValueError as error:
        raise InputError("there is no such day", where=place, came=text, allowed=_DATES) from error
    raise InputError("this is no date", where=place, came=text, allowed=_DATES)


def _existing(folder: Path, name: str, place: str) -> Path:
    """Return a file that is named, or refuse one that is not there."""
    path = folder / name
    if exists(path):
        return path
    try:
        near = nearest_names(path.name, [file.name for file in path.parent.iterdir()], count=2, likeness=0.75)
    except OSError:
        near = []
    raise InputError(
        "there is no such file",
        where=place,
        came=name,
        cure=f"Did you mean {' or '.join(near)}?" if near else "Check the path.",
    )


def _named_files(options: Mapping[str, Any], folder: Path) -> dict[str, Path]:
    return {value: folder / value for name, value in options.items() if name in FILES and isinstance(value, str)}
