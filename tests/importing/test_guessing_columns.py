"""What a guess takes columns, times and sheets for, and what it must not take for something else."""

from __future__ import annotations

import re
from datetime import date, time
from pathlib import Path
from typing import Any

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
    ("name", "cells", "entry"),
    [
        ("Uncertainty [um] (2 sigma)", "3 2 5", 'columns: ["Uncertainty [um] (2 sigma)"], unit: um, coverage: 2}'),
        ("Uncertainty (k=2) [um]", "3 2 5", "unit: um, coverage: 2}"),
        ("U (k=2)", "3 2 5", "unit: mm, coverage: 2}"),
        ("U95", "3 2 5", "unit: mm, coverage: 2}"),
        ("Std [m] of the point", "3 2 5", "unit: m}"),
        ("U [mm]", "0.03 0.02 0.05", "coverage: 2}"),
        ("u [um]", "0.03 0.02 0.05", "unit: um}"),
        ("U (mm)", "0.03 0.02 0.05", "coverage: 2}"),
        ("u [mm]", "3 200 500", ""),  # a path
        ("u [mm]", "-3 2 5", ""),
    ],
)
def test_a_deviation_keeps_its_unit(tmp_path: Path, name: str, cells: str, entry: str) -> None:
    lines = [line for line in guessed(tmp_path, name, cells.split()).splitlines() if "sigma:" in line]
    assert [entry in line for line in lines] == [True] * bool(entry)


def test_numbers_of_an_orientation_are_a_quaternion_or_asked_for(tmp_path: Path) -> None:
    text = guessed(tmp_path, "ori_x,ori_y,ori_z,ori_w", ["0,0.6,0,0.8", "0,0,0,1", "1,0,0,0"])
    assert "qw: ori_w" in text
    assert "- target: tip" in text
    assert "target: ori" not in text
    for name in ("rot_x,rot_y,rot_z", "Rotation X [deg],Rotation Y [deg],Rotation Z [deg]"):
        text = guessed(tmp_path, name, ["10,20,30", "11,21,31", "12,23,34"])
        assert "about: '?', axes: '?', unit: deg}" in text
        assert "- target: tip" in text


@pytest.mark.parametrize(
    ("first", "second", "because"),
    [
        ("J1 [mrad]", "J2 [mrad]", "the headings say mrad, in which joints are not read"),
        ("J1 [grad]", "J2 [grad]", "the headings say grad: 400 to a turn are not read"),
        ("J1 [gon]", "J2 [gon]", "the headings say gon"),
        ("J1 [mrad]", "J2 [mm]", "the headings say mrad"),
        ("J1 [grad]", "J2 [mm]", "the headings say grad"),
        ("J1", "J2 (Grad)", "the headings say Grad"),
        ("J1", "J2 [mm]", "the headings do not name one unit for all"),
    ],
)
def test_units_in_which_all_joints_cannot_be_read_are_asked_for(
    tmp_path: Path, first: str, second: str, because: str
) -> None:
    text = wide(tmp_path, f"p,{first},{second},X [in],Y,Z\na,90,2,801,2,3\nb,91,3,802,3,4\n")
    assert f"unit: '?'  # guess: {because}" in text
    assert "length_unit: in  # guess: the headings that name one" in text


def test_times_that_tell_the_order(tmp_path: Path) -> None:
    text = timed(tmp_path, "Date;Time", ["03.04.2026;09:59:30", "03.04.2026;10:00:17"])
    assert "order: {column: Time, time: '%H:%M:%S'}" in text  # one day leaves it to the times
    assert "# Not used: Date" in text
    assert 'order: {column: "t [s]"}' in timed(tmp_path, "t [s]", ["0.00", "47.25", "94.5"])
    text = timed(tmp_path, "Date;Time", ["03.04.2026;23:59:30", "04.04.2026;00:00:17"])
    assert "order: {columns: [Date, Time], time: '%d.%m.%Y %H:%M:%S'}  # guess: their names and their texts" in text


def test_a_sheet_that_cannot_be_read_is_refused_whatever_other_sheets_there_are(tmp_path: Path) -> None:
    for rows, other, cells, words in (
        (10, None, "A5:A6", "Data!A5: these cells are merged; got 'A5:A6'"),
        (18, None, "", "Data!D9: the formula has no value in the file"),
        (19, 4, "A5:A6", "these cells are merged"),
    ):
        book, sheet = book_of(rows, other)
        if cells:
            sheet.merge_cells(cells)
        else:
            sheet["D9"] = "=1000*0.1"
        book.save(tmp_path / "cell.xlsx")
        with pytest.raises(InputError, match=re.escape(words)):
            guess_mapping(tmp_path / "cell.xlsx")


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
    guess = truearm.import_guess(folder / "table.txt").guessed
    assert guess.refusal is None
    return guess.text


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
    guess = guess_mapping(tmp_path / "table.csv")
    assert "# Note: line 5101 has 7 cells where others have 6." in guess.text
    assert "# Note: line 5001, column J1: '50.5' is no number as others are written." in guess.text
    assert guess.refusal is not None
    assert "line 5101" in guess.refusal or "line 5001" in guess.refusal


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
    guess = guess_mapping(tmp_path / "table.csv")
    assert 'sigma_rot: {columns: ["sA [mrad]", "sB [mrad]", "sC [mrad]"], unit: mrad}' in guess.text
    assert 'missing: ["n.v."]' in guess.text
    assert guess.refusal is None
    assert guess.configurations == 3


@pytest.mark.parametrize("letter", ["p", "t", "T"])
def test_positions_of_one_letter_are_known_where_nothing_else_is_one(tmp_path: Path, letter: str) -> None:
    names = ",".join(letter + axis for axis in "xyz")
    (tmp_path / "table.csv").write_text(
        f"id,J1,J2,{names}\n" + "".join(f"{n},{100 + n},2,80{n},2.5,3\n" for n in (1, 2))
    )
    assert f"    x: {letter}x  # guess: its name" in guess_mapping(tmp_path / "table.csv").text
    beside = f"id,J1,J2,X,Y,Z,{names}\n" + "".join(f"{n},{100 + n},2,80{n},2.5,3,100,0,{n}\n" for n in (1, 2))
    (tmp_path / "table.csv").write_text(beside)
    guess = guess_mapping(tmp_path / "table.csv")
    assert "    x: X  # guess: its name" in guess.text
    assert f"# Not used: {letter}x" in guess.text


def timed(folder: Path, heading: str, cells: list[str]) -> str:
    """Return what is guessed of a table with numbered labels in another order than its times."""
    rows = [f"P{(5 * n) % 7};{100 + n};{20 - n};{800 + n};2;{30 + n};{cell}" for n, cell in enumerate(cells, 1)]
    (folder / "table.csv").write_text("\n".join([f"label;J1;J2;X;Y;Z;{heading}", *rows]) + "\n")
    return truearm.import_guess(folder / "table.csv").text


@pytest.mark.parametrize(
    ("times", "way"),
    [
        (["04.03.26 09:00:47", "04.03.26 09:01:47"], "'%d.%m.%y %H:%M:%S'"),
        (["04.03.2026 09:00", "04.03.2026 09:05"], "'%d.%m.%Y %H:%M'"),
        (["03-Apr-2026 23:50:00", "03-Apr-2026 23:51:00"], "'%d-%b-%Y %H:%M:%S'"),
        (["04/23/2026 11:50:00 PM", "04/23/2026 11:51:00 PM"], "'%m/%d/%Y %I:%M:%S %p'"),
        (["2026/04/23 23:50:00", "2026/04/23 23:51:00"], "'%Y/%m/%d %H:%M:%S'"),
        (["23:50:00,5", "23:51:00,5"], "'%H:%M:%S,%f'"),
        (["2026-04-23T23:50:00Z", "2026-04-23T23:51:00Z"], "iso"),
    ],
)
def test_formats_of_times(tmp_path: Path, times: list[str], way: str) -> None:
    text = timed(tmp_path, "Time", times)
    assert f"order: {{column: Time, time: {way}}}" in text
    guess = truearm.import_guess(tmp_path / "table.csv").guessed
    assert (guess.refusal, guess.configurations) == (None, 2)


@pytest.mark.parametrize(
    ("heading", "cells"),
    [
        ("Time", ["am Dienstag", "am Mittwoch"]),
        ("Date;Time", ["03/04/2026;10:00:00", "05/02/2026;10:00:00"]),
        ("Date;Time", ["03.04.2026;23:59:30", "04.04.2026;"]),
        ("Time", ["03/04/2026 10:00:00", "05/02/2026 10:00:00"]),
        ("Date", ["03.04.2026", "04.04.2026"]),
        ("t [s]", ["12.5", "3.25"]),
    ],
)
def test_times_that_do_not_tell_the_order_are_asked_for(tmp_path: Path, heading: str, cells: list[str]) -> None:
    text = timed(tmp_path, heading, cells)
    assert "order: '?'  # guess: " in text
    assert "by: labels" not in text
    assert f"# Not used: {heading.replace(';', ', ')}" in text
    assert "order" in truearm.import_guess(tmp_path / "table.csv").guessed.open


def test_days_of_a_workbook_and_its_times_are_taken_together(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["Info", "of nothing"])
    sheet = book.create_sheet("Data")
    sheet.append(["Pose", "Day", "Clock", "J1", "J2", "X", "Y", "Z"])
    for n, day in ((1, 24), (2, 23)):
        sheet.append([f"P{n}", date(2026, 11, day), time(10, n, 5), 10.5 * n, -20 - n, 1000.5, 2 * n, 3])
    book.save(tmp_path / "table.xlsx")
    guess = truearm.import_guess(tmp_path / "table.xlsx")
    assert "order: {columns: [Day, Clock], time: iso}" in guess.text
    mapping = tmp_path / "map.yaml"
    mapping.write_text(guess.text.replace("confirmed: no", "confirmed: yes").replace("unit: '?'", "unit: deg"))
    data = truearm.import_table(tmp_path / "table.xlsx", mapping).data
    assert data.number is not None
    assert data.number.tolist() == [1, 0]


def filled(sheet: Any, rows: int) -> Any:
    """Return a sheet with headings and rows of a table."""
    sheet.append(["Pos", "A1", "A2", "X", "Y", "Z"])
    for n in range(1, rows + 1):
        sheet.append([n, 10 + 7 * n, 20 - 3.5 * n, 800 + n, 200 - n, 300 + n])
    return sheet


def book_of(rows: int, other: int | None = None) -> tuple[Any, Any]:
    """Return a workbook with a table of so many rows, below a sheet of words or of another table, and its sheet."""
    book = pytest.importorskip("openpyxl").Workbook()
    if other is None:
        book.active.append(["Campaign", 2026])
    else:
        filled(book.active, other)
    return book, filled(book.create_sheet("Data"), rows)


def test_a_smaller_sheet_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    book, sheet = book_of(3, other=12)
    sheet.merge_cells("A3:A4")
    book.save(tmp_path / "cell.xlsx")
    text = truearm.import_guess(tmp_path / "cell.xlsx").text
    assert "sheet: Sheet  # guess: it has the most numbers of 2 sheets that can be read" in text
    assert "# Note: the sheet Data was not read: " in text
    assert "these cells are merged" in text


def test_numbers_that_are_texts_are_refused(tmp_path: Path) -> None:
    book = pytest.importorskip("openpyxl").Workbook()
    book.active.append(["Pos", "A1", "X", "Y", "Z"])
    for n in range(1, 5):
        book.active.append([n, f"{n},5", f"80{n},1", "2,5", "3,5"])
    book.save(tmp_path / "cell.xlsx")
    with pytest.raises(InputError, match=r"no sheet looks like a table of numbers; .*as texts"):
        guess_mapping(tmp_path / "cell.xlsx")
