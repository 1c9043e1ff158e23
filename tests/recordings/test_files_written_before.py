"""Files that version 0.1.0 wrote in November 2026 are read for good, with the same figures.

``written/`` is never written anew: a file that another version writes otherwise comes beside the old one.
"""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from tests.answered import compensate
from tests.recordings.comparing import differences

import truearm
from truearm.studio.project import open_project

WRITTEN = Path(__file__).parent / "written"
ROBOTS = sorted(path.name for path in (WRITTEN / "robots").iterdir())
NOMINAL = [name for name in ROBOTS if name not in ("found-by-axes.yaml", "ur10-controller.yaml")]
#: Somewhere in the reach of the IRB 120 [rad].
JOINTS = np.radians([[10.0, 20.0, -30.0, 40.0, 50.0, 60.0], [-70.0, 30.0, 0.0, -20.0, 40.0, 0.0]])


@pytest.fixture
def written(tmp_path: Path) -> Path:
    """Return a copy of the files, to work in."""
    return Path(shutil.copytree(WRITTEN, tmp_path / "written"))


def close(found: object, told: object) -> bool:
    """Say whether numbers agree with those of a file; a fit of another processor ends elsewhere in the last digits."""
    return bool(found == pytest.approx(told, rel=1e-6, abs=1e-9))


@pytest.mark.parametrize("name", ROBOTS)
def test_robot_files_are_shown(name: str) -> None:
    shown = truearm.show(WRITTEN / "robots" / name).summary()
    assert len(shown["joints"]) == 6


@pytest.mark.parametrize("name", NOMINAL)
def test_a_converted_robot_goes_where_the_first_one_went(name: str) -> None:
    places = [truearm.load_robot(robot).forward(JOINTS) for robot in ("irb120", WRITTEN / "robots" / name)]
    for one, other in zip(*places, strict=True):
        np.testing.assert_allclose(other, one, atol=1e-9)


def test_the_calibrated_robot_goes_where_it_went() -> None:
    robot = truearm.load_robot(WRITTEN / "calibrated" / "calibrated.yaml")
    positions, _ = robot.forward(JOINTS, frame="world", target="1")
    told = [
        [1.989674390777532, 1.238931084418889, 0.070598223487612],
        [2.756493548418193, 1.256468236462684, -0.247228270209375],
    ]
    np.testing.assert_allclose(positions, told, rtol=0, atol=1e-9)
    assert robot.simulated


def test_the_result_holds_what_a_new_calibration_finds(written: Path) -> None:
    old = json.loads((written / "calibrated" / "result.json").read_text())
    new = truearm.calibrate(
        "irb120", written / "data" / "train.csv", model="elastic", payload="2.7kg,50mm,25mm,100mm", out=written / "new"
    ).summary()
    for part in ("nominal", "train", "validation"):
        assert close(new[part]["position_mm"], old[part]["position_mm"])
    before = [one["code"] for one in old["warnings"] if one["code"] != "urdf-partial"]  # it is `not_in_urdf` now
    assert [one["code"] for one in new["warnings"]] == before
    assert new["not_in_urdf"] == ["compliance"]


def test_the_proof_holds(written: Path) -> None:
    """The robot file was not changed since, and is judged as it was."""
    old = json.loads((written / "validated" / "result.json").read_text())
    new = truearm.validate(written / "calibrated" / "calibrated.yaml", written / "data" / "check.csv")
    assert close(new.summary()["position_mm"], old["position_mm"])


def test_a_program_is_corrected_with_the_robot_and_the_cell_as_it_was(written: Path) -> None:
    correction = compensate(
        written / "calibrated" / "calibrated.yaml",
        [written / "cell" / "plate.mod"],
        tools=written / "cell" / "cell.yaml",
        frames=written / "cell" / "cell.yaml",
        accept=["not-better-here"],
        out=written / "anew",
    )
    codes = {warning["code"] for warning in correction.summary()["warnings"]}
    assert not codes & {"unproven", "edited-by-hand", "changed-since-written"}
    texts = ((written / place / "plate.mod").read_text() for place in ("corrected", "anew"))
    old, new = (re.sub(r"\d{4}-\d\d-\d\d", "today", text).splitlines() for text in texts)
    assert not list(differences(old, new))


def test_a_corrected_program_is_known_and_restored(written: Path) -> None:
    with pytest.raises(truearm.InputError, match="corrected already"):
        compensate(written / "calibrated" / "calibrated.yaml", [written / "corrected" / "plate.mod"])
    truearm.revert([written / "corrected" / "plate.mod"], out=written / "original")
    original = (written / "cell" / "plate.mod").read_bytes()
    assert (written / "original" / "plate.mod").read_bytes() == original


def test_the_ledger_knows_a_corrected_program_without_its_record_and_its_comment(written: Path) -> None:
    text = re.sub(r"(?m)^.*truearm.*\n", "", (written / "corrected" / "plate.mod").read_text())
    (written / "bare.mod").write_text(text)
    robot = written / "calibrated" / "calibrated.yaml"
    with pytest.raises(truearm.InputError, match="corrected already"):
        compensate(robot, [written / "bare.mod"])
    (written / "calibrated" / "truearm.corrected.json").unlink()
    compensate(robot, [written / "bare.mod"], accept=["not-better-here"])


def test_a_measuring_goes_on_where_it_stopped(written: Path) -> None:
    place = written / "measuring"
    with (place / "seen" / "rows.csv").open("a") as stream:
        stream.write("P2,floor,1,2,3,1,0,0,0,0.02,2026-11-23 10:02:00,0.01,0.01,20,0\n")
        stream.write("P3,smr,700,-640,790,1,0,0,0,0.02,2026-11-23 10:03:00,0.01,0.01,20,0\n")
        stream.write("P3,floor,1,2,3,1,0,0,0,0.02,2026-11-23 10:04:00,0.01,0.01,20,0\n")
    measured = truearm.measure(
        place / "plan.csv",
        "irb120",
        watch=place / "seen",
        mapping=place / "rows.yaml",
        targets=["smr"],
        timeout=0,
        out=place / "out",
    )
    assert "unfinished" not in {warning["code"] for warning in measured.summary()["warnings"]}
    before = (WRITTEN / "measuring" / "out" / "readings.csv").read_text()
    assert (place / "out" / "readings.csv").read_text().startswith(before)


@pytest.mark.parametrize("lost", [None, "0000002.jsonl"])
def test_a_series_goes_on_where_it_stopped(written: Path, lost: str | None) -> None:
    place = written / "series"
    old = json.loads((place / "out" / "fleet.json").read_text())
    parts = place / "out" / "parts" / "0000"
    if lost:
        (parts / lost).unlink()
    kept = (parts / "0000001.jsonl").stat().st_mtime_ns
    fleet = truearm.fleet(place / "series.yaml", out=place / "out", workers=1).summary()
    assert (parts / "0000001.jsonl").stat().st_mtime_ns == kept
    assert fleet["calibrated"] == 3
    for of, errors in old["errors_mm"].items():
        assert close(fleet["errors_mm"][of]["worst_mean"], errors["worst_mean"])


def test_tests_by_iso_9283_are_evaluated_as_they_were_and_compared(written: Path) -> None:
    place = written / "iso9283"
    old = json.loads((place / "result" / "iso9283.json").read_text())
    truearm.iso9283_evaluate(
        place / "plan" / "plan.yaml",
        poses=place / "before" / "poses.csv",
        alignment=place / "before" / "alignment.yaml",
        compare=place / "result" / "iso9283.json",
        out=written / "new",
    )
    new = json.loads((written / "new" / "iso9283.json").read_text())
    assert not list(differences(old["criteria"], new["criteria"]))
    assert not list(differences(old["plan"], new["plan"]))


def test_plans_are_measured_and_sets_read(written: Path) -> None:
    measured = truearm.simulate("irb120", truth="nominal", poses=written / "plan" / "plan.csv", noise=0.0)
    assert len(measured.data.labels) == 8
    found = truearm.inverse("irb120", written / "plan" / "set-poses.csv", branch="front-up-noflip")
    assert found.summary()["poses_reached"] == 5


def test_a_project_of_the_studio_is_opened(written: Path) -> None:
    settings = open_project(written / "studio").settings
    assert (settings.robot, settings.data, settings.train, settings.dark) == ("irb120", "measurements.csv", 40, True)
    assert settings.taught == ("none",)
    assert settings.performance.plan == "tests/plan.yaml"
    told = truearm.validate(written / "studio" / "calibrated.yaml", written / "studio" / "measurements.csv").summary()
    assert told["position_mm"]["mean"] == pytest.approx(0.09391282279686651, rel=1e-6)
