"""What a mapping says of orientations, deviations, order, temperature and missing texts of a table."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from tests.engine.data.test_table import LONG, MAP, read

from truearm.engine.base.errors import InputError
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.engine.data.readers.table import read_noting
from truearm.engine.robot.transform import quaternion_from_rotation, rotation_from_vector
from truearm.importing.jobs import import_table

ROWS = "pose,q1,q2,ball,X,Y,Z,a,b,c\np,1,2,t,1,2,3,{}\n"


def turned(folder: Path, numbers: str, entry: str) -> np.ndarray:
    data = read(folder, ROWS.format(numbers), MAP.replace("z: Z", f"z: Z, {entry}"))
    assert data.quaternion is not None
    return np.asarray(data.quaternion[0])


def about(axis: str, degrees: float) -> np.ndarray:
    return np.asarray(rotation_from_vector(np.radians(degrees) * np.eye(3)["xyz".index(axis)][None])[0])


def test_angles_of_every_order(tmp_path: Path) -> None:
    for order in (a + b + c for a in "xyz" for b in "xyz" for c in "xyz" if a != b != c):
        first, second, third = (about(axis, value) for axis, value in zip(order, (20.0, -50.0, 110.0), strict=True))
        for axes, wanted in (("moving", first @ second @ third), ("fixed", third @ second @ first)):
            entry = f"angles: {{columns: [a, b, c], about: {order}, axes: {axes}, unit: deg}}"
            got = turned(tmp_path, "20,-50,110", entry)
            assert got == pytest.approx(quaternion_from_rotation(wanted), abs=1e-12), (order, axes)


def test_angles_of_known_makers(tmp_path: Path) -> None:
    kuka = turned(tmp_path, "90,0,0", "angles: {columns: [a, b, c], about: zyx, axes: moving, unit: deg}")
    fanuc = turned(tmp_path, "0,0,90", "angles: {columns: [a, b, c], about: xyz, axes: fixed, unit: deg}")
    half = math.sqrt(0.5)
    assert kuka == pytest.approx([half, 0, 0, half])
    assert fanuc == pytest.approx([half, 0, 0, half])


def test_rotation_vectors_and_missing_ones(tmp_path: Path) -> None:
    entry = "rotation_vector: {columns: [a, b, c], unit: rad}"
    assert turned(tmp_path, f"0,{math.pi / 2},0", entry) == pytest.approx([math.sqrt(0.5), 0, math.sqrt(0.5), 0])
    table = ROWS.format("0,1,0") + "p,1,2,u,1,2,3,0,,0\n"
    data = read(tmp_path, table, MAP.replace("z: Z", f"z: Z, {entry}") + "sigma_rot: {value: 1, unit: mrad}\n")
    assert data.has_orientation.tolist() == [True, False]


def test_deviations_in_columns(tmp_path: Path) -> None:
    table = "pose,q1,q2,ball,X,Y,Z,a,b,c,U\np,1,2,t,1,2,3,0.01,0.02,0.03,0.08\np,1,2,u,,2,3,,,,\n"
    three = read(tmp_path, table, MAP.replace("z: Z", "z: Z, sigma: {columns: [a, b, c], unit: mm}"))
    assert three.sigma is not None
    assert three.sigma[0] == pytest.approx(1e-5 * math.sqrt(14.0 / 3.0))
    assert np.isnan(three.sigma[1])
    data = read(tmp_path, table, MAP.replace("z: Z", "z: Z, sigma: {columns: [U], unit: mm, coverage: 2}"))
    assert data.sigma is not None
    assert data.sigma[0] == pytest.approx(4e-5)


def test_deviations_that_are_far_apart_are_told(tmp_path: Path) -> None:
    mapping = MAP.replace("z: Z", "z: Z, sigma: {columns: [a, b, c], unit: mm}")
    table = "pose,q1,q2,ball,X,Y,Z,a,b,c\np,1,2,t,1,2,3,0.01,0.02,{}\np,1,2,u,1,2,3,0.01,0.01,0.04\np,1,2,v,,,,,,\n"
    read(tmp_path, table.format("0.03"), mapping)
    data, (notice,) = read_noting(tmp_path / "table.txt", tmp_path / "map.yaml")
    assert (notice.code, notice.level) == ("sigma-uneven", "note")
    assert "3.5 times apart in half of the readings or more, and up to 4 times" in notice.message
    assert data.sigma is not None
    assert 3.0 * data.sigma[0] ** 2 == pytest.approx(1e-10 * (1 + 4 + 9))
    imported = import_table(tmp_path / "table.txt", tmp_path / "map.yaml")
    assert imported.lines()[-1].startswith("Note (sigma-uneven): ")
    assert imported.summary()["warnings"][0]["code"] == "sigma-uneven"
    (tmp_path / "table.txt").write_text(table.format("0.01").replace("0.04", "0.015"))
    assert not import_table(tmp_path / "table.txt", tmp_path / "map.yaml").warnings


@pytest.mark.parametrize(
    ("entry", "numbers", "words"),
    [
        ("angles: {columns: [a, b, c], about: zyx, axes: moving, unit: rad}", "10,-35,170", "orientations (a, b, c)"),
        ("rotation_vector: {columns: [a, b, c], unit: rad}", "0.1,,-6.4", "orientations (a, b, c)"),
        ("rotation_vector: {columns: [a, b, c], unit: rad}", "0.1,0.2,-6.2", ""),
        ("angles: {columns: [a, b, c], about: zyx, axes: moving, unit: deg}", "10,-35,170", ""),
    ],
)
def test_degrees_that_are_read_as_radians_are_told(tmp_path: Path, entry: str, numbers: str, words: str) -> None:
    read(tmp_path, ROWS.format("0,1,0") + f"p,1,2,u,1,2,3,{numbers}\n", MAP.replace("z: Z", f"z: Z, {entry}"))
    notices = import_table(tmp_path / "table.txt", tmp_path / "map.yaml").warnings
    assert [(notice.code, notice.level) for notice in notices] == [("radians-unlikely", "warning")] * bool(words)
    assert all(words in notice.message and "in 1 of 2 rows" in notice.message for notice in notices)


def test_joints_in_degrees_that_are_read_as_radians_are_told(tmp_path: Path) -> None:
    """A joint may turn on: one row of three beyond a full turn says nothing."""
    table = "pose,q1,q2,ball,X,Y,Z\n1,{},2,t,1,2,3\n2,{},1,t,1,2,3\n3,1,-1,t,1,2,3\n"
    mapping = MAP.replace("unit: deg", "unit: rad")
    for first, second, warned in ((30, -110, True), (30, 6, False)):
        read(tmp_path, table.format(first, second), mapping)
        notices = import_table(tmp_path / "table.txt", tmp_path / "map.yaml").warnings
        assert [notice.code for notice in notices] == ["radians-unlikely"] * warned
        assert all("joints (q1, q2)" in n.message and "up to 110" in n.message for n in notices)


def test_deviations_of_each_target_of_a_wide_table(tmp_path: Path) -> None:
    mapping = MAP.replace(
        "- {target_column: ball, x: X, y: Y, z: Z}",
        "- {target: one, x: X, y: Y, z: Z, sigma: {columns: [s], unit: um}}\n"
        "  - {target: two, x: A, y: B, z: C, sigma: {columns: [t], unit: um}}",
    )
    data = read(tmp_path, "pose,q1,q2,X,Y,Z,s,A,B,C,t\np,1,2,1,2,3,10,4,5,6,20\n", mapping)
    assert data.sigma is not None
    assert data.sigma.tolist() == pytest.approx([1e-5, 2e-5])


def test_texts_that_mean_missing(tmp_path: Path) -> None:
    table = LONG.replace("7,,9", "n/a,-,9").replace("4,5,6", "4,-9999,6")
    data = read(tmp_path, table, MAP + "missing: [n/a, '-', '-9999']\n")
    assert data.has_position.tolist() == [True, False, False]
    commas = LONG.replace(",", ";").replace("7;;9", "7,5;n.a.;9")
    layout = "layout: {delimiter: semicolon, decimal: comma}\n"
    assert read(tmp_path, commas, MAP + layout + "missing: [n.a.]\n").has_position.tolist() == [True, True, False]
    with pytest.raises(InputError, match=r"a number belongs here; got 'n.a.'.*name its text under missing"):
        read(tmp_path, commas, MAP + layout)
    with pytest.raises(InputError, match=r"line 2, column q1: a number belongs here; got 'n/a'"):
        read(tmp_path, LONG.replace("a,10,20,one", "a,n/a,20,one"), MAP + "missing: [n/a]\n")
    with pytest.raises(InputError, match="name its text under missing in the mapping"):
        read(tmp_path, LONG.replace("7,,9", "n/a,8,9"), MAP)


def test_temperatures(tmp_path: Path) -> None:
    table = "pose,q1,q2,ball,X,Y,Z,T\na,1,2,t,1,2,3,68\na,1,2,u,1,2,3,70\nb,3,4,t,1,2,3,\nb,3,4,u,1,2,3,50\n"
    data = read(tmp_path, table, MAP + "temperature: {column: T, unit: degF}\n")
    assert data.temperature is not None
    assert data.temperature.tolist() == pytest.approx([20.5555555, 10.0])
    with pytest.raises(InputError, match=r"line 2, column T: no arm is that cold or warm; got '68'"):
        read(tmp_path, table, MAP + "temperature: {column: T, unit: K}\n")
    with pytest.raises(InputError, match="line 4, column T: the configuration 'b' has no temperature"):
        read(tmp_path, table.replace("3,50", "3,"), MAP + "temperature: {column: T, unit: degC}\n")


# -- order ----------------------------------------------------------------------------------------------------


TIMED = "pose,q1,q2,ball,X,Y,Z,when\n{}"


def numbers(folder: Path, rows: str, order: str) -> list[float]:
    data = read(folder, TIMED.format(rows), MAP + f"order: {order}\n")
    (folder / "again.csv").write_text(csv_text(data))
    again = read_csv(folder / "again.csv")
    assert data.number is not None
    assert again.number is not None
    assert again.number.tolist() == data.number.tolist()
    return [float(number) for number in again.number]


def test_the_order_is_told_by_labels_rows_numbers_and_times(tmp_path: Path) -> None:
    rows = "P3,1,2,t,1,2,3,{}\nP1,3,4,t,1,2,3,{}\nP7,5,6,t,1,2,3,{}\n"
    assert numbers(tmp_path, rows.format(0, 0, 0), "{by: labels}") == [2, 0, 6]
    assert numbers(tmp_path, rows.format(0, 0, 0), "{by: rows}") == [0, 1, 2]
    data = read(tmp_path, TIMED.format(rows.format(0, 0, 0)), MAP + "order: {by: rows}\n")
    assert data.approach is not None  # what backlash and its like need
    assert data.approach.tolist() == [[0, 0], [1, 1], [1, 1]]
    assert numbers(tmp_path, rows.format(3, 9, 5), "{column: when}") == [2, 8, 4]
    assert numbers(tmp_path, rows.format("0.5", "1.7e9", "2"), "{column: when}") == [0, 2, 1]
    assert numbers(tmp_path, rows.format(3, 9, 5), "{column: when, time: null}") == [2, 8, 4]
    days = rows.format("2026-11-23 10:00", "2026-11-22 23:59", "2026-11-23 10:01")
    assert numbers(tmp_path, days, "{column: when, time: iso}") == [1, 0, 2]
    ours = rows.format("23.11.2026 10:00:01", "22.11.2026 23:59:00", "23.11.2026 10:00:09")
    assert numbers(tmp_path, ours, "{column: when, time: '%d.%m.%Y %H:%M:%S'}") == [1, 0, 2]
    several = "a,1,2,t,1,2,3,4\na,1,2,u,1,2,3,5\nb,3,4,t,1,2,3,\nb,3,4,u,1,2,3,1\n"
    assert numbers(tmp_path, several, "{column: when}") == [1, 0]


@pytest.mark.parametrize(
    ("rows", "order", "part"),
    [
        ("a 1, b 2, a 3", "{column: when}", "line 3, column when: the conf"),
        ("a 1, b 1", "{column: when}", "line 3, column when: the configurations 'a' and 'b' w"),
        ("a 1, b 2, a 3", "{by: rows}", "line 4: the configuration 'a' comes"),
        ("P1 1, Q2 2", "{by: labels}", "line 3: the label does not tell the order"),
        ("P1 1, P01 2", "{by: labels}", "line 3: two labels have the same number: P1 and P01"),
        ("a x", "{column: when, time: iso}", "line 2, column when: this is no time of the format"),
        ("a x", "{column: when}", "line 2, column when: a number belongs here"),
        ("a ", "{column: when}", "line 2, column when: the column that shall tell the order is empty"),
        ("a 23:59, b 00:01", "{column: when, time: '%H:%M'}", "line 2, column when: the times have no day"),
        (
            "a 2026-01-01T10:00Z, b 2026-01-01T10:01",
            "{column: when, time: iso}",
            "line 3, column when: this time has no time zone",
        ),
        ("a 1", "{column: time}", "map.yaml, order.column: "),
        ("a 1", "{column: when, time: '%'}", "map.yaml, order.time: this is no format of times"),
        ("a 1", "{by: rows, column: when}", "map.yaml, order: give either by"),
        ("a 1", "{by: rows, time: iso}", "map.yaml, order: time is the format of a column"),
    ],
)
def test_an_order_that_is_not_told_is_refused_with_its_cell(tmp_path: Path, rows: str, order: str, part: str) -> None:
    table, seen = "", set[str]()
    for number, row in enumerate(rows.split(", ")):
        label, when = row.split(" ")
        joint = 0 if label in seen else number  # the same configuration has the same joint positions
        table += f"{label},{joint},2,{'u' if label in seen else 't'},1,2,3,{when}\n"
        seen.add(label)
    with pytest.raises(InputError, match=re.escape(part)):
        numbers(tmp_path, table, order)


def test_configurations_that_were_not_measured_keep_their_place(tmp_path: Path) -> None:
    mapping = MAP.replace("columns: [q1, q2]\n  unit: deg", "file: joints.csv") + "order: {column: when}\n"
    joints = "configuration,joint_1 [deg],joint_2 [deg]\na,1,2\nb,3,4\nc,5,6\n"
    table = "pose,ball,X,Y,Z,when\na,t,1,2,3,10\nc,t,1,2,3,40\n"
    data = read(tmp_path, table, mapping, joints)
    assert data.number is not None
    assert data.number.tolist() == [0, 1, 2]
    with pytest.raises(InputError, match="where it stands in the order is not known; got 'b'"):
        read(tmp_path, table.replace("40", "4"), mapping, joints)


# -- a second file of the canonical form, second headings, confirmation ------------------------------------------


def test_joints_come_from_a_file_with_the_columns_of_the_canonical_csv(tmp_path: Path) -> None:
    mapping = MAP.replace("columns: [q1, q2]\n  unit: deg", "file: joints.csv")
    joints = "configuration,note,axis_1 [rad],axis_2 [mm]\nb,x,0.5,6\na,y,0.25,5\n"
    data = read(tmp_path, LONG, mapping, joints)
    assert (data.labels, data.joints.tolist(), data.joints_are) == (
        ("b", "a"),
        [[0.5, 0.006], [0.25, 0.005]],
        "controller",
    )
    other = tmp_path / "other.csv"
    other.write_text(joints.replace("axis", "joint"))
    data = read_noting(tmp_path / "table.txt", tmp_path / "map.yaml", joints=other)[0]
    assert data.joints_are == "model"
    with pytest.raises(InputError, match="the mapping says whose joint positions they are"):
        read_noting(tmp_path / "table.txt", tmp_path / "map.yaml", "controller", joints=other)
    with pytest.raises(InputError, match="the column configuration is missing"):
        read(tmp_path, LONG, mapping, joints.replace("configuration", "pose"))
    with pytest.raises(InputError, match=r"the configuration has no joints in .*column configuration"):
        read(tmp_path, LONG, mapping, joints.replace("\nb,", "\nc,"))
    with pytest.raises(InputError, match=r"got 'P001'.*Did you mean 1\? A pattern .* reads the number alone"):
        read(tmp_path, LONG.replace("a", "P001"), mapping, joints.replace("\na,", "\n1,"))
    (tmp_path / "map.yaml").write_text(MAP)
    with pytest.raises(InputError, match="takes the joint positions from the table itself") as refusal:
        read_noting(tmp_path / "table.txt", tmp_path / "map.yaml", joints=other)
    assert refusal.value.parameter == "joints_file"


@pytest.mark.parametrize(
    ("entry", "part"),
    [
        ("angles: {columns: [a, b], about: xyz, axes: fixed, unit: deg}", "readings[1].angles.columns: three columns"),
        ("angles: {columns: [a, b, c], about: xxz, axes: fixed, unit: deg}", "readings[1].angles.about: these are no"),
        ("angles: {columns: [a, b, c], about: xyz, axes: '?', unit: deg}", "got '?'; allowed: moving, fixed"),
        ("angles: {columns: [a, b, a], about: xyz, axes: fixed, unit: deg}", "a column is used twice"),
        ("rotation_vector: {columns: [a, b, c], unit: mm}", "allowed: deg, rad, mrad"),
        ("sigma: {columns: [a, b], unit: mm}", "readings[1].sigma.columns: these are not one column, or one for each"),
        ("sigma: {columns: [a], unit: mm, coverage: 0.5}", "readings[1].sigma.coverage"),
        ("sigma: {columns: [X], unit: mm}", "a column is used twice"),
        ("sigma_rot: {columns: [a], unit: mrad}", "sigma_rot is given, and there is no orientation"),
    ],
)
def test_entries_that_cannot_be(tmp_path: Path, entry: str, part: str) -> None:
    with pytest.raises(InputError, match=re.escape(part)):
        turned(tmp_path, "1,2,3", entry)


def test_an_orientation_and_deviations_come_from_one_place(tmp_path: Path) -> None:
    angles = "angles: {columns: [a, b, c], about: xyz, axes: fixed, unit: deg}"
    with pytest.raises(InputError, match="an orientation comes from one place"):
        turned(tmp_path, "1,2,3", f"{angles}, rotation_vector: {{columns: [a, b, c], unit: rad}}")
    mapping = MAP.replace("z: Z", "z: Z, sigma: {columns: [a], unit: mm}") + "sigma: {value: 1, unit: mm}\n"
    with pytest.raises(InputError, match="sigma is given for all readings, and again for some"):
        read(tmp_path, ROWS.format("1,2,3"), mapping)
    with pytest.raises(InputError, match=r"line 2, column a: a standard deviation must be above zero"):
        turned(tmp_path, "0,2,3", "sigma: {columns: [a], unit: mm}")


def test_two_lines_of_headings_are_refused_with_their_cell(tmp_path: Path) -> None:
    table = LONG.replace("\n", "\npose,deg,deg,name,mm,mm,mm\n", 1)
    with pytest.raises(InputError, match=r"line 2, column X: this row holds no numbers, like a second line of head"):
        read(tmp_path, table, MAP)
    numbered = MAP.replace("column: pose", "column: 1").replace("[q1, q2]", "[2, 3]")
    numbered = numbered.replace("ball, x: X, y: Y, z: Z", "4, x: 5, y: 6, z: 7") + "layout: {header: none}"
    with pytest.raises(InputError, match=r"line 1, column 5: this row holds no numbers, like a line of headings"):
        read(tmp_path, LONG, numbered)


def test_a_mapping_that_nobody_confirmed_is_refused(tmp_path: Path) -> None:
    for word in ("no", "false"):
        with pytest.raises(InputError, match=r"map.yaml, confirmed: this mapping was guessed.*allowed: yes"):
            read(tmp_path, LONG, MAP + f"confirmed: {word}\n")
    assert read(tmp_path, LONG, MAP + "confirmed: yes\n").labels == ("a", "b")


def test_a_day_and_a_time_in_two_columns_tell_the_order(tmp_path: Path) -> None:
    table = "pose,q1,q2,ball,X,Y,Z,day,clock\nb,1,2,t,1,2,3,23.11.2026,00:01\na,3,4,t,1,2,3,22.11.2026,23:59\n"
    order = "order: {columns: [day, clock], time: '%d.%m.%Y %H:%M'}\n"
    data = read(tmp_path, table, MAP + order)
    assert data.number is not None
    assert data.number.tolist() == [1, 0]
    for text, part in (
        (table.replace("23:59", ""), "line 3, column clock: this cell is empty, and the other of day and time is not"),
        (table.replace("23:59", "late"), "line 3, column day and clock: this is no time of the format"),
        (table.replace("22.11.2026,23:59", "23.11.2026,00:01"), "line 3, column day and clock: the configurations"),
    ):
        with pytest.raises(InputError, match=part):
            read(tmp_path, text, MAP + order)
    for wrong, part in (
        ("{columns: [day], time: iso}", "not one column with the day and one with the time"),
        ("{columns: [day, clock]}", "give their format"),
        ("{columns: [day, hour], time: iso}", r"order.columns\[2\]"),
    ):
        with pytest.raises(InputError, match=part):
            read(tmp_path, table, MAP + f"order: {wrong}\n")


def test_visits_come_from_a_column(tmp_path: Path) -> None:
    table = "pose,q1,q2,ball,X,Y,Z,round\na,1,2,t,1,2,3,1\na,1,2,u,1,2,3,2\nb,3,4,t,1,2,3,1\n"
    data = read(tmp_path, table, MAP + "visit: {column: round}\n")
    assert data.visit is not None
    assert data.visit.tolist() == [1, 2, 1]
    (tmp_path / "again.csv").write_text(csv_text(data))
    assert np.array_equal(np.asarray(read_csv(tmp_path / "again.csv").visit), data.visit)
    with pytest.raises(InputError, match="line 3, column round: this is no number of a visit; got 'II'"):
        read(tmp_path, table.replace("3,2\n", "3,II\n"), MAP + "visit: {column: round}\n")
    mapping = MAP.replace("columns: [q1, q2]\n  unit: deg", "file: joints.csv") + "visit: {column: round}\n"
    joints = "configuration,joint_1 [deg],joint_2 [deg]\na,1,2\nb,3,4\nc,5,6\n"
    assert len(np.asarray(read(tmp_path, table, mapping, joints).visit)) == 5
    with pytest.raises(InputError, match="a column is used twice"):
        read(tmp_path, table, MAP + "visit: {column: X}\n")
