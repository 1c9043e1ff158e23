"""``truearm ik``."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from truearm.cli.loading import GravityText, PayloadText, read_gravity, read_payload
from truearm.cli.output import Json, print_json
from truearm.errors import InputError

if TYPE_CHECKING:
    from truearm.modeling.inverse.solutions import JointSolutions
    from truearm.modeling.robot import Robot

#: Poses explained one by one where a person reads.
_EXPLAINED = 10


def ik(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    poses: Annotated[
        Path, typer.Argument(metavar="POSES.csv", help="Columns pose, x \\[mm], y \\[mm], z \\[mm], qw, qx, qy, qz.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="JOINTS.csv", help="File to write.")],
    branch: Annotated[
        str | None,
        typer.Option(
            metavar="LABEL|all", help="A branch, as front-up-noflip, or all.", show_default="nearest to the seed"
        ),
    ] = None,
    seed_joints: Annotated[
        str | None,
        typer.Option(metavar="DEG,DEG,..", help="Readings to stay near to (mm if sliding).", show_default="zeros"),
    ] = None,
    target: Annotated[
        str | None, typer.Option(metavar="NAME", help="What goes to the poses.", show_default="the flange")
    ] = None,
    frame: Annotated[
        str, typer.Option(metavar="base|world", help="What the poses are given in: the robot's base, or the world.")
    ] = "base",
    position_only: Annotated[bool, typer.Option("--position-only", help="Leave the orientation free.")] = False,
    axis_only: Annotated[
        bool, typer.Option("--axis-only", help="Keep the z axis alone, free to turn about it.")
    ] = False,
    payload: PayloadText = None,
    gravity: GravityText = None,
    json: Json = False,
) -> None:
    """Find the joint readings that bring a robot to poses, with its calibration and joint effects."""
    from truearm.files import writable_folder, write_text
    from truearm.library import load_robot
    from truearm.measurement.readers.poses import read_poses
    from truearm.modeling.formats.joint_table import joints_csv
    from truearm.modeling.inverse import inverse
    from truearm.modeling.transform import rotation_from_quaternion

    writable_folder(out.parent)
    if position_only and axis_only:
        raise InputError("only one of them can hold", where="--position-only, --axis-only", cure="Leave one out.")
    loaded = load_robot(robot).with_payload(read_payload(payload), read_gravity(gravity))
    wanted = read_poses(poses)
    if wanted.quaternion is None and not position_only:
        raise InputError(
            "the poses have no orientation",
            where=str(poses),
            allowed="the columns qw, qx, qy, qz",
            cure="Add them, or say --position-only.",
        )
    solutions = inverse(
        loaded,
        wanted.position,
        None if wanted.quaternion is None else rotation_from_quaternion(wanted.quaternion),
        target=target,
        frame=frame,  # type: ignore[arg-type]
        branch=branch,
        seed=_seed(loaded, seed_joints),
        orientation="free" if position_only else "axis" if axis_only else "full",
    )
    write_text(out, joints_csv(solutions, wanted.labels, loaded.joints))
    summary = _summary(solutions, wanted.labels)
    if json:
        print_json(summary)
    else:
        _print(summary, out)
    if not solutions.complete:
        raise typer.Exit(3)


def _seed(robot: Robot, text: str | None) -> list[float] | None:
    from truearm.units import to_si

    if text is None:
        return None
    units = ["deg" if joint.kind == "revolute" else "mm" for joint in robot.joints]
    parts = text.split(",")
    try:
        values = [float(part) for part in parts]
    except ValueError:
        raise InputError(
            "numbers separated by commas belong here", where="--seed-joints", came=text, allowed="0,-30,45, .."
        ) from None
    if len(values) != len(units):
        raise InputError(
            "the seed has the wrong length",
            where="--seed-joints",
            came=f"{len(values)} numbers",
            allowed=f"{len(units)}, one for each joint of {robot.name}",
        )
    return [to_si(value, unit) for value, unit in zip(values, units, strict=True)]


def _summary(solutions: JointSolutions, labels: tuple[str, ...]) -> dict[str, Any]:
    """Return counts by status, and in words every pose that the robot cannot or should not just go to."""
    usable = {int(p) for p, status in zip(solutions.pose, solutions.status, strict=True) if status.usable}
    explained = [
        {
            "pose": labels[pose],
            "branch": solutions.branch[row],
            "status": status.value,
            "advice": solutions.advice(row),
        }
        for row, (pose, status) in enumerate(zip(solutions.pose.tolist(), solutions.status, strict=True))
        if status.value != "reached" and (status.usable or pose not in usable)
    ]
    return {
        "poses": solutions.poses,
        "poses_reached": len(usable),
        "rows": len(solutions.status),
        "status": dict(Counter(status.value for status in solutions.status)),
        "attention": explained,
    }


def _print(summary: dict[str, Any], out: Path) -> None:
    counts = ", ".join(f"{count} {status}" for status, count in summary["status"].items())
    typer.echo(f"{summary['poses_reached']} of {summary['poses']} poses reached. Rows: {counts}")
    for entry in summary["attention"][:_EXPLAINED]:
        name = f"{entry['pose']} ({entry['branch']})" if entry["branch"] else entry["pose"]
        typer.echo(f"  {name}: {entry['status']}. {entry['advice']}")
    if len(summary["attention"]) > _EXPLAINED:
        typer.echo(f"  and {len(summary['attention']) - _EXPLAINED} more; --json lists all")
    typer.echo(f"Written to {out}")
