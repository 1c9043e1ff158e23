"""Joints for poses, and which poses the robot cannot or should not just go to."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any, Final

from truearm.modeling.chain import Array
from truearm.modeling.controller import JointsOf
from truearm.modeling.inverse.solutions import JointSolutions, PoseStatus
from truearm.notices import Notice
from truearm.results.record import Record, joints_lines, notice_lines, notice_summaries
from truearm.simulated import Marked

#: Poses explained one by one where a person reads.
_EXPLAINED: Final = 10


@dataclass(frozen=True, eq=False, repr=False)
class JointTable(Record):
    """Joints for poses."""

    labels: tuple[str, ...]  #: Name of each pose.
    solutions: JointSolutions  #: What was found, one row a pose, or one a pose and branch.
    warnings: tuple[Notice, ...] = ()  #: What speaks against the calibration of the robot.
    #: Whose joint positions the file holds: the ``model``'s, or those that the ``controller`` shows.
    joints_are: JointsOf = "model"
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    @property
    def joints(self) -> Array:
        """Joint positions of each row, of the model [rad; m for prismatic joints], ``(rows, joints)``."""
        return self.solutions.joints

    @property
    def status(self) -> tuple[PoseStatus, ...]:
        """How the search for each row ended."""
        return self.solutions.status

    @property
    def complete(self) -> bool:
        """Whether the robot can go to every pose."""
        return self.solutions.complete

    @property
    def attention(self) -> tuple[dict[str, str], ...]:
        """Every pose that the robot cannot or should not just go to: its name, branch and status, and what to do."""
        found = self.solutions
        reached = set(found.pose[found.usable].tolist())
        return tuple(
            {
                "pose": self.labels[pose],
                "branch": found.branch[row],
                "status": status.value,
                "advice": found.advice(row),
            }
            for row, (pose, status) in enumerate(zip(found.pose.tolist(), found.status, strict=True))
            if status.value != "reached" and (status.usable or pose not in reached)
        )

    def summary(self) -> dict[str, Any]:
        """Return counts by status, and what needs attention, as JSON holds them."""
        found = self.solutions
        return {
            "poses": found.poses,
            "poses_reached": len(set(found.pose[found.usable].tolist())),
            "rows": len(found.status),
            "joints_are": self.joints_are,
            "status": dict(Counter(status.value for status in found.status)),
            "attention": list(self.attention),
            "warnings": notice_summaries(self.warnings),
        }

    def lines(self) -> list[str]:
        """Return how many poses are reached, and what is wrong with the others."""
        summary = self.summary()
        counts = ", ".join(f"{count} {status}" for status, count in summary["status"].items())
        text = [f"{summary['poses_reached']} of {summary['poses']} poses reached. Rows: {counts}"]
        for entry in self.attention[:_EXPLAINED]:
            name = f"{entry['pose']} ({entry['branch']})" if entry["branch"] else entry["pose"]
            text.append(f"  {name}: {entry['status']}. {entry['advice']}")
        if len(self.attention) > _EXPLAINED:
            text.append(f"  and {len(self.attention) - _EXPLAINED} more; the JSON summary lists all")
        return text + joints_lines(self.joints_are) + notice_lines(self.warnings)
