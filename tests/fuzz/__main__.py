"""Damage inputs and see what truearm makes of them: ``script/fuzz``.

Every case is a kind and a number: the same ones give the same case. Without a finding it ends with code 0.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from itertools import count
from pathlib import Path

from tests.fuzz.cases import KINDS, findings
from tests.fuzz.commands import limit_memory

#: About how many files are read while one job, or one command, runs.
_COST = {"read": 1, "job": 12, "command": 5}


def _cases(kinds: tuple[str, ...], first: int, used: dict[str, float], most: int | None) -> Iterator[tuple[str, int]]:
    """Give cases for ever, or so many of each kind, of the kind that has had the least time."""
    number = {kind: count(first) for kind in kinds}
    left = {kind: most if most is None else max(1, most // _COST[kind.partition("-")[0]]) for kind in kinds}
    while left:
        kind = min(left, key=lambda kind: used[kind] / (5.0 if kind == "command" else 1.0))
        yield kind, next(number[kind])
        if (rest := left[kind]) is not None:
            left[kind] = rest - 1
            if rest == 1:
                del left[kind]


def main() -> int:
    """Run cases until the time is over."""
    asked = argparse.ArgumentParser(prog="script/fuzz", description=__doc__)
    asked.add_argument("--seconds", type=float, default=600.0, help="of the processor, 600 unless told")
    asked.add_argument("--first", type=int, default=0, help="number of the first case of each kind")
    asked.add_argument("--only", action="append", default=[], help="kinds that begin so; several may be given")
    asked.add_argument(
        "--most", type=int, help="files for each reader, fewer calls of jobs and commands; the same ones each time"
    )
    asked.add_argument("--case", metavar="KIND:NUMBER", help="this case alone")
    asked.add_argument("--keep", type=Path, metavar="DIR", help="keep the files of the case in this folder")
    given = asked.parse_args()
    warnings.simplefilter("error")
    limit_memory()
    if given.case is not None:
        kind, _, number = given.case.partition(":")
        if given.keep is not None:
            given.keep.mkdir(parents=True)
        found = findings(kind, int(number), given.keep)
        print("\n".join(found) or "nothing")  # noqa: T201
        return int(bool(found))
    kinds = tuple(kind for kind in KINDS if not given.only or kind.startswith(tuple(given.only)))
    used, done, wrong = dict.fromkeys(kinds, 0.0), Counter[str](), 0
    began = time.monotonic()
    with suppress(KeyboardInterrupt):
        for kind, number in _cases(kinds, given.first, used, given.most):
            if sum(used.values()) > given.seconds:
                break
            start, clock = time.process_time(), time.monotonic()
            found = findings(kind, number)
            used[kind] += (time.monotonic() - clock if kind == "command" else time.process_time() - start) + 1e-4
            done[kind] += 1
            for words in found:
                wrong += 1
                print(f"script/fuzz --case {kind}:{number}  # {words}", flush=True)  # noqa: T201
    commands = done.pop("command", 0)
    print(  # noqa: T201
        f"{sum(done.values())} inputs in process, {commands} commands, {wrong} findings in "
        f"{time.monotonic() - began:.0f} s; fewest of {min(done or {'command': 0}, key=lambda kind: done[kind])}."
    )
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
