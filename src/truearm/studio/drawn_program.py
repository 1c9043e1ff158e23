"""A robot program in the project: where it sends the tip, on the nominal robot and on the real one."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from truearm.engine.base.files import confined_reads
from truearm.engine.programs.program import Program
from truearm.engine.robot.chain import Array
from truearm.engine.robot.wrench import WrenchFrame
from truearm.studio.corrected import CellPart, cell_parts
from truearm.studio.tasks import Outcome, Progress

#: So many moves are drawn at most.
_MOVES: Final = 5000


@dataclass(frozen=True, eq=False)
class DrawnProgram:
    """What of a program is drawn, in the robot's base frame [m]."""

    outcome: Outcome | None  #: What the command prints that corrects it; None if it was only read.
    names: tuple[str, ...]  #: Of each target, with its line.
    tips: Array  #: Where the controller takes the tip of each target to be, ``(n, 3)``.
    way: Array  #: These in the order of the moves, with rows of NaN between routines, ``(m, 3)``.
    joints: Array  #: That the controller commands, of the model [rad or m], ``(n, joints)``; NaN where it finds none.
    #: meant, before, after: where tips shall be on the real robot, and where the calibrated robot takes them with the
    #: program as it was and as it is corrected, ``(n, 3)`` each; NaN for targets that were not corrected. Empty if it
    #: was only read.
    meant: Array
    before: Array
    after: Array
    corrected: Array  #: Joint positions that the corrected program commands, like `joints`; empty if it was only read.

    def between(self, share: float) -> Array:
        """Return how far the tips are from where they shall be, from the original program, 0, to the corrected, 1."""
        return (1.0 - share) * self.before + share * self.after - self.meant


def read_program(folder: Path, robot: str, program: str, progress: Progress) -> DrawnProgram:
    """Read a program, and find where the nominal robot goes with it."""
    from truearm.compensation.program_correction import commanded_tips
    from truearm.engine.programs.correction import way_through
    from truearm.engine.programs.program_files import program_files, read_programs
    from truearm.engine.robot.library import load_robot

    os.chdir(folder)
    progress("reading the program")
    with confined_reads(folder):
        (read,) = read_programs(program_files([Path(program)], again=False))[:1]
        joints, tips = commanded_tips(load_robot(robot), read)
    none = np.zeros((0, 3))
    way = way_through(read, tips, _MOVES)
    return DrawnProgram(None, _names(read), tips[:, :3, 3], way, joints, none, none, none, np.zeros((0, 0)))


def corrected_program(
    folder: Path,
    robot: str,
    program: str,
    out: str,
    cell: str | None,
    wrench: str | None,
    wrench_frame: WrenchFrame | None,
    taught: Sequence[str] | None,
    controller_kinematics: str | None,
    accept: Sequence[str],
    accept_correction: str | None,
    progress: Progress,
) -> DrawnProgram:
    """Correct a program and write it, :func:`truearm.compensate`, and find where the real robot goes with it."""
    from truearm.compensation.jobs import Compensate
    from truearm.compensation.program_correction import commanded
    from truearm.engine.programs.cell import Cell, read_frames, read_tools
    from truearm.engine.programs.correction import way_through
    from truearm.engine.programs.program_files import language_called

    os.chdir(folder)
    with confined_reads(folder):
        places: dict[CellPart, str] = {} if cell is None else dict.fromkeys(cell_parts(Path(cell)), cell)
        asked = Compensate(
            robot,
            [program],
            out=out,
            tools=places.get("tools"),
            frames=places.get("frames"),
            wrench=wrench,
            wrench_frame=wrench_frame,
            taught=taught,
            controller_kinematics=controller_kinematics,
            accept=accept,
            accept_correction=accept_correction,
            progress=progress,
        )
        made = replace(asked, command=asked.as_command()).run()
        progress("drawing the program")
        tools, frames = (None if part not in places else Path(places[part]) for part in ("tools", "frames"))
        language = language_called(made.files[0].language)
        known = Cell(read_tools(made.robot, tools, language.flange), read_frames(made.robot, frames, language.base))
        before, after = (
            commanded(made.robot, one, known) for one in (made.result.corrections[0].program, made.as_written()[0])
        )
    correction, real_tips = made.result.corrections[0], made.result.real_tips[0]
    (meant, there), (_, then) = real_tips(before), real_tips(after)
    kept = ~correction.corrected[:, None]
    return DrawnProgram(
        Outcome(tuple(made.lines()), made.warnings, tuple(file.name for file in made.files)),
        _names(correction.program),
        correction.tips[:, :3, 3],
        way_through(correction.program, correction.tips, _MOVES),
        before,
        np.where(kept, np.nan, meant),
        np.where(kept, np.nan, there),
        np.where(kept, np.nan, then),
        after,
    )


def _names(program: Program) -> tuple[str, ...]:
    return tuple(f"{target.name or 'inline'}, line {target.line}" for target in program.targets)
