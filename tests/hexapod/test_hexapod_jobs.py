"""The jobs of the hexapod device from Python: records, files, and refusals that name the parameter."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truearm
from truearm import InputError
from truearm.engine.data.hexapod import poses
from truearm.engine.robot.transform import Transform
from truearm.hexapod.sheet_reading import read_sheet

LEGS = (0.3,) * 6
FIXTURE = (0.22, 0.0, 0.1, np.radians(-30.0))


def test_uncertainty_is_repeated_with_its_seed() -> None:
    first, again, other = (truearm.hexapod_uncertainty(trials=500, seed=seed) for seed in (1, 1, 2))
    assert first.drawn == again.drawn
    assert first.drawn != other.drawn
    assert first.solutions[0].norms[2] == pytest.approx(3.359, abs=5e-4)


def test_one_pose_is_solved_from_any_sequence_of_lengths() -> None:
    solution = truearm.hexapod_solve(pose=7, legs=np.array(LEGS), base_sides=[0.3] * 3)  # type: ignore[arg-type]
    assert solution.poses[0].cups == pytest.approx(poses()[6].cups, abs=1e-12)
    assert solution.data is None
    with pytest.raises(ValueError, match="no joint positions"):
        solution.save("data.csv")


def test_a_fixture_is_a_transform_or_numbers(tmp_path: Path) -> None:
    half = FIXTURE[3] / 2
    quaternion = (float(np.cos(half)), 0.0, 0.0, float(np.sin(half)))
    out, steps = tmp_path / "sheet.csv", tmp_path / "steps.txt"
    plans = [
        truearm.hexapod_plan("irb120", fixture, distinct=True, branches=["front-up"], out=out, steps=steps)
        for fixture in (FIXTURE, (*FIXTURE[:3], *quaternion), Transform((0.22, 0.0, 0.1), quaternion))
    ]
    assert plans[0].summary() == plans[1].summary() == plans[2].summary()
    assert all(row.branch.startswith("front-up") for row in plans[0].reachable.rows)
    assert plans[0].lines()[-1] == f"Written to {out}, {steps}"


def test_a_plan_and_its_sheet_are_written_and_solved(tmp_path: Path) -> None:
    sheet, steps, data = (tmp_path / name for name in ("sheet.csv", "steps.txt", "data.csv"))
    plan = truearm.hexapod_plan("irb120", FIXTURE, distinct=True, out=sheet, steps=steps)
    assert steps.read_text().count("Configuration ") == len(plan.reachable.rows)
    header, *rows = (line.split(",") for line in sheet.read_text().splitlines())
    for row in rows:
        design = next(p.design for p in poses() if str(p.number) == row[header.index("pose")])
        for name in (*design.leg_names, "B1-B2", "B2-B3", "B3-B1"):
            row[header.index(f"{name} [mm]")] = "300"
        for name in ("T1-T2", "T2-T3", "T3-T1"):
            row[header.index(f"{name} [mm]")] = "150"
    sheet.write_text("\n".join(",".join(row) for row in [header, *rows]) + "\n")
    solved = truearm.hexapod_solve(sheet, out=data)
    assert len(solved.poses) == len(rows)
    assert solved.left_out == ()
    assert truearm.load_data(data).position == pytest.approx(read_sheet(sheet).dataset().position, abs=1e-12)
    assert truearm.hexapod_solve(read_sheet(sheet)).summary() == solved.summary()
    assert len(repr(solved)) <= 2000


def one_pose(**options: Any) -> object:
    return truearm.hexapod_solve(**{"pose": 7, "legs": LEGS, **options})


SIDES, JOINTS = (0.3, 0.3, 0.3), np.zeros((3, 6))


@pytest.mark.parametrize(
    ("call", "parameter", "words"),
    [
        (lambda: truearm.hexapod_solve(), "sheet, pose, legs", "a sheet, or a pose and its six legs"),
        (lambda: truearm.hexapod_solve("a.csv", pose=7, legs=LEGS), "sheet, pose, legs", "a sheet, or a pose"),
        (lambda: truearm.hexapod_solve("missing.csv"), "sheet", "there is no such file"),
        (lambda: truearm.hexapod_solve(3), "sheet", "a path belongs here"),  # type: ignore[arg-type]
        (lambda: one_pose(legs=LEGS[:5]), "legs", "6 numbers belong here"),
        (lambda: one_pose(legs=(*LEGS[:5], np.nan)), "legs", "the number cannot be used"),
        (lambda: one_pose(legs=(*LEGS[:5], 0.302)), "legs", "is beyond the range"),
        (lambda: one_pose(base_sides=(0.31, 0.3, 0.3)), "base_sides", "the length B1-B2"),
        (lambda: one_pose(tool_sides=(0.15, 0.2, 0.15)), "tool_sides", "the length T2-T3"),
        (lambda: one_pose(base_sides=(0.3, 0.3, 0.6), reach=0.4), "base_sides", "B1, B2, B3 lie on one line"),
        (lambda: one_pose(legs=(0.1, 0.1, 0.1, 0.3, 0.3, 0.3), reach=0.4), "legs", "do not meet"),
        (lambda: one_pose(out="a.csv"), "out", "is no data file"),
        (lambda: truearm.hexapod_plan("irb120", (1.0, 2.0)), "fixture", "4 or 7 numbers"),
        (lambda: truearm.hexapod_plan("irb120", "here"), "fixture", "numbers belong here"),  # type: ignore[arg-type]
        (lambda: truearm.hexapod_plan("irb120", (0, 0, np.nan, 0)), "fixture", "NaN and infinity"),
        (lambda: truearm.hexapod_plan("irb120", (0, 0, 0, 1, 1, 0, 0)), "fixture", "does not have length 1"),
        (lambda: truearm.hexapod_plan("irb120", (9.0, 0, 0, 0)), "fixture", "can reach none of the 72 poses"),
        (lambda: truearm.hexapod_plan("irb120", FIXTURE, branches=["front-upp"]), "branches", "no such branch"),
        (lambda: truearm.hexapod_plan("irb120", FIXTURE, tool="hammer"), "tool", "no such tool"),
        (lambda: truearm.hexapod_plan("irb120", FIXTURE, out="a", steps="a"), "steps", "must be different files"),
        (lambda: truearm.hexapod_world_frame("irb120", JOINTS[:2], SIDES), "touches", "got '(2, 6)'"),
        (lambda: truearm.hexapod_world_frame("irb120", "missing.csv", SIDES), "touches", "there is no such file"),
        (lambda: truearm.hexapod_world_frame("irb120", JOINTS, SIDES[:2]), "base_sides", "3 numbers belong here"),
        (lambda: truearm.hexapod_world_frame("irb120", JOINTS, (0.3, 0.302, 0.3)), "base_sides", "the length B2-B3"),
        (lambda: truearm.hexapod_world_frame("irb120", JOINTS, SIDES, cup="4"), "cup", "no cup of this name"),
        (lambda: truearm.hexapod_world_frame("irb120", JOINTS, SIDES), "touches", "lie on one line"),
    ],
)
def test_refusals_name_the_parameter(call: Callable[[], Any], parameter: str, words: str) -> None:
    with pytest.raises(InputError) as refused:
        call()
    assert refused.value.parameter == parameter
    assert words in str(refused.value)


def test_the_robot_file_is_not_overwritten(tmp_path: Path) -> None:
    robot = tmp_path / "robot.yaml"
    robot.write_text("truearm: truearm-robot/1\n")
    for name in ("out", "steps"):
        with pytest.raises(InputError, match="this file is read") as refused:
            truearm.hexapod_plan(robot, FIXTURE, **{name: robot})  # type: ignore[arg-type]
        assert refused.value.parameter == name
