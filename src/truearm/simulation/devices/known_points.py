"""Known points touched by hand: the holes of a calibration table (Li et al.), a printed circle (Patel, 5.5.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.parts import Tool
from truearm.modeling.robot import Robot
from truearm.simulation.devices.calibration_table import rectangular_grid
from truearm.simulation.devices.device import Arm, Device, recorded
from truearm.simulation.devices.jogging import SPARE, jogged, postures_at, site

_STAYS: Final = np.deg2rad(75.0)


@dataclass(frozen=True)
class KnownPoints(Device):
    """A plate with known points that the tip is jogged to by hand, at several places in turn.

    Where the plate lies is not known. The tool is turned otherwise each time.
    """

    points: tuple[tuple[float, float, float], ...] = ()  #: Places on the plate in its own frame [m].
    #: How the plate lies each time: roll, pitch and yaw against the base, ``Rz Ry Rx`` [rad].
    plates: tuple[tuple[float, float, float], ...] = ((0.0, 0.0, 0.0),)

    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return where the tip is on each plate: point after point, again and again."""
        base, middle = nominal.base.rotation, site(nominal)
        plate = np.arange(SPARE * count) % len(self.plates)
        known = np.array(self.points)
        on_plate = known[np.arange(len(plate)) // len(self.plates) % len(known)]
        lying = np.array([base @ _turned(*angles) for angles in self.plates])[plate]
        goals = middle + np.einsum("nij,nj->ni", lying, on_plate)
        name = nominal.targets[0].name
        facing = -lying[:, :, 2]
        kept, joints = postures_at(nominal, name, goals, count, rng, self.name, facing=facing, within=_STAYS)
        plate, on_plate = plate[kept], on_plate[kept]
        wanted = goals[kept] + sigma * rng.standard_normal((count, 3))
        joints = jogged(nominal, arm, name, joints, lambda place: wanted - place)
        return recorded(
            nominal,
            self.name,
            joints,
            range(count),
            [name] * count,
            position=on_plate,
            fixtures=tuple(f"plate_{k + 1}" for k in range(len(self.plates))),
            fixture=plate.astype(np.intp),
            sigma=sigma,
        )


def _turned(roll: float, pitch: float, yaw: float) -> Array:
    """Return ``Rz(yaw) Ry(pitch) Rx(roll)``."""
    (a, b, c), (k, m, n) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, a, -k], [0.0, k, a]])
    about_y = np.array([[b, 0.0, m], [0.0, 1.0, 0.0], [-m, 0.0, b]])
    about_z = np.array([[c, -n, 0.0], [n, c, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(about_z @ about_y @ about_x)


def _grid() -> tuple[tuple[float, float, float], ...]:
    return tuple((x, y, z) for x, y, z in rectangular_grid(6, 5, 0.05).tolist())


_TILT: Final = float(np.deg2rad(20.0))
_SLOPE: Final = float(np.deg2rad(-45.0))
_RADIUS: Final = 0.1
CALIBRATION_TABLE: Final = KnownPoints(
    "calibration-table",
    "table with 30 known holes 50 mm apart, level, rolled and pitched by 20 deg, touched by hand",
    "Li et al., section 3: holes of a table on a ball joint that turns by up to 20 deg; grid and deviation ours",
    sigma=5e-5,
    tool=Tool({"tip": (0.02, 0.01, 0.15)}),
    points=_grid(),
    plates=((0.0, 0.0, 0.0), (_TILT, 0.0, 0.0), (0.0, _TILT, 0.0)),
)
TOUCH_UP: Final = KnownPoints(
    "touch-up",
    "pencil jogged by hand to four points of a printed circle on a slope of 45 deg, two pages",
    "Patel, section 5.5.2: four points a quarter apart on a plane at 45 deg; radius and deviation ours",
    sigma=2e-4,
    tool=Tool({"pencil": (0.02, 0.01, 0.15)}),
    points=((_RADIUS, 0.0, 0.0), (0.0, _RADIUS, 0.0), (-_RADIUS, 0.0, 0.0), (0.0, -_RADIUS, 0.0)),
    plates=((0.0, _SLOPE, 0.0), (0.0, _SLOPE, float(np.pi / 2))),
)
