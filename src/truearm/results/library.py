"""What can be named: the robots of the library, and the instruments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from truearm.modeling.controller import AS_THE_MODEL
from truearm.modeling.formats.reach_entry import reach_summary
from truearm.modeling.robot import Robot
from truearm.results.record import Record


@dataclass(frozen=True, eq=False, repr=False)
class RobotList(Record):
    """The robots of the library."""

    robots: tuple[Robot, ...]  #: In the order of their ids.

    def summary(self) -> dict[str, Any]:
        """Return what is known of each, as JSON holds it."""
        rows = [
            {
                "id": robot.name,
                "maker": robot.maker or None,
                "title": robot.title,
                "joints": len(robot.joints),
                **reach_summary(robot.reach),
                "controller_known": robot.controller != AS_THE_MODEL,
                "source": robot.source,
            }
            for robot in self.robots
        ]
        return {"robots": rows}

    def lines(self) -> list[str]:
        """Return one line a robot, below what its columns are."""
        rows = [("id", "maker", "joints", "reach", "controller", "robot")]
        for robot in self.robots:
            reach = "-" if robot.reach is None else f"{robot.reach.distance * 1e3:.6g} mm"
            known = "-" if robot.controller == AS_THE_MODEL else "known"
            title = robot.title.removeprefix(robot.maker).strip()
            rows.append((robot.name, robot.maker or "-", str(len(robot.joints)), reach, known, title))
        widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
        return ["  ".join(f"{c:{w}}" for c, w in zip(row, widths, strict=True)).rstrip() for row in rows]
