"""What others rely on of ``truearm plan``."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from tests.commanding import Truearm

from truearm.engine.data.readers.canonical import read_csv

RULES = """\
truearm: truearm-constraints/1
units: {length: mm, angle: deg}
moments: {2: positive}
floor: 50
"""


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_plan_in_json_and_in_its_files(truearm: Truearm, tmp_path: Path) -> None:
    rules, out = tmp_path / "rules.yaml", tmp_path / "plan.csv"
    rules.write_text(RULES)
    words = ("plan", "irb120", "--poses", 15, "--candidates", 400, "--constraints", rules, "--out", out, "--json")
    run = truearm(*words)
    assert run.code == 0
    told = json.loads(run.out)
    assert {"poses", "indices", "candidates", "rejected", "seconds"} <= set(told)
    assert (told["poses"], told["candidates"]) == (15, 400)
    assert list(told["indices"]) == ["O1", "O2", "O3", "O4", "O5"]
    assert set(told["rejected"]) == {"limits", "moment_2", "floor"}
    assert told["prediction"]["floor_mm"] < told["prediction"]["planned_mm"]
    rows = rows_of(out)
    assert [row["configuration"] for row in rows] == [str(k + 1) for k in range(15)]
    assert list(rows[0])[1] == "joint_1 [deg]"
    assert list(rows[0])[-1] == "approach_6 [deg]"
    page = (tmp_path / "plan.html").read_text()
    assert "Where the robot will be accurate" in page
    assert "<script src" not in page
    first = out.read_bytes()
    assert truearm(*words).code == 0
    assert out.read_bytes() == first


def test_a_choice_among_measured_configurations_keeps_their_names(
    truearm: Truearm, small: Path, tmp_path: Path
) -> None:
    out = tmp_path / "plan.csv"
    run = truearm("plan", "irb120", "--from", small / "data.csv", "--poses", 12, "--model", "elastic", "--out", out)
    assert run.code == 0
    assert "12 of 40 usable configurations" in run.out
    assert "poses are enough" in run.out or "More poses" in run.out
    data = read_csv(small / "data.csv")
    for row in rows_of(out):
        joints = [float(row[f"joint_{k} [deg]"]) for k in range(1, 7)]
        assert np.deg2rad(joints) == pytest.approx(data.joints[data.labels.index(row["configuration"])])


def test_auto_and_a_calibrated_robot(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    assert truearm("calibrate", "irb120", small / "data.csv", "--out", tmp_path / "done").code == 0
    rules = tmp_path / "rules.yaml"
    rules.write_text(RULES.replace("floor: 50", "visibility: {within: 90, targets: {'1': [0, 0, 1]}}"))
    calibrated = tmp_path / "done" / "calibrated.yaml"
    words = ("--poses", "auto", "--candidates", 300, "--constraints", rules, "--out", tmp_path / "plan.csv", "--json")
    run = truearm("plan", calibrated, *words)
    assert run.code == 0
    assert json.loads(run.out)["poses"] >= 11
    run = truearm("plan", "irb120", *words)
    assert run.code == 2
    assert "the position of the instrument is not known" in run.err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--poses", "many"), "a number of poses belongs here"),
        (("--poses", "0"), "--poses: the number is out of range; got 0; allowed: 1 to 50000"),
        (("--poses", "20", "--model", "auto"), "no model of this name"),
        (("--poses", "20", "--objective", "O9"), "no objective of this name"),
        (("--poses", "auto", "--objective", "O2"), "only O1 can choose"),
        (("--poses", "20", "--candidates", "19"), "too few configurations"),
    ],
)
def test_refusals_write_nothing(truearm: Truearm, tmp_path: Path, words: tuple[str, ...], message: str) -> None:
    run = truearm("plan", "irb120", "--out", tmp_path / "plan.csv", *words)
    assert run.code == 2
    assert message in run.err
    assert not list(tmp_path.iterdir())


def test_constraints_that_leave_too_few_say_what_they_cost(truearm: Truearm, tmp_path: Path) -> None:
    rules = tmp_path / "rules.yaml"
    rules.write_text(RULES.replace("50", "900"))
    run = truearm("plan", "irb120", "--poses", 30, "--constraints", rules, "--out", tmp_path / "plan.csv")
    assert run.code == 2
    assert "rejected by moment_2" in run.err
    assert "floor" in run.err
    rules.write_text(RULES + "wall: 3\n")
    run = truearm("plan", "irb120", "--poses", 30, "--constraints", rules, "--out", tmp_path / "plan.csv")
    assert run.code == 2
    assert "wall" in run.err


def test_inputs_are_not_overwritten(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    data = tmp_path / "data.csv"
    data.write_bytes((small / "data.csv").read_bytes())
    run = truearm("plan", "irb120", "--from", data, "--poses", 12, "--out", data)
    assert run.code == 2
    assert "would be overwritten" in run.err
    run = truearm("plan", "irb120", "--poses", 12, "--out", tmp_path / "plan.html")
    assert run.code == 2
    assert "the plan is a CSV file" in run.err


def test_floor_room_and_home_of_the_command_line(truearm: Truearm, tmp_path: Path) -> None:
    out = tmp_path / "plan.csv"
    words = ("plan", "irb120", "--poses", 8, "--candidates", 40, "--out", out)
    run = truearm(*words, "--floor", -300, "--clearance", 30, "--home", "0,-20,20,0,30,0", "--json")
    assert run.code == 0
    ways = json.loads(run.out)["ways"]
    assert ways["home"] == pytest.approx([0, -20, 20, 0, 30, 0])
    assert (ways["floor_mm"], ways["clearance_mm"]) == pytest.approx((-300, 30))
    assert ways["room_mm"] >= 30
    rows = rows_of(tmp_path / "plan-ways.csv")
    assert len(rows) == ways["moves"] + 1
    assert "back in" in (tmp_path / "plan.html").read_text()
    run = truearm(*words, "--no-floor", "--details")
    assert run.code == 0
    assert "mm or more from its own links (but for up to 520 mm of the arm where two are connected)." in run.out
    assert f"Written: {out}, {out.with_suffix('.html')}, {tmp_path / 'plan-ways.csv'}" in run.out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--floor", "100"), "--floor: the floor is above the base of the robot; got '100 mm'"),
        (("--floor", "-100", "--no-floor"), "--floor, --no-floor: a floor is given and denied"),
        (("--clearance", "-5"), "--clearance"),
        (("--home", "0,0,0"), "--home: there are not as many numbers as joints"),
        (("--home", "0,100,0,0,0,0"), "--home: the safe configuration is not clear"),
        (("--home", "0,0,0,0,0,300"), "--home: joint 6 of the safe configuration is not where the plan keeps it"),
    ],
)
def test_what_cannot_be_driven_is_refused(
    truearm: Truearm, tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    run = truearm("plan", "irb120", "--poses", 8, "--candidates", 40, "--out", tmp_path / "plan.csv", *words)
    assert run.code == 2
    assert message in run.err
    assert not list(tmp_path.iterdir())
