"""The command ``truearm``: one file a command, each of them thin."""

from __future__ import annotations

import os
import sys
from typing import Annotated

import typer

from truearm.cli.calibrate import calibrate
from truearm.cli.convert import convert
from truearm.cli.importing import app as importing
from truearm.cli.library import robots, show
from truearm.cli.simulate import simulate
from truearm.cli.starting import demo, example, new_robot
from truearm.cli.validate import validate
from truearm.errors import InputError
from truearm.version import __version__

# A calibration's matrices are small: a second BLAS thread gains nothing on a quiet machine and waits for its turn on
# a busy one. NumPy reads this when it is first imported, which is after here.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

app = typer.Typer(
    name="truearm",
    help="Make a serial robot accurate: identify the real robot from measurements and prove how good it is.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"truearm {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and stop.")
    ] = False,
) -> None:
    pass


app.command()(calibrate)
app.command()(validate)
app.command()(simulate)
app.add_typer(importing, name="import")
app.command()(robots)
app.command()(show)
app.command()(convert)
app.command("new-robot")(new_robot)
app.command()(example)
app.command()(demo)


def main() -> None:
    """Run the command; refused input ends with one message and exit code 2."""
    try:
        app(prog_name="truearm")
    except InputError as error:
        print(f"truearm: {error}", file=sys.stderr)  # noqa: T201
        sys.exit(2)
