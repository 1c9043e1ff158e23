"""What the likelihood says of declared deviations and of visits; joint positions in coarse steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated import campaign

from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.plausibility import check_rounding, step_of
from truearm.engine.diagnose.unmodelled import LeftOver
from truearm.engine.diagnose.visits import check_separate_visits, check_sigma_beside_joints, joints_as_far_off
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.twin import measure

NOISE = 2e-5


def missing_by(deviation: float, seed: int, *, each_target: bool = False) -> Dataset:
    """Return readings of a robot whose joints miss by so much [deg] at every visit, or anew for each target."""
    twin, data = campaign("irb120", 30, NOISE, seed)
    rng = np.random.default_rng(seed)
    position = data.position.copy()
    for visit in range(len(data.targets) if each_target else 1):
        missed = np.radians(deviation) * rng.standard_normal(data.joints.shape)
        rows = data.target == visit if each_target else np.ones(len(data.target), dtype=bool)
        position[rows] = measure(twin, data.joints + missed, NOISE, rng).position[rows]
    return replace(data, position=position)


def left_of(data: Dataset) -> LeftOver:
    return LeftOver.of(identify(load_robot("irb120"), data, named_model("geometric")), data)


def of_one_target(data: Dataset) -> Dataset:
    dataset = data.of_readings(data.target == 0)
    return replace(dataset, targets=("1",))


@pytest.mark.parametrize("deviation", [0.0, 0.003, 0.02])
@pytest.mark.parametrize("targets", [1, 3])
def test_honest_campaigns_are_not_doubted(deviation: float, targets: int) -> None:
    for seed in range(2):
        data = missing_by(deviation, seed)
        left = left_of(data if targets == 3 else of_one_target(data))
        assert check_sigma_beside_joints(left) == []
        assert check_separate_visits(left) == []


@pytest.mark.parametrize("factor", [2.0, 5.0])
def test_sigma_that_takes_errors_of_the_joints_for_noise(factor: float) -> None:
    data = missing_by(0.005, 0)
    (notice,) = check_sigma_beside_joints(left_of(replace(data, sigma=np.full(len(data.target), factor * NOISE))))
    assert notice.code == "sigma-too-large"
    times = float(notice.message.split("about ")[1].split(" times")[0])
    assert times == pytest.approx(factor, rel=0.2)
    assert "the expected error and the intervals may be too small" in notice.message


def test_separate_visits_are_told_unless_the_data_say_so() -> None:
    data = missing_by(0.01, 0, each_target=True)
    (notice,) = check_separate_visits(left_of(data))
    assert (notice.code, notice.level) == ("separate-visits", "warning")
    assert check_separate_visits(left_of(replace(data, visit=data.target))) == []


def test_the_error_of_every_joint_that_explains_what_is_left() -> None:
    assert np.degrees(joints_as_far_off(left_of(missing_by(0.05, 0)))) == pytest.approx(0.05, rel=0.15)


@pytest.mark.parametrize(
    ("step", "unit", "found"),
    [(1.0, "deg", (1.0, "deg")), (0.1, "deg", (0.1, "deg")), (0.001, "rad", (0.001, "rad")), (0.01, "deg", None)],
)
def test_steps_of_joint_positions(step: float, unit: str, found: tuple[float, str] | None) -> None:
    data = campaign("irb120", 20, NOISE, 0)[1]
    size = np.radians(step) if unit == "deg" else step
    assert step_of(replace(data, joints=np.round(data.joints / size) * size)) == found
    standing = np.where(np.arange(6) == 1, data.joints, 0.0)
    assert step_of(replace(data, joints=standing)) is None


def test_rounded_joint_positions_are_told_by_what_they_do() -> None:
    twin, data = campaign("irb120", 30, NOISE, 0)
    rounded = np.radians(np.degrees(data.joints).round(1))
    wrong = replace(data, joints=rounded)
    (notice,) = check_rounding(left_of(wrong).fit, wrong)
    assert notice.code == "joints-rounded"
    commanded = measure(twin, rounded, NOISE, np.random.default_rng(1))
    assert check_rounding(left_of(commanded).fit, commanded) == []
    noisy = replace(measure(twin, rounded, 0.3e-3, np.random.default_rng(1)), sigma=None)
    assert check_rounding(left_of(noisy).fit, noisy) == []
