"""Robots that a manifest or its table names: read with their options, or refused by file and line."""

from __future__ import annotations

import inspect
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from tests.expecting import refused

import truearm
from truearm.fleets.entries import OPTIONS, robots_of
from truearm.fleets.manifest import read_manifest

HEADER = "name,robot,data,of,date,model,train,effects\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("a.csv", "b.csv", "arm.yaml", "bounds.yaml"):
        (tmp_path / name).write_text(f"{name}\n", "utf-8")
    return tmp_path


def table(folder: Path, text: str, options: str = "{}") -> Path:
    (folder / "robots.csv").write_text(text, "utf-8")
    path = folder / "fleet.yaml"
    path.write_text(f"truearm: truearm-fleet/1\nrobots: robots.csv\noptions: {options}\n", "utf-8")
    return path


def test_options_are_those_that_calibrate_takes() -> None:
    keywords = {name for name, p in inspect.signature(truearm.calibrate).parameters.items() if p.kind is p.KEYWORD_ONLY}
    assert set(OPTIONS) == keywords - {"out", "replace", "notes", "command", "progress"}


def test_a_table_gives_every_robot_its_options(folder: Path) -> None:
    path = table(
        folder,
        HEADER + "one,ur5,a.csv,4711,2026-03-01,,40,\n"
        "# measured again\ntwo,arm.yaml,b.csv,4711,2026-09-01,elastic,all,backlash;clearance\n",
        "{model: geometric, seed: 3, bounds: bounds.yaml}",
    )
    first, second = read_manifest(path).robots
    assert (first.robot, first.data, first.of, first.date) == ("ur5", folder / "a.csv", "4711", "2026-03-01")
    assert first.options == {"model": "geometric", "seed": 3, "train": 40, "bounds": str(folder / "bounds.yaml")}
    assert (second.robot, second.options["model"], second.options["train"]) == (
        str(folder / "arm.yaml"),
        "elastic",
        "all",
    )
    assert second.options["effects"] == ["backlash", "clearance"]
    assert {"a.csv", "b.csv", "arm.yaml", "robots.csv", "bounds.yaml"} <= set(read_manifest(path).hashes)


def test_a_list_gives_the_same(folder: Path) -> None:
    entries = [
        {"name": "one", "robot": "ur5", "data": "a.csv", "of": 4711, "date": "2026-03-01", "options": {"train": 40}},
    ]
    (entry,) = robots_of(entries, {"seed": 2}, folder / "fleet.yaml").entries
    assert (entry.of, entry.date, entry.options) == ("4711", "2026-03-01", {"seed": 2, "train": 40})


ROW = "one,ur5,a.csv,,,,,\n"
REFUSED = {
    "a missing file": (HEADER + ROW + "two,ur5,c.csv,,,,,\n", "robots.csv, line 3, column data", "no such file"),
    "a missing robot file": (HEADER + "one,leg.yaml,a.csv,,,,,\n", "line 2, column robot", "no such file"),
    "two robots of one name": (HEADER + ROW + "One,ur5,b.csv,,,,,\n", "line 3, column name", "same name"),
    "one name, few columns": ("name,robot,data\none,ur5,a.csv\none,ur5,b.csv\n", "line 3, column name", "same name"),
    "a name that is no folder": (HEADER + "../one,ur5,a.csv,,,,,\n", "line 2, column name", "cannot be a name"),
    "an unknown column": ("name,robot,data,modell\none,ur5,a.csv,geometric\n", "line 1", "Did you mean model?"),
    "a column twice": ("name,robot,data,of,of\none,ur5,a.csv,1,2\n", "line 1", "two columns"),
    "a missing column": ("name,robot\none,ur5\n", "line 1", "allowed: data"),
    "an empty cell": (HEADER + "one,,a.csv,,,,,\n", "line 2, column robot", "empty"),
    "an impossible day": (HEADER + "one,ur5,a.csv,,2026-02-30,,,\n", "line 2, column date", "no such day"),
    "a date of another form": (HEADER + "one,ur5,a.csv,,1.3.2026,,,\n", "line 2, column date", "no date"),
    "an unknown model": (HEADER + "one,ur5,a.csv,,,geometrc,,\n", "line 2, column model", "Did you mean geometric?"),
    "no number": (HEADER + "one,ur5,a.csv,,,,some,\n", "line 2, column train", "whole number, or all"),
    "an unknown effect": (HEADER + "one,ur5,a.csv,,,,,backlsh\n", "line 2, column effects", "Did you mean backlash?"),
    "no numbers": ("name,robot,data,gravity\none,ur5,a.csv,down\n", "line 2, column gravity", "numbers"),
    "no payload": ("name,robot,data,payload\none,ur5,a.csv,heavy\n", "line 2, column payload", "heavy"),
    "no bounds file": ("name,robot,data,bounds\none,ur5,a.csv,b.yaml\n", "line 2, column bounds", "no such file"),
    "a header alone": (HEADER, "robots.csv", "no rows"),
}


def test_a_table_that_cannot_be_used_is_refused_where_it_is_wrong(folder: Path) -> None:
    for case, (text, place, words) in REFUSED.items():
        message = refused(None, "", read_manifest, table(folder, text))
        assert (place in message, words in message) == (True, True), (case, message)
    wrong = table(folder, HEADER + ROW, "{loss: square}")
    refused(None, r"fleet.yaml, options.loss: there is nothing of this name", read_manifest, wrong)


LISTED: dict[str, tuple[dict[str, Any], str, str]] = {
    "an unknown option": ({"options": {"trian": 40}}, "robots[1].options.trian", "Did you mean train?"),
    "an option of another kind": ({"options": {"seed": "some"}}, "robots[1].options.seed", "a whole number"),
    "yes for a number": ({"options": {"train": True}}, "robots[1].options.train", "a whole number"),
    "an unknown entry": ({"dat": "2026-01-01"}, "robots[1]", "dat"),
    "a serial number on two lines": ({"of": "a\nb"}, "robots[1].of", "serial"),
    "a missing file": ({"data": "c.csv"}, "robots[1].data", "no such file"),
}


def test_an_entry_that_cannot_be_used_is_refused_by_its_place(folder: Path) -> None:
    for case, (changed, place, words) in LISTED.items():
        entries = [{"name": "one", "robot": "ur5", "data": "a.csv", **changed}]
        message = refused(None, "", robots_of, entries, {}, folder / "fleet.yaml")
        assert (place in message, words in message) == (True, True), (case, message)
    refused(None, "no such file", robots_of, "fleet.csv", {}, folder / "fleet.yaml")
    refused(None, "there are no robots", robots_of, [], {}, folder / "fleet.yaml")


def test_the_same_readings_are_neither_two_robots_nor_two_campaigns(folder: Path) -> None:
    (folder / "copy.csv").write_bytes((folder / "a.csv").read_bytes())
    robots = "two robots, one and two"
    for of, who in (("4711", "two campaigns of 4711, one and two"), ("4712", robots), ("", robots)):
        for data in ("a.csv", "copy.csv"):
            rows = f"one,ur5,a.csv,4711,2026-01-01,,,\ntwo,ur5,{data},{of},2026-07-01,,,\n"
            words = f"line 3, column data: the same readings stand for {who}.*List them once, or give the right file."
            refused(None, words, read_manifest, table(folder, HEADER + rows))


def test_numbers_that_yaml_would_write_otherwise_belong_in_quotes(folder: Path) -> None:
    for entry, written in product(("of", "name"), ("0123", "1_000", "0x7b", "+12")):
        robot = {"name": "one", "robot": "ur5", "data": "a.csv", entry: written}
        entry_text = ", ".join(f"{name}: {text}" for name, text in robot.items())
        (folder / "fleet.yaml").write_text(f"truearm: truearm-fleet/1\nrobots:\n  - {{{entry_text}}}\n", "utf-8")
        words = rf"robots\[1\].{entry}: without quotes this is a number"
        assert written in refused(None, words, read_manifest, folder / "fleet.yaml")
    (folder / "fleet.yaml").write_text(
        "truearm: truearm-fleet/1\nrobots:\n"
        "  - {name: 7, robot: ur5, data: a.csv, of: '0123'}\n  - {name: '08', robot: ur5, data: b.csv, of: 123}\n",
        "utf-8",
    )
    assert [(read.name, read.of) for read in read_manifest(folder / "fleet.yaml").robots] == [
        ("7", "0123"),
        ("08", "123"),
    ]


def test_a_robot_is_computed_anew_where_its_own_entry_or_file_changes(folder: Path) -> None:
    rows = ROW + "two,arm.yaml,b.csv,,,,,\n"

    def keys(text: str) -> list[str]:
        (folder / "robots.csv").write_text(HEADER + text, "utf-8")
        path = folder / "fleet.yaml"
        path.write_text("truearm: truearm-fleet/1\nrobots: robots.csv\nchunk: 1\n", "utf-8")
        asked = read_manifest(path)
        return [asked.key(part) for part in range(asked.parts)]

    first, corrected = keys(rows), keys(rows.replace("b.csv,,,,", "b.csv,,,,9"))
    assert [a == b for a, b in zip(first, corrected, strict=True)] == [True, False]
    (folder / "arm.yaml").write_text("another arm\n", "utf-8")
    assert [a == b for a, b in zip(first, keys(rows), strict=True)] == [True, False]
    assert keys(rows + "three,ur5,bounds.yaml,,,,,\n")[:2] == keys(rows)
