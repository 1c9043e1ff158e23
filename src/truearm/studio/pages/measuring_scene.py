"""Readings and lines of sight of a measuring, in the scene."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.studio import words
from truearm.studio.measuring import ASIDE, INSTRUMENT, Measuring
from truearm.studio.pages.jog import JogPage
from truearm.studio.window import Window

_LEGEND: Final = (
    "Readings that are kept go from blue (they scatter by nothing) to yellow (by as much as is allowed), grey where "
    "nothing says how they were taken; violet ones are set aside. Lines of sight are green to what is next, and red to "
    "what the instrument does not see."
)
_KEPT, _ASIDE, _LINES, _NAMES = "measured-kept", "measured-aside", "measured-sight", "measured-names"
#: Of a point, by the length of the arm.
_SIZE: Final = 0.01
#: So high above it stands what the instrument is called, by the length of the arm: at it stands the name of the world.
_ABOVE: Final = 0.22
_ASIDE_SIZE: Final = 0.014


class MeasuringScene:
    """A part of the page Measure."""

    def __init__(self, window: Window) -> None:
        self._window, self._measuring, self._at = window, None, -1
        gui = window.gui
        with gui.add_folder("In the scene", expand_by_default=False):
            gui.add_html(words.paragraph(_LEGEND))
            self._points: Any = gui.add_checkbox("Readings", True)
            self._lines: Any = gui.add_checkbox("Lines of sight", True)
            self._follows: Any = gui.add_checkbox("Drawn arm at the next configuration", True)
        for element in (self._points, self._lines, self._follows):
            element.on_update(window.action(self._again))

    _measuring: Measuring | None

    def show(self, measuring: Measuring) -> None:
        """Draw the readings, and the arm and the lines of sight at the next configuration."""
        self._measuring = measuring
        jog = next((page for page in self._window.pages if isinstance(page, JogPage)), None)
        if jog is None or jog.scene.solid is None:
            return
        scene, base = jog.scene, jog.scene.solid.robot.base

        def in_scene(points: Array) -> Array:
            return np.asarray(points @ base.rotation.T + np.array(base.translation))

        points = measuring.points() if self._points.value else None
        if points is None:
            scene.show_points(_KEPT, None)
            scene.show_points(_ASIDE, None)
        else:
            scene.show_points(_KEPT, in_scene(points.kept), points.colours, _SIZE)
            scene.show_points(_ASIDE, in_scene(points.aside), ASIDE, _ASIDE_SIZE)
        step = measuring.campaign.session.next
        at = -1 if step is None else step.configuration
        joints = measuring.campaign.joints
        if at != self._at and at >= 0 and self._follows.value and joints.shape[1] == len(scene.joints):
            jog.go_to_joints(joints[at])
        self._at = at
        lines = measuring.lines_of_sight() if self._lines.value else None
        if lines is None:
            scene.show_lines(_LINES, None)
        else:
            scene.show_lines(_LINES, in_scene(lines.segments), lines.colours)
        names = {} if lines is None else lines.names
        above = {INSTRUMENT: np.array([0.0, 0.0, _ABOVE * scene.length])}
        places = {name: in_scene(place) + above.get(name, 0.0) for name, place in names.items()}
        scene.show_names(_NAMES, {words.one_line(name): place for name, place in places.items()})

    def clear(self) -> None:
        """Draw nothing any more."""
        self._measuring, self._at = None, -1
        jog = next((page for page in self._window.pages if isinstance(page, JogPage)), None)
        if jog is None or jog.scene.solid is None:
            return
        jog.scene.show_points(_KEPT, None)
        jog.scene.show_points(_ASIDE, None)
        jog.scene.show_lines(_LINES, None)
        jog.scene.show_names(_NAMES, {})

    def _again(self) -> None:
        self._at = -1
        if self._measuring is not None:
            self.show(self._measuring)
