"""``truearm iso9283``: tests of a robot's performance by the criteria of ISO 9283."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.options import Commands, command_line
from truearm.cli.output import print_record

app = Commands(no_args_is_help=True, help="Test a robot's performance by the criteria of ISO 9283.")


@app.command()
def simulate(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="The robot that the plan was made for.")],
    plan: Annotated[Path, typer.Option(metavar="PLAN.yaml", help="Of 'truearm iso9283 plan'.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for what is read.")],
    truth: Annotated[
        str, typer.Option(metavar="NAME|FILE", help="What the robot truly is, as in 'truearm simulate'.")
    ] = "random",
    noise: Annotated[float, typer.Option(metavar="MM", min=0.0, help="Standard deviation of a coordinate.")] = 0.01,
    noise_rot: Annotated[
        float, typer.Option("--noise-rot", metavar="DEG", min=0.0, help="Standard deviation of an angle.")
    ] = 0.005,
    rate: Annotated[float, typer.Option(metavar="HZ", help="Readings in a second, 10 to 2000.")] = 500.0,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of all that is drawn.")] = 0,
    corrected: Annotated[
        str | None,
        typer.Option(metavar="ROBOT", help="Correct commands by this calibrated robot.", show_default=False),
    ] = None,
) -> None:
    """Run the tests of a plan on a twin that moves, and read it with a simulated instrument."""
    from truearm.cli.output import progress
    from truearm.jobs.iso9283_simulate import iso9283_simulate
    from truearm.units import sized_si

    with progress() as say:
        found = iso9283_simulate(
            robot,
            plan,
            truth=truth,
            noise=sized_si(noise, "mm", parameter="noise", deviation=True) if noise else 0.0,
            noise_rot=sized_si(noise_rot, "deg", parameter="noise_rot", deviation=True) if noise_rot else 0.0,
            rate=rate,
            seed=seed,
            corrected=corrected,
            out=out,
            command=command_line(),
            progress=say,
        )
    print_record(found)
