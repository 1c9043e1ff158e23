"""Boxes to keep clear of as rows, written into a constraints file of the project and drawn in the scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import exists, read_text
from truearm.studio import words
from truearm.studio.cell_rules import CellRules, changed_rules, read_rules, with_box, with_length, without_box
from truearm.studio.pages.fields import NONE, Fields, chosen, offer
from truearm.studio.window import Window

#: The file that is written where none is chosen.
CONSTRAINTS: Final = "cell-constraints.yaml"
#: Where a new box stands [mm], by the length of the arm in m.
_FIRST: Final = ((500.0, 700.0), (-200.0, 200.0), (-100.0, 100.0))


@dataclass(frozen=True)
class _Row:
    """Fields of a box: its folder, its name, three ranges."""

    folder: Any
    name: Any
    ranges: tuple[Any, Any, Any]


class CellBoxes:
    """A part of the page Cell.

    Args:
        draw: Called with the boxes to draw.
        length: Returns the length of the arm [m].
    """

    def __init__(self, window: Window, draw: Callable[[CellRules | None], None], length: Callable[[], float]) -> None:
        self._window, self._draw, self._length = window, draw, length
        self._rows: dict[str, _Row] = {}
        self._rules: CellRules | None = None
        gui = window.gui
        self.place = gui.add_folder("Boxes to keep clear of", expand_by_default=False)
        with self.place:
            self._file: Any = gui.add_dropdown("Constraints", (NONE,), hint="boxes, floor and clearance: a file")
            self._fields = Fields(window, self._lengths, self._set_length)
            self._fields.number("floor", "Floor [mm]", "base frame; below 0 it is kept clear on the ways, too")
            self._fields.number("clearance", "Clearance [mm]", "between middle lines of links, where one measures")
            self._draws: Any = gui.add_checkbox("Draw", True, hint="the boxes in the scene")
            self._said = gui.add_html("")
            self._add = gui.add_button("Add a box")
        self._file.on_update(window.action(lambda: window.edit(constraints=chosen(self._file))))
        self._draws.on_update(window.action(self.refresh))
        self._add.on_click(window.action(self._added))

    def refresh(self) -> None:
        """Show what the file says now; its boxes are in the scene, too."""
        settings, project = self._window.project.settings, self._window.project
        offer(self._file, project.names(".yaml", ".yml"), settings.constraints)
        path = project.file("constraints")
        self._rules, said = None, ""
        if path is not None and exists(path):
            try:
                self._rules = read_rules(path)
            except InputError as error:
                said = words.paragraph(words.refusal(error))
        self._said.content = said
        self._fields.refresh()
        self._show_rows()
        self._draw(self._rules if self._draws.value else None)

    # Rows --------------------------------------------------------------------------------------------------------

    def _show_rows(self) -> None:
        boxes = {} if self._rules is None else self._rules.boxes
        for name in [name for name in self._rows if name not in boxes]:
            self._rows.pop(name).folder.remove()
        for name, ranges in boxes.items():
            row = self._rows.get(name) or self._row(name)
            for element, text in zip((row.name, *row.ranges), (name, *ranges), strict=True):
                if element.value != text:
                    element.value = text

    def _row(self, name: str) -> _Row:
        gui = self._window.gui
        with self.place:
            folder = gui.add_folder(words.one_line(name))
            with folder:
                called = gui.add_text("Name", name)
                x, y, z = (
                    gui.add_text(
                        f"{axis} [mm]", "", hint="from..to in the base frame; empty: without end on both sides"
                    )
                    for axis in "xyz"
                )
                remove = gui.add_button("Remove the box")
        row = self._rows[name] = _Row(folder, called, (x, y, z))
        for element in (called, x, y, z):
            element.on_update(self._window.settled(partial(self._changed, name)))
        remove.on_click(self._window.action(partial(self._write, without_box(name))))
        return row

    def _changed(self, name: str) -> None:
        row = self._rows.get(name)
        if row is None:
            return
        x, y, z = (str(element.value).strip() for element in row.ranges)
        self._write(with_box(str(row.name.value).strip(), (x, y, z), name))

    def _added(self) -> None:
        taken = self._rows
        name = next(f"box_{k}" for k in range(1, len(taken) + 2) if f"box_{k}" not in taken)
        x, y, z = ("..".join(f"{round(end * self._length(), -1):g}" for end in ends) for ends in _FIRST)
        self._write(with_box(name, (x, y, z)))

    # The file ----------------------------------------------------------------------------------------------------

    def _lengths(self) -> dict[str, float | None]:
        rules = self._rules
        return (
            {"floor": None, "clearance": None}
            if rules is None
            else {
                "floor": rules.floor,
                "clearance": rules.clearance,
            }
        )

    def _set_length(self, name: str, value: float | None) -> None:
        if self._rules is not None or value is not None:
            self._write(with_length(name, value))

    def _write(self, change: Callable[[dict[str, Any], str], None]) -> None:
        """Change the file, and choose it; nothing is overwritten that another program has written meanwhile."""
        window = self._window
        name = window.project.settings.constraints or CONSTRAINTS
        path = window.project.path(name)
        known = read_text(path) if exists(path) else None
        if self._rules is not None and known is not None:
            known = self._rules.text  # as it is shown
        rules = changed_rules(path, window.robot(), change)
        window.edit({name: rules.text}, known={name: known}, constraints=name)
