"""Pushes that lie far from the straight line of the others of their direction and cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.validation.iso9283.compliance import PushLine
from truearm.validation.iso9283.values import Instrument

#: A push is wild that lies so many deviations off its line, and so many times as far as any other that is left.
_FAR: Final = 8.0
_BEYOND: Final = 2.2
#: The scatter is never taken below this share of the instrument's.
_LEAST_SCATTER: Final = 1.0 / 3.0
#: Fewer forces show no line.
_LEAST_FORCES: Final = 4


@dataclass(frozen=True)
class WildPush:
    """A push that lies far from the line of the others."""

    direction: str  #: direction, cycle, line: which; the line of the file.
    cycle: int
    line: int
    force: float  #: [N].
    away: float  #: How far from the line of the others, along the force [m].
    value: float  #: value, without: compliance of the direction with it, and without [m/N].
    without: float


def wild_pushes(lines: Sequence[PushLine], instrument: Instrument) -> tuple[WildPush, ...]:
    """Return pushes that are further off their line than all others by more than scatter does, one a line."""
    lines = [one for one in lines if len(one.force) >= _LEAST_FORCES]
    if not lines:
        return ()
    off = [_off(one.force, one.displacement) for one in lines]
    scatter = max(1.4826 * float(np.median(np.concatenate(off))), instrument.least_scatter(_LEAST_SCATTER)[0], 1e-12)
    order = np.argsort([-one.max() for one in off], kind="stable")
    wild = 0
    for k in range(1, max(1, len(lines) // 3) + 1):
        chosen = order[:k]
        left = [float(off[one].max()) for one in order[k:]]
        left += [float(_off(*_without(lines[one], int(off[one].argmax()))).max()) for one in chosen]
        if off[chosen[-1]].max() > max(_FAR * scatter, _BEYOND * max(left)):
            wild = k
    slopes = {one.direction: [other.slope for other in lines if other.direction == one.direction] for one in lines}
    found = []
    for number in sorted(order[:wild]):
        one, row = lines[number], int(off[number].argmax())
        force, moved = _without(one, row)
        slope, rest = np.polyfit(force, moved, 1)
        mine = slopes[one.direction]
        value = float(np.mean(mine))
        away = float(abs(one.displacement[row] - rest - slope * one.force[row]))
        without = value + (float(slope) - one.slope) / len(mine)
        line = int(one.line[row])
        found.append(WildPush(one.direction, one.cycle, line, float(one.force[row]), away, value, without))
    return tuple(found)


def _without(one: PushLine, row: int) -> tuple[Array, Array]:
    return np.delete(one.force, row), np.delete(one.displacement, row)


def _off(force: Array, moved: Array) -> Array:
    """Return how far each point is from the line of all, in the scatter of a reading, ``(n,)``."""
    about = force - force.mean()
    squares = float(about @ about)
    if not squares > 0:
        return np.zeros(len(force))
    lever = 1.0 / len(force) + about**2 / squares
    left = moved - moved.mean() - about * float(about @ moved) / squares
    return np.asarray(np.abs(left) / np.sqrt(np.maximum(1.0 - lever, 1e-3)))
