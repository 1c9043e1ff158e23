"""The whole job on programs: read, put right, report, write; what the command and a script call."""

from __future__ import annotations

import math
import shlex
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.compensation.advice import check_correction, frame_words
from truearm.compensation.cell import read_cell
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
from truearm.compensation.programs.program import Edit, Program, Source
from truearm.compensation.split import Divided, divided
from truearm.errors import InputError
from truearm.files import writable_folder
from truearm.library import load_robot
from truearm.modeling.parts import Payload
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.reporting.program_report import Checked, ProgramReport, ReportedFile, program_html

REPORT: Final = "compensation.html"


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
            joints=self.robot.joints,
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
    arm = (robot if isinstance(robot, Robot) else load_robot(str(robot))).with_payload(payload)
    cell = read_cell(arm, None if tools is None else Path(tools), None if frames is None else Path(frames))
    files = program_files([Path(path) for path in programs], again=again)
    progress("reading the programs")
    read = read_programs(files)
    result = corrected_programs(arm, read, cell, progress)
    if strict:
        _refuse_skipped(result)
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
        edits = _edits(correction, division[number] if division else None)
        for index, source in enumerate(correction.program.sources):
            file = next(file for file in files if file.path == source.path)
            text = edited(source.text, [edit for edit in edits if edit.source == index])
            made.append(FileCorrection(file, correction, index, text.encode("latin-1")))
    made.sort(key=lambda one: files.index(one.file))
    name = robot.name if isinstance(robot, Robot) else str(robot)
    command = ["truearm", "compensate", name, *map(str, programs)]
    for option, given in (("--tool", tools), ("--frame", frames)):
        command += [option, str(given)] if given is not None else []
    command += ["--payload", payload.text] if payload is not None else []
    command += ["--strict"] if strict else []
    command += ["--split", f"{split * 1e3:g}"] if split is not None else []
    command += ["--again"] if again else []
    return ProgramCorrection(
        robot=arm,
        files=tuple(made),
        result=result,
        division=division,
        warnings=check_correction(arm, result, division),
        command=shlex.join(command),
    )


def _refuse_skipped(result: CorrectedPrograms) -> None:
    skipped = [
        (correction.program.sources[one.source].where(one.line), one.reason)
        for correction in result.corrections
        for one in correction.skipped
    ]
    if skipped:
        more = f", and {len(skipped) - 1} more" if len(skipped) > 1 else ""
        where, reason = skipped[0]
        raise InputError(
            f"a target cannot be corrected{more}, and --strict writes nothing then", where=where, came=reason
        )


def _edits(correction: Correction, division: Divided | None) -> list[Edit]:
    """Return all edits of a program; where the division has new words, the numbers in the old ones are gone."""
    if division is None:
        return [*correction.edits]
    cut = sorted((edit.source, edit.start, edit.stop) for edit in division.edits if edit.start < edit.stop)

    def stays(edit: Edit) -> bool:
        at = bisect_right(cut, (edit.source, edit.start, math.inf)) - 1
        return at < 0 or cut[at][0] != edit.source or edit.start >= cut[at][2]

    return [*division.edits, *filter(stays, correction.edits)]


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
