"""A circle printed on a page on a slope: four points touched up by hand (Patel, section 5.5.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.measurement.dataset import Dataset
from truearm.measurement.devices.device import Arm, Device, recorded
from truearm.measurement.devices.jogging import SPARE, jogged, postures_at, site
from truearm.modeling.parts import Tool
from truearm.modeling.robot import Robot

_SLOPE: Final = np.deg2rad(45.0)
_STAYS: Final = np.deg2rad(75.0)


@dataclass(frozen=True)
class TouchUp(Device):
    """A pencil that is jogged by hand to points of a printed circle a quarter apart.

    Attributes
    ----------
    radius
        Of the circle [m].
    pages
        How many pages are laid out, each turned by a right angle about the upright.
    """

    radius: float = 0.1
    pages: int = 2

    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return where the pencil is on each page: four points, again and again with the tool turned otherwise."""
        base, middle = nominal.base.rotation, site(nominal)
        page = np.arange(SPARE * count) % self.pages
        quarter = np.pi / 2 * (np.arange(len(page)) // self.pages % 4)
        on_page = self.radius * np.column_stack([np.cos(quarter), np.sin(quarter), np.zeros(len(page))])
        turned = np.array([base @ _page(np.pi / 2 * k) for k in range(self.pages)])[page]
        goals = middle + np.einsum("nij,nj->ni", turned, on_page)
        name = nominal.targets[0].name
        facing = -turned[:, :, 2]
        kept, joints = postures_at(nominal, name, goals, count, rng, self.name, facing=facing, within=_STAYS)
        page, on_page = page[kept], on_page[kept]
        wanted = goals[kept] + sigma * rng.standard_normal((count, 3))
        joints = jogged(nominal, arm, name, joints, lambda place: wanted - place)
        return recorded(
            nominal,
            self.name,
            joints,
            range(count),
            [name] * count,
            position=on_page,
            fixtures=tuple(f"page_{k + 1}" for k in range(self.pages)),
            fixture=page.astype(np.intp),
            sigma=sigma,
        )


def _page(turn: float) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Return the axes of a page that slopes by 45 deg and is turned about the upright."""
    c, s = np.cos(turn), np.sin(turn)
    upright = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    k, m = np.cos(_SLOPE), np.sin(_SLOPE)
    return np.asarray(upright @ np.array([[k, 0.0, -m], [0.0, 1.0, 0.0], [m, 0.0, k]]))


TOUCH_UP: Final = TouchUp(
    "touch-up",
    "pencil jogged by hand to four points of a printed circle on a slope of 45 deg, two pages",
    "Patel, section 5.5.2: four points a quarter apart on a plane at 45 deg; deviation ours",
    sigma=2e-4,
    tool=Tool({"pencil": (0.02, 0.01, 0.15)}),
)
