"""Sets of poses, paths and sphere tests as jobs and commands: what they write, and what they refuse."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from tests.commanding import Truearm
from tests.house.examples import EXAMPLES, PATH

import truearm as package
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.engine.data.readers.configurations import read_poses
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rotation_from_quaternion
from truearm.engine.twin.twin import Twin

CUBE = ("--centre", "350,0,350", "--side", "200")

# -- sets of poses -----------------------------------------------------------------------------------------


def test_a_set_is_written_as_other_commands_read_it(truearm: Truearm, tmp_path: Path) -> None:
    out = tmp_path / "set.csv"
    run = truearm("poses", "irb120", "--set", "diagonal", "--count", 6, *CUBE, "--tip", "0,0,50", "--out", out)
    assert run.code == 0, run.err
    assert run.out.startswith("6 poses of the set diagonal in the cube of 200 mm about (350, 0, 350) mm.")
    assert {path.name for path in tmp_path.iterdir()} == {
        *("set.csv", "set-poses.csv", "set.html"),
        "truearm.manifest.json",
    }
    data, read = read_csv(out), read_poses(tmp_path / "set-poses.csv")
    robot = package.load_robot("irb120")
    position, rotation = robot.forward(data.joints)
    assert read.labels == data.labels
    assert read.position == pytest.approx(position, abs=1e-9)
    assert read.quaternion is not None
    assert rotation_from_quaternion(read.quaternion) == pytest.approx(rotation, abs=1e-9)
    again = package.inverse("irb120", tmp_path / "set-poses.csv", seed_joints=data.joints)
    assert again.joints == pytest.approx(data.joints, abs=1e-6)
    measured = tmp_path / "measured.csv"
    run = truearm("simulate", "irb120", "--truth", "random", "--poses", out, "--noise", 0.05, "--out", measured)
    assert run.code == 0, run.err
    assert read_csv(measured).joints == pytest.approx(data.joints, abs=0.0)
    assert read_csv(measured).labels == data.labels
    plan = truearm("plan", "irb120", "--from", out, "--poses", 5, "--model", "offsets", "--out", tmp_path / "plan.csv")
    assert plan.code == 0, plan.err
    template = truearm("calibrate", "irb120", out, "--out", tmp_path / "no")
    assert template.code == 2
    assert "no reading" in template.err or "reading" in template.err


def test_a_target_of_the_robot_goes_to_the_poses(tmp_path: Path) -> None:
    robot = package.load_robot("irb120")
    robot = robot.with_frames(robot.base, {"a": (0.0, 0.02, 0.1), "b": (0.0, 0.0, 0.05)})
    found = package.poses(robot, "p1-p5", centre=(0.35, 0.0, 0.3), side=0.2, target="a", out=tmp_path / "p.csv")
    at, _ = robot.forward(found.joints, target="a")
    assert at[0] == pytest.approx([0.35, 0.0, 0.3], abs=1e-8)
    assert read_poses(tmp_path / "p-poses.csv").position == pytest.approx(at, abs=1e-9)
    assert read_csv(tmp_path / "p.csv").targets == ("a", "b")


def test_unreachable_poses_end_with_exit_code_3_and_their_names(truearm: Truearm, tmp_path: Path) -> None:
    words = ("--centre", "350,0,350", "--side", 300, "--tip-orientation", "down", "--out", tmp_path / "s.csv", "--json")
    run = truearm("poses", "irb120", "--set", "iso-cube", *words)
    assert run.code == 3
    summary = json.loads(run.out)
    assert summary["missed"] == ["C1", "C4"]
    assert [(w["code"], w["level"]) for w in summary["warnings"]] == [("unreachable-poses", "error")]
    assert read_csv(tmp_path / "s.csv").labels == ("P1", "C2", "C3", "C5", "C6", "C7", "C8")


def test_the_controllers_joint_positions_can_be_asked_for(tmp_path: Path) -> None:
    given = {"centre": (0.4, 0.0, 0.3), "side": 0.2}
    fanuc = package.poses("lrmate200ic", "p1-p5", out=tmp_path / "c.csv", **given)  # type: ignore[arg-type]
    assert "axis_1 [deg]" in (tmp_path / "c.csv").read_text().splitlines()[0]
    package.poses("lrmate200ic", "p1-p5", joints="model", out=tmp_path / "m.csv", **given)  # type: ignore[arg-type]
    assert read_csv(tmp_path / "m.csv").joints == pytest.approx(fanuc.joints, abs=1e-12)
    shown = package.load_data(tmp_path / "c.csv", "lrmate200ic")
    assert shown.joints == pytest.approx(fanuc.joints, abs=1e-9)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"set": "p6"}, "no set of poses of this name"),
        ({"set": "sphere"}, "the sphere needs its centre and its size"),
        ({"set": "p1-p5", "centre": (0.3, 0, 0.3)}, "a cube needs its centre and its side"),
        ({"set": "p1-p5", "centre": (0.3, 0, 0.3), "side": 0.0}, "side"),
        ({"set": "p1-p5", "centre": (0.3, 0, 0.3), "side": -1.0}, "side"),
        ({"set": "p1-p5", "centre": (0.3, 0, 0.3), "side": 0.2, "count": 5}, "has a number of poses of its own"),
        ({"set": "p1-p5", "plane": "C1"}, "no plane of this name"),
        ({"set": "p1-p5", "ahead": "up"}, "no ahead of this name"),
        ({"set": "p1-p5", "tip_orientation": (1.0, 1.0, 0.0, 0.0)}, "has length 1"),
        ({"set": "p1-p5", "tip_orientation": "up"}, "no orientation of this name"),
        ({"set": "p1-p5", "target": "a", "tip": (0, 0, 0.1)}, "only one of them can go to the poses"),
        ({"set": "p1-p5", "target": "a"}, "there is no target"),
        ({"set": "p1-p5", "lowest": 5.0}, "reaches no cube"),
    ],
)
def test_what_no_set_can_be_is_refused(given: dict[str, object], said: str) -> None:
    with pytest.raises(InputError) as refusal:
        package.poses("irb120", **given)  # type: ignore[arg-type]
    assert said in str(refusal.value), refusal.value
    assert refusal.value.parameter


def test_a_device_finds_its_own_configurations(tmp_path: Path) -> None:
    package.poses("irb120", "p1-p5", centre=(0.35, 0.0, 0.35), side=0.2, out=tmp_path / "p.csv")
    with pytest.raises(InputError, match="a device finds its own configurations"):
        package.simulate("irb120", truth="nominal", poses=tmp_path / "p.csv", device="tracker")


# -- paths -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    robot = EXAMPLES["path"](tmp_path_factory.mktemp("path"))["robot"]
    assert isinstance(robot, Path)
    return robot


def test_a_path_is_written_with_its_correction_and_programs(truearm: Truearm, calibrated: Path, tmp_path: Path) -> None:
    (tmp_path / "path.yaml").write_text(PATH)
    out = tmp_path / "out"
    words = ("--program", "rapid", "--program", "val3", "--spacing", 0.3, "--seed-joints", "0,11,23,0,52,0")
    run = truearm("path", calibrated, tmp_path / "path.yaml", *words, "--out", out)
    assert run.code == 0, run.err
    names = ["motion.csv", "corrected.csv", "loads.csv", "report.html", "truearm_path.mod"]
    names += [f"truearm_path/{name}" for name in ("truearm_path.dtx", "start.pgx", "truearm_path.pjx")]
    assert all((out / name).is_file() for name in names)
    assert "without correction" in run.out
    assert "geometry corrected" in run.out
    header, *rows = (line.split(",") for line in (out / "corrected.csv").read_text().splitlines())
    assert header == [
        *("time [s]", "section"),
        *(f"joint_{i} [deg]" for i in range(1, 7)),
        *("tip_x [mm]", "tip_y [mm]", "tip_z [mm]", "error_before [mm]", "error_after [mm]"),
    ]
    table = np.array(rows, float)
    found = package.path(calibrated, tmp_path / "path.yaml", seed_joints=np.radians([0, 11, 23, 0, 52, 0]))
    assert np.radians(table[:, 2:8]) == pytest.approx(found.joints, abs=1e-12)
    assert table[:, 8:11] == pytest.approx(1e3 * found.path.planned.trajectory.position, abs=1e-5)
    assert table[:, 12].max() < 1e-5 < table[:, 11].mean()
    loads = (out / "loads.csv").read_text().splitlines()
    assert loads[0].startswith("time [s],force_x_1 [N],force_y_1 [N],force_z_1 [N],moment_x_1 [N m]")
    assert len(loads) == len(rows) + 1
    codes = {
        notice.code: notice.level
        for notice in package.path(calibrated, tmp_path / "path.yaml", languages=["krl"]).warnings
    }
    assert codes["maker"] == "warning"
    assert codes["untimed-moves"] == "note"
    poses = partial(package.path, calibrated, tmp_path / "path.yaml", languages=["rapid"], move_to="poses", spacing=0.5)
    with pytest.raises(InputError, match="Absolute Accuracy"):
        poses()
    far = poses(controller_kinematics="nominal")
    assert {notice.code: notice.level for notice in far.warnings}["between-targets"] == "warning"


def test_a_nominal_robot_follows_the_path_and_is_not_corrected(tmp_path: Path) -> None:
    (tmp_path / "path.yaml").write_text(PATH)
    found = package.path(
        "irb120", tmp_path / "path.yaml", languages=["urscript"], move_to="poses", out=tmp_path / "out"
    )
    assert not (tmp_path / "out" / "corrected.csv").exists()
    assert "nothing to correct" in found.lines()[1]
    assert "corrected by truearm" not in found.programs["truearm_path.script"]
    assert found.summary()["error_mm"] == {}


def test_poses_for_a_controller_with_kinematics_of_its_own_are_refused(tmp_path: Path) -> None:
    robot = package.load_robot("ur5")
    robot = robot.with_values({"a_2": robot.values["a_2"] + 1e-3})
    (tmp_path / "path.yaml").write_text(PATH.replace("joint_speeds: [250, 250, 250, 320, 320, 420]\n", ""))
    given = {"languages": ["urscript"], "seed_joints": np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])}
    assert package.path(robot, tmp_path / "path.yaml", **given).programs  # type: ignore[arg-type]
    with pytest.raises(InputError, match="what the factory measured") as refusal:
        package.path(robot, tmp_path / "path.yaml", move_to="poses", **given)  # type: ignore[arg-type]
    assert refusal.value.parameter == "controller_kinematics"
    said = package.path(robot, tmp_path / "path.yaml", move_to="poses", controller_kinematics="nominal", **given)  # type: ignore[arg-type]
    assert "controller-nominal" in {notice.code for notice in said.warnings}


@pytest.mark.parametrize(
    ("given", "said", "parameter"),
    [
        ({"languages": ["basic"]}, "no language of this name", "languages"),
        ({"languages": ["rapid"], "name": "2nd"}, "cannot be called so in every language", "name"),
        ({"languages": ["rapid"], "move_to": "pulses"}, "no kind of targets of this name", "move_to"),
        ({"seed_joints": (0.0, 0.0)}, "seed_joints", "seed_joints"),
        ({"accept": ["anything"]}, "anything", "accept"),
        ({"seed_joints": (0.0, 0.2, 0.4, 0.0, 0.0, 0.0), "file": "way.yaml"}, "no such file", "file"),
    ],
)
def test_what_cannot_be_followed_is_refused(
    given: dict[str, object], said: str, parameter: str, calibrated: Path, tmp_path: Path
) -> None:
    (tmp_path / "path.yaml").write_text(PATH)
    arguments = {"file": tmp_path / "path.yaml"} | given
    with pytest.raises(InputError) as refusal:
        package.path(calibrated, **arguments)  # type: ignore[arg-type]
    assert said in str(refusal.value), refusal.value
    assert refusal.value.parameter == parameter


def test_a_place_on_the_path_is_told_where_it_cannot_be_followed(calibrated: Path, tmp_path: Path) -> None:
    file = tmp_path / "path.yaml"
    file.write_text(PATH.replace("- line: [350, 60, 250]", "- line: [350, 60, 250]\n  - line: [900, 60, 250]"))
    with pytest.raises(InputError, match=r"mm along the path, at .* s \(sample \d+\)") as refusal:
        package.path(calibrated, file)
    assert refusal.value.parameter == "file"


# -- sphere tests ------------------------------------------------------------------------------------------


def _bar(robot: Robot, count: int, noise: float) -> Dataset:
    """Lengths from the tool of a robot to a ball, and where it was taught."""
    rng = np.random.default_rng(3)
    joints = robot.random_configurations(count, rng)
    centre = np.array([0.3, 0.1, 0.2])
    at_ball = robot.inverse(centre, np.diag([1.0, -1.0, -1.0]), target="ball", frame="world").joints
    joints = np.concatenate([at_ball, joints])
    places = Twin(robot).frames(joints)["ball"][:, :3, 3]
    lengths = np.linalg.norm(places - centre, axis=1) + noise * rng.standard_normal(len(joints))
    lengths[[0, 5]] = np.nan
    number = np.arange(len(joints))
    return Dataset(
        source="bar.csv",
        labels=("taught", *(str(k) for k in number[1:])),
        joints=joints,
        joint_kinds=("revolute",) * 6,
        targets=("ball",),
        configuration=number,
        target=np.zeros(len(joints), dtype=np.intp),
        position=np.full((len(joints), 3), np.nan),
        distance=lengths,
        fixtures=("cup",),
        fixture=np.zeros(len(joints), dtype=np.intp),
    )


@pytest.fixture(scope="module")
def true() -> Robot:
    robot = package.load_robot("irb120")
    rng = np.random.default_rng(1)
    drawn = {
        p.name: p.value + p.prior * rng.standard_normal() for p in robot.parameters.values() if p.group == "geometry"
    }
    return robot.with_values(drawn).with_frames(robot.base, {"ball": (0.01, 0.0, 0.125)})


def test_a_sphere_is_judged_before_and_after_calibration(true: Robot) -> None:
    data = _bar(true, 40, 1e-6)
    found = package.sphere(true, data)
    (one,) = found.spheres
    assert (one.target, one.fixture, len(one.lengths), one.left_out) == ("ball", "cup", 39, 2)
    assert one.after.largest < 4e-6
    assert one.before is not None
    assert one.before.deviation > 0.2e-3
    assert found.summary()["spheres"][0]["nominal_mm"]["deviation"] > 0.2
    taught = package.sphere(true, data, taught_at="taught")
    assert taught.spheres[0].after.centre == pytest.approx([0.3, 0.1, 0.2], abs=1e-8)
    assert taught.spheres[0].after.largest < 4e-6
    assert taught.spheres[0].before is not None
    assert (taught.spheres[0].before.errors ** 2).sum() > (one.before.errors**2).sum()  # teaching had errors of its own
    assert "taught at configuration taught" in taught.lines()[0]
    alone = package.sphere("irb120", data, tip=(0.01, 0.0, 0.125))
    assert alone.spheres[0].before is None
    assert alone.spheres[0].after.deviation > 0.2e-3


def test_the_command_says_mean_deviation_and_largest(truearm: Truearm, true: Robot, tmp_path: Path) -> None:
    (tmp_path / "bar.csv").write_text(csv_text(_bar(true, 30, 1e-6)))
    run = truearm("sphere", "irb120", tmp_path / "bar.csv", "--tip", "10,0,125", "--out", tmp_path / "bar.html")
    assert run.code == 0, run.err
    assert "ball about cup, 29 readings, 2 beyond the range of the bar" in run.out
    assert "this robot  mean" in run.out
    assert "mm along" not in run.out
    assert "Measured less predicted distance of each reading" in (tmp_path / "bar.html").read_text()


def test_what_no_sphere_test_is_made_of_is_refused(true: Robot, tmp_path: Path) -> None:
    data = _bar(true, 30, 1e-6)
    with pytest.raises(InputError, match="no configuration of this name") as refusal:
        package.sphere(true, data, taught_at="x")
    assert refusal.value.parameter == "taught_at"
    assert data.distance is not None
    with pytest.raises(InputError, match="no distances of a ballbar"):
        package.sphere(true, replace(data, distance=np.full(31, np.nan)))
    with pytest.raises(InputError, match="ball"):
        package.sphere("irb120", data)
    few = data.of_configurations([0, 1, 2, 3])
    with pytest.raises(InputError, match="too few lengths"):
        package.sphere(true, few)
    (tmp_path / "bar.csv").write_text(csv_text(data).replace("distance [mm]", "distance"))
    with pytest.raises(InputError, match="no unit is given"):
        package.sphere(true, tmp_path / "bar.csv")
