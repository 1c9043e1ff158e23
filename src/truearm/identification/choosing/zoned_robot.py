"""Robots that are read from a calibration by zones."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from truearm.errors import InputError, refusals_of
from truearm.identification.choosing.zone_boxes import Box, WrittenRobot, boxes_of, flange_places, read_zones
from truearm.identification.choosing.zones import error_sizes
from truearm.library import is_zones, load_robot
from truearm.measurement.dataset import Dataset, IntArray
from truearm.measurement.statistics import Errors, errors_of
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot


@dataclass(frozen=True, eq=False)
class ZonedRobot:
    """A robot with other models in zones, as a calibration wrote it."""

    whole: Robot  #: The robot elsewhere, which says where the nominal flange is.
    file: Path  #: Of it.
    zones: tuple[tuple[Box, Robot], ...]  #: Boxes with their robots.

    def configurations(self, postures: Array | Postures) -> list[IntArray]:
        """Return the indices of the configurations in each zone."""
        places = flange_places(self.whole, postures)
        return [np.flatnonzero(box.holds(places)) for box, _ in self.zones]

    def errors(self, whole: Robot, data: Dataset) -> Errors:
        """Return errors on data, each configuration by the robot of its zone.

        Args:
            whole: The robot elsewhere, with what it carried.
        """
        found = errors_of(whole, data)
        position = found.position_errors.copy()
        orientation = None if found.orientation_errors is None else found.orientation_errors.copy()
        length = None if found.length_errors is None else found.length_errors.copy()
        for mine, (_, robot) in zip(self.configurations(data.postures), self.zones, strict=True):
            if not len(mine):
                continue
            carrying = robot.with_payload(whole.payload, whole.gravity).with_wrench(whole.wrench)
            part = errors_of(carrying, data.of_configurations(mine))
            readings = np.isin(data.configuration, mine)
            position[readings] = part.position_errors
            if orientation is not None and part.orientation_errors is not None:
                orientation[readings] = part.orientation_errors
            if length is not None and part.length_errors is not None:
                length[readings] = part.length_errors
        return Errors(found.configurations, position, orientation, length)

    def means(self, data: Dataset, errors: Errors) -> dict[str, tuple[int, float]]:
        """Return for each zone, and for elsewhere, how many configurations lie in it and their mean error [m]."""
        sizes, made = error_sizes(errors), {}
        inside = self.configurations(data.postures)
        elsewhere = np.setdiff1d(np.arange(data.configurations), np.concatenate([*inside, np.zeros(0, np.intp)]))
        for name, mine in zip([*(box.name for box, _ in self.zones), ""], [*inside, elsewhere], strict=True):
            read = np.isin(data.configuration, mine) & np.isfinite(sizes)
            if read.any():
                made[name] = len(mine), float(sizes[read].mean())
        return made


def zoned_robot(robot: object) -> ZonedRobot | None:
    """Return the robot of a file of zones that a calibration wrote; None for any other robot.

    Raises:
        InputError: For a file that only says where zones are, or robots of another calibration.
    """
    if not isinstance(robot, str | Path) or not is_zones(robot):
        return None
    path = Path(robot)
    with refusals_of("robot"):
        content = read_zones(path)
        boxes, _ = boxes_of(content, str(path))
        entries = [content.zones[box.name].robot for box in boxes]
        if content.whole is None or any(entry is None for entry in entries):
            raise InputError(
                "this file says where zones are, and not which robot is in each",
                where=str(path),
                cure="Give the zones.yaml that 'truearm calibrate' wrote.",
            )
        zones = [(box, _written(path, entry)) for box, entry in zip(boxes, entries, strict=True) if entry is not None]
        return ZonedRobot(_written(path, content.whole), path.with_name(content.whole.file), tuple(zones))


def _written(path: Path, entry: WrittenRobot) -> Robot:
    """Return a robot that a file of zones names, or refuse one that is of another calibration."""
    file = path.with_name(entry.file)
    robot = load_robot(file)
    if robot.proof is None or robot.proof.digest != entry.proof:
        raise InputError(
            "this robot is of another calibration than the zones",
            where=str(file),
            cure=f"Run the calibration again, or give the robot itself instead of {path.name}.",
        )
    return robot
