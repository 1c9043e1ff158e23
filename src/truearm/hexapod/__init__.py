"""One ballbar between six cups: `truearm hexapod`, and in Python `truearm.hexapod.solve`, `plan` and others."""

from truearm.hexapod.jobs import hexapod_enumerate as enumerate
from truearm.hexapod.jobs import hexapod_plan as plan
from truearm.hexapod.jobs import hexapod_solve as solve
from truearm.hexapod.jobs import hexapod_uncertainty as uncertainty
from truearm.hexapod.jobs import hexapod_world_frame as world_frame

__all__ = ["enumerate", "plan", "solve", "uncertainty", "world_frame"]
