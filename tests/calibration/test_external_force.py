"""What is said where a force acts at the tool: whether the data determined how the arm gives way to it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from truearm.calibration.calibrate import calibrate
from truearm.engine.base.errors import Notice
from truearm.engine.diagnose.external_force import check_force
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.robot.wrench import Wrench
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import PERFECT

LOW, HIGH = np.radians([[-90, 0, -80, -150, -90, -180], [90, 110, 70, 150, 90, 180]])
SIDEWAYS = Wrench((0.0, 14.0, 0.0))


def elastic_twin() -> Twin:
    """The IRB 120 of the thesis, whose joint 1 gives way, too."""
    twin = truth_twin(load_robot("irb120"), "tracker-triangular", np.random.default_rng(0))
    joints = {**twin.joints, 1: replace(twin.joints.get(1, PERFECT), compliance=5e-5)}
    return replace(twin, joints=joints, robot=twin.robot.with_payload("0.5kg,0mm,0mm,60mm"))


def calibrated(model: str, force: float) -> Robot:
    """The twin calibrated from 60 configurations, pushed to all sides in half of them."""
    twin, rng = elastic_twin(), np.random.default_rng(1)
    wrench = np.zeros((60, 6))
    wrench[::2, :3] = force * rng.standard_normal((30, 3))
    data = measure(twin, rng.uniform(LOW, HIGH, (60, 6)), 0.02e-3, rng, wrench=wrench)
    return calibrate("irb120", data, model=model, payload=twin.robot.payload).robot


@pytest.fixture(scope="module")
def by_gravity() -> Robot:
    return calibrated("elastic", 0.0)


@pytest.fixture(scope="module")
def by_force() -> Robot:
    return calibrated("elastic", 10.0)


def notices_of(robot: Robot, wrench: Wrench = SIDEWAYS) -> dict[str, Notice]:
    q = np.random.default_rng(2).uniform(LOW, HIGH, (40, 6))
    return {notice.code: notice for notice in check_force([(robot.with_wrench(wrench, "1"), q)])}


def test_a_sideways_force_leans_on_what_gravity_did_not_load(by_gravity: Robot) -> None:
    notices = notices_of(by_gravity)
    assert notices["compliance-unseen"].level == "warning"
    assert "compliance_1" in notices["compliance-unseen"].message
    assert "It loads axis_1 with " in notices["compliance-unseen"].message
    assert notices["force-taken"].level == "note"
    rigid = notices_of(calibrated("offsets", 0.0))
    assert rigid["force-on-rigid-model"].level == "warning"
    assert "force-taken" not in rigid


def test_what_was_pushed_in_calibration_is_known(by_force: Robot) -> None:
    notices = notices_of(by_force, Wrench((0.0, 5.0, 0.0)))
    assert list(notices) == ["force-taken"]
    assert "moves its tip by up to 0." in notices["force-taken"].message
    assert "known to 0.0" in notices["force-taken"].message
    notices = notices_of(replace(by_force, proof=None), Wrench((0.0, 5.0, 0.0)))  # it bends as its values say
    assert list(notices) == ["force-taken"]
    assert "known to" not in notices["force-taken"].message
    assert check_force([]) == check_force([(by_force, np.zeros((3, 6)))]) == []
    assert check_force([(by_force.with_wrench(SIDEWAYS), np.full((2, 6), np.nan))]) == []


def test_the_force_that_is_told_is_as_uncertain_as_the_twin_is_off(by_force: Robot) -> None:
    """Tips of the calibrated robot and the twin, each under the force less at rest, differ by the deviation told."""
    twin = elastic_twin()
    q = np.random.default_rng(3).uniform(LOW, HIGH, (40, 6))
    pushed = replace(twin, robot=twin.robot.with_wrench(SIDEWAYS, "1"))
    bends = pushed.frames(q)["1"][:, :3, 3] - twin.frames(q)["1"][:, :3, 3]
    predicted = by_force.with_wrench(SIDEWAYS, "1").world_poses(q, "1")[0] - by_force.world_poses(q, "1")[0]
    words = notices_of(by_force)["force-taken"].message.split("known to ")[1]
    deviation = float(words.split(" mm")[0]) * 1e-3
    off = np.linalg.norm(bends - predicted, axis=1)
    assert 0.1 * deviation < off.max() < 3.0 * deviation
    assert np.linalg.norm(bends, axis=1).max() > 20 * off.max()


def test_loads_beyond_those_of_the_calibration_are_told(by_gravity: Robot) -> None:
    notices = notices_of(by_gravity, Wrench((0.0, 0.0, 0.0), (0.0, 3.0, 0.0), "tool"))
    message = notices["loads-beyond-data"].message
    assert notices["loads-beyond-data"].level == "warning"
    assert "axis_4 with " in message or "axis_5 with " in message
    assert "(measured with -0." in message


def test_the_rated_load_counts_payload_and_force(by_force: Robot) -> None:
    notices = notices_of(by_force.with_payload("2kg,0mm,0mm,60mm"))
    assert notices["rated-load-exceeded"].level == "warning"
    assert "make up to 33.6 N, and irb120 is rated for 29.4 N (3 kg)" in notices["rated-load-exceeded"].message
    unknown = notices_of(replace(by_force, rated_load=None))
    assert unknown["rating-unknown"].level == "note"


def test_another_base_of_the_controller_is_told(by_force: Robot) -> None:
    base = Transform((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    turned = replace(by_force, controller=replace(by_force.controller, base=base))
    notice = notices_of(turned)["force-in-model-base"]
    assert notice.level == "warning"
    assert "`wrench_frame=controller`" in notice.message
    assert "force-in-model-base" not in notices_of(turned, Wrench((0.0, -14.0, 0.0), frame="controller"))
    assert "force-in-model-base" not in notices_of(by_force)
