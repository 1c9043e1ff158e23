"""Where zones of the workspace are: boxes that are named in a file, or cut so that all hold about as much."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import combinations, product
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, StringConstraints

from truearm.errors import InputError
from truearm.files import read_yaml
from truearm.modeling.chain import Array
from truearm.modeling.formats.entries import STRICT, Name, NotNegative, Number
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot
from truearm.modeling.transform import IDENTITY
from truearm.units import sized_si

#: What a file of zones begins with.
SCHEMA: Final = "truearm-zones/1"
#: Zones that can be asked for.
FEWEST: Final = 2
MOST: Final = 64
#: Share of the places that may lie outside of the extent along an axis.
_OUTSIDE: Final = 0.05
_SHA256: Final = "^[0-9a-f]{64}$"


@dataclass(frozen=True, eq=False)
class Box:
    """A box of the workspace."""

    name: str  #: Of the zone.
    low: Array  #: low, high: its corners in the base frame [m], ``(3,)``; infinite where nothing lies beyond.
    high: Array

    def holds(self, places: Array, overlap: float = 0.0) -> NDArray[np.bool_]:
        """Return which places in the base frame ``(n, 3)`` lie in it; the lower sides belong to it.

        Args:
            overlap: How far beyond its sides it reaches [m].
        """
        return np.asarray(((places >= self.low - overlap) & (places < self.high + overlap)).all(axis=1))


class _Units(BaseModel):
    model_config = STRICT
    length: Literal["mm", "m", "um", "in"]


class WrittenRobot(BaseModel):
    """A robot of a calibration by zones: its file, and the hash of its proof."""

    model_config = STRICT
    file: Annotated[str, StringConstraints(strict=True, pattern=r"^[^/\\]+\.yaml$")]
    proof: Annotated[str, StringConstraints(strict=True, pattern=_SHA256)]


_Span = tuple[Number | None, Number | None]


class ZoneEntry(BaseModel):
    """A zone: where the nominal flange is, along the axes of the base; null, or an axis left out, is no limit."""

    model_config = STRICT
    x: _Span | None = None
    y: _Span | None = None
    z: _Span | None = None
    robot: WrittenRobot | None = None


class ZonesFile(BaseModel):
    """Schema ``truearm-zones/1``: zones to try, or those that a calibration kept, with their robots."""

    model_config = STRICT
    truearm: Literal["truearm-zones/1"]
    units: _Units
    overlap: NotNegative = 0.0
    whole: WrittenRobot | None = None
    zones: Annotated[dict[Name, ZoneEntry], Field(min_length=1, max_length=MOST)]


def read_zones(path: Path) -> ZonesFile:
    """Read a file of zones."""
    return read_yaml(path, ZonesFile)


def boxes_of(content: ZonesFile, where: str) -> tuple[tuple[Box, ...], float]:
    """Return the boxes of a file, and how far each takes in configurations beyond its sides [m].

    Raises:
        InputError: For a zone without extent, one without limits, and zones that share a part of the workspace.
    """
    unit = content.units.length
    boxes = []
    for name, entry in content.zones.items():
        low, high = np.full(3, -np.inf), np.full(3, np.inf)
        for axis, span in enumerate((entry.x, entry.y, entry.z)):
            if span is None:
                continue
            for value, end in zip(span, (low, high), strict=True):
                if value is not None:
                    end[axis] = sized_si(value, unit, where=f"{where}, zones.{name}")
            if not low[axis] < high[axis]:
                raise InputError(
                    "a zone ends where it begins, or before",
                    where=f"{where}, zones.{name}.{'xyz'[axis]}",
                    came=str([*span]),
                    allowed="the lower end first",
                )
        if np.isinf(low).all() and np.isinf(high).all():
            raise InputError(
                "a zone without limits is the whole workspace",
                where=f"{where}, zones.{name}",
                cure="Give it a range along x, y or z.",
            )
        boxes.append(Box(name, low, high))
    for one, other in combinations(boxes, 2):
        if (np.maximum(one.low, other.low) < np.minimum(one.high, other.high)).all():
            raise InputError(
                "two zones share a part of the workspace",
                where=f"{where}, zones",
                came=f"{one.name} and {other.name}",
                cure="Let each end where the other begins; `overlap` only says how far beyond its sides a zone takes "
                "in configurations.",
            )
    return tuple(boxes), sized_si(content.overlap, unit, where=f"{where}, overlap")


def cut_boxes(places: Array, divisions: tuple[int, int, int]) -> tuple[Box, ...]:
    """Return boxes that fill the space, cut so that as many places lie on either side of each cut.

    Args:
        places: ``(n, 3)`` [m].
        divisions: Into how many slices the space is cut along x, y and z.
    """
    cuts = [np.quantile(places[:, axis], np.linspace(0.0, 1.0, n + 1)[1:-1]) for axis, n in enumerate(divisions)]
    edges = [np.concatenate([[-np.inf], cut, [np.inf]]) for cut in cuts]
    found = []
    for number, box in enumerate(product(*(range(n) for n in divisions)), 1):
        low = np.array([edges[axis][k] for axis, k in enumerate(box)])
        high = np.array([edges[axis][k + 1] for axis, k in enumerate(box)])
        found.append(Box(str(number), low, high))
    return tuple(found)


def divisions_for(places: Array, count: int) -> tuple[int, int, int]:
    """Return into how many slices a space is cut along x, y and z for so many boxes that are as cubic as can be."""
    low, high = np.quantile(places, [_OUTSIDE / 2.0, 1.0 - _OUTSIDE / 2.0], axis=0)
    extent = np.maximum(high - low, 1e-9)
    choices = [
        (a, b, count // (a * b))
        for a in range(1, count + 1)
        for b in range(1, count + 1)
        if count % a == 0 and (count // a) % b == 0
    ]

    def longest_by_shortest(choice: tuple[int, int, int]) -> float:
        sides = extent / np.array(choice)
        return float(sides.max() / sides.min())

    return min(choices, key=lambda choice: (round(longest_by_shortest(choice), 9), choice))


def flange_places(robot: Robot, q: Array | Postures) -> Array:
    """Return where the flange is by the robot's table, with nothing identified, in the base frame [m], ``(n, 3)``."""
    plain = replace(robot, known={}, proof=None, tools={}, truths={})
    return plain.with_frames(IDENTITY, {}).world_poses(q)[0]


def shown_box(box: Box) -> dict[str, list[float | None]]:
    """Return the limits of a box as a file holds them [mm]."""
    made = {}
    for axis, letter in enumerate("xyz"):
        ends = [float(box.low[axis]), float(box.high[axis])]
        if not all(map(math.isinf, ends)):
            made[letter] = [None if math.isinf(end) else round(1e3 * end, 3) for end in ends]
    return made
