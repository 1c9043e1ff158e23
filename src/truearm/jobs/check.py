"""What is wrong with measurements before they are believed."""

from __future__ import annotations

from pathlib import Path

from truearm.errors import InputError
from truearm.identification.judging.data_check import _compared
from truearm.identification.judging.left_over import LeftOver
from truearm.identification.judging.next_steps import steps_after_check
from truearm.jobs.arguments import data_argument, readings_argument, refuse_swapped, robot_argument
from truearm.jobs.excluding import count_excluded, excluded_notices, without_excluded
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import errors_of
from truearm.modeling.robot import Robot
from truearm.results.data_check import DataCheck
from truearm.simulated import parts_of


def check(
    robot: Robot | Dataset | str | Path | None,
    data: Dataset | str | Path | None = None,
    *,
    device: str | None = None,
    exclude: str | Path | None = None,
) -> DataCheck:
    """Say what is wrong with measurements before they are believed.

    Parameters
    ----------
    robot
        The nominal robot, or what :func:`truearm.load_robot` takes. With it, units, joint order and signs, limits and
        single readings are checked too. It may be left out: ``check(data)``, or None.
    data
        Readings, or a canonical CSV file.
    device
        Name of the instrument, of ``truearm.devices()``; with it, readings beyond its range are named.
    exclude
        File of readings that are excluded, each with its reason, as for :func:`truearm.calibrate`.

    Raises
    ------
    InputError
        If the robot or the data cannot be used, or their joints do not belong together.
    """
    if data is None:
        robot, data = None, robot
    refuse_swapped(robot, data, "check")
    against = None if robot is None else robot_argument(robot)
    measured = data_argument(data) if against is None else readings_argument(against, data)
    measured, excluded = without_excluded(measured, exclude)
    parts = [measured] if measured.references is None else [measured, measured.references]
    if not any(part.has_reading.any() for part in parts):
        raise InputError(
            "there is no reading", parameter="data", where=measured.source, cure="Fill in x, y and z, or distance."
        )
    noticed, fit, part = _compared(measured, against, device, excluded=count_excluded(excluded))
    noticed, marks = (*noticed, *excluded_notices(excluded)), parts_of((measured, against))
    if fit is None or part is None:
        return DataCheck(measured, noticed, steps_after_check(noticed, robot=against is not None), marks)
    steps = steps_after_check(noticed, LeftOver.of(fit, part), errors_of(fit.robot, part))
    return DataCheck(measured, noticed, steps, marks)
