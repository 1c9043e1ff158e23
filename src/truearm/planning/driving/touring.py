"""A tour through configurations to measure, from the safe one and back, each way checked."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.planning.driving.nearest import nearest_on
from truearm.planning.driving.said_of_cells import cell_notices, limits_notices
from truearm.planning.driving.tour import HOME, Stop, Tour
from truearm.planning.driving.ways import Way, WayFinder


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
    room = min(distances.values(), default=math.inf)
    limits = limits_notices(finder.check.robot, finder.low, finder.high)
    notices = (*limits, *cell_notices(finder.check))
    tour = Tour(
        tuple(stops), cell.floor, cell.clearance, room, cell.surface, distances, notices, finder.check.connected
    )
    _refuse_winding(finder, tour)
    return tour


def _refuse_near(finder: WayFinder, entered: Array, joints: Array, labels: Sequence[str]) -> None:
    looked = finder.check.ways(entered, joints)
    for k in np.flatnonzero(looked.room < finder.check.cell.clearance).tolist():
        raise InputError(
            "a configuration is too near to what the arm keeps clear of",
            where=f"configuration {labels[k]}",
            came=f"{finder.check.words(int(looked.worst[k]))}: {max(looked.room[k], 0.0) * 1e3:.1f} mm",
            allowed=f"{finder.check.cell.clearance * 1e3:g} mm or more",
            cure="Leave the configuration out, or lower `clearance`; `floor` says where the floor is.",
        )


def _refuse_way(finder: WayFinder, start: Array, end: Array, left: str, reached: str) -> None:
    looked = finder.check.ways(start[None], end[None])
    raise InputError(
        "no way was found on which the arm keeps clear",
        where=f"from {left} to {reached}",
        came=f"on the straight one {finder.check.words(int(looked.worst[0]))}: {max(looked.room[0], 0.0) * 1e3:.1f} mm",
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
