"""How a model was chosen: what every joint effect gains, as a picture and as rows."""

from __future__ import annotations

import html
from dataclasses import dataclass

import numpy as np

from truearm.identification.choosing.choice import Selection
from truearm.identification.choosing.folds import FOLDS
from truearm.reporting.drawing import AFTER, BEFORE, Figure, axis, figure
from truearm.reporting.numbers import rounded
from truearm.results.summaries import LAYOUT
from truearm.shown import counted, listed


@dataclass(frozen=True)
class CandidateRow:
    """One joint effect as it is printed."""

    effect: str
    gain: str
    error: str
    verdict: str
    taken: bool


@dataclass(frozen=True)
class ConfirmationRow:
    """One comparison of fits in the folds as it is printed."""

    model: str
    error: str
    smaller: str
    smaller_error: str
    gain: str
    standard_error: str


def choice_sentence(selection: Selection) -> str:
    """Return how the choice was made, in words."""
    held_out = (
        f"{counted(selection.blocks, 'block')} of neighbours, because the configurations {LAYOUT[selection.layout]}"
        if selection.blocks
        else "configurations drawn one by one"
    )
    elastic = "" if selection.elastic is None else f", that of the elastic model {selection.elastic * 1e3:.4f} mm"
    return (
        f"By {FOLDS}-fold cross-validation on the training configurations alone, holding out {held_out}. The mean "
        f"error of the geometric model there is {selection.geometric * 1e3:.4f} mm{elastic}, that of the chosen model "
        f"{selection.error * 1e3:.4f} mm. Errors of every choice follow in closed form from one fit; of those that are "
        "not worse than the best one by a standard error, the one with the fewest parameters was taken. Gains are "
        "those over the chosen model without the effect, or what it would gain with it."
    )


def candidate_rows(selection: Selection) -> tuple[CandidateRow, ...]:
    """Return a row for every joint effect that could be chosen."""
    return tuple(
        CandidateRow(
            one.effect,
            "–" if one.gain is None else f"{one.gain.mean * 1e3:+.4f}",
            "–" if one.gain is None else f"{one.gain.error * 1e3:.4f}",
            "taken" if one.taken else f"left out: {one.reason}",
            one.taken,
        )
        for one in selection.candidates
    )


def confirmation_rows(selection: Selection) -> tuple[ConfirmationRow, ...]:
    """Return a row for every model that was fitted in the folds."""
    return tuple(
        ConfirmationRow(
            listed(one.effects) or "geometric",
            f"{one.error * 1e3:.4f}",
            listed(one.smaller) or "geometric",
            f"{one.smaller_error * 1e3:.4f}",
            f"{one.gain.mean * 1e3:+.4f}",
            f"{one.gain.error * 1e3:.4f}",
        )
        for one in selection.confirmations
    )


def candidates_figure(selection: Selection) -> Figure:
    """Show what every joint effect that was tried gains, with its standard error."""
    tried = [one for one in reversed(selection.candidates) if one.gain is not None]
    traces = []
    for taken, name, colour in ((True, "taken", AFTER), (False, "left out", BEFORE)):
        mine = [one for one in tried if one.taken is taken]
        gains = [one.gain for one in mine if one.gain is not None]
        traces.append(
            {
                "type": "bar",
                "orientation": "h",
                "name": name,
                "y": [html.escape(one.effect) for one in mine],
                "x": rounded(np.array([each.mean * 1e3 for each in gains]), 4),
                "error_x": {"type": "data", "array": rounded(np.array([each.error * 1e3 for each in gains]), 3)},
                "marker": {"color": colour, "line": {"width": 0}},
                "hovertemplate": "%{y}: gains %{x} mm<extra></extra>",
            }
        )
    return figure(
        traces,
        120 + 26 * len(tried),
        xaxis={**axis("gain of the mean held-out error [mm]")},
        yaxis={**axis(""), "type": "category", "categoryorder": "array", "categoryarray": [o.effect for o in tried]},
        margin={"l": 160, "r": 16, "t": 16, "b": 48},
    )
