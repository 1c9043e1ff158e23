"""``truearm calibrate``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

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

if TYPE_CHECKING:
    from truearm.calibration.result import Calibration


def calibrate(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    data: Annotated[str, typer.Argument(metavar="DATA.csv", help="Measurements in the canonical CSV.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")],
    model: Annotated[
        str,
        typer.Option(
            metavar="MODEL",
            help="offsets, joints, geometric, elastic, tilting, full; auto: the effects that the data can carry; "
            "frames: base, tool and fixtures alone.",
        ),
    ] = "geometric",
    train: Annotated[
        str | None,
        typer.Option(metavar="N|all", help="Configurations to train on; the rest judges.", show_default="70 %"),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of the split.")] = 0,
    loss: Annotated[str, typer.Option(metavar="LOSS", help="linear, huber, cauchy, l1 or l1-components.")] = "linear",
    redundancy: Annotated[
        str,
        typer.Option(
            metavar="HOW",
            help="prior (keep all, near nominal), drop (hold and name redundant ones), none (no priors, all free; with "
            "--bounds or --hold).",
        ),
    ] = "prior",
    bounds: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Limits of parameter values.", show_default=False)
    ] = None,
    hold: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WHAT,...",
            help="What is known and not found: base, targets, fixtures, or names; repeatable.",
            show_default=False,
        ),
    ] = None,
    frames: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Where what is held stands.", show_default=False)
    ] = None,
    bootstrap: Annotated[
        int,
        typer.Option(
            metavar="N", help="Deviations from N fits to configurations drawn anew.", show_default="from the residuals"
        ),
    ] = 0,
    effects: Annotated[
        list[str] | None,
        typer.Option(
            "--effect", metavar="NAME", help="A joint effect to add to the model; repeat for each.", show_default=False
        ),
    ] = None,
    payload: PayloadText = None,
    gravity: GravityText = None,
    base_changes: Annotated[
        str | None,
        typer.Option(
            "--base-changes",
            metavar="AT,...",
            help="Configurations from which on the instrument or the robot's base stood elsewhere.",
            show_default=False,
        ),
    ] = None,
    without: Annotated[
        list[str] | None,
        typer.Option(
            "--without", metavar="LABEL,...", help="Configurations to leave out; repeatable.", show_default=False
        ),
    ] = None,
    exclude: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Readings to exclude: configuration, target and reason.", show_default=False),
    ] = None,
    monte_carlo: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="Simulate N calibrations for intervals beside the linear ones.", show_default=False
        ),
    ] = None,
    zones: Annotated[
        str | None,
        typer.Option(
            metavar="N|FILE", help="Try a model for each of N zones, or for those of a file.", show_default=False
        ),
    ] = None,
    notes: NoteTexts = None,
    replace: Annotated[
        bool,
        typer.Option(
            "--replace", help="Replace a sound result in DIR even by one that is worse than nominal, or otherwise bad."
        ),
    ] = False,
    json: Json = False,
) -> None:
    """Identify the real robot from measurements and judge it on configurations it has not seen.

    Writes calibrated.yaml, result.json, report.html and calibrated.urdf into DIR.
    """
    from truearm.calibration.calibrate import calibrate as run

    with _told_if_kept(json=json), progress() as say:
        calibration = run(
            robot,
            data,
            out=out,
            model=model,
            train=read_train(train),
            seed=seed,
            loss=loss,  # type: ignore[arg-type]
            redundancy=redundancy,  # type: ignore[arg-type]
            bounds=bounds,
            hold=[name.strip() for text in hold or () for name in text.split(",")],
            frames=frames,
            bootstrap=bootstrap,
            effects=effects or (),
            payload=payload,
            gravity=read_gravity(gravity),
            base_changes=[name.strip() for name in base_changes.split(",")] if base_changes else (),
            without=[name.strip() for text in without or () for name in text.split(",")],
            exclude=exclude,
            monte_carlo=monte_carlo,
            zones=number_or(zones),
            notes=read_notes(notes),
            replace=replace,
            command=command_line(),
            progress=say,
        )
    _print(calibration, json=json)
    if not json:
        print_line(f"Written to {out}: {', '.join(calibration.files)}")
    if not calibration.finished:
        raise typer.Exit(3)


@contextmanager
def _told_if_kept(*, json: bool) -> Iterator[None]:
    """Print what a calibration says also where it is not written, because a sound result stays."""
    from truearm.calibration.parts import ResultKeptError

    try:
        yield
    except ResultKeptError as kept:
        _print(kept.calibration, json=json)
        raise


def _print(calibration: Calibration, *, json: bool) -> None:
    if json:
        print_json(calibration.summary())
    else:
        print_record(calibration)
