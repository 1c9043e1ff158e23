"""What a calibration knows about its result stays with the robot and its file, and only as long as it is about them."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.expecting import known, refused
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.calibration.result import Calibration
from truearm.engine.base.errors import Notice
from truearm.engine.robot.conversion import converted
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.proof import Proof
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file import curve_entry as correlations
from truearm.engine.robot.robot_file.curve_entry import correlations_text, factor_from
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.seal import arm_is_known, is_intact, sealed
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import IDENTITY


def proof_of(robot: Robot) -> Proof:
    return known(robot.proof)


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return calibrate("irb120", campaign("irb120", 20, 2e-5, 1)[1], model="geometric", effects=["compliance"])


def read(text: str, tmp_path: Path) -> Robot:
    path = tmp_path / "calibrated.yaml"
    path.write_text(text, encoding="utf-8")
    return read_robot(path)


def test_it_says_how_the_fit_ended_and_what_it_saw(calibration: Calibration) -> None:
    proof = proof_of(calibration.robot)
    assert proof.status == "converged"
    assert proof.names == calibration.fit.free.names
    training = calibration.data.joints[calibration.training]
    np.testing.assert_array_equal(np.array(proof.region).T, [training.min(axis=0), training.max(axis=0)])
    np.testing.assert_array_equal(proof.joint_error, calibration.fit.joint_error)


def test_a_file_is_the_same_after_it_was_read(calibration: Calibration, tmp_path: Path) -> None:
    text = robot_text(calibration.robot)
    robot = read(text, tmp_path)
    ours, theirs = proof_of(robot), proof_of(calibration.robot)
    assert replace(ours, region=(), joint_error=()) == replace(theirs, region=(), joint_error=())
    np.testing.assert_allclose(ours.region, theirs.region, rtol=5e-16)
    np.testing.assert_allclose(ours.joint_error, theirs.joint_error, rtol=5e-16)
    assert robot_text(robot) == text
    assert is_intact(robot)
    assert is_intact(calibration.robot)
    # what spoke against it is kept
    unlike = Notice("implausible", 'Signs of "joint 6": wrong.', "error")
    doubted = replace(calibration, warnings=(*calibration.warnings, unlike)).robot
    robot = read(robot_text(doubted), tmp_path)
    assert (proof_of(robot).status, proof_of(robot).errors) == ("implausible", (unlike,))
    assert is_intact(robot)


def test_the_rounded_covariance_predicts_as_the_fit_does(calibration: Calibration) -> None:
    robot, fit = calibration.robot, calibration.fit
    joints = robot.random_configurations(50, np.random.default_rng(0))
    J = robot.position_jacobian(robot.forward_kinematics(joints, "1"), joints, fit.free.names)
    exact, rounded = (np.einsum("pxn,pq,qxn->n", J, C, J) for C in (fit.covariance, proof_of(robot).covariance))
    np.testing.assert_allclose(rounded, exact, rtol=1e-3)
    # and one without full rank is kept
    parameters = [Parameter.plain(name, "m", "geometry", 0.0, 1e-3) for name in "abc"]
    root = np.array([[1e-3], [-2e-4], [0.0]])
    proof = Proof.of("at-bound", [], [], np.zeros(0), parameters, root @ root.T)
    np.testing.assert_allclose(proof.covariance, root @ root.T, atol=1e-13)
    assert proof.deviations == (1e-3, 2e-4, 0.0)


def test_it_is_about_what_moves_the_robot(calibration: Calibration, tmp_path: Path) -> None:
    text = robot_text(calibration.robot.with_payload("1kg,0mm,0mm,50mm"))
    convention = "convention: modified-hayati\n"
    for old, new, about in (
        ("title: ", "title: my ", True),
        ("name: irb120", "name: cell_3", True),
        ("history:\n", "history:\n  - moved to cell 3\n", True),
        ("a: 270.0", "a: 270.1", False),
        ("status: converged", "status: at-bound", False),
        ("correlations:\n    - '1'", "correlations:\n    - '0.5'", False),
        (convention, f"{convention}gravity: [0.0, 0.0, 9.81]\n", False),
        ("payload:", "payload: {mass: 3.0, cog: [0.0, 0.0, 0.0]} #", False),
    ):
        assert old in text
        robot = read(text.replace(old, new, 1), tmp_path)
        assert is_intact(robot) == arm_is_known(robot) == about, new
    line = next(line for line in text.splitlines() if line.strip().startswith("a_3: {unit: mm"))
    value = line.partition("value: ")[2].partition(",")[0]
    assert not is_intact(read(text.replace(line, line.replace(value, f"{float(value) + 1e-9:.12f}")), tmp_path))
    assert is_intact(read(text.replace(line, line.replace(value, f"{value}0")), tmp_path))


def test_changed_copies(calibration: Calibration) -> None:
    robot = calibration.robot
    assert is_intact(robot.with_payload(Payload(2.0, (0.0, 0.0, 0.1)), (0.0, 9.81, 0.0)))
    assert is_intact(robot.with_values({"a_3": robot.values["a_3"]}))
    for other in (
        robot.with_values({"a_3": 0.2701}),
        robot.with_effects(["gain"]),
        robot.with_frames(IDENTITY, {"1": (0.0, 0.0, 0.1)}),
    ):
        assert proof_of(other)
        assert not is_intact(other)
        assert not is_intact(other.with_payload("1kg,0mm,0mm,50mm"))


def test_a_robot_with_other_targets_is_written_so_that_it_can_be_read(calibration: Calibration, tmp_path: Path) -> None:
    other = calibration.robot.with_frames(IDENTITY, {"ball": (0.0, 0.0, 0.1)})
    text = robot_text(other)
    robot = read(text, tmp_path)
    assert (proof_of(robot).status, proof_of(robot).names) == ("converged", ())
    assert robot_text(robot) == text
    assert not is_intact(robot)


def test_another_convention_and_older_files_have_none(calibration: Calibration, tmp_path: Path) -> None:
    assert converted(calibration.robot, "zero-reference").proof is None
    head, tail = robot_text(calibration.robot).split("proof:\n")
    robot = read(head + tail[tail.index("history:") :], tmp_path)
    assert robot.proof is None
    assert not is_intact(robot)
    assert robot.values == read(robot_text(calibration.robot), tmp_path).values


def test_only_base_and_targets_found_anew(calibration: Calibration) -> None:
    before = sealed(calibration.robot, replace(proof_of(calibration.robot), status="rank-loss"))
    again = calibrate(before, campaign("irb120", 12, 2e-5, 1)[1], model="frames")
    proof = proof_of(again.robot)
    assert (again.status.value, proof.status) == ("converged", "rank-loss")
    assert is_intact(again.robot)
    was, after = (dict(zip(p.names, p.deviations, strict=True)) for p in (proof_of(before), proof))
    assert after["a_3"] == pytest.approx(was["a_3"], rel=1e-6)
    assert after["base_x"] != was["base_x"]
    assert proof.region[0][0] <= proof_of(before).region[0][0]
    edited = proof_of(calibrate(before.with_values({"a_3": 0.2703}), again.data, model="frames").robot)
    assert (edited.status, "a_3" in edited.names) == ("rank-loss", False)
    anew = calibrate(before, campaign("irb120", 20, 2e-5, 1)[1], effects=["compliance"])
    assert proof_of(anew.robot).status == "converged"


def test_a_damaged_entry_is_refused(calibration: Calibration, tmp_path: Path) -> None:
    text = robot_text(calibration.robot)
    numbers = ("proof.correlations[1]", "numbers from -1 to 1", "got 'one'", "allowed: 1 number")
    for old, new, parts in (
        ("    - '1'\n", "    - one\n", numbers),
        ("    - '1'\n", "", ("proof.correlations", "one row belongs here for each", "allowed: ")),
        ("joint_error: [", "joint_error: [0.0, ", ("proof.joint_error", "one entry belongs here for each joint", "7")),
        ("deviations: {base_x:", "deviations: {base_q:", ("proof.deviations", "no such parameter", "got 'base_q'")),
        ("status: converged", "status: fine", ("proof.status", "converged")),
        ("sha256: ", "sha256: no", ("proof.sha256",)),
        ("  region:", "  regions:", ("regions", "Did you mean region")),
    ):
        assert old in text
        message = refused(None, r"calibrated\.yaml", read, text.replace(old, new, 1), tmp_path)
        assert all(part in message for part in parts), message


# -- correlations of hundreds of parameters -------------------------------------------------------------------


def many(count: int) -> tuple[tuple[float, ...], ...]:
    rng = np.random.default_rng(1)
    rows = [np.append(rng.normal(0, 0.02, number), rng.uniform(-1, 1)).round(7).tolist() for number in range(count)]
    return ((1.0,), (-1.0, 0.0), *map(tuple, rows[2:]))


def test_a_factor_of_any_size_is_read_as_it_was_written() -> None:
    for count in (1, 60, 61, 130):
        factor = many(count)[:count]
        written = correlations_text(factor)
        digits = [" ".join(f"{v:.7g}" for v in row) for row in factor]
        assert factor_from(written, count, "here", "") == factor_from(digits, count, "here", "") == factor, count
        assert isinstance(written, str) == (count > 60)
        assert not isinstance(written, str) or len(written) < 0.5 * sum(map(len, digits))
    # what is not rounded is written in digits
    factor = (*many(70)[:-1], (1.234567e-5,) * 70)
    assert factor_from(correlations_text(factor), 70, "here", "") == factor


def test_a_seal_holds_whichever_way_the_factor_is_written(
    calibration: Calibration, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files of either form are about the same robot, and may be read and written again."""
    rows = robot_text(calibration.robot)
    monkeypatch.setattr(correlations, "_READABLE", 5)
    short = robot_text(calibration.robot)
    assert "    - '1'" in rows
    assert "correlations: " in short
    assert len(short) < len(rows)
    for text in (rows, short):
        robot = read(text, tmp_path)
        assert proof_of(robot).factor == proof_of(calibration.robot).factor
        assert is_intact(robot)
        assert is_intact(read(robot_text(robot), tmp_path))


def test_a_damaged_text_of_correlations_is_refused() -> None:
    text = correlations_text(many(61))
    assert isinstance(text, str)
    for damaged, fault in (
        (text[:-4], "no text of correlations of so many parameters; got '5907 bytes'; allowed: 5910"),
        (f"{text[:-4]}???!", "got 'other signs than those of base64'"),
        ("/" * 8 + text[8:], "correlations are -1 to 1"),
    ):
        refused(None, re.escape(fault), factor_from, damaged, 61, "robot.yaml, proof.correlations", "")
