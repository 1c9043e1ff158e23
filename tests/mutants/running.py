"""Puts faults into a copy of the tree and runs the tests that executed their lines, the nearest and quickest first."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from coverage import CoverageData
from tests.mutants.tree import ROOT, Function, Mutant

#: Most tests for a fault, most of one test function, and most seconds that they took when coverage was measured.
MOST_TESTS, MOST_ALIKE, MOST_SECONDS = 100, 8, 60.0
FOUND, SURVIVED, TIMED_OUT, NO_TEST, GONE = "found", "not found", "timed out", "no test", "gone"


def copy_of_the_tree(folder: Path) -> Path:
    """Copy what is tracked, and what would be, with the times of the files."""
    names = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split("\0")
    for name in filter(None, names):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    return folder


def pytest(copy: Path, *words: str, timeout: float | None = None) -> tuple[int | None, str]:
    """Run pytest in a copy of the tree: its exit code, None when it was stopped, and what it printed."""
    data = os.environ.get("TRUEARM_DATA") or str(ROOT.parent / "shared" / "data")
    env = os.environ | {"PYTHONPATH": str(copy / "src"), "TRUEARM_DATA": data, "OPENBLAS_NUM_THREADS": "1"}
    run = subprocess.Popen(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *words],
        cwd=copy,
        env=env,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
    )
    try:
        return (run.communicate(timeout=timeout)[0], run.returncode)[::-1]
    except subprocess.TimeoutExpired:
        os.killpg(run.pid, signal.SIGKILL)
        return None, run.communicate()[0]


def collected(copy: Path) -> list[str]:
    """Give the names of all tests."""
    code, printed = pytest(copy, "--collect-only")
    assert code == 0, printed[-2000:]
    return [line for line in printed.splitlines() if "::" in line]


def failed(printed: str, tests: list[str]) -> list[str]:
    """Give the tests that pytest says have failed."""
    said = [line.partition(" ")[2] for line in printed.splitlines() if line.startswith(("FAILED ", "ERROR "))]
    found = (max((t for t in tests if line.startswith(t)), key=len, default=None) for line in said)
    return [test for test in found if test is not None]


@dataclass
class Choice:
    """Chooses tests for a fault: by coverage, or only the test that found it last time."""

    tests: list[str]
    data: CoverageData | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    wrong: set[str] = field(default_factory=set)

    @classmethod
    def of(cls, tests: list[str], coverage: Path | None, junit: Path | None) -> Choice:
        """Read the data of coverage and the times of the tests."""
        choice = cls(tests)
        if coverage is not None:
            choice.data = CoverageData(basename=str(coverage))
            choice.data.read()
        if junit is not None:
            for case in ElementTree.parse(junit).iter("testcase"):
                name = f"{case.get('classname', '').replace('.', '/')}.py::{case.get('name')}"
                choice.seconds[name] = float(case.get("time", 0.0))
        return choice

    def _executed(self, function: Function, index: int) -> set[str]:
        """Give the tests that executed the node, or that share what was made by it for another test of their file.

        What only processes execute that tests start is not measured: then it may be any test.
        """
        if self.data is None:
            return set()
        file = next((f for f in self.data.measured_files() if Path(f).match(str(function.path))), None)
        by_line = {} if file is None else self.data.contexts_by_lineno(file)
        for lines in function.lines(index):
            contexts = {context for line in lines for context in by_line.get(line, ()) if context}
            if contexts:
                shared = tuple(c.partition("::")[0] + "::" for c in contexts if c.endswith("|setup"))
                own = {context.rpartition("|")[0] for context in contexts}
                return {test for test in self.tests if test in own or test.startswith(shared)}
        return set(self.tests)

    def again(self, mutant: Mutant) -> list[str]:
        """Give the test that found it last time; if it has moved, those of its name."""
        if mutant.by is None or mutant.by in self.wrong:
            return []
        name = mutant.by.partition("::")[2]
        return [mutant.by] if mutant.by in self.tests else [t for t in self.tests if t.partition("::")[2] == name][:3]

    def others(self, mutant: Mutant, function: Function) -> list[str]:
        """Give the tests chosen by coverage, in the order in which they are run."""
        words = set(re.split(r"[\W_]+", f"{function.path.with_suffix('')} {function.name}".lower()))

        def cost(test: str) -> float:
            near = len(words & set(re.split(r"[\W_]+", test.lower())))
            return float((0.1 + self.seconds.get(test, 1.0)) * 0.3**near)

        chosen, alike, left = self.again(mutant), Counter[str](), MOST_SECONDS
        for test in sorted(
            self._executed(function, mutant.index) - self.wrong - set(chosen), key=lambda t: (cost(t), t)
        ):
            of, took = test.partition("[")[0], self.seconds.get(test, 1.0)
            if alike[of] < MOST_ALIKE and took <= left and len(chosen) < MOST_TESTS:
                chosen.append(test)
                alike[of] += 1
                left -= took
        files = list(dict.fromkeys(test.partition("::")[0] for test in chosen))
        return sorted(chosen, key=lambda test: files.index(test.partition("::")[0]))

    def longest(self, tests: list[str]) -> float:
        """Give the seconds after which tests are stopped: only a fault makes them so slow."""
        return 120.0 + 3.0 * sum(self.seconds.get(test, 1.0) for test in tests)


def tried(copy: Path, mutant: Mutant, function: Function, choice: Choice) -> tuple[str, str | None]:
    """Put a fault into the copy, run its tests and take it out: what came of it, and the test that found it."""
    parts = [part for part in (choice.again(mutant), choice.others(mutant, function)) if part]
    file, original = copy / function.path, ROOT / function.path
    file.write_text(function.mutated(original.read_text(encoding="utf-8"), mutant), encoding="utf-8")
    try:
        for tests in parts:
            code, printed = pytest(copy, "-x", *tests, timeout=choice.longest(tests))
            if code != 0:
                return TIMED_OUT if code is None else FOUND, next(iter(failed(printed, tests)), tests[0])
    finally:
        shutil.copy2(original, file)
    return SURVIVED if parts else NO_TEST, None
