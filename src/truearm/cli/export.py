"""``truearm export``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.output import Json, print_json


def export(
    robot: Annotated[
        str, typer.Argument(metavar="CALIBRATED.yaml", help="A robot file, calibrated or not, a library id or a URDF.")
    ],
    format_: Annotated[
        str,
        typer.Option(
            "--format",
            metavar="dh|mdh|hayati|urdf|json|python",
            help="A standard DH, modified DH or Hayati table (CSV), a URDF, everything as JSON, or a Python file for "
            "forward and inverse kinematics that needs only NumPy.",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="File to write; nothing is overwritten.")],
    json: Json = False,
) -> None:
    """Write a robot for other programs, and say what the format cannot hold."""
    from truearm.files import write_new_text
    from truearm.library import load_robot
    from truearm.modeling.formats.export import exported

    loaded = load_robot(robot)
    made = exported(loaded, format_)
    write_new_text(out, made.text)
    if json:
        warnings = [{"code": "left-out", "message": message} for message in made.left_out]
        print_json({"file": str(out), "format": format_, "frames": made.frames, "warnings": warnings})
        return
    typer.echo(f"{out}: {loaded.name} as {format_}. {made.frames}")
    for message in made.left_out:
        typer.echo(message, err=True)
