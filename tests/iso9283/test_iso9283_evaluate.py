"""Tests by ISO 9283 from plan to report: what the twin truly does comes out, and what does not fit is refused."""

from __future__ import annotations

import ast
import dataclasses
import hashlib
import inspect
import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.house.examples import performance_files
from tests.performance_plan import small_plan

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import quaternion_from_rotation, rotation_from_quaternion, rotation_from_vector
from truearm.engine.twin.truths import truth_twin
from truearm.iso9283.criteria.poses import missing_places
from truearm.iso9283.criteria.rows import Conditions, Value
from truearm.iso9283.evaluating.evaluate import Iso9283Evaluation
from truearm.iso9283.evaluating.table import cycle_notices, worst_places
from truearm.iso9283.planning.criteria import TEST_OF
from truearm.iso9283.planning.plan_file import PLAN, ROBOT, plan_text

FILES = ("poses", "paths", "settling", "forces")
Arguments = dict[str, Any]
#: A few cycles of every test.
FEW = {
    "AP": 8,
    "vAP": 6,
    "AD": 8,
    "dAP": 5,
    "E": 5,
    "t": 3,
    "posing-time": 3,
    "AT": 3,
    "AT-reorientation": 3,
    "CR": 3,
    "AV": 3,
    "WS": 3,
    "compliance": 3,
}


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Arguments:
    """Return the arguments of a campaign of all tests."""
    folder = tmp_path_factory.mktemp("campaign")
    plan = small_plan(cycles=FEW, hours=0.5)
    (folder / PLAN).write_text(plan_text(plan))
    (folder / ROBOT).write_text(robot_text(plan.robot))
    truearm.iso9283_simulate("irb120", folder / PLAN, seed=1, rate=200.0, out=folder)
    return {
        "plan": folder / PLAN,
        **{name: folder / f"{name}.csv" for name in FILES},
        "alignment": folder / "alignment.yaml",
    }


@pytest.fixture(scope="module")
def found(campaign: Arguments) -> Iso9283Evaluation:
    return truearm.iso9283_evaluate(**campaign, out=campaign["plan"].parent / "evaluated")


@pytest.fixture
def small(tmp_path: Path) -> Arguments:
    """Return the arguments of a small campaign that a test may change."""
    return arguments_in(tmp_path, performance_files())


def arguments_in(folder: Path, texts: Mapping[str, str]) -> Arguments:
    folder.mkdir(exist_ok=True)
    for name, text in texts.items():
        (folder / name).write_text(text)
    return {
        "plan": folder / PLAN,
        **{name: folder / f"{name}.csv" for name in FILES},
        "alignment": folder / "alignment.yaml",
    }


def changed(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert re.search(old, text, re.M)
    file.write_text(re.sub(old, new, text, count=1, flags=re.M))


def positions(found: Iso9283Evaluation, criterion: str) -> dict[str, Value]:
    return {value.where: value for value in found.values if value.id == criterion and value.component == "position"}


def test_every_criterion_has_a_value_and_the_files_hold_it(found: Iso9283Evaluation, campaign: Arguments) -> None:
    assert {value.id for value in found.values} == {*TEST_OF}
    assert all(value.status != "not-measured" for value in found.values if value.component == "position")
    folder = campaign["plan"].parent / "evaluated"
    held = json.loads((folder / "iso9283.json").read_text())
    assert held == json.loads(json.dumps(found.summary()))
    keys = {"id", "component", "where", "value", "unit", "interval_95", "cycles", "conditions", "status"}
    assert all(keys <= {*entry} <= keys | {"range", "bandwidth_hz"} for entry in held["criteria"])
    assert held["alignment"]["kind"] == "base-features"
    given = {**campaign, "robot": campaign["plan"].with_name("robot.yaml")}
    assert held["inputs"] == {
        name: {"file": str(given[name]), "sha256": hashlib.sha256(Path(given[name]).read_bytes()).hexdigest()}
        for name in ("plan", "poses", "paths", "settling", "forces", "alignment", "robot")
    }


def test_pose_accuracy_is_what_the_twin_truly_misses(found: Iso9283Evaluation) -> None:
    plan = small_plan(["AP"])
    truth = truth_twin(plan.robot, "random", np.random.default_rng(1))
    # The controller commands what brings the nominal flange to the pose.
    for name, value in positions(found, "AP").items():
        pose = plan.poses[name]
        true = truth.robot.with_payload(replace(truth.robot.payload, mass=plan.rated_load))
        at, _ = true.world_poses(pose.joints[None])
        base = np.linalg.inv(truth.robot.base.matrix)
        missed = np.linalg.norm(base[:3, :3] @ at[0] + base[:3, 3] - pose.position)
        assert value.interval is not None
        assert value.interval[0] < missed < value.interval[1]
        assert value.value == pytest.approx(missed, rel=0.1)


def test_the_command_shows_each_criterion_once(found: Iso9283Evaluation) -> None:
    text = found.lines()
    assert len(text) < 40
    for criterion in TEST_OF:
        assert sum(line.startswith(f"  {criterion} ") for line in text) == 1
    worst = max(positions(found, "AP").values(), key=lambda value: value.value)
    assert any(line.startswith(f"  AP                {worst.where}, worst of 5") for line in text)


def test_the_worst_place_is_taken_at_the_fastest_velocity_and_loads_stay_apart() -> None:
    def value(where: str, number: float, velocity: float, load: float) -> Value:
        return Value("AD", "position", where, number, "length", None, 30, Conditions(velocity, load), "measured")

    found = worst_places(
        [
            value("a", 1e-3, 0.5, 1.0),
            value("a", 1e-3, 1.0, 1.0),
            value("b", -2e-3, 1.0, 1.0),
            value("a", 4e-3, 1.0, 0.1),
            value("c", float("nan"), 1.0, 1.0),
        ]
    )
    assert [one.cells[:3] for one in found] == [
        ("AD", "b, worst of 2 of 3", "-2.0000 mm"),
        ("AD", "a, load 10 %", "4.0000 mm"),
    ]
    assert found[0].cells[4:] == ("50 %: 1.0000", "not-measured: c")


def test_the_report_has_a_picture_of_every_test_and_stays_small(found: Iso9283Evaluation) -> None:
    page = found.contents()["report.html"]
    places = set(re.findall(r'<div class="figure" id="([^"]+)"', page))
    assert places == {
        "clouds",
        "accuracy",
        "approaches",
        "robots",
        "drift",
        "settling",
        "posing-time",
        "compliance",
        "paths",
        "paths-reoriented",
        "corners",
        "velocity",
        "weave",
    }
    assert "needs the standard" in page
    assert "<td>AP</td>" in page
    assert len(page) < 1e6  # without Plotly's own script, which is left out here


def test_streams_without_cycles_are_drawn_as_what_was_found_in_them(small: Arguments) -> None:
    header, *rows = small["paths"].read_text().splitlines()
    column = header.split(",").index("cycle")
    start = 0.0
    lines = []
    last: tuple[str, float] = ("1", 0.0)
    time = header.split(",").index("time [s]")
    for row in rows:
        cells = row.split(",")
        if cells[column] != last[0]:
            start = last[1] + 0.5
        now = float(cells[time]) + start
        last = (cells[column], now)
        cells[column], cells[time] = "", f"{now:.6f}"
        lines.append(",".join(cells))
    small["paths"].write_text("\n".join([header, *lines]) + "\n")
    evaluated = truearm.iso9283_evaluate(small["plan"], paths=small["paths"], alignment=small["alignment"])
    assert positions(evaluated, "AV")["line"].cycles == 3
    assert 'id="streams"' in evaluated.contents()["report.html"]


def test_what_was_not_measured_is_said(small: Arguments) -> None:
    evaluated = truearm.iso9283_evaluate(small["plan"], forces=small["forces"], alignment=small["alignment"])
    assert "Not measured: AP, RP, t, OV, AV, RV, FV." in evaluated.lines()
    absent = [entry for entry in evaluated.summary()["criteria"] if entry["id"] == "AP"]
    assert absent == [{**absent[0], "value": None, "interval_95": None, "cycles": 0, "status": "not-measured"}]


def test_without_a_tie_the_frame_is_fitted_and_that_is_said(small: Arguments) -> None:
    tied = truearm.iso9283_evaluate(small["plan"], poses=small["poses"], alignment=small["alignment"])
    fitted = truearm.iso9283_evaluate(small["plan"], poses=small["poses"])
    assert "best-fit-alignment" in {notice.code for notice in fitted.warnings}
    assert {notice.level for notice in fitted.warnings} == {"warning"}
    assert (fitted.summary()["alignment"]["kind"], fitted.summary()["alignment"]["standard"]) == ("best-fit", False)
    for name, value in positions(fitted, "AP").items():
        assert value.value < positions(tied, "AP")[name].value
        assert positions(fitted, "RP")[name].value == pytest.approx(positions(tied, "RP")[name].value)
    with pytest.raises(InputError, match=r"tied to the robot's base is not known"):
        truearm.iso9283_evaluate(small["plan"], forces=small["forces"])


def test_too_few_cycles_are_said_and_the_values_stand(small: Arguments) -> None:
    whole = truearm.iso9283_evaluate(small["plan"], poses=small["poses"], alignment=small["alignment"])
    assert not any(notice.code == "too-few-cycles" for notice in whole.warnings)
    lines = small["poses"].read_text().splitlines()
    small["poses"].write_text("\n".join(lines[:-1]) + "\n")
    fewer = truearm.iso9283_evaluate(small["plan"], poses=small["poses"], alignment=small["alignment"])
    (said,) = [notice for notice in fewer.warnings if notice.code == "too-few-cycles"]
    assert said.level == "warning"
    found = re.fullmatch(r"Fewer cycles .* measured: AP (P\d): (\d+) of (\d+); RP \1: \2 of \3. .*", said.message)
    assert found is not None
    assert int(found[2]) == int(found[3]) - 1
    assert {"too-few-cycles", "measured"} <= {value.status for value in positions(fewer, "AP").values()}
    assert all(np.isfinite(value.value) for value in positions(fewer, "AP").values())


def test_more_cycles_than_planned_are_noted(small: Arguments) -> None:
    whole = truearm.iso9283_evaluate(small["plan"], poses=small["poses"], alignment=small["alignment"])
    plan = dataclasses.replace(
        whole.plan, tests=tuple(dataclasses.replace(test, cycles=test.cycles - 1) for test in whole.plan.tests)
    )
    more = [notice for notice in cycle_notices(plan, whole.evaluation) if notice.code == "more-cycles"]
    assert cycle_notices(whole.plan, whole.evaluation) == []
    assert [notice.level for notice in more] == ["note"]
    assert re.match(r"More cycles than planned were measured: AP P1: (\d+) of \d+; ", more[0].message)


def test_times_may_be_in_other_units_that_the_header_names(small: Arguments, tmp_path: Path) -> None:
    for name in ("poses", "paths", "settling"):
        header, *rows = small[name].read_text().splitlines()
        place = header.split(",").index("time [s]")
        made = [header.replace("time [s]", "time [ms]")]
        for row in rows:
            cells = row.split(",")
            cells[place] = repr(1e3 * float(cells[place])) if cells[place] else ""
            made.append(",".join(cells))
        (tmp_path / f"{name}-ms.csv").write_text("\n".join(made) + "\n")
        one, other = (
            truearm.iso9283_evaluate(**{"plan": small["plan"], "alignment": small["alignment"], name: file})
            for file in (small[name], tmp_path / f"{name}-ms.csv")
        )
        assert [value.value for value in one.values] == pytest.approx([v.value for v in other.values], nan_ok=True)


def test_texts_name_parameters_of_these_jobs_alone() -> None:
    """A word in backticks is shown as an option by the command: texts may have no others."""
    jobs = (truearm.iso9283_plan, truearm.iso9283_simulate, truearm.iso9283_evaluate)
    known = {name for job in jobs for name in inspect.signature(job).parameters}
    root = Path(truearm.__file__).parent
    files = [file for file in root.rglob("*.py") if "iso9283" in str(file.relative_to(root))]
    assert len(files) > 30
    for file in files:
        tree = ast.parse(file.read_text())
        documented = {
            id(node.body[0].value)
            for node in ast.walk(tree)
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
            and node.body
            and isinstance(node.body[0], ast.Expr)
        }
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in documented:
                named = set(re.findall(r"(?<!`)`([a-z][a-z_]*)(?:=[^`]*)?`(?!`)", node.value))
                assert named <= known, (file.name, node.value)


def test_a_wild_row_is_said_with_the_value_without_it(small: Arguments) -> None:
    given = {"poses": small["poses"], "alignment": small["alignment"]}
    clean = truearm.iso9283_evaluate(small["plan"], **given)
    assert not {"wild-row", "two-places", "places-missing"} & {notice.code for notice in clean.warnings}
    header, *rows = small["poses"].read_text().splitlines()
    place, cell = header.split(",").index("y [mm]"), rows[7].split(",")
    cell[place] = str(float(cell[place]) + 5.0)
    rows[7] = ",".join(cell)
    small["poses"].write_text("\n".join([header, *rows]) + "\n")
    (said,) = [n for n in truearm.iso9283_evaluate(small["plan"], **given).warnings if n.code == "wild-row"]
    assert said.level == "warning"
    where = cell[header.split(",").index("pose")]
    assert re.search(
        rf"^Cycle 2 of AP {where}, 100 %, load 100 %, on line 9 lies 5(\.\d+)? mm from the others, which scatter by "
        r"0\.\d+ mm: RP is \d\.\d{4} mm, without it 0\.\d{4}; AP is \d\.\d{4} mm, without it \d\.\d{4}\. ",
        said.message,
    )


def test_two_places_of_rest_are_said_with_the_rows_of_the_fewer(tmp_path: Path) -> None:
    plan = small_plan(["AP"], cycles={"AP": 24})
    (tmp_path / PLAN).write_text(plan_text(plan))
    (tmp_path / ROBOT).write_text(robot_text(plan.robot))
    truearm.iso9283_simulate("irb120", plan, seed=1, noise=1e-6, out=tmp_path / "read")
    poses = tmp_path / "read" / "poses.csv"
    header, *rows = [line.split(",") for line in poses.read_text().splitlines()]
    cycle, pose, z = (header.index(name) for name in ("cycle", "pose", "z [mm]"))
    lines = []
    for line, row in enumerate(rows, 2):
        if row[pose] == "P4" and int(row[cycle]) % 4 == 0:
            row[z] = str(float(row[z]) + 0.3)
            lines.append(str(line))
    poses.write_text("\n".join(",".join(row) for row in (header, *rows)) + "\n")
    tie = tmp_path / "read" / "alignment.yaml"
    made = truearm.iso9283_evaluate(tmp_path / PLAN, poses=poses, alignment=tie)
    (said,) = [notice for notice in made.warnings if notice.code in ("two-places", "wild-row")]
    assert (said.code, said.level) == ("two-places", "warning")
    assert "AP P4, 100 %, load 100 % (6 and 18 cycles, 0.3" in said.message
    assert f"the 6 on lines {', '.join(lines)})" in said.message


def test_orientations_that_are_degrees_off_are_said(small: Arguments) -> None:
    given = {"poses": small["poses"], "noise_rot": 1e-5}
    clean = truearm.iso9283_evaluate(small["plan"], **given, alignment=small["alignment"])
    assert "orientation-far-off" not in {notice.code for notice in clean.warnings}
    header, *rows = [line.split(",") for line in small["poses"].read_text().splitlines()]
    place = header.index("qw")
    q = np.array([row[place : place + 4] for row in rows], dtype=float)
    turned = quaternion_from_rotation(rotation_from_quaternion(q) @ rotation_from_vector(np.array([0, 0, 0.1])))
    lines = [",".join([*row[:place], *map(str, one), *row[place + 4 :]]) for row, one in zip(rows, turned, strict=True)]
    small["poses"].write_text("\n".join([",".join(header), *lines]) + "\n")
    off = truearm.iso9283_evaluate(small["plan"], **given, alignment=small["alignment"])
    (said,) = [notice for notice in off.warnings if notice.code == "orientation-far-off"]
    off_by = re.search(r"up to -?(\d\.\d+) deg \(AP c of P\d\)", said.message)
    assert said.level == "warning"
    assert off_by
    assert float(off_by[1]) == pytest.approx(5.73, abs=0.5)


def test_a_pose_without_a_row_is_said_and_stands_in_the_table(small: Arguments) -> None:
    lines = small["poses"].read_text().splitlines()
    small["poses"].write_text("\n".join(line for line in lines if ",P3," not in line) + "\n")
    made = truearm.iso9283_evaluate(small["plan"], poses=small["poses"], alignment=small["alignment"])
    (said,) = [notice for notice in made.warnings if notice.code == "places-missing"]
    assert (said.level, said.message.split(". ")[0]) == ("warning", "Planned and without a row: AP: P3")
    (row,) = [line for line in made.lines() if line.startswith("  AP ")]
    assert "worst of 4 of 5" in row
    assert row.endswith("not-measured: P3")
    assert "worst of 4 of 5" in str(made.contents()["report.html"]).replace("\N{NO-BREAK SPACE}", " ")


def test_places_and_velocities_of_other_tests_without_a_value_are_said() -> None:
    plan = small_plan(["AT", "posing-time", "AV"], velocities=(1.0, 0.5))

    def value(id_: str, where: str, velocity: float | None) -> Value:
        return Value(id_, "position", where, 1.0, "length", None, 3, Conditions(velocity, 1.0), "measured")

    there = [value("AT", place, v) for place in ("line", "rectangle", "large-circle") for v in (1.0, 0.5)]
    there += [value("AT", "small-circle", 0.5), value("posing-time", "P1-D50", None)]
    assert [one.words for one in missing_places(plan, there)] == ["AT: small-circle at 100 %", "posing-time: P1-D10"]


def test_an_instrument_that_is_too_coarse_is_said(small: Arguments) -> None:
    given = {"poses": small["poses"], "alignment": small["alignment"]}
    coarse = truearm.iso9283_evaluate(small["plan"], **given, noise=1e-3)
    (said,) = [notice for notice in coarse.warnings if notice.code == "instrument-too-coarse"]
    assert (said.level, "RP" in said.message) == ("warning", True)
    assert {value.status for value in positions(coarse, "RP").values()} == {"instrument-too-coarse"}


def test_a_result_is_compared_with_itself_and_with_a_better_one(small: Arguments, tmp_path: Path) -> None:
    given = {"poses": small["poses"], "alignment": small["alignment"]}
    out = tmp_path / "first"
    first = truearm.iso9283_evaluate(small["plan"], **given, out=out)
    again = truearm.iso9283_evaluate(small["plan"], **given, compare=out / "iso9283.json")
    assert again.comparison is not None
    assert {row.verdict for row in again.comparison.rows} <= {"not told apart", "no interval"}
    assert len(again.comparison.rows) == len([value for value in first.values if np.isfinite(value.value)])

    other = json.loads((out / "iso9283.json").read_text())
    for entry in other["criteria"]:
        if entry["id"] == "AP" and entry["component"] == "position":
            factor = {"P1": 10.0, "P2": 0.1, "P3": 1.0}.get(entry["where"], 1.0)
            entry["value"] *= factor
            entry["interval_95"] = [end * factor for end in entry["interval_95"]]
    (out / "iso9283.json").write_text(json.dumps(other))
    beside = truearm.iso9283_evaluate(small["plan"], **given, compare=out / "iso9283.json")
    assert beside.comparison is not None
    verdicts = {
        row.where: row.verdict for row in beside.comparison.rows if (row.id, row.component) == ("AP", "position")
    }
    assert verdicts["P1"] == "smaller"
    assert verdicts["P2"] == "larger"
    assert verdicts["P3"] == "not told apart"
    text = "\n".join(beside.lines())
    assert "smaller by more than both intervals leave open: 1" in text
    assert re.search(r"AP P1, 100 %, load 100 %: \d+\.\d+ -> \d\.\d+ mm", text)
    assert f"Beside {out / 'iso9283.json'}" in beside.contents()["report.html"]


def test_results_that_were_tied_differently_are_not_compared_where_it_matters(small: Arguments, tmp_path: Path) -> None:
    truearm.iso9283_evaluate(small["plan"], poses=small["poses"], out=tmp_path / "fitted")
    tied = truearm.iso9283_evaluate(
        small["plan"],
        poses=small["poses"],
        alignment=small["alignment"],
        compare=tmp_path / "fitted" / "iso9283.json",
    )
    assert tied.comparison is not None
    assert {row.id for row in tied.comparison.rows} == {"RP"}
    (said,) = [notice for notice in tied.warnings if notice.code == "alignment-differs"]
    assert (said.level, "AP" in said.message) == ("warning", True)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"robot": "irb120"', '"robot": "kr5"', "of another robot"),
        ("result/1", "result/2", "no result of tests by ISO 9283"),
        ('"criteria": \\[', '"criteria": [{}, ', "no result of tests by ISO 9283"),
        ('"id": "AP"', '"id": "XX"', ""),
    ],
)
def test_what_is_no_other_result_is_refused(small: Arguments, tmp_path: Path, old: str, new: str, said: str) -> None:
    given = {"forces": small["forces"], "alignment": small["alignment"]}
    out = tmp_path / "first"
    truearm.iso9283_evaluate(small["plan"], **given, out=out)
    changed(out / "iso9283.json", old, new)
    if not said:
        assert truearm.iso9283_evaluate(small["plan"], **given, compare=out / "iso9283.json").comparison is not None
        return
    with pytest.raises(InputError, match=said) as refusal:
        truearm.iso9283_evaluate(small["plan"], **given, compare=out / "iso9283.json")
    assert refusal.value.parameter == "compare"


def test_results_without_common_values_are_refused(small: Arguments, tmp_path: Path) -> None:
    out = tmp_path / "first"
    truearm.iso9283_evaluate(small["plan"], forces=small["forces"], alignment=small["alignment"], out=out)
    with pytest.raises(InputError, match="no value of the same kind"):
        truearm.iso9283_evaluate(
            small["plan"], poses=small["poses"], alignment=small["alignment"], compare=out / "iso9283.json"
        )


def test_nothing_measured_is_refused(small: Arguments) -> None:
    with pytest.raises(InputError, match="nothing was measured") as refusal:
        truearm.iso9283_evaluate(small["plan"], alignment=small["alignment"])
    assert refusal.value.parameter == "poses, paths, settling, forces"


@pytest.mark.parametrize("name", [*FILES, "plan", "alignment"])
def test_a_file_that_is_missing_is_refused_by_its_parameter(small: Arguments, name: str) -> None:
    small[name].unlink()
    with pytest.raises(InputError, match="no such file") as refusal:
        truearm.iso9283_evaluate(**small)
    assert refusal.value.parameter == name


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (r"kind: base-features", "kind: best-fit", "kind"),
        (r"^sigma: .*$", "sigma: 0", "sigma"),
        (r"^sigma_rot: .*$", "sigma_rot: -1", "sigma_rot"),
        (r"^quaternion: \[[^,]*", "quaternion: [3", "length 1"),
        (r"^sigma: .*\n", "", "sigma"),
        (r"length: mm", "length: furlong", "length"),
    ],
)
def test_a_tie_that_cannot_be_used_is_refused(small: Arguments, old: str, new: str, said: str) -> None:
    changed(small["alignment"], old, new)
    with pytest.raises(InputError, match=said) as refusal:
        truearm.iso9283_evaluate(**small)
    assert refusal.value.parameter == "alignment"


def test_poses_of_a_test_that_is_not_planned_are_refused_with_their_row(small: Arguments) -> None:
    changed(small["poses"], r"\nAP,", "\nAD,")
    with pytest.raises(InputError, match=r"poses\.csv, line 2, column criterion"):
        truearm.iso9283_evaluate(**small)
