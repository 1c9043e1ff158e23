"""Lines and branches that the tests execute, compared with those at the mark."""

from __future__ import annotations

import json
import tempfile
from collections import Counter
from pathlib import Path

from coverage import Coverage
from tests.mutants.drawing import LEFT_OUT
from tests.mutants.tree import PACKAGE, ROOT

FILE = Path(__file__).with_name("coverage.json")
#: Percent points that differ between two runs of the same tests.
NOISE = 0.1
WHOLE, REST = "whole", f"without {' and '.join(LEFT_OUT)}"
Shares = dict[str, dict[str, float]]


def shares(data: Path) -> Shares:
    """Give percent and missing counts of each top-level folder, of all, and of all that stays."""
    measured = Coverage(data_file=str(data))
    measured.load()
    with tempfile.TemporaryDirectory() as folder:
        # Code that a dataclass or NamedTuple makes is measured, too, and has no file.
        measured.json_report(outfile=str(Path(folder) / "report.json"), ignore_errors=True)
        files = json.loads((Path(folder) / "report.json").read_text())["files"]
    counts: dict[str, Counter[str]] = {}
    for file, entry in files.items():
        within = (ROOT / file).as_posix().partition(f"/{PACKAGE.as_posix()}/")[2]
        room = within.partition("/")[0] if "/" in within else "."
        for total in (room, WHOLE, *([] if room in LEFT_OUT else [REST])):
            counts.setdefault(total, Counter()).update({k: v for k, v in entry["summary"].items() if type(v) is int})
    return {
        room: {
            "lines": round(100.0 * count["covered_lines"] / max(count["num_statements"], 1), 2),
            "missing lines": count["missing_lines"],
            "branches": round(100.0 * count["covered_branches"] / max(count["num_branches"], 1), 2),
            "missing branches": count["missing_branches"],
        }
        for room, count in sorted(counts.items())
    }


def worse(now: Shares, mark: Shares) -> list[str]:
    """Say which totals are lower than at the mark; folders may change, so only totals are compared."""
    return [
        f"{kind} {total}: {now[total][kind]:.2f} %, at the mark {mark[total][kind]:.2f} %"
        for total in (WHOLE, REST)
        for kind in ("lines", "branches")
        if now[total][kind] < mark[total][kind] - NOISE
    ]


def compare(data: Path, mark: bool) -> int:
    """Print what is covered; end with code 1 when it is less than at the mark."""
    now = shares(data)
    for room, share in now.items():
        print(f"{room:28}" + "  ".join(f"{kind} {value:g}" for kind, value in share.items()))  # noqa: T201
    if mark:
        FILE.write_text(json.dumps(now, indent=1) + "\n")
        return 0
    less = worse(now, json.loads(FILE.read_text()))
    print("\n".join(less) or "Not less than at the mark.")  # noqa: T201
    return int(bool(less))
