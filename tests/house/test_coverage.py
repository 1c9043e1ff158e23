"""The page of all capabilities: each has a command that stands in a session of the guide, which the tests run."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

from tests.house.test_documents import blocks

DOCS = Path(__file__).parents[2] / "docs"
PAGE = DOCS / "coverage.md"
ROWS = [
    f"{letter}{number}"
    for letter, count in (("M", 12), ("D", 12), ("S", 6), ("I", 9), ("C", 6), ("V", 5), ("U", 3))
    for number in range(1, count + 1)
]
#: What runs until it is stopped, and is tested by clicking through it.
CLICKED = "U2"
TABLE = re.compile(r"^\| (?P<row>[A-Z]\d+) \| (?P<what>[^|]+) \| [^|]+ \|(?P<command>[^|]*)\|(?P<page>[^|]*)\|$", re.M)
LISTED = {match["row"]: match for match in TABLE.finditer(PAGE.read_text())}


def sessions(page: Path) -> list[str]:
    """Return the commands that the tests run of a page."""
    bodies = [body.replace("\\\n", "") for kind, body in blocks(page) if kind == "console"]
    shown = [line[2:] for body in bodies for line in body.splitlines() if line.startswith("$ ")]
    return [" ".join(command.split()) for command in shown]


def test_every_capability_is_listed_once() -> None:
    assert list(LISTED) == ROWS
    assert len(TABLE.findall(PAGE.read_text())) == len(ROWS) == 53


def shown(row: str) -> tuple[list[str], Path]:
    """Return the commands of a capability, and the page of the guide that shows them."""
    (page,) = re.findall(r"\((guide/[a-z0-9-]+\.md)\)", LISTED[row]["page"])
    return re.findall(r"`(truearm [^`]+)`", LISTED[row]["command"]), DOCS / page


def test_the_tests_run_its_command() -> None:
    for row in ROWS:
        if row == CLICKED or LISTED[row]["what"].startswith("open: "):
            continue
        commands, page = shown(row)
        assert commands, row
        run = {one.removeprefix("cd cell && ").replace(" --details", "") for one in sessions(page)}
        assert {*commands} <= run, row


def test_what_runs_until_it_is_stopped_is_clicked_through() -> None:
    from tests.studio import test_story

    commands, page = shown(CLICKED)
    assert commands
    assert all(f"{command} " in page.read_text() for command in commands)
    assert "serve(folder, port=0, demo=True" in inspect.getsource(test_story)
