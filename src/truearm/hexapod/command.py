"""``truearm hexapod``: poses from six lengths between cups."""

from __future__ import annotations

from truearm.engine.command.options import Commands, add
from truearm.hexapod.jobs import EnumeratePoses, FindFixture, KnowCups, PlanHexapod, SolveCups

app = Commands(
    no_args_is_help=True, help="Measure poses with one ballbar between three cups on the tool and three on the base."
)
add(app, EnumeratePoses, KnowCups, SolveCups, PlanHexapod, FindFixture)
