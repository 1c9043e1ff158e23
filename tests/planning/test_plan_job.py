"""The job that plans measurements: what it takes from Python, and what its record says."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.simulated import campaign

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.base.manifest import MANIFEST, sets_in
from truearm.engine.base.writing import write_files
from truearm.engine.command.driving import plan_files_for, refuse_ways_of_another, replaced_notices
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.motion.constraints import Constraints

RULES = {"truearm": "truearm-constraints/1", "units": {"length": "mm", "angle": "deg"}, "moments": {2: "positive"}}


def test_objects_and_files_give_the_same_plan(tmp_path: Path) -> None:
    _, data = campaign("irb120", 30, 0.05e-3, 1)
    file = tmp_path / "data.csv"
    file.write_text(csv_text(data))
    out = tmp_path / "plan.csv"
    from_file = truearm.plan("irb120", poses=10, candidates_from=file, out=out)
    from_data = truearm.plan(truearm.load_robot("irb120"), poses=10, candidates_from=truearm.load_data(file))
    assert np.array_equal(from_file.joints, from_data.joints)
    assert set(from_file.labels) <= set(data.labels)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["data.csv", "plan.csv", "plan.html", MANIFEST]
    assert "truearm.plan(&#39;irb120&#39;, poses=10," in (tmp_path / "plan.html").read_text()
    saved = from_data.save(tmp_path / "again.csv")
    assert saved == (tmp_path / "again.csv", tmp_path / "again.html")
    assert saved[0].read_bytes() == out.read_bytes()


def test_the_record_tells_what_constraints_cost() -> None:
    planned = truearm.plan("irb120", poses=10, candidates=60, constraints=Constraints.model_validate(RULES), seed=3)
    cost = planned.made.rejected["moment_2"]
    assert planned.lines()[0] == f"10 of {60 - cost} usable configurations, chosen by O1."
    assert f"  moment_2: broken by {cost} of 60" in planned.lines()
    assert planned.lines()[-4:-1] == planned.answer
    assert planned.summary()["rejected"] == {"limits": 0, "moment_2": cost}


def test_limits_in_another_unit_are_warned_of(tmp_path: Path) -> None:
    """With a box whose name would be markup on the page."""
    rules = Constraints.model_validate(
        {
            **RULES,
            "moments": {},
            "limits": {1: [-1.57, 1.57], 2: [-1, 1], 3: [-1, 1]},
            "keep_out": {"<script>alert(1)</script>": {"x": [-900, -700]}},
        }
    )
    planned = truearm.plan(
        "irb120", poses=10, candidates=60, constraints=rules, model="offsets", out=tmp_path / "p.csv"
    )
    (notice,) = [warning for warning in planned.warnings if warning.code != "tool-assumed"]
    assert (notice.code, notice.level) == ("limits-tiny", "warning")
    assert "joint 1 from -1.57 to 1.57 deg, joint 2 from -1 to 1 deg, joint 3" in notice.message
    prediction = planned.made.prediction
    assert prediction.tells_little
    assert prediction.nominal == pytest.approx(1.5e-3, rel=0.2)
    assert any("Before a calibration the robot misses them by about 1." in line for line in planned.answer)
    assert not any("More poses than were looked at" in line for line in planned.answer)
    page = (tmp_path / "p.html").read_text()
    assert "&lt;script&gt;alert(1)" in page
    assert "<script>alert" not in page
    drawn = planned.made.drawn
    assert drawn is not None
    assert f"{drawn.tried} were drawn within the limits, 60 of those that keep clear were taken." in page
    assert replace(drawn, lost={"floor": 2, "links": 0, "keep_out a": 30}).words == "keep_out a 30, floor 2"


def test_what_does_not_go_together_is_refused(tmp_path: Path) -> None:
    (tmp_path / "made.html").mkdir()
    poses = tmp_path / "poses.csv"
    poses.write_text(POSES)
    _, data = campaign("irb120", 12, 0.05e-3, 1)
    cases: list[tuple[dict[str, Any], str, str]] = [
        ({"poses": 12.0}, "poses", "whole number|number of poses"),
        ({"poses": "many"}, "poses", "a number of poses belongs here; got 'many'"),
        ({"dwell": 2.0}, "dwell", "none is asked for"),
        ({"candidates_from": data, "device": "ballbar"}, "device, candidates_from", "a device finds its own"),
        ({"out": tmp_path / "plan.html"}, "out", "the plan is a CSV file"),
        ({"out": tmp_path / "made.csv"}, "out", "this is a folder"),
        ({"accurate_at": poses, "out": poses}, "out", "this file is read, and would be overwritten"),
    ]
    for options, parameter, words in cases:
        with pytest.raises(InputError, match=words) as refusal:
            truearm.plan("irb120", **{"poses": 10, "candidates": 60, **options})
        assert refusal.value.parameter == parameter
    assert poses.read_text() == POSES


def test_a_plan_says_what_noise_it_assumes() -> None:
    for noise, words in ((1e-4, "off by 0.100 mm"), (3e-5, "off by 0.0300 mm")):
        planned = truearm.plan("irb120", poses=8, candidates=30, noise=noise, seed=3)
        assert words in planned.answer[-1]
        assert "give `noise` where you know better" in planned.answer[-1]
        assert planned.answer[-1] in planned.lines()


def test_a_plan_says_what_its_figure_leaves_out() -> None:
    for robot, model, loads in (("irb120", "offsets", True), ("kr5", "offsets", False)):
        planned = truearm.plan(robot, poses=8, candidates=30, model=model, seed=3)
        assert planned.summary()["prediction"]["loads_left_out"] is loads
        assert ("Plan with `model=elastic`" in planned.answer[-1]) is loads
        assert "has more to find than offsets: it is not planned for" in planned.answer[-1]


POSES = """pose,x [mm],y [mm],z [mm],qw,qx,qy,qz
a,400,0,300,0,0,1,0
b,450,100,300,0,0,1,0
"""
RAPID = Path(__file__).parents[1] / "engine" / "programs" / "samples" / "rapid" / "polish.mod"


@pytest.mark.parametrize("nominal", [True, False])
def test_a_plan_for_a_program_for_poses_and_for_a_region(tmp_path: Path, nominal: bool) -> None:
    robot: object = "irb120"
    if not nominal:
        robot = truearm.calibrate(
            "irb120", campaign("irb120", 20, 0.05e-3, 1)[1], train="all", model="geometric"
        ).fit.robot
    file = tmp_path / "poses.csv"
    file.write_text(POSES)
    plan = partial(truearm.plan, robot, poses=12, candidates=60)  # type: ignore[arg-type]
    plans = {
        "at the 11 of 15 targets of polish.mod": plan(accurate_at=RAPID),
        "at the 2 poses of poses.csv": plan(accurate_at=file),
        "in the region x 300 to 500, y -100 to 100, z 200 to 400 mm": plan(
            region=[(0.3, 0.5), (-0.1, 0.1), (0.2, 0.4)]
        ),
        "at the given configurations": plan(accurate_at=np.zeros((1, 6))),
    }
    for words, planned in plans.items():
        wanted = planned.made.prediction.there
        assert wanted is not None
        assert f"12 of 60 usable configurations, chosen by the error {words}." in planned.lines()[:2]
        assert planned.summary()["prediction"]["there"]["places"] == len(wanted.error)
        assert wanted.by_o1 is not None
        assert wanted.error.mean() < wanted.by_o1.mean()
        assert f"{words}, at most by" in planned.answer[0]
    assert len(plans["at the 11 of 15 targets of polish.mod"].joints) == 12


def test_of_many_places_some_are_looked_at() -> None:
    joints = np.random.default_rng(0).uniform(-1.0, 1.0, (1200, 6))
    planned = truearm.plan("irb120", poses=12, candidates=60, accurate_at=joints, objective="O3")
    assert planned.lines()[0] == "12 of 60 usable configurations, chosen by O3."
    assert "at the given configurations (judged at 500 of them)" in planned.answer[0]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"region": [(0.3, 0.3), (0, 1), (0, 1)]}, "no extent along x; got '300 to 300 mm'"),
        ({"region": [(3, 4), (0, 1), (0, 1)]}, "does not reach this region"),
        ({"region": "300..400"}, "a box belongs here"),
        ({"region": [(0, 1)]}, "3, 2"),
        ({"region": [(0.3, 0.4), (0, 1), (0, 1)], "accurate_at": RAPID}, "for places or for a region"),
        ({"tools": "tools.yaml"}, "only a program needs to know"),
        ({"accurate_at": np.zeros((2, 5))}, "n, 6"),
        ({"accurate_at": "nothing.mod"}, "no such file"),
        ({"accurate_at": np.zeros((1, 6)), "poses": "auto"}, "only O1 can choose"),
        ({"objective": "error"}, "nothing was said of where"),
    ],
)
def test_where_a_robot_shall_be_accurate_is_refused(options: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        truearm.plan("irb120", **{"poses": 12, "candidates": 60, **options})  # type: ignore[arg-type]


def test_poses_and_targets_out_of_reach_are_refused(tmp_path: Path) -> None:
    poses = tmp_path / "poses.csv"
    poses.write_text(POSES + "c,1400,0,300,0,0,1,0\n")
    with pytest.raises(InputError, match="cannot go to 1 pose; got 'c'"):
        truearm.plan("irb120", poses=12, candidates=60, accurate_at=poses)
    program = tmp_path / "far.mod"
    program.write_text(
        "MODULE far\nCONST robtarget p:=[[5000,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n"
        "PROC main()\nMoveJ p,v100,fine,tool0;\nENDPROC\nENDMODULE\n"
    )
    with pytest.raises(InputError, match="reaches none of the targets; got '1 target'"):
        truearm.plan("irb120", poses=12, candidates=60, accurate_at=program)


QUICK: dict[str, Any] = {"poses": 10, "candidates": 60, "clearance": 0.0, "no_floor": True}
PLAN_FILES = ("plan.csv", "plan.html", "plan-ways.csv")


@pytest.fixture
def written(tmp_path: Path) -> Path:
    """Return the table of a plan that truearm wrote."""
    write_files(tmp_path, dict.fromkeys(PLAN_FILES, "a,b\n"), "truearm plan irb120")
    return tmp_path / "plan.csv"


def test_another_plan_is_replaced_and_that_is_told(tmp_path: Path) -> None:
    table = tmp_path / "plan.csv"
    first = truearm.plan("irb120", **QUICK, command="truearm plan first", out=table)
    again = truearm.plan("irb120", **QUICK, command="truearm plan again", out=table)
    assert not first.replaced
    assert not again.replaced
    other = truearm.plan("irb120", **QUICK, seed=1, out=table)
    (notice,) = other.replaced
    assert (notice.code, notice.level) == ("plan-replaced", "warning")
    assert f"Another plan stood in {table}, written by 'truearm plan again', and was replaced." in notice.message
    assert any("plan-replaced" in line for line in other.lines())
    assert [warning["code"] for warning in other.summary()["warnings"]] == ["plan-replaced", "tool-assumed"]
    table.write_text(table.read_text() + "11,0,0,0,0,0,0\n")
    before = table.read_bytes()
    with pytest.raises(InputError, match="written here by truearm and has been changed since") as refusal:
        truearm.plan("irb120", **QUICK, out=table)
    assert refusal.value.parameter == "out"
    with pytest.raises(InputError, match="changed since") as refusal:
        other.save(table)
    assert (refusal.value.parameter, table.read_bytes()) == ("file", before)


@pytest.mark.parametrize("name", PLAN_FILES)
def test_a_file_that_was_changed_or_is_foreign_stays(name: str, written: Path) -> None:
    plan_files_for(PLAN_FILES, written)
    written.with_name(name).write_text("corrected by hand\n")
    with pytest.raises(InputError, match=r"has been changed since.*Choose another `out`") as refusal:
        plan_files_for(PLAN_FILES, written)
    assert refusal.value.where == str(written.with_name(name))
    elsewhere = written.parent / "new" / "plan.csv"
    elsewhere.parent.mkdir()
    elsewhere.with_name(name).write_text("mine\n")
    with pytest.raises(InputError, match="not written here by truearm"):
        plan_files_for(PLAN_FILES, elsewhere)


def test_the_files_of_another_result_stay(written: Path) -> None:
    write_files(written.parent, {"plan.csv": "1", "plan.html": "2", "plan-poses.csv": "3"}, "truearm poses irb120")
    with pytest.raises(InputError, match=r"to another result there; got .written together with plan-poses\.csv"):
        plan_files_for(PLAN_FILES, written)


def test_no_ways_stay_beside_a_plan_that_has_none(written: Path) -> None:
    with pytest.raises(InputError, match="the ways of another plan are there") as refusal:
        refuse_ways_of_another(written.with_name(PLAN_FILES[2]))
    assert refusal.value.parameter == "out"
    refuse_ways_of_another(written.with_name("other-ways.csv"))


def test_what_was_removed_or_is_the_same_is_not_told_of(written: Path) -> None:
    assert not replaced_notices(written.parent, "plan.csv", "a,b\n")
    assert replaced_notices(written.parent, "plan.csv", "c,d\n")
    written.unlink()
    assert not replaced_notices(written.parent, "plan.csv", "c,d\n")


def test_plans_of_tests_and_of_inclinometers_and_sets_of_poses_keep_to_the_same(tmp_path: Path) -> None:
    cube = tmp_path / "cube.yaml"
    cube.write_text("truearm: truearm-cube/1\nunits: {length: mm}\ncentre: [350, 0, 350]\nside: 200\n")
    tests: dict[str, Any] = {"cube": cube, "criteria": ["ap"], "out": tmp_path / "iso"}
    truearm.iso9283_plan("irb120", **tests)
    assert "plan-replaced" not in {warning.code for warning in truearm.iso9283_plan("irb120", **tests).warnings}
    other = truearm.iso9283_plan("irb120", **tests, limit_band=0.2e-3)
    assert other.warnings[-1].code == "plan-replaced"
    tilts: dict[str, Any] = {"poses": 8, "candidates": 60, "pull": 20.0}
    truearm.plan_inclinometers("katana450", **tilts, out=tmp_path / "tilts.csv")
    table = truearm.plan_inclinometers("katana450", **tilts, seed=1, out=tmp_path / "tilts.csv")
    assert [warning["code"] for warning in table.summary()["warnings"]] == ["plan-replaced"]
    poses: dict[str, Any] = {"set": "iso-cube", "centre": (0.35, 0, 0.35), "side": 0.2}
    truearm.poses("irb120", **poses, out=tmp_path / "set.csv")
    truearm.poses("irb120", **poses, out=tmp_path / "set.csv")
    for name, job in (
        ("iso/sheet.html", lambda: truearm.iso9283_plan("irb120", **tests)),
        ("tilts.csv", lambda: truearm.plan_inclinometers("katana450", **tilts, out=tmp_path / "tilts.csv")),
        ("set.csv", lambda: truearm.poses("irb120", **poses, out=tmp_path / "set.csv")),
    ):
        (tmp_path / name).write_text("filled in\n")
        with pytest.raises(InputError, match="has been changed since") as refusal:
            job()
        assert refusal.value.parameter == "out"
        assert (tmp_path / name).read_text() == "filled in\n"
    assert sets_in(tmp_path)
