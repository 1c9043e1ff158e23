"""What a check of measurements is asked for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from truearm.engine.command.groups import Excluding, Long, SeenBy
from truearm.engine.command.kinds import Given
from truearm.engine.command.request import job, option

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
    robot: Robot | Dataset | str | Path | None = option(
        Given("[ROBOT]"),
        "A library id, a robot file or a URDF.",
        default=None,
        shown=False,
        kw_only=False,
        more="It may be left out: ``check(data)``, or None.",
    )
    data: Dataset | str | Path | None = option(
        Given("DATA.csv"), "Measurements in the canonical CSV.", default=None, shown=False, kw_only=False
    )

    def run(self) -> DataCheck:
        """Check."""
        from truearm.checking.checking import checked

        return checked(self)


check = job(Check)
