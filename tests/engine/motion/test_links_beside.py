"""Arms whose links may lie beside the lines of the model: kept clear wherever along the axes they truly are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.sampled_arm import sampled_room

from truearm import load_robot
from truearm.engine.motion.arm_capsules import beside_notices, links_beside
from truearm.engine.motion.cell import Cell, KeepOut
from truearm.engine.motion.collisions import CollisionCheck
from truearm.engine.motion.constraints import joint_window
from truearm.engine.motion.touring import nearest_on
from truearm.planning.choosing import with_targets

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
TABLE = KeepOut("table", np.array([0.3, -0.2, 0.0]), np.array([0.6, 0.2, 0.3]))


@pytest.mark.parametrize("name", TRULY)
def test_links_are_looked_for_where_they_truly_are(name: str) -> None:
    (group,) = links_beside(load_robot(name))
    assert group.joints == tuple(range(2, 3 + len(TRULY[name])))
    assert group.low <= min(TRULY[name])
    assert group.high >= max(TRULY[name])


@pytest.mark.parametrize("name", ["irb120", "gp7", "lrmate200id", "katana450"])
def test_links_in_one_plane_lie_on_their_lines(name: str) -> None:
    assert not beside_notices(load_robot(name))


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
    room = CollisionCheck(robot, cell).room(q)
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
    q = q[check.room(q) >= check.need]
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
