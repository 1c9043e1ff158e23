"""Whether files that have no other tie to the plan were read where it has them: where the tip rests, and is pushed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.measurement.performance.records import Pushes
from truearm.modeling.chain import Array
from truearm.planning.iso9283.planned import PerformancePlan
from truearm.validation.iso9283.settling import SettlingCurve

#: A tip may rest beside its command by this share of the cube's side, and in small cubes by this length [m].
_BESIDE: Final = 0.1
_LEAST_BESIDE: Final = 20e-3
#: The way to a pose may differ from the planned one by this length [m], and this share of it.
_OTHER_WAY: Final = 2e-3
_OTHER_SHARE: Final = 0.1
#: The ends of a record of which the mean is taken.
_END: Final = 5


def refuse_other_rests(plan: PerformancePlan, curves: Sequence[SettlingCurve], source: str) -> None:
    """Refuse records whose tip rests at another place than their pose, or made another way than the planned one.

    Raises:
        InputError: Naming the lines of the record.
    """
    for curve in curves:
        planned = plan.test(curve.test)
        assert planned is not None
        names = tuple(dict.fromkeys((*planned.places, *planned.approaches)))
        first = planned.places[0]
        name = curve.where.removeprefix(f"{first}-")
        where = f"{source}, lines {curve.lines[0]} to {curve.lines[-1]}"
        end = curve.position[-_END:].mean(axis=0)
        own = float(np.linalg.norm(end - plan.poses[name].position))
        apart = {other: float(np.linalg.norm(end - plan.poses[other].position)) for other in names}
        near = min(apart, key=lambda other: apart[other])
        if own > _allowed(plan):
            beside = f", {1e3 * apart[near]:.4g} mm from {near}" if near != name else ""
            raise InputError(
                f"the tip comes to rest at another place than {name} in cycle {curve.cycle} of {curve.test}",
                where=where,
                came=f"{1e3 * own:.4g} mm from {name}{beside}",
                allowed=f"up to {1e3 * _allowed(plan):.4g} mm",
                cure="Correct the name in the column pose, check the unit, and how the instrument is tied to the "
                "robot's base.",
            )
        if curve.test != "posing-time" or name == first:
            continue
        way = float(np.linalg.norm(plan.poses[name].position - plan.poses[first].position))
        made = float(np.linalg.norm(end - curve.position[:_END].mean(axis=0)))
        if abs(made - way) > _OTHER_WAY + _OTHER_SHARE * way:
            raise InputError(
                f"the way to {name} in cycle {curve.cycle} of {curve.test} is not the planned one",
                where=where,
                came=f"{1e3 * made:.4g} mm",
                allowed=f"{1e3 * way:.4g} mm within {1e3 * (_OTHER_WAY + _OTHER_SHARE * way):.3g} mm",
                cure=f"Record from rest in {first} on, and check the name in the column pose.",
            )


def refuse_other_push_place(plan: PerformancePlan, pushes: Pushes, position: Array) -> None:
    """Refuse pushes whose tip is not at the pose of the test where the force is least.

    Args:
        position: Of the pushes in the base frame [m], ``(n, 3)``.

    Raises:
        InputError: Naming the line.
    """
    test = plan.test("compliance")
    if test is None:
        return
    name = test.places[0]
    for direction in pushes.direction.names:
        rows = np.flatnonzero(pushes.direction.are(direction))
        for cycle in np.unique(pushes.cycle[rows]).tolist():
            mine = rows[pushes.cycle[rows] == cycle]
            row = int(mine[pushes.force[mine].argmin()])
            away = float(np.linalg.norm(position[row] - plan.poses[name].position))
            if away > _allowed(plan):
                raise InputError(
                    f"the tip is not at {name} where it is pushed least in cycle {cycle} of the direction {direction}",
                    where=f"{pushes.source}, line {int(pushes.line[row])}",
                    came=f"{1e3 * away:.4g} mm from it",
                    allowed=f"up to {1e3 * _allowed(plan):.4g} mm",
                    cure="Check the unit of this file, and that it was read with the instrument where it stood for the "
                    "others.",
                )


def _allowed(plan: PerformancePlan) -> float:
    return max(_BESIDE * plan.cube.side, _LEAST_BESIDE)
