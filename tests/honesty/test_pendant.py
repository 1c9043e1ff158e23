"""What a pendant shows is not the model's: a FANUC arm whose controller is written out here by hand.

The arm below is made of the joint readings themselves, as FANUC counts them: J3 is the forearm's angle to the
horizontal, whatever J2 is, and J3 to J6 turn against the axes of the arm (ROS-Industrial, fanuc_lrmate200ic_support:
axes z, y, -y, -x, -y, -x; tool0 W 180, P -90, R 0). Nothing of it comes from the chain or the robot file.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Final

import numpy as np
import pytest

import truearm
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import quaternion_from_rotation

ROBOT: Final = "lrmate200ic"
#: What the real arm differs by: three lengths [m] and three turns [rad] behind each of seven frames.
ERRORS: Final = np.random.default_rng(11).normal(size=(7, 6)) * [3e-4, 3e-4, 3e-4, 5e-4, 5e-4, 5e-4]
NONE: Final = np.zeros((7, 6))
TARGETS: Final = {"a": (0.0, 0.0, 0.12), "b": (0.09, 0.08, 0.2), "c": (-0.1, 0.05, 0.1)}
#: Columns of a pendant's readings in the order of the joints.
AXES: Final = tuple(f"axis_{i} [deg]" for i in range(1, 7))
JOINTS: Final = tuple(f"joint_{i} [deg]" for i in range(1, 7))


def turn(axis: int, angle: float) -> Array:
    """Return the turn about an axis, ``(4, 4)``."""
    made, (i, j) = np.eye(4), ((axis + 1) % 3, (axis + 2) % 3)
    made[i, i] = made[j, j] = np.cos(angle)
    made[j, i] = np.sin(angle)
    made[i, j] = -made[j, i]
    return made


def slide(x: float, y: float, z: float) -> Array:
    made = np.eye(4)
    made[:3, 3] = x, y, z
    return made


def off(error: Array) -> Array:
    x, y, z, a, b, c = error.tolist()
    return slide(x, y, z) @ turn(0, a) @ turn(1, b) @ turn(2, c)


def faceplate(degrees: Array, errors: Array = NONE) -> Array:
    """Return the face plate in FANUC's world at readings of the pendant [deg], ``(4, 4)``."""
    j1, j2, j3, j4, j5, j6 = np.radians(degrees).tolist()
    parts = (
        turn(2, j1) @ slide(0.075, 0, 0),
        turn(1, j2) @ slide(0, 0, 0.3),
        turn(1, -j2) @ turn(1, -j3) @ slide(0, 0, 0.075),
        turn(0, -j4) @ slide(0.32, 0, 0),
        turn(1, -j5) @ slide(0.08, 0, 0),
        turn(0, -j6),
        turn(1, -np.pi / 2) @ turn(0, np.pi),
    )
    made = np.eye(4)
    for part, error in zip(parts, errors, strict=True):
        made = made @ part @ off(error)
    return made


def as_model(shown: Array) -> Array:
    """Return plain angles between the links from readings of the pendant [deg], written out."""
    j1, j2, j3, j4, j5, j6 = shown.T
    return np.column_stack([j1, j2, -(j2 + j3), -j4, -j5, -j6])


def readings(count: int, seed: int) -> Array:
    """Return readings of the pendant [deg], ``(count, 6)``, within the limits of the arm."""
    rng = np.random.default_rng(seed)
    model = rng.uniform([-170, -60, -150, -180, -115, -180], [170, 130, 70, 180, 115, 180], size=(count, 6))
    j2 = model[:, 1]
    return np.column_stack([model[:, 0], j2, -model[:, 2] - j2, -model[:, 3:]])


def campaign(file: Path, shown: Array, numbers: Array, heading: tuple[str, ...], noise: float = 2e-5) -> Path:
    """Write what a tracker reads of the real arm at readings of the pendant, beside the joints that were noted."""
    rng = np.random.default_rng(5)
    tracker = slide(1.5, -0.7, 0.4) @ turn(2, 2.1) @ turn(0, 0.02)
    with file.open("w", newline="") as stream:
        rows = csv.writer(stream)
        rows.writerow(["configuration", *heading, "target", "x [mm]", "y [mm]", "z [mm]"])
        for number, (at, noted) in enumerate(zip(shown, numbers, strict=True), 1):
            place = tracker @ faceplate(at, ERRORS)
            for name, target in TARGETS.items():
                p = (place @ [*target, 1.0])[:3] + rng.normal(0.0, noise, 3)
                rows.writerow([number, *(repr(float(v)) for v in noted), name, *(repr(float(1e3 * v)) for v in p)])
    return file


def table(file: Path) -> list[dict[str, str]]:
    with file.open(newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return the same campaign noted from the pendant, as the model's joints, and with either name on the other."""
    folder, shown = tmp_path_factory.mktemp("pendant"), readings(40, 1)
    cases = {
        "pendant": (shown, AXES),
        "model": (as_model(shown), JOINTS),
        "pendant called model": (shown, JOINTS),
        "model called pendant": (as_model(shown), AXES),
    }
    return {
        name: campaign(folder / f"{name.replace(' ', '_')}.csv", shown, numbers, heading)
        for name, (numbers, heading) in cases.items()
    }


def test_pendant_readings_calibrate_to_the_same_figure_as_the_models_joints(files: dict[str, Path]) -> None:
    pendant, model = (
        truearm.calibrate(ROBOT, files[name], train=28, model="geometric") for name in ("pendant", "model")
    )
    assert pendant.validation is not None
    assert model.validation is not None
    assert pendant.validation.position is not None
    assert model.validation.position is not None
    assert pendant.validation.position.mean < 0.06e-3
    assert abs(pendant.validation.position.mean - model.validation.position.mean) < 1e-9
    for name, value in model.fit.robot.values.items():
        assert pendant.fit.robot.values[name] == pytest.approx(value, abs=1e-9)
    assert not [w for w in pendant.warnings if w.level == "error"]


def test_right_names_are_believed(files: dict[str, Path]) -> None:
    for name in ("pendant", "model"):
        assert not truearm.check(ROBOT, files[name]).warnings


@pytest.mark.parametrize(
    ("name", "code", "cure"),
    [
        ("pendant called model", "joints-of-controller", r"Name the columns axis_1.*`joints_are=controller`"),
        ("model called pendant", "joints-of-model", r"Name the columns joint_1.*`joints_are=model`"),
    ],
)
def test_joints_under_the_wrong_name_are_named(files: dict[str, Path], name: str, code: str, cure: str) -> None:
    said = truearm.check(ROBOT, files[name]).warnings
    assert (said[0].code, said[0].level) == (code, "error")
    assert re.search(cure, said[0].message)
    fitted = truearm.calibrate(ROBOT, files[name], train=28)
    assert (fitted.warnings[0].code, fitted.warnings[0].level) == (code, "error")


def test_a_calibration_is_validated_with_pendant_readings(files: dict[str, Path], tmp_path: Path) -> None:
    truearm.calibrate(ROBOT, files["pendant"], train="all", out=tmp_path / "result", model="geometric")
    shown = readings(10, 2)
    new = {
        "axis": campaign(tmp_path / "axis.csv", shown, shown, AXES),
        "joint": campaign(tmp_path / "joint.csv", shown, as_model(shown), JOINTS),
    }
    calibrated = tmp_path / "result" / "calibrated.yaml"
    means = {}
    for name, file in new.items():
        errors = truearm.validate(calibrated, file).errors.position
        assert errors is not None
        means[name] = errors.mean, truearm.distances(calibrated, file).summary()["distance_mm"]["mean"]
    assert means["axis"][0] < 0.06e-3
    assert means["axis"] == pytest.approx(means["joint"], abs=1e-9)


def test_a_plan_typed_into_the_pendant_leads_where_it_says(tmp_path: Path) -> None:
    plan = truearm.plan(ROBOT, poses=10, candidates=40, out=tmp_path / "plan.csv")
    rows = table(tmp_path / "plan.csv")
    robot = truearm.load_robot(ROBOT)
    places, turned = robot.forward(plan.joints, frame="controller")
    for row, p, R in zip(rows, places, turned, strict=True):
        there = faceplate(np.array([float(row[name]) for name in AXES]))
        assert there[:3, 3] == pytest.approx(p, abs=1e-9)
        assert there[:3, :3] == pytest.approx(R, abs=1e-9)
    before = np.array([[float(row[f"approach_{i} [deg]"]) for i in range(1, 7)] for row in rows])
    assert plan.made.before is not None
    assert as_model(before) == pytest.approx(np.degrees(plan.made.before), abs=1e-9)


def test_inverse_kinematics_of_poses_as_the_pendant_shows_them_reach_them(tmp_path: Path) -> None:
    shown = readings(6, 3)
    there = np.array([faceplate(at) for at in shown])
    quaternions = quaternion_from_rotation(there[:, :3, :3])
    lines = ["pose,x [mm],y [mm],z [mm],qw,qx,qy,qz"]
    for number, (place, q) in enumerate(zip(there, quaternions, strict=True)):
        lines.append(",".join([f"p{number}", *(repr(float(v)) for v in (*(1e3 * place[:3, 3]), *q))]))
    (tmp_path / "poses.csv").write_text("\n".join(lines) + "\n")
    truearm.inverse(ROBOT, tmp_path / "poses.csv", frame="controller", out=tmp_path / "joints.csv")
    for row, place in zip(table(tmp_path / "joints.csv"), there, strict=True):
        assert faceplate(np.array([float(row[name]) for name in AXES])) == pytest.approx(place, abs=1e-8)


def test_a_robot_shows_the_pose_that_the_pendant_shows() -> None:
    shown = readings(1, 4)[0]
    said = truearm.show(ROBOT, joint_positions=np.radians(shown)).summary()["at"]
    assert said["joints"]["controller"] == pytest.approx(shown)
    assert said["joints"]["model"] == pytest.approx(as_model(shown[None])[0])
    there = faceplate(shown)
    assert said["flange"]["controller"]["position_mm"] == pytest.approx(1e3 * there[:3, 3])
    w, p, r = np.radians(said["flange"]["controller"]["angles about x y z, fixed axes"])
    assert (turn(2, r) @ turn(1, p) @ turn(0, w))[:3, :3] == pytest.approx(there[:3, :3])
    zero = truearm.show(ROBOT, joint_positions=np.zeros(6)).lines()
    assert "  x 475.000  y 0.000  z 375.000 mm" in zero


#: Joints of ROS's ur_description for a UR5: parent, child, place, turn, and axis of those that move. The link `base` is
#: the pendant's Base.
UR5_LINKS: Final = (
    ("base_link", "base", "0 0 0", "0 0 -3.141592653589793", None),
    ("base_link", "shoulder", "0 0 0.089159", "0 0 0", "0 0 1"),
    ("shoulder", "upper_arm", "0 0.13585 0", "0 1.5707963267948966 0", "0 1 0"),
    ("upper_arm", "forearm", "0 -0.1197 0.425", "0 0 0", "0 1 0"),
    ("forearm", "wrist_1", "0 0 0.39225", "0 1.5707963267948966 0", "0 1 0"),
    ("wrist_1", "wrist_2", "0 0.093 0", "0 0 0", "0 0 1"),
    ("wrist_2", "wrist_3", "0 0 0.09465", "0 0 0", "0 1 0"),
    ("wrist_3", "tool0", "0 0.0823 0", "-1.5707963267948966 0 0", None),
)


def test_a_ur_shows_its_pose_in_base_and_not_in_base_link(tmp_path: Path) -> None:
    """The pose of a UR5 at zero joints is known: X -817.25, Y -191.45, Z -5.49 mm, RX 1.571."""
    links = dict.fromkeys(name for parent, child, *_ in UR5_LINKS for name in (parent, child))
    text = '<robot name="ur5">' + "".join(f'<link name="{link}"/>' for link in links)
    for parent, child, xyz, rpy, axis in UR5_LINKS:
        kind = "fixed" if axis is None else "revolute"
        moves = "" if axis is None else f'<axis xyz="{axis}"/><limit lower="-6" upper="6"/>'
        text += f'<joint name="to_{child}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        text += f'<origin xyz="{xyz}" rpy="{rpy}"/>{moves}</joint>'
    (tmp_path / "ur5.urdf").write_text(text + "</robot>")
    for robot, own in (("ur5", -817.25), (str(tmp_path / "ur5.urdf"), 817.25)):
        assert 1e3 * load_robot(robot).forward(np.zeros(6))[0][0, 0] == pytest.approx(own)
        pose = truearm.show(robot, joint_positions=np.zeros(6)).summary()["at"]["flange"]["controller"]
        assert pose["position_mm"] == pytest.approx([-817.25, -191.45, -5.491], abs=1e-6)
        assert pose["rotation vector"] == pytest.approx([np.pi / 2, 0.0, 0.0], abs=1e-9)
