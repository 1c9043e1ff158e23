"""The whole job on programs: read, put right, report, write; what the command and a script call."""

from __future__ import annotations

import math
import shlex
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.compensation.cell import read_cell
from truearm.compensation.division import MOST, Divided, divided
from truearm.compensation.gauge import turns_between
from truearm.compensation.program_correction import CorrectedPrograms, Correction, corrected_programs
from truearm.compensation.program_files import (
    ProgramFile,
    edited,
    language_called,
    program_files,
    read_programs,
    recorded,
    restored,
    write_programs,
)
from truearm.compensation.programs.program import Program, Source
from truearm.errors import InputError
from truearm.files import writable_folder
from truearm.modeling.parts import NO_PAYLOAD, Payload
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.reporting.program_report import Checked, ProgramReport, ReportedFile, frame_words, program_html
from truearm.robots import load_robot

REPORT: Final = "compensation.html"
#: Corrections of calibration errors are smaller [m]; a larger mean comes of a wrong tool, frame or robot.
_LARGE: Final = 0.02
#: With so few targets and no frame, a correction without a mean is no correction.
_FEW: Final = 3
_LISTED: Final = 5


@dataclass(frozen=True, eq=False)
class FileCorrection:
    """One file of a program put right.

    Attributes
    ----------
    file
        As it was found.
    correction
        Of the program that it is part of.
    source
        Which file of that program, from 0.
    text
        Its new bytes.
    """

    file: ProgramFile
    correction: Correction
    source: int
    text: bytes

    @cached_property
    def rows(self) -> list[int]:
        """Indices of the targets in this file."""
        return [i for i, target in enumerate(self.correction.program.targets) if target.source == self.source]

    def summary(self) -> dict[str, Any]:
        """Return what ``--json`` says of the file, lengths in mm."""
        moved = self.correction.moved[[row for row in self.rows if self.correction.corrected[row]]] * 1e3
        return {
            "file": self.file.name,
            "language": self.correction.program.language,
            "targets": len(self.rows),
            "corrected": len(moved),
            "skipped": [
                {"line": one.line, "reason": one.reason} for one in self.correction.skipped if one.source == self.source
            ],
            "shift_mm": {
                "mean": float(moved.mean()) if len(moved) else 0.0,
                "max": float(moved.max()) if len(moved) else 0.0,
            },
        }


@dataclass(frozen=True, eq=False)
class ProgramCorrection:
    """Programs put right, ready to be written.

    Attributes
    ----------
    robot
        The calibrated robot, with the payload that holds.
    files
        In the order of the programs.
    result
        How it was done.
    division
        What was divided, one a program; empty if nothing was to be.
    warnings
        What to know about it.
    command
        How to do it again.
    checked
        What a simulated robot does with the programs, where there is one.
    """

    robot: Robot
    files: tuple[FileCorrection, ...]
    result: CorrectedPrograms
    division: tuple[Divided, ...]
    warnings: tuple[Notice, ...]
    command: str
    checked: Checked | None = None

    def summary(self) -> dict[str, Any]:
        """Return what ``--json`` prints."""
        return {
            "programs": [file.summary() for file in self.files],
            "warnings": [{"code": notice.code, "message": notice.message} for notice in self.warnings],
        }

    def applied(self) -> dict[str, Any]:
        """Return what the records beside the programs say was applied, in mm and deg."""
        frames, payload = self.result.frames, self.robot.payload
        made: dict[str, Any] = {
            "robot": self.robot.name,
            "history": list(self.robot.history),
            "payload_kg": payload.mass,
            "tools": frames.tools,
            "frames": frames.frames,
        }
        for name, told, shift in (("base", frames.frames, frames.base), ("flange", frames.tools, frames.flange)):
            if told == "assumed":
                made[f"{name}_shift"] = {
                    "mm": [round(float(v) * 1e3, 6) for v in shift[:3, 3]],
                    "rotation_vector_deg": [
                        round(math.degrees(v), 7) for v in turns_between(np.eye(4)[None], shift[None])[0].tolist()
                    ],
                }
        return made

    def report(self) -> ProgramReport:
        """Return what the report tells about."""
        return ProgramReport(
            robot=self.robot.title,
            files=tuple(ReportedFile(**one.summary()) for one in self.files),
            corrections=self.result.corrections,
            joint_names=tuple(joint.name for joint in self.robot.joints),
            words=tuple(frame_words(self.result.frames)),
            divisions=self.division,
            warnings=self.warnings,
            command=self.command,
            checked=self.checked,
        )

    def as_written(self) -> tuple[Program, ...]:
        """Return the programs as they are read again from their new texts."""
        language = language_called(self.files[0].correction.program.language)
        return language.programs([Source(one.file.path, one.text.decode("latin-1")) for one in self.files])

    def save(self, folder: str | Path, progress: Callable[[str], None] = lambda _: None) -> tuple[Path, ...]:
        """Write programs, their records and the report ``compensation.html`` into a folder, all or nothing.

        Returns
        -------
        The files written.

        Raises
        ------
        InputError
            If a file would be overwritten that was read, or that truearm has not written.
        """
        folder = writable_folder(Path(folder))
        progress("drawing the report")
        files: dict[str, str | bytes] = {}
        for one in self.files:
            name, language = one.file.name, one.correction.program.language
            files[name] = one.text
            files[f"{name}.truearm.json"] = recorded(one.file, one.text, language, self.applied())
        files[REPORT] = program_html(self.report())
        progress("writing the files")
        write_programs(folder, [one.file.path for one in self.files], files)
        return tuple(folder / name for name in files)


def correct(
    robot: Robot | str | Path,
    programs: Sequence[str | Path],
    *,
    tools: str | Path | None = None,
    frames: str | Path | None = None,
    payload: Payload | None = None,
    strict: bool = False,
    split: float | None = None,
    again: bool = False,
    progress: Callable[[str], None] = lambda _: None,
) -> ProgramCorrection:
    """Put programs right for a calibrated robot.

    Parameters
    ----------
    robot
        A calibrated robot, or what :func:`load_robot` takes.
    programs
        Files in one robot language. Those given together share what has to be assumed of base and flange.
    tools, frames
        Files that say where tools and frames are, see :mod:`truearm.compensation.cell`.
    payload
        What the flange carries in production; None for what it carried in calibration.
    strict
        Refuse if a target cannot be corrected.
    split
        Divide straight and circular moves where the correction between targets would stray farther [m].
    again
        Take the originals of programs that were corrected already.
    progress
        Called with what is being done.

    Raises
    ------
    InputError
        If a program cannot be read or was corrected already, the robot is not calibrated, a tool or frame is not
        defined, or with `strict` a target cannot be corrected.
    """
    arm = (robot if isinstance(robot, Robot) else load_robot(str(robot))).carrying(payload)
    cell = read_cell(arm, None if tools is None else Path(tools), None if frames is None else Path(frames))
    files = program_files([Path(path) for path in programs], again=again)
    progress("reading the programs")
    read = read_programs(files)
    result = corrected_programs(arm, read, cell, progress)
    skipped = [
        f"{correction.program.sources[one.source].path}, line {one.line}: {one.reason}"
        for correction in result.corrections
        for one in correction.skipped
    ]
    if strict and skipped:
        more = f", and {len(skipped) - 1} more" if len(skipped) > 1 else ""
        raise InputError(
            f"a target cannot be corrected{more}, and --strict writes nothing then",
            where=skipped[0].partition(": ")[0],
            came=skipped[0].partition(": ")[2],
        )
    language = language_called(read[0].language)
    division: tuple[Divided, ...] = ()
    if split is not None:
        progress("dividing moves")
        division = tuple(
            divided(language, correction, between, split)
            for correction, between in zip(result.corrections, result.between, strict=True)
        )
    made = []
    for number, correction in enumerate(result.corrections):
        cut = division[number].edits if division else ()
        for index, source in enumerate(correction.program.sources):
            here = [edit for edit in cut if edit.source == index]
            # The division has new text for some words that hold numbers of their own.
            new = [
                edit
                for edit in correction.edits
                if edit.source == index and not any(c.start <= edit.start < c.stop for c in here if c.stop > c.start)
            ]
            file = next(file for file in files if file.path == source.path)
            made.append(FileCorrection(file, correction, index, edited(source.text, [*here, *new]).encode("latin-1")))
    made.sort(key=lambda one: files.index(one.file))
    options = [
        *(["--tool", str(tools)] if tools is not None else []),
        *(["--frame", str(frames)] if frames is not None else []),
        *(["--strict"] if strict else []),
        *(["--split", f"{split * 1e3:g}"] if split is not None else []),
        *(["--again"] if again else []),
    ]
    name = robot.name if isinstance(robot, Robot) else str(robot)
    command = ["truearm", "compensate", name, *map(str, programs), *options]
    return ProgramCorrection(
        robot=arm,
        files=tuple(made),
        result=result,
        division=division,
        warnings=tuple(_warnings(arm, result, division)),
        command=shlex.join(command),
    )


def revert(programs: Sequence[str | Path], folder: str | Path) -> tuple[Path, ...]:
    """Write the originals of corrected programs into a folder.

    Returns
    -------
    The files written.

    Raises
    ------
    InputError
        If a program has no record or was changed since, or a file would be overwritten.
    """
    paths, folder = [Path(path) for path in programs], writable_folder(Path(folder))
    files = restored(paths)
    write_programs(folder, paths, {file.name: file.original for file in files})
    return tuple(folder / file.name for file in files)


def _warnings(robot: Robot, result: CorrectedPrograms, division: Sequence[Divided]) -> list[Notice]:
    made = []
    corrections, frames = result.corrections, result.frames
    count = sum(int(one.corrected.sum()) for one in corrections)
    if not any(one.program.targets for one in corrections):
        return [Notice("no-targets", "There is no target in the programs that could be corrected.")]
    if frames.frames == "assumed":
        few = f" With so few targets ({count}) little or nothing of the correction is left: give the frame."
        made.append(Notice("frames-assumed", f"{frame_words(frames)[0]}{few if count <= _FEW else ''}"))
    if frames.tools == "assumed":
        made.append(Notice("tools-assumed", frame_words(frames)[-1]))
    skipped = sum(len(one.skipped) for one in corrections)
    if skipped:
        made.append(
            Notice("targets-skipped", f"{_counted(skipped, 'target')} left unchanged, as listed with the reason.")
        )
    unknown: Counter[str] = sum((Counter(one.program.unknown) for one in corrections), Counter())
    if unknown:
        words = ", ".join(f"{word} ({number})" for word, number in unknown.most_common(_LISTED))
        made.append(
            Notice(
                "instructions-unknown",
                f"{_counted(sum(unknown.values()), 'unknown instruction')} left alone: {words}"
                f"{', ..' if len(unknown) > _LISTED else ''}. If one of them moves the robot, its targets stay.",
            )
        )
    edges = [(one, row) for one in corrections for row in one.on_edge]
    if edges:
        targets = [(one.program.sources, one.program.targets[row]) for one, row in edges[:_LISTED]]
        lines = ", ".join(f"{sources[target.source].path.name} line {target.line}" for sources, target in targets)
        made.append(
            Notice(
                "configuration-on-edge",
                f"{_counted(len(edges), 'target')} moved across the edge of a quadrant or turn of the configuration "
                f"by a joint that stands on it, as at 0: {lines}{', ..' if len(edges) > _LISTED else ''}. Controllers "
                "take the nearest posture there, but step through these first.",
            )
        )
    if result.guessed:
        made.append(
            Notice(
                "posture-guessed",
                f"Nothing says in which posture the robot reaches its first pose ({'; '.join(result.guessed)}): it was "
                "taken as the first that can be reached of front-up-noflip and so on, and the next as near as can be.",
            )
        )
    moved = np.concatenate([one.moved[one.corrected] for one in corrections]) if count else np.zeros(0)
    if count and float(moved.mean()) > _LARGE:
        made.append(
            Notice(
                "corrections-large",
                f"Targets move by {moved.mean() * 1e3:.1f} mm on average, more than calibration errors do: check that "
                "tools, frames and robot belong together, and the convention of their angles.",
            )
        )
    left = sum(len(one.left) for one in division)
    if left:
        made.append(
            Notice(
                "moves-not-divided",
                f"{_counted(left, 'straight or circular move')} not divided for --split: where the start is not sure, "
                "a target was not corrected, is given by joints or is an offset, the posture changes on the way, or "
                f"{MOST} pieces are not enough.",
            )
        )
    if robot.effect_names and robot.payload == NO_PAYLOAD:
        made.append(
            Notice(
                "no-payload",
                "The robot carries nothing in this correction. If its tool weighs something, say so with --payload.",
            )
        )
    return made


def _counted(number: int, what: str) -> str:
    """Return that so many were: ``1 target was``, ``2 targets were``."""
    return f"{number} {what}{' was' if number == 1 else 's were'}"
