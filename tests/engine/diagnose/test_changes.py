"""What moved during a campaign is told from what else could have, with where and by how much; and a second base."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from tests.expecting import known, refused
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.engine.base.errors import Notice
from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.changes import check_changes, find_change
from truearm.engine.diagnose.unmodelled import LeftOver, chi_squared_tail
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import rotation_from_vector
from truearm.engine.twin.twin import Twin
from truearm.importing.files import read_matrices

FIRST_MOVED = 23


@cache
def honest() -> tuple[Twin, Dataset]:
    twin, data = campaign("irb120", 50, 0.05e-3, 3)
    return twin, replace(data, sigma=None, number=np.arange(50.0))


def told(data: Dataset, robot: str = "irb120") -> list[Notice]:
    return check_changes(LeftOver.of(identify(load_robot(robot), data, named_model("geometric")), data))


def moved_instrument(data: Dataset, shift: Array, turn: Array | None = None) -> Dataset:
    R = np.eye(3) if turn is None else rotation_from_vector(turn)
    late = data.configuration >= FIRST_MOVED
    return replace(data, position=np.where(late[:, None], data.position @ R.T + shift, data.position))


def test_a_moved_instrument_is_named_with_its_configuration_and_size() -> None:
    (notice,) = told(moved_instrument(honest()[1], np.array([1.2e-3, -1.6e-3, 0.0])))
    assert (notice.code, notice.level) == ("instrument-moved", "error")
    size = re.match(f"From configuration {FIRST_MOVED + 1} on, all readings stand ([0-9.]+) mm", notice.message)
    assert float(known(size)[1]) == pytest.approx(2.0, rel=0.05)
    assert "`base_changes`" in notice.message
    (notice,) = told(moved_instrument(honest()[1], np.array([0.0, 0.0, 0.16e-3])))
    assert (notice.code, notice.level) == ("instrument-moved", "warning")


def test_a_moved_target_is_named() -> None:
    twin, data = honest()
    _, R = twin.robot.world_poses(data.joints)
    late = (data.configuration >= FIRST_MOVED) & (data.target == 1)
    shift = R[data.configuration] @ np.array([0.0, 1e-3, 0.0])
    (notice,) = told(replace(data, position=np.where(late[:, None], data.position + shift, data.position)))
    assert (notice.code, notice.level) == ("target-moved", "error")
    assert notice.message.startswith(f"From configuration {FIRST_MOVED + 1} on, target 2 stands 1")
    assert 0.9 < float(re.findall(r"stands ([0-9.]+) mm", notice.message)[0]) < 1.1


def test_a_jumped_joint_zero_is_named() -> None:
    _, data = honest()
    for joint in (1, 3, 6):
        joints = data.joints.copy()
        joints[FIRST_MOVED:, joint - 1] += np.radians(0.2)
        (notice,) = told(replace(data, joints=joints))
        assert (notice.code, notice.level) == ("joint-zero-jumped", "error")
        found = known(re.search(r"From configuration (\d+) on, joint (\d) stands ([0-9.]+) deg off", notice.message))
        assert (int(found[1]), int(found[2])) == (FIRST_MOVED + 1, joint)
        assert 0.18 < float(found[3]) < 0.22


def test_a_drift_is_told() -> None:
    _, data = honest()
    along = (data.configuration / data.configurations)[:, None] * np.array([0.5e-3, 0.0, 0.0])
    (notice,) = told(replace(data, position=data.position + along))
    assert (notice.code, notice.level) == ("drift", "warning")
    assert "Measure reference points" in notice.message


def test_nothing_is_told_of_honest_campaigns() -> None:
    for robot, seed in product(("irb120", "katana450", "kr5", "ur10"), range(3)):
        _, data = campaign(robot, 40, 0.05e-3, seed)
        assert told(replace(data, number=np.arange(40.0)), robot) == [], (robot, seed)


def test_rows_in_another_order_say_the_same() -> None:
    data = moved_instrument(honest()[1], np.array([2e-3, 0.0, 0.0]))
    shuffled = data.of_configurations(np.random.default_rng(0).permutation(50))
    (notice,) = told(shuffled)
    assert notice.message.startswith(f"From configuration {FIRST_MOVED + 1} on, all readings stand 1.9")
    assert told(data.of_configurations(np.arange(FIRST_MOVED - 9, FIRST_MOVED + 9))) == []


def test_without_an_order_that_of_the_file_is_tried_unless_it_follows_a_joint() -> None:
    data = replace(honest()[1], number=None, approach=None)
    moved = moved_instrument(data, np.array([2e-3, 0.0, 0.0]))
    (notice,) = told(moved)
    assert (notice.code, notice.level) == ("instrument-moved", "warning")
    assert notice.message.startswith(f"From configuration {FIRST_MOVED + 1} on, all readings stand 1.9")
    assert notice.message.endswith("the order of the file was taken for that of measurement. If it is, number them so.")
    assert told(data) == []
    assert told(moved.of_configurations(np.argsort(data.joints[:, 1]))) == []
    sorted_first = data.of_configurations(np.argsort(-data.joints[:, 1]))
    late = moved_instrument(sorted_first, np.array([2e-3, 0.0, 0.0]))
    assert told(late) == []
    (notice,) = told(replace(late, number=np.arange(float(late.configurations))))
    assert notice.level == "error"
    assert "Joint 2 moved on with the order of measurement" in notice.message


def test_measured_campaigns_show_no_change(measured_data: Path) -> None:
    folder = measured_data / "irb120-faro"
    targets = {str(i): folder / f"target_{i}.txt" for i in (1, 2, 3)}
    data = read_matrices(folder / "joints_commanded.txt", targets, {}, "deg", "mm")[0]
    left = LeftOver.of(identify(load_robot("irb120"), data, named_model("geometric")), data)
    assert find_change(left) is None


def test_tails_of_chi_squared() -> None:
    # Abramowitz and Stegun, table 26.8: quantiles of 1 %.
    for freedom, quantile in ((1, 6.63490), (2, 9.21034), (3, 11.3449), (6, 16.8119)):
        assert chi_squared_tail(quantile, freedom) == pytest.approx(0.01, rel=1e-4)


# -- a second base -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("shift", "turn"), [((2e-3, 0.0, 0.0), (0.0, 0.0, 0.0)), ((1.0, 0.3, 0.2), (0.1, 0.5, -1.0))])
def test_a_second_base_cures_a_moved_instrument(shift: tuple[float, ...], turn: tuple[float, ...]) -> None:
    _, data = honest()
    steady = calibrate("irb120", data)
    moved = moved_instrument(data, np.array(shift), np.array(turn))
    assert not calibrate("irb120", moved).finished
    cured = calibrate("irb120", moved, base_changes=[str(FIRST_MOVED + 1)])
    assert cured.finished
    after, before = (known(each.validation).position_norms.mean() for each in (cured, steady))
    assert after <= 1.1 * before
    (notice,) = [n for n in cured.warnings if n.code == "base-changed"]
    assert notice.level == "note"
    assert f"from {FIRST_MOVED + 1} on by " in notice.message
    assert f"another base from {FIRST_MOVED + 1} on" in cured.robot.history[-1]
    assert "base_changes=" in cured.command


def test_what_cannot_be_a_change_of_the_base_is_refused_and_what_is_none_moves_nothing() -> None:
    data = honest()[1]
    for labels, words in (
        (["nowhere"], "there is no configuration of this name"),
        (["1"], "nothing was measured before the first configuration"),
        (["3"], "too few training configurations"),
        ([2.5], "a name belongs here"),
        ("24", "a sequence of names belongs here"),
    ):
        refused(None, words, calibrate, "irb120", data, base_changes=labels)
    orderless = replace(data, number=None, approach=None)
    refused(None, "the order of measurement is not known", calibrate, "irb120", orderless, base_changes=["24"])
    (notice,) = [n for n in calibrate("irb120", data, base_changes=["24"]).warnings if n.code == "base-changed"]
    assert float(re.findall(r"by ([0-9.]+) mm", notice.message)[0]) < 0.06
