"""Performance tests by ISO 9283: `truearm iso9283`, and in Python `truearm.iso9283.plan`, `simulate`, `evaluate`."""

from truearm.iso9283.jobs import iso9283_evaluate as evaluate
from truearm.iso9283.jobs import iso9283_plan as plan
from truearm.iso9283.jobs import iso9283_simulate as simulate

__all__ = ["evaluate", "plan", "simulate"]
