"""What an arm keeps clear of: capsules against sampled points, ways against closely spaced postures, and refusals."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tests.sampled_arm import sampled_room

from truearm.engine.base.errors import InputError
from truearm.engine.motion.arm_capsules import ArmCapsules
from truearm.engine.motion.cell import Cell, KeepOut, box_distance, stands
from truearm.engine.motion.collisions import MARGIN, CollisionCheck
from truearm.engine.motion.constraints import joint_window, on_principal_turn
from truearm.engine.motion.home import checked_home, safe_configuration
from truearm.engine.motion.touring import tour_of, unreached
from truearm.engine.motion.ways import WayFinder, drawn_clear, touched
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.planning.choosing import with_targets

TABLE = KeepOut("table", np.array([0.3, -0.2, 0.0]), np.array([0.6, 0.2, 0.3]))


def arm(name: str = "irb120") -> Robot:
    return with_targets(load_robot(name))


def drawn(robot: Robot, count: int, seed: int = 0) -> np.ndarray:
    low, high = joint_window(robot)
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


def finder(robot: Robot, cell: Cell) -> WayFinder:
    low, high = joint_window(robot)
    check = CollisionCheck(robot, cell)
    return WayFinder(check, safe_configuration(check, low, high), low, high)


def test_distance_from_a_box_by_brute_force() -> None:
    rng = np.random.default_rng(0)
    p, q = rng.normal(size=(2, 3, 200))
    low, high = np.array([-0.2, -0.5, 0.1]), np.array([0.4, np.inf, 0.3])
    along = p[..., None] + np.linspace(0.0, 1.0, 801) * (q - p)[..., None]
    nearest = along - np.clip(along, low[:, None, None], high[:, None, None])
    brute = np.linalg.norm(nearest, axis=0).min(axis=1)
    found = box_distance(p, q, low, high)
    assert (found <= brute + 1e-3).all()
    assert found == pytest.approx(brute, abs=5e-3)
    assert (found < 1e-3).any()
    assert box_distance(p, p, low, high) == pytest.approx(np.linalg.norm(p - np.clip(p.T, low, high).T, axis=0))


@pytest.mark.parametrize("name", ["irb120", "gp7", "fr3", "katana450"])
def test_rooms_are_those_of_sampled_links(name: str) -> None:
    robot = arm(name)
    q = drawn(robot, 60)
    cell = Cell(floor=-0.1, boxes=(TABLE,), clearance=0.03)
    brute = sampled_room(robot, q, cell)
    room = CollisionCheck(robot, cell).room(q)
    assert (room <= brute + 3e-4).all()
    assert room == pytest.approx(brute, abs=0.012)
    left, lost = CollisionCheck(robot, cell).sifted(q)
    assert np.array_equal(left, q[room >= cell.clearance + MARGIN])
    assert sum(lost.values()) == len(q) - len(left)
    assert (brute < 0.0).any()
    assert (brute > 0.05).any()


@pytest.mark.parametrize("name", ["ur5e", "katana450"])
def test_ways_are_clear_where_closely_spaced_postures_are(name: str) -> None:
    robot = arm(name)
    check = CollisionCheck(robot, Cell(boxes=(TABLE,)))
    q = drawn(robot, 3000)
    q = q[check.room(q) >= check.need][:120]
    starts, ends = q[::2], q[1::2]
    looked = check.ways(starts, ends)
    share = np.linspace(0.0, 1.0, 201)[:, None]
    brute = np.array([check.room(a + share * (b - a)).min() for a, b in zip(starts, ends, strict=True)])
    assert (brute[looked.clear] >= check.cell.clearance).all()
    assert (looked.clear | (brute < check.need + 1e-3)).all()
    assert looked.room[looked.clear] == pytest.approx(brute[looked.clear], abs=5e-3)
    assert looked.clear.any()
    assert not looked.clear.all()


def test_the_thickness_of_links_follows_from_the_length_of_the_arm() -> None:
    links = ArmCapsules(arm()).links
    long = 0.290 + 0.270 + 0.070 + 0.302 + 0.072
    assert [link.radius for link in links] == pytest.approx([0.06 * long] * 2 + [0.045 * long] * 3)


def test_of_many_targets_the_outermost_are_looked_at() -> None:
    robot = load_robot("irb120")
    grid = {f"{x}_{y}": (0.01 * x, 0.01 * y, 0.05) for x in range(6) for y in range(6)}
    many = ArmCapsules(robot.with_frames(robot.base, grid))
    corners = {"0_0", "0_5", "5_0", "5_5"}
    assert corners <= set(many.targets)
    assert len(many.targets) <= 12


def test_the_base_column_may_stand_on_a_table() -> None:
    robot = arm()
    below = KeepOut("bench", np.array([-0.5, -0.5, -0.9]), np.array([0.5, 0.5, 0.0]))
    check = CollisionCheck(robot, Cell(floor=-0.9, boxes=(below,)))
    assert check.room(np.zeros((1, 6)))[0] > 0.1
    assert set(check.kept(np.zeros((1, 6)))) == {"floor", "keep_out bench", "links"}


def test_a_box_that_holds_the_base_is_refused() -> None:
    box = KeepOut("wall", np.array([-np.inf, -0.1, -0.2]), np.array([0.1, 0.1, 0.2]))
    with pytest.raises(InputError, match="holds the base of the robot; got 'x -inf to 100, y -100 to 100") as refusal:
        CollisionCheck(arm(), Cell(boxes=(box,)))
    assert refusal.value.parameter == "constraints"
    assert "keep_out, wall" in str(refusal.value)


@pytest.mark.parametrize(
    ("limits", "window"),
    [
        ((-165, 165), (-165, 165)),
        ((-400, 400), (-180, 180)),
        ((-360, 360), (-180, 180)),
        ((170, 400), (170, 400)),
        ((100, 700), (100, 460)),
        ((-300, 10), (-300, 10)),
        ((-700, 10), (-350, 10)),
    ],
)
def test_joints_stay_on_their_principal_turn(limits: tuple[float, float], window: tuple[float, float]) -> None:
    robot = load_robot("irb120")
    joints = (*robot.joints[:5], replace(robot.joints[5], limits=tuple(np.deg2rad(limits))))
    low, high = joint_window(replace(robot, joints=joints))
    assert np.rad2deg([low[5], high[5]]) == pytest.approx(window)


def test_joints_on_another_turn_are_brought_back() -> None:
    robot = load_robot("irb120")
    q = np.deg2rad([[10.0, 20, 30, 40, 50, 350], [10.0, 20, 30, 40, 50, -170]])
    assert np.rad2deg(on_principal_turn(robot, q)[:, 5]) == pytest.approx([-10.0, -170.0])
    assert np.array_equal(on_principal_turn(robot, q)[:, :5], q[:, :5])


@pytest.mark.parametrize(
    ("gravity", "standing"), [((0, 0, -9.81), True), ((0, 3, -9), True), ((0, 0, 9.81), False), ((9.81, 0, 0), False)]
)
def test_gravity_says_whether_a_robot_stands(gravity: tuple[float, float, float], standing: bool) -> None:
    assert stands(load_robot("irb120").with_payload(gravity=gravity)) is standing


@pytest.mark.parametrize("name", ["irb120", "ur3e", "fr3", "lrmate200ic", "puma560", "li3"])
def test_a_safe_configuration_is_found(name: str) -> None:
    robot = arm(name)
    low, high = joint_window(robot)
    cell = Cell()
    home = safe_configuration(CollisionCheck(robot, cell), low, high)
    assert ((home >= low) & (home <= high)).all()
    assert sampled_room(robot, home[None], cell)[0] >= 0.09
    if name in ("irb120", "lrmate200ic"):
        assert not home.any()


def test_no_room_for_a_safe_configuration_is_refused() -> None:
    robot = arm()
    low, high = joint_window(robot)
    lid = KeepOut("lid", np.array([-2.0, -2.0, 0.32]), np.array([2.0, 2.0, 3.0]))
    with pytest.raises(InputError, match=r"no configuration was found in which the arm keeps clear.*the box 'lid'"):
        safe_configuration(CollisionCheck(robot, Cell(boxes=(lid,))), low, high)


@pytest.mark.parametrize(
    ("degrees", "words"),
    [
        ([0, 0, 0, 0, 0, 200], "joint 6 of the safe configuration is not where the plan keeps it; got '200 deg'"),
        ([0, 90, 0, 0, 90, 0], "the safe configuration is not clear; got '.* the floor: 0.0 mm'"),
    ],
)
def test_a_safe_configuration_that_is_none_is_refused(degrees: list[float], words: str) -> None:
    robot = arm()
    with pytest.raises(InputError, match=words) as refusal:
        checked_home(CollisionCheck(robot, Cell()), np.deg2rad(degrees), *joint_window(robot))
    assert refusal.value.parameter == "home"


def test_limits_in_which_nothing_is_clear_are_refused() -> None:
    find = finder(arm(), Cell())
    low, high = np.deg2rad([[0.0, 85, 0, 0, 80, 0], [0.0, 90, 0, 0, 90, 0]])
    narrow = WayFinder(find.check, find.home, low, high)
    with pytest.raises(InputError, match=r"no configuration in which the arm keeps clear; got '400 drawn") as refusal:
        drawn_clear(narrow, 10, np.zeros(6), np.random.default_rng(0))
    assert refusal.value.parameter == "clearance"
    assert "rejected by floor" in str(refusal.value)


def test_a_way_goes_around_a_wall() -> None:
    """On both sides of a thin wall that the stretched arm would sweep through."""
    robot = arm()
    wall = KeepOut("wall", np.array([0.2, -0.02, 0.0]), np.array([2.0, 0.02, 0.6]))
    find = finder(robot, Cell(boxes=(wall,)))
    q = np.deg2rad([[60.0, 20, 20, 0, 0, 0], [-60.0, 20, 20, 0, 0, 0]])
    assert not find.check.ways(q[:1], q[1:]).clear[0]
    tour = tour_of(find, q, ["left", "right"])
    kinds = [stop.kind for stop in tour.stops]
    assert kinds[0] == kinds[-1] == "home"
    assert [stop.label for stop in tour.measured] == ["left", "right"]
    assert "via" in kinds[kinds.index("measure") :]
    stops = tour.joints
    share = np.linspace(0.0, 1.0, 40)[:-1, None]
    along = np.concatenate([a + share * (b - a) for a, b in pairwise(stops)])
    brute = sampled_room(robot, along, find.check.cell)
    assert brute.min() >= find.check.cell.clearance
    assert tour.room == pytest.approx(brute.min(), abs=0.02)
    assert tour.room >= find.check.cell.clearance + MARGIN
    assert touched(find.check, stops) is None
    move, room, words = touched(find.check, np.array([find.home, *q])) or (-1, 0.0, "")
    assert move in (0, 1)
    assert room < find.check.cell.clearance
    assert "the box 'wall'" in words


def test_a_configuration_behind_walls_is_refused_by_its_name() -> None:
    """The arm stands between two walls that it cannot pass over, and is asked to measure behind one of them."""
    robot = arm()
    walls = tuple(
        KeepOut(name, np.array([-2.0, y - 0.02, -1.0]), np.array([2.0, y + 0.02, 3.0]))
        for name, y in (("left", 0.3), ("right", -0.3))
    )
    find = finder(robot, Cell(boxes=walls, clearance=0.01))
    q = np.array([find.home, find.home])
    q[1, 0] = np.deg2rad(80.0)
    with pytest.raises(InputError, match=r"too near to what the arm keeps clear of.*the box 'left'") as refusal:
        tour_of(find, q, ["first", "second"])
    assert refusal.value.where == "configuration second"
    assert unreached(find, q, None) == [1]


def test_a_pair_without_a_way_is_named() -> None:
    """Between the sides of a wall whose only gap, above the base, is too narrow for the upper arm."""
    robot = arm()
    low, high = joint_window(robot)
    walls = tuple(
        KeepOut(name, np.array([first, -0.02, -np.inf]), np.array([last, 0.02, np.inf]))
        for name, first, last in (("front", 0.1, np.inf), ("rear", -np.inf, -0.1))
    )
    check = CollisionCheck(robot, Cell(boxes=walls))
    left, right = np.deg2rad([[90.0, 60, -30, 0, 0, 0], [-90.0, 60, -30, 0, 0, 0]])
    find = WayFinder(check, left, low, high)
    with pytest.raises(InputError, match=r"no way was found on which .*the box '(front|rear)'") as no:
        tour_of(find, right[None], ["other side"])
    assert no.value.where == "from home to other side"
    assert unreached(find, np.array([left, right]), None) == [1]


def test_a_joint_that_would_be_wound_up_is_refused() -> None:
    robot = arm()
    find = finder(robot, Cell())
    q = np.zeros((2, 6))
    q[:, 5] = np.deg2rad([390.0, -10.0])
    with pytest.raises(InputError, match=r"joint 6 is turned further than a cable follows.*400.0 deg") as refusal:
        tour_of(find, q, ["one", "two"])
    assert refusal.value.where == "between two and one"
