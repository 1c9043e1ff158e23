"""What all pictures have in common: plain Plotly figures, that is dictionaries, so that Plotly need not be imported."""

from __future__ import annotations

import html
import math
from typing import Any, Final

from truearm.modeling.chain import Array
from truearm.reporting.numbers import rounded_to

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
        step = max(one for one in (1, 2, 5) if one * 10.0**decade <= third)
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
