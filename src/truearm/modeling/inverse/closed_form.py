"""All branches of a nominal arm in closed form, as starts for the calibrated one.

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

from truearm.modeling.chain import Array, ForwardKinematics
from truearm.modeling.inverse.branches import Line, joint_axes
from truearm.modeling.transform import cross, homogeneous

if TYPE_CHECKING:
    from truearm.modeling.robot import Robot

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
        robot: One that has a :func:`~truearm.modeling.inverse.branches.branch_rule`.
        target: The tip of the poses that will be asked for; the flange if None.
    """

    def __init__(self, robot: Robot, target: str | None) -> None:
        from eaik.pybindings.EAIK import Robot as Arm  # a tenth of the size of the package, and no mesh libraries

        zero = np.zeros((1, 6))
        nominal, now = robot.rigid.trunk.forward_kinematics(zero.T), robot.rigid.forward_kinematics(zero, target)
        base, wrist = _end_frames(nominal)
        axes = joint_axes(nominal)
        directions = np.column_stack([base[:3, :3].T @ line.along[:, 0] for line in axes]).round(12)
        points = [base[:3, :3].T @ (point - base[:3, 3]) for point in (*(a.point[:, 0] for a in axes), wrist[:3, 3])]
        offsets = np.diff(np.array([np.zeros(3), *points]), axis=0).T
        self._arm: Any = Arm(directions, offsets, base[:3, :3].T @ wrist[:3, :3], [], True)
        self._from_world, last = (np.linalg.inv(frame) for frame in _end_frames(now))
        tip = np.eye(4)
        tip[:3, :3], tip[:3, 3] = now.matrix()[0], now.position[:, 0]
        self._behind = np.linalg.inv(last @ tip)

    @property
    def known(self) -> bool:
        """Whether the arm has a closed form."""
        return bool(self._arm.has_known_decomposition())

    def starts(self, position: Array, rotation: Array) -> Starts:
        """Return the solutions for poses of the tip in the world, ``(n, 3)`` [m] and ``(n, 3, 3)``."""
        poses = homogeneous(rotation, position)
        found = self._arm.calculate_IK_batched(list(self._from_world @ poses @ self._behind), _THREADS)
        joints = np.full((len(position), SLOTS, 6), np.nan)
        nearest = np.ones((len(position), SLOTS), dtype=bool)
        every = [solution.Q for solution in found]
        flags = [solution.is_LS for solution in found]
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
