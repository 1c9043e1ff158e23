"""``truearm lines``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from truearm.cli.loading import read_lengths
from truearm.cli.output import Json, print_json
from truearm.errors import InputError

if TYPE_CHECKING:
    from truearm.measurement.dataset import Dataset
    from truearm.modeling.robot import Robot


def lines(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="The nominal robot, as the controller knows it.")],
    centre: Annotated[str, typer.Option(metavar="X,Y,Z", help="Middle of the box in the base frame \\[mm].")],
    size: Annotated[str, typer.Option(metavar="X,Y,Z", help="Of the box \\[mm].")] = "600,800,400",
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

    from truearm.compensation.inverse_errors import fake_targets
    from truearm.files import writable_file, write_text
    from truearm.jobs.load_data import load_data
    from truearm.library import load_robot
    from truearm.planning.poses.seven_lines import readings, seven_lines
    from truearm.simulation.truths import truth_twin
    from truearm.units import from_si, sized_si
    from truearm.validation.line_test import from_data, on_twin, summary

    if truth is not None and data is not None:
        raise InputError("only one of them can be judged", where="--truth, --data", cure="Leave one out.")
    if out is not None:
        writable_file(out)
    sigma = sized_si(noise, "mm", "--noise", deviation=True) if noise else 0.0
    nominal = load_robot(robot)
    errors = None if model is None else load_robot(model)
    plan = seven_lines(read_lengths(centre, "--centre", 3), read_lengths(size, "--size", 3))
    joints = plan.joints(nominal)
    commanded = joints
    if errors is not None:
        _check_design(nominal, errors)
        commanded = readings(fake_targets(errors, joints).solutions, plan.labels, "compensated line test")
    content: dict[str, Any] = {"poses": len(plan.labels), "lines": []}
    if truth is not None:
        rng = np.random.default_rng(seed)
        twin = truth_twin(nominal, truth, rng)
        before = on_twin(plan, twin, joints, sigma, repeats, rng)
        after = None if errors is None else on_twin(plan, twin, commanded, sigma, repeats, rng)
        content = summary(before, after)
    elif data is not None:
        measured = load_data(data)
        content = summary(from_data(plan, _standing(nominal, errors, measured), measured), None)
    if out is not None:
        heading = ["configuration", *(f"joint_{i} [deg]" for i in range(1, joints.shape[1] + 1))]
        rows = [
            [label, *(repr(from_si(reading, "deg")) for reading in row)]
            for label, row in zip(plan.labels, commanded.tolist(), strict=True)
        ]
        write_text(out, "\n".join(",".join(row) for row in [heading, *rows]) + "\n")
    if json:
        print_json(content)
        return
    _print_lines(content)
    if not content["lines"]:
        typer.echo(f"The robot can go to all {len(plan.labels)} poses.")
    if out is not None:
        said = "compensated" if errors is not None else "nominal"
        typer.echo(f"{out}: {len(plan.labels)} configurations, {said} readings.")


def _print_lines(content: dict[str, Any]) -> None:
    for line in content["lines"]:
        text = f"{line['direction']:<4} mean {line['before_mm']['mean']:.3f}  max {line['before_mm']['max']:.3f} mm"
        if "after_mm" in line:
            after = line["after_mm"]
            text += (
                f"   compensated mean {after['mean']:.3f}  max {after['max']:.3f} mm"
                f"   max reduced by {line['reduction_percent']:.1f} %"
            )
        typer.echo(text)


def _standing(nominal: Robot, errors: Robot | None, data: Dataset) -> Robot:
    """Return a robot that says where the base and the targets are: one of those given, or placed by the data."""
    from truearm.identification.solving.fit import place

    for robot in (errors, nominal):
        if robot is not None and set(data.targets) <= {target.name for target in robot.targets}:
            return robot
    return place(nominal, data).robot


def _check_design(nominal: Robot, errors: Robot) -> None:
    """Refuse joint errors of another robot."""
    import numpy as np

    from truearm.compensation.inverse_errors import design
    from truearm.modeling.transform import IDENTITY

    plain = design(errors)
    q = nominal.random_configurations(5, np.random.default_rng(0))
    if len(plain.joints) == len(nominal.joints):
        apart = np.abs(plain.world_poses(q)[0] - nominal.with_frames(IDENTITY, {}).world_poses(q)[0]).max()
        if apart < 1e-6:
            return
    raise InputError(
        f"these joint errors belong to another robot than {nominal.name}",
        where="--model",
        came=errors.name,
        cure="Give the robot that 'truearm axes' was given.",
    )
