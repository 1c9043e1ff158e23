"""Base, targets and fixtures as rows, written into a robot file of the project."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import exists, read_text
from truearm.engine.robot.library import load_robot, urdf_source
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.studio import words
from truearm.studio.cell_places import (
    THINGS,
    Thing,
    file_for_places,
    free_name,
    numbers_of,
    placed_text,
    things_of,
    with_base,
    with_thing,
)
from truearm.studio.window import Window

#: Where a new fixture stands [mm], and how far beside it the next one.
_FIRST, _ASIDE = (500.0, -300.0, 0.0), 100.0
_PLACE, _TURNS = "x, y, z [mm]", "rx, ry, rz [deg]"


@dataclass(frozen=True)
class _Row:
    """Fields of a target or fixture: its folder, name, kind, place and turns."""

    folder: Any
    name: Any
    kind: Any
    place: Any
    turns: Any


class CellPlaces:
    """A part of the page Cell."""

    def __init__(self, window: Window) -> None:
        self._window = window
        self._rows: dict[str, _Row] = {}
        gui, zeros = window.gui, (0.0, 0.0, 0.0)
        self.place = gui.add_folder("Base, targets and fixtures", expand_by_default=False)
        with self.place:
            gui.add_html(
                words.paragraph(
                    "The instrument is the origin of the world. Base and fixtures stand in its frame, targets on the "
                    "flange. A change is written into a robot file of the project, which is then the robot."
                )
            )
            with gui.add_folder("Base in the instrument's frame"):
                self._base: Any = gui.add_vector3(_PLACE, zeros, step=0.1)
                self._turns: Any = gui.add_vector3(_TURNS, zeros, step=0.1, hint="about the fixed axes, in turn")
            self._add: Any = gui.add_button_group("Add", ("target", "point", "plane", "frame"))
        for element in (self._base, self._turns):
            element.on_update(window.settled(self._moved))
        self._add.on_click(window.action(self._added))

    def refresh(self) -> None:
        """Show the places of the robot."""
        try:
            robot = self._robot()
        except InputError:
            return  # what is known of the robot says so
        place, turns = numbers_of(robot.base)
        _show(self._base, place)
        _show(self._turns, turns)
        things = {thing.name: thing for thing in things_of(robot)}
        for name in [name for name in self._rows if name not in things]:
            self._rows.pop(name).folder.remove()
        for name, thing in things.items():
            row = self._rows.get(name) or self._row(thing)
            for element, value in zip(
                (row.name, row.kind, row.place, row.turns), (name, thing.kind, thing.place, thing.turns), strict=True
            ):
                _show(element, value)
            row.turns.visible = thing.turned

    def _row(self, thing: Thing) -> _Row:
        gui, name = self._window.gui, thing.name
        with self.place:
            folder = gui.add_folder(words.one_line(name))
            with folder:
                called = gui.add_text("Name", name, hint="as the data call it")
                kind = gui.add_dropdown("Kind", THINGS, initial_value=thing.kind)
                place = gui.add_vector3(_PLACE, thing.place, step=0.1)
                turns = gui.add_vector3(_TURNS, thing.turns, step=0.1, hint="about the fixed axes, in turn")
                remove = gui.add_button(f"Remove {words.one_line(name)}")
        row = self._rows[name] = _Row(folder, called, kind, place, turns)
        for element in (called, place, turns):
            element.on_update(self._window.settled(partial(self._changed, name)))
        kind.on_update(self._window.action(partial(self._changed, name)))
        remove.on_click(self._window.action(lambda: self._write(with_thing(self._robot(), None, name))))
        return row

    def _changed(self, name: str) -> None:
        row = self._rows.get(name)
        if row is None:
            return
        thing = Thing(str(row.name.value).strip(), row.kind.value, tuple(row.place.value), tuple(row.turns.value))
        if thing == next((one for one in things_of(self._robot()) if one.name == name), None):
            return
        self._write(with_thing(self._robot(), thing, name))

    def _added(self) -> None:
        kind, robot = self._add.value, self._robot()
        taken = {thing.name for thing in things_of(robot)}
        name = free_name(kind, taken)
        x, y, z = _FIRST
        place = {"target": (0.0, 0.0, 100.0), "plane": (0.0, 0.0, -100.0)}.get(kind, (x, y + _ASIDE * len(taken), z))
        self._write(with_thing(robot, Thing(name, kind, place)))

    def _moved(self) -> None:
        place, turns = tuple(self._base.value), tuple(self._turns.value)
        robot = self._robot()
        if (place, turns) == numbers_of(robot.base):
            return
        self._write(with_base(robot, place, turns))

    def _robot(self) -> Robot:
        """Return the robot without what it carries, which the project says."""
        return load_robot(self._window.project.robot_source())

    def _write(self, robot: Robot) -> None:
        """Write a robot file of the project, and choose it; a file that was not written so is not replaced."""
        window = self._window
        settings = window.project.settings
        name = file_for_places(settings.robot, robot.name, window.project.names(".yaml"))
        path, text = window.project.path(name), placed_text(robot, name)
        known = read_text(path) if exists(path) else None
        if known is not None and known != robot_text(load_robot(path)):
            raise InputError(
                "this file was not written here, and is not changed",
                where=name,
                cure="Edit it yourself, or give it a name that does not end in -cell.yaml.",
            )
        looks = settings.meshes if urdf_source(settings.robot) is None else settings.robot
        window.edit({name: text}, known={name: known}, robot=name, meshes=looks)


def _show(element: Any, value: Any) -> None:
    if element.value != value:
        element.value = value
