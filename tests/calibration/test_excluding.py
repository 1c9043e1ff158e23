"""Readings are excluded by a file, each with its reason: they count as missing, and the result tells of them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.commanding import Truearm
from tests.expecting import known, refused
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.checking.check import check
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.excluded import Exclusion, exclusions_text, numbers_read, read_exclusions, without_readings
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.data.statistics import errors_of

DATA = campaign("irb120", 24, 0.05e-3, 4)[1]
#: Of 24 configurations with the seed 0.
HELD_OUT = [DATA.labels[c] for c in np.random.default_rng(0).permutation(24)[17:]]
TRAINING = [label for label in DATA.labels if label not in HELD_OUT]


@pytest.fixture
def csv(tmp_path: Path) -> Path:
    """Measurements in which one reading of the held-out part is 3 mm off."""
    position = DATA.position.copy()
    (row,) = _rows(DATA, HELD_OUT[0], "2")
    position[row] += [0.003, 0.0, 0.0]
    path = tmp_path / "data.csv"
    path.write_text(csv_text(replace(DATA, position=position)))
    return path


def _rows(data: Dataset, configuration: str, target: str) -> list[int]:
    return [
        row
        for row in range(len(data.target))
        if (data.labels[data.configuration[row]], data.targets[data.target[row]]) == (configuration, target)
    ]


def _file(folder: Path, *rows: tuple[str, str, str]) -> Path:
    path = folder / "excluded.csv"
    path.write_text(exclusions_text(Exclusion(*row) for row in rows))
    return path


def test_excluded_readings_count_as_missing_and_the_split_stays(csv: Path, tmp_path: Path) -> None:
    file = _file(tmp_path, (TRAINING[0], "1", "beam, broken"), (HELD_OUT[0], "2", "touched"))
    result = calibrate("irb120", csv, model="offsets", exclude=file, out=tmp_path / "result")
    plain = calibrate("irb120", csv, model="offsets")
    assert np.array_equal(result.held_out, plain.held_out)
    position = DATA.position.copy()
    position[_rows(DATA, TRAINING[0], "1")] = np.nan
    emptied = calibrate("irb120", replace(DATA, position=position), model="offsets")
    for name, value in emptied.fit.robot.values.items():
        assert result.fit.robot.values[name] == pytest.approx(value, abs=1e-7)

    words = "Excluded: 2 readings (1 of the training part, 1 of the held-out part): beam, broken (1), touched (1)"
    assert words in result.lines()
    assert " 2 readings excluded, redundancy" in result.history
    assert f"exclude='{file}'" in result.command
    assert "missing" not in [notice.code for notice in result.warnings]
    rows = json.loads((tmp_path / "result" / "result.json").read_text())["excluded"]
    assert [(row["configuration"], row["reason"], row["part"]) for row in rows] == [
        (TRAINING[0], "beam, broken", "training"),
        (HELD_OUT[0], "touched", "held out"),
    ]
    assert f"{HELD_OUT[0]}/2 (held out): touched" in (tmp_path / "result" / "report.html").read_text()
    assert "excluded" not in plain.summary()


def test_who_excludes_from_the_held_out_part_is_told_what_it_is_worth_with_them(csv: Path, tmp_path: Path) -> None:
    file = _file(tmp_path, (HELD_OUT[0], "2", "looks wrong"))
    result = calibrate("irb120", csv, model="offsets", exclude=file)
    (notice,) = [warning for warning in result.warnings if warning.code == "held-out-excluded"]
    assert notice.level == "warning"
    assert "1 reading of the held-out part is excluded: looks wrong (1)." in notice.message
    whole = calibrate("irb120", csv, model="offsets")
    with_it = known(errors_of(result.fit.robot, whole.data.of_configurations(whole.held_out)).position)
    without = known(known(result.validation).position)
    assert f"With it the held-out errors are {with_it.mean * 1e3:.3f} mm on average" in notice.message
    assert f"{with_it.max * 1e3:.3f} mm at most; without it {without.mean * 1e3:.3f}" in notice.message
    only_training = _file(tmp_path, (TRAINING[0], "2", "beam broken"))
    fit = calibrate("irb120", csv, model="offsets", exclude=only_training)
    assert "held-out-excluded" not in [warning.code for warning in fit.warnings]
    # what stands in a configuration that is left out belongs to no part
    file = _file(tmp_path, ("3", "2", "beam broken"))
    result = calibrate("irb120", csv, model="offsets", exclude=file, without=["3"])
    assert "Excluded: 1 reading (1 of configurations that are left out): beam broken (1)" in result.lines()


def test_what_is_excluded_is_no_longer_found_and_counted(truearm: Truearm, csv: Path, tmp_path: Path) -> None:
    before = check("irb120", csv)
    assert "outliers" in [notice.code for notice in before.warnings]
    file = _file(tmp_path, (HELD_OUT[0], "2", "touched"))
    outcome = truearm("check", "irb120", csv, "--exclude", file, "--json")
    by_code = {notice["code"]: notice for notice in json.loads(outcome.out)["warnings"]}
    assert "outliers" not in by_code
    assert by_code["excluded"]["level"] == "note"
    assert "1 reading is excluded: touched (1). Excluded readings count as missing." in by_code["excluded"]["message"]
    assert "missing" not in by_code  # whoever has excluded it knows that it is
    assert "falsifies the proof" in by_code["excluded"]["message"]
    words = ["calibrate", "irb120", csv, "--model", "offsets", "--exclude", file, "--json"]
    assert json.loads(truearm(*words, "--out", tmp_path / "r").out)["excluded"][0]["part"] == "held out"


def test_one_of_several_visits_and_reference_points_are_excluded(tmp_path: Path) -> None:
    twice = Dataset.of(np.zeros((2, 6)), np.ones((2, 1, 3)), configurations=["a", "b"])
    double = replace(twice.of_readings([0, 0, 1]), visit=np.array([1, 2, 1]), references=twice.of_readings([0, 1]))
    named = replace(double, references=replace(known(double.references), targets=("nest",)))
    result, counts = without_readings(named, [Exclusion("a", "1", "x", visit="2"), Exclusion("b", "nest", "y")])
    assert np.isnan(result.position[:, 0]).tolist() == [False, True, False]
    assert np.isnan(known(result.references).position[:, 0]).tolist() == [False, True]
    assert counts == (1, 1)
    assert without_readings(named, [Exclusion("a", "1", "x")])[1] == (2,)
    text = exclusions_text([Exclusion("a", "1", "x", visit="2"), Exclusion("b", "nest", "y")])
    assert text == "configuration,target,reason,visit\na,1,x,2\nb,nest,y,\n"
    path = tmp_path / "excluded.csv"
    path.write_text(text)
    assert exclusions_text(read_exclusions(path)) == text
    path.write_text(exclusions_text([]))
    assert read_exclusions(path) == ()


def test_a_reading_that_is_not_the_one_that_was_excluded_is_refused(csv: Path, tmp_path: Path) -> None:
    (row,) = _rows(DATA, "5", "1")
    x, y, z = DATA.position[row] * 1e3
    path = tmp_path / "excluded.csv"
    head = "configuration,target,reason,read [mm]\n"
    path.write_text(f"{head}5,1,beam broken,{x:.4f} {y:.4f} {z:.4f}\n")
    assert "excluded" in [notice.code for notice in check("irb120", csv, exclude=path).warnings]
    longer = DATA.of_configurations([*range(23), 23, 22])  # more measurements of the same names are no others
    assert without_readings(longer, read_exclusions(path))[1] == (1,)
    metres = f"{head.replace('mm', 'm')}5,1,beam broken,{x / 1e3:.7f} {y / 1e3:.7f} {z / 1e3:.7f}\n6,1,by hand,\n"
    path.write_text(metres)
    assert without_readings(DATA, read_exclusions(path))[1] == (1, 1)

    path.write_text(f"{head}5,1,beam broken,{x:.4f} {y + 0.01:.4f} {z:.4f}\n")
    words = "line 2: another reading stands here in the measurements than the one that was excluded"
    for job in (check, calibrate):
        refused("exclude", rf"excluded\.csv, {words}.* that was made for these", job, "irb120", csv, exclude=path)


def test_what_was_read_is_compared_whatever_was_measured() -> None:
    plain = Dataset.of(np.zeros((2, 6)), np.arange(6.0).reshape(2, 1, 3), configurations=["a", "b"])
    twice = replace(plain.of_readings([0, 1, 1]), visit=np.array([1, 1, 2]))
    assert numbers_read(twice) == [(0.0, 1.0, 2.0), (3.0, 4.0, 5.0), (3.0, 4.0, 5.0)]
    both = Exclusion("b", "1", "x", read=((3.0, 4.0, 5.0), (3.0, 4.0, 5.0)))
    assert without_readings(twice, [both])[1] == (2,)
    once = replace(both, read=both.read[:1])  # it was read once more since
    refused(None, "another reading", without_readings, twice, [once])
    assert without_readings(twice, [replace(once, visit="2")])[1] == (1,)
    lengths = replace(
        plain,
        position=np.full((2, 3), np.nan),
        distance=np.array([0.5, 0.25]),
        fixtures=("ball",),
        fixture=np.zeros(2, int),
    )
    assert numbers_read(lengths) == [(0.5,), (0.25,)]
    assert without_readings(lengths, [Exclusion("a", "1", "x", read=((0.5,),))])[1] == (1,)
    refused(None, "got '250 mm in", without_readings, lengths, [Exclusion("b", "1", "x", read=((0.5,),))])
    text = exclusions_text([both, Exclusion("a", "1", "y")])
    assert text == "configuration,target,reason,read [mm]\nb,1,x,3000 4000 5000; 3000 4000 5000\na,1,y,\n"


def test_files_that_exclude_nothing_that_was_read_are_refused(csv: Path, tmp_path: Path) -> None:
    path = tmp_path / "excluded.csv"
    for text, fault in (
        ("configuration,target,reason,read\n1,1,x,1 2 3\n", "line 1, read: no unit is given"),
        ("configuration,target,reason,read [deg]\n1,1,x,1 2 3\n", "line 1, read: this unit does not fit here"),
        ("configuration,target,reason,read [mm]\n1,1,x,1 2 three\n", "line 2, column read .mm.: numbers with blanks"),
        ("configuration,target,reason,read [mm]\n1,1,x,1 2 1e99\n", "line 2, column read .mm.: .*too large"),
        ("configuration,target,reason,read [m],read [mm]\n1,1,x,1,1\n", "line 1: the column read appears twice"),
        ("configuration,target\n1,1\n", "line 1: the column reason is missing"),
        ("configuration,target,reason,why\n1,1,x,y\n", "line 1: the column is not known; got 'why'"),
        ("configuration,target,reason,reason\n1,1,x,y\n", "line 1: the column reason appears twice"),
        ("configuration,target,reason\n1,1,\n", "line 2, column reason: the cell is empty"),
        ("configuration,target,reason\n1,1,x\n1,1,y\n", "line 3: this reading is excluded twice"),
        ("configuration,target,reason\n241,1,x\n", "line 2: there is no configuration of this name; got '241'"),
        ("configuration,target,reason\n1,tip,x\n", "line 2: there is no target of this name; got 'tip'"),
        ("configuration,target,reason,visit\n1,1,x,2\n", "line 2: nothing was read there"),
    ):
        path.write_text(text)
        refused("exclude", rf"excluded\.csv, {fault}", check, "irb120", csv, exclude=path)
