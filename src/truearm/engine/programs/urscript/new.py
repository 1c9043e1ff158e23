"""New URScript programs: targets one after the other, or with stops, waits and circles.

Source: Universal Robots, The URScript programming language: movej, movel, movec, sleep, set_tcp, set_payload,
get_standard_digital_in, popup. movec takes the orientation evenly from that of its start to that of its end. A popup
that blocks pauses the program until the operator goes on.
"""

from __future__ import annotations

import math
from typing import Final

from truearm.engine.programs.new_program import (
    Carried,
    CircleMove,
    InputWait,
    JointMove,
    MotionProgram,
    NewProgram,
    Pause,
    Remark,
    StraightMove,
    Wait,
    number,
)
from truearm.engine.programs.urscript.targets import JOINTS, POSE

#: What 100 % of the joints' speed is taken for, as URScript says no share [rad/s].
FASTEST: Final = math.radians(120.0)

#: How often an input is looked at [s].
_LOOKING: Final = 0.02


def motion_program(program: MotionProgram) -> dict[str, str]:
    """Return a script; accelerations are those of URScript where none are stated: 1.4 rad/s^2 and 1.2 m/s^2."""
    lines = [*(f"# {line}" for line in program.comments), f"def {program.name}():"]
    lines += _carried(program.carried)

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
            case InputWait():
                lines += [
                    f"  looks = {round(step.seconds / _LOOKING)}",
                    *_looked(step.input, "True"),
                    *_looked(step.input, "False"),
                    "  if (looks <= 0):",
                    f'    popup("{step.label}: no signal", blocking=True)',
                    "  end",
                ]
            case Pause():
                lines.append(f'  popup("{step.label}: measure, then go on", blocking=True)')
    return {f"{program.name}.script": "\n".join([*lines, "end", "", f"{program.name}()", ""])}


def _carried(carried: Carried | None) -> list[str]:
    if carried is None:
        return ["  set_tcp(p[0, 0, 0, 0, 0, 0])"]
    tip, cog = (", ".join(number(v, 6) for v in point) for point in (carried.tip, carried.cog))
    return [f"  set_tcp(p[{tip}, 0, 0, 0])", f"  set_payload({number(carried.mass, 3)}, [{cog}])"]


def _looked(signal: str, state: str) -> list[str]:
    """Return a loop that ends when an input has left a state, or there are no more looks."""
    return [
        f"  while (looks > 0 and get_standard_digital_in({signal}) == {state}):",
        f"    sleep({_LOOKING})",
        "    looks = looks - 1",
        "  end",
    ]


def new_program(program: NewProgram) -> dict[str, str]:
    """Return a script: every move takes its time (``t``)."""
    lines = [*(f"# {line}" for line in program.comments), f"def {program.name}():"]
    lines.append("  set_tcp(p[0, 0, 0, 0, 0, 0])")
    for row in range(len(program)):
        time, blend = f"t={program.seconds(row):.4f}", f"r={program.blend(row):.5f}"
        if row == 0:
            lines.append(f"  movej([{', '.join(program.axes(0, JOINTS))}], a=0.5, v=0.2)")
        elif program.poses is None:
            lines.append(f"  movej([{', '.join(program.axes(row, JOINTS))}], {time}, {blend})")
        else:
            lines.append(f"  movel(p[{', '.join(program.pose(row, POSE))}], {time}, {blend})")
    return {f"{program.name}.script": "\n".join([*lines, "end", "", f"{program.name}()", ""])}
