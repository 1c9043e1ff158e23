"""A robot with the kinematics that its controller computes with."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.results.record import Record, notice_lines, notice_summaries

#: Joint zeros that are so many times smaller speak for another type: of published files they are 8 times and more, or
#: less than twice.
_CLEARLY: Final = 5.0


@dataclass(frozen=True, eq=False, repr=False)
class ImportedKinematics(Record):
    """A robot with the kinematics that its controller computes with."""

    robot: Robot  #: Its values are the controller's, its nominal values the type's.
    type: Robot  #: The type of arm, as its maker publishes it.
    distance: float  #: How far the flange is from the type's on average, at random joint positions [m].
    #: Other types of the library that the file fits as well, with the largest joint zero that it has of them [rad].
    fitting: Mapping[str, float] = field(default_factory=dict)
    file: Path | None = None  #: The robot file; None if none was written.

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know about it: types that cannot be told apart by the file."""
        if not self.fitting:
            return ()
        best, zero = min(self.fitting.items(), key=lambda one: one[1])
        ours = largest_zero(self.robot)
        if zero < ours / _CLEARLY:
            return (
                Notice(
                    "type-doubtful",
                    f"The file is rather of an arm of type {best}. The factory's joint zeros are nearly nothing, and "
                    f"they are up to {math.degrees(zero):.2g} deg for {best} and {math.degrees(ours):.2g} deg for "
                    f"{self.type.name}. Read the type on the arm.",
                ),
            )
        return (
            Notice(
                "type-not-told",
                f"The file fits {' and '.join(self.fitting)} as well as {self.type.name}: it has differences to a "
                "table that it does not name. Read the type on the arm; with the wrong one lengths are off by what "
                "the data sheets differ.",
                "note",
            ),
        )

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "file": None if self.file is None else str(self.file),
            "robot": self.robot.name,
            "identity": dict(self.robot.controller.kinematics.identity),
            "mean_distance_from_type_mm": self.distance * 1e3,
            "warnings": notice_summaries(self.warnings),
        }

    def lines(self) -> list[str]:
        """Return what was read."""
        text = (
            f"{self.robot.name} with the kinematics of its controller, flange {self.distance * 1e3:.2f} mm from the "
            "type's on average"
        )
        identity = self.robot.controller.kinematics.identity
        return [
            text if self.file is None else f"{self.file}: {text}",
            *(f"  {name}: {value}" for name, value in identity.items()),
            *notice_lines(self.warnings),
        ]


def largest_zero(robot: Robot) -> float:
    """Return the largest joint zero of a robot [rad]."""
    return max(abs(parameter.value) for parameter in robot.parameters.values() if parameter.group == "joint zero")
