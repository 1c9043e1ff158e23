"""A force at the tool in the jobs that take one: inverse, validate, simulate and compensate."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.answered import ANSWERS, compensate
from tests.calibration.test_external_force import HIGH, LOW, elastic_twin
from tests.plate import PLATE
from typer.testing import CliRunner

import truearm
from truearm.commands import program
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.wrench import Wrench
from truearm.engine.twin.twin import Twin, measure

TEXT = "0N,8N,0N,0Nm,0Nm,0.5Nm"


@pytest.fixture(scope="module")
def campaign() -> tuple[Twin, Robot]:
    """An elastic IRB 120, measured with a force to all sides in half of the configurations."""
    twin, rng = elastic_twin(), np.random.default_rng(5)
    wrench = np.zeros((60, 6))
    wrench[::2, :3] = 10.0 * rng.standard_normal((30, 3))
    data = measure(twin, rng.uniform(LOW, HIGH, (60, 6)), 0.03e-3, rng, wrench=wrench)
    return twin, truearm.calibrate("irb120", data, model="elastic", payload=twin.robot.payload).robot


@pytest.fixture
def cell(campaign: tuple[Twin, Robot], tmp_path: Path) -> Path:
    from truearm.engine.robot.robot_file.writing import robot_text

    (tmp_path / "calibrated.yaml").write_text(robot_text(campaign[1]))
    (tmp_path / "plate.mod").write_text(PLATE)
    return tmp_path


def codes(result: Any) -> set[str]:
    return {notice.code for notice in result.warnings}


# -- inverse ---------------------------------------------------------------------------------------------


def test_the_target_goes_to_the_pose_under_the_force(campaign: tuple[Twin, Robot]) -> None:
    _, robot = campaign
    q = np.random.default_rng(1).uniform(0.2, 0.8, (3, 6))
    wanted = robot.forward(q, target="1")
    frames: tuple[Any, ...] = ("base", "tool", "world", "controller")
    for frame in frames:
        solution = truearm.inverse(robot, *wanted, seed_joints=q, target="1", wrench=TEXT, wrench_frame=frame)
        assert "force-taken" in codes(solution), frame
        pushed = robot.with_wrench(Wrench.of(TEXT, frame), "1")
        np.testing.assert_allclose(pushed.forward(solution.joints, target="1")[0], wanted[0], atol=2e-9, err_msg=frame)
        assert np.abs(solution.joints - q).max() > 1e-5, frame
        same = truearm.inverse(robot, *wanted, seed_joints=q, target="1", wrench=Wrench.of(TEXT, frame))
        np.testing.assert_array_equal(same.joints, solution.joints)


def test_the_force_acts_on_the_controllers_flange_where_poses_are_the_controllers(campaign: tuple[Twin, Robot]) -> None:
    from truearm.engine.robot.transform import Transform

    _, robot = campaign
    flange = Transform((0.0, 0.0, 0.1), (0.5, 0.5, 0.5, 0.5))
    robot = replace(robot, controller=replace(robot.controller, flange=flange))
    q = np.full((1, 6), 0.4)
    wanted = robot.forward(q, frame="controller")
    solution = truearm.inverse(robot, *wanted, seed_joints=q, frame="controller", wrench=TEXT, wrench_frame="tool")
    pushed = robot.with_wrench(Wrench.of(TEXT, "tool"), flange)
    np.testing.assert_allclose(pushed.forward(solution.joints, frame="controller")[0], wanted[0], atol=2e-9)


@pytest.mark.parametrize(
    ("given", "parameter", "said"),
    [
        ({"wrench": "0,0,80,0,0"}, "wrench", "three forces and three moments"),
        ({"wrench": "0,0,nan,0,0,0"}, "wrench", "a number belongs here"),
        ({"wrench": "0,0,8kg,0,0,0"}, "wrench", "no unit of a force"),
        ({"wrench": [0, 0, 8, 0, 0]}, "wrench", "wrong shape"),
        ({"wrench": 8}, "wrench", "a wrench belongs here"),
        ({"wrench": TEXT, "wrench_frame": "flange"}, "wrench_frame", "there is no wrench_frame of this name"),
        ({"wrench_frame": "tool"}, "wrench_frame", "no force is given"),
        ({"wrench": Wrench((1.0, 0.0, 0.0)), "wrench_frame": "tool"}, "wrench_frame", "the wrench says its own frame"),
        ({"wrench": "0,0,30,0,0,0"}, "wrench", "larger than irb120 is rated for"),
    ],
)
def test_a_wrench_that_cannot_be_meant_is_refused(given: dict[str, Any], parameter: str, said: str) -> None:
    robot = truearm.load_robot("irb120")
    with pytest.raises(InputError) as refusal:
        truearm.inverse(robot, *robot.forward(np.full((1, 6), 0.3)), **given)
    assert said in str(refusal.value)
    assert refusal.value.parameter == parameter


def test_the_command_names_the_option(cell: Path) -> None:
    (cell / "poses.csv").write_text("pose,x [mm],y [mm],z [mm],qw,qx,qy,qz\nA,300,100,400,0,0,1,0\n")
    words = ["ik", "irb120", str(cell / "poses.csv"), "--out", str(cell / "joints.csv")]
    run = CliRunner().invoke(program(), [*words, "--wrench", "0,0,80,0,0,0"])
    assert "--wrench: the force is larger than irb120 is rated for" in str(run.exception)
    run = CliRunner().invoke(program(), [*words, "--wrench", "0,0,20,0,0,0"])
    assert "Warning (force-on-rigid-model)" in " ".join(run.output.split())


# -- simulate and validate -------------------------------------------------------------------------------


@pytest.mark.parametrize("device", [None, "tracker"])
def test_what_is_simulated_under_a_force_says_so(campaign: tuple[Twin, Robot], device: str | None) -> None:
    def worst(data: Dataset, **force: Any) -> tuple[float, set[str]]:
        result = truearm.validate(robot, data, **force)
        assert result.position is not None
        return result.position.max, codes(result)

    _, robot = campaign
    options: dict[str, Any] = {"truth": robot, "poses": 5, "noise": 0.0, "device": device}
    force: dict[str, Any] = {"wrench": TEXT, "wrench_frame": "tool", "wrench_at": "2"}
    data = truearm.simulate(robot, **options, **force).data
    assert data.wrench is not None
    assert truearm.simulate(robot, **options).data.wrench is None
    np.testing.assert_allclose(np.linalg.norm(data.wrench[:, :3], axis=1), 8.0)
    bare = replace(data, wrench=None)
    for most, told in (worst(data), worst(bare, **force)):
        assert most < 1e-9
        assert "force-taken" in told
    assert worst(bare)[0] > 0.05e-3


def test_the_data_file_holds_the_force(campaign: tuple[Twin, Robot], tmp_path: Path) -> None:
    _, robot = campaign
    data = truearm.simulate(robot, truth=robot, poses=3, noise=0.0, wrench=TEXT, wrench_at="flange").data
    assert "force_y [N]" in csv_text(data).splitlines()[0]
    assert data.wrench is not None
    np.testing.assert_allclose(data.wrench, [[0, 8, 0, 0, 0, 0.5]] * 3, atol=1e-12)


@pytest.mark.parametrize(
    ("given", "parameter", "said"),
    [
        ({"wrench": TEXT}, "wrench_at", "there are several targets, and a force acts on one point"),
        ({"wrench": TEXT, "wrench_at": "4"}, "wrench_at", "no target of this name; got '4'; allowed: 1, 2, 3, flange"),
        ({"wrench_at": "1"}, "wrench_at", "no force is given"),
        ({"wrench_frame": "tool"}, "wrench_frame", "no force is given"),
        ({"wrench": "1,2,3", "wrench_at": "1"}, "wrench", "three forces"),
        ({"wrench": "0,0,99,0,0,0", "wrench_at": "1"}, "wrench", "larger than irb120 is rated for"),
    ],
)
def test_where_the_force_acts_is_never_guessed(
    campaign: tuple[Twin, Robot], given: dict[str, Any], parameter: str, said: str
) -> None:
    _, robot = campaign
    data = truearm.simulate(robot, truth=robot, poses=3, noise=0.0).data
    for call in (
        lambda: truearm.validate(robot, data, **given),
        lambda: truearm.simulate(robot, truth=robot, poses=3, noise=0.0, **given),
    ):
        with pytest.raises(InputError) as refusal:
            call()
        assert said in str(refusal.value)
        assert refusal.value.parameter == parameter


def test_data_that_say_the_force_are_told_no_other(campaign: tuple[Twin, Robot]) -> None:
    _, robot = campaign
    data = truearm.simulate(robot, truth=robot, poses=3, noise=0.0, wrench=TEXT, wrench_at="1").data
    with pytest.raises(InputError, match="the data say what acted on the flange; got 'the columns force_x"):
        truearm.validate(robot, data, wrench=TEXT, wrench_at="1")


def test_one_target_is_where_the_force_acts(campaign: tuple[Twin, Robot]) -> None:
    _, robot = campaign
    arm = robot.with_frames(robot.base, {"tip": (0.0, 0.0, 0.12)})
    options: dict[str, Any] = {"truth": arm, "poses": 3, "noise": 0.0, "wrench": TEXT}
    plain, named = (truearm.simulate(arm, **options, wrench_at=at).data for at in (None, "tip"))
    np.testing.assert_array_equal(plain.position, named.position)


# -- compensate ------------------------------------------------------------------------------------------


def test_a_program_is_corrected_for_a_force(cell: Path) -> None:
    robot, program = cell / "calibrated.yaml", cell / "plate.mod"
    free = compensate(robot, [program], payload="0.5kg,0mm,0mm,60mm")
    pushed = compensate(
        robot, [program], payload="0.5kg,0mm,0mm,60mm", wrench=TEXT, wrench_frame="tool", out=cell / "out"
    )
    assert "force-taken" in codes(pushed) - codes(free)
    assert all(part in pushed.command for part in (f"wrench='{TEXT}'", "wrench_frame='tool'"))
    assert pushed.files[0].text != free.files[0].text
    record = json.loads((cell / "out" / "plate.mod.truearm.json").read_text())
    assert record["applied"]["wrenches"] == [
        {"force_n": [0.0, 8.0, 0.0], "moment_nm": [0.0, 0.0, 0.5], "frame": "tool"}
    ]


def test_a_file_says_what_acts_where(cell: Path) -> None:
    text = (
        "truearm: truearm-cell/1\nunits: {length: mm, angle: deg, force: N, moment: N m}\n"
        "tools:\n  tProbe: {of: flange, target: '1'}\n"
        "wrenches:\n  - {targets: [pHole1], force: [0, 8, 0]}\n"
    )
    file = cell / "cell.yaml"
    file.write_text(text)
    words = ["compensate", str(cell / "calibrated.yaml"), str(cell / "plate.mod"), "--out", str(cell / "out"), *ANSWERS]
    run = CliRunner().invoke(program(), [*words, "--tools", str(file), "--wrench", str(file), "--json"])
    assert "force-taken" in {notice["code"] for notice in json.loads(run.output)["warnings"]}
    said: tuple[tuple[list[str], str], ...] = (
        ([], str(file) + ": the file has wrenches, and nothing takes them. Give the file as --wrench"),
        (["--wrench", str(file), "--wrench-frame", "tool"], "--wrench-frame: the file says the frame of each force"),
        (["--wrench", str(cell / "no.yaml")], "there is no such file"),
        (["--wrench", "1,2,3,4,5"], "--wrench: three forces and three moments belong here"),
    )
    for more, message in said:
        run = CliRunner().invoke(program(), [*words, "--tools", str(file), *more])
        assert message in str(run.exception)


def test_a_file_may_not_be_replaced_and_a_robot_not_pushed_twice(cell: Path, campaign: tuple[Twin, Robot]) -> None:
    with pytest.raises(InputError, match="something acts on the tool of this robot already"):
        compensate(campaign[1].with_wrench(Wrench((0.0, 5.0, 0.0))), [cell / "plate.mod"])
    (cell / "cell.yaml").write_text(
        "truearm: truearm-cell/1\nunits: {length: mm, angle: deg, force: N}\n"
        "wrenches:\n  - {targets: [pHole1], force: [0, 80, 0]}\n"
    )
    with pytest.raises(InputError, match="larger than irb120 is rated for") as refusal:
        compensate(cell / "calibrated.yaml", [cell / "plate.mod"], wrench=cell / "cell.yaml")
    assert refusal.value.parameter == "wrench"
    assert "cell.yaml, wrenches[1]" in str(refusal.value)
