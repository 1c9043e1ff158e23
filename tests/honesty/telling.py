"""What a command tells: its code, the codes and levels of its notices, and the figures beside them."""

from __future__ import annotations

import io
import json
import re
import sys
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from truearm.commands import main
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text


@dataclass(frozen=True)
class Told:
    """What a command said.

    Attributes
    ----------
    code
        Its exit code.
    levels, messages
        Level and message of each notice, by its code.
    summary
        All of its JSON; empty for a refusal.
    refusal
        What stood on standard error.
    """

    code: int
    levels: Mapping[str, str]
    messages: Mapping[str, str]
    summary: Mapping[str, Any]
    refusal: str = ""

    def says(self, code: str, level: str, words: str = "") -> bool:
        """Return whether a notice was given at a level, in words that a pattern finds."""
        return self.levels.get(code) == level and re.search(words, self.messages[code]) is not None


def told(*words: object) -> Told:
    """Run a command that knows ``--json`` in this process."""
    out, err, before = io.StringIO(), io.StringIO(), sys.argv
    code: object = 0
    sys.argv = ["truearm", *map(str, words), "--json"]
    try:
        with redirect_stdout(out), redirect_stderr(err):
            main()
    except SystemExit as stop:
        code = stop.code or 0
    finally:
        sys.argv = before
    assert isinstance(code, int)
    if code not in (0, 3):
        return Told(code, {}, {}, {}, err.getvalue())
    summary = json.loads(out.getvalue())
    notices = summary.get("warnings", [])
    return Told(code, {n["code"]: n["level"] for n in notices}, {n["code"]: n["message"] for n in notices}, summary)


def written(folder: Path, data: Dataset, name: str = "data.csv") -> Path:
    """Write data as a user has them, and return the file."""
    path = folder / name
    path.write_text(csv_text(data), encoding="utf-8")
    return path
