"""Zones of the workspace: boxes, a model for each, and robots that are read from a calibration by zones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, StringConstraints

from truearm.engine.base.errors import InputError, refusals_of
from truearm.engine.base.files import read_yaml
from truearm.engine.base.units import sized_si
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.statistics import Errors, errors_of
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.models import Model
from truearm.engine.fit.rounds import Redundant
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import is_zones, load_robot
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.entries import STRICT, Name, NotNegative, Number
from truearm.engine.robot.transform import IDENTITY, Transform

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
    for box, other in combinations(boxes, 2):
        if (np.maximum(box.low, other.low) < np.minimum(box.high, other.high)).all():
            raise InputError(
                "two zones share a part of the workspace",
                where=f"{where}, zones",
                came=f"{box.name} and {other.name}",
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


# A model for each zone of the workspace (Nubiola, sections 1.3.1 and 4.5).
#
# What a model cannot follow over the whole workspace it can over a part: there an error that bends is nearly straight.
# The workspace is cut into boxes by where the flange is, each box gets a model of its own that starts at the values of
# the whole's, and a pose is predicted by the model of the box in which the nominal flange is.

#: Training configurations that a zone needs for a model of its own.
LEAST_CONFIGURATIONS: Final = 12
#: Held-out configurations that a zone is judged by at least, and standard errors by which it must gain.
LEAST_HELD_OUT: Final = 5
#: Chance for any of the zones to be kept that is as good as the model of the whole.
_CHANCE: Final = 0.025


@dataclass(frozen=True, eq=False)
class Zone:
    """A box of the workspace with a model of its own."""

    low: Array  #: low, high: its corners in the base frame [m], ``(3,)``; infinite where nothing lies beyond.
    high: Array
    fit: Fit  #: Of its training configurations.
    configurations: int  #: How many these were, with those of the overlap.
    name: str = ""  #: Of the zone.

    def holds(self, places: Array) -> NDArray[np.bool_]:
        """Return which places in the base frame ``(n, 3)`` lie in it; the lower sides belong to it."""
        return np.asarray(((places >= self.low) & (places < self.high)).all(axis=1))


@dataclass(frozen=True, eq=False)
class Zones:
    """A workspace cut into boxes."""

    nominal: Robot  #: Says where the flange is.
    whole: Fit  #: The model of the whole workspace; it stands in where a box had too few training configurations.
    zones: tuple[Zone, ...]  #: Boxes with a model of their own; they do not overlap.

    def of(self, q: Array | Postures) -> IntArray:
        """Return the index of the zone for joint positions ``(n, joints)``, -1 for the whole, ``(n,)``."""
        places = _flange(self.nominal, q)
        found = np.full(len(places), -1, dtype=np.intp)
        for index, zone in enumerate(self.zones):
            found[zone.holds(places)] = index
        return found

    def positions(self, joints: Array, target: str) -> Array:
        """Return where a target is in the world by the model of each zone [m], ``(n, 3)``.

        Args:
            joints: Joint positions ``(n, joints)``.
        """
        zone = self.of(joints)
        made = np.empty((len(joints), 3))
        for index in np.unique(zone).tolist():
            fit = self.whole if index < 0 else self.zones[index].fit
            made[zone == index] = fit.robot.world_poses(joints[zone == index], target)[0]
        return made


def identify_zones(
    robot: Robot,
    data: Dataset,
    model: Model,
    divisions: tuple[int, int, int],
    overlap: float,
    least: int = LEAST_CONFIGURATIONS,
) -> Zones:
    """Identify a model for the whole workspace and one for each of its zones.

    Args:
        robot: The nominal robot.
        data: Training readings, in the instrument's own frame.
        model: What is free, in the whole and in every zone. A zone's priors are centred on what the whole found.
        divisions: Into how many slices the workspace is cut along x, y and z of the base. Cuts leave as many training
            configurations on either side.
        overlap: How far beyond its box a zone takes training configurations [m].
        least: A box with fewer training configurations, overlap included, gets no model of its own.

    Raises:
        InputError: If there is nothing to cut, the overlap is negative, or the data do not say where the robot stands:
            each zone would then have a world of its own.
    """
    if min(divisions) < 1 or max(divisions) < 2:
        raise InputError(
            "these divisions make no zones", where="zones", came=divisions, allowed="1 or more along each axis, 2 once"
        )
    if not overlap >= 0.0:
        raise InputError("zones overlap by a length", where="zones", came=f"{overlap * 1e3:g} mm", allowed="0 or more")
    if not data.anchored:
        raise InputError(
            "zones need readings that say where the robot stands",
            where=data.source,
            came="readings against fixtures alone",
            cure="Measure positions in one frame, or use one model for the whole workspace.",
        )
    whole = identify(robot, data, model)
    places = _flange(robot, data.postures)
    zones = []
    for box in cut_boxes(places, divisions):
        mine = np.flatnonzero(box.holds(places, overlap))
        if len(mine) >= least:
            fit = identify(whole.robot, data.of_configurations(mine), model)
            zones.append(Zone(box.low, box.high, fit, len(mine), box.name))
    return Zones(robot, whole, tuple(zones))


@dataclass(frozen=True, eq=False)
class ZoneVerdict:
    """Whether a model of its own is better in a zone."""

    box: Box  #: Where it is.
    #: training, held_out: configurations that it was identified from, with those of the overlap, and judged by.
    training: int
    held_out: int
    #: whole, zone: mean error of its held-out readings by the model of the whole workspace, and by its own [m]; None
    #: where there was nothing to judge by.
    whole: float | None
    zone: float | None
    error: float | None  #: Standard error of their difference, by the scatter of the configurations [m].
    kept: bool  #: Whether it stays.
    why: str  #: In words.
    fit: Fit | None  #: Its own model; None where there were too few configurations for one.


def judge_zones(
    whole: Fit,
    boxes: Sequence[Box],
    overlap: float,
    parts: tuple[Dataset, Dataset],
    places: tuple[Array, Array],
    *,
    loss: Loss = "linear",
    redundancy: Redundant = "prior",
    bounds: Bounds | None = None,
) -> tuple[ZoneVerdict, ...]:
    """Identify a model for each box, and judge it on held-out readings there against the model of the whole.

    A zone is kept if its mean error there is lower by more than chance: by a one-sided t test of the paired differences
    in which any of the zones passes in one case of forty if all are as good as the whole.

    Args:
        overlap: How far beyond its box a zone takes training configurations [m].
        parts: Training and held-out readings, in the instrument's own frame.
        places: Where the flange is at each of their configurations, ``(n, 3)`` [m].
        loss, redundancy, bounds: Of the fits.
    """
    training, held_out = parts
    verdicts = []
    for box in boxes:
        mine, judges = (np.flatnonzero(box.holds(places[0], overlap)), np.flatnonzero(box.holds(places[1])))
        fit = None
        if len(mine) >= LEAST_CONFIGURATIONS and len(judges) >= LEAST_HELD_OUT:
            part = training.of_configurations(mine)
            fit = identify(whole.robot, part, whole.model, loss=loss, redundancy=redundancy, bounds=bounds)
        verdicts.append(_verdict(whole, fit, box, len(mine), held_out, judges, len(boxes)))
    return tuple(verdicts)


def _verdict(
    whole: Fit, fit: Fit | None, box: Box, training: int, held_out: Dataset, judges: IntArray, zones: int
) -> ZoneVerdict:
    count = len(judges)
    if fit is None:
        few = (
            f"{training} training configurations, and a model needs {LEAST_CONFIGURATIONS}"
            if training < LEAST_CONFIGURATIONS
            else f"{count} held-out configurations, and a judgement needs {LEAST_HELD_OUT}"
        )
        return ZoneVerdict(box, training, count, None, None, None, False, f"only {few}", None)
    from scipy.special import stdtrit

    part = held_out.of_configurations(judges)
    missing = {target.name for target in whole.robot.targets} - {target.name for target in fit.robot.targets}
    if missing & set(part.targets):
        return ZoneVerdict(box, training, count, None, None, None, False, "a target was not measured in it", fit)
    before, after = (error_sizes(errors_of(one.robot, part)) for one in (whole, fit))
    read = np.isfinite(before)
    at = np.unique(part.configuration[read], return_inverse=True)[1].reshape(-1)
    judged = int(at.max(initial=-1)) + 1
    if judged < LEAST_HELD_OUT:
        why = f"only {judged} held-out configurations with readings, and a judgement needs {LEAST_HELD_OUT}"
        return ZoneVerdict(box, training, judged, None, None, None, False, why, fit)
    gain = before[read] - after[read]
    sums = np.bincount(at, gain - gain.mean())
    error = math.sqrt(judged / (judged - 1) * float(sums @ sums)) / len(gain)
    kept = bool(gain.mean() > float(stdtrit(judged - 1, 1.0 - _CHANCE / zones)) * error)
    why = (
        "better by more than chance"
        if kept
        else "better, but not by more than chance"
        if gain.mean() > 0.0
        else "not better than the model of the whole"
    )
    old, new = float(before[read].mean()), float(after[read].mean())
    return ZoneVerdict(box, training, judged, old, new, error, kept, why, fit)


def zoned_mean(whole: Fit, verdicts: Sequence[ZoneVerdict], held_out: Dataset, places: Array) -> tuple[float, float]:
    """Return the mean held-out error with one model, and with the zones that are kept [m].

    Args:
        places: Where the flange is at the held-out configurations, ``(n, 3)`` [m].
    """
    errors = error_sizes(errors_of(whole.robot, held_out))
    zoned = errors.copy()
    for verdict in verdicts:
        mine = np.flatnonzero(verdict.box.holds(places))
        if verdict.kept and verdict.fit is not None and len(mine):
            part = held_out.of_configurations(mine)
            of_zone = np.isin(held_out.configuration, mine)
            zoned[of_zone] = error_sizes(errors_of(verdict.fit.robot, part))
    return float(np.nanmean(errors)), float(np.nanmean(zoned))


def error_sizes(errors: Errors) -> Array:
    """Return the size of the error of each position, distance or height [m], NaN where none was read."""
    norms: Array = np.linalg.norm(errors.position_errors, axis=1)
    return norms if errors.length_errors is None else np.where(np.isfinite(norms), norms, np.abs(errors.length_errors))


def _flange(robot: Robot, q: Array | Postures) -> Array:
    """Return where the flange is in the base frame [m], ``(n, 3)``."""
    return robot.with_frames(Transform(), {}).world_poses(q)[0]


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
