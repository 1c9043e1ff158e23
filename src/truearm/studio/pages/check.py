"""What is wrong with measurements before they are believed, and readings that are excluded."""

from __future__ import annotations

from itertools import count
from typing import Any, ClassVar, Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, counted
from truearm.engine.base.files import exists, read_text
from truearm.engine.data.excluded import Exclusion, exclusions_text, read_exclusions
from truearm.engine.robot.chain import Array
from truearm.studio import words
from truearm.studio.checked import Checked, checked, with_exclusions
from truearm.studio.pages.fields import NONE, chosen, offer
from truearm.studio.pages.jog import JogPage
from truearm.studio.project import stamp_of
from truearm.studio.window import Window

#: What is chosen instead of a finding, and instead of a reading.
_ANY: Final = "(any reading)"
_ALL: Final = "(all of them)"
#: So many readings are offered at most.
_LISTED: Final = 2000
#: The file of excluded readings, where none is chosen and none is there; else it has a number.
_FILE: Final = "excluded{}.csv"
#: How other readings, chosen ones and excluded ones are drawn: name, colour, and size by the length of the arm.
_DRAWN: Final = (
    ("readings", (150, 156, 166), 0.005),
    ("finding", (214, 69, 61), 0.016),
    ("excluded", (230, 140, 0), 0.012),
)
_NAMELESS: Final = "This finding names no readings."
_RULE: Final = (
    "Exclude readings for reasons of the instrument alone, such as a broken beam. To exclude what fits badly, or to "
    "measure it again, falsifies the proof. Nothing is deleted: the reasons stand in a file of the project, and the "
    "report counts what was excluded, in the held-out part too."
)


class CheckPage:
    """Shows what :func:`truearm.check` finds as a table and in the scene, and excludes readings."""

    title: ClassVar[str] = "Check"

    def __init__(self, window: Window) -> None:
        self._window = window
        self._checked: Checked | None = None
        self._of: tuple[Any, ...] = ()
        self._shown: tuple[Any, ...] = ()
        self._excluded: tuple[Exclusion, ...] = ()
        self._text: str | None = None  # of their file
        self._reason_of: tuple[str | None, str | None] = (None, None)  # measurements, and the file of excluded readings
        gui = window.gui
        self._data: Any = gui.add_dropdown("Measurements", (NONE,), hint="a CSV file of the project")
        self._file: Any = gui.add_dropdown("Exclude", (NONE,), hint="a file of readings that are excluded")
        self._run = gui.add_button("Check the measurements")
        self._found = gui.add_html("")
        with gui.add_folder("Readings", visible=False) as self._readings:
            self._finding: Any = gui.add_dropdown("Finding", (_ANY,))
            self._reading: Any = gui.add_dropdown("Reading", (_ALL,), hint="configuration/target")
            self._draws: Any = gui.add_checkbox("In the scene", True)
            self._drawn = gui.add_html("")
            self._arm: Any = gui.add_button("Move the drawn arm there")
            self._reason: Any = gui.add_text("Reason", "", hint="what went wrong with the instrument")
            self._exclude: Any = gui.add_button("Exclude")
        with gui.add_folder("Excluded readings"):
            gui.add_html(words.paragraph(_RULE))
            self._table = gui.add_html("")
            self._back: Any = gui.add_dropdown("Reading", (NONE,), visible=False)
            self._restore: Any = gui.add_button("Restore", visible=False)
        self._data.on_update(window.action(lambda: choose_measurements(window, chosen(self._data))))
        self._file.on_update(window.action(lambda: window.edit(exclude=chosen(self._file))))
        self._run.on_click(window.action(self._check))
        self._finding.on_update(window.action(self._choose))
        self._reading.on_update(window.action(self._choose_reading))
        self._draws.on_update(window.action(self._draw))
        self._arm.on_click(window.action(self._go))
        self._exclude.on_click(window.action(self._add))
        self._restore.on_click(window.action(self._remove))

    def refresh(self) -> None:
        """Offer the files of the folder; what was found of others is no longer shown."""
        project, settings = self._window.project, self._window.project.settings
        offer(self._data, project.names(".csv"), settings.data)
        offer(self._file, project.names(".csv"), settings.exclude)
        self._show_excluded()
        if self._reason_of != (settings.data, settings.exclude):
            self._reason.value, self._reason_of = "", (settings.data, settings.exclude)
        if self._checked is not None and self._of != self._now():
            changed = "Exclusions" if self._of[:2] == self._now()[:2] else "Robot or measurements"
            self._found.content = words.paragraph(f"{changed} have changed: check again.")
            if changed != "Exclusions":
                self._checked = None
        self._readings.visible = self._checked is not None
        self._draw()

    # -- checking ------------------------------------------------------------------------------------------

    def _check(self) -> None:
        window, settings = self._window, self._window.project.settings
        data, of = data_of(window), self._now()

        def done(found: Checked) -> None:
            self._checked, self._of = found, of
            rows = [[finding.level, finding.code, words.spelled(finding.message)] for finding in found.findings]
            shown = words.lines(found.outcome.lines[:1])
            shown += words.table(["level", "finding", "what it says"], rows) if rows else ""
            messages = [finding.message for finding in found.findings]
            rest = [line for line in found.outcome.lines[1:] if not any(text in line for text in messages)]
            self._found.content = shown + words.lines(rest)
            names = [_name(number, finding) for number, finding in enumerate(found.findings, 1)]
            offer(self._finding, (_ANY, *names), next(iter(names), _ANY), None)
            self._draws.value = any(finding.at for finding in found.findings)  # what is right does not stand in the way
            self._choose()

        window.start(
            "Check",
            checked,
            done,
            folder=window.project.folder,
            robot=settings.robot,
            data=data,
            exclude=settings.exclude,
        )

    def _choose(self) -> None:
        """Offer the readings of the chosen finding, and draw them; where none is chosen, no reading is either."""
        found = self._checked
        if found is None:
            return
        named = self._named(found)[:_LISTED]
        first = _ALL if self._finding.value != _ANY and named else NONE
        offer(self._reading, (first, *(_reading(*found.readings[k]) for k in named)), first, None)
        self._choose_reading()

    def _choose_reading(self) -> None:
        """Draw what is chosen; the reason that was given is that of another reading."""
        self._reason.value = ""
        self._draw()

    def _named(self, found: Checked) -> list[int]:
        """Return the readings of the chosen finding; all if none is chosen."""
        for number, finding in enumerate(found.findings, 1):
            if self._finding.value == _name(number, finding):
                return [int(k) for k in found.rows_of(finding.at)]
        return list(range(len(found.readings)))

    def _chosen(self, found: Checked) -> list[int]:
        rows = self._named(found)
        if self._reading.value == _ALL:
            return rows
        return [k for k in rows if _reading(*found.readings[k]) == self._reading.value]

    # -- the scene -----------------------------------------------------------------------------------------

    def _draw(self) -> None:
        jog = next((page for page in self._window.pages if isinstance(page, JogPage)), None)
        found = self._checked
        if jog is None:
            return
        scene = jog.scene
        solid = None if scene.solid is None else scene.solid.robot
        shown = (found, self._finding.value, self._reading.value, self._excluded, solid, self._draws.value)
        if shown == self._shown:
            return
        self._shown = shown
        if found is None or scene.solid is None or not self._draws.value:
            for name, *_ in _DRAWN:
                scene.show_points(name, None)
            self._drawn.content = "" if found is None or self._named(found) else words.paragraph(_NAMELESS)
            return
        base = scene.solid.robot.base
        points = found.points @ base.rotation.T + np.array(base.translation)
        rows = self._chosen(found)
        gone = {(one.configuration, one.target) for one in self._excluded}
        out = [k for k, reading in enumerate(found.readings) if reading in gone]
        others = sorted(set(range(len(points))) - {*rows, *out})
        for (name, colour, size), some in zip(_DRAWN, (others, [k for k in rows if k not in out], out), strict=True):
            scene.show_points(name, _seen(points[some]), colour, size)
        unseen = len(rows) - len(_seen(points[rows]))
        told = f"{counted(len(rows), 'reading')} chosen: red in the scene; excluded ones are orange, all others grey."
        if not self._named(found):
            told = f"{_NAMELESS} {told}"
        self._drawn.content = words.paragraph(
            told
            + (f" The first {_LISTED} can be chosen here." if len(self._named(found)) > _LISTED else "")
            + (f" {unseen} of them have no place in the instrument's frame, and are not drawn." if unseen else "")
        )

    def _go(self) -> None:
        found = self._checked
        rows = [] if found is None else self._chosen(found)
        if found is None or not rows:
            raise InputError("no reading is chosen", parameter="Reading", cure="Choose one, or a finding.")
        next(page for page in self._window.pages if isinstance(page, JogPage)).go_to_joints(found.joints[rows[0]])

    # -- excluding -----------------------------------------------------------------------------------------

    def _add(self) -> None:
        found = self._checked
        rows = [] if found is None else self._chosen(found)
        if found is None or not rows:
            raise InputError("no reading is chosen", parameter="Reading", cure="Choose one, or a finding.")
        self._write(with_exclusions(self._excluded, found.named(rows), self._reason.value))
        self._reason.value = ""

    def _remove(self) -> None:
        kept = [one for one in self._excluded if _reading(one.configuration, one.target) != self._back.value]
        self._write(tuple(kept))

    def _write(self, excluded: tuple[Exclusion, ...]) -> None:
        project = self._window.project
        names = (_FILE.format(f"-{k}" if k > 1 else "") for k in count(1))
        name = project.settings.exclude or next(one for one in names if not exists(project.path(one)))
        self._window.edit({name: exclusions_text(excluded)}, known={name: self._text}, exclude=name)

    def _show_excluded(self) -> None:
        path = self._window.project.file("exclude")
        there = path is not None and exists(path)
        self._text = read_text(path) if path is not None and there else None
        self._excluded = read_exclusions(path) if path is not None and there else ()
        rows = [[_reading(one.configuration, one.target), one.reason] for one in self._excluded]
        self._table.content = words.table(["reading", "reason"], rows) if rows else words.paragraph("None.")
        self._back.visible = self._restore.visible = bool(rows)
        if rows:
            names = dict.fromkeys(row[0] for row in rows)
            offer(self._back, names, self._back.value if self._back.value in names else next(iter(names)), None)

    # -- what is shown is of what --------------------------------------------------------------------------

    def _now(self) -> tuple[Any, ...]:
        project = self._window.project
        data = (project.settings.data, stamp_of(project.file("data")))
        return (project.settings.robot, stamp_of(project.robot_file())), data, self._excluded


NOTHING_EXCLUDED: Final = Rule(
    "nothing-excluded",
    "warning",
    "other measurements are chosen, so that the readings excluded from the former ones are no longer",
)


def choose_measurements(window: Window, name: str | None) -> None:
    """Choose measurements; what was excluded from other ones is no longer, for it is said of readings by their names.

    Args:
        name: Of their file; None for none.
    """
    settings = window.project.settings
    if settings.data in (None, name) or settings.exclude is None:
        window.edit(data=name)
        return
    told = _excludes(window, settings.exclude)
    window.edit(data=name, exclude=None)
    if not told:
        return
    text = (
        f"{settings.exclude} excludes readings of {settings.data}. Other measurements are chosen, so nothing is "
        "excluded now. Undo brings both back; if its readings are among these too, choose it again on the page Check."
    )
    window.tell(NOTHING_EXCLUDED(text))


def _excludes(window: Window, name: str) -> bool:
    """Return whether a file excludes readings; one that cannot be read may."""
    try:
        path = window.project.path(name)
        return exists(path) and bool(read_exclusions(path))
    except InputError:
        return True


def data_of(window: Window) -> str:
    """Return the name of the measurements that are chosen.

    Raises:
        InputError: If none are.
    """
    if window.project.settings.data is None:
        raise InputError("no measurements are chosen", parameter="data", cure="Choose a CSV file on the page Check.")
    return window.project.settings.data


def _name(number: int, finding: Notice) -> str:
    return f"{number}. {finding.level} {finding.code}"


def _reading(configuration: str, target: str) -> str:
    return f"{configuration}/{target}"


def _seen(points: Array) -> Array:
    return np.asarray(points[np.isfinite(points).all(axis=1)])
