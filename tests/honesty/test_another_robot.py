"""Readings of a look-alike calibrate the robot that was named to its last hundredth: that is told, and not used."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from tests.answered import ANSWERS
from tests.honesty.telling import Told, told, written
from tests.lookalikes import campaign_of, sized
from tests.plate import PLATE

from truearm.engine.robot.library import load_robot


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("another")
    (made / "plate.mod").write_text(PLATE)
    poses = [f"  movel(p[-0.{6 + i}, -0.3, 0.{2 + i}, 0.1, 3.1, 0.0], a=1.2, v=0.25)" for i in range(3)]
    (made / "job.script").write_text("\n".join(["def job():", "  set_tcp(p[0, 0, 0.1, 0, 0, 0])", *poses, "end", ""]))
    written(made, campaign_of(load_robot("ur10e"), 60, 1)[1])
    return made


@cache
def calibrated(given: str, folder: Path) -> Told:
    return told("calibrate", given, folder / "data.csv", "--out", folder / given, "--model=geometric")


def test_readings_of_a_ur10e_are_not_those_of_a_ur10(folder: Path) -> None:
    found = calibrated("ur10", folder)
    assert found.code == 3
    assert found.summary["status"] == "converged"
    assert found.summary["validation"]["position_mm"]["mean"] < 0.15
    assert found.says("wrong-robot", "error", r"not of ur10, by its lengths: d_2 \+ d_3 \+ d_4 by \+1\d\.\d mm")
    assert found.says("wrong-robot", "error", r"ur10e of the library fits them \d\.\d times better")
    assert calibrated("ur10e", folder).code == 0


def test_the_check_tells_it_before_anything_is_fitted(folder: Path) -> None:
    found = told("check", "ur10", folder / "data.csv")
    assert found.code == 3
    assert found.says("wrong-robot", "error", "ur10e of the library")
    assert told("check", "ur10e", folder / "data.csv").code == 0


@pytest.mark.parametrize(("times", "off"), [(1.278, "[+]9"), (0.75, "-8")])
def test_an_arm_of_the_family_that_is_in_no_library_is_no_unit(times: float, off: str, tmp_path: Path) -> None:
    """Both parts of its arm are longer, or shorter: the readings fit when they are scaled, by no unit's factor."""
    longer = sized("irb1200_7_0.7", "longer", a_3=350.0 * times, d_4=351.0 * times)
    file = written(tmp_path, campaign_of(longer, 30, 3)[1])
    for words in (("check",), ("calibrate", "--model=geometric", "--out", tmp_path / "out")):
        found = told(words[0], "irb1200_7_0.7", file, *words[1:])
        assert found.says("wrong-robot", "error", rf"by its lengths: .*a_3 by {off}[0-9.]+ mm"), found
        assert "wider priors" not in found.messages["wrong-robot"]
        assert "unit-length" not in found.levels


def test_an_instrument_whose_scale_is_wrong_may_be_the_cause(tmp_path: Path) -> None:
    data = campaign_of(load_robot("irb1200_7_0.7"), 30, 3)[1]
    for times, code, words in (
        (
            1.278,
            "wrong-robot",
            r"All its lengths come out 1\.28 times as long, by one factor: .*the scale of the instrument",
        ),
        (10.0, "unit-length", "too large for this robot"),
    ):
        file = written(tmp_path, replace(data, position=data.position * times))
        assert told("check", "irb1200_7_0.7", file).says(code, "error", words)
    assert not told("check", "irb1200_7_0.7", written(tmp_path, data)).levels


def test_an_arm_of_another_maker_is_not_unrelated_rows(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("truearm.engine.diagnose.wrong_robot.library", lambda: ("irb120", "ur5e"))
    for measured, given, code in (("puma560", "irb120", "wrong-robot"), ("xarm6", "ur5e", "implausible")):
        found = told("check", given, written(tmp_path, campaign_of(load_robot(measured), 30, 3)[1]))
        assert found.says(code, "error"), found
        assert "rows-unrelated" not in found.levels


def test_who_validates_it_hears_it_again(folder: Path) -> None:
    calibrated("ur10", folder)
    calibrated("ur10e", folder)
    for name, is_wrong in (("ur10", True), ("ur10e", False)):
        found = told("validate", folder / name / "calibrated.yaml", folder / "data.csv")
        assert ("wrong-robot" in found.levels) is is_wrong, found


def test_no_program_is_corrected_with_it_until_it_is_accepted(folder: Path) -> None:
    calibrated("ur10", folder)
    arm, program = folder / "ur10" / "calibrated.yaml", folder / "job.script"
    words = ("compensate", arm, program, *ANSWERS, "--out")
    refused = told(*words, folder / "out")
    assert refused.code == 2
    assert "ur10e of the library" in refused.refusal
    assert "--accept wrong-robot" in refused.refusal
    assert not (folder / "out").exists()
    accepted = told(*words, folder / "accepted", "--accept", "wrong-robot")
    assert accepted.code == 0, accepted
    assert accepted.says("wrong-robot", "warning", "not of ur10")


def test_a_program_of_another_maker_is_not_corrected_until_it_is_accepted(folder: Path) -> None:
    calibrated("ur10e", folder)
    words = ("compensate", folder / "ur10e" / "calibrated.yaml", folder / "plate.mod", *ANSWERS, "--out")
    refused = told(*words, folder / "rapid")
    assert refused.code == 2
    assert "a robot of Universal Robots and programs in RAPID" in refused.refusal
    assert "--accept maker" in refused.refusal
    accepted = told(*words, folder / "rapid", "--accept", "maker", "--accept", "skipped")
    assert accepted.says("maker", "warning", "RAPID runs on controllers of ABB"), accepted
