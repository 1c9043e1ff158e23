"""FANUC TP programs in ASCII (.ls).

A position carries the numbers of its user frame (UF) and tool (UT). They are the names of the frame and of the tool;
0, the world and the flange, is the empty name. F is the number that is active at the moves to the position, as
UFRAME_NUM= and UTOOL_NUM= set it in this program; programs that are called are taken to leave it. If a position's
number differs from the active one the controller stops with a fault, so nothing else is done about that.

Frames, tools and position registers are kept in the controller. A move to a position register is skipped. A position
that an offset (``Offset,PR[1]``) shifts is corrected where it stands. Motion group 1 is the robot; other groups and
external axes stay as they are.

A move begins a new routine, in the sense of :class:`~truearm.engine.programs.program.Move`, where it is not
certain which move came before it or where that one ended: after labels, calls and instructions that are not known
(macros), after moves to places that are not known, and before and after offsets and skips.

Sources: FANUC, R-30iB/R-30iB Mate controller, HandlingTool operator's manual (V9.40), sections 7.2.1 (motion
instructions), 7.2.6 and 11.9 (positions), 7.2.9 (frame numbers) and 12.2.7 (ASCII programs). The manual was not at
hand: its sections are those that a public repository's notes on it name, and the syntax is that of public programs.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from truearm.engine.base.errors import InputError
from truearm.engine.programs.fanuc_ls.instructions import Instructions, split_moves
from truearm.engine.programs.fanuc_ls.new import motion_program, new_program
from truearm.engine.programs.fanuc_ls.text import JOINTS, LINE_COUNT, POSE, LsFile, Position, configuration, recognizes
from truearm.engine.programs.program import (
    ANY_POSTURE,
    LARGEST,
    Language,
    MakersCalibration,
    Move,
    Program,
    ProgramTarget,
    Skipped,
    Source,
    replaced,
    with_lines_behind,
)

_NAME: Final = "FANUC LS"
_TRACKED: Final = re.compile(r"\bLINE_TRACK_SCHEDULE_NUMBER\s*:\s*0*[1-9]", re.IGNORECASE)


class _Positions:
    """The positions of a file, as targets."""

    def __init__(self, file: LsFile, source: int, instructions: Instructions) -> None:
        self._file, self._source, self._instructions = file, source, instructions
        self._tracked = _TRACKED.search(file.text, 0, file.instructions[0]) is not None

    def target(self, position: Position) -> ProgramTarget | str:
        """Return a position as a target, or why it is left as it is."""
        number = position.number if position.number in self._instructions.active else ""
        if position.fault or number in self._instructions.no_place:
            return position.fault or self._instructions.no_place[number]
        is_pose = position.names[0] == "X"
        values = tuple([float(text) for text in position.texts])
        if not max(map(abs, values)) <= LARGEST:
            raise InputError(
                f"a number of P[{position.number}] is out of all proportion",
                where=self._file.where(position.places[0][0]),
                came=max(values, key=abs),
            )
        frame, tool = self._active(position.number, 0, position.frame), self._active(position.number, 1, position.tool)
        posture = ANY_POSTURE
        if is_pose:
            if self._tracked:
                return "is in a frame that moves with a conveyor (LINE_TRACK)"
            for name, text in position.external:
                if float(text):
                    return f"has {name} off zero, and that external axis may carry the robot"
            if frame is None or tool is None:
                kind = "user frame" if frame is None else "tool"
                return f"is for the active {kind}, and the program does not say for certain which that is"
            read_posture = configuration(position.configuration)
            if read_posture is None:
                return "has a CONFIG that cannot be read"
            posture = read_posture
        return ProgramTarget(
            self._source,
            self._file.line(position.start),
            f"P[{position.number}:{position.comment}]" if position.comment else f"P[{position.number}]",
            POSE if is_pose else JOINTS,
            values,
            tuple(position.places),
            tool or "",
            frame or "",
            posture,
        )

    def _active(self, number: str, slot: int, written: str) -> str | None:
        """Return the name of a frame (0) or tool (1), None if it is not known."""
        if written not in "Ff":
            return written.lstrip("0")
        active: str | None
        if number in self._instructions.active:
            active = self._instructions.active[number][slot]
        else:
            everywhere = self._instructions.everywhere[slot]
            active = next(iter(everywhere)) if len(everywhere) == 1 else None
        return None if active is None else active.lstrip("0")


def read(sources: Sequence[Source]) -> Program:
    """Read FANUC programs; each file is one.

    Raises:
        InputError: If a section is missing, a position is not complete or appears twice, or a number is out of all
            proportion.
    """
    targets: list[ProgramTarget] = []
    moves: list[Move] = []
    skipped: list[Skipped] = []
    unknown: Counter[str] = Counter()
    routine = 0
    for number, source in enumerate(sources):
        file = LsFile(source)
        instructions = Instructions(file, number, routine)
        positions = _Positions(file, number, instructions)
        places: dict[str, int | None] = {}
        for position in file.taught():
            target = positions.target(position)
            if isinstance(target, str):
                line = file.line(position.start)
                instructions.skipped.append(Skipped(number, line, f"P[{position.number}] {target}"))
                places[position.number] = None
            else:
                places[position.number] = len(targets)
                targets.append(target)
        gaps = 0
        for step in instructions.steps:
            index = places.get(step.target)
            if index is None or step.via:
                for wanted, span in ((step.target, step.target_text), (step.via, step.via_text)):
                    if wanted and span and wanted not in places:
                        reason = f"P[{wanted}] is not among the positions of this program"
                        instructions.skipped.append(Skipped(number, file.line(span[0]), reason))
            if index is None:
                gaps += 1
                continue
            via = places.get(step.via)
            move = Move(
                step.kind,
                index,
                number,
                file.line(step.statement[0]),
                via,
                step.routine + gaps,
                step.statement,
                step.target_text,
                None if via is None else step.via_text,
            )
            moves.append(move)
        routine = instructions.routine + gaps + 1
        skipped += sorted(instructions.skipped, key=lambda entry: entry.line)
        unknown += instructions.unknown
    return Program(_NAME, tuple(sources), tuple(targets), tuple(moves), skipped=tuple(skipped), unknown=dict(unknown))


def commented(text: str, lines: Sequence[str]) -> str:
    """Return a program with remarks behind its last instruction, where no line is numbered anew."""
    file = LsFile(Source(Path(), text))
    place, number, head = file.instructions[0], 0, (0, 4)
    for statement in file.statements():
        place = statement.stop
        digits = text[slice(*statement.number)]
        if digits:
            number, head = int(digits), (file.text.rfind("\n", 0, statement.number[0]) + 1, statement.number[1])
    rows = [f"{number + row:{head[1] - head[0]}}:  !{line}    ;" for row, line in enumerate(lines, 1)]
    remarked = with_lines_behind(text, place, rows, None)
    count = LINE_COUNT.search(text, 0, file.instructions[0])
    if count is None:
        return remarked
    return replaced(remarked, 0, len(remarked), [(*count.span(1), str(int(count[1]) + len(lines)))])


#: A position that goes to a position register.
_READS: Final = re.compile(r"(?m)^[ \t]*+\d*+:[ \t]*+!.*+$|=[ \t]*+(P\[\d++)[^\]\n]*+\]", re.IGNORECASE)

FANUC_LS: Final = Language(
    _NAME,
    (".ls",),
    ("FANUC",),
    recognizes,
    read,
    commented,
    split_moves,
    new_program,
    motion_program,
    calibration=MakersCalibration("FANUC", "robot calibration (mechanism error parameters)"),
    flange=("0",),
    base=("0",),
    reads=_READS,
)
