"""Tables of configurations without readings, as plans have them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.data.readers.configurations import read_configurations, read_stops
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure

HEAD = "configuration,joint_1 [deg],joint_2 [mm],approach_1 [deg],approach_2 [mm],reads\n"


def written(folder: Path, text: str) -> Path:
    (folder / "plan.csv").write_text(text)
    return folder / "plan.csv"


def test_a_row_is_a_configuration_that_nobody_has_seen(tmp_path: Path) -> None:
    data = read_configurations(written(tmp_path, HEAD + "P1,90,10,88,5,tip\nP2,-90,20,-92,15,tip\n"))
    assert data.labels == ("P1", "P2")
    assert data.joint_kinds == ("revolute", "prismatic")
    assert data.joints == pytest.approx(np.array([[np.pi / 2, 0.01], [-np.pi / 2, 0.02]]))
    assert (data.joints_are, bool(data.has_position.any())) == ("model", False)
    shown = read_configurations(written(tmp_path, "configuration,axis_1 [rad]\nA,1\nB,2\n"))
    assert (shown.joints_are, shown.joints.ravel().tolist()) == ("controller", [1.0, 2.0])
    pulled = "configuration,order,joint_1 [deg],force_x [N],force_y [N],force_z [N],reads\n1,1,5,0,0,-20,positions\n"
    assert read_configurations(written(tmp_path, pulled)).labels == ("1",)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEAD.replace("joint_1 [deg]", "joint_1") + "P1,1,1,1,1,\n", "column 2, joint_1: no unit is given"),
        (HEAD.replace("joint_2 [mm]", "joint_3 [mm]") + "P1,1,1,1,1,\n", "the column joint_2 is missing"),
        (HEAD.replace("joint_2 [mm]", "axis_2 [mm]") + "P1,1,1,1,1,\n", "joint positions of one kind"),
        (HEAD.replace("reads", "speed") + "P1,1,1,1,1,\n", "column 6: the column is not known in a table of config"),
        (HEAD.replace("reads", "joint_1 [deg]") + "P1,1,1,1,1,1\n", "the column joint_1 appears twice"),
        (HEAD.replace("configuration", "stop") + "P1,1,1,1,1,\n", "column 1: the column is not known"),
        (HEAD.replace("configuration,", "") + "1,1,1,1,\n", "the column configuration is missing"),
        (HEAD + "P1,1,,1,1,\n", "line 2, column joint_2 [mm]"),
        (HEAD + "P1,1,x,1,1,\n", "line 2, column joint_2 [mm]"),
        (HEAD + "P1,1,1,1\n", "line 2"),
        (HEAD + "P1,1,1,1,1,\nP1,2,1,1,1,\n", "the joints of configuration 'P1' differ"),
        (HEAD.replace(",", ";") + "P1;1;1;1;1;\n", "separated by commas"),
        (HEAD, "a header and no rows"),
        ("a,b\n1,2\n", "the column is not known"),
        ("\n \n", "the file is empty"),
    ],
)
def test_what_cannot_be_is_refused_with_its_place(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError) as refusal:
        read_configurations(written(tmp_path, text))
    assert words in str(refusal.value)
    assert str(tmp_path / "plan.csv") in str(refusal.value)


@pytest.mark.parametrize(("robot", "joints_are"), [("irb120", "model"), ("lrmate200id", "controller")])
def test_a_plan_is_taken_where_configurations_are(robot: str, joints_are: str, tmp_path: Path) -> None:
    table = tmp_path / "plan.csv"
    first = truearm.plan(robot, poses=15, candidates=60, no_floor=True, clearance=0.0, out=table)
    assert first.joints_are == joints_are
    some = truearm.plan(robot, poses=10, candidates_from=table)
    assert set(some.labels) <= set(first.labels)
    at = dict(zip(first.labels, first.joints, strict=True))
    assert some.joints == pytest.approx(np.array([at[label] for label in some.labels]))
    seen = truearm.simulate(robot, truth="nominal", poses=table, noise=0.0).data
    model = truearm.load_data(seen, robot) if seen.joints_are == "controller" else seen
    assert (seen.labels, len(seen.position)) == (first.labels, 45)
    assert model.joints == pytest.approx(first.joints)


@pytest.mark.parametrize("name", ["irb120", "lrmate200id"])
def test_a_twin_comes_to_a_plan_as_the_robot_does_that_drives_its_ways(name: str, tmp_path: Path) -> None:
    table, file = tmp_path / "plan.csv", tmp_path / "twin.csv"
    planned = truearm.plan(name, poses=12, candidates=80, clearance=0.02, out=table)
    assert planned.tour is not None
    arm = truearm.load_robot(name).with_effects(["approach"])
    truth = arm.with_values({parameter: 2e-3 for parameter in arm.parameters if parameter.startswith("approach_")})
    simulation = truearm.simulate(name, truth=truth, poses=table, noise=0.0, out=file)
    assert simulation.lines()[2].startswith("Before each the arm stopped at its approach_i;")
    twin = truth_twin(planned.made.robot, truth, np.random.default_rng(0))
    stops = planned.tour.stops
    driven = measure(twin, np.array([stop.joints for stop in stops]), 0.0, np.random.default_rng(0))
    rows = [row for row, stop in enumerate(stops) if stop.kind == "measure"]
    every = driven.position.reshape(len(stops), -1, 3)[rows].reshape(-1, 3)
    assert simulation.data.position == pytest.approx(every, abs=1e-12)
    joints = np.array([stops[row].joints for row in rows])
    straight = measure(twin, joints, 0.0, np.random.default_rng(0))
    assert np.abs(straight.position - every).max() > 1e-4  # from the configuration before it stands elsewhere
    again = truearm.load_data(file)
    assert again.approach is not None
    assert not again.approach.any()  # nobody takes it that joints came from the configuration before
    assert again.number is not None
    assert again.number.tolist() == list(range(1, 24, 2))


def test_a_program_without_stops_before_has_a_plan_without_them(tmp_path: Path) -> None:
    truearm.plan("irb120", poses=10, candidates=60, clearance=0.02, program="rapid", out=tmp_path / "made")
    table = tmp_path / "made" / "plan.csv"
    assert "approach" not in table.read_text()
    assert read_stops(table) is None
    simulation = truearm.simulate("irb120", truth="nominal", poses=table, noise=0.0)
    assert (len(simulation.lines()), simulation.stopped_before) == (2, False)
    assert simulation.data.number is not None
    assert simulation.data.number.tolist() == list(range(10))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEAD.replace(",approach_2 [mm]", "") + "P1,1,1,1,\n", "the stops before the configurations are not those"),
        (HEAD.replace("approach_1 [deg]", "approach_1") + "P1,1,1,1,1,\n", "approach_1: no unit is given"),
        (HEAD + "P1,1,1,,1,\n", "line 2, column approach_1 [deg]"),
    ],
)
def test_stops_that_cannot_be_are_refused_with_their_place(tmp_path: Path, text: str, words: str) -> None:
    table = written(tmp_path, text)
    with pytest.raises(InputError) as refusal:
        read_stops(table)
    assert words in str(refusal.value)
    assert str(table) in str(refusal.value)
    assert read_configurations(table).configurations == 1  # where the arm stands is known all the same


def test_stops_are_read_in_their_units(tmp_path: Path) -> None:
    stops = read_stops(written(tmp_path, HEAD + "P1,90,10,88,5,tip\nP2,-90,20,-92,15,tip\n"))
    assert stops is not None
    assert stops.joints == pytest.approx(np.array([[np.deg2rad(88.0), 0.005], [np.deg2rad(-92.0), 0.015]]))
