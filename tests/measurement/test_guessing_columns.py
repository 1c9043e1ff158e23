"""Columns that a guess must not take for something else: speeds, voltages, orientations, nominal positions."""

from __future__ import annotations

from pathlib import Path

import pytest

import truearm


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
        *("v_x,v_y,v_z", "A_x [mm/s],A_y [mm/s],A_z [mm/s]", "X_nom,Y_nom,Z_nom"),
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
