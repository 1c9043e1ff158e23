"""A fleet of robots that were measured: from manifest to folder, what is tried before and corrected after."""

from __future__ import annotations

import csv
import json
import math
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.expecting import refused as said_of

import truearm
from truearm.calibration.result import RESULT_FILES
from truearm.commands import main
from truearm.engine.base.errors import InputError
from truearm.fleets import robots as fleet_robots
from truearm.fleets.entries import RobotEntry
from truearm.fleets.manifest import read_manifest
from truearm.fleets.result import Fleet
from truearm.fleets.robots import calibrated_robot
from truearm.fleets.series import Accuracy


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two robots of a series, one of them measured twice, and a file without a reading."""
    folder = tmp_path_factory.mktemp("campaigns")
    for name, seed in (("a", 1), ("b", 2)):
        truearm.simulate("irb120", truth="random", poses=20, noise=3e-5, seed=seed, out=folder / f"{name}.csv")
    lines = (folder / "a.csv").read_text("utf-8").splitlines()
    rows = [line.split(",") for line in lines[1:]]
    moved = [",".join([*row[:3], f"{float(row[3]) + 0.1:.6f}", *row[4:]]) for row in rows]
    empty = [",".join([*row[:8], "", "", "", "0.03"]) for row in rows[:3]]
    metres = [lines[0].replace("[mm]", "[m]"), *lines[1:]]
    for name, content in (("again", [lines[0], *moved]), ("empty", [lines[0], *empty]), ("metres", metres)):
        (folder / f"{name}.csv").write_text("\n".join(content) + "\n", "utf-8")
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


def test_a_fleet_calibrates_every_robot_and_says_what_they_say_together(campaigns: Path, tmp_path: Path) -> None:
    fleet = truearm.fleet(campaigns / "fleet.yaml", out=tmp_path / "out", workers=1)
    out = tmp_path / "out"
    for name in ("one", "two", "one-again"):
        assert {*RESULT_FILES} <= {path.name for path in (out / "robots" / name).iterdir()}
    assert not (out / "robots" / "broken").exists()
    result = json.loads((out / "robots" / "one" / "result.json").read_text("utf-8"))
    alone = truearm.calibrate("irb120", campaigns / "a.csv", train=15)
    parameters = {row["name"]: row for row in result["parameters"]}
    assert parameters["a_3"]["value"] == pytest.approx(alone.robot.values["a_3"] * 1e3, abs=1e-9)
    assert result["notes"] == {"date": "2026-01-10", "serial": "4711"}
    second = (out / "robots" / "two" / "result.json").read_text("utf-8")
    assert "seed 5" in json.loads(second)["history"]

    summary = json.loads((out / "fleet.json").read_text("utf-8"))
    assert (summary["measurements"], summary["machines"], summary["calibrated"]) == (4, 3, 3)
    assert [each["name"] for each in summary["failed"]] == ["broken"]
    (kind,) = summary["kinds"]
    changed = [row["parameter"] for row in kind["drift"] if row["significant"]]
    assert changed[0] == "theta_offset_3"
    assert {"robots-failed", "robots-drift"} <= {notice.code for notice in fleet.warnings}
    assert fleet.analysis.looks[0].robot == "broken"
    with (out / "robots.csv").open(encoding="utf-8") as stream:
        table = {row["name"]: row for row in csv.DictReader(stream)}
    assert table["broken"]["look"] == "failed"
    assert "drifts" in table["one-again"]["look"]
    page = (out / "report.html").read_text("utf-8")
    for words in ("Machines measured again", "theta_offset_3", "not calibrated:", "compared with its prior"):
        assert words in page
    assert not (out / "priors.yaml").exists()  # of three robots none follow


def test_one_robot_of_a_fleet_may_have_excluded_readings_and_its_result_says_why(
    campaigns: Path, tmp_path: Path
) -> None:
    (tmp_path / "dirty.csv").write_text("configuration,target,reason\n3,1,nest was dirty\n", "utf-8")
    robots = [
        {"name": "one", "robot": "irb120", "data": str(campaigns / "a.csv"), "options": {"exclude": "dirty.csv"}},
        {"name": "two", "robot": "irb120", "data": str(campaigns / "b.csv")},
    ]
    manifest = {"truearm": "truearm-fleet/1", "robots": robots, "options": {"model": "offsets"}}
    (tmp_path / "fleet.yaml").write_text(json.dumps(manifest), "utf-8")
    truearm.fleet(tmp_path / "fleet.yaml", out=tmp_path / "out", workers=1)
    first, second = (
        json.loads((tmp_path / "out" / "robots" / name / "result.json").read_text("utf-8")) for name in ("one", "two")
    )
    assert [(row["configuration"], row["target"], row["reason"]) for row in first["excluded"]] == [
        ("3", "1", "nest was dirty")
    ]
    assert "excluded" not in second


def test_a_robot_whose_result_ends_with_an_error_is_named(campaigns: Path, tmp_path: Path) -> None:
    entry = f"{{name: one, robot: irb120, data: {campaigns / 'metres.csv'}}}"
    (tmp_path / "fleet.yaml").write_text(f"truearm: truearm-fleet/1\nrobots: [{entry}]\n", "utf-8")
    fleet = truearm.fleet(tmp_path / "fleet.yaml", out=tmp_path / "out", workers=1)
    messages = {notice.code: notice.message for notice in fleet.warnings}
    assert messages["robots-in-error"].startswith("The result of 1 robot (one) should not be used")
    assert "no-result" in messages
    assert fleet.lines()[1] == "1 robot: 0 usable, 1 whose result ends with an error, 0 not calibrated."


def test_what_cannot_be_used_is_told_first_and_figures_say_of_how_many_they_are(
    campaigns: Path, tmp_path: Path
) -> None:
    robots = [
        {"name": name, "robot": "irb120", "data": str(campaigns / f"{file}.csv")}
        for name, file in (("wrong", "metres"), ("right", "b"), ("empty", "empty"))
    ]
    (tmp_path / "fleet.yaml").write_text(json.dumps({"truearm": "truearm-fleet/1", "robots": robots}), "utf-8")
    fleet = truearm.fleet(tmp_path / "fleet.yaml", out=tmp_path / "out", workers=1)
    line_of_counts = "3 robots: 1 usable, 1 whose result ends with an error, 1 not calibrated."
    heads = [f"{robots} robots, mean error of 1 robot" for robots in ("Nominal", "Calibrated")]
    assert [fleet.lines()[1], *(line.partition(":")[0] for line in fleet.lines()[2:4])] == [line_of_counts, *heads]
    assert line_of_counts.replace(": ", ", ", 1) in (tmp_path / "out" / "report.html").read_text("utf-8")


def test_a_row_holds_the_arm_alone_with_its_covariance(campaigns: Path) -> None:
    row = calibrated_robot(RobotEntry("one", "irb120", campaigns / "a.csv", {"train": 15})).row
    assert (row.status, row.robot) == ("calibrated", "irb120")
    assert not any(name.startswith(("base", "target")) for name in row.parameters)
    count = len(row.parameters)
    assert len(row.covariance) == count * (count + 1) // 2
    first = next(iter(row.parameters.values()))
    assert row.covariance[0] == pytest.approx((first.deviation / first.prior) ** 2, abs=1e-9)
    assert type(row).read(json.loads(json.dumps(row.content()))) == row
    # values without priors are not drawn
    row = calibrated_robot(RobotEntry("one", "irb120", campaigns / "a.csv", {"train": 15, "redundancy": "drop"})).row
    assert not row.drawn
    assert type(row).read(json.loads(json.dumps(row.content()))) == row


def test_a_robot_of_which_the_calibration_breaks_is_a_row(campaigns: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def breaks(*_: object, **__: object) -> None:
        raise ArithmeticError("singular")

    monkeypatch.setattr(fleet_robots, "calibrate", breaks)
    row = calibrated_robot(RobotEntry("one", "irb120", campaigns / "a.csv", of="4711", date="2026-01-01")).row
    assert (row.status, row.of, row.date) == ("failed", "4711", "2026-01-01")
    assert row.message == "the calibration failed (ArithmeticError: singular)"


def test_a_robot_whose_figures_are_not_finite_is_a_row(
    campaigns: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    row = fleet_robots._row
    monkeypatch.setattr(
        fleet_robots, "_row", lambda *arguments: replace(row(*arguments), held_out=Accuracy(math.nan, 1, 1, 3))
    )
    calibrated = calibrated_robot(RobotEntry("one", "irb120", campaigns / "a.csv", {"train": 15}), tmp_path)
    assert (calibrated.row.status, calibrated.written, "not finite" in calibrated.row.message) == ("failed", (), True)


def test_a_folder_that_cannot_be_written_is_no_fault_of_the_robot(campaigns: Path, tmp_path: Path) -> None:
    (tmp_path / "robots").write_text("a file where the folder belongs", "utf-8")
    entry = RobotEntry("one", "irb120", campaigns / "a.csv", {"train": 15})
    said_of(None, "a folder is needed", calibrated_robot, entry, tmp_path)


# -- what is tried before anything is computed, and corrected afterwards ----------------------------------------------


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three robots of a series, a file of which one has fewer configurations, and a fleet of them that is done."""
    folder = tmp_path_factory.mktemp("checks")
    for number in (1, 2, 3):
        truearm.simulate("irb120", truth="random", poses=20, noise=3e-5, seed=number, out=folder / f"{number}.csv")
    lines = (folder / "3.csv").read_text("utf-8").splitlines(keepends=True)
    (folder / "few.csv").write_text("".join(lines[: 1 + 12 * ((len(lines) - 1) // 20)]), "utf-8")
    truearm.fleet(manifest(folder, ROBOTS), out=folder / "out", workers=1)
    return folder


ROBOTS: list[dict[str, Any]] = [
    {"name": "one", "robot": "irb120", "data": "1.csv"},
    {"name": "two", "robot": "irb120", "data": "2.csv", "options": {"train": 15}},
]


def manifest(folder: Path, robots: list[dict[str, Any]], options: dict[str, Any] | None = None, chunk: int = 1) -> Path:
    content = {"truearm": "truearm-fleet/1", "robots": robots, "chunk": chunk}
    (folder / "fleet.yaml").write_text(json.dumps({**content, "options": options or {"model": "offsets"}}), "utf-8")
    return folder / "fleet.yaml"


def own(measured: Path, tmp_path: Path) -> Path:
    """Return a copy of the fleet that is done, with its data."""
    shutil.copytree(measured, tmp_path / "fleet")
    return tmp_path / "fleet"


def new(measured: Path, tmp_path: Path) -> Path:
    """Return a copy of its data alone."""
    folder = own(measured, tmp_path)
    shutil.rmtree(folder / "out")
    return folder


def run(path: Path, **options: Any) -> Fleet:
    return truearm.fleet(path, out=path.parent / "out", workers=1, **options)


def refused(path: Path) -> InputError:
    with pytest.raises(InputError) as caught:
        run(path)
    return caught.value


WRONG: tuple[tuple[dict[str, Any], str], ...] = (
    ({"train": -5}, "must leave some held out"),
    ({"hold": ["bases"]}, "nothing of this name to hold; got 'bases'; allowed: base"),
    ({"hold": ["base"]}, "Give its places in a file with 'frames'."),
    ({"base_changes": [1, 2]}, "nothing was measured before the first configuration"),
    ({"base_changes": [4]}, "too few training configurations"),
    ({"zones": 100}, "out of range"),
    ({"seed": -1}, "out of range"),
    ({"bootstrap": 1}, "out of range"),
    ({"without": ["none"]}, "no configuration of this name"),
    ({"monte_carlo": 100, "loss": "huber"}, "Leave 'loss' out"),
)


def test_an_option_that_no_robot_can_be_calibrated_with_is_refused_where_it_stands(
    measured: Path, tmp_path: Path
) -> None:
    folder = new(measured, tmp_path)
    for wrong, words in WRONG:
        option = next(iter(wrong))
        refusal = refused(manifest(folder, ROBOTS[:1], wrong))
        assert (refusal.parameter, refusal.where) == ("manifest", f"{folder / 'fleet.yaml'}, options.{option}")
        assert words in str(refusal)
        assert not (folder / "out").exists()
        refusal = refused(manifest(folder, [ROBOTS[0], {**ROBOTS[1], "options": wrong}]))
        assert refusal.where == f"{folder / 'fleet.yaml'}, robots[2].options.{option}"
    refusal = refused(manifest(folder, [ROBOTS[0], {**ROBOTS[1], "robot": "nix"}]))
    assert ("robots[2].robot" in str(refusal), "no such robot" in str(refusal)) == (True, True)


def test_an_option_that_one_robot_of_several_cannot_be_calibrated_with_is_its_own_failure(
    measured: Path, tmp_path: Path
) -> None:
    folder = new(measured, tmp_path)
    few = {"name": "few", "robot": "irb120", "data": "few.csv"}
    fleet = run(manifest(folder, [few, ROBOTS[0]], {"train": 15}))
    assert [name for name, _ in fleet.analysis.failed] == ["few"]
    assert [notice.level for notice in fleet.warnings if notice.code == "robots-failed"] == ["warning"]


def test_a_fleet_of_which_all_robots_failed_ends_with_an_error(
    measured: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = own(measured, tmp_path)
    lines = (folder / "1.csv").read_text("utf-8").splitlines()
    empty = [",".join([*line.split(",")[:8], "", "", "", "0.03"]) for line in lines[1:4]]
    (folder / "1.csv").write_text("\n".join([lines[0], *empty]) + "\n", "utf-8")
    path = manifest(folder, ROBOTS[:1])
    monkeypatch.setattr("sys.argv", ["truearm", "fleet", str(path), "--out", str(folder / "new"), "--workers", "1"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 3
    assert "Error (no-result): None of 1 robot has a result" in capsys.readouterr().out


def test_a_corrected_manifest_goes_on_with_what_it_has_not_changed(measured: Path, tmp_path: Path) -> None:
    folder = own(measured, tmp_path)
    first = (folder / "out" / "parts" / "0000" / "0000001.jsonl").read_bytes()
    three = {"name": "three", "robot": "irb120", "data": "3.csv"}
    corrected = [ROBOTS[0], {**ROBOTS[1], "options": {"train": 14}}, three]
    path = manifest(folder, corrected)
    fleet = run(path)
    assert (fleet.run.parts, fleet.run.before) == (3, 1)
    assert fleet.run.told == ("1 part computed again, because the manifest or files of it have changed: two",)
    assert (folder / "out" / "parts" / "0000" / "0000001.jsonl").read_bytes() == first
    assert fleet.content() == truearm.fleet(path, out=folder / "whole", workers=1).content()
    assert run(path).run.before == 3


def test_corrected_data_are_computed_again_and_another_fleet_does_not_go_on_there(
    measured: Path, tmp_path: Path
) -> None:
    folder = own(measured, tmp_path)
    for robots, chunk in ((ROBOTS[::-1], 1), (ROBOTS, 2), (ROBOTS[:1], 1)):
        refusal = refused(manifest(folder, robots, chunk=chunk))
        assert "the parts there are of another manifest" in str(refusal)
        assert (folder / "out" / "robots" / "two").exists()
    robot = "out/robots/one/calibrated.yaml"  # a file that the fleet writes
    refusal = refused(manifest(folder, [*ROBOTS, {"name": "again", "robot": robot, "data": "3.csv"}]))
    assert "stands where the fleet writes" in str(refusal)
    shutil.copy(folder / "3.csv", folder / "2.csv")
    fleet = run(manifest(folder, ROBOTS))
    assert fleet.run.told == ("1 part computed again, because the manifest or files of it have changed: two",)


def test_a_folder_that_is_missing_is_made_again(measured: Path, tmp_path: Path) -> None:
    folder = own(measured, tmp_path)
    before = (folder / "out" / "robots" / "two" / "calibrated.yaml").read_bytes()
    shutil.rmtree(folder / "out" / "robots" / "two")
    (folder / "out" / "robots" / "one" / "report.html").unlink()
    fleet = run(manifest(folder, ROBOTS))
    every = ", ".join(f"robots/two/{name}" for name in ("calibrated.yaml", "result.json", "report.html"))
    message = "1 part computed again, because files of it are missing: "
    assert fleet.run.told == (f"{message}robots/one/report.html", f"{message}{every}, robots/two/calibrated.urdf")
    assert (folder / "out" / "robots" / "two" / "calibrated.yaml").read_bytes() == before


def test_data_that_change_while_the_fleet_runs_are_not_taken_for_the_old_ones(measured: Path, tmp_path: Path) -> None:
    folder = new(measured, tmp_path)
    path = manifest(folder, ROBOTS)
    old = (folder / "2.csv").read_bytes()

    def disturb(words: str) -> None:
        if words.startswith("part 1 of 2"):
            shutil.copy(folder / "3.csv", folder / "2.csv")

    assert [*read_manifest(path).robots[0].hashes] == [folder / "1.csv"]  # each knows the files read for it
    fleet = run(path, progress=disturb)
    assert fleet.analysis.failed == (("two", "2.csv changed while the fleet ran; start it again"),)
    assert not (folder / "out" / "robots" / "two").exists()
    (folder / "2.csv").write_bytes(old)
    again = run(path)
    assert again.run.told == ("1 part computed again, because files changed while it was computed: two",)
    assert again.content() == truearm.fleet(path, out=folder / "whole", workers=1).content()


def test_data_that_are_gone_while_the_fleet_runs_are_no_failure_of_the_robot(measured: Path, tmp_path: Path) -> None:
    folder = new(measured, tmp_path)
    path = manifest(folder, ROBOTS)

    def disturb(words: str) -> None:
        if words.startswith("part 1 of 2"):
            (folder / "2.csv").rename(folder / "away.csv")

    assert run(path, progress=disturb).analysis.failed[0][1] == "2.csv changed while the fleet ran; start it again"
    (folder / "away.csv").rename(folder / "2.csv")
    assert run(path).content()["calibrated"] == 2


def test_a_result_from_before_of_a_robot_that_fails_now_is_told(measured: Path, tmp_path: Path) -> None:
    folder = own(measured, tmp_path)
    lines = (folder / "2.csv").read_text("utf-8").splitlines()
    empty = [",".join([*line.split(",")[:8], "", "", "", "0.03"]) for line in lines[1:4]]
    (folder / "2.csv").write_text("\n".join([lines[0], *empty]) + "\n", "utf-8")
    robots = [ROBOTS[0], {**ROBOTS[1], "options": {}}]
    fleet = run(manifest(folder, robots))
    assert [(notice.level, notice.message[:29]) for notice in fleet.warnings if notice.code == "robots-outdated"] == [
        ("warning", "two could not be calibrated, ")
    ]


@pytest.mark.parametrize("name", RESULT_FILES)
def test_files_of_others_in_the_folder_of_a_robot_are_found_first(name: str, measured: Path, tmp_path: Path) -> None:
    folder = own(measured, tmp_path)
    shutil.rmtree(folder / "out")
    (folder / "out" / "robots" / "two").mkdir(parents=True)
    (folder / "out" / "robots" / "two" / name).write_text("mine", "utf-8")
    refusal = refused(manifest(folder, ROBOTS))
    assert refusal.where == str(folder / "out" / "robots" / "two" / name)
    assert not (folder / "out" / "record.json").exists()


@pytest.mark.parametrize("link", ["robots", "robots/two"])
def test_links_out_of_the_folder_are_refused(link: str, measured: Path, tmp_path: Path) -> None:
    folder = own(measured, tmp_path)
    shutil.rmtree(folder / "out")
    (folder / "elsewhere").mkdir()
    (folder / "out" / link).parent.mkdir(parents=True)
    (folder / "out" / link).symlink_to(folder / "elsewhere")
    refusal = refused(manifest(folder, ROBOTS))
    assert ("this is a link" in str(refusal), refusal.where) == (True, str(folder / "out" / link))
    assert [*(folder / "elsewhere").iterdir()] == []


def test_where_ctrl_c_stops_a_fleet_the_command_says_how_many_parts_are_on_disk(
    measured: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = own(measured, tmp_path)
    (folder / "out" / "parts" / "0000" / "0000002.jsonl").unlink()

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("truearm.fleets.running._computed", stop)
    path = manifest(folder, ROBOTS)
    monkeypatch.setattr("sys.argv", ["truearm", "fleet", str(path), "--out", str(folder / "out"), "--workers", "1"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 130
    assert capsys.readouterr().err == "Stopped: 1 of 2 parts are on disk; run it again to go on.\n"
