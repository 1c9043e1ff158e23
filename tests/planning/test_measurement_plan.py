"""Plans of measurements: what is chosen, what is refused, and whether the prediction comes true."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import MODELS
from truearm.engine.motion.constraints import Constraints
from truearm.engine.motion.ordering import short_order
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure
from truearm.planning import accuracy as prediction
from truearm.planning.accuracy import accuracy_goal, predict, sensitivity
from truearm.planning.choosing import APPROACH, MeasurementPlan, plan_measurements, random_candidates, with_targets
from truearm.planning.result import Plan

POLISHING = Path(__file__).parents[1] / "engine" / "programs" / "samples" / "rapid" / "polish.mod"
MODEL = {model.name: model for model in MODELS}


def planned_with(poses: int | None = 20, candidates: int = 300, **options: object) -> MeasurementPlan:
    rng = np.random.default_rng(0)
    arm = with_targets(load_robot("irb120"))
    return plan_measurements(
        arm,
        random_candidates(arm, candidates, rng),
        MODEL["geometric"],
        poses=poses,
        rng=rng,
        **options,  # type: ignore[arg-type]
    )


@pytest.fixture(scope="module")
def plan() -> MeasurementPlan:
    return planned_with()


@pytest.fixture
def few_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Judge plans at one number of poses alone: what other numbers would do takes most of the time."""
    monkeypatch.setattr(prediction, "NUMBERS", (30,))


def test_a_plan_is_better_than_chance_and_within_limits(plan: MeasurementPlan) -> None:
    arm = plan.robot
    low, high = np.array([joint.limits for joint in arm.joints]).T
    assert plan.joints.shape == (20, 6)
    assert len(set(plan.chosen.tolist())) == 20
    assert ((plan.joints >= low) & (plan.joints <= high)).all()
    predicted = plan.prediction
    assert (predicted.chosen < predicted.random).all()
    assert (np.diff(predicted.chosen) < 0).all()
    assert predicted.floor < predicted.planned < predicted.random[0]
    assert predicted.sufficient_number is not None
    assert predicted.chosen[predicted.numbers.tolist().index(predicted.sufficient_number)] <= 1.1 * predicted.floor


def test_every_joint_comes_from_below(plan: MeasurementPlan) -> None:
    low = np.array([joint.limits[0] for joint in plan.robot.joints if joint.limits])
    assert plan.before is not None
    step = plan.joints - plan.before
    inside = plan.joints - APPROACH["revolute"] >= low
    assert step[inside] == pytest.approx(APPROACH["revolute"])
    assert (step >= 0).all()
    assert (plan.before >= low).all()


def test_the_order_is_shorter_than_by_chance(plan: MeasurementPlan) -> None:
    def way(joints: np.ndarray) -> float:
        return float(np.abs(np.diff(joints, axis=0)).max(axis=1).sum())

    rng = np.random.default_rng(1)
    assert way(plan.joints) < 0.9 * min(way(rng.permutation(plan.joints)) for _ in range(50))
    points = np.array([[0.0], [3.0], [1.0], [2.0]])
    assert short_order(points).tolist() == [0, 2, 3, 1]


def test_what_cannot_be_told_apart_is_named(plan: MeasurementPlan) -> None:
    assert {"d_3", "theta_offset_1", "theta_offset_6"} <= set(plan.left_out)  # against d_2, base and targets
    assert "theta_offset_2" not in plan.left_out


@pytest.mark.usefixtures("few_numbers")
def test_each_objective_is_best_by_its_own_measure() -> None:
    plans = {name: planned_with(candidates=80, objective=name) for name in ("O1", "O3", "O5")}
    for name, plan in plans.items():
        assert plan.indices[name] == max(other.indices[name] for other in plans.values())


def test_the_same_seed_gives_the_same_plan(plan: MeasurementPlan) -> None:
    again = planned_with()
    assert np.array_equal(plan.joints, again.joints)
    summary, summary_again = (Plan(planned, "").summary() | {"seconds": 0} for planned in (plan, again))
    assert summary == summary_again


@pytest.mark.usefixtures("few_numbers")
def test_constraints_are_counted_and_kept() -> None:
    rules = Constraints.model_validate(
        {
            "truearm": "truearm-constraints/1",
            "units": {"length": "mm", "angle": "deg"},
            "moments": {2: "positive"},
            "floor": 0,
        }
    )
    plan = planned_with(constraints=rules)
    assert set(plan.rejected) == {"limits", "moment_2", "floor"}
    assert plan.rejected["limits"] == 0
    assert (
        plan.candidates - sum(plan.rejected.values()) <= plan.usable < plan.candidates - plan.rejected["moment_2"] + 1
    )
    tight = rules.model_copy(update={"floor": 900.0})
    with pytest.raises(InputError, match=r"(?s)too few.*rejected by moment_2 \d+, floor \d\d\d"):
        planned_with(constraints=tight)


@pytest.mark.usefixtures("few_numbers")
def test_auto_takes_eleven_or_more() -> None:
    plan = planned_with(poses=None, candidates=60)
    assert 11 <= len(plan.joints) <= 60
    assert plan.indices["O1"] >= planned_with(poses=11, candidates=60).indices["O1"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"poses": 0}, "at least one pose"),
        ({"poses": 301}, "too few.*300 of 300.*301 or more"),
        ({"poses": 2}, "fewer equations.*4 or more"),
        ({"objective": "O6"}, "no objective of this name.*O1, O2"),
        ({"objective": "error"}, "nothing was said of where the error shall be small"),
        ({"objective": "O3", "poses": None}, "only O1 can choose"),
    ],
)
def test_what_cannot_be_planned_is_refused(options: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=f"(?s){words}"):
        planned_with(**options)  # type: ignore[arg-type]


def test_a_temperature_is_in_no_plan() -> None:
    arm = with_targets(load_robot("irb120"))
    model = replace(MODEL["geometric"], effects=("thermal-growth",))
    rng = np.random.default_rng(0)
    with pytest.raises(InputError, match="temperature"):
        plan_measurements(arm, random_candidates(arm, 50, rng), model, poses=20, rng=rng)


def test_a_growth_of_zero_needs_no_temperature() -> None:
    """A calibration of every effect has it where a temperature was recorded, and finds it to be zero."""
    arm = with_targets(load_robot("irb120")).with_effects(["thermal-growth"])
    rng = np.random.default_rng(0)
    candidates = random_candidates(arm, 5, rng)
    assert sensitivity(arm, candidates, MODEL["geometric"].free(arm), 1e-4).rows.any()
    grown = arm.with_values({"thermal_growth_3": 1e-5})
    with pytest.raises(InputError, match="temperature"):
        sensitivity(grown, candidates, MODEL["geometric"].free(grown), 1e-4)


def test_a_robot_without_targets_tells_nothing() -> None:
    rng, arm = np.random.default_rng(0), load_robot("irb120")
    with pytest.raises(InputError, match="no targets"):
        sensitivity(arm, random_candidates(arm, 5, rng), MODEL["geometric"].free(arm), 1e-4)


@pytest.mark.usefixtures("few_numbers")
def test_where_the_robot_stands_does_not_matter() -> None:
    arm = with_targets(load_robot("irb120"))
    away = truth_twin(load_robot("irb120"), "nominal", np.random.default_rng(0)).robot
    rng = np.random.default_rng(0)
    q = random_candidates(arm, 200, rng)
    plans = [
        plan_measurements(robot, q, MODEL["geometric"], poses=15, rng=np.random.default_rng(1)) for robot in (arm, away)
    ]
    assert plans[0].indices["O1"] == pytest.approx(plans[1].indices["O1"], rel=0.01)


def test_the_predicted_error_comes_true() -> None:
    """Against calibrations of twins whose readings hang together as the prediction says."""
    noise, errors = 1e-4, []
    nominal = load_robot("irb120")
    for seed in range(12):
        rng = np.random.default_rng(seed)
        twin = truth_twin(nominal, "random", rng)
        data = measure(twin, nominal.random_configurations(15, rng), 0.0, rng)
        common = np.repeat(rng.normal(size=(15, 3)), 3, axis=0)
        jitter = noise * (np.sqrt(0.75) * common + np.sqrt(0.25) * rng.normal(size=(45, 3)))
        fit = identify(nominal, replace(data, position=data.position + jitter), MODEL["geometric"])
        q = nominal.random_configurations(40, rng)
        seen = [fit.robot.world_poses(q, name)[0] - twin.robot.world_poses(q, name)[0] for name in data.targets]
        errors.append(np.linalg.norm(np.stack(seen) + noise * rng.normal(size=(3, 40, 3)), axis=2).mean())
    arm = with_targets(nominal)
    rng = np.random.default_rng(1)
    candidates = random_candidates(arm, 15, rng), random_candidates(arm, 200, rng)
    measured, elsewhere = (sensitivity(arm, postures, MODEL["geometric"].free(arm), noise) for postures in candidates)
    predicted = predict(arm, measured, np.arange(15), elsewhere, candidates[1].joints, noise, rng)
    assert predicted.planned == pytest.approx(np.mean(errors), rel=0.1)
    assert predicted.planned > 1.1 * predicted.floor


@pytest.mark.usefixtures("few_numbers")
def test_configurations_chosen_for_a_program_on_ten_robots() -> None:
    """30 chosen for a program against 30 chosen by O1: the true error at its targets."""
    nominal, model = load_robot("irb120"), MODEL["geometric"]
    arm, rng = with_targets(nominal), np.random.default_rng(0)
    goal = accuracy_goal(nominal, POLISHING, None, None, None, rng)
    assert goal is not None
    at, targets = goal.postures, goal.postures.joints
    plans = {
        objective: plan_measurements(
            arm,
            random_candidates(arm, 1500, np.random.default_rng(1)),
            model,
            poses=30,
            rng=rng,
            objective=objective,
            accurate_at=at,
        )
        for objective in ("O1", "error")
    }
    ratios = []
    for seed in range(10):
        twin = truth_twin(nominal, "random", np.random.default_rng(seed))
        error = dict.fromkeys(plans, 0.0)
        true = [twin.robot.world_poses(targets, name)[0] for name in ("1", "2", "3")]
        for objective, plan in plans.items():
            for campaign in range(3):
                data = measure(twin, plan.joints, 1e-4, np.random.default_rng(100 * campaign + seed))
                fit = identify(nominal, data, model).robot
                positions = [fit.world_poses(targets, name)[0] for name in data.targets]
                error[objective] += float(np.linalg.norm(np.array(positions) - true, axis=2).mean())
        ratios.append(error["error"] / error["O1"])
    at_targets = plans["error"].prediction.there
    assert at_targets is not None
    assert at_targets.by_o1 is not None
    assert float(at_targets.error.mean() / at_targets.by_o1.mean()) <= 0.8
    assert np.median(ratios) <= 0.8
    assert plans["O1"].prediction.there is not None
    assert plans["O1"].prediction.there.error.mean() == pytest.approx(at_targets.by_o1.mean())
