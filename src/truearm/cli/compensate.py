"""``truearm compensate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from truearm.cli.loading import PayloadText, read_payload
from truearm.cli.output import Json, print_json, progress
from truearm.errors import InputError

if TYPE_CHECKING:
    from truearm.correction import ProgramCorrection

#: Skipped targets explained one by one where a person reads.
_EXPLAINED = 10


def compensate(
    robot: Annotated[str, typer.Argument(metavar="CALIBRATED.yaml", help="The robot that calibrate wrote.")],
    programs: Annotated[
        list[Path],
        typer.Argument(metavar="PROGRAM...", help="RAPID, KRL, FANUC LS, URScript, Yaskawa JBI or VAL3 files."),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the corrected programs.")],
    tool: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Where the tools really are on the flange.", show_default="best with nominal"
        ),
    ] = None,
    frame: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Where the program's frames really are.", show_default="no shift on average"),
    ] = None,
    payload: PayloadText = None,
    strict: Annotated[bool, typer.Option("--strict", help="Write nothing if a target cannot be corrected.")] = False,
    split: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            help="Divide straight and circular moves where the correction in between would stray farther.",
            show_default=False,
        ),
    ] = None,
    again: Annotated[
        bool, typer.Option("--again", help="Correct the originals of programs corrected before, anew.")
    ] = False,
    revert: Annotated[bool, typer.Option("--revert", help="Write the originals of corrected programs.")] = False,
    json: Json = False,
) -> None:
    """Correct robot programs so that the real robot goes where they meant.

    Only the numbers of targets change. Beside each program NAME.truearm.json records what was done, and holds the
    original; compensation.html shows how far each target was moved.
    """
    from truearm.correction import REPORT, correct
    from truearm.correction import revert as restore
    from truearm.files import writable_folder

    writable_folder(out)
    if revert:
        others = {"--tool": tool, "--frame": frame, "--payload": payload, "--split": split}
        flags = {"--strict": strict or None, "--again": again or None}
        for name, given in (others | flags).items():
            if given is not None:
                raise InputError("only one of them can hold", where=f"--revert, {name}", cure="Leave one out.")
        paths = restore(programs, out)
        if json:
            print_json({"reverted": [str(path) for path in paths]})
        else:
            for path in paths:
                typer.echo(f"{path}: as it was before the correction")
        return
    with progress() as say:
        correction = correct(
            robot,
            programs,
            tools=tool,
            frames=frame,
            payload=read_payload(payload),
            strict=strict,
            split=None if split is None else split / 1e3,
            again=again,
            progress=say,
        )
        correction.save(out, say)
    if json:
        print_json(correction.summary())
    else:
        print_correction(correction)
        typer.echo(f"Written to {out}, with the report {REPORT}")


def print_correction(correction: ProgramCorrection) -> None:
    """Print a table of the files, what was skipped and what to know."""
    summary = correction.summary()
    width = max(len(file["file"]) for file in summary["programs"])
    for file in summary["programs"]:
        shift = file["shift_mm"]
        typer.echo(
            f"{file['file']:{width}}  {file['language']}: {file['corrected']} of {file['targets']} targets corrected, "
            f"moved by {shift['mean']:.3f} mm on average, {shift['max']:.3f} mm at most"
        )
    skipped = [(file["file"], one) for file in summary["programs"] for one in file["skipped"]]
    for name, one in skipped[:_EXPLAINED]:
        typer.echo(f"  {name}, line {one['line']}: {one['reason']}")
    if len(skipped) > _EXPLAINED:
        typer.echo(f"  and {len(skipped) - _EXPLAINED} more; --json lists all")
    for division in correction.division:
        if division.moves:
            moves, more = division.moves, division.added
            typer.echo(f"  {moves} move{'s'[: moves > 1]} divided by {more} more target{'s'[: more > 1]}")
    for warning in summary["warnings"]:
        typer.echo(f"Warning ({warning['code']}): {warning['message']}")


def print_checked(correction: ProgramCorrection) -> None:
    """Print how far from its targets a simulated robot comes with the original and with the corrected program."""
    checked = correction.checked
    if checked is not None:
        typer.echo(f"Distance of {checked.robot} from where the program meant it to be:")
        for name, missed in (("original program", checked.original), ("corrected program", checked.corrected)):
            typer.echo(f"  {name:17}  mean {1e3 * missed.mean():.3f}  max {1e3 * missed.max():.3f} mm")
