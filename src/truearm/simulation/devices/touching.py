"""Closed loops: a probe on a plane or a sphere, a tip held at a point (Nubiola, section 1.2), a ball in sockets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.parts import Tool
from truearm.modeling.robot import Robot
from truearm.simulation.devices.device import Arm, Device, recorded
from truearm.simulation.devices.jogging import SPARE, jogged, postures_at, site

#: Three contacts place a plate, one more tells something of the robot.
_LEAST_ON_A_PLATE: Final = 4
_STYLUS: Final = Tool({"stylus": (0.02, 0.01, 0.15)})


@dataclass(frozen=True)
class PlaneProbe(Device):
    """A touch probe on a flat plate, level and leaning to two sides: its tip is in a plane, where nobody knows.

    A level plate alone says nothing of lengths across an upright first axis.
    """

    size: float = 0.3  #: Side of the plate [m].
    leaning: float = np.deg2rad(30.0)  #: By how much it leans [rad].

    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return contacts all over the plate in turns, the probe within 60 deg of its normal."""
        base, middle = nominal.base.rotation, site(nominal)
        c, s = np.cos(self.leaning), np.sin(self.leaning)
        about_x, about_y = [[1, 0, 0], [0, c, -s], [0, s, c]], [[c, 0, s], [0, 1, 0], [-s, 0, c]]
        plates = base @ np.array([np.eye(3), about_x, about_y])
        of = np.arange(SPARE * count) % len(plates)
        places = np.column_stack([rng.uniform(-0.5, 0.5, (len(of), 2)) * self.size, np.zeros(len(of))])
        name = nominal.targets[0].name
        goals = middle + np.einsum("nij,nj->ni", plates[of], places)
        facing = -plates[of, :, 2]
        kept, joints = postures_at(nominal, name, goals, count, rng, self.name, facing=facing)
        if count >= _LEAST_ON_A_PLATE * len(plates):
            for plate in np.flatnonzero(np.bincount(of[kept], minlength=len(plates)) < _LEAST_ON_A_PLATE).tolist():
                on = np.flatnonzero(of == plate)
                more, q = postures_at(nominal, name, goals[on], _LEAST_ON_A_PLATE, rng, self.name, facing=facing[on])
                kept, joints = _with_these(kept, joints, on[more], q, of)
        of, up = of[kept], -facing[kept]
        miss = sigma * rng.standard_normal(count)

        def short(place: Array) -> Array:
            return np.asarray((miss - np.sum((place - middle) * up, axis=1))[:, None] * up)

        joints = jogged(nominal, arm, name, joints, short)
        return recorded(
            nominal,
            self.name,
            joints,
            range(count),
            [name] * count,
            height=np.zeros(count),
            fixtures=("plate_level", "plate_leaning_1", "plate_leaning_2"),
            fixture=of.astype(np.intp),
            sigma=sigma,
        )


def _with_these(
    kept: NDArray[np.intp], joints: Array, added: NDArray[np.intp], q: Array, of: NDArray[np.intp]
) -> tuple[NDArray[np.intp], Array]:
    """Return as many contacts as before, those of one plate exchanged, and the last of the fullest plates given up."""
    count, other = len(kept), of[kept] != of[added[0]]
    kept, joints = kept[other], joints[other]
    while len(kept) + len(added) > count:
        last = np.flatnonzero(of[kept] == np.bincount(of[kept]).argmax())[-1]
        kept, joints = np.delete(kept, last), np.delete(joints, last, axis=0)
    together = np.concatenate([kept, added])
    order = np.argsort(together)
    return together[order], np.concatenate([joints, q])[order]


@dataclass(frozen=True)
class SphereProbe(Device):
    """A touch probe on precision spheres: its tip is at a known distance from their centres."""

    radius: float = 0.017  #: Of sphere and tip together [m].
    apart: float | None = None  #: Distance of two spheres, which is known [m]; None for one alone.
    known: float = 1e-6  #: How well [m].

    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return contacts on the upper half of the spheres, in turns."""
        turned, middle = nominal.base.rotation, site(nominal)
        places = [np.zeros(3)] if self.apart is None else [np.array([0.0, s * self.apart / 2, 0.0]) for s in (-1, 1)]
        centres = np.array([middle + turned @ place for place in places])
        of = np.arange(SPARE * count) % len(centres)
        z = rng.uniform(0.0, 1.0, len(of))
        around = rng.uniform(0.0, 2 * np.pi, len(of))
        flat = np.sqrt(1.0 - z**2)
        normal = np.column_stack([flat * np.cos(around), flat * np.sin(around), z]) @ turned.T
        name = nominal.targets[0].name
        goals = centres[of] + self.radius * normal
        wide = np.deg2rad(75.0)
        kept, joints = postures_at(nominal, name, goals, count, rng, self.name, facing=-normal, within=wide)
        of = of[kept]
        miss = sigma * rng.standard_normal(count)

        def short(place: Array) -> Array:
            from_centre = place - centres[of]
            far = np.linalg.norm(from_centre, axis=1, keepdims=True)
            return np.asarray(from_centre / far * ((self.radius + miss)[:, None] - far))

        joints = jogged(nominal, arm, name, joints, short)
        fixtures = tuple(f"sphere_{k + 1}" for k in range(len(centres)))
        return recorded(
            nominal,
            self.name,
            joints,
            range(count),
            [name] * count,
            distance=np.full(count, self.radius),
            fixtures=fixtures,
            fixture=of.astype(np.intp),
            setup=None if self.apart is None else _between(self, nominal, fixtures, self.apart, self.known, sigma, rng),
            sigma=sigma,
        )


@dataclass(frozen=True)
class HeldAtPoint(Device):
    """A tip that is jogged by eye to one point, from all sides."""

    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return postures that hold the tip at the point."""
        point = site(nominal)
        name = nominal.targets[0].name
        goals = np.tile(point, (SPARE * count, 1))
        _, joints = postures_at(nominal, name, goals, count, rng, self.name)
        wanted = point + sigma * rng.standard_normal((count, 3))
        joints = jogged(nominal, arm, name, joints, lambda place: wanted - place)
        return recorded(
            nominal,
            self.name,
            joints,
            range(count),
            [name] * count,
            position=np.zeros((count, 3)),
            fixtures=("point",),
            fixture=np.zeros(count, dtype=np.intp),
            sigma=sigma,
        )


@dataclass(frozen=True)
class TwoSockets(Device):
    """A ball that is put into two sockets by hand, in ever other postures; joint positions are all that is read."""

    apart: float = 0.2  #: Distance of the sockets' centres [m].
    known: float = 2e-5  #: How well [m].
    #: How far the flange's z may lean from straight down: the ball's stem meets the socket beyond [rad].
    within: float = np.deg2rad(75.0)

    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return postures with the ball in the sockets, in turns, so that no posture follows from the one before."""
        turned, middle = nominal.base.rotation, site(nominal)
        centres = np.array([middle + turned @ np.array([0.0, s * self.apart / 2, 0.0]) for s in (-1, 1)])
        of = np.arange(SPARE * count) % len(centres)
        name = nominal.targets[0].name
        down = np.tile(-turned[:, 2], (len(of), 1))
        kept, joints = postures_at(nominal, name, centres[of], count, rng, self.name, facing=down, within=self.within)
        of = of[kept]
        wanted = centres[of] + sigma * rng.standard_normal((count, 3))
        joints = jogged(nominal, arm, name, joints, lambda place: wanted - place)
        fixtures = ("socket_1", "socket_2")
        return recorded(
            nominal,
            self.name,
            joints,
            range(count),
            [name] * count,
            position=np.zeros((count, 3)),
            fixtures=fixtures,
            fixture=of.astype(np.intp),
            setup=_between(self, nominal, fixtures, self.apart, self.known, sigma, rng),
            sigma=sigma,
        )


def _between(
    device: Device,
    nominal: Robot,
    fixtures: tuple[str, ...],
    apart: float,
    known: float,
    sigma: float,
    rng: np.random.Generator,
) -> Dataset:
    """Return what is known of two fixtures: their distance [m], read with the deviation `known` unless `sigma` is 0."""
    return recorded(
        nominal,
        device.name,
        np.zeros((1, len(nominal.joints))),
        [0],
        [fixtures[1]],
        distance=np.array([apart + (known if sigma > 0 else 0.0) * rng.standard_normal()]),
        fixtures=fixtures,
        fixture=np.zeros(1, dtype=np.intp),
        sigma=known,
    )


PLANE: Final = PlaneProbe(
    "plane",
    "touch probe on a flat plate of 300 mm, level and leaning by 30 deg to two sides",
    "Nubiola, section 1.2: planar constraints (Ikits and Hollerbach 1997); plate and deviation ours",
    sigma=5e-6,
    tool=_STYLUS,
)
SPHERE: Final = SphereProbe(
    "sphere",
    "touch probe on one sphere of 15 mm radius",
    "Nubiola, section 1.2: diameter of a sphere as in MasterCal; sizes and deviation ours",
    sigma=5e-6,
    tool=_STYLUS,
)
TWO_SPHERES: Final = SphereProbe(
    "two-spheres",
    "touch probe on two spheres 300 mm apart, known to 0.001 mm",
    "Nubiola, section 1.2: MasterCal; sizes and deviations ours",
    sigma=5e-6,
    tool=_STYLUS,
    apart=0.3,
)
POINT: Final = HeldAtPoint(
    "point",
    "tip jogged by eye to one point, from all sides",
    "Nubiola, section 1.2: point constraint; deviation ours",
    sigma=5e-5,
    tool=Tool({"tip": (0.02, 0.01, 0.15)}),
)
TWO_SOCKETS: Final = TwoSockets(
    "two-sockets",
    "ball on the flange put into two sockets 200 mm apart, known to 0.02 mm; nothing but joint positions is read",
    "Franzese et al. 2025 (MUKCa): two sockets a known distance apart; distance and deviations ours",
    sigma=2e-5,
    tool=Tool({"ball": (0.02, 0.01, 0.15)}),
)
