"""The measuring program of a plan: its texts, and what to know of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from truearm.compensation.plan_program import Driving, shown_speed
from truearm.compensation.programs.motion_program import Carried, number
from truearm.notices import Notice
from truearm.planning.driving.tour import Tour
from truearm.results.record import notice_lines, notice_summaries
from truearm.shown import counted

#: What is written beside a program: the plan as CSV, its page, all stops, and what the operator takes along.
TABLE: Final = "plan.csv"
PLAN_PAGE: Final = "plan.html"
WAYS: Final = "plan-ways.csv"
SHEET: Final = "sheet.html"
#: Characters of a plan's hash by which program and sheet name it.
MARK: Final = 12
#: What the robot waits for, in words.
_WAITS: Final = {
    "time": "",
    "input": ", then for input {} up to {} s",
    "operator": ", then until the operator starts it again",
}
#: Where languages have the load that do not set it themselves.
_BY_HAND: Final = {"FANUC LS": "Payload schedule 1", "INFORM": "Tool file 0", "VAL3": "The tool flange"}


@dataclass(frozen=True, eq=False)
class PlanProgram:
    """A program that drives a plan."""

    language: str  #: Its name.
    files: Mapping[str, str]  #: Texts by their names in the folder of the plan.
    tour: Tour  #: What it drives.
    driving: Driving  #: How fast, and for what it waits.
    carried: Carried  #: What it tells the controller of the tool.
    fastest: float  #: Highest speed of a target or the flange [m/s].
    mark: str = ""  #: The first digits of the plan's hash, by which program and sheet name it.
    warnings: tuple[Notice, ...] = ()  #: What to know about it.
    speeds: str = ""  #: How fast the joints go at 100 %, in words; empty where it is not known.

    @property
    def answer(self) -> tuple[str, ...]:
        """What it does, in words."""
        driving = self.driving
        approached = any(stop.kind == "approach" for stop in self.tour.stops)
        waits = _WAITS[driving.wait].format(driving.input, number(driving.longest, 2))
        way = [f"{counted(len(self.tour.measured), 'configuration')} from Home and back"]
        way += ["each approached from one side"] if approached else []
        return (
            f"Measuring program in {self.language}: {', '.join(way)}.",
            f"At most {shown_speed(self.fastest)} mm/s and {number(100 * driving.share, 2)} % of the joints' "
            f"speed{f' ({self.speeds})' if self.speeds else ''}; it stands for {number(driving.dwell, 2)} s{waits}.",
            self._told,
            "It is not verified and no safety function: run it step by step first, at reduced speed, nobody near.",
        )

    @property
    def _told(self) -> str:
        """What the controller is told of the tool, or has to be told by hand."""
        carried = self.carried
        load = f"{number(carried.mass, 3)} kg at ({', '.join(carried.cog_mm)}) mm"
        if self.language in _BY_HAND:
            return f"{_BY_HAND[self.language]} on the controller must hold {load}: programs do not set it."
        tip = f"target {carried.name}" if carried.name else "the flange"
        return f"It tells the controller of {tip} at ({', '.join(carried.tip_mm)}) mm and of {load}."

    def lines(self) -> list[str]:
        """Return what it does, and what to know about it."""
        return [*self.answer, *notice_lines(self.warnings)]

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        driving, carried = self.driving, self.carried
        return {
            "language": self.language,
            "files": list(self.files),
            "order": [stop.label for stop in self.tour.measured],
            "approached": any(stop.kind == "approach" for stop in self.tour.stops),
            "speed_mm_s": 1e3 * self.fastest,
            "joint_speed_percent": 100.0 * driving.share,
            "joint_speeds": self.speeds or None,
            "dwell_s": driving.dwell,
            "wait": driving.words,
            "tip": carried.name or None,
            "tip_mm": [1e3 * v for v in carried.tip],
            "load_kg": carried.mass,
            "load_cog_mm": [1e3 * v for v in carried.cog],
            "warnings": notice_summaries(self.warnings),
        }
