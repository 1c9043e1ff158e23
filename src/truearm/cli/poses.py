"""``truearm poses``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from truearm.cli.cubes import Ahead, Floor, Nearest, TargetName, TipText
from truearm.cli.loading import JointsText
from truearm.cli.options import command_line
from truearm.cli.output import Json, end_on_error, print_json, print_line, print_record
from truearm.jobs.texts import read_lengths, read_numbers


def poses(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    set: Annotated[str, typer.Option("--set", metavar="NAME", help="p1-p5, iso-cube, diagonal, 118 or sphere.")],
    out: Annotated[
        Path, typer.Option("--out", metavar="SET.csv", help="File to write, with SET-poses.csv and SET.html beside it.")
    ],
    centre: Annotated[
        str | None,
        typer.Option(metavar="X,Y,Z", help="Of the cube in the base frame \\[mm].", show_default="the largest cube"),
    ] = None,
    side: Annotated[
        float | None,
        typer.Option(metavar="MM", help="Of the cube; the diameter of the sphere.", show_default="the largest cube"),
    ] = None,
    ahead: Ahead = "+x",
    nearest: Nearest = 0.0,
    floor: Floor = 0.0,
    plane: Annotated[str, typer.Option(metavar="CORNERS", help="Diagonal plane, for sets on one.")] = "C1-C2-C7-C8",
    count: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Poses of diagonal, 118 and sphere.", show_default="25, 118 and 50"),
    ] = None,
    target: TargetName = None,
    tip: TipText = None,
    orientation: Annotated[
        str, typer.Option(metavar="free|down|QW,QX,QY,QZ", help="Of the tip in the base frame.")
    ] = "free",
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of poses in any orientation.")] = 0,
    joints: JointsText = None,
    json: Json = False,
) -> None:
    """Write a set of poses: those of ISO 9283 in a cube, or those of a ballbar on a sphere.

    SET.csv has their joint positions, and room for readings; SET-poses.csv has the poses, for truearm ik.
    """
    from truearm.jobs.poses import poses as run
    from truearm.results.pose_set import PAGE, POSES
    from truearm.units import sized_si

    found = run(
        robot,
        set,
        centre=None if centre is None else read_lengths(centre, "centre"),  # type: ignore[arg-type]
        side=None if side is None else sized_si(side, "mm", parameter="side"),
        ahead=ahead,  # type: ignore[arg-type]
        nearest=sized_si(nearest, "mm", parameter="nearest"),
        floor=sized_si(floor, "mm", parameter="floor"),
        plane=plane,
        count=count,
        target=target,
        tip=None if tip is None else read_lengths(tip, "tip"),  # type: ignore[arg-type]
        orientation=_orientation(orientation),
        seed=seed,
        joints=joints,  # type: ignore[arg-type]
        out=out,
        command=command_line(),
    )
    if json:
        print_json(found.summary())
    else:
        print_record(found)
        print_line(f"Written: {out}, {out.with_name(out.stem + POSES)}, {out.with_suffix(PAGE)}")
    end_on_error(found.warnings)


def _orientation(text: str) -> Any:
    """Return numbers where the text has them; the job refuses what is neither these nor a name."""
    return read_numbers(text, "orientation", "free, down, or a quaternion w,x,y,z") if "," in text else text
