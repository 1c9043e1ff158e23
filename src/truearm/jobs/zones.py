"""Calibrations by zones: what is accepted, how zones are judged, and robots that are read from such a calibration."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from truearm.errors import InputError, refusals_of
from truearm.files import path_argument
from truearm.identification.choosing.zone_boxes import (
    FEWEST,
    MOST,
    Box,
    boxes_of,
    cut_boxes,
    divisions_for,
    flange_places,
    read_zones,
)
from truearm.identification.choosing.zones import judge_zones, zoned_mean
from truearm.identification.solving.bounds import Bounds
from truearm.identification.solving.fit import Fit
from truearm.identification.solving.losses import Loss
from truearm.identification.solving.rounds import Redundant
from truearm.jobs.arguments import whole_argument
from truearm.measurement.dataset import Dataset
from truearm.modeling.robot import Robot
from truearm.results.zones import ZONES_FILE, ZoneChoice, robot_file_of

#: How far a zone that is cut takes in configurations beyond its sides [m].
_OVERLAP: Final = 0.05


def zones_argument(value: object, *, held_out: bool) -> int | tuple[tuple[Box, ...], float] | None:
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
    wanted: int | tuple[tuple[Box, ...], float],
    nominal: Robot,
    whole: Fit,
    parts: tuple[Dataset, Dataset],
    *,
    loss: Loss,
    redundancy: Redundant,
    bounds: Bounds | None,
) -> ZoneChoice:
    """Identify and judge zones, see :func:`truearm.identification.choosing.zones.judge_zones`."""
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
