"""What limits the accuracy, as JSON and the command show it, in mm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

from truearm.identification.judging.error_budget import ErrorBudget, Share

#: What the sources are called where people read.
_SOURCES: Final = {
    "instrument": "instrument noise",
    "table": "table motion",
    "repeatability": "repeatability",
    "model": "what the model cannot express",
    "parameters": "uncertain parameters",
    "remainder": "remainder",
}
_APPARENT: Final = "apparent noise"

#: Many times the shares is not called the same, however uncertain: outliers make anything uncertain.
_ALIKE: Final = 3.0
#: Standard deviations of a share beyond which it is more than chance.
_SURE: Final = 2.0
#: Part of all shares from which one is told that may be chance.
_LARGE: Final = 0.25


def name_of(share: Share) -> str:
    """Return what a source is called: noise of readings without declared deviations need not be the instrument's."""
    return _APPARENT if share.apparent else _SOURCES[share.source]


def budget_summary(budget: ErrorBudget) -> dict[str, Any]:
    """Return what limits the accuracy as JSON holds it: squares in mm^2, which add up, and their roots in mm."""
    return {
        "of": "held-out" if budget.held_out else "expected",
        "kind": budget.kind,
        "configurations": budget.configurations,
        "readings": budget.readings,
        "rms_mm": budget.rms * 1e3,
        "square_mm2": budget.square * 1e6,
        "square_deviation_mm2": budget.deviation * 1e6,
        "shares": _summaries(budget.shares, budget.square),
        "table_motion_removed_mm": None if budget.removed is None else budget.removed * 1e3,
        "workspace": None if budget.workspace is None else _summaries(budget.workspace, _sum(budget.workspace)),
    }


def _summaries(shares: Sequence[Share], total: float) -> list[dict[str, Any]]:
    return [
        {
            "source": share.source,
            "square_mm2": None if share.square is None else share.square * 1e6,
            "square_deviation_mm2": None if share.square is None else share.deviation * 1e6,
            "rms_mm": None if share.rms is None else share.rms * 1e3,
            "part": None if share.square is None or total <= 0.0 else share.square / total,
            "words": share.words,
        }
        for share in shares
    ]


def _sum(shares: Sequence[Share]) -> float:
    return sum(share.square or 0.0 for share in shares)


def budget_lines(budget: ErrorBudget | None) -> list[str]:
    """Return what limits the accuracy in a line: the shares that are more than chance, or large, the largest first."""
    if budget is None:
        return []
    places = min(max(3, 1 - math.floor(math.log10(max(budget.rms * 1e3, 1e-9)))), 6)
    what = "held out" if budget.held_out else "to expect at configurations like these"
    shares = sum(share.square or 0.0 for share in budget.shares if share.source != "remainder")
    told = [
        share
        for share in budget.shares
        if share.source != "remainder" and (_is_sure(share) or (share.square or 0.0) > _LARGE * max(shares, 0.0))
    ]
    told.sort(key=lambda share: -(share.square or 0.0))
    parts = [
        f"{name_of(share)} {'' if _is_sure(share) else 'perhaps '}{(share.rms or 0.0) * 1e3:.{places}f} mm"
        for share in told
    ]
    together = math.sqrt(max(shares, 0.0))
    rest = "the same within its uncertainty" if budget.held_out else "which is their sum"
    if budget.held_out and not (budget.remainder_is_chance and budget.square < _ALIKE * shares):
        left = next(share for share in budget.shares if share.source == "remainder").rms or 0.0
        rest = f"in squares {abs(left) * 1e3:.{places}f} mm {'more' if left > 0.0 else 'less'} than they explain"
    for share in budget.shares:
        if share.square is not None and share.source != "remainder" and share.square < -_SURE * share.deviation:
            rest += f"; {name_of(share)} takes {abs(share.rms or 0.0) * 1e3:.{places}f} mm away, see the report"
    return [
        f"What limits the accuracy: {', '.join(parts) or 'nothing that is more than chance'}; all shares together, in "
        f"squares, {together * 1e3:.{places}f} mm, {what} {budget.rms * 1e3:.{places}f} mm, {rest}"
    ]


def _is_sure(share: Share) -> bool:
    return share.square is not None and share.square > _SURE * share.deviation
