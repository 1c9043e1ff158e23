"""``truearm import``: measurement files of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.options import Commands
from truearm.errors import InputError

app = Commands(help="Turn measurement files into the canonical CSV.", no_args_is_help=True)


@app.command()
def matrices(
    joints: Annotated[Path, typer.Option(metavar="FILE", help="Joint readings, one configuration a row.")],
    target: Annotated[list[str], typer.Option(metavar="NAME=FILE", help="Positions of a target; repeat for each.")],
    angle_unit: Annotated[str, typer.Option(metavar="deg|rad", help="Unit of the joint readings.")],
    length_unit: Annotated[str, typer.Option(metavar="mm|m", help="Unit of the positions.")],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    reference: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=FILE", help="Positions of a fixed point beside the robot; repeat for each."),
    ] = None,
) -> None:
    """White-space separated matrices, one configuration a row. A row of zeros or NaN is a missing reading."""
    from truearm.files import refuse_overwriting, write_text
    from truearm.measurement.readers.canonical import csv_text
    from truearm.measurement.readers.matrices import read_matrices

    targets, references = _named(target, "--target"), _named(reference or [], "--reference")
    refuse_overwriting(out, [joints, *targets.values(), *references.values()])
    data, missing = read_matrices(joints, targets, references, angle_unit, length_unit)
    write_text(out, csv_text(data))
    typer.echo(f"{data.configurations} configurations, targets {', '.join(data.targets)}: {out}")
    for name, count in missing.items():
        typer.echo(f"  {name}: {count} missing {'reading' if count == 1 else 'readings'}")


@app.command()
def table(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A CSV or SpatialAnalyzer ASCII file.")],
    mapping: Annotated[Path, typer.Option("--map", metavar="MAPPING.yaml", help="Which column is what.")],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
) -> None:
    """Any table of points, by a mapping that says which column is what (the guide has complete ones)."""
    from truearm.files import refuse_overwriting, write_text
    from truearm.measurement.readers.canonical import csv_text
    from truearm.measurement.readers.table import files_read, read_table

    refuse_overwriting(out, files_read(file, mapping))
    data = read_table(file, mapping)
    write_text(out, csv_text(data))
    typer.echo(f"{data.configurations} configurations, targets {', '.join(data.targets)}: {out}")


@app.command()
def circle(
    scan: Annotated[list[str], typer.Option(metavar="NAME=IMAGE", help="A scanned page; repeat for each.")],
    points: Annotated[
        list[str],
        typer.Option(metavar="NAME=FILE", help="Joints, angle and height read while it was drawn; one a page."),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    dpi: Annotated[
        str | None, typer.Option(metavar="N|X,Y", help="Dots per inch of the scans.", show_default="as the files say")
    ] = None,
    sigma: Annotated[
        float | None, typer.Option(metavar="MM", help="Deviation of radius and height.", show_default="not declared")
    ] = None,
) -> None:
    """Circles that the robot drew with a pencil: scanned pages and the potentiometer's readings."""
    from truearm.files import refuse_overwriting, write_text
    from truearm.measurement.readers.canonical import csv_text
    from truearm.measurement.readers.drawn_circles import Page, read_drawn_circles
    from truearm.units import sized_si

    scans, tables = _named(scan, "--scan"), _named(points, "--points")
    for name in (*scans, *tables):
        if name not in scans or name not in tables:
            raise InputError(
                "every page needs a scan and a table",
                where="--points" if name in scans else "--scan",
                came=f"nothing for {name}",
                allowed="the same names in --scan and --points",
            )
    refuse_overwriting(out, [*scans.values(), *tables.values()])
    pages = {name: Page(scans[name], tables[name]) for name in scans}
    deviation = None if sigma is None else sized_si(sigma, "mm", "--sigma", deviation=True)
    data = read_drawn_circles(pages, _dots(dpi), deviation)
    write_text(out, csv_text(data))
    typer.echo(f"{data.configurations} configurations on {len(pages)} page{'s' if len(pages) > 1 else ''}: {out}")
    gaps = int((~data.has_reading).sum())
    if gaps:
        typer.echo(f"  {gaps} missing {'distance' if gaps == 1 else 'distances'}, where the line has gaps")


def _dots(text: str | None) -> float | tuple[float, float] | None:
    if text is None:
        return None
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2):
        raise InputError("a resolution belongs here", where="--dpi", came=text, allowed="a number, or X,Y")
    return numbers[0] if len(numbers) == 1 else (numbers[0], numbers[1])


def _named(entries: list[str], option: str) -> dict[str, Path]:
    named: dict[str, Path] = {}
    for entry in entries:
        name, separator, file = entry.partition("=")
        if not separator or not name or not file:
            raise InputError("a name and a file belong here", where=option, came=entry, allowed="NAME=FILE")
        if name in named:
            raise InputError("this name is given twice", where=option, came=name)
        named[name] = Path(file)
    return named
