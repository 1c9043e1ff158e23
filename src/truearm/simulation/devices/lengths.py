"""Devices that read a length from fixed points: the telescoping ballbar and four strings (Nubiola, 1.7 and 2.6.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.parts import Tool
from truearm.modeling.robot import Robot
from truearm.simulation.devices.device import Arm, Device, recorded
from truearm.simulation.devices.jogging import SPARE, jogged, postures_at, site

#: Places of the cups on a table, about the middle of the robot's reach [m].
_CUPS: Final = ((0.1, 0.0, -0.1), (-0.05, 0.0866, -0.1), (-0.05, -0.0866, -0.1))
_UPWARD: Final = 0.15


@dataclass(frozen=True)
class Ballbar(Device):
    """A telescoping ballbar from a cup on the table to a ball on the tool.

    The robot is jogged along the bar until that reads within its range, and the joints are read there. Where the cups
    stand is not known.
    """

    length: float = 0.3  #: Of the bar at its zero [m].
    range: float = 1e-3  #: How far it reads to either side [m].

    def beyond_range(self, data: Dataset) -> NDArray[np.bool_]:
        """Return which lengths differ from the bar's by more than its range."""
        if data.distance is None:
            return super().beyond_range(data)
        return np.asarray(np.abs(data.distance - self.length) > self.range * (1.0 + 1e-9))

    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return distances of the ball from three cups, in turns, in all directions that lie above the table."""
        cups = site(nominal) + np.array(_CUPS) @ nominal.base.rotation.T
        cup = np.arange(SPARE * count) % len(cups)
        way = _upward(len(cup), rng) @ nominal.base.rotation.T
        length = self.length + rng.uniform(-0.8, 0.8, len(cup)) * self.range
        name = nominal.targets[0].name
        goals = cups[cup] + length[:, None] * way
        kept, joints = postures_at(nominal, name, goals, count, rng, self.name)
        cup, length = cup[kept], length[kept]

        def too_short(place: Array) -> Array:
            bar = place - cups[cup]
            far = np.linalg.norm(bar, axis=1, keepdims=True)
            return np.asarray(bar / far * (length[:, None] - far))

        joints = jogged(nominal, arm, name, joints, too_short)
        return recorded(
            nominal,
            self.name,
            joints,
            range(count),
            [name] * count,
            distance=length + sigma * rng.standard_normal(count),
            fixtures=tuple(f"cup_{k + 1}" for k in range(len(cups))),
            fixture=cup.astype(np.intp),
            sigma=sigma,
        )


@dataclass(frozen=True)
class Strings(Device):
    """Four strings from known points to one point of the tool."""

    no_plan: ClassVar[str] = "it reads four distances at once, and a plan is gone through by places and poses"

    side: float = 1.5  #: Of the square at whose corners the strings leave [m].
    placed: float = 2e-5  #: How well these are known [m].

    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return four distances at random configurations above the strings."""
        half = 0.5 * self.side
        base = nominal.base
        corners = np.array([(x, y, -0.4) for x in (-half, half) for y in (-half, half)])
        anchors = site(nominal) + corners @ base.rotation.T
        name = nominal.targets[0].name
        up = base.rotation[:, 2]
        joints = np.empty((0, len(nominal.joints)))
        while len(joints) < count:
            drawn = nominal.random_configurations(4 * count, rng)
            above = (nominal.world_poses(drawn, name)[0] - anchors.mean(axis=0)) @ up
            joints = np.concatenate([joints, drawn[above > _UPWARD]])
        joints = joints[:count]
        place = arm.frames(joints)[name][:, :3, 3]
        length = np.linalg.norm(place[:, None] - anchors, axis=2).reshape(-1)
        fixtures = tuple(f"string_{k + 1}" for k in range(len(anchors)))
        known = recorded(
            nominal,
            self.name,
            np.zeros((1, joints.shape[1])),
            [0] * len(anchors),
            fixtures,
            position=anchors + (self.placed if sigma > 0 else 0.0) * rng.standard_normal(anchors.shape),
            fixtures=fixtures,
            sigma=self.placed,
        )
        return recorded(
            nominal,
            self.name,
            joints,
            np.repeat(np.arange(count), len(anchors)),
            [name] * len(length),
            distance=length + sigma * rng.standard_normal(len(length)),
            fixtures=fixtures,
            fixture=np.tile(np.arange(len(anchors)), count),
            setup=known,
            sigma=sigma,
        )


def _upward(count: int, rng: np.random.Generator) -> Array:
    """Return directions ``(count, 3)`` that point upward, spread over the upper half of the sphere."""
    z = rng.uniform(_UPWARD, 1.0, count)
    turn = rng.uniform(0.0, 2 * np.pi, count)
    return np.column_stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z])


BALLBAR: Final = Ballbar(
    "ballbar",
    "telescoping ballbar of 300 mm from three cups in turn, +/-1 mm, jogged into its range",
    "Nubiola, section 2.6.3: Renishaw QC20-W, 1 um",
    sigma=1e-6,
    tool=Tool({"ball": (0.0, 0.0, 0.125)}),
)
STRINGS: Final = Strings(
    "strings",
    "four strings from the corners of a square of 1.5 m, whose places are known to 0.02 mm",
    "Nubiola, section 1.7: CompuGauge, repeatability 0.020 mm",
    sigma=2e-5,
    tool=Tool({"string": (0.0, 0.0, 0.1)}),
)
