"""A plan of measurements as CSV."""

from __future__ import annotations

import csv
import io

from truearm.modeling.controller import JointsOf
from truearm.modeling.formats.joint_columns import counting, joint_cells, joint_headings
from truearm.planning.choosing.measurement_plan import MeasurementPlan


def plan_csv(plan: MeasurementPlan, joints_are: JointsOf = "model") -> str:
    """Return a plan as CSV, one row a configuration in the order of measurement, joints in deg or mm.

    ``joint_i``, or ``axis_i`` as the controller shows it, is where to measure, ``approach_i`` likewise where to stop
    right before, if it stops there, ``reads`` what a device reads there.
    """
    joints, controller = plan.robot.joints, counting(plan.robot, joints_are)
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    positions = {None: plan.joints} | ({} if plan.before is None else {"approach": plan.before})
    names = [heading for name in positions for heading in joint_headings(joints, controller, name)]
    writer.writerow(["configuration", *names, *(["reads"] if plan.reads else [])])
    reads = [[words] for words in plan.reads] or [[] for _ in plan.labels]
    cells = zip(*(joint_cells(values, joints, controller) for values in positions.values()), strict=True)
    for label, row, read in zip(plan.labels, cells, reads, strict=True):
        writer.writerow([label, *(cell for part in row for cell in part), *read])
    return stream.getvalue()
