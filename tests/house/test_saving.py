"""Where results may be written, by the job and by the record itself."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.house.examples import EXAMPLES

import truearm
from truearm.engine.base.errors import InputError


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("saving")


def test_one_pose_of_the_device_is_no_data_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no joint positions"):
        truearm.hexapod_solve(**EXAMPLES["hexapod_solve"](tmp_path)).save(tmp_path / "cups.csv")


@pytest.mark.parametrize("job", ["simulate", "inverse", "plan", "export", "lines", "calibrate"])
@pytest.mark.parametrize("place", ["/proc/x", "w/.."])
def test_a_job_refuses_a_place_that_cannot_be_before_its_work(
    job: str, place: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if (job, place) == ("calibrate", "w/.."):
        place = "/dev/null"
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as refusal:
        getattr(truearm, job)(**{**EXAMPLES[job](folder), "out": place})
    assert refusal.value.parameter == "out"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("job", "parameter"), [("example", "folder"), ("new_robot", "file")])
def test_templates_name_the_place(job: str, parameter: str) -> None:
    with pytest.raises(InputError, match="cannot be written to") as refusal:
        getattr(truearm, job)("/proc/x")
    assert refusal.value.parameter == parameter


def test_a_record_does_not_overwrite_what_its_job_read(folder: Path) -> None:
    data = EXAMPLES["load_data"](folder)["data"]
    before = data.read_bytes()
    with pytest.raises(InputError, match="is read, and would be overwritten") as refusal:
        truearm.plan("irb120", poses=10, candidates_from=data).save(data)
    assert (refusal.value.parameter, data.read_bytes()) == ("file", before)
    robot = EXAMPLES["validate"](folder)["robot"]
    again = truearm.calibrate(robot, data, model="offsets")
    with pytest.raises(InputError, match="is read, and would be overwritten") as refusal:
        again.save(robot.parent)
    assert refusal.value.parameter == "folder"


@pytest.mark.parametrize("steps", ["sub/../sheet.csv", "./sheet.csv"])
def test_a_sheet_and_its_steps_are_two_files(
    steps: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("sub").mkdir()
    good = EXAMPLES["hexapod_plan"](folder)
    for sheet, text in (("sheet.csv", steps), ("sheet.csv", tmp_path / "sheet.csv"), ("sheet.csv", "/proc/x")):
        with pytest.raises(InputError) as refusal:
            truearm.hexapod_plan(**{**good, "out": sheet, "steps": text})
        assert refusal.value.parameter == "steps"
        assert not Path("sheet.csv").exists()
