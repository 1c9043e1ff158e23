"""truearm: programs of 100 000 targets, read and compared with a correction of nothing, beside one pass of a regex."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from stopwatch import median_seconds, report

import truearm
from truearm.engine.programs import LANGUAGES
from truearm.engine.programs.new_program import NewProgram
from truearm.engine.programs.program import NUMBER, Language, Program, Source
from truearm.engine.programs.program_files import ProgramFile, edited, read_programs
from truearm.engine.programs.program_poses import edits_of, pose_numbers, poses_of

COUNT = 100_000
NUMBERS = re.compile(NUMBER)


def sources(language: Language) -> list[Source]:
    """Return a program of that many targets, as truearm writes paths."""
    robot, rng = truearm.load_robot("irb120"), np.random.default_rng(0)
    joints = robot.random_configurations(COUNT, rng)
    position, rotation = robot.forward(joints)
    poses = np.tile(np.eye(4), (COUNT, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = rotation, position
    path = NewProgram(
        name="path",
        robot=robot.name,
        joints=joints,
        sliding=(False,) * 6,
        poses=poses,
        branches=(0,) * COUNT,
        durations=np.full(COUNT, 0.1),
        speeds=np.full(COUNT, 0.1),
        spacing=np.full(COUNT, 0.01),
        corrected=False,
        beside=0.0,
    )
    assert language.new is not None
    return [Source(Path(name), text) for name, text in language.new(path).items()]


def round_trip(program: Program) -> None:
    """Correct a program by nothing: no byte may change."""
    poses = poses_of(program)
    rows = np.array([i for i, target in enumerate(program.targets) if target.form.kind == "pose"], dtype=int)
    edits = edits_of(program, pose_numbers(program, poses, poses, rows))
    if edits or any(edited(source.text, edits) != source.text for source in program.sources):
        raise ValueError(f"{program.language}: a correction of nothing changed the program")


figures: dict[str, object] = {}
for language in LANGUAGES:
    texts = sources(language)
    files = [ProgramFile(source.path, source.path.name, source.text.encode("latin-1")) for source in texts]
    (program,) = read_programs(files)
    figures[language.name] = {
        "targets": len(program.targets),
        "bytes": sum(len(file.original) for file in files),
        "read": median_seconds(lambda files=files: read_programs(files), 3),
        "compared": median_seconds(lambda program=program: round_trip(program), 3),
        "regex": median_seconds(lambda texts=texts: [len(NUMBERS.findall(source.text)) for source in texts], 3),
    }
report(figures, {"truearm": truearm.__version__, "numpy": np.__version__})
