"""Tests by ISO 9283 in the scene: the cube with its poses and paths, and the errors there, magnified."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from truearm.engine.base.files import exists
from truearm.engine.robot.chain import Array
from truearm.iso9283.evaluating.comparison import read_result
from truearm.iso9283.evaluating.evaluate import RESULT
from truearm.iso9283.planning.plan_file import read_plan
from truearm.studio import words
from truearm.studio.arrows import FACTORS, coloured, error_arrows
from truearm.studio.cube_in_space import CubeInSpace, cube_in_space, is_of_plan
from truearm.studio.pages.jog import JogPage
from truearm.studio.scene import Scene
from truearm.studio.window import Window

#: Of paths whose errors are not known, and of the cube's edges.
_PATH: Final = np.array([150, 150, 160], np.uint8)
_EDGE: Final = (120, 128, 140)
_PARTS: Final = ("tests-frame", "tests-paths", "tests-names", "tests-errors", "tests-rp")


class DrawnCube:
    """A part of the page Performance: draws the chosen plan, and its result."""

    def __init__(self, window: Window) -> None:
        self._window = window
        self._of: tuple[Any, ...] = ()
        gui = window.gui
        with gui.add_folder("Cube, poses, paths and errors in the scene"):
            self._draw: Any = gui.add_checkbox("Draw", False)
            low, high = FACTORS
            self._factor: Any = gui.add_number("AP magnified", 50.0, min=low, max=high, step=1.0)
            self._factor_rp: Any = gui.add_number("RP magnified", 1000.0, min=low, max=high, step=1.0)
            self._said = gui.add_html("")
        for element in (self._draw, self._factor, self._factor_rp):
            element.on_update(window.action(self._show))

    def refresh(self) -> None:
        """Draw it anew where plan, result or robot are others than those that are drawn."""
        if bool(self._draw.value) and self._now() != self._of:
            self._show()

    def _show(self) -> None:
        self._of, self._said.content = self._now(), ""
        project = self._window.project
        plan_file = project.settings.performance.plan
        scene = self._scene()
        self._clear(scene)
        if not self._draw.value or scene.solid is None:
            return
        if plan_file is None or not exists(project.path(plan_file)):
            self._said.content = words.paragraph("There is no plan to draw: choose one, or plan the tests.")
            return
        plan = read_plan(project.path(plan_file))
        place = project.path(project.settings.performance.result) / RESULT
        result = read_result(place) if exists(place) else None
        said = []
        if plan.robot.name != scene.solid.robot.name:
            said.append(f"The plan is of {plan.robot.name}, and {scene.solid.robot.name} is drawn.")
        if result is not None and not is_of_plan(result, plan):
            said.append("The result is of another plan than the one that is chosen: its errors are not drawn.")
            result = None
        space = cube_in_space(plan, result)
        self._draw_space(scene, space, float(self._factor.value), float(self._factor_rp.value))
        said += [space.legend()] if space.legend() else []
        self._said.content = "".join(map(words.paragraph, said))

    def _draw_space(self, scene: Scene, space: CubeInSpace, factor: float, factor_rp: float) -> None:
        assert scene.solid is not None
        base = scene.solid.robot.base  # where the instrument has found it, if it has

        def placed(points: Array) -> Array:
            return np.asarray(points @ base.rotation.T + np.array(base.translation))

        errors = np.nan_to_num(space.path_errors)
        known = np.isfinite(space.path_errors)[:, None]
        colours = np.where(known, coloured(errors, 0.0, space.largest), _PATH).astype(np.uint8)
        arrows = error_arrows(space.commands, space.offsets, factor, space.largest)
        scene.show_lines("tests-frame", placed(space.frame), _EDGE)
        scene.show_lines("tests-paths", placed(space.paths), colours)
        scene.show_names("tests-names", {name: placed(at) for name, at in space.poses.items()})
        if len(space.names):
            shown = type(arrows)(placed(arrows.segments), arrows.colours, space.words(factor, factor_rp))
            scene.show_arrows("tests-errors", shown)
            scene.show_balls("tests-rp", shown.segments[:, 1], factor_rp * space.repeatability)

    def _clear(self, scene: Scene) -> None:
        for name in _PARTS:
            scene.show_arrows(name, None)

    def _scene(self) -> Scene:
        return next(page.scene for page in self._window.pages if isinstance(page, JogPage))

    def _now(self) -> tuple[Any, ...]:
        """Return what the drawing is of."""
        project = self._window.project
        files = project.settings.performance
        stamps = []
        for name in (files.plan, f"{files.result}/{RESULT}"):
            stat = None if name is None or not exists(project.path(name)) else project.path(name).stat()
            stamps.append(None if stat is None else (name, stat.st_mtime_ns, stat.st_size))
        solid = self._scene().solid
        return (*stamps, None if solid is None else solid.robot)
