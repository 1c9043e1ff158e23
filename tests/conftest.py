"""Makes the tests' own helpers importable as ``tests.<room>.<helper>``, however pytest is started."""

import gc
import os
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.commanding import demonstrated, small, truearm

__all__ = ["demonstrated", "small", "truearm"]


@pytest.fixture(scope="session", autouse=True)
def files_that_need_not_outlive_the_machine() -> Iterator[None]:
    """Leave files of tests to the system to write to disk when it likes: waiting for the disk is most of their time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: None)
        yield


#: Where pages are looked at as a browser shows them.
DRAWN = (
    *(
        "tests/studio/",
        "tests/engine/document/",
        "tests/calibration/test_report",
        "tests/compensation/test_program_picture",
    ),
    *("tests/fleets/test_analysis", "tests/simulation/test_influence_figures"),
)


@pytest.fixture(scope="module", autouse=True)
def pages_without_what_draws_them(request: pytest.FixtureRequest) -> Iterator[None]:
    """Leave Plotly's own script out of the pages: hundreds are written here, and that makes each of them 5 MB."""
    with pytest.MonkeyPatch.context() as patch:
        if not request.node.nodeid.startswith(DRAWN):
            patch.setattr("truearm.engine.document.page._plotly", lambda: "/* plotly.js */")
        yield


#: Where plans themselves are looked at, and not made for what comes after them.
PLANNING = (
    *("tests/studio/", "tests/recordings/", "tests/house/test_documents", "tests/house/test_measured"),
    *("tests/planning/test_measurement_plan", "tests/planning/test_reachable"),
)


@pytest.fixture(scope="module", autouse=True)
def plans_judged_at_few_numbers_of_poses(request: pytest.FixtureRequest) -> Iterator[None]:
    """Judge plans at few numbers of poses: all of them take most of a plan's time, and are tested with the planning."""
    with pytest.MonkeyPatch.context() as patch:
        if not request.node.nodeid.startswith(PLANNING):
            patch.setattr("truearm.planning.accuracy.NUMBERS", (8, 30))
        yield


@pytest.fixture(scope="session")
def measured_data() -> Path:
    """Folder of the real measurements, which are not part of the repository."""
    folder = Path(os.environ.get("TRUEARM_DATA") or Path(__file__).parents[1].parent / "shared" / "data")
    if not (folder / "irb120-faro").is_dir():
        pytest.skip(f"no measured data in {folder}; name their folder in TRUEARM_DATA")
    return folder


#: Files that copy their process hundreds of times, which takes ten times as long once it has grown: begun first of all.
COPYING = "tests/house/test_killed_runs.py"
#: Files whose tests, or what they share, take seconds each: begun first, no process is left alone with them at the end.
LONG = ("tests/house/test_documents.py", "tests/house/test_measured.py", "tests/engine/twin/", "tests/papers/")
#: What takes a second or more and is left to ``script/test --all``: functions of tests, or whole files.
SLOW = frozenset(Path(__file__).with_name("slow.txt").read_text().split())


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let a part of the tests be chosen: ``--part 3/8``."""
    parser.addoption("--part", default="1/1", metavar="I/N", help="the I-th of N parts of the tests")


def pytest_configure() -> None:
    """Collect no garbage while tests are collected: nearly all that is made then stays, and is looked at in vain."""
    gc.disable()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what is slow, choose a part, and put slow files first; within a file the order stays, for what is shared."""
    number, of = map(int, config.getoption("--part").split("/"))
    items[:] = [item for item in items if zlib.crc32(item.nodeid.encode()) % of == number - 1]
    for item in items:
        file, _, name = item.nodeid.partition("::")
        if SLOW & {file, item.nodeid, f"{file}::{name.partition('[')[0]}"}:
            item.add_marker(pytest.mark.slow)
    items.sort(key=lambda item: (not item.nodeid.startswith(COPYING), not item.nodeid.startswith(LONG)))


def pytest_collection_finish() -> None:
    """Keep what is loaded now, and stays, out of every later garbage collection."""
    gc.collect()
    gc.freeze()
    gc.enable()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say loudly that tests on measured data did not run: without them no figure on a real robot was checked."""
    skipped = [r for r in terminalreporter.stats.get("skipped", []) if "no measured data" in str(r.longrepr)]
    if skipped:
        terminalreporter.section("MEASURED DATA ARE MISSING", sep="!", red=True, bold=True)
        terminalreporter.line(
            f"{len(skipped)} tests on real robots were skipped: nothing above says how well measured robots are"
            " calibrated. Name the folder of the data in TRUEARM_DATA."
        )
