"""Pictures of a fleet: of three robots every value, of ten thousand their distribution."""

from __future__ import annotations

import html
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.units import SHOWN_AS, from_si
from truearm.engine.document.drawing import AFTER, BEFORE, Figure, axis, figure, logarithmic_axis, rounded, significant
from truearm.fleets.analysis import LEAST_COMPARED, Analysis, Errors, KindAnalysis
from truearm.fleets.drift import Drift

_ALARM: Final = "#b3261e"
_SHADE: Final = "#c3d5e3"
_LINES: Final = (AFTER, _ALARM, "#3b7d3b", "#8a6d1d", "#5b3a8c", "#1d7f86")
#: Robots of which each is drawn; of more, so many points along the curve, and boxes.
_EACH: Final = 200
_BINS: Final = 40
#: Robots that differ and are drawn beside boxes.
_MOST_MARKS: Final = 300
#: Informed share from which on a parameter is drawn: two that are told together have half each.
_DRAWN_SHARE: Final = 0.4
#: Legends of many entries, where no toolbar comes to lie upon them.
_BELOW: Final = {"orientation": "h", "x": 0, "y": 0, "yref": "container", "xanchor": "left", "yanchor": "bottom"}
#: A value so many times as far out as the others is not drawn at its place, but at the edge.
_FAR: Final = 4.0
#: Robots beyond a picture that are named.
_NAMED: Final = 3
#: Largest error over smallest beyond which an axis is logarithmic.
_LOGARITHMIC: Final = 15.0


def fleet_figures(analysis: Analysis) -> dict[str, Figure]:
    """Return the pictures of a fleet by their places on the page."""
    figures = {}
    if analysis.errors:
        figures["accuracy"] = accuracy_figure(analysis)
    judged = analysis.errors.get("held_out")
    if judged is not None and len(judged.mean) >= LEAST_COMPARED:
        figures["histogram"] = histogram_figure(judged)
    if analysis.kinds:
        kind = analysis.kinds[0]
        if len(_drawn(kind)):
            figures["parameters"] = parameters_figure(kind)
        if any(spread.spread is not None for spread in kind.spreads):
            figures["spread"] = spread_figure(kind)
    for unit, name in (("m", "drift-lengths"), ("rad", "drift-angles")):
        changes = shown_drifts(analysis, unit)
        if changes:
            figures[name] = drift_figure(changes)
    return figures


def accuracy_figure(analysis: Analysis) -> Figure:
    """Show the mean errors of the robots, the most accurate first, before and after calibration."""
    names = {"nominal": ("nominal", BEFORE), "held_out": ("calibrated, held out", AFTER)}
    traces = []
    low, high = np.inf, 0.0
    for name, (words, colour) in names.items():
        if name not in analysis.errors:
            continue
        values = np.sort(analysis.errors[name].mean) * 1e3
        count = len(values)
        share = 100.0 * (np.arange(count) + 0.5) / count
        if count > _EACH:
            at = np.unique(np.concatenate([np.linspace(0, count - 1, _EACH), np.arange(count - 20, count)]).astype(int))
            values, share = values[at], share[at]
        low, high = min(low, float(values[0])), max(high, float(values[-1]))
        traces.append(
            {
                "type": "scatter",
                "mode": "lines+markers" if count <= _EACH else "lines",
                "name": words,
                "x": rounded(share, 5),
                "y": rounded(values, 4),
                "line": {"color": colour, "width": 2},
                "marker": {"size": 7, "color": colour},
                "hovertemplate": f"{words}: %{{x:.3g}} % of the robots below %{{y}} mm<extra></extra>",
            }
        )
    y: dict[str, Any] = axis("mean error of a robot [mm]")
    if high > _LOGARITHMIC * max(low, 1e-9):
        y = logarithmic_axis("mean error of a robot [mm]", max(low, 1e-6), high)
    else:
        y |= {"rangemode": "tozero"}
    x = axis("robots, the most accurate first [%]") | {"range": [0, 100]}
    return figure(traces, 380, xaxis=x, yaxis=y, showlegend=True)


def histogram_figure(errors: Errors) -> Figure:
    """Show how many calibrated robots have which mean error."""
    whole = errors.mean * 1e3
    end = _FAR * float(np.median(whole))
    values, beyond = whole[whole <= end], np.flatnonzero(whole > end)
    bins = min(_BINS, max(5, int(np.sqrt(len(values)) * 2)))
    low, high = float(values.min()), float(values.max())
    edges = np.linspace(low, high if high > low else low * 1.01 + 1e-9, bins + 1)
    ranges = [f"{a:.3g} to {b:.3g} mm" for a, b in pairwise(edges)]
    trace = {
        "type": "bar",
        "x": rounded((edges[:-1] + edges[1:]) / 2, 6),
        "width": rounded(np.diff(edges), 6),
        "y": np.histogram(values, edges)[0].tolist(),
        "customdata": ranges,
        "marker": {"color": AFTER, "line": {"width": 0}},
        "opacity": 0.8,
        "hovertemplate": "%{customdata}: %{y} robots<extra></extra>",
    }
    x = axis("mean held-out error of a calibrated robot [mm]")
    words = []
    if len(beyond):
        worst = beyond[np.argsort(-whole[beyond])]
        farthest = ", ".join(
            f"{html.escape(errors.names[i])} {significant(whole[i])} mm" for i in worst[:_NAMED].tolist()
        )
        more = f" and {len(beyond) - _NAMED} more" if len(beyond) > _NAMED else ""
        words = [
            {
                "text": f"beyond: {farthest}{more}",
                "xref": "paper",
                "yref": "paper",
                "x": 0,
                "y": 1.02,
                "xanchor": "left",
                "yanchor": "bottom",
                "showarrow": False,
                "font": {"color": _ALARM},
            }
        ]
    return figure([trace], 300, xaxis=x, yaxis=axis("robots"), bargap=0, annotations=words)


def _drawn(analysis: KindAnalysis) -> NDArray[np.intp]:
    """Return the parameters that are worth a look: the readings tell much of them, or a robot differs in them."""
    differ = np.isin(np.array(analysis.kind.parameters), [difference.parameter for difference in analysis.differences])
    return np.flatnonzero((analysis.kind.share > _DRAWN_SHARE) | differ)


def parameters_figure(analysis: KindAnalysis) -> Figure:
    """Show how far each parameter of each robot is from nominal, in its prior; of many robots as boxes."""
    kind, chosen = analysis.kind, _drawn(analysis)
    rows = kind.latest
    values = kind.undrawn[0][np.ix_(rows, chosen)] / kind.prior[chosen]
    names = [html.escape(kind.parameters[i]) for i in chosen.tolist()]
    robots = [html.escape(kind.names[i]) for i in rows.tolist()]
    traces: list[Figure] = []
    each = len(rows) <= _EACH // 4
    edge = _edge(values)
    shown = np.clip(values, -edge, edge)
    if each:
        for row, robot in enumerate(robots):
            those = [
                (n, v) for n, v in zip(names, values[row].tolist(), strict=True) if np.isfinite(v) and abs(v) <= edge
            ]
            traces.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "x": [n for n, _ in those],
                    "y": rounded(np.array([v for _, v in those]), 4),
                    "marker": {"size": 7, "color": AFTER, "opacity": 0.6},
                    "hovertemplate": f"{robot}, %{{x}}: %{{y}} of its prior<extra></extra>",
                    "showlegend": False,
                }
            )
    else:
        traces.append(_boxes(names, values))
    row_of = {kind.names[row]: place for place, row in enumerate(rows.tolist())}
    column_of = {kind.parameters[column]: place for place, column in enumerate(chosen.tolist())}
    marks = [
        (difference, (row_of[difference.robot], column_of[difference.parameter]))
        for difference in analysis.differences[:_MOST_MARKS]
    ]
    if marks:
        sizes = [values[place] for _, place in marks]
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": "differs",
                "x": [html.escape(difference.parameter) for difference, _ in marks],
                "y": rounded(np.array([shown[place] for _, place in marks]), 4),
                "text": [html.escape(difference.robot) for difference, _ in marks],
                "customdata": rounded(np.array(sizes), 4),
                "marker": {"size": 11, "color": _ALARM, "symbol": [_symbol(size, edge) for size in sizes]},
                "hovertemplate": "%{text}, %{x}: %{customdata} of its prior<extra></extra>",
            }
        )
    marked = {place for _, place in marks}
    out = [(i, j) for i, j in np.argwhere(np.abs(values) > edge).tolist() if each or (i, j) in marked]
    unmarked = [place for place in out if place not in marked]
    if unmarked:
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "x": [names[j] for _, j in unmarked],
                "y": rounded(np.array([shown[i, j] for i, j in unmarked]), 4),
                "text": [robots[i] for i, _ in unmarked],
                "customdata": rounded(np.array([values[i, j] for i, j in unmarked]), 4),
                "marker": {"size": 9, "color": AFTER, "symbol": [_symbol(values[i, j], edge) for i, j in unmarked]},
                "hovertemplate": "%{text}, %{x}: %{customdata} of its prior<extra></extra>",
                "showlegend": False,
            }
        )
    far = list(dict.fromkeys(robots[i] for i, _ in sorted(out, key=lambda at: -abs(values[at[0], at[1]]))))
    title = "difference from nominal [priors]"
    if far:
        more = f" and {len(far) - _NAMED} more" if len(far) > _NAMED else ""
        title = f"{title}<br>triangles: beyond ({', '.join(far[:_NAMED])}{more})"
    return figure(
        traces,
        420,
        xaxis=axis("parameter") | {"type": "category", "tickangle": -60},
        yaxis=axis(title),
        showlegend=bool(marks),
    )


def _boxes(names: list[str], values: NDArray[np.float64]) -> Figure:
    ends = np.nanpercentile(values, [2.5, 25.0, 50.0, 75.0, 97.5], axis=0)
    keys = ("lowerfence", "q1", "median", "q3", "upperfence")
    return {
        "type": "box",
        "x": names,
        **{key: rounded(end, 4) for key, end in zip(keys, ends, strict=True)},
        "fillcolor": _SHADE,
        "line": {"color": AFTER, "width": 1.5},
        "showlegend": False,
    }


def _edge(values: NDArray[np.float64]) -> float:
    """Return how far out values are drawn at their places: as most of them need, so that one does not hide the rest."""
    sizes = np.sort(np.abs(values[np.isfinite(values)]))
    usual = max(float(np.quantile(sizes, 0.75)), 1.0) if len(sizes) else 1.0
    return _FAR * usual if len(sizes) and sizes[-1] > _FAR**2 * usual else np.inf


def _symbol(value: float, edge: float) -> str:
    if abs(value) <= edge:
        return "diamond"
    return "triangle-up" if value > 0.0 else "triangle-down"


def spread_figure(analysis: KindAnalysis) -> Figure:
    """Show how far parameters scatter over the series, in their priors, with intervals of 95 %."""
    known = [parameter for parameter in analysis.spreads if parameter.spread is not None]
    prior = np.array([parameter.prior for parameter in known])
    spread, low, high = (
        np.array([(parameter.spread, parameter.low, parameter.high) for parameter in known], dtype=float).T / prior
    )
    colours = [
        AFTER if parameter.verdict == "agrees" else _ALARM if parameter.verdict == "wider" else "#8a6d1d"
        for parameter in known
    ]
    trace = {
        "type": "scatter",
        "mode": "markers",
        "x": [html.escape(parameter.parameter) for parameter in known],
        "y": rounded(spread, 4),
        "error_y": {
            "type": "data",
            "symmetric": False,
            "array": rounded(high - spread, 4),
            "arrayminus": rounded(spread - low, 4),
            "thickness": 1.4,
            "width": 5,
            "color": BEFORE,
        },
        "marker": {"size": 9, "color": colours},
        "hovertemplate": "%{x}: %{y} of its prior<extra></extra>",
        "showlegend": False,
    }
    line = {
        "type": "line",
        "xref": "paper",
        "x0": 0,
        "x1": 1,
        "y0": 1,
        "y1": 1,
        "line": {"color": "#9aa0a6", "dash": "dash"},
    }
    return figure(
        [trace],
        380,
        xaxis=axis("parameter") | {"type": "category", "tickangle": -60},
        yaxis=axis("spread over the series [priors]") | {"rangemode": "tozero"},
        shapes=[line],
    )


def shown_drifts(analysis: Analysis, unit: str) -> list[Drift]:
    """Return the changes that are drawn: the surest of a unit, those that are more than chance before others."""
    those = [drift for drift in analysis.drifts if drift.unit == unit]
    sure = [drift for drift in those if drift.significant]
    return sorted(sure or those, key=lambda drift: -abs(drift.times))[: len(_LINES) if sure else 3]


def drift_figure(changes: list[Drift]) -> Figure:
    """Show how parameters of machines went on since the first campaign, with their lines."""
    unit = SHOWN_AS[changes[0].unit]

    def shown(values: tuple[float, ...]) -> list[float]:
        return rounded(np.array([from_si(v, unit) for v in values]), 4)

    traces: list[Figure] = []
    for change, colour in zip(changes, _LINES, strict=False):
        name = f"{html.escape(change.machine)}, {html.escape(change.parameter)}"
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": f"{name}{'' if change.significant else ' (no more than chance)'}",
                "x": rounded(np.array(change.campaign_months), 5),
                "y": shown(change.changes),
                "error_y": {
                    "type": "data",
                    "array": shown(tuple(1.96 * d for d in change.deviations)),
                    "thickness": 1.4,
                    "width": 5,
                },
                "marker": {"size": 8, "color": colour},
                "hovertemplate": f"{name}: %{{y}} {unit} after %{{x:.3g}} months<extra></extra>",
            }
        )
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": rounded(np.array([0.0, change.months]), 5),
                "y": shown((0.0, change.change)),
                "line": {"color": colour, "width": 1.5, "dash": "solid" if change.significant else "dot"},
                "hoverinfo": "skip",
                "showlegend": False,
            }
        )
    return figure(
        traces,
        380,
        xaxis=axis("months after the first campaign"),
        yaxis=axis(f"change since then [{unit}]"),
        showlegend=True,
        legend=_BELOW,
    )


def figures_text(value: float | None, unit: str) -> str:
    """Return a value [SI] as a table shows it, in the unit that people read."""
    if value is None or not np.isfinite(value):
        return "–"
    shown = from_si(abs(value), SHOWN_AS[unit])
    return ("−" if value < 0.0 and shown >= 5e-5 else "") + significant(shown)
