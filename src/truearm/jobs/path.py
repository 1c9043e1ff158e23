"""A path followed by a robot: its joint motion, corrected, and as programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path

import numpy as np

from truearm.arrays import finite_number
from truearm.compensation.controller_model import (
    controller_notices,
    controller_question,
    refuse_proprietary_controller,
)
from truearm.compensation.corrected_path import TIP, CorrectedPath, correct_path
from truearm.compensation.corrected_targets import LedgerEntry, corrected_digests
from truearm.compensation.correction_limit import CorrectionLimit, check_size, correction_limit
from truearm.compensation.gauge import turns_between
from truearm.compensation.path_program import TargetKind, path_program
from truearm.compensation.programs import BY_NAME
from truearm.compensation.programs.new_program import NewProgram
from truearm.compensation.programs.program import Language, Source
from truearm.compensation.questions import refuse_unanswered
from truearm.errors import InputError, refusals_of
from truearm.files import path_argument
from truearm.identification.judging.external_force import check_force
from truearm.jobs.arguments import (
    array_argument,
    choice_argument,
    choices_argument,
    command_argument,
    files_of,
    folder_beside,
    gravity_argument,
    joints_argument,
    name_argument,
    payload_argument,
    pushed_argument,
    python_call,
    robot_argument,
    wrench_argument,
)
from truearm.jobs.corrected_already import ledger_of, ledger_to_write
from truearm.jobs.proof import accept_argument, changed_since, refuse_unaccepted, told_of
from truearm.modeling.chain import Array
from truearm.modeling.controller import JointsOf
from truearm.modeling.formats.controller_entry import STATED
from truearm.modeling.formats.controller_kinematics import with_controller_kinematics
from truearm.modeling.parts import Payload
from truearm.modeling.robot import Robot
from truearm.modeling.transform import homogeneous
from truearm.modeling.wrench import Wrench, WrenchFrame
from truearm.notices import Notice
from truearm.planning.paths.path_file import read_path
from truearm.results.followed_path import CORRECTED, LOADS, MOTION, REPORT, FollowedPath
from truearm.shown import listed, millimetres

#: Every language at once.
ALL = "all"
#: A program that leaves the path by no more than this between its targets is said nothing of [m].
_FAR = 0.02e-3


def path(
    robot: Robot | str | Path,
    file: str | Path,
    *,
    seed: Array | Sequence[float] | None = None,
    payload: Payload | str | None = None,
    gravity: Sequence[float] | None = None,
    wrench: Wrench | Sequence[float] | str | None = None,
    wrench_frame: WrenchFrame | None = None,
    programs: Sequence[str] = (),
    targets: str = "joints",
    spacing: float = 0.02,
    name: str = "truearm_path",
    controller_kinematics: str | Path | None = None,
    accept: Sequence[str] = (),
    accept_correction: str | None = None,
    joints: JointsOf | None = None,
    out: str | Path | None = None,
    command: str | None = None,
) -> FollowedPath:
    """Follow a path of lines, circles and waypoints, and correct it for the calibrated robot.

    Parameters
    ----------
    robot
        A calibrated robot, or what :func:`truearm.load_robot` takes. One that is nominal follows the path, and there is
        nothing to correct.
    file
        The path, see :mod:`truearm.planning.paths.path_file`.
    seed
        Joint positions of the model ``(joints,)`` [rad; m for prismatic joints] near which the motion shall begin; zero
        if None.
    payload, gravity
        What the robot carries (an object, or a text such as ``2.7kg,50mm,25mm,100mm``) and free fall in its base frame
        [m/s^2]; None for what its file says.
    wrench, wrench_frame
        External force and moment on the tip, the same all along the path, and whose axes it is given in, as for
        :func:`truearm.inverse`.
    programs
        Languages in which to write the corrected path: ``rapid``, ``krl``, ``fanuc-ls``, ``urscript``, ``inform``,
        ``val3``, or ``all``.
    targets
        ``joints`` if the targets of the programs are joint positions, ``poses`` for straight moves to poses.
    spacing
        Time from one target to the next [s], or a little less; that of the file's samples at the least.
    name
        Of the programs.
    controller_kinematics
        With what the controller turns poses into joint positions, as :func:`truearm.compensate` takes it.
    accept
        What may speak against the robot's calibration, by name, as :func:`truearm.compensate` takes it; asked for where
        programs are written.
    accept_correction
        How far a program may move and turn the tip from the path, such as ``95mm,3deg``, as for
        :func:`truearm.compensate`.
    joints
        Whose joint positions the CSV files hold: the ``model``'s, or as the ``controller`` shows them; None for the
        controller's where the robot file says that they differ.
    out
        Folder for the joint motion, the corrected one, the loads, the programs and report.html; None writes nothing.
    command
        How to run it again, for the page; None writes the call in Python.

    Raises
    ------
    InputError
        If the file is malformed, or the robot cannot follow the path: with the place on it. If the correction of a
        program is larger than the robot's errors explain.
    """
    read = path_argument(file, "file")
    known = [*BY_NAME, ALL]
    languages = choices_argument(programs, "programs", known, "language")
    if ALL in languages:
        languages = tuple(BY_NAME)
    kinds: dict[str, TargetKind] = {"joints": "joints", "poses": "poses"}
    kind = choice_argument(targets, "targets", kinds)
    called = name_argument(name, "name")
    time = finite_number(spacing, "spacing", allowed="a time in s")
    if not time > 0.0:
        raise InputError("targets are some time apart", parameter="spacing", came=f"{time:g} s", allowed="above 0 s")
    kinematics = (
        () if controller_kinematics is None or str(controller_kinematics) in STATED else (controller_kinematics,)
    )
    written = (MOTION, CORRECTED, LOADS, REPORT)
    folder = None if out is None else folder_beside(written, MOTION, out, robot, file, *kinematics)
    pushed = wrench_argument(wrench, wrench_frame)
    carried, fall = payload_argument(payload), gravity_argument(gravity)
    allowed = None if accept_correction is None else CorrectionLimit.of(accept_correction, "accept_correction")
    calibrated = robot_argument(robot)
    if controller_kinematics is not None:
        with refusals_of("controller_kinematics"):
            said = str(path_argument(controller_kinematics, "controller_kinematics"))
            calibrated = with_controller_kinematics(calibrated, said, Path())
    arm = pushed_argument(calibrated.with_payload(carried, fall), pushed)
    accepted = accept_argument(accept, arm)
    call = command_argument(command) or python_call(
        "path",
        robot,
        file,
        seed=None if seed is None else np.asarray(seed).tolist(),
        payload=carried,
        gravity=fall,
        wrench=None if pushed is None else pushed.text,
        wrench_frame=wrench_frame,
        programs=list(languages) or None,
        targets=kind,
        spacing=time,
        name=called,
        controller_kinematics=controller_kinematics,
        accept=list(accepted) or None,
        accept_correction=accept_correction,
        joints=joints,
    )
    if languages:
        refuse_unaccepted(arm, accepted)
    joints_are = joints_argument(joints, arm)
    near = None
    if seed is not None:
        near = array_argument(seed, "seed", (len(arm.joints),), f"{len(arm.joints)} numbers, one for each joint")
    with refusals_of("file"):
        followed = correct_path(arm, read_path(read), near)
    chosen = [BY_NAME[one] for one in languages]
    notices = [*changed_since(robot), *told_of(arm), *check_force([(arm, followed.joints[followed.best])])]
    texts: dict[str, str] = {}
    if chosen:
        if followed.calibrated:
            notices += _check_size(followed, correction_limit(calibrated), allowed)
        with refusals_of("name" if kind == "joints" else "targets"):
            content = path_program(followed, arm, called, targets=kind, spacing=time)
            texts = _programs(arm, content, chosen, notices)
    ledger = None
    if chosen and followed.calibrated:
        ledger, unremembered = ledger_to_write(ledger_of(robot))
        notices += unremembered
    made = FollowedPath(
        arm,
        followed,
        texts,
        call,
        tuple(dict.fromkeys(notices)),
        files_of(robot, file, *kinematics),
        joints_are,
        None if ledger is None else (ledger, _entries(arm, chosen, texts)),
    )
    if folder is not None:
        made.save(folder)
    return made


def _check_size(followed: CorrectedPath, limit: CorrectionLimit, accepted: CorrectionLimit | None) -> list[Notice]:
    """Refuse a correction that errors of the robot do not explain, or say that it was accepted."""
    before, after = (
        homogeneous(rotation, position)
        for position, rotation in (
            followed.nominal.forward(followed.joints[name], target=TIP) for name in ("nothing", followed.best)
        )
    )
    turned = np.linalg.norm(turns_between(before, after), axis=1)
    trajectory = followed.planned.trajectory
    return check_size(
        np.linalg.norm(after[:, :3, 3] - before[:, :3, 3], axis=1),
        turned if followed.planned.orientation == "full" else np.zeros_like(turned),
        limit,
        accepted,
        where=lambda row: f"{followed.planned.source}, {trajectory.distance[row] * 1e3:.1f} mm along the path",
        check="Check the payload, the force, and that the calibration is of this robot.",
        parameter="file",
    )


def _entries(arm: Robot, languages: Sequence[Language], texts: Mapping[str, str]) -> tuple[LedgerEntry, ...]:
    """Return what is remembered of corrected programs."""
    sources = [Source(Path(file), text) for file, text in texts.items()]
    day = date.today().isoformat()
    return tuple(
        LedgerEntry(program=str(path), date=day, robot=arm.name, targets=corrected_digests((), targets))
        for language in languages
        for program in language.programs([one for one in sources if one.path.suffix.lower() in language.suffixes])
        for path, targets in program.by_file().items()
    )


def _programs(arm: Robot, content: NewProgram, languages: Sequence[Language], notices: list[Notice]) -> dict[str, str]:
    """Return the files of a program in every language, and add what is to be said of them."""
    texts: dict[str, str] = {}
    for language in languages:
        assert language.new is not None
        files = language.new(content)
        theirs = not arm.maker or language.runs_on(arm.maker)
        if content.corrected and theirs:
            as_read = [language.read([Source(Path(file), text) for file, text in files.items()])]
            refuse_proprietary_controller(arm, as_read)
            refuse_unanswered([controller_question(arm, as_read)])
            notices += controller_notices(arm, as_read)
        texts |= files
    foreign = [one for one in languages if arm.maker and not one.runs_on(arm.maker)]
    if foreign:
        written = ", ".join(f"{one.name} of {one.makers[0]}" for one in foreign)
        notices.append(Notice("maker", f"{arm.name} is of {arm.maker}, and programs were written in {written}."))
    if content.beside > _FAR:
        notices.append(
            Notice(
                "between-targets",
                f"Between its targets the program leaves the path by up to {millimetres(content.beside)} mm. Take a "
                "smaller `spacing`.",
            )
        )
    untimed = [one.name for one in languages if content.untimed(one.name)]
    if untimed:
        notices.append(
            Notice(
                "untimed-moves",
                f"{listed(untimed)} cannot say how long a joint motion takes: the robot goes as fast as it is set to, "
                "and what motion adds to the loads is another than was corrected. Write `targets=poses`, or run the "
                "program slowly.",
                "note",
            )
        )
    return texts
