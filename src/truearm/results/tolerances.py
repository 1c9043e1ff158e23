"""What joint errors use of their tolerances, and what tolerances may do at the flange."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from truearm.results.record import Record
from truearm.simulated import Marked
from truearm.validation.tolerances import FlangeError, Tolerance


@dataclass(frozen=True, eq=False, repr=False)
class UsedTolerances(Record):
    """What the errors of a robot's joints use of their tolerances."""

    robot: str  #: Its name.
    depths: tuple[float, ...]  #: Of the joints' holes [m].
    joints: tuple[Tolerance, ...]  #: What each joint uses.
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it, in mm and deg."""
        rows = [
            {
                "joint": number,
                "depth_mm": depth * 1e3,
                "lean_mm": used.delta * 1e3,
                "towards_deg": math.degrees(used.towards),
                "position_mm": [v * 1e3 for v in used.position],
            }
            for number, (depth, used) in enumerate(zip(self.depths, self.joints, strict=True), 1)
        ]
        return {"robot": self.robot, "joints": rows}

    def lines(self) -> list[str]:
        """Return what the command prints."""
        text = ["joint  depth [mm]  lean [mm]  towards [deg]  position x, y, z [mm]"]
        for row in self.summary()["joints"]:
            place = ", ".join(f"{v:.4f}" for v in row["position_mm"])
            figures = f"{row['depth_mm']:<11.1f} {row['lean_mm']:<10.4f} {row['towards_deg']:<14.1f}"
            text.append(f"{row['joint']:<6} {figures} {place}")
        return text


@dataclass(frozen=True, eq=False, repr=False)
class AllowedErrors(Record):
    """The largest error of the flange's position that tolerances allow."""

    robot: str  #: Its name.
    configurations: int  #: How many were looked at.
    angles: tuple[float, ...]  #: Largest angle of each joint's axis [rad].
    errors: FlangeError  #: What the tolerances may do at the flange [m].
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it, in mm and deg."""
        leaning, place = self.errors.leaning.tolist(), self.errors.position.tolist()
        worst, root = self.errors.together
        return {
            "robot": self.robot,
            "configurations": self.configurations,
            "joints": [
                {"joint": i, "angle_deg": math.degrees(t), "by_lean_mm": a * 1e3, "by_position_mm": b * 1e3}
                for i, (t, a, b) in enumerate(zip(self.angles, leaning, place, strict=True), 1)
            ],
            "together": {"worst_mm": worst * 1e3, "root_of_squares_mm": root * 1e3},
        }

    def lines(self) -> list[str]:
        """Return what the command prints."""
        said = self.summary()
        text = [f"Largest error of the flange's position over {self.configurations} configurations:"]
        text += [
            f"  joint {e['joint']}: {e['by_lean_mm']:.4f} mm by leaning {e['angle_deg']:.4f} deg,"
            f" {e['by_position_mm']:.4f} mm by place"
            for e in said["joints"]
        ]
        worst, root = said["together"].values()
        return [*text, f"  all at their worst {worst:.3f} mm, root of the sum of squares {root:.3f} mm"]
