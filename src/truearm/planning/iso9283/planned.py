"""What is commanded in the tests of ISO 9283: poses, approaches, paths, speeds and loads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.planning.poses.iso9283 import Cube
from truearm.simulated import Marked


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

    id: str  #: A key of :data:`truearm.planning.iso9283.criteria.TESTS`.
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
        return next((one for one in self.tests if one.id == test), None)


def visited(test: PlannedTest) -> tuple[str, ...]:
    """Return the poses at which the robot stops in each cycle of a test of poses, in their order; none along paths."""
    if test.id in ("t", "dAP"):
        return tuple(name for place in test.places for name in ("P2", place))
    if test.id == "posing-time":
        return tuple(name for place in test.approaches for name in ("P1", place))
    if test.id in ("AP", "E"):
        return tuple(reversed(test.places))
    return test.places if test.id == "AD" else ()
