"""What limits the accuracy, as a picture in which squares add up, and as rows of a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truearm.identification.judging.error_budget import ErrorBudget, Share, shown_shares
from truearm.reporting.drawing import AFTER, BEFORE, Figure, axis, figure
from truearm.reporting.numbers import rounded, significant
from truearm.results.budgets import name_of

_NEGATIVE = "#b3261e"
#: Height of a bar with its gap, and of what stands around them.
_BAR = 34
_AROUND = 96


@dataclass(frozen=True)
class BudgetRow:
    """One source of error as it is printed: its name, root [mm], part of the square, uncertainty and words."""

    source: str
    rms: str
    part: str
    square: str
    words: str


def budget_rows(budget: ErrorBudget) -> tuple[BudgetRow, ...]:
    """Return a row for each source, and one for what they add up to."""
    rows = [
        BudgetRow(
            name_of(share),
            "–" if share.rms is None else _signed(share.rms * 1e3),
            "–" if share.square is None else _percent(share.square, budget.square),
            "–" if share.square is None else _squares(share.square, share.deviation),
            share.words,
        )
        for share in budget.shares
    ]
    what = "all held-out readings together" if budget.held_out else "all together"
    words = "the uncertainty is that by the scatter of the configurations"
    return (
        *rows,
        BudgetRow(what, significant(budget.rms * 1e3), "100 %", _squares(budget.square, budget.deviation), words),
    )


def budget_figure(budget: ErrorBudget) -> Figure:
    """Show squares from the first source to the last, each beginning where the one before ends, and their sum."""
    shares = shown_shares(budget.shares)
    return _stairs(shares, budget.square, "held out, together" if budget.held_out else "to expect, together")


def workspace_budget_figure(shares: Sequence[Share]) -> Figure:
    """Show likewise what the mean square to expect over the workspace is made of."""
    total = sum(share.square or 0.0 for share in shares)
    return _stairs(list(shares), total, "over the workspace, together")


def _stairs(shares: Sequence[Share], total: float, together: str) -> Figure:
    squares = np.array([share.square or 0.0 for share in shares]) * 1e6
    ends = np.cumsum(squares)
    begins = np.concatenate([ends - squares, [0.0]])
    lengths = np.concatenate([squares, [total * 1e6]])
    names = [*map(name_of, shares), together]
    roots = [_signed(float(np.sign(s) * np.sqrt(abs(s)))) for s in lengths]
    parts = [_percent(s, total * 1e6) for s in lengths.tolist()]
    trace = {
        "type": "bar",
        "orientation": "h",
        "y": names,
        "x": rounded(lengths, 5),
        "base": rounded(begins, 5),
        "text": [f"{root} mm ({part})" for root, part in zip(roots, parts, strict=True)],
        "textposition": "outside",
        "cliponaxis": False,
        "marker": {"color": [*(AFTER if s >= 0.0 else _NEGATIVE for s in squares), BEFORE], "line": {"width": 0}},
        "hovertemplate": "%{y}: %{text}<extra></extra>",
        "showlegend": False,
    }
    edges = np.concatenate([begins, begins + lengths])
    low, high = min(float(edges.min()), 0.0), float(edges.max())
    room = 0.22 * max(high - low, 1e-12)
    return figure(
        [trace],
        _AROUND + _BAR * len(names),
        xaxis=axis("mean square [mm²]")
        | {"exponentformat": "none", "range": [low - (room if low < 0.0 else 0.0), high + room]},
        yaxis={**axis(""), "autorange": "reversed", "showgrid": False, "ticks": ""},
        bargap=0.3,
        margin={"l": 60, "r": 20, "t": 12, "b": 50},
    )


def _percent(square: float, total: float) -> str:
    text = f"{100.0 * square / total:.0f}" if total > 0.0 else "–"
    return f"{'0' if text == '-0' else text.replace('-', '−')} %"


def _signed(value: float) -> str:
    return f"−{significant(-value)}" if value < 0.0 else significant(value)


def _squares(square: float, deviation: float) -> str:
    sign = "−" if square < 0.0 else ""
    return f"{sign}{abs(square) * 1e6:.2g} ± {deviation * 1e6:.1g}" if deviation else f"{sign}{abs(square) * 1e6:.2g}"
