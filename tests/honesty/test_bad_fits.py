"""A fit that is worse than none says so, and does not take the place of a good one."""

from __future__ import annotations

import hashlib
import json
import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from tests.commanding import Truearm
from tests.commanding import truearm as truearm
from tests.honesty.telling import told, written
from tests.plate import PLATE
from tests.simulated import campaign

import truearm as package
from truearm.calibration.parts import ResultKeptError
from truearm.engine.base.writing import write_files
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure

NOISE: Final = 2e-5
#: Places of reflectors on the flange [m], some 40 mm from each other.
REFLECTORS: Final = ((0.0, 0.03, 0.08), (0.03, 0.0, 0.09), (-0.03, 0.0, 0.085))


@cache
def large_arm(targets: int) -> Dataset:
    """Return readings of reflectors that are close together on an arm of 2.7 m."""
    rng = np.random.default_rng(3)
    nominal = load_robot("kr210_r2700")
    twin = truth_twin(nominal, "random", rng)
    places = {
        target.parameter(axis): value
        for target, place in zip(twin.robot.targets, REFLECTORS, strict=True)
        for axis, value in zip("xyz", place, strict=True)
    }
    twin = replace(twin, robot=twin.robot.with_values(places))
    joints = nominal.random_configurations(60, rng)
    read = measure(twin, joints, NOISE, rng).position.reshape(60, 3, 3)[:, :targets]
    return Dataset.of(joints, read, targets=("A", "B", "C")[:targets], sigma=NOISE)


@cache
def small_arm(truth: str = "random") -> Dataset:
    return campaign("irb120", 60, NOISE, 3, truth)[1]


def swapped(data: Dataset, share: float, *, late: bool = False) -> Dataset:
    """Return data with the names of the first two targets exchanged at a share of the configurations."""
    n, count = data.configurations, round(share * data.configurations)
    where = np.arange(n - count, n) if late else np.random.default_rng(1).permutation(n)[:count]
    target = np.where(np.isin(data.configuration, where) & (data.target < 2), 1 - data.target, data.target)
    return replace(data, target=target.astype(np.intp))


def with_entry_errors(data: Dataset, count: int) -> Dataset:
    """Return data of which a few readings are 60 mm off."""
    rng = np.random.default_rng(1)
    position, off = data.position.copy(), rng.standard_normal((count, 3))
    position[rng.permutation(len(position))[:count]] += 0.06 * off / np.linalg.norm(off, axis=1, keepdims=True)
    return replace(data, position=position)


@pytest.mark.parametrize(("targets", "share"), [(3, 0.05), (2, 0.5), (3, 0.5)])
def test_exchanged_reflectors_are_an_error(targets: int, share: float, tmp_path: Path) -> None:
    file = written(tmp_path, swapped(large_arm(targets), share))
    found = told("calibrate", "kr210_r2700", file, "--out", tmp_path / "out", "--model=geometric")
    assert found.summary["validation"]["position_mm"]["mean"] > 1.0
    assert found.code == 3
    assert found.says("targets-swapped", "error", "is target (A|B)"), found
    assert told("check", "kr210_r2700", file).says("targets-swapped", "warning")


def test_they_are_named_reading_by_reading() -> None:
    data = large_arm(3)
    wrong = swapped(data, 0.5)
    (notice,) = (n for n in package.check("kr210_r2700", wrong).warnings if n.code == "targets-swapped")
    moved = data.configuration[wrong.target != data.target]
    exchanged = {(data.labels[c], name) for c in moved for name in "AB"}
    others = {(label, name) for label in data.labels for name in "AB"} - exchanged
    assert set(notice.at) in (exchanged, others)


def test_where_every_row_has_them_nothing_is_wrong(tmp_path: Path) -> None:
    for number, data in enumerate((large_arm(3), swapped(large_arm(3), 1.0), large_arm(2))):
        file = written(tmp_path, data, f"{number}.csv")
        found = told("calibrate", "kr210_r2700", file, "--out", tmp_path / "out")
        assert (found.code, found.levels) == (0, {})  # no fault: every effect is in the model
        assert found.summary["validation"]["position_mm"]["mean"] < 0.1


def test_a_robust_loss_is_not_pulled_by_exchanged_names(tmp_path: Path) -> None:
    file = written(tmp_path, swapped(large_arm(3), 0.05))
    found = told("calibrate", "kr210_r2700", file, "--out", tmp_path / "out", "--loss", "cauchy", "--model=geometric")
    assert (found.code, found.levels["targets-swapped"]) == (0, "warning")


def test_a_fit_that_is_worse_than_the_nominal_robot_is_an_error(tmp_path: Path) -> None:
    file = written(tmp_path, with_entry_errors(small_arm("nominal"), 5))
    found = told("calibrate", "irb120", file, "--out", tmp_path / "out", "--model=geometric")
    assert found.code == 3
    assert found.says("worse-than-nominal", "error", r"1 %\)"), found
    program = tmp_path / "plate.mod"
    program.write_text(PLATE)
    refused = told("compensate", tmp_path / "out" / "calibrated.yaml", program, "--out", tmp_path / "corrected")
    assert refused.code == 2
    assert "--accept worse-than-nominal" in refused.refusal
    assert not (tmp_path / "corrected").exists()


def test_the_same_readings_without_entry_errors_or_with_a_robust_loss_are_not(tmp_path: Path) -> None:
    honest = written(tmp_path, small_arm("nominal"), "honest.csv")
    entry_errors = written(tmp_path, with_entry_errors(small_arm("nominal"), 5), "slips.csv")
    for words in ([honest], [entry_errors, "--loss", "cauchy"]):
        found = told("calibrate", "irb120", *words, "--out", tmp_path / "out")
        assert (found.code, found.levels["no-gain"]) == (0, "warning")
        assert "worse-than-nominal" not in found.levels
    gained = told("calibrate", "irb120", written(tmp_path, small_arm()), "--out", tmp_path / "out")
    assert (gained.code, gained.levels) == (0, {})


# -- what a bad fit replaces -----------------------------------------------------------------------------------

#: Results that do not replace a sound one, and why.
BAD: Final = {
    "swapped": "worse-than-nominal",
    "accurate": "no-gain",
    "six": "rank-loss",
    "metres": "implausible",
}


def bad(name: str) -> Dataset:
    data = small_arm()
    if name == "metres":
        return replace(data, position=data.position * 1e-3)
    if name == "accurate":
        return small_arm("nominal")
    return data.of_configurations(np.arange(6)) if name == "six" else swapped(data, 0.05)


def state(folder: Path) -> dict[str, str]:
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.iterdir())}


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a sound result, which stays as it is."""
    folder = tmp_path_factory.mktemp("sound") / "result"
    assert package.calibrate("irb120", small_arm(), out=folder, model="geometric").faults == ()
    return folder


@pytest.mark.parametrize("name", BAD)
def test_a_bad_result_does_not_replace_a_sound_one(name: str, sound: Path, truearm: Truearm, tmp_path: Path) -> None:
    before = state(sound)
    file = written(tmp_path, bad(name))
    run = truearm("calibrate", "irb120", file, "--out", sound, "--model=geometric")
    assert run.code == 2
    assert state(sound) == before
    assert "a sound result is in this folder, and the new one is not sound" in run.err
    assert BAD[name] in run.err
    assert "in the folder: converged, unseen configurations off by 0.0" in run.err
    assert "--replace" in run.err
    assert "Status: " in run.out  # what the fit said is not lost
    assert "Written" not in run.out
    as_json = truearm("calibrate", "irb120", file, "--out", sound, "--json", "--model=geometric")
    assert (as_json.code, state(sound)) == (2, before)
    assert BAD[name] in {notice["code"] for notice in json.loads(as_json.out)["warnings"]}


@pytest.mark.parametrize("name", BAD)
def test_nor_does_a_bad_result_of_the_default_model(name: str, sound: Path, truearm: Truearm, tmp_path: Path) -> None:
    before = state(sound)
    run = truearm("calibrate", "irb120", written(tmp_path, bad(name)), "--out", sound)
    assert (run.code, state(sound)) == (2, before)
    assert "a sound result is in this folder, and the new one is not sound" in run.err


def test_python_hands_out_the_result_that_was_not_written(sound: Path, tmp_path: Path) -> None:
    before = state(sound)
    with pytest.raises(ResultKeptError, match=r"another `out`, or .* with `replace`") as refusal:
        package.calibrate("irb120", bad("six"), out=sound, model="geometric")
    kept = refusal.value.result
    assert kept.faults[0] == "rank-loss"
    assert refusal.value.parameter == "out"
    with pytest.raises(ResultKeptError):
        kept.save(sound)
    assert state(sound) == before
    assert kept.save(tmp_path / "other")


def test_it_does_where_that_is_asked_for_and_then_anything_replaces_it(truearm: Truearm, tmp_path: Path) -> None:
    out = tmp_path / "out"
    sound, six, entry_errors = (
        written(tmp_path, data, f"{n}.csv") for n, data in enumerate((small_arm(), bad("six"), bad("accurate")))
    )
    assert truearm("calibrate", "irb120", sound, "--model", "geometric", "--out", out).code == 0
    assert truearm("calibrate", "irb120", six, "--model", "geometric", "--out", out, "--replace").code == 3
    content = json.loads((out / "result.json").read_text())
    assert (content["status"], "--replace" in content["command"]) == ("rank-loss", False)
    assert (
        truearm("calibrate", "irb120", entry_errors, "--model", "geometric", "--out", out).code == 0
    )  # a bad one replaces a bad one
    assert truearm("calibrate", "irb120", six, "--model", "geometric", "--out", out).code == 3
    assert truearm("calibrate", "irb120", sound, "--model", "geometric", "--out", out).code == 0  # and a sound one any
    assert truearm("calibrate", "irb120", sound, "--out", out, "--model", "elastic").code == 0
    assert truearm("calibrate", "irb120", six, "--model", "geometric", "--out", out).code == 2


def test_the_robot_file_alone_says_that_a_result_is_sound(sound: Path, tmp_path: Path) -> None:
    shutil.copytree(sound, tmp_path / "out")
    (tmp_path / "out" / "result.json").unlink()
    with pytest.raises(ResultKeptError, match=r"in the folder: converged[.]"):
        package.calibrate("irb120", bad("six"), out=tmp_path / "out", model="geometric")


@pytest.mark.parametrize(("told_then", "stays"), [((), True), (("not-better",), False), (("no-loads",), True)])
def test_a_result_of_an_earlier_version_without_a_proof(
    told_then: tuple[str, ...], stays: bool, tmp_path: Path
) -> None:
    warnings = [{"code": code, "level": "warning", "message": "..."} for code in told_then]
    content = {"truearm": "truearm-result/1", "status": "converged", "warnings": warnings}
    write_files(tmp_path, {"calibrated.yaml": robot_text(load_robot("irb120")), "result.json": json.dumps(content)})
    before = state(tmp_path)
    if stays:
        with pytest.raises(ResultKeptError):
            package.calibrate("irb120", bad("six"), out=tmp_path, model="geometric")
    else:
        package.calibrate("irb120", bad("six"), out=tmp_path, model="geometric")
    assert (state(tmp_path) == before) is stays


def test_a_damaged_result_is_refused_as_it_was(tmp_path: Path) -> None:
    package.calibrate("irb120", small_arm(), out=tmp_path, model="geometric")
    (tmp_path / "result.json").write_text("{")
    with pytest.raises(package.InputError, match="has been changed since"):
        package.calibrate("irb120", bad("six"), out=tmp_path, replace=True)
