"""The plan in words, to print and to work through with the bar in hand (Nubiola, 3.5 and 4.4)."""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.measurement.hexapod.four_cups import TO_FOURTH
from truearm.measurement.hexapod.geometry import DEVICE, Device, side_names
from truearm.modeling.controller import Controller
from truearm.modeling.robot import Robot
from truearm.planning.hexapod.reachable import Reachable
from truearm.units import from_si

_FOURTH: Final = (
    "   Set the fourth cup below the three others in the same way, at the fourth corner of a tetrahedron. It must be",
    "   as far from each of them as they are from each other, to the range of the bar.",
)
_ANEW: Final = (
    "   Before the first configuration of every place, set the base fixture up there and repeat steps 2 and 3. The",
    "   distances of the base go into the first row of the place.",
)


def steps_text(plan: Reachable, robot: Robot, controller: Controller | None = None, device: Device = DEVICE) -> str:
    """Return the plan step by step; figures go into the sheet.

    Args:
        controller: Who shows the joint positions; None for the model's.
    """
    base, tool, leg = (f"{length * 1e3:g} mm" for length in (device.base, device.tool, device.leg))
    with_sides, places = any(row.side > 1 for row in plan.rows), any(row.place for row in plan.rows)
    fourth = TO_FOURTH if with_sides else ()
    lines = [
        f"Measuring {robot.name} with one ballbar: {len(plan.rows)} configurations, {plan.poses_reached} poses.",
        f"The bar reads only within +/- {device.reach * 1e3:g} mm of the nominal length. If one of the six legs is",
        "beyond, leave its cell empty and go on. Plan again with the robot that a first calibration gives.",
        "",
        f"1. Set the bar to {tool} on its calibrator. Measure {', '.join(side_names('T'))}.",
        "2. Loosen the base cups. Bring the setting ball in cup T1 to the three places of the base cups by programme,",
        f"   {base} apart. Let each cup snap on and lock it. Note the joint positions.",
        *(_FOURTH if with_sides else ()),
        f"3. Set the bar to {base} on its calibrator. Measure {', '.join((*side_names('B'), *fourth))}.",
        f"4. For every configuration below: move, set the bar to {leg} on its calibrator, then measure six legs.",
        *(_ANEW if places else ()),
        "",
    ]
    joints = np.array([row.joints for row in plan.rows])
    shown = joints if controller is None else controller.from_model(joints)
    called = "joints" if controller is None else "joints as the controller shows them"
    there, attached = "", plan.rows[0].attachment
    for row, at, room in zip(plan.rows, shown.tolist(), plan.clearance.tolist(), strict=True):
        positions = " ".join(
            f"{from_si(value, 'deg' if joint.kind == 'revolute' else 'mm'):.3f}"
            for joint, value in zip(robot.joints, at, strict=True)
        )
        if row.place != there:
            lines += [f"Place {row.place}: set the base fixture up there; steps 2 and 3.", ""]
            there = row.place
        if row.attachment != attached:
            lines += [f"Attachment {row.attachment}: take the tool off, and attach it again.", ""]
            attached = row.attachment
        pose = f"pose {row.pose} on side {row.side}" if with_sides else f"pose {row.pose}"
        lines.append(f"Configuration {row.configuration}  ({pose}, {row.branch}, {room * 1e3:.0f} mm of room)")
        lines.append(f"   {called} {positions}")
        lines += [f"   [ ] Attach the bar between {' and '.join(name.split('-'))}." for name in row.leg_names]
    return "\n".join(lines) + "\n"
