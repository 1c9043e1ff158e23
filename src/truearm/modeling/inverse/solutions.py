"""What inverse kinematics answers: joint positions for poses, and how far each answer can be trusted."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array
from truearm.shown import as_html, counted, short_text

#: Poses explained one by one where a person looks at the solutions.
_EXPLAINED: Final = 5


class PoseStatus(Enum):
    """How the search for a pose ended; the value is the word in files, `advice` what to do."""

    REACHED = "reached"
    NEAR_SINGULAR = "near-singular"
    BEYOND_LIMIT = "beyond-limit"
    BRANCH_LOST = "branch-lost"
    UNREACHABLE = "unreachable"

    @property
    def usable(self) -> bool:
        """Whether the robot can go there with these joints."""
        return self in (PoseStatus.REACHED, PoseStatus.NEAR_SINGULAR)

    @property
    def advice(self) -> str:
        """What it means and what to do about it."""
        return {
            PoseStatus.REACHED: "The joints give the pose.",
            PoseStatus.NEAR_SINGULAR: "The joints give the pose, but near a singular posture, where a small change "
            "of the pose takes a large motion of the joints: go there by joint motion, or move the pose.",
            PoseStatus.BEYOND_LIMIT: "The joints give the pose, but a joint is beyond its limits: take another branch, "
            "or move the pose.",
            PoseStatus.BRANCH_LOST: "The pose is reached on another branch, whose joints are given, and not on the one "
            "asked for: take that one, or move the pose.",
            PoseStatus.UNREACHABLE: "No joints give the pose; the joints given are the nearest that were found: move "
            "the pose, and check its frame, its units and the target.",
        }[self]


@dataclass(frozen=True, eq=False, repr=False)
class JointSolutions:
    """Joint positions for poses, one row a pose, or one a pose and branch where all branches were asked for."""

    poses: int  #: How many poses were asked for.
    pose: NDArray[np.intp]  #: Index of each row's pose, ascending, ``(rows,)``. Every pose has at least one row.
    joints: Array  #: Joint positions [rad or m], ``(rows, joints)``.
    status: tuple[PoseStatus, ...]  #: How each search ended.
    branch: tuple[str, ...]  #: Name of the branch of each row; empty where the robot's branches have no names.
    position_error: Array  #: Distance from the pose asked for [m], ``(rows,)``.
    #: Angle from it [rad], ``(rows,)``; between the z axes where only those count, NaN where no orientation does.
    orientation_error: Array
    beyond: NDArray[np.bool_]  #: Which joint positions are beyond their limits, ``(rows, joints)``.
    #: How little the pose moves with a joint motion of norm 1, positions in reach lengths, ``(rows,)``. It is 0 in a
    #: singular posture.
    singular_value: Array
    joint_names: tuple[str, ...]  #: As the robot has them.

    def __repr__(self) -> str:
        counts = Counter(status.value for status in self.status)
        usable = len(set(self.pose[self.usable].tolist()))
        of_each = ", ".join(f"{count} {status}" for status, count in counts.items())
        lines = [f"{usable} of {counted(self.poses, 'pose')} can be reached ({of_each or 'none'})"]
        rows = np.flatnonzero(~self.usable)
        lines += [f"pose {self.pose[row]}: {self.advice(row)}" for row in rows[:_EXPLAINED]]
        lines += [f"and {len(rows) - _EXPLAINED} more"] if len(rows) > _EXPLAINED else []
        return short_text(lines)

    def _repr_html_(self) -> str:
        return as_html(repr(self))

    def without_unreached(self) -> JointSolutions:
        """Return the solutions with NaN for the joints of poses that are out of reach."""
        out = self.rows(PoseStatus.UNREACHABLE)
        joints = self.joints.copy()
        joints[out] = np.nan
        return replace(self, joints=joints)

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Which rows the robot can go to, ``(rows,)``."""
        return np.array([status.usable for status in self.status], dtype=bool)

    @property
    def complete(self) -> bool:
        """Whether every pose has a row the robot can go to."""
        return len(set(self.pose[self.usable].tolist())) == self.poses

    def rows(self, *wanted: PoseStatus) -> NDArray[np.intp]:
        """Return the rows that have one of these statuses."""
        return np.flatnonzero([status in wanted for status in self.status])

    def advice(self, row: int) -> str:
        """Say of one row what it means and what to do about it, with its figures."""
        status = self.status[row]
        if status is PoseStatus.UNREACHABLE:
            angle = self.orientation_error[row]
            turn = "" if math.isnan(angle) else f" and {math.degrees(angle):.4g} deg"
            missing = f"{self.position_error[row] * 1e3:.4g} mm{turn} are missing."
            if not np.isfinite(self.joints[row]).all():  # only answers that can be sent are given
                return f"{missing} No joints give the pose: move it, and check its frame, its units and the target."
            return f"{missing} {status.advice}"
        if status is PoseStatus.BEYOND_LIMIT:
            names = [name for name, beyond in zip(self.joint_names, self.beyond[row], strict=True) if beyond]
            return f"Beyond its limits: {', '.join(names)}. {status.advice}"
        if status is PoseStatus.BRANCH_LOST:
            return f"Reached on {self.branch[row]}. {status.advice}"
        return status.advice
