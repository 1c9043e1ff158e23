"""``truearm import``: files of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.engine.command.options import JointsAreText, Json, _named, print_json, print_record


def matrices(
    joints: Annotated[Path, typer.Option(metavar="FILE", help="Joint positions, one configuration a row.")],
    targets: Annotated[
        list[str], typer.Option("--target", metavar="NAME=FILE", help="Positions of a target; repeat for each.")
    ],
    angle_unit: Annotated[str, typer.Option(metavar="deg|rad", help="Unit of the joint positions.")],
    length_unit: Annotated[str, typer.Option(metavar="mm|m", help="Unit of the positions.")],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    references: Annotated[
        list[str] | None,
        typer.Option(
            "--reference", metavar="NAME=FILE", help="Positions of a fixed point beside the robot; repeat for each."
        ),
    ] = None,
    joints_are: JointsAreText = None,
) -> None:
    """White-space separated matrices, one configuration a row. A row of zeros or NaN is a missing reading."""
    from truearm.importing.files import import_matrices

    imported = import_matrices(
        joints,
        _named(targets, "targets"),
        _named(references or [], "references"),
        angle_unit=angle_unit,
        length_unit=length_unit,
        joints_are=joints_are or "model",  # type: ignore[arg-type]
        out=out,
    )
    print_record(imported)


def table(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A CSV, another delimited text, or an Excel workbook.")],
    mapping: Annotated[
        Path,
        typer.Option(
            "--map",
            metavar="MAPPING.yaml|PRESET",
            help="Which column is what: a file, or one of spatial-analyzer and t-mac.",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    joints: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Second file with the joint positions.", show_default="as the mapping says"),
    ] = None,
    joints_are: JointsAreText = None,
) -> None:
    """Any table of points or poses, by a mapping that says which column is what (`guess` writes one)."""
    from truearm.importing.files import import_table

    imported = import_table(file, mapping, joints=joints, joints_are=joints_are, out=out)  # type: ignore[arg-type]
    print_record(imported)


def guess(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A CSV, another delimited text, or an Excel workbook.")],
    out: Annotated[Path, typer.Option("--out", metavar="MAPPING.yaml", help="File to write; nothing is overwritten.")],
    json: Json = False,
) -> None:
    """Look at a table and write the mapping that it seems to need, for you to confirm. Nothing is imported."""
    from truearm.importing.guess import import_guess

    guessed = import_guess(file, out=out)
    if json:
        print_json(guessed.summary())
    else:
        print_record(guessed)


def robodk(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Calibration or validation measurements, as exported.")],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    angle_unit: Annotated[
        str | None, typer.Option(metavar="deg|rad", help="Unit of the angles of measured poses.", show_default=False)
    ] = None,
    joints_are: JointsAreText = None,
    delimiter: Annotated[
        str, typer.Option(metavar="comma|semicolon|tab", help="What stands between columns.")
    ] = "comma",
    decimal: Annotated[str, typer.Option(metavar="point|comma", help="The decimal sign.")] = "point",
    json: Json = False,
) -> None:
    """Calibration or validation measurements of RoboDK: joints, measured points and tool points."""
    from truearm.importing.files import import_robodk

    imported = import_robodk(
        file,
        angle_unit=angle_unit,  # type: ignore[arg-type]
        joints_are=joints_are or "model",  # type: ignore[arg-type]
        delimiter=delimiter,  # type: ignore[arg-type]
        decimal=decimal,  # type: ignore[arg-type]
        out=out,
    )
    if json:
        print_json(imported.summary())
    else:
        print_record(imported)


def sockets(
    file: Annotated[Path, typer.Argument(metavar="TOUCHES.csv", help="Joint positions, and the socket, row by row.")],
    apart: Annotated[
        str, typer.Option(metavar="DISTANCE,SIGMA", help="How far apart the sockets are, with units: 200mm,0.02mm.")
    ],
    ball: Annotated[str, typer.Option(metavar="DIAMETER", help="Of the ball, with its unit: 25mm.")],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    sigma: Annotated[
        float | None,
        typer.Option(
            metavar="MM", help="How well the ball comes to rest in a socket, a deviation.", show_default="not declared"
        ),
    ] = None,
) -> None:
    """Joint positions of a ball on the flange that was put into two sockets, without any instrument."""
    from truearm.engine.base.units import sized_si
    from truearm.importing.files import import_sockets

    imported = import_sockets(
        file,
        apart=apart,
        ball=ball,
        sigma=None if sigma is None else sized_si(sigma, "mm", parameter="sigma", deviation=True),
        out=out,
    )
    print_record(imported)
