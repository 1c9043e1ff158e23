"""Readings that are excluded."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from truearm.engine.base.errors import Notice, Rule, counted, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.excluded import Exclusion, read_exclusions, without_readings
from truearm.engine.data.statistics import Errors, errors_of, without_table_motion
from truearm.engine.document.document import Block, say
from truearm.engine.robot.robot import Robot

Part = Literal["training", "held out", "left out"]
_OF: Final = {
    "training": "of the training part",
    "held out": "of the held-out part",
    "left out": "of configurations that are left out",
}


@dataclass(frozen=True)
class Excluded:
    """An exclusion, and what it means for a result."""

    row: Exclusion  #: Of the file of exclusions.
    readings: int  #: How many readings it means.
    part: Part  #: The part of the split that they would belong to; ``left out`` if their whole configuration is.


def excluded_block(excluded: Sequence[Excluded]) -> Block:
    """Return how many readings of each part were excluded, and why."""
    parts = Counter[str]()
    for exclusion in excluded:
        parts[exclusion.part] += exclusion.readings
    by_part = ", ".join(f"{count} {_OF[part]}" for part, count in parts.items())
    rows = [
        {
            "configuration": exclusion.row.configuration,
            "target": exclusion.row.target,
            **({"visit": exclusion.row.visit} if exclusion.row.visit else {}),
            **({"fixture": exclusion.row.fixture} if exclusion.row.fixture else {}),
            "reason": exclusion.row.reason,
            "readings": exclusion.readings,
            "part": exclusion.part,
        }
        for exclusion in excluded
    ]
    return say(f"Excluded: {counted(parts.total(), 'reading')} ({by_part}): {reasons(excluded)}", excluded=rows)


def reasons(excluded: Sequence[Excluded]) -> str:
    """Return the reasons, each with how many readings have it."""
    counter = Counter[str]()
    for exclusion in excluded:
        counter[exclusion.row.reason] += exclusion.readings
    return ", ".join(f"{reason} ({count})" for reason, count in counter.items())


_RULE: Final = (
    "Exclude readings for reasons of the instrument alone: to exclude what fits badly, or to repeat it, falsifies the "
    "proof."
)


def without_excluded(data: Dataset, exclude: str | Path | None) -> tuple[Dataset, tuple[Excluded, ...]]:
    """Return data in which the readings that a file excludes are missing, and these, all of them as of training.

    Raises:
        InputError: If the file cannot be used, or excludes what was not read.
    """
    if exclude is None:
        return data, ()
    path = path_argument(exclude, "exclude")
    with refusals_of("exclude"):
        rows = read_exclusions(path)
        remaining, counts = without_readings(data, rows)
    return remaining, tuple(Excluded(row, count, "training") for row, count in zip(rows, counts, strict=True))


def in_parts(excluded: tuple[Excluded, ...], split: Dataset, held_out: IntArray) -> tuple[Excluded, ...]:
    """Return excluded readings with the part of a split that they would belong to.

    Args:
        split: The data that were split.
    """
    judging, known = {split.labels[c] for c in held_out.tolist()}, set(split.labels)

    def part(label: str) -> Part:
        return "held out" if label in judging else "training" if label in known else "left out"

    return tuple(Excluded(entry.row, entry.readings, part(entry.row.configuration)) for entry in excluded)


def count_excluded(excluded: tuple[Excluded, ...]) -> dict[str, int]:
    """Return how many readings of each target are excluded, of configurations that are not left out."""
    counter = Counter[str]()
    for exclusion in excluded:
        if exclusion.part != "left out":
            counter[exclusion.row.target] += exclusion.readings
    return dict(counter)


EXCLUDED: Final = Rule(
    "excluded",
    "note",
    "readings that [`exclude`](results.md#excluding-readings) leaves out, with their reasons; they count as missing",
)


def excluded_notices(excluded: tuple[Excluded, ...]) -> list[Notice]:
    """Say how many readings are excluded, before any split."""
    count = sum(exclusion.readings for exclusion in excluded)
    if not count:
        return []
    return [
        EXCLUDED(
            f"{counted(count, 'reading')} {'is' if count == 1 else 'are'} excluded: {reasons(excluded)}. Excluded "
            f"readings count as missing. {_RULE}"
        )
    ]


HELD_OUT_EXCLUDED: Final = Rule(
    "held-out-excluded",
    "warning",
    "readings that would judge are [excluded](results.md#excluding-readings); what the held-out errors are with them "
    "and without",
    gravity=2,
)


def check_excluded(
    excluded: tuple[Excluded, ...], robot: Robot, as_read: Dataset | None, held_out: IntArray, without: Errors | None
) -> list[Notice]:
    """Say if readings are excluded by which a fit would be judged, and what the errors are with them.

    Args:
        robot: The calibrated one.
        as_read: The data that were split, with the excluded readings; None if they cannot be compared.
        without: Errors on the held-out part as it judges; None if there is none.
    """
    of_held_out = tuple(exclusion for exclusion in excluded if exclusion.part == "held out")
    count = sum(exclusion.readings for exclusion in of_held_out)
    if not count:
        return []
    advice = ""
    if as_read is not None and without is not None:
        whole = errors_of(robot, without_table_motion(as_read).of_configurations(held_out))
        some, every = without.position or without.length, whole.position or whole.length
        if some is not None and every is not None:
            it = "it" if count == 1 else "them"
            advice = (
                f" With {it} the held-out errors are {every.mean * 1e3:.3f} mm on average and {every.max * 1e3:.3f} mm "
                f"at most; without {it} {some.mean * 1e3:.3f} and {some.max * 1e3:.3f} mm."
            )
    return [
        HELD_OUT_EXCLUDED(
            f"{counted(count, 'reading')} of the held-out part {'is' if count == 1 else 'are'} excluded: "
            f"{reasons(of_held_out)}.{advice} {_RULE}"
        )
    ]
