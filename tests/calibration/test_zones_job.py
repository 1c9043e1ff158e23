"""Zones win where the model lacks something, lose where it lacks nothing, and are refused where they cannot be."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tests.expecting import known, refused
from tests.simulated import campaign, more_of
from typer.testing import CliRunner

from truearm.calibration.calibrate import calibrate
from truearm.calibration.result import Calibration
from truearm.commands import program
from truearm.engine.choosing.zones import boxes_of, cut_boxes, divisions_for, flange_places, read_zones
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot_file.seal import is_intact
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import measured_with
from truearm.engine.twin.twin import Twin
from truearm.robot_files.jobs import inverse
from truearm.validation.jobs import validate

HEAD = "truearm: truearm-zones/1\nunits: {length: mm}\n"


@pytest.fixture(scope="module")
def bending() -> tuple[Twin, Dataset]:
    """An arm that gives way, which the geometric model lacks."""
    return campaign("irb120", 200, 0.02e-3, 7, truth="tracker-triangular")


@pytest.fixture(scope="module")
def cut(bending: tuple[Twin, Dataset], tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Calibration]:
    folder = tmp_path_factory.mktemp("zones")
    (folder / "data.csv").write_text(csv_text(bending[1]))
    return folder, calibrate("irb120", folder / "data.csv", zones=4, out=folder / "out")


def test_zones_win_where_the_model_lacks_something(
    bending: tuple[Twin, Dataset], cut: tuple[Path, Calibration]
) -> None:
    folder, run = cut
    zones = known(run.zones)
    assert (len(zones.verdicts), len(zones.kept) >= 2) == (4, True)
    assert zones.zoned < 0.9 * zones.whole
    assert zones.whole == pytest.approx(known(known(run.validation).position).mean)
    new = more_of(bending[0], 80, 0.02e-3, 8)
    by_zones, by_one = (validate(folder / "out" / name, new) for name in ("zones.yaml", "calibrated.yaml"))
    mean = known(by_zones.position).mean
    assert mean < 0.92 * known(by_one.position).mean
    assert sum(count for count, _ in known(by_zones.zones).values()) == 80
    rows = by_zones.summary()["zones"]
    assert sum(row["mean_mm"] * row["configurations"] for row in rows) / 80 == pytest.approx(mean * 1e3)
    assert any(line.startswith("  zone ") for line in by_zones.lines())
    assert "zones" not in by_one.summary()


def test_what_is_kept_is_written_and_read(cut: tuple[Path, Calibration]) -> None:
    folder, run = cut
    zones = known(run.zones)
    names = {path.name for path in (folder / "out").iterdir()}
    zone_names = [verdict.box.name for verdict in zones.kept]
    assert names == {*run.written, "truearm.manifest.json"}
    assert {f"zone-{name}.yaml" for name in zone_names} < names
    result = json.loads((folder / "out" / "result.json").read_text())["zones"]
    assert result["kept"] == zone_names
    assert [zone["kept"] for zone in result["zones"]].count(True) == len(zone_names)
    content = read_zones(folder / "out" / "zones.yaml")
    boxes, overlap = boxes_of(content, "zones.yaml")
    assert overlap == pytest.approx(0.05)
    for box, verdict in zip(boxes, zones.kept, strict=True):
        assert box.low == pytest.approx(verdict.box.low, abs=1e-6)
        assert box.high == pytest.approx(verdict.box.high, abs=1e-6)
    robot = load_robot(folder / "out" / f"zone-{zone_names[0]}.yaml")
    assert is_intact(robot)
    assert len(known(robot.proof).measured) == zones.kept[0].training
    assert robot.history[-1].endswith(f"zone {zone_names[0]}")
    page = (folder / "out" / "report.html").read_text()
    assert 'id="zone-errors"' in page
    assert any(line.startswith("Zones: ") for line in run.lines())


def test_zones_lose_where_the_model_lacks_nothing(tmp_path: Path) -> None:
    _, data = campaign("irb120", 160, 0.02e-3, 7)
    run = calibrate("irb120", data, zones=4, out=tmp_path / "out")
    zones = known(run.zones)
    assert (zones.kept, zones.zoned) == ((), zones.whole)
    assert not (tmp_path / "out" / "zones.yaml").exists()
    assert any(line.startswith("Zones: none of 4 zones is kept; one model is as good") for line in run.lines())
    assert {verdict.why for verdict in zones.verdicts} <= {
        "not better than the model of the whole",
        "better, but not by more than chance",
    }


def test_zones_of_a_file(bending: tuple[Twin, Dataset], tmp_path: Path) -> None:
    file = tmp_path / "zones.yaml"
    file.write_text(HEAD + "overlap: 20\nzones:\n  left: {y: [0, null]}\n  corner: {x: [300, 310], y: [-500, 0]}\n")
    run = calibrate("irb120", bending[1], zones=file, out=tmp_path / "out")
    left, corner = known(run.zones).verdicts
    assert (left.kept, corner.fit) == (True, None)
    assert corner.why.startswith("only ")
    assert "held-out configurations, and a judgement needs 5" in corner.why or "a model needs 12" in corner.why
    assert run.written[-2:] == ("zones.yaml", "zone-left.yaml")
    assert run.summary()["validation"] is not None
    again = calibrate("irb120", bending[1], zones=tmp_path / "out" / "zones.yaml")
    assert known(again.zones).verdicts[0].zone == left.zone


def test_a_file_of_zones_that_cannot_be_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "zones.yaml"
    for text, fault in (
        ("zones: {}\n", "too few entries"),
        ("zones: {a: {}}\n", "a zone without limits is the whole workspace"),
        ("zones: {a: {x: [null, null]}}\n", "a zone without limits is the whole workspace"),
        ("zones: {a: {x: [3, 1]}}\n", r"zones\.a\.x: a zone ends where it begins, or before"),
        ("zones: {a: {x: [1, 1]}}\n", "a zone ends where it begins"),
        ("zones: {a: {x: [0, 9]}, b: {x: [8, 20], y: [0, 5]}}\n", "two zones share a part .*; got 'a and b'"),
        ("zones: {a: {w: [0, 9]}}\n", "w"),
        ("zones: {a: {x: [0]}}\n", r"zones\.a\.x"),
        ("zones: {a: {x: [0, far]}}\n", r"zones\.a\.x"),
        ("zones: {a/b: {x: [0, 9]}}\n", "a/b"),
        ("overlap: -1\nzones: {a: {x: [0, 9]}}\n", "overlap"),
        ("zones: {a: {x: [0, 1e12]}}\n", r"zones\.a"),
        ("zones: {a: {x: [0, 9], robot: {file: ../b.yaml, proof: no}}}\n", "robot"),
    ):
        file.write_text(HEAD + text)
        refused(None, fault, lambda: boxes_of(read_zones(file), str(file)))
    file.write_text("truearm: truearm-zones/1\nzones: {a: {x: [0, 9]}}\n")
    refused(None, "units", read_zones, file)


def test_what_cannot_be_cut_is_refused(bending: tuple[Twin, Dataset]) -> None:
    _, data = bending
    for zones, fault in (
        (1, "out of range; got 1; allowed: 2 to 64"),
        ("nowhere.yaml", "there is no such file"),
        (2.5, "a whole number belongs here"),
    ):
        refused(None, fault, calibrate, "irb120", data, zones=zones)
    words = r"zones are judged on held-out configurations.*Leave `train` out"
    refused(None, words, calibrate, "irb120", data, zones=2, train="all")
    measured = measured_with(named_device("point"), load_robot("irb120"), bending[0], 30, np.random.default_rng(0))
    words = "zones need readings that say where the robot stands"
    refused(None, words, calibrate, "irb120", measured, zones=2, model="offsets")


def test_zones_are_for_validate_alone(cut: tuple[Path, Calibration], tmp_path: Path) -> None:
    folder, run = cut
    zones, data, file = folder / "out" / "zones.yaml", folder / "data.csv", tmp_path / "zones.yaml"
    words = r"names the robots of zones, and one robot belongs here.*Give calibrated.yaml"
    refused(None, words, load_robot, zones)
    refused(None, "one robot belongs here", inverse, zones, np.zeros((1, 3)) + 0.4)
    refused(None, r"moved is found with one robot.*Give calibrated.yaml", validate, zones, data, refit="base")
    file.write_text(HEAD + "zones: {left: {y: [0, null]}}\n")
    refused(None, "says where zones are, and not which robot is in each", validate, file, data)
    files = [f"zone-{verdict.box.name}.yaml" for verdict in known(run.zones).kept]
    for name in ("zones.yaml", "calibrated.yaml", *files):
        (tmp_path / name).write_bytes((folder / "out" / name).read_bytes())
    (tmp_path / files[0]).write_bytes((folder / "out" / "calibrated.yaml").read_bytes())
    refused(None, "this robot is of another calibration than the zones", validate, file, data)
    (tmp_path / files[0]).unlink()
    refused(None, "there is no such file", validate, file, data)


def test_the_command_takes_a_number_or_a_file(tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_text(csv_text(campaign("irb120", 60, 0.02e-3, 7)[1]))
    words = ["calibrate", "irb120", str(tmp_path / "data.csv"), "--out", str(tmp_path / "out"), "--details"]
    outcome = CliRunner().invoke(program(), [*words, "--zones", "2"])
    assert outcome.exit_code == 0
    assert "\nZones: " in outcome.stdout
    assert outcome.stdout.splitlines()[-1].startswith(f"Written to {tmp_path / 'out'}: calibrated.yaml, result.json")
    outcome = CliRunner().invoke(program(), [*words, "--zones", "2 or 3"])
    assert outcome.exit_code != 0


def test_boxes_fill_the_space_and_are_nearly_cubes() -> None:
    rng = np.random.default_rng(0)
    places = rng.uniform([0.0, 0.0, 0.0], [4.0, 1.0, 2.0], (400, 3))
    assert divisions_for(places, 4) in ((4, 1, 1), (2, 1, 2))
    assert divisions_for(places, 8) == (4, 1, 2)
    assert divisions_for(places, 5) == (5, 1, 1)
    boxes = cut_boxes(places, (2, 1, 2))
    inside = np.array([box.holds(places) for box in boxes])
    assert (inside.sum(axis=0) == 1).all()
    assert inside.sum(axis=1).min() > 60


def test_the_nominal_flange_is_that_of_the_table(cut: tuple[Path, Calibration]) -> None:
    _, run = cut
    joints = run.data.joints[:5]
    assert flange_places(run.robot, joints) == pytest.approx(load_robot("irb120").forward(joints)[0], abs=1e-12)
