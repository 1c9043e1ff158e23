"""Branches: the up to eight postures in which an arm of six joints reaches the same pose, by name.

A branch is three words, such as ``front-up-noflip``. Each word is the side of a surface on which the arm is singular,
so that a branch is left only through a singular posture (Lee and Ziegler, "Geometric approach in solving inverse
kinematics of PUMA robots", IEEE Trans. AES 20, 1984, name the branches of the PUMA in this way). With the joint axes
as lines, h their directions and p points on them:

============== ============================================ ==============================================
word           sign of                                      in words
============== ============================================ ==============================================
front or back  h2 . (h1 x (S - p1))                         the wrist S is before or behind axis 1
up or down     h2 . ((p3 - p2) x (W - p2)), times the one   the elbow is above or below the line from the
               above                                        shoulder to the wrist W
noflip or flip h5 . (h4 x h6)                               joint 5 bends to its positive or negative side
============== ============================================ ==============================================

S is where axes 5 and 6 cross and W where axes 4 and 5 cross; in a spherical wrist both are the wrist centre. Front is
where the wrist is when all joint positions are zero (where the arm then stands upright, the side to which joint 2 turns
it). Above is away from the base plate. Noflip is the side on which joint 5 reads +90 deg.

The lines of a calibrated arm cross no more, but pass each other closely. The points are then the feet of the common
normals, which move with the calibration errors and no more than that, because axes 4, 5 and 6 stay far from parallel.
So joints far from a singular posture have the same name before and after a calibration.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError, did_you_mean
from truearm.modeling.chain import Array, Chain, ForwardKinematics
from truearm.modeling.transform import cross, dot

if TYPE_CHECKING:
    from truearm.modeling.robot import Robot

#: Names of the branches, in the order of their numbers.
BRANCHES: Final = tuple(f"{s}-{e}-{w}" for s in ("front", "back") for e in ("up", "down") for w in ("noflip", "flip"))

#: Two nominal axes are parallel below this sine; well apart above the other one.
_PARALLEL: Final = 1e-4
_APART: Final = 0.1
#: Two nominal axes cross below this distance [m].
_CROSSING: Final = 1e-5


def branch_number(name: str) -> int:
    """Return the number of a branch, or refuse the name."""
    if name not in BRANCHES:
        raise InputError(
            "there is no such branch",
            parameter="branch",
            came=name,
            allowed=f"{', '.join(BRANCHES)}, or all",
            cure=did_you_mean(name, BRANCHES),
        )
    return BRANCHES.index(name)


@dataclass(frozen=True, eq=False)
class Line:
    """A joint axis in the world: its direction and a point on it [m], each ``(3, 1 or n)``."""

    along: Array
    point: Array

    def foot(self, other: Line) -> Array:
        """Return the point of this line that is nearest to another, ``(3, n)`` [m]."""
        normal = cross(self.along, other.along)
        apart = other.point - self.point
        return self.point + dot(cross(apart, other.along), normal) / dot(normal, normal) * self.along

    def sine(self, other: Line) -> Array:
        """Return the sine of the angle between two lines, ``(n,)``."""
        normal = cross(self.along, other.along)
        return np.sqrt(dot(normal, normal))


def joint_axes(kinematics: ForwardKinematics) -> list[Line]:
    """Return the axes of the six joints as forward kinematics passed them."""
    places = {e.variable: i for i, e in enumerate(kinematics.elements) if e.variable is not None}
    return [Line(kinematics.axis(places[i]), kinematics.origin(places[i])) for i in range(6)]


@dataclass(frozen=True)
class BranchRule:
    """How the branches of one arm are told apart."""

    shoulder: float  #: shoulder, elbow, wrist: the sign, 1 or -1, of the expression that means front, up and noflip.
    elbow: float
    wrist: float

    def numbers(self, kinematics: ForwardKinematics) -> NDArray[np.intp]:
        """Return the branch of each configuration, as its place in :data:`BRANCHES`, ``(n,)``."""
        shoulder, elbow, wrist = _expressions(joint_axes(kinematics))
        back, down = self.shoulder * shoulder < 0, self.elbow * elbow * shoulder < 0
        number: NDArray[np.intp] = np.asarray(4 * back + 2 * down + (self.wrist * wrist < 0), dtype=np.intp)
        return number

    def bend(self, kinematics: ForwardKinematics) -> Array:
        """Return how much joint 5 bends the wrist, 0 in a singular posture and 1 at most, ``(n,)``."""
        return np.abs(_expressions(joint_axes(kinematics))[2])


def branch_rule(robot: Robot) -> BranchRule | None:
    """Return the rule of a robot, by its nominal axes, or None if its branches have no such names.

    They have for an arm of six turning joints of which axes 2 and 3 are parallel and axes 5 and 6 cross, and either
    axis 4 is parallel to axis 3 or axes 4, 5 and 6 cross in one point.
    """
    if len(robot.joints) != 6 or any(joint.kind != "revolute" for joint in robot.joints):
        return None
    joints = np.zeros((6, 2))
    joints[4, 1] = np.pi / 2
    kinematics = robot.rigid.trunk.forward_kinematics(joints)
    lines = [
        Line(np.broadcast_to(line.along, (3, 2))[:, :1], np.broadcast_to(line.point, (3, 2))[:, :1])
        for line in joint_axes(kinematics)
    ]
    one, two, three, four, five, six = lines
    apart = min(one.sine(two)[0], four.sine(five)[0], five.sine(six)[0])
    if apart < _APART or two.sine(three)[0] > _PARALLEL:
        return None
    centre = five.foot(six)
    if np.linalg.norm(six.foot(five) - centre) > _CROSSING:
        return None
    spherical = max(np.linalg.norm(four.foot(five) - centre), np.linalg.norm(five.foot(four) - centre)) < _CROSSING
    if not spherical and three.sine(four)[0] > _PARALLEL:
        return None
    plate = Chain(robot.base_elements).forward_kinematics(np.zeros((6, 1))).rotation[2]
    upwards = float(plate[:, 0] @ one.along[:, 0])
    shoulder, _, wrist = _expressions(joint_axes(kinematics))
    reach = float(np.linalg.norm(kinematics.position[:, 0] - one.point[:, 0]))
    front = float(np.sign(shoulder[0])) if abs(shoulder[0]) > 1e-3 * reach else float(np.sign(upwards) or 1.0)
    return BranchRule(front, float(np.sign(upwards) or 1.0), float(np.sign(wrist[1]) or 1.0))


def _expressions(lines: list[Line]) -> tuple[Array, Array, Array]:
    """Return the expressions of the module's table, without the product in the second."""
    one, two, three, four, five, six = lines
    shoulder = dot(two.along, cross(one.along, five.foot(six) - one.point))
    elbow = dot(two.along, cross(three.point - two.point, four.foot(five) - two.point))
    wrist = dot(five.along, cross(four.along, six.along))
    return shoulder, elbow, wrist
