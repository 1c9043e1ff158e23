"""Deletes a feature in a copy of the tree, and looks whether the rest still stands: ``python -m tests.house.removal``.

    python -m tests.house.removal [--whole] [FEATURE ...] [FEATURE,FEATURE ...]

Of the rest the quick tests of the registries are run, or with ``--whole`` all that are not slow. Features with commas
between them are deleted from one copy.

What goes: the folder of the feature, the folders that import it, their tests, and what names them in registries and
other tests (:mod:`tests.house.pruning`). Of the studio and of the papers single files go, as long as enough is left.
"""

from __future__ import annotations

import ast
import gc
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from ruamel.yaml import YAML
from tests.house.pruning import Gone, Pruned, prune
from tests.mutants.running import copy_of_the_tree, pytest
from tests.mutants.tree import ROOT

#: Modules that list what there is: there a line goes.
REGISTRIES: Final = ("truearm", "truearm.commands", "truearm.studio.pages", "papers")
#: Parts of which single files may go, and what may not: without it the whole part goes.
IN_PARTS: Final = {"truearm.studio": ("truearm.studio.command",), "papers": ("papers.study",)}
#: What belongs to the papers and lies elsewhere: what runs them.
OF_PAPERS: Final = ("truearm.starting.published", "truearm.starting.study", "truearm.starting.studying")
#: Files whose lists name jobs or studies.
LISTS: Final = ("papers/__init__.py", "tests/house/", "tests/fuzz/", "tests/honesty/", "tests/kill_every_job.py")
#: Tests that go through the registries, and are quick; and those of the whole tree, which is not what is here.
QUICK: Final = ("test_contract.py", "test_every_job.py", "test_package.py", "test_refusals.py", "test_slow.py")
OF_THE_WHOLE: Final = ("tests/mutants", "tests/house/test_documents.py", "tests/house/test_removal.py")

_IMPORTS = """
import importlib, pkgutil, sys
import truearm
found = [truearm]
if len(sys.argv) > 1:
    import papers
    found.append(papers)
for package in found:
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if not module.name.endswith(("__main__", "python_template")):
            importlib.import_module(module.name)
"""


def features() -> list[str]:
    """Return all features: the folders of the package beside the engine, and the papers."""
    found = sorted(path.parent.name for path in (ROOT / "src" / "truearm").glob("*/__init__.py"))
    return [name for name in found if name != "engine"] + ["papers"]


def _part(module: str) -> str:
    """Return the feature that a module belongs to."""
    return "papers" if module.startswith("papers") else ".".join(module.split(".")[:2])


def _piece(module: str, studies: set[str]) -> str:
    """Return what goes with a module: its feature, its study, or only itself in the studio and in the papers."""
    part, study = _part(module), ".".join(module.split(".")[:2])
    return study if study in studies else module if part in IN_PARTS else part


def _gone(features: Sequence[str], files: dict[str, Pruned]) -> Gone:
    """Return the modules that go with features, and their tests."""
    gone = Gone({name for f in features for name in (("papers", *OF_PAPERS) if f == "papers" else (f"truearm.{f}",))})
    names = {
        n.value for n in ast.walk(files["papers"].tree) if isinstance(n, ast.Constant) and isinstance(n.value, str)
    }
    studies = {f"papers.{name.replace('-', '_')}" for name in names}
    jobs = {
        key.value: value.value
        for node in ast.walk(files["truearm"].tree)
        if isinstance(node, ast.Dict)
        for key, value in zip(node.keys, node.values, strict=True)
        if isinstance(key, ast.Constant) and isinstance(value, ast.Constant)
    }
    before = 0
    while before != (before := len(gone.modules)):
        gone.names = {("truearm", str(job)) for job, home in jobs.items() if gone.has(str(home))}
        for module, file in files.items():
            if module in REGISTRIES or gone.has(module):
                continue
            if file.touched(gone):
                assert not module.startswith("truearm.engine"), f"{module} uses {features}"
                gone.modules.add(_piece(module, studies))
        pages = {dotted for _, dotted in files["truearm.studio.pages"].imported if ".pages." in dotted}
        for part, needed in IN_PARTS.items():
            if any(map(gone.has, needed)) or (part == "truearm.studio" and all(map(gone.has, pages))):
                gone.modules.add(part)
    gone.modules = {module for module in gone.modules if module == _part(module) or _part(module) not in gone.modules}
    gone.modules |= {f"tests.{module.removeprefix('truearm.')}" for module in gone.modules if module == _part(module)}
    gone.keys = {name for _, name in gone.names}
    gone.kept = {str(job) for job in jobs} - gone.keys
    gone.keys |= {m.removeprefix("papers.").replace("_", "-") for m in gone.modules if m.startswith("papers.")}
    return gone


def _run(copy: Path, *words: str) -> subprocess.CompletedProcess[str]:
    env = os.environ | {"PYTHONPATH": f"{copy / 'src'}{os.pathsep}{copy}", "COLUMNS": "120"}
    return subprocess.run([sys.executable, *words], cwd=copy, env=env, capture_output=True, text=True)


def _commands(tree: Path) -> set[tuple[str, ...]]:
    """Return the words of all commands."""
    run = _run(tree, "-c", "import json; from truearm.commands import COMMANDS; print(json.dumps([*COMMANDS]))")
    assert run.returncode == 0, run.stderr
    every = [tuple(words.split()) for words in json.loads(run.stdout)]
    return {*every, *(words[:1] for words in every)}


def removed(copy: Path, *features: str) -> Gone:
    """Delete features in a copy of the tree, and what names them."""
    before = _commands(copy)
    gc.disable()  # nothing of the trees is garbage before the end
    files = {
        path: path.read_text(encoding="utf-8")
        for part in ("src", "papers", "tests")
        for path in sorted((copy / part).rglob("*.py"))
    }
    pruned = [
        Pruned(path.relative_to(copy), text, registry=str(path.relative_to(copy)).startswith(LISTS))
        for path, text in files.items()
    ]
    gc.enable()
    gone = _gone(features, {file.module: file for file in pruned if file.path.parts[0] != "tests"})
    left = [file for file in pruned if not gone.has(file.module)]
    prune([file for file in left if file.module in REGISTRIES], gone)
    _write([file for file in left if file.module in REGISTRIES], copy)
    for module in gone.modules:
        place = copy / ("" if module.startswith(("tests", "papers")) else "src") / module.replace(".", "/")
        shutil.rmtree(place, ignore_errors=True)
        place.with_suffix(".py").unlink(missing_ok=True)
    gone.commands = before - _commands(copy)
    tests = [file for file in left if file.path.parts[0] == "tests"]
    prune(tests, gone)
    _write(tests, copy)
    _recordings(copy, gone)
    _slow(copy, gone)
    _contract(copy, gone)
    _run(copy, "-m", "ruff", "check", "-q", "--select", "F401", "--fix", "src", "tests", "papers")
    return gone


def _write(files: list[Pruned], copy: Path) -> None:
    for file in files:
        if file.changed:
            (copy / file.path).write_text(file.written(), encoding="utf-8")


def _recordings(copy: Path, gone: Gone) -> None:
    """Take out the recorded groups that run a command that is gone, or show the list of all."""
    path = copy / "tests" / "recordings" / "commands.yaml"
    yaml = YAML(typ="safe")
    content = yaml.load(path)
    for name, group in [*content["groups"].items()]:
        steps = [step.split() for step in group["steps"] if isinstance(step, str)]
        if (gone.commands and name == "help") or any(gone.called(step) for step in steps):
            del content["groups"][name]
            gone.tests.append(f"recording {name}")
    with path.open("w", encoding="utf-8") as stream:
        yaml.dump(content, stream)


def _slow(copy: Path, gone: Gone) -> None:
    """Take what is gone out of the list of slow tests."""
    path = copy / "tests" / "slow.txt"
    entries = [line.partition("[")[0] for line in path.read_text(encoding="utf-8").splitlines()]
    left = [entry for entry in entries if (copy / entry.partition("::")[0]).exists() and entry not in gone.tests]
    path.write_text("".join(f"{entry}\n" for entry in left), encoding="utf-8")


def _contract(copy: Path, gone: Gone) -> None:
    """Write the import contract without what is gone."""
    rules = tomllib.loads((copy / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    text = f"[importlinter]\nroot_package = {rules['root_package']}\n"
    for number, contract in enumerate(rules["contracts"]):
        layers = [[name.strip() for name in layer.split("|")] for layer in contract["layers"]]
        kept = [" | ".join(name for name in layer if not gone.has(name)) for layer in layers]
        text += f"\n[importlinter:contract:{number}]\nname = {contract['name']}\ntype = {contract['type']}\nlayers =\n"
        text += "".join(f"    {layer}\n" for layer in kept if layer)
    (copy / ".importlinter").write_text(text, encoding="utf-8")


def faults(copy: Path, gone: Gone, *, whole: bool) -> dict[str, str]:
    """Return what is wrong with the rest, by what found it."""
    cache = (
        ROOT / ".mypy_cache" / f"removal{os.environ.get('PYTEST_XDIST_WORKER', '')}"
    )  # two at once must not share it
    checks = {
        "imports": ("-c", _IMPORTS, *(() if gone.has("papers") else ("papers",))),
        "names": ("-m", "ruff", "check", "-q", "--select", "F821,F401,F811", "src", "tests"),
        "types": (
            "-m",
            "mypy",
            "--no-warn-unused-ignores",
            "--cache-dir",
            str(cache),
            *(p for p in ("src", "papers", "tests") if (copy / p).is_dir()),
        ),
        "contract": (
            "-c",
            "from importlinter.cli import lint_imports_command as c; c()",
            "--config",
            ".importlinter",
            "--no-cache",
        ),
        "help": ("-m", "truearm", "--help"),
    }
    found = {}
    for name, words in checks.items():
        begun = time.monotonic()
        run = _run(copy, *words)
        if run.returncode:
            found[name] = f"{run.stdout}{run.stderr}"
        elif name == "help" and any(
            re.search(rf"(?m)^\W*{words[0]} ", run.stdout) for words in gone.commands if not words[1:]
        ):
            found[name] = run.stdout
        sys.stdout.write(f"    {name} {time.monotonic() - begun:.0f} s\n")
    ignored = [f"--ignore={name}" for name in OF_THE_WHOLE]
    begun = time.monotonic()
    which = ("-n", "auto", "--dist", "worksteal") if whole else ("-k", " or ".join(QUICK))
    code, printed = pytest(copy, *ignored, "tests", "-m", "not slow", *which)
    if code:
        found["tests"] = printed[-6000:]
    sys.stdout.write(f"    tests {time.monotonic() - begun:.0f} s: {printed.splitlines()[-1]}\n")
    return found


def told(gone: Gone) -> str:
    """Return in lines what went."""
    of = Counter(test.partition("::")[0] for test in gone.tests)
    lines = [f"  gone: {', '.join(sorted(gone.modules))}", f"  {len(gone.tests)} tests elsewhere went:"]
    return "\n".join([*lines, *(f"    {count:3} {name}" for name, count in sorted(of.items()))]) + "\n"


def main(words: list[str]) -> int:
    """Try the features that are named, or all; say what is wrong."""
    wrong = 0
    for together in [word for word in words if word != "--whole"] or features():
        sys.stdout.write(f"{together}\n")
        with tempfile.TemporaryDirectory(prefix="truearm-removal-") as folder:
            copy = copy_of_the_tree(Path(folder))
            gone = removed(copy, *together.split(","))
            sys.stdout.write(told(gone))
            sys.stdout.flush()
            for name, text in faults(copy, gone, whole="--whole" in words).items():
                sys.stdout.write(f"  {name} FAILED\n{text}\n")
                wrong += 1
        sys.stdout.flush()
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
