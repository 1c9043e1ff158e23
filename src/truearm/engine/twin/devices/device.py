"""Instruments: what they see of an arm, and how well; laser tracker and measurement arm (Nubiola, 2.2 and 3.5)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, counted
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parts import Tool
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rigid_motion
from truearm.engine.twin.truths import DEFAULT_TOOL, at_station
from truearm.engine.twin.twin import Twin, directions

IntArray = NDArray[np.intp]
_DRAWS: Final = 200
_DRAWN: Final = 2000
_TRIED: Final = 100


class Arm(Protocol):
    """What is measured, configuration by configuration: a twin, or a robot taken at its word."""

    @property
    def robot(self) -> Robot:
        """Its targets by name."""

    def frames(self, joints: Array) -> Mapping[str, Array]:
        """Return ``T_world_target`` ``(n, 4, 4)`` of every target at joints ``(n, joints)``, in measuring order."""


@dataclass(frozen=True)
class _InOrder:
    """A twin as a campaign meets it: it comes to the first configuration as cold as it is before any."""

    twin: Twin

    @property
    def robot(self) -> Robot:
        return self.twin.robot

    def frames(self, joints: Array) -> Mapping[str, Array]:
        return self.twin.frames(joints, number=np.arange(float(len(joints))))


@dataclass(frozen=True)
class Device(ABC):
    """An instrument."""

    #: Why it cannot go through a plan of configurations by itself, reading by reading; empty if it can.
    no_plan: ClassVar[str] = (
        "the arm is jogged to what this device reads, so the joint positions come of measuring and not of a plan"
    )

    name: str  #: As the command line spells it.
    summary: str  #: What it is and reads, in words.
    source: str  #: Where its figures come from.
    sigma: float  #: Standard deviation of a coordinate, distance or height that it reads [m].
    tool: Tool | None = None  #: What it needs on the flange; None for whatever targets the robot has.

    @property
    def reads_where(self) -> str:
        """What must be so for a target to be read, in words; empty for a device that reads all."""
        return ""

    def beyond_range(self, data: Dataset) -> NDArray[np.bool_]:
        """Return which readings the device cannot have read, ``(readings,)``; one without a range reads all."""
        return np.zeros(len(data.target), dtype=bool)

    def visible(self, robot: Robot, joints: Array) -> NDArray[np.bool_]:
        """Return which targets of a robot it reads at joint positions ``(n, joints)``, ``(n, targets)``.

        What the arm itself hides is not asked.
        """
        return np.ones((len(joints), len(robot.targets)), dtype=bool)

    @abstractmethod
    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return what it reads of an arm.

        Args:
            nominal: What is known of the arm: the nominal robot where it stands, with the targets of its tool. Postures
                are chosen by it.
            arm: What is read.
            count: Number of configurations.
            sigma: Standard deviation of a reading [m]; zero reads without noise and declares nothing.

        Raises:
            InputError: If the arm does not reach, or never shows, what is read.
        """


def measured_with(
    device: Device, nominal: Robot, twin: Twin, count: int, rng: np.random.Generator, sigma: float | None = None
) -> Dataset:
    """Return what a device reads of a twin.

    Args:
        nominal: The robot as it is known; where it stands and what it carries is taken from the twin. A twin may count
            its base from elsewhere (from axis 2, say), so the nominal robot stands where its flange is nearest to the
            true one.
        twin: The true robot, given the device's tool if it needs one.
        count: Number of configurations.
        sigma: Standard deviation of a reading [m]; the device's own if None, no noise if zero.
    """
    if count < 1 or (sigma is not None and sigma < 0.0):
        raise InputError(
            "a campaign needs a configuration or more, and no negative deviation",
            where=device.name,
            came=f"{counted(count, 'configuration')}, deviation {sigma}",
            allowed="1 configuration or more, deviation 0 or more",
        )
    twin, placed = seen_by(device, nominal, twin)
    data = device.campaign(placed, _InOrder(twin), count, device.sigma if sigma is None else sigma, rng)
    return replace(data, simulated=True)


def seen_by(device: Device, nominal: Robot, twin: Twin) -> tuple[Twin, Robot]:
    """Return a twin with the tool of a device, if it needs one, and the nominal robot where that twin stands."""
    if device.tool is not None:
        carrying = twin.robot.with_frames(twin.robot.base, device.tool.targets)
        twin = replace(twin, robot=carrying)
    values = twin.robot.values
    places = {t.name: [values[t.parameter(axis)] for axis in "xyz"] for t in twin.robot.targets}
    return twin, nominal.with_frames(_true_base(nominal, twin.robot), places)


def in_view_of(device: Device, robot: Robot) -> Robot:
    """Return a robot where a simulated instrument sees it, with the device's tool or, if that needs none, its own."""
    tool = device.tool or next(iter(robot.tools.values()), DEFAULT_TOOL)
    return at_station(robot, tool)


def _true_base(nominal: Robot, true: Robot) -> Transform:
    q = nominal.random_configurations(_TRIED, np.random.default_rng(0))
    at_origin = nominal.with_frames(Transform(), {})
    return Transform.from_matrix(*rigid_motion(at_origin.world_poses(q)[0], true.world_poses(q)[0]))


def recorded(
    nominal: Robot,
    source: str,
    joints: Array,
    configuration: Sequence[int] | IntArray,
    target: Sequence[str],
    *,
    position: Array | None = None,
    quaternion: Array | None = None,
    distance: Array | None = None,
    height: Array | None = None,
    fixtures: tuple[str, ...] = (),
    fixture: IntArray | None = None,
    setup: Dataset | None = None,
    sigma: float = 0.0,
    sigma_rot: float = 0.0,
) -> Dataset:
    """Return readings as a dataset, the configurations numbered in the order of measurement.

    Args:
        joints: Joint positions ``(n, joints)``.
        configuration, target: Of each reading.
        position, quaternion, distance, height, fixtures, fixture, setup: As in
            :class:`truearm.engine.data.dataset.Dataset`.
        sigma, sigma_rot: Standard deviations [m], [rad]; nothing is declared where they are zero.
    """
    names = tuple(dict.fromkeys(target))
    n = len(joints)
    if fixture is not None:
        used = np.unique(fixture[fixture >= 0])
        place = np.full(len(fixtures), -1)
        place[used] = np.arange(len(used))
        fixtures, fixture = tuple(fixtures[k] for k in used), place[fixture]
    return Dataset(
        source=source,
        labels=tuple(str(k + 1) for k in range(n)),
        joints=joints,
        joint_kinds=tuple(joint.kind for joint in nominal.joints),
        targets=names,
        configuration=np.asarray(configuration, dtype=np.intp),
        target=np.array([names.index(name) for name in target], dtype=np.intp),
        position=np.full((len(target), 3), np.nan) if position is None else position,
        quaternion=quaternion,
        distance=distance,
        height=height,
        fixtures=fixtures,
        fixture=fixture,
        setup=setup,
        sigma=np.full(len(target), sigma) if sigma > 0 else None,
        sigma_rot=np.full(len(target), sigma_rot) if sigma_rot > 0 else None,
        approach=directions(joints),
        number=np.arange(float(n)),
    )


def shown(
    nominal: Robot, count: int, rng: np.random.Generator, visible: Visible, device: str
) -> tuple[Array, NDArray[np.bool_]]:
    """Return random configurations that show enough of the tool.

    Args:
        visible: Tells which targets of a robot are seen at joint positions ``(n, joints)``, ``(n, targets)``; a
            configuration that shows none of them is passed over.
        device: Who looks, for messages.

    Returns:
        Joint positions ``(count, joints)``, and which targets are seen ``(count, targets)``.
    """
    joints, seen = [], []
    for _ in range(_DRAWS):
        drawn = nominal.random_configurations(_DRAWN, rng)
        sees = visible(nominal, drawn)
        some = sees.any(axis=1)
        joints.append(drawn[some])
        seen.append(sees[some])
        if sum(map(len, joints)) >= count:
            return np.concatenate(joints)[:count], np.concatenate(seen)[:count]
    raise InputError(
        f"{device} sees too few configurations of {nominal.name}",
        parameter="device",
        came=f"{sum(map(len, joints))} among {_DRAWN * _DRAWS} within the limits",
        allowed=f"{count} or more",
        cure="Lower `poses`, or take another device.",
    )


class Visible(Protocol):
    """Tells which targets of a robot are seen."""

    def __call__(self, robot: Robot, joints: Array) -> NDArray[np.bool_]:
        """Return ``(n, targets)`` for joint positions ``(n, joints)``."""


@dataclass(frozen=True)
class Tracker(Device):
    """A laser tracker at the origin of the world and reflectors that look outward from the tool."""

    no_plan: ClassVar[str] = ""

    within: float = np.deg2rad(30.0)  #: Half the opening of a reflector's cone of sight [rad].
    at_least: int = 1  #: How many reflectors must be seen at a configuration for it to count.

    @property
    def reads_where(self) -> str:
        """How far a reflector may look past the tracker."""
        return f"a reflector must look at the tracker within {np.rad2deg(self.within):.3g} deg"

    def visible(self, robot: Robot, joints: Array) -> NDArray[np.bool_]:
        """Return which targets the tracker sees, none where they are fewer than asked for, ``(n, targets)``."""
        rotation = robot.world_poses(joints)[1]
        looks = outward(robot)
        seen = np.empty((len(joints), len(robot.targets)), dtype=bool)
        for k, target in enumerate(robot.targets):
            place = robot.world_poses(joints, target.name)[0]
            cosine = -np.einsum("nij,j,ni->n", rotation, looks[k], place) / np.linalg.norm(place, axis=1)
            seen[:, k] = cosine > np.cos(self.within)
        enough = seen.sum(axis=1, keepdims=True) >= min(self.at_least, len(robot.targets))
        return np.asarray(seen & enough)

    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return the positions of the reflectors that are seen, at random configurations."""
        joints, seen = shown(nominal, count, rng, self.visible, self.name)
        return positions(nominal, arm, joints, seen, sigma, rng, self.name)


@dataclass(frozen=True)
class MeasurementArm(Device):
    """An articulated arm whose stylus is held to the targets; its base is at the origin of the world."""

    no_plan: ClassVar[str] = ""

    reach: float = 3.0  #: How far it reaches [m].

    @property
    def reads_where(self) -> str:
        """How far a target may be."""
        return f"a target must be within {self.reach * 1e3:.4g} mm of the base of the arm"

    def beyond_range(self, data: Dataset) -> NDArray[np.bool_]:
        """Return which places are out of reach of its base."""
        return np.asarray(np.linalg.norm(data.position, axis=1) > self.reach)

    def visible(self, robot: Robot, joints: Array) -> NDArray[np.bool_]:
        """Return which targets are within reach, ``(n, targets)``."""
        far = [np.linalg.norm(robot.world_poses(joints, target.name)[0], axis=1) for target in robot.targets]
        return np.stack(far, axis=1) < self.reach

    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return the positions of all targets within reach, at random configurations."""
        joints, seen = shown(nominal, count, rng, self.visible, self.name)
        return positions(nominal, arm, joints, seen, sigma, rng, self.name)


def outward(robot: Robot) -> Array:
    """Return the direction in which each target looks, in the flange frame, ``(targets, 3)``.

    Three targets or more look away from their middle; fewer look along the flange's z.
    """
    places = np.array([[robot.values[target.parameter(axis)] for axis in "xyz"] for target in robot.targets])
    away = places - places.mean(axis=0)
    far = np.linalg.norm(away, axis=1, keepdims=True)
    if len(places) < 3 or float(far.min()) < 1e-6:
        return np.tile([0.0, 0.0, 1.0], (len(places), 1))
    return np.asarray(away / far)


def positions(
    nominal: Robot,
    arm: Arm,
    joints: Array,
    seen: NDArray[np.bool_],
    sigma: float,
    rng: np.random.Generator,
    source: str,
) -> Dataset:
    """Return the positions of targets in the world, of those that are seen ``(n, targets)``."""
    frames = arm.frames(joints)
    names = [target.name for target in nominal.targets]
    configuration, target = np.nonzero(seen)
    place = np.array([frames[names[t]][c, :3, 3] for c, t in zip(configuration, target, strict=True)])
    place = place + sigma * rng.standard_normal(place.shape)
    return recorded(nominal, source, joints, configuration, [names[t] for t in target], position=place, sigma=sigma)


TRACKER: Final = Tracker(
    "tracker",
    "laser tracker and three reflectors, each seen within 30 deg of where it looks",
    "Nubiola, section 2.2: 0.022 mm on a scale bar of 2.3 m, reflector cones of +/-30 deg; deviation a coordinate ours",
    sigma=1e-5,
)
MEASUREMENT_ARM: Final = MeasurementArm(
    "measurement-arm",
    "measurement arm whose stylus is held to the targets",
    "Nubiola, section 3.5: FaroArm Platinum, a check on 15 poses; reach and deviation ours",
    sigma=2.5e-5,
    tool=Tool({"nest": (0.0, 0.0, 0.125)}),
)
