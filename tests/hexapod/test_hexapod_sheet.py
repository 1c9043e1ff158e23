"""Sheets of lengths: of one place, and of several with sides of four cups and attachments of the tool."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.data.hexapod import CUPS, DEVICE, leg_lengths, poses, side_names, triangle
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.transform import rotation_from_quaternion
from truearm.hexapod.rehearsal import ballbar, measured_legs, measured_sides
from truearm.hexapod.sheet import (
    CUP_DEVIATION,
    TO_FOURTH,
    ChangerRepeatability,
    PlannedRow,
    Sheet,
    compared,
    four_cups,
    legs_of_side,
    sheet_csv,
    side_distances,
    side_frames,
    together,
)
from truearm.hexapod.sheet_reading import read_sheet, read_touches

JOINTS = [Joint(f"axis_{n}", "revolute", {}) for n in range(1, 7)]
Rows = list[dict[str, str]]


@pytest.fixture
def three() -> Rows:
    """Three poses with their lengths, the fixtures' distances in the first row only."""
    all_poses = poses()
    base = triangle([0.3] * 3, "B")
    bar = ballbar(np.random.default_rng(0))
    rows, lengths = [], []
    for label, number in (("a", 5), ("b", 40), ("c", 66)):
        pose = all_poses[number - 1]
        rows.append(PlannedRow(label, "front-up-flip", number, pose.design, pose.solution, np.full(6, 0.1)))
        lengths.append(measured_legs(bar, pose.design, base, pose.cups))
    lengths[0] |= measured_sides(bar, base, "B") | measured_sides(bar, all_poses[0].cups, "T")
    return list(csv.DictReader(io.StringIO(sheet_csv(rows, JOINTS, lengths))))


def read_three(folder: Path, rows: Rows, header: list[str] | None = None) -> Sheet:
    file = folder / "sheet.csv"
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header or list(rows[0]))
    writer.writerows(row.values() for row in rows)
    file.write_text(stream.getvalue())
    return read_sheet(file)


def test_the_cups_come_back(tmp_path: Path, three: Rows) -> None:
    sheet = read_three(tmp_path, three)
    expected = [poses()[number - 1].cups for number in (5, 40, 66)]
    assert sheet.cups() == pytest.approx(np.array(expected), abs=2e-5)
    assert (sheet.base[1] == sheet.base[0]).all()
    data = sheet.dataset()
    assert (data.labels, data.targets, data.position.shape) == (("a", "b", "c"), ("1", "2", "3"), (9, 3))
    assert data.position[3:6] == pytest.approx(expected[1], abs=2e-5)
    assert data.joints == pytest.approx(np.full((3, 6), 0.1))


def test_joint_positions_of_the_controller_are_kept_as_such(tmp_path: Path, three: Rows) -> None:
    shown = [_shown(row) for row in three]
    assert read_three(tmp_path, shown).dataset().joints_are == "controller"
    both = [row | {"axis_1 [deg]": "1"} for row in three]
    with pytest.raises(InputError, match="a file has joint positions of one kind"):
        read_three(tmp_path, both)


def test_a_row_without_all_its_legs_is_left_out(tmp_path: Path, three: Rows) -> None:
    leg = poses()[39].design.leg_names[2]
    three[1][f"{leg} [mm]"] = ""
    sheet = read_three(tmp_path, three)
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
def test_bad_cells_of_one_place(tmp_path: Path, three: Rows, words: str, row: int, column: str, text: str) -> None:
    names = poses()[(5, 40, 66)[row] - 1].design.leg_names
    if column == "leg":
        column = f"{names[0]} [mm]"
    if column == "no leg":
        column = next(name for name in three[0] if name[:1] == "B" and "-T" in name and name[:5] not in names)
    three[row][column] = text
    with pytest.raises(InputError, match=words):
        read_three(tmp_path, three)


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
def test_bad_headers(tmp_path: Path, three: Rows, words: str, before: str, after: str) -> None:
    header = [name.replace(before, after) for name in three[0]]
    if not after:
        three = [{k: v for k, v in row.items() if before not in k} for row in three]
        with pytest.raises(InputError, match=words):
            read_three(tmp_path, three).dataset()
        return
    with pytest.raises(InputError, match=words):
        read_three(tmp_path, three, header)


def test_a_missing_column_and_nothing_measured(tmp_path: Path, three: Rows) -> None:
    legs = [name for name in three[0] if name[:1] == "B" and "-T" in name]
    with pytest.raises(InputError, match="no row has all six legs"):
        read_three(tmp_path, [row | dict.fromkeys(legs, "") for row in three]).dataset()
    with pytest.raises(InputError, match="the column B1-T1 is missing"):
        read_three(tmp_path, [{k: v for k, v in row.items() if k != "B1-T1 [mm]"} for row in three])


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


POSES = poses()
#: Label, pose, place, side and attachment of each row.
SAID = (
    ("a", 5, "left", 1, "1"),
    ("b", 40, "left", 2, "1"),
    ("c", 66, "left", 3, "1"),
    ("d", 12, "left", 4, "2"),
    ("e", 5, "right", 1, "2"),
    ("f", 40, "right", 1, "2"),
    ("g", 12, "right", 1, "2"),
    ("h", 20, "right", 1, "2"),
)


@pytest.fixture
def base() -> Array:
    """Four cups, each a little off its place."""
    cups = four_cups([0.3] * 3, [0.3] * 3) + 1e-4 * np.random.default_rng(1).standard_normal((4, 3))
    return np.asarray(cups)


@pytest.fixture
def filled(base: Array) -> Rows:
    """Eight rows with exact lengths."""
    between = [float(np.linalg.norm(base[a] - base[b])) for a, b in ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))]
    rows, lengths = [], []
    for number, (label, pose, place, side, attachment) in enumerate(SAID):
        planned = POSES[pose - 1]
        joints = np.full(6, 0.1 * pose)
        row = PlannedRow(label, "front", pose, planned.design, planned.solution, joints, place, side, attachment)
        own = dict(zip(row.leg_names, _legs(base, pose, side), strict=True))
        if number == 0:
            own |= dict.fromkeys(side_names("T"), 0.15)
        if number in (0, 4):
            own |= dict(zip((*side_names("B"), *TO_FOURTH), between, strict=True))
        rows.append(row)
        lengths.append(own)
    return list(csv.DictReader(io.StringIO(sheet_csv(rows, JOINTS, lengths))))


def _legs(base: Array, pose: int, side: int) -> list[float]:
    return [float(v) for v in leg_lengths(POSES[pose - 1].design, base[_feet(side)], _cups(base, pose, side))]


def _feet(side: int) -> list[int]:
    return [[0, 1, 2], [1, 0, 3], [2, 1, 3], [0, 2, 3]][side - 1]


def _cups(base: Array, pose: int, side: int) -> Array:
    """Return true cups of a pose on a side, in the frame in which the base cups are given."""
    frame = side_frames(base)[side - 1]
    return np.asarray(POSES[pose - 1].cups @ frame.rotation.T + np.array(frame.translation))


def read(folder: Path, rows: Rows, name: str = "sheet.csv") -> Sheet:
    stream = io.StringIO()
    writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    (folder / name).write_text(stream.getvalue())
    return read_sheet(folder / name)


def test_all_sides_are_in_the_frame_of_the_first(tmp_path: Path, filled: Rows, base: Array) -> None:
    first = side_frames(base)[0]
    cups = read(tmp_path, filled).cups()
    for row, (_, pose, _, side, _) in enumerate(SAID):
        true = (_cups(base, pose, side) - np.array(first.translation)) @ first.rotation
        assert cups[row] == pytest.approx(true, abs=1e-9)


def test_each_side_has_its_own_distances_and_names() -> None:
    assert side_distances(3, (1.0, 2.0, 3.0), (4.0, 5.0, 6.0)).tolist() == [2.0, 5.0, 6.0]  # B3, B2, B4
    design = next(pose.design for pose in POSES if pose.design.name == "112212331")
    assert legs_of_side(design, 1) == design.leg_names
    assert legs_of_side(design, 2) == ("B2-T1", "B1-T1", "B4-T1", "B2-T2", "B1-T2", "B1-T3")


def test_places_are_fixtures(tmp_path: Path, filled: Rows) -> None:
    data = together([read(tmp_path, filled)]).dataset()
    assert data.fixtures == ("left", "right")
    assert data.fixture is not None
    assert data.fixture.tolist() == [0] * 12 + [1] * 12
    assert not data.anchored


def test_one_place_stays_the_frame_of_the_data(tmp_path: Path, filled: Rows) -> None:
    data = together([read(tmp_path, filled[:4])]).dataset()
    assert (data.fixtures, data.fixture) == ((), None)
    assert data.anchored


def test_sheets_without_places_are_a_place_each(tmp_path: Path, filled: Rows) -> None:
    parts = [
        read(tmp_path, [{k: v for k, v in row.items() if k != "place"} for row in rows], name)
        for rows, name in ((filled[:4], "one.csv"), (_with_tool(filled)[4:], "two.csv"))
    ]
    data = together(parts).dataset()
    assert data.fixtures == ("fixture_1", "fixture_2")
    assert data.position == pytest.approx(together([read(tmp_path, filled)]).dataset().position, abs=1e-12)
    assert data.labels == ("a", "b", "c", "d", "e", "f", "g", "h")


def test_sheets_of_the_same_place_share_it(tmp_path: Path, filled: Rows) -> None:
    whole = [dict(filled[0], **{k: v for k, v in row.items() if v}) for row in filled[:2]]
    parts = [read(tmp_path, filled[:4], "one.csv"), read(tmp_path, whole[:1], "two.csv")]
    data = together(parts).dataset()
    assert data.fixtures == ()
    assert data.labels == ("a", "b", "c", "d", "a#2")


def _with_tool(rows: Rows) -> Rows:
    return [row | {f"{name} [mm]": "150" for name in side_names("T")} for row in rows]


@pytest.mark.parametrize(
    ("words", "cure", "row", "column", "text"),
    [
        ("side 2 was measured, and the distance B2-B4 is not known", "Measure the distances", 0, "B2-B4 [mm]", ""),
        (r"line 6, column B1-B2 \[mm\]: the first row of a place", "locked anew", 4, "B1-B2 [mm]", ""),
        ("the attachment of the tool is missing", "leave the whole column empty", 2, "attachment", ""),
        ("line 4, column place: the cell is empty", "", 2, "place", ""),
        ("rows of the place left do not stand together", "call that another place", 6, "place", "left"),
        ("too few rows of the place right have all six legs; got 3; allowed: 4", "remove the rows", 7, "place", "here"),
        ("there is no such side; got '5'; allowed: 1, 2, 3, 4", "", 1, "side", "5"),
        ("there is no such side; got ''", "", 1, "side", ""),
        (r"has no leg B3-T\d on this side", "which cups", 1, "B3", "300"),
        ("the length B3-B4 is beyond the range", "", 0, "B3-B4 [mm]", "302"),
        ("did not stand still at the place left; got 'B1-B2 from", "another name", 2, "B1-B2 [mm]", "300.6"),
    ],
)
def test_bad_cells(tmp_path: Path, filled: Rows, words: str, cure: str, row: int, column: str, text: str) -> None:
    if column == "B3":
        column = next(name for name in filled[row] if name.startswith("B3-T"))
    filled[row][column] = text
    if text == "here":
        filled[row] |= {name: "" for name in filled[row] if name[:1] == "B" and "-T" in name}
        filled[row] |= {f"{name} [mm]": "300" for name in side_names("B")}
    with pytest.raises(InputError, match=words) as refused:
        together([read(tmp_path, filled)])
    assert cure in str(refused.value)


def test_an_attachment_is_needed_only_where_something_was_measured(tmp_path: Path, filled: Rows) -> None:
    leg = legs_of_side(POSES[39].design, 2)[0]
    filled[1] |= {f"{leg} [mm]": "", "attachment": ""}
    assert read(tmp_path, filled).attachments == ("1", "", "1", "2", "2", "2", "2", "2")
    assert read(tmp_path, [row | {"attachment": ""} for row in filled]).attachments is None


@pytest.mark.parametrize(
    ("words", "cure", "change"),
    [
        ("not of one robot", "on their own", lambda rows: [_without(row, "joint_6 [deg]") for row in rows]),
        ("one of the sheets has joint_1 .., the other axis_1", "alike", lambda rows: [_shown(row) for row in rows]),
        ("only one of the sheets has joint positions", "Add them", lambda rows: [_without(r, "joint") for r in rows]),
        ("not of one tool; got 'T2-T3", "measure its cups", lambda rows: [r | {"T2-T3 [mm]": "150.3"} for r in rows]),
        ("only one of the sheets names its places", "the same name", lambda rows: [_without(r, "place") for r in rows]),
        ("only one of the sheets names its attachments", "all of", lambda rows: [_without(r, "attach") for r in rows]),
        ("did not stand still at the place left", "", lambda rows: [r | {"B2-B3 [mm]": "299.5"} for r in rows]),
    ],
)
def test_sheets_that_do_not_fit(
    tmp_path: Path, filled: Rows, words: str, cure: str, change: Callable[[Rows], Rows]
) -> None:
    first, second = read(tmp_path, filled, "one.csv"), read(tmp_path, change(_with_tool(filled)[:1]), "two.csv")
    with pytest.raises(InputError, match=words) as refused:
        together([first, second])
    assert cure in str(refused.value)


def _shown(row: dict[str, str]) -> dict[str, str]:
    return {name.replace("joint_", "axis_"): value for name, value in row.items()}


def _without(row: dict[str, str], begin: str) -> dict[str, str]:
    return {name: value for name, value in row.items() if not name.startswith(begin)}


def _attached(
    rng: np.random.Generator, shift: float, turn: float, repeatability: float, attachments: int
) -> tuple[Array, Array]:
    """Return cups ``(configurations * attachments, 3, 3)`` in a world, and joint positions that tell configurations."""
    seen, joints = [], []
    moved = []
    for _ in range(attachments):
        half = np.array([1.0, *(turn / 2 * rng.standard_normal(3))])
        moved.append(CUPS @ rotation_from_quaternion(half / np.linalg.norm(half)).T + shift * rng.standard_normal(3))
    for configuration in range(4):
        q, _ = np.linalg.qr(rng.standard_normal((3, 3)))
        for cups in moved:
            seen.append(cups @ q.T + repeatability * rng.standard_normal((3, 3)))
            joints.append(np.full(6, 0.1 * configuration))
    return np.array(seen), np.array(joints)


def test_the_changer_is_told_from_the_robot() -> None:
    rng = np.random.default_rng(3)
    of_changer, of_robot = [], []
    for _ in range(60):
        cups, joints = _attached(rng, 2e-5, 2e-4, 1e-5, 4)
        seen = compared(cups, joints, [""] * 16, ["1", "2", "3", "4"] * 4).repeatability
        assert seen is not None
        assert seen.rest is not None
        assert (seen.pairs, seen.compared) == (24, 4)
        of_changer.append(seen.changer**2)
        of_robot.append(seen.rest**2)
    true = np.sqrt(4e-10 + 4e-8 * 2 / 3 * (CUPS**2).sum(axis=1))
    assert np.sqrt(np.mean(of_changer, axis=0)) == pytest.approx(true, rel=0.15)
    assert np.sqrt(np.mean(of_robot, axis=0)) == pytest.approx(np.full(3, 1e-5), rel=0.1)


def test_an_attachment_counts_as_it_differs_from_the_mean_of_all_rows() -> None:
    """The place of the tool is found from all rows, so what all rows share is no error."""
    rng = np.random.default_rng(5)
    repeatability = ChangerRepeatability(np.full(3, 2e-5), np.full(3, 1e-6), np.zeros(3), np.zeros(3), 1, 2)
    assert repeatability.declared(["1"] * 4) == pytest.approx(np.full((4, 3), 1e-6))
    names = ["1", "1", "1", "1", "1", "1", "2", "3"]
    moved = 2e-5 * rng.standard_normal((20000, 3))[:, np.array([int(name) - 1 for name in names])]
    moved = moved - moved.mean(axis=1, keepdims=True) + 1e-6 * rng.standard_normal(moved.shape)
    assert repeatability.declared(names)[:, 0] == pytest.approx(moved.std(axis=0), rel=0.03)


def test_one_configuration_cannot_tell_the_robot_from_the_changer() -> None:
    cups, joints = _attached(np.random.default_rng(4), 2e-5, 0.0, 0.0, 2)
    seen = compared(cups[:2], joints[:2], ["", ""], ["1", "2"]).repeatability
    assert seen is not None
    assert seen.rest is None
    assert seen.changer == pytest.approx(np.linalg.norm(cups[1] - cups[0], axis=1) / np.sqrt(6))
    assert seen.declared(["1", "2", "2"]) == pytest.approx(np.tile(seen.changer, (3, 1)))
    # at another place, or at other joint positions, nothing was measured again
    assert compared(cups[:2], joints[:2], ["left", "right"], ["1", "2"]).repeatability is None
    assert compared(cups[:2], joints[[0, -1]], ["", ""], ["1", "2"]).repeatability is None


def test_what_the_changer_does_not_repeat_is_declared(tmp_path: Path, filled: Rows) -> None:
    again = filled[1] | {"configuration": "b2", "attachment": "2"}
    leg = f"{legs_of_side(POSES[39].design, 2)[0]} [mm]"
    again[leg] = str(float(again[leg]) + 0.05)
    sheet = together([read(tmp_path, [*filled[:2], again, *filled[2:]])])
    attached = sheet.attached()
    assert attached is not None
    assert attached.repeatability is not None
    sigma = sheet.dataset().sigma
    assert sigma is not None
    assert attached.repeatability.rest is None
    assert sigma[:3] == pytest.approx(np.maximum(attached.repeatability.changer, CUP_DEVIATION * DEVICE.sigma))
    assert sigma.max() > 1e-5
    # without anything measured again nothing is known, and nothing declared
    assert together([read(tmp_path, filled)]).dataset().sigma is None
    assert together([read(tmp_path, [row | {"attachment": "1"} for row in filled])]).attached() is None
