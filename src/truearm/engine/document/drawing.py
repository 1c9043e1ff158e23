"""Numbers as text, and parts of pictures: Plotly figures as dictionaries, so that Plotly is not imported."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from truearm.engine.robot.chain import Array


def significant(value: float, digits: int = 3, decimals: int = 4) -> str:
    """Write a size that is not negative with so many significant digits, and at most so many decimals."""
    if not math.isfinite(value):
        return "–"
    smallest = 10.0**-decimals
    if value < smallest / 2:
        return "0" if value == 0 else f"< {smallest:.{decimals}f}"
    # Rounded first: 0.9996 has its first digit before the point once it is written.
    places = digits - 1 - math.floor(math.log10(float(f"{value:.{digits - 1}e}")))
    return f"{value:.{min(max(places, 0), decimals)}f}"


def decimals_of(deviation: float, most: int = 6) -> int:
    """Return to how many decimals a figure of this standard deviation is known: the last digit is the first doubtful.

    Two digits of a deviation count where the first is 1 or 2, one otherwise, as metrology rounds.
    """
    if not math.isfinite(deviation) or deviation <= 0.0:
        return most
    first = math.floor(math.log10(float(f"{deviation:.1e}")))
    digits = 2 if deviation / 10.0**first < 3.0 else 1
    return min(max(digits - 1 - first, 0), most)


def deserved(value: float, deviation: float | None) -> str:
    """Write a size with the digits that its standard deviation deserves; three of one whose deviation is not known."""
    if deviation is None or not math.isfinite(deviation) or deviation <= 0.0 or not math.isfinite(value):
        return significant(value)
    decimals = decimals_of(deviation)
    text = f"{value:.{decimals}f}"
    return text if float(text) else significant(value, 1)


def student_975(freedom: int) -> float:
    """Return the 97.5th percentile of Student's t (Cornish-Fisher expansion, Abramowitz and Stegun 26.7.5).

    It is off by less than 1 % from three degrees of freedom on.
    """
    z = 1.959964
    if freedom < 3:
        return {1: 12.706, 2: 4.303}.get(freedom, math.inf)
    terms = (
        (z**3 + z) / 4.0,
        (5 * z**5 + 16 * z**3 + 3 * z) / 96.0,
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384.0,
    )
    return z + math.fsum(term / float(freedom) ** power for power, term in enumerate(terms, 1))


def rounded(values: Array, digits: int) -> list[float]:
    """Return a list of numbers with so many significant digits."""
    return [float(f"{value:.{digits}g}") for value in np.asarray(values, float).tolist()]


def rounded_to(values: Array, decimals: int) -> list[Any]:
    """Return a list, or a list of lists, of numbers with so many decimals."""
    numbers: list[Any] = (np.round(np.asarray(values, float), decimals) + 0.0).tolist()
    return numbers


Figure = dict[str, Any]

BEFORE: Final = "#b8ab97"
AFTER: Final = "#1d5f8a"
#: What colours of pictures become on a dark screen, as the style of the pages has them there.
DARK: Final = {
    BEFORE: "#c3b49b",
    AFTER: "#5fb0e2",
    "#b3261e": "#f2867d",
    "#3b7d3b": "#7cc47c",
    "#2456a6": "#7aa7f0",
    "#2b2f33": "#e3e6e9",
    "#e4e6e8": "#30373d",
    "#d5d8db": "#3a4147",
    "#9aa0a6": "#6a737b",
    "#c8ccd0": "#6a737b",
    "#ffffff": "#16191c",
    "#000000": "#e3e6e9",
    "#c3d5e3": "#1f3d52",
    "#2c6f9c": "#4d93c4",
    "#4b3a63": "#b78ed6",
    "#8a6d1d": "#d3b75f",
    "#5b3a8c": "#b08fe6",
    "#1d7f86": "#5cc3ca",
    "#646b72": "#a0a8af",
    "#6b6f73": "#a0a8af",
}
#: Colours of x, y and z, or of the first things that are drawn together.
COLOURS: Final = ("#b3261e", "#3b7d3b", "#2456a6")
#: Colours of things that are drawn together.
HUES: Final = (*COLOURS, "#8a6d1d", "#5b3a8c", "#1d7f86", "#6b6f73")
INK: Final = "#2b2f33"
SHADE: Final = "#e4e6e8"
CAMERA: Final = {"eye": {"x": 1.55, "y": 1.55, "z": 0.8}, "center": {"x": 0, "y": 0, "z": -0.15}}
_FONT: Final = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"


def axis(title: str) -> Figure:
    """Make an axis of a plane picture."""
    return {
        "title": {"text": title},
        "gridcolor": SHADE,
        "zeroline": False,
        "linecolor": "#9aa0a6",
        "showline": True,
        "automargin": True,
    }


def logarithmic_axis(title: str, low: float, high: float) -> Figure:
    """Make an axis with ticks at 1, 2 and 5 in every decade, at whole decades where there are many.

    Where fewer than two of them lie between `low` and `high`, the ticks are evenly spaced.
    """
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    steps = (1, 2, 5) if len(decades) <= 5 else (1,)
    ticks = [float(f"{step}e{decade}") for decade in decades for step in steps]
    if low < high and sum(low <= tick <= high for tick in ticks) < 2:
        decade = math.floor(math.log10(third := (high - low) / 3.0))
        step = max(factor for factor in (1, 2, 5) if factor * 10.0**decade <= third)
        first, last = (int(end / (step * 10.0**decade)) for end in (low, high))
        ticks = [float(f"{k * step}e{decade}") for k in range(max(first, 1), last + 2)]
    return axis(f"{title}, logarithmic") | {
        "type": "log",
        "tickvals": ticks,
        "ticktext": [f"{tick:g}" for tick in ticks],
    }


def scene_axis(title: str) -> Figure:
    """Make an axis of a picture in space."""
    return {
        "title": {"text": title},
        "gridcolor": "#d5d8db",
        "showbackground": False,
        "zeroline": False,
        "showspikes": False,
    }


def base_axes(length: float) -> list[Figure]:
    """Make the axes of the base frame, `length` long."""
    return [
        {
            "type": "scatter3d",
            "mode": "lines+text",
            **{letter: [0, length if letter == name else 0] for letter in "xyz"},
            "text": ["base" if name == "x" else "", name],
            "textposition": "bottom center" if name == "x" else "top center",
            "textfont": {"color": colour, "size": 12},
            "line": {"color": colour, "width": 5},
            "hoverinfo": "skip",
            "showlegend": False,
        }
        for name, colour in zip("xyz", COLOURS, strict=True)
    ]


def figure(traces: list[Figure], height: int, **layout: Any) -> Figure:
    """Put traces into the house's layout, `height` pixels high; `layout` adds to it."""
    common = {
        "height": height,
        "font": {"family": _FONT, "size": 13, "color": INK},
        "paper_bgcolor": "#ffffff",
        "plot_bgcolor": "#ffffff",
        "margin": {"l": 60, "r": 20, "t": 36, "b": 50},
        "legend": {"orientation": "h", "x": 0, "y": 1.02, "xanchor": "left", "yanchor": "bottom"},
        "hoverlabel": {"bgcolor": "#ffffff", "bordercolor": "#9aa0a6", "font": {"color": INK}},
    }
    return {"data": traces, "layout": {**common, **layout}}


def line(name: str, x: Array, y: Array, colour: str, width: float = 1.5, **more: object) -> Figure:
    """Return a line; without a name it is not in the legend."""
    return {
        "type": "scatter",
        "mode": "lines",
        "name": html.escape(name),
        "x": rounded_to(x, 4),
        "y": [value if math.isfinite(value) else None for value in rounded_to(y, 4)],  # a gap
        "line": {"color": colour, "width": width},
        "hoverinfo": "skip" if not name else "x+y+name",
        **more,
    }


#: Between two panels, as a share of the width, and of the height [pixels].
_GAP: Final = 0.09
_ROW_GAP: Final = 104


@dataclass(frozen=True, eq=False)
class Panel:
    """One of them."""

    title: str  #: Above it.
    traces: Sequence[Figure]  #: What is drawn.
    x: str  #: x, y: titles of its axes.
    y: str
    equal: bool = False  #: Whether a unit is as long on both axes.
    #: What else is drawn, in its coordinates; one with ``yref`` ``paper`` reaches from its bottom to its top.
    shapes: Sequence[Figure] = ()
    more_x: Figure = field(default_factory=dict)  #: more_x, more_y: what else its axes have.
    more_y: Figure = field(default_factory=dict)


def panels(drawn: Sequence[Panel], columns: int, height: int, **layout: Any) -> Figure:
    """Put panels into rows of so many columns, each `height` pixels high."""
    rows = math.ceil(len(drawn) / columns)
    columns = min(columns, len(drawn))
    inside = rows * height + (rows - 1) * _ROW_GAP
    wide = (1.0 - _GAP * (columns - 1)) / columns
    traces: list[Figure] = []
    shapes: list[Figure] = []
    titles: list[Figure] = []
    axes: dict[str, Figure] = {}
    named: set[str] = set()
    for number, panel in enumerate(drawn, 1):
        row, column = divmod(number - 1, columns)
        left = column * (wide + _GAP)
        top = 1.0 - row * (height + _ROW_GAP) / inside
        bottom = max(top - height / inside, 0.0)
        name = "" if number == 1 else str(number)
        axes[f"xaxis{name}"] = {
            **axis(panel.x),
            "anchor": f"y{name}",
            "domain": [round(left, 5), round(left + wide, 5)],
            **panel.more_x,
        }
        axes[f"yaxis{name}"] = {
            **axis(panel.y),
            "anchor": f"x{name}",
            "domain": [round(bottom, 5), round(top, 5)],
            **({"scaleanchor": f"x{name}", "constrain": "domain"} if panel.equal else {}),
            **panel.more_y,
        }
        if panel.equal:
            axes[f"xaxis{name}"]["constrain"] = "domain"
        titles.append(
            {
                "text": panel.title,
                "xref": "paper",
                "yref": "paper",
                "x": round(left + wide / 2, 5),
                "y": round(top, 5),
                "xanchor": "center",
                "yanchor": "bottom",
                "showarrow": False,
            }
        )
        for trace in panel.traces:
            group = str(trace.get("name", ""))
            shown = bool(group) and group not in named and trace.get("showlegend", True)
            named |= {group} if shown else set()
            traces.append(
                {**trace, "xaxis": f"x{name}", "yaxis": f"y{name}", "legendgroup": group, "showlegend": shown}
            )
        for shape in panel.shapes:
            whole = shape.get("yref") == "paper"
            shapes.append({**shape, "xref": f"x{name}", "yref": f"y{name} domain" if whole else f"y{name}"})
    return figure(
        traces,
        inside + 150,
        **axes,
        **{
            "annotations": titles,
            "shapes": shapes,
            "margin": {"l": 60, "r": 20, "t": 90, "b": 60},
            "legend": {
                "orientation": "h",
                "x": 0,
                "y": round(1.0 + 26 / inside, 4),
                "xanchor": "left",
                "yanchor": "bottom",
                "traceorder": "normal",
            },
            **layout,
        },
    )
