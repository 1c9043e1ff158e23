"""Yaskawa INFORM: job files (``.jbi``) of the XRC, NX100, DX, FS and YRC controllers.

A job has a table of positions and a list of instructions. Lines that begin with ``///`` say of the positions after
them what they are (pulses of the motors, joint angles or a pose), and with which tool, in which user frame and in
which posture. Sources: Yaskawa, NX100 data transmission manual (HW0481924), section 4.1 "Job data format", and DX100
data transmission manual (HW0482494), sections 4.1 and 4.3, for the file; NX100 operator's manual (149235-1CD),
"Manipulator types", for the posture and "Circular interpolation" for MOVC; FS100 and YRC1000 INFORM language manuals
for the instructions. That circles of different curvature are separated, the tag FPT, front and rear, and on which side
180 deg is are from memory.

Tool 0 is a tool file like the others, and user frame 1 is the first one: their numbers are the names here. No job
says where they are. Positions of base and of station axes (BC, EC, BP, EX) stay as they are.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from functools import cache
from math import radians
from typing import Final

from truearm.engine.programs.jbi.job import (
    ANGLES,
    JOB,
    KINDS,
    NOWHERE,
    POSE,
    PULSES,
    Job,
    Key,
    Position,
    Step,
    Steps,
    arcs_of,
    jobs_of,
    steps_of,
)
from truearm.engine.programs.jbi.new import motion_program, new_program
from truearm.engine.programs.jbi.split import split_moves
from truearm.engine.programs.program import (
    ANY_POSTURE,
    Configuration,
    Language,
    Lines,
    MakersCalibration,
    Move,
    Program,
    ProgramTarget,
    Skipped,
    Source,
    with_lines_behind,
)

_FORMS: Final = {"PULSE": PULSES, "ANGLE": ANGLES}
_AXES: Final = 6

#: Openings of the intervals that the manual leaves open below and closes above [rad].
_OPEN: Final = 1e-8

#: Where the instructions begin: what is said of the job, and NOP, stand before them.
_BEGINNING: Final = re.compile(
    r"[\r\n][ \t]*+//INST[ \t]*+(?:[\r\n]++[ \t]*+///[^\r\n]*+)*+(?:[\r\n]++[ \t]*+NOP[ \t]*+(?=[\r\n]|\Z))?"
)


def recognizes(text: str) -> bool:
    """Tell whether a text is a job."""
    return JOB.search(text) is not None


def read(sources: Sequence[Source]) -> Program:
    """Read jobs.

    Args:
        sources: Job files; each has its own table of positions, or more if there are several jobs in it.

    Raises:
        InputError: If a job is not complete, or a line of its table of positions is malformed.
    """
    targets: list[ProgramTarget] = []
    moves: list[Move] = []
    skipped: list[Skipped] = []
    unknown: Counter[str] = Counter()
    routine = 0
    for index, source in enumerate(sources):
        lines = Lines(source.text)
        for job in jobs_of(source, lines):
            steps = steps_of(source, lines, job)
            unknown.update(steps.unknown)
            places: dict[Key, int] = {}
            barred: set[Key] = set()
            left: list[Skipped] = []
            for position in job.positions:
                key = position.table, position.number
                reason = _reason(position, key, job, steps)
                if reason is None:
                    places[key] = len(targets)
                    targets.append(_target(index, position))
                else:
                    barred.add(key)
                    left.append(Skipped(index, position.line, f"{position.name} {reason}"))
            for arc in arcs_of(steps.steps):
                if arc and all(step.key in places for step in arc):
                    moves.append(_move(index, routine, arc, places))
                    continue
                routine += 1
                lost = [step for step in arc if step.key not in places and step.key not in barred]
                left += [Skipped(index, step.line, _missing(step)) for step in lost]
            routine += 1
            skipped += sorted(left, key=lambda entry: entry.line)
    return Program(
        language=JBI.name,
        sources=tuple(sources),
        targets=tuple(targets),
        moves=tuple(moves),
        skipped=tuple(skipped),
        unknown=dict(unknown),
    )


def _target(source: int, position: Position) -> ProgramTarget:
    state = position.state
    form = _FORMS.get(state.postype, POSE)
    return ProgramTarget(
        source,
        position.line,
        position.name,
        form,
        position.values[:_AXES],
        position.places[:_AXES],
        tool=state.tool,
        frame=state.user if state.postype == "USER" else "",
        configuration=_configuration(state.rconf) if form is POSE else ANY_POSTURE,
    )


def _reason(position: Position, key: Key, job: Job, steps: Steps) -> str | None:
    """Return why a position is left as it is, None if it is not."""
    state = position.state
    if steps.robots > 1:
        return "is in a job of two robots, and it is not known whose it is"
    if state.postype in ("TOOL", "MTOOL"):
        return f"is in coordinates of the {'master tool' if state.postype == 'MTOOL' else 'tool'}"
    if state.postype == "USER" and not state.user:
        return "is in a user frame whose number is not given"
    if state.postype in ("BASE", "USER") and job.carried:
        return "is in a job whose base axes carry the robot"
    if len(position.values) < _AXES:
        return f"has {len(position.values)} numbers, {_AXES} are expected"
    if any(position.values[_AXES:]):
        return "moves a seventh axis of the arm too"
    if position.table == "P" and steps.all_variables_barred:
        return "may be changed by an instruction that chooses a position variable by its index"
    return steps.barred.get(key)


def _missing(step: Step) -> str:
    if step.key == NOWHERE:
        return f"{step.word}: the position is chosen when the program runs"
    table, number = step.key
    reason = "a position variable of the controller" if table == "P" else "not in the table of positions"
    return f"{step.word} {table}{number:05d}: {reason}"


def _move(source: int, routine: int, arc: Sequence[Step], places: dict[Key, int]) -> Move:
    first, last = arc[0], arc[-1]
    via = first if len(arc) == 2 else None
    return Move(
        kind=KINDS[last.word],
        target=places[last.key],
        source=source,
        line=last.line,
        via=places[via.key] if via is not None else None,
        routine=routine,
        statement=(first.start, last.stop),
        target_text=last.target_text,
        via_text=via.target_text if via is not None else None,
    )


@cache
def _configuration(text: str) -> Configuration:
    """Return what ``///RCONF`` says.

    Its numbers are 1 for no-flip, lower arm, rear, and for an R, T and S axis beyond 180 deg. Flip is an R axis that
    reads within 90 deg of a whole turn. Whether the lower arm of a rear posture is the one that hangs down, or the one
    that bends the other way, is not documented: it is not used then.
    """
    parts = [part.strip() for part in text.split(",")][:6]
    if len(parts) < 3 or not {"0", "1"}.issuperset(parts):
        return ANY_POSTURE
    flags = [part == "1" for part in parts]
    no_flip, lower, rear = flags[:3]
    beyond = dict(zip((4, 6, 1), flags[3:6], strict=False))
    inside: list[tuple[int, float, float]] = []
    outside: list[tuple[int, float, float]] = []
    for joint, far in beyond.items():
        (outside if far else inside).append(_interval(joint, 180.0))
    if 4 in beyond:
        # Turned by 180 deg, flip is no flip.
        if beyond[4]:
            (inside if no_flip else outside).append(_interval(4, 270.0))
        else:
            (outside if no_flip else inside).append(_interval(4, 90.0))
    return Configuration(
        shoulder="back" if rear else "front",
        elbow=None if rear else "down" if lower else "up",
        ranges=tuple(inside),
        outside=tuple(outside),
    )


def _interval(joint: int, degrees: float) -> tuple[int, float, float]:
    return joint, _OPEN - radians(degrees), _OPEN + radians(degrees)


def _commented(text: str, lines: Sequence[str]) -> str:
    head = _BEGINNING.search(text)
    return text if head is None else with_lines_behind(text, head.end(), [f"'{line}" for line in lines], "'")


JBI: Final = Language(
    "INFORM",
    (".jbi",),
    ("Yaskawa", "Motoman"),
    recognizes,
    read,
    _commented,
    split_moves,
    new_program,
    motion_program,
    calibration=MakersCalibration("Yaskawa", "absolute accuracy"),
    base=("robot",),
)
