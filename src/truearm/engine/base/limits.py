"""How much is taken at most: sizes of files, rows, names and counts, all in one place.

Every limit lies far above what people measure, and so low that reading and checking what it allows takes less than 1 GB
of memory and 30 s. Who needs more names it in the environment variable ``TRUEARM_LIMITS``, for Python and for the
command alike: ``TRUEARM_LIMITS="rows=2000000 cells=20000000"``. It is read whenever a limit is asked for.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from truearm.engine.base.errors import InputError, did_you_mean

#: The environment variable that changes limits.
VARIABLE: Final = "TRUEARM_LIMITS"
#: No limit can be raised so far; Python may refuse to write such a number out.
_BEYOND_ALL: Final = 10**15
_ENTRY: Final = re.compile(r"(?P<name>[a-z_]+)=(?P<most>[1-9][0-9]{0,14})")


@dataclass(frozen=True)
class Limit:
    """How much there may be of something."""

    most: int  #: So much and no more, unless the environment says otherwise.
    what: str  #: What there is too much of, for the refusal.
    unit: str  #: What is counted.
    cure: str = ""  #: What else to do than to allow more.


#: Every limit by its name.
LIMITS: Final[Mapping[str, Limit]] = {
    "file_size": Limit(100_000_000, "the file is too large", "bytes"),
    "yaml_size": Limit(4_000_000, "the file is too large for YAML", "bytes"),
    "program_size": Limit(
        30_000_000, "the program is too large to be corrected at once", "bytes", "Split it into several files."
    ),
    "entries": Limit(100_000, "the file has too many entries", "entries"),
    "nesting": Limit(100, "the entries are nested too deep", "levels"),
    "rows": Limit(500_000, "the table has too many lines", "lines"),
    "samples_size": Limit(400_000_000, "the file of samples is too large", "bytes", "Split it by tests."),
    "samples_read": Limit(2_000_000, "the file has too many samples", "samples", "Split it by tests."),
    "columns": Limit(10_000, "the table has too many columns", "columns"),
    "cells": Limit(5_000_000, "the table has too many cells", "cells"),
    "sheet_size": Limit(20_000_000, "the workbook is too large", "bytes unpacked", "Save the sheet as CSV."),
    "steps": Limit(3_000_000_000, "the pattern takes too long for so many names", "steps", "Write a shorter pattern."),
    "pixels": Limit(
        80_000_000,
        "the image has too many dots",
        "dots",
        "Scan at 300 to 600 dpi: more does not show a pencil line better.",
    ),
    "dots": Limit(
        20_000_000, "the page is too large to look for a circle on it", "dots", "Scan the part with the circle alone."
    ),
    "readings": Limit(400_000, "there would be too many readings", "readings"),
    "places": Limit(2_000_000, "there are too many points for so many configurations", "places"),
    "derivatives": Limit(
        10_000_000,
        "there are too many readings for so many parameters",
        "derivatives",
        "Leave out readings, or targets that say nothing more.",
    ),
    "parameters": Limit(
        1000, "there are too many parameters", "parameters", "Leave out targets that say nothing more."
    ),
    "wrenches": Limit(
        100, "there are too many different forces for one run", "forces", "Correct the programs in several runs."
    ),
    "poses": Limit(50_000, "the number is out of range", "poses"),
    "samples": Limit(
        20_000, "the path has too many samples", "samples", "Take a longer step in the file, or go faster."
    ),
    "candidates": Limit(50_000, "the number is out of range", "candidates"),
    "keep_out": Limit(20, "there are too many boxes to keep out of", "boxes", "Give one box for several."),
    "trials": Limit(1_000_000, "the number is out of range", "trials"),
    "monte_carlo": Limit(100_000, "the number is out of range", "trials"),
    "repeats": Limit(100_000, "the number is out of range", "repeats"),
    "bootstrap": Limit(10_000, "the number is out of range", "fits"),
    "robots": Limit(1_000_000, "there are too many robots", "robots"),
    "workers": Limit(1000, "the number is out of range", "workers"),
    "upload": Limit(50_000_000, "the file is too large to be taken in", "bytes", "Copy it into the folder yourself."),
    "mesh_size": Limit(30_000_000, "the mesh is too large", "bytes", "Save it with fewer triangles."),
    "triangles": Limit(500_000, "there are too many triangles to draw", "triangles", "Save meshes with fewer of them."),
    "seeds": Limit(1000, "the number is out of range", "seeds"),
}


def limit(name: str) -> int:
    """Return how much there may be of something, by the name of its limit."""
    return _changed(os.environ.get(VARIABLE, "")).get(name, LIMITS[name].most)


def refuse_beyond(name: str, count: int, *, where: str | None = None, parameter: str | None = None) -> None:
    """Refuse what is more than a limit allows.

    Args:
        name: Of the limit.
        count: How much there is.
        where, parameter: What the refusal names.
    """
    most = limit(name)
    if count <= most:
        return
    known = LIMITS[name]
    meant = count < _BEYOND_ALL
    raised = f"More is allowed by the environment variable: {VARIABLE}={name}={count}." if meant else ""
    raise InputError(
        known.what,
        parameter=parameter,
        where=where,
        came=f"{count if meant else 'very many'} {known.unit}",
        allowed=f"{most} {known.unit} or fewer",
        cure=f"{known.cure} {raised}".strip() or None,
    )


@lru_cache(maxsize=8)
def _changed(text: str) -> Mapping[str, int]:
    """Return the limits that the environment changes."""
    changed = {}
    for word in re.split(r"[\s,]+", text.strip()) if text.strip() else ():
        entry = _ENTRY.fullmatch(word)
        if entry is None or entry["name"] not in LIMITS:
            raise InputError(
                "this is no limit",
                where=f"environment variable {VARIABLE}",
                came=word,
                allowed=f"NAME=COUNT with a blank between two of them; names are {', '.join(LIMITS)}",
                cure=did_you_mean(word.partition("=")[0], LIMITS),
            )
        changed[entry["name"]] = int(entry["most"])
    return changed
