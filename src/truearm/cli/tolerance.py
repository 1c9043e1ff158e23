"""``truearm tolerance``."""

from __future__ import annotations

from typing import Annotated

import typer

from truearm.cli.loading import read_lengths
from truearm.cli.output import Json, print_json
from truearm.errors import InputError


def tolerance(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A robot with joint errors, as 'axes' writes it.")],
    depth: Annotated[str, typer.Option(metavar="MM[,MM..]", help="Depth of each joint's hole, or of all.")],
    lean: Annotated[
        str | None,
        typer.Option(metavar="MM[,MM..]", help="Perpendicularity or parallelism that is allowed.", show_default=False),
    ] = None,
    position: Annotated[
        str | None,
        typer.Option(metavar="MM[,MM..]", help="Radius about its place that a joint may have.", show_default=False),
    ] = None,
    json: Json = False,
) -> None:
    """Say what joint errors use of their tolerances, or what tolerances may do at the flange.

    With --lean or --position the largest flange error that they allow, else the tolerances of the robot's own errors.
    """
    import math

    import numpy as np

    from truearm.compensation.inverse_errors import design
    from truearm.library import load_robot
    from truearm.modeling.conversion import converted
    from truearm.validation.tolerances import checked_depth, errors_of_tolerance, flange_error, joint_tolerances

    loaded = load_robot(robot)
    count = len(loaded.joints)
    depths = [checked_depth(d) for d in read_lengths(depth, "--depth", count)]
    if lean is None and position is None:
        design(loaded)  # refuses robots without joint errors
        used = joint_tolerances(loaded, depths)
        rows = [
            {
                "joint": number,
                "depth_mm": d * 1e3,
                "lean_mm": t.delta * 1e3,
                "towards_deg": math.degrees(t.towards),
                "position_mm": [v * 1e3 for v in t.position],
            }
            for number, (d, t) in enumerate(zip(depths, used, strict=True), 1)
        ]
        if json:
            print_json({"robot": loaded.name, "joints": rows})
            return
        typer.echo("joint  depth [mm]  lean [mm]  towards [deg]  position x, y, z [mm]")
        for number, (d, t) in enumerate(zip(depths, used, strict=True), 1):
            place = ", ".join(f"{v * 1e3:.4f}" for v in t.position)
            typer.echo(f"{number:<6} {d * 1e3:<11.1f} {t.delta * 1e3:<10.4f} {math.degrees(t.towards):<14.1f} {place}")
        return
    leans = read_lengths(lean or "0", "--lean", count)
    positions = read_lengths(position or "0", "--position", count)
    for where, given in (("--lean", leans), ("--position", positions)):
        if min(given) < 0.0:
            raise InputError("a tolerance cannot be negative", where=where, came=f"{min(given) * 1e3:g} mm")
    errors = loaded if loaded.convention_name == "joint-errors" else converted(loaded, "joint-errors")
    q = loaded.random_configurations(2000, np.random.default_rng(0))
    angles = [errors_of_tolerance(a, 0.0, d)[0] for a, d in zip(leans, depths, strict=True)]
    found = flange_error(errors, angles, positions, q)
    together = {"worst_mm": found.together[0] * 1e3, "root_of_squares_mm": found.together[1] * 1e3}
    each = [
        {"joint": i, "angle_deg": math.degrees(t), "by_lean_mm": float(a) * 1e3, "by_position_mm": float(b) * 1e3}
        for i, (t, a, b) in enumerate(zip(angles, found.leaning, found.position, strict=True), 1)
    ]
    if json:
        print_json({"robot": loaded.name, "configurations": len(q), "joints": each, "together": together})
        return
    typer.echo("Largest error of the flange's position over 2000 configurations:")
    for e in each:
        typer.echo(
            f"  joint {e['joint']}: {e['by_lean_mm']:.4f} mm by leaning {e['angle_deg']:.4f} deg,"
            f" {e['by_position_mm']:.4f} mm by place"
        )
    worst, root = together.values()
    typer.echo(f"  all at their worst {worst:.3f} mm, root of the sum of squares {root:.3f} mm")
