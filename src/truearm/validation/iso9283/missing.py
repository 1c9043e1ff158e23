"""What a test lacks that was measured otherwise: poses, approaches, robots, paths without a row."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final

from truearm.planning.iso9283.criteria import TEST_OF, TESTS
from truearm.planning.iso9283.planned import PerformancePlan, PlannedTest
from truearm.validation.iso9283.pose_rows import Cycles
from truearm.validation.iso9283.values import Conditions, Value

#: Robots that are exchanged.
ROBOTS: Final = 5


def missing_rows(plan: PerformancePlan, cycles: Sequence[Cycles]) -> tuple[str, ...]:
    """Return what is missing in tests of poses that have rows: ``AP: P3``, ``vAP: P2 from y``, ``AP: P3 at 50 %``."""
    found = []
    for test in plan.tests:
        mine = [one for one in cycles if one.test == test.id]
        if mine:
            robots = sorted({one.robot for one in mine})
            found += [line for robot in robots for line in _missing_of(test, mine, robot, len(robots) > 1)]
            if test.id == "E" and len(robots) < ROBOTS:
                found.append(f"E: {ROBOTS - len(robots)} of {ROBOTS} robots")
    return tuple(found)


def _missing_of(test: PlannedTest, cycles: Sequence[Cycles], robot: str, several: bool) -> list[str]:
    there = {(one.pose, one.approach, one.velocity, one.load) for one in cycles if one.robot == robot}
    of = f" of {robot}" if several else ""
    approaches = test.approaches if test.id == "vAP" else ("",)
    conditions = [*product(test.velocities, test.loads)]
    found = []
    for pose, approach in product(test.places, approaches):
        absent = [under for under in conditions if (pose, approach, *under) not in there]
        where = f"{test.id}: {pose}{f' from {approach}' if approach else ''}"
        found += [f"{where}{of}{under}" for under in _at(absent, conditions, test)]
    return found


def _at(absent: Sequence[tuple[float, float]], all_: Sequence[tuple[float, float]], test: PlannedTest) -> list[str]:
    """Return under which conditions, in words; nothing to say of all of them."""
    if len(absent) == len(all_):
        return [""]
    return [
        f" at {100 * velocity:g} %{f', load {100 * load:g} %' if len(test.loads) > 1 else ''}"
        for velocity, load in absent
    ]


@dataclass(frozen=True)
class MissingPlace:
    """A place of a test under a condition that has no value, while others of the test have one."""

    test: str  #: test, where: which, the place as values have it.
    where: str
    conditions: Conditions  #: As values have them.
    words: str  #: ``AT: line``, ``AT: line at 50 %``.


def missing_places(plan: PerformancePlan, values: Sequence[Value]) -> tuple[MissingPlace, ...]:
    """Return what is missing in tests of paths, of settling and of forces that have values."""
    found = []
    for test in plan.tests:
        mine = [v for v in values if TEST_OF[v.id] == test.id and math.isfinite(v.value)]
        if TESTS[test.id].readings == "poses" or not mine:
            continue
        conditions = [*product(test.velocities, test.loads)]
        for place in test.approaches or test.places:
            here = [v.conditions for v in mine if _is_at(v.where, place)]
            absent = [under for under in conditions if not any(_is_under(one, under) for one in here)]
            where = f"{test.places[0]}-{place}" if test.id == "posing-time" else place
            for under, words in zip(absent, _at(absent, conditions, test), strict=False):
                known = mine[0].conditions
                velocity = None if known.velocity is None else under[0]
                load = None if known.load is None else under[1]
                found.append(MissingPlace(test.id, where, Conditions(velocity, load), f"{test.id}: {where}{words}"))
    return tuple(found)


def _is_at(where: str, place: str) -> bool:
    """Return whether a value is of a place: ``rectangle E2`` of the rectangle, ``P1-D10`` of D10."""
    return where == place or where.startswith(f"{place} ") or where.endswith(f"-{place}")


def _is_under(one: Conditions, under: tuple[float, float]) -> bool:
    """Return whether a value is of a velocity and a load, which are not said where they do not matter."""
    return all(
        own is None or abs(own - planned) < 1e-6 for own, planned in zip((one.velocity, one.load), under, strict=True)
    )
