"""URScript programs with stops, waits and circles.

Source: Universal Robots, The URScript programming language: movej, movel, movec, sleep, set_tcp. movec takes the
orientation evenly from that of its start to that of its end.
"""

from __future__ import annotations

import math
from typing import Final

from truearm.compensation.programs.motion_program import (
    CircleMove,
    JointMove,
    MotionProgram,
    Remark,
    StraightMove,
    Wait,
    number,
)
from truearm.compensation.programs.urscript.program import JOINTS, POSE

#: What 100 % of the joints' speed is taken for, as URScript says no share [rad/s].
FASTEST: Final = math.radians(120.0)


def motion_program(program: MotionProgram) -> dict[str, str]:
    """Return a script; accelerations are those of URScript where none are stated: 1.4 rad/s^2 and 1.2 m/s^2."""
    lines = [*(f"# {line}" for line in program.comments), f"def {program.name}():"]
    lines.append("  set_tcp(p[0, 0, 0, 0, 0, 0])")

    def pose(row: int) -> str:
        return f"p[{', '.join(program.pose(row, POSE))}]"

    for step, near in program.zoned():
        match step:
            case JointMove():
                axes = ", ".join(program.axes(step.target, JOINTS))
                lines.append(f"  movej([{axes}], v={FASTEST * step.share:.4f})")
            case StraightMove():
                lines.append(f"  movel({pose(step.target)}, v={step.speed:.5f}, r={number(near, 5)})")
            case CircleMove():
                arc = f"{pose(step.via)}, {pose(step.target)}"
                lines.append(f"  movec({arc}, v={step.speed:.5f}, r={number(near, 5)})")
            case Wait():
                lines.append(f"  sleep({number(step.seconds, 3)})")
            case Remark():
                lines.append(f"  # {step.text}")
    return {f"{program.name}.script": "\n".join([*lines, "end", "", f"{program.name}()", ""])}
