"""A Katana twin calibrated with one instrument after the other, for the study katana-devices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from truearm.compensation.trajectories import corrected
from truearm.errors import InputError
from truearm.identification.solving.fit import Fit, identify, place
from truearm.identification.solving.models import MODELS
from truearm.identification.solving.redundancy import gauge_freedoms
from truearm.measurement.circles import fit_circle
from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.parts import Tool
from truearm.modeling.robot import Robot
from truearm.modeling.transform import IDENTITY, Transform, rigid_motion
from truearm.planning.paths.joint_motion import JointMotion
from truearm.planning.paths.trajectory import Trajectory
from truearm.simulation.devices import DEVICES, Device, measured_with
from truearm.simulation.devices.artefacts import MARKERS, PLANAR_ARTEFACT, SPATIAL_ARTEFACT, Artefact
from truearm.simulation.devices.hexapod_poses import HEXAPOD
from truearm.simulation.devices.known_points import TOUCH_UP
from truearm.simulation.devices.pencil import DRAWN_CIRCLE, PencilCircle
from truearm.simulation.devices.tracker import TRACKER, Tracker
from truearm.simulation.twin import Twin
from truearm.studies.katana import NOISE, TIP, inclined, katana, published, twin
from truearm.studies.katana_circle import PENCIL, motions, paths

#: Where the robot stands before an instrument at the origin: 2.6 m away (the Optotrak sees from 2 to 7 m), turned.
_STANDS: Final = Transform((2.5, 0.2, -0.7), (0.5**0.5, 0.0, 0.0, 0.5**0.5))
_POINT: Final = Tool({TIP: (0.0, 0.0, PENCIL)})
#: The attachment of chapters 3 and 4, whose end is the point that the document's tables are of.
_ATTACHMENT: Final = Tool({TIP: (0.0, 0.0, 0.0)})
_REFLECTORS: Final = {TIP: (0.0, 0.0, PENCIL), "left": (0.08, 0.0, 0.05), "right": (-0.08, 0.0, 0.05)}
#: The circle of section 5.5.1 in the base frame [m].
_MIDDLE: Final = (0.0, -0.3, 0.1392893)
_RADIUS: Final = 0.1
_CONE: Final = float(np.deg2rad(45.0))
_DRAWN_AT_RANDOM: Final = 10_000
_TIME: Final = 0.2  # s, between points of the circle that are looked at

OPTOTRAK, TRACKED, CAMERAS = (
    "three active markers (Optotrak)",
    "laser tracker, one reflector seen within 45 deg",
    "optical CMM of 0.060 mm",
)
LOW_COST: Final = "low-cost set-up: touch-up and drawn circle"
#: The document's instruments with their configurations: 118 poses (section 3.4), 30 points (section 3.3).
DOCUMENT: Final[Mapping[str, tuple[Device, int]]] = {
    OPTOTRAK: (replace(MARKERS, sigma=NOISE, tool=_ATTACHMENT), 118),
    f"{OPTOTRAK}, 30 points": (replace(MARKERS, sigma=NOISE, tool=_ATTACHMENT), 30),
    f"{TRACKED}, 30 points": (replace(TRACKER, within=_CONE, tool=_ATTACHMENT), 30),
    f"{CAMERAS}, 30 points": (replace(SPATIAL_ARTEFACT, sigma=6e-5, tool=_ATTACHMENT), 30),
}
#: The hexapod's tool has to take whole poses, which five joints cannot.
USED: Final = tuple(device for device in DEVICES if device.name != HEXAPOD.name)
_TRIES: Final = 10
Start = Literal["geometry alone", "tilting first"]
STARTS: Final[tuple[Start, ...]] = ("geometry alone", "tilting first")
_GEOMETRIC: Final = next(model for model in MODELS if model.name == "geometric")


@dataclass(frozen=True)
class Counts:
    """How much is measured and judged.

    Attributes
    ----------
    registry
        Configurations of each device of the registry but the two of the low-cost set-up.
    touched, drawn
        Contacts of the touch-up, and points of the drawn circles.
    unseen
        Configurations to judge by.
    """

    registry: int = 48
    touched: int = 24
    drawn: int = 72
    unseen: int = 100

    def of(self, device: Device) -> int:
        """Return how many configurations a device of the registry gets."""
        return {TOUCH_UP.name: self.touched, DRAWN_CIRCLE.name: self.drawn}.get(device.name, self.registry)


@dataclass(frozen=True, eq=False)
class Reached:
    """What a calibration with one instrument reaches.

    Attributes
    ----------
    configurations
        How many were measured.
    own
        Mean and largest error on unseen configurations in the instrument's own frame [mm]; NaN where it has none.
    moved
        Likewise after the best rigid motion of all predictions.
    size
        By how much predicted lengths are too long [1].
    trusted
        What nobody measured: the base, the size.
    unseen
        Parameters that predictions need and the readings do not tell.
    """

    configurations: int
    own: tuple[float, float]
    moved: tuple[float, float]
    size: float
    trusted: tuple[str, ...]
    unseen: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class OnPage:
    """The circle of section 5.5.1 as the twin went round it.

    Attributes
    ----------
    along
        Angle round the circle [deg], ``(n,)``.
    outward, height
        What the page shows beside a circle of the right size about the line's own middle, in its own plane [mm].
    distance
        How far the tip truly was from where it should be at that moment [mm].
    moved
        Likewise after the best rigid motion.
    """

    along: Array
    outward: Array
    height: Array
    distance: Array
    moved: Array

    @property
    def seen(self) -> float:
        """Mean distance from the circle as the page shows it [mm]."""
        return float(np.hypot(self.outward, self.height).mean())


@dataclass(frozen=True, eq=False)
class DeviceRun:
    """What one seed gives: by instrument and by how it was calibrated.

    Attributes
    ----------
    before
        The nominal robot with base and tool fitted to the document's markers, and to the registry's on the pencil.
    read
        Mean and largest distance of what an instrument reads from the nominal robot where it stands [mm].
    reached
        By instrument and start.
    sees
        Share of random configurations that an instrument sees [%].
    pages
        The circle by what it was corrected with.
    """

    before: Mapping[str, Reached]
    read: Mapping[str, tuple[float, float]]
    reached: Mapping[tuple[str, Start], Reached]
    sees: Mapping[str, float]
    pages: Mapping[tuple[str, str], OnPage]


def run_devices(seed: int, counts: Counts) -> DeviceRun:
    """Calibrate a twin with every instrument, judge it elsewhere and on the circle."""
    rng = np.random.default_rng(seed)
    nominal = katana()
    fit = inclined(nominal, twin(published("standard")), rng)
    starts: dict[Start, Robot] = {"geometry alone": nominal, "tilting first": fit.robot}
    others = nominal.random_configurations(counts.unseen, rng)
    at_end, with_pencil = (_standing(published("standard"), places) for places in (_ATTACHMENT.targets, _REFLECTORS))
    end, tip = (truth.frames(others)[TIP][:, :3, 3] for truth in (at_end, with_pencil))
    before, reached, fits = {}, {}, {}

    def judge(what: str, data: Dataset, true: Array) -> None:
        data = replace(data, sigma=None, sigma_rot=None)
        if what in (OPTOTRAK, MARKERS.name):
            before[what] = _reached(place(nominal, data), data, others, true)
        for name, start in starts.items():
            found = fits[what, name] = identify(start, data, _GEOMETRIC)
            reached[what, name] = _reached(found, data, others, true)

    read = {}
    for what, (device, count) in DOCUMENT.items():
        data = _measured(device, nominal, at_end, count, rng)
        judge(what, data, end)
        apart = data.position - nominal.with_frames(_STANDS, _ATTACHMENT.targets).world_poses(data.joints, TIP)[0]
        read[what] = _mean_and_largest(np.linalg.norm(apart, axis=1))
    low_cost = []
    for device in USED:
        led = device if device.tool is None else replace(device, tool=_POINT)
        if isinstance(led, PencilCircle):
            led = replace(led, centre=_MIDDLE, radius=_RADIUS)
        data = _measured(led, nominal, with_pencil, counts.of(device), rng)
        judge(device.name, data, tip)
        if device.name in (TOUCH_UP.name, DRAWN_CIRCLE.name):
            low_cost.append(data)
    judge(LOW_COST, together(*low_cost), tip)
    corrections = {(what, name): fits[what, name] for what in (MARKERS.name, LOW_COST) for name in STARTS}
    sees = _seen(nominal, nominal.random_configurations(_DRAWN_AT_RANDOM, rng))
    return DeviceRun(before, read, reached, sees, _pages(corrections, rng))


def together(first: Dataset, second: Dataset) -> Dataset:
    """Return two campaigns with the same robot and target and with fixtures of their own as one."""
    k, n = first.configurations, len(first.target)

    def stacked(a: Array | None, b: Array | None) -> Array:
        whole = [np.full(size, np.nan) if v is None else v for v, size in ((a, n), (b, len(second.target)))]
        return np.concatenate(whole)

    return replace(
        first,
        source=f"{first.source} and {second.source}",
        labels=tuple(str(i + 1) for i in range(k + second.configurations)),
        joints=np.concatenate([first.joints, second.joints]),
        configuration=np.concatenate([first.configuration, k + second.configuration]),
        target=np.concatenate([first.target, second.target]),
        position=np.concatenate([first.position, second.position]),
        distance=stacked(first.distance, second.distance),
        height=stacked(first.height, second.height),
        fixtures=(*first.fixtures, *second.fixtures),
        fixture=np.concatenate([first.against, len(first.fixtures) + second.against]),
        setup=second.setup,
        sigma=stacked(first.sigma, second.sigma),
        approach=None,
        number=None,
    )


def _measured(device: Device, nominal: Robot, truth: Twin, count: int, rng: np.random.Generator) -> Dataset:
    """Return a campaign; where an arm cannot be jogged to a place because a joint falls to and fro there, another."""
    for _ in range(_TRIES - 1):
        try:
            return measured_with(device, nominal, truth, count, rng)
        except InputError:
            continue
    return measured_with(device, nominal, truth, count, rng)


def _standing(robot: Robot, places: Mapping[str, tuple[float, float, float]]) -> Twin:
    return twin(robot.with_frames(_STANDS, places))


def _seen(nominal: Robot, joints: Array) -> dict[str, float]:
    """Return what share of configurations instruments see [%]."""
    looking: dict[str, tuple[Tracker | Artefact, Mapping[str, tuple[float, float, float]]]] = {
        TRACKED: (replace(TRACKER, within=_CONE), _POINT.targets),
        "laser tracker, three reflectors seen within 30 deg": (TRACKER, _REFLECTORS),
        PLANAR_ARTEFACT.name: (PLANAR_ARTEFACT, _POINT.targets),
        SPATIAL_ARTEFACT.name: (SPATIAL_ARTEFACT, _POINT.targets),
        OPTOTRAK: (MARKERS, _POINT.targets),
    }
    return {
        what: 100 * float(device.visible(nominal.with_frames(_STANDS, places), joints).any(axis=1).mean())
        for what, (device, places) in looking.items()
    }


def _reached(fit: Fit, data: Dataset, joints: Array, true: Array) -> Reached:
    """Judge a robot by true places ``(n, 3)`` of its tip in the world."""
    predicted = fit.robot.world_poses(joints, TIP)[0]
    R, p = rigid_motion(predicted, true)
    own = np.linalg.norm(predicted - true, axis=1) if data.anchored else np.full(len(true), np.nan)
    spread, truly = (places - places.mean(axis=0) for places in (predicted @ R.T, true))
    return Reached(
        data.configurations,
        _mean_and_largest(own),
        _mean_and_largest(np.linalg.norm(predicted @ R.T + p - true, axis=1)),
        float(np.sum(spread * truly) / np.sum(truly * truly)) - 1.0,
        gauge_freedoms(data),
        fit.unseen,
    )


def _pages(fits: Mapping[tuple[str, Start], Fit], rng: np.random.Generator) -> dict[tuple[str, str], OnPage]:
    """Let the twin draw the circle of section 5.5.1, by the nominal robot and by calibrated ones."""
    circle, line = paths(_TIME)
    motion = motions(katana(PENCIL), circle, line, rng)[0]
    truth = twin(published("standard").with_frames(IDENTITY, _POINT.targets))
    found = {("before", ""): _drawn(truth, motion.joints, motion, circle, rng)}
    for (what, name), fit in fits.items():
        commanded = corrected(fit.robot, motion, _in_base(fit, circle.position), TIP).joints
        found[what, name] = _drawn(truth, commanded, motion, circle, rng)
    return found


def _in_base(fit: Fit, path: Array) -> Array:
    """Return a path of the true base in the base that was found; without an anchor the base is taken as found."""
    if not any(p.group == "base" for p in fit.free.parameters):
        return path
    base = fit.robot.base
    in_world = path @ _STANDS.rotation.T + _STANDS.translation
    return np.asarray((in_world - np.array(base.translation)) @ base.rotation)


def _drawn(truth: Twin, joints: Array, motion: JointMotion, circle: Trajectory, rng: np.random.Generator) -> OnPage:
    went = truth.postures(joints, velocity=motion.velocity, acceleration=motion.acceleration)
    tip = np.array([posture.targets[TIP][:3, 3] for posture in went])
    line = fit_circle(tip)
    outward, height = (
        1e3 * (v + DRAWN_CIRCLE.sigma * rng.standard_normal(len(tip)))
        for v in (line.radius - _RADIUS + line.radial, line.axial)
    )
    R, p = rigid_motion(tip, circle.position)
    return OnPage(
        along=360 * circle.distance / circle.distance[-1],
        outward=outward,
        height=height,
        distance=1e3 * np.linalg.norm(tip - circle.position, axis=1),
        moved=1e3 * np.linalg.norm(tip @ R.T + p - circle.position, axis=1),
    )


def _mean_and_largest(errors: Array) -> tuple[float, float]:
    """Return both in millimetres."""
    return 1e3 * float(errors.mean()), 1e3 * float(errors.max())
