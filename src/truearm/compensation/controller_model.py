"""With what the controller that runs a program turns its poses into joint positions, asked before they are corrected.

A controller that has kinematics of its own, measured by its maker, goes elsewhere with a pose than the table of the
robot file says. Correcting against that table then adds what the controller corrects already. Targets that are given
by joints do not pass through the kinematics.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Final

from truearm.compensation.fake_targets import nominal_robot
from truearm.compensation.gauge import disagreement
from truearm.compensation.programs import LANGUAGES
from truearm.compensation.programs.program import MakersCalibration, Program
from truearm.compensation.questions import Question
from truearm.errors import InputError
from truearm.modeling.controller import OTHER_ARM, ControllerKinematics
from truearm.modeling.robot import Robot
from truearm.notices import Notice

_KEPT: Final = (
    "The robot file keeps the answer (controller: {{kinematics: {0}}}), or a cell file (controller_kinematics: {0})."
)


def refuse_proprietary_controller(robot: Robot, programs: Sequence[Program]) -> None:
    """Refuse to correct poses for a controller that computes them with a model which nobody else can read.

    Raises:
        InputError: With what to do instead.
    """
    if robot.controller.kinematics.kind != "proprietary" or not _poses(programs):
        return
    calibration = _calibration(programs)
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


def controller_question(robot: Robot, programs: Sequence[Program]) -> Question | None:
    """Return what to ask where nothing says with what the controller computes, and its maker offers a calibration."""
    calibration = _calibration(programs)
    if robot.controller.kinematics.kind != "unknown" or calibration is None or not _poses(programs):
        return None
    answers = (
        "`controller_kinematics=nominal` (it computes with the data sheet) or `controller_kinematics=proprietary` (it "
        "has a calibration that nobody else can read)"
    )
    if calibration.always:
        return Question(
            "controller_kinematics",
            f"Which kinematics does the controller compute with? {calibration.maker} controllers compute with what "
            "the factory measured of each arm; corrected against the data sheet, the poses would become worse.",
            "`controller_kinematics` and the file calibration.conf from the folder .urcontrol of the controller, or "
            f"that of the ROS driver; or with {answers}",
            _KEPT.format("calibration.conf"),
        )
    return Question(
        "controller_kinematics",
        f"Does this controller have {calibration.name}? {calibration.maker} delivers it where it was ordered. A "
        "controller that has it corrects the poses once more, and the program becomes worse.",
        answers,
        _KEPT.format("nominal"),
    )


def refuse_kinematics_of_another_arm(robot: Robot, accepted: Collection[str]) -> None:
    """Refuse kinematics of a controller that agree worse with the calibrated arm than the table of the robot file does.

    What a factory measured of this arm is nearer to it than the data sheet is.

    Raises:
        InputError: With how far both are from the calibrated arm.
    """
    if robot.controller.kinematics.kind != "own" or OTHER_ARM in accepted:
        return
    table = replace(robot, controller=replace(robot.controller, kinematics=ControllerKinematics("nominal")))
    own, sheet = (disagreement(robot, nominal_robot(one)) for one in (robot, table))
    if own > sheet:
        raise InputError(
            "the controller's kinematics are not those of this arm: they are farther from what calibration found than "
            "the data sheet is",
            parameter="controller_kinematics",
            where=robot.name,
            came=f"{own * 1e3:.2f} mm apart on average, the data sheet {sheet * 1e3:.2f} mm",
            cure="Take the file of the controller that runs this arm, and check that the measurements are of it. "
            f"`accept={OTHER_ARM}` uses them all the same.",
        )


def controller_notices(robot: Robot, programs: Sequence[Program]) -> list[Notice]:
    """Say where it was answered that a controller computes with the data sheet, and its maker calibrates every arm."""
    calibration = _calibration(programs)
    if calibration is None or not calibration.always or robot.controller.kinematics.kind != "nominal":
        return []
    if not _poses(programs):
        return []
    return [
        Notice(
            "controller-nominal",
            f"Controllers of {calibration.maker} compute with what the factory measured of each arm, and the poses "
            "were corrected for one that computes with the data sheet, as was said. On an arm with its own "
            "controller that makes programs worse; give its file with `controller_kinematics`.",
        )
    ]


def _poses(programs: Sequence[Program]) -> bool:
    return any(target.form.kind == "pose" for program in programs for target in program.targets)


def _calibration(programs: Sequence[Program]) -> MakersCalibration | None:
    """Return how controllers of the programs' language may have been calibrated; all are in one language."""
    return next((one.calibration for one in LANGUAGES if programs and one.name == programs[0].language), None)
