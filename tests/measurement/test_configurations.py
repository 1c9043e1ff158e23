"""Tables of configurations without readings, as plans have them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truearm
from truearm.errors import InputError
from truearm.measurement.readers.configurations import read_configurations

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
