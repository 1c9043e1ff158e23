"""New URScript programs."""

from __future__ import annotations

from truearm.compensation.programs.new_program import NewProgram
from truearm.compensation.programs.urscript.program import JOINTS, POSE


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
