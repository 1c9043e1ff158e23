"""A model for each zone of the workspace (Nubiola, sections 1.3.1 and 4.5).

What a model cannot follow over the whole workspace it can over a part: there an error that bends is nearly straight.
The workspace is cut into boxes by where the flange is, each box gets a model of its own that starts at the values of
the whole's, and a pose is predicted by the model of the box in which the nominal flange is.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.identification.solving.fit import Fit, identify
from truearm.identification.solving.models import Model
from truearm.measurement.dataset import Dataset, IntArray
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform

#: Training configurations that a zone needs for a model of its own.
LEAST_CONFIGURATIONS: Final = 12


@dataclass(frozen=True, eq=False)
class Zone:
    """A box of the workspace with a model of its own.

    Attributes
    ----------
    low, high
        Its corners in the base frame [m], ``(3,)``; infinite where nothing lies beyond.
    fit
        Of its training configurations.
    configurations
        How many these were, with those of the overlap.
    """

    low: Array
    high: Array
    fit: Fit
    configurations: int

    def holds(self, places: Array) -> NDArray[np.bool_]:
        """Return which places in the base frame ``(n, 3)`` lie in it; the lower sides belong to it."""
        return np.asarray(((places >= self.low) & (places < self.high)).all(axis=1))


@dataclass(frozen=True, eq=False)
class Zones:
    """A workspace cut into boxes.

    Attributes
    ----------
    nominal
        Says where the flange is.
    whole
        The model of the whole workspace; it stands in where a box had too few training configurations.
    zones
        Boxes with a model of their own; they do not overlap.
    """

    nominal: Robot
    whole: Fit
    zones: tuple[Zone, ...]

    def of(self, q: Array | Postures) -> IntArray:
        """Return the index of the zone for joint positions ``(n, joints)``, -1 for the whole, ``(n,)``."""
        places = _flange(self.nominal, q)
        found = np.full(len(places), -1, dtype=np.intp)
        for index, zone in enumerate(self.zones):
            found[zone.holds(places)] = index
        return found

    def positions(self, joints: Array, target: str) -> Array:
        """Return where a target is in the world by the model of each zone [m], ``(n, 3)``.

        Parameters
        ----------
        joints
            Joint positions ``(n, joints)``.
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

    Parameters
    ----------
    robot
        The nominal robot.
    data
        Training readings, in the instrument's own frame.
    model
        What is free, in the whole and in every zone. A zone's priors are centred on what the whole found.
    divisions
        Into how many slices the workspace is cut along x, y and z of the base. Cuts leave as many training
        configurations on either side.
    overlap
        How far beyond its box a zone takes training configurations [m].
    least
        A box with fewer training configurations, overlap included, gets no model of its own.

    Raises
    ------
    InputError
        If there is nothing to cut, the overlap is negative, or the data do not say where the robot stands: each
        zone would then have a world of its own.
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
    cuts = [np.quantile(places[:, axis], np.linspace(0.0, 1.0, n + 1)[1:-1]) for axis, n in enumerate(divisions)]
    edges = [np.concatenate([[-np.inf], cut, [np.inf]]) for cut in cuts]
    zones = []
    for box in product(*(range(n) for n in divisions)):
        low = np.array([edges[axis][k] for axis, k in enumerate(box)])
        high = np.array([edges[axis][k + 1] for axis, k in enumerate(box)])
        mine = np.flatnonzero(((places >= low - overlap) & (places < high + overlap)).all(axis=1))
        if len(mine) >= least:
            fit = identify(whole.robot, data.of_configurations(mine), model)
            zones.append(Zone(low, high, fit, len(mine)))
    return Zones(robot, whole, tuple(zones))


def _flange(robot: Robot, q: Array | Postures) -> Array:
    """Return where the flange is in the base frame [m], ``(n, 3)``."""
    return robot.with_frames(Transform(), {}).world_poses(q)[0]
