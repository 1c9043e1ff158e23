"""New RAPID modules."""

from __future__ import annotations

import math

from truearm.compensation.programs.new_program import NewProgram
from truearm.compensation.programs.new_targets import NewTargets
from truearm.compensation.programs.rapid.data import JOINTTARGET, ROBTARGET

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
