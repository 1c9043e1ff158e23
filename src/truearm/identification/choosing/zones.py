"""A model for each zone of the workspace (Nubiola, sections 1.3.1 and 4.5).

What a model cannot follow over the whole workspace it can over a part: there an error that bends is nearly straight.
The workspace is cut into boxes by where the flange is, each box gets a model of its own that starts at the values of
the whole's, and a pose is predicted by the model of the box in which the nominal flange is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.identification.choosing.zone_boxes import Box, cut_boxes
from truearm.identification.solving.bounds import Bounds
from truearm.identification.solving.fit import Fit, identify
from truearm.identification.solving.losses import Loss
from truearm.identification.solving.models import Model
from truearm.identification.solving.rounds import Redundant
from truearm.measurement.dataset import Dataset, IntArray
from truearm.measurement.statistics import Errors, errors_of
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform

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
        mine, judges = (
            np.flatnonzero(box.holds(places[0], overlap)),
            np.flatnonzero(box.holds(places[1])),
        )
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
