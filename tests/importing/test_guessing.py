"""The mapping that a table seems to need: guessed, marked, and refused until somebody confirms it."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.data.readers.canonical import csv_text
from truearm.importing.guess import guess_mapping

#: Semicolons, decimal commas, radians, joints last, another order of joints, and n/a.
NEWCOMER = """\
Zelle 4, 12. März
Nr;Temp [°C];Z;X;Y;q3;q2;q1
P001;22,5;655,1041;1841,2213;112,8402;0,5454;-0,3578;0,1745
P002;22,6;n/a;n/a;n/a;0,096;0,2094;-0,6109
P003;22,7;790,6644;1702,5519;-640,2207;0,25;0,5;0,75
"""


def guessed(folder: Path, text: str, *, encoding: str = "utf-8") -> str:
    (folder / "table.csv").write_bytes(text.encode(encoding))
    guess = truearm.import_guess(folder / "table.csv")
    for line in guess.text.splitlines():
        assert "# guess: " in line or line.startswith(("#", "truearm:", "confirmed: no")) or line.endswith(":"), line
    return guess.text


def test_a_newcomer_comes_in_at_the_first_try(tmp_path: Path) -> None:
    text = guessed(tmp_path, NEWCOMER, encoding="cp1252")
    mapping = tmp_path / "map.yaml"
    mapping.write_text(text)
    with pytest.raises(InputError, match=r"joints.unit: this value is not known; got .\?.; allowed: deg, rad"):
        truearm.import_table(tmp_path / "table.csv", mapping)
    mapping.write_text(text.replace("unit: '?'", "unit: rad"))
    with pytest.raises(InputError, match="confirmed: this mapping was guessed, and nobody has confirmed it"):
        truearm.import_table(tmp_path / "table.csv", mapping)
    mapping.write_text(text.replace("unit: '?'", "unit: rad").replace("confirmed: no", "confirmed: yes"))
    data = truearm.import_table(tmp_path / "table.csv", mapping).data
    wanted = (
        "configuration,order,joint_1 [rad],joint_2 [rad],joint_3 [rad],target,x [mm],y [mm],z [mm],temperature [degC]\n"
        "P001,1,0.1745,-0.3578,0.5454,tip,1841.2213,112.8402,655.1041,22.5\n"
        "P002,2,-0.6109,0.2094,0.096,tip,,,,22.6\n"
        "P003,3,0.75,0.5,0.25,tip,1702.5519,-640.2207,790.6644,22.7\n"
    )
    assert csv_text(data, angle_unit="rad") == wanted


@pytest.mark.parametrize(
    ("table", "lines"),
    [
        (  # points of SpatialAnalyzer
            "// mm\nA::P1::s1, 1841.2, 112.8, 655.1\nA::P1::s2, 1839.0, 96.1, 602.3\n"
            "A::P2::s1, 1702.5, -640.2, 790.6\n",
            [
                'comment: "//"',
                "header: none",
                "column: 1, pattern: '[^:]*::(?P<configuration>[^:]+)::(?P<target>[^:]+)'",
                "- x: 2",
                "joints: {file: joints.csv}",
            ],
        ),
        (  # blanks, no header
            "P1 s1 1841.2 112.8 655.1\nP1 s2 1839.0 96.1 602.3\nP2 s1 1702.5 -640.2 790.6\n",
            ["delimiter: whitespace", "configuration: {column: 1}", "target_column: 2", "x: 3", "order: {by: labels}"],
        ),
        (  # a wide table with units in a line of their own
            "Pose;A1;A2;L x;L y;L z;R x;R y;R z\n;deg;deg;mm;mm;mm;mm;mm;mm\n"
            "a;10,5;2;1841,2;5;6;7;8;9\nb;1;2;4;5;6;7;8;9\n",
            ["decimal: comma", "first_row: 3", "target: l", "target: r", "length_unit: mm", "unit: deg"],
        ),
        (  # a quaternion with w first, KUKA's joints, times, expanded uncertainties
            "name,time,A1 [deg],A2 [deg],x/m,y/m,z/m,qx,qy,qz,qw,U95 [mm]\n"
            "a,2026-01-01T10:00:00,1,2,0.1,0.2,0.3,0,0,0,1,0.02\nb,2026-01-01T10:01:00,2,2,0.1,0.2,0.3,0,0.6,0,0.8,0.02\n",
            [
                "qw: qw",
                "qx: qx",
                "order: {column: time, time: iso}",
                'columns: ["U95 [mm]"], unit: mm, coverage: 2',
                'x: "x/m"',
            ],
        ),
        (  # roll, pitch, yaw and an unknown order of days and months
            "Point,J1,J2,X,Y,Z,Roll,Pitch,Yaw,Date\nk,100,2,800,2,3,10,20,30,01/02/2026 10:00:00\n"
            "l,90,2,801,2,3,10,20,30,01/03/2026 10:00:00\n",
            [
                "columns: [Roll, Pitch, Yaw], about: xyz, axes: fixed, unit: deg",
                "%d/%m/%Y %H:%M:%S would read them too",
            ],
        ),
        (  # names of UR's joints, deviations of each coordinate, a count that is no joint
            "No,base,shoulder,elbow,wrist1,wrist2,wrist3,x,y,z,sx,sy,sz\n"
            "1,90,2,3,4,5,6,800,2,3,0.01,0.01,0.01\n2,91,2,3,4,5,6,800,2,3,0.01,0.01,0.01\n",
            ["columns: [base, shoulder, elbow, wrist1, wrist2, wrist3]", "sigma: {columns: [sx, sy, sz], unit: mm}"],
        ),
        (  # Motive: names twice, below lines of other names
            "Format Version,1.23,Take Name,a\n\n,Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,"
            "Rigid Body,Rigid Body,Rigid Body\n,ID,1,1,1,1,1,1,1,1\n"
            ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error\n"
            "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,\n412,4.12,0.6,0,0,0.8,0.14,0.16,2.01,0.0001\n9,9.1,,,,,,,,\n",
            ["header: none", "first_row: 7", "x: 7", "qw: 6", "qx: 3", "order: {column: 2}", "length_unit: '?'"],
        ),
        (  # what was commanded beside what was measured; a time for each row
            "timestamp,actual_q_0,actual_q_1,target x (m),target y (m),target z (m),tracker_x [mm],tracker_y [mm],"
            "tracker_z [mm]\n2026-11-23T10:00:00Z,0.1,-1.5,0.5,0.2,0.3,1500.1,200.5,300.8\n"
            "2026-11-23T10:01:00Z,0.2,-1.4,0.5,0.2,0.3,1501.1,201.5,301.8\n",
            [
                "{each: row}",
                "- target: tip",
                'x: "tracker_x [mm]"',
                "length_unit: mm",
                "time: iso",
                "# Not used: target x",
            ],
        ),
        (  # quotes around decimal commas, KUKA's angles
            '"Pose","A1","A2","X","Y","Z","A","B","C"\n"1","10,5","-90","800,1","20","900","90","0","180"\n'
            '"2","11,5","-80","810,1","30","910","91","1","179"\n',
            ["delimiter: comma", "decimal: comma", "columns: [A, B, C], about: zyx, axes: moving, unit: deg"],
        ),
        (  # units that are part of a name
            "id,theta1(rad),theta2(rad),Xm,Ym,Zm,sigma\na,0.1,0.2,0.812,0.1,0.5,0.00002\n",
            ["length_unit: m ", "unit: rad", "sigma: {columns: [sigma], unit: m}"],
        ),
        (  # targets with numbers for names
            "p,J1,X1,Y1,Z1,X2,Y2,Z2\na,90,800,2,3,4,5,6\nb,91,800,2,3,4,5,6\n",
            ['- target: "1"', "x: X1", '- target: "2"', "x: X2"],
        ),
        (  # targets in two units
            "p,J1,L x [mm],L y [mm],L z [mm],R x [m],R y [m],R z [m]\na,90,1,2,3,4,5,6\nb,91,1,2,3,4,5,6\n",
            ["length_unit: '?'  # guess: the headings name several units"],
        ),
        (  # nothing has a name
            "1,10,20,1841.2,112.8,655.1\n2,11,20,1841.2,113.8,656.1\n",
            ["configuration: {column: 1}", "columns: [2, 3]", "x: 4"],
        ),
        (  # nominal and measured
            "id\tJ1\tJ2\tnominal x\tnominal y\tnominal z\t"
            "measured x\tmeasured y\tmeasured z\na\t90\t2\t800\t2\t3\t801\t2\t3\nb\t9\t2\t800\t2\t3\t801\t2\t3\n",
            ["delimiter: tab", "x: measured x", "# Not used: nominal x, nominal y, nominal z"],
        ),
    ],
)
def test_what_is_guessed(tmp_path: Path, table: str, lines: list[str]) -> None:
    text = guessed(tmp_path, table)
    for line in lines:
        assert line in text, text


def test_what_nothing_tells_is_asked(tmp_path: Path) -> None:
    table = "p,q1,q2,X,Y,Z,Rx,Ry,Rz\na,0.1,0.2,1.1,0.2,0.3,1,0,0\nb,0.1,0.3,1.1,0.2,0.3,1,0,0\n"
    (tmp_path / "table.csv").write_text(table)
    guess = truearm.import_guess(tmp_path / "table.csv", out=tmp_path / "map.yaml")
    assert guess.guessed.open == ("length_unit", "readings.angles", "joints.unit")
    assert guess.lines() == [
        f"Guessed 12 entries: {tmp_path / 'map.yaml'}",
        "Nothing in the file tells length_unit, readings.angles, joints.unit: answer each '?'.",
        "Nothing is imported before every guess is confirmed: look at each, then write confirmed: yes.",
    ]
    with pytest.raises(InputError, match=r"map.yaml, length_unit: this value is not known; got '\?'; allowed: mm, m"):
        truearm.import_table(tmp_path / "table.csv", tmp_path / "map.yaml")
    with pytest.raises(InputError, match="exists already and is not overwritten"):
        truearm.import_guess(tmp_path / "table.csv", out=tmp_path / "map.yaml")


def test_many_small_angles_are_radians(tmp_path: Path) -> None:
    rows = "".join(f"{n},{math.sin(n):.4f},{math.cos(n):.4f},800,1,2\n" for n in range(1, 12))
    assert "unit: rad  # guess: no angle is beyond" in guessed(tmp_path, "no,J1,J2,X,Y,Z\n" + rows)


def test_an_import_with_it_is_tried(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("p,J1,J2,X,Y,Z\na,100,2,800,2,3\nb,90,2,801,2,3\n")
    guess = truearm.import_guess(tmp_path / "a.csv")
    assert guess.lines()[1] == "An import with it would read 2 configurations, targets tip."
    assert guess.summary()["configurations"] == 2
    (tmp_path / "a.csv").write_text("p,J1,J2,X,Y,Z\na,100,2,800,2,3\na,90,2,801,2,3\nb,n/a,2,801,2,3\n")
    guess = truearm.import_guess(tmp_path / "a.csv")
    assert guess.guessed.refusal is not None
    assert "a.csv, line 4, column J1: a number belongs here; got 'n/a'" in guess.lines()[1]
    (tmp_path / "a.csv").write_text("p,X,Y,Z\na,800,2,3\nb,801,2,3\n")
    assert "No columns are called like joint positions: name" in truearm.import_guess(tmp_path / "a.csv").lines()[1]


@pytest.mark.parametrize(
    ("content", "part"),
    [
        (b"", "the file is empty"),
        (b"hello\nworld\n", "this does not look like a table"),
        (b"a,b\n1,2\n3,4\n", "no columns look like x, y and z"),
        (b"p\tX\tY\tZ\na\t1,841.22\t2.5\t3\nb\t1,702.55\t2.5\t3\n", "the column X is called like a coordinate"),
        (
            b"configuration,joint_1 [deg],target,x [mm],y [mm],z [mm]\na,1,t,1,2,3\n",
            "of the canonical CSV, which needs",
        ),
        (bytes(range(256)), "this does not look like a table"),
        (b"p,J1,X,Y\na,1,2,3\n", "no columns look like x, y and z of a measured point; got 'p, J1, X, Y'"),
    ],
)
def test_what_is_no_table_is_refused(tmp_path: Path, content: bytes, part: str) -> None:
    (tmp_path / "table.csv").write_bytes(content)
    with pytest.raises(InputError, match=re.escape(part)):
        guess_mapping(tmp_path / "table.csv")


def test_a_workbook_is_guessed_from_its_sheet_of_numbers(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    sheet = book.create_sheet("Points")
    sheet.merge_cells("A1:F1")
    sheet["A1"] = "Campaign"
    for row in (["Pose", "J1", "J2", "X", "Y", "Z"], ["P1", 90, 2, 800.5, 2, 3], ["P2", 91, 2, None, None, None]):
        sheet.append(row)
    book.save(tmp_path / "cell.xlsx")
    guess = truearm.import_guess(tmp_path / "cell.xlsx")
    assert "sheet: Points  # guess: it has the most numbers of 2 sheets" in guess.text
    assert "header: 2" in guess.text
    assert guess.lines()[1] == "An import with it would read 2 configurations, targets tip."
