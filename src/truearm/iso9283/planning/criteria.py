"""The performance criteria of ISO 9283:1998, what is commanded in their tests, and planned paths by distance."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

import numpy as np

from truearm.engine.base.units import Marked
from truearm.engine.motion.cube import Cube
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rotation_from_vector, rotation_vector

# The text of the standard was not at hand. Names, cycles and places are those that Nubiola (section 2.6), Patel
# (chapter 3) and the literature give; who wants to claim conformity must read the standard itself.

#: In which file the measurements of a test are.
Readings = Literal["poses", "paths", "settling", "forces"]


@dataclass(frozen=True)
class PerformanceTest:
    """A test: measurements that are evaluated together, and never with those of another."""

    id: str  #: What its rows have in the column ``criterion``.
    name: str  #: In words.
    criteria: tuple[str, ...]  #: What is evaluated from it.
    readings: Readings  #: In which file its rows are.
    cycles: int  #: How often each place is gone to, or each path run.
    places: tuple[str, ...]  #: Poses, paths or corners, as a plan calls them.


_ALL_POSES: Final = ("P1", "P2", "P3", "P4", "P5")
_PATHS: Final = ("line", "rectangle", "large-circle", "small-circle")

#: Every test by what its rows have in the column ``criterion``.
TESTS: Final[Mapping[str, PerformanceTest]] = {
    test.id: test
    for test in (
        PerformanceTest("AP", "pose accuracy and repeatability", ("AP", "RP"), "poses", 30, _ALL_POSES),
        PerformanceTest("vAP", "multi-directional pose accuracy variation", ("vAP",), "poses", 30, ("P1", "P2", "P4")),
        PerformanceTest("AD", "distance accuracy and repeatability", ("AD", "RD"), "poses", 30, ("P2", "P4")),
        PerformanceTest("dAP", "drift of pose accuracy and repeatability", ("dAP", "dRP"), "poses", 10, ("P1",)),
        PerformanceTest("E", "exchangeability", ("E",), "poses", 30, _ALL_POSES),
        PerformanceTest("t", "position stabilisation time and overshoot", ("t", "OV"), "settling", 3, ("P1",)),
        PerformanceTest("posing-time", "minimum posing time", ("posing-time",), "settling", 3, ("P1",)),
        PerformanceTest("AT", "path accuracy and repeatability", ("AT", "RT"), "paths", 10, _PATHS),
        PerformanceTest(
            "AT-reorientation",
            "path accuracy and repeatability on reorientation",
            ("AT-reorientation", "RT-reorientation"),
            "paths",
            10,
            ("line",),
        ),
        PerformanceTest("CR", "cornering deviations", ("CR", "CO"), "paths", 3, ("rectangle",)),
        PerformanceTest("AV", "path velocity characteristics", ("AV", "RV", "FV"), "paths", 10, ("line",)),
        PerformanceTest("WS", "weaving deviations", ("WS", "WF"), "paths", 3, ("weave",)),
        PerformanceTest("compliance", "static compliance", ("compliance",), "forces", 3, ("P1",)),
    )
}
#: The test in which each criterion is measured, in the order of the standard's table.
TEST_OF: Final[Mapping[str, str]] = {
    criterion: TESTS[test].id
    for criterion, test in (
        ("AP", "AP"),
        ("RP", "AP"),
        ("vAP", "vAP"),
        ("AD", "AD"),
        ("RD", "AD"),
        ("t", "t"),
        ("OV", "t"),
        ("dAP", "dAP"),
        ("dRP", "dAP"),
        ("E", "E"),
        ("AT", "AT"),
        ("RT", "AT"),
        ("AT-reorientation", "AT-reorientation"),
        ("RT-reorientation", "AT-reorientation"),
        ("CR", "CR"),
        ("CO", "CR"),
        ("AV", "AV"),
        ("RV", "AV"),
        ("FV", "AV"),
        ("posing-time", "posing-time"),
        ("compliance", "compliance"),
        ("WS", "WS"),
        ("WF", "WS"),
    )
}
#: Every criterion.
CRITERIA: Final = tuple(TEST_OF)


@dataclass(frozen=True, eq=False)
class PlannedPose:
    """A commanded pose of the tip in the robot's base frame."""

    name: str  #: ``P1`` to ``P5``; others where a test needs them.
    position: Array  #: position, rotation: [m], ``(3,)`` and ``(3, 3)``.
    rotation: Array
    joints: Array  #: Joint positions of the nominal robot that reach it [rad or m], ``(joints,)``.


@dataclass(frozen=True, eq=False)
class PlannedPath:
    """A commanded path of the tip in the robot's base frame."""

    name: str  #: ``line``, ``rectangle``, ``large-circle``, ``small-circle``, ``weave``.
    #: ``polyline`` through :attr:`points`; ``circle`` about the first of them that begins, and ends, at the second,
    #: counter-clockwise about :attr:`normal`; ``weave`` along the line between two points.
    kind: Literal["polyline", "circle", "weave"]
    points: Array  #: [m], ``(k, 3)``. Those of a closed polyline end with the first.
    normal: Array  #: Unit vector at right angles to the plane in which the path lies, ``(3,)``.
    rotation: Array  #: Orientation of the tip, ``(3, 3)``.
    #: Orientation with which it alternates where the orientation changes on the way, ``(3, 3)``; None where it is kept.
    other: Array | None = None
    #: stroke, wavelength: of a weave: from one side to the other, and along the path from one to the next to the same
    #: side [m]; 0 of others.
    stroke: float = 0.0
    wavelength: float = 0.0


@dataclass(frozen=True)
class PlannedTest:
    """One test: where, how often and under what."""

    id: str  #: A key of :data:`truearm.iso9283.planning.criteria.TESTS`.
    places: tuple[str, ...]  #: Names of poses or paths.
    cycles: int  #: How often each.
    velocities: tuple[float, ...] = (1.0,)  #: Shares of the rated velocity, 0 to 1.
    loads: tuple[float, ...] = (1.0,)  #: Shares of the rated load, 0 to 1.
    #: Of ``vAP``: names of the directions from which each pose is gone to. Of ``posing-time``: names of the poses it is
    #: gone to from P1. Of ``compliance``: ``+x`` to ``-z``. Empty for others.
    approaches: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class PerformancePlan:
    """What is commanded in the tests of a robot, by ISO 9283."""

    robot: Robot  #: The nominal robot, as the controller knows it.
    target: str | None  #: Name of the robot's target that is measured; None for the flange.
    cube: Cube  #: cube, plane: in which cube the poses lie, and on which of its diagonal planes.
    plane: str
    poses: Mapping[str, PlannedPose]  #: poses, paths: by their names.
    paths: Mapping[str, PlannedPath]
    #: Of ``vAP``: the pose from which each pose is gone to, by pose and approach (``P1``, ``x``).
    starts: Mapping[tuple[str, str], PlannedPose]
    tests: tuple[PlannedTest, ...]  #: In the order of the plan.
    rated_load: float  #: [kg].
    rated_velocity: float  #: Of the tip along a path, that 100 % stands for [m/s].
    limit_band: float = 0.1e-3  #: Within which of the final pose the tip is said to stand [m].
    hours: float = 8.0  #: How long the drift is watched.

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """``robot``, if it was planned for a robot that was calibrated with simulated measurements."""
        return self.robot.simulated_from

    def test(self, test: str) -> PlannedTest | None:
        """Return what is planned for a test, None if nothing is."""
        return next((planned for planned in self.tests if planned.id == test), None)


def visited(test: PlannedTest) -> tuple[str, ...]:
    """Return the poses at which the robot stops in each cycle of a test of poses, in their order; none along paths."""
    if test.id in ("t", "dAP"):
        return tuple(name for place in test.places for name in ("P2", place))
    if test.id == "posing-time":
        return tuple(name for place in test.approaches for name in ("P1", place))
    if test.id in ("AP", "E"):
        return tuple(reversed(test.places))
    return test.places if test.id == "AD" else ()


#: Stretches in each of which the orientation turns from one to the other.
TURNS: Final = 4


# On a path on which the orientation changes, it turns from one to the other and back in :data:`TURNS` stretches of
# equal length, evenly in each.
@dataclass(frozen=True, eq=False)
class Way:
    """A planned path by the distance travelled along it.

    Of a weave it is the line in the middle: how far the tip goes aside is for those who command it.
    """

    path: PlannedPath  #: As planned.
    reoriented: bool = False  #: Whether the orientation alternates on the way.

    @cached_property
    def length(self) -> float:
        """Of the path [m]."""
        if self.path.kind == "circle":
            return float(2.0 * math.pi * np.linalg.norm(self.path.points[1] - self.path.points[0]))
        return float(self.corners[-1])

    @cached_property
    def corners(self) -> Array:
        """Distance travelled at each of the points of a polyline or a weave [m], ``(k,)``; its ends of a circle."""
        if self.path.kind == "circle":
            return np.array([0.0, self.length])
        steps = np.linalg.norm(np.diff(self.path.points, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def position(self, distance: Array) -> Array:
        """Return places at distances ``(n,)``, ``(n, 3)`` [m]; the ends before and behind the path."""
        s = np.clip(distance, 0.0, self.length)
        points = self.path.points
        if self.path.kind == "circle":
            out = points[1] - points[0]
            aside = np.cross(self.path.normal, out)
            angle = (s / np.linalg.norm(out))[:, None]
            return np.asarray(points[0] + np.cos(angle) * out + np.sin(angle) * aside)
        return np.column_stack([np.interp(s, self.corners, points[:, k]) for k in range(3)])

    def direction(self, distance: Array) -> Array:
        """Return the unit vector of travel at distances ``(n,)``, ``(n, 3)``; behind a corner at the corner itself."""
        s = np.clip(distance, 0.0, self.length)
        points = self.path.points
        if self.path.kind == "circle":
            out = points[1] - points[0]
            out = out / np.linalg.norm(out)
            aside = np.cross(self.path.normal, out)
            angle = (s / np.linalg.norm(points[1] - points[0]))[:, None]
            return np.asarray(-np.sin(angle) * out + np.cos(angle) * aside)
        steps = np.diff(points, axis=0)
        unit = steps / np.linalg.norm(steps, axis=1, keepdims=True)
        piece = np.clip(np.searchsorted(self.corners, s, side="right") - 1, 0, len(unit) - 1)
        return np.asarray(unit[piece])

    def rotation(self, distance: Array) -> Array:
        """Return orientations at distances ``(n,)``, ``(n, 3, 3)``."""
        R, other = self.path.rotation, self.path.other
        if not self.reoriented or other is None:
            return np.broadcast_to(R, (len(distance), 3, 3))
        share = TURNS * np.clip(distance, 0.0, self.length) / self.length
        turned = 1.0 - np.abs(1.0 - share % 2.0)
        vector = rotation_vector((other @ R.T)[None])[0]
        return np.asarray(rotation_from_vector(turned[:, None] * vector) @ R)

    def evenly(self, count: int) -> Array:
        """Return evenly spaced distances from end to end, every corner among them, ``(n,)`` with n at least `count`."""
        pieces = [
            np.linspace(a, b, max(2, math.ceil(count * (b - a) / self.length)), endpoint=False)
            for a, b in zip(self.corners[:-1], self.corners[1:], strict=True)
        ]
        return np.concatenate([*pieces, [self.length]])


def weave_corners(path: PlannedPath) -> tuple[Array, float]:
    """Return the corners of a weave ``(k, 3)`` [m], and how much longer its way is than the line in the middle.

    It runs in straight lines from side to side, its first and last stretch from and to the middle.
    """
    way = path.points[-1] - path.points[0]
    length = float(np.linalg.norm(way))
    along = way / length
    aside = np.cross(path.normal, along)
    half = path.wavelength / 2
    count = int(length / half + 1e-9)
    middle = (np.arange(count) + 0.5) * half
    sides = np.where(np.arange(count) % 2 == 0, 1.0, -1.0) * path.stroke / 2
    corners = path.points[0] + middle[:, None] * along + sides[:, None] * aside
    end = path.points[0] + count * half * along
    return np.concatenate([path.points[:1], corners, end[None]]), float(np.hypot(half, path.stroke) / half)
