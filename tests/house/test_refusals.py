"""Bad input ends with exit code 2 and one message that says what, where, what came, what is allowed, the cure."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from tests.commanding import Truearm


def refused(truearm: Truearm, *words: object) -> str:
    run = truearm(*words)
    assert run.code == 2, (run.out, run.err)
    assert run.out == ""
    assert "Traceback" not in run.err
    return " ".join(run.err.split())


@pytest.fixture
def table(small: Path) -> list[str]:
    return (small / "data.csv").read_text().splitlines()


def written(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path


def with_cell(lines: list[str], line: int, column: str, text: str) -> list[str]:
    changed = lines.copy()
    cells = changed[line - 1].split(",")
    cells[lines[0].split(",").index(column)] = text
    changed[line - 1] = ",".join(cells)
    return changed


def test_unknown_robot_offers_the_nearest(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    message = refused(truearm, "calibrate", "irb12O", small / "data.csv", "--out", tmp_path / "out")
    assert "there is no such robot; got 'irb12O'" in message
    assert "Did you mean irb120" in message
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", ["show", "calibrate", "validate"])
def test_missing_files_are_named(truearm: Truearm, small: Path, tmp_path: Path, command: str) -> None:
    missing = tmp_path / "no" / "robot.yaml"
    more: dict[str, list[object]] = {
        "show": [],
        "calibrate": [small / "data.csv", "--out", tmp_path],
        "validate": [small / "data.csv"],
    }
    assert f"{missing}: there is no such file" in refused(truearm, command, missing, *more[command])


def test_a_missing_data_file_offers_its_neighbour(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    message = refused(truearm, "calibrate", "irb120", small / "dat.csv", "--out", tmp_path)
    assert "dat.csv: there is no such file" in message
    assert "Did you mean data.csv?" in message


def test_a_folder_is_no_file(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    assert "this is a folder, a file is needed" in refused(truearm, "calibrate", "irb120", small, "--out", tmp_path)
    assert "this is a folder, a file is needed" in refused(truearm, "show", small)


@pytest.mark.parametrize(
    ("line", "column", "text", "parts"),
    [
        (5, "x [mm]", "12,5", ["data.csv, line 5", "cells"]),
        (5, "x [mm]", "about 12", ["line 5, column x [mm]", "a number belongs here", "'about 12'", "Correct the cell"]),
        (7, "y [mm]", "nan", ["line 7, column y [mm]", "NaN and infinity are not readings", "Leave the cell empty"]),
        (7, "z [mm]", "-inf", ["line 7, column z [mm]", "NaN and infinity"]),
        (3, "joint_2 [deg]", "", ["line 3, column joint_2 [deg]", "the cell is empty"]),
        (1, "x [mm]", "x", ["line 1, column 9, x", "no unit is given", "mm, m, um, in", "Units are never guessed"]),
        (1, "x [mm]", "x [ft]", ["got 'ft'", "allowed: mm, m, um, in"]),
        (1, "joint_6 [deg]", "joint_7 [deg]", ["joint_6 is missing"]),
        (1, "y [mm]", "depth [mm]", ["line 1", "the column is not known", "depth [mm]"]),
        (1, "target", "targets", ["the column is not known", "Did you mean target?"]),
    ],
)
def test_a_bad_cell_is_named(
    truearm: Truearm, table: list[str], tmp_path: Path, line: int, column: str, text: str, parts: list[str]
) -> None:
    data = written(tmp_path / "data.csv", with_cell(table, line, column, text))
    message = refused(truearm, "calibrate", "irb120", data, "--out", tmp_path / "out")
    for part in parts:
        assert part in message
    assert not (tmp_path / "out").exists()


def test_the_wrong_number_of_joints(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    message = refused(truearm, "calibrate", "li3", small / "data.csv", "--out", tmp_path)
    assert "got '6 joint columns'; allowed: 3 (li3)" in message


def test_the_wrong_kind_of_joint(truearm: Truearm, table: list[str], tmp_path: Path) -> None:
    data = written(tmp_path / "data.csv", with_cell(table, 1, "joint_3 [deg]", "joint_3 [mm]"))
    message = refused(truearm, "calibrate", "irb120", data, "--out", tmp_path / "out")
    assert "column joint_3: joint 3 of irb120 is revolute" in message
    assert "allowed: deg or rad" in message


def test_an_unknown_target(truearm: Truearm, small: Path, table: list[str], tmp_path: Path) -> None:
    truearm("calibrate", "irb120", small / "data.csv", "--out", tmp_path)
    data = written(tmp_path / "new.csv", with_cell(table, 4, "target", "9"))
    message = refused(truearm, "validate", tmp_path / "calibrated.yaml", data)
    assert "irb120: the robot has no target of this name; got '9'; allowed: 1, 2, 3" in message


def test_a_target_seen_only_in_the_held_out_part(truearm: Truearm, table: list[str], tmp_path: Path) -> None:
    data = written(tmp_path / "data.csv", with_cell(table, 2, "target", "nine"))
    for seed in range(20):
        run = truearm("calibrate", "irb120", data, "--train", "20", "--seed", seed, "--out", tmp_path / "out")
        if run.code == 2:
            break
    assert "got 'nine'" in run.err
    assert "Raise --train, change --seed" in run.err


def test_a_nominal_robot_cannot_be_validated(truearm: Truearm, small: Path) -> None:
    message = refused(truearm, "validate", "irb120", small / "data.csv")
    assert "the robot has no targets" in message
    assert "calibrated.yaml" in message


@pytest.mark.parametrize("train", ["40", "41", "0", "-3"])
def test_training_must_leave_something(truearm: Truearm, small: Path, tmp_path: Path, train: str) -> None:
    message = refused(truearm, "calibrate", "irb120", small / "data.csv", f"--train={train}", "--out", tmp_path)
    assert f"--train: the number of training configurations must leave some held out; got {train}" in message
    assert "allowed: 1 to 39, or all" in message


@pytest.mark.parametrize(
    ("option", "text", "part"),
    [
        ("--train", "half", "--train: a number of configurations belongs here; got 'half'"),
        ("--model", "geometry", "there is no model of this name; got 'geometry'; allowed: frames, offsets, joints"),
        ("--loss", "hubert", "Did you mean huber?"),
        ("--redundancy", "keep", "allowed: prior, drop"),
        ("--bounds", "nowhere.yaml", "nowhere.yaml: there is no such file"),
    ],
)  # fmt: skip
def test_bad_options(truearm: Truearm, small: Path, tmp_path: Path, option: str, text: str, part: str) -> None:
    assert part in refused(truearm, "calibrate", "irb120", small / "data.csv", option, text, "--out", tmp_path)


@pytest.mark.parametrize(
    ("content", "parts"),
    [
        (
            "within: {a_33: 1}",
            ["within", "no free parameter of this model has this name", "got 'a_33'", "Did you mean a_3"],
        ),
        ("within: {a: -1}", ["within.a", "-1"]),
        ("between: {a_3: [271, 269]}", ["a_3", "the bounds leave no value"]),
        ("betwen: {a_3: [1, 2]}", ["betwen", "not known", "Did you mean between?"]),
    ],
)
def test_bad_bounds(truearm: Truearm, small: Path, tmp_path: Path, content: str, parts: list[str]) -> None:
    bounds = tmp_path / "bounds.yaml"
    bounds.write_text(f"truearm: truearm-bounds/1\nunits: {{length: mm, angle: deg}}\n{content}\n")
    message = refused(truearm, "calibrate", "irb120", small / "data.csv", "--bounds", bounds, "--out", tmp_path)
    for part in ["bounds.yaml", *parts]:
        assert part in message


def test_too_few_equations_without_priors(truearm: Truearm, table: list[str], tmp_path: Path) -> None:
    data = written(tmp_path / "data.csv", table[:16])
    message = refused(
        truearm, "calibrate", "irb120", data, "--train", "4", "--redundancy", "drop", "--out", tmp_path / "out"
    )
    assert "fewer equations than unknowns; got '36 equations for 40 unknown parameters'" in message


def test_a_single_configuration(truearm: Truearm, table: list[str], tmp_path: Path) -> None:
    data = written(tmp_path / "data.csv", table[:4])
    assert "use --train all" in refused(truearm, "calibrate", "irb120", data, "--out", tmp_path / "out")


@pytest.mark.parametrize("content", ["", "\n\n", "configuration,joint_1 [deg],target,x [mm],y [mm],z [mm]\n"])
def test_empty_data(truearm: Truearm, tmp_path: Path, content: str) -> None:
    data = tmp_path / "data.csv"
    data.write_text(content)
    assert "data.csv: the file" in refused(truearm, "calibrate", "irb120", data, "--out", tmp_path / "out")


def test_an_output_that_is_a_file(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("mine")
    message = refused(truearm, "calibrate", "irb120", small / "data.csv", "--out", tmp_path / "taken")
    assert "taken: this is a file, a folder is needed" in message
    assert (tmp_path / "taken").read_text() == "mine"


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_an_output_that_cannot_be_written(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    message = refused(truearm, "calibrate", "irb120", small / "data.csv", "--out", tmp_path / "out")
    assert "the folder cannot be written to" in message


def test_an_output_on_a_device_that_takes_nothing(truearm: Truearm, small: Path) -> None:
    if not Path("/proc/version").exists():
        pytest.skip("needs Linux's /proc, where nobody may make a folder")
    message = refused(truearm, "calibrate", "irb120", small / "data.csv", "--out", "/proc/truearm")
    assert "/proc" in message


def test_an_earlier_result_survives_a_failed_run(
    truearm: Truearm, small: Path, table: list[str], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    truearm("calibrate", "irb120", small / "data.csv", "--out", out)
    before = {p.name: p.read_bytes() for p in out.iterdir()}
    data = written(tmp_path / "data.csv", with_cell(table, 9, "x [mm]", "?"))
    refused(truearm, "calibrate", "irb120", data, "--out", out)
    assert {p.name: p.read_bytes() for p in out.iterdir()} == before


def test_a_failure_while_writing_leaves_the_earlier_result(
    truearm: Truearm, small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    truearm("calibrate", "irb120", small / "data.csv", "--out", out)
    before = {p.name: p.read_bytes() for p in out.iterdir()}
    opened = Path.open

    def full(path: Path, *words: object, **named: object) -> object:
        stream = opened(path, *words, **named)  # type: ignore[call-overload]
        if path.parent == out and sum(1 for _ in out.iterdir()) > 5:
            stream.close()
            raise OSError(28, "No space left on device", str(path))
        return stream

    monkeypatch.setattr(Path, "open", full)
    message = refused(truearm, "calibrate", "irb120", small / "data.csv", "--model", "offsets", "--out", out)
    assert "cannot be written (No space left on device)" in message
    assert {p.name: p.read_bytes() for p in out.iterdir()} == before


def test_existing_files_are_not_overwritten(truearm: Truearm, tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text("mine")
    assert "exists already" in refused(truearm, "new-robot", tmp_path / "mine.yaml")
    (tmp_path / "check.csv").write_text("mine")
    assert "check.csv: this exists already" in refused(truearm, "example", tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["check.csv", "mine.yaml"]
    assert {p.read_text() for p in tmp_path.iterdir()} == {"mine"}


def test_a_demo_does_not_overwrite_measurements(truearm: Truearm, tmp_path: Path) -> None:
    (tmp_path / "measurements.csv").write_text("mine")
    message = refused(truearm, "demo", "--out", tmp_path)
    assert "measurements.csv: this is another file of that name, and it is not overwritten" in message
    assert (tmp_path / "measurements.csv").read_text() == "mine"
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("noise", ["inf", "nan", "-1", "1e-9", "1e9"])
def test_noise_that_nothing_has(truearm: Truearm, tmp_path: Path, noise: str) -> None:
    words = ["--truth", "nominal", "--poses", 5, f"--noise={noise}", "--out", tmp_path / "x.csv"]
    assert "--noise" in refused(truearm, "simulate", "irb120", *words)
    assert not (tmp_path / "x.csv").exists()


@pytest.mark.parametrize("text", ["", "  "])
def test_no_robot_at_all(truearm: Truearm, text: str) -> None:
    assert "ROBOT: no robot is given" in refused(truearm, "show", text)


LONG = "a" * 300


def test_names_that_no_file_system_takes(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    simulated = ["simulate", "irb120", "--truth", "nominal", "--poses", 5, "--noise", 0, "--out"]
    assert "there is no such robot" in refused(truearm, "show", LONG)
    assert "irb120 has no truth of this name" in refused(
        truearm, "simulate", "irb120", "--truth", LONG, *simulated[4:], tmp_path / "x.csv"
    )
    for words in (
        ["show", f"{LONG}.yaml"],
        ["show", f"{LONG}.urdf"],
        ["check", tmp_path / LONG],
        ["calibrate", "irb120", small / "data.csv", "--out", tmp_path / LONG],
        ["calibrate", "irb120", small / "data.csv", "--out", tmp_path / LONG / "below"],
        ["demo", "--out", tmp_path / LONG],
        ["example", tmp_path / LONG],
        ["new-robot", tmp_path / LONG],
        [*simulated, tmp_path / LONG],
    ):
        assert "File name too long" in refused(truearm, *words)


def test_links_that_lead_nowhere(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to("nowhere.csv")
    for words in (
        ["check", link],
        ["calibrate", "irb120", small / "data.csv", "--out", link],
        ["calibrate", "irb120", small / "data.csv", "--out", link / "below"],
        ["simulate", "irb120", "--truth", "nominal", "--poses", 5, "--noise", 0, "--out", link],
        ["example", link],
        ["new-robot", link],
    ):
        message = refused(truearm, *words)
        assert f"{link}: this is a link, and there is nothing where it points to; got 'nowhere.csv'" in message
    assert link.is_symlink()


def test_an_output_that_is_an_input(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    files = {
        "joints.txt": "1 2\n3 4\n",
        "a.txt": "1 2 3\n4 5 6\n",
        "b.txt": "1 2 3\n4 5 7\n",
        "table.csv": "P,X,Y,Z\na,1,2,3\n",
        "joints.csv": "P,q\na,1\n",
        "map.yaml": "truearm: truearm-mapping/1\nconfiguration: {column: P}\nlength_unit: mm\n"
        "readings: [{target: t, x: X, y: Y, z: Z}]\n"
        "joints: {file: joints.csv, key: P, columns: [q], unit: deg}\n",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "link").symlink_to("joints.txt")
    matrices = [
        "import",
        "matrices",
        "--angle-unit",
        "deg",
        "--length-unit",
        "mm",
        "--joints-file",
        tmp_path / "joints.txt",
    ]
    matrices += ["--target", f"a={tmp_path / 'a.txt'}", "--reference", f"b={tmp_path / 'b.txt'}", "--out"]
    table = ["import", "table", tmp_path / "table.csv", "--map", tmp_path / "map.yaml", "--out"]
    for words, names in ((matrices, ("joints.txt", "a.txt", "b.txt", "link")), (table, [*files][3:])):
        for name in names:
            out = tmp_path / ".." / tmp_path.name / name
            assert f"{name}: this file is read, and would be overwritten" in refused(truearm, *words, out)
        assert truearm(*words, tmp_path / "new.csv").code == 0
    assert {name: (tmp_path / name).read_text() for name in files} == files
    truearm("new-robot", tmp_path / "r.yaml")
    words = ["--poses", 5, "--noise", 0, "--out", tmp_path / "r.yaml"]
    assert "would be overwritten" in refused(truearm, "simulate", tmp_path / "r.yaml", "--truth", "nominal", *words)


def test_unknown_truth(truearm: Truearm, tmp_path: Path) -> None:
    words = ["--poses", 5, "--noise", 0.1, "--out", tmp_path / "x.csv"]
    message = refused(truearm, "simulate", "irb120", "--truth", "tracker-triangle", *words)
    assert "Did you mean tracker-triangular" in message
    message = refused(truearm, "simulate", "irb120", "--truth", "li3.yaml", *words)
    assert "li3.yaml: there is no such file" in message
    assert not (tmp_path / "x.csv").exists()


def test_a_truth_of_another_robot(truearm: Truearm, tmp_path: Path) -> None:
    from truearm.engine.robot.library import load_robot
    from truearm.engine.robot.robot_file.writing import robot_text

    (tmp_path / "li3.yaml").write_text(robot_text(load_robot("li3")))
    message = refused(
        truearm, "simulate", "irb120", "--truth", tmp_path / "li3.yaml", "--poses", 5, "--noise", 0, "--out",
        tmp_path / "x.csv",
    )  # fmt: skip
    assert "other joints than irb120; got '3 joints'; allowed: 6" in message


@pytest.mark.parametrize("entry", ["1", "1=", "=file.txt"])
def test_import_names_its_targets(truearm: Truearm, tmp_path: Path, entry: str) -> None:
    message = refused(
        truearm, "import", "matrices", "--joints-file", "j.txt", "--target", entry, "--angle-unit", "deg",
        "--length-unit", "mm", "--out", tmp_path / "x.csv",
    )  # fmt: skip
    assert f"--target: a name and a file belong here; got '{entry}'; allowed: NAME=FILE" in message


def test_urdf_with_a_loop(truearm: Truearm, tmp_path: Path) -> None:
    joint = (
        '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    )
    links = "".join(f'<link name="{n}"/>' for n in "abc")
    looped = joint.format("j1", "a", "b") + joint.format("j2", "b", "c") + joint.format("j3", "c", "a")
    (tmp_path / "loop.urdf").write_text(f'<robot name="r">{links}{looped}</robot>')
    assert "loop.urdf" in refused(truearm, "show", tmp_path / "loop.urdf")
    (tmp_path / "still.urdf").write_text('<robot name="r"><link name="a"/></robot>')
    assert "still.urdf" in refused(truearm, "show", tmp_path / "still.urdf")


def test_a_number_written_with_an_exponent_is_a_number(truearm: Truearm, tmp_path: Path) -> None:
    truearm("new-robot", tmp_path / "r.yaml")
    text = (tmp_path / "r.yaml").read_text()
    assert "a: 25," in text
    (tmp_path / "e.yaml").write_text(text.replace("a: 25,", "a: 25e0,").replace("d: 80,", "d: 8e1,"))
    import json

    shown = json.loads(truearm("show", tmp_path / "e.yaml", "--json").out)
    assert shown["joints"][1]["values"]["a_2"] == 25
    assert shown["joints"][5]["values"]["d_6"] == 80


def test_convert_overwrites_nothing_and_knows_its_conventions(truearm: Truearm, tmp_path: Path) -> None:
    out = tmp_path / "mine.yaml"
    out.write_text("mine")
    assert "exists already" in refused(truearm, "convert", "ur5", "--convention", "cpc", "--out", out)
    assert out.read_text() == "mine"
    message = refused(truearm, "convert", "ur5", "--convention", "dh", "--out", tmp_path / "dh.yaml")
    assert "--convention: there is no convention of this name; got 'dh'; allowed: standard-dh, modified-dh" in message


def test_a_calibration_does_not_overwrite_what_it_reads(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    truearm("calibrate", "irb120", small / "data.csv", "--out", tmp_path)
    before = (tmp_path / "calibrated.yaml").read_bytes()
    message = refused(truearm, "calibrate", tmp_path / "calibrated.yaml", small / "data.csv", "--out", tmp_path)
    assert "this file is read, and would be overwritten" in message
    assert (tmp_path / "calibrated.yaml").read_bytes() == before
