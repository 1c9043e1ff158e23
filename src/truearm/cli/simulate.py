"""``truearm simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.loading import GravityText, PayloadText, read_gravity, read_payload


def simulate(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    truth: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE", help="nominal, random, a truth of the robot file ('truearm show'), or a robot file."
        ),
    ],
    poses: Annotated[int, typer.Option(metavar="N", min=1, help="Configurations, drawn evenly within the limits.")],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    noise: Annotated[
        float | None,
        typer.Option(
            metavar="MM", min=0.0, help="Standard deviation of a reading.", show_default="what the device is good for"
        ),
    ] = None,
    device: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="An instrument of 'truearm devices'.",
            show_default="one that sees every target everywhere",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of configurations, noise and a random truth.")] = 0,
    payload: PayloadText = None,
    gravity: GravityText = None,
) -> None:
    """Measure a digital twin whose truth is known, with a simulated instrument."""
    from dataclasses import replace

    import numpy as np

    from truearm.cli.output import progress
    from truearm.errors import InputError
    from truearm.files import refuse_overwriting, writable_file, write_text
    from truearm.library import load_robot, urdf_source
    from truearm.measurement.readers.canonical import csv_text
    from truearm.simulation.devices import measured_with, named_device
    from truearm.simulation.truths import truth_twin
    from truearm.simulation.twin import measure
    from truearm.units import sized_si

    if noise is None and device is None:
        raise InputError(
            "nobody knows how good the instrument is", where="--noise", cure="Give --noise in mm, or a --device."
        )
    instrument = None if device is None else named_device(device)
    sigma = 0.0 if instrument is None else instrument.sigma
    if noise is not None:
        sigma = sized_si(noise, "mm", "--noise", deviation=True) if noise else 0.0
    writable_file(out)
    refuse_overwriting(out, [(urdf_source(name) or (Path(name), None))[0] for name in (robot, truth)])
    rng = np.random.default_rng(seed)
    nominal = load_robot(robot)
    twin = truth_twin(nominal, truth, rng)
    twin = replace(twin, robot=twin.robot.with_payload(read_payload(payload), read_gravity(gravity)))
    with progress() as say:
        say(f"measuring {poses} configurations")
        if instrument is None:
            data = measure(twin, nominal.random_configurations(poses, rng), sigma, rng)
        else:
            data = measured_with(instrument, nominal, twin, poses, rng, sigma)
    write_text(out, csv_text(data))
    what = f"{len(data.target)} readings of {len(data.targets)} target{'s' if len(data.targets) > 1 else ''}"
    against = f" against {', '.join(data.fixtures)}" if data.fixtures else ""
    typer.echo(f"{poses} configurations of {nominal.name} ({truth}), {what}{against}: {out}")
