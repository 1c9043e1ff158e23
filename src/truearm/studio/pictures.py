"""Pictures of reports in the window, light or dark."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, Final

from truearm.engine.base.files import exists, read_text
from truearm.studio.window import Window

#: Where a report has the data of its pictures.
_FIGURES: Final = re.compile(r'<script type="application/json" id="figures">(.*?)</script>', re.S)
#: Where more panels than that stand side by side, letters are so small [px].
_WIDE: Final = 3
_SMALL: Final = 8
#: What comes up over a picture: below each other at its edge, and no more than saving it, zooming and going back. Of
#: itself Plotly offers to send the measurements to a server of its maker.
_BUTTONS: Final = {
    "orientation": "v",
    "remove": ["select2d", "lasso2d", "zoomIn2d", "zoomOut2d", "autoScale2d", "toggleSpikelines", "sendChartToCloud"],
}


class Picture:
    """A place for one picture at a time.

    Each picture is an element of its own. viser gives all that one element draws the same `uirevision`, so Plotly would
    take the axes, the zoom, the camera and the hidden curves of a picture over to the next one.

    Attributes:
        place: The folder it stands in.
    """

    def __init__(self, window: Window, title: str, aspect: float = 1.2) -> None:
        self._window, self._aspect = window, aspect
        self.place = window.gui.add_folder(title, visible=False)
        self._plot: Any = None
        self._of: Any = None

    def show(self, drawn: dict[str, Any], of: object = None) -> None:
        """Show a picture as the report has it, in the colours of the window.

        Args:
            of: The run that it follows while that goes on, if any: the same object with the same curves is the same
                picture with more in it, and keeps what the user has zoomed.
        """
        import plotly.graph_objects as go

        from truearm.engine.document.drawing import DARK

        if self._window.project.settings.dark:
            drawn = _recoloured(drawn, DARK)
        layout = {name: value for name, value in drawn["layout"].items() if name not in ("width", "height")}
        layout = {**_narrow(layout), "modebar": _BUTTONS}
        figure = go.Figure(data=drawn["data"], layout=layout, skip_invalid=True)
        goes_on = of is not None and of is self._of and _curves(figure) == _curves(self._plot.figure)
        self._of = of
        with self._window.server.atomic(), self.place:
            self.place.visible = True
            if goes_on:
                self._plot.figure = figure
                return
            if self._plot is not None:
                self._plot.remove()
            self._plot = self._window.gui.add_plotly(figure, aspect=self._aspect)


def _curves(figure: Any) -> list[tuple[str, str | None]]:
    """Return the kinds and the names of a picture's curves."""
    return [(curve.type, curve.name) for curve in figure.data]


def report_figures(path: Path) -> dict[str, Any]:
    """Return the pictures of a report by their names, without those that have not the form of one."""
    if not exists(path):
        return {}
    match = _FIGURES.search(read_text(path))
    try:
        figures = json.loads(match[1]) if match else {}
    except (json.JSONDecodeError, RecursionError):
        return {}
    return {name: drawn for name, drawn in figures.items() if _is_drawn(drawn)} if isinstance(figures, dict) else {}


def _is_drawn(drawn: Any) -> bool:
    """Return whether this has the form of a picture; a report may be damaged."""
    layout = drawn.get("layout") if isinstance(drawn, dict) else None
    if not isinstance(layout, dict) or not isinstance(drawn.get("data"), list):
        return False
    parts = (part for name, part in layout.items() if name.startswith(("xaxis", "yaxis", "font")))
    return all(isinstance(part, dict) for part in parts)


def _narrow(layout: dict[str, Any]) -> dict[str, Any]:
    """Return a layout that can be read in the window: many panels side by side have small letters and few titles."""
    across = {name: axis.get("domain") or (0.0, 1.0) for name, axis in layout.items() if name.startswith("xaxis")}
    if len({str(domain) for domain in across.values()}) <= _WIDE:
        return layout
    made = {**layout, "font": {**layout.get("font", {}), "size": _SMALL}}
    for name, axis in layout.items():
        if name.startswith("yaxis") and across.get(name.replace("y", "x", 1), (0.0,))[0] > 0.0:
            made[name] = {**axis, "title": None}
    return made


def _recoloured(value: Any, colours: dict[str, str]) -> Any:
    """Return a picture with other colours, as the report draws it on a dark page."""
    if isinstance(value, dict):
        return {name: _recoloured(part, colours) for name, part in value.items()}
    if isinstance(value, list):
        return [_recoloured(part, colours) for part in value]
    return colours.get(value, value) if isinstance(value, str) else value
