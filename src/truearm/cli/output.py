"""What commands print: results on standard output, progress on standard error."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any

import typer

from truearm.cli.options import spelled
from truearm.printable import printable, with_short_words

if TYPE_CHECKING:
    from truearm.notices import Notice
    from truearm.results.record import Record

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output and nothing else there.")]


def print_json(content: Any) -> None:
    """Print one JSON object."""
    typer.echo(json.dumps(content, indent=2, allow_nan=False))


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """Show on standard error what is being done, where somebody is looking."""
    from rich.console import Console
    from rich.text import Text

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _: None
        return
    with console.status("starting") as status:
        yield lambda words: status.update(Text(with_short_words(printable(words))))


def end_on_error(notices: Iterable[Notice]) -> None:
    """End with exit code 3 if a notice says that the result should not be used as it is."""
    from truearm.notices import has_error

    if has_error(notices):
        raise typer.Exit(3)


def print_record(record: Record) -> None:
    """Print a result in words and figures."""
    for line in record.lines():
        print_line(spelled(line))


def print_line(line: str, *, err: bool = False) -> None:
    """Print one line, whatever names of files and targets are in it."""
    typer.echo(with_short_words(printable(line)), err=err)
