"""Faults that the tests should find: draw them, run them, and compare with what was found when the mark was set.

    python -m tests.mutants draw [--again]      100 faults; or only new ones for those that are gone
    python -m tests.mutants run --coverage DATA --junit XML [--workers 2] [--only 3/8] [--mark]
    python -m tests.mutants coverage DATA [--mark]

The data are those of `pytest --cov=truearm --cov-branch --cov-context=test --junitxml=XML`, measured on this tree.
Without them only the tests run that found a fault at the mark. `run` ends with code 1 when one of those is not found.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from queue import SimpleQueue

from tests.mutants.drawing import drawn
from tests.mutants.measured import compare
from tests.mutants.running import FOUND, GONE, TIMED_OUT, Choice, collected, copy_of_the_tree, failed, pytest, tried
from tests.mutants.tree import Function, Mutant, all_functions, found_again

FILE = Path(__file__).with_name("mutants.json")


def stored() -> list[Mutant]:
    """Give the faults that are kept."""
    return [Mutant(**entry) for entry in json.loads(FILE.read_text(encoding="utf-8"))]


def store(mutants: list[Mutant]) -> None:
    """Keep these faults."""
    FILE.write_text(json.dumps([asdict(m) for m in mutants], indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def draw(again: bool) -> int:
    """Draw all faults, or only new ones for those that are gone."""
    among = all_functions()
    kept = [mutant for mutant in stored() if found_again(mutant, among)] if again else []
    new = drawn(among, kept)
    store(new)
    print(f"{len(new) - len(kept)} drawn, {len(kept)} kept. Mark them: python -m tests.mutants run --mark")  # noqa: T201
    return 0


def run(given: argparse.Namespace) -> int:
    """Run the tests on each fault and compare with the mark."""
    mutants, among = stored(), all_functions()
    part, _, parts = given.only.partition("/")
    asked = range(int(part) - 1, len(mutants), int(parts))
    where = {number: found_again(mutants[number], among) for number in asked}
    came: dict[int, tuple[str, str | None]] = {number: (GONE, None) for number in asked if where[number] is None}
    copies: SimpleQueue[Path] = SimpleQueue()

    def one(number: int, function: Function) -> None:
        copy, began = copies.get(), time.monotonic()
        came[number] = result, by = tried(copy, mutants[number], function, choice)
        copies.put(copy)
        print(_line(number, mutants[number], f"{result} {time.monotonic() - began:.0f} s", by), flush=True)  # noqa: T201

    with tempfile.TemporaryDirectory(prefix="truearm-mutants-") as folder, ThreadPoolExecutor(given.workers) as pool:
        for worker in range(given.workers):
            copies.put(copy_of_the_tree(Path(folder) / str(worker) / "tree"))
        clean = copy_of_the_tree(Path(folder) / "clean" / "tree")
        choice = Choice.of(collected(clean), given.coverage, given.junit)
        todo = {number: function for number, function in where.items() if function is not None}
        while todo:
            list(pool.map(one, todo, todo.values()))
            # A test that fails without a fault as well finds none.
            by = sorted({test for number in todo if (test := came[number][1]) is not None})
            wrong = set(failed(pytest(clean, *by)[1], by)) if by else set()
            choice.wrong |= wrong
            todo = {number: function for number, function in todo.items() if came[number][1] in wrong}
    before = lost(mutants, came)
    for number in asked:
        if came[number][0] not in (FOUND, TIMED_OUT):
            print(_line(number, mutants[number], *came[number]))  # noqa: T201
        if given.mark and came[number][0] != GONE:
            mutants[number].found, mutants[number].by = came[number][1] is not None, came[number][1]
    if given.mark:
        store(mutants)
    counts = Counter(result for result, _ in came.values())
    print(f"{len(came)} faults: " + ", ".join(f"{count} {result}" for result, count in counts.most_common()))  # noqa: T201
    if before and not given.mark:
        print(f"Found at the mark and not now: {', '.join(str(number + 1) for number in before)}")  # noqa: T201
    return int(bool(before) and not given.mark)


def lost(mutants: list[Mutant], came: dict[int, tuple[str, str | None]]) -> list[int]:
    """Give those that were found at the mark, that are still in the tree, and that are not found now."""
    return [n for n, (result, _) in sorted(came.items()) if mutants[n].found and result not in (FOUND, TIMED_OUT, GONE)]


def _line(number: int, mutant: Mutant, result: str, by: str | None) -> str:
    before, after = (" ".join(text.split())[:50] for text in (mutant.before, mutant.after))
    return f"{number + 1:3} {result:14} {mutant.name} ({mutant.operator}): {before} -> {after}  {by or ''}"


def main() -> int:
    """Do what is asked."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = asked.add_subparsers(dest="command", required=True)
    drawing = commands.add_parser("draw")
    drawing.add_argument("--again", action="store_true", help="keep those that are not gone")
    running = commands.add_parser("run")
    running.add_argument("--coverage", type=Path, help="data file of coverage.py with a context for each test")
    running.add_argument("--junit", type=Path, help="pytest's XML file: the time of each test")
    running.add_argument("--workers", type=int, default=1)
    running.add_argument("--only", default="1/1", metavar="I/N", help="each N-th fault, beginning with the I-th")
    running.add_argument("--mark", action="store_true", help="keep what is found as the mark")
    measured = commands.add_parser("coverage")
    measured.add_argument("data", type=Path)
    measured.add_argument("--mark", action="store_true", help="keep what is covered as the mark")
    given = asked.parse_args()
    if given.command == "draw":
        return draw(given.again)
    return run(given) if given.command == "run" else compare(given.data, given.mark)


if __name__ == "__main__":
    sys.exit(main())
