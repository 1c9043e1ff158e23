"""Zones: two robots in one, each told by its own half; a missing effect made up for; what cannot be cut."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import MODELS
from truearm.engine.fit.zones import Zones, identify_zones
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import measured_with
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure

GEOMETRIC = next(model for model in MODELS if model.name == "geometric")


def to_either_side(count: int, rng: np.random.Generator) -> Array:
    """Joint positions with the flange clearly to the left for the first half, to the right for the second."""
    joints = load_robot("irb120").random_configurations(20 * count, rng)
    y = load_robot("irb120").world_poses(joints)[0][:, 1]
    left, right = joints[y > 0.05], joints[y < -0.05]
    return np.concatenate([left[: count // 2], right[: count // 2]])


def halves() -> tuple[Robot, tuple[Twin, Twin], Dataset]:
    """A robot that is another one on its right, and what an instrument reads of it."""
    rng = np.random.default_rng(1)
    nominal = load_robot("irb120")
    one, other = (
        Twin(truth_twin(nominal, truth, np.random.default_rng(0)).robot) for truth in ("tracker-triangular", "nominal")
    )
    joints = to_either_side(80, rng)
    parts = [measure(twin, part, 1e-6, rng) for twin, part in zip((one, other), np.split(joints, 2), strict=True)]
    whole = measure(one, joints, 1e-6, rng)
    return nominal, (one, other), replace(whole, position=np.concatenate([part.position for part in parts]))


@pytest.fixture(scope="module")
def cut() -> tuple[Zones, tuple[Twin, Twin]]:
    nominal, twins, data = halves()
    return identify_zones(nominal, data, GEOMETRIC, (1, 2, 1), 0.0), twins


def test_each_zone_tells_its_own_robot(cut: tuple[Zones, tuple[Twin, Twin]]) -> None:
    zones, twins = cut
    assert [zone.configurations for zone in zones.zones] == [40, 40]
    unseen = to_either_side(20, np.random.default_rng(2))
    found = zones.positions(unseen, "1")
    true = np.concatenate([t.frames(q)["1"][:, :3, 3] for t, q in zip(twins, np.split(unseen, 2), strict=True)])
    assert np.linalg.norm(found - true, axis=1).max() < 3e-5
    of_whole = zones.whole.robot.world_poses(unseen, "1")[0]
    assert np.linalg.norm(of_whole - true, axis=1).max() > 1e-3


def test_the_nominal_flange_says_which_zone(cut: tuple[Zones, tuple[Twin, Twin]]) -> None:
    zones, _ = cut
    # Straight ahead, the flange is at (374, 0, 630) mm; a quarter turn either way takes it to the side.
    turned = np.zeros((2, 6))
    turned[:, 0] = [np.pi / 2, -np.pi / 2]
    right, left = zones.zones
    assert zones.of(turned).tolist() == [1, 0]
    assert right.high[1] == left.low[1]
    assert abs(right.high[1]) < 0.05
    everywhere = np.random.default_rng(3).uniform(-2.0, 2.0, (500, 3))
    assert (right.holds(everywhere) ^ left.holds(everywhere)).all()


def test_overlap_lends_configurations(cut: tuple[Zones, tuple[Twin, Twin]]) -> None:
    zones, _ = cut
    nominal, _, data = halves()
    lent = identify_zones(nominal, data, GEOMETRIC, (1, 2, 1), 0.2)
    assert sum(zone.configurations for zone in lent.zones) > sum(zone.configurations for zone in zones.zones)


def test_where_too_little_was_measured_the_whole_stands_in() -> None:
    nominal, _, data = halves()
    few = identify_zones(nominal, data.of_configurations(range(60)), GEOMETRIC, (1, 2, 1), 0.0, least=31)
    assert few.zones == ()
    joints = data.joints[:5]
    assert few.of(joints).tolist() == [-1] * 5
    assert few.positions(joints, "2").tolist() == few.whole.robot.world_poses(joints, "2")[0].tolist()


def test_zones_make_up_for_a_missing_effect() -> None:
    rng = np.random.default_rng(4)
    nominal = load_robot("irb120")
    twin = truth_twin(nominal, "tracker-triangular", rng)
    data = measure(twin, nominal.random_configurations(120, rng), 1e-5, rng)
    unseen = nominal.random_configurations(60, rng)
    true = twin.frames(unseen)["3"][:, :3, 3]
    zones = identify_zones(nominal, data, GEOMETRIC, (2, 1, 2), 0.05)

    def mean(places: Array) -> float:
        return float(np.linalg.norm(places - true, axis=1).mean())

    whole = mean(identify(nominal, data, GEOMETRIC).robot.world_poses(unseen, "3")[0])
    assert mean(zones.whole.robot.world_poses(unseen, "3")[0]) == pytest.approx(whole, rel=1e-9)
    assert mean(zones.positions(unseen, "3")) < 0.9 * whole


def test_what_cannot_be_cut_is_refused() -> None:
    nominal, (twin, _), data = halves()
    with pytest.raises(InputError, match="these divisions make no zones"):
        identify_zones(nominal, data, GEOMETRIC, (1, 1, 1), 0.0)
    with pytest.raises(InputError, match="these divisions make no zones"):
        identify_zones(nominal, data, GEOMETRIC, (0, 2, 1), 0.0)
    with pytest.raises(InputError, match=r"zones overlap by a length.*-10 mm"):
        identify_zones(nominal, data, GEOMETRIC, (2, 1, 1), -0.01)
    rng = np.random.default_rng(5)
    held = measured_with(named_device("point"), nominal, twin, 5, rng)
    with pytest.raises(InputError, match="zones need readings that say where the robot stands"):
        identify_zones(nominal, held, GEOMETRIC, (2, 1, 1), 0.0)
