"""Instruments that read where targets are: laser tracker and measurement arm (Nubiola, sections 2.2 and 3.5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.parts import Tool
from truearm.modeling.robot import Robot
from truearm.simulation.devices.device import Arm, Device, recorded, shown


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
    return recorded(
        nominal,
        source,
        joints,
        configuration,
        [names[t] for t in target],
        position=place,
        sigma=sigma,
    )


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
