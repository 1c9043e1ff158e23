"""Joint effects found in simulated data, and what a fit says about those it cannot know."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.simulated import campaign

from truearm.engine.base.errors import InputError
from truearm.engine.data.checks import check_data
from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.advice import check_fit
from truearm.engine.diagnose.expected_error import expected_error
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import MODELS, Model
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure
from truearm.engine.twin.twin_joint import JointTruth

MODEL = {model.name: model for model in MODELS}
TOOL = Payload(2.7, (0.05, 0.025, 0.1))
COMPLIANCE = {2: 0.032e-3, 3: 0.130e-3, 4: 0.605e-3, 5: 0.419e-3, 6: 0.647e-3}
IRB120 = load_robot("irb120").with_payload(TOOL)


def bending_data(poses: int) -> Dataset:
    """Return readings of an IRB 120 that gives way under its tool."""
    return campaign("irb120", poses, 3e-5, 1, "tracker-triangular")[1]


def tilted(truth: JointTruth) -> Dataset:
    """Return readings of an IRB 120 all of whose joints do what the truth says."""
    rng = np.random.default_rng(4)
    twin = truth_twin(load_robot("irb120"), "tracker-triangular", rng)
    twin = replace(twin, joints=dict.fromkeys(range(1, 7), truth))
    return measure(twin, IRB120.random_configurations(50, rng), 3e-5, rng)


def messages_of(fit: Fit) -> dict[str, str]:
    return {notice.code: notice.message for notice in check_fit(fit, expected_error(fit))}


def test_compliance_is_that_of_the_twin_and_the_vertical_axis_is_named() -> None:
    fit = identify(IRB120, bending_data(50), MODEL["elastic"])
    for number, true in COMPLIANCE.items():
        parameter = fit.robot.parameters[f"compliance_{number}"]
        assert parameter.deviation is not None
        assert parameter.deviation < 0.2 * true
        assert abs(parameter.value - true) < 4 * parameter.deviation
    notices = messages_of(fit)
    assert notices["effects-uninformed"].startswith("The data say nothing about compliance_1. Either nothing loads")
    assert not {"no-loads", "negative-effect", "too-many-effects"} & set(notices)
    assert fit.parameter_status("compliance_1") == "uninformed"
    assert fit.robot.values["compliance_1"] == pytest.approx(0.0, abs=1e-6)


def test_dropped_effects_are_named_too() -> None:
    fit = identify(IRB120, bending_data(50), MODEL["elastic"], redundancy="drop")
    assert "compliance_1" in [r.dropped for r in fit.redundancies]
    assert "compliance_1" in messages_of(fit)["effects-uninformed"]
    assert fit.robot.values["compliance_1"] == 0.0


def test_a_robot_without_masses_is_told_so() -> None:
    data = bending_data(15)
    weightless = replace(load_robot("irb120"), masses=())
    notices = messages_of(identify(weightless, data, MODEL["elastic"]))
    assert "no link masses and no payload" in notices["no-loads"]
    assert "`payload`" in notices["no-loads"]
    assert "effects-uninformed" not in notices
    assert "no-loads" not in messages_of(identify(weightless.with_payload(TOOL), data, MODEL["elastic"]))
    assert "no-loads" not in messages_of(identify(weightless, data, MODEL["joints"]))


def test_more_effects_than_the_data_can_carry() -> None:
    for model, few, enough in (("full", 12, 60), ("tilting", 6, 30)):
        fit = identify(IRB120, bending_data(few), MODEL[model])
        notices = messages_of(fit)
        effects = [p for effect in fit.robot.effects for p in effect.parameters]
        assert notices["too-many-effects"].startswith(f"Of {len(effects)} parameters of joint effects, ")
        assert "effects-uninformed" in notices
        assert "too-many-effects" not in messages_of(identify(IRB120, bending_data(enough), MODEL[model])), model


def test_loads_of_the_wrong_sign_come_out_as_negative_springs() -> None:
    data = bending_data(50)
    message = messages_of(identify(IRB120.with_payload(gravity=(0.0, 0.0, 9.81)), data, MODEL["elastic"]))[
        "negative-effect"
    ]
    assert "compliance_2, compliance_3" in message
    assert "masses, payload or gravity may be wrong" in message
    assert "negative-effect" not in messages_of(identify(IRB120, data, MODEL["tilting"]))


def test_negative_springs_and_plays_are_told() -> None:
    for effect, truth, named in (
        ("bearing-compliance", JointTruth(bearing=-3e-5), "bearing_compliance_2, bearing_compliance_4"),
        ("clearance", JointTruth(clearance=-1e-3), "clearance_1, clearance_2, clearance_3"),
        ("clearance-linear-contact", JointTruth(clearance=-1e-3), "clearance_1, clearance_2, clearance_3"),
        ("backlash", JointTruth(backlash=-2e-3), "backlash_2, backlash_3"),
    ):
        fit = identify(IRB120, tilted(truth), MODEL["elastic"].also([effect]))
        assert named in messages_of(fit)["negative-effect"], effect


def test_a_negative_sum_is_told_where_neither_of_two_is_known() -> None:
    # The axes of joints 5 and 6 cross: what bears one of them and what bears the other move the tool in the same way.
    fit = identify(IRB120, tilted(JointTruth(bearing=-6e-5)), MODEL["elastic"].also(["bearing-compliance"]))
    for number in (5, 6):
        bearing = fit.robot.parameters[f"bearing_compliance_{number}"]
        assert bearing.deviation is not None
        assert -bearing.value < 2.0 * bearing.deviation
    assert "the sum of bearing_compliance_5 and bearing_compliance_6 came out" in messages_of(fit)["negative-effect"]
    positive = identify(IRB120, tilted(JointTruth(bearing=6e-5)), MODEL["elastic"].also(["bearing-compliance"]))
    assert "bearing" not in messages_of(positive).get("negative-effect", "")


def test_growth_is_found_by_the_temperature() -> None:
    rng = np.random.default_rng(3)
    twin = truth_twin(load_robot("irb120"), "random", rng)
    twin = replace(twin, joints={number: JointTruth(growth=23e-6) for number in range(1, 7)})
    joints = IRB120.random_configurations(60, rng)
    data = measure(twin, joints, 2e-5, rng, temperature=np.linspace(18.0, 34.0, 60))
    model = Model("warm", "", MODEL["geometric"].groups, ("thermal-growth",))
    fit = identify(IRB120, data, model)
    for number in (3, 4):
        growth = fit.robot.parameters[f"thermal_growth_{number}"]
        assert growth.deviation is not None
        assert growth.deviation < 6e-6
        assert growth.value == pytest.approx(23e-6, abs=3 * growth.deviation)
    plain = identify(IRB120, data, MODEL["geometric"])
    assert fit.excess == 1.0
    assert plain.excess > 1.2
    with pytest.raises(InputError, match=r"thermal-growth needs the temperature of the arm.*temperature \[degC\]"):
        identify(IRB120, replace(data, temperature=None), model)


def test_a_pull_at_the_flange_turns_the_vertical_axis() -> None:
    rng = np.random.default_rng(4)
    twin = truth_twin(load_robot("irb120"), "tracker-triangular", rng)
    twin = replace(twin, joints={**twin.joints, 1: JointTruth(0.1e-3)})
    wrench = np.column_stack([rng.uniform(-30, 30, (60, 2)), np.zeros((60, 4))])
    data = measure(twin, IRB120.random_configurations(60, rng), 3e-5, rng, wrench=wrench)
    fit = identify(IRB120, data, MODEL["elastic"])
    assert fit.robot.values["compliance_1"] == pytest.approx(0.1e-3, rel=0.1)
    assert "effects-uninformed" not in messages_of(fit)


def test_bounds_on_effects_are_in_the_units_that_are_shown() -> None:
    entries = {"truearm": "truearm-bounds/1", "units": {"length": "m", "angle": "rad"}}
    bounds = Bounds.model_validate(
        {
            **entries,
            "within": {"compliance_2": 0.01, "backlash": math.radians(0.02)},
            "between": {"compliance_3": [0.0, 0.1]},
        }
    )
    fit = identify(IRB120, bending_data(30), MODEL["tilting"], bounds=bounds)
    assert fit.robot.values["compliance_2"] == pytest.approx(0.01e-3)
    assert fit.robot.values["compliance_3"] == pytest.approx(0.1e-3)
    assert all(abs(fit.robot.values[f"backlash_{i}"]) <= math.radians(0.02) + 1e-12 for i in range(1, 7))


def test_effects_that_no_model_frees_are_told() -> None:
    geared = IRB120.with_effects(["bearing-compliance"])
    message = messages_of(identify(geared, bending_data(30), MODEL["elastic"]))["effects-idle"]
    assert "bearing-compliance with all values zero" in message
    assert "`effects=bearing-compliance`" in message
    assert "effects-idle" not in messages_of(
        identify(geared, bending_data(30), MODEL["elastic"].also(["bearing-compliance"]))
    )
    known = geared.with_values({"bearing_compliance_2": 1e-5})
    assert "effects-idle" not in messages_of(identify(known, bending_data(30), MODEL["elastic"]))


def test_temperatures_of_no_arm_are_told() -> None:
    for warmth, is_reported in (((18.0, 31.0), False), ((291.0, 304.0), True)):
        data = replace(bending_data(20), temperature=np.linspace(*warmth, 20))
        assert ("temperature-unlikely" in [notice.code for notice in check_data(data)]) == is_reported


def test_bearings_that_are_assumed_are_told_where_joints_tilt() -> None:
    data = bending_data(30)
    message = messages_of(identify(IRB120, data, MODEL["tilting"]))["bearing-assumed"]
    assert all(joint.name in message for joint in IRB120.joints)
    stated = replace(IRB120, joints=tuple(replace(joint, bearing=0.0) for joint in IRB120.joints))
    assert "bearing-assumed" not in messages_of(identify(stated, data, MODEL["tilting"]))
    assert "bearing-assumed" not in messages_of(identify(IRB120, data, MODEL["elastic"]))
