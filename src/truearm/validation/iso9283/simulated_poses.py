"""Simulated tests by ISO 9283 at poses: accuracy, distances, exchange of robots, approaches and drift."""

from __future__ import annotations

from typing import Final

from truearm.planning.iso9283.planned import PlannedTest
from truearm.validation.iso9283.simulated_cell import Cell, conditions

#: From one group of cycles to the next where the drift is watched [s].
_BETWEEN_GROUPS: Final = 1800.0
#: How many robots are exchanged.
ROBOTS: Final = 5


def run_poses(cell: Cell, test: PlannedTest) -> None:
    """Go to all poses in turn, cycle by cycle; where robots are exchanged, with each of them."""
    for robot in range(ROBOTS if test.id == "E" else 1):
        for load, velocity in conditions(test):
            came = cell.joints(test.places[0] if len(test.places) > 1 else cell.other(test.places[0]), load)
            for cycle in range(1, test.cycles + 1):
                for place in reversed(test.places):
                    came = cell.stand(test, robot, place, cycle, "", velocity, load, came)


def run_approaches(cell: Cell, test: PlannedTest) -> None:
    """Go to each pose from each side."""
    for load, velocity in conditions(test):
        for place in test.places:
            for cycle in range(1, test.cycles + 1):
                for approach in test.approaches:
                    start = cell.joints(f"{place} from {approach}", load)
                    cell.stand(test, 0, place, cycle, approach, velocity, load, start)


def run_drift(cell: Cell, test: PlannedTest) -> None:
    """Measure groups of cycles from cold, every half hour; cycles are counted through all groups."""
    load, velocity = test.loads[0], test.velocities[0]
    place = test.places[0]
    away = cell.joints(cell.other(place), load)
    cycle, begin = 0, cell.now
    while cell.now - begin <= cell.plan.hours * 3600.0:
        group = cell.now
        for _ in range(test.cycles):
            cycle += 1
            cell.stand(test, 0, place, cycle, "", velocity, load, away)
        cell.now = max(cell.now, group + _BETWEEN_GROUPS)
