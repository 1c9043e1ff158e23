"""A plan of measurements as CSV."""

from __future__ import annotations

import csv
import io

from truearm.planning.choosing.measurement_plan import MeasurementPlan
from truearm.units import written


def plan_csv(plan: MeasurementPlan) -> str:
    """Return a plan as CSV, one row a configuration in the order of measurement, joints in deg or mm.

    ``joint_i`` is where to measure, ``approach_i`` where to stop right before, ``reads`` what a device reads there.
    """
    units = ["deg" if joint.kind == "revolute" else "mm" for joint in plan.robot.joints]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    names = [f"{name}_{number} [{unit}]" for name in ("joint", "approach") for number, unit in enumerate(units, 1)]
    writer.writerow(["configuration", *names, *(["reads"] if plan.reads else [])])
    reads = [[words] for words in plan.reads] or [[] for _ in plan.labels]
    for label, at, before, read in zip(plan.labels, plan.joints.tolist(), plan.before.tolist(), reads, strict=True):
        cells = [repr(written(value, unit)) for row in (at, before) for value, unit in zip(row, units, strict=True)]
        writer.writerow([label, *cells, *read])
    return stream.getvalue()
