"""What the robot of the project looks like, as its URDF says it: read once, and again where a file has changed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePosixPath
from typing import Any, Final

from truearm.engine.base.errors import InputError, Rule, shortened
from truearm.engine.base.files import exists
from truearm.engine.robot.library import urdf_source
from truearm.engine.robot.robot import Robot
from truearm.studio import words
from truearm.studio.solids import Mesh
from truearm.studio.urdf_meshes import Looks, urdf_meshes
from truearm.studio.window import Window

_FILES: Final = (".urdf", ".stl", ".obj")
#: So much is said of why links have no meshes.
_LONGEST: Final = 600


WITHOUT_MESHES: Final = Rule("without-meshes", "note", "links of a URDF are drawn without meshes, and why")


class RobotLooks:
    """Meshes of the URDF that the settings name, or that is the robot."""

    def __init__(self, window: Window) -> None:
        self._window = window
        self._of: tuple[Any, ...] = ()
        self._looks: Looks | None = None

    def meshes(self, robot: Robot) -> Mapping[str, Mesh] | None:
        """Return the meshes of a robot; None where there are none, or the URDF is of another chain."""
        settings, project = self._window.project.settings, self._window.project
        name = settings.meshes or settings.robot
        if urdf_source(name) is None:
            return None
        stamps = [project.path(one).stat() for one in project.names(*_FILES) if exists(project.path(one))]
        of = (name, *((stamp.st_mtime_ns, stamp.st_size) for stamp in stamps))
        if of != self._of:
            self._of, self._looks = of, self._read(name)
        looks = self._looks
        if looks is None or looks.joints != tuple(joint.name for joint in robot.joints):
            return None
        return looks.meshes or None

    def _read(self, name: str) -> Looks | None:
        project = self._window.project
        folder = PurePosixPath(name).parent.as_posix()
        try:
            looks = urdf_meshes(project.path(name), project.path, "" if folder == "." else folder)
        except InputError as error:
            self._tell(words.refusal(error))
            return None
        if looks.left_out:
            self._tell(" ".join(words.spelled(text) for text in looks.left_out))
        return looks

    def _tell(self, why: str) -> None:
        text = f"Links are drawn without meshes: {shortened(why, _LONGEST)}"
        self._window.tell(WITHOUT_MESHES(text))
