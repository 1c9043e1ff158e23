"""A robot whose controller was calibrated by its maker: measured, corrected and judged from outside."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests import ur_controller as ur
from tests.answered import compensate

import truearm

TCP = np.array([0.0, 0.0, 0.1])
NEAR = np.radians([160.0, -95.0, 145.0, -140.0, -90.0, -110.0])


@pytest.fixture(scope="module")
def arm() -> ur.Arm:
    return ur.Arm.like("ur10", ur.UR10_CONF, np.random.default_rng(7), 0.15e-3)


@pytest.fixture(scope="module")
def cell(arm: ur.Arm, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the controller's file, readings of a tracker and a program for a plate."""
    folder = tmp_path_factory.mktemp("cell")
    (folder / "calibration.conf").write_text(ur.UR10_CONF)
    rng = np.random.default_rng(11)
    joints = rng.uniform(-np.pi, np.pi, (60, 6))
    nests = np.array([[0.05, 0.0, 0.12], [-0.04, 0.06, 0.1], [0.0, -0.07, 0.15]])
    base = np.array([1.2, -0.8, 0.3])
    turned = ur.rotation(np.array([0.1, -0.05, 0.7]))
    poses = arm.poses(joints)
    lines = [
        "configuration,target," + ",".join(f"joint_{i} [deg]" for i in range(1, 7)) + ",x [mm],y [mm],z [mm],sigma [mm]"
    ]
    for number, (q, pose) in enumerate(zip(joints, poses, strict=True), 1):
        for name, nest in zip("abc", nests, strict=True):
            seen = base + turned @ (pose[:3, :3] @ nest + pose[:3, 3]) + rng.normal(0, 0.02e-3, 3)
            numbers = [*np.degrees(q), *(seen * 1e3), 0.02]
            lines.append(f"{number},{name}," + ",".join(repr(float(v)) for v in numbers))
    (folder / "data.csv").write_text("\n".join(lines) + "\n")
    (folder / "plate.script").write_text(program(arm))
    return folder


def program(arm: ur.Arm) -> str:
    """Return a program that visits a plate of 400 x 300 mm, its poses as a designer would write them."""
    lines = ["def plate():", "  set_tcp(p[0,0,0.1,0,0,0])"]
    lines += [f"  movej([{', '.join(f'{v:.6f}' for v in NEAR)}])"]
    for x in np.linspace(0.45, 0.85, 5):
        for y in np.linspace(0.0, 0.3, 4):
            lines.append(f"  movel(p[{x:.4f}, {y:.4f}, 0.1000, 3.141593, 0, 0])")
    return "\n".join([*lines, "end", ""])


def run(script: str, arm: ur.Arm) -> ur.Array:
    """Return where the tip of the real arm goes when its controller runs a program, ``(n, 3)`` [m]."""
    rows, near, tips = ur.table("ur10", ur.UR10_CONF), NEAR, []
    for words in re.findall(r"movel\(p\[([^\]]*)\]", script):
        x, y, z, *turn = (float(word) for word in words.split(","))
        pose = np.eye(4)
        pose[:3, :3] = ur.rotation(np.array(turn))
        pose[:3, 3] = np.array([x, y, z]) - pose[:3, :3] @ TCP
        near = ur.inverse(rows, pose, near)
        real = arm.poses(near[None])[0]
        tips.append(real[:3, :3] @ TCP + real[:3, 3])
    return np.array(tips)


def wanted(script: str) -> ur.Array:
    return np.array([[float(v) for v in words.split(",")[:3]] for words in re.findall(r"movel\(p\[([^\]]*)\]", script)])


def plate_error(tips: ur.Array, places: ur.Array) -> float:
    """Return the mean distance [mm] of tips from places, best laid on them (Kabsch)."""
    a, b = tips - tips.mean(axis=0), places - places.mean(axis=0)
    U, _, Vt = np.linalg.svd(a.T @ b)
    R = U @ np.diag([1, 1, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    return 1e3 * float(np.linalg.norm(a @ R - b, axis=1).mean())


def test_the_hand_written_controller_reaches_its_own_poses() -> None:
    rows = ur.table("ur10", ur.UR10_CONF)
    q = np.radians([[10.0, -80.0, 70.0, -60.0, -80.0, 30.0]])
    assert np.allclose(ur.inverse(rows, ur.forward(rows, q)[0], q[0] + 0.05), q[0], atol=1e-9)
    same = ur.Arm.like("ur10", ur.UR10_CONF, np.random.default_rng(0), 0.0)
    assert np.allclose(same.poses(q), ur.forward(rows, q), atol=1e-12)


@pytest.mark.parametrize("way", ["file of the controller", "imported robot", "ROS driver's file", "robot file"])
def test_a_plate_gets_better_when_the_controllers_own_kinematics_are_told(
    cell: Path, arm: ur.Arm, way: str, tmp_path: Path
) -> None:
    robot: truearm.Robot | str = "ur10"
    kinematics: Path | None = cell / "calibration.conf"
    if way == "imported robot":
        robot, kinematics = truearm.import_ur_kinematics(cell / "calibration.conf", "ur10").robot, None
    elif way == "ROS driver's file":
        arm_of_controller = truearm.import_ur_kinematics(cell / "calibration.conf", "ur10").robot
        truearm.export(arm_of_controller, "ur-kinematics", out=tmp_path / "ros.yaml")
        kinematics = tmp_path / "ros.yaml"
    calibration = truearm.calibrate(robot, cell / "data.csv", seed=3, model="geometric")
    calibrated: truearm.Robot | Path = calibration.robot
    if way == "robot file":
        file = tmp_path / "calibrated.yaml"
        calibration.save(tmp_path)
        text = file.read_text()
        (tmp_path / "factory.conf").write_text(ur.UR10_CONF)
        file.write_text(text.replace("controller:\n", "controller:\n  kinematics: factory.conf\n"))
        calibrated, kinematics = file, None
    original = (cell / "plate.script").read_text()
    corrected = compensate(calibrated, [cell / "plate.script"], controller_kinematics=kinematics)
    assert not {"edited-by-hand", "controller-unknown"} & {notice.code for notice in corrected.warnings}
    before = plate_error(run(original, arm), wanted(original))
    after = plate_error(run(corrected.files[0].text.decode(), arm), wanted(original))
    assert calibration.validation is not None
    held_out = 1e3 * float(calibration.validation.position_norms.mean())
    assert corrected.files[0].corrected >= 20
    assert before > 0.05
    assert after < before / 3
    assert after <= 1.5 * held_out


def test_a_plate_gets_worse_when_the_data_sheet_is_taken_for_the_controllers_kinematics(
    cell: Path, arm: ur.Arm
) -> None:
    # What happened before anything was asked: the controller corrects what the program corrects again.
    calibrated = truearm.calibrate("ur10", cell / "data.csv", seed=3, model="geometric").robot
    with pytest.raises(truearm.InputError, match="controller_kinematics"):
        compensate(calibrated, [cell / "plate.script"], controller_kinematics=None)
    original = (cell / "plate.script").read_text()
    corrected = compensate(calibrated, [cell / "plate.script"], controller_kinematics="nominal")
    before = plate_error(run(original, arm), wanted(original))
    after = plate_error(run(corrected.files[0].text.decode(), arm), wanted(original))
    assert after > 1.5 * before


def test_types_that_fit_as_well_are_told_and_a_better_one_is_a_warning(cell: Path) -> None:
    imported = truearm.import_ur_kinematics(cell / "calibration.conf", "ur10")
    for fitting, codes in (({}, []), ({"ur10e": 1.0}, ["type-not-told"]), ({"ur10e": 1e-9}, ["type-doubtful"])):
        assert [notice.code for notice in replace(imported, fitting=fitting).warnings] == codes
