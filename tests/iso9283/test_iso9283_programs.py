"""Measuring programs that the job writes: slow ones first, faster ones after a slow run is recorded."""

from __future__ import annotations

import datetime
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.iso9283.campaign_files import CUBE

import truearm
from truearm.engine.base.errors import InputError, Notice
from truearm.engine.robot.controller import Controller
from truearm.iso9283.planning.result import Iso9283Plan
from truearm.iso9283.planning.routes import SLOW_RUN


def planned(cube: Path, **more: Any) -> Iso9283Plan:
    options: dict[str, Any] = {"criteria": ["av"], "cube": cube, "velocities": [100, 10], "velocity": 0.5, "load": 3.0}
    return truearm.iso9283_plan(**({"robot": "irb120"} | options | more))


@pytest.fixture(scope="module")
def slow(cube: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a plan, its slow program and the record that its slow run asks for."""
    folder = tmp_path_factory.mktemp("slow")
    planned(cube, program="rapid", out=folder)
    return folder


def filled(path: Path, **entries: str) -> None:
    lines = path.read_text().splitlines()
    known = {"completed": "yes", "by": "A. Operator", "date": datetime.date.today().isoformat(), **entries}
    path.write_text(
        "\n".join(f"{key}: {known[key]}" if (key := line.partition(":")[0]) in known else line for line in lines) + "\n"
    )


def test_faster_programs_are_written_once_the_slow_run_is_recorded(cube: Path, tmp_path: Path) -> None:
    first = planned(cube, program="rapid", out=tmp_path)
    assert first.programs is not None
    assert [*first.programs.files] == ["programs/AV_10.mod"]
    assert "1 measuring program in RAPID, at up to 10 % of the velocity. The faster ones" in "\n".join(first.lines())
    assert first.summary()["programs"] == {
        "language": "RAPID",
        "slow_percent": 10.0,
        "slow_run_completed": False,
        "files": ["programs/AV_10.mod"],
    }
    assert first.written == ["plan.yaml", "robot.yaml", "sheet.html", "programs", SLOW_RUN]
    record = tmp_path / SLOW_RUN
    assert "completed: no" in record.read_text()
    planned(cube, program="rapid", out=tmp_path)  # as long as nobody has filled it in it is written again
    filled(record)
    content = record.read_text()
    both = planned(cube, program="rapid", slow_run=record, out=tmp_path)
    assert both.programs is not None
    assert sorted(path.name for path in (tmp_path / "programs").iterdir()) == ["AV_10.mod", "AV_100.mod"]
    assert "2 measuring programs in RAPID, at every velocity." in both.lines()
    assert record.read_text() == content
    assert "[500,500,5000,1000]" in (tmp_path / "programs" / "AV_100.mod").read_text()
    with pytest.raises(InputError, match="somebody has filled in this record of a slow run, and it would be lost"):
        planned(cube, program="rapid", out=tmp_path)
    assert record.read_text() == content


@pytest.mark.parametrize(
    ("entries", "more", "message"),
    [
        ({"completed": "no"}, {}, "the slow run is not completed, so no faster programs are written; got 'no'"),
        ({"completed": "perhaps"}, {}, "completed"),
        ({"by": "''"}, {}, "does not say by whom and when"),
        ({"date": "''"}, {}, "does not say by whom and when"),
        ({"date": "23.11.2026"}, {}, "the day of the slow run is no date; got '23.11.2026'; allowed: year-month-day"),
        ({"date": "2026-02-30"}, {}, "day is out of range for month"),
        ({"date": "2099-01-01"}, {}, "the day of the slow run is still to come; got 2099-01-01"),
        ({"date": "2099-01-01 08:00:00"}, {}, "the day of the slow run is still to come; got 2099-01-01"),
        ({}, {"velocities": [100.0, 50.0, 10.0]}, "the slow run was of another plan"),
        ({}, {"dwell": 3.0}, "the slow run was of other programs"),
        ({}, {"program": "krl"}, "the slow run was of other programs"),
        ({}, {"program": None}, "a slow run allows faster programs, and none are asked for"),
    ],
)
def test_a_slow_run_that_says_too_little_or_something_else_is_refused(
    entries: dict[str, str], more: dict[str, Any], message: str, cube: Path, slow: Path, tmp_path: Path
) -> None:
    out = shutil.copytree(slow, tmp_path / "out")
    filled(out / SLOW_RUN, **entries)
    with pytest.raises(InputError, match=message):
        planned(cube, slow_run=out / SLOW_RUN, out=out, **({"program": "rapid"} | more))
    assert [path.name for path in (out / "programs").iterdir()] == ["AV_10.mod"]


def test_a_language_of_another_maker_and_speeds_that_it_does_not_say_are_told(cube: Path) -> None:
    def notices(language: str, **more: Any) -> list[Notice]:
        warnings = planned(cube, program=language, **more).warnings
        return [warning for warning in warnings if warning.code in ("maker", "joint-speed-assumed")]

    (speed,) = notices("rapid")
    assert (speed.code, speed.level) == ("joint-speed-assumed", "note")
    assert "joint motions have the share of the rated velocity, of the tip" in speed.message
    maker, speed = notices("urscript")
    assert (maker.code, maker.level, speed.code) == ("maker", "warning", "joint-speed-assumed")
    assert "programs were written in URScript." in maker.message
    assert "the leading joint goes so fast that one joint has the share" in speed.message
    assert [notice.code for notice in notices("fanuc")] == ["maker"]
    robot = truearm.load_robot("irb120")
    robot = replace(robot, maker="", joints=tuple(replace(joint, max_speed=None) for joint in robot.joints))
    for language, words in (("krl", "the tip keeps to 250 mm/s"), ("urscript", "100 % is taken for 120 deg/s")):
        *_, speed = notices(language, robot=robot)
        assert (speed.code, words in speed.message) == ("joint-speed-assumed", True), language


def test_programs_of_a_controller_whose_counting_is_not_known_say_so_or_are_refused(cube: Path) -> None:
    robot = replace(truearm.load_robot("irb120"), controller=Controller(), maker="")
    options: dict[str, Any] = {"criteria": ["ap"], "velocities": (100, 50, 10), "velocity": None}
    with pytest.raises(
        InputError, match="controllers that run FANUC LS count joint 3 together with joint 2"
    ) as refusal:
        planned(cube, robot=robot, program="fanuc", **options)
    assert refusal.value.parameter == "program"
    for language in ("rapid", "krl", "urscript", "val3"):
        result = planned(cube, robot=robot, program=language, **options)
        (assumed,) = [warning for warning in result.warnings if warning.code == "controller-counts-assumed"]
        assert assumed.level == "warning"
        assert result.programs is not None
        assert any("compare joints with the pendant" in text for text in result.programs.files.values())
        assert assumed.message.partition(":")[0] in result.contents()["sheet.html"]
    counted = replace(robot, controller=Controller(source="the pendant shows the model's joints"))
    known = planned(cube, robot=counted, program="fanuc", **options).programs
    assert known is not None
    assert not any("compare joints" in text for text in known.files.values())


def test_the_sheet_has_the_order_of_the_poses_and_the_tip(cube: Path) -> None:
    sheet = planned(cube, criteria=["ap", "ad", "at"], tip=(0.01, 0.0, 0.1)).contents()["sheet.html"]
    assert "P5, P4, P3, P2, P1" in sheet
    assert "P2, P4" in sheet
    assert "at x 10.000, y 0.000, z 100.000 mm in the flange frame" in sheet
    assert "The flange itself is measured" in planned(cube).contents()["sheet.html"]
    assert "in the order in which programs drive them" not in planned(cube).contents()["sheet.html"]
    noted = planned(cube, velocity=None).contents()["sheet.html"]
    assert '<p class="notice note" data-code="rated-velocity-assumed">' in noted


def test_a_folder_never_holds_programs_of_two_plans(cube: Path, tmp_path: Path) -> None:
    for criteria in (["av"], ["av", "ap"], ["av", "ap"]):
        planned(cube, program="krl", criteria=criteria, out=tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert sorted(path.name for path in (tmp_path / "programs").iterdir()) == ["AP_10.src", "AV_10.src"]
    for other in ({"program": "krl"}, {"program": "rapid", "criteria": ["av", "ap"]}, {}, {"criteria": ["ad"]}):
        with pytest.raises(InputError, match="programs of another plan are there, and would stay beside") as refusal:
            planned(cube, out=tmp_path, **other)
        assert refusal.value.parameter == "out"
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before
    filled(tmp_path / SLOW_RUN)
    planned(cube, program="krl", criteria=["av", "ap"], slow_run=tmp_path / SLOW_RUN, out=tmp_path)
    (tmp_path / SLOW_RUN).unlink()
    with pytest.raises(InputError, match=r"would stay beside this one; got '.*100.src'"):
        planned(cube, program="krl", criteria=["av", "ap"], out=tmp_path)


def test_a_program_of_somebody_else_is_not_overwritten(cube: Path, tmp_path: Path) -> None:
    planned(cube, program="krl", out=tmp_path)
    (tmp_path / "programs" / "AD_10.src").write_text("of somebody else")
    with pytest.raises(InputError, match="was not written here by truearm, and is not overwritten"):
        planned(cube, program="krl", criteria=["av", "ad"], out=tmp_path)


def test_ways_that_come_near_the_floor_are_told(cube: Path, tmp_path: Path) -> None:
    low = tmp_path / "low.yaml"
    low.write_text(CUBE.replace("0, 350]", "0, 150]"))
    options: dict[str, Any] = {"criteria": ["ap", "av"], "program": "rapid", "tip": (0.0, 0.0, 0.05)}
    assert not [warning for warning in planned(cube, **options).warnings if warning.code == "ways-near"]
    (near,) = [warning for warning in planned(low, **options).warnings if warning.code == "ways-near"]
    assert near.level == "warning"
    assert "ways the arm comes within 50 mm of the floor or of itself, nearest on A" in near.message
    assert "near the floor, " in near.message
