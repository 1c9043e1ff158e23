"""``truearm import``: measurement files of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.errors import InputError

app = typer.Typer(help="Turn measurement files into the canonical CSV.", no_args_is_help=True)


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
