"""Plans that an arm can drive: floor, boxes and its own links are kept clear, at every stop and on every way."""

from __future__ import annotations

import csv
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.sampled_arm import sampled_room
from tests.simulated import campaign

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.motion.cell import Cell, boxes_of
from truearm.engine.motion.collisions import CollisionCheck
from truearm.engine.motion.constraints import Constraints
from truearm.engine.motion.tour import Tour
from truearm.engine.motion.touring import cell_notices
from truearm.engine.motion.ways import WayFinder
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.truths import carrying_targets
from truearm.planning.choosing import Reachable, chosen_with_ways
from truearm.planning.result import Plan

UNITS = {"units": {"length": "mm", "angle": "deg"}}
TABLE = {"table": {"x": [300, 700], "y": [-300, 300], "z": [-1000, 150]}}


#: Of ten makers.
ARMS = ("fr3", "gp7", "irb120", "kr10_r1100", "lrmate200id", "meca500", "rs007l", "tx2_60", "ur5e", "vs060")


def on_the_ways(planned: Plan, steps: int = 12) -> np.ndarray:
    """Joint positions on all ways of a plan, each joint moving evenly from stop to stop."""
    assert planned.tour is not None
    stops = planned.tour.joints
    share = np.linspace(0.0, 1.0, steps)[:, None]
    return np.concatenate([a + share * (b - a) for a, b in pairwise(stops)])


def window(robot: Robot) -> np.ndarray:
    """Limits, and -180 to 180 deg for joints that can turn so far both ways."""
    limits = np.array([joint.range for joint in robot.joints])
    for k, joint in enumerate(robot.joints):
        if joint.kind == "revolute" and limits[k, 0] <= -np.pi and limits[k, 1] >= np.pi:
            limits[k] = -np.pi, np.pi
    return limits


def rules(**entries: object) -> Constraints:
    return Constraints.model_validate({"truearm": "truearm-constraints/1", **UNITS, **entries})


def toured(**options: Any) -> tuple[Plan, Tour]:
    """Plan for an IRB 120, and return its tour, too."""
    planned = truearm.plan("irb120", **{"poses": 10, "candidates": 60, **options})
    assert planned.tour is not None
    return planned, planned.tour


def a_quarter(robot: Robot) -> Constraints:
    """Limits of a quarter of what each joint has, in its middle."""
    size = [np.degrees(1.0) if joint.kind == "revolute" else 1e3 for joint in robot.joints]
    limits = {
        k: ((low + high) / 2 + (high - low) / 8 * np.array([-1.0, 1.0])) * by
        for k, ((low, high), by) in enumerate(zip(window(robot), size, strict=True), 1)
    }
    return rules(limits={k: tuple(v.tolist()) for k, v in limits.items()})


@pytest.mark.parametrize("name", ARMS)
def test_thirty_poses_are_driven(name: str) -> None:
    planned = truearm.plan(name, poses=30, candidates=400)
    robot, tour = planned.made.robot, planned.tour
    assert tour is not None
    assert [stop.label for stop in tour.measured] == [str(k + 1) for k in range(30)]
    assert np.array_equal(np.array([stop.joints for stop in tour.measured]), planned.joints)
    assert [tour.stops[k].kind for k in (0, -1)] == ["home", "home"]
    assert np.array_equal(tour.stops[0].joints, tour.stops[-1].joints)
    low, high = window(robot).T
    assert ((tour.joints >= low - 1e-9) & (tour.joints <= high + 1e-9)).all()
    assert robot.forward(planned.joints)[0][:, 2].min() > 0.05
    distances = sampled_room(robot, on_the_ways(planned), Cell(), points=7)
    assert distances.min() >= 0.05
    assert 0.05 <= tour.distance <= sampled_room(robot, tour.joints, Cell()).min() + 1e-5


@pytest.mark.parametrize("name", ["irb120", "ur5e", "fr3"])
def test_limits_of_a_quarter_leave_as_many_to_choose_from(name: str) -> None:
    robot = truearm.load_robot(name)
    quarter = a_quarter(robot)
    planned = truearm.plan(robot, poses=30, candidates=400, constraints=quarter)
    assert planned.made.usable == 400
    assert not any(planned.made.rejected.values())
    assert planned.tour is not None
    for number, (low, high) in quarter.limits.items():
        degrees = np.rad2deg(planned.tour.joints[:, number - 1])
        assert ((degrees >= low - 1e-9) & (degrees <= high + 1e-9)).all()


def test_boxes_of_the_cell_are_kept_out_of() -> None:
    free, restricted = (
        truearm.plan("irb120", poses=20, candidates=150, constraints=constraints)
        for constraints in (None, rules(keep_out=TABLE))
    )
    low, high = 1e-3 * np.array([TABLE["table"][axis] for axis in "xyz"]).T
    cell = Cell(boxes=boxes_of({"table": (low, high)}))
    assert sampled_room(free.made.robot, on_the_ways(free), cell, points=9).min() < 0.05
    assert sampled_room(restricted.made.robot, on_the_ways(restricted), cell, points=9).min() >= 0.05


def test_the_floor_is_the_base_unless_one_is_given_or_there_is_none() -> None:
    low, tour = toured(poses=20, candidates=150, floor=-0.4, clearance=0.1)
    assert (tour.floor, tour.clearance) == (-0.4, 0.1)
    distances = sampled_room(low.made.robot, on_the_ways(low), Cell(-0.4, clearance=0.1), points=9)
    assert distances.min() >= 0.1
    assert low.made.robot.forward(low.joints)[0][:, 2].min() < 0.0
    assert " mm from the floor at -400 mm" in low.lines()[3]
    for of_file, floor in ((-300.0, -0.3), (80.0, 0.0)):
        assert toured(constraints=rules(floor=of_file))[1].floor == pytest.approx(floor)
    without, tour = toured(no_floor=True)
    assert tour.floor is None
    assert not any("gravity" in line for line in without.lines())
    assert without.made.robot.forward(without.joints)[0][:, 2].min() < 0.0


@pytest.mark.parametrize("gravity", [(0.0, 0.0, 9.81), (9.81, 0.0, 0.0)])
def test_a_ceiling_or_wall_that_carries_the_robot_is_kept_clear(gravity: tuple[float, float, float]) -> None:
    planned, tour = toured(gravity=gravity)
    assert tour.floor == 0.0
    assert sampled_room(planned.made.robot, on_the_ways(planned), Cell()).min() >= 0.048
    words = "\n".join(planned.lines())
    assert "mm or more from the mounting surface at 0 mm" in words
    assert "Only its mounting surface is kept clear: by its gravity the robot does not stand" in words
    assert "floor" not in words
    away, tour = toured(gravity=gravity, no_floor=True)
    assert tour.floor is None
    assert any(line.startswith("Its mounting surface is not kept clear") for line in away.lines())
    with pytest.raises(InputError, match=r"(?s)does not stand by its gravity.*'-600 mm'.*keep_out") as refusal:
        toured(gravity=gravity, floor=-0.6)
    assert refusal.value.parameter == "floor"


def test_a_safe_configuration_that_is_given_is_driven_from() -> None:
    home = np.deg2rad([10.0, -20, 10, 0, 30, 0]).tolist()
    planned, tour = toured(home=home)
    assert tour.home.tolist() == home
    assert toured(home="10,-20,10,0,30,0")[1].home == pytest.approx(home)
    assert any(line.startswith("Driven from home (10, -20, 10, 0, 30, 0) and back in ") for line in planned.lines())
    assert planned.summary()["ways"]["home"] == pytest.approx([10, -20, 10, 0, 30, 0])


def test_given_configurations_are_checked_where_room_or_boxes_are_asked_for() -> None:
    _, data = campaign("irb120", 40, 0.05e-3, 1)
    options: dict[str, Any] = {"poses": 12, "candidates_from": data}
    for plain in (truearm.plan("irb120", **options), truearm.plan("irb120", **options, constraints=rules())):
        assert plain.tour is None
        assert plain.made.usable == 40
        assert "ways" not in plain.summary()
    driven, _ = toured(**options, clearance=0.05)
    assert driven.made.usable < 40
    assert driven.made.rejected["floor"] > 0
    below = driven.made.robot.forward(data.joints)[0][:, 2] < 0.0
    assert not set(np.array(data.labels)[below]) & set(driven.labels)
    boxed, tour = toured(**options, constraints=rules(keep_out=TABLE))
    assert boxed.made.rejected["keep_out table"] > 0
    assert tour.distances["keep_out table"] >= 0.05


def test_given_configurations_are_checked_where_that_is_asked_for() -> None:
    _, data = campaign("irb120", 40, 0.05e-3, 1)
    plain = truearm.plan("irb120", poses=12, candidates_from=data)
    assert plain.tour is None
    assert plain.made.usable == 40
    assert "ways" not in plain.summary()
    driven = truearm.plan("irb120", poses=12, candidates_from=data, clearance=0.05)
    assert driven.tour is not None
    assert driven.made.usable < 40
    assert driven.made.rejected["floor"] > 0
    below = driven.made.robot.forward(data.joints)[0][:, 2] < 0.0
    assert not set(np.array(data.labels)[below]) & set(driven.labels)


@pytest.mark.parametrize(("name", "height"), [("rs007l", 360), ("lrmate200id", 330), ("irb120", None)])
def test_a_pendant_with_another_base_frame_is_told_of(name: str, height: float | None) -> None:
    robot = truearm.load_robot(name)
    cell = Cell(boxes=boxes_of({"table": (np.array([0.4, -0.2, 0.0]), np.array([0.6, 0.2, 0.1]))}))
    notices = [notice for notice in cell_notices(CollisionCheck(robot, cell)) if notice.code == "other-base-on-pendant"]
    assert len(notices) == (height is not None)
    if height is not None:
        assert notices[0].level == "note"
        assert notices[0].message.startswith("The floor and boxes are kept in the base frame of the robot file.")
        assert f"its origin at (0, 0, {height}) mm in it: add that" in notices[0].message
        turned = Transform.from_matrix(np.diag([-1.0, -1.0, 1.0]), np.array([0.0, 0.0, 0.33]))
        robot = replace(robot, controller=replace(robot.controller, base=turned))
        (turned_notice,) = [n for n in cell_notices(CollisionCheck(robot, cell)) if n.code == "other-base-on-pendant"]
        assert "in it, turned by 180 deg: add" in turned_notice.message
        assert any(n.message.startswith("The floor is kept in") for n in cell_notices(CollisionCheck(robot, Cell())))
        nothing = CollisionCheck(robot, Cell(None))
        assert not [n for n in cell_notices(nothing) if n.code == "other-base-on-pendant"]


def test_a_plan_without_a_program_says_what_it_assumed_of_the_tool() -> None:
    def quick(robot: str | Robot, **options: Any) -> Plan:
        return truearm.plan(robot, **{"poses": 10, "candidates": 30, "no_floor": True, "clearance": 0.0, **options})

    plain = quick("irb120")
    assert [(warning.code, warning.level) for warning in plain.warnings] == [("tool-assumed", "note")]
    assert "target 3 at (150, 0, 125) mm (the first tool of the robot file, triangular)" in plain.warnings[0].message
    assert "Note (tool-assumed): Nobody said the targets of the flange" in "\n".join(plain.lines())
    assert plain.summary()["warnings"][0]["code"] == "tool-assumed"
    robot = plain.made.robot
    assert quick(robot, payload="1kg,0mm,0mm,60mm").warnings == ()
    heavy = quick(robot, payload="9kg,0mm,0mm,60mm")
    assert [(warning.code, warning.level) for warning in heavy.warnings] == [("overload", "warning")]
    (notice,) = quick(replace(robot, rated_load=None), payload="9kg,0mm,0mm,60mm").warnings
    assert (notice.code, notice.level) == ("rating-unknown", "note")
    assert "The flange carries 9 kg, and the robot file does not say for how much irb120 is rated" in notice.message
    ball = quick("irb120", device="ballbar")
    assert "target ball at (0, 0, 125) mm (as of the device ballbar)" in ball.warnings[0].message


def test_configurations_without_a_way_are_left_out_and_counted() -> None:
    """Of two sides of a wall with a gap too narrow for the upper arm one is out of reach."""
    wall = {"front": {"x": [80, 5000], "y": [-20, 20]}, "rear": {"x": [-5000, -80], "y": [-20, 20]}}
    _, data = campaign("irb120", 200, 0.05e-3, 1)
    home = np.deg2rad([90.0, 60, -30, 0, 0, 0]).tolist()
    options: dict[str, Any] = {"poses": 4, "candidates_from": data, "floor": -1.0, "clearance": 0.02}
    planned, _ = toured(**options, constraints=rules(keep_out=wall), home=home)
    assert planned.made.rejected["ways"] > 0
    assert planned.made.candidates == 200
    assert planned.joints[:, :5] == pytest.approx(data.joints[planned.made.chosen, :5])
    assert np.abs(planned.joints[:, 5]).max() <= np.pi
    assert (planned.made.robot.forward(planned.joints)[0][:, 1] > 0.0).all()


@pytest.mark.parametrize("pull", [20.0, 0.0])
def test_pairs_for_inclinometers_are_driven(pull: float, tmp_path: Path) -> None:
    out = tmp_path / "pairs.csv"
    planned = truearm.plan_inclinometers("katana450", poses=8, candidates=100, pull=pull, out=out)
    tour = planned.tour
    at = np.concatenate(
        [pairs.joints_in_turn()[0] for pairs in (planned.made.inclined, planned.made.posed) if len(pairs)]
    )
    assert np.array_equal(np.array([stop.joints for stop in tour.measured]), at)
    assert [stop.label for stop in tour.measured] == [str(k + 1) for k in range(len(at))]
    share = np.linspace(0.0, 1.0, 12)[:, None]
    ways = np.concatenate([a + share * (b - a) for a, b in pairwise(tour.joints)])
    assert sampled_room(planned.robot, ways, Cell(), points=9).min() >= 0.05
    assert any(line.startswith("Driven from home (") for line in planned.lines())
    assert planned.summary()["ways"]["clearance_mm"] == pytest.approx(50.0)
    with (tmp_path / "pairs-ways.csv").open(newline="") as file:
        assert [row["stop"] for row in csv.DictReader(file)] == [stop.kind for stop in tour.stops]
    with pytest.raises(InputError, match="the floor is above the base"):
        truearm.plan_inclinometers("katana450", poses=8, candidates=100, floor=0.2)


def test_a_device_that_winds_no_cable() -> None:
    planned, _ = toured(poses=12, candidates=150, device="ballbar")
    assert np.abs(planned.joints[:, 5]).max() <= np.pi
    assert "The fixtures of the device are not kept clear of." in planned.lines()


@pytest.mark.parametrize(
    ("options", "parameter", "words"),
    [
        ({"floor": 0.1}, "floor", "the floor is above the base of the robot; got '100 mm'; allowed: 0 mm or less"),
        ({"floor": -0.1, "no_floor": True}, "floor, no_floor", "a floor is given and denied; got '-100 mm'"),
        ({"clearance": 0.9}, "clearance", "no configuration was found in which the arm keeps clear"),
        ({"clearance": 5e-5}, "clearance", r"so little room.*'0\.05 mm'"),
        ({"home": [0.0] * 5}, "home", "6 numbers belong here"),
        ({"home": "0,0,0,0,0"}, "home", "there are not as many numbers as joints; got '5 numbers'"),
        ({"home": "0,x"}, "home", "numbers separated by commas"),
        ({"home": [0.0, 0, 0, 0, 0, 6.5]}, "home", "joint 6 of the safe configuration is not where"),
        ({"home": [0.0, 1.5, 0, 0, 0, 0]}, "home", "the safe configuration is not clear"),
    ],
)
def test_what_cannot_be_driven_is_refused(options: dict[str, object], parameter: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as refusal:
        toured(**options)
    assert refusal.value.parameter == parameter


WALLS = {"a": {"x": [200, 201]}, "b": {"x": [-201, -200]}, "c": {"y": [200, 201]}, "d": {"y": [-201, -200]}}


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ({"keep_out": {"table": {}}}, "keep_out, table: a box to keep out of that has no end leaves no room"),
        ({"keep_out": {"table": {"x": [5, 1]}}}, "keep_out, table, x: the range is empty"),
        ({"keep_out": {"cage": {"x": [-900, 900], "y": [-900, 900], "z": [-100, 1500]}}}, "holds the base"),
        ({"keep_out": {"block": {"x": [250, 500], "y": [-200, 200], "z": [500, 900]}}}, "is not clear.*box 'block'"),
        ({"keep_out": {str(k): {"x": [900, 950 + k]} for k in range(21)}}, "too many boxes.*'21 boxes'.*20 boxes or"),
        ({"limits": {k: [0, 0] for k in range(1, 7)}}, "that were chosen coincide.*1 different ones of 12"),
        ({"limits": {2: [200, 300]}}, "the limits of joint 2 leave nothing.*'200 to 300 deg'.*-110 to 110"),
        ({"limits": {2: [100, 110], 3: [60, 70]}}, "no configuration was found|is not clear|not where the plan"),
        (
            {"keep_out": WALLS},
            "[0-9]+ of [0-9]+ usable.*of 2400 drawn, too near to keep_out [ab] .*floor .*smaller boxes",
        ),
    ],
)
def test_cells_without_room_are_refused(entries: dict[str, object], words: str) -> None:
    home = {} if "a" in entries.get("keep_out", {}) else {"home": [0.0] * 6}  # type: ignore[operator]
    with pytest.raises(InputError, match=words):
        toured(poses=12, constraints=rules(**entries), **home)


def test_all_stops_are_written(tmp_path: Path) -> None:
    out = tmp_path / "plan.csv"
    planned, tour = toured(out=out)
    with (tmp_path / "plan-ways.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    kinds = [row["stop"] for row in rows]
    assert kinds == [stop.kind for stop in tour.stops]
    assert [row["configuration"] for row in rows if row["configuration"]] == [*planned.labels]
    joints = np.array([[float(row[f"joint_{k} [deg]"]) for k in range(1, 7)] for row in rows])
    assert np.deg2rad(joints) == pytest.approx(tour.joints)
    with out.open(newline="") as file:
        first = next(csv.DictReader(file))
    approach = rows[kinds.index("measure") - 1]
    assert approach["stop"] == "approach"
    assert [approach[f"joint_{k} [deg]"] for k in range(1, 7)] == [first[f"approach_{k} [deg]"] for k in range(1, 7)]
    (tmp_path / "other-ways.csv").mkdir()
    with pytest.raises(InputError, match="this is a folder"):
        toured(out=tmp_path / "other.csv")


def test_a_plan_is_as_good_as_one_that_hits_the_floor() -> None:
    """By what the priors and the readings tell of the parameters, all over the reach."""
    driven = truearm.plan("irb120", poses=30, candidates=600)
    anywhere = truearm.plan("irb120", poses=30, candidates=600, no_floor=True, clearance=0.0)
    assert driven.made.prediction.planned < 1.02 * anywhere.made.prediction.planned


def test_a_calibrated_robot_is_looked_at_where_its_table_says() -> None:
    robot = truearm.load_robot("irb120")
    moved = robot.with_values({"base_x": 0.5, "base_z": 0.7})
    nominal, calibrated = (truearm.plan(arm, poses=12, candidates=60) for arm in (robot, moved))
    assert nominal.tour is not None
    assert calibrated.tour is not None
    assert np.array_equal(nominal.tour.home, calibrated.tour.home)
    assert calibrated.made.robot.forward(calibrated.joints)[0][:, 2].min() > 0.05
    assert replace(nominal.tour.stops[0], label=None).kind == "home"


ODD = {
    "one joint": "  - {name: a, theta_offset: 0, d: 0, a: 500, alpha: 0}\n",
    "a pendulum": """\
  - {name: a, theta_offset: 0, d: 0, a: 0, alpha: 90}
  - {name: b, theta_offset: 0, d: 0, a: 400, alpha: 0}
""",
    "a horizontal arm": """\
  - {name: a, theta_offset: 0, d: 200, a: 250, alpha: 0, limits: [-130, 130]}
  - {name: b, theta_offset: 0, d: 0, a: 250, alpha: 180, limits: [-145, 145]}
  - {name: c, type: prismatic, theta_offset: 0, d: 0, a: 0, alpha: 0, limits: [0, 150]}
  - {name: d, theta_offset: 0, d: 20, a: 0, alpha: 0, limits: [-360, 360]}
""",
    "a gantry": """\
  - {name: x, type: prismatic, theta_offset: 90, d: 0, a: 0, alpha: 90, limits: [100, 1000]}
  - {name: y, type: prismatic, theta_offset: 90, d: 0, a: 0, alpha: 90, limits: [0, 1000]}
  - {name: z, type: prismatic, theta_offset: 0, d: 0, a: 0, alpha: 0, limits: [0, 800]}
""",
}


@pytest.mark.parametrize("kind", ODD)
def test_arms_of_other_kinds_are_driven_where_nothing_is_near(kind: str, tmp_path: Path) -> None:
    file = tmp_path / "odd.yaml"
    head = "truearm: truearm-robot/1\nname: odd\nunits: {length: mm, angle: deg}\nconvention: standard-dh\njoints:\n"
    file.write_text(head + ODD[kind] + 'tools: {tip: {targets: {"1": [10, 0, 5]}}}\n')
    low = {} if kind == "a horizontal arm" else {"no_floor": True}
    planned = truearm.plan(file, poses=12, candidates=60, **low)  # type: ignore[arg-type]
    assert planned.tour is not None
    robot = planned.made.robot
    assert sampled_room(robot, on_the_ways(planned), Cell(0.0 if not low else None), points=9).min() >= 0.05
    assert len(planned.tour.measured) == 12


def test_a_plan_says_where_links_beside_their_lines_are_kept_clear() -> None:
    planned = truearm.plan("ur5e", poses=10, candidates=60)
    assert any("links-beside" in line for line in planned.lines())
    assert [warning["code"] for warning in planned.summary()["warnings"]] == ["tool-assumed", "links-beside"]


HOME = np.deg2rad([90.0, 60, -30, 0, 0, 0])


@pytest.fixture(scope="module")
def walled() -> Reachable:
    """An arm on one side of a wall with a gap too narrow for it, and candidates on both sides."""
    robot = carrying_targets(load_robot("irb120"))
    inf = np.inf
    walls = {
        "front": (np.array([0.08, -0.02, -inf]), np.array([5.0, 0.02, inf])),
        "rear": (np.array([-5.0, -0.02, -inf]), np.array([-0.08, 0.02, inf])),
    }
    check = CollisionCheck(robot, Cell(-1.0, boxes_of(walls), 0.02))
    low, high = np.array([joint.range for joint in robot.joints]).T
    drawn = np.random.default_rng(1).uniform(low, high, (400, 6))
    clear = drawn[check.smallest_distance(drawn) >= check.need]
    return Reachable(WayFinder(check, HOME, low, high), clear, clear)


def test_what_has_no_way_is_left_out_and_the_choices_are_bounded(walled: Reachable) -> None:
    """A choice that prefers what has no way is asked a few times, then only what is known to have one counts."""
    finder, q = walled.finder, walled.joints
    far = np.argsort(finder.check.arm.robot.forward(q)[0][:, 1])  # beyond the wall first
    rounds: list[int] = []
    messages: list[str] = []

    def choose(left: np.ndarray) -> np.ndarray:
        rounds.append(len(left))
        return far[np.isin(far, left)][:3]

    reachable = Reachable(finder, q, q)
    chosen, cost = chosen_with_ways(choose, np.arange(len(q)), reachable, 3, messages.append)
    assert len(chosen) == 3
    assert len(rounds) == 4
    assert sorted(rounds, reverse=True) == rounds
    assert reachable.known[chosen].all()
    assert (finder.check.arm.robot.forward(q[chosen])[0][:, 1] > 0.0).all()
    assert all(way is not None for way in finder.home_from(q[chosen]))
    assert cost["ways"] >= 9
    assert cost["ways"] + cost.get("straight ways", 0) + rounds[-1] == len(q)
    assert [words for words in messages if words.startswith("looking for ways that keep clear, round ")][-1][-1] == "3"
    assert any(words.endswith("as there was no way to 3") for words in messages)


def test_too_few_with_ways_are_refused_with_what_is_in_the_way(walled: Reachable) -> None:
    q = walled.joints
    beyond = np.flatnonzero(walled.finder.check.arm.robot.forward(q)[0][:, 1] < -0.1)[:12]
    with pytest.raises(
        InputError, match=r"have a way.*0 of 12; on the straight ones most often .*near the box '(front|rear)"
    ) as it:
        chosen_with_ways(lambda left: left[:4], beyond, Reachable(walled.finder, q, q), 4, lambda _: None)
    assert it.value.parameter == "home"
    assert "4 or more" in str(it.value)


def test_without_anything_to_keep_clear_of_the_first_choice_counts() -> None:
    chosen, cost = chosen_with_ways(lambda left: left[:2], np.arange(5), None, 2, lambda _: None)
    assert chosen.tolist() == [0, 1]
    assert cost == {}
