"""Sphere tests: a ballbar's lengths beside those that a robot's models predict, before and after calibration."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.results.record import Record, notice_lines, notice_summaries
from truearm.shown import counted
from truearm.simulated import Marked
from truearm.validation.sphere_test import SphereTest
from truearm.writing import output_file, write_text


@dataclass(frozen=True, eq=False)
class OneSphere:
    """The test of one target about one ball."""

    target: str  #: At which the bar is attached.
    fixture: str  #: The fixed ball.
    lengths: Array  #: What the bar read [m], ``(n,)``.
    left_out: int  #: How many configurations have no length: there the bar was beyond its range.
    before: SphereTest | None  #: By the nominal robot; None for a robot that is not calibrated.
    after: SphereTest  #: By the robot.


@dataclass(frozen=True, eq=False, repr=False)
class SphereTests(Record):
    """Every sphere of a file of measurements."""

    robot: Robot  #: The robot that is judged.
    source: str  #: The measurements, for messages.
    spheres: tuple[OneSphere, ...]  #: One for each target and ball.
    #: Name of the configuration at which the robot was taught where the ball is; None where the centre that fits best
    #: was taken.
    taught: str | None
    command: str  #: How to run it again.
    warnings: tuple[Notice, ...] = ()  #: What speaks against the calibration of the robot.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it, in mm."""
        return {
            "centre": "found" if self.taught is None else "taught",
            "spheres": [
                {
                    "target": one.target,
                    "fixture": one.fixture,
                    "readings": len(one.lengths),
                    "left_out": one.left_out,
                    **({} if one.before is None else {"nominal_mm": _figures(one.before)}),
                    "robot_mm": _figures(one.after),
                }
                for one in self.spheres
            ],
            "warnings": notice_summaries(self.warnings),
        }

    def lines(self) -> list[str]:
        """Return what the command prints: mean, deviation and largest error of each sphere."""
        text = [
            "Measured less predicted distance from the centre that fits best:"
            if self.taught is None
            else f"Measured less predicted distance from the centre that was taught at configuration {self.taught}:"
        ]
        for one in self.spheres:
            lost = f", {one.left_out} beyond the range of the bar" if one.left_out else ""
            text.append(f"{one.target} about {one.fixture}, {counted(len(one.lengths), 'reading')}{lost}")
            if one.before is not None:
                text.append(f"  nominal     {_words(one.before)}")
            text.append(f"  {'calibrated' if one.before is not None else 'this robot'}  {_words(one.after)}")
        return [*text, *notice_lines(self.warnings)]

    def save(self, file: str | Path) -> Path:
        """Write a page with the errors of every reading; return the file."""
        from truearm.reporting.sphere_page import sphere_page

        page = output_file(file, self.inputs)
        write_text(page, sphere_page(self))
        return page


def _figures(test: SphereTest) -> dict[str, float]:
    return {"mean": test.mean * 1e3, "deviation": test.deviation * 1e3, "largest": test.largest * 1e3}


def _words(test: SphereTest) -> str:
    mean, deviation, largest = (value * 1e3 for value in (test.mean, test.deviation, test.largest))
    return f"mean {mean:.3f}  deviation {deviation:.3f}  largest {largest:.3f} mm"
