"""``truearm measure``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from truearm.engine.command.options import (
    Json,
    PayloadText,
    command_line,
    print_json,
    print_line,
    print_record,
    progress,
)

_VIRTUAL: Final = "Virtual instrument"
_REAL: Final = "Real instrument"


def measure(
    plan: Annotated[str, typer.Argument(metavar="PLAN.csv", help="Configurations, as 'truearm plan' writes them.")],
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for log, measurements and report.")],
    device: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Readings of a virtual instrument ('truearm devices').", rich_help_panel=_VIRTUAL
        ),
    ] = None,
    truth: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="The twin that it measures, as for 'truearm simulate'.",
            show_default="random",
            rich_help_panel=_VIRTUAL,
        ),
    ] = None,
    noise: Annotated[
        float | None,
        typer.Option(
            metavar="MM", help="Of a coordinate.", show_default="the deviation of the device", rich_help_panel=_VIRTUAL
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(metavar="S", min=0, help="Of all draws.", show_default="0", rich_help_panel=_VIRTUAL)
    ] = None,
    disturbed: Annotated[
        float | None,
        typer.Option(
            metavar="SHARE", help="Of readings that go wrong, up to 0.9.", show_default="0", rich_help_panel=_VIRTUAL
        ),
    ] = None,
    drift: Annotated[
        float | None,
        typer.Option(
            metavar="MM", help="How far the instrument moves till the end.", show_default="0", rich_help_panel=_VIRTUAL
        ),
    ] = None,
    payload: PayloadText = None,
    constraints: Annotated[
        str | None,
        typer.Option(
            metavar="FILE", help="Its boxes hide nests, as the arm does.", show_default=False, rich_help_panel=_VIRTUAL
        ),
    ] = None,
    watch: Annotated[
        str | None,
        typer.Option(metavar="DIR", help="Readings from a folder into which software writes.", rich_help_panel=_REAL),
    ] = None,
    mapping: Annotated[
        str | None, typer.Option("--map", metavar="MAPPING.yaml", help="What the columns mean.", rich_help_panel=_REAL)
    ] = None,
    listen: Annotated[
        int | None,
        typer.Option(
            metavar="PORT", help="Readings from programs of this machine; 0: any free port.", rich_help_panel=_REAL
        ),
    ] = None,
    token: Annotated[
        str | None,
        typer.Option(metavar="TOKEN", help="Which they send first.", show_default="a new one", rich_help_panel=_REAL),
    ] = None,
    targets: Annotated[
        list[str] | None,
        typer.Option("--target", metavar="NAME", help="Measured at each configuration; repeat it for more."),
    ] = None,
    nests: Annotated[
        list[str] | None,
        typer.Option("--nest", metavar="NAME", help="Fixed point beside the robot; repeat it for more."),
    ] = None,
    every: Annotated[
        int, typer.Option(metavar="N", min=1, help="Configurations between two rounds of the nests.")
    ] = 10,
    most_deviation: Annotated[
        float | None,
        typer.Option(metavar="MM", min=0.0, help="Largest scatter of a sample.", show_default="by the virtual device"),
    ] = None,
    most_settling: Annotated[
        float | None,
        typer.Option(
            metavar="MM", min=0.0, help="Between the halves of a dwell.", show_default="by the virtual device"
        ),
    ] = None,
    fewest_samples: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Of a dwell.", show_default="by the virtual device")
    ] = None,
    about: Annotated[
        str | None, typer.Option(metavar="ABOUT.yaml", help="Serial numbers, reflector, air.", show_default=False)
    ] = None,
    wait: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", min=0.0, help="End after so long without a reading.", show_default="never"),
    ] = None,
    json: Json = False,
) -> None:
    """Go through a plan with an instrument, reading by reading; run again, it goes on where it stopped."""
    from truearm.engine.base.units import sized_si, to_si
    from truearm.measuring.measure import measure as run

    def length(value: float | None) -> float | None:
        return None if value is None else to_si(value, "mm")

    with progress() as say:
        found = run(
            plan,
            robot,
            out=out,
            device=device,
            truth=truth,
            noise=sized_si(noise, "mm", parameter="noise", deviation=True) if noise else noise,
            seed=seed,
            disturbed=disturbed,
            drift=length(drift),
            payload=payload,
            constraints=constraints,
            watch=watch,
            mapping=mapping,
            listen=listen,
            token=token,
            targets=targets,
            nests=nests,
            every=every,
            most_deviation=length(most_deviation),
            most_settling=length(most_settling),
            fewest_samples=fewest_samples,
            about=about,
            wait=wait,
            command=command_line(),
            tell=lambda line: print_line(line, err=json),
            progress=say,
        )
    if json:
        print_json(found.summary())
        return
    print_record(found)
    if found.files:
        print_line(f"Written to {out}: {', '.join(found.files)}, and the log readings.csv")
