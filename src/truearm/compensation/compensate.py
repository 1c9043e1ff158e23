"""Robot programs corrected, and their originals restored."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Collection
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.compensation.advice import check_correction
from truearm.compensation.limit import (
    CorrectionLimit,
    check_size,
    controller_notices,
    controller_question,
    correction_limit,
    day_of,
    kinematics_file,
    ledger_of,
    ledger_to_write,
    numbers_read,
    refuse_corrected_already,
    refuse_kinematics_of_another_arm,
    refuse_proprietary_controller,
    with_controller,
)
from truearm.compensation.program_correction import CorrectedPrograms, ProgramSplit, corrected_programs, split_program
from truearm.compensation.result import REPORT, FileCorrection, ProgramCorrection, RestoredPrograms
from truearm.engine.base.errors import InputError, Notice, counted, refusals_at, refusals_of
from truearm.engine.base.units import IN_PROGRAMS
from truearm.engine.command.arguments import files_of, folder_for, hashes_of, robot_argument, wrench_argument
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
from truearm.engine.diagnose.external_force import check_force, check_other_payload, check_payload
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
from truearm.engine.programs.program import Edit, Language, Program, correction_comment
from truearm.engine.programs.program_files import (
    ProgramFile,
    edited,
    language_called,
    program_files,
    read_programs,
    restored,
)
from truearm.engine.programs.program_poses import place
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.wrench import Wrench

if TYPE_CHECKING:
    from truearm.compensation.jobs import Compensate, Revert

#: Targets that cannot be corrected, shown one by one in a refusal.
_SHOWN: Final = 5


@dataclass(frozen=True, eq=False)
class _Settings:
    """What was given beside the programs, as it was read."""

    calibrated: Robot  #: As its controller computes.
    arm: Robot  #: With what it carries.
    kinematics: tuple[str | Path, ...]  #: The file of the controller's kinematics, if there is one.
    choice: Choice
    allowed: CorrectionLimit | None
    accepted: tuple[str, ...]
    acting: tuple[TargetWrench, ...]
    folder: Path | None
    hashes: dict[str, str]


@dataclass(frozen=True, eq=False)
class _Read:
    """The programs, and what was measured of tools and frames."""

    files: tuple[ProgramFile, ...]
    programs: tuple[Program, ...]
    language: Language
    cell: Cell
    foreign: tuple[Notice, ...]  #: What is to be said of the language of another maker.


@dataclass(frozen=True, eq=False)
class _Corrections:
    """How the programs are corrected."""

    result: CorrectedPrograms
    splits: tuple[ProgramSplit, ...]
    ledger: Path | None
    unremembered: tuple[Notice, ...]  #: What is to be said where their targets cannot be remembered.
    accepted: tuple[Notice, ...]  #: What would be refused, and was accepted.


def corrected(asked: Compensate) -> ProgramCorrection:
    """Correct programs, and write them."""
    settings = _settings(asked)
    read = _read(asked, settings)
    corrections = _corrections(asked, settings, read)
    day = day_of(asked.notes or {})
    arm = settings.arm
    correction = ProgramCorrection(
        robot=arm,
        files=_corrected_files(settings, read, corrections, day),
        result=corrections.result,
        splits=corrections.splits,
        warnings=(
            *changed_since(asked.robot),
            *known_of(arm),
            *read.foreign,
            *controller_notices(arm, read.programs),
            *_payloads_unlikely(settings.calibrated, arm, corrections.result),
            *check_force(corrections.result.pushed),
            *corrections.accepted,
            *check_correction(arm, corrections.result, corrections.splits),
            *corrections.unremembered,
        ),
        command=asked.command or asked.as_python(),
        inputs=files_of(asked.robot, asked.tools, asked.frames, asked.wrench_file, *settings.kinematics),
        hashes=settings.hashes,
        notes=dict(asked.notes or {}),
        date=day.isoformat(),
        ledger=corrections.ledger,
    )
    if settings.folder is not None:
        with refusals_of("out"):
            correction.save(settings.folder, asked.progress)
    return correction


def _settings(asked: Compensate) -> _Settings:
    """Read the robot, and what is said of the cell and of the correction."""
    wrench_file = asked.wrench_file
    pushed = None if wrench_file is not None else wrench_argument(asked.wrench, asked.wrench_frame)
    answers = read_answers({"tools": _path(asked.tools), "frames": _path(asked.frames)})
    stated, parameter = asked.controller_kinematics, "controller_kinematics"
    if stated is None:
        stated, parameter = answers.controller_kinematics, "tools, frames"
    taught = asked.taught
    if taught is None and answers.taught is not None:
        taught = dict(asked.options())["taught"].kind.check(answers.taught, "taught")
    choice = Choice(
        joint_targets=asked.joint_targets == "correct",
        only=tuple(asked.only),
        keep=tuple(asked.keep),
        taught=None if taught is None else frozenset(kind for kind in TAUGHT if kind in taught),
    )
    kinematics = kinematics_file(stated)
    read = (asked.robot, asked.tools, asked.frames, wrench_file, *kinematics)
    folder = None if asked.out is None else folder_for((REPORT,), asked.out, *read, *asked.programs)
    hashes = hashes_of(
        robot=asked.robot,
        tools=asked.tools,
        frames=asked.frames,
        wrench=wrench_file,
        controller_kinematics=next(iter(kinematics), None),
    )
    allowed = None
    if asked.accept_correction is not None:
        allowed = CorrectionLimit.of(asked.accept_correction, "accept_correction")
    calibrated = with_controller(robot_argument(asked.robot), stated, parameter)
    arm = asked.loads.on(calibrated)
    if arm.wrench is not None:
        raise InputError(
            "something acts on the tool of this robot already",
            parameter="robot",
            came=arm.wrench.text,
            cure="Give it as `wrench`, and the robot without it.",
        )
    accepted = accept_argument(asked.accept, arm)
    refuse_unaccepted(arm, accepted)
    acting = _wrenches(arm, pushed, wrench_file)
    return _Settings(calibrated, arm, kinematics, choice, allowed, accepted, acting, folder, hashes)


def _path(value: str | Path | None) -> Path | None:
    return None if value is None else Path(value)


def _read(asked: Compensate, settings: _Settings) -> _Read:
    """Read the programs, tools and frames, and refuse what is not known well enough of them."""
    arm = settings.arm
    with refusals_of("programs"):
        files = program_files([*map(Path, asked.programs)], again=asked.again)
        asked.progress("reading the programs")
        programs = read_programs(files)
    language = language_called(programs[0].language)
    tool_file, frame_file = _path(asked.tools), _path(asked.frames)
    with refusals_of("tools"):
        tools = read_tools(arm, tool_file, language.flange)
    with refusals_of("frames"):
        frames = read_frames(arm, frame_file, language.base)
    cell = Cell(tools, frames)
    for path, parameter in ((tool_file, "tools"), (frame_file, "frames")):
        if path != asked.wrench_file:
            refuse_wrenches_left_out(path, parameter)
    _refuse_taught_and_measured(settings.choice, cell)
    foreign = check_maker(arm, language, settings.accepted)
    refuse_proprietary_controller(arm, programs)
    refuse_unanswered([taught_question(programs, settings.choice), controller_question(arm, programs)])
    with refusals_of("robot"):
        refuse_kinematics_of_another_arm(arm, settings.accepted)
    return _Read(tuple(files), programs, language, cell, tuple(foreign))


def _corrections(asked: Compensate, settings: _Settings, read: _Read) -> _Corrections:
    """Correct the programs, and refuse what the robot's errors do not explain, or what would harm."""
    accepted, language = settings.accepted, read.language
    with refusals_of("robot"):
        result = corrected_programs(
            settings.arm,
            read.programs,
            read.cell,
            asked.progress,
            choice=replace(settings.choice, every=NOT_BETTER in accepted),
            weigh_tools=asked.payload is None,
            wrenches=settings.acting,
        )
    refuse_corrected_already(result, [*map(Path, asked.programs)], settings.folder, ledger_of(asked.robot))
    ledger, unremembered = ledger_to_write(ledger_of(asked.robot))
    large = _check_size(result, correction_limit(settings.calibrated), settings.allowed)
    if SKIPPED not in accepted:
        _refuse_skipped(result)
    read_by_program = _check_numbers_read(language, result, accepted)
    splits: tuple[ProgramSplit, ...] = ()
    if asked.split is not None:
        asked.progress("splitting moves")
        splits = tuple(
            split_program(language, correction, between, asked.split)
            for correction, between in zip(result.corrections, result.between, strict=True)
        )
    return _Corrections(result, splits, ledger, tuple(unremembered), (*large, *read_by_program))


def _corrected_files(
    settings: _Settings, read: _Read, corrections: _Corrections, day: date
) -> tuple[FileCorrection, ...]:
    """Return the files with their new texts, in the order in which they were given."""
    arm = settings.arm
    comment = correction_comment(day, arm.name, settings.hashes.get("robot", ""))
    comment += (IN_PROGRAMS,) if arm.simulated else ()
    bounded = arm.proof is not None and arm.proof.lower_bound
    files = []
    for number, correction in enumerate(corrections.result.corrections):
        edits = _edits(correction, corrections.splits[number] if corrections.splits else None)
        for index, source in enumerate(correction.program.sources):
            file = next(file for file in read.files if file.path == source.path)
            text = edited(source.text, [edit for edit in edits if edit.source == index])
            if text != source.text:
                text = read.language.comment(text, comment)
            relative = corrections.result.relative
            files.append(FileCorrection(file, correction, index, text.encode("latin-1"), relative, bounded))
    return tuple(sorted(files, key=lambda corrected_file: read.files.index(corrected_file.file)))


def _wrenches(arm: Robot, pushed: Wrench | None, file: Path | None) -> tuple[TargetWrench, ...]:
    """Return what acts on the tool, and where: at every target, or as a file says."""
    if file is None:
        return () if pushed is None else (TargetWrench((), (), pushed),)
    with refusals_of("wrench"):
        acting = read_wrenches(file)
        for target_wrench in acting:
            with refusals_at(target_wrench.where):
                arm.with_wrench(target_wrench.wrench)
    return acting


def _payloads_unlikely(calibrated: Robot, arm: Robot, result: CorrectedPrograms) -> list[Notice]:
    """Say which loads no arm of this size carries, and that what another one than in calibration does is not known."""
    loads = [load for load in dict.fromkeys(result.loads.values()) if load is not None]
    unlikely = [notice for load in [arm.payload, *loads] for notice in check_payload(arm.with_payload(load))]
    return [*unlikely[:1], *check_other_payload(calibrated, [arm.payload, *loads])]


def _refuse_taught_and_measured(choice: Choice, cell: Cell) -> None:
    """Refuse tools or frames that are said to be taught and have a measured place; what the controller has is none."""
    kinds: tuple[tuple[Taught, dict[str, Placed]], ...] = (("tools", cell.tools), ("frames", cell.frames))
    for kind, places in kinds:
        measured = [name for name, placed in places.items() if placed.identified is not None]
        if measured and choice.was_taught(kind):
            raise InputError(
                f"the {kind} cannot be both taught and measured",
                parameter=f"taught, {kind}",
                came=measured[0] or ("flange" if kind == "tools" else "base"),
                cure=f"Leave {kind} out of `taught`, or say with `of: controller` what the controller has.",
            )


def _check_size(result: CorrectedPrograms, limit: CorrectionLimit, accepted: CorrectionLimit | None) -> list[Notice]:
    """Refuse corrections that errors of the robot do not explain, or say that they were accepted."""
    rows = [(correction, np.flatnonzero(correction.corrected)) for correction in result.corrections]
    targets = [correction.program.targets[row] for correction, some in rows for row in some.tolist()]
    programs = [correction.program for correction, some in rows for _ in some]
    identified = [name for name in ("frames", "tools") if getattr(result.frames, name) == "identified"]
    if result.frames.frames == "assumed":
        bases = np.array([*result.frames.bases.values()]).reshape(-1, 4, 4)
        turns = np.linalg.norm(turns_between(np.broadcast_to(np.eye(4), bases.shape), bases), axis=1)
        limit = limit.beside(float(turns.max(initial=0.0)))
    shared = shared_motion([correction.motions(some) for correction, some in rows])
    common = ""
    if shared is not None and result.frames.frames != "assumed":
        common = f"All targets share a shift of {shared.moved * 1e3:.2f} mm. "
    return check_size(
        np.concatenate([correction.moved[some] for correction, some in rows]),
        np.concatenate([correction.turned[some] for correction, some in rows]),
        limit,
        accepted,
        where=lambda row: place(programs[row], targets[row]),
        check=f"{common}Check where frame and tool were measured and how they are turned (a target that is a point "
        "does not say it), the numbers that the controller has for them, units, conventions of angles, and the load.",
        parameter=", ".join(identified) or "programs",
    )


def _refuse_skipped(result: CorrectedPrograms) -> None:
    """Refuse a program that would be corrected in part."""
    skipped = [
        f"{correction.program.sources[target.source].where(target.line)}: {target.reason}"
        for correction in result.corrections
        for target in correction.skipped
    ]
    if skipped:
        more = f"; and {len(skipped) - _SHOWN} more" if len(skipped) > _SHOWN else ""
        raise InputError(
            f"{counted(len(skipped), 'target')} cannot be corrected, and the others would move without "
            f"{'it' if len(skipped) == 1 else 'them'} ({'; '.join(skipped[:_SHOWN])}{more})",
            parameter="programs",
            cure="Check frame and tool; fix the program; leave a target as it is on purpose by its name with `keep`; "
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
    if NUMBERS_READ.code in accepted:
        return [NUMBERS_READ(f"{words[0].upper()}{words[1:]}. It was accepted.")]
    raise InputError(
        words,
        parameter="programs",
        cure="Let the program compute with numbers of its own, leave these targets as they are with `keep`, or accept "
        f"it with `accept={NUMBERS_READ.code}`.",
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


def reverted(asked: Revert) -> RestoredPrograms:
    """Restore the originals of corrected programs, and write them."""
    paths = [*map(Path, asked.programs)]
    folder = None if asked.out is None else folder_for((path.name for path in paths), asked.out, *paths)
    with refusals_of("programs"):
        result = RestoredPrograms(restored(paths))
    if folder is None:
        return result
    with refusals_of("out"):
        result.save(folder)
    return replace(result, folder=folder)
