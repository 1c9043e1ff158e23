"""The robots of a fleet that were measured: entries of a manifest, or rows of a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator

from truearm.errors import InputError
from truearm.modeling.formats.entries import STRICT
from truearm.schemas import validated


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
    """A robot that was measured.

    Attributes
    ----------
    name
        In the fleet.
    robot
        What :func:`truearm.load_robot` takes.
    data
        Canonical CSV file.
    options
        Keywords of :func:`truearm.calibrate`.
    of
        Serial number or name of the machine, where it was measured several times.
    date
        When (ISO 8601).
    """

    name: str
    robot: str
    data: Path
    options: Mapping[str, Any] = field(default_factory=dict)
    of: str | None = None
    date: str | None = None

    def content(self) -> dict[str, Any]:
        """Return what is asked of it, as JSON holds it, without where the manifest stands."""
        options = {**self.options}
        return {"name": self.name, "data": self.data.name, "of": self.of, "date": self.date, "options": options}


def robots_of(
    said: object, options: Mapping[str, Any], manifest: Path
) -> tuple[tuple[RobotEntry, ...], dict[str, Path]]:
    """Return the robots that a manifest names, and their files by the names that it gives them.

    Parameters
    ----------
    said
        A list of entries, or the name of a table.
    options
        Of all robots that do not say others.
    """
    if not isinstance(said, list):
        raise InputError("a list of robots belongs here", where=f"{manifest}, robots")
    robots: list[RobotEntry] = []
    files: dict[str, Path] = {}
    for number, one in enumerate(said, 1):
        entry = validated(one, _Entry, f"{manifest}, robots[{number}]")
        if any(entry.name == known.name for known in robots):
            raise InputError(
                "two robots have the same name",
                where=f"{manifest}, robots[{number}].name",
                came=entry.name,
                cure="Give each a name of its own; measurements of one machine say so with of.",
            )
        files[entry.data] = manifest.parent / entry.data
        robot = entry.robot
        if Path(robot).suffix:
            files[robot] = manifest.parent / robot
            robot = str(files[robot])
        robots.append(
            RobotEntry(entry.name, robot, files[entry.data], {**options, **entry.options}, entry.of, entry.date)
        )
    if not robots:
        raise InputError("there are no robots", where=f"{manifest}, robots")
    return tuple(robots), files
