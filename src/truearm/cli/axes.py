"""``truearm axes``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from truearm.cli.output import Json, print_json, progress
from truearm.errors import InputError


def axes(
    data: Annotated[str, typer.Argument(metavar="DATA.csv", help="Measurements in which one joint moves at a time.")],
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")],
    frame: Annotated[
        str,
        typer.Option(
            metavar="instrument|robot",
            help="What the data are given in: the instrument's frame, or the robot's base frame, set up before.",
        ),
    ] = "instrument",
    json: Json = False,
) -> None:
    """Find a robot's axes from circles, and with them its frames, parameters and joint errors.

    Writes calibrated.yaml, joint-errors.yaml and axes.json into DIR.
    """
    import json as text

    from truearm.files import refuse_overwriting, writable_folder, write_files
    from truearm.identification.axes.analysis import analyse
    from truearm.jobs.load_data import load_data
    from truearm.library import load_robot, urdf_source

    if frame not in ("instrument", "robot"):
        raise InputError("there is no such frame", where="--frame", came=frame, allowed="instrument, robot")
    writable_folder(out)
    source = urdf_source(robot)
    for name in ("calibrated.yaml", "joint-errors.yaml", "axes.json"):
        refuse_overwriting(out / name, [Path(robot) if source is None else source[0], Path(data)])
    with progress() as say:
        say("fitting circles and axes")
        found = analyse(load_robot(robot), load_data(data), in_robot_frame=frame == "robot")
        summary = found.summary()
        write_files(out, found.files(text.dumps(summary, indent=2, allow_nan=False) + "\n"))
    if json:
        print_json(summary)
        return
    _print_axes(summary)
    typer.echo(f"Written to {out}: calibrated.yaml, joint-errors.yaml, axes.json")


def _print_axes(summary: dict[str, Any]) -> None:
    typer.echo("joint  target  points   arc [deg]  radius [mm]  axis +/- [mm]  [mrad]  tangential [mm]  backlash [deg]")
    for c in summary["circles"]:
        lag = "" if c["backlash_deg"] is None else f"{c['backlash_deg']:.4f}"
        typer.echo(
            f"{c['joint']:<6} {c['target']:<7} {c['points']:<8} {c['arc_deg']:<10.1f} {c['radius_mm']:<12.3f} "
            f"{c['centre_deviation_mm']:<14.4f} {c['direction_deviation_mrad']:<7.3f} "
            f"{c['tangential_range_mm']:<16.4f} {lag}".rstrip()
        )
    errors = summary["joint_errors"]
    typer.echo(f"Joint errors: {len(errors['found'])} found, in 95 % intervals:")
    for e in errors["found"]:
        typer.echo(
            f"  {e['is']:<24} {e['value']:9.4f} {e['unit']:<4} {e['interval'][0]:9.4f} to {e['interval'][1]:.4f}"
        )
    typer.echo("Held at nominal, because circles do not see by themselves:")
    for e in errors["unseen"]:
        moves = " (moves the flange)" if e["moves_flange"] else ""
        typer.echo(f"  {e['combination']}{moves}")
    for warning in summary["warnings"]:
        typer.echo(f"Warning ({warning['code']}): {warning['message']}")
