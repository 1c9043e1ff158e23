"""Programs corrected with the answers without which nothing is: all was computed, and the controller is nominal."""

from __future__ import annotations

from functools import partial
from typing import Final

import truearm

#: The answers as words of the command.
ANSWERS: Final = ("--taught", "none", "--controller-kinematics", "nominal")
compensate = partial(truearm.compensate, taught=["none"], controller_kinematics="nominal")
