"""The cube of ISO 9283 in the workspace of an arm, its diagonal planes and its measuring points.

ISO 9283:1998 tests a robot in the largest cube of its workspace with edges along the base frame, on planes that hold
two opposite horizontal edges of the cube, at points P1 to P5. Patel (sections 3.4 and 4.4.2) takes 118 poses on these
planes but does not print them. The construction here is ours.

Corners C1 to C4 are those of the upper face, beginning at ``(+x, +y)`` and going counter-clockwise seen from above; C5
to C8 lie below them. The four diagonal planes are C1-C2-C7-C8, C2-C3-C8-C5, C3-C4-C5-C6 and C4-C1-C6-C7: each goes
through the centre and is inclined by 45 deg. P1 is the centre. P2 to P5 lie on the two diagonals of the chosen plane,
which are also diagonals of the cube, at 10 % of their length from their ends.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from truearm.errors import InputError, Words
from truearm.modeling.chain import Array
from truearm.planning.paths.paths import Circle, Line, point

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
        corners, made = self.corners, []
        for name, (a, b, _, d) in PLANES.items():
            along, across = (corners[a] - corners[k] for k in (b, d))
            made.append(
                DiagonalPlane(name, self.centre, along / self.side, across / (math.sqrt(2.0) * self.side), self.side)
            )
        return tuple(made)

    def plane(self, name: str) -> DiagonalPlane:
        """Return the diagonal plane of this name."""
        for plane in self.planes:
            if plane.name == name:
                return plane
        raise InputError("the cube has no such diagonal plane", where="plane", came=name, allowed=", ".join(PLANES))
