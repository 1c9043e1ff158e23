"""Work that kills the process that does it, for tests of what is then repeated."""

from __future__ import annotations

import os
from pathlib import Path


def doubled(number: int) -> int:
    return 2 * number


def divided(number: int) -> float:
    return 1 / number


def deadly_once(task: tuple[Path, int]) -> int:
    """Return a number; the first process that is asked for a 3 dies."""
    mark, number = task
    if number == 3 and not mark.exists():
        mark.touch()
        os._exit(1)
    return 2 * number


def thread_setting(_: int) -> str | None:
    return os.environ.get("OPENBLAS_NUM_THREADS")
