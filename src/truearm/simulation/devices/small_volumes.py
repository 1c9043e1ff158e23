"""Devices that read a ball's place in a small volume of their own: stereo cameras, five lasers, three linear gauges.

Where they stand is not known; they are put to several places in turn (Nubiola, section 1.7).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.measurement.dataset import Dataset
from truearm.modeling.parts import Tool
from truearm.modeling.robot import Robot
from truearm.simulation.devices.device import Arm, Device, recorded
from truearm.simulation.devices.jogging import SPARE, jogged, postures_at, site

_BALL: Final = Tool({"ball": (0.02, 0.01, 0.12)})
_PLACES: Final = ((0.0, -0.15, -0.1), (0.0, 0.15, -0.1), (0.1, 0.0, 0.1))


@dataclass(frozen=True)
class SmallVolume(Device):
    """A device that reads where the centre of a ball is, within a box, in its own frame."""

    range: tuple[float, float, float] = (0.01, 0.01, 0.01)  #: Sides of the box [m].
    #: Radius about the middle within which it reads, if that is no box [m]; the box then lies inside.
    sphere: float | None = None
    places: int = 3  #: How many places it is put to.

    def beyond_range(self, data: Dataset) -> NDArray[np.bool_]:
        """Return which places, counted from the middle, are outside the box or sphere."""
        if self.sphere is not None:
            return np.asarray(np.linalg.norm(data.position, axis=1) > self.sphere)
        return np.asarray((np.abs(data.position) > 0.5 * np.array(self.range)).any(axis=1))

    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return places of the ball all over the box, with the tool turned to all sides."""
        turned = nominal.base.rotation
        origins = site(nominal) + np.array(_PLACES[: self.places]) @ turned.T
        of = np.arange(SPARE * count) % self.places
        inside = rng.uniform(-0.45, 0.45, (len(of), 3)) * self.range
        name = nominal.targets[0].name
        goals = origins[of] + inside @ turned.T
        kept, joints = postures_at(nominal, name, goals, count, rng, self.name)
        of, inside, goals = of[kept], inside[kept], goals[kept]
        joints = jogged(nominal, arm, name, joints, lambda place: goals - place)
        return recorded(
            nominal,
            self.name,
            joints,
            range(count),
            [name] * count,
            position=inside + sigma * rng.standard_normal((count, 3)),
            fixtures=tuple(f"place_{k + 1}" for k in range(self.places)),
            fixture=of.astype(np.intp),
            sigma=sigma,
        )


STEREO: Final = SmallVolume(
    "stereo",
    "two cameras that see the centre of a ball within 2 mm, at three places",
    "Nubiola, section 1.7.3: ROSY, 0.020 mm within a sphere of +/-2 mm; a cube of 2 mm in it is used",
    sigma=1e-5,
    tool=_BALL,
    range=(0.002, 0.002, 0.002),
    sphere=0.002,
)
FIVE_LASERS: Final = SmallVolume(
    "five-lasers",
    "five line lasers that see the centre of a ball within 39.5 x 38.5 x 36.5 mm, at three places",
    "Nubiola, section 1.7: LaserLab, repeatability 0.020 mm, typical 0.035 mm",
    sigma=2e-5,
    tool=_BALL,
    range=(0.0395, 0.0385, 0.0365),
)
GAUGES: Final = SmallVolume(
    "gauges",
    "three linear gauges square to each other against a ball, within 10 mm, at three places",
    "Nubiola, future work: 1 um, range 10 mm",
    sigma=1e-6,
    tool=_BALL,
)
