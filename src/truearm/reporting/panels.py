"""Several plane pictures of one kind side by side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from truearm.reporting.drawing import Figure, axis, figure

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
