"""The jobs that import files of other programs, from Python and on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests.commanding import Truearm
from tests.house.examples import EXAMPLES

import truearm as package
from truearm.engine.base.errors import InputError
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
    made = json.loads(truearm(*words, "--scale-sigma", "200", "--json").out)
    assert (made["configurations"], made["on_flange"], made["scale_sigma_ppm"]) == (2, "camera", 200.0)
    assert made["ahead_mm"] == pytest.approx(425.0)
    assert "the board's size is known to 200 ppm" in truearm(*words, "--scale-sigma", "200").out
    assert out.read_text().splitlines()[0].endswith("sigma [mm],sigma_rot [mrad],scale_sigma [ppm]")
    named = truearm(*words, "--board", "14x10,25mm,18mm,5X5_250")
    assert (named.code, "--board: a board is named" in named.err) == (2, True)


def test_a_guess_is_confirmed_and_imported(truearm: Truearm, tmp_path: Path) -> None:
    file, mapping, out = tmp_path / "cell.csv", tmp_path / "cell.yaml", tmp_path / "data.csv"
    file.write_text("Pose;J1;J2;X;Y;Z\nP001;10,5;20;800,5;2;3\nP002;11;21;n/a;n/a;n/a\n")
    made = truearm("import", "guess", file, "--out", mapping)
    assert (made.code, made.out.splitlines()[1]) == (0, "An import with it would read 2 configurations, targets tip.")
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
    made = truearm(*words, "--joints-file", joints)
    assert (made.code, made.out) == (0, f"1 configuration, targets ball: {out}\n")
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
