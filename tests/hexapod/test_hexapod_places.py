"""From the plan for several places and four cups to the calibrated robot, on a twin; and the tool changer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.data.hexapod import Device, poses
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rigid_motion
from truearm.engine.twin.twin import Twin
from truearm.hexapod.places import plain_frame
from truearm.hexapod.reachable import reachable_at_places, with_cups
from truearm.hexapod.rehearsal import ToolChanger, ballbar, filled_sheet, locked_cups
from truearm.hexapod.results import HexapodPlan
from truearm.hexapod.sheet import PlannedRow

PLACES = (Transform((0.2268, 0.0, 0.3)), Transform((0.05, 0.25, 0.3), (np.cos(0.2), 0.0, 0.0, np.sin(0.2))))
#: A bar whose range no error of the twin exceeds.
EXACT = Device(sigma=0.0, reach=5e-3)
FRONT = ["front-up", "front-down"]
#: What is wrong with the twin [m or rad].
WRONG = {"a_3": 2e-4, "d_4": -3e-4, "theta_offset_2": 5e-4, "theta_offset_5": -8e-4, "alpha_2": 3e-4, "a_1": 2e-4}


@pytest.fixture(scope="module")
def robot() -> Robot:
    return with_cups(truearm.load_robot("irb120"), "triangular")[0]


@pytest.fixture(scope="module")
def plan(robot: Robot) -> HexapodPlan:
    return truearm.hexapod_plan(robot, PLACES, fourth_cup=True, attachments=4, branches=FRONT)


def wrong(robot: Robot) -> Robot:
    values = robot.values
    return robot.with_values({name: values[name] + value for name, value in WRONG.items()})


def campaign(
    plan: HexapodPlan, twin: Twin, device: Device, changer: bool
) -> tuple[list[PlannedRow], dict[str, Array], str]:
    """Return every sixth row with what comes again, the true base cups, and the sheet filled in."""
    rng = np.random.default_rng(7)
    every = plan.reachable.rows
    again = [row.joints for row in every if row.attachment != "1"]
    rows = [
        row
        for number, row in enumerate(every)
        if (number % 4 == 0 and row.attachment == "1")
        or (changer and any(np.array_equal(row.joints, joints) for joints in again))
    ]
    cups = {f"fixture_{number}": locked_cups(place, rng, 1e-4, fourth=True) for number, place in enumerate(PLACES, 1)}
    return rows, cups, filled_sheet(twin, rows, cups, ballbar(rng, device), ToolChanger(rng) if changer else None)


def test_cups_of_all_sides_and_places_are_exact_and_calibrate_to_the_truth(
    robot: Robot, plan: HexapodPlan, tmp_path: Path
) -> None:
    twin = Twin(wrong(robot))
    rows, cups, text = campaign(plan, twin, EXACT, changer=False)
    (tmp_path / "sheet.csv").write_text(text)
    solved = truearm.hexapod_solve(tmp_path / "sheet.csv", reach=5e-3, out=tmp_path / "data.csv")
    assert len(solved.poses) == len(rows)
    assert {pose.side for pose in solved.poses} >= {1, 2, 4}
    by_label = {row.configuration: row for row in rows}
    for pose in solved.poses:
        frame = plain_frame(cups[pose.place][:3])
        frames = twin.target_frames(by_label[pose.configuration].joints)
        world = np.array([frames[target.name][:3, 3] for target in robot.targets])
        assert pose.cups == pytest.approx((world - np.array(frame.translation)) @ frame.rotation, abs=1e-9)
    result = truearm.calibrate(robot, tmp_path / "data.csv", model="geometric")
    unseen = robot.random_configurations(50, np.random.default_rng(1))
    predicted, true = (
        np.concatenate([arm.world_poses(unseen, target.name)[0] for target in robot.targets])
        for arm in (result.robot, twin.robot)
    )
    R, p = rigid_motion(predicted, true)
    assert predicted @ R.T + p == pytest.approx(true, abs=1e-9)


def test_the_tool_changer_is_found(robot: Robot, plan: HexapodPlan, tmp_path: Path) -> None:
    *_, text = campaign(plan, Twin(wrong(robot)), replace(EXACT, sigma=5e-7), changer=True)
    file = tmp_path / "sheet.csv"
    file.write_text(text)
    solved = truearm.hexapod_solve(file, reach=5e-3)
    assert solved.attached is not None
    assert solved.attached.repeatability is not None
    _, cups = with_cups(robot)
    shift, turn = ToolChanger.shift, ToolChanger.turn
    true = np.sqrt(shift**2 + turn**2 * 2 / 3 * (cups**2).sum(axis=1))
    # 3 freedoms of the attachments in 6 directions: a single draw is good to about a quarter of the truth
    assert solved.attached.repeatability.changer == pytest.approx(true, rel=0.7)
    assert solved.attached.repeatability.rest is not None
    assert solved.attached.repeatability.rest.max() < 3e-6
    assert solved.notices == ()
    assert any("The data declare it." in line for line in solved.lines())
    assert solved.data is not None
    assert solved.data.sigma is not None
    # most rows are of the first attachment, which is where the tool is found; the others are declared to differ more
    assert solved.data.sigma[:3].max() < 0.5 * solved.attached.repeatability.changer.min()
    assert (solved.data.sigma[-3:] > solved.attached.repeatability.changer).all()


def test_attachments_that_were_not_compared_are_told(robot: Robot, plan: HexapodPlan, tmp_path: Path) -> None:
    rows, cups, _ = campaign(plan, Twin(robot), EXACT, changer=False)
    attached = [replace(row, attachment=str(1 + number % 2)) for number, row in enumerate(rows)]
    file = tmp_path / "sheet.csv"
    file.write_text(filled_sheet(Twin(robot), attached, cups, ballbar(np.random.default_rng(0), EXACT)))
    solved = truearm.hexapod_solve(file, reach=5e-3)
    assert [(notice.code, notice.level) for notice in solved.notices] == [("attachments-not-compared", "warning")]
    assert solved.lines()[-1].startswith("Warning (attachments-not-compared): The tool was attached 2 times")
    assert solved.data is not None
    assert solved.data.sigma is None


def test_a_plan_names_places_and_counts_sides(plan: HexapodPlan) -> None:
    summary = plan.summary()
    assert [place["place"] for place in summary["places"]] == ["fixture_1", "fixture_2"]
    assert summary["poses"] == 2 * 4 * 72
    rows = plan.reachable.rows
    assert len({row.configuration for row in rows}) == len(rows) == len(plan.reachable.clearance)
    again = [row for row in rows if row.attachment != "1"]
    assert [row.attachment for row in again] == [*"22222", *"33333", *"44444"]
    assert {row.place for row in again} == {"fixture_2"}
    text = plan.steps_text()
    assert "Measure B1-B2, B2-B3, B3-B1, B1-B4, B2-B4, B3-B4." in text
    assert text.index("Place fixture_1:") < text.index("Place fixture_2:") < text.index("Attachment 2: take the tool")
    assert "between B4 and T" in text


def test_a_place_that_is_out_of_reach_is_named(robot: Robot) -> None:
    with pytest.raises(InputError, match=r"fixture_2.*can reach none of the 8 poses") as refused:
        reachable_at_places(robot, [PLACES[0], Transform((3.0, 0.0, 0.3))], poses()[:2], fourth_cup=True)
    assert refused.value.parameter == "fixture"


def test_a_sheet_is_given_once_and_not_none(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("configuration\n")
    for sheets, words in (([], "there is no sheet"), ([tmp_path / "a.csv"] * 2, "the sheet is given twice")):
        with pytest.raises(InputError, match=words) as refused:
            truearm.hexapod_solve(sheets)
        assert refused.value.parameter == "sheet"
