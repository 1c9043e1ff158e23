"""Tests by ISO 9283 in a cell that was stated."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.motion.constraints import Constraints, read_constraints
from truearm.engine.motion.cube import Cube
from truearm.iso9283.planning import choosing as planning
from truearm.iso9283.planning.choosing import performance_plan
from truearm.iso9283.planning.criteria import TESTS
from truearm.iso9283.planning.programs import StatedCell, stated_cell
from truearm.iso9283.planning.result import Iso9283Plan

CELL = "truearm: truearm-constraints/1\nunits: {length: mm, angle: deg}\n"
#: Where the cube's near faces are, and where nothing of the arm ever is.
IN_THE_WAY, ASIDE = "keep_out: {post: {x: [300, 320], z: [0, 400]}}\n", "keep_out: {wall: {x: [-2000, -600]}}\n"


def rules(folder: Path, text: str) -> Constraints:
    (folder / "cell.yaml").write_text(CELL + text)
    return read_constraints(folder / "cell.yaml")


def planned(cube: Path, **more: Any) -> Iso9283Plan:
    given: dict[str, Any] = {"criteria": ["ap", "av"], "cube": cube, "velocity": 0.5, "tip": (0.0, 0.0, 0.05)}
    return truearm.iso9283_plan("irb120", **(given | more))


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
    assert "ways-near" not in {one.code for one in stated.warnings}
    assert stated.plan.robot.joints == alone.plan.robot.joints
    room = float(stated.kept.partition(" mm or more")[0].rsplit(" ", 1)[1])
    assert room >= 50.0


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
    told = ways.unsuited(plan)
    assert " ways are not clear (A" in told
    assert "near the box 'ball', 0 mm" in told
    assert "; and others; nearest " in told


def test_the_cube_is_chosen_where_the_ways_are_clear(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = Cube((0.35, 0.0, 0.35), 0.3)
    monkeypatch.setattr(planning, "largest_cube", lambda *_, **__: whole)
    robot = truearm.load_robot("irb120")
    given: dict[str, Any] = {"tests": ["AP"], "rated_load": 3.0, "rated_velocity": 1.0}
    monkeypatch.setattr(planning, "TESTS", {"AP": TESTS["AP"]})
    anywhere = performance_plan(robot, **given)
    text = {"truearm": "truearm-constraints/1", "units": {"length": "mm", "angle": "deg"}}
    post = Constraints.model_validate(
        {**text, "keep_out": {"post": {"x": [450, 900], "y": [-500, 100], "z": [0, 150]}}}
    )
    cell = cell_of(post)
    assert cell.unclear(np.array([pose.joints for pose in anywhere.poses.values()]))
    clear = performance_plan(robot, **given, unclear=cell.unclear, unsuited=cell.unsuited)
    assert not cell.unsuited(clear)
    assert clear.cube.side < anywhere.cube.side
    assert (np.abs(clear.cube.centre - whole.centre) + clear.cube.side / 2.0 <= whole.side / 2.0 + 1e-12).all()
    with pytest.raises(InputError, match="and keep clear; got 'missed: never"):
        performance_plan(robot, **given, cube=clear.cube, unsuited=lambda _: "never")
