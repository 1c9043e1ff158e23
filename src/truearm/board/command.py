"""``truearm import hand-eye``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.engine.command.options import Json, print_json, print_record


def hand_eye(
    file: Annotated[
        Path, typer.Argument(metavar="VIEWS.csv", help="Joint positions, and poses or pictures of the board.")
    ],
    on_flange: Annotated[
        str, typer.Option(metavar="camera|board", help="What moves with the robot; the other one stands beside it.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    board: Annotated[
        str | None,
        typer.Option(
            metavar="SQUARES,SIDE,MARKER,DICTIONARY",
            help="The ChArUco board in the pictures: 14x10,25mm,18mm,5X5_250.",
            show_default="the table holds poses",
        ),
    ] = None,
    scale_sigma: Annotated[
        float | None,
        typer.Option(
            metavar="PPM", help="How well the size of the board is known, a deviation.", show_default="taken as exact"
        ),
    ] = None,
    ahead: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            help="How far before the camera the target is; that of the first session for every later one.",
            show_default="where the board was on average",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Poses of a board in a camera, one of them on the flange, or pictures that show it."""
    from truearm.board.import_hand_eye import import_hand_eye
    from truearm.engine.base.units import sized_si, to_si

    imported = import_hand_eye(
        file,
        on_flange=on_flange,  # type: ignore[arg-type]
        board=board,
        scale_sigma=None if scale_sigma is None else to_si(scale_sigma, "ppm"),
        ahead=None if ahead is None else sized_si(ahead, "mm", parameter="ahead"),
        out=out,
    )
    if json:
        print_json(imported.summary())
    else:
        print_record(imported)
