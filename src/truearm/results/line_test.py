"""A line test: the poses, the joint positions that reach them, and the errors found there."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from truearm.modeling.chain import Array
from truearm.modeling.controller import JointsOf
from truearm.modeling.formats.joint_columns import counting, joint_cells, joint_headings
from truearm.modeling.robot import Robot
from truearm.planning.poses.seven_lines import DIRECTIONS, SevenLines
from truearm.results.record import Record
from truearm.simulated import Marked
from truearm.validation.line_test import LineErrors, reduction
from truearm.writing import output_file, write_text


@dataclass(frozen=True, eq=False, repr=False)
class LineTest(Record):
    """A line test of a robot."""

    robot: Robot  #: The nominal robot.
    poses: SevenLines  #: The poses, line after line.
    joints: Array  #: Joint positions to command, of the model, ``(7 k, joints)`` [rad or m].
    compensated: bool  #: Whether `joints` are compensated for joint errors.
    before: LineErrors | None  #: Errors without compensation; None where nothing was measured and no truth was named.
    after: LineErrors | None  #: Errors with compensation; None where it was not tried.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    #: Whose joint positions the file holds: the ``model``'s, or those that the ``controller`` shows.
    joints_are: JointsOf = "model"
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it, in mm."""
        return {"poses": len(self.poses.labels), "lines": self._errors()}

    def lines(self) -> list[str]:
        """Return what the command prints: one line of text for each line of poses."""
        text = []
        for row in self._errors():
            before = row["before_mm"]
            words = f"{row['direction']:<4} mean {before['mean']:.3f}  max {before['max']:.3f} mm"
            if "after_mm" in row:
                after = row["after_mm"]
                words += (
                    f"   compensated mean {after['mean']:.3f}  max {after['max']:.3f} mm"
                    f"   max reduced by {row['reduction_percent']:.1f} %"
                )
            text.append(words)
        return text or [f"The robot can go to all {len(self.poses.labels)} poses."]

    def csv_text(self) -> str:
        """Return the plan as CSV: one configuration a pose, joint positions in deg, those of sliding joints in mm."""
        joints, controller = self.robot.joints, counting(self.robot, self.joints_are)
        heading = ["configuration", *joint_headings(joints, controller)]
        cells = joint_cells(self.joints, joints, controller)
        rows = [[label, *row] for label, row in zip(self.poses.labels, cells, strict=True)]
        return "\n".join(",".join(row) for row in [heading, *rows]) + "\n"

    def save(self, file: str | Path) -> None:
        """Write the plan as a CSV file."""
        write_text(output_file(file, self.inputs), self.csv_text())

    def _errors(self) -> list[dict[str, Any]]:
        if self.before is None:
            return []
        rows = []
        for direction in DIRECTIONS:
            row: dict[str, Any] = {"direction": direction, "before_mm": _shown(self.before, direction)}
            if self.after is not None:
                row["after_mm"] = _shown(self.after, direction)
                row["reduction_percent"] = reduction(self.before, self.after, direction)
            rows.append(row)
        return rows


def _shown(errors: LineErrors, direction: str) -> dict[str, float]:
    return {"mean": errors.mean(direction) * 1e3, "max": errors.largest(direction) * 1e3}
