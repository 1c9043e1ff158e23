"""New Yaskawa jobs: targets one after the other, or with stops, waits and circles.

Source: Yaskawa, INFORM language manuals of the controllers DX100, DX200 and FS100: MOVJ, MOVL, MOVC, TIMER, WAIT,
PAUSE, and the tags VJ, V and PL. The first MOVC of a row is reached on a line: it stands where the arc begins. Between
two arcs a MOVL stands at the point where they meet, as the operator's manuals are remembered to ask for; the tag FPT in
its place is known to newer controllers alone. Tool and load are in the tool files of the controller, not in jobs.
"""

from __future__ import annotations

import math

from truearm.engine.programs.jbi.job import ANGLES, POSE
from truearm.engine.programs.new_program import (
    CircleMove,
    InputWait,
    JointMove,
    MotionProgram,
    NewProgram,
    NewTargets,
    Pause,
    Remark,
    StraightMove,
    Wait,
    number,
)

#: The controller writes its own when it loads the job.
DATE = "2000/01/01 00:00"


def new_program(program: NewProgram) -> dict[str, str]:
    """Return a job: straight moves have their speed, joint motions a tenth of the fastest (VJ), as no time can be said.

    Positions are joint angles or poses, not pulses of the motors.
    """
    name = program.name.upper()
    count = len(program)
    lines = ["/JOB", f"//NAME {name}", "//POS", f"///NPOS {count},0,0,0,0,0", "///TOOL 0"]
    steps, state = [], ""
    for row in range(count):
        if program.poses is None or row == 0:
            header, numbers = "///POSTYPE ANGLE\n///ANGLE", program.axes(row, ANGLES)
            steps.append(f"MOVJ C{row:05d} VJ=10.00{' PL=1' if program.blend(row) else ' PL=0'}")
        else:
            header, numbers = f"///POSTYPE ROBOT\n///RECTAN\n///RCONF {rconf(program, row)}", program.pose(row, POSE)
            speed = max(program.speed(row) * 1e3, 0.1)
            steps.append(f"MOVL C{row:05d} V={speed:.1f}{' PL=1' if program.blend(row) else ' PL=0'}")
        if header != state:
            lines.append(header)
            state = header
        lines.append(f"C{row:05d}={','.join(numbers)}")
    comments = [f"'{line[:32]}" for line in program.comments]
    lines += ["//INST", f"///DATE {DATE}", "///ATTR SC,RW", "///GROUP1 RB1", "NOP", *comments, *steps, "END", ""]
    return {f"{name}.JBI": "\n".join(lines)}


def rconf(program: NewTargets, row: int) -> str:
    """Return the posture of a pose: no-flip, lower arm, rear, and R, T and S beyond 180 deg."""
    shoulder, elbow, _ = program.words(row)
    turned, last, first = (program.joints[row, joint] for joint in (3, 5, 0))
    no_flip = abs(turned - 2 * math.pi * round(turned / (2 * math.pi))) > math.pi / 2
    beyond = [abs(angle) > math.pi for angle in (turned, last, first)]
    flags = [no_flip, shoulder == "front" and elbow == "down", shoulder == "back", *beyond]
    return ",".join(str(int(flag)) for flag in flags)


def motion_program(program: MotionProgram) -> dict[str, str]:
    """Return a job: every move has a position of its own, and where the robot does not stop, no position level."""
    name = program.name.upper()
    steps: list[str] = []
    positions: list[str] = []
    state, count = "", 0

    def position(kind: str, row: int) -> str:
        nonlocal state, count
        if kind == "joints":
            header, numbers = "///POSTYPE ANGLE\n///ANGLE", program.axes(row, ANGLES)
        else:
            header, numbers = f"///POSTYPE ROBOT\n///RECTAN\n///RCONF {rconf(program, row)}", program.pose(row, POSE)
        if header != state:
            positions.append(header)
            state = header
        label, count = f"C{count:05d}", count + 1
        positions.append(f"{label}={','.join(numbers)}")
        return label

    arc = False
    for step, near in program.zoned():
        end = "" if near else " PL=0"
        match step:
            case JointMove():
                steps.append(f"MOVJ {position('joints', step.target)} VJ={max(100.0 * step.share, 0.01):.2f}{end}")
            case StraightMove():
                steps.append(f"MOVL {position('pose', step.target)} V={_speed(step.speed)}{end}")
            case CircleMove():
                speed = f"V={_speed(step.speed)}"
                if arc:
                    steps.append(f"MOVL {position('pose', step.start)} {speed}")
                steps.append(f"MOVC {position('pose', step.start)} {speed}")
                steps.append(f"MOVC {position('pose', step.via)} {speed}")
                steps.append(f"MOVC {position('pose', step.target)} {speed}{end}")
            case Wait():
                steps.append(f"TIMER T={number(step.seconds, 2)}")
            case Remark():
                steps.append(f"'{step.text}")
            case InputWait():
                for state, other in (("OFF", "ON"), ("ON", "OFF")):
                    steps.append(f"WAIT IN#({step.input})={state} T={step.seconds:.2f}")
                    steps += [f"'{step.label}: no signal", f"PAUSE IF IN#({step.input})={other}"]
            case Pause():
                steps += ["'Measure, then start again", "PAUSE"]
        arc = isinstance(step, CircleMove)
    lines = ["/JOB", f"//NAME {name}", "//POS", f"///NPOS {count},0,0,0,0,0", "///TOOL 0", *positions]
    lines += ["//INST", f"///DATE {DATE}", "///ATTR SC,RW", "///GROUP1 RB1", "NOP"]
    comments = program.comments if program.carried is None else (*program.comments, "Tool file 0 must hold this load")
    lines += [*(f"'{line}" for line in comments), *steps, "END", ""]
    return {f"{name}.JBI": "\n".join(lines)}


def _speed(speed: float) -> str:
    return f"{max(speed * 1e3, 0.1):.1f}"
