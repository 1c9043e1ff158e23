"""A ball in two sockets: nothing but joint positions, and what they tell of an arm with seven joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pytest

from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.unmodelled import LeftOver
from truearm.engine.fit.fit import Status, identify
from truearm.engine.fit.models import named_model
from truearm.engine.fit.problem import gauge_freedoms
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rigid_motion
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import Arm, in_view_of
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin
from truearm.engine.twin.twin_joint import JointTruth

TOOL = "0.5kg,0mm,0mm,60mm"
#: About what strain wave gears with a torque sensor give way [rad/(N m)].
SOFT = dict(zip(range(1, 8), np.array([5, 5, 6, 6, 10, 10, 10]) * 1e-5, strict=True))
NOMINAL = load_robot("fr3").with_payload(TOOL)
DEVICE = named_device("two-sockets")


@dataclass(frozen=True)
class Pressed:
    """An arm whose ball is pushed into its socket by hand, each time otherwise; nobody measures how."""

    twin: Twin
    force: Array

    @property
    def robot(self) -> Robot:
        return self.twin.robot

    def frames(self, joints: Array) -> Mapping[str, Array]:
        wrench = np.concatenate([self.force[: len(joints)], np.zeros((len(joints), 3))], axis=1)
        return self.twin.frames(joints, wrench=wrench)


def campaign(seed: int, sigma: float, newton: float = 5.0, count: int = 120) -> tuple[Twin, Dataset]:
    """Return a robot drawn from its priors, elastic, and what its ball in the sockets tells."""
    rng = np.random.default_rng(seed)
    drawn = truth_twin(NOMINAL, "random", rng)
    twin = replace(
        drawn,
        robot=in_view_of(DEVICE, drawn.robot).with_payload(TOOL),
        joints={number: JointTruth(compliance=value) for number, value in SOFT.items()},
    )
    pressed: Arm = Pressed(twin, newton / np.sqrt(3) * rng.standard_normal((count, 3)))
    placed = NOMINAL.with_frames(twin.robot.base, {"ball": (0.02, 0.01, 0.15)})
    return twin, DEVICE.campaign(placed, pressed, count, sigma, rng)


def error(robot: Robot, twin: Twin) -> float:
    """Return the mean error of the ball all over the limits of the joints, behind the best rigid motion [m]."""
    q = NOMINAL.random_configurations(100, np.random.default_rng(99))
    true, result = twin.frames(q)["ball"][:, :3, 3], robot.world_poses(q, "ball")[0]
    R, t = rigid_motion(result, true)
    return float(np.linalg.norm(result @ R.T + t - true, axis=1).mean())


@pytest.mark.parametrize(("seed", "sigma", "most"), [(0, 2e-5, 0.1), (1, 1e-4, 0.25)])
def test_the_error_elsewhere_falls_to_a_tenth_of_the_nominal_robots(seed: int, sigma: float, most: float) -> None:
    twin, data = campaign(seed, sigma)
    fit = identify(NOMINAL, data, named_model("elastic"))
    assert fit.status is Status.CONVERGED
    assert error(fit.robot, twin) < most * error(fit.start, twin)
    seen = " ".join(fit.unobservable_combinations)
    assert fit.gauge_freedoms == ("base",)
    assert all(name in seen for name in ("theta_offset_1", "d_1", "theta_offset_7", "d_7"))  # base and flange zero


def test_the_distance_of_the_sockets_is_the_only_scale() -> None:
    _, data = campaign(2, 2e-5, 0.0)
    assert data.setup is not None
    assert gauge_freedoms(data) == ("base",)
    assert gauge_freedoms(replace(data, setup=None)) == ("base", "size")
    assert data.setup.distance is not None
    longer = replace(data, setup=replace(data.setup, distance=1.001 * data.setup.distance))
    sure, wrong = (identify(NOMINAL, d, named_model("elastic")).robot for d in (data, longer))
    lengths = ["d_3", "d_5", "a_4"]
    grown = [wrong.values[n] / sure.values[n] - 1.0 for n in lengths]
    # nominal lengths, each good to 1 mm, hold a little against a distance that is good to 0.02 mm
    np.testing.assert_allclose(grown, 0.001, rtol=0.15)
    unsure = replace(data, setup=replace(data.setup, sigma=np.array([1e-3])))
    loose = identify(NOMINAL, unsure, named_model("elastic")).robot
    for name in lengths:
        spread, tight = loose.parameters[name].deviation, sure.parameters[name].deviation
        assert spread is not None
        assert tight is not None
        assert spread > 1.5 * tight


def test_a_size_that_no_reading_holds_does_not_explain_what_a_fit_leaves() -> None:
    _, data = campaign(3, 2e-5, 0.0, 60)
    left = LeftOver.of(identify(NOMINAL, data, named_model("geometric")), data)
    remaining = left.without_parameters(left.residual)
    assert float(remaining @ remaining) > 0.5 * float(left.residual @ left.residual)
