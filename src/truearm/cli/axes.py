"""``truearm axes``, ``tolerance`` and ``lines``: joints turned one at a time, and what follows from their axes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from truearm.cli.output import Json, print_json, progress
from truearm.errors import InputError

if TYPE_CHECKING:
    from truearm.modeling.robot import Robot


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

    from truearm.calibration import load_data
    from truearm.files import refuse_overwriting, writable_folder, write_files
    from truearm.identification.axis_analysis import analyse
    from truearm.robots import load_robot, urdf_source

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
    from truearm.modeling.conversion import converted
    from truearm.modeling.tolerances import checked_depth, flange_error, joint_tolerances
    from truearm.robots import load_robot

    loaded = load_robot(robot)
    count = len(loaded.joints)
    depths = [checked_depth(d) for d in _lengths(depth, "--depth", count)]
    if lean is None and position is None:
        design(loaded)  # refuses robots without joint errors
        rows = [
            {
                "joint": number,
                "depth_mm": d * 1e3,
                "lean_mm": t.delta * 1e3,
                "towards_deg": math.degrees(t.towards),
                "position_mm": [v * 1e3 for v in t.position],
            }
            for number, (d, t) in enumerate(zip(depths, joint_tolerances(loaded, depths), strict=True), 1)
        ]
        if json:
            print_json({"robot": loaded.name, "joints": rows})
            return
        typer.echo("joint  depth [mm]  lean [mm]  towards [deg]  position x, y, z [mm]")
        for r in rows:
            x, y, z = r["position_mm"]  # type: ignore[misc]
            typer.echo(
                f"{r['joint']:<6} {r['depth_mm']:<11.1f} {r['lean_mm']:<10.4f} {r['towards_deg']:<14.1f} "
                f"{x:.4f}, {y:.4f}, {z:.4f}"
            )
        return
    leans = _lengths(lean or "0", "--lean", count)
    positions = _lengths(position or "0", "--position", count)
    for where, given in (("--lean", leans), ("--position", positions)):
        if min(given) < 0.0:
            raise InputError("a tolerance cannot be negative", where=where, came=f"{min(given) * 1e3:g} mm")
    errors = loaded if loaded.convention_name == "joint-errors" else converted(loaded, "joint-errors")
    q = loaded.random_configurations(2000, np.random.default_rng(0))
    found = flange_error(errors, [a / d for a, d in zip(leans, depths, strict=True)], positions, q)
    together = {"worst_mm": found.together[0] * 1e3, "root_of_squares_mm": found.together[1] * 1e3}
    each = [
        {"joint": i, "by_lean_mm": float(a) * 1e3, "by_position_mm": float(b) * 1e3}
        for i, (a, b) in enumerate(zip(found.leaning, found.position, strict=True), 1)
    ]
    if json:
        print_json({"robot": loaded.name, "configurations": len(q), "joints": each, "together": together})
        return
    typer.echo("Largest error of the flange's position over 2000 configurations:")
    for e in each:
        typer.echo(f"  joint {e['joint']}: {e['by_lean_mm']:.4f} mm by leaning, {e['by_position_mm']:.4f} mm by place")
    typer.echo(
        f"  all at their worst {together['worst_mm']:.3f} mm, in the root of squares {found.together[1] * 1e3:.3f} mm"
    )


def lines(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="The nominal robot, as the controller knows it.")],
    centre: Annotated[str, typer.Option(metavar="X,Y,Z", help="Middle of the box in the base frame [mm].")],
    size: Annotated[str, typer.Option(metavar="X,Y,Z", help="Of the box [mm].")] = "600,800,400",
    model: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="joint-errors.yaml to compensate with.", show_default=False),
    ] = None,
    truth: Annotated[
        str | None,
        typer.Option(metavar="NAME|FILE", help="Try it on this twin, as in 'truearm simulate'.", show_default=False),
    ] = None,
    data: Annotated[
        str | None,
        typer.Option(metavar="DATA.csv", help="Measured, configurations named x-1 to xyz-11.", show_default=False),
    ] = None,
    noise: Annotated[float, typer.Option(metavar="MM", min=0.0, help="Of a coordinate of a repetition.")] = 0.0,
    repeats: Annotated[int, typer.Option(metavar="N", min=1, help="Repetitions on the twin.")] = 30,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of the noise.")] = 0,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="PLAN.csv", help="Write the readings to command.")
    ] = None,
    json: Json = False,
) -> None:
    """Test a robot along seven directions of a box, and compensate it off-line through its joint errors."""
    import numpy as np

    from truearm.calibration import load_data
    from truearm.compensation.inverse_errors import fake_targets
    from truearm.compensation.line_test import from_data, on_twin, summary
    from truearm.files import writable_file, write_text
    from truearm.measurement.truths import truth_twin
    from truearm.planning.seven_lines import readings, seven_lines
    from truearm.robots import load_robot
    from truearm.units import from_si

    if truth is not None and data is not None:
        raise InputError("only one of them can be judged", where="--truth, --data", cure="Leave one out.")
    if out is not None:
        writable_file(out)
    nominal = load_robot(robot)
    errors = None if model is None else load_robot(model)
    plan = seven_lines(_lengths(centre, "--centre", 3), _lengths(size, "--size", 3))
    joints = plan.joints(nominal)
    commanded = joints
    if errors is not None:
        _check_design(nominal, errors)
        commanded = readings(fake_targets(errors, joints).solutions, plan.labels, "compensated line test")
    content: dict[str, Any] = {"poses": len(plan.labels)}
    if truth is not None:
        rng = np.random.default_rng(seed)
        twin = truth_twin(nominal, truth, rng)
        before = on_twin(plan, twin, joints, noise / 1e3, repeats, rng)
        after = None if errors is None else on_twin(plan, twin, commanded, noise / 1e3, repeats, rng)
        content = summary(before, after)
    elif data is not None:
        from truearm.identification.fit import place

        measured = load_data(data)
        stands = (
            nominal if set(measured.targets) <= {t.name for t in nominal.targets} else place(nominal, measured).robot
        )
        content = summary(from_data(plan, stands, measured), None)
    if out is not None:
        units = ["deg"] * joints.shape[1]
        heading = ["configuration", *(f"joint_{i} [{u}]" for i, u in enumerate(units, 1))]
        rows = [
            [label, *(repr(from_si(v, u)) for v, u in zip(row, units, strict=True))]
            for label, row in zip(plan.labels, commanded.tolist(), strict=True)
        ]
        write_text(out, "\n".join(",".join(row) for row in [heading, *rows]) + "\n")
    if json:
        print_json(content)
        return
    _print_lines(content)
    if out is not None:
        said = "compensated" if errors is not None else "nominal"
        typer.echo(f"{out}: {len(plan.labels)} configurations, {said} readings.")


def _print_lines(content: dict[str, Any]) -> None:
    for line in content.get("lines", ()):
        text = f"{line['direction']:<4} mean {line['before_mm']['mean']:.3f}  max {line['before_mm']['max']:.3f} mm"
        if "after_mm" in line:
            after = line["after_mm"]
            text += (
                f"   compensated mean {after['mean']:.3f}  max {after['max']:.3f} mm"
                f"   max reduced by {line['reduction_percent']:.1f} %"
            )
        typer.echo(text)


def _check_design(nominal: Robot, errors: Robot) -> None:
    """Refuse joint errors of another robot."""
    import numpy as np

    from truearm.compensation.inverse_errors import design

    plain = design(errors)
    q = nominal.random_configurations(5, np.random.default_rng(0))
    if len(plain.joints) == len(nominal.joints):
        from truearm.modeling.transform import IDENTITY

        apart = np.abs(plain.poses(q)[0] - nominal.with_frames(IDENTITY, {}).poses(q)[0]).max()
        if apart < 1e-6:
            return
    raise InputError(
        f"these joint errors belong to another robot than {nominal.name}",
        where="--model",
        came=errors.name,
        cure="Give the robot that 'truearm axes' was given.",
    )


def _lengths(text: str, where: str, count: int) -> list[float]:
    """Return `count` lengths [m] of a text in mm; one number stands for all."""
    from truearm.units import as_number, sized_si

    numbers = [as_number(part.strip()) for part in text.split(",")]
    if None in numbers or len(numbers) not in (1, count):
        raise InputError(
            "numbers separated by commas belong here", where=where, came=text, allowed=f"{count} numbers in mm"
        )
    found = [sized_si(number, "mm", where) for number in numbers if number is not None]
    return found * count if len(found) == 1 else found
