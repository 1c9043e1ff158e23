"""What exact parameters would leave is what the true robot leaves, and nothing else is called noise."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Literal, NamedTuple

import numpy as np
import pytest
from tests.expecting import known

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import Errors, errors_of
from truearm.engine.diagnose.gain import mean_length
from truearm.engine.diagnose.least_error import Kind, LeastError, least_errors
from truearm.engine.diagnose.position_errors import as_residuals_allow
from truearm.engine.document.summaries import error_line, least_words
from truearm.engine.fit.fit import identify
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.models import named_model
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import quaternion_from_rotation
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import measured_with
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure

ROBOT = load_robot("irb120")
NOISE = 3e-5
HELD_OUT = 150


class Case(NamedTuple):
    """A calibration of a twin."""

    least: dict[Kind, LeastError]
    seen: Errors  #: On the held-out readings.
    true: float  #: Mean error that the true robot leaves of them [m].

    @property
    def words(self) -> str:
        return f"{error_line(self.seen, self.least)} {least_words(self.seen, self.least).get('position', '')}"


def measured(
    truth: str, postures: int, seed: int, repeat: float, visits: int, targets: int, declared: float | None
) -> tuple[Dataset, Dataset]:
    """Return readings of a robot that misses its joint positions by `repeat` [deg], and what it should have done."""
    rng = np.random.default_rng(seed)
    twin = truth_twin(ROBOT, truth, rng)
    joints = np.repeat(ROBOT.random_configurations(postures, rng), visits, axis=0)
    moved = joints + np.radians(repeat) * rng.standard_normal(joints.shape)
    both = [
        some_targets(replace(measure(twin, q, noise, rng), joints=joints), targets)
        for q, noise in ((moved, NOISE), (joints, 0.0))
    ]
    sigma = None if declared is None else np.full(len(both[0].target), declared * NOISE)
    return replace(both[0], sigma=sigma), both[1]


def some_targets(data: Dataset, count: int) -> Dataset:
    kept = data.target < count
    return replace(
        data,
        targets=data.targets[:count],
        target=data.target[kept],
        configuration=data.configuration[kept],
        position=data.position[kept],
        sigma=None if data.sigma is None else data.sigma[kept],
    )


def case(
    truth: str = "random",
    postures: int = 60,
    seed: int = 1,
    *,
    repeat: float = 0.0,
    visits: int = 1,
    targets: int = 3,
    declared: float | None = 1.0,
    loss: Loss = "linear",
) -> Case:
    data, true = measured(truth, postures + HELD_OUT // visits, seed, repeat, visits, targets, declared)
    first = data.of_configurations(range(postures * visits))
    rest = range(postures * visits, data.configurations)
    second = data.of_configurations(rest)
    fit = identify(ROBOT, first, named_model("geometric"), loss=loss)
    allowed = as_residuals_allow(fit, first).joint_error
    off = np.linalg.norm(second.position - true.of_configurations(rest).position, axis=1)
    return Case(least_errors(fit.robot, data, second, fit, allowed), errors_of(fit.robot, second), float(off.mean()))


@pytest.mark.parametrize("declared", [1.0, None])
@pytest.mark.parametrize("targets", [1, 3])
@pytest.mark.parametrize(
    ("repeat", "visits", "evidence"), [(0.01, 1, "residuals"), (0.01, 3, "visits"), (0.0, 3, "visits")]
)
def test_it_is_what_the_true_robot_leaves(
    repeat: float, visits: int, evidence: str, targets: int, declared: float | None
) -> None:
    cases = [
        case(postures=60 // visits, seed=seed, repeat=repeat, visits=visits, targets=targets, declared=declared)
        for seed in range(1, 5)
    ]
    assert {each.least["position"].evidence for each in cases} == {evidence}
    ratios = [each.least["position"].mean / each.true for each in cases]
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.1)
    assert np.std(ratios) < 0.15


@pytest.mark.parametrize("targets", [1, 3])
def test_without_errors_of_the_joints_it_is_the_declared_noise_or_follows_from_residuals(targets: int) -> None:
    for declared, evidence in ((1.0, "declared"), (None, "residuals")):
        found = case(targets=targets, seed=2, declared=declared)
        least = found.least["position"]
        assert least.evidence == evidence
        assert least.mean == pytest.approx(found.true, rel=0.1)
    assert case(targets=targets).least["position"].mean == pytest.approx(math.sqrt(8.0 / math.pi) * NOISE)


def test_a_robust_loss_knows_declared_noise_and_visits_alone() -> None:
    robust = partial(case, repeat=0.005, loss="huber")
    found = robust()
    least = found.least["position"]
    assert least.evidence == "declared"
    assert least.mean == pytest.approx(math.sqrt(8.0 / math.pi) * NOISE)
    assert least.mean < 0.7 * found.true
    assert robust(declared=None).least == {}
    again = robust(postures=20, visits=3, declared=None)
    assert again.least["position"].evidence == "visits"
    assert again.least["position"].mean == pytest.approx(again.true, rel=0.1)


@pytest.mark.parametrize("declared", [1.0, None])
@pytest.mark.parametrize("targets", [1, 3])
def test_what_the_model_cannot_follow_is_never_called_noise(targets: int, declared: float | None) -> None:
    """The arm bends, the model is rigid, and nothing else says how well it repeats."""
    for seed in range(1, 4):
        found = case("tracker-triangular", seed=seed, targets=targets, declared=declared)
        least = found.least["position"]
        assert least.evidence == "residuals"
        assert least.mean > 10.0 * found.true
        assert "estimated from what the model leaves" in found.words
        assert "What the model cannot follow is in it; only revisits tell that from noise" in found.words
        assert "(noise and repeatability" not in found.words
        said = {f"(declared noise: mean {1e3 * (least.declared or 0.0):.3f})"}
        if least.mean < known(found.seen.position).mean:
            said = {f"(estimated from residuals: mean {1e3 * least.mean:.3f})"}
        elif declared is None:
            said = {"(no more than residuals let expect)"}
        assert all(words in found.words for words in said)


@pytest.mark.parametrize("declared", [1.0, None])
def test_visits_tell_noise_and_repeatability_whatever_the_model(declared: float | None) -> None:
    found = case("tracker-triangular", 20, repeat=0.005, visits=3, declared=declared)
    least = found.least["position"]
    assert (least.evidence, least.visits, least.postures) == ("visits", 210, 70)
    assert least.mean == pytest.approx(found.true, rel=0.1)
    assert known(found.seen.position).mean > 8.0 * least.mean
    assert f"(noise and repeatability: mean {1e3 * least.mean:.3f})" in found.words
    assert "as 210 visits to 70 postures show." in found.words


def test_of_more_than_was_seen_no_figure_stands_beside_it() -> None:
    found = case(declared=3.0)
    assert found.least["position"].mean > known(found.seen.position).mean
    assert "(no more than declared noise)" in found.words
    assert ", and no more was found; repeatability is not in it (too few revisits)." in found.words


@pytest.mark.parametrize("evidence", ["visits", "declared", "residuals"])
def test_it_stands_on_the_line_of_the_error(evidence: Literal["visits", "declared", "residuals"]) -> None:
    """Which is the one that most people read, and has a hundred columns."""
    seen = case().seen
    for mean in (0.5 * known(seen.position).mean, 1.0):
        for declared in (None, 1e-6, 1.0):
            line = f"  calibrated  {error_line(seen, {'position': LeastError(mean, evidence, declared)})}"
            assert line.startswith("  calibrated  mean 0.0")
            assert 61 < len(line) <= 100


def test_too_few_visits_or_postures_say_nothing() -> None:
    data, _ = measured("random", 10, 1, 0.01, 2, 1, None)
    robot = truth_twin(ROBOT, "random", np.random.default_rng(1)).robot
    assert least_errors(robot, data, data)["position"].visits == 20
    nine = data.of_configurations(range(18))
    assert least_errors(robot, nine, nine) == {}
    data, _ = measured("random", 4, 1, 0.01, 30, 1, None)
    assert least_errors(robot, data, data) == {}


def test_lengths_are_off_by_one_number() -> None:
    rng = np.random.default_rng(5)
    data = measured_with(named_device("ballbar"), ROBOT, truth_twin(ROBOT, "random", rng), 120, rng)
    first, second = (data.of_configurations(part) for part in (range(90), range(90, 120)))
    fit = identify(ROBOT, first, named_model("geometric"))
    least = least_errors(fit.robot, data, second, fit)
    assert [*least] == ["length"]
    assert least["length"].mean == pytest.approx(math.sqrt(2.0 / math.pi) * known(data.sigma)[0])
    errors = errors_of(fit.robot, second)
    larger = replace(errors, length_errors=2.0 * known(errors.length_errors))
    assert error_line(larger, least).endswith(f" mm of length (declared noise: mean {1e3 * least['length'].mean:.3f})")


def test_noise_that_was_assumed_is_no_estimate() -> None:
    data, _ = measured("random", 60, 1, 0.0, 1, 3, None)
    fit = identify(ROBOT, data.of_configurations(range(40)), named_model("geometric"))
    rest = data.of_configurations(range(40, 60))
    assert least_errors(fit.robot, data, rest, fit)["position"].evidence == "residuals"
    assert least_errors(fit.robot, data, rest, replace(fit, assumed=("position",))) == {}


def test_orientations_have_one_of_their_own() -> None:
    rng = np.random.default_rng(6)
    twin = Twin(ROBOT.with_frames(ROBOT.base, {"1": ROBOT.base}))
    joints = np.repeat(ROBOT.random_configurations(30, rng), 4, axis=0)
    moved = joints + np.radians(0.01) * rng.standard_normal(joints.shape)
    data = replace(measure(twin, moved, NOISE, rng), joints=joints, sigma=None)
    quaternions = np.array([quaternion_from_rotation(twin.target_frames(q)["1"][:3, :3]) for q in moved])
    data = replace(data, quaternion=quaternions)
    least = least_errors(twin.robot, data, data)
    assert [*least] == ["position", "orientation"]
    errors = errors_of(twin.robot, data)
    assert least["orientation"].mean == pytest.approx(known(errors.orientation).mean, rel=0.1)
    assert error_line(errors, least).count("noise and repeatability") == 2


def test_the_mean_length_of_normal_vectors_is_that_of_many() -> None:
    normal = np.random.default_rng(7).standard_normal((200_000, 3))
    variances = np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 1.0], [3.0, 0.5, 0.1], [0.0, 2.0, 2.0], [0.0, 0.0, 0.0]])
    drawn = [np.linalg.norm(normal * np.sqrt(each), axis=1).mean() for each in variances]
    assert mean_length(variances) == pytest.approx(drawn, rel=5e-3)
    assert mean_length(variances)[:2] == pytest.approx([math.sqrt(2.0 / math.pi), math.sqrt(8.0 / math.pi)])
