"""Pictures of reports in the window, light or dark."""

from __future__ import annotations

from typing import Any

from truearm.studio.window import Window


class Picture:
    """A place for one picture at a time.

    Attributes
    ----------
    place
        The folder it stands in.
    """

    def __init__(self, window: Window, title: str) -> None:
        self._window = window
        self.place = window.gui.add_folder(title, visible=False)
        self._plot: Any = None

    def show(self, drawn: dict[str, Any]) -> None:
        """Show a picture as the report has it, in the colours of the window."""
        import plotly.graph_objects as go

        from truearm.reporting.drawing import DARK

        if self._window.project.settings.dark:
            drawn = _recoloured(drawn, DARK)
        layout = {name: value for name, value in drawn["layout"].items() if name not in ("width", "height")}
        figure = go.Figure(data=drawn["data"], layout=layout, skip_invalid=True)
        self.place.visible = True
        if self._plot is None:
            with self.place:
                self._plot = self._window.gui.add_plotly(figure, aspect=1.2)
        else:
            self._plot.figure = figure


def _recoloured(value: Any, colours: dict[str, str]) -> Any:
    """Return a picture with other colours, as the report draws it on a dark page."""
    if isinstance(value, dict):
        return {name: _recoloured(part, colours) for name, part in value.items()}
    if isinstance(value, list):
        return [_recoloured(part, colours) for part in value]
    return colours.get(value, value) if isinstance(value, str) else value
