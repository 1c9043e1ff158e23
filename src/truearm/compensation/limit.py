"""Checks before programs are corrected: measured range, controller, size of the correction, earlier corrections."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.compensation.program_correction import CorrectedPrograms
from truearm.engine.base.errors import InputError, Notice, Rule, Words, refusals_of, wrong_kind
from truearm.engine.base.files import exists, path_argument
from truearm.engine.base.units import ANGLE_UNITS, LENGTH_UNITS, quantity_si
from truearm.engine.base.writing import writable_folder
from truearm.engine.programs import LANGUAGES
from truearm.engine.programs.chosen_targets import Question
from truearm.engine.programs.corrected_targets import known_by_ledger, ledger_beside, refuse_corrected
from truearm.engine.programs.correction import Correction
from truearm.engine.programs.fake_targets import matrices, nominal_robot
from truearm.engine.programs.gauge import disagreement, turns_between
from truearm.engine.programs.program import Language, MakersCalibration, Program
from truearm.engine.programs.program_files import known_by_records
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import OTHER_ARM, ControllerKinematics
from truearm.engine.robot.controller_kinematics import with_controller_kinematics
from truearm.engine.robot.inverse.kinematics import reach
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.entries import STATED

#: How far beyond the measured range of a joint nothing new is to be expected, as a share of that range.
_MARGIN: Final = 0.1


def beyond_measured(robot: Robot, joints: Array) -> NDArray[np.bool_]:
    """Return which joints are well beyond the range in which they were measured, ``(n, joints)``; none if unknown.

    A turn more or less is the same posture.

    Args:
        joints: Joint positions of the model, ``(n, joints)`` [rad or m].
    """
    region = () if robot.proof is None else robot.proof.region
    if len(region) != len(robot.joints):
        return np.zeros(joints.shape, dtype=bool)
    low, high = np.array(region).T
    turn = np.where([joint.kind == "revolute" for joint in robot.joints], 2.0 * np.pi, 0.0)
    turned = joints + turn * np.arange(-2, 3)[:, None, None]
    away = np.maximum(np.maximum(low - turned, turned - high), 0.0).min(axis=0)
    return np.asarray(away > _MARGIN * (high - low))


# With what the controller that runs a program turns its poses into joint positions, asked before they are corrected.
#
# A controller that has kinematics of its own, measured by its maker, goes elsewhere with a pose than the table of the
# robot file says. Correcting against that table then adds what the controller corrects already. Targets that are given
# by joints do not pass through the kinematics.
_ANSWER_STAYS_IN: Final = (
    "The robot file keeps the answer (controller: {{kinematics: {0}}}), or a cell file (controller_kinematics: {0})."
)


def with_controller(arm: Robot, stated: str | Path | None, parameter: str) -> Robot:
    """Return a robot with what was said of its controller's kinematics, and by which parameter; None for nothing."""
    if stated is None:
        return arm
    with refusals_of(parameter):
        return with_controller_kinematics(arm, str(path_argument(stated, parameter)), Path())


def kinematics_file(stated: str | Path | None) -> tuple[str | Path, ...]:
    """Return the file that was named for a controller's kinematics, if there is one."""
    return () if stated is None or str(stated) in STATED else (stated,)


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
            _ANSWER_STAYS_IN.format("calibration.conf"),
        )
    return Question(
        "controller_kinematics",
        f"Does this controller have {calibration.name}? {calibration.maker} delivers it where it was ordered. A "
        "controller that has it corrects the poses once more, and the program becomes worse.",
        answers,
        _ANSWER_STAYS_IN.format("nominal"),
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
    own, sheet = (disagreement(robot, nominal_robot(arm)) for arm in (robot, table))
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


CONTROLLER_NOMINAL: Final = Rule(
    "controller-nominal",
    "warning",
    "it was said that a controller computes with the data sheet whose maker calibrates every arm",
    gravity=2,
)


def controller_notices(robot: Robot, programs: Sequence[Program]) -> list[Notice]:
    """Say where it was answered that a controller computes with the data sheet, and its maker calibrates every arm."""
    calibration = _calibration(programs)
    if calibration is None or not calibration.always or robot.controller.kinematics.kind != "nominal":
        return []
    if not _poses(programs):
        return []
    return [
        CONTROLLER_NOMINAL(
            f"Controllers of {calibration.maker} compute with what the factory measured of each arm, and the poses "
            "were corrected for one that computes with the data sheet, as was said. On an arm with its own "
            "controller that makes programs worse; give its file with `controller_kinematics`."
        )
    ]


def _poses(programs: Sequence[Program]) -> bool:
    return any(target.form.kind == "pose" for program in programs for target in program.targets)


def _calibration(programs: Sequence[Program]) -> MakersCalibration | None:
    """Return how controllers of the programs' language may have been calibrated; all are in one language."""
    return next(
        (language.calibration for language in LANGUAGES if programs and language.name == programs[0].language), None
    )


# How far a correction may take targets: no farther than the errors of the robot explain.
#
# A frame that was measured elsewhere, another tool's target, a controller's number or a unit that is wrong: each makes
# a large correction, and the error that is then expected is small. So what a correction does is held against the robot.
# Its nominal and its calibrated self are compared all over the workspace, at the targets of the calibration and with
# the base that it found: nothing that a cell file, a wrench or another payload says has a part in that. A correction is
# allowed to be twice the largest deviation, in position and in orientation.

#: Configurations at which the two robots are compared.
_CONFIGURATIONS: Final = 1000
#: How many times the largest deviation a correction may be.
_TIMES: Final = 2.0
_EXAMPLE: Final = "95mm,3deg"


@dataclass(frozen=True)
class CorrectionLimit:
    """How far targets may be moved and turned."""

    moved: float  #: [m].
    turned: float  #: [rad].
    words: str = "as accepted"  #: Where it comes from.

    @classmethod
    def of(cls, text: object, parameter: str) -> CorrectionLimit:
        """Read a limit such as ``95mm,3deg``.

        Raises:
            InputError: If it is not a length and an angle, with their units and above zero.
        """
        if not isinstance(text, str):
            raise wrong_kind("a length and an angle belong here", text, parameter, f'a text such as "{_EXAMPLE}"')
        parts = text.split(",")
        if len(parts) != 2:
            raise InputError(
                "a length and an angle belong here, with a comma between",
                parameter=parameter,
                came=text,
                allowed=f"numbers with their units, such as {_EXAMPLE}",
            )
        moved = quantity_si(parts[0], LENGTH_UNITS, parameter, "95", _EXAMPLE)
        turned = quantity_si(parts[1], ANGLE_UNITS, parameter, "3", _EXAMPLE)
        if moved < 0.0 or turned < 0.0:
            raise InputError("a limit is not negative", parameter=parameter, came=text, allowed=_EXAMPLE)
        return cls(moved, turned)

    @property
    def text(self) -> str:
        """In words, in mm and deg."""
        return f"{self.moved * 1e3:.2f} mm and {math.degrees(self.turned):.2f} deg"

    def beside(self, turned: float) -> CorrectionLimit:
        """Return it for targets that a base which had to be assumed turns by so much with itself [rad]."""
        return CorrectionLimit(self.moved, self.turned + turned, f"{self.words}, and the turn of the assumed base")

    def allows(self, other: CorrectionLimit) -> bool:
        """Return whether what moves and turns so far is within it."""
        return other.moved <= self.moved and other.turned <= self.turned


def correction_limit(robot: Robot) -> CorrectionLimit:
    """Return twice the largest deviation of a calibrated robot from the nominal one over the workspace.

    Args:
        robot: Calibrated, as its calibration left it: with the payload that it carried there, and nothing that acts on
            its tool. The deviation is that of its targets, or of its flange if there are none, in the identified base.
            An angle that moves a point by as much at the length of the arm counts as much: frames that were located at
            points turn by that, also where lengths alone are wrong.
    """
    joints = robot.random_configurations(_CONFIGURATIONS, np.random.default_rng(0))
    believed = nominal_robot(robot)
    nominal, real = matrices(believed, joints), np.linalg.inv(robot.base.matrix) @ matrices(robot, joints)
    points = [[*(robot.values[target.parameter(axis)] for axis in "xyz"), 1.0] for target in robot.targets]
    apart = (real - nominal)[:, :3] @ np.array(points or [[0.0, 0.0, 0.0, 1.0]]).T
    moved = float(np.linalg.norm(apart, axis=1).max())
    turned = float(np.linalg.norm(turns_between(nominal, real), axis=1).max())
    words = "twice the largest deviation of the calibrated from the nominal robot in its workspace"
    return CorrectionLimit(_TIMES * moved, _TIMES * max(turned, moved / reach(believed, None)), words)


CORRECTIONS_LARGE: Final = Rule(
    "corrections-large",
    "warning",
    "targets are moved or turned farther than the robot's errors explain, which was "
    "[accepted](programs.md#how-large-a-correction-may-be)",
)


def check_size(
    moved: Array,
    turned: Array,
    limit: CorrectionLimit,
    accepted: CorrectionLimit | None,
    *,
    where: Callable[[int], str],
    check: str,
    parameter: str,
) -> list[Notice]:
    """Refuse a correction that is larger than the robot explains, or than was accepted in place of that.

    Args:
        moved, turned: By how much it moves [m] and turns [rad] each target, ``(n,)``.
        limit: Of the robot, :func:`correction_limit`.
        accepted: What the user allows in its place; None if nothing was said.
        where: Where the target of a number is written, for the message.
        check: What to look at, in a sentence.
        parameter: What is refused, of the job.

    Returns:
        Notice: What is said of a correction that was accepted and is beyond the limit of the robot; none otherwise.

    Raises:
        InputError: With the largest move and turn, and both limits.
    """
    largest = CorrectionLimit(float(moved.max(initial=0.0)), float(turned.max(initial=0.0)))
    holds = limit if accepted is None else accepted
    if holds.allows(largest):
        message = (
            f"Targets are moved and turned by up to {largest.text}, which was accepted. Errors of this robot explain "
            f"{limit.text}: {limit.words}. {check}"
        )
        return [] if limit.allows(largest) else [CORRECTIONS_LARGE(message)]
    worst = int((moved if largest.moved > holds.moved else turned).argmax())
    enough = f"{_up(largest.moved * 1e3)}mm,{_up(math.degrees(largest.turned))}deg"
    raise InputError(
        "the correction is larger than the errors of this robot explain"
        if accepted is None
        else "the correction is larger than what was accepted",
        parameter=parameter,
        where=where(worst),
        came=Words(f"up to {largest.text}"),
        allowed=f"up to {holds.text}, {holds.words}",
        cure=f"{check} If it is right all the same, `accept_correction={enough}` allows it.",
    )


def _up(value: float) -> str:
    """Return a number of two digits or so that is not below a value."""
    if value <= 0.0:
        return "0"
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return f"{math.ceil(value / step) * step:.6g}"


# Programs that compute with the numbers of their targets: what they compute changes with a correction.

#: A name without index, or with the beginning of one: ``pRow``, ``P[13``.
_BEGINNINGS: Final = (re.compile(r"\w+"), re.compile(r"\w+\[\d+"))


def numbers_read(language: Language, corrections: Sequence[Correction]) -> list[str]:
    """Return where programs read numbers of targets that are corrected: file, line and what is read."""
    return [place for correction in corrections for place in _read_in(language, correction)]


def _read_in(language: Language, correction: Correction) -> Iterator[str]:
    program = correction.program
    corrected = {target.name for row, target in enumerate(program.targets) if correction.corrected[row]}
    names = {
        match[0].lower() for name in corrected for begins in _BEGINNINGS if (match := begins.match(name)) is not None
    }
    for source in program.sources:
        for match in language.reads.finditer(source.text) if language.reads is not None else ():
            if match[1] is not None and match[1].lower() in names:
                line = source.text.count("\n", 0, match.start()) + 1
                yield f"{source.where(line)}: {' '.join(match[0].split())}"


def refuse_corrected_already(
    result: CorrectedPrograms, paths: Sequence[Path], folder: Path | None, ledger: Path | None
) -> None:
    """Refuse programs with targets that are corrected already.

    Records are looked for beside the programs and in the folder of results, whatever programs are called there.

    Raises:
        InputError: If there are such targets, or the ledger cannot be read.
    """
    folders = {*(path.parent for path in paths), *([] if folder is None else [folder])}
    with refusals_of("robot"):
        known = [] if ledger is None else known_by_ledger(ledger)
    with refusals_of("programs"):
        refuse_corrected(result.corrections, [*known_by_records(folders), *known])


def ledger_of(robot: object) -> Path | None:
    """Return where the ledger of a robot is that was given by its file; None for any other."""
    if not isinstance(robot, str | Path) or not exists(Path(robot)) or Path(robot).is_dir():
        return None
    return ledger_beside(Path(robot))


LEDGER_NOT_WRITTEN: Final = Rule(
    "ledger-not-written",
    "note",
    "the folder of the robot file cannot be written to, so copies of the programs without comment may not be known "
    "as corrected",
)


def ledger_to_write(ledger: Path | None) -> tuple[Path | None, list[Notice]]:
    """Return the ledger if it can be written, and say so if it cannot."""
    if ledger is None:
        return None, []
    try:
        writable_folder(ledger.parent)
    except InputError:
        message = (
            f"{ledger} cannot be written. A copy of these programs may not be known as corrected once its comment is "
            "removed."
        )
        return None, [LEDGER_NOT_WRITTEN(message)]
    return ledger, []


def day_of(notes: Mapping[str, str]) -> date:
    """Return the day that was noted as the date, today if there is none."""
    try:
        return date.fromisoformat(notes.get("date", ""))
    except ValueError:
        return date.today()
