"""The branches of an arm of six joints by name, and all of them in closed form, as starts for the calibrated arm.

The solutions come from EAIK (Ostermeier, Kuelz and Althoff, "Automatic geometric decomposition for analytical inverse
kinematics", arXiv 2409.14815, with the subproblems of Elias and Wen, arXiv 2211.05737). It needs axes that are exactly
parallel or crossing, which only the nominal arm has.

What the calibrated arm is asked for must therefore be said in terms that both arms share: where its last two axes stand
to its first two. A frame on the first two axes and one on the last two, both at zero joint positions, say it. Base,
tool and the zeros of the first and last joint then drop out, however far they are from nominal (identification may have
moved metres from ``d_1`` to ``base_z``), and the start is off by the errors between the axes alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, did_you_mean
from truearm.engine.robot.chain import Array, Chain, ForwardKinematics
from truearm.engine.robot.transform import cross, dot, homogeneous

if TYPE_CHECKING:
    from truearm.engine.robot.robot import Robot


# Branches: the up to eight postures in which an arm of six joints reaches the same pose, by name.
#
# A branch is three words, such as ``front-up-noflip``. Each word is the side of a surface on which the arm is singular,
# so that a branch is left only through a singular posture (Lee and Ziegler, "Geometric approach in solving inverse
# kinematics of PUMA robots", IEEE Trans. AES 20, 1984, name the branches of the PUMA in this way). With the joint axes
# as lines, h their directions and p points on them:
#
# ============== ============================================ ==============================================
# word           sign of                                      in words
# ============== ============================================ ==============================================
# front or back  h2 . (h1 x (S - p1))                         the wrist S is before or behind axis 1
# up or down     h2 . ((p3 - p2) x (W - p2)), times the one   the elbow is above or below the line from the
#                above                                        shoulder to the wrist W
# noflip or flip h5 . (h4 x h6)                               joint 5 bends to its positive or negative side
# ============== ============================================ ==============================================
#
# S is where axes 5 and 6 cross and W where axes 4 and 5 cross; in a spherical wrist both are the wrist centre. Front is
# where the wrist is when all joint positions are zero (where the arm then stands upright, the side to which joint 2
# turns it). Above is away from the base plate. Noflip is the side on which joint 5 reads +90 deg.
#
# The lines of a calibrated arm cross no more, but pass each other closely. The points are then the feet of the common
# normals, which move with the calibration errors and no more than that, because axes 4, 5 and 6 stay far from parallel.
# So joints far from a singular posture have the same name before and after a calibration.

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


#: Most solutions of one pose.
SLOTS: Final = 8
#: Two threads: what a small machine has.
_THREADS: Final = 2


@dataclass(frozen=True, eq=False)
class Starts:
    """What the joints of the nominal arm turn by to reach poses."""

    joints: Array  #: [rad], ``(n, 8, 6)``; NaN where a pose has fewer solutions.
    #: Whether the nominal arm only comes near to the pose in this way (a least-squares solution), ``(n, 8)``.
    nearest: NDArray[np.bool_]


class ClosedForm:
    """The closed form of a robot's nominal arm.

    Args:
        robot: One that has a :func:`~truearm.engine.robot.inverse.branches.branch_rule`.
        target: The tip of the poses that will be asked for; the flange if None.
    """

    def __init__(self, robot: Robot, target: str | None) -> None:
        from eaik.pybindings.EAIK import Robot as Arm  # a tenth of the size of the package, and no mesh libraries

        zero = np.zeros((1, 6))
        nominal, whole = robot.rigid.trunk.forward_kinematics(zero.T), robot.rigid.forward_kinematics(zero, target)
        base, wrist = _end_frames(nominal)
        axes = joint_axes(nominal)
        directions = np.column_stack([base[:3, :3].T @ line.along[:, 0] for line in axes]).round(12)
        points = [base[:3, :3].T @ (point - base[:3, 3]) for point in (*(a.point[:, 0] for a in axes), wrist[:3, 3])]
        offsets = np.diff(np.array([np.zeros(3), *points]), axis=0).T
        self._arm: Any = Arm(directions, offsets, base[:3, :3].T @ wrist[:3, :3], [], True)
        self._from_world, last = (np.linalg.inv(frame) for frame in _end_frames(whole))
        tip = np.eye(4)
        tip[:3, :3], tip[:3, 3] = whole.matrix()[0], whole.position[:, 0]
        self._behind = np.linalg.inv(last @ tip)

    @property
    def known(self) -> bool:
        """Whether the arm has a closed form."""
        return bool(self._arm.has_known_decomposition())

    def starts(self, position: Array, rotation: Array) -> Starts:
        """Return the solutions for poses of the tip in the world, ``(n, 3)`` [m] and ``(n, 3, 3)``."""
        poses = homogeneous(rotation, position)
        solutions = self._arm.calculate_IK_batched(list(self._from_world @ poses @ self._behind), _THREADS)
        joints = np.full((len(position), SLOTS, 6), np.nan)
        nearest = np.ones((len(position), SLOTS), dtype=bool)
        every = [solution.Q for solution in solutions]
        flags = [solution.is_LS for solution in solutions]
        filled = np.arange(SLOTS) < np.array([len(q) for q in every], dtype=int)[:, None]
        if filled.any():
            joints[filled] = np.concatenate([q for q in every if len(q)])
            nearest[filled] = np.concatenate([flag for flag in flags if len(flag)])
        return Starts(joints, nearest)


def _end_frames(kinematics: ForwardKinematics) -> tuple[Array, Array]:
    """Return the frames on the first two and on the last two axes at one configuration, ``(4, 4)`` each."""
    axes = joint_axes(kinematics)
    return _frame(axes[0], axes[1]), _frame(axes[5], axes[4])


def _frame(line: Line, other: Line) -> Array:
    """Return the frame whose z axis is a line, nearest to another one at the origin, and y across both."""
    z, y = line.along, cross(line.along, other.along)
    y = y / np.linalg.norm(y)
    frame = np.eye(4)
    for column, vector in enumerate((cross(y, z), y, z, line.foot(other))):
        frame[:3, column] = vector[:, 0]
    return frame
