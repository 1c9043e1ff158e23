"""What can be named: the robots of the library, and the instruments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from truearm.modeling.robot import Robot
from truearm.results.record import Record
from truearm.simulation.devices import Device


@dataclass(frozen=True, eq=False, repr=False)
class RobotList(Record):
    """The robots of the library.

    Attributes
    ----------
    robots
        In the order of their ids.
    """

    robots: tuple[Robot, ...]

    def summary(self) -> dict[str, Any]:
        """Return id, title, joints and source of each, as JSON holds them."""
        rows = [{"id": r.name, "title": r.title, "joints": len(r.joints), "source": r.source} for r in self.robots]
        return {"robots": rows}

    def lines(self) -> list[str]:
        """Return one line a robot."""
        width = max(len(r.name) for r in self.robots)
        return [f"{r.name:{width}}  {len(r.joints)} joints  {r.title}" for r in self.robots]


@dataclass(frozen=True, eq=False, repr=False)
class DeviceList(Record):
    """The instruments that can be simulated and planned for.

    Attributes
    ----------
    devices
        In the order of the registry.
    """

    devices: tuple[Device, ...]

    def summary(self) -> dict[str, Any]:
        """Return name, words, deviation and source of each, as JSON holds them."""
        rows = [
            {"name": d.name, "summary": d.summary, "sigma_mm": d.sigma * 1e3, "source": d.source} for d in self.devices
        ]
        return {"devices": rows}

    def lines(self) -> list[str]:
        """Return one line an instrument."""
        width = max(len(device.name) for device in self.devices)
        return [f"{d.name:<{width}}  {d.summary}; deviation {d.sigma * 1e3:g} mm" for d in self.devices]
