"""Devices that read lengths or touch known points: hexapod ballbar, telescoping ballbar, strings, plates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.hexapod import CUPS, DEVICE, leg_lengths, poses, tool_cups, triangle
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.branches import branch_rule
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.parts import Tool
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.devices.calibration_table import rectangular_grid
from truearm.engine.twin.devices.device import Arm, Device, IntArray, recorded
from truearm.engine.twin.devices.jogging import SPARE, jogged, postures_at, site

#: Where the fixture is put: shares of the way out to the middle of the reach, and how much lower than that [m].
_FIXTURE_DISTANCES: Final = (0.6, 0.8, 1.0)
_FIXTURE_DROP: Final = 0.2
#: How far a pose is jogged beside its nominal place, within the range of the bar [m].
_JOG_RANGE: Final = 4e-4
#: Declared deviation of a coordinate of a cup, in deviations of a length: the root mean square over Table 3.1, worked
#: out anew, is 1.6, and nine coordinates of a pose weigh no more than its six lengths.
_CUP_DEVIATION: Final = 2.0
_STEPS: Final = 20
_SETTLED: Final = 1e-9


@dataclass(frozen=True)
class HexapodPoses(Device):
    """Six lengths of a ballbar between three cups of a base fixture and three of the tool (Nubiola, chapter 3).

    The fixture is put to several places, where nobody knows exactly, and the robot is jogged until all six lengths are
    within the range of the bar. That the cups of a pose err together is not told; the deviation is declared so large
    that what comes of it is right.
    """

    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        """Return the places of the tool's cups in the frame of the fixture, at poses on all branches."""
        wanted = poses()
        origins, place_of, pose_of, joints = self._reachable(nominal)
        order = rng.permutation(len(joints))[: SPARE * count]
        names = [target.name for target in nominal.targets]
        base, turned = nominal.base, nominal.base.rotation
        aside = rng.uniform(-1.0, 1.0, (len(order), 1, 3)) * _JOG_RANGE
        goals = np.array([wanted[k].cups for k in pose_of[order]]) + aside + origins[place_of[order]][:, None]
        goals = goals @ turned.T + np.array(base.translation)
        at = _jogged(nominal, arm, names, joints[order], goals)
        frames = arm.frames(at)
        seen = np.stack([frames[name][:, :3, 3] for name in names], axis=1)
        low, high = np.array([joint.limits or (-np.inf, np.inf) for joint in nominal.joints]).T
        jogged = np.linalg.norm(seen - goals, axis=2).max(axis=1) < _JOG_RANGE
        reached = np.flatnonzero(jogged & ((at >= low) & (at <= high)).all(axis=1))[:count]
        if len(reached) < count:
            raise InputError(
                f"{nominal.name} reaches too few poses of the device",
                where=self.name,
                came=f"{len(reached)} of {len(order)} tried, at {len(origins)} places of the fixture",
                allowed=f"{count} or more",
                cure="Lower `poses`.",
            )
        at, place = at[reached], place_of[order][reached]
        frames = arm.frames(at)  # once more: what depends on the order depends on that of the poses taken
        seen = np.stack([frames[name][:, :3, 3] for name in names], axis=1)
        pose = [wanted[k] for k in pose_of[order][reached]]
        cups = (seen - np.array(base.translation)) @ turned - origins[place][:, None]
        feet, bar = triangle([DEVICE.base] * 3, "B"), sigma / _CUP_DEVIATION * rng.standard_normal((count, 6))
        read = []
        for hexapod, tool, noise in zip(pose, cups, bar, strict=True):
            lengths = leg_lengths(hexapod.design, feet, tool) + noise
            read.append(tool_cups(hexapod.design, hexapod.solution, [DEVICE.base] * 3, [DEVICE.tool] * 3, lengths))
        return recorded(
            nominal,
            self.name,
            at,
            np.repeat(np.arange(count), 3),
            names * count,
            position=np.concatenate(read),
            fixtures=tuple(f"fixture_{k + 1}" for k in range(len(origins))),
            fixture=np.repeat(place, 3),
            sigma=sigma,
        )

    def _reachable(self, nominal: Robot) -> tuple[Array, IntArray, IntArray, Array]:
        """Return the places of the fixture, and place, pose and joints of all configurations there."""
        if branch_rule(nominal) is None:
            raise InputError(
                f"{nominal.name} cannot reach the poses of the device",
                where=self.name,
                allowed="a robot with six turning joints whose branches have names",
                cure="Take another device.",
            )
        wanted = poses()
        position, rotation = np.array([p.position for p in wanted]), np.array([p.rotation for p in wanted])
        middle = triangle([DEVICE.base] * 3, "B").mean(axis=0)
        centre = (site(nominal) - np.array(nominal.base.translation)) @ nominal.base.rotation
        origins = np.array(
            [centre * (out, out, 1.0) - (0.0, 0.0, _FIXTURE_DROP) - middle for out in _FIXTURE_DISTANCES]
        )
        place, pose, joints = [], [], []
        for k, origin in enumerate(origins):
            joint_solutions = inverse(nominal, position + origin, rotation, branch="all")
            usable = np.array([status.usable for status in joint_solutions.status])
            place.append(np.full(int(usable.sum()), k))
            pose.append(joint_solutions.pose[usable])
            joints.append(joint_solutions.joints[usable])
        return origins, np.concatenate(place), np.concatenate(pose), np.concatenate(joints)


def _jogged(nominal: Robot, arm: Arm, names: list[str], joints: Array, goals: Array) -> Array:
    """Return joint positions with the arm's cups as near to their goals ``(n, 3, 3)`` as a rigid tool can be."""
    joints = joints.copy()
    moving = np.arange(len(joints))
    for _ in range(_STEPS):
        frames = arm.frames(joints[moving])
        missing = np.stack([goals[moving, k] - frames[name][:, :3, 3] for k, name in enumerate(names)], axis=1)
        J = np.concatenate([nominal.joint_jacobian(joints[moving], name)[:, :3] for name in names], axis=1)
        step = (np.linalg.pinv(J, rcond=1e-4) @ missing.reshape(len(moving), -1, 1))[..., 0]
        joints[moving] += step
        moving = moving[np.abs(step).max(axis=1) >= _SETTLED]
        if not len(moving):
            break
    return joints


HEXAPOD: Final = HexapodPoses(
    "hexapod",
    "places of three cups from six lengths of a ballbar, the base fixture at three places",
    "Nubiola, chapter 3: 72 poses, a cup within 3 um in 95 of 100 readings",
    sigma=_CUP_DEVIATION * DEVICE.sigma,
    tool=Tool({f"cup_{k + 1}": (float(x), float(y), float(z)) for k, (x, y, z) in enumerate(CUPS)}),
)


_STAYS: Final = np.deg2rad(75.0)


# Known points touched by hand: the holes of a calibration table (Li et al.), a printed circle (Patel, 5.5.2).
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
        reached, joints = postures_at(nominal, name, goals, count, rng, self.name, facing=facing, within=_STAYS)
        plate, on_plate = plate[reached], on_plate[reached]
        wanted = goals[reached] + sigma * rng.standard_normal((count, 3))
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


_TILT: Final = float(np.deg2rad(20.0))
_SLOPE: Final = float(np.deg2rad(-45.0))
_RADIUS: Final = 0.1
CALIBRATION_TABLE: Final = KnownPoints(
    "calibration-table",
    "table with 30 known holes 50 mm apart, level, rolled and pitched by 20 deg, touched by hand",
    "Li et al., section 3: holes of a table on a ball joint that turns by up to 20 deg; grid and deviation ours",
    sigma=5e-5,
    tool=Tool({"tip": (0.02, 0.01, 0.15)}),
    points=tuple((x, y, z) for x, y, z in rectangular_grid(6, 5, 0.05).tolist()),
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


# Devices that read a length from fixed points: the telescoping ballbar and four strings (Nubiola, 1.7 and 2.6.3).

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
        reached, joints = postures_at(nominal, name, goals, count, rng, self.name)
        cup, length = cup[reached], length[reached]

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
