"""``truearm hexapod`` and ``truearm distances``: keys, files, refusals."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from tests.commanding import Truearm

from truearm.engine.data.hexapod import poses, triangle
from truearm.engine.data.readers.canonical import read_csv
from truearm.engine.robot.library import load_robot
from truearm.hexapod.sheet_reading import read_sheet


def test_enumerate(truearm: Truearm) -> None:
    counts = json.loads(truearm("hexapod", "enumerate", "--json").out)
    assert list(counts) == ["designs", "assemblies", "poses", "distinct", "near_equal"]
    assert [counts[key] for key in list(counts)[:4]] == [36, 144, 72, 54]
    assert len(counts["near_equal"]) == 18
    assert [10, 37] in counts["near_equal"]
    assert "72 poses" in truearm("hexapod", "enumerate").out


def test_uncertainty(truearm: Truearm) -> None:
    found = json.loads(truearm("hexapod", "uncertainty", "--trials", "20000", "--json").out)
    assert list(found) == ["solutions", "monte_carlo"]
    assert [list(row) for row in found["solutions"]] == [["t1", "t2", "t3", "t3_as_printed"]] * 4
    assert [row["t3"] for row in found["solutions"]] == pytest.approx([3.359, 3.052, 2.886, 3.331], abs=5e-4)
    for row, drawn in zip(found["solutions"], found["monte_carlo"], strict=True):
        assert drawn == pytest.approx({key: row[key] for key in drawn}, rel=0.02)
    assert "3.359" in truearm("hexapod", "uncertainty", "--trials", "100").out


def test_one_pose(truearm: Truearm) -> None:
    legs = "300,300,300,300,300,300"
    found = json.loads(truearm("hexapod", "solve", "--pose", "7", "--legs", legs, "--json").out)
    assert found["left_out"] == []
    assert np.array(found["poses"][0]["cups_mm"]) == pytest.approx(poses()[6].cups * 1e3, abs=1e-9)
    assert "T3  x" in truearm("hexapod", "solve", "--pose", "7", "--legs", legs).out


@pytest.mark.parametrize(
    ("words", "options"),
    [
        ("the length B", ["--pose", "7", "--legs", "301.5,300,300,300,300,300"]),
        (
            "the length B1-B2 is beyond",
            ["--pose", "7", "--legs", ",".join(["300"] * 6), "--base-sides", "310,300,300"],
        ),
        ("B1, B2, B3 lie on one line", ["--range", "400", "--base-sides", "300,300,600"]),
        ("legs of these lengths do not meet", ["--range", "400", "--legs", "100,100,100,300,300,300"]),
        ("6 numbers belong here; got 2", ["--legs", "300,300"]),
        ("numbers separated by commas", ["--legs", "300;300"]),
        ("--pose: the number is out of range; got 73; allowed: 1 to 72", ["--pose", "73"]),
        ("--out: one pose without joint positions is no data file", ["--out", "data.csv"]),
        ("too large to be plausible", ["--legs", "1e12,300,300,300,300,300"]),
    ],
)
def test_what_solve_refuses(truearm: Truearm, words: str, options: list[str]) -> None:
    given = {"--pose": "7", "--legs": "300,300,300,300,300,300"} | dict(zip(options[::2], options[1::2], strict=True))
    run = truearm("hexapod", "solve", *(part for pair in given.items() for part in pair))
    assert run.code == 2
    assert words in run.err


def test_solve_needs_a_sheet_or_a_pose(truearm: Truearm, tmp_path: Path) -> None:
    for words in ([], ["--pose", "7"], ["--legs", "1,2,3,4,5,6"], [tmp_path / "a.csv", "--pose", "7"]):
        run = truearm("hexapod", "solve", *words)
        assert run.code == 2
        assert "a sheet, or a pose and its six legs" in run.err


def test_from_plan_to_data(truearm: Truearm, tmp_path: Path) -> None:
    """The planned sheet is filled in with exact lengths; the data say what the robot's own model says."""
    sheet, steps, data = (tmp_path / name for name in ("sheet.csv", "steps.txt", "data.csv"))
    words = ["irb120", "--fixture", "220,0,100,-30", "--distinct", "--out", sheet, "--steps", steps]
    run = truearm("hexapod", "plan", *words, "--json")
    assert run.code == 0
    summary = json.loads(run.out)
    assert list(summary) == [
        "poses",
        "poses_reached",
        "configurations",
        "places",
        "left_out",
        "smallest_room_mm",
        "joints_are",
    ]
    assert summary["poses"] == 54
    assert 10 < summary["poses_reached"] <= 54
    assert steps.read_text().count("Configuration ") == summary["configurations"]
    assert f"{summary['poses_reached']} of 54 poses" in truearm("hexapod", "plan", *words).out
    rows = list(csv.DictReader(sheet.read_text().splitlines()))
    assert len(rows) == summary["configurations"]
    for row in rows:
        lengths = dict.fromkeys(_legs(row["design"]), "300")
        if row is rows[0]:
            lengths |= dict.fromkeys(("B1-B2", "B2-B3", "B3-B1"), "300") | dict.fromkeys(
                ("T1-T2", "T2-T3", "T3-T1"), "150"
            )
        row.update({f"{name} [mm]": length for name, length in lengths.items()})
    rows[1][f"{_legs(rows[1]['design'])[0]} [mm]"] = ""
    with sheet.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    run = truearm("hexapod", "solve", sheet, "--out", data)
    assert run.code == 0
    assert f"Left out, not all legs measured: {rows[1]['configuration']}" in run.out
    found = read_csv(data)
    assert found.configurations == len(rows) - 1
    assert found.position == pytest.approx(read_sheet(sheet).dataset().position, abs=1e-12)
    entries = json.loads(truearm("hexapod", "solve", sheet, "--json").out)["poses"]
    assert list(entries[0]) == ["configuration", "design", "solution", "legs", "place", "side", "cups_mm"]


def _legs(design: str) -> list[str]:
    i, j, k = design[0], design[3], design[7]
    first, second, third = list(design[4:7])
    return [f"B{b}-T{t}" for b, t in ((i, first), (j, first), (k, first), (i, second), (j, second), (j, third))]


def test_several_places_and_sides_from_plan_to_data(truearm: Truearm, tmp_path: Path) -> None:
    sheet, steps, data = (tmp_path / name for name in ("sheet.csv", "steps.txt", "data.csv"))
    words = [
        "irb120",
        "--fixture",
        "220,0,300,-30",
        "--fixture",
        "150,250,300,20",
        "--fourth-cup",
        "--attachments",
        "2",
    ]
    run = truearm("hexapod", "plan", *words, "--branches", "front-up", "--out", sheet, "--steps", steps)
    assert run.code == 0
    assert "fixture_2: " in run.out
    assert "on side 2" in run.out
    text = steps.read_text()
    assert "Measure B1-B2, B2-B3, B3-B1, B1-B4, B2-B4, B3-B4." in text
    assert "Place fixture_2: set the base fixture up there" in text
    assert "Attachment 2: take the tool off" in text
    rows = list(csv.DictReader(sheet.read_text().splitlines()))
    for row in rows:
        filled = [name for name in row if name[:1] == "B" and (name[3:4] == "B" or name[:5] in _side_legs(row))]
        row.update(dict.fromkeys(filled, "300") | {f"{name} [mm]": "150" for name in ("T1-T2", "T2-T3", "T3-T1")})
    with sheet.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    run = truearm("hexapod", "solve", sheet, "--details", "--out", data)
    assert run.code == 0
    assert "place fixture_2, side 4, design" in run.out
    assert "Tool changer, from 5 pairs of readings with 2 attachments:" in run.out
    found = read_csv(data)
    assert found.fixtures == ("fixture_1", "fixture_2")
    assert found.sigma is not None
    summary = json.loads(truearm("hexapod", "solve", sheet, "--json").out)
    assert list(summary["tool_changer"]) == [
        "attachments",
        "pairs",
        "deviation_mm",
        "rest_mm",
        "mean_mm",
        "largest_mm",
        "ballbar_mm",
    ]
    twice = truearm("hexapod", "solve", sheet, sheet)
    assert twice.code == 2
    assert "the sheet is given twice" in twice.err


def _side_legs(row: dict[str, str]) -> list[str]:
    cups = ("", "123", "214", "324", "134")[int(row["side"])]
    return [f"B{cups[int(name[1]) - 1]}{name[2:]}" for name in _legs(row["design"])]


def test_a_wrong_fixture_and_a_plan_over_its_robot(truearm: Truearm, tmp_path: Path) -> None:
    out = tmp_path / "sheet.csv"
    for fixture, words in (
        ("1,2", "--fixture: the fixture has 4 or 7 numbers"),
        ("1,a", "numbers separated"),
        ("0,0,0,1,1,0,0", "length 1"),
        ("9000,0,0,0", "none of the"),
    ):
        run = truearm("hexapod", "plan", "irb120", "--fixture", fixture, "--out", out)
        assert run.code == 2
        assert words in run.err
        assert not out.exists()


def test_world_frame(truearm: Truearm, tmp_path: Path) -> None:
    from truearm.engine.robot.inverse.kinematics import inverse
    from truearm.hexapod.reachable import with_cups

    robot, _ = with_cups(load_robot("irb120"))
    cups = triangle([0.3003, 0.3, 0.2996], "B") + np.array([0.25, -0.1, 0.1])
    down = np.broadcast_to(np.diag([1.0, -1.0, -1.0]), (3, 3, 3))
    joints = np.degrees(inverse(robot, cups, down, target="1").joints)
    file = tmp_path / "touches.csv"
    lines = ["cup," + ",".join(f"joint_{n} [deg]" for n in range(1, 7))]
    lines += [f"B{n},{','.join(map(repr, row))}" for n, row in enumerate(joints.tolist(), 1)]
    file.write_text("\n".join(lines) + "\n")
    words = ["hexapod", "world-frame", "irb120", file, "--base-sides"]
    found = json.loads(truearm(*words, "300.3,300,299.6", "--json").out)
    assert list(found) == ["position_mm", "quaternion", "plain", "distances_by_robot_mm", "residuals_mm"]
    assert found["position_mm"] == pytest.approx([250, -100, 100], abs=1e-6)
    assert found["quaternion"] == pytest.approx([1, 0, 0, 0], abs=1e-9)
    assert found["residuals_mm"] == pytest.approx([0, 0, 0], abs=1e-6)
    assert "x 250.0000" in truearm(*words, "300.3,300,299.6").out
    assert "the length B2-B3 is beyond" in truearm(*words, "300,302,300").err
    assert "no cup of this name" in truearm(*words, "300,300,300", "--cup", "4").err


def test_distances(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    data = small / "data.csv"
    truearm("calibrate", "irb120", data, "--out", tmp_path)
    run = truearm("distances", tmp_path / "calibrated.yaml", data, "--json")
    assert run.code == 0
    found = json.loads(run.out)
    keys = ["configurations", "pairs", "distance_mm", "positive", "histogram"]
    assert list(found) == ["simulated", "simulated_parts", *keys]
    assert list(found["distance_mm"]) == ["mean", "deviation", "max"]
    assert (found["configurations"], found["pairs"]) == (40, 120 * 119 // 2 - 40 * 3)
    assert sum(found["histogram"]["counts"]) == found["pairs"]
    assert 0.01 < found["distance_mm"]["mean"] < 0.2
    assert "% of the predicted distances are too long" in truearm("distances", tmp_path / "calibrated.yaml", data).out
    assert "the robot has no targets" in truearm("distances", "irb120", data).err
