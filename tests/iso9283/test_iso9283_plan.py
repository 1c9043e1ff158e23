"""Plans of tests by ISO 9283: where everything lies, what a plan's file keeps, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.iso9283.campaign_files import CUBE
from tests.performance_plan import small_plan

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.motion.constraints import Constraints, read_constraints
from truearm.engine.motion.cube import Cube
from truearm.engine.motion.joint_motion import Tip
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.iso9283.planning import choosing as planning
from truearm.iso9283.planning.choosing import performance_plan
from truearm.iso9283.planning.criteria import CRITERIA, TEST_OF, TESTS
from truearm.iso9283.planning.plan_file import PLAN, ROBOT, plan_text, read_cube, read_plan
from truearm.iso9283.planning.programs import StatedCell, stated_cell
from truearm.iso9283.planning.result import Iso9283Plan


@pytest.fixture(scope="module")
def whole(cube: Path, tmp_path_factory: pytest.TempPathFactory) -> Iso9283Plan:
    """Return a plan of all criteria at three velocities in a cube of 200 mm."""
    return truearm.iso9283_plan("irb120", cube=cube, tip=(0.0, 0.0, 0.1), out=tmp_path_factory.mktemp("plan"))


def test_every_criterion_belongs_to_one_test_and_all_are_planned(whole: Iso9283Plan) -> None:
    assert {criterion for test in TESTS.values() for criterion in test.criteria} == {*CRITERIA}
    assert all(criterion in TESTS[test].criteria for criterion, test in TEST_OF.items())
    assert [test.id for test in whole.plan.tests] == [*TESTS]
    assert [test.cycles for test in whole.plan.tests] == [test.cycles for test in TESTS.values()]


def test_poses_lie_at_ten_percent_from_the_ends_of_the_diagonals(whole: Iso9283Plan) -> None:
    places = {name: 1e3 * pose.position for name, pose in whole.plan.poses.items()}
    assert places["P1"] == pytest.approx([350.0, 0.0, 350.0])
    for name in ("P2", "P3", "P4", "P5"):
        assert np.abs(places[name] - places["P1"]).tolist() == pytest.approx([80.0] * 3)
    assert np.linalg.norm(places["P2"] - places["P4"]) == pytest.approx(160.0 * np.sqrt(3.0))


def test_joint_positions_bring_the_tip_to_the_poses_in_one_posture(whole: Iso9283Plan) -> None:
    plan = whole.plan
    tip = Tip(plan.robot, plan.target)
    for pose in (*plan.poses.values(), *plan.starts.values()):
        reached = tip.at(pose.joints[None])
        assert reached.position[0] == pytest.approx(pose.position, abs=1e-6)
        assert np.abs(reached.rotation[0] - pose.rotation).max() < 1e-6


def test_weaving_is_run_at_the_slowest_velocity_and_optional_speeds_are_left_out(whole: Iso9283Plan) -> None:
    velocities = {test.id: test.velocities for test in whole.plan.tests}
    assert velocities["AP"] == velocities["AT"] == (1.0, 0.5, 0.1)
    assert velocities["WS"] == (0.1,)
    assert velocities["E"] == velocities["t"] == (1.0,)


def test_approaches_begin_along_the_axes_and_inside_the_cube(whole: Iso9283Plan) -> None:
    for (pose, axis), start in whole.plan.starts.items():
        away = start.position - whole.plan.poses[pose].position
        assert np.abs(away).tolist() == pytest.approx([0.02 if axis == name else 0.0 for name in "xyz"], abs=1e-12)
        assert np.abs(start.position - whole.plan.cube.centre).max() <= 0.1 + 1e-9


def test_circles_and_the_rectangle_have_their_sizes(whole: Iso9283Plan) -> None:
    paths = whole.plan.paths
    for name, share in (("large-circle", 0.8), ("small-circle", 0.1)):
        centre, first = paths[name].points
        assert 2 * np.linalg.norm(first - centre) == pytest.approx(share * 0.2)
    assert paths["rectangle"].points == pytest.approx(
        np.array([whole.plan.poses[name].position for name in ("P2", "P3", "P4", "P5", "P2")])
    )


def test_a_plan_that_is_written_is_the_same_plan(whole: Iso9283Plan) -> None:
    folder = Path(str(whole.request.out))
    assert {"plan.yaml", "robot.yaml", "sheet.html"} <= {path.name for path in folder.iterdir()}
    read = read_plan(folder / PLAN)
    assert plan_text(read) == (folder / PLAN).read_text() == plan_text(whole.plan)
    assert read.tests == whole.plan.tests
    assert (read.rated_load, read.rated_velocity, read.limit_band, read.hours) == (3.0, 1.0, 1e-4, 8.0)
    for name, pose in whole.plan.poses.items():
        assert read.poses[name].joints == pytest.approx(pose.joints, abs=1e-12)


def test_the_rated_velocity_that_is_assumed_is_said(whole: Iso9283Plan, cube: Path) -> None:
    assert [(notice.code, notice.level) for notice in whole.warnings] == [("rated-velocity-assumed", "note")]
    stated = truearm.iso9283_plan("irb120", criteria=["AP"], cube=cube, velocity=0.4)
    assert stated.warnings == ()
    assert stated.plan.rated_velocity == 0.4


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"criteria": ["ap", "zz"]}, "criteria"),
        ({"criteria": []}, "no criterion is given"),
        ({"target": "9"}, "target"),
        ({"target": "1", "tip": (0.0, 0.0, 0.1)}, "only one of them"),
        ({"velocities": (150.0,)}, "got 150 %; allowed: percent of the rated one, above 1 up to 100"),
        ({"velocities": (0.0,)}, "percent of the rated one; got 0 %"),
        ({"velocities": (100.0, 0.5)}, "Give 50, not 0.5"),
        ({"velocities": ()}, "velocities: no number is given"),
        ({"loads": (-5.0,)}, "got -5 %; allowed: percent of the rated one, 0, or above 1 up to 100"),
        ({"velocity": 0.0005}, "got 0.5 mm/s; allowed: 10 to 20000 mm/s. Is it 500 mm/s?"),
        ({"velocity": 1000.0}, "got 1e+06 mm/s; allowed: 10 to 20000 mm/s. Is it 1000 mm/s? Check its unit."),
        ({"robot": "katana450", "load": 0.4}, "5 joints"),
        ({"robot": "puma560"}, "Give it as `load`, or state rated_load"),
    ],
)
def test_what_cannot_be_planned_is_refused(options: dict[str, object], words: str, cube: Path) -> None:
    with pytest.raises(InputError, match=re.escape(words)):
        truearm.iso9283_plan(**{"robot": "irb120", "criteria": ["ap"], "cube": cube, **options})  # type: ignore[arg-type]


def test_a_cube_that_the_arm_cannot_reach_is_refused(tmp_path: Path) -> None:
    far = tmp_path / "far.yaml"
    far.write_text(CUBE.replace("[350, 0, 350]", "[900, 0, 350]"))
    with pytest.raises(InputError, match=r"cannot come to all poses.*missed: P"):
        truearm.iso9283_plan("irb120", criteria=["ap"], cube=far)
    for options in ({"cube": far.with_name("none.yaml")}, {"cube": far, "constraints": far.with_name("none.yaml")}):
        with pytest.raises(InputError, match="no such file") as refusal:
            truearm.iso9283_plan("irb120", criteria=["ap"], **options)  # type: ignore[arg-type]
        assert refusal.value.parameter == [*options][-1]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("side: 200", "side: 0", "side"),
        ("side: 200", "", "side"),
        ("side: 200", "side: 0.25", "side: no robot is tested .* got 0.25 mm; .* Are these numbers in m?"),
        ("length: mm", "length: m", "got 200 m; allowed: 10 mm to 20 m. Are these numbers in mm?"),
        ("side: 200", "side: 30000", "Check the number and its unit."),
        ("length: mm", "length: parsec", "length"),
        ("cube/1", "cube/2", "truearm"),
        ("centre: [350, 0, 350]", "centre: [350, 0]", "centre"),
    ],
)
def test_a_cube_that_cannot_be_used_is_refused_and_one_in_other_units_is_read(
    old: str, new: str, words: str, tmp_path: Path
) -> None:
    path = tmp_path / "cube.yaml"
    path.write_text(CUBE.replace(old, new))
    with pytest.raises(InputError, match=words):
        read_cube(path)
    path.write_text(CUBE.replace("mm", "m").replace("350", "0.35").replace("200", "0.2"))
    assert (read_cube(path).side, *read_cube(path).centre) == (0.2, 0.35, 0.0, 0.35)


@pytest.fixture(scope="module")
def text() -> str:
    return plan_text(small_plan())


@pytest.mark.parametrize(
    ("pattern", "new", "words"),
    [
        (r"name: P2,", "name: P1,", "two poses have this name"),
        (r"name: P1, position: \[350.0, ", "name: P1, position: [351.0, ", "do not bring the tip to the pose"),
        (r"name: P1, position: \[350.0, ", "name: P1, position: [550.0, ", "outside the cube"),
        (r"joints: \[[^]]*\]", "joints: [0, 0]", "one position for each joint"),
        (r"pose: P1, approach: y", "pose: P1, approach: x", "two approaches of a pose have this name"),
        (r"pose: P1, approach: x", "pose: P9, approach: x", "no such pose"),
        (r"name: rectangle, kind", "name: line, kind", "two paths have this name"),
        (r"kind: circle", "kind: weave", "has a stroke"),
        (r"kind: circle", "kind: ellipse", "kind"),
        (r"normal: \[[^]]*\]", "normal: [2, 0, 0]", "the normal has length 1"),
        (r"criterion: vAP", "criterion: AP", "this test is planned twice"),
        (r"criterion: vAP", "criterion: XX", "no such test"),
        (r"criterion: AT, places: \[line", "criterion: AT, places: [P1", "no such place"),
        (r'approaches: \["x", "y", "z"\]', 'approaches: ["x", "w"]', "no start: P1 from w"),
        (r'approaches: \["x", "y", "z"\]', 'approaches: ["x"]', "two directions or more"),
        (r'approaches: \["\+x"', 'approaches: ["+w"', "no such direction"),
        (r'approaches: \["D10"', 'approaches: ["D99"', "no such pose"),
        (r"approaches: \[\]", 'approaches: ["x"]', "this test has no approaches"),
        (r"^robot: .*$", "robot: ../robot.yaml", "lies beside the plan"),
        (r"^robot: .*$", "robot: other.yaml", "no such file"),
        (r"^robot: .*$", "robot: robot.yaml\ntarget: nothing", "no such target"),
        (r"plane: C1-C2-C7-C8", "plane: C1", "no such diagonal plane"),
        (r"velocities: \[100.0\]", "velocities: [120.0]", "velocities"),
        (r"cycles: 30", "cycles: 0", "cycles"),
        (r"length: mm", "length: m", "length"),
    ],
)
def test_a_plan_file_that_cannot_be_used_is_refused(
    pattern: str, new: str, words: str, text: str, tmp_path: Path
) -> None:
    changed = re.sub(pattern, new, text, count=1, flags=re.M)
    assert changed != text
    (tmp_path / PLAN).write_text(changed)
    (tmp_path / ROBOT).write_text(robot_text(small_plan(["AP"]).robot))
    with pytest.raises(InputError) as refusal:
        read_plan(tmp_path / PLAN)
    assert words in str(refusal.value)


def test_the_largest_cube_is_that_of_the_robot_whichever_tests_are_planned(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = truearm.load_robot("irb120")
    largest = Cube([0.3036, 0.0, 0.3036], 0.4239)  # AP alone would be planned in it
    monkeypatch.setattr("truearm.iso9283.planning.choosing.largest_cube", lambda *_, **__: largest)
    sides = {
        tests: performance_plan(robot, tests=tests, rated_load=3.0, rated_velocity=1.0).cube.side
        for tests in (("AP",), ("AT", "vAP"))
    }
    assert sides["AP",] == sides["AT", "vAP"] < largest.side
    alone = performance_plan(robot, tests=("AP",), cube=largest, rated_load=3.0, rated_velocity=1.0)
    assert alone.cube.side == largest.side


CELL = "truearm: truearm-constraints/1\nunits: {length: mm, angle: deg}\n"
#: Where the cube's near faces are, and where nothing of the arm ever is.
IN_THE_WAY, ASIDE = "keep_out: {post: {x: [300, 320], z: [0, 400]}}\n", "keep_out: {wall: {x: [-2000, -600]}}\n"


def rules(folder: Path, text: str) -> Constraints:
    (folder / "cell.yaml").write_text(CELL + text)
    return read_constraints(folder / "cell.yaml")


def planned(cube: Path, **more: Any) -> Iso9283Plan:
    options: dict[str, Any] = {"criteria": ["ap", "av"], "cube": cube, "velocity": 0.5, "tip": (0.0, 0.0, 0.05)}
    return truearm.iso9283_plan("irb120", **(options | more))


def cell_of(constraints: Constraints) -> StatedCell:
    cell = stated_cell(truearm.load_robot("irb120"), constraints, "cell.yaml", None)
    assert cell is not None
    return cell


def test_ways_of_a_stated_cell_keep_clear_and_that_is_told(cube: Path, tmp_path: Path) -> None:
    alone = planned(cube)
    assert (alone.kept, alone.answer[-1].startswith("Rated")) == ("", True)
    stated = planned(cube, constraints=rules(tmp_path, ASIDE), program="rapid")
    assert stated.kept.startswith("On all ")
    assert "mm or more from " in stated.kept
    assert all(thing in stated.kept for thing in ("the floor at 0 mm", "its own links"))
    assert stated.kept in stated.lines()
    assert "ways-near" not in {warning.code for warning in stated.warnings}
    assert stated.plan.robot.joints == alone.plan.robot.joints
    millimetres = float(stated.kept.partition(" mm or more")[0].rsplit(" ", 1)[1])
    assert millimetres >= 50.0


@pytest.mark.parametrize(
    ("text", "more", "parameter", "words"),
    [
        (IN_THE_WAY, {}, "cube", "near the box 'post', "),
        ("limits: {2: [60, 90]}\n", {}, "cube", "in one posture, and keep clear"),
        ("limits: {2: [150, 160]}\n", {}, "constraints", "the limits of joint 2 leave nothing"),
        ("keep_out: {table: {z: [-100, 100]}}\n", {}, "constraints", "holds the base of the robot"),
        ("box: {of: flange, z: [400, 900]}\n", {}, "cube", "box of the constraints"),
        (ASIDE, {"clearance": 0.4}, "cube", "keep clear"),
    ],
)
def test_a_cube_that_is_not_clear_is_refused(
    cube: Path, tmp_path: Path, text: str, more: dict[str, Any], parameter: str, words: str
) -> None:
    with pytest.raises(InputError) as refusal:
        planned(cube, constraints=rules(tmp_path, text), **more)
    assert refusal.value.parameter == parameter
    assert words in str(refusal.value)


def test_ways_between_clear_poses_that_are_not_clear_are_named(cube: Path, tmp_path: Path) -> None:
    cell = cell_of(rules(tmp_path, ASIDE))
    plan = planned(cube, tip=None).plan
    assert cell.unsuited(plan) == ""
    ways = cell_of(rules(tmp_path, "keep_out: {ball: {x: [330, 370], y: [-20, 20], z: [330, 370]}}\n"))
    message = ways.unsuited(plan)
    assert " ways are not clear (A" in message
    assert "near the box 'ball', 0 mm" in message
    assert "; and others; nearest " in message


def test_the_cube_is_chosen_where_the_ways_are_clear(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = Cube((0.35, 0.0, 0.35), 0.3)
    monkeypatch.setattr(planning, "largest_cube", lambda *_, **__: whole)
    robot = truearm.load_robot("irb120")
    options: dict[str, Any] = {"tests": ["AP"], "rated_load": 3.0, "rated_velocity": 1.0}
    monkeypatch.setattr(planning, "TESTS", {"AP": TESTS["AP"]})
    anywhere = performance_plan(robot, **options)
    text = {"truearm": "truearm-constraints/1", "units": {"length": "mm", "angle": "deg"}}
    post = Constraints.model_validate(
        {**text, "keep_out": {"post": {"x": [450, 900], "y": [-500, 100], "z": [0, 150]}}}
    )
    cell = cell_of(post)
    assert cell.unclear(np.array([pose.joints for pose in anywhere.poses.values()]))
    clear = performance_plan(robot, **options, unclear=cell.unclear, unsuited=cell.unsuited)
    assert not cell.unsuited(clear)
    assert clear.cube.side < anywhere.cube.side
    assert (np.abs(clear.cube.centre - whole.centre) + clear.cube.side / 2.0 <= whole.side / 2.0 + 1e-12).all()
    with pytest.raises(InputError, match="and keep clear; got 'missed: never"):
        performance_plan(robot, **options, cube=clear.cube, unsuited=lambda _: "never")
