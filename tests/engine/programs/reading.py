"""Programs that tests read: the samples of every language, and what of a program tests look at."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np

from truearm.engine.programs.program import Edit, Language, Program, ProgramTarget, Source, Split
from truearm.engine.programs.program_files import edited
from truearm.engine.robot.inverse.branches import BRANCHES, branch_rule
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import QUATERNION

SAMPLES = Path(__file__).parent / "samples"


def folder(language: Language) -> Path:
    return SAMPLES / language.read.__module__.split("programs.")[1].split(".")[0]


def sample(language: Language, *names: str) -> Program:
    """Read one of the programs of the samples."""
    return language.read([Source(Path(n), (folder(language) / n).read_bytes().decode("latin-1")) for n in names])


@cache
def samples(language: Language) -> tuple[tuple[Source, ...], ...]:
    """Return the programs of a language: a file, or the files of a folder, each."""
    programs = []
    for entry in sorted(folder(language).iterdir()):
        files = sorted(entry.iterdir()) if entry.is_dir() else [entry]
        programs.append(tuple(Source(file, file.read_bytes().decode("latin-1")) for file in files))
    return tuple(programs)


def texts(program: Program, edits: Sequence[Edit]) -> list[str]:
    return [
        edited(source.text, [e for e in edits if e.source == number]) for number, source in enumerate(program.sources)
    ]


def split(language: Language, program: Program, *splits: Split) -> Program:
    """Return a program with split moves, read again."""
    assert language.split is not None
    new = texts(program, language.split(program, splits).edits)
    return language.read([Source(s.path, text) for s, text in zip(program.sources, new, strict=True)])


def shifted(target: ProgramTarget) -> np.ndarray:
    """Return a small change of every number that is written."""
    size = 3.0 if target.form.kind == "pulses" else 2e-5 if target.form.length == 1.0 else 2e-2
    sizes = [size] * len(target.places)
    if target.form.orientation is QUATERNION:  # stays one of length 1
        sizes[3:] = [1e-4] * 4
    return np.array([0.0 if s is None or s[0] == s[1] else v for s, v in zip(target.places, sizes, strict=True)])


def way(program: Program) -> list[tuple[str, str, str | None]]:
    """Return kind, target and point on the way of each move."""
    names = [target.name for target in program.targets]
    return [(move.kind, names[move.target], None if move.via is None else names[move.via]) for move in program.moves]


def reasons(program: Program) -> list[tuple[int, str]]:
    """Return what is left alone: its line and why."""
    return [(skipped.line, skipped.reason) for skipped in program.skipped]


def written(program: Program, row: int) -> list[str | None]:
    """Return the numbers of a target as they stand in the text."""
    target = program.targets[row]
    text = program.sources[target.source].text
    return [None if place is None else text[slice(*place)] for place in target.places]


def said(program: Program, row: int) -> tuple[str, str, str]:
    """Return the statement of a move, its target and the point on its way as they stand in the text."""
    move = program.moves[row]
    text = program.sources[move.source].text
    parts = [text[slice(*part)] for part in (move.statement, move.target_text, move.via_text or (0, 0))]
    return parts[0], parts[1], parts[2]


def branches(robot: Robot, joints: np.ndarray) -> list[str]:
    """Return the names of the postures that joints make."""
    rule = branch_rule(robot)
    assert rule is not None
    return [BRANCHES[number] for number in rule.numbers(robot.forward_kinematics(joints)).tolist()]
