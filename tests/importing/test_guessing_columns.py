"""Columns that a guess must not take for something else: speeds, voltages, orientations, nominal positions."""

from __future__ import annotations

from pathlib import Path

import pytest

import truearm
from truearm.engine.base.errors import InputError
from truearm.importing.guess import guess_mapping


def guessed(folder: Path, more: str, cells: list[str], name: str = "label") -> str:
    """Return what is guessed of a table with joints, X, Y, Z and further columns with these cells."""
    rows = [f"{n},{100 + n},{20 - n},{800 + n},2,{30 + n},{cell}" for n, cell in enumerate(cells, 1)]
    (folder / "table.csv").write_text("\n".join([f"{name},J1,J2,X,Y,Z,{more}", *rows]) + "\n")
    return truearm.import_guess(folder / "table.csv").text


@pytest.mark.parametrize("name", ["s", "S", "t", "U", "U [V]", "speed [mm/s]", "sigma [N]", "v (mm/s)", "std [deg]"])
def test_a_column_that_is_no_length_is_no_deviation(tmp_path: Path, name: str) -> None:
    text = guessed(tmp_path, name, ["3", "2", "5"])
    assert "sigma:" not in text
    assert f"# Not used: {name}" in text


@pytest.mark.parametrize(
    ("name", "entry"),
    [
        ("Uncertainty [um] (2 sigma)", 'columns: ["Uncertainty [um] (2 sigma)"], unit: um, coverage: 2}'),
        ("Uncertainty (k=2) [um]", "unit: um, coverage: 2}"),
        ("U (k=2)", "unit: mm, coverage: 2}"),
        ("U95", "unit: mm, coverage: 2}"),
        ("Std [m] of the point", "unit: m}"),
    ],
)
def test_a_deviation_keeps_its_unit(tmp_path: Path, name: str, entry: str) -> None:
    assert entry in guessed(tmp_path, name, ["3", "2", "5"])


def test_four_numbers_of_an_orientation_are_a_quaternion(tmp_path: Path) -> None:
    text = guessed(tmp_path, "ori_x,ori_y,ori_z,ori_w", ["0,0.6,0,0.8", "0,0,0,1", "1,0,0,0"])
    assert "qw: ori_w" in text
    assert "- target: tip" in text
    assert "target: ori" not in text


@pytest.mark.parametrize("name", ["rot_x,rot_y,rot_z", "Rotation X [deg],Rotation Y [deg],Rotation Z [deg]"])
def test_three_numbers_of_an_orientation_are_asked_for(tmp_path: Path, name: str) -> None:
    text = guessed(tmp_path, name, ["10,20,30", "11,21,31", "12,23,34"])
    assert "about: '?', axes: '?', unit: deg}" in text
    assert "- target: tip" in text


@pytest.mark.parametrize(
    "name",
    [
        *("dX,dY,dZ", "delta x,delta y,delta z", "dev_x,dev_y,dev_z", "nom_x,nom_y,nom_z", "cmd_x,cmd_y,cmd_z"),
        *("Xnom,Ynom,Znom", "v_x,v_y,v_z", "A_x [mm/s],A_y [mm/s],A_z [mm/s]", "X_nom,Y_nom,Z_nom"),
    ],
)
def test_what_is_no_measured_position_is_no_target(tmp_path: Path, name: str) -> None:
    text = guessed(tmp_path, name, ["1,2,3", "2,2,4", "3,5,3"])
    assert "- target: tip" in text
    assert "x: X " in text
    assert f"# Not used: {name.split(',')[0]}" in text


def test_what_was_measured_comes_before_what_is_shown(tmp_path: Path) -> None:
    text = guessed(tmp_path, "meas_x,meas_y,meas_z", ["801,2,31", "802,2,32", "803,2,33"])
    assert "x: meas_x" in text
    assert "# Not used: X, Y, Z" in text
    names = "nom_x,nom_y,nom_z,act_x,act_y,act_z"
    (tmp_path / "table.csv").write_text(f"p,J1,{names}\na,90,800,2,3,801,2,3\nb,91,800,2,4,801,2,4\n")
    text = truearm.import_guess(tmp_path / "table.csv").text
    assert "x: act_x" in text
    assert "# Not used: nom_x, nom_y, nom_z" in text


def wide(folder: Path, text: str) -> str:
    """Return what is guessed of a table."""
    (folder / "table.txt").write_text(text)
    made = truearm.import_guess(folder / "table.txt").guessed
    assert made.refusal is None
    return made.text


@pytest.mark.parametrize("number", ["-999", "0", "-999.000"])
def test_a_reading_of_one_number_is_none(tmp_path: Path, number: str) -> None:
    rows = f"a,90,80.5,1.5,3\nb,91,{number},{number},{number}\nc,92,81.5,2.5,3\n"
    text = wide(tmp_path, "p,J1,X,Y,Z\n" + rows)
    assert f'missing: ["{number}"]  # guess: rows have {number} in all of x, y and z' in text


def test_a_reading_of_zeros_is_asked_for_where_zeros_are_coordinates(tmp_path: Path) -> None:
    text = wide(tmp_path, "p,J1,X,Y,Z\na,90,80.5,0,3\nb,91,0,0,0\nc,92,81.5,2.5,3\n")
    assert "missing: '?'  # guess: rows of 0 in all of x, y and z seem to be no readings" in text


def test_a_number_for_no_reading_may_fill_the_whole_row(tmp_path: Path) -> None:
    text = wide(tmp_path, "p,J1,X,Y,Z,A,B,C\na,90,80,1,3,1,2,3\nb,91,-9,-9,-9,-9,-9,-9\nc,92,81,2,3,10,20,30\n")
    assert 'missing: ["-9"]' in text


def test_a_column_without_a_heading_goes_by_its_number(tmp_path: Path) -> None:
    text = wide(tmp_path, "Point\tMeasured\t\t\tJoints\n\tX\tY\tZ\tJ1\n1\t801\t2\t3\t90\n2\t802\t3\t4\t91\n")
    assert "header: none  # guess: line 2 leaves a column without a name" in text
    assert "configuration: {column: 1}" in text
    assert "columns: [5]" in text


@pytest.mark.parametrize("names", [["Cell::Grp 01::T1", "Cell::Grp 02::T1"], ["A::P1::T 1", "A::P1::T 2"]])
def test_names_with_blanks_between_blanks_are_refused(tmp_path: Path, names: list[str]) -> None:
    (tmp_path / "table.txt").write_text("".join(f"{name} 906.8 22{n}.5 1151.4\n" for n, name in enumerate(names)))
    with pytest.raises(InputError, match=f"a name with blanks seems to stand.*{names[0]}.*Export the table again"):
        guess_mapping(tmp_path / "table.txt")
    text = wide(tmp_path, "".join(f"{name},906.8,22{n}.5,1151.4\n" for n, name in enumerate(names)))
    assert "names: {column: 1" in text


@pytest.mark.parametrize(
    ("unit", "because"),
    [
        ("mrad", "the headings say mrad, in which joints are not read"),
        ("grad", "the headings say grad: 400 to a turn are not read"),
        ("gon", "the headings say gon"),
    ],
)
def test_units_in_which_joints_are_not_read_are_asked_for(tmp_path: Path, unit: str, because: str) -> None:
    text = wide(tmp_path, f"p,J1 [{unit}],J2 [{unit}],X,Y,Z\na,90,2,801,2,3\nb,91,3,802,3,4\n")
    assert f"unit: '?'  # guess: {because}" in text


@pytest.mark.parametrize(
    ("first", "second", "because"),
    [
        ("J1 [mrad]", "J2 [mm]", "the headings say mrad"),
        ("J1 [grad]", "J2 [mm]", "the headings say grad"),
        ("J1", "J2 (Grad)", "the headings say Grad"),
        ("J1", "J2 [mm]", "the headings do not name one unit for all"),
    ],
)
def test_a_unit_of_some_joints_is_not_that_of_all(tmp_path: Path, first: str, second: str, because: str) -> None:
    text = wide(tmp_path, f"p,{first},{second},X [in],Y,Z\na,90,2,801,2,3\nb,91,3,802,3,4\n")
    assert f"unit: '?'  # guess: {because}" in text
    assert "length_unit: in  # guess: the headings that name one" in text


def test_joints_that_were_reached_come_before_those_that_were_commanded(tmp_path: Path) -> None:
    text = wide(tmp_path, "p,J1_cmd,J2_cmd,J1_act,J2_act,X,Y,Z\na,90,2,90.1,2.1,801,2,3\nb,91,3,91.1,3.1,802,3,4\n")
    assert "columns: [J1_act, J2_act]" in text
    assert "# Not used: J1_cmd, J2_cmd" in text


def test_letters_of_targets_may_be_those_of_differences(tmp_path: Path) -> None:
    names = ",".join(f"{target}_{axis}" for target in "ABCD" for axis in "xyz")
    rows = "a,90,1,2,3,4,5,6,7,8,9,10,11,12\nb,91,1,2,3,4,5,6,7,8,9,10,11,12\n"
    (tmp_path / "table.txt").write_text(f"p,J1,{names}\n{rows}")
    text = truearm.import_guess(tmp_path / "table.txt").text
    assert all(f"- target: {target}" in text for target in "abcd")


def test_directions_and_columns_of_no_clear_target_are_not_used(tmp_path: Path) -> None:
    names = "n_x,n_y,n_z,std x,std y,std z"
    text = wide(tmp_path, f"p,J1,X,Y,Z,{names}\na,90,80,1,3,1,0,0,1,2,3\nb,91,81,1,4,0,1,0,1,2,3\n")
    assert "# Not used: n_x, n_y, n_z" in text
    assert "sigma: {columns: [std x, std y, std z]" in text
    names = "X2,Y2,Z2,std x,std y,std z"
    text = wide(tmp_path, f"p,J1,X,Y,Z,{names}\na,90,80,1,3,10,0,0,1,2,3\nb,91,81,1,4,0,10,0,1,2,3\n")
    assert "which target they are of is not clear" in text
    assert "# Not used: std x, std y, std z" in text


@pytest.mark.parametrize(
    ("name", "entry"),
    [("U [mm]", "coverage: 2}"), ("u [um]", "unit: um}"), ("U (mm)", "coverage: 2}")],
)
def test_an_uncertainty_alone_is_told_by_its_unit(tmp_path: Path, name: str, entry: str) -> None:
    (line,) = [line for line in guessed(tmp_path, name, ["0.03", "0.02", "0.05"]).splitlines() if "sigma:" in line]
    assert entry in line


def test_a_path_in_millimetres_is_no_uncertainty(tmp_path: Path) -> None:
    assert "sigma:" not in guessed(tmp_path, "u [mm]", ["3", "200", "500"])
    assert "sigma:" not in guessed(tmp_path, "u [mm]", ["-3", "2", "5"])


def test_visits_are_guessed_where_labels_come_again(tmp_path: Path) -> None:
    rows = ["Pose,J1,J2,X,Y,Z,Round"]
    rows += [f"P{n},{10 * n},{20 * n},100{n},200,30{n}.{k},{k}" for n in (1, 2, 3) for k in (1, 2)]
    (tmp_path / "table.csv").write_text("\n".join(rows) + "\n")
    assert "visit: {column: Round}" in guess_mapping(tmp_path / "table.csv").text
    (tmp_path / "table.csv").write_text("\n".join(rows[:2] + rows[3:4]) + "\n")
    assert "visit:" not in guess_mapping(tmp_path / "table.csv").text


def test_a_change_of_form_far_below_is_found(tmp_path: Path) -> None:
    rows = ["Pose;J1;J2;X;Y;Z"] + [f"P{n};{n % 90},5;{n % 80},25;1000,5;{n % 700},25;30,5" for n in range(1, 5200)]
    rows[5000] = rows[5000].replace(",", ".")
    rows[5100] += ";7"
    (tmp_path / "table.csv").write_text("\n".join(rows) + "\n")
    made = guess_mapping(tmp_path / "table.csv")
    assert "# Note: line 5101 has 7 cells where others have 6." in made.text
    assert "# Note: line 5001, column J1: '50.5' is no number as others are written." in made.text
    assert made.refusal is not None
    assert "line 5101" in made.refusal or "line 5001" in made.refusal


def test_a_guess_says_if_it_has_not_seen_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = ["Pose,J1,J2,X,Y,Z"] + [f"P{n},{n},{2 * n},1000,{n},30" for n in range(1, 500)]
    (tmp_path / "table.csv").write_text("\n".join(rows) + "\n")
    assert "looked at" not in guess_mapping(tmp_path / "table.csv").text
    monkeypatch.setattr("truearm.importing.layouts._MOST_LINES", 450)
    assert "# Note: only the first 450 lines were looked at" in guess_mapping(tmp_path / "table.csv").text


def test_deviations_are_named_like_the_angles_beside_them(tmp_path: Path) -> None:
    head = "label;J1;J2;X;Y;Z;A [rad];B [rad];C [rad];sA [mrad];sB [mrad];sC [mrad]"
    rows = [f"M{n};{100 + n};2{n};80{n};2,5;3{n};0,1;0,2;0,{n};0,1;0,1;0,3" for n in (1, 2)]
    rows.append("M3;103;23" + ";n.v." * 6 + ";" * 3)
    (tmp_path / "table.csv").write_text("\n".join([head, *rows]) + "\n")
    made = guess_mapping(tmp_path / "table.csv")
    assert 'sigma_rot: {columns: ["sA [mrad]", "sB [mrad]", "sC [mrad]"], unit: mrad}' in made.text
    assert 'missing: ["n.v."]' in made.text
    assert made.refusal is None
    assert made.configurations == 3


@pytest.mark.parametrize("letter", ["p", "t", "T"])
def test_positions_of_one_letter_are_known_where_nothing_else_is_one(tmp_path: Path, letter: str) -> None:
    names = ",".join(letter + axis for axis in "xyz")
    (tmp_path / "table.csv").write_text(
        f"id,J1,J2,{names}\n" + "".join(f"{n},{100 + n},2,80{n},2.5,3\n" for n in (1, 2))
    )
    assert f"    x: {letter}x  # guess: its name" in guess_mapping(tmp_path / "table.csv").text
    beside = f"id,J1,J2,X,Y,Z,{names}\n" + "".join(f"{n},{100 + n},2,80{n},2.5,3,100,0,{n}\n" for n in (1, 2))
    (tmp_path / "table.csv").write_text(beside)
    made = guess_mapping(tmp_path / "table.csv")
    assert "    x: X  # guess: its name" in made.text
    assert f"# Not used: {letter}x" in made.text
