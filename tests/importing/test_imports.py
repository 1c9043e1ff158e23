"""The jobs that import files of other programs, from Python and on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tests.commanding import Truearm
from tests.house.examples import EXAMPLES

import truearm as package
from truearm.engine.base.errors import InputError
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.engine.data.readers.presets import PRESETS


def test_sockets(truearm: Truearm, tmp_path: Path) -> None:
    file, out = EXAMPLES["import_sockets"](tmp_path)["file"], tmp_path / "data.csv"
    words = ("import", "sockets", file, "--apart", "200mm,0.02mm", "--sigma", "0.02", "--out", out)
    refused = truearm(*words, "--ball", "25")
    assert (refused.code, "--ball: no unit that fits is given; got '25'" in refused.err) == (2, True)
    assert not out.exists()
    assert truearm(*words, "--ball", "25mm").out == f"3 configurations, targets ball: {out}\n"
    assert ",right,fixture,left,,,,200.0,0.02\n" in out.read_text()


def test_hand_eye(truearm: Truearm, tmp_path: Path) -> None:
    file, out = EXAMPLES["import_hand_eye"](tmp_path)["file"], tmp_path / "data.csv"
    words = ("import", "hand-eye", file, "--on-flange", "camera", "--out", out)
    summary = json.loads(truearm(*words, "--scale-sigma", "200", "--json").out)
    assert (summary["configurations"], summary["on_flange"], summary["scale_sigma_ppm"]) == (2, "camera", 200.0)
    assert summary["ahead_mm"] == pytest.approx(425.0)
    assert "the board's size is known to 200 ppm" in truearm(*words, "--scale-sigma", "200").out
    assert out.read_text().splitlines()[0].endswith("sigma [mm],sigma_rot [mrad],scale_sigma [ppm]")
    named = truearm(*words, "--board", "14x10,25mm,18mm,5X5_250")
    assert (named.code, "--board: a board is named" in named.err) == (2, True)


def test_a_guess_is_confirmed_and_imported(truearm: Truearm, tmp_path: Path) -> None:
    file, mapping, out = tmp_path / "cell.csv", tmp_path / "cell.yaml", tmp_path / "data.csv"
    file.write_text("Pose;J1;J2;X;Y;Z\nP001;10,5;20;800,5;2;3\nP002;11;21;n/a;n/a;n/a\n")
    run = truearm("import", "guess", file, "--out", mapping)
    assert (run.code, run.out.splitlines()[1]) == (0, "An import with it would read 2 configurations, targets tip.")
    assert json.loads(truearm("import", "guess", file, "--out", tmp_path / "b.yaml", "--json").out)["open"] == []
    refused = truearm("import", "table", file, "--map", mapping, "--out", out)
    assert (refused.code, "cell.yaml, confirmed: " in refused.err) == (2, True)
    assert "nobody has confirmed it" in refused.err
    assert not out.exists()
    mapping.write_text(mapping.read_text().replace("confirmed: no", "confirmed: yes"))
    assert truearm("import", "table", file, "--map", mapping, "--out", out).code == 0
    assert out.read_text().splitlines()[1] == "P001,1,10.5,20.0,tip,800.5,2.0,3.0"
    again = truearm("import", "guess", file, "--out", mapping)
    assert (again.code, "exists already and is not overwritten" in again.err) == (2, True)


def test_presets_and_another_file_of_joints(truearm: Truearm, tmp_path: Path) -> None:
    points, joints, out = tmp_path / "points.txt", tmp_path / "driven.csv", tmp_path / "data.csv"
    points.write_text("A, P1, ball, 1, 2, 3, 0.1, 0.1, 0.1, 01/31/2026 10:00:00\n")
    joints.write_text("configuration,joint_1 [deg]\nP1,10\n")
    words = ("import", "table", points, "--map", "spatial-analyzer", "--out", out)
    run = truearm(*words, "--joints-file", joints)
    assert (run.code, run.out) == (0, f"1 configuration, targets ball: {out}\n")
    missing = truearm(*words)
    assert (missing.code, "joints.csv: there is no such file" in missing.err) == (2, True)
    typo = truearm("import", "table", points, "--map", "spatial-analyser", "--out", out)
    assert (typo.code, "--map: there is no such file, and no such preset" in typo.err) == (2, True)
    assert "Did you mean spatial-analyzer?" in typo.err
    shown = " ".join(truearm("import", "table", "--help").out.split())
    assert all(preset in shown for preset in PRESETS)


def test_matrices_and_what_is_missing(tmp_path: Path) -> None:
    arguments = EXAMPLES["import_matrices"](tmp_path)
    read = package.import_matrices(**arguments, out=tmp_path / "data.csv")
    assert read.lines() == [
        f"2 configurations, targets 1: {tmp_path / 'data.csv'}",
        "  1: 1 missing reading",
        "  base: 1 missing reading",
    ]
    assert package.load_data(tmp_path / "data.csv").configurations == 2
    with pytest.raises(InputError, match="would be overwritten") as refusal:
        package.import_matrices(**arguments, out=arguments["joints_file"])
    assert refusal.value.parameter == "out"


def test_a_table_is_not_written_over_its_mapping(tmp_path: Path) -> None:
    arguments = EXAMPLES["import_table"](tmp_path)
    assert package.import_table(**arguments).lines() == ["2 configurations, targets tip"]
    with pytest.raises(InputError, match="would be overwritten"):
        package.import_table(**arguments, out=arguments["mapping"])


def test_circles_need_a_scan_and_a_table_each(tmp_path: Path) -> None:
    arguments = EXAMPLES["import_circle"](tmp_path)
    read = package.import_circle(**arguments)
    assert read.lines() == ["2 configurations on 1 page"]
    assert read.data.sigma is not None
    for name, words in (("points", "got 'nothing for a'"), ("scans", "no page is given")):
        with pytest.raises(InputError, match=words) as refusal:
            package.import_circle(**{**arguments, name: {}})
        assert refusal.value.parameter == name
    for dpi in (0.0, [300.0, 5.0]):
        with pytest.raises(InputError, match="this is no resolution of a scan") as refusal:
            package.import_circle(**{**arguments, "dpi": dpi})
        assert refusal.value.parameter == "dpi"


ROWS = "configuration,joint_1 [deg],joint_2 [deg],socket\n1,10,20,left\n2,12,22,right\n3,15,25,left\n"


def touches(folder: Path, text: str = ROWS) -> Path:
    path = folder / "touches.csv"
    path.write_text(text)
    return path


def test_joints_and_sockets_become_readings_at_two_points(tmp_path: Path) -> None:
    out = tmp_path / "data.csv"
    imported = package.import_sockets(touches(tmp_path), apart="200mm,0.02mm", ball="25mm", sigma=3e-5, out=out)
    data = imported.data
    assert imported.lines() == [f"3 configurations, targets ball: {out}"]
    assert data.fixtures == ("left", "right")
    assert data.against.tolist() == [0, 1, 0]
    assert not data.position.any()
    assert data.sigma is not None
    assert data.sigma.tolist() == [3e-5] * 3
    assert data.number is not None
    assert data.number.tolist() == [0, 1, 2]
    assert data.setup is not None
    assert data.setup.distance is not None
    assert data.setup.sigma is not None
    assert (data.setup.targets, data.setup.distance.tolist(), data.setup.sigma.tolist()) == (("right",), [0.2], [2e-5])
    again = read_csv(out)
    assert csv_text(again) == out.read_text() == csv_text(data)
    np.testing.assert_allclose(again.joints, np.radians([[10, 20], [12, 22], [15, 25]]), rtol=0, atol=1e-15)


def test_numbers_and_texts_mean_the_same(tmp_path: Path) -> None:
    data = package.import_sockets(touches(tmp_path), apart=(0.2, 2e-5), ball=0.025).data
    other = package.import_sockets(touches(tmp_path), apart="20e-2 m, 20um", ball="25mm").data
    assert csv_text(data) == csv_text(other)
    assert data.sigma is None


def test_joint_positions_of_the_controller_stay_the_controllers(tmp_path: Path) -> None:
    path = touches(tmp_path, ROWS.replace("joint_", "axis_"))
    assert package.import_sockets(path, apart="200mm,0.02mm", ball="25mm").data.joints_are == "controller"


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("apart", "20mm,0.02mm", r"run into each other; got '20 mm'; allowed: 25 mm, the diameter of the ball"),
        ("apart", "200,0.02", r"no unit that fits is given; got '200'; allowed: 200mm or .*write 200mm,0\.02mm"),
        ("apart", "200mm,0.02", r"no unit that fits is given; got '0\.02'"),
        ("apart", "200mm", r"a distance and its standard deviation belong here; got '200mm'; allowed: 200mm,0\.02mm"),
        ("apart", "200mm,0mm", r"the number is too small to be plausible"),
        ("apart", "200mm,500mm", r"hardly known.*got '200 mm with a standard deviation of 500 mm'.*up to 10%"),
        ("apart", (0.2, 0.021), r"hardly known"),
        ("apart", "far,0.02mm", r"a number with its unit belongs here; got 'far'"),
        ("apart", [0.2], r"2 numbers belong here; got 1"),
        ("apart", (0.2, -1e-5), r"the number is too small to be plausible"),
        ("ball", "25", r"no unit that fits is given; got '25'; allowed: 25mm"),
        ("ball", 0.0, r"the ball has no size; got '0 mm'; allowed: above 0 mm"),
        ("ball", "-3mm", r"the ball has no size"),
    ],
)
def test_what_sockets_cannot_be_is_refused(tmp_path: Path, name: str, value: object, words: str) -> None:
    arguments: dict[str, object] = {"apart": "200mm,0.02mm", "ball": "25mm", name: value}
    with pytest.raises(InputError, match=words) as refusal:
        package.import_sockets(touches(tmp_path), **arguments)  # type: ignore[arg-type]
    assert refusal.value.parameter == name


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (ROWS.replace("right", "left"), r"column socket: two sockets are needed: .*; got '1: left'.*both sockets"),
        (ROWS + "4,16,26,third\n", r"got '3: left, right, third'; allowed: two names"),
        (ROWS.replace(",socket", ",cup"), r"line 1, column 4: the column is not known; got 'cup'"),
        (ROWS.replace(",socket", ",").replace("2 [deg],", "2 [deg],"), r"the column has no name"),
        (ROWS.replace(",socket", ",configuration"), r"the column configuration appears twice"),
        (ROWS.replace("joint_1 [deg]", "joint_1"), r"no unit is given; allowed: deg, rad"),
        (ROWS.replace("configuration", "configuration [m]"), r"this column takes no unit"),
        ("configuration,joint_1 [deg]\n1,10\n", r"the column socket is missing; .*Add socket\."),
        (
            ROWS.replace("joint_1 [deg],", "").replace(",20", "").replace(",22", "").replace(",25", ""),
            r"joint_1 is mis",
        ),
        (ROWS + "1,10,20,right\n", r"lines 2 and 5: the configuration '1' appears twice.*a label of its own"),
        (ROWS + "4,16,,right\n", r"line 5, column joint_2 \[deg\]: the cell is empty"),
        (ROWS.replace(",", ";"), r"the columns are not separated by commas; got 'semicolons'"),
    ],
)
def test_a_table_that_does_not_fit_is_refused(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as refusal:
        package.import_sockets(touches(tmp_path, text), apart="200mm,0.02mm", ball="25mm")
    assert refusal.value.parameter == "file"
