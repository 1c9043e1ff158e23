"""``truearm calibrate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from truearm.cli.loading import GravityText, PayloadText, read_gravity, read_payload
from truearm.cli.output import Json, error_line, print_json, progress
from truearm.errors import InputError

if TYPE_CHECKING:
    from truearm.calibration import Calibration, Train


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
    loss: Annotated[str, typer.Option(metavar="LOSS", help="linear, huber, cauchy or l1.")] = "linear",
    redundancy: Annotated[
        str, typer.Option(metavar="HOW", help="prior (keep all, near nominal) or drop (hold and name redundant ones).")
    ] = "prior",
    bounds: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Limits of parameter values.", show_default=False)
    ] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="A joint effect to add to the model; repeat for each.", show_default=False),
    ] = None,
    payload: PayloadText = None,
    gravity: GravityText = None,
    json: Json = False,
) -> None:
    """Identify the real robot from measurements and judge it on configurations it has not seen.

    Writes calibrated.yaml, result.json, report.html and calibrated.urdf into DIR.
    """
    from truearm.calibration import RESULT_FILES
    from truearm.calibration import calibrate as run
    from truearm.files import refuse_overwriting, writable_folder
    from truearm.robots import urdf_source

    writable_folder(out)
    source = urdf_source(robot)
    inputs = [Path(robot) if source is None else source[0], Path(data), *([bounds] if bounds else [])]
    for name in RESULT_FILES:
        refuse_overwriting(out / name, inputs)
    with progress() as say:
        calibration = run(
            robot,
            data,
            model=model,
            train=_train(train),
            seed=seed,
            loss=loss,  # type: ignore[arg-type]
            redundancy=redundancy,  # type: ignore[arg-type]
            bounds=bounds,
            effects=effect or (),
            payload=read_payload(payload),
            gravity=read_gravity(gravity),
            progress=say,
        )
        calibration.save(out, say)
    if json:
        print_json(calibration.summary())
    else:
        print_calibration(calibration)
        typer.echo(f"Written to {out}: calibrated.yaml, result.json, report.html, calibrated.urdf")
    exit_unless_finished(calibration)


def print_calibration(calibration: Calibration) -> None:
    """Print the figures people look for, the held-out error first."""
    summary = calibration.summary()
    held_out = summary["validation"]
    if held_out is not None:
        typer.echo(f"On {held_out['configurations']} configurations the fit has not seen:")
        typer.echo(f"  nominal     {error_line(summary['nominal'])}")
        typer.echo(f"  calibrated  {error_line(held_out)}")
        typer.echo(f"On the {summary['train']['configurations']} training configurations:")
    else:
        typer.echo(f"Nothing was held out; on the {summary['train']['configurations']} training configurations:")
        typer.echo(f"  nominal     {error_line(summary['nominal'])}")
    typer.echo(f"  calibrated  {error_line(summary['train'])}")
    if calibration.selection is not None:
        typer.echo(f"Chosen model: {calibration.fit.model.summary}")
    if calibration.fit.model.name == "frames":
        print_places(calibration)
    typer.echo(f"Status: {summary['status']}. {calibration.status.advice}")
    for warning in summary["warnings"]:
        typer.echo(f"Warning ({warning['code']}): {warning['message']}")


def print_places(calibration: Calibration) -> None:
    """Print where the targets are on the flange, with their deviations."""
    for target in calibration.robot.targets:
        found = [calibration.robot.parameters[target.parameter(axis)] for axis in "xyz"]
        place = ", ".join(f"{p.value * 1e3:.3f}" for p in found)
        told = ", ".join("?" if p.deviation is None else f"{p.deviation * 1e3:.2g}" for p in found)
        typer.echo(f"Target {target.name} on the flange: ({place}) mm, deviations ({told}) mm")


def exit_unless_finished(calibration: Calibration) -> None:
    """End with exit code 3 if the fit did not come to a good end."""
    from truearm.identification.solving.fit import Status

    if calibration.status not in (Status.CONVERGED, Status.AT_BOUND):
        raise typer.Exit(3)


def _train(text: str | None) -> Train:
    if text is None or text == "all":
        return text  # type: ignore[return-value]
    try:
        return int(text)
    except ValueError:
        raise InputError(
            "a number of configurations belongs here", where="--train", came=text, allowed="a whole number, or all"
        ) from None
