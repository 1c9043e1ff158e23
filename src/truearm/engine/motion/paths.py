"""Paths of a point in space, and when the point is where: from rest to rest, at a stated speed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Protocol

import numpy as np
from numpy.typing import ArrayLike

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array

#: More samples than anyone means.
_MOST_SAMPLES: Final = 1_000_000


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Where a point is over time, in the robot's base frame."""

    time: Array  #: [s], ``(n,)``, rising.
    position: Array  #: position, velocity, acceleration: [m], [m/s], [m/s^2], ``(n, 3)``.
    velocity: Array
    acceleration: Array

    @property
    def distance(self) -> Array:
        """Length of the chords up to each sample [m], ``(n,)``."""
        chords = np.linalg.norm(np.diff(self.position, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(chords)])


def sample_times(duration: float, step: float) -> Array:
    """Return times from 0 to `duration` [s], evenly apart by `step` or a little less."""
    if not (math.isfinite(step) and step > 0):
        raise InputError("it must be a positive number", where="step", came=step, allowed="above 0 s")
    if duration / step > _MOST_SAMPLES:
        raise InputError(
            "there would be too many samples",
            where="step",
            came=f"{step:.4g} s over {duration:.4g} s",
            allowed=f"at most {_MOST_SAMPLES} samples",
            cure="Take a longer step, or go faster.",
        )
    return np.linspace(0.0, duration, math.ceil(duration / step - 1e-9) + 1)


# Paths of a point in space: straight line, circle, and cubic Hermite sections through waypoints.
#
# A path says where the point is after a distance along it, in which direction it goes on and how that direction turns.
# It knows nothing of time: :func:`timed` adds that.

#: Points nearer than this are one point [m].
_SAME_POINT: Final = 1e-9
#: A path whose speed over its parameter falls below this share of its mean has a cusp.
_CUSP: Final = 1e-4
#: A section is integrated over so many pieces, each with Gauss' points.
_PIECES: Final = 64
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)


class Path(Protocol):
    """A path, parametrised by the distance along it."""

    @property
    def length(self) -> float:
        """Length of the path [m]."""
        ...

    def at(self, distance: Array) -> tuple[Array, Array, Array]:
        """Return the path after distances ``(n,)`` [m].

        Returns:
            position: [m], ``(n, 3)``.
            direction: First derivative by the distance, a unit vector, ``(n, 3)``.
            curvature: Second derivative by the distance [1/m], ``(n, 3)``.
        """
        ...


class Line:
    """The straight line between two points [m]."""

    def __init__(self, start: ArrayLike, end: ArrayLike) -> None:
        self.start, self.end = point("start of the line", start), point("end of the line", end)
        self.length = float(np.linalg.norm(self.end - self.start))
        if self.length < _SAME_POINT:
            raise InputError("the line has no length", where="line", came=_shown(self.start), cure="Move one end.")

    def at(self, distance: Array) -> tuple[Array, Array, Array]:
        """Return position, direction and curvature, as :meth:`Path.at` says."""
        along = np.broadcast_to((self.end - self.start) / self.length, (len(distance), 3))
        return self.start + distance[:, None] * along, along, np.zeros(along.shape)


class Circle:
    """A full circle.

    Args:
        centre: [m].
        start: The point on the circle where it begins and ends [m].
        normal: Axis about which it turns, counter-clockwise; any length. It must be at right angles to the radius.
    """

    def __init__(self, centre: ArrayLike, start: ArrayLike, normal: ArrayLike) -> None:
        self.centre, first = point("centre of the circle", centre), point("start of the circle", start)
        axis = point("normal of the circle", normal)
        self._x, size = first - self.centre, float(np.linalg.norm(axis))
        self.radius = float(np.linalg.norm(self._x))
        if self.radius < _SAME_POINT or size < _SAME_POINT:
            raise InputError("radius and normal of a circle must not be zero", where="circle", came=_shown(first))
        self.normal = axis / size
        if abs(self._x @ self.normal) > 1e-6 * self.radius:
            raise InputError(
                "the circle's start does not lie in its plane",
                where="circle",
                came=f"{abs(self._x @ self.normal) * 1e3:.4g} mm beside it",
                cure="Give a start whose radius is at right angles to the normal.",
            )
        self._y = np.cross(self.normal, self._x)
        self.length = 2 * np.pi * self.radius

    @classmethod
    def through(cls, first: ArrayLike, second: ArrayLike, third: ArrayLike) -> Circle:
        """Make the circle that begins at the first point and passes the second before the third [m]."""
        a, b, c = (point("point of the circle", coordinates) for coordinates in (first, second, third))
        u, v = b - a, c - a
        n = np.cross(u, v)
        if np.linalg.norm(n) <= 1e-9 * max(u @ u, v @ v):
            raise InputError(
                "three points on a line define no circle", where="circle", came=_shown(np.stack([a, b, c]))
            )
        centre = a + (v @ v * np.cross(n, u) - u @ u * np.cross(n, v)) / (2 * n @ n)
        return cls(centre, a, n)

    def at(self, distance: Array) -> tuple[Array, Array, Array]:
        """Return position, direction and curvature, as :meth:`Path.at` says."""
        angle = np.asarray(distance)[:, None] / self.radius
        outward = np.cos(angle) * self._x + np.sin(angle) * self._y
        along = np.cos(angle) * self._y - np.sin(angle) * self._x
        return self.centre + outward, along / self.radius, -outward / self.radius**2


class Hermite:
    """Cubic sections through waypoints, with the velocity given at both ends of each (Li, equation 3).

    With ``h`` the length of a section in the parameter and ``x`` from 0 to 1 along it, the section from waypoint 0 to 1
    is ``(2x^3-3x^2+1) p0 + (x^3-2x^2+x) h v0 + (3x^2-2x^3) p1 + (x^3-x^2) h v1``.

    Direction is continuous everywhere, curvature within a section. At a waypoint curvature jumps, unless no velocities
    are given and those of the natural cubic spline are taken.

    Args:
        waypoints: [m], ``(k, 3)``.
        velocities: At the waypoints [m per unit of the parameter], ``(k, 3)``; those of the natural cubic spline if
            None.
        knots: Value of the parameter at each waypoint, ascending, ``(k,)``: times [s] where velocities are in m/s; 0,
            1, 2 and so on if None.
    """

    def __init__(
        self, waypoints: ArrayLike, velocities: ArrayLike | None = None, knots: ArrayLike | None = None
    ) -> None:
        self.waypoints = np.asarray(waypoints, float)
        if self.waypoints.ndim != 2 or self.waypoints.shape[1] != 3 or len(self.waypoints) < 2:
            raise InputError(
                "a path needs two waypoints or more of three coordinates",
                where="waypoints",
                came=f"an array of shape {self.waypoints.shape}",
                allowed="(k, 3)",
            )
        count = len(self.waypoints)
        self.knots = np.arange(float(count)) if knots is None else np.asarray(knots, float)
        if self.knots.shape != (count,) or not (np.diff(self.knots) > 0).all():
            raise InputError(
                "the parameter does not rise from waypoint to waypoint",
                where="knots",
                allowed=f"{count} rising numbers",
            )
        checked = {"waypoints": self.waypoints, "knots": self.knots}
        if velocities is not None:
            checked["velocities"] = np.asarray(velocities, float)
            if checked["velocities"].shape != self.waypoints.shape:
                raise InputError(
                    "there are not as many velocities as waypoints",
                    where="velocities",
                    came=f"an array of shape {checked['velocities'].shape}",
                    allowed=f"{self.waypoints.shape}",
                )
        for name, values in checked.items():
            if not np.isfinite(values).all():
                raise InputError("a waypoint cannot be NaN or infinite", where=name)
        self.velocities = checked["velocities"] if "velocities" in checked else _natural(self.knots, self.waypoints)

    @property
    def length(self) -> float:
        """Length of the path [m].

        Raises:
            InputError: If the point stands still somewhere: there the path has no direction.
        """
        return float(self._travelled[-1])

    def at(self, distance: Array) -> tuple[Array, Array, Array]:
        """Return position, direction and curvature, as :meth:`Path.at` says."""
        parameter = np.interp(distance, self._travelled, self._grid)
        for _ in range(3):  # Newton's steps: the tabulated start is good to a millionth already
            place = np.clip(np.searchsorted(self._grid, parameter, side="right") - 1, 0, len(self._grid) - 2)
            missing = distance - self._travelled[place] - self._pieces(self._grid[place], parameter)
            parameter = parameter + missing / np.linalg.norm(self.by_parameter(parameter)[1], axis=1)
        position, rate, bend = self.by_parameter(np.clip(parameter, self.knots[0], self.knots[-1]))
        speed = np.linalg.norm(rate, axis=1)[:, None]
        along = rate / speed
        return position, along, (bend - (bend * along).sum(1, keepdims=True) * along) / speed**2

    def by_parameter(self, parameter: Array) -> tuple[Array, Array, Array]:
        """Return position and its first two derivatives by the parameter, ``(n, 3)`` each."""
        first = np.clip(np.searchsorted(self.knots, parameter, side="right") - 1, 0, len(self.knots) - 2)
        h = (self.knots[first + 1] - self.knots[first])[:, None]
        x = (np.asarray(parameter) - self.knots[first])[:, None] / h
        p, q = self.waypoints[first], self.waypoints[first + 1]
        v, w = h * self.velocities[first], h * self.velocities[first + 1]
        square, cubic = 3 * (q - p) - 2 * v - w, 2 * (p - q) + v + w
        position = p + x * (v + x * (square + x * cubic))
        return position, (v + x * (2 * square + 3 * x * cubic)) / h, (2 * square + 6 * x * cubic) / h**2

    def trajectory(self, step: float) -> Trajectory:
        """Return the motion whose time is the parameter itself, sampled every `step` [s] or a little less.

        It has the velocities that were given. Its acceleration jumps at waypoints, unless they are the natural
        spline's.
        """
        time = sample_times(float(self.knots[-1] - self.knots[0]), step)
        return Trajectory(time, *self.by_parameter(time + self.knots[0]))

    @cached_property
    def _grid(self) -> Array:
        """Parameter values ``(pieces + 1,)`` between which the length is tabulated."""
        inner = [np.linspace(a, b, _PIECES, endpoint=False) for a, b in zip(self.knots, self.knots[1:], strict=False)]
        return np.concatenate([*inner, self.knots[-1:]])

    @cached_property
    def _travelled(self) -> Array:
        """Distance up to each value of the grid [m]."""
        pieces = self._pieces(self._grid[:-1], self._grid[1:])
        speed = np.linalg.norm(self.by_parameter(self._grid)[1], axis=1)
        slow = np.flatnonzero(speed <= _CUSP * pieces.sum() / (self._grid[-1] - self._grid[0]))
        if len(slow):
            place = self._grid[slow[0]]
            raise InputError(
                "the path stands still and has no direction there",
                where=f"parameter {place:.6g} of {self.knots[0]:.6g} to {self.knots[-1]:.6g}",
                cure="Give a velocity that is not zero and leads on, or take the motion over time as it is.",
            )
        return np.concatenate([[0.0], np.cumsum(pieces)])

    def _pieces(self, start: Array, end: Array) -> Array:
        """Return the length between parameter values within one section each, ``(n,)`` [m]."""
        half = (end - start) / 2
        total = np.zeros(len(half))
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            total += weight * np.linalg.norm(self.by_parameter(start + half * (1 + node))[1], axis=1)
        return total * half


def point(name: str, coordinates: ArrayLike) -> Array:
    """Return three finite coordinates [m], or refuse what was given."""
    values = np.asarray(coordinates, float)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise InputError("a point needs three finite coordinates", where=name, came=str(values))
    return values


def _natural(knots: Array, waypoints: Array) -> Array:
    """Return the velocities with which the second derivative is continuous, and zero at both ends."""
    h, slope = np.diff(knots), np.diff(waypoints, axis=0) / np.diff(knots)[:, None]
    count = len(knots)
    matrix, right = np.zeros((count, count)), np.zeros(waypoints.shape)
    matrix[0, :2], right[0] = (2, 1), 3 * slope[0]
    matrix[-1, -2:], right[-1] = (1, 2), 3 * slope[-1]
    for i in range(1, count - 1):
        matrix[i, i - 1 : i + 2] = h[i], 2 * (h[i - 1] + h[i]), h[i - 1]
        right[i] = 3 * (h[i] * slope[i - 1] + h[i - 1] * slope[i])
    return np.asarray(np.linalg.solve(matrix, right))


def _shown(points: Array) -> str:
    return f"{np.round(points * 1e3, 4).tolist()} mm"


# The speed rises over a ramp of duration ``T`` as ``V (3x^2 - 2x^3)``, ``x = t / T``, is constant, and falls in the
# same way. The acceleration along the path is then ``6 V/T x (1 - x)``: continuous, zero at rest and at full speed, and
# at most ``1.5 V / T``, which is the acceleration that the caller states. The documents state no law; this one is ours.
@dataclass(frozen=True)
class TimeLaw:
    """The motion along a path of some length, from rest to rest."""

    length: float  #: Of the path [m].
    #: Speed between the ramps [m/s]. On a path too short for both ramps the peak is lower: see :attr:`peak_speed`.
    speed: float
    #: Largest acceleration along the path [m/s^2]. What a bend adds, speed squared times curvature, is not in it.
    acceleration: float

    def __post_init__(self) -> None:
        for name in ("length", "speed", "acceleration"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise InputError("it must be a positive number", where=name, came=value, allowed="above 0")

    @property
    def peak_speed(self) -> float:
        """Speed that is reached [m/s]."""
        return min(self.speed, math.sqrt(self.length * self.acceleration / 1.5))

    @property
    def ramp(self) -> float:
        """Duration of each ramp [s]."""
        return 1.5 * self.peak_speed / self.acceleration

    @property
    def duration(self) -> float:
        """Duration of the whole motion [s]."""
        return self.ramp + self.length / self.peak_speed

    def at(self, time: Array) -> tuple[Array, Array, Array]:
        """Return distance [m], speed [m/s] and acceleration [m/s^2] along the path at times [s], ``(n,)`` each."""
        T, V = self.ramp, self.peak_speed
        late = time > self.duration / 2  # the second half is the first one seen backwards
        elapsed = np.where(late, self.duration - time, time)
        x = np.clip(elapsed / T, 0.0, 1.0)
        distance = V * T * x**3 * (1 - x / 2) + V * np.maximum(elapsed - T, 0.0)
        distance = np.where(late, self.length - distance, distance)
        return distance, V * x**2 * (3 - 2 * x), np.where(late, -6.0, 6.0) * V / T * x * (1 - x)


def timed(path: Path, speed: float, acceleration: float, step: float) -> Trajectory:
    """Let a point run along a path, from rest to rest.

    Args:
        path: Where it goes.
        speed, acceleration: As :class:`TimeLaw` has them [m/s], [m/s^2].
        step: Time between samples, or a little less, so that the last sample is the end [s].

    Raises:
        InputError: If a number is not positive, or the samples would be more than a million.
    """
    law = TimeLaw(path.length, speed, acceleration)
    time = sample_times(law.duration, step)
    s, rate, change = law.at(time)
    position, along, curvature = path.at(s)
    velocity = rate[:, None] * along
    return Trajectory(time, position, velocity, change[:, None] * along + rate[:, None] ** 2 * curvature)
