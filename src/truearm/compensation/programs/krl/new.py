"""New KRL programs."""

from __future__ import annotations

from truearm.compensation.programs.krl.aggregates import JOINTS, POSE
from truearm.compensation.programs.new_program import NewProgram

_NAMES = ("X", "Y", "Z", "A", "B", "C")


def new_program(program: NewProgram) -> dict[str, str]:
    """Return a ``.src`` file: straight moves have their speed ($VEL.CP), for joint motions no time can be said."""
    lines = [f"DEF {program.name} ( )", *(f"  ; {line}" for line in program.comments)]
    lines += ["  $TOOL = {X 0,Y 0,Z 0,A 0,B 0,C 0}", "  $BASE = {X 0,Y 0,Z 0,A 0,B 0,C 0}", "  $ADVANCE = 3"]
    said = ""
    for row in range(len(program)):
        if program.poses is None or row == 0:
            axes = ",".join(f"A{number} {value}" for number, value in enumerate(program.axes(row, JOINTS), 1))
            lines.append(f"  PTP {{{axes}}}{' C_PTP' if program.blend(row) else ''}")
            continue
        speed = f"{program.speed(row):.4f}"
        if speed != said:
            lines.append(f"  $VEL.CP = {speed}")
            said = speed
        blend = program.blend(row) * 1e3
        if blend:
            lines.append(f"  $APO.CDIS = {blend:.3f}")
        pose = ",".join(f"{name} {value}" for name, value in zip(_NAMES, program.pose(row, POSE), strict=True))
        lines.append(f"  LIN {{{pose}}}{' C_DIS' if blend else ''}")
    return {f"{program.name}.src": "\n".join([*lines, "END", ""])}
