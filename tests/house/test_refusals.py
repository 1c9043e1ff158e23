"""Bad input ends with exit code 2 and one message that says what, where, what came, what is allowed, the cure."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.commanding import Truearm

from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot_file.writing import robot_text


def refused(truearm: Truearm, *words: object) -> str:
    run = truearm(*words)
    assert run.code == 2, (run.out, run.err)
    assert run.out == ""
    assert "Traceback" not in run.err
    return " ".join(run.err.split())


@pytest.fixture
def table(small: Path) -> list[str]:
    return (small / "data.csv").read_text().splitlines()


@pytest.fixture
def told(truearm: Truearm, small: Path, tmp_path: Path) -> Callable[..., str]:
    """What is said of a calibration that is refused; of a table of lines, or of the measurements as they are."""

    def call(data: Path | list[str], *words: object, robot: object = "irb120") -> str:
        file = data if isinstance(data, Path) else written(tmp_path / "data.csv", data)
        message = refused(truearm, "calibrate", robot, file, *words, "--out", tmp_path / "out", "--model=geometric")
        assert not (tmp_path / "out").exists()
        return message

    return call


def written(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path


def with_cell(lines: list[str], line: int, column: str, text: str) -> list[str]:
    changed = lines.copy()
    cells = changed[line - 1].split(",")
    cells[lines[0].split(",").index(column)] = text
    changed[line - 1] = ",".join(cells)
    return changed


def test_files_and_robots_that_are_not_there(
    truearm: Truearm, told: Callable[..., str], small: Path, tmp_path: Path
) -> None:
    message = told(small / "data.csv", robot="irb12O")
    assert "there is no such robot; got 'irb12O'" in message
    assert "Did you mean irb120" in message
    message = told(small / "dat.csv")
    assert "dat.csv: there is no such file" in message
    assert "Did you mean data.csv?" in message
    missing = tmp_path / "no" / "robot.yaml"
    assert f"{missing}: there is no such file" in told(small / "data.csv", robot=missing)
    assert f"{missing}: there is no such file" in refused(truearm, "show", missing)
    assert f"{missing}: there is no such file" in refused(truearm, "validate", missing, small / "data.csv")
    assert "this is a folder, a file is needed" in told(small)
    assert "this is a folder, a file is needed" in refused(truearm, "show", small)
    for text in ("", "  "):
        assert "ROBOT: no robot is given" in refused(truearm, "show", text)


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
        (1, "joint_3 [deg]", "joint_3 [mm]", ["column joint_3: joint 3 of irb120 is revolute", "allowed: deg or rad"]),
        (1, "y [mm]", "depth [mm]", ["line 1", "the column is not known", "depth [mm]"]),
        (1, "target", "targets", ["the column is not known", "Did you mean target?"]),
    ],
)
def test_a_bad_cell_is_named(
    told: Callable[..., str], table: list[str], line: int, column: str, text: str, parts: list[str]
) -> None:
    message = told(with_cell(table, line, column, text))
    for part in parts:
        assert part in message


def test_data_that_do_not_suffice(told: Callable[..., str], table: list[str], small: Path, tmp_path: Path) -> None:
    assert "got '6 joint columns'; allowed: 3 (li3)" in told(small / "data.csv", robot="li3")
    said = told(table[:16], "--train", "4", "--redundancy", "drop")
    assert "fewer equations than unknowns; got '36 equations for 40 unknown parameters'" in said
    assert "use --train all" in told(table[:4])
    for content in ("", "\n\n", "configuration,joint_1 [deg],target,x [mm],y [mm],z [mm]\n"):
        (tmp_path / "empty.csv").write_text(content)
        assert "empty.csv: the file" in told(tmp_path / "empty.csv")
    for train in ("40", "41", "0", "-3"):
        message = told(small / "data.csv", f"--train={train}")
        assert f"--train: the number of training configurations must leave some held out; got {train}" in message
        assert "allowed: 1 to 39, or all" in message
    assert "--train: a number of configurations belongs here; got 'half'" in told(small / "data.csv", "--train", "half")


def test_targets_that_nobody_knows(truearm: Truearm, small: Path, table: list[str], tmp_path: Path) -> None:
    message = refused(truearm, "validate", "irb120", small / "data.csv")
    assert "the robot has no targets" in message
    assert "calibrated.yaml" in message
    truearm("calibrate", "irb120", small / "data.csv", "--out", tmp_path, "--model=geometric")
    data = written(tmp_path / "new.csv", with_cell(table, 4, "target", "9"))
    message = refused(truearm, "validate", tmp_path / "calibrated.yaml", data)
    assert "new.csv: the robot has no target of this name; got '9'; allowed: 1, 2, 3" in message
    data = written(tmp_path / "data.csv", with_cell(table, 2, "target", "nine"))
    for seed in range(20):  # until it is in the held-out part
        run = truearm(
            "calibrate", "irb120", data, "--train", "20", "--seed", seed, "--out", tmp_path / "out", "--model=geometric"
        )
        if run.code == 2:
            break
    assert "got 'nine'" in run.err
    assert "Raise --train, change --seed" in run.err


@pytest.mark.parametrize(
    ("content", "parts"),
    [
        ("within: {a_33: 1}", ["no free parameter of this model has this name", "got 'a_33'", "Did you mean a_3"]),
        ("within: {a: -1}", ["within.a", "-1"]),
        ("between: {a_3: [271, 269]}", ["a_3", "the bounds leave no value"]),
        ("betwen: {a_3: [1, 2]}", ["betwen", "not known", "Did you mean between?"]),
    ],
)
def test_bad_bounds(told: Callable[..., str], small: Path, tmp_path: Path, content: str, parts: list[str]) -> None:
    bounds = tmp_path / "bounds.yaml"
    bounds.write_text(f"truearm: truearm-bounds/1\nunits: {{length: mm, angle: deg}}\n{content}\n")
    message = told(small / "data.csv", "--bounds", bounds)
    for part in ["bounds.yaml", *parts]:
        assert part in message


def test_outputs_that_cannot_be(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    words = ("calibrate", "irb120", small / "data.csv", "--out")
    (tmp_path / "taken").write_text("mine")
    assert "taken: this is a file, a folder is needed" in refused(truearm, *words, tmp_path / "taken")
    assert (tmp_path / "taken").read_text() == "mine"
    if Path("/proc/version").exists():  # where nobody may make a folder
        assert "/proc" in refused(truearm, *words, "/proc/truearm")
    if os.geteuid() != 0:  # root may write everywhere
        tmp_path.chmod(0o500)
        assert "the folder cannot be written to" in refused(truearm, *words, tmp_path / "out")


def test_an_earlier_result_survives_a_failed_run(
    truearm: Truearm, small: Path, table: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    truearm("calibrate", "irb120", small / "data.csv", "--out", out, "--model=geometric")
    before = {p.name: p.read_bytes() for p in out.iterdir()}
    data = written(tmp_path / "data.csv", with_cell(table, 9, "x [mm]", "?"))
    refused(truearm, "calibrate", "irb120", data, "--out", out)
    assert {p.name: p.read_bytes() for p in out.iterdir()} == before
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
    for name in ("mine.yaml", "measurements.csv"):
        (tmp_path / name).write_text("mine")
    assert "exists already" in refused(truearm, "new-robot", tmp_path / "mine.yaml")
    assert "exists already" in refused(
        truearm, "convert", "ur5", "--convention", "cpc", "--out", tmp_path / "mine.yaml"
    )
    assert "measurements.csv: this exists already" in refused(truearm, "example", tmp_path)
    message = refused(truearm, "demo", "--out", tmp_path)
    assert "measurements.csv: this is another file of that name, and it is not overwritten" in message
    assert sorted(p.name for p in tmp_path.iterdir()) == ["measurements.csv", "mine.yaml"]
    assert {p.read_text() for p in tmp_path.iterdir()} == {"mine"}


LONG = "a" * 300
SIMULATED = ("--poses", 5, "--noise", 0, "--out")


def test_names_that_no_file_system_takes_and_links_that_lead_nowhere(
    truearm: Truearm, small: Path, tmp_path: Path
) -> None:
    assert "there is no such robot" in refused(truearm, "show", LONG)
    words = ("simulate", "irb120", "--truth", LONG, *SIMULATED, tmp_path / "x.csv")
    assert "irb120 has no truth of this name" in refused(truearm, *words)
    for file in (f"{LONG}.yaml", f"{LONG}.urdf"):
        assert "File name too long" in refused(truearm, "show", file)
    long, link = tmp_path / LONG, tmp_path / "link"
    link.symlink_to("nowhere.csv")
    nowhere = f"{link}: this is a link, and there is nothing where it points to; got 'nowhere.csv'"
    for place, said in ((long, "File name too long"), (link, nowhere)):
        assert said in refused(truearm, "check", place)
        for out in (place, place / "below"):
            assert said in refused(truearm, "calibrate", "irb120", small / "data.csv", "--out", out)
        assert said in refused(truearm, "example", place)
        assert said in refused(truearm, "new-robot", place)
        assert said in refused(truearm, "simulate", "irb120", "--truth", "nominal", *SIMULATED, place)
    assert "File name too long" in refused(truearm, "demo", "--out", long)
    assert link.is_symlink()


def test_truths_that_are_none(truearm: Truearm, tmp_path: Path) -> None:
    (tmp_path / "li3.yaml").write_text(robot_text(load_robot("li3")))
    for truth, said in (
        ("tracker-triangle", "Did you mean tracker-triangular"),
        ("nowhere.yaml", "nowhere.yaml: there is no such file"),
        (tmp_path / "li3.yaml", "other joints than irb120; got '3 joints'; allowed: 6"),
    ):
        assert said in refused(truearm, "simulate", "irb120", "--truth", truth, *SIMULATED, tmp_path / "x.csv")
    assert not (tmp_path / "x.csv").exists()


def test_import_names_its_targets(truearm: Truearm, tmp_path: Path) -> None:
    words = ["--joints-file", "j.txt", "--angle-unit", "deg", "--length-unit", "mm", "--out", tmp_path / "x.csv"]
    for entry in ("1", "1=", "=file.txt"):
        message = refused(truearm, "import", "matrices", *words, "--target", entry)
        assert f"--target: a name and a file belong here; got '{entry}'; allowed: NAME=FILE" in message


def test_a_number_written_with_an_exponent_is_a_number(truearm: Truearm, tmp_path: Path) -> None:
    truearm("new-robot", tmp_path / "r.yaml")
    text = (tmp_path / "r.yaml").read_text()
    assert "a: 25," in text
    (tmp_path / "e.yaml").write_text(text.replace("a: 25,", "a: 25e0,").replace("d: 80,", "d: 8e1,"))
    shown = json.loads(truearm("show", tmp_path / "e.yaml", "--json").out)
    assert shown["joints"][1]["values"]["a_2"] == 25
    assert shown["joints"][5]["values"]["d_6"] == 80
