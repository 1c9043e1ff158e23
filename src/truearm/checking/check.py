"""What a check of measurements is asked for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from truearm.engine.command.groups import Excluding, Long, Measured, OfRobot, SeenBy
from truearm.engine.command.request import as_in, job

if TYPE_CHECKING:
    from truearm.checking.checking import DataCheck
    from truearm.engine.data.dataset import Dataset
    from truearm.engine.robot.robot import Robot


class Check(SeenBy, Excluding, Long):
    """Say what is wrong with measurements before they are believed.

    With `robot`, also units, joint order and signs, limits, and readings that are far off; with `device` its range.
    """

    job = "check"
    refuses = "If the robot or the data cannot be used, or their joints do not belong together."
    robot: Robot | Dataset | str | Path | None = as_in(
        OfRobot,
        "robot",
        default=None,
        kw_only=False,
        metavar="[ROBOT]",
        more="It may be left out: ``check(data)``, or None.",
    )
    data: Dataset | str | Path | None = as_in(Measured, "data", default=None, kw_only=False)

    def run(self) -> DataCheck:
        """Check."""
        from truearm.checking.checking import checked

        return checked(self)


check = job(Check)
