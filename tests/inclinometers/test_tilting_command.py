"""What others rely on of ``truearm tilting`` and ``influence``, and of inclinometers as a device."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from tests.commanding import Truearm

import truearm as package
from truearm.engine.data.readers.canonical import csv_text


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what is read of a Katana whose joints tilt."""
    folder = tmp_path_factory.mktemp("tilting")
    options = {"truth": "tilting", "poses": 24}
    package.simulate_inclinometers("katana450", **options, out=folder / "inclinations.csv")  # type: ignore[arg-type]
    data = package.simulate("katana450", truth="tilting", poses=40, noise=1e-5).data
    (folder / "poses.csv").write_text(csv_text(data))
    return folder


def test_both_stages_from_files_into_files(truearm: Truearm, campaign: Path, tmp_path: Path) -> None:
    files = campaign / "inclinations.csv", campaign / "poses.csv", "--pushed", campaign / "inclinations-pushed.csv"
    run = truearm("tilting", "katana450", *files, "--out", tmp_path, "--json")
    assert run.code == 0, run.err
    summary = json.loads(run.out)
    keys = ["status", "warnings", "inclinations", "constants", "geometry", "geometry_alone"]
    assert {*summary} == {"simulated", "simulated_parts", *keys}
    assert (summary["inclinations"]["pairs"], summary["inclinations"]["pushed"]) == (12, 16)
    after, alone = (summary[key]["validation"]["position_mm"]["mean"] for key in ("geometry", "geometry_alone"))
    assert after < 0.3 * alone
    assert json.loads(truearm("show", tmp_path / "calibrated.yaml", "--json").out)["name"] == "katana450"
    checked = truearm("validate", tmp_path / "calibrated.yaml", campaign / "poses.csv", "--json")
    assert json.loads(checked.out)["position_mm"]["mean"] == pytest.approx(after, rel=0.5)


def test_the_first_stage_alone_says_what_it_did_not_see(truearm: Truearm, campaign: Path, tmp_path: Path) -> None:
    run = truearm("tilting", "katana450", campaign / "inclinations.csv", "--out", tmp_path)
    assert run.code == 0, run.err
    assert "joint 1: tilt 0.02" in run.out
    assert "Warning (upright-unseen): compliance_1, backlash_1 stay" in run.out
    assert "give the poses of both as --pushed" in run.out
    assert "calibrated.urdf\n" in run.out


def test_errors_end_with_exit_code_3(truearm: Truearm, campaign: Path, tmp_path: Path) -> None:
    with (campaign / "inclinations.csv").open(newline="") as file:
        rows = [*csv.reader(file)]
    pulled = [rows[0].index(f"force_{axis} [N]") for axis in "xyz"]
    for row in rows[1:]:
        for place in pulled:
            row[place] = "0"  # nobody wrote the forces down
    lying = tmp_path / "lying.csv"
    lying.write_text("\n".join(",".join(row) for row in rows) + "\n")
    run = truearm("tilting", "katana450", lying, "--out", tmp_path / "out", "--json")
    assert run.code == 3
    assert json.loads(run.out)["warnings"][0]["level"] == "error"


def test_files_of_something_else_are_refused(truearm: Truearm, campaign: Path, tmp_path: Path) -> None:
    for words, says in (
        (("katana450", campaign / "poses.csv"), "This looks like readings of targets"),
        ((campaign / "inclinations.csv", "katana450"), "exchanged"),
    ):
        run = truearm("tilting", *words, "--out", tmp_path / "out")
        assert (run.code, says in run.err) == (2, True)
    assert not (tmp_path / "out").exists()


def test_inclinometers_are_planned_and_simulated(truearm: Truearm, tmp_path: Path) -> None:
    out = tmp_path / "plan.csv"
    words = ("--device", "inclinometers", "--candidates", 100, "--noise", 0.01, "--out", out)
    summary = json.loads(truearm("plan", "katana450", "--poses", 8, *words, "--json").out)
    assert (summary["inclined"], summary["posed"], summary["unseen"]) == (8, 16, [])
    with out.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["reads"] for row in rows] == ["inclinations"] * 8 + ["positions"] * 16
    assert [row["order"] for row in rows] == [str(number) for number in range(1, 25)]
    assert rows[0]["joint_1 [deg]"] == rows[1]["joint_1 [deg]"]
    assert {abs(float(rows[0][f"force_{axis} [N]"])) for axis in "xyz"} == {0.0, 20.0}
    run = truearm("plan", "katana450", "--poses", 8, *words, "--pull", 0, "--details")
    assert "by gravity alone" in run.out
    assert "compliance_1   stays unknown" in run.out
    table = tmp_path / "read.csv"
    pulled = ("--truth", "tilting", "--device", "inclinometers", "--pull", 30, "--out", table)
    run = truearm("simulate", "katana450", "--poses", 8, *pulled)
    assert run.code == 0, run.err
    assert "80 angles of 5 inclinometers" in run.out
    assert (tmp_path / "read-pushed.csv").exists()


PLAN, READ = ("plan", "katana450"), ("simulate", "katana450", "--truth", "nominal")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ((*PLAN, "--poses", "auto"), "--poses: for inclinometers a number"),
        ((*PLAN, "--poses", 7), "--poses: inclinations are compared two by two; got 7"),
        ((*PLAN, "--objective", "O2"), "--objective: this says nothing for inclinometers"),
        ((*PLAN, "--from", "data.csv"), "--from: this says nothing"),
        ((*PLAN, "--model", "full"), "--model: this says nothing"),
        ((*PLAN, "--program", "rapid"), "--program: this says nothing for inclinometers"),
        ((*PLAN, "--floor", "5"), "--floor: the floor is above the base"),
        ((*PLAN, "--approach"), "--approach: this says nothing for inclinometers"),
        ((*READ, "--noise", 0.1), "--noise: this says nothing"),
        ((*READ, "--wrench", "1N,0N,0N,0Nm,0Nm,0Nm"), "--wrench: this says"),
        ((*PLAN, "--device", "ballbar", "--pull", 5), "use --device inclinometers"),
        ((*READ, "--noise", 0.1, "--device", "tracker", "--pull", 5), "use --device inclinometers"),
    ],
)
def test_options_that_do_not_fit_inclinometers(
    truearm: Truearm, tmp_path: Path, words: tuple[object, ...], says: str
) -> None:
    more = [*(() if "--poses" in words else ("--poses", 8))]
    more += [] if "--device" in words else ["--device", "inclinometers"]
    run = truearm(*words, *more, "--out", tmp_path / "out.csv")
    assert (run.code, says in run.err) == (2, True), run.err


def test_influence_with_and_without_data(truearm: Truearm, campaign: Path, tmp_path: Path) -> None:
    run = truearm("influence", "katana450", "--poses", 6, "--angle", 0.1, "--length", 0.2, "--details")
    assert run.code == 0, run.err
    assert "theta_offset_2 +0.1 deg" in run.out
    assert "d_5            +0.2 mm                mean 0.2000 mm" in run.out
    words = ("influence", "katana450", campaign / "poses.csv", "--out", tmp_path, "--combine", "best-pose")
    run = truearm(*words)
    assert run.code == 0, run.err
    assert "On 12 configurations that none of them has seen:" in run.out
    assert "influence-based, pose by pose" in run.out
    assert "Note (influence-worse)" in run.out
    summary = json.loads(truearm(*words[:3], "--json").out)
    assert list(summary["errors"]) == ["nominal", "minimum norm", "influence", "least squares", "calibrate"]
    assert {"influence.csv", "report.html", "result.json"} < {path.name for path in tmp_path.iterdir()}
    run = truearm("influence", "katana450", campaign / "poses.csv", "--poses", 3)
    assert (run.code, "--poses: the configurations are those of the readings" in run.err) == (2, True)
