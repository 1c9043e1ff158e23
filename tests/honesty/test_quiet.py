"""Good data are not doubted: arms that give way under loads nobody knows, in campaigns of few configurations too."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.honesty.telling import Told, told, written

from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import NO_PAYLOAD, LinkMass, Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import in_view_of, measured_with
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin
from truearm.engine.twin.twin_joint import JointTruth

#: What the first joint that gravity loads gives way by [rad/(N m)]; each further one twice as much.
SOFT = 3e-6


def giving_way(robot: str, device: str, seed: int) -> tuple[Robot, Twin]:
    """Return a robot whose file knows no masses, and one that has them and gives way, seen by a device."""
    nominal = load_robot(robot)
    masses = tuple(LinkMass(k, 25.0 * 0.6**k, (0.0, 0.0, 0.0)) for k in range(1, len(nominal.joints) + 1))
    twin = truth_twin(replace(nominal, masses=masses), "random", np.random.default_rng(seed))
    soft = {k: JointTruth(compliance=SOFT * 2.0**k) for k in range(1, len(nominal.joints) + 1)}
    return nominal, replace(
        twin, robot=in_view_of(named_device(device), twin.robot).with_payload(NO_PAYLOAD), joints=soft
    )


@cache
def read_by(device: str, configurations: int, robot: str = "gp7", seed: int = 1) -> Dataset:
    nominal, twin = giving_way(robot, device, seed)
    return measured_with(named_device(device), nominal, twin, configurations, np.random.default_rng(seed))


def doubts(found: Told) -> dict[str, str]:
    """Return the warnings and errors."""
    return {code: found.messages[code] for code, level in found.levels.items() if level != "note"}


CAMPAIGNS = [("measurement-arm", 20), ("markers", 18), ("markers", 60), ("strings", 60), ("strings", 200)]


@pytest.mark.parametrize(("device", "configurations"), CAMPAIGNS)
@pytest.mark.parametrize("declared", [True, False])
def test_an_arm_that_gives_way_passes_the_check(
    device: str, configurations: int, declared: bool, tmp_path: Path
) -> None:
    data = read_by(device, configurations)
    found = told("check", "gp7", written(tmp_path, data if declared else replace(data, sigma=None)))
    assert not doubts(found), found
    assert found.code == 0


@pytest.mark.parametrize(("device", "configurations"), CAMPAIGNS)
@pytest.mark.parametrize("declared", [True, False])
def test_its_calibration_is_not_doubted(device: str, configurations: int, declared: bool, tmp_path: Path) -> None:
    data = read_by(device, configurations)
    file = written(tmp_path, data if declared else replace(data, sigma=None))
    found = told("calibrate", "gp7", file, "--out", tmp_path / "out")
    assert not doubts(found), found
    assert found.code == 0


def moved(data: Dataset, first: int, shift: float) -> Dataset:
    """Move the instrument along x before a configuration, by an index from 0."""
    late = (data.configuration >= first)[:, None]
    return replace(data, position=data.position + late * [shift, 0.0, 0.0])


@pytest.mark.parametrize("shift", [1e-3, 3e-3])
def test_check_and_calibrate_name_the_same_configuration(shift: float, tmp_path: Path) -> None:
    file = written(tmp_path, moved(read_by("measurement-arm", 40), 22, shift))
    checked, calibrated = told("check", "gp7", file), told("calibrate", "gp7", file, "--out", tmp_path)
    for found in (checked, calibrated):
        assert found.says("instrument-moved", "error", r"From configuration 23 on"), found
        assert found.code == 3
        assert found.summary["next"][0]["code"] == "instrument-moved"
    assert "residuals-exceed-sigma" not in calibrated.levels  # what moved says why
    assert not doubts(told("check", "gp7", written(tmp_path, read_by("measurement-arm", 40))))


def test_a_move_near_the_end_may_have_been_nearer_to_it(tmp_path: Path) -> None:
    data = read_by("measurement-arm", 40)
    for first, word in ((7, "earlier"), (22, None), (34, "later")):
        message = told("check", "gp7", written(tmp_path, moved(data, first, 3e-3))).messages["instrument-moved"]
        assert ("It may have been" in message) is (word is not None), message
        assert word is None or f"It may have been {word}" in message


@pytest.mark.parametrize("seed", range(6))
def test_other_arms_are_not_doubted_either(seed: int, tmp_path: Path) -> None:
    robot = ("kr10_r1100", "tx2_60", "irb2600_12_1.85", "rs007l", "m20id_25", "xarm6")[seed]
    file = written(tmp_path, read_by("markers", 40, robot, seed))
    found = told("calibrate", robot, file, "--out", tmp_path / "out")
    assert not doubts(found), found


def test_another_payload_than_in_calibration_is_told_where_nobody_knows_what_the_arm_weighs(tmp_path: Path) -> None:
    nominal, twin = giving_way("gp7", "markers", 1)
    heavy = replace(twin, robot=twin.robot.with_payload(Payload(5.0, (0.0, 0.0, 0.1))))
    device, rng = named_device("markers"), np.random.default_rng(2)
    file, later = (written(tmp_path, measured_with(device, nominal, heavy, n, rng), f"{n}.csv") for n in (25, 20))
    load = ("--payload", "5kg,0mm,0mm,100mm")
    told("calibrate", "gp7", file, *load, "--model", "elastic", "--out", tmp_path / "out")
    arm = tmp_path / "out" / "calibrated.yaml"
    assert "loads-beyond-data" not in told("validate", arm, later).levels
    assert "loads-beyond-data" not in told("validate", arm, later, *load).levels
    light = told("validate", arm, later, "--payload", "1kg,0mm,0mm,50mm")
    assert light.says("loads-beyond-data", "warning", "calibrated with 5 kg on the flange, and carries 1 kg"), light
