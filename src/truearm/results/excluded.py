"""Readings that were excluded, as results tell of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from truearm.measurement.excluded import Exclusion
from truearm.shown import counted

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

    def summary(self) -> dict[str, str | int]:
        """Return it as JSON holds it."""
        row = self.row
        return {
            "configuration": row.configuration,
            "target": row.target,
            **({"visit": row.visit} if row.visit else {}),
            **({"fixture": row.fixture} if row.fixture else {}),
            "reason": row.reason,
            "readings": self.readings,
            "part": self.part,
        }


def excluded_line(excluded: Sequence[Excluded]) -> str:
    """Return how many readings of each part were excluded, and why."""
    parts = Counter[str]()
    for one in excluded:
        parts[one.part] += one.readings
    told = ", ".join(f"{count} {_OF[part]}" for part, count in parts.items())
    return f"Excluded: {counted(parts.total(), 'reading')} ({told}): {reasons(excluded)}"


def reasons(excluded: Sequence[Excluded]) -> str:
    """Return the reasons, each with how many readings have it."""
    found = Counter[str]()
    for one in excluded:
        found[one.row.reason] += one.readings
    return ", ".join(f"{reason} ({count})" for reason, count in found.items())
