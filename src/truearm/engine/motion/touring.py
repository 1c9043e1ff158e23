"""A tour through configurations to measure, from the safe one and back, each way checked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, Notice, Rule
from truearm.engine.motion.arm_capsules import beside_notices
from truearm.engine.motion.collisions import CollisionCheck
from truearm.engine.motion.tour import HOME, Stop, Tour
from truearm.engine.motion.ways import Way, WayFinder
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rotation_vector

#: By how much the stated distances may be too small [m], and by which part of themselves.
_TOLERANCE: Final = 1e-4
_PART: Final = 0.002


def nearest_on(check: CollisionCheck, joints: Array) -> dict[str, float]:
    """Return how near an arm comes to each thing [m] where it is driven through configurations ``(n, joints)``.

    Each way is halved as long as a part of it could be nearer than the nearest found, by how fast distances change at
    most. The distances hold all the way: somewhere the arm comes as near but for 0.1 mm or 0.2 % of them.

    Returns:
        distances: By the floor, each box and the links, the smallest first. Negative where they touch.
    """
    things = list(dict.fromkeys(check.things))
    thing = np.array([things.index(name) for name in check.things], dtype=np.intp)
    starts, ends = (joints[:-1], joints[1:]) if len(joints) > 1 else (joints, joints)
    at = check.distances(joints)
    at_start, at_end = (at[:, :-1], at[:, 1:]) if len(joints) > 1 else (at, at)
    least = np.full(len(things), np.inf)
    _lower(least, thing, at)
    tolerance = np.zeros(len(things))
    while len(starts):
        tolerance = np.maximum(_TOLERANCE, _PART * least)
        could = (at_start + at_end - check.spread(starts, ends)) / 2.0
        left = np.flatnonzero((could < (least - tolerance)[thing][:, None]).any(axis=0))
        starts, ends = starts[left], ends[left]
        middle = (starts + ends) / 2.0
        at_middle = check.distances(middle)
        _lower(least, thing, at_middle)
        at_start, at_end = (
            np.concatenate([at_start[:, left], at_middle], axis=1),
            np.concatenate([at_middle, at_end[:, left]], axis=1),
        )
        starts, ends = np.concatenate([starts, middle]), np.concatenate([middle, ends])
    nearest = {name: float(least[k] - max(_TOLERANCE, _PART * least[k])) for k, name in enumerate(things)}
    return dict(sorted(nearest.items(), key=lambda item: item[1]))


def _lower(least: Array, thing: NDArray[np.intp], distances: Array) -> None:
    if distances.shape[1]:
        np.minimum.at(least, thing, distances.min(axis=1))


#: A box whose sides are all shorter is meant in another unit [m].
_TINY: Final = 0.01
#: A joint of less range may have its limits in another unit: once around is 6.3 rad, and a rail 2 m long [rad; m].
_NARROW: Final = {"revolute": math.radians(7.0), "prismatic": 5e-3}
#: Base frames that differ by less are the same [m and rad].
_SAME: Final = 1e-6


NEVER_APART: Final = Rule(
    "never-apart", "note", "what no posture keeps apart by the clearance, and so is not looked at"
)


def cell_notices(check: CollisionCheck) -> tuple[Notice, ...]:
    """Return what is to be known of what a check keeps clear of."""
    notices = [*_box_notices(check), *_frame_notices(check), *beside_notices(check.robot)]
    if check.left_out:
        notices.append(
            NEVER_APART(
                "Nearer to each other than the clearance whatever the joints do, and so not kept apart: "
                f"{'; '.join(check.left_out)}."
            )
        )
    return tuple(notices)


LIMITS_TINY: Final = Rule(
    "limits-tiny",
    "warning",
    "joints that have less than 7 deg or 5 mm between the limits of the constraints, or the robot's own: their unit "
    "may be another one. Configurations that coincide are refused",
    cure="Check the unit of the limits, rad or deg, m or mm.",
)


def limits_notices(robot: Robot, low: Array, high: Array) -> tuple[Notice, ...]:
    """Return a warning of joints with hardly any range between `low` and `high`, ``(joints,)`` [rad or m]."""
    narrow = []
    for k, joint in enumerate(robot.joints):
        if high[k] - low[k] < _NARROW[joint.kind]:
            unit, size = ("deg", math.degrees(1.0)) if joint.kind == "revolute" else ("mm", 1e3)
            narrow.append(f"joint {k + 1} from {size * low[k]:.4g} to {size * high[k]:.4g} {unit}")
    if not narrow:
        return ()
    sentence = "Hardly any range is left to a joint" if len(narrow) == 1 else "Hardly any range is left to joints"
    return (LIMITS_TINY(f"{sentence}: {', '.join(narrow)}."),)


OTHER_BASE_ON_PENDANT: Final = Rule(
    "other-base-on-pendant",
    "note",
    "floor and boxes are in another base frame than that in which the pendant shows positions: where the origin of "
    "that is",
)


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
    verb = "are" if cell.boxes else "is"
    at = ", ".join(f"{round(1e3 * v, 3) + 0.0:g}" for v in moved)
    also = f", turned by {np.degrees(turned):.4g} deg" if turned >= _SAME else ""
    return [
        OTHER_BASE_ON_PENDANT(
            f"{named[0].upper()}{named[1:]} {verb} kept in the base frame of the robot file. The pendant shows "
            f"positions in another one, with its origin at ({at}) mm in it{also}: add that to what it shows."
        )
    ]


BOX_UNLIKELY: Final = Rule(
    "box-unlikely",
    "warning",
    "a box that has no side of 10 mm, or that the arm never comes near: its unit or its frame may be another one",
    cure="Check its unit, and that it is in the base frame of the robot.",
)


def _box_notices(check: CollisionCheck) -> list[Notice]:
    """Return what is to be said of boxes that are tiny, or that the arm never comes near."""
    notices = []
    thick = max(capsule.radius for capsule in (*check.arm.links, *check.arm.tools))
    reach = float((check.arm.along + check.arm.aside).max()) + thick
    for box in check.cell.boxes:
        longest = float((box.high - box.low).max())
        away = float(np.linalg.norm(np.clip(0.0, box.low, box.high)))
        if longest < _TINY:
            notices.append(BOX_UNLIKELY(f"The longest side of the box '{box.name}' is {longest * 1e3:.3g} mm."))
        elif away - reach > check.need:
            notices.append(
                BOX_UNLIKELY(
                    f"The box '{box.name}' begins {away * 1e3:.0f} mm from the base, and the arm reaches at most "
                    f"{reach * 1e3:.0f} mm: nothing is kept clear by it."
                )
            )
    return notices


def unreached(finder: WayFinder, joints: Array, before: Array | None) -> list[int]:
    """Return the numbers of configurations ``(n, joints)`` to which no way from the safe one was found."""
    entered = joints if before is None else before
    left = np.flatnonzero(finder.check.ways(entered, joints).clear)
    for at in (joints, entered):
        ways = finder.home_from(at[left])
        left = left[[way is not None for way in ways]]
    return sorted(set(range(len(joints))) - set(left.tolist()))


def tour_of(finder: WayFinder, joints: Array, labels: Sequence[str], before: Array | None = None) -> Tour:
    """Return a tour through configurations in their order.

    Args:
        finder: Finds the ways, from its safe configuration on.
        joints: Where to measure, by the model, ``(n, joints)`` [rad or m].
        labels: Their names.
        before: Where to stop right before each, ``(n, joints)``; None to drive there from anywhere.

    Raises:
        InputError: If a configuration is not clear, no way was found from one to the next, or a joint would be wound up
            by more than a turn.
    """
    entered = joints if before is None else before
    _refuse_near(finder, entered, joints, labels)
    starts = np.concatenate([finder.home[None], joints])
    ends = np.concatenate([entered, finder.home[None]])
    names = (HOME, *labels, HOME)
    ways = finder.between(starts, ends)
    stops = [Stop(finder.home, "home")]
    for k, way in enumerate(ways):
        if way is None:
            _refuse_way(finder, starts[k], ends[k], names[k], names[k + 1])
        assert isinstance(way, Way)
        stops += [Stop(over, "home" if np.array_equal(over, finder.home) else "via") for over in way.over]
        if k < len(labels):
            if not np.array_equal(entered[k], joints[k]):
                stops.append(Stop(entered[k], "approach"))
            stops.append(Stop(joints[k], "measure", labels[k]))
    stops.append(Stop(finder.home, "home"))
    cell = finder.check.cell
    distances = nearest_on(finder.check, np.array([stop.joints for stop in stops]))
    smallest = min(distances.values(), default=math.inf)
    limits = limits_notices(finder.check.robot, finder.low, finder.high)
    notices = (*limits, *cell_notices(finder.check))
    tour = Tour(
        tuple(stops), cell.floor, cell.clearance, smallest, cell.surface, distances, notices, finder.check.connected
    )
    _refuse_winding(finder, tour)
    return tour


def _refuse_near(finder: WayFinder, entered: Array, joints: Array, labels: Sequence[str]) -> None:
    looked = finder.check.ways(entered, joints)
    for k in np.flatnonzero(looked.distance < finder.check.cell.clearance).tolist():
        raise InputError(
            "a configuration is too near to what the arm keeps clear of",
            where=f"configuration {labels[k]}",
            came=f"{finder.check.words(int(looked.worst[k]))}: {max(looked.distance[k], 0.0) * 1e3:.1f} mm",
            allowed=f"{finder.check.cell.clearance * 1e3:g} mm or more",
            cure="Leave the configuration out, or lower `clearance`; `floor` says where the floor is.",
        )


def _refuse_way(finder: WayFinder, start: Array, end: Array, left: str, reached: str) -> None:
    way = finder.check.ways(start[None], end[None])
    raise InputError(
        "no way was found on which the arm keeps clear",
        where=f"from {left} to {reached}",
        came=f"on the straight one {finder.check.words(int(way.worst[0]))}: {max(way.distance[0], 0.0) * 1e3:.1f} mm",
        allowed=f"{finder.check.cell.clearance * 1e3:g} mm or more all the way",
        cure="Lower `clearance`, name another safe configuration (`home`), or leave one of the two out.",
    )


def _refuse_winding(finder: WayFinder, tour: Tour) -> None:
    """Refuse a tour on which a joint is turned further than once, which no cable follows."""
    joints = tour.joints
    for k, joint in enumerate(finder.check.arm.robot.joints):
        low, high = int(np.argmin(joints[:, k])), int(np.argmax(joints[:, k]))
        turned = float(joints[high, k] - joints[low, k])
        if joint.kind == "revolute" and turned > 2.0 * math.pi + 1e-9:
            names = [tour.stops[at].label or tour.stops[at].kind for at in (low, high)]
            raise InputError(
                f"joint {k + 1} is turned further than a cable follows",
                where=f"between {names[0]} and {names[1]}",
                came=f"{math.degrees(turned):.1f} deg",
                allowed="360 deg",
                cure="Leave out configurations in which it stands on another turn.",
            )
