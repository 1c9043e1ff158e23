"""What a controller commands over time: straight lines with blended corners, circles, and moves of the joints.

The law is the plain one of many controllers: speed in trapezoids. Ahead of a corner the tip leaves its line at the
zone's radius ``z`` and comes to the next one as far behind it, on a parabola with the corner as its middle control
point, so that the acceleration is constant: ``c^2 |u2 - u1| / (2 z)`` with speed ``c`` at its ends and directions
``u1``, ``u2``. It passes the corner at ``z |u2 - u1| / 4`` then, ``z sqrt(2) / 4`` at a right angle. Looking ahead, the
controller slows down early enough for every corner. Orientations are blended by the same parabola, of rotation vectors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.transform import rotation_from_vector, rotation_vector

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
        rest = self.length - up * (self.peak + self.before) / 2 - down * (self.peak + self.behind) / 2
        return up, max(rest, 0.0) / self.peak if self.peak > 0 else 0.0, down

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
    now = 0.0
    for i, (left, (before, behind)) in enumerate(zip(straight.tolist(), pairwise(speeds.tolist()), strict=True)):
        straight_on = Ramp.over(max(left, 0.0), before, behind, float(fastest[i]), pace.acceleration)
        pieces.append((now, straight_on, i))
        now += straight_on.duration
        if zones[i + 1] > 0:
            pieces.append((now, None, i + 1))
            now += 2 * zones[i + 1] / behind
    time = step * np.arange(math.ceil(now / step - 1e-9) + 1, dtype=float)
    position, turned = np.zeros((len(time), 3)), np.zeros((len(time), 3, 3))
    starts = np.array([piece[0] for piece in pieces])
    which = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(pieces) - 1)
    for number, (start, ramp, i) in enumerate(pieces):
        rows = which == number
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
    bent = (bend > _STRAIGHT) | (twist > _STRAIGHT)
    inner = np.where(bent, np.minimum(pace.zone, np.minimum(length[:-1], length[1:]) / 2), 0.0)
    room = 2.0 * inner
    slowest = np.minimum(
        np.sqrt(room * pace.acceleration / np.maximum(bend, _STRAIGHT)),
        np.sqrt(room * pace.turning_acceleration / np.maximum(twist, _STRAIGHT)),
    )
    passed = np.where(bent, slowest, np.inf)
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
