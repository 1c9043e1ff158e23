"""CPC, the complete and parametrically continuous model, and its direction vectors.

Source: H. Zhuang, Z. S. Roth and F. Hamano, "A complete and parametrically continuous kinematic model for robot
manipulators", IEEE Transactions on Robotics and Automation 8(4), 1992. A link is ``Q V``: the joint, ``Q = Rz(theta)``
or ``Tz(d)``, and the fixed part ``V = R(b) Rz(beta) Trans(l_x, l_y, l_z)``. The unit vector b is the direction of the
next joint axis in this link's frame, and R(b) turns z there about the axis across both, ``z x b``::

           | 1 - b_x^2/(1 + b_z)    -b_x b_y/(1 + b_z)     b_x |
    R(b) = | -b_x b_y/(1 + b_z)     1 - b_y^2/(1 + b_z)    b_y |
           | -b_x                   -b_y                   b_z |

Only the last link has beta and l_z. R(b) is continuous but for b = -z, which the publication avoids by pointing every
axis the other way; the sense of a joint is not ours to change, so b_z may be negative here.

R(b) is not elementary in b_x and b_y. The b of the row is therefore a fixed rotation, and what identification changes
are two small rotations behind it, ``R(b) Rx(rx) Ry(ry)``. The published vector is then :func:`published_direction`,
and the rotation differs from R of that vector by a turn about the next joint's axis alone: a change of that joint's
zero and of the directions of everything beyond, which :func:`truearm.engine.robot.conversion.converted` works out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from truearm.engine.robot.chain import Array, Direction, Element
from truearm.engine.robot.conventions.convention import JOINT, Convention, JointKind, direction
from truearm.engine.robot.conventions.displaced import small_turns

_Z = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class CpcConvention(Convention):
    """Links ``Rz(theta) R(b) Rx(rx) Ry(ry) Rz(beta) Tx(l_x) Ty(l_y) Tz(l_z)``."""

    @property
    def vectors(self) -> tuple[str, ...]:
        """The direction of the next axis."""
        return ("b",)

    def row_units(self, kind: JointKind) -> dict[str, str]:
        """Return the columns of a CPC link, with their SI units."""
        return super().row_units(kind) | {f"b_{a}": "1" for a in "xyz"}

    def elements(self, number: int, row: Mapping[str, float], kind: JointKind) -> tuple[Element, ...]:
        """Build the joint, the rotation to the next axis with its small rotations, and the rest."""
        plain = super().elements(number, row, kind)
        after = self.columns.index(JOINT) + (2 if kind == "prismatic" else 1)
        return (*plain[:after], *_rotation(direction(row, "b")), *small_turns(number, _Z), *plain[after:])


def rotation_to(b: Direction) -> Array:
    """Return R(b), ``(3, 3)``, that turns z into the unit vector `b` about the axis across both.

    For ``b = -z`` the turn is about x.
    """
    x, y, z = b
    if z == -1.0:
        return np.diag([1.0, -1.0, -1.0])
    c = -x * y / (1 + z)
    return np.array([[1 - x * x / (1 + z), c, x], [c, 1 - y * y / (1 + z), y], [-x, -y, z]])


def published_direction(b: Direction, rx: float, ry: float) -> Direction:
    """Return the published vector of a link with nominal `b` and small rotations `rx`, `ry` [rad]."""
    tilted = (math.sin(ry), -math.sin(rx) * math.cos(ry), math.cos(rx) * math.cos(ry))
    x, y, z = (float(v) for v in rotation_to(b) @ tilted)
    return x, y, z


def small_rotations(b: Direction, published: Direction) -> tuple[float, float]:
    """Return the small rotations rx, ry [rad] that tilt a link of nominal `b` into a published vector."""
    x, y, z = (float(v) for v in rotation_to(b).T @ published)
    return math.atan2(-y, z), math.atan2(x, math.hypot(y, z))


def _rotation(b: Direction) -> tuple[Element, ...]:
    across = math.hypot(b[0], b[1])
    if across == 0.0:
        return () if b[2] > 0 else (Element("R", math.pi, axis=(1.0, 0.0, 0.0)),)
    return (Element("R", math.atan2(across, b[2]), axis=(-b[1] / across, b[0] / across, 0.0)),)
