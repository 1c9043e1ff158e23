"""Lists to choose files and words from."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

#: What stands in a list where nothing is chosen: an empty text would stop the whole page.
NONE: Final = "(none)"


def offer(element: Any, names: Iterable[str], value: str | None, none: str | None = NONE) -> None:
    """Let a list offer names and show the chosen one, which is offered even where it is no longer there.

    Args:
        none: What stands for nothing chosen; None where something always is.
    """
    offered = dict.fromkeys([*([] if none is None else [none]), *names, *([] if value is None else [value])])
    if element.options != tuple(offered):
        element.options = tuple(offered)
    element.value = none if value is None else value


def chosen(element: Any, none: str = NONE) -> str | None:
    """Return what is chosen in a list; None if nothing is."""
    return None if element.value == none else str(element.value)
