"""What was moved since the calibration is found anew and told; honest readings are left alone."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.simulated import campaign, more_of
from typer.testing import CliRunner

from truearm.calibration.calibrate import calibrate
from truearm.commands import program
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.refit import refit
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rotation_from_vector
from truearm.engine.twin.twin import Twin, measure
from truearm.validation.jobs import validate

NOISE = 0.05e-3
TURN = rotation_from_vector(np.array([0.1, -0.2, 0.7]))
SHIFT = np.array([1.2, -3.4, 0.2])


@cache
def cell(seed: int = 5, robot: str = "irb120") -> tuple[Twin, Robot, Dataset]:
    """Return a twin, its calibrated robot, and new readings of it."""
    twin, data = campaign(robot, 40, NOISE, seed)
    return twin, calibrate(robot, data, model="geometric").robot, more_of(twin, 15, NOISE, 100 + seed)


def points_of(twin: Twin) -> dict[str, Array]:
    values = twin.robot.values
    return {t.name: np.array([values[t.parameter(axis)] for axis in "xyz"]) for t in twin.robot.targets}


def with_points(twin: Twin, points: dict[str, Array], joints: Array, seed: int = 3) -> Dataset:
    """Return readings of the twin with other targets."""
    places = {name: tuple(point.tolist()) for name, point in points.items()}
    moved = replace(twin, robot=twin.robot.with_frames(twin.robot.base, places))
    return measure(moved, joints, NOISE, np.random.default_rng(seed))


def remounted(joints: Array, turn: Array, shift: Array) -> Dataset:
    twin = cell()[0]
    return with_points(twin, {name: turn @ point + shift for name, point in points_of(twin).items()}, joints)


def test_an_instrument_that_was_carried_elsewhere_is_told_and_found() -> None:
    _, robot, new = cell()
    honest = validate(robot, new)
    there = replace(new, position=new.position @ TURN.T + SHIFT)
    (notice,) = validate(robot, there).warnings
    assert (notice.code, notice.level) == ("base-moved", "error")
    assert "`refit=base`" in notice.message
    assert re.search(
        r"moved by \d+(\.\d+)? mm at their middle and turned by 4\d(\.\d+)? deg as a whole", notice.message
    )
    result = validate(robot, there, refit="base")
    assert result.warnings == ()
    assert result.position is not None
    assert honest.position is not None
    assert honest.position.mean < result.position.mean < 1.4 * honest.position.mean
    assert result.refit is not None
    assert (result.refit.parameters, result.refit.readings) == (6, 45)
    middle = new.position.mean(axis=0)
    assert result.refit.shift == pytest.approx(np.linalg.norm(TURN @ middle + SHIFT - middle), abs=1e-3)
    assert result.refit.turn == pytest.approx(np.linalg.norm([0.1, -0.2, 0.7]), abs=1e-3)
    assert "The base was found anew from 45 readings (6 numbers)" in "\n".join(result.lines())
    assert result.summary()["refit"]["turn_deg"] == pytest.approx(math.degrees(math.sqrt(0.54)), abs=0.1)


@pytest.mark.parametrize("angle", [2e-3, 2.0])
def test_a_tool_that_was_mounted_anew_is_told_and_found_alone(angle: float) -> None:
    _, robot, new = cell()
    moved = remounted(new.joints, rotation_from_vector(np.array([0.6, 0.0, 0.8]) * angle), np.array([1e-3, 5e-4, 0.0]))
    (notice,) = validate(robot, moved).warnings
    assert notice.code == "tool-moved"
    assert "`refit=tool`" in notice.message
    assert "mm at the middle of its targets and turned by" in notice.message
    result = validate(robot, moved, refit="tool")
    assert result.warnings == ()
    assert result.position is not None
    assert result.position.mean < 0.15e-3
    assert result.refit is not None
    assert result.refit.turn == pytest.approx(angle, abs=3e-4)
    for name in ("base_x", "base_y", "base_z"):
        assert result.refit.robot.values[name] == pytest.approx(robot.values[name], abs=1e-12)


def test_a_target_that_was_put_on_anew_is_named() -> None:
    twin, robot, new = cell()
    points = points_of(twin)
    name = next(iter(points))
    moved = with_points(twin, {**points, name: points[name] + np.array([0.0, 2e-3, 0.0])}, new.joints)
    (notice,) = validate(robot, moved).warnings
    assert notice.code == "tool-moved"
    assert f"target {name} by " in notice.message
    assert "`refit=targets`" in notice.message
    result = validate(robot, moved, refit="targets")
    assert result.refit is not None
    assert result.refit.turn is None
    assert result.refit.shifts[name] == pytest.approx(2e-3, abs=2e-4)
    assert max(shift for other, shift in result.refit.shifts.items() if other != name) < 3e-4


def test_base_and_tool_that_were_both_moved_are_told() -> None:
    _, robot, new = cell()
    moved = remounted(new.joints, rotation_from_vector(np.array([0.0, 0.3, 0.0])), np.array([0.0, 0.05, 0.0]))
    moved = replace(moved, position=moved.position @ TURN.T + SHIFT)
    (notice,) = validate(robot, moved).warnings
    assert (notice.code, notice.level) == ("frames-differ", "error")
    assert "`model=frames`" in notice.message


def test_configurations_that_cannot_tell_base_from_tool_are_called_so() -> None:
    twin, robot, _ = cell()
    rng = np.random.default_rng(0)
    q = np.radians([20.0, 10.0, -10.0, 5.0, 40.0, 0.0]) + np.radians(0.5) * rng.uniform(-1, 1, (12, 6))
    near = measure(twin, q, NOISE, rng)
    (notice,) = validate(robot, replace(near, position=near.position + np.array([1e-3, 0.0, 0.0]))).warnings
    assert "These configurations do not tell that from a moved" in notice.message


def test_the_errors_of_a_refit_are_those_of_configurations_it_has_not_seen() -> None:
    """Against fitting again without each configuration."""
    _, robot, new = cell()
    few = new.of_configurations(np.arange(6))
    result = refit(robot, few, "tool")
    for c in range(6):
        others = refit(robot, few.of_configurations([i for i in range(6) if i != c]), "tool")
        alone = errors_of(others.robot, few.of_configurations([c])).position_errors
        rows = few.configuration == c
        assert result.errors.position_errors[rows] == pytest.approx(alone, abs=2e-7)


def test_honest_readings_are_left_alone() -> None:
    """30 campaigns: five of each of six robots."""
    for seed in range(6):
        robot = ("irb120", "ur10", "puma560")[seed % 3]
        twin, data = campaign(robot, 25, NOISE, seed)
        calibrated = calibrate(robot, data, model=("offsets", "geometric")[seed % 2], train="all").robot
        for again in range(5):
            new = more_of(twin, 12, NOISE, 500 + 10 * seed + again)
            assert validate(calibrated, new).warnings == (), (robot, seed, again)


def test_single_targets_exchanged_names_and_too_few_readings() -> None:
    _, robot, new = cell()
    result = refit(robot, new.of_readings(new.target == 0), "tool")
    assert (result.parameters, result.turn) == (3, None)  # it is shifted and not turned
    (notice,) = validate(robot, replace(new, targets=("2", "3", "1")), refit="targets").warnings
    assert notice.code == "targets-renamed"
    with pytest.raises(InputError, match="too few") as told:
        validate(robot, new.of_configurations([0]), refit="base")
    assert told.value.parameter == "refit"


def test_the_command_finds_what_moved(tmp_path: Path) -> None:
    _, robot, new = cell()
    from truearm.engine.robot.robot_file.writing import robot_text

    (tmp_path / "robot.yaml").write_text(robot_text(robot))
    (tmp_path / "moved.csv").write_text(csv_text(replace(new, position=new.position + SHIFT)))
    words = ["validate", str(tmp_path / "robot.yaml"), str(tmp_path / "moved.csv")]
    outcome = CliRunner().invoke(program(), words)
    assert outcome.exit_code == 3
    assert "--refit base" in outcome.output
    done = CliRunner().invoke(program(), [*words, "--refit", "base", "--note", "operator=A B", "--json"])
    assert done.exit_code == 0, done.output
    content = json.loads(done.stdout)
    assert content["refit"]["shift_mm"] == pytest.approx(1e3 * float(np.linalg.norm(SHIFT)), abs=0.2)
    assert content["notes"] == {"operator": "A B"}
