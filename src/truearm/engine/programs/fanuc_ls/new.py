"""New FANUC TP programs in ASCII: targets one after the other, or with stops, waits and circles.

Source: FANUC, operator's manual of the controllers R-30iA and R-30iB, program instructions: J, L and C with FINE and
CNT, WAIT with TIMEOUT, PAUSE and PAYLOAD. The second position of a circle stands on a line of its own. What a payload
schedule holds is not said in programs. ``$WAITTMOUT`` is in hundredths of a second.
"""

from __future__ import annotations

import math

from truearm.engine.programs.fanuc_ls.text import JOINTS, POSE
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
    TargetKind,
    Wait,
    number,
    percent,
)


def new_program(program: NewProgram) -> dict[str, str]:
    """Return an ``.ls`` file: joint motions take their time (msec), straight moves have their speed."""
    name = program.name.upper()
    steps = [f"!{line[:32]}" for line in program.comments]
    steps += ["UFRAME_NUM=0", "UTOOL_NUM=0"]
    moves, positions = [], []
    for row in range(len(program)):
        end = "CNT100" if program.blend(row) else "FINE"
        if program.poses is None or row == 0:
            speed = f"{max(1, round(program.seconds(row) * 1e3))}msec" if row else "5%"
            moves.append(f"J P[{row + 1}] {speed} {end}")
            axes = program.axes(row, JOINTS, least=0)
            units = ["mm" if slides else "deg" for slides in program.sliding]
            parts = [f"J{n}= {v} {unit}" for n, (v, unit) in enumerate(zip(axes, units, strict=True), 1)]
            head = "UF : 0, UT : 0,"
        else:
            moves.append(f"L P[{row + 1}] {max(program.speed(row) * 1e3, 0.1):.1f}mm/sec {end}")
            numbers = program.pose(row, POSE)
            parts = [f"{n} = {v} mm" for n, v in zip("XYZ", numbers[:3], strict=True)]
            parts += [f"{n} = {v} deg" for n, v in zip("WPR", numbers[3:], strict=True)]
            head = f"UF : 0, UT : 0,\t\tCONFIG : '{config(program, row)}',"
        rows = [",\t".join(parts[k : k + 3]) for k in range(0, len(parts), 3)]
        body = ",\n\t".join(rows)
        positions.append(f"P[{row + 1}]{{\n   GP1:\n\t{head}\n\t{body}\n}};")
    numbered = [f"{number:4}:  {text}    ;" for number, text in enumerate(steps, 1)]
    numbered += [f"{number:4}:{text}    ;" for number, text in enumerate(moves, len(steps) + 1)]
    head_lines = [f"/PROG  {name}", "/ATTR", f"LINE_COUNT\t= {len(numbered)};", "DEFAULT_GROUP\t= 1,*,*,*,*;", "/MN"]
    return {f"{name}.ls": "\n".join([*head_lines, *numbered, "/POS", *positions, "/END", ""])}


def config(program: NewTargets, row: int) -> str:
    """Return the CONFIG of a pose: the sign of joint 5, the side of the elbow and of the wrist, and turns."""
    shoulder, elbow, _ = program.words(row)
    flip = "N" if program.joints[row, 4] < 0.0 else "F"
    up = "U" if (elbow == "up") == (shoulder == "front") else "D"
    turns = [round(program.joints[row, joint] / (2 * math.pi)) for joint in (0, 3, 5)]
    return f"{flip} {up} {'T' if shoulder == 'front' else 'B'}, {turns[0]}, {turns[1]}, {turns[2]}"


def motion_program(program: MotionProgram) -> dict[str, str]:
    """Return an ``.ls`` file: where the robot does not stop it goes on with CNT100, as the controller rounds it off."""
    name = program.name.upper()
    numbers = {place: count for count, place in enumerate(program.places(), 1)}
    steps = [f"  !{line}    ;" for line in program.comments]
    steps += ["  UFRAME_NUM=0    ;", "  UTOOL_NUM=0    ;"]
    if program.carried is not None:
        steps += ["  !PAYLOAD[1] must hold this load    ;", "  PAYLOAD[1]    ;"]
    late = 0
    for step, near in program.zoned():
        end = "CNT100" if near else "FINE"
        match step:
            case JointMove():
                steps.append(f"J P[{numbers['joints', step.target]}] {percent(step.share)}% FINE    ;")
            case StraightMove():
                steps.append(f"L P[{numbers['pose', step.target]}] {_speed(step.speed)} {end}    ;")
            case CircleMove():
                last = f"    :  P[{numbers['pose', step.target]}] {_speed(step.speed)} {end}    ;"
                steps.append(f"C P[{numbers['pose', step.via]}]    \n{last}")
            case Wait():
                steps.append(f"  WAIT{step.seconds:7.2f}(sec)    ;")
            case Remark():
                steps.append(f"  !{step.text}    ;")
            case InputWait():
                late += 1
                steps += [
                    f"  $WAITTMOUT={round(100.0 * step.seconds)}    ;",
                    f"  WAIT DI[{step.input}]=OFF TIMEOUT,LBL[{2 * late - 1}]    ;",
                    f"  WAIT DI[{step.input}]=ON TIMEOUT,LBL[{2 * late - 1}]    ;",
                    f"  JMP LBL[{2 * late}]    ;",
                    f"  LBL[{2 * late - 1}]    ;",
                    f"  !{step.label}: no signal    ;",
                    "  PAUSE    ;",
                    f"  LBL[{2 * late}]    ;",
                ]
            case Pause():
                steps += ["  !Measure, then start again    ;", "  PAUSE    ;"]
    numbered = [f"{line:4}:{text}" for line, text in enumerate(steps, 1)]
    head = [f"/PROG  {name}", "/ATTR", f"LINE_COUNT\t= {len(numbered)};", "DEFAULT_GROUP\t= 1,*,*,*,*;", "/MN"]
    positions = [_position(program, kind, row, count) for (kind, row), count in numbers.items()]
    return {f"{name}.ls": "\n".join([*head, *numbered, "/POS", *positions, "/END", ""])}


def _speed(speed: float) -> str:
    return f"{number(max(speed * 1e3, 0.1), 1)}mm/sec"


def _position(program: MotionProgram, kind: TargetKind, row: int, count: int) -> str:
    if kind == "joints":
        axes = program.axes(row, JOINTS, least=0)
        units = ["mm" if slides else "deg" for slides in program.sliding]
        parts = [f"J{axis}= {v} {unit}" for axis, (v, unit) in enumerate(zip(axes, units, strict=True), 1)]
        head = "UF : 0, UT : 0,"
    else:
        numbers = program.pose(row, POSE)
        parts = [f"{axis} = {v} mm" for axis, v in zip("XYZ", numbers[:3], strict=True)]
        parts += [f"{axis} = {v} deg" for axis, v in zip("WPR", numbers[3:], strict=True)]
        head = f"UF : 0, UT : 0,\t\tCONFIG : '{config(program, row)}',"
    rows = [",\t".join(parts[k : k + 3]) for k in range(0, len(parts), 3)]
    body = ",\n\t".join(rows)
    return f"P[{count}]{{\n   GP1:\n\t{head}\n\t{body}\n}};"
