"""Cameras with artefacts, closed loops, and devices that read a ball's place in a small volume."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parts import Tool
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import quaternion_from_rotation, rotation_from_quaternion
from truearm.engine.twin.devices.device import Arm, Device, recorded, shown
from truearm.engine.twin.devices.jogging import SPARE, jogged, postures_at, site


# Cameras that read the pose of an artefact: optical CMM, three active markers (Nubiola, 2.2; Patel, 3.3).
@dataclass(frozen=True)
class Artefact(Device):
    """Cameras at the origin of the world that count what they see of an artefact on the flange.

    A target is seen if it looks at the cameras within a cone. What the arm itself hides is not asked.
    """

    no_plan: ClassVar[str] = ""

    #: Where each target of the artefact looks, in the flange frame, ``(k, 3)``.
    normals: tuple[tuple[float, float, float], ...] = ()
    within: float = np.deg2rad(60.0)  #: Half the opening of a target's cone of sight [rad].
    at_least: int = 3  #: How many must be seen.
    #: Typical distance of a target from the middle of the artefact [m]: what turns a deviation of places into one of
    #: angles.
    size: float = 0.075

    @property
    def reads_where(self) -> str:
        """How many targets of the artefact must look at the cameras, and how far past them they may look."""
        within = f"{np.rad2deg(self.within):.3g} deg"
        return f"{self.at_least} targets of the artefact or more must look at the cameras within {within}"

    def counted(self, robot: Robot, joints: Array) -> NDArray[np.intp]:
        """Return how many targets of the artefact are seen, ``(n,)``."""
        place, rotation = robot.world_poses(joints, robot.targets[0].name)
        to_camera = -place / np.linalg.norm(place, axis=1, keepdims=True)
        flange = robot.world_poses(joints)[1] if robot.targets[0].quaternion is None else rotation
        cosine = np.einsum("nij,kj,ni->nk", flange, np.array(self.normals), to_camera)
        return np.asarray((cosine > np.cos(self.within)).sum(axis=1))

    def visible(self, robot: Robot, joints: Array) -> NDArray[np.bool_]:
        """Return whether the pose of the artefact can be read, ``(n, 1)``."""
        return (self.counted(robot, joints) >= self.at_least)[:, None]

    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return the pose of the artefact at random configurations that show enough of it."""
        joints, _ = shown(nominal, count, rng, self.visible, self.name)
        return self.read(nominal, arm, joints, sigma, rng)

    def read(self, nominal: Robot, arm: Arm, joints: Array, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return the pose of the artefact at joint positions ``(n, joints)``."""
        count = len(joints)
        frames = arm.frames(joints)[nominal.targets[0].name]
        place = frames[:, :3, 3] + sigma * rng.standard_normal((count, 3))
        spread = sigma / self.size
        half = 0.5 * spread * rng.standard_normal((count, 3))
        small = np.column_stack([np.ones(count), half])
        small /= np.linalg.norm(small, axis=1, keepdims=True)
        turned = rotation_from_quaternion(small) @ frames[:, :3, :3]
        return recorded(
            nominal,
            self.name,
            joints,
            range(count),
            [nominal.targets[0].name] * count,
            position=place,
            quaternion=quaternion_from_rotation(turned),
            sigma=sigma,
            sigma_rot=spread,
        )


def _even(count: int) -> tuple[tuple[float, float, float], ...]:
    """Return directions spread evenly over the sphere (golden spiral)."""
    k = np.arange(count) + 0.5
    height = 1.0 - 2.0 * k / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * k
    round_it = np.sqrt(1.0 - height**2)
    return tuple(map(tuple, np.column_stack([round_it * np.cos(turn), round_it * np.sin(turn), height]).tolist()))


_ARTEFACT: Final = Tool({"artefact": (0.05, 0.03, 0.155)})
PLANAR_ARTEFACT: Final = Artefact(
    "optical-cmm-planar",
    "optical CMM and a plate with nine targets on each side, seen within 15 deg of its normal",
    "Nubiola, section 2.2: C-Track, 0.075 mm volumetric; at least 9 of the plate; those on the base are always seen",
    sigma=2.5e-5,
    tool=_ARTEFACT,
    normals=((0.0, -1.0, 0.0),) * 9 + ((0.0, 1.0, 0.0),) * 9,
    within=np.deg2rad(15.0),
    at_least=9,
)
SPATIAL_ARTEFACT: Final = Artefact(
    "optical-cmm-spatial",
    "optical CMM and an artefact with 198 targets all round",
    "Nubiola, section 2.2.2: at least 20 of the artefact; cones of 45 deg are ours",
    sigma=2.5e-5,
    tool=_ARTEFACT,
    normals=_even(198),
    within=np.deg2rad(45.0),
    at_least=20,
)
MARKERS: Final = Artefact(
    "markers",
    "three active markers that look one way, read as a pose",
    "Patel, section 3.3: Optotrak, resolution 0.010 mm; cones of 60 deg are ours",
    sigma=3e-5,
    tool=Tool({"markers": (0.0, 0.0, 0.08)}),
    normals=((1.0, 0.0, 0.0),) * 3,
    within=np.deg2rad(60.0),
    at_least=3,
    size=0.05,
)


_BALL: Final = Tool({"ball": (0.02, 0.01, 0.12)})
_PLACES: Final = ((0.0, -0.15, -0.1), (0.0, 0.15, -0.1), (0.1, 0.0, 0.1))


# Devices that read a ball's place in a small volume of their own: stereo cameras, five lasers, three linear gauges.
#
# Where they stand is not known; they are put to several places in turn (Nubiola, section 1.7).
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
        reached, joints = postures_at(nominal, name, goals, count, rng, self.name)
        of, inside, goals = of[reached], inside[reached], goals[reached]
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


# Closed loops: a probe on a plane or a sphere, a tip held at a point (Nubiola, section 1.2), a ball in sockets.

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
        reached, joints = postures_at(nominal, name, goals, count, rng, self.name, facing=facing)
        if count >= _LEAST_ON_A_PLATE * len(plates):
            for plate in np.flatnonzero(np.bincount(of[reached], minlength=len(plates)) < _LEAST_ON_A_PLATE).tolist():
                on = np.flatnonzero(of == plate)
                more, q = postures_at(nominal, name, goals[on], _LEAST_ON_A_PLATE, rng, self.name, facing=facing[on])
                reached, joints = _with_these(reached, joints, on[more], q, of)
        of, up = of[reached], -facing[reached]
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
    reached: NDArray[np.intp], joints: Array, added: NDArray[np.intp], q: Array, of: NDArray[np.intp]
) -> tuple[NDArray[np.intp], Array]:
    """Return as many contacts as before, those of one plate exchanged, and the last of the fullest plates given up."""
    count, other = len(reached), of[reached] != of[added[0]]
    reached, joints = reached[other], joints[other]
    while len(reached) + len(added) > count:
        last = np.flatnonzero(of[reached] == np.bincount(of[reached]).argmax())[-1]
        reached, joints = np.delete(reached, last), np.delete(joints, last, axis=0)
    together = np.concatenate([reached, added])
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
        reached, joints = postures_at(nominal, name, goals, count, rng, self.name, facing=-normal, within=wide)
        of = of[reached]
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
        reached, joints = postures_at(
            nominal, name, centres[of], count, rng, self.name, facing=down, within=self.within
        )
        of = of[reached]
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
