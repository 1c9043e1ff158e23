"""``truearm devices``."""

from __future__ import annotations

import typer

from truearm.cli.output import Json, print_json


def devices(json: Json = False) -> None:
    """List the instruments that can be simulated and planned for, with what each is good for."""
    from truearm.simulation.devices import DEVICES

    if json:
        print_json(
            [{"name": d.name, "summary": d.summary, "sigma_mm": d.sigma * 1e3, "source": d.source} for d in DEVICES]
        )
        return
    width = max(len(device.name) for device in DEVICES)
    for device in DEVICES:
        typer.echo(f"{device.name:<{width}}  {device.summary}; deviation {device.sigma * 1e3:g} mm")
