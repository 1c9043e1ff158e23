"""A fleet of robots that were measured, from the manifest to its folder."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from tests.expecting import refused

import truearm
from truearm.calibration.result import RESULT_FILES
from truearm.fleets import robots as fleet_robots
from truearm.fleets.entries import RobotEntry
from truearm.fleets.robots import calibrated_robot
from truearm.fleets.series import Accuracy


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two robots of a series, one of them measured twice, and a file without a reading."""
    folder = tmp_path_factory.mktemp("measured")
    for name, seed in (("a", 1), ("b", 2)):
        truearm.simulate("irb120", truth="random", poses=20, noise=3e-5, seed=seed, out=folder / f"{name}.csv")
    lines = (folder / "a.csv").read_text("utf-8").splitlines()
    rows = [line.split(",") for line in lines[1:]]
    moved = [",".join([*row[:3], f"{float(row[3]) + 0.1:.6f}", *row[4:]]) for row in rows]
    empty = [",".join([*row[:8], "", "", "", "0.03"]) for row in rows[:3]]
    metres = [lines[0].replace("[mm]", "[m]"), *lines[1:]]
    for name, made in (("again", [lines[0], *moved]), ("empty", [lines[0], *empty]), ("metres", metres)):
        (folder / f"{name}.csv").write_text("\n".join(made) + "\n", "utf-8")
    (folder / "robots.csv").write_text(
        "name,robot,data,of,date,seed\n"
        "one,irb120,a.csv,4711,2026-01-10,\n"
        "two,irb120,b.csv,,2026-01-12,5\n"
        "one-again,irb120,again.csv,4711,2026-07-10,\n"
        "broken,irb120,empty.csv,,,\n",
        "utf-8",
    )
    (folder / "fleet.yaml").write_text("truearm: truearm-fleet/1\nrobots: robots.csv\noptions: {train: 15}\n", "utf-8")
    return folder


def test_a_fleet_calibrates_every_robot_and_says_what_they_say_together(measured: Path, tmp_path: Path) -> None:
    found = truearm.fleet(measured / "fleet.yaml", out=tmp_path / "out", workers=1)
    out = tmp_path / "out"
    for name in ("one", "two", "one-again"):
        assert {*RESULT_FILES} <= {path.name for path in (out / "robots" / name).iterdir()}
    assert not (out / "robots" / "broken").exists()
    one = json.loads((out / "robots" / "one" / "result.json").read_text("utf-8"))
    alone = truearm.calibrate("irb120", measured / "a.csv", train=15)
    told = {row["name"]: row for row in one["parameters"]}
    assert told["a_3"]["value"] == pytest.approx(alone.robot.values["a_3"] * 1e3, abs=1e-9)
    assert one["notes"] == {"date": "2026-01-10", "serial": "4711"}
    second = (out / "robots" / "two" / "result.json").read_text("utf-8")
    assert "seed 5" in json.loads(second)["history"]

    said = json.loads((out / "fleet.json").read_text("utf-8"))
    assert (said["measurements"], said["machines"], said["calibrated"]) == (4, 3, 3)
    assert [each["name"] for each in said["failed"]] == ["broken"]
    (kind,) = said["kinds"]
    changed = [row["parameter"] for row in kind["drift"] if row["significant"]]
    assert changed[0] == "theta_offset_3"
    assert {"robots-failed", "robots-drift"} <= {notice.code for notice in found.warnings}
    assert found.analysis.looks[0].robot == "broken"
    with (out / "robots.csv").open(encoding="utf-8") as stream:
        table = {row["name"]: row for row in csv.DictReader(stream)}
    assert table["broken"]["look"] == "failed"
    assert "drifts" in table["one-again"]["look"]
    page = (out / "report.html").read_text("utf-8")
    for words in ("Machines measured again", "theta_offset_3", "not calibrated:", "compared with its prior"):
        assert words in page
    assert not (out / "priors.yaml").exists()  # of three robots none follow


def test_one_robot_of_a_fleet_may_have_excluded_readings_and_its_result_says_why(
    measured: Path, tmp_path: Path
) -> None:
    (tmp_path / "dirty.csv").write_text("configuration,target,reason\n3,1,nest was dirty\n", "utf-8")
    robots = [
        {"name": "one", "robot": "irb120", "data": str(measured / "a.csv"), "options": {"exclude": "dirty.csv"}},
        {"name": "two", "robot": "irb120", "data": str(measured / "b.csv")},
    ]
    manifest = {"truearm": "truearm-fleet/1", "robots": robots, "options": {"model": "offsets"}}
    (tmp_path / "fleet.yaml").write_text(json.dumps(manifest), "utf-8")
    truearm.fleet(tmp_path / "fleet.yaml", out=tmp_path / "out", workers=1)
    one, two = (
        json.loads((tmp_path / "out" / "robots" / name / "result.json").read_text("utf-8")) for name in ("one", "two")
    )
    assert [(row["configuration"], row["target"], row["reason"]) for row in one["excluded"]] == [
        ("3", "1", "nest was dirty")
    ]
    assert "excluded" not in two


def test_a_robot_whose_result_ends_with_an_error_is_named(measured: Path, tmp_path: Path) -> None:
    entry = f"{{name: one, robot: irb120, data: {measured / 'metres.csv'}}}"
    (tmp_path / "fleet.yaml").write_text(f"truearm: truearm-fleet/1\nrobots: [{entry}]\n", "utf-8")
    found = truearm.fleet(tmp_path / "fleet.yaml", out=tmp_path / "out", workers=1)
    told = {notice.code: notice.message for notice in found.warnings}
    assert told["robots-in-error"].startswith("The result of 1 robot (one) should not be used")
    assert "no-result" in told
    assert found.lines()[1] == "1 robot: 0 usable, 1 whose result ends with an error, 0 not calibrated."


def test_what_cannot_be_used_is_told_first_and_figures_say_of_how_many_they_are(measured: Path, tmp_path: Path) -> None:
    robots = [
        {"name": name, "robot": "irb120", "data": str(measured / f"{file}.csv")}
        for name, file in (("wrong", "metres"), ("right", "b"), ("empty", "empty"))
    ]
    (tmp_path / "fleet.yaml").write_text(json.dumps({"truearm": "truearm-fleet/1", "robots": robots}), "utf-8")
    found = truearm.fleet(tmp_path / "fleet.yaml", out=tmp_path / "out", workers=1)
    said = "3 robots: 1 usable, 1 whose result ends with an error, 1 not calibrated."
    heads = [f"{robots} robots, mean error of 1 robot" for robots in ("Nominal", "Calibrated")]
    assert [found.lines()[1], *(line.partition(":")[0] for line in found.lines()[2:4])] == [said, *heads]
    assert said.replace(": ", ", ", 1) in (tmp_path / "out" / "report.html").read_text("utf-8")


def test_a_row_holds_the_arm_alone_with_its_covariance(measured: Path) -> None:
    row = calibrated_robot(RobotEntry("one", "irb120", measured / "a.csv", {"train": 15})).row
    assert (row.status, row.robot) == ("calibrated", "irb120")
    assert not any(name.startswith(("base", "target")) for name in row.parameters)
    count = len(row.parameters)
    assert len(row.covariance) == count * (count + 1) // 2
    first = next(iter(row.parameters.values()))
    assert row.covariance[0] == pytest.approx((first.deviation / first.prior) ** 2, abs=1e-9)
    assert type(row).read(json.loads(json.dumps(row.content()))) == row
    # values without priors are not drawn
    row = calibrated_robot(RobotEntry("one", "irb120", measured / "a.csv", {"train": 15, "redundancy": "drop"})).row
    assert not row.drawn
    assert type(row).read(json.loads(json.dumps(row.content()))) == row


def test_a_robot_of_which_the_calibration_breaks_is_a_row(measured: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def breaks(*_: object, **__: object) -> None:
        raise ArithmeticError("singular")

    monkeypatch.setattr(fleet_robots, "calibrate", breaks)
    row = calibrated_robot(RobotEntry("one", "irb120", measured / "a.csv", of="4711", date="2026-01-01")).row
    assert (row.status, row.of, row.date) == ("failed", "4711", "2026-01-01")
    assert row.message == "the calibration failed (ArithmeticError: singular)"


def test_a_robot_whose_figures_are_not_finite_is_a_row(
    measured: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    row = fleet_robots._row
    monkeypatch.setattr(fleet_robots, "_row", lambda *given: replace(row(*given), held_out=Accuracy(math.nan, 1, 1, 3)))
    done = calibrated_robot(RobotEntry("one", "irb120", measured / "a.csv", {"train": 15}), tmp_path)
    assert (done.row.status, done.written, "not finite" in done.row.message) == ("failed", (), True)


def test_a_folder_that_cannot_be_written_is_no_fault_of_the_robot(measured: Path, tmp_path: Path) -> None:
    (tmp_path / "robots").write_text("a file where the folder belongs", "utf-8")
    entry = RobotEntry("one", "irb120", measured / "a.csv", {"train": 15})
    refused(None, "a folder is needed", calibrated_robot, entry, tmp_path)
