"""The job that runs the tests of a plan on a twin: its files, before and after a correction, and its refusals."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.performance_plan import small_plan

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rotation_vector
from truearm.engine.twin.truths import truth_twin
from truearm.iso9283.simulating.simulate import Iso9283Simulation

TRUTH = "tracker-triangular"


@pytest.fixture(scope="module")
def calibrated() -> Robot:
    data = truearm.simulate("irb120", truth=TRUTH, poses=120, noise=3e-5, seed=3).data
    return truearm.calibrate("irb120", data, model="elastic", payload="2.7kg,50mm,25mm,100mm").robot


def accuracy(simulation: Iso9283Simulation, pose: str) -> tuple[float, float]:
    """Return how far the middle of what was attained is from the command, and by how much it scatters [m]."""
    poses, tie = simulation.campaign.poses, simulation.tie.T_base_instrument
    assert poses is not None
    attained = poses.position[poses.pose.are(pose)] @ tie.rotation.T + np.array(tie.translation)
    middle = attained.mean(axis=0)
    commanded = small_plan(["AP"]).poses[pose].position
    return float(np.linalg.norm(middle - commanded)), float(np.linalg.norm(attained - middle, axis=1).std(ddof=1))


def test_corrected_commands_are_ten_times_as_accurate_and_as_repeatable(calibrated: Robot) -> None:
    plan = small_plan(["AP"], cycles={"AP": 15})
    before, after = (
        truearm.iso9283_simulate("irb120", plan, truth=TRUTH, seed=5, corrected=robot) for robot in (None, calibrated)
    )
    assert before.tie == after.tie
    assert not after.warnings
    for pose in ("P1", "P2", "P3", "P4", "P5"):
        (far, spread), (near, again) = accuracy(before, pose), accuracy(after, pose)
        assert far > 10 * near
        assert 0.4 < again / spread < 2.5


def test_a_calibration_of_another_truth_is_told(calibrated: Robot) -> None:
    plan = small_plan(["AP"], cycles={"AP": 1})
    simulation = truearm.iso9283_simulate("irb120", plan, truth="random", seed=1, corrected=calibrated)
    (notice,) = simulation.warnings
    assert (notice.code, notice.level) == ("another-truth", "warning")
    assert "calibrated on another truth" in simulation.lines()[-1]
    assert simulation.summary()["warnings"][0]["code"] == "another-truth"


def test_a_path_is_corrected_as_well(calibrated: Robot) -> None:
    plan = small_plan(["AV"], cycles={"AV": 1})
    line = plan.paths["line"].points
    along = (line[1] - line[0]) / np.linalg.norm(line[1] - line[0])
    off = []
    for robot in (None, calibrated):
        simulation = truearm.iso9283_simulate("irb120", plan, truth=TRUTH, seed=5, corrected=robot)
        tie, paths = simulation.tie.T_base_instrument, simulation.campaign.paths
        assert paths is not None
        way = paths.position @ tie.rotation.T + np.array(tie.translation) - line[0]
        off.append(float(np.linalg.norm(way - np.outer(way @ along, along), axis=1).mean()))
    assert off[0] > 5 * off[1]


def test_the_files_have_the_columns_and_units_that_are_read(tmp_path: Path) -> None:
    plan = small_plan(["AP", "E", "AV", "t", "compliance"], cycles={"AP": 1, "E": 1, "AV": 1, "t": 1, "compliance": 1})
    simulation = truearm.iso9283_simulate("irb120", plan, rate=50.0, out=tmp_path / "run")
    texts = {path.name: path.read_text().splitlines() for path in (tmp_path / "run").iterdir()}
    place, turn = "x [mm],y [mm],z [mm]", "qw,qx,qy,qz"
    shares = "velocity [%],load [%],time [s]"
    assert texts["poses.csv"][0] == f"criterion,robot,pose,cycle,approach,{shares},{place},{turn},simulated"
    assert texts["paths.csv"][0] == f"criterion,path,cycle,{shares},{place},{turn},simulated"
    assert texts["settling.csv"][0] == f"criterion,pose,cycle,time [s],{place},simulated"
    assert texts["forces.csv"][0] == f"direction,force [N],cycle,{place},simulated"
    assert texts["alignment.yaml"][1] == "truearm: truearm-alignment/1"
    rows = {name: len(lines) - 1 for name, lines in texts.items() if name.endswith(".csv")}
    assert rows == {f"{name}.csv": count for name, count in simulation.summary()["rows"].items()}
    first = texts["paths.csv"][1].split(",")
    paths = simulation.campaign.paths
    assert paths is not None
    assert first[:5] == ["AV", "line", "1", "100", "100"]
    np.testing.assert_allclose([float(v) for v in first[6:9]], 1e3 * paths.position[0], atol=1e-6)
    assert texts["poses.csv"][6].split(",")[:3] == ["E", "r1", "P5"]
    assert simulation.written == ("poses.csv", "paths.csv", "settling.csv", "forces.csv", "alignment.yaml")


def test_the_tie_is_off_by_what_it_states() -> None:
    plan = small_plan(["AP"], cycles={"AP": 1})
    plan = replace(plan, tests=(replace(plan.tests[0], places=("P1",)),))
    base = truth_twin(plan.robot, "nominal", np.random.default_rng(0)).robot.base.matrix
    off = []
    for seed in range(60):
        tie = truearm.iso9283_simulate("irb120", plan, truth="nominal", seed=seed).tie
        off.append(tie.T_base_instrument.matrix @ base)
    assert np.array(off)[:, :3, 3].std() == pytest.approx(tie.sigma, rel=0.25)
    assert rotation_vector(np.array(off)[:, :3, :3]).std() == pytest.approx(tie.sigma_rot, rel=0.25)
    assert (tie.sigma, tie.sigma_rot) == (2e-5, math.radians(0.002))


def test_robots_that_are_exchanged_differ(tmp_path: Path) -> None:
    plan = small_plan(["E"], cycles={"E": 1})
    for truth in ("random", TRUTH):
        poses = truearm.iso9283_simulate("irb120", plan, truth=truth).campaign.poses
        assert poses is not None
        places = np.array([poses.position[poses.robot.are(f"r{k}") & poses.pose.are("P1")][0] for k in range(1, 6)])
        apart = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(5, 1)]
        assert apart.min() > 1e-4
        assert apart.max() < 0.05


def test_what_cannot_be_simulated_is_refused(calibrated: Robot) -> None:
    plan = small_plan(["AP"], cycles={"AP": 1})
    x, y, z = calibrated.base.translation
    elsewhere = calibrated.with_frames(replace(calibrated.base, translation=(x + 0.1, y, z)), {})
    ur5 = load_robot("ur5")
    ur5_calibrated = ur5.with_values({"theta_offset_2": ur5.values["theta_offset_2"] + 1e-3})
    cases: list[tuple[str, dict[str, Any], str]] = [
        ("ur5", {}, "this plan is of another robot"),
        ("katana450", {}, "this is another robot than katana450"),
        ("irb120", {"truth": load_robot("katana450")}, "this robot has other joints than irb120"),
        ("irb120", {"truth": "trakcer"}, "irb120 has no truth of this name"),
        ("irb120", {"truth": 3}, "a truth belongs here"),
        ("irb120", {"plan": 3}, "a plan belongs here"),
        ("irb120", {"corrected": "irb120"}, "this robot is not calibrated"),
        ("irb120", {"truth": TRUTH, "corrected": elsewhere}, "calibrated in the frame of another instrument"),
        ("irb120", {"corrected": "katana450"}, "this is another robot than irb120"),
        ("irb120", {"corrected": ur5_calibrated}, "this is another robot than irb120"),
    ]
    for robot, options, words in cases:
        with pytest.raises(InputError, match=words):
            truearm.iso9283_simulate(robot, **{"plan": plan, **options})


def test_a_robot_of_which_no_compliance_is_known_gives_way_to_pushes_as_real_ones_do() -> None:
    plan = small_plan(["compliance", "AP"], cycles={"compliance": 1, "AP": 1})
    for truth in ("random", "nominal"):
        simulation = truearm.iso9283_simulate("irb120", plan, truth=truth, noise=0.0, seed=4)
        forces, tie = simulation.campaign.forces, simulation.tie.T_base_instrument
        assert forces is not None
        for way in forces.direction.names:
            rows = forces.direction.are(way)
            along = (forces.position[rows] @ tie.rotation.T)[:, "xyz".index(way[1])] * (1 if way[0] == "+" else -1)
            slope = np.polyfit(forces.force[rows], along, 1)[0]
            assert 5e-7 < slope < 5e-5, (truth, way)  # 0.5 to 50 um/N
