"""``truearm hexapod``: poses from six lengths between cups."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from truearm.cli.options import Commands
from truearm.cli.output import Json, print_json
from truearm.errors import InputError

if TYPE_CHECKING:
    from truearm.measurement.hexapod.geometry import Design
    from truearm.modeling.chain import Array
    from truearm.modeling.transform import Transform

app = Commands(
    no_args_is_help=True, help="Measure poses with one ballbar between three cups on the tool and three on the base."
)

_THREE = "MM,MM,MM"
Range = Annotated[float, typer.Option("--range", metavar="MM", min=0.0, help="What the ballbar reads about nominal.")]
RobotName = Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")]
ToolName = Annotated[
    str | None, typer.Option("--tool", metavar="NAME", help="Of the robot file.", show_default="first")
]


@app.command("enumerate")
def enumerate_(json: Json = False) -> None:
    """Count designs, assemblies and poses, and list the poses that teach much the same."""
    from truearm.measurement.hexapod.geometry import designs
    from truearm.measurement.hexapod.poses import assemblies, distinct, near_equal, poses

    found = poses()
    pairs = near_equal(found)
    counts = {
        "designs": len(designs()),
        "assemblies": len(list(assemblies())),
        "poses": len(found),
        "distinct": len(distinct(found)),
        "near_equal": [list(pair) for pair in pairs],
    }
    if json:
        print_json(counts)
        return
    typer.echo(f"{counts['designs']} designs, {counts['assemblies']} assemblies above the base")
    typer.echo(f"{counts['poses']} poses with the flange beyond the tool's plane, {counts['distinct']} distinct")
    typer.echo(f"Nearer than 30 deg and 50 mm: {', '.join(f'{a}-{b}' for a, b in pairs)}")


@app.command()
def uncertainty(
    trials: Annotated[int, typer.Option(metavar="N", min=2, help="Of the Monte Carlo.")] = 100_000,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of the Monte Carlo.")] = 0,
    json: Json = False,
) -> None:
    """Say how well the tool's cups are known, in standard deviations of one length (Nubiola, Table 3.1)."""
    import numpy as np

    from truearm.measurement.hexapod.uncertainty import all_solutions, cup_monte_carlo

    rng = np.random.default_rng(seed)
    names = ("t1", "t2", "t3")
    solutions = [
        {**dict(zip(names, u.norms, strict=True)), "t3_as_printed": float(np.linalg.norm(u.third_as_printed))}
        for u in all_solutions().values()
    ]
    drawn = [dict(zip(names, cup_monte_carlo(number, trials, rng), strict=True)) for number in all_solutions()]
    if json:
        print_json({"solutions": solutions, "monte_carlo": drawn})
        return
    typer.echo("solution     t1     t2     t3   t3 as printed   Monte Carlo: t1     t2     t3   [sigma]")
    for number, (row, again) in enumerate(zip(solutions, drawn, strict=True), 1):
        figures = "  ".join(f"{row[name]:5.3f}" for name in names)
        checks = "  ".join(f"{again[name]:5.3f}" for name in names)
        typer.echo(f"{number:8}  {figures}  {row['t3_as_printed']:14.3f}  {checks:>32}")


@app.command()
def solve(
    sheet: Annotated[
        Path | None, typer.Argument(metavar="SHEET.csv", help="A sheet of 'truearm hexapod plan', filled in.")
    ] = None,
    pose: Annotated[int | None, typer.Option(metavar="1..72", help="Without a sheet: which pose.")] = None,
    legs: Annotated[
        str | None, typer.Option(metavar="MM,..", help="Without a sheet: six lengths in the order of the pose's legs.")
    ] = None,
    base: Annotated[str, typer.Option(metavar=_THREE, help="B1-B2, B2-B3, B3-B1.")] = "300,300,300",
    tool: Annotated[str, typer.Option(metavar=_THREE, help="T1-T2, T2-T3, T3-T1.")] = "150,150,150",
    reach: Range = 1.0,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DATA.csv", help="Cups as measurements, for 'truearm calibrate'.")
    ] = None,
    json: Json = False,
) -> None:
    """Find the tool's cups from measured lengths, in the frame of the base fixture."""
    from dataclasses import replace

    from truearm.files import refuse_overwriting, writable_file, write_text
    from truearm.measurement.hexapod.geometry import DEVICE
    from truearm.measurement.hexapod.sheet import read_sheet
    from truearm.units import sized_si

    device = replace(DEVICE, reach=sized_si(reach, "mm", "--range"))
    if (sheet is None) == (legs is None) or (legs is None) != (pose is None):
        raise InputError(
            "a sheet, or a pose and its six legs, belong here", where="SHEET.csv", allowed="SHEET.csv, or --pose --legs"
        )
    if sheet is None:
        if out is not None:
            raise InputError("one pose without joint readings is no data file", where="--out", cure="Use a sheet.")
        design, solution, cups = _one_pose(pose, legs, base, tool, device)
        content: dict[str, Any] = {"poses": [_pose_entry("", design, solution, cups)], "left_out": []}
    else:
        if out is not None:
            writable_file(out)
            refuse_overwriting(out, [sheet])
        read = read_sheet(sheet, device)
        cups_of, measured = read.cups(), read.measured.tolist()
        content = {
            "poses": [_pose_entry(read.labels[r], read.designs[r], read.solutions[r], cups_of[r]) for r in measured],
            "left_out": [label for row, label in enumerate(read.labels) if row not in measured],
        }
        if out is not None:
            from truearm.measurement.readers.canonical import csv_text

            write_text(out, csv_text(read.dataset()))
    if json:
        print_json(content)
        return
    for entry in content["poses"]:
        typer.echo(f"{entry['configuration'] or 'pose'}: design {entry['design']}, solution {entry['solution']}")
        for cup, (x, y, z) in enumerate(entry["cups_mm"], 1):
            typer.echo(f"  T{cup}  x {x:.4f}  y {y:.4f}  z {z:.4f} mm")
    if content["left_out"]:
        typer.echo(f"Left out, not all legs measured: {', '.join(content['left_out'])}")
    if out is not None:
        typer.echo(f"Written to {out}")


@app.command()
def plan(
    robot: RobotName,
    fixture: Annotated[
        str,
        typer.Option(
            metavar="X,Y,Z,TURN",
            help="Base fixture in the robot's base frame: B1 \\[mm] and turn about z \\[deg], or X,Y,Z,QW,QX,QY,QZ.",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="SHEET.csv", help="Sheet to fill in.")],
    steps: Annotated[Path | None, typer.Option(metavar="STEPS.txt", help="The same step by step, to print.")] = None,
    tool: ToolName = None,
    distinct_only: Annotated[bool, typer.Option("--distinct", help="Leave out near-equal poses.")] = False,
    branches: Annotated[
        str | None, typer.Option(metavar="NAME,..", help="Only these, as front-up,back-down.", show_default="all")
    ] = None,
    arm_radius: Annotated[float, typer.Option(metavar="MM", min=0.0, help="Of the arm, for room at the bars.")] = 50.0,
    json: Json = False,
) -> None:
    """Plan which configurations of a robot can be measured with the fixture at one place."""
    from truearm.files import refuse_overwriting, writable_file, write_text
    from truearm.library import load_robot, urdf_source
    from truearm.measurement.hexapod.poses import distinct, poses
    from truearm.measurement.hexapod.sheet import sheet_csv
    from truearm.planning.hexapod.reachable import reachable
    from truearm.planning.hexapod.steps import steps_text
    from truearm.planning.hexapod.tool import with_cups
    from truearm.units import sized_si

    place = _fixture(fixture)
    for path in (out, *([] if steps is None else [steps])):
        writable_file(path)
        refuse_overwriting(path, [(urdf_source(robot) or (Path(robot), None))[0]])
    loaded, cups = with_cups(load_robot(robot), tool)
    wanted = poses(cups)
    found = reachable(
        loaded,
        place,
        distinct(wanted) if distinct_only else wanted,
        arm_radius=sized_si(arm_radius, "mm", "--arm-radius"),
        branches=() if branches is None else branches.split(","),
    )
    write_text(out, sheet_csv(found.rows, loaded.joints))
    if steps is not None:
        write_text(steps, steps_text(found, loaded))
    summary = {
        "poses": found.poses,
        "poses_reached": found.poses_reached,
        "configurations": len(found.rows),
        "left_out": dict(found.left_out),
        "smallest_room_mm": float(found.clearance.min()) * 1e3,
    }
    if json:
        print_json(summary)
        return
    typer.echo(f"{summary['poses_reached']} of {summary['poses']} poses, {summary['configurations']} configurations")
    typer.echo(f"Left out: {', '.join(f'{n} {why}' for why, n in found.left_out.items()) or 'nothing'}")
    typer.echo(f"Smallest room between arm and bars: {summary['smallest_room_mm']:.0f} mm")
    typer.echo(f"Written to {', '.join(str(path) for path in (out, steps) if path is not None)}")


@app.command("world-frame")
def world_frame(
    robot: RobotName,
    touches: Annotated[
        Path, typer.Argument(metavar="TOUCHES.csv", help="Columns cup, joint_1 \\[deg] ..; B1, B2, B3.")
    ],
    base: Annotated[str, typer.Option(metavar=_THREE, help="Measured distances B1-B2, B2-B3, B3-B1.")],
    target: Annotated[str | None, typer.Option(metavar="NAME", help="Cup of the tool that touched.")] = None,
    tool: ToolName = None,
    reach: Range = 1.0,
    json: Json = False,
) -> None:
    """Find the base fixture from the joint readings at its cups and the distances between them."""
    from dataclasses import replace

    import numpy as np

    from truearm.library import load_robot
    from truearm.measurement.hexapod.geometry import DEVICE, side_names
    from truearm.measurement.hexapod.touches import read_touches
    from truearm.measurement.hexapod.world_frame import world_frame as fitted
    from truearm.planning.hexapod.tool import with_cups
    from truearm.units import sized_si

    device = replace(DEVICE, reach=sized_si(reach, "mm", "--range"))
    loaded, _ = with_cups(load_robot(robot), tool)
    readings = read_touches(touches, loaded)
    sides = _lengths(base, 3, "--base")
    for name, side in zip(side_names("B"), sides.tolist(), strict=True):
        device.check(device.base, side, name, "--base")
    position, _ = loaded.world_poses(readings, target or loaded.targets[0].name)
    stand = loaded.base
    points = (position - np.array(stand.translation)) @ stand.rotation
    found = fitted(points, sides)
    content = {
        "position_mm": [value * 1e3 for value in found.frame.translation],
        "quaternion": list(found.frame.quaternion),
        "plain": {
            "position_mm": [value * 1e3 for value in found.plain.translation],
            "quaternion": list(found.plain.quaternion),
        },
        "distances_by_robot_mm": (found.seen * 1e3).tolist(),
        "residuals_mm": (np.linalg.norm(found.residual, axis=1) * 1e3).tolist(),
    }
    if json:
        print_json(content)
        return
    x, y, z = content["position_mm"]
    typer.echo(f"Base fixture in the robot's base frame: x {x:.4f}  y {y:.4f}  z {z:.4f} mm")
    typer.echo("  quaternion {:.8f} {:.8f} {:.8f} {:.8f}".format(*content["quaternion"]))
    seen = ", ".join(f"{n} {s:.3f}" for n, s in zip(side_names("B"), content["distances_by_robot_mm"], strict=True))
    typer.echo(f"Distances by the robot: {seen} mm")
    typer.echo("Left at the cups: {:.4f}, {:.4f}, {:.4f} mm".format(*content["residuals_mm"]))


def _one_pose(number: Any, legs: Any, base: str, tool: str, device: Any) -> tuple[Design, int, Array]:
    from truearm.measurement.hexapod.geometry import side_names
    from truearm.measurement.hexapod.kinematics import tool_cups
    from truearm.measurement.hexapod.poses import poses

    known = poses()
    if not 1 <= number <= len(known):
        raise InputError("there is no such pose", where="--pose", came=number, allowed=f"1 to {len(known)}")
    chosen = known[number - 1]
    lengths = _lengths(legs, 6, "--legs")
    sides = _lengths(base, 3, "--base"), _lengths(tool, 3, "--tool")
    for names, values, nominal, where in (
        (chosen.design.leg_names, lengths, device.leg, "--legs"),
        (side_names("B"), sides[0], device.base, "--base"),
        (side_names("T"), sides[1], device.tool, "--tool"),
    ):
        for name, value in zip(names, values.tolist(), strict=True):
            device.check(nominal, value, name, where)
    return chosen.design, chosen.solution, tool_cups(chosen.design, chosen.solution, *sides, lengths)


def _pose_entry(label: str, design: Design, solution: int, cups: Array) -> dict[str, Any]:
    return {
        "configuration": label,
        "design": design.name,
        "solution": solution,
        "legs": list(design.leg_names),
        "cups_mm": (cups * 1e3).tolist(),
    }


def _lengths(text: str, count: int, where: str) -> Array:
    import numpy as np

    from truearm.units import sized_si

    values = [sized_si(value, "mm", where) for value in _numbers(text, (count,), where, f"{count} lengths in mm")]
    return np.array(values)


def _numbers(text: str, counts: tuple[int, ...], where: str, allowed: str) -> list[float]:
    from truearm.units import as_number

    numbers = [as_number(part.strip()) for part in text.split(",")]
    known = [number for number in numbers if number is not None]
    if len(known) != len(numbers) or len(numbers) not in counts:
        raise InputError("numbers separated by commas belong here", where=where, came=text, allowed=allowed)
    return known


def _fixture(text: str) -> Transform:
    import math

    import numpy as np

    from truearm.measurement.readers.rows import unit_quaternions
    from truearm.modeling.transform import Transform
    from truearm.units import sized_si

    numbers = _numbers(text, (4, 7), "--fixture", "X,Y,Z,TURN in mm and deg, or X,Y,Z,QW,QX,QY,QZ")
    x, y, z = (sized_si(number, "mm", "--fixture") for number in numbers[:3])
    if len(numbers) == 4:
        half = sized_si(numbers[3], "deg", "--fixture") / 2
        return Transform((x, y, z), (math.cos(half), 0.0, 0.0, math.sin(half)))
    w, i, j, k = unit_quaternions(np.array([numbers[3:]]), "--fixture", [1])[0].tolist()
    return Transform((x, y, z), (w, i, j, k))
