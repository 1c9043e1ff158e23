"""From measurements to a calibrated robot."""

from __future__ import annotations

import time
from typing import Any, ClassVar, Final

from truearm.calibration.calibrating import FitStep
from truearm.engine.base.errors import InputError
from truearm.engine.base.files import exists, read_text
from truearm.engine.fit.every_effect import AUTO
from truearm.engine.fit.losses import LOSSES
from truearm.engine.fit.models import FRAMES, MODELS
from truearm.studio import words
from truearm.studio.evaluated_with import OTHER_SETTINGS
from truearm.studio.fit_course import fit_course
from truearm.studio.pages.check import choose_measurements, data_of
from truearm.studio.pages.fields import NONE, chosen, offer
from truearm.studio.pictures import Picture
from truearm.studio.project import stamp_of
from truearm.studio.tasks import Outcome, calibrate
from truearm.studio.window import Window

#: The course of a fit is drawn so often at most [s].
_PAUSE: Final = 0.5
_MODELS: Final = (AUTO, *(model.name for model in MODELS), FRAMES.name)
#: What stands for the model that robot and data ask for.
_BY_DEFAULT: Final = "by default"
_STALE: Final = OTHER_SETTINGS(
    "The figures below were made with another robot, measurements, payload, exclusions or settings than are chosen "
    "now. Calibrate again, or look at the page Proof: it says what the result is of, and what differs."
)


class CalibratePage:
    """Chooses the model and runs :func:`truearm.calibrate`; the result stands in the project as the command's does."""

    title: ClassVar[str] = "Calibrate"

    def __init__(self, window: Window) -> None:
        self._window = window
        gui, settings = window.gui, window.project.settings
        self._data = gui.add_dropdown("Measurements", (NONE,))
        self._model = gui.add_dropdown("Model", (_BY_DEFAULT,))
        self._train: Any = gui.add_text("Train on", "", hint="configurations, or all; empty for 70 %")
        self._seed: Any = gui.add_text("Seed", str(settings.seed), hint="of the split, a whole number from 0 on")
        self._loss = gui.add_dropdown("Loss", tuple(LOSSES))
        self._replace: Any = gui.add_checkbox("Replace a sound result", False, hint="even by one that is not sound")
        self._run = gui.add_button("Calibrate")
        self._steps: list[FitStep] = []
        self._drawn = 0.0
        self._shown: tuple[int, bool] = (0, False)
        self._lines, self._made = "", self._asked()
        self._course = Picture(window, "Cost and error, step by step", 0.75)
        self._now = gui.add_html("")
        self._judged = gui.add_html("")
        self._said = gui.add_html("")
        self._data.on_update(window.action(lambda: choose_measurements(window, chosen(self._data))))
        self._model.on_update(window.action(lambda: window.edit(model=chosen(self._model, _BY_DEFAULT))))
        self._train.on_update(window.settled(lambda: window.edit(train=_train(self._train.value))))
        self._seed.on_update(window.settled(lambda: window.edit(seed=_whole(self._seed.value, "seed"))))
        self._loss.on_update(window.action(lambda: window.edit(loss=self._loss.value)))
        self._run.on_click(window.action(self._calibrate))

    def refresh(self) -> None:
        """Show the settings."""
        self._draw()
        settings = self._window.project.settings
        offer(self._data, self._window.project.names(".csv"), settings.data)
        offer(self._model, _MODELS, settings.model, _BY_DEFAULT)
        offer(self._loss, LOSSES, settings.loss, None)
        self._train.value = "" if settings.train is None else str(settings.train)
        self._seed.value = str(settings.seed)
        self._judged.content = words.paragraph(
            "Nothing is held out: the errors flatter the model."
            if settings.train == "all"
            else "The result is judged on configurations that the fit has not seen."
        )
        self._said.content, stale = self._lines, bool(self._lines) and self._made != self._asked()
        self._now.content = words.notice(_STALE) if stale else ""

    def _asked(self) -> tuple[object, ...]:
        """Return what is calibrated with now."""
        project = self._window.project
        of, excluded = project.settings, project.file("exclude")
        without = read_text(excluded) if excluded is not None and exists(excluded) else ""
        files = stamp_of(project.robot_file()), stamp_of(project.file("data"))
        return of.robot, of.data, files, of.model, of.train, of.seed, of.loss, of.payload, without, of.result

    def _calibrate(self) -> None:
        window, settings = self._window, self._window.project.settings
        self._steps, self._shown = [], (0, False)
        asked, replace = self._asked(), self._replace.value
        self._replace.value = False
        window.start(
            "Calibrate",
            calibrate,
            lambda outcome: self._done(outcome, asked),
            self._told,
            folder=window.project.folder,
            robot=settings.robot,
            data=data_of(window),
            out=settings.result,
            model=settings.model,
            train=settings.train,
            seed=settings.seed,
            loss=settings.loss,
            payload=settings.payload,
            exclude=settings.exclude,
            replace=replace,
        )

    def _told(self, text: str) -> None:
        """Draw the course of the fit as far as it is known."""
        if isinstance(text, FitStep):
            self._steps.append(text)
            if time.monotonic() - self._drawn > _PAUSE:
                self._draw()

    def _draw(self) -> None:
        shown = (len(self._steps), self._window.project.settings.dark)
        if self._steps and shown != self._shown:
            self._shown = shown
            self._course.show(fit_course(self._steps), self._steps)
            self._drawn = time.monotonic()

    def _done(self, outcome: Outcome, asked: tuple[object, ...]) -> None:
        self._draw()
        written = f"Written to {self._window.project.settings.result}: {', '.join(outcome.files)}"
        if outcome.refused is not None:
            written = "Not written."
        self._lines, self._made = words.lines([*outcome.lines, written]), asked
        if outcome.refused is not None:
            raise outcome.refused


def _train(text: str) -> int | str | None:
    """Return what a text says of the training part: a number, all, or nothing."""
    text = text.strip()
    if not text or text == "all":
        return text or None
    allowed = "how many configurations, 1 or more; or all"
    if not text.isdecimal() or int(text) < 1:
        raise InputError("a whole number belongs here, or all", parameter="train", came=text, allowed=allowed)
    return int(text)


def _whole(text: str, parameter: str) -> int:
    try:
        return int(text)
    except ValueError as error:
        raise InputError("a whole number belongs here", parameter=parameter, came=text) from error
