"""What an instrument reads of a simulated robot."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from truearm.measurement.dataset import Dataset
from truearm.results.record import Record
from truearm.shown import counted
from truearm.simulation.devices import Device


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Record):
    """What an instrument reads of a simulated robot."""

    robot: str  #: Name of the nominal robot.
    truth: str  #: What the simulated robot truly is: the name of a truth, or the robot file.
    data: Dataset  #: The readings.
    out: Path | None = None  #: The file that holds them; None if none was written.
    stopped_before: bool = False  #: Whether the arm stopped right before each configuration where a plan says so.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "robot": self.robot,
            "truth": self.truth,
            "configurations": self.data.configurations,
            "joints_are": self.data.joints_are,
            "readings": len(self.data.target),
            "targets": list(self.data.targets),
            "fixtures": list(self.data.fixtures),
            "stopped_before": self.stopped_before,
        }

    def lines(self) -> list[str]:
        """Return what was read."""
        data = self.data
        what = f"{counted(len(data.target), 'reading')} of {counted(len(data.targets), 'target')}"
        against = f" against {', '.join(data.fixtures)}" if data.fixtures else ""
        where = "" if self.out is None else f": {self.out}"
        many = counted(data.configurations, "configuration")
        said = [f"{many} of {self.robot} ({self.truth}), {what}{against}{where}"]
        if self.stopped_before:
            said.append("Before each the arm stopped at its approach_i; the order of the data counts these stops, too.")
        return said


@dataclass(frozen=True, eq=False, repr=False)
class DeviceList(Record):
    """The instruments that can be simulated and planned for."""

    devices: tuple[Device, ...]  #: In the order of the registry.

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
