"""``truearm hexapod``: keys, files and units."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.commanding import Truearm

from truearm.engine.data.hexapod import poses, triangle
from truearm.engine.data.readers.canonical import read_csv
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.library import load_robot
from truearm.hexapod.reachable import with_cups
from truearm.hexapod.sheet_reading import read_sheet

BASE, TOOL = ("B1-B2", "B2-B3", "B3-B1"), ("T1-T2", "T2-T3", "T3-T1")


def test_uncertainty(truearm: Truearm) -> None:
    summary = json.loads(truearm("hexapod", "uncertainty", "--trials", "20000", "--json").out)
    assert list(summary) == ["solutions", "monte_carlo"]
    assert [list(row) for row in summary["solutions"]] == [["t1", "t2", "t3", "t3_as_printed", "radius_95_um"]] * 4
    assert [row["radius_95_um"]["t3"] for row in summary["solutions"]] == pytest.approx(
        [3.024, 2.660, 2.482, 2.995], abs=5e-4
    )
    assert [row["t3"] for row in summary["solutions"]] == pytest.approx([3.359, 3.052, 2.886, 3.331], abs=5e-4)
    for row, drawn in zip(summary["solutions"], summary["monte_carlo"], strict=True):
        assert drawn == pytest.approx({key: row[key] for key in drawn}, rel=0.02)
    first = truearm("hexapod", "uncertainty", "--trials", "100").out.splitlines()[1].split()
    assert (first[3], first[-3:]) == ("3.359", ["1.976", "2.288", "3.024"])


def test_from_plan_to_data(truearm: Truearm, tmp_path: Path) -> None:
    """The planned sheet is filled in with exact lengths; the data say what the robot's own model says."""
    sheet, steps, data = (tmp_path / name for name in ("sheet.csv", "steps.txt", "data.csv"))
    words = ["irb120", "--fixture", "220,0,100,-30", "--distinct", "--out", sheet, "--steps", steps]
    summary = json.loads(truearm("hexapod", "plan", *words, "--json").out)
    keys = "poses poses_reached configurations places left_out smallest_room_mm joints_are"
    assert list(summary) == keys.split()
    assert summary["poses"] == 54
    assert 10 < summary["poses_reached"] <= 54
    assert steps.read_text().count("Configuration ") == summary["configurations"]
    assert f"{summary['poses_reached']} of 54 poses" in truearm("hexapod", "plan", *words).out

    def fill(row: dict[str, str]) -> dict[str, str]:
        lengths = dict.fromkeys(_legs(row["design"]), "300")
        if row["configuration"] == "1":
            lengths |= dict.fromkeys(BASE, "300") | dict.fromkeys(TOOL, "150")
        if row["configuration"] == "2":
            del lengths[_legs(row["design"])[0]]
        return lengths

    rows = filled(sheet, fill)
    assert len(rows) == summary["configurations"]
    run = truearm("hexapod", "solve", sheet, "--out", data)
    assert run.code == 0
    assert f"Left out, not all legs measured: {rows[1]['configuration']}" in run.out
    dataset = read_csv(data)
    assert dataset.configurations == len(rows) - 1
    assert dataset.position == pytest.approx(read_sheet(sheet).dataset().position, abs=1e-12)
    entries = json.loads(truearm("hexapod", "solve", sheet, "--json").out)["poses"]
    assert list(entries[0]) == ["configuration", "design", "solution", "legs", "place", "side", "cups_mm"]


def filled(sheet: Path, lengths: Callable[[dict[str, str]], dict[str, str]]) -> list[dict[str, str]]:
    """Fill a planned sheet in with lengths [mm], and return its rows."""
    rows = list(csv.DictReader(sheet.read_text().splitlines()))
    for row in rows:
        row.update({f"{name} [mm]": length for name, length in lengths(row).items()})
    with sheet.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return rows


def _legs(design: str) -> list[str]:
    i, j, k = design[0], design[3], design[7]
    first, second, third = list(design[4:7])
    return [f"B{b}-T{t}" for b, t in ((i, first), (j, first), (k, first), (i, second), (j, second), (j, third))]


def test_several_places_and_sides_from_plan_to_data(truearm: Truearm, tmp_path: Path) -> None:
    sheet, steps, data = (tmp_path / name for name in ("sheet.csv", "steps.txt", "data.csv"))
    words = ["irb120", "--fixture", "220,0,300,-30", "--fixture", "150,250,300,20", "--fourth-cup", "--attachments", 2]
    run = truearm("hexapod", "plan", *words, "--branches", "front-up", "--out", sheet, "--steps", steps)
    assert run.code == 0
    assert "fixture_2: " in run.out
    assert "on side 2" in run.out
    text = steps.read_text()
    assert "Measure B1-B2, B2-B3, B3-B1, B1-B4, B2-B4, B3-B4." in text
    assert "Place fixture_2: set the base fixture up there" in text
    assert "Attachment 2: take the tool off" in text
    between = (*BASE, "B1-B4", "B2-B4", "B3-B4")
    filled(sheet, lambda row: dict.fromkeys((*between, *_side_legs(row)), "300") | dict.fromkeys(TOOL, "150"))
    run = truearm("hexapod", "solve", sheet, "--details", "--out", data)
    assert run.code == 0
    assert "place fixture_2, side 4, design" in run.out
    assert "Tool changer, from 5 pairs of readings with 2 attachments:" in run.out
    dataset = read_csv(data)
    assert dataset.fixtures == ("fixture_1", "fixture_2")
    assert dataset.sigma is not None
    summary = json.loads(truearm("hexapod", "solve", sheet, "--json").out)
    keys = "attachments pairs deviation_mm rest_mm mean_mm largest_mm ballbar_mm"
    assert list(summary["tool_changer"]) == keys.split()
    twice = truearm("hexapod", "solve", sheet, sheet)
    assert (twice.code, "the sheet is given twice" in twice.err) == (2, True)


def _side_legs(row: dict[str, str]) -> list[str]:
    cups = ("", "123", "214", "324", "134")[int(row["side"])]
    return [f"B{cups[int(name[1]) - 1]}{name[2:]}" for name in _legs(row["design"])]


def test_a_fixture_that_is_none_is_refused_and_nothing_written(truearm: Truearm, tmp_path: Path) -> None:
    for fixture, words in (("1,2", "--fixture: the fixture has 4 or 7 numbers"), ("1,a", "numbers separated")):
        run = truearm("hexapod", "plan", "irb120", "--fixture", fixture, "--out", tmp_path / "sheet.csv")
        assert (run.code, words in run.err) == (2, True), fixture
    assert not (tmp_path / "sheet.csv").exists()


def test_world_frame(truearm: Truearm, tmp_path: Path) -> None:
    robot, _ = with_cups(load_robot("irb120"))
    cups = triangle([0.3003, 0.3, 0.2996], "B") + np.array([0.25, -0.1, 0.1])
    down = np.broadcast_to(np.diag([1.0, -1.0, -1.0]), (3, 3, 3))
    joints = np.degrees(inverse(robot, cups, down, target="1").joints)
    file = tmp_path / "touches.csv"
    lines = ["cup," + ",".join(f"joint_{n} [deg]" for n in range(1, 7))]
    lines += [f"B{n},{','.join(map(repr, row))}" for n, row in enumerate(joints.tolist(), 1)]
    file.write_text("\n".join(lines) + "\n")
    words = ["hexapod", "world-frame", "irb120", file, "--base-sides", "300.3,300,299.6"]
    summary = json.loads(truearm(*words, "--json").out)
    assert list(summary) == ["position_mm", "quaternion", "plain", "distances_by_robot_mm", "residuals_mm"]
    assert summary["position_mm"] == pytest.approx([250, -100, 100], abs=1e-6)
    assert summary["quaternion"] == pytest.approx([1, 0, 0, 0], abs=1e-9)
    assert summary["residuals_mm"] == pytest.approx([0, 0, 0], abs=1e-6)
    assert "x 250.0000" in truearm(*words).out


def test_poses_are_counted_and_one_is_solved(truearm: Truearm) -> None:
    counts = json.loads(truearm("hexapod", "enumerate", "--json").out)
    assert list(counts) == ["designs", "assemblies", "poses", "distinct", "near_equal"]
    assert [counts[key] for key in list(counts)[:4]] == [36, 144, 72, 54]
    assert len(counts["near_equal"]) == 18
    assert [10, 37] in counts["near_equal"]
    assert "72 poses" in truearm("hexapod", "enumerate").out
    words = ("hexapod", "solve", "--pose", "7", "--legs", "300,300,300,300,300,300")
    summary = json.loads(truearm(*words, "--json").out)
    assert summary["left_out"] == []
    assert np.array(summary["poses"][0]["cups_mm"]) == pytest.approx(poses()[6].cups * 1e3, abs=1e-9)
    assert "T3  x" in truearm(*words).out
    for more, expected in (
        (["--legs", "300;300"], "numbers separated by commas"),
        (["--out", "data.csv"], "--out: one pose without joint positions is no data file"),
        (["--legs", "1e12,300,300,300,300,300"], "too large to be plausible"),
    ):
        run = truearm(*words, *more)
        assert (run.code, expected in run.err) == (2, True), more
