"""The cause of data that cannot be the robot's is named, first and as an error; honest data are left alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.checking.check import check
from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.narrow_data import check_few_to_doubt
from truearm.engine.fit.fit import Status, identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Tool
from truearm.engine.twin.truths import at_station
from truearm.engine.twin.twin import Twin, measure

ROBOT = "irb120"


@cache
def honest() -> Dataset:
    return replace(campaign(ROBOT, 24, 0.05e-3, 5)[1], sigma=None)


def noise(data: Dataset) -> Dataset:
    return replace(data, position=np.random.default_rng(0).normal(0.0, 0.5, data.position.shape))


def scaled(factor: float) -> Callable[[Dataset], Dataset]:
    return lambda data: replace(data, position=data.position * factor)


def exchanged_axes(data: Dataset) -> Dataset:
    return replace(data, position=data.position[:, [1, 0, 2]])


def negated_axis(data: Dataset) -> Dataset:
    return replace(data, position=data.position * np.array([1.0, -1.0, 1.0]))


def sign_of(joint: int) -> Callable[[Dataset], Dataset]:
    def with_sign(data: Dataset) -> Dataset:
        joints = data.joints.copy()
        joints[:, joint - 1] *= -1
        return replace(data, joints=joints)

    return with_sign


def shuffled(data: Dataset) -> Dataset:
    return replace(data, joints=np.random.default_rng(0).permutation(data.joints))


def one_row_late(data: Dataset) -> Dataset:
    return replace(data, joints=np.roll(data.joints, 1, axis=0))


def of_another_robot(_: Dataset) -> Dataset:
    return replace(campaign("puma560", 24, 0.05e-3, 6)[1], sigma=None)


WRONG = [
    pytest.param(noise, "rows-unrelated", "in an order drawn at random", id="noise"),
    pytest.param(
        scaled(2.0), "wrong-robot", "All its lengths come out 2 times as long, by one factor", id="twice as large"
    ),
    pytest.param(scaled(1e4), "unit-length", "times too large for this robot", id="ten thousand times"),
    pytest.param(scaled(1e3), "unit-length", "as if mm were called m", id="mm called m"),
    pytest.param(scaled(1e-3), "unit-length", "as if m were called mm", id="m called mm"),
    pytest.param(exchanged_axes, "mirrored", "columns x, y and z", id="x and y exchanged"),
    pytest.param(negated_axis, "mirrored", "columns x, y and z", id="y negated"),
    pytest.param(sign_of(4), "joint-sign", "The sign of joint 4 is", id="sign of joint 4"),
    pytest.param(sign_of(6), "joint-sign", "The sign of joint 6 is", id="sign of joint 6"),
    pytest.param(shuffled, "rows-unrelated", "do not follow the joint positions", id="rows shuffled"),
    pytest.param(one_row_late, "rows-shifted", "shifted by one row", id="joints one row late"),
    pytest.param(of_another_robot, None, "", id="another robot"),
]


@pytest.mark.parametrize(("spoil", "code", "words"), WRONG)
def test_what_cannot_be_the_robot_is_implausible_and_its_cause_named(
    spoil: Callable[[Dataset], Dataset], code: str | None, words: str
) -> None:
    run = calibrate(ROBOT, spoil(honest()))
    assert run.status is Status.IMPLAUSIBLE
    assert not run.finished
    first = run.warnings[0]
    assert first.level == "error"
    (implausible,) = [n for n in run.warnings if n.code == "implausible"]
    assert implausible.level == "error"
    assert "enter wider priors" not in " ".join(n.message for n in run.warnings)
    if code is not None:
        assert first.code == code
        assert words in first.message
        assert f"The cause is most likely what {code} says" in implausible.message


def of_some(factor: float, share: float) -> Callable[[Dataset], Dataset]:
    def with_factor(data: Dataset) -> Dataset:
        drawn = np.random.default_rng(1).random(data.configurations) < share
        return replace(data, position=np.where(drawn[data.configuration, None], factor, 1.0) * data.position)

    return with_factor


def single_cells(data: Dataset) -> Dataset:
    drawn = np.random.default_rng(1).random(data.position.shape) < 0.1
    return replace(data, position=np.where(drawn, 1e3, 1.0) * data.position)


def in_metres_with_a_sign(data: Dataset) -> Dataset:
    return sign_of(4)(scaled(1e3)(data))


def test_units_of_positions_are_named_by_what_fits() -> None:
    for spoil, expected in (
        (of_some(1e3, 0.4), ["are a thousand times too large, as if mm were called m; those of the others are not"]),
        (of_some(1e-3, 0.4), ["are a thousand times too small, as if m were called mm; those of the others are not"]),
        (of_some(25.4, 0.1), ["are 25.4 times too large, as if mm were called inches; those"]),
        (single_cells, ["No one unit makes them fit"]),
        (in_metres_with_a_sign, ["are a thousand times too large, as if mm were called m", "The sign of joint 4 is"]),
    ):
        errors = [notice for notice in check(ROBOT, spoil(honest())).warnings if notice.level == "error"]
        assert errors[0].code == "unit-length"
        for notice, words in zip(errors, expected, strict=True):
            assert words in notice.message


def rows_of(data: Dataset, first: int, last: int, factor: float, target: int | None = None) -> tuple[Dataset, set[str]]:
    """Return data with a block of configurations, or one target of it, in another unit, and which these are."""
    rows = (data.configuration >= first - 1) & (data.configuration < last)
    if target is not None:
        rows &= data.target == target
    names = {f"{data.labels[data.configuration[r]]}/{data.targets[data.target[r]]}" for r in np.flatnonzero(rows)}
    return replace(data, position=np.where(rows[:, None], factor, 1.0) * data.position), names


@pytest.mark.parametrize("of_one", [False, True])
def test_rows_in_another_unit_of_length_are_all_named_and_nothing_else_is_said_of_them(of_one: bool) -> None:
    for first, last, factor, words in (
        (5, 5, 1e-3, "at configuration 5 are a thousand times too small"),
        (5, 10, 1e-3, "at configurations 5 to 10 are a thousand times too small"),
        (1, 19, 1e-3, "at configurations 1 to 19 are a thousand times too small"),
        (9, 10, 1e3, "at configurations 9, 10 are a thousand times too large"),
        (20, 24, 1 / 25.4, "at configurations 20 to 24 are 25.4 times too small, as if inches"),
    ):
        data, rows = rows_of(one_target_of(honest()) if of_one else honest(), first, last, factor)
        run = check(ROBOT, data)
        (notice,) = run.warnings
        assert (notice.code, notice.level, words in notice.message) == ("unit-length", "error", True), notice.message
        assert {"/".join(place) for place in notice.at} == rows, words
        assert [step.code for step in run.next] == ["fix-data"], words


def test_without_a_robot_distances_tell_rows_in_another_unit() -> None:
    data, rows = rows_of(honest(), 5, 10, 1e-3)
    (notice,) = check(None, data).warnings
    assert (notice.code, notice.level) == ("unit-length", "error")
    assert "lie 1000 times closer together at configurations 5 to 10 than at the others" in notice.message
    assert {"/".join(place) for place in notice.at} == rows
    (notice,) = check(None, rows_of(honest(), 1, 19, 1 / 25.4)[0]).warnings
    assert "lie 25.4 times farther apart at configurations 20 to 24 than at the others" in notice.message
    # two rows of a long campaign are named, and a reading alone
    long = replace(campaign(ROBOT, 80, 0.05e-3, 5)[1], sigma=None)
    data, rows = rows_of(long, 41, 42, 1e-3)
    (notice,) = check(ROBOT, data).warnings
    assert "The positions at configurations 41, 42 are a thousand times too small" in notice.message
    data, more = rows_of(data, 60, 60, 1 / 25.4, target=1)
    (notice,) = check(ROBOT, data).warnings
    assert "; the positions at 60/2 (configuration/target) are 25.4 times too small" in notice.message
    assert {"/".join(place) for place in notice.at} == rows | more


def test_honest_data_have_no_error() -> None:
    for robot, poses in (("irb120", 30), ("ur10", 12), ("katana450", 30), ("li3", 20)):
        run = calibrate(robot, campaign(robot, poses, 0.05e-3, 8)[1], model="geometric")
        assert run.finished, robot
        assert not [n for n in run.warnings if n.level == "error"], robot


def test_an_unmastered_robot_is_the_robot() -> None:
    data = honest()
    off = np.radians(5.0) * np.array([1, -1, 1, 1, -1, 1])
    run = calibrate(ROBOT, replace(data, joints=data.joints + off), model="geometric")
    assert run.status is Status.CONVERGED
    assert not [n for n in run.warnings if n.level == "error"]
    assert "enter wider priors" in next(n.message for n in run.warnings if n.code == "far-from-nominal")


def test_the_sign_of_the_last_joint_is_named_for_a_target_near_its_axis() -> None:
    nominal, rng = load_robot(ROBOT), np.random.default_rng(2)
    drawn = {
        p.name: p.value + p.prior * float(rng.standard_normal())
        for p in nominal.parameters.values()
        if p.group in ("geometry", "joint zero")
    }
    for offset in (0.5e-3, 5e-3):
        twin = Twin(at_station(nominal.with_values(drawn), Tool({"A": (offset, 0.0, 0.1)})), {})
        data = replace(measure(twin, nominal.random_configurations(40, rng), 0.02e-3, rng), sigma=None)
        assert not check(ROBOT, data).warnings, offset
        (notice,) = check(ROBOT, sign_of(6)(data)).warnings
        assert (notice.code, notice.level) == ("joint-sign", "error"), offset
        assert notice.message.startswith("The sign of joint 6 is opposite"), offset


def test_joint_positions_of_another_row_are_told() -> None:
    data = honest()
    joints = data.joints.copy()
    joints[[4, 9]] = joints[[9, 4]]
    (notice,) = check(ROBOT, replace(data, joints=joints)).warnings
    assert notice.code == "rows-shifted"
    assert "5 (those of 10), 10 (those of 5)" in notice.message
    joints = data.joints.copy()
    joints[4] = joints[9]
    (notice,) = check(ROBOT, replace(data, joints=joints)).warnings
    assert notice.code == "joints-repeated"


def test_joint_positions_that_belong_to_no_row_are_told_and_not_their_readings() -> None:
    data = honest()
    joints = data.joints.copy()
    joints[4, 2] += np.radians(10.0)
    wrong = replace(data, joints=joints)
    (notice,) = check(ROBOT, wrong).warnings
    assert (notice.code, notice.level) == ("joints-mistaken", "warning")
    assert notice.message.startswith("The joint positions of configuration 5 (")
    assert "do not belong to their readings" in notice.message
    assert "narrow-data" not in {n.code for n in calibrate(ROBOT, wrong, train=18).warnings}
    (notice,) = check(ROBOT, one_target_of(wrong)).warnings
    assert notice.code == "outliers"
    assert notice.message.startswith("1 reading is far from where it must be (configuration/target): 5/1 (")


def test_a_robot_is_not_another_one_because_of_one_wrong_row() -> None:
    joints = honest().joints.copy()
    joints[3, 2] += 0.2
    found_codes = {n.code for n in calibrate(ROBOT, replace(honest(), joints=joints), model="geometric").warnings}
    assert ("joints-mistaken" in found_codes, "wrong-robot" in found_codes) == (True, False)


def one_target_of(data: Dataset) -> Dataset:
    return replace(data.of_readings(data.target == 0), targets=data.targets[:1])


def test_rows_in_another_unit_of_angle_are_told() -> None:
    for data in (honest(), one_target_of(honest())):
        joints = data.joints.copy()
        joints[[2, 6]] *= np.pi / 180
        (notice,) = check(ROBOT, replace(data, joints=joints)).warnings
        assert (notice.code, notice.level) == ("unit-angle", "error")
        assert "radians are called deg, at some configurations alone (3, 7)" in notice.message


@pytest.mark.parametrize(
    ("units", "words"), [(np.radians, "radians are called deg"), (np.degrees, "degrees are called rad")]
)
def test_blocks_of_rows_and_all_rows_in_another_unit_of_angle_are_told(
    units: Callable[[Array], Array], words: str
) -> None:
    data = honest()
    for share in (0.3, 0.5, 0.8):
        joints, some = data.joints.copy(), round(share * data.configurations)
        joints[:some] = units(joints[:some])
        (error,) = [n for n in check(ROBOT, replace(data, joints=joints)).warnings if n.level == "error"]
        assert error.code == "unit-angle", share
        assert f"{words}, at some configurations alone (1, 2" in error.message, share
    every = check(ROBOT, replace(data, joints=units(data.joints))).warnings
    assert any(n.message == f"The joints: {words}. Fix the unit in the header." for n in every)


def test_a_reading_far_off_is_blamed_once_and_no_good_one_with_it() -> None:
    data = honest()
    position = data.position.copy()
    position[[12, 13]] += np.array([0.05, 0.0, 0.0])
    (notice,) = check(ROBOT, replace(data, position=position)).warnings
    assert notice.code == "outliers"
    assert "2 readings are far from where they must be (configuration/target): 5/1 (49.9 mm off), 5/2" in notice.message


def test_nothing_is_doubted_where_numbers_are_few() -> None:
    few = campaign("fr3", 5, 0.05e-3, 8)[1]
    assert check_few_to_doubt(identify(load_robot("fr3"), few, named_model("geometric"), loss="cauchy"))
    position = few.position.copy()
    position[4] += np.array([0.0, 2e-3, 0.0])
    (notice,) = check("fr3", one_target_of(replace(few, position=position))).warnings
    assert notice.code == "few-readings"


def renamed(data: Dataset, readings: list[int], name: str) -> Dataset:
    target = data.target.copy()
    names = (*data.targets, name) if name not in data.targets else data.targets
    target[readings] = names.index(name)
    return replace(data, target=target, targets=names)


def test_a_misspelt_target_is_told() -> None:
    data = replace(honest(), targets=("A", "B", "C"))
    assert not check(None, data).warnings
    first_of = np.flatnonzero(data.target == 0).tolist()
    by_code = {n.code: n for n in check(None, renamed(data, first_of[3:5], "a")).warnings}
    assert by_code["target-misspelt"].level == "error"
    assert "a at 4, 5, where A is missing: did you mean A?" in by_code["target-misspelt"].message
    by_code = {n.code: n for n in check(None, renamed(data, first_of[6:7], "B")).warnings}
    assert "B is there twice at 7, and A not at all" in by_code["target-misspelt"].message
    other = renamed(data, first_of[3:5], "spare-marker")
    assert "target-misspelt" not in {n.code for n in check(None, other).warnings}


def test_positions_that_a_controller_computed_are_told() -> None:
    robot = load_robot(ROBOT)
    joints = honest().joints
    positions = np.round(robot.forward(joints)[0], 5)
    by_code = {n.code: n for n in check(ROBOT, Dataset.of(joints, positions)).warnings}
    assert by_code["positions-computed"].level == "warning"
    assert "computes such positions from its joints" in by_code["positions-computed"].message
    few = Dataset.of(joints[:9], positions[:9])
    assert "positions-computed" not in {n.code for n in check(ROBOT, few).warnings}
