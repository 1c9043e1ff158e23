"""What a plan is measured with, and in what air: fields of a file of the project, as the job reads it."""

from __future__ import annotations

from typing import Any, Final

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import exists, read_text
from truearm.engine.base.units import as_number
from truearm.measuring.reading_log import About, read_about
from truearm.studio import words
from truearm.studio.about_file import AIR, ENTRIES, changed_about, with_air, with_entry
from truearm.studio.pages.fields import Fields
from truearm.studio.window import Window

#: The file that is written where none is chosen.
_FILE: Final = "about.yaml"
_LABELS: Final = {
    "instrument": ("Instrument", "what it is called"),
    "instrument_serial": ("Its serial number", "of the instrument"),
    "robot_serial": ("Robot's serial number", "as on its plate"),
    "reflector_radius": ("Reflector, radius [mm]", "of the reflector; the instrument corrects for it"),
    "reflector_offset": ("Its offset [mm]", "of its centre from where the nest holds it"),
}
_AIR_LABELS: Final = {
    "temperature": ("Air [degC]", "its temperature"),
    "pressure": ("Air [hPa]", "its pressure"),
    "humidity": ("Air [percent]", "its humidity"),
}


class MeasuredWith:
    """A part of the page Measure.

    Args:
        fields: Of the page, for the name of the file.
    """

    def __init__(self, window: Window, fields: Fields) -> None:
        self._window = window
        self._known = About()
        gui = window.gui
        with gui.add_folder("Measured with", expand_by_default=False):
            fields.file("about", "File", (".yaml", ".yml"), "serial numbers, reflector and air; about.yaml is written")
            self._fields = Fields(window, self._now, self._set)
            for name in ENTRIES:
                label, hint = _LABELS[name]
                add = self._fields.number if ENTRIES[name].is_length else self._fields.text
                add(name, label, hint)
            with gui.add_folder("The air, as often as it is read"):
                self._when: Any = gui.add_text("When", "start")
                self._air: dict[str, Any] = {
                    name: gui.add_text(_AIR_LABELS[name][0], "", hint=_AIR_LABELS[name][1]) for name in AIR
                }
                self._add = gui.add_button("Add the reading of the air")
            self._said = gui.add_html("")
        self._add.on_click(window.action(self._add_air))

    def refresh(self) -> None:
        """Show what the file says now."""
        path = self._path()
        self._known, said = About(), ""
        if path is not None and exists(path):
            try:
                self._known = read_about(path)
                said = words.table(("what", "value"), self._known.rows())
            except InputError as error:
                said = words.paragraph(words.refusal(error))
        self._said.content = said
        self._fields.refresh()

    def _path(self) -> Any:
        project = self._window.project
        name = project.settings.measure.about
        return None if name is None else project.path(name, "about")

    def _now(self) -> dict[str, Any]:
        known = self._known
        lengths = {name: getattr(known, name) for name in ENTRIES if ENTRIES[name].is_length}
        shown = {name: None if value is None else round(value * 1e3, 9) for name, value in lengths.items()}
        return {**{name: getattr(known, name) for name in ENTRIES}, **shown}

    def _set(self, name: str, value: Any) -> None:
        self._write(with_entry(name, value))

    def _add_air(self) -> None:
        values = {}
        for name, element in self._air.items():
            text = str(element.value).strip()
            values[name] = as_number(text)
            if text and values[name] is None:
                raise InputError("a number belongs here", parameter=name, came=text)
        self._write(with_air(str(self._when.value).strip(), values))
        for element in (self._when, *self._air.values()):
            element.value = ""

    def _write(self, change: Any) -> None:
        said = self._window.project.settings.measure
        name = said.about or _FILE
        path = self._window.project.path(name, "about")
        known = read_text(path) if exists(path) else None
        text = changed_about(path, change)
        self._window.edit({name: text}, known={name: known}, measure={**said.model_dump(mode="json"), "about": name})
