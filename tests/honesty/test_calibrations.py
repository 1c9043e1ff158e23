"""Figures of a calibration hold, or the page says why they may not."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from tests.honesty.telling import Told, told, written
from tests.simulated import campaign, more_of

import truearm
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot import library
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure

NOISE: Final = 2e-5
#: Middle of the joints in a narrow campaign [deg].
MIDDLE: Final = (10.0, 20.0, 10.0, 20.0, 40.0, 10.0)


@cache
def made(half_width: float | None) -> tuple[Twin, Dataset]:
    """Return a robot and its readings, over its limits or so many degrees about the middle."""
    twin, full = campaign("irb120", 60, NOISE, 11)
    if half_width is None:
        return twin, full
    rng = np.random.default_rng(11)
    joints = np.radians(np.array(MIDDLE) + rng.uniform(-half_width, half_width, (60, 6)))
    return twin, measure(twin, joints, NOISE, rng)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("calibrations")


@cache
def calibrated(half_width: float | None, folder: Path) -> Told:
    """Return what calibration says; its folder is named after the width."""
    file = written(folder, made(half_width)[1], f"{half_width}.csv")
    return told("calibrate", "irb120", file, "--out", folder / str(half_width), "--model=geometric")


def true_error(half_width: float | None, folder: Path) -> float:
    """Return the mean error of the calibrated robot over all it can reach [mm]."""
    calibrated(half_width, folder)
    robot = truearm.load_robot(folder / str(half_width) / "calibrated.yaml")
    position = errors_of(robot, more_of(made(half_width)[0], 300, 0.0, 99)).position
    assert position is not None
    return position.mean * 1e3


@pytest.mark.parametrize("half_width", [1.0, 5.0])
def test_a_narrow_campaign_says_so(half_width: float, folder: Path) -> None:
    found = calibrated(half_width, folder)
    held_out = found.summary["validation"]["position_mm"]["mean"]
    assert true_error(half_width, folder) > 3.0 * held_out
    assert found.says("narrow-data", "error", "joint|axis"), found
    assert found.code == 3
    low, high = found.summary["expected_mm"]["interval_90"]
    assert 0.5 * low < true_error(half_width, folder) < 2.0 * high


def test_a_campaign_over_the_workspace_does_not(folder: Path) -> None:
    found = calibrated(None, folder)
    assert (found.code, found.levels) == (0, {})
    low, high = found.summary["expected_mm"]["interval_90"]
    assert low < true_error(None, folder) < high


@pytest.mark.parametrize("model", ["offsets", "joints"])
def test_a_model_without_geometry_says_so_too(model: str, folder: Path) -> None:
    def run(half_width: float | None) -> Told:
        file = written(folder, made(half_width)[1], f"{half_width}.csv")
        return told("calibrate", "irb120", file, "--model", model, "--out", folder / f"{model}-{half_width}")

    narrow = run(5.0)
    assert narrow.says("narrow-data", "error", f"The {model} model takes the geometry as exact"), narrow
    interval = re.search(r"90 %: ([0-9.]+) to ([0-9.]+)", narrow.messages["narrow-data"])
    robot = truearm.load_robot(folder / f"{model}-5.0" / "calibrated.yaml")
    position = errors_of(robot, more_of(made(5.0)[0], 300, 0.0, 99)).position
    assert interval is not None
    assert position is not None
    assert float(interval[1]) < position.mean * 1e3 < float(interval[2])
    assert "narrow-data" not in run(None).levels


def test_a_payload_in_grams(folder: Path) -> None:
    file = written(folder, made(None)[1])
    for mass, said in (("2700kg", True), ("2.7kg", False)):
        found = told(
            "calibrate",
            "irb120",
            file,
            "--payload",
            f"{mass},0mm,0mm,100mm",
            "--out",
            folder / mass,
            "--model=geometric",
        )
        assert found.says("payload-unlikely", "warning", "grams called kilograms") is said, found


def test_a_payload_above_the_rated_load(folder: Path) -> None:
    file = written(folder, made(None)[1])
    unrated = folder / "unrated.yaml"
    text = (Path(library.__file__).parent / "irb120.yaml").read_text()
    unrated.write_text(re.sub(r"(?m)^rated_load.*\n", "", text))
    assert unrated.read_text() != text
    for robot, mass, said in (
        ("irb120", 3.0, False),
        ("irb120", 3.1, True),
        ("irb120", 6.0, True),
        (unrated, 6.0, False),
    ):
        payload = f"{mass}kg,0mm,0mm,100mm"
        found = told("calibrate", robot, file, "--payload", payload, "--out", folder / "heavy", "--model=geometric")
        assert found.says("rated-load-exceeded", "warning", "irb120 is rated for 3 kg") is said, found
        assert "payload-unlikely" not in found.levels


def test_another_robot_is_not_this_one(folder: Path) -> None:
    file = written(folder, made(None)[1])
    found = told("calibrate", "lrmate200ic", file, "--out", folder / "lrmate", "--model=geometric")
    assert found.code == 3
    assert found.summary["status"] == "implausible"
    assert found.says("implausible", "error")
    assert found.says("wrong-robot", "error", "not of lrmate200ic, by its lengths")


def test_three_configurations_determine_no_robot(folder: Path) -> None:
    file = written(folder, made(None)[1])
    found = told("calibrate", "irb120", file, "--train", 3, "--out", folder / "three", "--model=geometric")
    assert found.code == 3
    assert found.says("rank-loss", "error")


# -- intervals -------------------------------------------------------------------------------------------------


def of_many_targets(seed: int, repeatability: float, decimals: int | None = None) -> tuple[Twin, Dataset]:
    """Return a robot with ten targets, whose joints stop beside their readings, by chance or by rounding [deg]."""
    rng = np.random.default_rng(seed)
    targets = {str(n): tuple(rng.uniform(0.0, 0.2, 3).tolist()) for n in range(10)}
    nominal = load_robot("irb120")
    twin = truth_twin(nominal, "random", rng)
    twin = replace(twin, robot=twin.robot.with_frames(twin.robot.base, targets))
    joints = nominal.random_configurations(40, rng)
    read = joints if decimals is None else np.radians(np.degrees(joints).round(decimals))
    data = measure(twin, joints + np.radians(repeatability) * rng.standard_normal(joints.shape), NOISE, rng)
    return twin, replace(data, joints=read, sigma=None)


@pytest.mark.parametrize("repeatability", [0.0, 0.02])
def test_intervals_hold_where_targets_share_the_error_of_the_joints(repeatability: float) -> None:
    off, found = [], []
    for seed in range(3):
        twin, data = of_many_targets(seed, repeatability)
        fit = identify(load_robot("irb120"), data, named_model("geometric"))
        found += np.degrees(fit.joint_error).tolist()
        for name in fit.free.names:
            p = fit.robot.parameters[name]
            if p.group in ("geometry", "joint zero") and p.deviation and (p.informed or 0.0) >= 0.5:
                off.append(abs(p.value - twin.robot.values[name]) / p.deviation)
    assert len(off) > 40
    assert np.mean(np.array(off) < 1.96) > 0.85
    assert np.mean(found) == pytest.approx(repeatability, abs=0.004)


def test_joints_with_one_decimal_are_as_uncertain_as_that() -> None:
    _, data = of_many_targets(5, 0.0, 1)
    calibration = truearm.calibrate("irb120", data, model="geometric")
    assert np.degrees(calibration.fit.joint_error) == pytest.approx(np.full(6, 0.1 / np.sqrt(12.0)), rel=0.3)
    assert "errors of the joints of 0.0" in "\n".join(calibration.lines())


def test_the_error_of_the_joints_is_one_of_a_kind_of_joint(tmp_path: Path) -> None:
    told(
        "calibrate",
        "irb120",
        written(tmp_path, of_many_targets(0, 0.02)[1]),
        "--out",
        tmp_path / "out",
        "--model=geometric",
    )
    (of_all,) = json.loads((tmp_path / "out" / "result.json").read_text())["noise"]["joint_error"]
    assert (of_all["kind"], of_all["joints"], of_all["unit"]) == ("revolute", [1, 2, 3, 4, 5, 6], "deg")
    assert of_all["deviation"] == pytest.approx(0.02, abs=0.004)


# -- postures visited again ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("truth", "seed"), [("gear-errors", 0), ("gear-errors", 3), ("random", 1)], ids=["gears-0", "gears-3", "perfect"]
)
def test_postures_visited_again_say_little_of_others(truth: str, seed: int, folder: Path) -> None:
    """Errors of the gears are the same on every visit: three visits of ten postures are no thirty configurations."""
    rng, robot = np.random.default_rng(seed), load_robot("irb120")
    twin = truth_twin(robot, truth, rng)
    of = rng.permutation(np.repeat(np.arange(14), 3))
    joints = robot.random_configurations(14, rng)[of]
    data = measure(twin, joints + np.radians(rng.normal(0.0, 0.001, joints.shape)), 3e-5, rng)
    found = told("calibrate", "irb120", written(folder, data), "--model=geometric", "--out", folder / "again")
    position = errors_of(truearm.load_robot(folder / "again" / "calibrated.yaml"), more_of(twin, 200, 0.0, 9)).position
    assert position is not None
    low, high = found.summary["expected_mm"]["interval_90"]
    assert low < 1e3 * position.mean < (high or 1.6 * found.summary["expected_mm"]["mean"])


def test_copied_readings_count_once(folder: Path) -> None:
    """With fewer digits, so that nothing tells that they are copies."""
    twin, data = made(None)
    some = data.of_configurations(np.arange(16))
    copied = Dataset.of(
        np.concatenate([some.joints] * 3),
        np.concatenate([some.position, some.position.round(6), some.position.round(7)]).reshape(-1, 3, 3),
        sigma=NOISE,
    )
    found = told("calibrate", "irb120", written(folder, copied), "--model=geometric", "--out", folder / "copied")
    position = errors_of(truearm.load_robot(folder / "copied" / "calibrated.yaml"), more_of(twin, 200, 0.0, 9)).position
    assert position is not None
    low, high = found.summary["expected_mm"]["interval_90"]
    assert low < 1e3 * position.mean < high


# -- plans -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("model", "holds"), [("elastic", True), ("geometric", False)])
def test_what_a_plan_predicts_where_loads_are_known(model: str, holds: bool, folder: Path) -> None:
    """The joints of the truth give way: the geometric model cannot follow, and the plan for it says so."""
    load, rng = Payload(2.7, (0.05, 0.025, 0.1)), np.random.default_rng(0)
    robot = load_robot("irb120").with_payload(load)
    planned = truearm.plan(robot, poses=30, candidates=200, model=model)
    twin = truth_twin(robot, "tracker-triangular", rng)
    fit = identify(robot, measure(twin, planned.joints, planned.noise, rng), named_model(model))
    position = errors_of(fit.robot, more_of(twin, 100, planned.noise, 2)).position
    assert position is not None
    assert (0.8 < position.mean / planned.made.prediction.planned < 1.25) is holds
    assert planned.summary()["prediction"]["loads_left_out"] is not holds
    assert (f"the {model} model does not follow how far joints give way" in planned.answer[-1]) is not holds


# -- calibrated again ------------------------------------------------------------------------------------------


@cache
def after_a_repair(folder: Path) -> tuple[Twin, Path, Path]:
    """Return a robot whose third joint's zero was moved after its calibration, that calibration, and five readings."""
    twin, data = campaign("irb120", 70, 3e-5, 102)
    told("calibrate", "irb120", written(folder, data, "before.csv"), "--model=geometric", "--out", folder / "before")
    moved = twin.robot.values["theta_offset_3"] + np.radians(0.3)
    repaired = replace(twin, robot=twin.robot.with_values({"theta_offset_3": moved}))
    few = written(folder, more_of(repaired, 5, 3e-5, 502), "five.csv")
    return repaired, folder / "before" / "calibrated.yaml", few


@pytest.mark.parametrize("model", [(), ("--model=offsets",)], ids=["default", "offsets"])
def test_five_configurations_after_a_repair(model: tuple[str, ...], folder: Path) -> None:
    """What was known and was not asked anew is known as well as before: the geometry is not what its priors say."""
    twin, calibration, few = after_a_repair(folder)
    found = told("calibrate", calibration, few, *model, "--out", folder / f"repaired{len(model)}")
    assert (found.code, [*found.levels]) == (0, ["few-held-out"]), found
    assert found.summary["nominal"]["position_mm"]["mean"] > 2.0
    position = errors_of(
        truearm.load_robot(folder / f"repaired{len(model)}" / "calibrated.yaml"), more_of(twin, 300, 0.0, 9)
    ).position
    assert position is not None
    low, high = found.summary["expected_mm"]["interval_90"]
    assert low < 1e3 * position.mean < high < 0.2


def test_five_configurations_of_a_robot_of_which_nothing_is_known(folder: Path) -> None:
    """Without the proof of the calibration before, the geometry is as uncertain as its priors."""
    _, calibration, few = after_a_repair(folder)
    text = calibration.read_text()
    head, tail = text.split("proof:\n")
    unproven = folder / "unproven.yaml"
    unproven.write_text(head + tail[tail.index("history:") :])
    found = told("calibrate", unproven, few, "--model=offsets", "--out", folder / "unproven")
    assert found.summary["expected_mm"]["lower_bound"]
    assert found.summary["expected_mm"]["interval_90"][1] is None


def test_geometry_found_anew_is_not_as_well_known_as_before(folder: Path) -> None:
    _, calibration, few = after_a_repair(folder)
    found = told("calibrate", calibration, few, "--model=geometric", "--out", folder / "anew")
    assert found.says("rank-loss", "error", "earlier calibration knew the geometry.*model=offsets"), found
    nominal = told("calibrate", "irb120", few, "--model=geometric", "--out", folder / "first")
    assert nominal.says("rank-loss", "error")
    assert "earlier calibration" not in nominal.messages["rank-loss"]


# -- validation ------------------------------------------------------------------------------------------------


def test_training_data_prove_nothing(folder: Path) -> None:
    calibrated(None, folder)
    robot = folder / "None" / "calibrated.yaml"
    assert told("validate", robot, folder / "None.csv").says("training-data", "warning")
    fresh = told("validate", robot, written(folder, more_of(made(None)[0], 10, NOISE, 5), "fresh.csv"))
    assert (fresh.code, fresh.levels) == (0, {})


def test_training_data_that_were_written_again_are_known(folder: Path, tmp_path: Path) -> None:
    calibrated(None, folder)
    data = made(None)[1]
    rng = np.random.default_rng(0)
    again = written(tmp_path, data.of_configurations(rng.permutation(data.configurations)), "again.csv")
    again.write_text(again.read_text().replace("\n", "\r\n") + "\r\n")
    assert told("validate", folder / "None" / "calibrated.yaml", again).says("training-data", "warning", "42 of")
    assert truearm.validate(folder / "None" / "calibrated.yaml", data).warnings[0].code == "training-data"


def test_a_robot_that_changed_is_beyond_its_proof(folder: Path) -> None:
    calibrated(None, folder)
    twin = made(None)[0]
    longer = {p.name: p.value + 1e-3 for p in twin.robot.parameters.values() if p.name in ("a_2", "d_4")}
    for move, level in ((1.0, "error"), (0.2, "warning")):
        values = {name: twin.robot.values[name] + move * (v - twin.robot.values[name]) for name, v in longer.items()}
        changed = replace(twin, robot=twin.robot.with_values(values))
        file = written(folder, more_of(changed, 10, NOISE, 5), "changed.csv")
        found = told("validate", folder / "None" / "calibrated.yaml", file)
        assert found.says("beyond-proof", level, "times the .* that the robot's own calibration"), found


def test_a_second_calibration_with_the_same_data_proves_nothing(folder: Path) -> None:
    calibrated(None, folder)
    robot = folder / "None" / "calibrated.yaml"
    again = told("calibrate", robot, folder / "None.csv", "--seed", 1, "--out", folder / "twice", "--model=geometric")
    assert again.says("training-data", "warning", "held.out"), again
    fresh = written(folder, more_of(made(None)[0], 30, NOISE, 6), "later.csv")
    assert "training-data" not in told("calibrate", robot, fresh, "--out", folder / "later", "--model=geometric").levels


def test_targets_that_took_other_names(folder: Path) -> None:
    calibrated(None, folder)
    fresh = more_of(made(None)[0], 10, NOISE, 5)
    renamed = replace(fresh, targets=(fresh.targets[1], fresh.targets[0], *fresh.targets[2:]))
    found = told("validate", folder / "None" / "calibrated.yaml", written(folder, renamed, "renamed.csv"))
    assert found.says("targets-renamed", "error"), found
    assert found.code == 3


TURN: Final = np.array([[np.cos(0.3), -np.sin(0.3), 0.0], [np.sin(0.3), np.cos(0.3), 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize(
    ("change", "code", "level", "ends", "words"),
    [
        (lambda p: p @ TURN.T + np.array([0.1, 0.0, 0.0]), "base-moved", "error", 3, "turned by 17[.]. deg"),
        (lambda p: p + np.array([5e-4, 0.0, 0.0]), "base-moved", "warning", 0, r"moved by 0\.5"),
        (lambda p: p * 1e-3, "implausible", "error", 3, "units"),
    ],
    ids=["instrument-elsewhere", "table-pushed-by-half-a-millimetre", "metres-called-millimetres"],
)
def test_new_readings_in_another_frame(
    change: Callable[[Array], Array], code: str, level: str, ends: int, words: str, folder: Path
) -> None:
    calibrated(None, folder)
    fresh = more_of(made(None)[0], 10, NOISE, 5)
    file = written(folder, replace(fresh, position=change(fresh.position)), "elsewhere.csv")
    found = told("validate", folder / "None" / "calibrated.yaml", file)
    assert found.says(code, level, words), found
    assert found.code == ends


def test_a_robot_that_errs_is_not_in_another_frame(folder: Path) -> None:
    calibrated(1.0, folder)
    fresh = written(folder, more_of(made(1.0)[0], 10, NOISE, 5), "wide.csv")
    found = told("validate", folder / "1.0" / "calibrated.yaml", fresh)
    assert found.summary["position_mm"]["mean"] > 0.1
    assert (found.code, found.levels) == (0, {})


# -- folders ---------------------------------------------------------------------------------------------------


def test_a_folder_of_two_results_says_so(folder: Path, tmp_path: Path) -> None:
    calibrated(None, folder)
    calibrated(5.0, folder)
    mixed = tmp_path / "mixed"
    shutil.copytree(folder / "None", mixed)
    data = written(tmp_path, more_of(made(None)[0], 4, NOISE, 5))
    assert "changed-since-written" not in told("validate", mixed / "calibrated.yaml", data).levels
    shutil.copy(folder / "5.0" / "calibrated.yaml", mixed)
    assert told("validate", mixed / "calibrated.yaml", data).says("changed-since-written", "warning", "result.json")
    shutil.copy(mixed / "calibrated.yaml", tmp_path)
    assert "changed-since-written" not in told("validate", tmp_path / "calibrated.yaml", data).levels
