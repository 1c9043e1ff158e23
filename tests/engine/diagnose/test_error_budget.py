"""The error budget adds up, and each of its shares is what the twin's truth says."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.expecting import known
from tests.simulated import campaign

from truearm.calibration.parts import budget_block
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import table_motion, without_table_motion
from truearm.engine.diagnose.error_budget import ErrorBudget, Source, error_budget
from truearm.engine.diagnose.expected_error import expected_error
from truearm.engine.document.document import json_of, lines_of
from truearm.engine.fit.every_effect import identify_every_effect
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import MODELS
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import rotation_from_vector
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import measured_with
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure

MODEL = {model.name: model for model in MODELS}
ROBOT = load_robot("irb120")
HELD_OUT = 60


def read(twin: Twin, joints: Array, noise: float, rng: np.random.Generator, repeat: float = 0.0) -> Dataset:
    """Return readings at joint positions that the robot misses by its repeatability."""
    return replace(measure(twin, joints + repeat * rng.standard_normal(joints.shape), noise, rng), joints=joints)


def judged(
    truth: str,
    poses: int,
    noise: float,
    seed: int,
    *,
    repeat: float = 0.0,
    visits: int = 1,
    declared: float | None = 1.0,
    every: bool = False,
) -> tuple[ErrorBudget, Fit, Twin, Dataset]:
    """Return the budget of a calibration of a twin, geometric or with every effect, and the held-out readings."""
    rng = np.random.default_rng(seed)
    twin = truth_twin(ROBOT, truth, rng)
    joints = np.repeat(ROBOT.random_configurations(poses + HELD_OUT, rng), visits, axis=0)
    data = read(twin, joints, noise, rng, repeat)
    if data.sigma is not None:
        data = replace(data, sigma=None if declared is None else declared * data.sigma)
    first, remaining = (data.of_configurations(part) for part in np.split(np.arange(len(joints)), [poses * visits]))
    fit = identify_every_effect(ROBOT, first)[1] if every else identify(ROBOT, first, MODEL["geometric"])
    return known(error_budget(fit, data, first, remaining)), fit, twin, remaining


def square(budget: ErrorBudget, source: Source) -> float:
    return known(budget.share(source).square)


def of_the_model(fit: Fit, twin: Twin, data: Dataset) -> float:
    """Return the true mean square error of what the robot predicts."""
    true = measure(twin, data.joints, 0.0, np.random.default_rng(0)).position.reshape(len(data.joints), -1, 3)
    values = np.stack([fit.robot.world_poses(data.joints, name)[0] for name in data.targets], axis=1)
    return float(np.mean(np.sum((values - true) ** 2, axis=2)))


def test_the_shares_add_up_to_the_held_out_square() -> None:
    budget, *_ = judged("tracker-triangular", 40, 0.02e-3, 1)
    shares = [share.square for share in budget.shares if share.square is not None]
    assert sum(shares) == pytest.approx(budget.square, rel=1e-12)
    summary = json_of([budget_block(budget)])["limits_of_accuracy"]
    assert sum(s["square_mm2"] or 0.0 for s in summary["shares"]) == pytest.approx(summary["rms_mm"] ** 2, rel=1e-9)
    (line,) = lines_of([budget_block(budget)])
    parts = line.split("; ")[0].split(": ")[1].split(", ")
    assert parts[0].startswith("what the model cannot express ")
    assert parts[-1] == "instrument noise 0.035 mm"
    assert line.endswith(f"mm, held out {summary['rms_mm']:.3f} mm, the same within its uncertainty")


def test_noise_that_nobody_declared_is_apparent_and_large_shares_are_told_though_they_may_be_chance() -> None:
    budget, *_ = judged("random", 20, 0.02e-3, 1, declared=None)
    (line,) = lines_of([budget_block(budget)])
    assert line.startswith("What limits the accuracy: apparent noise 0.03")
    unsure = tuple(
        replace(share, square=4e-6, deviation=3e-6) if share.source == "parameters" else share
        for share in budget.shares
    )
    (line,) = lines_of([budget_block(replace(budget, shares=unsure))])
    assert line.startswith("What limits the accuracy: uncertain parameters perhaps 2.000 mm, apparent noise 0.03")


def test_noise_alone_is_the_instruments() -> None:
    budgets = [judged("random", 60, 0.05e-3, seed)[0] for seed in range(5)]
    for budget in budgets:
        assert square(budget, "instrument") == pytest.approx(3 * 0.05e-3**2)
        assert budget.share("instrument").deviation == 0.0
        assert abs(square(budget, "model")) < 3 * budget.share("model").deviation
        assert budget.remainder_is_chance
    assert np.mean([square(b, "model") for b in budgets]) < 0.1 * square(budgets[0], "instrument")


def test_the_share_of_the_parameters_is_what_they_do_at_unseen_poses() -> None:
    result = [judged("random", 14, 0.05e-3, seed) for seed in range(6)]
    true = [of_the_model(fit, twin, others) for _, fit, twin, others in result]
    shares = [square(budget, "parameters") for budget, *_ in result]
    doubt = np.linalg.norm([budget.share("parameters").deviation for budget, *_ in result]) / len(result)
    assert abs(np.mean(shares) - np.mean(true)) < 2.5 * doubt < 0.7 * np.mean(true)
    for (budget, *_), is_so in zip(result, true, strict=True):
        assert abs(square(budget, "parameters") - is_so) < 3 * budget.share("parameters").deviation


def test_what_the_model_lacks_is_found() -> None:
    result = [judged("tracker-triangular", 80, 0.02e-3, n % 3, declared=1.0 if n < 3 else None) for n in range(6)]
    for budget, fit, twin, others in result:
        true = of_the_model(fit, twin, others)
        explained = square(budget, "model") + square(budget, "parameters")
        doubt = np.hypot(budget.share("model").deviation, budget.share("parameters").deviation)
        assert abs(explained - true) < 3 * np.hypot(doubt, budget.deviation)
        assert square(budget, "model") > 0.6 * true
        assert "how well the robot comes back" in budget.share("model").words
        assert square(budget, "instrument") == pytest.approx(3 * 0.02e-3**2, rel=0.3)


@pytest.mark.parametrize("truth", ["gear-errors", "random"])
def test_where_every_effect_is_in_the_model_nothing_is_counted_twice(truth: str) -> None:
    """What is expected of effects that may be larger than they were found is no share of what is seen."""
    budget, fit, twin, others = judged(truth, 40, 0.03e-3, 5, every=True)
    assert math.fsum(share.square or 0.0 for share in budget.shares) == pytest.approx(budget.square, rel=1e-9)
    assert all((share.square or 0.0) >= 0.0 for share in budget.shares if share.source != "remainder")
    assert abs(square(budget, "remainder")) < 0.15 * budget.square
    explained = square(budget, "model") + square(budget, "parameters")
    assert explained == pytest.approx(of_the_model(fit, twin, others), abs=0.2 * budget.square)


def test_repeatability_is_told_from_the_model_where_postures_were_visited_again() -> None:
    repeat = np.radians(0.01)
    budget, _, twin, remaining = judged("random", 30, 0.02e-3, 1, repeat=repeat, visits=3)
    at = measure(twin, remaining.joints, 0.0, np.random.default_rng(0)).position
    moved = 0.0
    for joint in range(6):
        repeated = measure(twin, remaining.joints + 1e-6 * np.eye(6)[joint], 0.0, np.random.default_rng(0)).position
        moved += float(np.mean(np.sum(((repeated - at) / 1e-6) ** 2, axis=1)))
    share = budget.share("repeatability")
    assert share.square == pytest.approx(moved * repeat**2, abs=3 * share.deviation)
    assert share.deviation < 0.2 * moved * repeat**2
    assert abs(square(budget, "model")) < 3 * budget.share("model").deviation
    assert "270 visits to 90 postures" in share.words


def test_declared_deviations_that_are_too_large_show_as_a_negative_share() -> None:
    budget, *_ = judged("random", 60, 0.05e-3, 2, declared=2.0)
    share = budget.share("model")
    assert known(share.square) < -3 * share.deviation
    assert share.words.startswith("negative: the training residuals are smaller than the declared deviations")
    assert "; what the model cannot express takes 0." in lines_of([budget_block(budget)])[0]


def test_an_effect_outside_the_training_part_is_a_remainder_that_is_not_explained() -> None:
    rng = np.random.default_rng(3)
    twin, data = campaign("irb120", 60, 0.02e-3, 3)
    remaining = read(twin, ROBOT.random_configurations(40, rng), 0.02e-3, rng)
    remaining = replace(remaining, position=remaining.position + np.array([0.5e-3, 0.0, 0.0]))
    fit = identify(ROBOT, data, MODEL["geometric"])
    budget = known(error_budget(fit, data, data, remaining))
    assert not budget.remainder_is_chance
    assert square(budget, "remainder") == pytest.approx(0.5e-3**2, rel=0.1)
    assert budget.share("remainder").words.startswith("not explained: the robot errs more")
    assert lines_of([budget_block(budget)])[0].endswith("mm more than they explain")


def test_nothing_held_out_leaves_no_remainder() -> None:
    _, data = campaign("irb120", 40, 0.02e-3, 4)
    fit = identify(ROBOT, data, MODEL["geometric"])
    budget = known(error_budget(fit, data, data, None, expected_error(fit)))
    assert not budget.held_out
    assert {share.source for share in budget.shares} == {"instrument", "table", "repeatability", "model", "parameters"}
    assert budget.square == pytest.approx(sum(share.square or 0.0 for share in budget.shares))
    assert "mm, to expect at configurations like these" in lines_of([budget_block(budget)])[0]
    expected = expected_error(fit).overall
    assert sum(share.square or 0.0 for share in known(budget.workspace)) == pytest.approx(expected.mean**2, rel=0.6)


@pytest.mark.parametrize(("device", "count", "kind"), [("ballbar", 120, "length"), ("point", 60, "position")])
def test_lengths_and_positions_before_a_fixture_have_a_budget_too(device: str, count: int, kind: str) -> None:
    rng = np.random.default_rng(5)
    data = measured_with(named_device(device), ROBOT, truth_twin(ROBOT, "random", rng), count, rng)
    first, remaining = (
        data.of_configurations(range(3 * count // 4)),
        data.of_configurations(range(3 * count // 4, count)),
    )
    budget = known(error_budget(identify(ROBOT, first, MODEL["geometric"]), data, first, remaining))
    assert (budget.kind, budget.remainder_is_chance) == (kind, True)
    sigma = known(data.sigma)[0]
    assert square(budget, "instrument") == pytest.approx(sigma**2 * (1 if kind == "length" else 3))
    assert budget.share("table").square is None


def on_a_moving_table(noise: float) -> tuple[Dataset, Array]:
    """Return readings on a table that moves, with four noisy reference points, and where the targets truly are."""
    rng = np.random.default_rng(6)
    twin = truth_twin(ROBOT, "random", rng)
    data = measure(twin, ROBOT.random_configurations(80, rng), 0.0, rng)
    points = np.array([[0.6, 0.4, 0.1], [0.5, -0.4, 0.1], [-0.5, 0.3, 0.1], [-0.3, -0.5, 0.3]])
    turns = rotation_from_vector(1e-4 * rng.standard_normal((80, 3)))
    shifts = 0.2e-3 * rng.standard_normal((80, 3))
    seen = points @ np.swapaxes(turns, 1, 2) + shifts[:, None] + noise * rng.standard_normal((80, 4, 3))
    rows = data.configuration
    position = np.einsum("nij,nj->ni", turns[rows], data.position) + shifts[rows]
    beside = replace(
        data,
        targets=("a", "b", "c", "d"),
        configuration=np.repeat(np.arange(80), 4),
        target=np.tile(np.arange(4), 80),
        position=seen.reshape(-1, 3),
    )
    return replace(data, position=position, references=beside), data.position


def test_what_is_left_of_the_tables_motion_has_a_share() -> None:
    moving, true = on_a_moving_table(0.01e-3)
    still = without_table_motion(moving)
    motion = known(table_motion(still))
    off = still.position - true
    off -= off.mean(axis=0)  # where the points are on average is not known better than their mean
    assert motion.left == pytest.approx(float(np.mean(np.sum(off**2, axis=1))), rel=0.2)
    removed = np.sqrt(np.mean(np.sum((moving.position - still.position) ** 2, axis=1)))
    assert motion.removed == pytest.approx(removed, rel=1e-6)
    assert table_motion(replace(still, references=None)) is None
    still = without_table_motion(replace(moving, sigma=np.full(len(moving.target), 1e-6)))
    first, remaining = still.of_configurations(range(50)), still.of_configurations(range(50, 80))
    budget = known(error_budget(identify(ROBOT, first, MODEL["geometric"]), still, first, remaining))
    share = budget.share("table")
    assert known(share.square) > 10 * abs(square(budget, "instrument"))
    assert "after a motion of 0.51 mm" in share.words
    assert budget.removed is not None
