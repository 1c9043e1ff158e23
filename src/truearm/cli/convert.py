"""``truearm convert``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def convert(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    convention: Annotated[str, typer.Option(metavar="NAME", help="The kinematic convention to write it in.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Robot file to write; nothing is overwritten.")],
) -> None:
    """Write a robot in another kinematic convention, every pose the same."""
    from truearm.files import write_new_text
    from truearm.library import load_robot
    from truearm.modeling.conversion import converted
    from truearm.modeling.formats.robot_file import robot_text

    made = converted(load_robot(robot), convention)
    write_new_text(out, robot_text(made))
    typer.echo(f"{out}: {made.name}, {made.history[-1]}.")
