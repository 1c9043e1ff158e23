"""With what the controller that runs a program turns its poses into joint positions, asked before they are corrected.

A controller that has kinematics of its own, measured by its maker, goes elsewhere with a pose than the table of the
robot file says. Correcting against that table then adds what the controller corrects already. Targets that are given
by joints do not pass through the kinematics.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from truearm.compensation.programs import LANGUAGES
from truearm.compensation.programs.program import MakersCalibration, Program
from truearm.errors import InputError
from truearm.modeling.robot import Robot
from truearm.notices import Notice

_ANSWER: Final = (
    "`controller_kinematics=nominal` says that it computes with the table of the robot file, "
    "`controller_kinematics=proprietary` that it has a calibration which nobody else can read"
)


def refuse_unknown_controller(robot: Robot, programs: Sequence[Program]) -> None:
    """Refuse to correct poses for a controller whose kinematics cannot be known, or surely are not the nominal ones.

    Raises
    ------
    InputError
        If the robot's controller computes poses with a model that nobody can read; or if nothing is said of it, and its
        maker delivers every arm with kinematics of its own.
    """
    if not _poses(programs):
        return
    kind, calibration = robot.controller.kinematics.kind, _calibration(programs)
    if kind == "proprietary":
        name = calibration.name if calibration is not None else "its maker's calibration"
        raise InputError(
            "the controller computes poses with a model that nobody else can read, so it is not known where a "
            "corrected pose would take the arm",
            parameter="controller_kinematics",
            where=robot.name,
            came="proprietary",
            allowed="nominal, or the file of the controller's kinematics",
            cure=f"Turn {name} off while these programs run and give `controller_kinematics=nominal`, or write the "
            "targets as joint positions, which do not pass through it as far as is known.",
        )
    if kind == "unknown" and calibration is not None and calibration.always:
        raise InputError(
            f"controllers of {calibration.maker} compute with what the factory measured of each arm, and it is not "
            "known what that is here. Corrected against the data sheet, the poses would become worse",
            parameter="controller_kinematics",
            where=robot.name,
            came="unknown",
            allowed="the file of the controller's kinematics, calibration.conf or that of the ROS driver; nominal; "
            "proprietary",
            cure="Copy calibration.conf from the folder .urcontrol of the controller and give it with "
            f"`controller_kinematics`. {_ANSWER}.",
        )


def controller_notices(robot: Robot, programs: Sequence[Program]) -> list[Notice]:
    """Say where it was not told with what a controller computes, and its maker offers a calibration."""
    calibration = _calibration(programs)
    if robot.controller.kinematics.kind != "unknown" or calibration is None or not _poses(programs):
        return []
    return [
        Notice(
            "controller-unknown",
            f"{calibration.maker} delivers robots with {calibration.name} where it was ordered, and nothing says "
            "whether this one has it. The poses are corrected for a controller without it; one that has it corrects "
            f"once more, and the programs become worse. Look on the controller, and answer: {_ANSWER}.",
        )
    ]


def _poses(programs: Sequence[Program]) -> bool:
    return any(target.form.kind == "pose" for program in programs for target in program.targets)


def _calibration(programs: Sequence[Program]) -> MakersCalibration | None:
    """Return how controllers of the programs' language may have been calibrated; all are in one language."""
    return next((one.calibration for one in LANGUAGES if programs and one.name == programs[0].language), None)
