"""An arm in motion with its controller: what is commanded along paths, how joints follow, where the tip is."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, quaternion_from_rotation, rotation_from_vector, rotation_vector
from truearm.engine.twin.twin import REFERENCE_TEMPERATURE, Twin
from truearm.engine.twin.twin_joint import PERFECT
from truearm.iso9283.planning.criteria import TURNS, PlannedPath, weave_corners

#: What a joint of the arm turns by under the moment of the rated load at the tip, in the middle of all robots [rad].
#: Joint 2 of an IRB 120 turns by 0.0005, joint 3 by 0.002 (Nubiola, Table 2.7); larger arms are stiffer for their load.
_TURN: Final = 3e-4
#: What a prismatic joint moves by under the rated load [m].
_SHIFT: Final = 2e-5
#: The last three joints have small gears: so much more they give way to the same moment.
_WRIST: Final = 3
_WEAKER: Final = 4.0
#: Standard deviation of the logarithm from joint to joint.
_SPREAD: Final = 0.4


def drawn_compliance(robot: Robot, force: float, lever: float, rng: np.random.Generator) -> tuple[float, ...]:
    """Return the compliance of each joint [rad/(N m), m/N of a prismatic one].

    Args:
        force: Weight of the rated load [N].
        lever: Of the tip from the base [m].
        rng: For what is drawn.
    """
    first = len(robot.joints) - _WRIST
    drawn = np.exp(_SPREAD * rng.standard_normal(len(robot.joints)))
    middle = (
        _SHIFT / force if joint.kind == "prismatic" else (_WEAKER if number >= first else 1.0) * _TURN / (force * lever)
        for number, joint in enumerate(robot.joints)
    )
    return tuple(float(compliance * share) for compliance, share in zip(middle, drawn, strict=True))


# How joints follow their commands: each a damped spring between command and joint, as a position loop makes it.
#
# ``q'' = w^2 (u - q) + 2 D w (k u' - q')`` with command ``u``, natural frequency ``w``, damping ratio ``D`` and the
# share ``k`` of the command's speed that is fed forward. Commands run straight from one to the next. For such a command
# ``u + 2 D (k - 1) / w u'`` is a solution, and what is left decays as a free oscillation: every step is exact, however
# long. Source: closed forms of the linear oscillator, as in any text on control.

#: What is left of a free oscillation when it is no longer followed.
_GONE: Final = 1e-18
#: Frequencies of a free motion nearer to each other than this share are one.
_CRITICAL: Final = 1e-8


@dataclass(frozen=True)
class Servo:
    """The position loop of the joints."""

    frequency: float  #: Natural frequency without damping [rad/s].
    damping: float  #: Ratio; below 1 the joint overshoots.
    velocity: float = math.inf  #: velocity, acceleration: what a joint cannot exceed [rad/s, rad/s^2 or m/s, m/s^2].
    acceleration: float = math.inf
    #: Share of the command's speed that is fed forward: 1 follows a steady motion without lag.
    feedforward: float = 0.0

    def __post_init__(self) -> None:
        for name in ("frequency", "damping", "velocity", "acceleration"):
            if not getattr(self, name) > 0 or (name in ("frequency", "damping") and math.isinf(getattr(self, name))):
                raise InputError(
                    "it must be a positive number", where=name, came=getattr(self, name), allowed="above 0"
                )

    def follow(self, command: Array, step: float, start: Array | None = None) -> tuple[Array, Array]:
        """Return positions and velocities of joints that follow a command from rest.

        Args:
            command: ``(n, joints)`` [rad or m], `step` [s] apart.
            start: Where the joints stand at first, ``(joints,)``; None for the first command.

        Returns:
            position, velocity: ``(n, joints)`` each, at the times of the commands. Where a limit is met, the
                acceleration of that step is constant: the one that keeps to the limit.
        """
        command = np.asarray(command, float)
        first = command[0] if start is None else np.asarray(start, float)
        position, velocity = self._unlimited(command, step, first)
        before = np.concatenate([np.zeros((1, command.shape[1])), velocity[:-1]])
        changes = np.abs(velocity - before).max(initial=0.0)
        if np.abs(velocity).max(initial=0.0) <= self.velocity and changes <= self.acceleration * step:
            return position, velocity
        return self._limited(command, step, first)

    def _unlimited(self, command: Array, step: float, first: Array) -> tuple[Array, Array]:
        """Return the motion by what every command adds to it: decaying oscillations, summed."""
        n = len(command)
        slope = np.diff(command, axis=0) / step
        taps = min(n, self._memory(step))
        decay = self._free(step * np.arange(1, taps + 1, dtype=float))
        before = np.concatenate([np.eye(2)[None], decay[: taps - 1]])
        answers = (before - decay) @ np.array([self._lag, 1.0])  # to a slope of one step, after 0, 1 .. steps
        position, velocity = command.copy(), np.zeros_like(command)
        for j in range(command.shape[1]):
            for k, into in ((0, position), (1, velocity)):
                into[1:, j] += np.convolve(slope[:, j], answers[:, k])[: n - 1]
        off = first - command[0]
        if off.any():
            free_response = self._free(step * np.arange(n, dtype=float))
            position += free_response[:, 0, 0, None] * off
            velocity += free_response[:, 1, 0, None] * off
        return position, velocity

    def _limited(self, command: Array, step: float, first: Array) -> tuple[Array, Array]:
        """Return the motion step by step, with the limits."""
        decay = self._free(np.array([step]))[0]
        position, velocity = np.empty_like(command), np.empty_like(command)
        q, v = first, np.zeros(command.shape[1])
        position[0], velocity[0] = q, v
        for k in range(1, len(command)):
            slope = (command[k] - command[k - 1]) / step
            off, speed = q - command[k - 1] - self._lag * slope, v - slope
            free = decay[0, 0] * off + decay[0, 1] * speed + command[k] + self._lag * slope
            wanted = decay[1, 0] * off + decay[1, 1] * speed + slope
            most = self.acceleration * step
            limited = np.clip(np.clip(wanted, v - most, v + most), -self.velocity, self.velocity)
            q = np.where(limited == wanted, free, q + (v + limited) / 2 * step)
            v = limited
            position[k], velocity[k] = q, v
        return position, velocity

    @property
    def _lag(self) -> float:
        return 2.0 * self.damping * (self.feedforward - 1.0) / self.frequency

    def _memory(self, step: float) -> int:
        """Return after how many steps nothing is left of a free oscillation."""
        w, d = self.frequency, self.damping
        slowest = d * w if d <= 1 else w * (d - math.sqrt(d * d - 1))
        return max(2, math.ceil(-2.0 * math.log(_GONE) / (slowest * step)))

    def _free(self, time: Array) -> Array:
        """Return what becomes of position and velocity in a time of free motion, ``(n, 2, 2)``."""
        w, d = self.frequency, self.damping
        beside = d * d - 1.0
        t = np.asarray(time, float)
        if abs(beside) < _CRITICAL:
            fall, c, s = np.exp(-w * t), np.ones_like(t), t
        elif beside < 0:
            turn = w * math.sqrt(-beside)
            fall, c, s = np.exp(-d * w * t), np.cos(turn * t), np.sin(turn * t) / turn
        else:
            rate = w * math.sqrt(beside)
            slow, fast = np.exp((rate - d * w) * t), np.exp((-rate - d * w) * t)
            fall, c, s = np.ones_like(t), (slow + fast) / 2, (slow - fast) / (2 * rate)
        return np.stack(
            [
                np.stack([fall * (c + d * w * s), fall * s], axis=-1),
                np.stack([-fall * w * w * s, fall * (c - d * w * s)], axis=-1),
            ],
            axis=-2,
        )


# An arm in a cell: what its controller believes, how its joints follow, and where its tip truly is.
#
# The controller computes joint positions with the nominal robot. The tip is where the digital twin has it at the
# positions to which the joints have come: with its geometry, its compliance under its own weight, its load, its motion
# and pushes, and its hysteresis by the direction of the commanded moves. Beside what the truth says, joints come to
# rest a little elsewhere each time, gears have a little play, and links are shorter while the arm is cold.

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
                truth, hysteresis=truth.hysteresis or self.drives.play, growth=truth.growth or self.warming.growth
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
        joint_solutions = inverse(self.nominal, frames[:, :3, 3], frames[:, :3, :3], target=self.target, seed=near)
        lost = [row for row, status in enumerate(joint_solutions.status) if not status.usable]
        if lost:
            x, y, z = (1e3 * frames[lost[0], :3, 3]).tolist()
            raise InputError(
                "the robot cannot come to a commanded pose",
                where=self.nominal.name,
                came=f"x {x:.1f}, y {y:.1f}, z {z:.1f} mm: {joint_solutions.status[lost[0]].value}",
                cure="Plan poses and paths that the robot can reach in one posture.",
            )
        return joint_solutions.joints

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
        loaded = np.asarray(self.pushed.frames(joints, approach=approach, temperature=warm, wrench=wrench)[TIP])
        if self.pushed is self.true:
            return loaded
        # From where the arm stands without giving way, by what the push alone does.
        free, stands = (
            twin.frames(joints, approach=approach, temperature=warm)[TIP] for twin in (self.pushed, self.true)
        )
        moved = stands.copy()
        moved[:, :3, 3] += loaded[:, :3, 3] - free[:, :3, 3]
        moved[:, :3, :3] = loaded[:, :3, :3] @ free[:, :3, :3].transpose(0, 2, 1) @ stands[:, :3, :3]
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
        commanded = np.concatenate(
            [np.repeat(command[:1], ahead, axis=0), command, np.repeat(command[-1:], left, axis=0)]
        )
        position, velocity = self.drives.servo.follow(commanded, step)
        acceleration = np.gradient(velocity, step, axis=0)
        ways = last_moves(commanded)

        def at(time: Array) -> tuple[NDArray[np.intp], Array]:
            steps = time / step + ahead
            k = np.clip((steps + 1e-9).astype(np.intp), 0, len(commanded) - 2)
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
            tip_place, oriented = self._believed(joints)
            place = tip_place + _interpolated(time, grid, place - nominal)
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
    direction = np.take_along_axis(signs, latest, axis=0)
    first = np.argmax(signs != 0.0, axis=0)
    starts = signs[first, np.arange(joints.shape[1])]
    return np.asarray(np.where(direction == 0.0, starts, direction))


def _interpolated(time: Array, grid: Array, values: Array) -> Array:
    return np.stack([np.interp(time, grid, column) for column in values.T], axis=1)


def _between(position: Array, velocity: Array, k: NDArray[np.intp], x: Array, step: float) -> Array:
    """Return positions a share of a step behind the k-th, by the cubic that has positions and velocities."""
    p, q = position[k], position[k + 1]
    v, w = step * velocity[k], step * velocity[k + 1]
    return np.asarray(p + x * (v + x * (3 * (q - p) - 2 * v - w + x * (2 * (p - q) + v + w))))


# What a controller commands over time: straight lines with blended corners, circles, and moves of the joints.
#
# The law is the plain one of many controllers: speed in trapezoids. Ahead of a corner the tip leaves its line at the
# zone's radius ``z`` and comes to the next one as far behind it, on a parabola with the corner as its middle control
# point, so that the acceleration is constant: ``c^2 |u2 - u1| / (2 z)`` with speed ``c`` at its ends and directions
# ``u1``, ``u2``. It passes the corner at ``z |u2 - u1| / 4`` then, ``z sqrt(2) / 4`` at a right angle. Looking ahead,
# the controller slows down early enough for every corner. Orientations are blended by the same parabola, of rotation
# vectors.
_STRAIGHT: Final = 1e-12


@dataclass(frozen=True)
class Pace:
    """How fast a controller runs a path."""

    velocity: float  #: velocity, acceleration: of the tip along the path, the latter also across it [m/s], [m/s^2].
    acceleration: float = 10.0
    zone: float = 0.0  #: Radius about a corner within which the path is left [m]; 0 to stop there.
    #: turning, turning_acceleration: largest angular velocity and acceleration [rad/s], [rad/s^2].
    turning: float = 2.0 * math.pi
    turning_acceleration: float = 50.0

    def __post_init__(self) -> None:
        for name in ("velocity", "acceleration", "turning", "turning_acceleration"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise InputError(
                    "it must be a positive number", where=name, came=getattr(self, name), allowed="above 0"
                )
        if not (math.isfinite(self.zone) and self.zone >= 0):
            raise InputError("a radius cannot be negative", where="zone", came=self.zone, allowed="0 or more")


@dataclass(frozen=True, eq=False)
class Commands:
    """Where the tip is commanded to be."""

    #: From 0, evenly spaced; the last is the first one at which the tip is commanded to stand [s], ``(n,)``.
    time: Array
    position: Array  #: position, rotation: ``(n, 3)`` [m] and ``(n, 3, 3)``.
    rotation: Array


@dataclass(frozen=True)
class Ramp:
    """The motion along a length, with speed in a trapezoid."""

    length: float  #: [m], or 1 for a share.
    before: float  #: before, behind: speeds at its ends.
    behind: float
    peak: float  #: Speed between the ramps.
    acceleration: float  #: Of both ramps.

    @classmethod
    def over(cls, length: float, before: float, behind: float, velocity: float, acceleration: float) -> Ramp:
        """Return the fastest motion that keeps to a velocity and an acceleration."""
        reachable = math.sqrt(acceleration * length + (before**2 + behind**2) / 2)
        return cls(length, before, behind, min(velocity, reachable), acceleration)

    @property
    def _times(self) -> tuple[float, float, float]:
        """How long it speeds up, keeps its speed and slows down."""
        up, down = (max(self.peak - end, 0.0) / self.acceleration for end in (self.before, self.behind))
        cruise = self.length - up * (self.peak + self.before) / 2 - down * (self.peak + self.behind) / 2
        return up, max(cruise, 0.0) / self.peak if self.peak > 0 else 0.0, down

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return sum(self._times)

    def at(self, time: Array) -> Array:
        """Return the distance travelled at times ``(n,)``."""
        up, even, _ = self._times
        a = self.acceleration
        t = np.clip(time, 0.0, self.duration)
        early = np.minimum(t, up)
        middle = np.clip(t - up, 0.0, even)
        late = np.maximum(t - up - even, 0.0)
        gone = self.before * early + a / 2 * early**2 + self.peak * middle + self.peak * late - a / 2 * late**2
        return np.asarray(np.minimum(gone, self.length))


def along_lines(points: Array, rotations: Array, pace: Pace, step: float) -> Commands:
    """Return the commands along straight lines from point to point, from rest to rest.

    Args:
        points, rotations: ``(k, 3)`` [m] and ``(k, 3, 3)``; between two the orientation turns evenly with the distance.
        pace: How fast; corners are blended within its zone, or within half of a shorter line.
        step: Time between two commands [s].

    Raises:
        InputError: If two neighbouring points are the same.
    """
    steps = np.diff(points, axis=0)
    length = np.linalg.norm(steps, axis=1)
    if len(length) == 0 or (length <= 0).any():
        raise InputError("neighbouring points of a path must be apart", where="path", came=f"{len(points)} points")
    along = steps / length[:, None]
    turning = rotation_vector(rotations[1:] @ rotations[:-1].transpose(0, 2, 1)) / length[:, None]
    rate = np.linalg.norm(turning, axis=1)
    fastest = np.minimum(pace.velocity, pace.turning / np.maximum(rate, _STRAIGHT))
    zones, speeds = _corners(length, along, turning, fastest, pace)
    straight = length - zones[:-1] - zones[1:]
    pieces: list[tuple[float, Ramp | None, int]] = []  # when it begins; the corner's number where it is a blend
    elapsed = 0.0
    for i, (left, (before, behind)) in enumerate(zip(straight.tolist(), pairwise(speeds.tolist()), strict=True)):
        straight_on = Ramp.over(max(left, 0.0), before, behind, float(fastest[i]), pace.acceleration)
        pieces.append((elapsed, straight_on, i))
        elapsed += straight_on.duration
        if zones[i + 1] > 0:
            pieces.append((elapsed, None, i + 1))
            elapsed += 2 * zones[i + 1] / behind
    time = step * np.arange(math.ceil(elapsed / step - 1e-9) + 1, dtype=float)
    position, turned = np.zeros((len(time), 3)), np.zeros((len(time), 3, 3))
    starts = np.array([piece[0] for piece in pieces])
    piece_of = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(pieces) - 1)
    for number, (start, ramp, i) in enumerate(pieces):
        rows = piece_of == number
        if not rows.any():
            continue
        t = time[rows] - start
        if ramp is not None:
            s = (zones[i] + ramp.at(t))[:, None]
            position[rows] = points[i] + s * along[i]
            turned[rows] = rotation_from_vector(s * turning[i]) @ rotations[i]
        else:
            z = zones[i]
            x = np.clip(t * speeds[i] / (2 * z), 0.0, 1.0)[:, None]
            position[rows] = points[i] + z * (x**2 * along[i] - (1 - x) ** 2 * along[i - 1])
            turned[rows] = rotation_from_vector(z * (x**2 * turning[i] - (1 - x) ** 2 * turning[i - 1])) @ rotations[i]
    return Commands(time, position, turned)


def _corners(length: Array, along: Array, turning: Array, fastest: Array, pace: Pace) -> tuple[Array, Array]:
    """Return how far ahead of each point its blend begins, and the speed there, ``(k,)`` each; both 0 at the ends."""
    bend = np.linalg.norm(np.diff(along, axis=0), axis=1)
    twist = np.linalg.norm(np.diff(turning, axis=0), axis=1)
    turns = (bend > _STRAIGHT) | (twist > _STRAIGHT)
    inner = np.where(turns, np.minimum(pace.zone, np.minimum(length[:-1], length[1:]) / 2), 0.0)
    blended = 2.0 * inner
    slowest = np.minimum(
        np.sqrt(blended * pace.acceleration / np.maximum(bend, _STRAIGHT)),
        np.sqrt(blended * pace.turning_acceleration / np.maximum(twist, _STRAIGHT)),
    )
    passed = np.where(turns, slowest, np.inf)
    zones = np.concatenate([[0.0], inner, [0.0]])
    speeds = np.concatenate([[0.0], np.minimum(passed, np.minimum(fastest[:-1], fastest[1:])), [0.0]])
    straight = np.maximum(length - zones[:-1] - zones[1:], 0.0)
    for i in range(len(length)):  # speeding up
        speeds[i + 1] = min(speeds[i + 1], math.sqrt(speeds[i] ** 2 + 2 * pace.acceleration * straight[i]))
    for i in reversed(range(len(length))):  # slowing down, by looking ahead
        speeds[i] = min(speeds[i], math.sqrt(speeds[i + 1] ** 2 + 2 * pace.acceleration * straight[i]))
    zones = np.where(speeds > 0, zones, 0.0)
    return zones, speeds


def along_circle(centre: Array, start: Array, normal: Array, rotation: Array, pace: Pace, step: float) -> Commands:
    """Return the commands once round a circle, counter-clockwise about its normal, from rest to rest.

    The speed is so low that the acceleration towards the centre keeps to the limit.
    """
    out = start - centre
    radius = float(np.linalg.norm(out))
    if radius <= 0:
        raise InputError("a circle must have a radius", where="path", came=0.0, allowed="above 0")
    velocity = min(pace.velocity, math.sqrt(pace.acceleration * radius))
    ramp = Ramp.over(2 * math.pi * radius, 0.0, 0.0, velocity, pace.acceleration)
    time = step * np.arange(math.ceil(ramp.duration / step - 1e-9) + 1, dtype=float)
    angle = (ramp.at(time) / radius)[:, None]
    position = centre + np.cos(angle) * out + np.sin(angle) * np.cross(normal, out)
    return Commands(time, position, np.broadcast_to(rotation, (len(time), 3, 3)))


def joint_move(start: Array, end: Array, velocity: float, acceleration: float, step: float) -> Array:
    """Return joint positions over time from one place to another, all joints on the way for the same time, ``(n, j)``.

    Args:
        start, end: ``(j,)`` [rad or m].
        velocity, acceleration: That no joint exceeds [rad/s, rad/s^2 or m/s, m/s^2].
        step: Between two commands [s].
    """
    way = np.asarray(end) - np.asarray(start)
    longest = float(np.abs(way).max(initial=0.0))
    if longest <= 0:
        return np.asarray(start, float)[None].copy()
    ramp = Ramp.over(1.0, 0.0, 0.0, velocity / longest, acceleration / longest)
    time = step * np.arange(math.ceil(ramp.duration / step - 1e-9) + 1, dtype=float)
    return np.asarray(np.asarray(start) + ramp.at(time)[:, None] * way)


#: Radius about a corner in which a rectangle is left where corners are judged [m], and that of a weave in strokes.
ZONE: Final = 2e-3
_WEAVE_ZONE: Final = 0.05
#: Tests in which a path is run without a stop at its corners.
_BLENDED: Final = ("CR", "AT-reorientation")


def zone_of(test: str, path: PlannedPath) -> float:
    """Return the radius about corners within which the controller leaves a path [m]; 0 where it stops there."""
    if path.kind == "weave":
        return _WEAVE_ZONE * path.stroke
    return ZONE if test in _BLENDED else 0.0


def path_commands(path: PlannedPath, pace: Pace, step: float, *, reoriented: bool = False) -> Commands:
    """Return what a controller commands along a planned path.

    A weave runs in straight lines from side to side, its first and last stretch from and to the middle. Its velocity is
    that of the advance along the line in the middle, so that its frequency is the velocity over the wavelength.

    Args:
        path: In the robot's base frame.
        pace: How fast.
        step: Between two commands [s].
        reoriented: Whether the orientation alternates: from one to the other and back, as ``Way`` has it.

    Raises:
        InputError: If the orientation shall alternate and the path has one alone.
    """
    if path.kind == "circle":
        return along_circle(path.points[0], path.points[1], path.normal, path.rotation, pace, step)
    points = path.points
    if path.kind == "weave":
        points, longer = weave_corners(path)
        pace = Pace(pace.velocity * longer, pace.acceleration, pace.zone, pace.turning, pace.turning_acceleration)
    rotations = np.broadcast_to(path.rotation, (len(points), 3, 3))
    if reoriented:
        if path.other is None:
            raise InputError(
                "this path has one orientation, and another is needed for the orientation to change",
                parameter="plan",
                came=path.name,
            )
        share = np.linspace(0.0, 1.0, TURNS + 1)[:, None]
        points = points[0] + share * (points[-1] - points[0])
        rotations = np.stack([path.rotation if k % 2 == 0 else path.other for k in range(TURNS + 1)])
    return along_lines(points, rotations, pace, step)
