"""Readings that are those of another cycle to the last digit: copied, or held by the instrument.

No robot comes back to where it was to the last digit of a reading that is finer than it scatters. Rounded readings may
be equal by chance, and how often is known from how finely they are rounded.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.measurement.performance.records import AttainedPoses, Names, Samples
from truearm.modeling.chain import Array

#: Equal rows are copies if fewer pairs of them than this are to be expected in a group by chance.
_BY_CHANCE: Final = 1e-3
#: Differences below this are rounding in the computer [m].
_SAME: Final = 1e-11
#: Chance that two Gaussian numbers with a standard deviation of 1 lie within a small width, per width.
_DENSITY: Final = 0.5 / np.sqrt(np.pi)
#: So many samples in a row, each elsewhere than all others, are not passed twice to the last digit.
_BLOCK: Final = 10


@dataclass(frozen=True)
class CopiedBlock:
    """Samples of a cycle that are those of another one to the last digit."""

    test: str  #: test, place: where.
    place: str
    cycles: tuple[int, int]  #: The first one and the one that is like it; 0 in a stream.
    lines: tuple[int, int]  #: Of the first samples of both.
    count: int  #: How many samples.


def refuse_copied_poses(readings: AttainedPoses) -> None:
    """Refuse two cycles of a pose with one and the same position, where rounding cannot explain it.

    Raises:
        InputError: If there are such rows, naming the first two.
    """
    columns = [readings.criterion.code, readings.pose.code, readings.robot.code, readings.approach.code]
    shares = [np.unique(share, return_inverse=True)[1].reshape(-1) for share in (readings.velocity, readings.load)]
    group = np.unique(np.column_stack([*columns, *shares]), axis=0, return_inverse=True)[1].reshape(-1)
    order = np.argsort(group, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(group[order])) + 1)
    scatters = [readings.position[rows].std(axis=0, ddof=1) for rows in groups if len(rows) > 1]
    if not scatters:
        return
    usual = _middle(np.array(scatters))
    step = _resolution(readings.position)
    found: list[tuple[int, int]] = []
    for rows in groups:
        pairs = _equal(readings.position[rows])
        if not pairs:
            continue
        own = readings.position[rows].std(axis=0, ddof=1)
        scatter = np.where(own > _SAME, np.minimum(own, usual), usual)
        if not (scatter > _SAME).all():
            continue
        chance = float(np.prod(np.minimum(_DENSITY * step / scatter, 1.0))) * len(rows) * (len(rows) - 1) / 2
        if chance < _BY_CHANCE:
            found += [(int(rows[one]), int(rows[other])) for one, other in pairs]
    if not found:
        return
    one, other = min(found, key=lambda pair: pair[1])
    raise InputError(
        f"{len(found)} row{'s' * (len(found) != 1)} with the position of another cycle of the same pose, to the last "
        "digit",
        where=f"{readings.source}, lines {int(readings.line[one])} and {int(readings.line[other])}",
        came=f"cycles {int(readings.cycle[one])} and {int(readings.cycle[other])} of {_name(readings.pose, one)}",
        allowed="readings that scatter as those of the other cycles",
        cure="A row was copied, or the instrument held its value: write what was read, or remove the cycle.",
    )


def copied_blocks(samples: Samples) -> tuple[CopiedBlock, ...]:
    """Return samples of a cycle that another one of the same place has too, one block for each two cycles."""
    found: dict[tuple[str, str, int, int], CopiedBlock] = {}
    place = np.unique(np.column_stack([samples.criterion.code, samples.place.code]), axis=0, return_inverse=True)[1]
    place = place.reshape(-1)
    bits = np.ascontiguousarray(samples.position).view(np.uint64)
    with np.errstate(over="ignore"):
        mixed = (bits * np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)).sum(axis=1)
    for which in range(int(place.max(initial=-1)) + 1):
        rows = np.flatnonzero(place == which)
        for first, second, count in _blocks(mixed[rows], samples.cycle[rows]):
            one, other = int(rows[first]), int(rows[second])
            if not (samples.position[one] == samples.position[other]).all():
                continue
            cycles = int(samples.cycle[one]), int(samples.cycle[other])
            test, name = _name(samples.criterion, one), _name(samples.place, one)
            block = CopiedBlock(test, name, cycles, (int(samples.line[one]), int(samples.line[other])), count)
            known = found.get((test, name, *cycles))
            if known is None or known.count < count:
                found[test, name, *cycles] = block
    return tuple(found.values())


def _blocks(mixed: NDArray[np.uint64], cycle: NDArray[np.intp]) -> list[tuple[int, int, int]]:
    """Return where samples go on as others before them did: the first of both, and how many."""
    order = np.argsort(mixed, kind="stable")
    equal = mixed[order[1:]] == mixed[order[:-1]]
    before = np.full(len(mixed), -1, dtype=np.intp)
    before[order[1:][equal]] = order[:-1][equal]
    moving = (np.diff(mixed) != 0) & (np.diff(cycle) == 0)
    goes_on = (before[1:] == before[:-1] + 1) & (before[:-1] >= 0) & moving
    edges = np.flatnonzero(np.diff(np.concatenate([[False], goes_on, [False]]).astype(np.int8))).reshape(-1, 2)
    long = [(a, b) for a, b in edges.tolist() if b - a + 1 >= _BLOCK and len(set(mixed[a : b + 1].tolist())) >= _BLOCK]
    return [(int(before[a]), a, b - a + 1) for a, b in long]


def _equal(position: Array) -> list[tuple[int, int]]:
    """Return rows that equal another one, each with the first of them."""
    _, first, which = np.unique(position, axis=0, return_index=True, return_inverse=True)
    of = first[which.reshape(-1)]
    return [(int(of[row]), row) for row in range(len(position)) if of[row] != row]


def _resolution(position: Array) -> float:
    """Return the smallest difference of two coordinates that are not equal [m]: no coarser were they rounded."""
    steps = np.concatenate([np.diff(np.sort(column)) for column in position.T])
    steps = steps[steps > _SAME]
    return float(steps.min()) if len(steps) else float("inf")


def _middle(scatters: Array) -> Array:
    """Return the middle of the scatters that are not 0, axis by axis; 0 where all are."""
    return np.array([np.median(column[column > _SAME]) if (column > _SAME).any() else 0.0 for column in scatters.T])


def _name(names: Names, row: int) -> str:
    return names.names[int(names.code[row])]
