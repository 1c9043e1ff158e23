"""What is wrong with measurements before they are believed."""

from __future__ import annotations

from typing import ClassVar

from truearm.errors import InputError
from truearm.notices import worst_first
from truearm.studio import words
from truearm.studio.pages.choices import NONE, chosen, offer
from truearm.studio.tasks import Outcome, check
from truearm.studio.window import Window


class CheckPage:
    """Chooses the measurements, and shows what :func:`truearm.check` finds in them as a table."""

    title: ClassVar[str] = "Check"

    def __init__(self, window: Window) -> None:
        self._window = window
        gui = window.gui
        self._data = gui.add_dropdown("Measurements", (NONE,), hint="a CSV file of the project")
        self._run = gui.add_button("Check the measurements")
        self._found = gui.add_html("")
        self._data.on_update(window.action(lambda: window.edit(data=chosen(self._data))))
        self._run.on_click(window.action(self._check))
        self._of: tuple[str, str] | None = None

    def refresh(self) -> None:
        """Offer the files of the folder; what was found of others is no longer shown."""
        settings = self._window.project.settings
        offer(self._data, self._window.project.names(".csv"), settings.data)
        if self._of is not None and self._of != (settings.robot, settings.data):
            self._found.content, self._of = words.paragraph("Robot or measurements have changed: check again."), None

    def _check(self) -> None:
        window, settings = self._window, self._window.project.settings
        data = data_of(window)
        of = (settings.robot, data)

        def done(outcome: Outcome) -> None:
            self._of = of
            rows = [[n.level, n.code, words.spelled(n.message)] for n in worst_first(outcome.notices)]
            shown = words.lines(outcome.lines[:1])
            shown += words.table(["level", "finding", "what it says"], rows) if rows else ""
            rest = [line for line in outcome.lines[1:] if not any(n.message in line for n in outcome.notices)]
            self._found.content = shown + words.lines(rest)

        window.start("Check", check, done, folder=window.project.folder, robot=settings.robot, data=data)


def data_of(window: Window) -> str:
    """Return the name of the measurements that are chosen.

    Raises
    ------
    InputError
        If none are.
    """
    if window.project.settings.data is None:
        raise InputError("no measurements are chosen", parameter="data", cure="Choose a CSV file on the page Check.")
    return window.project.settings.data
