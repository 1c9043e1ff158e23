"""What an import of a camera and a board, one of them on the flange, is asked for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from truearm.engine.base.errors import InputError, wrong_kind
from truearm.engine.command.groups import IntoFile
from truearm.engine.command.kinds import Choice, File, Given, Number
from truearm.engine.command.request import job, option, required

if TYPE_CHECKING:
    from truearm.board.readings import ImportedHandEye, OnFlange


class _Board(Given):
    """A ChArUco board, as a text."""

    def check(self, value: Any, name: str) -> Any:
        """Refuse a text that names no board."""
        from truearm.board.pictures import Charuco

        if not isinstance(value, str):
            raise wrong_kind("a board belongs here", value, name, "a text: 14x10,25mm,18mm,5X5_250")
        Charuco.of_text(value, name)
        return value


class ImportHandEye(IntoFile):
    """Poses of a board in a camera, one of them on the flange, or pictures that show it.

    They become poses of what is on the flange.
    """

    job = "import_hand_eye"
    words = "import hand-eye"
    refuses = "If a file cannot be used, or a picture does not show the board."
    file: str | Path = required(
        File("VIEWS.csv"),
        "Joint positions, and poses or pictures of the board.",
        kw_only=False,
        more="With the columns ``configuration``, ``joint_1 [deg]`` .. or ``axis_1 [deg]`` .., and either the pose of "
        "the board in the camera, ``x [mm]``, ``y [mm]``, ``z [mm]``, ``qw``, ``qx``, ``qy``, ``qz`` (and "
        "``sigma [mm]``, ``sigma_rot [mrad]``), or ``picture``: files, named from the folder of the table.",
    )
    on_flange: OnFlange = required(
        Choice(known=("camera", "board")),
        "What moves with the robot; the other one stands beside it.",
        kw_only=True,
        word="on_flange",
    )
    board: str | None = option(
        _Board("SQUARES,SIDE,MARKER,DICTIONARY"),
        "The ChArUco board in the pictures: 14x10,25mm,18mm,5X5_250.",
        default=None,
        shown="the table holds poses",
        more="Its squares, the sides of a square and of a marker, and the dictionary.",
    )
    scale_sigma: float | None = option(
        Number("ppm", low=0.0, high=1e5, above=True),
        "How well the size of the board is known, a deviation.",
        default=None,
        shown="taken as exact",
        more="Of how much longer than named the lengths on the board are, or of the poses' own scale.",
    )
    working_distance: float | None = option(
        Number("mm", low=0.0),
        "How far before the camera the target is; that of the first session for every later one.",
        default=None,
        shown="where the board was on average",
        formerly="ahead",
    )

    def check(self) -> None:
        """Refuse a point ahead of a camera that is not on the flange."""
        if self.working_distance is not None and self.on_flange != "camera":
            raise InputError(
                "only a camera on the flange has a point ahead of it",
                parameter="working_distance",
                came=f"{self.working_distance * 1e3:g} mm",
                cure="Leave it out.",
            )

    def run(self) -> ImportedHandEye:
        """Import."""
        from truearm.board.readings import of_views

        return of_views(self)


import_hand_eye = job(ImportHandEye)
