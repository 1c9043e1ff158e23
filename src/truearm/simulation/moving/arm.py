"""An arm in a cell: what its controller believes, how its joints follow, and where its tip truly is.

The controller computes joint positions with the nominal robot. The tip is where the digital twin has it at the
positions to which the joints have come: with its geometry, its compliance under its own weight, its load, its motion
and pushes, and its hysteresis by the direction of the commanded moves. Beside what the truth says, joints come to rest
a little elsewhere each time, gears have a little play, and links are shorter while the arm is cold.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.inverse.kinematics import inverse
from truearm.modeling.parts import Payload
from truearm.modeling.robot import Robot
from truearm.modeling.transform import (
    Transform,
    quaternion_from_rotation,
    rotation_from_vector,
    rotation_vector,
)
from truearm.simulation.moving.servo import Servo
from truearm.simulation.twin import REFERENCE_TEMPERATURE, Twin
from truearm.simulation.twin_joint import PERFECT

#: Joint positions for poses of the tip in the base frame ``(n, 4, 4)``, near to others ``(n, joints)``.
Commanded = Callable[[Array, Array], Array]
TIP: Final = "tip"
_FLANGE: Final = "flange"
#: The truth is followed this often; between, it is as far from the nominal tip as around [s].
_FINEST: Final = 2e-3
#: A joint that is commanded to move by less does not change the direction of its last move [rad or m].
_STILL: Final = 1e-9


@dataclass(frozen=True)
class Drives:
    """What the drives of an arm do, beside what the truth of the robot says."""

    #: How a joint follows its command.
    servo: Servo = field(
        default_factory=lambda: Servo(2 * math.pi * 25.0, 0.7, velocity=10.0, acceleration=200.0, feedforward=1.0)
    )
    #: velocity, acceleration: of moves of the joints, at 100 % [rad/s, rad/s^2 or m/s, m/s^2].
    velocity: float = math.pi
    acceleration: float = 20.0
    #: Standard deviation of where a joint comes to rest, or runs, from cycle to cycle [rad or m].
    scatter: float = 5e-6
    #: What a joint goes too far when it came forward, and too little when backward [rad or m], where the truth says
    #: nothing of it.
    play: float = 1e-5
    pace: float = 2e-4  #: Standard deviation of the share by which a run of a path is slower or faster than another.


@dataclass(frozen=True)
class Warming:
    """How an arm warms up while it works: exponentially."""

    rise: float = 8.0  #: How much colder than in the end it is at first [K].
    time: float = 5400.0  #: Until 37 % of that are left [s].
    #: Of the links' lengths, where the truth says nothing of it [1/K]; that of steel, or of cast iron.
    growth: float = 1.2e-5

    def temperature(self, working: Array) -> Array:
        """Return the arm's temperature [degC] after working for some time [s]; lengths are as given in the end."""
        return np.asarray(REFERENCE_TEMPERATURE - self.rise * np.exp(-np.asarray(working) / self.time))


DRIVES: Final = Drives()
WARMING: Final = Warming()


@dataclass(frozen=True, eq=False)
class MovingArm:
    """A true arm with its controller, carrying something."""

    nominal: Robot  #: The robot as the controller knows it; its base frame is that of the commands.
    target: str | None  #: Name of its target that is commanded; None for the flange.
    twin: Twin  #: The truth. Its targets do not matter.
    tip: Transform  #: Where the tip is on the true flange.
    payload: Payload  #: What it carries.
    drives: Drives = DRIVES  #: drives, warming: what the truth does not say.
    warming: Warming = WARMING
    #: How far each joint gives way to a push [rad/(N m), m/N of a prismatic one], where the truth knows of no
    #: compliance at all; empty for a rigid arm. Its own weight and its load do not bend such an arm.
    compliance: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        kinds = [[joint.kind for joint in robot.joints] for robot in (self.nominal, self.twin.robot)]
        if kinds[0] != kinds[1]:
            raise InputError(
                f"this truth has other joints than {self.nominal.name}",
                parameter="truth",
                where=self.twin.robot.name,
                came=f"{len(kinds[1])} joints",
                allowed=f"{len(kinds[0])}, of the same kinds",
            )

    @cached_property
    def true(self) -> Twin:
        """The twin with its load, its tip, and what the truth does not say of play and growth."""
        robot = self.twin.robot
        placed = robot.with_frames(robot.base, {TIP: self.tip, _FLANGE: Transform()})
        joints = {}
        for number in range(1, len(robot.joints) + 1):
            truth = self.twin.joints.get(number, PERFECT)
            joints[number] = replace(
                truth,
                hysteresis=truth.hysteresis or self.drives.play,
                growth=truth.growth or self.warming.growth,
            )
        return replace(self.twin, robot=replace(placed, payload=self.payload, wrench=None), joints=joints)

    @cached_property
    def pushed(self) -> Twin:
        """The twin that gives way to pushes."""
        joints = self.true.joints
        if not self.compliance or any(truth.compliance for truth in joints.values()):
            return self.true
        softer = {number: replace(joints[number], compliance=value) for number, value in enumerate(self.compliance, 1)}
        return replace(self.true, joints=softer)

    def joints_for(self, frames: Array, near: Array) -> Array:
        """Return joint positions with which the nominal robot brings its tip to poses in its base frame.

        Args:
            frames: ``(n, 4, 4)`` [m].
            near: Joint positions to be near to, ``(joints,)`` or ``(n, joints)``.

        Raises:
            InputError: If a pose is out of reach.
        """
        found = inverse(self.nominal, frames[:, :3, 3], frames[:, :3, :3], target=self.target, seed=near)
        lost = [row for row, status in enumerate(found.status) if not status.usable]
        if lost:
            x, y, z = (1e3 * frames[lost[0], :3, 3]).tolist()
            raise InputError(
                "the robot cannot come to a commanded pose",
                where=self.nominal.name,
                came=f"x {x:.1f}, y {y:.1f}, z {z:.1f} mm: {found.status[lost[0]].value}",
                cure="Plan poses and paths that the robot can reach in one posture.",
            )
        return found.joints

    def at_rest(self, joints: Array, approach: Array, working: Array, force: Array | None = None) -> Array:
        """Return where the tip stands in the world, ``(n, 4, 4)`` [m].

        Args:
            joints: Where the joints have come to rest, ``(n, joints)``.
            approach: Direction of the last move of each joint, +1, -1 or 0, ``(n, joints)``.
            working: How long the arm has been working [s], ``(n,)``; infinite for an arm that is warm.
            force: With which the tip is pushed, in the axes of the twin's base frame [N], ``(n, 3)``.
        """
        # Of hundredths of a kelvin links are made once: that is less than 0.1 um.
        warm = np.round(self.warming.temperature(working), 2)
        if force is None:
            return np.asarray(self.true.frames(joints, approach=approach, temperature=warm)[TIP])
        wrench = np.concatenate([force, np.zeros_like(force)], axis=1)
        base = self.twin.robot.base.rotation
        for _ in range(2):  # the lever is that of the arm as it has given way
            at = self.pushed.frames(joints, approach=approach, temperature=warm, wrench=wrench)
            lever = (at[TIP][:, :3, 3] - at[_FLANGE][:, :3, 3]) @ base
            wrench = np.concatenate([force, np.cross(lever, force)], axis=1)
        there = np.asarray(self.pushed.frames(joints, approach=approach, temperature=warm, wrench=wrench)[TIP])
        if self.pushed is self.true:
            return there
        # From where the arm stands without giving way, by what the push alone does.
        free, stands = (
            twin.frames(joints, approach=approach, temperature=warm)[TIP] for twin in (self.pushed, self.true)
        )
        moved = stands.copy()
        moved[:, :3, 3] += there[:, :3, 3] - free[:, :3, 3]
        moved[:, :3, :3] = there[:, :3, :3] @ free[:, :3, :3].transpose(0, 2, 1) @ stands[:, :3, :3]
        return np.asarray(moved)

    def in_motion(self, command: Array, step: float, time: Array, working: float) -> Motion:
        """Return where the tip is while the joints follow commands from rest.

        Args:
            command: Joint positions ``(n, joints)``, `step` [s] apart; behind the last one the joints are commanded to
                stay.
            time: When to look, evenly, from the first command [s], ``(m,)``; before it the joints stand still.
            working: How long the arm has been working [s].
        """
        ahead = max(0, math.ceil(-float(time[0]) / step)) + 2
        left = max(0, math.ceil(float(time[-1]) / step) + 2 - len(command))
        held = np.concatenate([np.repeat(command[:1], ahead, axis=0), command, np.repeat(command[-1:], left, axis=0)])
        position, velocity = self.drives.servo.follow(held, step)
        acceleration = np.gradient(velocity, step, axis=0)
        ways = last_moves(held)

        def at(time: Array) -> tuple[NDArray[np.intp], Array]:
            steps = time / step + ahead
            k = np.clip((steps + 1e-9).astype(np.intp), 0, len(held) - 2)
            return k, np.clip(steps - k, 0.0, 1.0)[:, None]

        often = len(time) > 2 and float(time[1] - time[0]) < _FINEST * (1 - 1e-9)
        grid = np.arange(time[0], time[-1] + _FINEST, _FINEST) if often else time
        k, x = at(grid)
        joints = _between(position, velocity, k, x, step)
        frames = self.true.frames(
            joints,
            approach=ways[k],
            temperature=np.full(len(grid), float(self.warming.temperature(np.array(working)))),
            velocity=(1 - x) * velocity[k] + x * velocity[k + 1],
            acceleration=(1 - x) * acceleration[k] + x * acceleration[k + 1],
        )[TIP]
        place, turned = frames[:, :3, 3], frames[:, :3, :3]
        base = self.twin.robot.base
        if often:
            nominal, believed = self._believed(joints)
            joints = _between(position, velocity, *at(time), step)
            there, oriented = self._believed(joints)
            place = there + _interpolated(time, grid, place - nominal)
            off = rotation_vector(turned @ believed.transpose(0, 2, 1))
            turned = rotation_from_vector(_interpolated(time, grid, off)) @ oriented
        by_joints = self.nominal.jacobian(joints, frame="base", target=self.target)
        by_joints = np.concatenate([base.rotation @ by_joints[:, :3], base.rotation @ by_joints[:, 3:]], axis=1)
        return Motion(time, place, quaternion_from_rotation(turned), by_joints)

    def _believed(self, joints: Array) -> tuple[Array, Array]:
        """Return where the nominal robot has its tip if it stands on the true base, ``(n, 3)`` and ``(n, 3, 3)``."""
        position, rotation = self.nominal.forward(joints, frame="base", target=self.target)
        base = self.twin.robot.base
        return position @ base.rotation.T + np.array(base.translation), base.rotation @ rotation


@dataclass(frozen=True, eq=False)
class Motion:
    """Where the tip was, in the world."""

    time: Array  #: From the first command [s], ``(n,)``.
    position: Array  #: position, quaternion: ``(n, 3)`` [m] and ``(n, 4)``, scalar first.
    quaternion: Array
    by_joints: Array  #: How position and orientation follow small offsets of the joints, ``(n, 6, joints)``.

    def with_offset(self, joints: Array) -> tuple[Array, Array]:
        """Return position ``(n, 3)`` and turn ``(n, 3)`` [rad] with joints a little elsewhere, ``(joints,)``."""
        moved = self.by_joints @ joints
        return self.position + moved[:, :3], moved[:, 3:]


def last_moves(joints: Array) -> Array:
    """Return the direction of the last move of each joint at positions in their order, +1, -1 or 0, ``(n, joints)``.

    At rest before the first move it is that of the first move.
    """
    steps = np.diff(joints, axis=0, prepend=joints[:1])
    signs = np.where(np.abs(steps) > _STILL, np.sign(steps), 0.0)
    rows = np.arange(len(joints))[:, None]
    latest = np.maximum.accumulate(np.where(signs != 0.0, rows, 0), axis=0)
    found = np.take_along_axis(signs, latest, axis=0)
    first = np.argmax(signs != 0.0, axis=0)
    starts = signs[first, np.arange(joints.shape[1])]
    return np.asarray(np.where(found == 0.0, starts, found))


def _interpolated(time: Array, grid: Array, values: Array) -> Array:
    return np.stack([np.interp(time, grid, column) for column in values.T], axis=1)


def _between(position: Array, velocity: Array, k: NDArray[np.intp], x: Array, step: float) -> Array:
    """Return positions a share of a step behind the k-th, by the cubic that has positions and velocities."""
    p, q = position[k], position[k + 1]
    v, w = step * velocity[k], step * velocity[k + 1]
    return np.asarray(p + x * (v + x * (3 * (q - p) - 2 * v - w + x * (2 * (p - q) + v + w))))
