"""What tests by ISO 9283 keep clear of where somebody has stated the cell, by the rules of plans of measurements."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.compensation.iso9283.programs import driven_ways
from truearm.errors import InputError
from truearm.jobs.driving import cell_argument
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot
from truearm.planning.constraints.constraints import Constraints, allowed, limits_of, refuse_clearance_of
from truearm.planning.driving.cell import Cell
from truearm.planning.driving.collisions import CollisionCheck
from truearm.planning.driving.joint_window import joint_window
from truearm.planning.driving.nearest import nearest_on
from truearm.planning.driving.tour_table import distance_words
from truearm.planning.iso9283.planned import PerformancePlan
from truearm.shown import counted

#: A message names no more ways.
_MOST_NAMED: Final = 3


@dataclass(frozen=True, eq=False)
class StatedCell:
    """A cell in which tests are driven."""

    robot: Robot  #: With its target, within the limits of the constraints.
    cell: Cell  #: Floor, boxes, and the room to keep.
    check: CollisionCheck  #: Of that room.
    #: rules, where: what else holds at every pose and on every path, and the file that says so.
    rules: Constraints | None
    where: str

    def unclear(self, joints: Array) -> str:
        """Return what is not kept at joint positions ``(n, joints)``, in words; nothing if all is."""
        own = bool(self.robot.targets)
        kept = allowed(self.robot, Postures(joints), self.rules, self.where, seen_from_the_origin=own)
        broken = [name for name, held in kept.items() if not held.all()]
        if broken:
            return f"{', '.join(broken)} of the constraints"
        rooms = self.check.rooms(joints)
        if not rooms.size or rooms.min() >= self.check.need:
            return ""
        return self._near(int(np.unravel_index(int(np.argmin(rooms)), rooms.shape)[0]), float(rooms.min()))

    def unsuited(self, plan: PerformancePlan) -> str:
        """Return which ways of a plan cannot be driven, in words; nothing if all can."""
        try:
            ways = driven_ways(plan)
        except InputError as error:
            return f"{error.what} ({error.where})"
        near = {}
        for name, joints in ways.items():
            looked = self.check.ways(joints[:-1], joints[1:])
            if len(looked.room) and looked.room.min() < self.cell.clearance:
                at = int(np.argmin(looked.room))
                near[name] = (float(looked.room[at]), int(looked.worst[at]))
        if not near:
            return ""
        worst = sorted(near, key=lambda name: near[name][0])
        room, number = near[worst[0]]
        named = "; ".join(worst[:_MOST_NAMED]) + ("; and others" if len(near) > _MOST_NAMED else "")
        return f"{len(near)} of {counted(len(ways), 'way')} are not clear ({named}; nearest {self._near(number, room)})"

    def words(self, plan: PerformancePlan) -> str:
        """Say what all ways of a plan keep, that is suited."""
        distances: dict[str, float] = {}
        ways = driven_ways(plan).values()
        for joints in ways:
            for what, room in nearest_on(self.check, joints).items():
                distances[what] = min(room, distances.get(what, math.inf))
        nearest_first = dict(sorted(distances.items(), key=lambda item: item[1]))
        near = distance_words(nearest_first, self.cell.floor, self.cell.surface, self.check.connected)
        return f"On all {counted(len(ways), 'way')} the arm stays {near}." if near else ""

    def _near(self, number: int, room: float) -> str:
        return f"{self.check.words(number)}, {max(room, 0.0) * 1e3:.0f} mm"


def stated_cell(robot: Robot, rules: Constraints | None, where: str, clearance: float | None) -> StatedCell | None:
    """Return the cell that was stated; None if none was.

    Args:
        robot: With the target that is measured.
        rules, where: Constraints as for plans of measurements, and the file that says so.
        clearance: Room to keep [m]; None for 50 mm.

    Raises:
        InputError: If a box holds the base, limits leave a joint nothing, or a length cannot be.
    """
    if rules is None and clearance is None:
        return None
    cell = cell_argument(robot, rules, where, None, False, clearance)
    joint_window(robot, rules, where)  # refuses limits that leave nothing
    refuse_clearance_of(robot, rules, where)
    low, high = limits_of(robot, rules, where)
    joints = tuple(
        joint if not np.isfinite([a, b]).all() else replace(joint, limits=(float(a), float(b)))
        for joint, a, b in zip(robot.joints, low, high, strict=True)
    )
    arm = replace(robot, joints=joints)
    return StatedCell(arm, cell, CollisionCheck(arm, cell), rules, where)
