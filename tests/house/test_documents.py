"""Every example in README and guide is run: console sessions with their output, Python blocks, captioned files.

Commands of truearm and Python blocks run in this process, which is many times faster than a process for each; other
commands and pipelines go to the shell.
"""

from __future__ import annotations

import io
import os
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout
from hashlib import sha256
from pathlib import Path
from typing import get_args

import pytest
from tests.house.test_options import TWICE, declared_apart

from truearm.commands import main
from truearm.engine.base.limits import LIMITS
from truearm.engine.diagnose.changes import Kind

ROOT = Path(__file__).parents[2]
ARCHITECTURE = ROOT / "docs" / "architecture.md"
GUIDE = sorted((ROOT / "docs" / "guide").glob("*.md"))
NOTICES = ROOT / "docs" / "guide" / "notices.md"
DOCUMENTS = [ROOT / "README.md", ROOT / "docs" / "api.md", *(page for page in GUIDE if page != NOTICES)]
#: Pages that are one session from top to bottom; elsewhere every block of Python stands for itself.
SESSIONS = ("api.md", "notebook.md")
PAGES = [
    ROOT / "README.md",
    *GUIDE,
    ROOT / "CHANGELOG.md",
    ROOT / "CONTRIBUTING.md",
    *sorted((ROOT / "docs").glob("*.md")),
]
BLOCK = re.compile(r"^(?P<indent> *)```(?P<kind>\S+(?: \S+)?)\n(?P<body>.*?)^(?P=indent)```$", re.M | re.S)
#: A command of truearm alone, perhaps in a folder: no pipeline, no other program.
ALONE = re.compile(r"(?:cd (?P<folder>\S+) && )?truearm (?P<words>[^|&;<>$`]*)")


def blocks(document: Path) -> list[tuple[str, str]]:
    found = []
    for match in BLOCK.finditer(document.read_text()):
        indent = len(match["indent"])
        found.append((match["kind"], "".join(line[indent:] for line in match["body"].splitlines(keepends=True))))
    return found


def fits(shown: str, came: str) -> bool:
    """Whether output is what a document shows; `...` stands for anything, runs of blanks do not count."""
    came = " ".join(came.split())
    first, *rest = [" ".join(part.split()) for part in shown.split("...")]
    if not rest:
        return came == first
    place = len(first)
    for part in rest[:-1]:
        found = came.find(part, place)
        if found < 0:
            return False
        place = found + len(part)
    return came.startswith(first) and came.endswith(rest[-1]) and len(came) >= place + len(rest[-1])


@contextmanager
def arguments(words: list[str]) -> Iterator[None]:
    before = sys.argv
    sys.argv = words
    try:
        yield
    finally:
        sys.argv = before


#: What commands printed, and the files that they wrote, by their words and all files of the folder they ran in.
DONE: dict[tuple[str, ...], tuple[int, str, dict[str, bytes]]] = {}


def files_in(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def run_once(command: str, folder: Path) -> tuple[int, str]:
    """Run a command, or give again what it did in another folder: pages share sessions, such as the demo's.

    Only the files that a command names can matter to it; where nothing of that name is there, it writes it.
    """
    if ALONE.fullmatch(command.strip()) is None:
        return run_command(command, folder)
    before, words = files_in(folder), shlex.split(command)
    named = {word.split("/")[0] for word in words}
    read = [f"{name}={sha256(content).hexdigest()}" for name, content in before.items() if name.split("/")[0] in named]
    key = (*words, *sorted(read))
    if key not in DONE:
        code, printed = run_command(command, folder)
        DONE[key] = code, printed, {name: text for name, text in files_in(folder).items() if before.get(name) != text}
        return code, printed
    code, printed, written = DONE[key]
    for name, content in written.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return code, printed


def run_command(command: str, folder: Path) -> tuple[int, str]:
    """Return the exit code of a command, and what it printed."""
    alone = ALONE.fullmatch(command.strip())
    if alone is None:
        environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
        done = subprocess.run(["sh", "-c", command], cwd=folder, env=environment, capture_output=True, text=True)
        return done.returncode, done.stdout + done.stderr
    code, out, err = 0, io.StringIO(), io.StringIO()
    words = ["truearm", *shlex.split(alone["words"])]
    with chdir(folder / (alone["folder"] or "")), arguments(words), redirect_stdout(out), redirect_stderr(err):
        try:
            main()
        except SystemExit as end:
            code = int(end.code or 0)
    return code, out.getvalue() + err.getvalue()


def run_session(session: str, folder: Path) -> None:
    commands = re.split(r"^\$ ", session.replace("\\\n", " "), flags=re.M)[1:]
    assert commands
    for entry in commands:
        command, _, shown = entry.partition("\n")
        code = re.search(r"^\[exit (\d+)\]\n", shown, re.M)
        came, printed = run_once(command, folder)
        assert came == (int(code[1]) if code else 0), f"{command}\n{printed}"
        shown = shown.replace(code[0], "") if code else shown
        if shown.strip():
            assert fits(shown, printed), f"{command} printed:\n{printed}"


def run_python(body: str, names: dict[str, object], folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run a block after those before it; comment lines below a print are lines of what it prints."""
    out, known = io.StringIO(), set(sys.modules)
    with monkeypatch.context() as patch, chdir(folder), redirect_stdout(out):
        patch.syspath_prepend(str(folder))
        exec(compile(body, "example", "exec"), names)
    for name in set(sys.modules) - known:
        if getattr(sys.modules[name], "__file__", None) == str(folder / f"{name}.py"):
            del sys.modules[name]  # an example's own module
    printed = out.getvalue().splitlines()
    for shown in re.findall(r"^(?:print\(.*|\))\n((?:# .*\n)+)|^(?: +print\(.*|    \))\n((?:# .*\n)+)", body, re.M):
        for line in "".join(shown).splitlines():
            assert any(fits(line[2:], each) for each in printed), f"{line}\nis not in\n{out.getvalue()}"


def test_output_is_compared_as_the_documents_mean_it() -> None:
    assert fits("mean 0.07...  max ... mm\nStatus: converged", "mean 0.073  max 0.178 mm\n\n Status: converged\n")
    assert fits("...", "")
    assert not fits("mean 0.08... mm", "mean 0.073 mm")
    assert not fits("a ... b", "a b c")
    assert not fits("a b ... b c", "a b c")
    assert not fits("one", "one two")


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda p: p.name)
def test_the_examples_run_as_shown(document: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ran, names = 0, dict[str, object]()
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
            if document.name not in SESSIONS:
                names = {}
            run_python(body, names, tmp_path, monkeypatch)
            ran += 1
    if document.name != "results.md":
        assert ran


def test_every_relative_link_leads_somewhere() -> None:
    for document in PAGES:
        for link, anchor in re.findall(r"\]\(([^)#:\s]*)(#[^)\s]+)?\)", document.read_text()):
            page = document.parent / link if link else document
            assert page.exists(), f"{document.name}: {link}"
            if anchor:
                assert anchor[1:] in anchors_of(page), f"{document.name}: {link}{anchor}"


def anchors_of(page: Path) -> set[str]:
    """Return what links can point to: the headings, in small letters, blanks as hyphens, no signs."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(), re.M)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_every_page_stands_in_the_index() -> None:
    index = (ROOT / "docs" / "index.md").read_text()
    for page in [*GUIDE, *(ROOT / "docs").glob("*.md")]:
        name = page.relative_to(ROOT / "docs").with_suffix("").as_posix()
        if name != "index":
            assert f"({name}.md)" in index, f"{name} has no line in the index"
            assert f"\n{name}\n" in index, f"{name} is in no list of pages"


def test_pages_that_can_be_skipped_say_so_themselves_and_in_the_index() -> None:
    lines = (ROOT / "docs" / "index.md").read_text().splitlines()
    for page in GUIDE:
        entry = next(line for line in lines if f"(guide/{page.name})" in line)
        says_so = page.read_text().splitlines()[2].startswith("*You can skip this page")
        assert says_so == ("*(special)*" in entry), page.name


def test_every_word_of_the_glossary_leads_to_a_page_that_uses_it() -> None:
    entries = re.split(r"^## ", (ROOT / "docs" / "glossary.md").read_text(), flags=re.M)[1:]
    words = [entry.splitlines()[0] for entry in entries]
    assert words == sorted(words, key=str.lower)
    for entry in entries:
        assert re.search(r"\]\((guide/|architecture|#)", entry), f"{entry.splitlines()[0]} leads nowhere"


#: "Lomb 1976", "Holland and Welsch (1977)", "Li et al. 2016", "Mooring, 1983": the last name and the year.
CITATION = re.compile(r"\b([A-Z][A-Za-z-]+)(?: et al\.| and others)?,? \(?((?:18|19|20)\d\d)\b")


def test_every_source_that_is_cited_stands_in_the_bibliography() -> None:
    entries = re.split(r"\n(?=- |\n)", (ROOT / "docs" / "bibliography.md").read_text())
    sources = ROOT / "src" / "truearm"
    cited = 0
    for file in sorted([*sources.rglob("*.py"), *sources.rglob("*.yaml"), *(ROOT / "docs" / "guide").glob("*.md")]):
        text = re.sub(r"\s+#?\s*", " ", file.read_text())
        for name, year in CITATION.findall(text):
            cited += 1
            assert any(name in entry and year in entry for entry in entries), f"{file.name}: {name} {year}"
    assert cited > 40


def test_every_file_that_the_architecture_names_is_there() -> None:
    folders = [ROOT / name for name in ("src", "papers", "tests")]
    places = [place for folder in folders for place in (folder, *folder.rglob("*"))]
    files = [f"/{place.relative_to(ROOT).as_posix()}" for place in places]
    named = set(re.findall(r"[\w/]*\w\.py\b|\b[a-z]\w+(?:/\w+)*/(?=[`\s,])", ARCHITECTURE.read_text()))
    assert len(named) > 110
    for name in named:
        assert any(file.endswith(f"/{name.rstrip('/')}") for file in files), name


def test_the_architecture_names_every_part_of_the_package_in_the_order_of_the_contract() -> None:
    house = re.search(r"^    engine/\n.*?\n\n", ARCHITECTURE.read_text(), re.M | re.S)
    assert house
    package = ROOT / "src" / "truearm"
    for place in package.iterdir():
        if place.name != "__pycache__":
            name = f"{place.name}/" if place.is_dir() else place.name
            assert re.search(rf"(?<![\w/.]){re.escape(name)}(?![\w/])", house[0]), f"{name} is not there"
    contract = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"][1]
    rooms = [part.strip() for layer in reversed(contract["layers"]) for part in layer.split("|")]
    named = [f"truearm.engine.{name}" for name in re.findall(r"^ {8}(\w+)/", house[0], re.M)]
    assert named == rooms
    assert {path.name for path in (package / "engine").iterdir() if path.is_dir()} - {"__pycache__"} == {
        name.rpartition(".")[2] for name in named
    }


def test_the_architecture_can_be_read_at_one_sitting() -> None:
    assert len(ARCHITECTURE.read_text().splitlines()) <= 250


#: Where notices are read that others wrote: from robot files, from results.
READ_BACK = ("engine/robot/robot_file/reading.py", "engine/command/split.py", "studio/measuring.py", "studio/pages/")


def sources() -> dict[str, str]:
    """Return the text of every file of the package."""
    package = ROOT / "src" / "truearm"
    return {file.relative_to(package).as_posix(): file.read_text() for file in sorted(package.rglob("*.py"))}


def test_the_page_of_notices_is_made_from_the_rules() -> None:
    run = subprocess.run([sys.executable, ROOT / "script" / "notices.py"], capture_output=True, text=True)
    assert (run.returncode, run.stderr) == (0, "")


def test_notices_are_made_by_rules_and_every_rule_makes_some() -> None:
    texts = sources()
    for name, text in texts.items():
        if name != "engine/base/errors.py" and not name.startswith(READ_BACK):
            assert not re.search(r"\bNotice\(", text), name
    rules = [rule for text in texts.values() for rule in re.findall(r"^(\w+): Final = Rule\(", text, re.M)]
    used = {word for text in texts.values() for word in re.findall(r"\b\w+\b(?!: Final)", text)}
    assert len(rules) > 200
    assert [rule for rule in rules if rule not in used] == []


def test_every_code_of_a_next_step_stands_in_the_guide() -> None:
    text = (ROOT / "docs" / "guide" / "results.md").read_text().split("## What to do next")[1].split("\n## ")[0]
    codes = set(get_args(Kind)).union(*(re.findall(r'\bNextStep\(\s*"([\w-]+)"', code) for code in sources().values()))
    assert len(codes) > 12
    for code in codes:
        assert f"`{code}`" in text, code


def test_every_limit_stands_in_the_guide() -> None:
    text = (ROOT / "docs" / "guide" / "data.md").read_text().replace(" ", "")
    for name, limit in LIMITS.items():
        assert f"|`{name}`|{limit.most}|" in text, f"{name} is {limit.most}"


def test_no_option_is_excused_that_is_declared_once() -> None:
    names, words = declared_apart()
    assert [name for name in TWICE if len({**names, **words}[name]) < 2] == []
