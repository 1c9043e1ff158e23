"""New Yaskawa jobs."""

from __future__ import annotations

import math

from truearm.compensation.programs.jbi.forms import ANGLES, POSE
from truearm.compensation.programs.new_program import NewProgram
from truearm.compensation.programs.new_targets import NewTargets

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
            now, numbers = "///POSTYPE ANGLE\n///ANGLE", program.axes(row, ANGLES)
            steps.append(f"MOVJ C{row:05d} VJ=10.00{' PL=1' if program.blend(row) else ' PL=0'}")
        else:
            now, numbers = f"///POSTYPE ROBOT\n///RECTAN\n///RCONF {rconf(program, row)}", program.pose(row, POSE)
            speed = max(program.speed(row) * 1e3, 0.1)
            steps.append(f"MOVL C{row:05d} V={speed:.1f}{' PL=1' if program.blend(row) else ' PL=0'}")
        if now != state:
            lines.append(now)
            state = now
        lines.append(f"C{row:05d}={','.join(numbers)}")
    comments = [f"'{line[:32]}" for line in program.comments]
    lines += [
        "//INST",
        f"///DATE {DATE}",
        "///ATTR SC,RW",
        "///GROUP1 RB1",
        "NOP",
        *comments,
        *steps,
        "END",
        "",
    ]
    return {f"{name}.JBI": "\n".join(lines)}


def rconf(program: NewTargets, row: int) -> str:
    """Return the posture of a pose: no-flip, lower arm, rear, and R, T and S beyond 180 deg."""
    shoulder, elbow, _ = program.words(row)
    turned, last, first = (program.joints[row, joint] for joint in (3, 5, 0))
    no_flip = abs(turned - 2 * math.pi * round(turned / (2 * math.pi))) > math.pi / 2
    beyond = [abs(angle) > math.pi for angle in (turned, last, first)]
    flags = [no_flip, shoulder == "front" and elbow == "down", shoulder == "back", *beyond]
    return ",".join(str(int(flag)) for flag in flags)
