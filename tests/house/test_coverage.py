"""The page of all capabilities: each has a command that stands in a session of the guide, which the tests run."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.house.test_documents import blocks

DOCS = Path(__file__).parents[2] / "docs"
PAGE = DOCS / "coverage.md"
ROWS = [
    f"{letter}{number}"
    for letter, count in (("M", 12), ("D", 12), ("S", 6), ("I", 9), ("C", 6), ("V", 5), ("U", 3))
    for number in range(1, count + 1)
]
#: What runs until it is stopped, and is tested by clicking through it.
CLICKED = {"U2": Path(__file__).parents[1] / "studio" / "test_story.py"}
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


@pytest.mark.parametrize("row", ROWS)
def test_the_tests_run_its_command(row: str) -> None:
    listed = LISTED[row]
    commands = re.findall(r"`(truearm [^`]+)`", listed["command"])
    if not commands:
        assert listed["what"].startswith("open: ")
        return
    (page,) = re.findall(r"\((guide/[a-z0-9-]+\.md)\)", listed["page"])
    if row in CLICKED:
        assert all(f"{command} " in (DOCS / page).read_text() for command in commands)
        assert "serve(folder, port=0, demo=True" in CLICKED[row].read_text()
        return
    run = sessions(DOCS / page)
    for command in commands:
        assert any(one.removeprefix("cd cell && ") == command for one in run), command
