"""Static compliance of ISO 9283, and pushes that lie far from the line of the others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.alignment import Alignment
from truearm.iso9283.criteria.rows import AXES, Conditions, Instrument, Value, valued
from truearm.iso9283.planning.criteria import PerformancePlan
from truearm.iso9283.planning.records import Pushes

# Public descriptions of ISO 9283:1998: the tip is pushed and pulled along each base axis in steps of a tenth of the
# rated load, and the displacement is given per force. Here it is the slope of a straight line through the steps of each
# cycle, along the force, so that the place of the unloaded tip does not count. Play that the first step takes up is a
# part of the displacement, and of the slope: 20 um at the first of eleven steps to 29 N add 0.3 um/N.

#: Standard gravity [m/s^2]: what the rated load weighs.
GRAVITY: Final = 9.80665
#: Forces may exceed the rated load's weight by rounding, as people round 98.07 N to 100 N.
_ROUNDING: Final = 0.05
_NOTHING: Final = math.nan
#: Scatter gives a tip that moves against the force by no more than so many standard errors.
_AGAINST: Final = 6.0


@dataclass(frozen=True, eq=False)
class PushLine:
    """Displacements of one direction in one cycle, and the line through them."""

    direction: str  #: direction, cycle: which.
    cycle: int
    force: Array  #: [N], ``(n,)``.
    displacement: Array  #: Along the force, from where the line is without force [m], ``(n,)``.
    slope: float  #: Along the force [m/N].
    slopes: Array  #: Of all three coordinates in the base frame, ``(3,)`` [m/N].
    line: NDArray[np.intp]  #: Of each push in the file, ``(n,)``.


def evaluate_pushes(
    plan: PerformancePlan, pushes: Pushes, alignment: Alignment, instrument: Instrument
) -> tuple[tuple[Value, ...], tuple[PushLine, ...]]:
    """Return the compliance of each direction, the mean of its cycles with the least and the largest, and all lines.

    There is no interval: three cycles say too little of their own scatter.

    Raises:
        InputError: For forces above the weight of the rated load, a direction that the plan does not have, a test that
            it does not have, a cycle whose forces are all the same, and a tip that moves against the force.
    """
    test = plan.test("compliance")
    if test is None:
        raise InputError(
            "the plan has no test of compliance", where=pushes.source, cure="Plan the test, or leave the file out."
        )
    directions = test.approaches or tuple(sign + axis for axis in AXES for sign in "+-")
    _check(plan, pushes, directions)
    turn = alignment.T_base_instrument.rotation
    values, lines = [], []
    for direction in directions:
        along = np.zeros(3)
        along["xyz".index(direction[1])] = 1.0 if direction[0] == "+" else -1.0
        way = pushes.position @ (turn.T @ along)
        in_direction = pushes.direction.are(direction)
        chosen = [
            (int(cycle), np.flatnonzero(in_direction & (pushes.cycle == cycle)))
            for cycle in np.unique(pushes.cycle[in_direction])
        ]
        push_lines = [_line(pushes, direction, cycle, rows, way, turn, instrument.sigma) for cycle, rows in chosen]
        slopes = np.array([line.slope for line in push_lines])
        # What a reading leaves open of a slope, as the steps spread over the forces.
        unknown = max((instrument.sigma / _spread(line.force) for line in push_lines), default=0.0)
        values.append(
            valued(
                "compliance",
                "position",
                direction,
                len(push_lines),
                test.cycles,
                Conditions(),
                float(slopes.mean()) if push_lines else _NOTHING,
                "compliance",
                None,
                unknown,
                least=float(slopes.min()) if push_lines else None,
                largest=float(slopes.max()) if push_lines else None,
            )
        )
        lines += push_lines
    return tuple(values), tuple(lines)


def _spread(force: Array) -> float:
    """Return the root of the sum of squares of forces about their mean [N]."""
    return float(np.linalg.norm(force - force.mean()))


def _line(
    pushes: Pushes, direction: str, cycle: int, rows: NDArray[np.intp], way: Array, turn: Array, sigma: float
) -> PushLine:
    rows = rows[np.lexsort((way[rows], pushes.force[rows]))]
    force = pushes.force[rows]
    if not _spread(force) > 1e-9 * max(float(force.max()), 1.0):
        raise InputError(
            f"cycle {cycle} of the direction {direction} has one force alone",
            where=f"{pushes.source}, line {int(pushes.line[rows[0]])}",
            came=f"{force[0]:.6g} N",
            allowed="two forces or more",
            cure="Push in steps of a tenth of the rated load, the unloaded tip first.",
        )
    about = force - force.mean()
    moved = way[rows]
    slope = float(about @ moved / (about @ about))
    intercept = float(moved.mean() - slope * force.mean())
    scatter = max(float(np.std(moved - intercept - slope * force)), sigma)
    if slope < -_AGAINST * scatter / _spread(force):
        raise InputError(
            f"the tip moves against the force in cycle {cycle} of the direction {direction}",
            where=f"{pushes.source}, line {int(pushes.line[rows].min())}",
            came=f"{1e3 * slope:.4g} mm/N",
            cure="Check the sign of the direction, and how the instrument was tied to the robot's base.",
        )
    slopes = about @ (pushes.position[rows] - pushes.position[rows].mean(axis=0)) @ turn.T / (about @ about)
    return PushLine(direction, cycle, force, moved - intercept, slope, slopes, pushes.line[rows])


def _check(plan: PerformancePlan, pushes: Pushes, directions: tuple[str, ...]) -> None:
    for direction in pushes.direction.names:
        rows = pushes.direction.are(direction)
        if direction not in directions and rows.any():
            raise InputError(
                "the plan does not have this direction",
                where=f"{pushes.source}, line {int(pushes.line[np.argmax(rows)])}, column direction",
                came=direction,
                allowed=", ".join(directions),
                cure="Remove its rows, or use the plan that was measured.",
            )
    most = GRAVITY * plan.rated_load
    above = pushes.force > most * (1.0 + _ROUNDING)
    if above.any():
        row = int(np.argmax(above))
        raise InputError(
            "the force is above the weight of the rated load",
            where=f"{pushes.source}, line {int(pushes.line[row])}, column force",
            came=f"{pushes.force[row]:.6g} N",
            allowed=f"up to {most:.4g} N, the weight of {plan.rated_load:.4g} kg",
            cure="Correct the row or its unit, or the rated load of the plan.",
        )


#: A push is outlying that lies so many deviations off its line, and so many times as far as any other that is left.
_FAR: Final = 8.0
_BEYOND: Final = 2.2
#: The scatter is never taken below this share of the instrument's.
_LEAST_SCATTER: Final = 1.0 / 3.0
#: Fewer forces show no line.
_LEAST_FORCES: Final = 4


@dataclass(frozen=True)
class OutlyingPush:
    """A push that lies far from the line of the others."""

    direction: str  #: direction, cycle, line: which; the line of the file.
    cycle: int
    line: int
    force: float  #: [N].
    away: float  #: How far from the line of the others, along the force [m].
    value: float  #: value, without: compliance of the direction with it, and without [m/N].
    without: float


def outlying_pushes(lines: Sequence[PushLine], instrument: Instrument) -> tuple[OutlyingPush, ...]:
    """Return pushes that are further off their line than all others by more than scatter does, one a line."""
    lines = [line for line in lines if len(line.force) >= _LEAST_FORCES]
    if not lines:
        return ()
    off = [_off(candidate.force, candidate.displacement) for candidate in lines]
    scatter = max(1.4826 * float(np.median(np.concatenate(off))), instrument.least_scatter(_LEAST_SCATTER)[0], 1e-12)
    order = np.argsort([-distances.max() for distances in off], kind="stable")
    outlying = 0
    for k in range(1, max(1, len(lines) // 3) + 1):
        chosen = order[:k]
        left = [float(off[index].max()) for index in order[k:]]
        left += [float(_off(*_without(lines[index], int(off[index].argmax()))).max()) for index in chosen]
        if off[chosen[-1]].max() > max(_FAR * scatter, _BEYOND * max(left)):
            outlying = k
    slopes = {line.direction: [other.slope for other in lines if other.direction == line.direction] for line in lines}
    outliers = []
    for number in sorted(order[:outlying]):
        push, row = lines[number], int(off[number].argmax())
        force, moved = _without(push, row)
        slope, intercept = np.polyfit(force, moved, 1)
        slopes_alike = slopes[push.direction]
        value = float(np.mean(slopes_alike))
        away = float(abs(push.displacement[row] - intercept - slope * push.force[row]))
        without = value + (float(slope) - push.slope) / len(slopes_alike)
        file_line = int(push.line[row])
        outliers.append(
            OutlyingPush(push.direction, push.cycle, file_line, float(push.force[row]), away, value, without)
        )
    return tuple(outliers)


def _without(push: PushLine, row: int) -> tuple[Array, Array]:
    return np.delete(push.force, row), np.delete(push.displacement, row)


def _off(force: Array, moved: Array) -> Array:
    """Return how far each point is from the line of all, in the scatter of a reading, ``(n,)``."""
    about = force - force.mean()
    squares = float(about @ about)
    if not squares > 0:
        return np.zeros(len(force))
    lever = 1.0 / len(force) + about**2 / squares
    left = moved - moved.mean() - about * float(about @ moved) / squares
    return np.asarray(np.abs(left) / np.sqrt(np.maximum(1.0 - lever, 1e-3)))
