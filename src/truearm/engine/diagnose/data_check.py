"""What is wrong with measurements, and what a robust fit of the robot believes of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from truearm.engine.base.errors import Notice, Rule, counted
from truearm.engine.base.limits import limit
from truearm.engine.data.checks import check_data, check_range
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import without_table_motion
from truearm.engine.data.thinning import JUDGED_IN_PART, thinned
from truearm.engine.diagnose.plausibility import check_against
from truearm.engine.fit.fit import Fit
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.devices.device import Device


def notices_of(
    data: Dataset, robot: Robot, *, steady: Dataset, excluded: Mapping[str, int] | None = None
) -> tuple[Notice, ...]:
    """Return one notice for each kind of fault; none for believable data.

    Args:
        steady: The same data without the motion of the table.
        excluded: How many readings of each target were excluded.
    """
    return compared_with(data, robot, steady=steady, excluded=excluded)[0]


def compared_with(
    data: Dataset,
    robot: Robot | None,
    device: Device | None = None,
    *,
    steady: Dataset | None = None,
    excluded: Mapping[str, int] | None = None,
) -> tuple[tuple[Notice, ...], Fit | None, Dataset | None]:
    """Return one notice for each kind of fault, a robust fit of the robot, and what is believed of its readings.

    Args:
        steady: The same data without the motion of the table, where that has been removed already.
        excluded: How many readings of each target were excluded.
    """
    ranged: tuple[Notice, ...] = ()
    if device is not None:
        ranged = tuple(check_range(data, device))
    if robot is None:
        return (*ranged, *check_data(data, excluded=excluded)), None, None
    still = without_table_motion(data) if steady is None else steady
    part = thinned(still, len(robot.parameters), limit("derivatives") // 2)
    if part is None:
        return (*ranged, *check_data(data, excluded=excluded), _too_seldom(data)), None, None
    against = check_against(robot, part)
    left_out = () if part is still else (_in_part(part, still),)
    scaled = {row for notice in against.notices if notice.code == "unit-length" for row in notice.at}
    notices = (*ranged, *check_data(data, against.suspects, excluded, scaled), *against.notices, *left_out)
    return notices, against.fit, against.believed


NOT_COMPARED: Final = Rule(
    "not-compared",
    "warning",
    "no target was read at four configurations, as where every reading has a name of its own",
    cure="Readings of the same point on the tool have the same target.",
    gravity=2,
)


def _too_seldom(data: Dataset) -> Notice:
    return NOT_COMPARED(
        f"{counted(len(data.targets), 'target')} of {counted(data.configurations, 'configuration')} were not compared "
        "with the robot: none was read at four configurations or more, so that nothing is said of the robot. Does "
        "every reading have a name of its own?"
    )


def _in_part(part: Dataset, data: Dataset) -> Notice:
    return JUDGED_IN_PART(
        f"The data are large: {part.configurations} of {counted(data.configurations, 'configuration')} and "
        f"{len(part.targets)} of {counted(len(data.targets), 'target')} were compared with the robot, evenly spaced "
        "and read most often. What is far off elsewhere was not looked for."
    )
