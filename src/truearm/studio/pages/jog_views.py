"""What an arm reaches, and the loads of its joints, in the scene: a part of the page Jog."""

from __future__ import annotations

from typing import Any, Final

from truearm.engine.base.errors import InputError
from truearm.studio import words
from truearm.studio.jogging import Jogging
from truearm.studio.load_arrows import load_arrows, reached_points
from truearm.studio.scene import Scene
from truearm.studio.window import Window

_REACHED: Final = (150, 158, 170)


class JogViews:
    """Draws the workspace of the arm that is jogged, and moments about its joints."""

    def __init__(self, window: Window, scene: Scene) -> None:
        self._scene = scene
        self._arm: Jogging | None = None
        self._of: tuple[Any, ...] = ()
        gui = window.gui
        with gui.add_folder("In the scene", expand_by_default=False):
            self.workspace: Any = gui.add_checkbox(
                "Workspace of the tip", False, hint="within the limits of the joints"
            )
            self.loads: Any = gui.add_checkbox(
                "Moments of the load", False, hint="about each axis, by weight; forces where a joint slides"
            )
            self._said = gui.add_html("", visible=False)
        self.workspace.on_update(window.action(self._again))
        self.loads.on_update(window.action(self._again))

    def moved(self, arm: Jogging) -> None:
        """Draw what follows from where an arm is, and which it is."""
        self._arm = arm
        self._draw_workspace(arm)
        self._draw_loads(arm)

    def _again(self) -> None:
        if self._arm is not None:
            self.moved(self._arm)

    def _draw_workspace(self, arm: Jogging) -> None:
        of = (id(arm.robot), arm.tip) if self.workspace.value else ()
        if of != self._of:
            self._of = of
            points = reached_points(arm.robot, arm.tip) if of else None
            self._scene.show_points("workspace", points, _REACHED, size=0.004)

    def _draw_loads(self, arm: Jogging) -> None:
        self._said.visible = bool(self.loads.value)
        if not self.loads.value:
            self._scene.show_arrows("loads", None)
            return
        try:
            arrows, told = load_arrows(arm.robot, arm.at, self._scene.length)
        except InputError as error:
            self._scene.show_arrows("loads", None)
            self._said.content = words.paragraph(words.refusal(error))
            return
        self._scene.show_arrows("loads", arrows)
        self._said.content = words.lines(told)
