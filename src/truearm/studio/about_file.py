"""The file of what was measured with, entry by entry: what else it says, its units and its comments stay."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any, Final

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import exists, read_text, read_yaml
from truearm.engine.base.schemas import validated
from truearm.engine.base.units import from_si, sized_si
from truearm.measuring.reading_log import AboutFile, about_of

Change = Callable[[Any, str], None]
_NEW: Final = "truearm: truearm-about/1\nunits: {length: mm, temperature: degC, pressure: hPa, humidity: percent}\n"
#: What is read of the air.
AIR: Final = ("temperature", "pressure", "humidity")


@dataclass(frozen=True)
class _Entry:
    """Where an entry stands: its group, its name there, and whether it is a length."""

    group: str
    name: str
    is_length: bool = False


#: By the names of :class:`truearm.measuring.reading_log.About`.
ENTRIES: Final[dict[str, _Entry]] = {
    "instrument": _Entry("instrument", "name"),
    "instrument_serial": _Entry("instrument", "serial"),
    "robot_serial": _Entry("robot", "serial"),
    "reflector_radius": _Entry("reflector", "radius", True),
    "reflector_offset": _Entry("reflector", "offset", True),
}


def changed_about(path: Path, change: Change) -> str:
    """Return the text of a file after a change; a file that is missing is a new one.

    Args:
        change: Called with the entries of the file and its unit of lengths, to change the entries.

    Raises:
        InputError: If the file is no such one, or would not be one that can be used.
    """
    from ruamel.yaml import YAML

    yaml, stream = YAML(), StringIO()
    yaml.width, yaml.preserve_quotes = 4096, True
    if exists(path):
        read_yaml(path, AboutFile)  # what cannot be read safely is refused before it is read to be changed
    content = yaml.load(read_text(path, "yaml_size") if exists(path) else _NEW)
    change(content, str(content["units"].get("length", "mm")))
    yaml.dump(content, stream)
    about_of(validated(_plain(content), AboutFile, path.name), path.name)
    return stream.getvalue()


def with_entry(name: str, value: str | float | None) -> Change:
    """Return a change that sets one of ``ENTRIES``, a length in mm; None takes it out."""
    entry = ENTRIES[name]

    def change(content: Any, unit: str) -> None:
        group = content.setdefault(entry.group, {})
        if value is None:
            group.pop(entry.name, None)
        elif entry.is_length:
            if entry.name == "offset" and "radius" not in group:
                raise InputError("a reflector has a radius first", parameter="reflector_radius", came="none")
            group[entry.name] = _in_file(float(value), unit, name)
        else:
            group[entry.name] = value
        if not group:
            del content[entry.group]

    return change


def with_air(when: str, values: Mapping[str, float | None]) -> Change:
    """Return a change that adds a reading of the air: when, in words, and values in degC, hPa and percent."""

    def change(content: Any, _: str) -> None:
        read = {name: value for name, value in values.items() if value is not None}
        if not when or not read:
            raise InputError(
                "nobody says when" if not when else "nothing of the air was read",
                parameter="at" if not when else ", ".join(AIR),
                allowed="such as start, or 14:30" if not when else "one of them, or more",
            )
        content.setdefault("environment", []).append({"at": when, **read})

    return change


def _in_file(value: float, unit: str, parameter: str) -> float:
    metres = sized_si(value, "mm", parameter=parameter)
    return value if unit == "mm" else round(from_si(metres, unit), 12)


def _plain(content: Any) -> Any:
    """Return entries as plain mappings, lists and values, as a reader sees them."""
    if isinstance(content, Mapping):
        return {key: _plain(value) for key, value in content.items()}
    if isinstance(content, list):
        return [_plain(value) for value in content]
    return str(content) if isinstance(content, str) else content
