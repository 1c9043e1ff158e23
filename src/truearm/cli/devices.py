"""``truearm devices``."""

from __future__ import annotations

from truearm.cli.output import Json, print_json, print_record


def devices(json: Json = False) -> None:
    """List the instruments that can be simulated and planned for, with what each is good for."""
    from truearm.jobs.devices import devices as run

    found = run()
    if json:
        print_json(found.summary()["devices"])
    else:
        print_record(found)
