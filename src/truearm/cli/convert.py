"""``truearm convert``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.output import print_record


def convert(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    convention: Annotated[str, typer.Option(metavar="NAME", help="The kinematic convention to write it in.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Robot file to write; nothing is overwritten.")],
) -> None:
    """Write a robot in another kinematic convention, every pose the same."""
    from truearm.jobs.convert import convert as run

    print_record(run(robot, convention, out=out))
