"""Lines, circles and curves through waypoints, made where the tip is, and played: a part of the page Jog."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import exists, read_text
from truearm.engine.base.schemas import validated
from truearm.engine.motion.path_file import PathFile, PlannedPath, planned_path, read_path
from truearm.engine.robot.chain import Array
from truearm.studio import words
from truearm.studio.jogging import Jogging
from truearm.studio.path_points import (
    PlayedPath,
    Point,
    entries_of,
    in_words,
    new_path,
    path_text,
    played_path,
    with_orientation,
    with_section,
    with_speed,
    without_last,
)
from truearm.studio.recorded import Motion
from truearm.studio.scene import Scene
from truearm.studio.window import Window

#: The file that is written where none is named.
PATH: Final = "path.yaml"
_FREE, _KEPT = "free", "direction of z as at its start"
_LINE: Final = (70, 130, 180)


class JogPath:
    """Makes a path file point by point, draws the path, and plays it as :func:`truearm.path` follows it.

    Args:
        arm: Returns the arm that is jogged, after ending what is played.
        play: Plays a motion.
        stop: Ends it.
    """

    def __init__(
        self,
        window: Window,
        scene: Scene,
        arm: Callable[[], Jogging],
        play: Callable[[Motion], None],
        stop: Callable[[], None],
    ) -> None:
        self._window, self._scene, self._arm, self._play, self._stop = window, scene, arm, play, stop
        self._path: dict[str, Any] | None = None
        self._first: Point | None = None
        self._axis: Point | None = None  # where the tip's z axis pointed at the start, if that was made here
        self._drawn: tuple[Any, ...] = (None,)
        gui = window.gui
        with gui.add_folder("Path", expand_by_default=False):
            self._file: Any = gui.add_text("File", PATH, hint="a path file; made here, or any other to be played")
            self._kept: Any = gui.add_dropdown("Orientation", (_FREE, _KEPT), hint="all along the path")
            self._speed: Any = gui.add_number("Speed [mm/s]", 200.0, min=0.1, max=5000.0, step=10.0)
            self._add: Any = gui.add_button_group(
                "From here", ("start", "line", "circle", "waypoint"), hint="where the tip is now; a circle takes two"
            )
            self._do: Any = gui.add_button_group("Path", ("play", "stop", "remove last"))
            self._draws: Any = gui.add_checkbox("Draw", True, hint="the path in the scene")
            self._said = gui.add_html(words.paragraph(_NONE))
        self._kept.on_update(window.action(self._other_orientation))
        self._file.on_update(window.settled(lambda: window.edit(path=self._file.value.strip() or None)))
        self._speed.on_update(window.settled(self._other_speed))
        self._add.on_click(window.action(lambda: self._added(self._add.value)))
        self._do.on_click(window.action(self._done))
        self._draws.on_update(window.action(self._drawn_or_not))

    def refresh(self) -> None:
        """Show the path of the file, in words and in the scene."""
        project = self._window.project
        name = project.settings.path or PATH
        if self._file.value != name:
            self._file.value = name
        self._show_orientation()
        path, solid = project.path(name, "path"), self._scene.solid
        stamp = path.stat().st_mtime_ns if exists(path) else None
        seen = (name, stamp, None if solid is None else id(solid))
        if seen == self._drawn:
            return
        is_other = name != self._drawn[0]
        self._drawn = seen
        self._scene.show_line("path", None)
        self._first = None
        if stamp is None:
            if self._path is not None and self._path["sections"]:  # of a file that is gone, as an undo takes it away
                self._path = None if is_other else {**self._path, "sections": []}
            self._say()
            return
        began = None if is_other or self._path is None else self._path["start"]
        try:
            planned = read_path(path)
            self._path = entries_of(read_text(path))
            if self._path is None or self._path["start"] != began:
                self._axis = None
            if self._path is not None:
                self._speed.value = float(self._path["speed"])
                self._show_orientation()
            self._show(planned)
        except InputError as error:
            self._path = None
            self._said.content = words.paragraph(words.refusal(error))

    # What a user does --------------------------------------------------------------------------------------------

    def _added(self, kind: str) -> None:
        arm, path = self._arm(), self._known()
        if kind == "start":
            if path is not None and path["sections"]:
                raise InputError("this path has begun already", where=self._name(), cure="Name another file.")
            position, rotation = arm.pose()
            self._axis = _point(rotation[:, 2])
            axis = None if self._kept.value == _FREE else self._axis
            speed, tip = float(self._speed.value), arm.tip
            self._path = new_path(_point(1e3 * position), speed, frame="base", target=tip, axis=axis)
            self._first = None
            self._say()
            return
        if path is None:
            raise InputError("the path has no start yet", where=self._name(), cure="Go there, and press start.")
        here = _point(1e3 * arm.pose("world" if path["frame"] == "world" else "base")[0])
        if kind == "circle" and self._first is None:
            self._first = here
            self._say("A circle through here: go to another point of it, and press circle again.")
            return
        points = [here] if self._first is None or kind != "circle" else [self._first, here]
        self._first = None
        self._write(with_section(path, "hermite" if kind == "waypoint" else kind, points))

    def _done(self) -> None:
        if self._do.value == "stop":
            self._stop()
        elif self._do.value == "play":
            self._start()
        else:
            path = self._known()
            left = None if path is None else without_last(path)
            self._first = None
            if left is not None and left["sections"]:
                self._write(left)
            elif path is not None and path["sections"]:
                raise InputError("the only section of a file is not removed", where=self._name())
            else:
                self._path = None
                self._say()

    def _other_speed(self) -> None:
        path = self._path
        if path is not None and path["sections"]:
            self._write(with_speed(path, float(self._speed.value)))
        elif path is not None:
            self._path = with_speed(path, float(self._speed.value))

    def _other_orientation(self) -> None:
        path = self._path
        if path is None:
            return
        if self._kept.value == _KEPT and self._axis is None:
            raise InputError(
                "where z pointed at the start of this path is not known any more, and its orientation stays free",
                where=self._name(),
                cure="Name another file, and press start there.",
            )
        path = with_orientation(path, None if self._kept.value == _FREE else self._axis)
        if path["sections"]:
            self._write(path)
        else:
            self._path = path

    def _start(self) -> None:
        window, arm = self._window, self._arm()
        if not exists(window.project.path(self._name(), "path")):
            raise InputError("there is no path to play", where=self._name(), cure="Give it a start and a section.")
        window.start(
            "Play the path",
            played_path,
            self._found,
            folder=window.project.folder,
            robot=arm.robot,
            file=self._name(),
            seed=arm.joints,
        )

    def _found(self, found: PlayedPath) -> None:
        self._window.tell_lines("Path", found.outcome.lines)
        self._play(found.motion)

    # The file ----------------------------------------------------------------------------------------------------

    def _name(self) -> str:
        return self._window.project.settings.path or PATH

    def _known(self) -> dict[str, Any] | None:
        """Return the path that is made; None if there is none yet; a file that was not made here is not changed."""
        file = self._window.project.path(self._name(), "path")
        if exists(file) and (self._path is None or path_text(self._path) != read_text(file)):
            raise InputError(
                "this path was not made here, or was changed since, and is not changed",
                where=self._name(),
                cure="Name another file.",
            )
        return self._path

    def _write(self, path: dict[str, Any]) -> None:
        """Write the file, if it is a path: a circle through points of a line is none."""
        name = self._name()
        file = self._window.project.path(name, "path")
        planned_path(validated(path, PathFile, str(file)), str(file))
        before = path_text(self._path) if self._path is not None and exists(file) else None
        self._window.edit({name: path_text(path)}, known={name: before}, path=name)
        self._path = path

    def _drawn_or_not(self) -> None:
        self._drawn = self._drawn[:1]
        self.refresh()

    def _show(self, planned: PlannedPath) -> None:
        if self._path is None:
            self._said.content = words.paragraph(f"Of another program: {', '.join(planned.kinds)}. It can be played.")
        else:
            self._say()
        solid = self._scene.solid
        if solid is not None and self._draws.value:
            at: Array = planned.trajectory.position
            if planned.frame != "world":
                at = at @ solid.robot.base.rotation.T + solid.robot.base.translation
            self._scene.show_line("path", at, _LINE)

    def _show_orientation(self) -> None:
        if self._path is not None:
            self._kept.value = _KEPT if "orientation" in self._path else _FREE

    def _say(self, more: str = "") -> None:
        """Show the path that is made, in words."""
        said = words.paragraph(_NONE) if self._path is None else words.lines(in_words(self._path))
        self._said.content = said + (words.paragraph(more) if more else "")


_NONE: Final = "No path yet: go to where it starts, and press start."


def _point(values: Array) -> Point:
    x, y, z = np.asarray(values, float).tolist()
    return x, y, z
