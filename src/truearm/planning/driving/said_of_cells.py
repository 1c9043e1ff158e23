"""What is to be known of what a plan keeps clear of: links beside their lines, what is left out, odd boxes, limits."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.modeling.transform import rotation_vector
from truearm.notices import Notice
from truearm.planning.driving.collisions import CollisionCheck
from truearm.planning.driving.links_beside import beside_notices

#: A box whose sides are all shorter is meant in another unit [m].
_TINY: Final = 0.01
#: A joint of less range may have its limits in another unit: once around is 6.3 rad, and a rail 2 m long [rad; m].
_NARROW: Final = {"revolute": math.radians(7.0), "prismatic": 5e-3}
#: Base frames that differ by less are the same [m and rad].
_SAME: Final = 1e-6


def cell_notices(check: CollisionCheck) -> tuple[Notice, ...]:
    """Return what is to be known of what a check keeps clear of."""
    notices = [*_box_notices(check), *_frame_notices(check), *beside_notices(check.robot)]
    if check.left_out:
        notices.append(
            Notice(
                "never-apart",
                "Nearer to each other than the clearance whatever the joints do, and so not kept apart: "
                f"{'; '.join(check.left_out)}.",
                "note",
            )
        )
    return tuple(notices)


def limits_notices(robot: Robot, low: Array, high: Array) -> tuple[Notice, ...]:
    """Return a warning of joints with hardly any range between `low` and `high`, ``(joints,)`` [rad or m]."""
    narrow = []
    for k, joint in enumerate(robot.joints):
        if high[k] - low[k] < _NARROW[joint.kind]:
            unit, size = ("deg", math.degrees(1.0)) if joint.kind == "revolute" else ("mm", 1e3)
            narrow.append(f"joint {k + 1} from {size * low[k]:.4g} to {size * high[k]:.4g} {unit}")
    if not narrow:
        return ()
    told = "Hardly any range is left to a joint" if len(narrow) == 1 else "Hardly any range is left to joints"
    return (Notice("limits-tiny", f"{told}: {', '.join(narrow)}. Check the unit of the limits, rad or deg, m or mm."),)


def _frame_notices(check: CollisionCheck) -> list[Notice]:
    """Return what is to be said of floor and boxes where the pendant shows positions in another base frame."""
    base, cell = check.robot.controller.base, check.cell
    moved = np.array(base.translation)
    turned = float(np.linalg.norm(rotation_vector(base.rotation)))
    if (cell.floor is None and not cell.boxes) or (np.abs(moved).max() < _SAME and turned < _SAME):
        return []
    named = " and ".join(
        ([f"The {cell.surface}"] if cell.floor is not None else []) + (["boxes"] if cell.boxes else [])
    )
    kept = "are" if cell.boxes else "is"
    at = ", ".join(f"{round(1e3 * v, 3) + 0.0:g}" for v in moved)
    also = f", turned by {np.degrees(turned):.4g} deg" if turned >= _SAME else ""
    return [
        Notice(
            "other-base-on-pendant",
            f"{named[0].upper()}{named[1:]} {kept} kept in the base frame of the robot file. The pendant shows "
            f"positions in another one, with its origin at ({at}) mm in it{also}: add that to what it shows.",
            "note",
        )
    ]


def _box_notices(check: CollisionCheck) -> list[Notice]:
    """Return what is to be said of boxes that are tiny, or that the arm never comes near."""
    notices = []
    thick = max(capsule.radius for capsule in (*check.arm.links, *check.arm.tools))
    reach = float((check.arm.along + check.arm.aside).max()) + thick
    for box in check.cell.boxes:
        longest = float((box.high - box.low).max())
        away = float(np.linalg.norm(np.clip(0.0, box.low, box.high)))
        if longest < _TINY:
            notices.append(
                Notice(
                    "box-tiny",
                    f"The longest side of the box '{box.name}' is {longest * 1e3:.3g} mm. Check the unit of the "
                    "constraints.",
                )
            )
        elif away - reach > check.need:
            notices.append(
                Notice(
                    "box-out-of-reach",
                    f"The box '{box.name}' begins {away * 1e3:.0f} mm from the base, and the arm reaches at most "
                    f"{reach * 1e3:.0f} mm: nothing is kept clear by it. Check its unit, and that it is in the base "
                    "frame of the robot.",
                )
            )
    return notices
