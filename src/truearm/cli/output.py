"""What commands print: results on standard output, progress on standard error."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output and nothing else there.")]


def print_json(content: Any) -> None:
    """Print one JSON object."""
    typer.echo(json.dumps(content, indent=2, allow_nan=False))


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """Show on standard error what is being done, where somebody is looking."""
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _: None
        return
    with console.status("starting") as status:
        yield lambda words: status.update(words)


def error_line(summary: dict[str, Any]) -> str:
    """Return the statistics of one set of errors as a line."""
    parts = []
    kinds = (("position_mm", "mm"), ("orientation_mrad", "mrad"), ("length_mm", "mm of length"))
    for key, unit in kinds:
        if key in summary:
            s = summary[key]
            parts.append(f"mean {s['mean']:.3f}  rms {s['rms']:.3f}  95 % {s['p95']:.3f}  max {s['max']:.3f} {unit}")
    return "   ".join(parts) if parts else "no readings"
