"""The hexapod ballbar device as an instrument among others: places of three cups from six lengths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.measurement.dataset import Dataset
from truearm.measurement.hexapod.geometry import DEVICE, triangle
from truearm.measurement.hexapod.kinematics import leg_lengths, tool_cups
from truearm.measurement.hexapod.poses import CUPS, poses
from truearm.modeling.chain import Array
from truearm.modeling.inverse import inverse
from truearm.modeling.inverse.branches import branch_rule
from truearm.modeling.parts import Tool
from truearm.modeling.robot import Robot
from truearm.simulation.devices.device import Arm, Device, IntArray, recorded
from truearm.simulation.devices.jogging import SPARE, site

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
        there = np.linalg.norm(seen - goals, axis=2).max(axis=1) < _JOG_RANGE
        kept = np.flatnonzero(there & ((at >= low) & (at <= high)).all(axis=1))[:count]
        if len(kept) < count:
            raise InputError(
                f"{nominal.name} reaches too few poses of the device",
                where=self.name,
                came=f"{len(kept)} of {len(order)} tried, at {len(origins)} places of the fixture",
                allowed=f"{count} or more",
                cure="Lower `poses`.",
            )
        at, place = at[kept], place_of[order][kept]
        frames = arm.frames(at)  # once more: what depends on the order depends on that of the poses taken
        seen = np.stack([frames[name][:, :3, 3] for name in names], axis=1)
        pose = [wanted[k] for k in pose_of[order][kept]]
        cups = (seen - np.array(base.translation)) @ turned - origins[place][:, None]
        feet, bar = triangle([DEVICE.base] * 3, "B"), sigma / _CUP_DEVIATION * rng.standard_normal((count, 6))
        read = []
        for one, there, noise in zip(pose, cups, bar, strict=True):
            lengths = leg_lengths(one.design, feet, there) + noise
            read.append(tool_cups(one.design, one.solution, [DEVICE.base] * 3, [DEVICE.tool] * 3, lengths))
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
            found = inverse(nominal, position + origin, rotation, branch="all")
            usable = np.array([status.usable for status in found.status])
            place.append(np.full(int(usable.sum()), k))
            pose.append(found.pose[usable])
            joints.append(found.joints[usable])
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
