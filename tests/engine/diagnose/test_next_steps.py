"""What to do next is named first: on twins with one thing wrong each, on combinations, and where nothing is wrong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.engine.diagnose.test_approach_lag import ON_A_TRACK
from tests.expecting import known
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.calibration.result import Calibration
from truearm.checking.check import check
from truearm.checking.checking import DataCheck
from truearm.engine.base.errors import Notice
from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.curves import about_curves
from truearm.engine.diagnose.external_force import check_payload
from truearm.engine.diagnose.next_step import MOST, NextStep, most_useful_first
from truearm.engine.diagnose.next_steps import _after, _end, steps_after_check
from truearm.engine.diagnose.off_configurations import off_configurations
from truearm.engine.diagnose.unmodelled import LeftOver, explanation
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.fit import Fit, Status, identify
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


def with_entry_errors(data: Dataset, entry_errors: Sequence[tuple[int, int, float]]) -> Dataset:
    """Return data in which joints of configurations are written down wrong: index, joint from 1, and by how much."""
    joints = data.joints.copy()
    for c, joint, degrees in entry_errors:
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


def test_a_geometric_model_of_an_elastic_robot_is_told_that_joints_give_way() -> None:
    before, after = calibrated(elastic(), "geometric"), calibrated(elastic())
    step = before.next[0]
    assert (step.code, "every joint effect: compliance explains" in step.message) == ("other-model", True)
    old, new = (known(known(run.validation).position).mean for run in (before, after))
    assert step.gain == pytest.approx(old - new, rel=0.2)
    assert not any(other.code == "measure-again" for other in before.next)  # large where the arm sags, and not wrong
    assert before.summary()["next"] == [next_step.summary() for next_step in before.next]
    text = before.lines()
    place = text.index(step.line)
    assert text[place : place + len(before.next)] == [next_step.line for next_step in before.next]
    assert check("irb120", elastic()).summary()["next"][0]["code"] == "other-model"
    frames = first(elastic(), "frames")
    assert (frames.code, "`model=geometric`" in frames.message) == ("other-model", True)


def test_a_worn_wrist_is_told_by_its_effect() -> None:
    for worn, effects in (("hysteresis", ("approach",)), ("backlash", ("backlash", "clearance"))):
        step = first(elastic(worn=worn))
        assert step.code == "other-model", worn
        assert any(f": {name} explains" in step.message for name in effects), worn


def with_one_reading_off() -> Dataset:
    position = elastic().position.copy()
    position[3 * 20 + 1] += [0.0, 0.0, 2e-3]
    return replace(elastic(), position=position)


def test_what_is_off_is_named_with_how_far_and_is_no_instrument_that_moved() -> None:
    for data, words in (
        (
            with_entry_errors(elastic(), [(17, 3, 1.0)]),
            ["joint 3 of configuration 18 looks off by about 1 deg", "`without=18`"],
        ),
        (with_one_reading_off(), ["target 2 of configuration 21 is off by 2 mm"]),
        (shifted(elastic(), 20, 21, 3.0), ["configuration 21 is off by 3 mm"]),
        (shifted(elastic(), 30, 34, 1.0), ["Measure configurations 31 to 34 again", "`without=31,32,33,34`"]),
    ):
        run = calibrated(data)
        step = run.next[0]
        assert step.code == "measure-again", words
        assert all(part in step.message for part in words), step.message
        assert ("joint" in step.message) is words[0].startswith("joint")
        if words[0].startswith("joint"):
            assert not {n.code for n in run.warnings} & {"instrument-moved", "joint-zero-jumped", "drift"}
    step = first(elastic(poses=18))
    assert (step.code, "13 more" in step.message, step.gain is None) == ("measure-more", True, False)


def test_a_forgotten_payload_is_named_with_its_mass_and_missing_masses_are_asked_for() -> None:
    step = first(elastic(), payload=None)
    assert step.code == "give-payload"
    mass = float(step.message.split("about ")[1].split(" kg")[0])
    assert mass == pytest.approx(LOAD.mass, rel=0.5)
    assert "`payload`" in step.message
    other = first(elastic(), payload=Payload(0.3))
    assert other.code == "give-payload"
    assert other.message.startswith("Check what the robot carried")
    assert "instead of 0.3 kg" in other.message
    # a robot without masses is asked for them
    heavy = load_robot("irb120")
    rigid = replace(heavy, masses=())
    step = calibrate(rigid, elastic(), model="geometric").next[0]
    assert step.code == "give-loads"
    assert "masses" in step.message
    assert "`payload`" in step.message


def test_where_every_effect_is_in_the_model_another_payload_is_told_too() -> None:
    """Other effects take what the payload does; at the load that was given the arm is off."""
    for payload, said in ((LOAD, ""), (Payload(0.3), "instead of 0.3 kg")):
        run = calibrate("irb120", elastic(), model="auto", payload=payload)
        messages = [n.message for n in run.warnings if n.code == "payload-unlikely"]
        assert len(messages) == bool(said), (payload, messages)
        assert all(said in message and "Other effects make up for it" in message for message in messages)
        assert bool(messages) is any("payload-unlikely" in step.message for step in run.next)


def test_the_gain_of_every_effect_is_what_the_model_with_every_effect_gains() -> None:
    robot, rng = load_robot("irb120").with_payload(LOAD), np.random.default_rng(3)
    joints = {
        i: JointTruth(compliance=5.0 * c, bearing=2e-5, gear=((2, 2e-4, 0.3),), hysteresis=2e-4)
        for i, c in enumerate(SPRINGS, 1)
    }
    true = replace(truth_twin(robot, "random", rng), joints=joints)
    data = measure(true, robot.random_configurations(70, rng), NOISE, rng)
    runs = {model: calibrate(robot, data, model=model) for model in ("elastic", "auto")}
    elastic_error, error = (known(known(run.validation).position).mean for run in runs.values())
    (step,) = (step for step in runs["elastic"].next if step.code == "other-model")
    assert step.gain == pytest.approx(elastic_error - error, rel=0.15)
    assert "% of what is left, all together 8" in step.message


def test_payloads_that_no_arm_carries_are_doubted() -> None:
    irb120, katana = load_robot("irb120"), load_robot("katana450")
    assert irb120.rated_load == 3.0
    assert katana.rated_load is None
    for robot, payload, words in (
        (irb120, Payload(27.0), "is rated for 3 kg. Were grams called kilograms?"),
        (irb120, Payload(2.7, (0.0, 0.0, 100.0)), "lies 100 m from the flange"),
        (katana, Payload(500.0), "no arm of that size carries more"),
    ):
        (notice,) = check_payload(robot.with_payload(payload))
        assert (notice.code, notice.level) == ("payload-unlikely", "warning")
        assert words in notice.message
    for mass in (3.1, 6.0):
        (notice,) = check_payload(irb120.with_payload(Payload(mass, (0.1, 0.0, 0.3))))
        assert (notice.code, notice.level) == ("rated-load-exceeded", "warning")
        assert f"The payload is {mass:g} kg, and irb120 is rated for 3 kg." in notice.message
    for robot, payload in ((irb120, Payload(3.0, (0.1, 0.0, 0.3))), (katana, Payload(0.5, (0.0, 0.0, 0.1)))):
        assert check_payload(robot.with_payload(payload)) == []


@pytest.mark.parametrize("of_one", [False, True])
def test_a_wrong_sign_of_one_joint_is_named_and_no_other_joint(of_one: bool) -> None:
    data = campaign("irb120", 40, NOISE, 3)[1]
    if of_one:
        data = replace(data.of_readings(data.target == 0), targets=data.targets[:1])
    for index, joint in ((21, 4), (12, 5), (28, 2)):
        assert np.degrees(abs(data.joints[index, joint - 1])) > 5.0
        joints = data.joints.copy()
        joints[index, joint - 1] *= -1
        run = check("irb120", replace(data, joints=joints))
        (notice,) = run.warnings
        assert notice.code == "joints-mistaken"
        assert f"{index + 1} (joint {joint}) fit with the opposite sign of this joint" in notice.message
        message = said_next(run)
        assert f"the sign of joint {joint} of configuration {index + 1} looks wrong" in message
        assert "looks off" not in message


def said_next(run: DataCheck) -> str:
    return " ".join(step.message for step in run.next)


def test_a_joint_or_slide_that_is_off_by_far_is_named_with_how_far(tmp_path: Path) -> None:
    message = said_next(check("irb120", with_entry_errors(elastic(), [(17, 3, 40.0)])))
    assert "joint 3 of configuration 18 looks off by about 40 deg" in message
    (tmp_path / "track.yaml").write_text(ON_A_TRACK, encoding="utf-8")
    robot, rng = load_robot(tmp_path / "track.yaml"), np.random.default_rng(3)
    data = measure(truth_twin(robot, "random", rng), robot.random_configurations(40, rng), NOISE, rng)
    joints = data.joints.copy()
    joints[20, 0] += 0.05
    message = said_next(check(robot, replace(data, joints=joints)))
    assert "joint 1 of configuration 21 looks off by about 50 mm" in message


def test_no_joint_is_named_where_two_explain_the_readings_or_none_does() -> None:
    twin, data = campaign("irb120", 40, NOISE, 3)
    joints = data.joints.copy()
    joints[21, 4] = 0.0  # joints 4 and 6 turn about one axis
    straight = measure(twin, joints, 0.3e-3, np.random.default_rng(3))
    message = said_next(check("irb120", with_entry_errors(straight, [(21, 4, 10.0)])))
    assert "configuration 22 is off by" in message
    assert "joint 4" not in message
    message = said_next(check("irb120", with_entry_errors(data, [(10, 2, 15.0), (10, 5, -30.0)])))
    assert "configuration 11 is off by" in message
    assert "of configuration 11 looks off" not in message


def test_several_rows_are_found_behind_each_other_and_behind_the_wrong_model() -> None:
    rows = with_entry_errors(elastic(), [(7, 2, 1.0), (30, 5, -1.0), (55, 4, 1.0)])
    for model in ("elastic", "geometric"):
        step = first(rows, model)
        assert step.code == "measure-again"
        assert "`without=8,31,56`" in step.message
        for words in ("joint 2 of configuration 8", "joint 5 of configuration 31", "joint 4 of configuration 56"):
            assert words in step.message


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


def test_how_the_fit_ended_is_followed_up() -> None:
    run = calibrate("irb120", elastic(), model="elastic", payload=LOAD, train="all")
    assert [step.code for step in run.next] == ["hold-out"]
    units = {"length": "mm", "angle": "deg"}
    bounds = Bounds.model_validate({"truearm": "truearm-bounds/1", "units": units, "within": {"a_3": 0.01}})
    run = calibrate("irb120", elastic(), model="elastic", payload=LOAD, bounds=bounds)
    assert run.status is Status.AT_BOUND
    assert "widen-bound" in [step.code for step in run.next]
    run = calibrate(
        "irb120", simulate("irb120", truth="random", poses=40, device="plane", seed=3).data, model="geometric"
    )
    assert (run.status, run.next[0].code) == (Status.RANK_LOSS, "measure-more")
    assert run.fit.unobservable[0] in run.next[0].message


def test_a_check_says_what_comes_next() -> None:
    (cure, go_on) = steps_after_check([Notice("joints-not-settled", "Wait longer.")])
    assert (cure.code, go_on.code, "joints-not-settled" in cure.message) == ("see-warning", "calibrate", True)
    assert [step.code for step in steps_after_check([Notice("missing", "Gaps.", "note")])] == ["calibrate"]
    (fix,) = check("irb120", replace(elastic(), joints=np.degrees(elastic().joints))).next
    assert (fix.code, "unit-angle" in fix.message) == ("fix-data", True)
    _, rigid = campaign("irb120", 40, NOISE, 3)
    (good,) = check("irb120", rigid).next
    assert good.code == "calibrate"
    assert [step.code for step in check(rigid).next] == ["check-robot"]
    row, model = check("irb120", with_entry_errors(elastic(), [(17, 3, 1.0)])).next
    assert {row.code, model.code} == {"measure-again", "other-model"}
    again = row if row.code == "measure-again" else model
    assert "joint 3 of configuration 18" in again.message
    assert "without" not in again.message  # a check has no such parameter


def test_few_distances_explain_nothing() -> None:
    data = simulate("irb120", truth="random", poses=40, device="ballbar", seed=3).data
    run = calibrate("irb120", data, model="geometric")
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
    model, more = NextStep("other-model", "Add it.", 6e-4), NextStep("measure-more", "Measure more.", 6e-5)
    (step,) = _after([model], [more])  # more configurations come after a model that gains far more
    assert (step.code, step.message, step.gain) == ("measure-more", "After that: measure more.", None)
    assert _after([replace(model, gain=1e-4)], [more]) == _after([], [more]) == [more]


def test_what_is_left_out_is_left_out_of_everything() -> None:
    data = with_entry_errors(elastic(), [(17, 3, 1.0)])
    left = LeftOver.of(identify(load_robot("irb120").with_payload(LOAD), data, named_model("geometric")), data)
    off = off_configurations(left)
    assert 17 in off.indices
    assert off.left < 0.9
    remaining = left.without(off.indices)
    assert remaining.problem.data.configurations == data.configurations - len(off.indices)
    assert remaining.freedom == len(remaining.residual) - remaining.basis.shape[1]
    assert known(explanation(left, off.indices)).cause == "compliance"
    assert left.without(()) is left


def test_few_configurations_cannot_tell_errors_of_gears() -> None:
    data = simulate("irb120", truth="gear-errors", poses=25, noise=3e-5, seed=1).data
    for effects in ([], ["joint-curve"]):
        (step,) = calibrate("irb120", data, model="geometric", effects=effects).next
        assert step.code == "unexplained", effects
        assert "no effect known here explains" not in step.message
        assert "cannot be told from 18 training configurations: measure about 200" in step.message
    every = calibrate("irb120", elastic(), model="auto")  # other effects stand in for them, and for the payload
    assert "see-warning" in {step.code for step in every.next}
    assert "payload-unlikely" in {notice.code for notice in every.warnings}


def fitted(poses: int) -> Fit:
    return identify(load_robot("irb120").with_payload(LOAD), elastic(poses=poses), named_model("elastic"))


def test_too_few_readings_are_told_from_a_model_with_every_effect_and_from_curves(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data, fit = elastic(poses=14), fitted(14)
    assert "too few readings to tell" in _end(LeftOver.of(fit, data)).message
    every = replace(fit, model=replace(fit.model, name="auto", weighed=True))
    assert "every joint effect known here is in the model" in _end(LeftOver.of(every, data)).message
    monkeypatch.setattr("truearm.engine.diagnose.next_steps.has_curves", lambda _: True)
    message = _end(LeftOver.of(fit, data)).message
    assert "The curves leave too few equations" in message
    assert "too few readings" not in message


def test_what_is_not_known_of_curves_is_said() -> None:
    fit = fitted(20)
    curved = replace(fit, model=replace(fit.model, effects=("joint-curve",)))
    assert about_curves(fit, 20).startswith("Errors that follow a joint's angle")
    assert "compare with `effects=joint-curve`" in about_curves(fit, 20)
    assert about_curves(curved, 20).endswith("measure about 200.")
    assert "were not looked for" in about_curves(fit, 300)
    assert about_curves(curved, 300) == ""


@pytest.mark.parametrize("declared", [True, False])
def test_repeatability_and_noise_that_explain_all_are_the_end(declared: bool) -> None:
    data = elastic(poses=150, repeatability=0.003)
    run = calibrated(data if declared else replace(data, sigma=None))
    assert "unexplained" not in {step.code for step in run.next}
    (end,) = (step for step in run.next if step.code == "stop")
    assert "errors of the joints of 0.00" in end.message
