"""Models for zones of the workspace: which were kept, as JSON, lines and files show it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from truearm.identification.choosing.zone_boxes import SCHEMA, Box, shown_box
from truearm.identification.choosing.zones import ZoneVerdict
from truearm.modeling.formats.robot_file import robot_text
from truearm.modeling.robot import Robot
from truearm.shown import counted, millimetres

#: The file that names the zones and their robots.
ZONES_FILE: Final = "zones.yaml"


def robot_file_of(name: str) -> str:
    """Return the file of the robot of a zone."""
    return f"zone-{name}.yaml"


@dataclass(frozen=True, eq=False)
class ZoneChoice:
    """What became of the zones that were tried."""

    verdicts: tuple[ZoneVerdict, ...]  #: One for each.
    overlap: float  #: How far beyond its box a zone took training configurations [m].
    whole: float  #: whole, zoned: mean held-out error with the model of the whole alone, and with the kept zones [m].
    zoned: float

    @property
    def kept(self) -> tuple[ZoneVerdict, ...]:
        """The zones that stay."""
        return tuple(verdict for verdict in self.verdicts if verdict.kept)

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it, in mm."""
        return {
            "kept": [verdict.box.name for verdict in self.kept],
            "overlap_mm": self.overlap * 1e3,
            "whole_mm": self.whole * 1e3,
            "with_kept_zones_mm": self.zoned * 1e3,
            "zones": [
                {
                    "name": verdict.box.name,
                    "box_mm": shown_box(verdict.box),
                    "training": verdict.training,
                    "held_out": verdict.held_out,
                    "whole_mm": None if verdict.whole is None else verdict.whole * 1e3,
                    "zone_mm": None if verdict.zone is None else verdict.zone * 1e3,
                    "standard_error_mm": None if verdict.error is None else verdict.error * 1e3,
                    "kept": verdict.kept,
                    "why": verdict.why,
                }
                for verdict in self.verdicts
            ],
        }

    def lines(self) -> list[str]:
        """Return which zones are kept, and why the others are not."""
        count = counted(len(self.verdicts), "zone")
        if not self.kept:
            text = [f"Zones: none of {count} is kept; one model is as good on held-out readings."]
        else:
            text = [
                f"Zones: {len(self.kept)} of {len(self.verdicts)} kept; mean held-out error {self.zoned * 1e3:.3f} mm "
                f"with them, {self.whole * 1e3:.3f} mm with one model (the held-out part has chosen them: validate "
                "with new data)."
            ]
        for verdict in self.verdicts:
            text.append(f"  zone {verdict.box.name}: {_words(verdict)}")
        return text


def _words(verdict: ZoneVerdict) -> str:
    kept = "kept" if verdict.kept else "not kept"
    if verdict.whole is None or verdict.zone is None or verdict.error is None:
        return f"{kept}, {verdict.why}"
    return (
        f"{kept}, {millimetres(verdict.zone)} instead of {millimetres(verdict.whole)} mm on "
        f"{counted(verdict.held_out, 'held-out configuration')} (difference good to {millimetres(verdict.error)} mm), "
        f"{verdict.why}"
    )


def zone_files(choice: ZoneChoice | None, whole: Robot, robot_of: Callable[[ZoneVerdict], Robot]) -> dict[str, str]:
    """Return the files of the zones that are kept, by name: the robots, and the file that names them.

    Args:
        whole: The robot of the whole workspace, in calibrated.yaml.
        robot_of: Returns the sealed robot of a zone.
    """
    if choice is None or not choice.kept:
        return {}
    robots = {verdict.box.name: robot_of(verdict) for verdict in choice.kept}
    files = {robot_file_of(name): robot_text(robot) for name, robot in robots.items()}
    boxes = [(verdict.box, robots[verdict.box.name]) for verdict in choice.kept]
    return {ZONES_FILE: _zones_text(choice, whole, boxes), **files}


def _zones_text(choice: ZoneChoice, whole: Robot, zones: Sequence[tuple[Box, Robot]]) -> str:
    """Return the text of the file that names the zones; YAML whose values are written as JSON."""
    lines = [
        f"truearm: {SCHEMA}",
        "units: {length: mm}",
        f"overlap: {choice.overlap * 1e3:g}",
        f"whole: {{file: calibrated.yaml, proof: {_digest(whole)}}}",
        "zones:",
    ]
    for box, robot in zones:
        lines.append(f"  {json.dumps(box.name)}:")
        lines += [f"    {axis}: {json.dumps(span)}" for axis, span in shown_box(box).items()]
        lines.append(f"    robot: {{file: {json.dumps(robot_file_of(box.name))}, proof: {_digest(robot)}}}")
    return "\n".join(lines) + "\n"


def _digest(robot: Robot) -> str:
    return "" if robot.proof is None else robot.proof.digest
