"""The errors of a robot on the distances between measured points."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from truearm.errors import refusals_of
from truearm.jobs.arguments import refuse_swapped
from truearm.jobs.validate import as_measured
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import errors_of
from truearm.modeling.parts import Payload
from truearm.modeling.robot import Robot
from truearm.results.distances import Distances
from truearm.simulated import parts_of
from truearm.validation.pair_distances import pair_distances


def distances(
    robot: Robot | str | Path,
    data: Dataset | str | Path,
    *,
    payload: Payload | str | None = None,
    gravity: Sequence[float] | None = None,
) -> Distances:
    """Judge a robot by the distances between all pairs of measured points; no common frame is needed.

    Parameters
    ----------
    robot
        A calibrated robot, or its file.
    data
        Readings of whatever instrument's frame, or a canonical CSV file.
    payload, gravity
        What the robot carried (an object, or a text such as ``2.7kg,50mm,25mm,100mm``) and free fall in its base frame
        [m/s^2] this time, if they differ from the calibration.

    Raises
    ------
    InputError
        If the robot has no targets, the data name others, or there are positions at one configuration only.
    """
    refuse_swapped(robot, data, "distances")
    arm, readings = as_measured(robot, data, payload, gravity)
    predicted = errors_of(arm, readings).position_errors
    seen = readings.has_position
    measured = readings.position[seen]
    with refusals_of("data"):
        found = pair_distances(measured + predicted[seen], measured, readings.configuration[seen])
    return Distances(readings.source, readings.configurations, found, parts_of((arm, readings)))
