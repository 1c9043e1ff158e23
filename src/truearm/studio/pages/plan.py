"""Which configurations to measure: chosen, drawn in space, and written as a sheet."""

from __future__ import annotations

from typing import Any, ClassVar, Final

from truearm.errors import InputError
from truearm.files import exists
from truearm.identification.solving.models import MODELS
from truearm.simulation.devices import DEVICES
from truearm.studio import words
from truearm.studio.arrows import coloured
from truearm.studio.pages.choices import NONE, chosen
from truearm.studio.pages.jog import JogPage
from truearm.studio.pictures import Picture
from truearm.studio.planned import Planned, planned
from truearm.studio.window import Window

#: The sheet and the page that a plan writes.
_FILES: Final = ("plan.csv", "plan.html")
#: Of the chosen configurations.
_CHOSEN: Final = (214, 69, 61)


class PlanPage:
    """Chooses configurations with :func:`truearm.plan`."""

    title: ClassVar[str] = "Plan"

    def __init__(self, window: Window) -> None:
        self._window = window
        gui = window.gui
        self._poses: Any = gui.add_text("Poses", "60", hint="how many to choose, or auto")
        self._model: Any = gui.add_dropdown("Model", tuple(model.name for model in MODELS), initial_value="geometric")
        self._device: Any = gui.add_dropdown(
            "Instrument", (NONE, *(device.name for device in DEVICES)), hint="none: all targets everywhere"
        )
        self._noise: Any = gui.add_number("Noise [mm]", 0.1, min=0.0001, max=10.0, step=0.01)
        self._candidates: Any = gui.add_number("Candidates", 1000, min=10, max=20000, step=10)
        self._seed: Any = gui.add_number("Seed", 0, min=0, step=1)
        self._run = gui.add_button("Plan")
        self._cloud: Any = gui.add_checkbox("Predicted error and chosen poses in the scene", True)
        self._said = gui.add_html(words.paragraph("There is no plan of this window yet."))
        self._enough = Picture(window, "How many poses are enough")
        self._files: Any = gui.add_button_group("Download", _FILES, visible=False)
        self._planned: Planned | None = None
        self._run.on_click(window.action(self._plan))
        self._cloud.on_update(window.action(self._draw))
        self._files.on_click(window.action(self._download))

    def refresh(self) -> None:
        """Show the picture as light or dark as the window is."""
        self._files.visible = all(exists(self._window.project.path(name)) for name in _FILES)
        self._picture()

    def _plan(self) -> None:
        window, settings = self._window, self._window.project.settings
        window.start(
            "Plan",
            planned,
            self._done,
            folder=window.project.folder,
            robot=settings.robot,
            poses=_count(self._poses.value),
            out=_FILES[0],
            model=self._model.value,
            device=chosen(self._device),
            noise=float(self._noise.value) / 1e3,
            candidates=None if chosen(self._device) else int(self._candidates.value),
            seed=int(self._seed.value),
            payload=settings.payload,
        )

    def _done(self, found: Planned) -> None:
        self._planned = found
        written = f"Written: {', '.join(found.outcome.files)}"
        self._said.content = words.lines([*found.outcome.lines, written])
        self._draw()

    def _draw(self) -> None:
        scene = next(page.scene for page in self._window.pages if isinstance(page, JogPage))
        found = self._planned if self._cloud.value else None
        if found is None or scene.solid is None:
            scene.show_points("predicted", None)
            scene.show_points("chosen", None)
            return
        base = scene.solid.robot.base  # where the instrument has found it, if it has
        chosen_at, places = (points @ base.rotation.T + base.translation for points in (found.chosen, found.places))
        low, high = float(found.errors.min()), float(found.errors.max())
        scene.show_points("predicted", places, coloured(found.errors, low, high))
        scene.show_points("chosen", chosen_at, _CHOSEN)

    def _picture(self) -> None:
        if self._planned is not None:
            self._enough.show(self._planned.enough)

    def _download(self) -> None:
        self._window.download(self._window.project.path(self._files.value))


def _count(text: str) -> int | str:
    text = text.strip()
    if text == "auto" or text.isdecimal():
        return text if text == "auto" else int(text)
    raise InputError("a number of poses belongs here", parameter="poses", came=text, allowed="a whole number, or auto")
