"""What the ballbar reads of a twin: true distances with noise, nothing where they are beyond its range."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truearm.engine.data.hexapod import DEVICE, Design, Device, side_names
from truearm.engine.robot.chain import Array


@dataclass
class Ballbar:
    """A ballbar in use."""

    device: Device  #: Its range and noise.
    rng: np.random.Generator  #: For the noise.
    #: What each reading adds to the next ones until the bar is initialised again [m]. Nubiola (3.5) saw as much as 3 um
    #: after many readings.
    drift: float = 0.0
    _readings: int = 0

    def initialise(self) -> None:
        """Put the bar on its calibrator: the drift begins anew."""
        self._readings = 0

    def read(self, distance: Array, nominal: float) -> Array:
        """Return what it reads of true distances [m], one after the other; NaN beyond its range."""
        number = self._readings + np.arange(distance.size).reshape(distance.shape)
        self._readings += distance.size
        read = distance + self.device.sigma * self.rng.standard_normal(distance.shape) + self.drift * number
        return np.where(np.abs(read - nominal) <= self.device.reach, read, np.nan)


def ballbar(rng: np.random.Generator, device: Device = DEVICE, drift: float = 0.0) -> Ballbar:
    """Return a ballbar that was just initialised."""
    return Ballbar(device, rng, drift)


def measured_sides(bar: Ballbar, cups: Array, fixture: str) -> dict[str, float]:
    """Return the distances 12, 23, 31 of a fixture that were in range, by name, from its true cups ``(3, 3)`` [m]."""
    nominal = bar.device.base if fixture == "B" else bar.device.tool
    read = bar.read(np.linalg.norm(cups - np.roll(cups, -1, axis=0), axis=1), nominal)
    return {name: value for name, value in zip(side_names(fixture), read.tolist(), strict=True) if np.isfinite(value)}


def measured_legs(bar: Ballbar, design: Design, base_cups: Array, tool_cups: Array) -> dict[str, float]:
    """Return the legs of a design that were in range, by name, from the true cups, each ``(3, 3)`` [m]."""
    true = np.array([np.linalg.norm(tool_cups[tool] - base_cups[base]) for base, tool in design.legs])
    read = zip(design.leg_names, bar.read(true, bar.device.leg).tolist(), strict=True)
    return {name: value for name, value in read if np.isfinite(value)}
