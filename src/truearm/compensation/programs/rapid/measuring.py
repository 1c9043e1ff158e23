r"""RAPID modules with stops, waits and circles.

Source: ABB, Technical reference manual, RAPID Instructions, Functions and Data types (3HAC050917-001): MoveAbsJ, MoveL,
MoveC, CirPathMode, WaitTime, and the data types speeddata and zonedata. ``WaitTime \InPos`` waits until the robot
stands still.
"""

from __future__ import annotations

import math

from truearm.compensation.programs.motion_program import (
    CircleMove,
    JointMove,
    MotionProgram,
    Remark,
    StraightMove,
    Wait,
    number,
)
from truearm.compensation.programs.rapid.data import JOINTTARGET, ROBTARGET
from truearm.compensation.programs.rapid.new import posture

_NO_AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"


def motion_program(program: MotionProgram) -> dict[str, str]:
    """Return a module with one routine; joint motions have the speed of the tip, as RAPID says no share."""
    speeds: dict[str, str] = {}
    zones: dict[str, str] = {}

    def speed(value: float) -> str:
        return speeds.setdefault(number(value * 1e3, 3), f"s{len(speeds) + 1}")

    def zone(value: float) -> str:
        return zones.setdefault(number(value * 1e3, 3), f"n{len(zones) + 1}") if value else "fine"

    steps = []
    for step, near in program.zoned():
        match step:
            case JointMove():
                steps.append(f"    MoveAbsJ j{step.target + 1},{speed(step.speed)},fine,tool0;")
            case StraightMove():
                steps.append(f"    MoveL p{step.target + 1},{speed(step.speed)},{zone(near)},tool0;")
            case CircleMove():
                arc = f"p{step.via + 1},p{step.target + 1}"
                steps.append(f"    MoveC {arc},{speed(step.speed)},{zone(near)},tool0;")
            case Wait():
                steps.append(f"    WaitTime \\InPos,{number(step.seconds, 3)};")
            case Remark():
                steps.append(f"    ! {step.text}")
    lines = [f"MODULE {program.name}", *(f"  ! {line}" for line in program.comments)]
    for kind, row in program.places():
        if kind == "joints":
            joints = ",".join(program.axes(row, JOINTTARGET))
            lines.append(f"  CONST jointtarget j{row + 1}:=[[{joints}],{_NO_AXES}];")
        else:
            pose = program.pose(row, ROBTARGET)
            quarters = [math.floor(program.joints[row, joint] / (math.pi / 2)) for joint in (0, 3, 5)]
            turns = ",".join(str(value) for value in [*quarters, posture(program, row)])
            place, turned = ",".join(pose[:3]), ",".join(pose[3:])
            lines.append(f"  CONST robtarget p{row + 1}:=[[{place}],[{turned}],[{turns}],{_NO_AXES}];")
    lines += [f"  CONST speeddata {name}:=[{value},500,5000,1000];" for value, name in speeds.items()]
    lines += [
        f"  CONST zonedata {name}:=[FALSE,{value},{wide},{wide},{turn},{wide},{turn}];"
        for value, name in zones.items()
        for wide, turn in [(number(1.5 * float(value), 3), number(0.15 * float(value), 3))]
    ]
    lines += ["", f"  PROC {program.name}_main()", "    ConfL \\Off;", "    CirPathMode \\ObjectFrame;", *steps]
    end = ["    CirPathMode \\PathFrame;", "    ConfL \\On;", "  ENDPROC", "ENDMODULE", ""]
    return {f"{program.name}.mod": "\n".join([*lines, *end])}
