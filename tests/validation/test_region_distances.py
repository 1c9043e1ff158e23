"""Distances from where the robot was calibrated: by the tip, by the joints, from the middle; and what they say."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.calibration.result import Calibration
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.document.drawing import significant
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.proof import MOST_MEASURED, Proof
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.seal import is_intact
from truearm.validation.frames import check_proof
from truearm.validation.jobs import validate
from truearm.validation.region import RegionDistances, distance_block, region_distances
from truearm.validation.report import validation_figures, validation_html
from truearm.validation.validate import measure_farther


@pytest.fixture(scope="module")
def run() -> Calibration:
    return calibrate("irb120", campaign("irb120", 40, 0.02e-3, 1)[1], train=30, model="geometric")


def distances(robot: Robot, data: Dataset) -> RegionDistances:
    result = region_distances(robot, data, errors_of(robot, data))
    assert result is not None
    return result


def test_training_configurations_are_no_distance_away(run: Calibration) -> None:
    result = distances(run.robot, run.data.of_configurations(run.training))
    assert result.training == 30
    assert result.tip.max() < 20e-6  # positions are kept to a thousandth of a degree
    assert np.degrees(result.joints.max()) < 0.001


def test_distances_are_those_of_the_nearest_configuration(run: Calibration) -> None:
    data = run.data.of_configurations(run.held_out)
    result = distances(run.robot, data)
    training = run.data.of_configurations(run.training).joints
    for row in (0, 7, 20):
        reading = result.reading[row]
        target, joints = data.targets[data.target[reading]], data.joints[data.configuration[reading]]
        places = run.robot.forward(training, target=target)[0]
        here = run.robot.forward(joints, target=target)[0][0]
        assert result.tip[row] == pytest.approx(np.linalg.norm(places - here, axis=1).min(), abs=5e-5)
        apart = np.abs(np.angle(np.exp(1j * (training - joints))))  # whole turns do not count
        assert result.joints[row] == pytest.approx(apart.max(axis=1).min(), abs=1e-4)
        assert result.middle[row] == pytest.approx(np.linalg.norm(places.mean(axis=0) - here), abs=5e-5)


def test_whole_turns_are_the_same_posture(run: Calibration) -> None:
    data = run.data.of_configurations(run.training)
    turned = data.joints.copy()
    turned[:, 5] += 2 * np.pi
    assert distances(run.robot, replace(data, joints=turned)).joints.max() < np.radians(0.002)


def test_the_file_keeps_where_it_was_measured(run: Calibration, tmp_path: Path) -> None:
    run.save(tmp_path)
    again = load_robot(tmp_path / "calibrated.yaml")
    assert is_intact(again)
    assert again.proof is not None
    assert run.robot.proof is not None
    assert np.allclose(again.proof.measured, run.robot.proof.measured, rtol=0, atol=1e-12)
    text = (tmp_path / "calibrated.yaml").read_text()
    row = next(line for number, line in enumerate(text.splitlines()) if text.splitlines()[number - 1] == "  measured:")
    words = row.partition("-")[2].strip().strip("'\"")
    for wrong in (words + " 5", words.rpartition(" ")[0], words.replace(words.split()[0], "here", 1), ""):
        (tmp_path / "bent.yaml").write_text(text.replace(words, wrong, 1))
        with pytest.raises(
            InputError, match=r"one number belongs here for each joint.*proof.measured\[1\]|proof.measured"
        ):
            load_robot(tmp_path / "bent.yaml")
    (tmp_path / "moved.yaml").write_text(text.replace(words, " ".join(["1.5"] * 6), 1))
    assert not is_intact(load_robot(tmp_path / "moved.yaml"))


def test_a_robot_that_does_not_know_is_judged_without(run: Calibration) -> None:
    proof = run.robot.proof
    assert proof is not None
    older = replace(run.robot, proof=replace(proof, measured=()))
    assert region_distances(older, run.data, errors_of(older, run.data)) is None
    result = validate(older, run.data.of_configurations(run.held_out))
    assert result.distances is None
    assert "distance_from_training" not in result.summary()


def test_a_thousand_configurations_are_kept_at_most() -> None:
    rows = [[float(i) / 1000, 0.0] for i in range(3000)]
    proof = Proof.of("converged", (), (), np.zeros(2), (), np.zeros((0, 0)), measured=rows, joint_units=["deg", "mm"])
    assert len(proof.measured) == MOST_MEASURED
    assert proof.measured[-1][0] == pytest.approx(2.999, abs=1e-5)
    twice = Proof.of("converged", (), (), np.zeros(1), (), np.zeros((0, 0)), measured=[[0.1]] * 5, joint_units=["deg"])
    assert len(twice.measured) == 1


def test_errors_that_grow_with_the_distance_are_told() -> None:
    rng = np.random.default_rng(0)
    tip = rng.uniform(0.0, 0.5, 90)
    error = 1e-4 * (1.0 + 6.0 * tip) * rng.uniform(0.8, 1.2, 90)
    at = np.repeat(np.arange(30), 3)
    grows = RegionDistances(np.arange(90), error, tip, np.full(90, np.nan), tip, at, 10)
    (step,) = measure_farther(grows)
    assert step.code == "measure-more"
    assert "Calibrate with configurations that reach farther" in step.message
    held = distance_block(grows).in_json["distance_from_training"]
    assert (held["grows"], held["joints_deg"]) == (True, [])
    spans = grows.spans(grows.tip)
    assert [span.readings for span in spans] == [18] * 5
    assert spans[0].mean < spans[2].mean < spans[4].mean
    level = replace(grows, error=1e-4 * rng.uniform(0.8, 1.2, 90))
    assert measure_farther(level) == ()
    assert "deg" not in distance_block(level).text
    few = replace(grows, configuration=np.zeros(90, dtype=np.intp))
    assert few.growth is None
    assert measure_farther(few) == ()


def test_the_page_draws_every_error_over_every_distance(run: Calibration) -> None:
    data = run.data.of_configurations(run.held_out)
    judged = validate(run.robot, data)
    result = judged.distances
    assert result is not None
    drawn = validation_figures(judged)
    assert {*drawn} == {"error-over-tip", "error-over-joints", "error-over-middle", "residuals"}
    for name, distance in (
        ("tip", 1e3 * result.tip),
        ("joints", np.degrees(result.joints)),
        ("middle", 1e3 * result.middle),
    ):
        readings, mean = drawn[f"error-over-{name}"]["data"]
        assert readings["type"] == "scatter"
        assert readings["x"] == pytest.approx(distance, rel=6e-4)
        assert readings["y"] == pytest.approx(1e3 * result.error, rel=6e-4)
        assert readings["text"][4] == f"{data.labels[data.configuration[4]]}, target {data.targets[data.target[4]]}"
        spans = result.spans(distance)
        assert mean["name"] == "mean of a fifth of the readings"
        assert mean["x"] == pytest.approx([v for span in spans for v in (span.low, span.high)], rel=6e-4)
        assert mean["y"] == pytest.approx([1e3 * span.mean for span in spans for _ in range(2)], rel=6e-4)
        assert drawn[f"error-over-{name}"]["layout"]["xaxis"]["rangemode"] == "tozero"
    page = validation_html(judged)
    assert f"On {judged.errors.configurations} configurations" in judged.lines()[1]
    assert "knows 30 training configurations" in page
    span = result.spans(result.tip)[1]
    row = f"{significant(1e3 * span.low, 3, 1)} to {significant(1e3 * span.high, 3, 1)}"
    for cell in (row, str(span.readings), significant(1e3 * span.mean), significant(1e3 * span.largest)):
        assert f">{cell}</td>" in page
    assert judged.position is not None
    for value in (judged.position.mean, judged.position.rms, judged.position.p95, judged.position.max):
        assert f">{significant(1e3 * value)}</td>" in page
    sums = judged.summary()["distance_from_training"]
    assert [row["mean_mm"] for row in sums["tip_mm"]] == pytest.approx([1e3 * s.mean for s in result.spans(result.tip)])
    degrees = [np.degrees(s.high) for s in result.spans(result.joints)]
    assert [row["to"] for row in sums["joints_deg"]] == pytest.approx(degrees)
    words = f"tips {1e3 * result.tip.min():.0f} to {1e3 * result.tip.max():.0f} mm, joints "
    assert words + f"{np.degrees(result.joints.min()):.0f} to {np.degrees(result.joints.max()):.0f} deg" in "\n".join(
        judged.lines()
    )


def test_readings_beyond_what_the_proof_lets_expect_are_told(run: Calibration) -> None:
    data = run.data.of_configurations(run.held_out)
    assert "beyond-proof" not in {notice.code for notice in validate(run.robot, data).warnings}
    rng = np.random.default_rng(3)
    off = rng.standard_normal(data.position.shape)
    for size, levels in ((0.03e-3, []), (0.12e-3, ["warning"]), (3e-3, ["error"])):
        moved = replace(data, position=data.position + size * off)
        notices = check_proof(run.robot, moved, errors_of(run.robot, moved))
        assert [notice.level for notice in notices] == levels, size
    rms = 1e3 * np.sqrt(np.mean(errors_of(run.robot, moved).position_norms ** 2))
    assert f"The positions are off by {rms:.2g} mm (root mean square)" in notices[0].message
    quiet = replace(moved, sigma=None)
    (assumed,) = check_proof(run.robot, quiet, errors_of(run.robot, quiet))
    assert "with 0.1 mm of noise, since no sigma is declared" in assumed.message
    proof = run.robot.proof
    assert proof is not None
    changed = run.robot.with_values({"a_3": run.robot.values["a_3"] + 1e-5})
    for robot in (changed, replace(run.robot, proof=None)):
        assert check_proof(robot, moved, errors_of(robot, moved)) == []
