"""The robot, what it carries, where it stands among what, and the files of the project."""

from __future__ import annotations

import math
from typing import Any, ClassVar, Final

from truearm.engine.base.errors import InputError, Rule
from truearm.engine.robot.library import library
from truearm.engine.robot.parts import Payload
from truearm.planning.programs import load_notices
from truearm.robot_files.jobs import show
from truearm.studio import words
from truearm.studio.cell_rules import CellRules
from truearm.studio.pages.cell_boxes import CellBoxes
from truearm.studio.pages.cell_places import CellPlaces
from truearm.studio.pages.fields import NONE, chosen, offer
from truearm.studio.pages.jog import JogPage
from truearm.studio.scene import Scene
from truearm.studio.uploads import Upload
from truearm.studio.window import Window

PAYLOAD_FAR: Final = Rule(
    "payload-far", "warning", "the centre of the payload is farther from the flange than the arm is long"
)


class CellPage:
    """Chooses the robot of the library or of a file, says what is known of it, and takes files into the project."""

    title: ClassVar[str] = "Cell"

    def __init__(self, window: Window) -> None:
        self._window = window
        gui = window.gui
        self._robot = gui.add_dropdown("Robot", (window.project.settings.robot,))
        self._meshes: Any = gui.add_dropdown("Meshes of", (NONE,), hint="a URDF whose meshes show the robot")
        self._payload: Any = gui.add_text(
            "Payload", "", hint="mass and place of its centre, such as 2.7kg,50mm,25mm,100mm"
        )
        self._upload = gui.add_upload_button("Take a file into the project", hint="a robot, measurements, a program")
        self.places = CellPlaces(window)
        self.boxes = CellBoxes(window, self._draw_boxes, lambda: self._scene().length)
        with gui.add_folder("Files of the project"):
            self._files = gui.add_html("")
        with gui.add_folder("What is known of the robot", expand_by_default=False):
            self._about = gui.add_html("")
        self._robot.on_update(window.action(lambda: window.edit(robot=self._robot.value)))
        self._meshes.on_update(window.action(lambda: window.edit(meshes=chosen(self._meshes))))
        self._payload.on_update(window.settled(self._weigh))
        window.receive(self._upload, self._take_in)

    def refresh(self) -> None:
        """Show the robot of the settings, what stands around it, and the files of the folder."""
        window, settings = self._window, self._window.project.settings
        files = window.project.names(".yaml", ".yml", ".urdf", ".xacro", ".xml")
        offer(self._robot, [*library(), *files], settings.robot, None)
        offer(self._meshes, window.project.names(".urdf"), settings.meshes)
        self._meshes.visible = len(self._meshes.options) > 1
        self._payload.value = settings.payload or ""
        self.places.refresh()
        self.boxes.refresh()
        names = window.project.names()
        self._files.content = words.lines(names) if names else words.paragraph("None yet: take one in.")
        try:
            self._about.content = words.lines(show(window.robot()).lines())
        except InputError as error:
            self._about.content = words.paragraph(words.refusal(error))

    def _weigh(self) -> None:
        """Take a payload that can be, and say where the arm cannot carry it, or hardly does."""
        window, text = self._window, self._payload.value.strip() or None
        payload = None if text is None else Payload.of(text, "payload")
        changed = text != window.project.settings.payload
        window.edit(payload=text)
        if not changed or payload is None:
            return
        try:
            robot = window.robot()
        except InputError:
            return  # what is known of the robot says so
        for notice in load_notices(robot):
            window.tell(notice)
        away, length = math.hypot(*payload.cog), self._scene().length
        if away > length:
            text = (
                f"The centre of the payload is {away * 1e3:.0f} mm from the flange, and {robot.name} is "
                f"{length * 1e3:.0f} mm long: check the units."
            )
            window.tell(PAYLOAD_FAR(text))

    def _draw_boxes(self, rules: CellRules | None) -> None:
        self._scene().show_boxes({} if rules is None else rules.corners)

    def _scene(self) -> Scene:
        return next(page.scene for page in self._window.pages if isinstance(page, JogPage))

    def _take_in(self, file: Upload) -> None:
        name = self._window.project.take_in(file.name, file.path)
        self._window.tell_lines(f"Taken into the project: {name}", [f"{file.size} bytes"])
        self._window.refresh()
