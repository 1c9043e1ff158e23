r"""New RAPID modules: targets one after the other, or with stops, waits and circles.

Source: ABB, Technical reference manual, RAPID Instructions, Functions and Data types (3HAC050917-001): MoveAbsJ, MoveL,
MoveC, CirPathMode, WaitTime, WaitDI, Stop, and the data types speeddata, zonedata and tooldata. ``WaitTime \InPos``
waits until the robot stands still; ``\T`` is the time of a motion in seconds, in the place of its speed.
"""

from __future__ import annotations

import math

from truearm.engine.programs.new_program import (
    Carried,
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
from truearm.engine.programs.rapid.data import JOINTTARGET, ROBTARGET

_NO_AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"


def new_program(program: NewProgram) -> dict[str, str]:
    r"""Return a module with one routine: every move takes its time (``\T``)."""
    lines = [f"MODULE {program.name}", *(f"  ! {line}" for line in program.comments)]
    for row in range(len(program)):
        joints = ",".join(program.axes(row, JOINTTARGET))
        if program.poses is None or row == 0:
            lines.append(f"  CONST jointtarget j{row + 1}:=[[{joints}],{_NO_AXES}];")
            continue
        pose = program.pose(row, ROBTARGET)
        quarters = [math.floor(program.joints[row, joint] / (math.pi / 2)) for joint in (0, 3, 5)]
        turns = ",".join(str(number) for number in [*quarters, posture(program, row)])
        place, turned = ",".join(pose[:3]), ",".join(pose[3:])
        lines.append(f"  CONST robtarget p{row + 1}:=[[{place}],[{turned}],[{turns}],{_NO_AXES}];")
    lines += ["", f"  PROC {program.name}_main()", "    ConfL \\Off;"]
    for row in range(len(program)):
        zone = "fine" if program.blend(row) == 0.0 else "z0"
        if row == 0:
            lines.append("    MoveAbsJ j1,v100,fine,tool0;")
        elif program.poses is None:
            lines.append(f"    MoveAbsJ j{row + 1},v100\\T:={program.seconds(row):.4f},{zone},tool0;")
        else:
            lines.append(f"    MoveL p{row + 1},v100\\T:={program.seconds(row):.4f},{zone},tool0;")
    return {f"{program.name}.mod": "\n".join([*lines, "    ConfL \\On;", "  ENDPROC", "ENDMODULE", ""])}


def posture(program: NewTargets, row: int) -> int:
    """Return cfx of a pose; 0 where the arm's postures have no names."""
    if program.branches is None:
        return 0
    shoulder, elbow, _ = program.words(row)
    first = {("front", "up"): 0, ("front", "down"): 2, ("back", "down"): 4, ("back", "up"): 6}[shoulder, elbow]
    return first + int(program.joints[row, 4] < 0.0)


_TURNING = math.radians(500.0)
_TOOL = "tMeasure"
#: A tool must weigh something: what tool0 weighs [kg, mm].
_LIGHTEST = ("0.001", ("0", "0", "0.001"))
_NO_AXES_MEASURING = "[9E9,9E9,9E9,9E9,9E9,9E9]"


def motion_program(program: MotionProgram) -> dict[str, str]:
    """Return a module with one routine; joint motions have their time or the tip's speed, as RAPID says no share."""
    speeds: dict[tuple[str, str], str] = {}
    zones: dict[str, str] = {}

    def speed(value: float, turning: float = _TURNING) -> str:
        return speeds.setdefault((number(value * 1e3, 3), number(math.degrees(turning), 2)), f"s{len(speeds) + 1}")

    def zone(value: float) -> str:
        return zones.setdefault(number(value * 1e3, 3), f"n{len(zones) + 1}") if value else "fine"

    tool = "tool0" if program.carried is None else _TOOL
    steps = []
    for step, near in program.zoned():
        match step:
            case JointMove():
                time = "" if step.seconds is None else f"\\T:={number(step.seconds, 2)}"
                fast = speed(step.speed, step.turning)
                steps.append(f"    MoveAbsJ j{step.target + 1},{fast}{time},fine,{tool};")
            case StraightMove():
                steps.append(f"    MoveL p{step.target + 1},{speed(step.speed)},{zone(near)},{tool};")
            case CircleMove():
                arc = f"p{step.via + 1},p{step.target + 1}"
                steps.append(f"    MoveC {arc},{speed(step.speed)},{zone(near)},{tool};")
            case Wait():
                steps.append(f"    WaitTime \\InPos,{number(step.seconds, 3)};")
            case Remark():
                steps.append(f"    ! {step.text}")
            case InputWait():
                signal = f"di{step.input}" if step.input.isdigit() else step.input
                wait, limit = f"WaitDI {signal}", f"\\MaxTime:={number(step.seconds, 2)}\\TimeFlag:=late;"
                steps += [f"    {wait},0{limit}", f"    IF NOT late {wait},1{limit}"]
                steps += ["    IF late THEN", f'      TPWrite "{step.label}: no signal";', "      Stop;", "    ENDIF"]
            case Pause():
                steps += [f'    TPWrite "{step.label}: measure, then start again";', "    Stop;"]
    lines = [f"MODULE {program.name}", *(f"  ! {line}" for line in program.comments)]
    lines += [] if program.carried is None else [_tooldata(program.carried)]
    lines += ["  VAR bool late;"] if any(isinstance(step, InputWait) for step in program.steps) else []
    for kind, row in program.places():
        if kind == "joints":
            joints = ",".join(program.axes(row, JOINTTARGET))
            lines.append(f"  CONST jointtarget j{row + 1}:=[[{joints}],{_NO_AXES_MEASURING}];")
        else:
            pose = program.pose(row, ROBTARGET)
            quarters = [math.floor(program.joints[row, joint] / (math.pi / 2)) for joint in (0, 3, 5)]
            turns = ",".join(str(value) for value in [*quarters, posture(program, row)])
            place, turned = ",".join(pose[:3]), ",".join(pose[3:])
            lines.append(f"  CONST robtarget p{row + 1}:=[[{place}],[{turned}],[{turns}],{_NO_AXES_MEASURING}];")
    lines += [f"  CONST speeddata {name}:=[{value},{turn},5000,1000];" for (value, turn), name in speeds.items()]
    lines += [
        f"  CONST zonedata {name}:=[FALSE,{value},{wide},{wide},{turn},{wide},{turn}];"
        for value, name in zones.items()
        for wide, turn in [(number(1.5 * float(value), 3), number(0.15 * float(value), 3))]
    ]
    if program.carried is None:
        begins, ends = (
            ("    ConfL \\Off;", "    CirPathMode \\ObjectFrame;"),
            ("    CirPathMode \\PathFrame;", "    ConfL \\On;"),
        )
        steps = [*begins, *steps, *ends]
    lines += ["", f"  PROC {program.name}_main()", *steps, "  ENDPROC", "ENDMODULE", ""]
    return {f"{program.name}.mod": "\n".join(lines)}


def _tooldata(carried: Carried) -> str:
    mass, cog = (number(carried.mass, 3), carried.cog_mm) if carried.mass >= 1e-3 else _LIGHTEST
    load = f"[{mass},[{','.join(cog)}],[1,0,0,0],0,0,0]"
    return f"  PERS tooldata {_TOOL}:=[TRUE,[[{','.join(carried.tip_mm)}],[1,0,0,0]],{load}];"
