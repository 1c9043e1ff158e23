"""What a campaign was measured with, and in what air: asked of the user, and kept with the data.

A file says it, all of it optional::

    truearm: truearm-about/1
    units: {length: mm, temperature: degC, pressure: hPa, humidity: percent}
    instrument: {name: tracker of the hall, serial: "750123"}
    robot: {serial: "120-501234"}
    reflector: {radius: 19.05, offset: 0.0}
    environment:
      - {at: start, temperature: 20.4, pressure: 1013.2, humidity: 45}

Nothing is computed from it: instruments correct for air and reflector themselves.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, Field, StringConstraints

from truearm.errors import InputError
from truearm.files import read_yaml
from truearm.modeling.formats.entries import STRICT, Number
from truearm.notices import Notice
from truearm.printable import is_one_line
from truearm.units import sized_si

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
        said = {
            "serial number of the instrument": self.instrument_serial,
            "serial number of the robot": self.robot_serial,
            "radius of the reflector": self.reflector_radius,
            "offset of the reflector": self.reflector_offset,
            **{
                f"{name} of the air": next((v for a in self.environment if (v := getattr(a, name)) is not None), None)
                for name in _AIR
            },
        }
        return [name for name, value in said.items() if value is None]

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
        found = [
            ("instrument", self.instrument or "not said"),
            ("serial number of the instrument", self.instrument_serial or "not said"),
            ("serial number of the robot", self.robot_serial or "not said"),
            ("radius of the reflector", _millimetres(self.reflector_radius)),
            ("offset of the reflector", _millimetres(self.reflector_offset)),
        ]
        for air in self.environment:
            said = [f"{value:g} {_AIR[name][2]}" for name in _AIR if (value := getattr(air, name)) is not None]
            found.append((f"air, {air.at}", ", ".join(said) or "not said"))
        return found if self.environment else [*found, ("air", "not said")]

    def notices(self) -> list[Notice]:
        """Name what nobody said."""
        if not self.missing:
            return []
        return [
            Notice(
                "not-said",
                f"Nobody said: {', '.join(self.missing)}. Whoever repeats the measurement needs it; give `about`.",
                "note",
            )
        ]


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
