"""What a fleet of measured robots asks for is tried before anything is computed, and mended afterwards."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

import truearm
from truearm.calibration.result import RESULT_FILES
from truearm.commands import main
from truearm.engine.base.errors import InputError
from truearm.fleets.manifest import read_manifest
from truearm.fleets.result import Fleet


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


def run(path: Path, **given: Any) -> Fleet:
    return truearm.fleet(path, out=path.parent / "out", workers=1, **given)


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
        told = refused(manifest(folder, ROBOTS[:1], wrong))
        assert (told.parameter, told.where) == ("manifest", f"{folder / 'fleet.yaml'}, options.{option}")
        assert words in str(told)
        assert not (folder / "out").exists()
        told = refused(manifest(folder, [ROBOTS[0], {**ROBOTS[1], "options": wrong}]))
        assert told.where == f"{folder / 'fleet.yaml'}, robots[2].options.{option}"
    told = refused(manifest(folder, [ROBOTS[0], {**ROBOTS[1], "robot": "nix"}]))
    assert ("robots[2].robot" in str(told), "no such robot" in str(told)) == (True, True)


def test_an_option_that_one_robot_of_several_cannot_be_calibrated_with_is_its_own_failure(
    measured: Path, tmp_path: Path
) -> None:
    folder = new(measured, tmp_path)
    few = {"name": "few", "robot": "irb120", "data": "few.csv"}
    found = run(manifest(folder, [few, ROBOTS[0]], {"train": 15}))
    assert [name for name, _ in found.analysis.failed] == ["few"]
    assert [notice.level for notice in found.warnings if notice.code == "robots-failed"] == ["warning"]


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


def test_a_mended_manifest_goes_on_with_what_it_has_not_changed(measured: Path, tmp_path: Path) -> None:
    folder = own(measured, tmp_path)
    first = (folder / "out" / "parts" / "0000" / "0000001.jsonl").read_bytes()
    three = {"name": "three", "robot": "irb120", "data": "3.csv"}
    mended = [ROBOTS[0], {**ROBOTS[1], "options": {"train": 14}}, three]
    path = manifest(folder, mended)
    found = run(path)
    assert (found.run.parts, found.run.before) == (3, 1)
    assert found.run.told == ("1 part computed again, because the manifest or files of it have changed: two",)
    assert (folder / "out" / "parts" / "0000" / "0000001.jsonl").read_bytes() == first
    assert found.content() == truearm.fleet(path, out=folder / "whole", workers=1).content()
    assert run(path).run.before == 3


def test_mended_data_are_computed_again_and_another_fleet_does_not_go_on_there(measured: Path, tmp_path: Path) -> None:
    folder = own(measured, tmp_path)
    for robots, chunk in ((ROBOTS[::-1], 1), (ROBOTS, 2), (ROBOTS[:1], 1)):
        told = refused(manifest(folder, robots, chunk=chunk))
        assert "the parts there are of another manifest" in str(told)
        assert (folder / "out" / "robots" / "two").exists()
    robot = "out/robots/one/calibrated.yaml"  # a file that the fleet writes
    told = refused(manifest(folder, [*ROBOTS, {"name": "again", "robot": robot, "data": "3.csv"}]))
    assert "stands where the fleet writes" in str(told)
    shutil.copy(folder / "3.csv", folder / "2.csv")
    found = run(manifest(folder, ROBOTS))
    assert found.run.told == ("1 part computed again, because the manifest or files of it have changed: two",)


def test_a_folder_that_is_missing_is_made_again(measured: Path, tmp_path: Path) -> None:
    folder = own(measured, tmp_path)
    before = (folder / "out" / "robots" / "two" / "calibrated.yaml").read_bytes()
    shutil.rmtree(folder / "out" / "robots" / "two")
    (folder / "out" / "robots" / "one" / "report.html").unlink()
    found = run(manifest(folder, ROBOTS))
    every = ", ".join(f"robots/two/{name}" for name in ("calibrated.yaml", "result.json", "report.html"))
    told = "1 part computed again, because files of it are missing: "
    assert found.run.told == (f"{told}robots/one/report.html", f"{told}{every}, robots/two/calibrated.urdf")
    assert (folder / "out" / "robots" / "two" / "calibrated.yaml").read_bytes() == before


def test_data_that_change_while_the_fleet_runs_are_not_taken_for_the_old_ones(measured: Path, tmp_path: Path) -> None:
    folder = new(measured, tmp_path)
    path = manifest(folder, ROBOTS)
    old = (folder / "2.csv").read_bytes()

    def disturb(words: str) -> None:
        if words.startswith("part 1 of 2"):
            shutil.copy(folder / "3.csv", folder / "2.csv")

    assert [*read_manifest(path).robots[0].hashes] == [folder / "1.csv"]  # each knows the files read for it
    found = run(path, progress=disturb)
    assert found.analysis.failed == (("two", "2.csv changed while the fleet ran; start it again"),)
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
    found = run(manifest(folder, robots))
    assert [(one.level, one.message[:29]) for one in found.warnings if one.code == "robots-outdated"] == [
        ("warning", "two could not be calibrated, ")
    ]


@pytest.mark.parametrize("name", RESULT_FILES)
def test_files_of_others_in_the_folder_of_a_robot_are_found_first(name: str, measured: Path, tmp_path: Path) -> None:
    folder = own(measured, tmp_path)
    shutil.rmtree(folder / "out")
    (folder / "out" / "robots" / "two").mkdir(parents=True)
    (folder / "out" / "robots" / "two" / name).write_text("mine", "utf-8")
    told = refused(manifest(folder, ROBOTS))
    assert told.where == str(folder / "out" / "robots" / "two" / name)
    assert not (folder / "out" / "record.json").exists()


@pytest.mark.parametrize("link", ["robots", "robots/two"])
def test_links_out_of_the_folder_are_refused(link: str, measured: Path, tmp_path: Path) -> None:
    folder = own(measured, tmp_path)
    shutil.rmtree(folder / "out")
    (folder / "elsewhere").mkdir()
    (folder / "out" / link).parent.mkdir(parents=True)
    (folder / "out" / link).symlink_to(folder / "elsewhere")
    told = refused(manifest(folder, ROBOTS))
    assert ("this is a link" in str(told), told.where) == (True, str(folder / "out" / link))
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
