"""Poses to test: the cube of ISO 9283 in the workspace, and the seven-direction line test of a box."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from truearm.engine.base.errors import InputError, Words
from truearm.engine.motion.paths import Circle, Line, point
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.inverse.pose_solver import JointSolutions
from truearm.engine.robot.robot import Robot

# The cube of ISO 9283 in the workspace of an arm, its diagonal planes and its measuring points.
#
# ISO 9283:1998 tests a robot in the largest cube of its workspace with edges along the base frame, on planes that hold
# two opposite horizontal edges of the cube, at points P1 to P5. Patel (sections 3.4 and 4.4.2) takes 118 poses on these
# planes but does not print them. The construction here is ours.
#
# Corners C1 to C4 are those of the upper face, beginning at ``(+x, +y)`` and going counter-clockwise seen from above;
# C5 to C8 lie below them. The four diagonal planes are C1-C2-C7-C8, C2-C3-C8-C5, C3-C4-C5-C6 and C4-C1-C6-C7: each goes
# through the centre and is inclined by 45 deg. P1 is the centre. P2 to P5 lie on the two diagonals of the chosen plane,
# which are also diagonals of the cube, at 10 % of their length from their ends.

#: Name of each diagonal plane, and its corners.
PLANES: Final = {
    "C1-C2-C7-C8": (0, 1, 6, 7),
    "C2-C3-C8-C5": (1, 2, 7, 4),
    "C3-C4-C5-C6": (2, 3, 4, 5),
    "C4-C1-C6-C7": (3, 0, 5, 6),
}
_FACE: Final = ((1, 1), (-1, 1), (-1, -1), (1, -1))
#: P2 to P5 lie this share of a diagonal from its ends.
_FROM_END: Final = 0.1
#: Fractional part of the golden ratio: its multiples spread most evenly over a unit length.
_GOLDEN: Final = (math.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True, eq=False)
class DiagonalPlane:
    """A rectangle that holds two opposite horizontal edges of a cube."""

    name: str  #: Its corners.
    centre: Array  #: [m], in the base frame.
    along: Array  #: Unit vector along the horizontal edges.
    across: Array  #: Unit vector at right angles to it in the plane, upwards.
    side: float  #: Of the cube [m]: the rectangle is ``side`` by ``sqrt(2) side``.

    @property
    def normal(self) -> Array:
        """Unit vector at right angles to the plane."""
        return np.asarray(np.cross(self.along, self.across))

    def points(self, u: ArrayLike, v: ArrayLike) -> Array:
        """Return the points at `u` along and `v` across, -1 to 1 from edge to edge, ``(n, 3)`` [m]."""
        along, across = np.multiply.outer(u, self.along), np.multiply.outer(v, self.across)
        return self.centre + self.side / 2 * (along + math.sqrt(2.0) * across)

    @property
    def measuring_points(self) -> Array:
        """P1 to P5 of ISO 9283, ``(5, 3)`` [m]: the centre, then from the plane's first corner to its last."""
        end = 1 - 2 * _FROM_END
        return self.points([0, end, -end, -end, end], [0, end, end, -end, -end])

    def circle(self, radius: float) -> Circle:
        """Return the circle about the centre that begins on the side of `along` [m]."""
        self._within("radius of the circle", radius, self.side / 2)
        return Circle(self.centre, self.centre + radius * self.along, self.normal)

    def line(self, length: float) -> Line:
        """Return the line through the centre, upwards across the plane [m]."""
        self._within("length of the line", length, math.sqrt(2.0) * self.side)
        return Line(self.centre - length / 2 * self.across, self.centre + length / 2 * self.across)

    def spread(self, count: int) -> Array:
        """Return points that fill the plane evenly from edge to edge, no two of them in a row, ``(count, 3)`` [m].

        They are a golden-ratio lattice: point k lies at share ``(k + 1/2) / count`` along and ``k g + 1/2`` across,
        without its whole part, with g = 0.618.
        """
        k = np.arange(count)
        return self.points(2 * (k + 0.5) / count - 1, 2 * ((k * _GOLDEN + 0.5) % 1.0) - 1)

    @staticmethod
    def _within(what: str, size: float, largest: float) -> None:
        if not 0 < size <= largest * (1 + 1e-9):
            raise InputError(
                "it does not lie within the diagonal plane",
                where=what,
                came=f"{size * 1e3:.4g} mm",
                allowed=f"above 0, up to {largest * 1e3:.4g} mm",
            )


@dataclass(frozen=True, eq=False)
class Cube:
    """A cube with edges along the axes of the base frame.

    Args:
        centre: [m].
        side: [m].
    """

    centre: Array
    side: float

    def __init__(self, centre: ArrayLike | Sequence[float], side: float) -> None:
        if not (math.isfinite(side) and side > 0):
            raise InputError(
                "the side of a cube must be positive",
                where="side of the cube",
                came=Words(f"{1e3 * side:g} mm"),
                allowed="above 0",
            )
        object.__setattr__(self, "centre", point("centre of the cube", centre))
        object.__setattr__(self, "side", float(side))

    @property
    def corners(self) -> Array:
        """C1 to C8, ``(8, 3)`` [m]."""
        corners = [(x, y, z) for z in (1, -1) for x, y in _FACE]
        return self.centre + self.side / 2 * np.array(corners, float)

    @property
    def planes(self) -> tuple[DiagonalPlane, ...]:
        """The four diagonal planes of ISO 9283."""
        corners, planes = self.corners, []
        for name, (a, b, _, d) in PLANES.items():
            along, across = (corners[a] - corners[k] for k in (b, d))
            planes.append(
                DiagonalPlane(name, self.centre, along / self.side, across / (math.sqrt(2.0) * self.side), self.side)
            )
        return tuple(planes)

    def plane(self, name: str) -> DiagonalPlane:
        """Return the diagonal plane of this name."""
        for plane in self.planes:
            if plane.name == name:
                return plane
        raise InputError("the cube has no such diagonal plane", where="plane", came=name, allowed=", ".join(PLANES))


DIRECTIONS: Final = ("x", "y", "z", "xy", "yz", "xz", "xyz")
#: Poses on each line, as in the document.
POSES_EACH: Final = 11
#: The tool points down: flange x along the base's x, flange z against its z.
DOWN: Final = np.diag([1.0, -1.0, -1.0])


# The seven-direction line test: poses along the axes and diagonals of a box (KR5 paper, sections 3.1 and 4.2).
#
# The document does not say where its lines lie in their box of 600 x 800 x 400 mm. Here all of them go through the
# middle of the box, from side to side, from edge to edge and from corner to corner.
@dataclass(frozen=True, eq=False)
class SevenLines:
    """Poses of the line test, line after line."""

    position: Array  #: Of the flange in the robot's base frame [m], ``(7 k, 3)``.
    rotation: Array  #: ``(3, 3)``, the same everywhere.
    labels: tuple[str, ...]  #: ``x-1`` to ``xyz-k``.

    @property
    def poses_each(self) -> int:
        """Poses on each line."""
        return len(self.labels) // len(DIRECTIONS)

    def rows(self, direction: str) -> slice:
        """Return which poses lie on a line."""
        first = DIRECTIONS.index(direction) * self.poses_each
        return slice(first, first + self.poses_each)

    def joints(self, robot: Robot) -> Array:
        """Return the nominal robot's joint positions ``(7 k, joints)``.

        Raises:
            InputError: If it cannot go to one of the poses, with its label.
        """
        rotation = np.broadcast_to(self.rotation, (len(self.position), 3, 3))
        return usable_joints(inverse(robot, self.position, rotation, seed=self._seed(robot)), self.labels, "line test")

    def _seed(self, robot: Robot) -> Array:
        """Return joint positions at the middle of the box, near which all others shall lie."""
        middle = self.position.mean(axis=0)
        joint_solutions = inverse(robot, middle[None], self.rotation[None])
        return np.asarray(usable_joints(joint_solutions, ("the middle of the box",), "line test")[0])


def seven_lines(centre: ArrayLike, size: ArrayLike, poses_each: int = POSES_EACH, rotation: Array = DOWN) -> SevenLines:
    """Return the poses of the line test.

    Args:
        centre, size: Of the box in the robot's base frame [m], three numbers each.
        poses_each: On each line, 2 or more.
        rotation: Of the flange.

    Raises:
        InputError: If the box has no size.
    """
    middle, lengths = np.asarray(centre, float), np.asarray(size, float)
    if lengths.shape != (3,) or not (lengths > 0.0).all():
        raise InputError("the box needs three sizes above zero", where="size", came=lengths.tolist())
    if poses_each < 2:
        raise InputError("a line needs two poses or more", where="poses on each line", came=poses_each)
    along = np.linspace(-0.5, 0.5, poses_each)[:, None]
    lines = [middle + along * lengths * [float(axis in direction) for axis in "xyz"] for direction in DIRECTIONS]
    labels = tuple(f"{direction}-{i}" for direction in DIRECTIONS for i in range(1, poses_each + 1))
    return SevenLines(np.concatenate(lines), rotation, labels)


def usable_joints(solutions: JointSolutions, labels: tuple[str, ...], where: str) -> Array:
    """Return the joint positions of solutions, one a pose, or refuse the first that cannot be gone to."""
    for row, status in enumerate(solutions.status):
        if not status.usable:
            raise InputError(
                "the robot cannot go to a pose",
                where=f"{where}, {labels[int(solutions.pose[row])]}",
                came=solutions.advice(row),
                cure="Move the box, or make it smaller.",
            )
    return solutions.joints
