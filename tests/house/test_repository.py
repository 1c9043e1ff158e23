"""What the repository holds: images are whole, and capabilities have commands that the tests run."""

from __future__ import annotations

import inspect
import io
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.house.test_documents import ROOT, blocks

# -- images --------------------------------------------------------------------------------------------------------


Image.init()
IMAGES = sorted(
    path
    for folder in ("docs", "src", "tests", "benchmarks")
    for path in (ROOT / folder).rglob("*")
    if path.suffix.lower() in Image.EXTENSION and "_build" not in path.parts and ".env" not in path.parts
)


def decode(content: bytes) -> None:
    """Decode every pixel, and compare the sum of every chunk up to the last one."""
    with Image.open(io.BytesIO(content)) as image:
        image.load()
    with Image.open(io.BytesIO(content)) as image:
        image.verify()


def test_every_image_is_whole_and_no_text_to_git() -> None:
    binary = (ROOT / ".gitattributes").read_text().splitlines()
    assert IMAGES
    for path in IMAGES:
        try:
            decode(path.read_bytes())
        except (OSError, SyntaxError) as error:
            pytest.fail(f"{path}: {error}")
        assert f"*{path.suffix} binary" in binary, path


def test_damage_of_an_image_is_found() -> None:
    content = io.BytesIO()
    noise = np.random.default_rng(0).integers(256, size=(300, 300), dtype=np.uint8)
    Image.fromarray(noise).save(content, "PNG")
    whole = content.getvalue()
    decode(whole)
    middle = len(whole) // 2
    for damaged in (
        whole[:middle] + whole[middle + 2 :],  # as where a word was once taken out of all files, images among them
        whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :],
        whole[:-30],
        whole.replace(b"\r\n", b"\n"),
    ):
        with pytest.raises((OSError, SyntaxError)):
            decode(damaged)


# -- the page of all capabilities: each has a command that stands in a session of the guide ------------------------


DOCS = ROOT / "docs"
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
