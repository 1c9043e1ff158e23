"""How a model was chosen: what every joint effect gains, as a picture and as rows."""

from __future__ import annotations

import html
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.identification.choosing.choice import Selection
from truearm.identification.choosing.folds import FOLDS
from truearm.modeling.chain import Array
from truearm.reporting.drawing import AFTER, BEFORE, Figure, axis, figure
from truearm.reporting.numbers import rounded
from truearm.results.summaries import LAYOUT
from truearm.shown import counted, listed

#: Gains are drawn in proportion up to this at least [mm].
_SMALLEST: Final = 1e-4


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
        "those over the chosen model without the effect, or what it would gain with it. A fold trains on four fifths "
        "of the configurations, and what is chosen looked best in these folds; the error of held-out readings may be "
        "smaller or larger than the one here: believe the held-out one."
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
    """Show what every joint effect that was tried gains, with its standard error.

    The axis is linear near no gain and logarithmic beyond, so that what little effects gain is seen beside a large one.
    """
    tried = [one for one in reversed(selection.candidates) if one.gain is not None]
    errors = [1e3 * one.gain.error for one in tried if one.gain is not None and one.gain.error > 0.0]
    linear = max(float(np.median(errors)) if errors else 0.0, _SMALLEST)
    ends: list[float] = [linear]
    traces = []
    for taken, name, colour in ((True, "taken", AFTER), (False, "left out", BEFORE)):
        mine = [one for one in tried if one.taken is taken]
        gains = np.array([1e3 * one.gain.mean for one in mine if one.gain is not None])
        error = np.array([1e3 * one.gain.error for one in mine if one.gain is not None])
        place = _bent(gains, linear)
        above, below = _bent(gains + error, linear), _bent(gains - error, linear)
        ends += [*(gains + error).tolist(), *(gains - error).tolist()]
        traces.append(
            {
                "type": "bar",
                "orientation": "h",
                "name": name,
                "y": [html.escape(one.effect) for one in mine],
                "x": rounded(place, 4),
                "customdata": rounded(gains, 4),
                "error_x": {
                    "type": "data",
                    "symmetric": False,
                    "array": rounded(above - place, 4),
                    "arrayminus": rounded(place - below, 4),
                },
                "marker": {"color": colour, "line": {"width": 0}},
                "hovertemplate": "%{y}: gains %{customdata} mm<extra></extra>",
            }
        )
    low, high = min(min(ends), -linear), max(max(ends), linear)
    left, right = _bent(np.array([low, high]), linear).tolist()
    room = 0.2 * (right - left)
    marks = [0.0, *(sign * 10.0**power for power in range(-5, 3) for sign in (-1.0, 1.0))]
    marks = sorted(mark for mark in marks if low <= mark <= high and (mark == 0.0 or abs(mark) >= 0.5 * linear))
    labels = [
        {
            "x": 1.0,
            "xref": "paper",
            "y": html.escape(one.effect),
            "text": f"{one.gain.mean * 1e3:+.4f} ± {one.gain.error * 1e3:.4f}",
            "xanchor": "right",
            "showarrow": False,
            "font": {"size": 11},
        }
        for one in tried
        if one.gain is not None
    ]
    return figure(
        traces,
        120 + 26 * len(tried),
        xaxis={
            **axis("gain of the mean held-out error [mm], logarithmic beyond its usual standard error"),
            "range": [left - 0.02 * (right - left), right + room],
            "tickvals": rounded(_bent(np.array(marks), linear), 4),
            "ticktext": [f"{mark:g}" for mark in marks],
        },
        yaxis={**axis(""), "type": "category", "categoryorder": "array", "categoryarray": [o.effect for o in tried]},
        margin={"l": 160, "r": 16, "t": 16, "b": 48},
        annotations=labels,
    )


def _bent(gain: Array, linear: float) -> Array:
    """Return where gains [mm] are drawn: in proportion up to about `linear`, by their logarithm beyond."""
    return np.asarray(np.sign(gain) * np.log10(1.0 + np.abs(gain) / linear))
