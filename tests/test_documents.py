"""Every example in README and guide is run: console sessions with their output, Python blocks, captioned files."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs" / "guide").glob("*.md"))]
BLOCK = re.compile(r"^(?P<indent> *)```(?P<kind>\S+(?: \S+)?)\n(?P<body>.*?)^(?P=indent)```$", re.M | re.S)


def blocks(document: Path) -> list[tuple[str, str]]:
    found = []
    for match in BLOCK.finditer(document.read_text()):
        indent = len(match["indent"])
        found.append((match["kind"], "".join(line[indent:] for line in match["body"].splitlines(keepends=True))))
    return found


def fits(shown: str, came: str) -> bool:
    """Whether output is what a document shows; `...` stands for anything, runs of blanks do not count."""
    parts = [re.escape(" ".join(part.split())) for part in shown.split("...")]
    return re.fullmatch(r"\s*.*?\s*".join(parts), " ".join(came.split()), re.S) is not None


def run_session(session: str, folder: Path) -> None:
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    commands = re.split(r"^\$ ", session.replace("\\\n", " "), flags=re.M)[1:]
    assert commands
    for entry in commands:
        command, _, shown = entry.partition("\n")
        code = re.search(r"^\[exit (\d+)\]\n", shown, re.M)
        done = subprocess.run(["sh", "-c", command], cwd=folder, env=environment, capture_output=True, text=True)
        assert done.returncode == (int(code[1]) if code else 0), f"{command}\n{done.stdout}{done.stderr}"
        shown = shown.replace(code[0], "") if code else shown
        if shown.strip():
            assert fits(shown, done.stdout + done.stderr), f"{command} printed:\n{done.stdout}{done.stderr}"


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda p: p.name)
def test_the_examples_run_as_shown(document: Path, tmp_path: Path) -> None:
    ran = 0
    for kind, body in blocks(document):
        if kind.startswith("{code-block}"):
            caption, _, content = body.partition("\n")
            (tmp_path / caption.removeprefix(":caption:").strip()).write_text(content)
    for kind, body in blocks(document):
        if kind == "console":
            if "session/" in body and not (tmp_path / "session").exists() and "truearm example" not in body:
                run_session("$ truearm example session\n", tmp_path)
            run_session(body, tmp_path)
            ran += 1
        elif kind == "python":
            done = subprocess.run([sys.executable, "-c", body], cwd=tmp_path, capture_output=True, text=True)
            assert done.returncode == 0, done.stderr
            ran += 1
    if document.name != "results.md":
        assert ran


def test_every_relative_link_leads_somewhere() -> None:
    for document in [*DOCUMENTS, ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")]:
        for link in re.findall(r"\]\(([^)#:]+)\)", document.read_text()):
            assert (document.parent / link).exists(), f"{document.name}: {link}"
