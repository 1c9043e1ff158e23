"""Cameras that read the pose of an artefact: optical CMM, three active markers (Nubiola, 2.2; Patel, 3.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.parts import Tool
from truearm.modeling.robot import Robot
from truearm.modeling.transform import quaternion_from_rotation, rotation_from_quaternion
from truearm.simulation.devices.device import Arm, Device, recorded, shown


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
