"""Times a computation inside a contender's own process and writes what it found for the comparison."""

from __future__ import annotations

import json
import platform
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path


def median_seconds(compute: Callable[[], object], repeats: int) -> float:
    """Return the median time of a computation [s] after one run that is not counted."""
    compute()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        compute()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def inputs() -> Path:
    """Return the folder of the input arrays: the first argument."""
    return Path(sys.argv[1])


def report(figures: dict[str, object], versions: dict[str, str]) -> None:
    """Write figures as JSON to the file that is the second argument."""
    text = json.dumps({"python": platform.python_version(), "versions": versions, "figures": figures}, indent=1)
    Path(sys.argv[2]).write_text(text)
