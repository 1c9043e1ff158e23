"""Robot programs corrected, and their originals restored."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from truearm.compensation.advice import check_correction
from truearm.compensation.limit import (
    CorrectionLimit,
    check_size,
    controller_notices,
    controller_question,
    correction_limit,
    day_of,
    ledger_of,
    ledger_to_write,
    numbers_read,
    refuse_corrected_already,
    refuse_kinematics_of_another_arm,
    refuse_proprietary_controller,
)
from truearm.compensation.program_correction import (
    CorrectedPrograms,
    ProgramSplit,
    check_tolerance,
    corrected_programs,
    split_program,
)
from truearm.compensation.result import REPORT, FileCorrection, ProgramCorrection, RestoredPrograms
from truearm.engine.base.arrays import finite_number
from truearm.engine.base.errors import InputError, Notice, counted, refusals_at, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.base.units import IN_PROGRAMS
from truearm.engine.command.arguments import (
    choice_argument,
    choices_argument,
    command_argument,
    files_of,
    flag_argument,
    folder_for,
    hashes_of,
    names_argument,
    notes_argument,
    paths_argument,
    payload_argument,
    progress_argument,
    python_call,
    robot_argument,
    wrench_argument,
)
from truearm.engine.command.split import (
    NOT_BETTER,
    NUMBERS_READ,
    SKIPPED,
    accept_argument,
    changed_since,
    check_maker,
    known_of,
    refuse_unaccepted,
)
from truearm.engine.diagnose.external_force import check_force, check_payload
from truearm.engine.programs.cell import (
    Cell,
    Placed,
    TargetWrench,
    read_answers,
    read_frames,
    read_tools,
    read_wrenches,
    refuse_wrenches_left_out,
)
from truearm.engine.programs.chosen_targets import TAUGHT, Choice, Taught, refuse_unanswered, taught_question
from truearm.engine.programs.correction import Correction, shared_motion
from truearm.engine.programs.gauge import turns_between
from truearm.engine.programs.program import Edit, Language, correction_comment
from truearm.engine.programs.program_files import edited, language_called, program_files, read_programs, restored
from truearm.engine.programs.program_poses import place
from truearm.engine.robot.controller_kinematics import with_controller_kinematics
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.entries import STATED
from truearm.engine.robot.wrench import Wrench, WrenchFrame

#: Targets that cannot be corrected, shown one by one in a refusal.
_SHOWN: Final = 5


def compensate(
    robot: Robot | str | Path,
    programs: Sequence[str | Path],
    *,
    out: str | Path | None = None,
    tools: str | Path | None = None,
    frames: str | Path | None = None,
    payload: Payload | str | None = None,
    wrench: Wrench | Sequence[float] | str | Path | None = None,
    wrench_frame: WrenchFrame | None = None,
    controller_kinematics: str | Path | None = None,
    split: float | None = None,
    again: bool = False,
    joint_targets: str = "keep",
    only: Sequence[str] = (),
    keep: Sequence[str] = (),
    taught: Sequence[str] | None = None,
    accept: Sequence[str] = (),
    accept_correction: str | None = None,
    notes: Mapping[str, str] | None = None,
    command: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> ProgramCorrection:
    """Correct robot programs so that the real robot goes where they say.

    Parameters
    ----------
    robot
        A calibrated robot, or its file.
    programs
        Files in one robot language. Those given together share what has to be assumed of base and flange.
    out
        Folder for the corrected programs, their records and compensation.html; None writes nothing, see
        :meth:`truearm.compensation.result.ProgramCorrection.save`.
    tools, frames
        Files that say where tools and frames are, see :mod:`truearm.engine.programs.cell`.
    payload
        What the flange carries in production (an object, or a text such as ``2.7kg,50mm,25mm,100mm``); None for what
        the program says of each tool, and what it carried in calibration where the program does not say it.
    wrench
        External force and moment on the tool at its point: six numbers [N, N m], a text such as
        ``0N,0N,80N,0Nm,0Nm,1.5Nm``, or an object, at every target; or a file that says it of targets and tools by name,
        see :mod:`truearm.engine.programs.cell`. None for none.
    wrench_frame
        Whose axes it is given in, if not by a file: ``base`` (also for None), ``tool``, ``world`` or ``controller``.
    controller_kinematics
        With what the controller turns poses into joint positions: ``nominal`` (the table of the robot file),
        ``proprietary`` (a calibration of its maker that nobody else can read), ``unknown``, or the file of its
        kinematics, as :func:`truearm.import_ur_kinematics` reads it; None for what a cell file or the robot file says.
    split
        Split straight and circular moves where the correction between targets would deviate farther [m].
    again
        Take the originals of programs that were corrected already.
    joint_targets
        ``keep`` leaves targets that are given by joints as they are, home positions for instance; ``correct`` sends the
        real robot where the nominal one would be.
    only, keep
        Names of targets, or patterns such as ``pHole*``: the only ones that are corrected, and some that stay.
    taught
        What was taught with this robot and is right already: ``points``, ``frames``, ``tools``, or ``none``, if all
        was computed off-line. None for what a cell file says.
    accept
        What may speak against the robot's calibration or against a correction, by name: ``rank-loss``,
        ``not-converged``, ``implausible``, or a notice of the level error that the calibration ended with, such as
        ``wrong-robot``; ``maker`` for programs in the language of another maker; ``other-kinematics`` for kinematics of
        the controller that are not this arm's; ``skipped`` for programs of which some targets cannot be corrected and
        stay as they are; ``numbers-read`` for programs that compute with numbers of corrected targets; and
        ``not-better-here`` to correct also the targets that would rather get worse.
    accept_correction
        How far targets may be moved and turned, such as ``95mm,3deg``, in place of the limit: twice the largest
        deviation of the calibrated from the nominal robot, see :mod:`truearm.compensation.limit`.
    notes
        What to write on the report, by its name: ``date``, ``serial``, ``operator``, or any other. A date such as
        ``2026-11-27`` is the one in the comment of the programs too.
    command
        How to do it again, for the report; None writes the call in Python.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        If a program cannot be read or was corrected already, the robot is not calibrated or its calibration ended
        badly or is another maker's, a tool or frame is not defined, a target cannot be corrected and that is not
        accepted, or would be moved or turned farther than the robot's errors explain, or nothing says what was taught,
        or with what a controller computes whose maker offers a calibration.
    """
    progress_argument(progress)
    paths = paths_argument(programs, "programs", "program")
    tool_file = None if tools is None else path_argument(tools, "tools")
    frame_file = None if frames is None else path_argument(frames, "frames")
    payload = payload_argument(payload)
    wrench_file = _wrench_file(wrench)
    pushed = None if wrench_file is not None else wrench_argument(wrench, wrench_frame)
    if wrench_file is not None and wrench_frame is not None:
        raise InputError("the file says the frame of each force", parameter="wrench_frame", came=wrench_frame)
    notes = notes_argument(notes)
    again = flag_argument(again, "again")
    if split is not None:
        split = finite_number(split, "split")
        check_tolerance(split)
    answers = read_answers({"tools": tool_file, "frames": frame_file})
    kinematics = answers.controller_kinematics if controller_kinematics is None else controller_kinematics
    said_by = "controller_kinematics" if controller_kinematics is not None else "tools, frames"
    choice = Choice(
        joint_targets=choice_argument(joint_targets, "joint_targets", {"keep": False, "correct": True}),
        only=names_argument(only, "only"),
        keep=names_argument(keep, "keep"),
        taught=_taught(answers.taught if taught is None else taught),
    )
    folder = (
        None
        if out is None
        else folder_for((REPORT,), out, robot, tools, frames, wrench_file, *_kinematics_file(kinematics), *paths)
    )
    hashes = hashes_of(
        robot=robot,
        tools=tools,
        frames=frames,
        wrench=wrench_file,
        controller_kinematics=next(iter(_kinematics_file(kinematics)), None),
    )
    allowed = None if accept_correction is None else CorrectionLimit.of(accept_correction, "accept_correction")
    calibrated = _with_controller(robot_argument(robot), kinematics, said_by)
    arm = calibrated.with_payload(payload)
    if arm.wrench is not None:
        raise InputError(
            "something acts on the tool of this robot already",
            parameter="robot",
            came=arm.wrench.text,
            cure="Give it as `wrench`, and the robot without it.",
        )
    accepted = accept_argument(accept, arm)
    invocation = command_argument(command) or python_call(
        "compensate",
        robot,
        paths,
        tools=tools,
        frames=frames,
        payload=payload,
        wrench=wrench,
        wrench_frame=wrench_frame,
        controller_kinematics=controller_kinematics,
        split=split,
        again=again or None,
        joint_targets="correct" if choice.joint_targets else None,
        only=list(choice.only) or None,
        keep=list(choice.keep) or None,
        taught=None if choice.taught is None else sorted(choice.taught) or ["none"],
        accept=list(accepted) or None,
        accept_correction=accept_correction,
        notes=notes or None,
    )
    refuse_unaccepted(arm, accepted)
    acting = _wrenches(arm, pushed, wrench_file)
    with refusals_of("programs"):
        files = program_files(paths, again=again)
        progress("reading the programs")
        read = read_programs(files)
    language = language_called(read[0].language)
    with refusals_of("tools"):
        tools_given = read_tools(arm, tool_file, language.flange)
    with refusals_of("frames"):
        frames_given = read_frames(arm, frame_file, language.base)
    cell = Cell(tools_given, frames_given)
    for path, parameter in ((tool_file, "tools"), (frame_file, "frames")):
        if path != wrench_file:
            refuse_wrenches_left_out(path, parameter)
    _refuse_taught_and_measured(choice, cell)
    foreign = check_maker(arm, language, accepted)
    refuse_proprietary_controller(arm, read)
    refuse_unanswered([taught_question(read, choice), controller_question(arm, read)])
    with refusals_of("robot"):
        refuse_kinematics_of_another_arm(arm, accepted)
    with refusals_of("robot"):
        result = corrected_programs(
            arm,
            read,
            cell,
            progress,
            choice=replace(choice, every=NOT_BETTER in accepted),
            weigh_tools=payload is None,
            wrenches=acting,
        )
    refuse_corrected_already(result, paths, folder, ledger_of(robot))
    ledger, unremembered = ledger_to_write(ledger_of(robot))
    large = _check_size(result, correction_limit(calibrated), allowed)
    if SKIPPED not in accepted:
        _refuse_skipped(result)
    read_by_program = _check_numbers_read(language, result, accepted)
    splits: tuple[ProgramSplit, ...] = ()
    if split is not None:
        progress("splitting moves")
        splits = tuple(
            split_program(language, correction, between, split)
            for correction, between in zip(result.corrections, result.between, strict=True)
        )
    day = day_of(notes)
    comment = correction_comment(day, arm.name, hashes.get("robot", ""))
    comment += (IN_PROGRAMS,) if arm.simulated else ()
    corrected = []
    for number, correction in enumerate(result.corrections):
        edits = _edits(correction, splits[number] if splits else None)
        for index, source in enumerate(correction.program.sources):
            file = next(file for file in files if file.path == source.path)
            text = edited(source.text, [edit for edit in edits if edit.source == index])
            if text != source.text:
                text = language.comment(text, comment)
            bounded = arm.proof is not None and arm.proof.lower_bound
            corrected.append(FileCorrection(file, correction, index, text.encode("latin-1"), result.relative, bounded))
    corrected.sort(key=lambda one: files.index(one.file))
    made = ProgramCorrection(
        robot=arm,
        files=tuple(corrected),
        result=result,
        splits=splits,
        warnings=(
            *changed_since(robot),
            *known_of(arm),
            *foreign,
            *controller_notices(arm, read),
            *_payloads_unlikely(arm, result),
            *check_force(result.pushed),
            *large,
            *read_by_program,
            *check_correction(arm, result, splits),
            *unremembered,
        ),
        command=invocation,
        inputs=files_of(robot, tools, frames, wrench_file, *_kinematics_file(kinematics)),
        hashes=hashes,
        notes=notes,
        date=day.isoformat(),
        ledger=ledger,
    )
    if folder is not None:
        with refusals_of("out"):
            made.save(folder, progress)
    return made


def _wrench_file(wrench: object) -> Path | None:
    """Return the file that says what acts on tools; None if that is said otherwise, or not at all."""
    named = isinstance(wrench, str) and wrench.lower().endswith((".yaml", ".yml"))
    return path_argument(wrench, "wrench") if named or isinstance(wrench, Path) else None


def _wrenches(arm: Robot, pushed: Wrench | None, file: Path | None) -> tuple[TargetWrench, ...]:
    """Return what acts on the tool, and where: at every target, or as a file says."""
    if file is None:
        return () if pushed is None else (TargetWrench((), (), pushed),)
    with refusals_of("wrench"):
        acting = read_wrenches(file)
        for one in acting:
            with refusals_at(one.where):
                arm.with_wrench(one.wrench)
    return acting


def _payloads_unlikely(arm: Robot, result: CorrectedPrograms) -> list[Notice]:
    """Say which loads no arm of this size carries."""
    loads = [load for load in dict.fromkeys(result.loads.values()) if load is not None]
    return [notice for load in [arm.payload, *loads] for notice in check_payload(arm.with_payload(load))][:1]


def _with_controller(arm: Robot, said: str | Path | None, said_by: str) -> Robot:
    """Return a robot with what was said of its controller's kinematics, by which parameter."""
    if said is None:
        return arm
    with refusals_of(said_by):
        return with_controller_kinematics(arm, str(path_argument(said, said_by)), Path())


def _kinematics_file(said: str | Path | None) -> tuple[str | Path, ...]:
    return () if said is None or str(said) in STATED else (said,)


def _taught(taught: object) -> frozenset[Taught] | None:
    """Return what was taught; None if that was not said."""
    if taught is None:
        return None
    named = choices_argument(taught, "taught", [*TAUGHT, "none"], "answer")
    if not named or ("none" in named and len(named) > 1):
        raise InputError(
            "what was taught is not clear",
            parameter="taught",
            came=", ".join(named) or "nothing",
            allowed=f"none, or some of {', '.join(TAUGHT)}",
        )
    return frozenset(what for what in TAUGHT if what in named)


def _refuse_taught_and_measured(choice: Choice, cell: Cell) -> None:
    """Refuse tools or frames that are said to be taught and have a measured place; what the controller has is none."""
    kinds: tuple[tuple[Taught, dict[str, Placed]], ...] = (("tools", cell.tools), ("frames", cell.frames))
    for what, places in kinds:
        measured = [name for name, placed in places.items() if placed.identified is not None]
        if measured and choice.was_taught(what):
            raise InputError(
                f"the {what} cannot be both taught and measured",
                parameter=f"taught, {what}",
                came=measured[0] or ("flange" if what == "tools" else "base"),
                cure=f"Leave {what} out of `taught`, or say with `of: controller` what the controller has.",
            )


def _check_size(result: CorrectedPrograms, limit: CorrectionLimit, accepted: CorrectionLimit | None) -> list[Notice]:
    """Refuse corrections that errors of the robot do not explain, or say that they were accepted."""
    rows = [(one, np.flatnonzero(one.corrected)) for one in result.corrections]
    targets = [one.program.targets[row] for one, some in rows for row in some.tolist()]
    programs = [one.program for one, some in rows for _ in some]
    given = [name for name in ("frames", "tools") if getattr(result.frames, name) == "identified"]
    if result.frames.frames == "assumed":
        bases = np.array([*result.frames.bases.values()]).reshape(-1, 4, 4)
        turns = np.linalg.norm(turns_between(np.broadcast_to(np.eye(4), bases.shape), bases), axis=1)
        limit = limit.beside(float(turns.max(initial=0.0)))
    shared = shared_motion([one.motions(some) for one, some in rows])
    common = ""
    if shared is not None and result.frames.frames != "assumed":
        common = f"All targets share a shift of {shared.moved * 1e3:.2f} mm. "
    return check_size(
        np.concatenate([one.moved[some] for one, some in rows]),
        np.concatenate([one.turned[some] for one, some in rows]),
        limit,
        accepted,
        where=lambda row: place(programs[row], targets[row]),
        check=f"{common}Check where frame and tool were measured and how they are turned (a target that is a point "
        "does not say it), the numbers that the controller has for them, units, conventions of angles, and the load.",
        parameter=", ".join(given) or "programs",
    )


def _refuse_skipped(result: CorrectedPrograms) -> None:
    """Refuse a program that would be corrected in part."""
    skipped = [
        f"{correction.program.sources[one.source].where(one.line)}: {one.reason}"
        for correction in result.corrections
        for one in correction.skipped
    ]
    if skipped:
        more = f"; and {len(skipped) - _SHOWN} more" if len(skipped) > _SHOWN else ""
        raise InputError(
            f"{counted(len(skipped), 'target')} cannot be corrected, and the others would move without "
            f"{'it' if len(skipped) == 1 else 'them'} ({'; '.join(skipped[:_SHOWN])}{more})",
            parameter="programs",
            cure="Check frame and tool; mend the program; leave a target as it is on purpose by its name with `keep`; "
            f"or accept all of them with `accept={SKIPPED}`.",
        )


def _check_numbers_read(language: Language, result: CorrectedPrograms, accepted: Collection[str]) -> list[Notice]:
    """Refuse programs that compute with numbers which the correction changes, or say that it was accepted."""
    places = numbers_read(language, result.corrections)
    if not places:
        return []
    more = f"; and {len(places) - _SHOWN} more" if len(places) > _SHOWN else ""
    words = (
        "the program computes with numbers of targets, which the correction changes: another branch or another place "
        f"may follow ({'; '.join(places[:_SHOWN])}{more})"
    )
    if NUMBERS_READ in accepted:
        return [Notice(NUMBERS_READ, f"{words[0].upper()}{words[1:]}. It was accepted.")]
    raise InputError(
        words,
        parameter="programs",
        cure="Let the program compute with numbers of its own, leave these targets as they are with `keep`, or accept "
        f"it with `accept={NUMBERS_READ}`.",
    )


def _edits(correction: Correction, split: ProgramSplit | None) -> list[Edit]:
    """Return all edits of a program; where split moves have new words, the numbers in the old ones are gone."""
    if split is None:
        return [*correction.edits]
    cut = sorted((edit.source, edit.start, edit.stop) for edit in split.edits if edit.start < edit.stop)

    def stays(edit: Edit) -> bool:
        at = bisect_right(cut, (edit.source, edit.start, math.inf)) - 1
        return at < 0 or cut[at][0] != edit.source or edit.start >= cut[at][2]

    return [*split.edits, *filter(stays, correction.edits)]


def revert(programs: Sequence[str | Path], *, out: str | Path | None = None) -> RestoredPrograms:
    """Restore the originals of corrected programs from the records beside them.

    Parameters
    ----------
    programs
        Corrected programs.
    out
        Folder for the originals; None writes nothing.

    Raises
    ------
    InputError
        If a program has no record or was changed since, or a file would be overwritten.
    """
    paths = paths_argument(programs, "programs", "program")
    folder = None if out is None else folder_for((path.name for path in paths), out, *paths)
    with refusals_of("programs"):
        made = RestoredPrograms(restored(paths))
    if folder is None:
        return made
    with refusals_of("out"):
        made.save(folder)
    return replace(made, folder=folder)
