"""What others rely on: names, files, JSON keys and exit codes of the command."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from tests.commanding import Truearm

import truearm as package
from truearm.calibration.result import RESULT_FILES
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.engine.robot.library import load_robot
from truearm.starting.demo import Demonstration

IDS = (
    *("fr3", "irb120", "irb1600", "katana450", "kr5", "li3", "lrmate200ic", "puma560"),
    *("ur10", "ur10e", "ur3", "ur3e", "ur5", "ur5e"),
)


def test_version_and_help_need_no_scipy_and_no_numpy() -> None:
    script = (
        "import sys\nfrom truearm.commands import main\nsys.argv = ['truearm', {!r}]\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "print([m for m in ('scipy', 'numpy', 'plotly', 'pydantic') if m in sys.modules])"
    )
    for option in ("--version", "--help"):
        done = subprocess.run([sys.executable, "-c", script.format(option)], capture_output=True, text=True, check=True)
        first, *_, last = done.stdout.splitlines()
        assert last == "[]"
        assert option == "--help" or first == f"truearm {package.__version__}"


def test_robots_are_listed_and_shown(truearm: Truearm) -> None:
    listed = json.loads(truearm("robots", "--json").out)
    assert list(listed) == ["robots"]
    assert {*IDS} <= {r["id"] for r in listed["robots"]}
    plain = truearm("robots").out
    for robot_id in IDS:
        assert robot_id in plain
        shown = json.loads(truearm("show", robot_id, "--json").out)
        assert (shown["name"], bool(shown["source"])) == (robot_id, True)
        assert len(shown["joints"]) == len(load_robot(robot_id).joints)
        assert "lengths in mm, angles in deg" in truearm("show", robot_id).out


def test_calibrate_writes_its_files_and_prints_one_object(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    out = tmp_path / "new" / "result"
    run = truearm("calibrate", "irb120", small / "data.csv", "--model", "geometric", "--out", out, "--json")
    assert run.code == 0
    summary = json.loads(run.out)
    marks = {"simulated", "simulated_parts"}
    judged = {"nominal", "train", "validation", "expected_mm", "least_error"}
    assert {*summary} == {*marks, *judged, "status", "warnings", "next"}
    assert summary["status"] == "converged"
    assert (summary["train"]["configurations"], summary["validation"]["configurations"]) == (28, 12)
    assert summary["nominal"]["configurations"] == 12
    for part in ("nominal", "train", "validation"):
        assert list(summary[part]["position_mm"]) == ["mean", "rms", "p95", "max"]
    assert summary["validation"]["position_mm"]["mean"] < summary["nominal"]["position_mm"]["mean"] / 3
    assert {p.name for p in out.iterdir()} == {*RESULT_FILES, "truearm.manifest.json"}
    result = json.loads((out / "result.json").read_text())
    assert {k: result[k] for k in summary} == summary
    assert result["truearm"] == "truearm-result/1"
    assert package.calibrate("irb120", package.load_data(small / "data.csv"), model="geometric").summary() == summary
    rows = {row["name"]: row for row in result["parameters"]}
    assert list(rows["theta_offset_2"]) == ["name", "unit", "nominal", "value", "deviation", "informed", "status"]
    assert rows["theta_offset_2"]["nominal"] == pytest.approx(-90)
    assert rows["a_3"]["unit"] == "mm"
    assert rows["a_3"]["informed"] > 0.9


def test_the_split_is_the_documented_one(small: Path) -> None:
    run = package.calibrate("irb120", small / "data.csv", train=25, seed=7, model="geometric")
    order = np.random.default_rng(7).permutation(40)
    assert run.training.tolist() == order[:25].tolist()
    assert run.held_out.tolist() == order[25:].tolist()


def test_runs_are_reproducible_byte_for_byte(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        truearm("calibrate", "irb120", small / "data.csv", "--out", tmp_path / name, "--model=geometric")
    for file in ("calibrated.yaml", "result.json", "calibrated.urdf", "report.html"):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_validate_works_on_new_data_in_the_same_frames(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    data = read_csv(small / "data.csv")
    first, second = tmp_path / "first.csv", tmp_path / "second.csv"
    first.write_text(csv_text(data.of_configurations(np.arange(30))))
    second.write_text(csv_text(data.of_configurations(np.arange(30, 40))))
    truearm("calibrate", "irb120", first, "--train", "all", "--out", tmp_path / "out", "--model=geometric")
    summary = json.loads(truearm("validate", tmp_path / "out" / "calibrated.yaml", second, "--json").out)
    assert summary["configurations"] == 10
    assert summary["position_mm"]["mean"] < 0.2
    assert "mean 0." in truearm("validate", tmp_path / "out" / "calibrated.yaml", second).out


def test_targets_may_have_any_name(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    data = replace(read_csv(small / "data.csv"), targets=("smr 1", "<b>", "Träger, #3: ?"))
    (tmp_path / "data.csv").write_text(csv_text(data), encoding="utf-8")
    assert (
        truearm("calibrate", "irb120", tmp_path / "data.csv", "--out", tmp_path / "out", "--model=geometric").code == 0
    )
    calibrated = tmp_path / "out" / "calibrated.yaml"
    assert json.loads(truearm("show", calibrated, "--json").out)["targets"] == list(data.targets)
    assert truearm("validate", calibrated, tmp_path / "data.csv").code == 0


def test_a_calibrated_robot_is_a_robot_like_any_other(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    truearm("calibrate", "irb120", small / "data.csv", "--out", tmp_path, "--model=geometric")
    again = json.loads(
        truearm(
            "calibrate",
            tmp_path / "calibrated.yaml",
            small / "data.csv",
            "--out",
            tmp_path / "again",
            "--json",
            "--model=geometric",
        ).out
    )
    assert again["nominal"]["position_mm"]["mean"] == pytest.approx(again["validation"]["position_mm"]["mean"], rel=0.1)
    shown = json.loads(truearm("show", tmp_path / "again" / "calibrated.yaml", "--json").out)
    assert len(shown["history"]) == 2
    assert "40 configurations of data.csv (sha256" in shown["history"][0]


def test_every_model(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    words = ("calibrate", "irb120", small / "data.csv", "--out", tmp_path, "--json")
    for model, redundancy in product(("offsets", "joints", "geometric"), ("prior", "drop")):
        run = truearm(*words, "--model", model, "--redundancy", redundancy)
        assert run.code == 0, (model, redundancy, run.err)
        codes = {w["code"] for w in json.loads(run.out)["warnings"]}
        assert ("redundant" in codes) == (redundancy == "drop"), (model, redundancy)
        assert ("not_in_urdf" in json.loads(run.out)) == (model == "joints"), (model, redundancy)
        names = {row["name"] for row in json.loads((tmp_path / "result.json").read_text())["parameters"]}
        assert ("gain_1" in names) == (model == "joints"), (model, redundancy)


def test_bounds_and_losses(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    bounds = tmp_path / "bounds.yaml"
    head = "truearm: truearm-bounds/1\nunits: {length: mm, angle: deg}\n"
    bounds.write_text(head + "within: {a_3: 1e-3, theta_offset: 2}\n")
    words = ("calibrate", "irb120", small / "data.csv", "--bounds", bounds, "--out", tmp_path, "--json")
    for loss in ("linear", "huber", "cauchy", "l1"):
        run = truearm(*words, "--loss", loss)
        assert (run.code, json.loads(run.out)["status"]) == (0, "at-bound"), (loss, run.err)
        a_3 = next(r for r in json.loads((tmp_path / "result.json").read_text())["parameters"] if r["name"] == "a_3")
        assert (a_3["status"], abs(a_3["value"] - 270) <= 1e-3 + 1e-9) == ("at-bound", True), loss


def test_simulate_is_seeded_and_declares_its_noise(truearm: Truearm, tmp_path: Path) -> None:
    for name, seed in (("a", 3), ("b", 3), ("c", 4)):
        run = truearm(
            "simulate", "ur5", "--truth", "random", "--poses", 20, "--noise", 0.1, "--seed", seed,
            "--out", tmp_path / f"{name}.csv",
        )  # fmt: skip
        assert run.code == 0
    assert (tmp_path / "a.csv").read_text() == (tmp_path / "b.csv").read_text() != (tmp_path / "c.csv").read_text()
    data = read_csv(tmp_path / "a.csv")
    assert data.configurations == 20
    assert data.sigma == pytest.approx(1e-4)


def test_simulating_a_calibrated_robot_keeps_its_frames(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    truearm("calibrate", "irb120", small / "data.csv", "--out", tmp_path, "--model=geometric")
    truth = tmp_path / "calibrated.yaml"
    truearm("simulate", "irb120", "--truth", truth, "--poses", 30, "--noise", 0.05, "--out", tmp_path / "sim.csv")
    summary = json.loads(truearm("validate", truth, tmp_path / "sim.csv", "--json").out)
    assert summary["position_mm"]["rms"] == pytest.approx(0.05 * 3**0.5, rel=0.15)


def test_the_session_runs_from_anywhere(truearm: Truearm, tmp_path: Path) -> None:
    folder, elsewhere = tmp_path / "session", tmp_path / "elsewhere"
    mark, *listed = truearm("example", folder).out.splitlines()
    assert mark == "SIMULATED: measurements of a virtual instrument, not of a robot."
    assert sorted(Path(p).name for p in listed) == ["check.csv", "measurements.csv", "my_robot.yaml", "session.sh"]
    elsewhere.mkdir()
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    subprocess.run(["sh", folder / "session.sh"], cwd=elsewhere, env=environment, capture_output=True, check=True)
    assert (folder / "result" / "report.html").exists()
    assert not list(elsewhere.iterdir())
    assert "at 15 others." in (folder / "session.sh").read_text()
    check = json.loads(truearm("validate", folder / "result" / "calibrated.yaml", folder / "check.csv", "--json").out)
    assert check["position_mm"]["mean"] < 0.15


def test_demo_ends_by_naming_its_report(truearm: Truearm, demonstrated: Demonstration, tmp_path: Path) -> None:
    shutil.copytree(demonstrated.folder, tmp_path / "demo")  # what it wrote itself it writes again
    run = truearm("demo", "--out", tmp_path / "demo")
    assert run.code == 0
    assert str(tmp_path / "demo" / "report.html") in run.out.splitlines()[-1]
    result = json.loads((tmp_path / "demo" / "result.json").read_text())
    noise = 0.03 * (8 / np.pi) ** 0.5
    assert 0.9 * noise < result["validation"]["position_mm"]["mean"] < 1.2 * noise
    assert result["nominal"]["position_mm"]["mean"] > 10 * noise


def test_too_alike_data_end_with_exit_code_3_and_so_does_a_demo_of_them(
    truearm: Truearm, small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = read_csv(small / "data.csv").of_configurations([0, 1])
    (tmp_path / "two.csv").write_text(csv_text(data))
    run = truearm(
        "calibrate",
        "irb120",
        tmp_path / "two.csv",
        "--train",
        "1",
        "--out",
        tmp_path / "out",
        "--json",
        "--model=geometric",
    )
    summary = json.loads(run.out)
    assert (run.code, summary["status"]) == (3, "rank-loss")
    assert "rank-loss" in {w["code"] for w in summary["warnings"]}
    found = package.calibrate("irb120", data, train=1, model="geometric")
    monkeypatch.setattr("truearm.starting.demo.demonstrated", lambda asked: Demonstration(Path(asked.out), found, None))
    assert truearm("demo", "--out", tmp_path / "demo").code == 3


@pytest.mark.skipif(sys.platform == "win32", reason="a shell script")
def test_the_demo_script_stays_where_it_is_called(tmp_path: Path) -> None:
    clone, here = tmp_path / "my clone", tmp_path / "here"
    for folder in (clone / "script", clone / ".venv" / "bin", here):
        folder.mkdir(parents=True)
    script = clone / "script" / "demo"
    script.write_text((Path(__file__).parents[2] / "script" / "demo").read_text())
    (clone / "script" / "bootstrap").write_text("#!/bin/sh\ncd /\n")
    (clone / ".venv" / "bin" / "truearm").write_text('#!/bin/sh\necho "$@" > ran\n')
    for made in (*clone.glob("script/*"), *clone.glob(".venv/bin/*")):
        made.chmod(0o755)
    environment = {**os.environ, "CDPATH": str(tmp_path)}
    subprocess.run(["sh", "../my clone/script/demo", "--out", "x y"], cwd=here, env=environment, check=True)
    assert (here / "ran").read_text() == "demo --out x y\n"


def test_the_wrong_robot_is_doubted(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    run = truearm("calibrate", "irb1600", small / "data.csv", "--out", tmp_path, "--json", "--model=geometric")
    codes = {w["code"]: w["message"] for w in json.loads(run.out)["warnings"]}
    assert run.code == 3
    assert "The readings are not of irb1600" in codes["wrong-robot"]
    assert "irb120 of the library fits them" in codes["wrong-robot"]


def test_convert_writes_the_same_robot_in_another_convention(truearm: Truearm, tmp_path: Path) -> None:
    out = tmp_path / "kr5.yaml"
    said = truearm("convert", "kr5", "--convention", "mcpc", "--out", out).out
    base = "the base frame now lies on the first axis"
    assert said == f"{out}: kr5, converted from translations to mcpc; {base}; left out: truths axis-tests.\n"
    zero = [json.loads(truearm("show", robot, "--json").out) for robot in ("kr5", out)]
    assert [z["convention"] for z in zero] == ["translations", "mcpc"]
    assert zero[1]["history"] == [said.partition("kr5, ")[2].rstrip(".\n")]


def test_a_model_that_cannot_tilt_parallel_axes_says_what_would(truearm: Truearm, small: Path, tmp_path: Path) -> None:
    for name, cure in (
        ("s-model", "Convert the robot to the convention hayati with 'truearm convert'."),
        ("standard-dh", "Write 'convention: hayati' in the robot file and 'beta: 0' at the link between them."),
    ):
        truearm("convert", "irb120", "--convention", name, "--out", tmp_path / f"{name}.yaml")
        run = truearm(
            "calibrate",
            tmp_path / f"{name}.yaml",
            small / "data.csv",
            "--out",
            tmp_path / "out",
            "--json",
            "--model=geometric",
        )
        warnings = {w["code"]: w["message"] for w in json.loads(run.out)["warnings"]}
        assert "Joints 2 and 3 are parallel" in warnings["parallel-axes"]
        assert cure in warnings["parallel-axes"]
