"""The sheet of lengths: what was planned comes back, and what cannot be is refused with line and column."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.data.hexapod import poses, triangle
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Joint
from truearm.hexapod.rehearsal import ballbar, measured_legs, measured_sides
from truearm.hexapod.sheet import PlannedRow, Sheet, sheet_csv
from truearm.hexapod.sheet_reading import read_sheet, read_touches

JOINTS = [Joint(f"axis_{n}", "revolute", {}) for n in range(1, 7)]


@pytest.fixture
def filled() -> list[dict[str, str]]:
    """Three poses with their lengths, the fixtures' distances in the first row only."""
    found = poses()
    base = triangle([0.3] * 3, "B")
    bar = ballbar(np.random.default_rng(0))
    rows, lengths = [], []
    for label, number in (("a", 5), ("b", 40), ("c", 66)):
        pose = found[number - 1]
        rows.append(PlannedRow(label, "front-up-flip", number, pose.design, pose.solution, np.full(6, 0.1)))
        lengths.append(measured_legs(bar, pose.design, base, pose.cups))
    lengths[0] |= measured_sides(bar, base, "B") | measured_sides(bar, found[0].cups, "T")
    return list(csv.DictReader(io.StringIO(sheet_csv(rows, JOINTS, lengths))))


def read(folder: Path, rows: list[dict[str, str]], header: list[str] | None = None) -> Sheet:
    file = folder / "sheet.csv"
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header or list(rows[0]))
    writer.writerows(row.values() for row in rows)
    file.write_text(stream.getvalue())
    return read_sheet(file)


def test_the_cups_come_back(tmp_path: Path, filled: list[dict[str, str]]) -> None:
    sheet = read(tmp_path, filled)
    expected = [poses()[number - 1].cups for number in (5, 40, 66)]
    assert sheet.cups() == pytest.approx(np.array(expected), abs=2e-5)
    assert (sheet.base[1] == sheet.base[0]).all()
    data = sheet.dataset()
    assert (data.labels, data.targets, data.position.shape) == (("a", "b", "c"), ("1", "2", "3"), (9, 3))
    assert data.position[3:6] == pytest.approx(expected[1], abs=2e-5)
    assert data.joints == pytest.approx(np.full((3, 6), 0.1))


def test_joint_positions_of_the_controller_are_kept_as_such(tmp_path: Path, filled: list[dict[str, str]]) -> None:
    shown = [{name.replace("joint_", "axis_"): value for name, value in row.items()} for row in filled]
    assert read(tmp_path, shown).dataset().joints_are == "controller"
    both = [row | {"axis_1 [deg]": "1"} for row in filled]
    with pytest.raises(InputError, match="a file has joint positions of one kind"):
        read(tmp_path, both)


def test_a_row_without_all_its_legs_is_left_out(tmp_path: Path, filled: list[dict[str, str]]) -> None:
    leg = poses()[39].design.leg_names[2]
    filled[1][f"{leg} [mm]"] = ""
    sheet = read(tmp_path, filled)
    assert sheet.measured.tolist() == [0, 2]
    assert np.isnan(sheet.cups()[1]).all()
    assert sheet.dataset().labels == ("a", "c")


@pytest.mark.parametrize(
    ("words", "row", "column", "text"),
    [
        (r"line 2, column .*: the length \S+ is beyond the range", 0, "leg", "301.2"),
        (r"column B1-B2 \[mm\]: the length B1-B2 is beyond", 0, "B1-B2 [mm]", "298.99"),
        (r"column T3-T1 \[mm\]: the length T3-T1 is beyond", 1, "T3-T1 [mm]", "300"),
        ("the first row must have the distances", 0, "B2-B3 [mm]", ""),
        (r"the design \d+ has no leg", 1, "no leg", "300"),
        ("there is no such design", 2, "design", "112212332"),
        ("there is no such solution", 2, "solution", "5"),
        ("the configuration appears twice", 2, "configuration", "a"),
        ("a number belongs here", 2, "leg", "about 300"),
    ],
)
def test_bad_cells(tmp_path: Path, filled: list[dict[str, str]], words: str, row: int, column: str, text: str) -> None:
    names = poses()[(5, 40, 66)[row] - 1].design.leg_names
    if column == "leg":
        column = f"{names[0]} [mm]"
    if column == "no leg":
        column = next(name for name in filled[0] if name[:1] == "B" and "-T" in name and name[:5] not in names)
    filled[row][column] = text
    with pytest.raises(InputError, match=words):
        read(tmp_path, filled)


@pytest.mark.parametrize(
    ("words", "before", "after"),
    [
        ("no unit is given", "B1-T1 [mm]", "B1-T1"),
        ("column B1-T1 appears twice", "B1-T2 [mm]", "B1-T1 [mm]"),
        ("Did you mean solution", "solution", "solutions"),
        ("the column is not known", "T1-T2 [mm]", "T1-T4 [mm]"),
        ("joint positions", "joint", ""),
    ],
)
def test_bad_headers(tmp_path: Path, filled: list[dict[str, str]], words: str, before: str, after: str) -> None:
    header = [name.replace(before, after) for name in filled[0]]
    if not after:
        filled = [{k: v for k, v in row.items() if before not in k} for row in filled]
        with pytest.raises(InputError, match=words):
            read(tmp_path, filled).dataset()
        return
    with pytest.raises(InputError, match=words):
        read(tmp_path, filled, header)


def test_a_missing_column_and_nothing_measured(tmp_path: Path, filled: list[dict[str, str]]) -> None:
    legs = [name for name in filled[0] if name[:1] == "B" and "-T" in name]
    with pytest.raises(InputError, match="no row has all six legs"):
        read(tmp_path, [row | dict.fromkeys(legs, "") for row in filled]).dataset()
    with pytest.raises(InputError, match="the column B1-T1 is missing"):
        read(tmp_path, [{k: v for k, v in row.items() if k != "B1-T1 [mm]"} for row in filled])


HEAD = "cup,joint_1 [deg],joint_2 [deg],joint_3 [deg],joint_4 [deg],joint_5 [deg],joint_6 [deg]\n"


def test_touches_in_any_order(tmp_path: Path) -> None:
    file = tmp_path / "touches.csv"
    file.write_text(f"{HEAD}B3,3,0,0,0,0,0\nB1,1,0,0,0,0,0\nB2,2,0,0,0,0,0\n")
    assert np.degrees(read_touches(file, load_robot("irb120"))[:, 0]) == pytest.approx([1, 2, 3])


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("every base cup is touched once", f"{HEAD}B1,0,0,0,0,0,0\nB1,0,0,0,0,0,0\nB2,0,0,0,0,0,0\n"),
        ("not known, or appears twice", f"{HEAD.replace('cup', 'cups')}B1,0,0,0,0,0,0\n"),
        ("not known, or appears twice", f"{HEAD.replace('joint_6', 'joint_7')}B1,0,0,0,0,0,0\n"),
        ("column joint_6 is missing", f"{HEAD.replace(',joint_6 [deg]', '')}B1,0,0,0,0,0\n"),
        ("does not fit here", f"{HEAD.replace('joint_6 [deg]', 'joint_6 [mm]')}B1,0,0,0,0,0,0\n"),
    ],
)
def test_bad_touches(tmp_path: Path, words: str, text: str) -> None:
    file = tmp_path / "touches.csv"
    file.write_text(text)
    with pytest.raises(InputError, match=words):
        read_touches(file, load_robot("irb120"))
