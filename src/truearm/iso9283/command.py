"""``truearm iso9283``: tests of a robot's performance."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.engine.command.options import (
    Ahead,
    Commands,
    Floor,
    Json,
    Nearest,
    TargetName,
    TipText,
    command_line,
    end_on_error,
    print_json,
    print_line,
    print_record,
    progress,
)
from truearm.engine.command.texts import read_lengths, read_numbers

_PERCENT = "percent, as 100,50,10"

app = Commands(no_args_is_help=True, help="Test a robot by the criteria of ISO 9283: plan, simulate, evaluate.")


@app.command()
def plan(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for plan.yaml, robot.yaml and sheet.html.")],
    criteria: Annotated[str, typer.Option(metavar="ID,..|all", help="As ap,rp,at.")] = "all",
    cube: Annotated[str, typer.Option(metavar="auto|FILE", help="The largest one, or a file with one.")] = "auto",
    plane: Annotated[str, typer.Option(metavar="CORNERS", help="Diagonal plane of the cube.")] = "C1-C2-C7-C8",
    target: TargetName = None,
    tip: TipText = None,
    load: Annotated[
        float | None, typer.Option(metavar="KG", help="Rated load.", show_default="that of the robot file")
    ] = None,
    velocity: Annotated[
        float | None, typer.Option(metavar="MM/S", help="Rated velocity along a path.", show_default="1000")
    ] = None,
    velocities: Annotated[str, typer.Option(metavar="%,..", help="Percent of the rated velocity.")] = "100,50,10",
    loads: Annotated[str, typer.Option(metavar="%,..", help="Percent of the rated load.")] = "100",
    limit_band: Annotated[float, typer.Option(metavar="MM", help="Within which the tip is said to stand.")] = 0.1,
    hours: Annotated[float, typer.Option(metavar="H", help="How long the drift is watched.")] = 8.0,
    ahead: Ahead = "+x",
    nearest: Nearest = 0.0,
    floor: Floor = 0.0,
    constraints: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="What stands in the cell, as for 'truearm plan': ways keep clear.", show_default=False
        ),
    ] = None,
    clearance: Annotated[
        float | None,
        typer.Option(metavar="MM", help="Room that ways keep to floor, boxes, links.", show_default="not kept, or 50"),
    ] = None,
    program: Annotated[
        str | None,
        typer.Option(
            metavar="rapid|krl|fanuc|urscript|inform|val3",
            help="Write measuring programs in this language.",
            show_default=False,
        ),
    ] = None,
    dwell: Annotated[float, typer.Option(metavar="S", help="How long they stand where it is measured.")] = 2.0,
    slow_run: Annotated[
        Path | None,
        typer.Option(
            "--slow-run", metavar="FILE", help="slow-run.yaml, completed: writes the faster ones.", show_default=False
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Plan the tests: poses and paths in the cube, cycles, velocities, loads, and a sheet for the operator."""
    from truearm.engine.base.units import sized_si
    from truearm.iso9283.plan.plan import iso9283_plan

    found = iso9283_plan(
        robot,
        criteria=[part.strip() for part in criteria.split(",")],
        cube=cube,
        plane=plane,
        target=target,
        tip=None if tip is None else read_lengths(tip, "tip"),  # type: ignore[arg-type]
        load=load,
        velocity=None if velocity is None else sized_si(velocity, "mm", parameter="velocity"),
        velocities=read_numbers(velocities, "velocities", _PERCENT),
        loads=read_numbers(loads, "loads", _PERCENT),
        limit_band=sized_si(limit_band, "mm", parameter="limit_band"),
        hours=hours,
        ahead=ahead,  # type: ignore[arg-type]
        nearest=sized_si(nearest, "mm", parameter="nearest"),
        floor=sized_si(floor, "mm", parameter="floor"),
        constraints=constraints,
        clearance=None if clearance is None else sized_si(clearance, "mm", parameter="clearance"),
        program=program,
        dwell=dwell,
        slow_run=slow_run,
        out=out,
        command=command_line(),
    )
    if json:
        print_json(found.summary())
    else:
        print_record(found)
        print_line(f"Written to {out}: {', '.join(found.files())}")
    end_on_error(found.warnings)


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
        str | None, typer.Option(metavar="ROBOT", help="Correct commands by this calibrated robot.", show_default=False)
    ] = None,
) -> None:
    """Run the tests of a plan on a twin that moves, and read it with a simulated instrument."""
    from truearm.engine.base.units import sized_si
    from truearm.iso9283.simulate.simulate import iso9283_simulate

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


@app.command()
def evaluate(
    plan: Annotated[Path, typer.Argument(metavar="PLAN.yaml", help="Of 'truearm iso9283 plan'.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for iso9283.json and report.html.")],
    poses: Annotated[Path | None, typer.Option(metavar="CSV", help="Attained poses.", show_default=False)] = None,
    paths: Annotated[Path | None, typer.Option(metavar="CSV", help="Samples along paths.", show_default=False)] = None,
    settling: Annotated[
        Path | None, typer.Option(metavar="CSV", help="Samples on the way to a pose.", show_default=False)
    ] = None,
    forces: Annotated[
        Path | None, typer.Option(metavar="CSV", help="The tip under forces.", show_default=False)
    ] = None,
    alignment: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="How the instrument was tied to the base.", show_default="best fit, with a warning"
        ),
    ] = None,
    noise: Annotated[float, typer.Option(metavar="MM", help="Of the instrument, of a coordinate.")] = 0.01,
    noise_rot: Annotated[float, typer.Option(metavar="DEG", help="Of the instrument, of an angle.")] = 0.005,
    compare: Annotated[
        Path | None, typer.Option(metavar="RESULT.json", help="iso9283.json of another result.", show_default=False)
    ] = None,
    json: Json = False,
) -> None:
    """Evaluate what was measured: each criterion with its 95 % interval or the range of its cycles, and a report."""
    from truearm.engine.base.units import sized_si
    from truearm.engine.command.options import progress
    from truearm.iso9283.evaluate.evaluate import iso9283_evaluate

    with progress() as say:
        found = iso9283_evaluate(
            plan,
            poses=poses,
            paths=paths,
            settling=settling,
            forces=forces,
            alignment=alignment,
            noise=sized_si(noise, "mm", parameter="noise", deviation=True),
            noise_rot=sized_si(noise_rot, "deg", parameter="noise_rot", deviation=True),
            compare=compare,
            out=out,
            command=command_line(),
            progress=say,
        )
    if json:
        print_json(found.summary())
    else:
        print_record(found)
        print_line(f"Written to {out}: {', '.join(found.contents())}")
    end_on_error(found.warnings)
