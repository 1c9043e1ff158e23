"""``truearm plan``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.loading import GravityText, PayloadText, read_gravity, read_payload
from truearm.cli.output import Json, print_json, progress
from truearm.errors import InputError


def plan(
    robot: Annotated[
        str, typer.Argument(metavar="ROBOT", help="A library id, a robot file, calibrated or not, or a URDF.")
    ],
    poses: Annotated[str, typer.Option(metavar="N|auto", help="How many configurations; auto lets O1 decide.")],
    out: Annotated[Path, typer.Option("--out", metavar="PLAN.csv", help="File to write, and PLAN.html beside it.")],
    candidates_of: Annotated[
        Path | None,
        typer.Option(
            "--from", metavar="DATA.csv", help="Choose among the configurations of a file.", show_default=False
        ),
    ] = None,
    objective: Annotated[str, typer.Option(metavar="INDEX", help="O1, O2, O3, O4 or O5.")] = "O1",
    model: Annotated[
        str, typer.Option(metavar="MODEL", help="What will be identified, as in truearm calibrate, without auto.")
    ] = "geometric",
    candidates: Annotated[
        int, typer.Option(metavar="N", min=1, help="Random configurations to choose from, without --from.")
    ] = 5000,
    device: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="An instrument of 'truearm devices'; not with --from.",
            show_default="one that reads every target everywhere",
        ),
    ] = None,
    constraints: Annotated[
        Path | None, typer.Option(metavar="FILE", help="What a configuration must keep.", show_default=False)
    ] = None,
    noise: Annotated[
        float, typer.Option(metavar="MM", help="Deviation of a coordinate about a well identified model.")
    ] = 0.1,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of the random configurations.")] = 0,
    payload: PayloadText = None,
    gravity: GravityText = None,
    json: Json = False,
) -> None:
    """Choose the configurations that tell most, in a measuring order, and say how accurate the result will be.

    Without a device every target on the robot's tool is measured at each of them. Writes PLAN.csv and PLAN.html.
    """
    import shlex
    import sys

    import numpy as np

    from truearm.files import refuse_overwriting, writable_file, write_files
    from truearm.identification.solving.models import named_model
    from truearm.jobs.load_data import load_data
    from truearm.library import load_robot, urdf_source
    from truearm.measurement.checks import check_joints
    from truearm.planning.choosing.measurement_plan import (
        device_candidates,
        plan_measurements,
        random_candidates,
        with_targets,
    )
    from truearm.planning.choosing.plan_table import plan_csv
    from truearm.planning.constraints.constraints import read_constraints
    from truearm.reporting.plan_report import answer, plan_html
    from truearm.simulation.devices import named_device
    from truearm.units import sized_si

    page = out.with_suffix(".html")
    if page == out:
        raise InputError("the plan is a CSV file", where="--out", came=out.name, allowed="PLAN.csv")
    source = urdf_source(robot)
    inputs = [Path(robot) if source is None else source[0], *filter(None, (candidates_of, constraints))]
    for path in (out, page):
        writable_file(path)
        refuse_overwriting(path, inputs)
    count = _poses(poses)
    wanted = named_model(model)
    deviation = sized_si(noise, "mm", "--noise", deviation=True)
    rules = None if constraints is None else read_constraints(constraints)
    rng = np.random.default_rng(seed)
    if device is not None and candidates_of is not None:
        raise InputError(
            "a device finds its own configurations to choose from",
            where="--device",
            came=f"{device} with --from",
            cure="Leave one of them out; --constraints narrows the choice.",
        )
    instrument = None if device is None else named_device(device)
    with progress() as say:
        say("reading the robot")
        loaded = load_robot(robot).with_payload(read_payload(payload), read_gravity(gravity))
        labels = None
        own = bool(loaded.targets)
        readings = None
        if instrument is not None:
            seen, readings, choice = device_candidates(loaded, instrument, candidates, rng)
            own = True
        elif candidates_of is None:
            seen = with_targets(loaded)
            choice = random_candidates(seen, candidates, rng)
        else:
            data = load_data(candidates_of)
            check_joints(loaded, data)
            seen, choice, labels = with_targets(loaded, data), data.postures, data.labels
            own = own or bool(data.has_position.any())
        say(f"choosing among {len(choice)} configurations")
        made = plan_measurements(
            seen,
            choice,
            wanted,
            poses=count,
            rng=rng,
            objective=objective,
            noise=deviation,
            labels=labels,
            constraints=rules,
            where=str(constraints),
            seen_from_the_origin=own,
            readings=readings,
        )
        say("writing the files")
        command = shlex.join(["truearm", *sys.argv[1:]])
        write_files(out.parent, {out.name: plan_csv(made), page.name: plan_html(made, command)})
    if json:
        print_json(made.summary())
        return
    typer.echo(f"{len(made.joints)} of {made.usable} usable configurations, chosen by {made.objective}.")
    for name, lost in made.rejected.items():
        if lost:
            typer.echo(f"  {name}: broken by {lost} of {made.candidates}")
    typer.echo("  " + "  ".join(f"{name} {value:.4g}" for name, value in made.indices.items()))
    for name, place in made.fixtures.items():
        typer.echo(f"  {name} at ({', '.join(f'{v * 1e3:.1f}' for v in place)}) mm in the base frame")
    for sentence in answer(made):
        typer.echo(sentence)
    typer.echo(f"Written: {out}, {page}")


def _poses(text: str) -> int | None:
    if text == "auto":
        return None
    try:
        return int(text)
    except ValueError:
        raise InputError(
            "a number of poses belongs here", where="--poses", came=text, allowed="a whole number, or auto"
        ) from None
