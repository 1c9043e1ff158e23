"""Workspace, loads and unnamed postures on the page Jog, without a browser."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.studio.arms import GANTRY, SCARA
from tests.studio.conftest import Serving
from tests.studio.test_jog_page import act

from truearm.engine.base.errors import InputError
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.studio.jogging import Jogging
from truearm.studio.load_arrows import load_arrows, reached_points
from truearm.studio.pages.jog import JogPage


def test_loads_and_workspace_are_drawn_and_follow_the_arm(serving: Serving) -> None:
    studio = serving()
    page = next(page for page in studio.window.pages if isinstance(page, JogPage))
    studio.window.edit(robot="gp7")
    act(page.views.loads, True)
    assert "carries nothing" in page.views._said.content
    studio.window.edit(payload="2kg,0mm,0mm,100mm")
    first = page.scene._parts["loads"][0].points.copy()
    act(page._sliders[1], 45.0)
    assert not np.array_equal(first, page.scene._parts["loads"][0].points)
    assert page.scene._parts["loads"][1].text.startswith("loads of the joints, largest ")
    act(page.views.workspace, True)
    cloud = page.scene._parts["workspace"][0]
    act(page._sliders[1], 10.0)
    assert page.scene._parts["workspace"][0] is cloud
    act(page.views.workspace, False)
    act(page.views.loads, False)
    assert page.scene._parts["workspace"] == page.scene._parts["loads"] == []


def test_moments_are_those_of_the_weight_about_the_axes() -> None:
    # A mass far out on a stretched arm pulls its shoulder and its elbow down by weight times lever.
    robot = replace(load_robot("irb120"), masses=(), balancers=()).with_payload(Payload(3.0, (0.0, 0.0, 0.1)), None)
    arm = Jogging(robot)
    arm.go(np.deg2rad([0.0, 90.0, -90.0, 0.0, 0.0, 0.0]))
    arrows, told = load_arrows(robot, arm.at, 1.0)
    tip = robot.forward(arm.joints[None], frame="world")[0][0] + robot.forward(arm.joints[None])[1][0][:, 2] * 0.1
    shoulder = np.array([0.0, 0.0, 0.29])
    moment = float(np.cross(tip - shoulder, [0.0, 0.0, -3.0 * 9.80665])[1])
    assert told[1] == f"axis_2: {moment:.3g} N m"
    largest = max(range(len(arrows.segments)), key=lambda k: float(np.linalg.norm(np.diff(arrows.segments[k], axis=0))))
    assert np.diff(arrows.segments[largest], axis=0)[0] == pytest.approx([0.0, 0.35, 0.0], abs=1e-9)
    sliding = SCARA.with_payload(Payload(3.0, (0.0, 0.0, 0.0)), None)
    assert load_arrows(sliding, Jogging(sliding).at, 1.0)[1][2].endswith(" N")
    with pytest.raises(InputError, match="carries nothing"):
        load_arrows(GANTRY, Jogging(GANTRY).at, 1.0)


def test_moments_of_rounding_are_zero() -> None:
    payload = Payload(3.0, (0.0, 0.0, 0.1))
    robot = replace(load_robot("irb120"), masses=(), balancers=()).with_payload(payload, (0.0, 1e-8, -9.80665))
    assert load_arrows(robot, Jogging(robot).at, 1.0)[1][0] == "axis_1: 0 N m"


def test_reached_points_are_those_of_the_tip() -> None:
    points = reached_points(SCARA, None)
    assert np.linalg.norm(points[:, :2], axis=1).max() <= 0.55 + 1e-9
    assert len(points) > 1000


@pytest.mark.parametrize("name", ["crx10ia", "fr3", "katana450"])
def test_arms_whose_branches_have_no_names_find_other_postures(name: str) -> None:
    robot = load_robot(name)
    arm = Jogging(robot)
    arm.go(robot.random_configurations(1, np.random.default_rng(3))[0])
    place, turned = arm.pose()
    found = arm.branches()
    assert found
    assert [branch.name for branch in found] == [f"posture {k}" for k in range(1, len(found) + 1)]
    for branch in found:
        assert np.abs(branch.joints - arm.joints).max() > 0.3
        other = Jogging(robot, branch.joints)
        assert other.pose()[0] == pytest.approx(place, abs=1e-6)
        if arm.orientation == "full":
            assert other.pose()[1] == pytest.approx(turned, abs=1e-6)


def test_where_there_is_no_other_posture_none_is_offered() -> None:
    assert Jogging(GANTRY).branches() == []
