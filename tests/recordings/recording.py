"""Run the commands of ``commands.yaml``, and record what they print, return and write.

The last bits of a calibration hang on which instructions of the processor NumPy and OpenBLAS take. So each group runs
in a process in which both take those that every x86-64 processor with AVX2 has.
"""

from __future__ import annotations

import io
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from datetime import date
from html.parser import HTMLParser
from itertools import groupby
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

import numpy as np
from PIL import Image
from ruamel.yaml import YAML

HERE: Final = Path(__file__).parent
INPUTS: Final = HERE / "inputs"
BASELINE: Final = HERE / "baseline"
#: All that a command sees of its environment, beside where programs and temporary files are: instructions that many
#: processors have, and no terminal with colours.
_ENVIRONMENT: Final = {
    "COLUMNS": "120",
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    "OPENBLAS_CORETYPE": "Haswell",
    "OPENBLAS_NUM_THREADS": "1",
    "PYTHONUTF8": "1",
}
_KEPT: Final = ("PATH", "PYTHONHASHSEED", "PYTHONPATH", "TMPDIR")
#: Tables of more lines are recorded by their first and last lines, and by the mean and the spread of each column.
_LONGEST: Final = 60
_TODAY: Final = re.compile(str(date.today()))
#: Of a list of more than twice as many numbers the first ones are recorded, and the mean and the spread of all.
_SHOWN: Final = 15


@dataclass(frozen=True)
class Group:
    """Commands that run one after the other in a folder of their own, as in a user's session."""

    name: str
    quick: bool
    files: tuple[str, ...]
    steps: tuple[str | dict[str, list[str]], ...]


def declared() -> tuple[list[Group], list[tuple[re.Pattern[str], str]], set[str]]:
    """Return the groups, and what is left out: patterns in texts with what takes their place, and keys of JSON."""
    content = YAML(typ="safe").load(HERE / "commands.yaml")
    groups = [
        Group(name, group.get("quick", False), tuple(group.get("files", ())), tuple(group["steps"]))
        for name, group in content["groups"].items()
    ]
    left_out = content["left_out"]
    patterns = [(re.compile(entry["pattern"]), entry["by"]) for entry in left_out if "pattern" in entry]
    return groups, patterns, {entry["key"] for entry in left_out if "key" in entry}


GROUPS, LEFT_OUT, KEYS_LEFT_OUT = declared()


def recorded(group: Group) -> dict[str, Any]:
    """Run the commands of a group in a process of its own, and return what each of them did."""
    words = [sys.executable, "-m", "tests.recordings.recording", group.name]
    seen = _ENVIRONMENT | {name: os.environ[name] for name in _KEPT if name in os.environ}
    done = subprocess.run(words, env=seen, cwd=HERE.parents[1], capture_output=True, text=True, encoding="utf-8")
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


def session(group: Group, folder: Path) -> dict[str, Any]:
    """Run the commands of a group in a folder and in this process, and return what each of them did."""
    for name in group.files:
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if (INPUTS / name).is_dir():
            shutil.copytree(INPUTS / name, target)
        else:
            shutil.copyfile(INPUTS / name, target)
    done: dict[str, Any] = {}
    with chdir(folder), patch.object(os, "fsync", lambda _: None):
        for step in group.steps:
            if isinstance(step, dict):
                _prepare(step)
            else:
                done[f"{step} (again)" if step in done else step] = command(step, folder)
    return done


def _prepare(step: dict[str, list[str]]) -> None:
    """Do what a user does between two commands: copy a file or a folder, replace a text, write or remove a file."""
    ((what, words),) = step.items()
    first = Path(words[0])
    if what == "copy":
        if first.is_dir():
            shutil.copytree(first, words[1])
        else:
            shutil.copyfile(first, words[1])
    elif what == "replace":
        text = first.read_text()
        assert words[2] in text, f"{first} holds no {words[2]!r}"
        Path(words[1]).write_text(text.replace(words[2], words[3], 1))
    elif what == "write":
        first.parent.mkdir(parents=True, exist_ok=True)
        first.write_text(words[1])
    else:
        assert what == "remove", what
        first.unlink()


def command(line: str, folder: Path) -> dict[str, Any]:
    """Run a command in this process, and return its exit code, what it printed, how it refused and what it wrote."""
    from truearm.commands import main

    before = _standing(folder)
    out, err = io.StringIO(), io.StringIO()
    code: object = 0
    refusal: BaseException | None = None
    with patch.object(sys, "argv", ["truearm", *shlex.split(line)]), redirect_stdout(out), redirect_stderr(err):
        try:
            main()
        except SystemExit as stop:
            code, refusal = stop.code or 0, stop.__context__
    after = _standing(folder)
    done: dict[str, Any] = {"exit": code}
    if code == 2:
        done["refusal"] = _refused(refusal)
    printed = out.getvalue()
    done["out"] = _rounded(json.loads(printed)) if printed.startswith("{") else _lines(printed)
    done["err"] = _lines(err.getvalue())
    whole = not printed.startswith("{")
    written = [name for name in sorted(after) if before.get(name) != after[name]]
    done["files"] = {name: contents(folder / name, whole=whole) for name in written}
    _say_once(done)
    done["removed"] = sorted(before.keys() - after.keys())
    return {key: value for key, value in done.items() if value or key == "exit"}


def _refused(by: BaseException | None) -> dict[str, str | None]:
    """Return what a job or the command line refused: the kind of refusal, and the parameter."""
    if by is not None and by.__cause__ is not None and not hasattr(by, "parameter"):
        told = _refused(by.__cause__)
        if told["kind"] == "InputError" or told["parameter"]:
            return told
    return {"kind": type(by).__name__, "parameter": getattr(by, "parameter", None)}


def _say_once(done: dict[str, Any]) -> None:
    """Name what was printed and stands in a file just so, instead of recording it twice."""
    for name, file in done["files"].items():
        if isinstance(done["out"], dict) and name.endswith(".json"):
            same = [key for key in done["out"] if key in file and file[key] == done["out"][key]]
            done["out"] = {key: value for key, value in done["out"].items() if key not in same}
            if same:
                done["out"][f"as in {name}"] = same


def _standing(folder: Path) -> dict[str, tuple[int, int, int]]:
    """Return what tells whether a file was written: files are replaced as a whole, and get another number."""
    files = {path: path.stat() for path in folder.rglob("*") if path.is_file()}
    return {str(path.relative_to(folder)): (s.st_ino, s.st_mtime_ns, s.st_size) for path, s in files.items()}


def contents(path: Path, *, whole: bool = True) -> Any:
    """Return what is recorded of a file; of pages and URDFs, if not the whole, how large they are."""
    if path.suffix == ".json":
        return _rounded(json.loads(path.read_text("utf-8")))
    if path.suffix == ".jsonl":
        return [_rounded(json.loads(line)) for line in path.read_text("utf-8").splitlines()]
    if path.suffix == ".html":
        page = _page(path.read_text("utf-8"))
        return page if whole else {"texts": len(page["texts"]), "figures": [*page["figures"]]}
    if path.suffix == ".png":
        with Image.open(path) as image:
            return f"picture, {image.width} x {image.height}"
    lines = _lines(_LONG.sub(lambda found: f"{float(found[0]):.12g}", path.read_bytes().decode("utf-8")))
    if path.suffix == ".csv" and len(lines) > _LONGEST:
        return lines[:20] + lines[-5:] + _columns(lines)
    return _shortened(lines) if whole or path.suffix != ".urdf" else f"{len(lines)} lines"


def _lines(text: str) -> list[str]:
    """Return the lines of a text without what is left out; frames of help and of usage errors are left away."""
    lines = [" ".join(line.split()) if any(c in line for c in "╭╰│") else line for line in text.split("\n")]
    for pattern, by in (*LEFT_OUT, (re.compile(re.escape(str(Path.cwd()))), "FOLDER"), (_TODAY, "TODAY")):
        lines = [pattern.sub(by, line) for line in lines]
    lines = [line.strip("─│╭╮╰╯ ") if any(c in line for c in "╭╰│") else line for line in lines]
    return lines[:-1] if lines[-1] == "" else lines


def _shortened(lines: list[str]) -> list[str]:
    """Return lines of which long runs of nothing but numbers are told by mean and spread, as correlations are."""
    told: list[str] = []
    for plain, run in groupby(lines, lambda line: bool(_ROW.fullmatch(line))):
        rows = list(run)
        if plain and len(rows) > _SHOWN:
            numbers = [float(number) for row in rows for number in re.findall(_NUMBER, row)]
            rows = [*rows[:3], f"{len(rows)} rows, {len(numbers)} numbers, {_mean_and_spread(numbers)}"]
        told += rows
    return told


def _columns(lines: list[str]) -> list[str]:
    """Return mean and spread of the numbers in each column of a table, and how many other cells there are."""
    header, *rows = [line.split(",") for line in lines]
    told = [f"{len(rows)} rows"]
    for number, name in enumerate(header):
        cells = [row[number] if number < len(row) else "" for row in rows]
        numbers = [float(cell) for cell in cells if re.fullmatch(_NUMBER, cell)]
        told.append(f"{name}: {len(set(cells))} values, {_mean_and_spread(numbers)}")
    return told


def _mean_and_spread(numbers: Sequence[float] | np.ndarray) -> str:
    """Return mean and standard deviation, by which a change of any number is seen."""
    known = np.array(numbers)[~np.isnan(numbers)]
    return f"mean {known.mean():.12g}, spread {known.std():.12g}" if known.size else "no numbers"


#: A row of numbers in a YAML file.
_ROW: Final = re.compile(r""" *- ['"][-+.\de ]+['"]""")
#: A number of more than 12 digits after the point.
_LONG: Final = re.compile(r"(?<![\w.])-?\d+\.\d{12,}(?:e[-+]?\d+)?(?!\w)")
_NUMBER: Final = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"


def _rounded(value: Any) -> Any:
    """Return what a JSON text holds, numbers with 12 significant digits, texts without what is left out."""
    if isinstance(value, dict):
        kept = {key: content for key, content in value.items() if key not in KEYS_LEFT_OUT}
        return {_lines(key)[0] if key else key: _rounded(content) for key, content in kept.items()}
    if isinstance(value, list):
        if len(value) > 2 * _SHOWN and all(type(content) in (int, float) for content in value):
            return [*_rounded(value[:_SHOWN]), f"{len(value)} numbers, {_mean_and_spread(value)}"]
        return [_rounded(content) for content in value]
    if isinstance(value, float):
        return float(f"{value:.12g}")
    return "\n".join(_lines(value)) if isinstance(value, str) and value else value


#: Elements of a page that begin a line.
_BLOCKS: Final = ("p", "h1", "h2", "h3", "tr", "dt", "li", "div", "pre", "caption", "figcaption", "summary", "section")


class _Page(HTMLParser):
    """The visible texts of a page, and its figures."""

    def __init__(self) -> None:
        super().__init__()
        self.texts: list[str] = []
        self.figures = ""
        self._within = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in ("script", "style", "svg"):
            self._within = "figures" if ("id", "figures") in attrs else tag
        elif tag in _BLOCKS:
            self.texts.append("")

    def handle_endtag(self, tag: str) -> None:
        if tag in ("script", "style", "svg"):
            self._within = ""

    def handle_data(self, data: str) -> None:
        if self._within == "figures":
            self.figures += data
        elif not self._within:
            self.texts[-1:] = [f"{self.texts[-1] if self.texts else ''} {data}"]


def _page(text: str) -> dict[str, Any]:
    page = _Page()
    page.feed(text)
    texts = [" ".join(line.split()) for line in page.texts]
    figures = json.loads(page.figures) if page.figures else {}
    shown = _lines("\n".join(filter(None, texts)) + "\n")
    return {"texts": shown, "figures": {name: _figure(figure) for name, figure in figures.items()}}


def _figure(figure: dict[str, Any]) -> list[str]:
    """Return the titles of a figure, and of each line in it the name and the mean and spread of its numbers."""
    axes = {key: axis for key, axis in figure["layout"].items() if "axis" in key and isinstance(axis, dict)}
    told = [f"{key}: {axis['title']['text']}" for key, axis in axes.items() if "text" in (axis.get("title") or {})]
    for trace in figure["data"]:
        arrays = {key: np.array(trace[key]) for key in ("x", "y", "z") if isinstance(trace.get(key), list)}
        numbers = [
            f"{key}: {a.size}, {_mean_and_spread(a) if a.dtype.kind in 'if' else 'texts'}" for key, a in arrays.items()
        ]
        told.append("; ".join([f"{trace.get('type', 'line')} {trace.get('name', '')}".strip(), *numbers]))
    return [line for text in told for line in _lines(text)]


def written_out(value: Any, indent: str = "") -> str:
    """Return JSON of which a difference can be read: what is short is on one line, lists of numbers too."""
    short = json.dumps(value, ensure_ascii=False)
    numbers = isinstance(value, list) and all(isinstance(content, int | float) for content in value)
    if not isinstance(value, dict | list) or len(indent) + len(short) <= 118 or numbers:
        return short
    inner = indent + " "
    if isinstance(value, dict):
        parts = [f"{json.dumps(key, ensure_ascii=False)}: {written_out(v, inner)}" for key, v in value.items()]
        return "{\n" + ",\n".join(inner + part for part in parts) + f"\n{indent}}}"
    return "[\n" + ",\n".join(inner + written_out(v, inner) for v in value) + f"\n{indent}]"


def baseline_of(group: Group) -> Any:
    """Return what was recorded of a group, nothing if nothing was."""
    path = BASELINE / f"{group.name}.json"
    return json.loads(path.read_text("utf-8")) if path.exists() else {}


def _main(name: str) -> None:
    """Print what the commands of a group do."""
    warnings.simplefilter("error")
    (group,) = (group for group in GROUPS if group.name == name)
    with tempfile.TemporaryDirectory() as folder:
        found = session(group, Path(folder).resolve())
    json.dump(found, sys.stdout)


if __name__ == "__main__":
    _main(sys.argv[1])
