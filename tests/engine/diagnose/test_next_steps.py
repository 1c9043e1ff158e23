"""What to do next is named first: on twins with one thing wrong each, on combinations, and where nothing is wrong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.engine.diagnose.test_arrival_lag import ON_A_TRACK
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.calibration.result import Calibration
from truearm.checking.check import check
from truearm.engine.base.errors import Notice
from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.curves import about_curves
from truearm.engine.diagnose.next_step import MOST, NextStep, most_useful_first
from truearm.engine.diagnose.next_steps import _after, _end, steps_after_check
from truearm.engine.diagnose.off_configurations import off_configurations
from truearm.engine.diagnose.unmodelled import LeftOver, explanation
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.fit import Status, identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import JointTruth
from truearm.simulation.jobs import simulate

NOISE, POSES = 0.02e-3, 60
LOAD = Payload(2.0, (0.02, -0.01, 0.08))
#: A joint of the twin gives way by so much [rad/(N m)].
SPRINGS = (6e-6, 1.2e-5, 1.5e-5, 3e-5, 4e-5, 5e-5)


@cache
def elastic(robot: str = "irb120", poses: int = POSES, worn: str = "", repeatability: float = 0.0) -> Dataset:
    """Return what is read of an arm that gives way, with an unknown repeatability [deg] and a worn joint 5."""
    rng = np.random.default_rng(5)
    nominal = load_robot(robot)
    true = truth_twin(nominal, "random", rng).robot.with_payload(LOAD)
    joints = {i: JointTruth(compliance=c) for i, c in enumerate(SPRINGS, 1)}
    size = 8e-4
    if worn == "hysteresis":
        joints[5] = replace(joints[5], hysteresis=size)
    elif worn == "backlash":
        joints[5] = replace(joints[5], backlash=size)
    q = nominal.random_configurations(poses, rng)
    reached = q + np.radians(repeatability) * rng.standard_normal(q.shape)
    return replace(measure(Twin(true, joints), reached, NOISE, rng), joints=q)


def slipped(data: Dataset, slips: Sequence[tuple[int, int, float]]) -> Dataset:
    """Return data in which joints of configurations are written down wrong: index, joint from 1, and by how much."""
    joints = data.joints.copy()
    for c, joint, degrees in slips:
        joints[c, joint - 1] += np.radians(degrees)
    return replace(data, joints=joints)


def shifted(data: Dataset, first: int, last: int, millimetres: float) -> Dataset:
    moved = (data.configuration >= first) & (data.configuration < last)
    shift = np.array([0.0, millimetres * 1e-3, 0.0])
    return replace(data, position=np.where(moved[:, None], data.position + shift, data.position))


def calibrated(data: Dataset, model: str = "elastic", payload: Payload | None = LOAD) -> Calibration:
    return calibrate("irb120", data, model=model, payload=payload)


def first(data: Dataset, model: str = "elastic", payload: Payload | None = LOAD) -> NextStep:
    return calibrated(data, model, payload).next[0]


def test_at_the_noise_it_says_stop() -> None:
    (step,) = calibrated(elastic()).next
    assert (step.code, step.gain) == ("stop", None)
    assert "is the instrument's noise" in step.message
    unknown = first(replace(elastic(), sigma=None))
    assert unknown.code == "stop"
    assert "looks like the instrument's noise" in unknown.message


def test_a_geometric_model_of_an_elastic_robot_is_told_to_be_elastic() -> None:
    before, after = calibrated(elastic(), "geometric"), calibrated(elastic())
    step = before.next[0]
    assert step.code == "other-model"
    assert "`model=elastic`" in step.message
    assert before.validation is not None
    assert after.validation is not None
    old, new = before.validation.position, after.validation.position
    assert old is not None
    assert new is not None
    assert step.gain == pytest.approx(old.mean - new.mean, rel=0.2)
    assert not any(other.code == "measure-again" for other in before.next)  # large where the arm sags, and not wrong


def test_a_forgotten_payload_is_named_with_its_mass() -> None:
    step = first(elastic(), payload=None)
    assert step.code == "give-payload"
    told = float(step.message.split("about ")[1].split(" kg")[0])
    assert told == pytest.approx(LOAD.mass, rel=0.5)
    assert "`payload`" in step.message
    other = first(elastic(), payload=Payload(0.3))
    assert other.code == "give-payload"
    assert other.message.startswith("Check what the robot carried")
    assert "instead of 0.3 kg" in other.message


@pytest.mark.parametrize(("worn", "effects"), [("hysteresis", ("approach",)), ("backlash", ("backlash", "clearance"))])
def test_a_worn_wrist_is_told_by_its_effect(worn: str, effects: tuple[str, ...]) -> None:
    step = first(elastic(worn=worn))
    assert step.code == "other-model"
    assert any(f"`effects={name}`" in step.message for name in effects)


def test_too_few_configurations_are_told_where_to_measure_more() -> None:
    step = first(elastic(poses=18))
    assert step.code == "measure-more"
    assert "13 more" in step.message
    assert step.gain is not None


def test_a_joint_that_was_written_down_wrong_is_named() -> None:
    run = calibrated(slipped(elastic(), [(17, 3, 1.0)]))
    step = run.next[0]
    assert step.code == "measure-again"
    assert "joint 3 of configuration 18 looks off by about 1 deg" in step.message
    assert "`without=18`" in step.message
    # One row that is far off does not look like an instrument that moved.
    assert not any(notice.code in ("instrument-moved", "joint-zero-jumped", "drift") for notice in run.warnings)


@pytest.mark.parametrize("of_one", [False, True])
@pytest.mark.parametrize(("index", "joint"), [(21, 4), (12, 5), (28, 2)])
def test_a_wrong_sign_of_one_joint_is_named_and_no_other_joint(index: int, joint: int, of_one: bool) -> None:
    data = campaign("irb120", 40, NOISE, 3)[1]
    if of_one:
        data = replace(data.of_readings(data.target == 0), targets=data.targets[:1])
    size = np.degrees(abs(data.joints[index, joint - 1]))
    assert size > 5.0
    joints = data.joints.copy()
    joints[index, joint - 1] *= -1
    run = check("irb120", replace(data, joints=joints))
    (notice,) = run.warnings
    assert notice.code == "joints-mistaken"
    assert f"{index + 1} (joint {joint}) fit with the opposite sign of this joint" in notice.message
    said = " ".join(step.message for step in run.next)
    assert f"the sign of joint {joint} of configuration {index + 1} looks wrong" in said
    assert "looks off" not in said


def test_a_joint_that_is_off_by_far_is_named_with_how_far() -> None:
    run = check("irb120", slipped(elastic(), [(17, 3, 40.0)]))
    assert "joint 3 of configuration 18 looks off by about 40 deg" in " ".join(step.message for step in run.next)


def test_a_slide_that_is_off_is_named_in_mm(tmp_path: Path) -> None:
    (tmp_path / "track.yaml").write_text(ON_A_TRACK, encoding="utf-8")
    robot, rng = load_robot(tmp_path / "track.yaml"), np.random.default_rng(3)
    data = measure(truth_twin(robot, "random", rng), robot.random_configurations(40, rng), NOISE, rng)
    joints = data.joints.copy()
    joints[20, 0] += 0.05
    said = " ".join(step.message for step in check(robot, replace(data, joints=joints)).next)
    assert "joint 1 of configuration 21 looks off by about 50 mm" in said


def test_no_joint_is_named_where_two_explain_the_readings_or_none_does() -> None:
    twin, data = campaign("irb120", 40, NOISE, 3)
    joints = data.joints.copy()
    joints[21, 4] = 0.0  # joints 4 and 6 turn about one axis
    straight = measure(twin, joints, 0.3e-3, np.random.default_rng(3))
    said = " ".join(step.message for step in check("irb120", slipped(straight, [(21, 4, 10.0)])).next)
    assert "configuration 22 is off by" in said
    assert "joint 4" not in said
    two = slipped(data, [(10, 2, 15.0), (10, 5, -30.0)])
    said = " ".join(step.message for step in check("irb120", two).next)
    assert "configuration 11 is off by" in said
    assert "of configuration 11 looks off" not in said


def test_several_rows_are_found_behind_each_other_and_behind_the_wrong_model() -> None:
    rows = slipped(elastic(), [(7, 2, 1.0), (30, 5, -1.0), (55, 4, 1.0)])
    for model in ("elastic", "geometric"):
        step = first(rows, model)
        assert step.code == "measure-again"
        assert "`without=8,31,56`" in step.message
        for words in ("joint 2 of configuration 8", "joint 5 of configuration 31", "joint 4 of configuration 56"):
            assert words in step.message


def test_one_reading_that_is_off_is_no_joint() -> None:
    data = elastic()
    position = data.position.copy()
    position[3 * 20 + 1] += [0.0, 0.0, 2e-3]
    step = first(replace(data, position=position))
    assert step.code == "measure-again"
    assert "target 2 of configuration 21 is off by 2 mm" in step.message


def test_readings_that_no_joint_explains_are_named_with_how_far_they_are_off() -> None:
    step = first(shifted(elastic(), 20, 21, 3.0))
    assert "configuration 21 is off by 3 mm" in step.message
    assert "joint" not in step.message


def test_configurations_in_a_row_moved_together() -> None:
    run = calibrated(shifted(elastic(), 30, 34, 1.0))
    assert "Measure configurations 31 to 34 again" in run.next[0].message
    assert "`without=31,32,33,34`" in run.next[0].message


def test_a_tracker_that_moved_is_named_with_its_configuration() -> None:
    run = calibrated(shifted(elastic(), 40, POSES, 0.5))
    assert run.next[0].code == "instrument-moved"
    assert "`base_changes=41`" in run.next[0].message
    both = calibrated(shifted(elastic(), 40, POSES, 0.5), "geometric").next
    assert {step.code for step in both[:2]} == {"instrument-moved", "other-model"}


def test_what_no_effect_explains_is_not_called_noise() -> None:
    run = calibrated(elastic(repeatability=0.02))
    assert run.next[0].code in ("unexplained", "measure-more")
    assert not any(step.code == "stop" for step in run.next)
    undeclared = calibrated(replace(elastic(poses=90, repeatability=0.02), sigma=None))
    assert not any(step.code == "stop" for step in undeclared.next)


def test_a_robot_without_masses_is_asked_for_them() -> None:
    heavy = load_robot("irb120")
    rigid = replace(heavy, masses=())
    step = calibrate(rigid, elastic(), model="geometric").next[0]
    assert step.code == "give-loads"
    assert "masses" in step.message
    assert "`payload`" in step.message


def test_frames_alone_are_told_what_geometry_gains() -> None:
    step = first(elastic(), "frames")
    assert step.code == "other-model"
    assert "`model=geometric`" in step.message


def test_errors_of_the_data_come_before_everything() -> None:
    data = elastic()
    steps = check("irb120", replace(data, joints=np.degrees(data.joints))).next
    assert [step.code for step in steps] == ["mend-data"]
    assert "unit-angle" in steps[0].message


def test_nothing_held_out_is_followed_up() -> None:
    run = calibrate("irb120", elastic(), model="elastic", payload=LOAD, train="all")
    assert [step.code for step in run.next] == ["hold-out"]


def test_a_value_at_a_bound_is_followed_up() -> None:
    units = {"length": "mm", "angle": "deg"}
    bounds = Bounds.model_validate({"truearm": "truearm-bounds/1", "units": units, "within": {"a_3": 0.01}})
    run = calibrate("irb120", elastic(), model="elastic", payload=LOAD, bounds=bounds)
    assert run.status is Status.AT_BOUND
    assert "widen-bound" in [step.code for step in run.next]


def test_rank_loss_asks_for_what_is_not_determined() -> None:
    run = calibrate("irb120", simulate("irb120", truth="random", poses=40, device="plane", seed=3).data)
    assert run.status is Status.RANK_LOSS
    assert run.next[0].code == "measure-more"
    assert run.fit.unobservable[0] in run.next[0].message


def test_warnings_are_pointed_to() -> None:
    (cure, go_on) = steps_after_check([Notice("joints-not-settled", "Wait longer.")])
    assert (cure.code, go_on.code) == ("see-warning", "calibrate")
    assert "joints-not-settled" in cure.message
    assert [step.code for step in steps_after_check([Notice("missing", "Gaps.", "note")])] == ["calibrate"]


def test_a_check_says_what_comes_next() -> None:
    _, rigid = campaign("irb120", 40, NOISE, 3)
    (good,) = check("irb120", rigid).next
    assert good.code == "calibrate"
    assert [step.code for step in check(rigid).next] == ["check-robot"]
    row, model = check("irb120", slipped(elastic(), [(17, 3, 1.0)])).next
    assert {row.code, model.code} == {"measure-again", "other-model"}
    again = row if row.code == "measure-again" else model
    assert "joint 3 of configuration 18" in again.message
    assert "without" not in again.message  # a check has no such parameter


def test_few_distances_explain_nothing() -> None:
    data = simulate("irb120", truth="random", poses=40, device="ballbar", seed=3).data
    run = calibrate("irb120", data)
    assert not any(step.code == "other-model" for step in run.next)
    assert not any("no effect" in step.message for step in run.next)


def test_steps_are_ordered_by_their_gain_and_three_at_most() -> None:
    steps = [NextStep("a", "A."), NextStep("b", "B.", 1e-5), NextStep("c", "C.", 2.04e-4), NextStep("d", "D.")]
    ordered = most_useful_first(steps)
    assert [step.code for step in ordered] == ["c", "b", "a"]
    assert len(ordered) == MOST
    assert ordered[0].line == "Next (c): C. Expected gain: 0.2 mm."
    assert ordered[0].summary() == {"code": "c", "message": "C.", "gain_mm": 0.2}
    assert ordered[2].summary()["gain_mm"] is None


def test_the_record_holds_the_steps() -> None:
    run = calibrated(elastic(), "geometric")
    assert run.summary()["next"] == [step.summary() for step in run.next]
    text = run.lines()
    place = text.index(run.next[0].line)
    assert text[place : place + len(run.next)] == [step.line for step in run.next]
    assert check("irb120", elastic()).summary()["next"][0]["code"] == "other-model"


def test_what_is_left_out_is_left_out_of_everything() -> None:
    data = slipped(elastic(), [(17, 3, 1.0)])
    left = LeftOver.of(identify(load_robot("irb120").with_payload(LOAD), data, named_model("geometric")), data)
    off = off_configurations(left)
    assert 17 in off.indices
    assert off.left < 0.9
    rest = left.without(off.indices)
    assert rest.problem.data.configurations == data.configurations - len(off.indices)
    assert rest.freedom == len(rest.residual) - rest.basis.shape[1]
    found = explanation(left, off.indices)
    assert found is not None
    assert found.cause == "compliance"
    assert left.without(()) is left


def test_a_choice_that_tried_everything_does_not_say_that_nobody_can_tell() -> None:
    data = elastic(poses=14)
    fit = identify(load_robot("irb120").with_payload(LOAD), data, named_model("elastic"))
    few = _end(LeftOver.of(fit, data)).message
    assert "too few readings to tell" in few
    tried = replace(fit, model=replace(fit.model, name="auto", tried=("backlash",)))
    assert "cross-validation found no other joint effect" in _end(LeftOver.of(tried, data)).message


@pytest.mark.parametrize(("model", "effects"), [("geometric", ()), ("geometric", ("joint-curve",)), ("auto", ())])
def test_few_configurations_cannot_tell_errors_of_gears(model: str, effects: tuple[str, ...]) -> None:
    data = simulate("irb120", truth="gear-errors", poses=25, noise=3e-5, seed=1).data
    (step,) = calibrate("irb120", data, model=model, effects=list(effects)).next
    assert step.code == "unexplained"
    assert "no effect known here explains" not in step.message
    assert "cannot be told from 18 training configurations: measure about 200" in step.message


def test_what_is_not_known_of_curves_is_said() -> None:
    data = elastic(poses=20)
    fit = identify(load_robot("irb120").with_payload(LOAD), data, named_model("elastic"))
    tried = replace(fit, model=replace(fit.model, tried=("joint-curve",)))
    curved = replace(fit, model=replace(fit.model, effects=("joint-curve",)))
    assert about_curves(fit, 20).startswith("Errors that follow a joint's angle")
    assert about_curves(tried, 20).startswith("Cross-validation left `joint-curve` out, but errors")
    assert "were not looked for" in about_curves(fit, 300)
    assert "tried `joint-curve` and left it out" in about_curves(tried, 300)
    assert about_curves(curved, 300) == ""


def test_more_configurations_come_after_a_model_that_gains_far_more() -> None:
    model, more = NextStep("other-model", "Add it.", 6e-4), NextStep("measure-more", "Measure more.", 6e-5)
    (step,) = _after([model], [more])
    assert (step.code, step.message, step.gain) == ("measure-more", "After that: measure more.", None)
    assert _after([replace(model, gain=1e-4)], [more]) == [more]
    assert _after([], [more]) == [more]


def test_curves_that_leave_few_equations_are_no_lack_of_readings(monkeypatch: pytest.MonkeyPatch) -> None:
    data = elastic(poses=14)
    fit = identify(load_robot("irb120").with_payload(LOAD), data, named_model("elastic"))
    monkeypatch.setattr("truearm.engine.diagnose.next_steps.has_curves", lambda _: True)
    said = _end(LeftOver.of(fit, data)).message
    assert "The curves leave too few equations" in said
    assert "too few readings" not in said
