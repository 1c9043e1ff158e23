"""New FANUC TP programs in ASCII."""

from __future__ import annotations

import math

from truearm.compensation.programs.fanuc_ls.forms import JOINTS, POSE
from truearm.compensation.programs.new_program import NewProgram
from truearm.compensation.programs.new_targets import NewTargets


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
