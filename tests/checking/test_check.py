"""Every check fires on a corrupted copy and is silent on clean data, measured and simulated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.commanding import Truearm
from tests.expecting import known, refused
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.checking.check import check
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.rigid_tool import rigid_suspects
from truearm.engine.data.statistics import errors_of, without_table_motion
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import MODELS
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.importing.files import read_matrices

Corruption = Callable[[Dataset, np.random.Generator], Dataset]
SEEDS = range(3)


@cache
def with_all_references(folder: Path) -> Dataset:
    folder = folder / "irb120-faro"
    targets = {str(i): folder / f"target_{i}.txt" for i in (1, 2, 3)}
    references = {f"base_{i}": folder / f"base_{i}.txt" for i in (1, 2, 3)}
    return read_matrices(folder / "joints_commanded.txt", targets, references, "deg", "mm")[0]


@cache
def with_good_references(folder: Path) -> Dataset:
    """The measured IRB 120 with its reference points where all of these are good."""
    data = with_all_references(folder)
    points = known(data.references)
    usual = [np.nanmedian(points.position[points.target == t], axis=0) for t in range(3)]
    off = np.linalg.norm(points.position - np.array(usual)[points.target], axis=1)
    bad = set(points.configuration[~(off < 1e-3)].tolist())
    return data.of_configurations([c for c in range(500) if c not in bad])


@pytest.fixture(scope="module")
def with_references(measured_data: Path) -> Dataset:
    return with_all_references(measured_data)


@pytest.fixture(scope="module")
def measured(measured_data: Path) -> Dataset:
    return with_good_references(measured_data)


def thinned(request: pytest.FixtureRequest) -> tuple[str, Dataset]:
    data = with_good_references(request.getfixturevalue("measured_data"))
    return "irb120", data.of_configurations(range(0, data.configurations, 6))


def simulated(request: pytest.FixtureRequest) -> tuple[str, Dataset]:
    return request.param, campaign(request.param, 40, 0.05e-3, 17)[1]


#: Data without a fault, and what gives them with their robot.
CLEAN = {"measured": thinned, "ur5": simulated, "kr5": simulated, "lrmate200ic": simulated}
#: Of faults, by the robot into whose data these are put: every seed is tried twice, with another robot.
SEEDS_OF = {"ur5": (0,), "kr5": (1,), "lrmate200ic": (2,)}


@pytest.fixture(scope="module", params=CLEAN)
def clean(request: pytest.FixtureRequest) -> tuple[str, Dataset]:
    return CLEAN[request.param](request)


def codes(data: Dataset, robot: str | None) -> set[str]:
    return {notice.code for notice in check(robot, data).warnings}


def test_clean_data_are_not_doubted(clean: tuple[str, Dataset]) -> None:
    robot, data = clean
    assert codes(data, None) == set()
    assert codes(data, robot) == set()
    assert not {n.code for n in calibrate(robot, data, model="geometric").warnings} & {
        "joints-not-settled",
        "outliers",
        "beyond-limits",
    }


def moved_readings(data: Dataset, readings: IntArray, by: Array) -> Dataset:
    position = data.position.copy()
    position[readings] += by
    return replace(data, position=position)


def missing(data: Dataset, rng: np.random.Generator) -> Dataset:
    return moved_readings(data, rng.choice(len(data.target), 3, replace=False), np.array(np.nan))


def outliers(data: Dataset, rng: np.random.Generator) -> Dataset:
    directions = rng.normal(size=(3, 3))
    shift = 8e-3 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return moved_readings(data, rng.choice(len(data.target), 3, replace=False), shift)


def two_targets(data: Dataset, rng: np.random.Generator) -> tuple[int, int]:
    c = int(rng.integers(data.configurations))
    first, second = rng.choice(np.flatnonzero(data.configuration == c), 2, replace=False).tolist()
    return first, second


def targets_swapped(data: Dataset, rng: np.random.Generator) -> Dataset:
    first, second = two_targets(data, rng)
    position = data.position.copy()
    position[[first, second]] = position[[second, first]]
    return replace(data, position=position)


def target_mistaken(data: Dataset, rng: np.random.Generator) -> Dataset:
    first, second = two_targets(data, rng)
    position = data.position.copy()
    position[first] = position[second] + rng.normal(0.0, 1e-5, 3)
    return replace(data, position=position)


def unit_length(data: Dataset, rng: np.random.Generator) -> Dataset:
    factor, everywhere = rng.choice([1e3, 1e-3, 25.4]), rng.random() < 0.5
    slipped = everywhere | (data.target == rng.integers(len(data.targets)))
    return replace(data, position=data.position * np.where(slipped, factor, 1.0)[:, None])


def unit_angle(data: Dataset, rng: np.random.Generator) -> Dataset:
    joints = data.joints.copy()
    chosen = slice(None) if rng.random() < 0.5 else int(rng.integers(joints.shape[1] - 2))
    joints[:, chosen] *= rng.choice([np.pi / 180, 180 / np.pi])
    return replace(data, joints=joints)


def joint_sign(data: Dataset, rng: np.random.Generator) -> Dataset:
    joints = data.joints.copy()
    if rng.random() < 0.5:
        joints[:, rng.integers(joints.shape[1])] *= -1
    else:
        a, b = rng.choice(joints.shape[1], 2, replace=False).tolist()
        joints[:, [a, b]] = joints[:, [b, a]]
    return replace(data, joints=joints)


def duplicates(data: Dataset, rng: np.random.Generator) -> Dataset:
    repeated = np.flatnonzero(data.configuration == rng.integers(data.configurations))
    return data.of_readings([*range(len(data.target)), *repeated.tolist()])


def beyond_limits(data: Dataset, rng: np.random.Generator) -> Dataset:
    joints = data.joints.copy()
    joints[rng.integers(len(joints)), rng.integers(joints.shape[1])] += rng.choice([-1, 1]) * 4 * np.pi
    return replace(data, joints=joints)


CORRUPTIONS: tuple[Corruption, ...] = (
    *(missing, outliers, targets_swapped, target_mistaken, unit_length, unit_angle, joint_sign, duplicates),
    beyond_limits,
)


@pytest.mark.parametrize("corrupt", CORRUPTIONS, ids=lambda c: c.__name__)
def test_every_fault_is_found(clean: tuple[str, Dataset], corrupt: Corruption) -> None:
    robot, data = clean
    for seed in SEEDS_OF.get(robot, SEEDS):
        assert corrupt.__name__.replace("_", "-") in codes(corrupt(data, np.random.default_rng(seed)), robot), seed


def test_exchanged_and_mistaken_targets_show_without_a_robot(measured: Dataset) -> None:
    for seed in SEEDS:
        for corrupt in (outliers, targets_swapped, target_mistaken):
            corrupted = corrupt(measured, np.random.default_rng(seed))
            assert codes(corrupted, None) == {corrupt.__name__.replace("_", "-")}, seed
        rng = np.random.default_rng(seed)
        first, second = two_targets(measured, np.random.default_rng(seed))
        (notice,) = check(target_mistaken(measured, rng)).warnings
        label = measured.labels[measured.configuration[first]]
        names = [measured.targets[measured.target[r]] for r in (first, second)]
        assert f"{label}/{names[0]} (is target {names[1]})" in notice.message
        assert "Leave these cells empty" in notice.message


@pytest.mark.parametrize("side", [(0.1, 0.1, 0.1), (0.1, 0.1, 0.1002), (0.1, 0.1, 0.13)])
def test_a_reading_that_is_off_is_no_exchange_of_targets(side: tuple[float, float, float]) -> None:
    for seed in SEEDS:
        rng, (a, b, c) = np.random.default_rng(seed), side
        along = (a**2 + c**2 - b**2) / (2 * c)
        tool = np.array([[0.0, 0, 0], [c, 0, 0], [along, np.sqrt(a**2 - along**2), 0]])
        position = np.tile(tool, (20, 1, 1)) + rng.normal(0.0, 2e-5, (20, 3, 3))
        wrong = rng.choice(20, 6, replace=False)
        outward = (tool - tool.mean(axis=0)) / np.linalg.norm(tool - tool.mean(axis=0), axis=1, keepdims=True)
        at = rng.integers(3, size=6)
        position[wrong, at] += 1e-3 * outward[at]
        data = Dataset.of(rng.uniform(-1.0, 1.0, (20, 6)), position)
        suspects = {(s.rule.code, s.configuration, s.target) for s in rigid_suspects(data)}
        assert suspects == {("outliers", str(c + 1), str(t + 1)) for c, t in zip(wrong, at, strict=True)}, seed


def test_of_many_targets_the_wrong_one_is_named() -> None:
    rng = np.random.default_rng(4)
    tool = rng.uniform(-0.3, 0.3, (40, 3))
    position = np.tile(tool, (12, 1, 1)) + rng.normal(0, 1e-5, (12, 40, 3))
    position[5, 17] += 0.004
    (suspect,) = rigid_suspects(Dataset.of(np.zeros((12, 6)), position))
    assert (suspect.rule.code, suspect.configuration, suspect.target) == ("outliers", "6", "18")


@pytest.mark.parametrize("points", [1, 3])
def test_a_moved_table_shows(measured: Dataset, points: int) -> None:
    references = known(measured.references)
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        direction = rng.normal(size=3)
        shift = 1e-3 * direction / np.linalg.norm(direction)
        later = references.configuration >= rng.integers(50, measured.configurations - 50)
        moved = later & (references.target < points)
        position = references.position + np.where(moved[:, None], shift, 0.0)
        corrupted = replace(measured, references=replace(references, position=position))
        assert codes(corrupted, None) == {"reference-moved"}, seed


def test_the_mistaken_reference_readings_are_named(with_references: Dataset) -> None:
    notices = {n.code: n.message for n in check("irb120", with_references).warnings}
    assert set(notices) == {"missing", "target-mistaken"}
    for label, is_target in ((22, 3), (51, 3), (136, 2), (400, 2)):
        assert f"{label}/base_3 (is target {is_target})" in notices["target-mistaken"]
    assert "1 of target base_2, 8 of target base_3" in notices["missing"]


def test_removing_the_motion_of_the_table_does_not_worsen_the_result(with_references: Dataset) -> None:
    robot = load_robot("irb120")
    geometric = next(m for m in MODELS if m.name == "geometric")
    medians = []
    for data in (with_references, without_table_motion(with_references)):
        means = []
        for seed in range(5):
            order = np.random.default_rng(seed).permutation(data.configurations)
            fit = identify(robot, data.of_configurations(order[:300]), geometric)
            means.append(errors_of(fit.robot, data.of_configurations(order[300:])).position_norms.mean())
        medians.append(np.median(means))
    assert medians[1] <= medians[0]


def test_a_known_motion_of_the_table_is_removed() -> None:
    _, data = campaign("ur5", 30, 0.0, 3)
    rng = np.random.default_rng(0)
    places = np.array([[2.0, 0.5, -0.5], [2.5, 1.5, -0.5], [1.5, 1.0, -0.6]])
    n = data.configurations
    shifts = 1e-3 * rng.normal(size=(n, 3))
    references = replace(
        data,
        targets=("a", "b", "c"),
        configuration=np.repeat(np.arange(n), 3),
        target=np.tile(np.arange(3), n),
        position=np.tile(places, (n, 1)) + np.repeat(shifts, 3, axis=0),
        sigma=None,
    )
    wobbling = replace(data, position=data.position + shifts[data.configuration], references=references)
    steady = without_table_motion(wobbling)
    np.testing.assert_allclose(steady.position, data.position + shifts.mean(axis=0), atol=1e-9)


def test_joints_read_before_settling_show(measured_data: Path) -> None:
    folder = measured_data / "irb120-faro"
    targets = {str(i): folder / f"target_{i}.txt" for i in (1, 2, 3)}
    results = {}
    for name in ("commanded", "read"):
        data, _ = read_matrices(folder / f"joints_{name}.txt", targets, {}, "deg", "mm")
        run = calibrate("irb120", data, train=300)
        mean = known(run.validation).position_norms.mean() * 1e3
        results[name] = (mean, {n.code: n.message for n in run.warnings})
    assert "joints-not-settled" not in results["commanded"][1]
    mean, notices = results["read"]
    assert mean <= 0.50
    assert "before the robot had settled" in notices["joints-not-settled"]
    assert "hysteresis" in notices["joints-not-settled"]
    assert "wrong-robot" not in notices


def test_hysteresis_of_a_simulated_robot_shows() -> None:
    for robot in ("ur5", "kr5", "puma560"):
        rng = np.random.default_rng(4)
        twin, data = campaign(robot, 80, 0.05e-3, 4)
        lag = np.sign(np.diff(data.joints, axis=0, prepend=data.joints[:1])) * np.radians(0.01)
        places = [twin.robot.world_poses(data.joints + lag, target)[0] for target in data.targets]
        position = np.stack(places, axis=1).reshape(-1, 3)
        late = replace(data, position=position + rng.normal(0.0, 0.05e-3, position.shape))
        assert "joints-not-settled" in {n.code for n in calibrate(robot, late).warnings}, robot
        assert "joints-not-settled" not in {n.code for n in calibrate(robot, data).warnings}, robot


def test_one_target_a_configuration_is_a_campaign() -> None:
    _, data = campaign("irb120", 46, 0.05e-3, 17)
    in_turn = data.of_readings(data.target == data.configuration % 3)
    assert codes(in_turn, None) == set()
    twice = data.of_readings((data.target == data.configuration % 3) | (data.configuration == 4))
    (missing,) = check(twice).warnings
    assert missing.message.startswith("90 readings are missing (29 of target 1, 31 of target 2, 30 of target 3).")


def test_configurations_that_are_off_are_not_called_nothing_wrong() -> None:
    _, data = campaign("irb120", 30, 0.05e-3, 17)
    joints = data.joints.copy()
    joints[7, 1] += np.radians(0.05)
    result = check("irb120", replace(data, joints=joints))
    assert not result.warnings
    assert result.next[0].code == "measure-again"
    assert result.lines()[2] == "Nothing looks wrong but the configurations named next."
    assert check("irb120", data).lines()[2] == "Nothing looks wrong."


def test_messages_count_in_words() -> None:
    _, data = campaign("irb120", 10, 0.05e-3, 17)

    def messages_of(broken: Dataset, robot: str | None = None) -> list[str]:
        return [notice.message for notice in check(robot, broken).warnings]

    lost = moved_readings(data, np.array([4]), np.array(np.nan))
    assert messages_of(lost) == ["1 reading is missing (1 of target 2). It is left out; nothing needs to be done."]
    (far,) = messages_of(moved_readings(data, np.array([4]), np.array([5e-3, 5e-3, 8e-3])))
    assert far.startswith("1 reading is far from where it must be (configuration/target): 2/2 (")
    assert far.endswith("Measure it again or leave it out; `loss=cauchy` lets it count little.")
    (wrong,) = messages_of(moved_readings(data, np.array([4]), np.array([0.3, 0.0, 0.0])))
    assert wrong.startswith("1 reading is far from where it must be (configuration/target): 2/2 (")
    elsewhere = data.position[5] - data.position[4]
    (wrong,) = messages_of(moved_readings(data, np.array([4]), elsewhere))
    assert wrong.startswith("1 reading was taken from another point than it names (configuration/target): 2/")
    (repeated,) = messages_of(data.of_readings([*range(30), 4]))
    assert repeated.startswith("1 reading repeats another one to the last digit (target at configurations): 2 at 2 and")
    single = replace(data, joints=data.joints[:, :1], joint_kinds=("revolute",), approach=None)
    refused(None, "got '1 joint column'; allowed: 6", check, "irb120", single)


def test_the_old_order_of_robot_and_data_is_refused_with_the_new_line(
    truearm: Truearm, small: Path, tmp_path: Path
) -> None:
    run = truearm("check", small / "data.csv", "irb120")
    assert run.code == 2
    assert f"Write 'truearm check irb120 {small / 'data.csv'}'." in run.err
    assert truearm("check", "irb120", small / "data.csv").code == 0
    refused(None, r"this is a robot.*Exchange robot and measurements", calibrate, "irb120", "irb120")
    (tmp_path / "arm.yaml").write_text("# an arm\ntruearm: truearm-robot/1\n")
    refused(None, "this is a robot", check, tmp_path / "arm.yaml")
