"""Errors as arrows in the scene, magnified, from before the calibration to after it."""

from __future__ import annotations

from typing import Any

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import exists
from truearm.studio import words
from truearm.studio.arrows import FACTORS, error_arrows
from truearm.studio.error_vectors import ErrorVectors, error_vectors
from truearm.studio.pages.check import data_of
from truearm.studio.pages.jog import JogPage
from truearm.studio.scene import Scene
from truearm.studio.window import Window

#: Under this name they are in the scene.
_NAME = "errors"


class ErrorArrows:
    """A part of the page Proof: draws the errors of the result where they were read."""

    def __init__(self, window: Window) -> None:
        self._window = window
        self._vectors: ErrorVectors | None = None
        self._of: tuple[Any, ...] = ()
        gui = window.gui
        with gui.add_folder("Errors in the scene"):
            self._draw = gui.add_button("Draw the errors")
            self._factor: Any = gui.add_number("Magnified by", 200.0, min=FACTORS[0], max=FACTORS[1], step=1.0)
            self._share: Any = gui.add_slider("Before (0) to after (1)", 0.0, 1.0, 0.05, 1.0)
            self._said = gui.add_html("", visible=False)
            self._hide = gui.add_button("Take them away")
        self._draw.on_click(window.action(self._find))
        self._factor.on_update(window.action(self._show))
        self._share.on_update(window.action(self._show))
        self._hide.on_click(window.action(self._clear))
        self.refresh()

    def refresh(self) -> None:
        """Take arrows away that are of another result or of other measurements."""
        if self._vectors is not None and self._now() != self._of:
            self._clear()
        self._enable()

    def _find(self) -> None:
        window, settings = self._window, self._window.project.settings
        folder = window.project.file("result")
        if folder is None or not exists(folder / "result.json"):
            raise InputError("there is no result yet", cure="Calibrate first.")
        window.refuse_result_of_another()
        window.start(
            "Draw the errors",
            error_vectors,
            self._found,
            folder=window.project.folder,
            robot=settings.robot,
            data=data_of(window),
            result=settings.result,
            train=settings.train,
            seed=settings.seed or None,
            loss=settings.loss,
            payload=settings.payload,
            exclude=settings.exclude,
        )

    def _found(self, vectors: ErrorVectors) -> None:
        self._vectors, self._of = vectors, self._now()
        self._show()
        self._enable()

    def _show(self) -> None:
        if self._vectors is not None:
            errors = self._vectors.between(float(self._share.value))
            arrows = error_arrows(self._vectors.points, errors, float(self._factor.value))
            self._scene().show_arrows(_NAME, arrows)
            self._said.content = words.paragraph(f"In the scene: {arrows.words}.")

    def _clear(self) -> None:
        self._vectors = None
        self._scene().show_arrows(_NAME, None)
        self._enable()

    def _enable(self) -> None:
        for element in (self._factor, self._share, self._hide):
            element.disabled = self._vectors is None
        self._said.visible = self._vectors is not None

    def _scene(self) -> Scene:
        return next(page.scene for page in self._window.pages if isinstance(page, JogPage))

    def _now(self) -> tuple[Any, ...]:
        """Return what the arrows are of."""
        project = self._window.project
        stamps = []
        for file in (project.file("data"), project.file("exclude"), project.file("result")):
            place = None if file is None else (file / "result.json" if file.is_dir() else file)
            stat = None if place is None or not exists(place) else place.stat()
            stamps.append(None if stat is None else (str(place), stat.st_mtime_ns, stat.st_size))
        return (*stamps, project.settings.robot, project.settings.payload)
