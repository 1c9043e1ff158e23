"""The instruments that can be simulated and planned for."""

from __future__ import annotations

from truearm.results.simulation import DeviceList
from truearm.simulation.devices import DEVICES


def devices() -> DeviceList:
    """List the instruments that can be simulated and planned for, with what each is good for."""
    return DeviceList(DEVICES)
