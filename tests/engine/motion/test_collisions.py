"""What an arm keeps clear of: capsules against sampled points, wherever links lie, and ways against many postures."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tests.expecting import refusing
from tests.sampled_arm import sampled_room

from truearm.engine.base.errors import InputError
from truearm.engine.motion.arm_capsules import ArmCapsules, beside_notices, links_beside
from truearm.engine.motion.cell import Cell, KeepOut, box_distance, stands
from truearm.engine.motion.collisions import MARGIN, CollisionCheck
from truearm.engine.motion.constraints import joint_window, on_principal_turn
from truearm.engine.motion.home import checked_home, safe_configuration
from truearm.engine.motion.touring import cell_notices, nearest_on, tour_of, unreached
from truearm.engine.motion.ways import WayFinder, drawn_clear
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


def test_rooms_are_those_of_sampled_links() -> None:
    for name in ("irb120", "gp7", "fr3", "katana450"):
        robot = arm(name)
        q = drawn(robot, 60)
        cell = Cell(floor=-0.1, boxes=(TABLE,), clearance=0.03)
        brute = sampled_room(robot, q, cell)
        room = CollisionCheck(robot, cell).smallest_distance(q)
        assert (room <= brute + 3e-4).all(), name
        assert room == pytest.approx(brute, abs=0.012), name
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
    q = q[check.smallest_distance(q) >= check.need][:120]
    starts, ends = q[::2], q[1::2]
    looked = check.ways(starts, ends)
    share = np.linspace(0.0, 1.0, 201)[:, None]
    brute = np.array([check.smallest_distance(a + share * (b - a)).min() for a, b in zip(starts, ends, strict=True)])
    assert (brute[looked.clear] >= check.cell.clearance).all()
    assert (looked.clear | (brute < check.need + 1e-3)).all()
    assert looked.distance[looked.clear] == pytest.approx(brute[looked.clear], abs=5e-3)
    assert looked.clear.any()
    assert not looked.clear.all()


def test_the_thickness_of_links_follows_from_the_length_of_the_arm_and_of_targets_the_outermost_count() -> None:
    long = 0.290 + 0.270 + 0.070 + 0.302 + 0.072
    assert [link.radius for link in ArmCapsules(arm()).links] == pytest.approx([0.06 * long] * 2 + [0.045 * long] * 3)
    robot = load_robot("irb120")
    grid = {f"{x}_{y}": (0.01 * x, 0.01 * y, 0.05) for x in range(6) for y in range(6)}
    many = ArmCapsules(robot.with_frames(robot.base, grid))
    assert {"0_0", "0_5", "5_0", "5_5"} <= set(many.targets)
    assert len(many.targets) <= 12


def test_the_base_column_may_stand_on_a_table_and_not_in_a_box() -> None:
    robot = arm()
    below = KeepOut("bench", np.array([-0.5, -0.5, -0.9]), np.array([0.5, 0.5, 0.0]))
    check = CollisionCheck(robot, Cell(floor=-0.9, boxes=(below,)))
    assert check.smallest_distance(np.zeros((1, 6)))[0] > 0.1
    assert set(check.clear_of(np.zeros((1, 6)))) == {"floor", "keep_out bench", "links"}
    box = KeepOut("wall", np.array([-np.inf, -0.1, -0.2]), np.array([0.1, 0.1, 0.2]))
    with refusing("keep_out, wall", "got 'x -inf to 100, y -100 to 100", parameter="constraints"):
        CollisionCheck(robot, Cell(boxes=(box,)))


def test_joints_stay_on_their_principal_turn_and_are_brought_back_to_it() -> None:
    robot = load_robot("irb120")
    for limits, window in (
        ((-165, 165), (-165, 165)),
        ((-400, 400), (-180, 180)),
        ((-360, 360), (-180, 180)),
        ((170, 400), (170, 400)),
        ((100, 700), (100, 460)),
        ((-300, 10), (-300, 10)),
        ((-700, 10), (-350, 10)),
    ):
        joints = (*robot.joints[:5], replace(robot.joints[5], limits=tuple(np.deg2rad(limits))))
        low, high = joint_window(replace(robot, joints=joints))
        assert np.rad2deg([low[5], high[5]]) == pytest.approx(window), limits
    q = np.deg2rad([[10.0, 20, 30, 40, 50, 350], [10.0, 20, 30, 40, 50, -170]])
    assert np.rad2deg(on_principal_turn(robot, q)[:, 5]) == pytest.approx([-10.0, -170.0])
    assert np.array_equal(on_principal_turn(robot, q)[:, :5], q[:, :5])


def test_gravity_says_whether_a_robot_stands() -> None:
    for gravity, standing in (((0, 0, -9.81), True), ((0, 3, -9), True), ((0, 0, 9.81), False), ((9.81, 0, 0), False)):
        assert stands(load_robot("irb120").with_payload(gravity=gravity)) is standing, gravity


def test_a_safe_configuration_is_found() -> None:
    for name in ("irb120", "ur3e", "fr3", "lrmate200ic", "puma560", "li3"):
        robot = arm(name)
        low, high = joint_window(robot)
        home = safe_configuration(CollisionCheck(robot, Cell()), low, high)
        assert ((home >= low) & (home <= high)).all()
        assert sampled_room(robot, home[None], Cell())[0] >= 0.09, name
        assert name not in ("irb120", "lrmate200ic") or not home.any()


def test_safe_configurations_and_limits_without_room_are_refused() -> None:
    robot = arm()
    low, high = joint_window(robot)
    lid = KeepOut("lid", np.array([-2.0, -2.0, 0.32]), np.array([2.0, 2.0, 3.0]))
    with refusing("no configuration was found in which the arm keeps clear", "the box 'lid'"):
        safe_configuration(CollisionCheck(robot, Cell(boxes=(lid,))), low, high)
    check = CollisionCheck(robot, Cell())
    for degrees, words in (
        ([0, 0, 0, 0, 0, 200], ["joint 6 of the safe configuration is not where the plan keeps it; got '200 deg'"]),
        ([0, 90, 0, 0, 90, 0], ["the safe configuration is not clear", "the floor: 0.0 mm"]),
    ):
        with refusing(*words, parameter="home"):
            checked_home(check, np.deg2rad(degrees), low, high)
    low, high = np.deg2rad([[0.0, 85, 0, 0, 80, 0], [0.0, 90, 0, 0, 90, 0]])
    narrow = WayFinder(check, finder(robot, Cell()).home, low, high)
    with refusing("no configuration in which the arm keeps clear", "rejected by floor", parameter="clearance"):
        drawn_clear(narrow, 10, np.zeros(6), np.random.default_rng(0))


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
    assert tour.distance == pytest.approx(brute.min(), abs=0.02)
    assert tour.distance >= find.check.cell.clearance + MARGIN
    straight = find.check.ways(np.array([find.home, q[0]]), q)
    k = int(np.argmin(straight.distance))
    assert straight.distance[k] < find.check.cell.clearance
    assert "the box 'wall'" in find.check.words(int(straight.worst[k]))


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


# -- links that may lie beside the lines of the model: kept clear wherever along the axes they truly are

#: Where upper arm and forearm truly lie along the axis of joint 2 [m]: ``offsets`` of physical_parameters.yaml in
#: UniversalRobots/Universal_Robots_ROS2_Description; of the PUMA, the centre of gravity of the upper arm (Armstrong et
#: al. 1986) and the offset of its elbow.
TRULY = {
    "ur3": (0.1198, 0.0275),
    "ur5": (0.13585, 0.0165),
    "ur10": (0.220941, 0.049042),
    "ur3e": (0.120, 0.027),
    "ur5e": (0.138, 0.007),
    "ur10e": (0.1762, 0.0393),
    "ur16e": (0.176, 0.040),
    "ur20": (0.260, 0.043),
    "ur30": (0.260, 0.043),
    "puma560": (0.2435,),
}


def test_links_are_looked_for_where_they_truly_are() -> None:
    for name, truly in TRULY.items():
        (group,) = links_beside(load_robot(name))
        assert group.joints == tuple(range(2, 3 + len(truly))), name
        assert group.low <= min(truly) <= max(truly) <= group.high, name
    for name in ("irb120", "gp7", "lrmate200id", "katana450"):
        assert not beside_notices(load_robot(name)), name


def test_centres_of_gravity_tell_of_links_beside() -> None:
    (group,) = links_beside(load_robot("m1013"))
    assert group.high == pytest.approx(1.4 * 0.19232)
    (flat,) = links_beside(replace(load_robot("m1013"), masses=()))
    assert flat.high == pytest.approx(1.4 * 0.0345)


def test_axes_of_a_calibrated_arm_are_parallel_all_the_same() -> None:
    robot = load_robot("ur5e")
    (nominal,) = links_beside(robot)
    (group,) = links_beside(robot.with_values({"alpha_2": 1e-3, "alpha_3": -8e-4, "d_4": 0.1341}))
    assert group.joints == (2, 3, 4)
    assert group.high == pytest.approx(nominal.high, abs=2e-3)


def test_where_links_are_looked_for_is_said() -> None:
    (notice,) = beside_notices(load_robot("ur5e"))
    assert (notice.code, notice.level) == ("links-beside", "note")
    assert "joints 2, 3 and 4" in notice.message
    assert "0 to 187 mm along the axis of joint 2" in notice.message
    (other,) = beside_notices(load_robot("tm5_900"))
    assert "-171 to 0 mm" in other.message


@pytest.mark.parametrize("name", ["ur3e", "ur10", "puma560", "kr5", "li3", "tm5_900"])
def test_rooms_hold_wherever_along_the_axes_links_lie(name: str) -> None:
    robot = with_targets(load_robot(name))
    (group,) = links_beside(robot)
    q = np.random.default_rng(0).uniform(*joint_window(robot), (80, len(robot.joints)))
    cell = Cell(floor=-0.1, boxes=(TABLE,), clearance=0.03)
    room = CollisionCheck(robot, cell).smallest_distance(q)
    least = np.full(len(q), np.inf)
    for share in np.random.default_rng(1).uniform(size=(6, 2)):
        at = group.side * (group.low + share * (group.high - group.low))
        truly = sampled_room(robot, q, cell, 12, dict(zip(group.joints[:-1], at.tolist(), strict=False)))
        assert (room <= truly + 1e-4).all()
        least = np.minimum(least, truly)
    assert (least < 0.0).any()
    assert (least > 0.03).any()


@pytest.mark.parametrize("name", ["ur5e", "ur3"])
def test_ways_keep_the_true_links_clear(name: str) -> None:
    robot = with_targets(load_robot(name))
    low, high = joint_window(robot)
    check = CollisionCheck(robot, Cell(boxes=(TABLE,)))
    q = np.random.default_rng(0).uniform(low, high, (6000, len(low)))
    q = q[check.smallest_distance(q) >= check.need]
    starts, ends = q[: len(q) // 2], q[len(q) // 2 : 2 * (len(q) // 2)]
    clear = np.flatnonzero(check.ways(starts, ends).clear)[:12]
    truly = dict(zip((2, 3), TRULY[name], strict=True))
    assert len(clear) == 12
    for start, end in zip(starts[clear], ends[clear], strict=True):
        along = start + np.linspace(0.0, 1.0, 60)[:, None] * (end - start)
        nearest = nearest_on(check, np.array([start, end]))
        assert list(nearest) == sorted(nearest, key=lambda what: nearest[what])
        assert min(nearest.values()) >= check.cell.clearance
        assert sampled_room(robot, along, check.cell, 10, truly).min() >= min(nearest.values())


# -- how near an arm comes to each thing, and what is said of what it keeps clear of

BENCH = KeepOut("bench", np.array([-0.9, -0.9, -0.9]), np.array([0.9, 0.9, 0.0]))


@pytest.mark.parametrize("name", ["irb120", "ur5e"])
def test_distances_are_those_of_closely_spaced_postures(name: str) -> None:
    robot = arm(name)
    check = CollisionCheck(robot, Cell(boxes=(TABLE,)))
    stops = np.random.default_rng(3).uniform(*joint_window(robot), (200, 6))
    stops = stops[check.smallest_distance(stops) > 0.0][:8]
    distances = nearest_on(check, stops)
    share = np.linspace(0.0, 1.0, 400)[:, None]
    rooms = check.distances(np.concatenate([a + share * (b - a) for a, b in pairwise(stops)]))
    whats = np.array(check.things)
    assert list(distances.values()) == sorted(distances.values())
    assert set(distances) == {"floor", "keep_out table", "links"}
    for what, room in distances.items():
        dense = rooms[whats == what].min()
        assert room <= dense
        assert room == pytest.approx(dense, abs=2e-3)


def test_at_a_single_configuration_and_with_nothing_around() -> None:
    robot = arm("irb120")
    at = np.zeros((1, 6))
    check = CollisionCheck(robot, Cell())
    assert min(nearest_on(check, at).values()) == pytest.approx(check.smallest_distance(at)[0], abs=1e-3)
    assert "floor" not in nearest_on(CollisionCheck(robot, Cell(floor=None)), at)


def test_rooms_change_no_faster_than_is_taken() -> None:
    """With a little for the gap between the lines of a plate, which counts more where it is near."""
    post = KeepOut("post", np.array([-0.02, 0.9, -2.0]), np.array([0.02, 0.94, 2.0]))
    for name in ("puma560", "ur10"):
        robot = arm(name)
        check = CollisionCheck(robot, Cell(boxes=(post,)))
        q = drawn(robot, 300)
        far = check.distances(q) > 0.1
        for joint in range(6):
            turned = q + 1e-3 * np.eye(6)[joint]
            change = np.abs(check.distances(turned) - check.distances(q))
            assert (change <= 1.03 * check.spread(q, turned) + 1e-9)[far].all(), (name, joint)


def test_tiny_boxes_and_boxes_out_of_reach_are_said() -> None:
    robot = arm("irb120")
    tiny = KeepOut("in metres", np.array([0.35e-3, -0.4e-3, 0.1e-3]), np.array([0.8e-3, 0.4e-3, 0.2e-3]))
    far = KeepOut("in inches", np.array([35.0, -np.inf, -np.inf]), np.full(3, np.inf))
    first, second = cell_notices(CollisionCheck(robot, Cell(boxes=(tiny, far, TABLE))))
    assert (first.code, first.level) == ("box-unlikely", "warning")
    assert "longest side of the box 'in metres' is 0.8 mm" in first.message
    assert (second.code, second.level) == ("box-unlikely", "warning")
    assert "The box 'in inches' begins 35000 mm from the base" in second.message
    assert not cell_notices(CollisionCheck(robot, Cell(boxes=(TABLE, BENCH))))


def test_what_no_posture_keeps_apart_is_named() -> None:
    """An arm whose limits keep its tool folded over its shoulder, and a drum that turns just over a bench."""
    robot = load_robot("irb120")
    folded = [(-1.0, 1.0), (-0.1, 0.1), (0.9, 1.2), (-0.1, 0.1), (1.3, 1.5), (-1.0, 1.0)]
    joints = tuple(replace(joint, limits=limits) for joint, limits in zip(robot.joints, folded, strict=True))
    arm_ = replace(robot, joints=joints).with_frames(robot.base, {"tip": (0.0, 0.0, 0.25)})
    (notice,) = cell_notices(CollisionCheck(arm_, Cell()))
    assert (notice.code, notice.level) == ("never-apart", "note")
    assert "the link from joint 1 to joint 2 and what holds target 'tip'" in notice.message
    check = CollisionCheck(arm("ur10"), Cell(boxes=(BENCH,)))
    *_, notice = cell_notices(check)
    assert "the link from joint 2 to joint 3, next to joint 2, and the box 'bench'" in notice.message
    upright = np.deg2rad([[0.0, -90, 0, -90, 0, 0]])
    assert check.smallest_distance(upright)[0] > 0.05
