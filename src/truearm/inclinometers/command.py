"""``truearm tilting``, and ``--device inclinometers`` of ``truearm plan`` and ``truearm simulate``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from truearm.engine.base.errors import InputError
from truearm.engine.command.options import (
    GravityText,
    Json,
    NoteTexts,
    PayloadText,
    command_line,
    number_or,
    print_json,
    print_line,
    print_record,
    progress,
    read_gravity,
    read_notes,
    read_train,
)

#: Options that say nothing for inclinometers.
_NOT_PLANNED: Final = (
    *("objective", "accurate_at", "region", "tools", "frames", "candidates_from", "constraints"),
    *("program", "approach", "speed", "dwell", "wait"),
)
_NOT_SIMULATED: Final = ("noise", "wrench", "wrench_frame", "wrench_at")


def plan_pairs(
    robot: str, poses: str, out: Path, *, model: str, noise: float, pull: float | None, json: bool, **given: Any
) -> None:
    """Plan what inclinometers read: ``truearm plan --device inclinometers``."""
    from truearm.engine.base.units import sized_si
    from truearm.engine.command.texts import read_seed
    from truearm.inclinometers.pairs import plan_inclinometers

    deviation = sized_si(noise, "mm", parameter="noise", deviation=True)
    beside = {name: None if given[name] is False else given[name] for name in _NOT_PLANNED}
    _refuse_beside(beside | {"model": None if model in ("geometric", "tilting") else model})
    lengths = [name for name in ("floor", "clearance") if given[name] is not None]
    more: dict[str, Any] = {name: sized_si(given[name], "mm", parameter=name) for name in lengths}
    with progress() as say:
        pairs = plan_inclinometers(
            robot,
            poses=_even(poses),
            out=out,
            pull=20.0 if pull is None else pull,
            noise=deviation,
            gravity=read_gravity(given["gravity"]),
            home=read_seed(robot, given["home"], given["joints"], "home"),
            command=command_line(),
            progress=say,
            **{name: given[name] for name in ("candidates", "seed", "payload", "joints", "no_floor")},
            **more,
        )
    if json:
        print_json(pairs.summary())
    else:
        print_record(pairs)
        print_line(f"Written: {out}, {out.with_name(f'{out.stem}-ways.csv')}")


def simulate_readings(
    robot: str, poses: str, *, pull: float | None, gravity: str | None, json: bool, **given: Any
) -> None:
    """Simulate what inclinometers read: ``truearm simulate --device inclinometers``."""
    from truearm.inclinometers.pairs import simulate_inclinometers

    _refuse_beside({name: given[name] for name in _NOT_SIMULATED})
    with progress() as say:
        read = simulate_inclinometers(
            robot,
            poses=number_or(poses),
            pull=20.0 if pull is None else pull,
            gravity=read_gravity(gravity),
            progress=say,
            **{name: given[name] for name in ("truth", "out", "seed", "payload", "joints")},
        )
    if json:
        print_json(read.summary())
    else:
        print_record(read)


def _refuse_beside(given: Mapping[str, object]) -> None:
    """Refuse what says nothing for inclinometers; None was not given."""
    for name, came in given.items():
        if came is not None:
            raise InputError(
                "this says nothing for inclinometers", parameter=name, came=str(came), cure=f"Leave `{name}` out."
            )


def _even(text: str) -> int:
    """Return how many configurations a text names."""
    try:
        return int(text)
    except ValueError:
        raise InputError(
            "for inclinometers a number of configurations belongs here",
            parameter="poses",
            came=text,
            allowed="an even number",
        ) from None


def tilting(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    inclinations: Annotated[
        str, typer.Argument(metavar="INCLINATIONS.csv", help="What inclinometers on the links read.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")],
    poses: Annotated[
        str | None,
        typer.Argument(
            metavar="[POSES.csv]", help="Measurements in the canonical CSV, for the geometry.", show_default=False
        ),
    ] = None,
    pushed: Annotated[
        str | None,
        typer.Option(
            metavar="PUSHED.csv",
            help="Measurements in pairs of configurations under two forces, for joints whose axes stand upright.",
            show_default=False,
        ),
    ] = None,
    model: Annotated[
        str, typer.Option(metavar="MODEL", help="What the poses tell: offsets, joints or geometric.")
    ] = "geometric",
    train: Annotated[
        str | None,
        typer.Option(metavar="N|all", help="Configurations to train on; the rest judges.", show_default="70 %"),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of the split.")] = 0,
    payload: PayloadText = None,
    gravity: GravityText = None,
    notes: NoteTexts = None,
    json: Json = False,
) -> None:
    """Find tilt, backlash and stiffness of the joints by inclinometers, then the geometry with these held.

    Writes calibrated.yaml, result.json, report.html and calibrated.urdf into DIR, and with POSES geometry.html.
    """
    from truearm.inclinometers.tilting import tilting as run

    with progress() as say:
        found = run(
            robot,
            inclinations,
            poses,
            pushed=pushed,
            out=out,
            model=model,
            train=read_train(train),
            seed=seed,
            payload=payload,
            gravity=read_gravity(gravity),
            notes=read_notes(notes),
            command=command_line(),
            progress=say,
        )
    if json:
        print_json(found.summary())
    else:
        print_record(found)
        more = "" if found.geometry is None else ", geometry.html"
        print_line(f"Written to {out}: calibrated.yaml, result.json, report.html, calibrated.urdf{more}")
    if not found.finished:
        raise typer.Exit(3)
