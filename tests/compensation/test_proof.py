"""What is refused, accepted and told of robots whose calibration ended badly, was edited, or is not known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.answered import compensate
from tests.compensation.workplace import cell, codes, plate
from tests.simulated import campaign

import truearm
from truearm import InputError, Robot
from truearm.compensation.report import program_html
from truearm.engine.base.errors import Notice
from truearm.engine.robot.robot_file.seal import sealed
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.robot_files.show import RobotDescription

NARROW = Notice("narrow-data", "Over the workspace it is worse.", "error")
FAR = Notice("far-from-nominal", "Check that the nominal values are those of its controller.", "note")
WRONG = Notice("wrong-robot", "The readings are not of irb120.", "error")
SIGNS = Notice("joint-sign", "Joint 6 turns the other way.", "error")


@pytest.fixture(scope="module")
def robot() -> Robot:
    return truearm.calibrate("irb120", campaign("irb120", 20, 2e-5, 1)[1], model="geometric").robot


@pytest.fixture
def program(tmp_path: Path) -> Path:
    return plate(tmp_path)


def with_proof(robot: Robot, **changes: Any) -> Robot:
    """Return a robot whose calibration is known to be otherwise."""
    assert robot.proof is not None
    return sealed(robot, replace(robot.proof, **changes))


def ended(robot: Robot, status: str = "converged", *errors: Notice) -> Robot:
    return with_proof(robot, status=status, errors=errors)


def test_an_unsound_fit_corrects_no_program_unless_accepted(robot: Robot, program: Path) -> None:
    for status in ("rank-loss", "not-converged", "implausible"):
        unsound = ended(robot, status)
        with pytest.raises(InputError, match=f"got '{status}'.*give `accept={status}`") as refusal:
            compensate(unsound, [program])
        assert refusal.value.parameter == "robot"
        result = compensate(unsound, [program], accept=[status])
        assert codes(result)[status] == "warning"
        assert f"accept=['{status}']" in result.command
        assert result.applied()["proof"]["status"] == status
    # Nor does the robot of a wrong name.
    wrong = ended(robot, "converged", WRONG)
    with pytest.raises(InputError, match=r"got 'wrong-robot'.*not of irb120.*give `accept=wrong-robot`"):
        compensate(wrong, [program])
    assert codes(compensate(wrong, [program], accept=["wrong-robot"]))["wrong-robot"] == "warning"


def test_an_error_of_the_calibration_is_told_with_its_words(robot: Robot, program: Path) -> None:
    unsound = ended(robot, "rank-loss", SIGNS)
    both = r"rank-loss.*also ended with joint-sign.*`accept=rank-loss` and `accept=joint-sign`"
    for accepted, words in (([], both), (["rank-loss"], "Joint 6 turns the other way")):
        with pytest.raises(InputError, match=words):
            compensate(unsound, [program], accept=accepted)
    assert {"rank-loss", "joint-sign"} <= set(codes(compensate(unsound, [program], accept=["rank-loss", "joint-sign"])))
    assert "Calibration: rank-loss, joint-sign" in RobotDescription(unsound).lines()
    edited = RobotDescription(unsound.with_values({"a_3": 0.2703}))
    assert "Calibration: rank-loss, joint-sign; values were changed since" in edited.lines()
    assert edited.summary()["proof"]["intact"] is False
    assert RobotDescription(truearm.load_robot("irb120")).summary()["proof"] is None


def test_a_warning_that_concerns_programs_is_repeated_and_refuses_nothing(robot: Robot, program: Path) -> None:
    path = program.parent / "calibrated.yaml"
    path.write_text(robot_text(with_proof(robot, warnings=(FAR,))), encoding="utf-8")
    correction = compensate(path, [program])
    assert FAR in correction.warnings
    assert "edited-by-hand" not in codes(correction)
    assert "far-from-nominal" not in codes(compensate(robot, [program]))
    # A calibration keeps the doubt about its nominal values.
    data = campaign("irb120", 20, 2e-5, 1)[1]
    off = replace(data, joints=data.joints + np.radians([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]))
    result = truearm.calibrate("irb120", off, model="geometric").robot
    for arm in (result, truearm.calibrate(result, off, model="frames").robot):
        assert codes(compensate(arm, [program]))["far-from-nominal"] == "note"


def test_a_program_of_another_maker_is_not_corrected_unless_accepted(robot: Robot, program: Path) -> None:
    other = replace(robot, maker="Universal Robots")
    with pytest.raises(InputError, match=r"RAPID runs on controllers of ABB.*`accept=maker`") as refusal:
        compensate(other, [program])
    assert refusal.value.parameter == "robot"
    result = compensate(other, [program], accept=["maker"])
    assert codes(result)["maker"] == "warning"
    for maker in ("ABB", "abb robotics", ""):
        assert "maker" not in codes(compensate(replace(robot, maker=maker), [program]))


def test_narrow_data_are_judged_target_by_target_but_of_an_edited_robot(robot: Robot, program: Path) -> None:
    narrow = ended(robot, "converged", NARROW)
    assert codes(compensate(narrow, [program]))["narrow-data"] == "warning"
    # That is not cleared of how its fit ended.
    for doubted, code in ((narrow, "narrow-data"), (ended(robot, "rank-loss"), "rank-loss")):
        edited = doubted.with_values({"a_3": 0.2703})
        with pytest.raises(InputError, match=f"got '{code}'"):
            compensate(edited, [program])
        result = compensate(edited, [program], accept=[code])
        assert codes(result)["edited-by-hand"] == "warning"
        assert result.summary()["programs"][0]["expected_mm"] is None


def test_only_known_names_are_accepted(robot: Robot, program: Path) -> None:
    always = "maker, other-kinematics, numbers-read, skipped, not-better-here"
    signs = ended(robot, "converged", SIGNS)
    for doubted, wrong, known in (
        (robot, "rank-lost", "narrow-data, wrong-robot"),
        (signs, "joint-signs", "joint-sign"),
    ):
        with pytest.raises(InputError, match=f"{known}, {always}") as refusal:
            compensate(doubted, [program], accept=[wrong])
        assert refusal.value.parameter == "accept"
    assert codes(compensate(robot, [program], accept=["rank-loss"])) == codes(compensate(robot, [program]))


def test_an_unproven_robot_is_corrected_with_a_note(robot: Robot, program: Path) -> None:
    result = compensate(replace(robot, proof=None), [program])
    assert codes(result)["unproven"] == "note"
    assert result.summary()["programs"][0]["expected_mm"] is None
    assert result.applied()["proof"] is None
    assert result.lines()[1] == "plate.mod  RAPID: the error to expect is not known"
    with pytest.raises(InputError, match="not calibrated") as refusal:
        compensate("irb120", [program])
    assert refusal.value.parameter == "robot"
    # A payload leaves the proof.
    result = compensate(robot, [program], payload="1kg,0mm,0mm,50mm")
    assert "edited-by-hand" not in codes(result)
    assert result.summary()["programs"][0]["expected_mm"] is not None


def test_joints_for_poses_and_exports_are_made_with_a_warning(robot: Robot, tmp_path: Path) -> None:
    unsound = ended(robot, "rank-loss", SIGNS).with_values({"a_3": 0.2703})
    position, rotation = robot.forward(np.zeros((1, 6)))
    table = truearm.inverse(unsound, position, rotation)
    exported = truearm.export(unsound, "json", out=tmp_path / "robot.json")
    for warnings, lines, summary in (
        (table.warnings, table.lines(), table.summary()),
        (exported.warnings, exported.lines(), exported.summary()),
    ):
        levels = {notice.code: notice.level for notice in warnings if notice.code != "left-out"}
        assert levels == dict.fromkeys(("rank-loss", "joint-sign", "edited-by-hand"), "warning")
        assert "Joint 6 turns the other way." in "\n".join(lines)
        assert {"rank-loss", "joint-sign", "edited-by-hand"} <= {notice["code"] for notice in summary["warnings"]}
    assert truearm.inverse(robot, position, rotation).warnings == ()
    assert truearm.inverse("irb120", position, rotation).warnings == ()


def test_what_is_expected_is_told(robot: Robot, program: Path, tmp_path: Path) -> None:
    result = compensate(robot, [program], out=tmp_path / "out")
    (file,) = result.files
    assert file.expected is not None
    before, after = file.expected
    assert len(before) == len(after) == 43
    assert 0.0 < after.mean() < before.mean()
    (summary,) = result.summary()["programs"]
    assert summary["expected_mm"]["before"]["max"] == pytest.approx(1e3 * before.max())
    assert summary["expected_mm"]["after"]["mean"] == pytest.approx(1e3 * after.mean())
    message = result.lines()[1]
    assert (
        f"RAPID: relative error to expect {1e3 * before.mean():.3f} mm before, {1e3 * after.mean():.3f} mm" in message
    )
    assert f"largest expected, not a bound: {1e3 * before.max():.3f} and {1e3 * after.max():.3f} mm" in message
    assert "at most" not in message
    page = (tmp_path / "out" / "compensation.html").read_text()
    assert 'id="expected"' in page
    assert f'<td class="n">{1e3 * after.mean():.3f}</td>' in page


def test_targets_that_were_measured_nowhere_near_are_named(robot: Robot, program: Path) -> None:
    assert robot.proof is not None
    (low, high), *others = robot.proof.region
    turned = with_proof(robot, region=((low + 2 * np.pi, high + 2 * np.pi), *others))
    for arm in (robot, turned):
        assert "beyond-measured" not in codes(compensate(arm, [program]))
    elsewhere = with_proof(robot, region=((1.5, 2.0), *others))
    (notice,) = [n for n in compensate(elsewhere, [program]).warnings if n.code == "beyond-measured"]
    assert "axis_1 stood well outside the range measured in calibration: plate.mod line 8" in notice.message


def test_a_lower_bound_is_called_one(robot: Robot, program: Path) -> None:
    assert robot.proof is not None
    for bound in (True, False):
        vague = tuple(5.0 * deviation for deviation in robot.proof.deviations)
        result = compensate(with_proof(robot, lower_bound=bound, deviations=vague), [program])
        assert result.summary()["expected_is_lower_bound"] is bound
        assert any("may be larger: the calibration" in line for line in result.lines()) is bound
        low, high = result.summary()["programs"][0]["expected_mm"]["after"]["interval_90"]
        assert low > 0.0
        assert (high is None) is bound
        assert (" or more); largest" in result.lines()[1]) is bound
        page = program_html(result)
        assert (f"the mean is {low:.3f} mm or more now" in page) is bound
        assert (f"the mean is {low:.3f} to " in page) is not bound


def test_errors_without_measured_frames_are_called_relative(robot: Robot, program: Path, tmp_path: Path) -> None:
    frames = cell(tmp_path, "frames:\n  wobjPlate: {of: base, translation: [310, -110, 60]}\n")
    assert any("RAPID: error to expect" in line for line in compensate(robot, [program], frames=frames).lines())
    result = compensate(robot, [program])
    assert "of all programs together" in result.relative
    assert result.summary()["expected_is_relative"] is True
    assert "in each frame" in compensate(robot, [program], taught=["frames"]).relative


def test_nothing_is_promised_that_no_robot_repeats(robot: Robot, program: Path) -> None:
    """A calibration from hundreds of readings without noise knows its parameters to nanometres; no arm goes there."""
    assert robot.proof is not None
    deviations = tuple(1e-6 * d for d in robot.proof.deviations)
    known = with_proof(robot, deviations=deviations, joint_error=(0.0,) * 6, lower_bound=False)
    result = compensate(known, [program])
    assert " mm before, 0.010 mm or more now (no robot repeats better); " in result.lines()[1]
    after = result.summary()["programs"][0]["expected_mm"]["after"]
    assert (after["mean"], after["max"]) == pytest.approx((0.01, 0.01))


def test_targets_that_rather_get_worse_are_kept_and_listed(robot: Robot, program: Path, tmp_path: Path) -> None:
    assert robot.proof is not None
    vague = with_proof(robot, deviations=tuple(50.0 * d for d in robot.proof.deviations))
    result = compensate(vague, [program], out=tmp_path / "out")
    (file,) = result.files
    unchanged = [row for row in file.not_better if not file.correction.corrected[row]]
    assert unchanged
    assert codes(result)["not-better-here"] == "warning"
    assert ("nothing-corrected" in codes(result)) is (len(unchanged) == 43)
    content = result.summary()["programs"][0]
    assert content["corrected"] == 43 - len(unchanged)
    assert len(content["not_better"]) == len(file.not_better)
    assert all(row["probability_worse"] > 0.1 or row["kept"] for row in content["not_better"])
    np.testing.assert_array_equal(file.correction.after[unchanged], file.correction.before[unchanged])
    again = result.as_written()[0].targets
    for row in unchanged:
        assert again[row].values == file.correction.program.targets[row].values
    page = (tmp_path / "out" / "compensation.html").read_text()
    assert 'id="not-better"' in page
    assert page.count("<td>kept</td>") == len(unchanged)
    all_of_them = compensate(vague, [program], accept=["not-better-here"])
    assert all_of_them.files[0].corrected == 43
    (notice,) = [notice for notice in all_of_them.warnings if notice.code == "not-better-here"]
    assert "corrected nevertheless" in notice.message
    assert {row["kept"] for row in all_of_them.summary()["programs"][0]["not_better"]} == {False}
