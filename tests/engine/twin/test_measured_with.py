"""What a device knows of where a twin stands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.devices.device import Arm, Device, measured_with
from truearm.engine.twin.devices.lengths import BALLBAR
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure


@dataclass(frozen=True)
class Onlooker(Device):
    """Compares what is known of the arm with the arm, and reads where its first target is."""

    def campaign(self, nominal: Robot, arm: Arm, count: int, sigma: float, rng: np.random.Generator) -> Dataset:
        joints = nominal.random_configurations(count, rng)
        name = nominal.targets[0].name
        apart = nominal.world_poses(joints, name)[0] - arm.frames(joints)[name][:, :3, 3]
        assert np.linalg.norm(apart, axis=1).max() < 5e-3
        return measure(truth_twin(nominal, "nominal", rng), joints, sigma, rng)


def test_the_nominal_robot_stands_where_the_twin_does_though_its_base_is_counted_from_axis_2() -> None:
    nominal = load_robot("irb120")
    twin = truth_twin(nominal, "tracker-triangular", np.random.default_rng(0))
    assert twin.robot.values["d_1"] == 0.0  # the published truth has d_1 in the base (Nubiola, equation I.2)
    measured_with(Onlooker("onlooker", "", "", 0.0), nominal, twin, 30, np.random.default_rng(1))


def test_a_ballbar_comes_into_its_range_on_such_a_twin() -> None:
    nominal = load_robot("irb120")
    twin = truth_twin(nominal, "tracker-triangular", np.random.default_rng(0))
    data = measured_with(BALLBAR, nominal, twin, 12, np.random.default_rng(0))
    assert data.distance == pytest.approx(np.full(12, 0.3), abs=1e-3)
