"""Link bending and run-out found in readings of a twin, and what a fit says about them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from tests.engine.fit.test_joint_effects import MODEL, messages_of

from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.fit import identify
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.twin.truths import joint_truths, truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import JointTruth

BOTH = ("link-bending", "run-out")
#: Nobody has said what its links weigh.
UNKNOWN = replace(load_robot("irb120"), masses=(), payload=Payload())


def test_what_a_twin_does_is_found_without_any_mass() -> None:
    rng = np.random.default_rng(2)
    true = UNKNOWN.with_effects(BOTH)
    own = [p for effect in true.effects for p in effect.parameters]
    true = true.with_values({p.name: p.prior * float(rng.normal()) for p in own})
    twin = truth_twin(true, "nominal", rng)
    twin = Twin(replace(twin.robot, masses=(), payload=Payload()), joint_truths(true))
    data = measure(twin, UNKNOWN.random_configurations(160, rng), 5e-6, rng)
    training, rest = data.of_configurations(np.arange(120)), data.of_configurations(np.arange(120, 160))
    plain, fit = (identify(UNKNOWN, training, MODEL["geometric"].also(names)) for names in ((), BOTH))
    of_plain, of_both = (errors_of(each.robot, rest).position_norms.mean() for each in (plain, fit))
    assert of_plain > 3e-5
    assert of_both < 1.3e-5  # of which the noise is 0.8
    for name in ("bending_zx_3", "bending_zy_2", "run_out_z_sin_2", "run_out_x_cos_4"):
        found = fit.robot.parameters[name]
        assert found.deviation is not None
        assert abs(found.value - true.values[name]) < 4.0 * found.deviation, name
    codes = messages_of(fit)
    assert "no-loads" not in codes
    assert "bearing-assumed" not in codes
    assert "bending_zx_1" in codes["effects-uninformed"]  # gravity is along the axis of joint 1 at every angle


def test_it_stands_in_for_a_load_and_is_right_for_that_load_only() -> None:
    rng = np.random.default_rng(3)
    soft = {number: JointTruth(compliance=1e-5, bearing=1e-5) for number in range(1, 7)}
    twin = truth_twin(load_robot("irb120"), "nominal", rng)
    twin = replace(twin, joints=soft, robot=twin.robot.with_payload(Payload(2.0, (0.05, 0.0, 0.1))))
    q = UNKNOWN.random_configurations(150, rng)
    data = measure(twin, q, 5e-6, rng)
    light = measure(replace(twin, robot=twin.robot.with_payload(Payload(0.1))), q[120:], 5e-6, rng)
    training, rest = data.of_configurations(np.arange(120)), data.of_configurations(np.arange(120, 150))
    plain, fit = (identify(UNKNOWN, training, MODEL["geometric"].also(names)) for names in ((), ("link-bending",)))
    of_plain, of_bent = (1e3 * errors_of(each.robot, rest).position_norms.mean() for each in (plain, fit))
    assert of_bent < 0.5 * of_plain
    assert 1e3 * errors_of(fit.robot, light).position_norms.mean() > 3.0 * of_bent
