"""``truearm iso9283``: tests of a robot's performance."""

from __future__ import annotations

from truearm.engine.command.options import Commands, add
from truearm.iso9283.jobs import EvaluateTests, PlanTests, SimulateTests

app = Commands(no_args_is_help=True, help="Test a robot by the criteria of ISO 9283: plan, simulate, evaluate.")
add(app, PlanTests, SimulateTests, EvaluateTests)
