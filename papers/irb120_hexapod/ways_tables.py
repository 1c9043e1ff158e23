"""Tables of an IRB 120 calibrated with the hexapod device in several ways, beside a tracker."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from papers.irb120_hexapod.ways import TURNS, Way, Ways
from papers.study import Row, Table
from truearm.engine.robot.chain import Array


@dataclass(frozen=True)
class _Line:
    """A way: what it is called, where it is among all ways, and what is to be said of it."""

    name: str
    of: Callable[[Ways], Way]
    why: str = ""


_TRACKER: Final = _Line("tracker, 38 configurations", lambda ways: ways.tracker)
_LINES: Final = (
    _TRACKER,
    _Line("one place, 22 poses", lambda ways: ways.few, "The place of section 3.5."),
    _Line("one place", lambda ways: ways.one_place, "A flat fixture before the robot."),
    _Line("three places", lambda ways: ways.three_places, "Frames of the places and model are found in turn."),
    _Line(
        "three places, frames by touches",
        lambda ways: ways.by_touches,
        "Each place by the readings at its three cups and the model from the first place.",
    ),
    _Line(
        "three places, frames by touches, in turn",
        lambda ways: ways.by_touches_in_turn,
        f"The same {TURNS} times, each time with the model found before. It gets worse: what errs at the cups, up to"
        " 300 mm away from each other, turns and shifts a whole place, the model follows, and errs more at the cups.",
    ),
    _Line(
        "four cups",
        lambda ways: ways.four_cups,
        "All four sides of the tetrahedron, at one place. The bar says where they are to each other.",
    ),
    _Line(
        "one place, bar never put on its calibrator",
        lambda ways: ways.drifting,
        "A few um among a tenth of a millimetre.",
    ),
    _Line("one place, tool attached anew for every pose", lambda ways: ways.attached_anew),
    _Line(
        "one place, joints come from either side",
        lambda ways: ways.either_side,
        "Nothing was done against the lag of the joints.",
    ),
)


def ways_tables(outcomes: Sequence[Ways]) -> tuple[Table, Table]:
    """Return what each way leaves everywhere, and near the fixture."""
    return (
        Table(
            "Calibrated with the device, and with a tracker: everywhere",
            "Error of the three cups over unseen configurations of the region of section 2.5, in the frame of the"
            " instrument. The document has no such figures of the IRB 120; it hoped for more than from a tracker"
            " (section 3.6), and found a third of the tracker's accuracy with the LR Mate (chapter 4).",
            _rows(outcomes, lambda way: way.everywhere, explained=True),
        ),
        Table(
            "The same near the flat fixture",
            "Less than 200 mm from the middle of the poses.",
            _rows(outcomes, lambda way: way.near, explained=False),
        ),
    )


def _rows(outcomes: Sequence[Ways], errors: Callable[[Way], Array], *, explained: bool) -> tuple[Row, ...]:
    rows = []
    for line in _LINES:
        found = [line.of(ways) for ways in outcomes]
        count = int(np.median([way.configurations for way in found]))
        words = line.name if line is _TRACKER else f"{line.name} ({count} configurations)"
        mean = [1e3 * float(errors(way).mean()) for way in found]
        rows.append(Row(f"{words}: mean", "mm", mean, explanation=line.why if explained else ""))
        rows.append(Row(f"{words}: maximum", "mm", [1e3 * float(errors(way).max()) for way in found]))
    return tuple(rows)
