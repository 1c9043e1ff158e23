"""What limits the accuracy, as JSON and the command show it, in mm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

from truearm.identification.judging.error_budget import ErrorBudget, Share

#: What the sources are called where people read.
SOURCES: Final = {
    "instrument": "instrument noise",
    "table": "table motion",
    "repeatability": "repeatability",
    "model": "what the model cannot express",
    "parameters": "uncertain parameters",
    "remainder": "remainder",
}


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
    """Return what limits the accuracy in a line; a share whose square is negative has a minus."""
    if budget is None:
        return []
    known = [share for share in budget.shares if share.rms is not None]
    places = min(max(3, 1 - math.floor(math.log10(max(budget.rms * 1e3, 1e-9)))), 6)
    parts = [f"{SOURCES[share.source]} {(share.rms or 0.0) * 1e3:.{places}f}" for share in known]
    if budget.held_out:
        parts[-1] += " (within its uncertainty)" if budget.remainder_is_chance else " (not explained)"
    missing = [SOURCES[share.source] for share in budget.shares if share.rms is None]
    what = "held-out rms" if budget.held_out else "rms to expect at configurations like these"
    below_zero = any((share.square or 0.0) < 0.0 for share in known)
    unknown = f"; not measured: {', '.join(missing)}" if missing else ""
    return [
        f"What limits the accuracy, in squares that add up to the {what} of {budget.rms * 1e3:.{places}f} mm: "
        f"{', '.join(parts)} mm{'; minus: a negative square' if below_zero else ''}{unknown}"
    ]
