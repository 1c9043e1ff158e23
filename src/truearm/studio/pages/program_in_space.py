"""A program in the scene: its way and targets, and how far the real robot is from them."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.studio import words
from truearm.studio.arrows import FACTORS, Arrows, error_arrows
from truearm.studio.drawn_program import DrawnProgram
from truearm.studio.pages.fields import NONE, offer
from truearm.studio.pages.jog import JogPage
from truearm.studio.window import Window

_WAY: Final = (120, 128, 140)
_TARGETS: Final = (70, 130, 180)
_CHOSEN: Final = (214, 69, 61)
#: Under these names they are in the scene.
_PARTS: Final = ("program-way", "program-targets", "program-chosen", "program-errors")
#: Of which program joint positions are taken.
_ORIGINAL: Final = "original program"
_CORRECTED: Final = "corrected program"


class ProgramInSpace:
    """A part of the page Programs: draws a program and moves the drawn arm to its targets."""

    def __init__(self, window: Window) -> None:
        self._window = window
        self._drawn: DrawnProgram | None = None
        gui = window.gui
        with gui.add_folder("Program in the scene", visible=False) as self.place:
            self._draw: Any = gui.add_checkbox("Draw", True)
            self._factor: Any = gui.add_number("Magnified by", 50.0, min=FACTORS[0], max=FACTORS[1], step=1.0)
            self._share: Any = gui.add_slider("Before (0) to after (1)", 0.0, 1.0, 0.05, 0.0)
            self._said = gui.add_html("")
            self._target: Any = gui.add_dropdown("Target", (NONE,))
            self._of: Any = gui.add_dropdown("Joints of", (_ORIGINAL, _CORRECTED))
            self._go = gui.add_button("Move the drawn arm there")
        self._elements = (self._draw, self._factor, self._share, self._target)
        self._shown: tuple[Any, ...] = ()
        for element in self._elements:
            element.on_update(window.action(self.show))
        self._go.on_click(window.action(self._move))

    def take(self, drawn: DrawnProgram | None) -> None:
        """Show another program; None for none."""
        self._drawn = drawn
        self.place.visible = drawn is not None
        if drawn is not None:
            real = len(drawn.meant) > 0
            offer(self._target, drawn.names, None)
            offer(self._of, (_ORIGINAL, _CORRECTED) if real else (_ORIGINAL,), _ORIGINAL, None)
            self._factor.visible = self._share.visible = real
        self.show()

    def show(self) -> None:
        """Draw the program as the elements say."""
        scene = next(page.scene for page in self._window.pages if isinstance(page, JogPage))
        solid = None if scene.solid is None else scene.solid.robot
        shown = (self._drawn, solid, *(element.value for element in self._elements))
        if shown == self._shown:
            return
        self._shown = shown
        for name in _PARTS:
            scene.show_arrows(name, None)
        drawn, self._said.content = self._drawn, ""
        if drawn is None or scene.solid is None or not self._draw.value:
            return
        base = scene.solid.robot.base  # where the instrument has found it, if it has

        def placed(points: Array) -> Array:
            return np.asarray(points @ base.rotation.T + np.array(base.translation))

        steps = np.stack([drawn.way[:-1], drawn.way[1:]], axis=1)
        scene.show_lines("program-way", placed(steps[np.isfinite(steps).all(axis=(1, 2))]), _WAY)
        seen = np.isfinite(drawn.tips).all(axis=1)
        scene.show_points("program-targets", placed(drawn.tips[seen]), _TARGETS, 0.008)
        if self._target.value in drawn.names:
            chosen = drawn.tips[[drawn.names.index(self._target.value)]]
            scene.show_points("program-chosen", placed(chosen), _CHOSEN, 0.014)
        if not len(drawn.meant):
            told = "The program as the controller takes it to be. Correct it to see where the real robot goes with it."
            self._said.content = words.paragraph(told)
            return
        if not np.isfinite(drawn.meant).any():
            self._said.content = words.paragraph("No target was corrected.")
            return
        errors = drawn.between(float(self._share.value))
        arrows = error_arrows(drawn.tips, errors, float(self._factor.value))
        scene.show_arrows("program-errors", Arrows(placed(arrows.segments), arrows.colours, arrows.words))
        sizes = [np.linalg.norm(part - drawn.meant, axis=1) for part in (drawn.before, drawn.after)]
        told = " and ".join(
            f"{np.nanmean(size) * 1e3:.3f} mm on average, {np.nanmax(size) * 1e3:.3f} at most" for size in sizes
        )
        self._said.content = words.paragraph(
            f"Where the calibrated robot goes with the original and with the corrected program: {told}, from where the "
            "targets are meant to be. What it cannot know of the real robot is in the error to expect, below."
        )

    def _move(self) -> None:
        drawn = self._drawn
        if drawn is None or self._target.value not in drawn.names:
            raise InputError("no target is chosen", parameter="Target", cure="Choose one.")
        joints = drawn.corrected if self._of.value == _CORRECTED else drawn.joints
        row = joints[drawn.names.index(self._target.value)]
        if not np.isfinite(row).all():
            raise InputError("the controller finds no joint positions for this target", came=self._target.value)
        next(page for page in self._window.pages if isinstance(page, JogPage)).go_to_joints(row)
