"""What finding a robot's axes from circles is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from truearm.engine.command.groups import IntoFolder, Long, OfData
from truearm.engine.command.kinds import Choice
from truearm.engine.command.request import job, option

if TYPE_CHECKING:
    from truearm.axis_circles.result import AxisCalibration


class Axes(OfData, IntoFolder, Long):
    """Find a robot's axes from circles, and with them its frames, parameters and joint errors.

    In the measurements one joint moves at a time; every joint does. Joint effects of the robot are kept, and deflect
    the axes. Writes calibrated.yaml, joint-errors.yaml and axes.json into a folder.
    """

    job = "axes"
    refuses = "If the robot or the data cannot be used, a joint has no run, or its axis cannot be found."
    measurement_frame: Literal["instrument", "robot"] = option(
        Choice(known=("instrument", "robot"), what="frame"),
        "What the data are given in: the instrument's frame, or the robot's base frame, set up before.",
        default="instrument",
        formerly="frame",
    )

    def run(self) -> AxisCalibration:
        """Find them."""
        from truearm.axis_circles.result import found_axes

        return found_axes(self)


axes = job(Axes)
