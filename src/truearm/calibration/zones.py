"""Calibrations by zones: what is accepted, how zones are judged, and robots that are read from such a calibration."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from truearm.engine.base.errors import InputError, counted, millimetres, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.choosing.zones import (
    FEWEST,
    MOST,
    SCHEMA,
    Box,
    ZoneVerdict,
    boxes_of,
    cut_boxes,
    divisions_for,
    flange_places,
    judge_zones,
    read_zones,
    shown_box,
    zoned_mean,
)
from truearm.engine.command.arguments import whole_argument
from truearm.engine.data.dataset import Dataset
from truearm.engine.document.document import Block, detail, each, say
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.fit import Fit
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.rounds import Redundant
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.writing import robot_text

#: How many zones are to be cut, or boxes with their overlap [m].
WantedZones = int | tuple[tuple[Box, ...], float]
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

    def blocks(self) -> Iterator[Block]:
        """Give which zones are kept, and why the others are not, in mm."""
        text = (
            f"Zones: none of {counted(len(self.verdicts), 'zone')} is kept; one model is as good on held-out readings."
        )
        if self.kept:
            text = (
                f"Zones: {len(self.kept)} of {len(self.verdicts)} kept; mean held-out error {self.zoned * 1e3:.3f} mm "
                f"with them, {self.whole * 1e3:.3f} mm with one model (the held-out part has chosen them: validate "
                "with new data)."
            )
        yield say(
            text,
            kept=[verdict.box.name for verdict in self.kept],
            overlap_mm=self.overlap * 1e3,
            whole_mm=self.whole * 1e3,
            with_kept_zones_mm=self.zoned * 1e3,
        )
        yield each("zones", ([_verdict_block(verdict)] for verdict in self.verdicts))


def _verdict_block(verdict: ZoneVerdict) -> Block:
    return detail(
        f"  zone {verdict.box.name}: {_words(verdict)}",
        name=verdict.box.name,
        box_mm=shown_box(verdict.box),
        training=verdict.training,
        held_out=verdict.held_out,
        whole_mm=None if verdict.whole is None else verdict.whole * 1e3,
        zone_mm=None if verdict.zone is None else verdict.zone * 1e3,
        standard_error_mm=None if verdict.error is None else verdict.error * 1e3,
        kept=verdict.kept,
        why=verdict.why,
    )


def _words(verdict: ZoneVerdict) -> str:
    state = "kept" if verdict.kept else "not kept"
    if verdict.whole is None or verdict.zone is None or verdict.error is None:
        return f"{state}, {verdict.why}"
    return (
        f"{state}, {millimetres(verdict.zone)} instead of {millimetres(verdict.whole)} mm on "
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


#: How far a zone that is cut takes in configurations beyond its sides [m].
_OVERLAP: Final = 0.05


def zones_argument(value: object, *, held_out: bool) -> WantedZones | None:
    """Return how many zones are to be cut, or the boxes of a file with their overlap [m]; None for None.

    Args:
        held_out: Whether anything is held out to judge zones by.
    """
    if value is None:
        return None
    if not held_out:
        raise InputError(
            "zones are judged on held-out configurations, and nothing is held out",
            parameter="zones",
            came="`train=all`",
            cure="Leave `train` out, or `zones`.",
        )
    if isinstance(value, str | Path):
        with refusals_of("zones"):
            return boxes_of(read_zones(path_argument(value, "zones")), str(value))
    return whole_argument(value, "zones", FEWEST, MOST)


def zone_file_names(wanted: int | tuple[tuple[Box, ...], float] | None) -> tuple[str, ...]:
    """Return the names of the files that zones may add to those of a calibration."""
    if wanted is None:
        return ()
    names = [str(n) for n in range(1, wanted + 1)] if isinstance(wanted, int) else [box.name for box in wanted[0]]
    return (ZONES_FILE, *map(robot_file_of, names))


def choose_zones(
    wanted: WantedZones,
    nominal: Robot,
    whole: Fit,
    parts: tuple[Dataset, Dataset],
    *,
    loss: Loss,
    redundancy: Redundant,
    bounds: Bounds | None,
) -> ZoneChoice:
    """Identify and judge zones, see :func:`truearm.engine.choosing.zones.judge_zones`."""
    training, held_out = parts
    if not training.anchored:
        raise InputError(
            "zones need readings that say where the robot stands",
            parameter="zones",
            where=training.source,
            came="readings against fixtures alone",
            cure="Measure positions in one frame, or use one model for the whole workspace.",
        )
    places = flange_places(nominal, training.postures), flange_places(nominal, held_out.postures)
    if isinstance(wanted, int):
        wanted = cut_boxes(places[0], divisions_for(places[0], wanted)), _OVERLAP
    boxes, overlap = wanted
    verdicts = judge_zones(whole, boxes, overlap, parts, places, loss=loss, redundancy=redundancy, bounds=bounds)
    return ZoneChoice(verdicts, overlap, *zoned_mean(whole, verdicts, held_out, places[1]))
