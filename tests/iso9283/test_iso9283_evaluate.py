"""Tests by ISO 9283 from plan to report: what the twin truly does comes out, and what does not fit is said."""

from __future__ import annotations

import ast
import hashlib
import inspect
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.iso9283.campaign_files import FILES, Arguments, Row, each_row, evaluated, notices, planned_in, refusal_of
from tests.performance_plan import small_plan

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.robot.transform import quaternion_from_rotation, rotation_from_quaternion, rotation_from_vector
from truearm.engine.twin.truths import truth_twin
from truearm.iso9283.criteria.poses import missing_places
from truearm.iso9283.criteria.rows import Conditions, Value
from truearm.iso9283.evaluating.evaluate import RESULT, Iso9283Evaluation
from truearm.iso9283.evaluating.table import beside_words, cycle_notices, uncovered_tests, worst_places
from truearm.iso9283.planning.criteria import TEST_OF, TESTS

#: A few cycles of every test.
FEW = dict.fromkeys(TESTS, 3) | {"AP": 8, "vAP": 6, "AD": 8, "dAP": 5, "E": 5}


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Arguments:
    """Return the arguments of a campaign of all tests."""
    return planned_in(tmp_path_factory.mktemp("campaign"), small_plan(cycles=FEW, hours=0.5), rate=200.0)


@pytest.fixture(scope="module")
def result(campaign: Arguments) -> Iso9283Evaluation:
    return evaluated(campaign, *FILES, out=campaign["plan"].parent / "evaluated")


def positions(result: Iso9283Evaluation, criterion: str) -> dict[str, Value]:
    return {value.where: value for value in result.values if value.id == criterion and value.component == "position"}


def test_every_criterion_has_a_value_and_the_files_hold_it(result: Iso9283Evaluation, campaign: Arguments) -> None:
    assert {value.id for value in result.values} == {*TEST_OF}
    assert all(value.status != "not-measured" for value in result.values if value.component == "position")
    folder = campaign["plan"].parent / "evaluated"
    content = json.loads((folder / "iso9283.json").read_text())
    assert content == json.loads(json.dumps(result.summary()))
    keys = {"id", "component", "where", "value", "unit", "interval_95", "cycles", "conditions", "status"}
    assert all(keys <= {*entry} <= keys | {"range", "bandwidth_hz"} for entry in content["criteria"])
    assert content["alignment"]["kind"] == "base-features"
    files = {**campaign, "robot": campaign["plan"].with_name("robot.yaml")}
    assert content["inputs"] == {
        name: {"file": str(files[name]), "sha256": hashlib.sha256(Path(files[name]).read_bytes()).hexdigest()}
        for name in ("plan", "poses", "paths", "settling", "forces", "alignment", "robot")
    }


def test_pose_accuracy_is_what_the_twin_truly_misses(result: Iso9283Evaluation) -> None:
    plan = small_plan(["AP"])
    truth = truth_twin(plan.robot, "random", np.random.default_rng(1))
    # The controller commands what brings the nominal flange to the pose.
    for name, value in positions(result, "AP").items():
        pose = plan.poses[name]
        true = truth.robot.with_payload(replace(truth.robot.payload, mass=plan.rated_load))
        at, _ = true.world_poses(pose.joints[None])
        base = np.linalg.inv(truth.robot.base.matrix)
        missed = np.linalg.norm(base[:3, :3] @ at[0] + base[:3, 3] - pose.position)
        assert value.interval is not None
        assert value.interval[0] < missed < value.interval[1]
        assert value.value == pytest.approx(missed, rel=0.1)


def test_the_command_shows_each_criterion_once(result: Iso9283Evaluation) -> None:
    text = result.lines()
    assert len(text) < 40
    for criterion in TEST_OF:
        assert sum(line.startswith(f"  {criterion} ") for line in text) == 1
    worst = max(positions(result, "AP").values(), key=lambda value: value.value)
    assert any(line.startswith(f"  AP                {worst.where}, worst of 5") for line in text)


def test_the_worst_place_is_taken_at_the_fastest_velocity_and_loads_stay_apart() -> None:
    def value(place: str, number: float, velocity: float, load: float) -> Value:
        return Value("AD", "position", place, number, "length", None, 30, Conditions(velocity, load), "measured")

    worst = worst_places(
        [
            value("a", 1e-3, 0.5, 1.0),
            value("a", 1e-3, 1.0, 1.0),
            value("b", -2e-3, 1.0, 1.0),
            value("a", 4e-3, 1.0, 0.1),
            value("c", float("nan"), 1.0, 1.0),
        ]
    )
    assert [row.cells[:3] for row in worst] == [
        ("AD", "b, worst of 2 of 3", "-2.0000 mm"),
        ("AD", "a, load 10 %", "4.0000 mm"),
    ]
    assert worst[0].cells[4:] == ("50 %: 1.0000", "not-measured: c")


def test_the_report_has_a_picture_of_every_test_and_stays_small(result: Iso9283Evaluation) -> None:
    page = result.contents()["report.html"]
    pictures = "clouds accuracy approaches robots drift settling posing-time compliance paths paths-reoriented corners"
    assert {*re.findall(r'<div class="figure" id="([^"]+)"', page)} == {*pictures.split(), "velocity", "weave"}
    assert "needs the standard" in page
    assert "<td>AP</td>" in page
    assert len(page) < 1e6  # without Plotly's own script, which is left out here


def test_a_campaign_of_all_tests_covers_all(result: Iso9283Evaluation) -> None:
    assert f"from {len(TESTS)} of {len(TESTS)} tests." in result.lines()[1]
    assert result.summary()["not_measured"] == []
    assert not any(line.startswith("Not measured") for line in result.lines())


def test_a_part_of_a_test_is_named_by_its_criteria(result: Iso9283Evaluation) -> None:
    """Without orientations a test has its positions only; a criterion without any value is not covered."""
    values = [replace(v, status="not-measured") if v.id in {"RP", "E"} else v for v in result.values]
    assert uncovered_tests(values) == ("RP", "exchangeability (E)")


def test_corner_deviations_say_that_they_are_means_and_how_large_the_largest_is(result: Iso9283Evaluation) -> None:
    corners = [*positions(result, "CR").values(), *positions(result, "CO").values()]
    assert len(corners) == 6
    for corner in corners:
        curves = next(c for c in result.evaluation.corners if c.where == corner.where)
        cycles = curves.rounding if corner.id == "CR" else curves.overshoot
        assert corner.value == pytest.approx(cycles.mean())
        least, largest = (f"{1e3 * length:.4f}" for length in (cycles.min(), cycles.max()))
        assert beside_words(corner) == f"mean of 3 cycles, {least} to {largest}"
    for criterion in ("t", "posing-time", "WS", "WF", "compliance"):
        assert beside_words(next(iter(positions(result, criterion).values()))).startswith("mean of 3 cycles, ")
    # AP of few cycles is the distance of their middle, and not the mean of their distances
    few = replace(next(iter(positions(result, "AP").values())), interval=None, least=1e-3, largest=2e-3, cycles=4)
    assert beside_words(few) == "4 cycles, 1.0000 to 2.0000"
    (overshoot,) = positions(result, "OV").values()
    assert overshoot.value == overshoot.largest
    assert beside_words(overshoot).startswith("largest of 3 cycles, ")


def test_streams_without_cycles_are_drawn_as_what_was_found_in_them(small: Arguments) -> None:
    cycle, start, last = "1", 0.0, 0.0

    def without_cycle(row: Row) -> None:
        nonlocal cycle, start, last
        if row["cycle"] != cycle:
            cycle, start = row["cycle"], last + 0.5
        last = float(row["time [s]"]) + start
        row.update({"cycle": "", "time [s]": f"{last:.6f}"})

    each_row(small["paths"], without_cycle)
    result = evaluated(small, "paths")
    assert positions(result, "AV")["line"].cycles == 3
    assert 'id="streams"' in result.contents()["report.html"]


def test_what_was_not_measured_is_said(small: Arguments) -> None:
    result = evaluated(small, "forces")
    (said,) = [line for line in result.lines() if line.startswith("Not measured: ")]
    assert result.lines()[1].endswith(": 6 values from 1 of 13 tests.")
    named = said.removeprefix("Not measured: ").removesuffix(".").split("; ")
    assert named == list(result.summary()["not_measured"])
    # planned and not measured, or not planned: both are not covered
    assert named[:2] == [
        "pose accuracy and repeatability (AP, RP)",
        "multi-directional pose accuracy variation (vAP)",
    ]
    assert len(named) == 12
    assert said in result.contents()["report.html"]
    (absent,) = [entry for entry in result.summary()["criteria"] if entry["id"] == "AP"]
    assert absent == {**absent, "value": None, "interval_95": None, "cycles": 0, "status": "not-measured"}


def test_without_a_tie_the_frame_is_fitted_and_that_is_said(small: Arguments) -> None:
    tied = evaluated(small, "poses")
    fitted = truearm.iso9283_evaluate(small["plan"], poses=small["poses"])
    assert "best-fit-alignment" in notices(fitted)
    assert {notice.level for notice in fitted.warnings} == {"warning"}
    assert (fitted.summary()["alignment"]["kind"], fitted.summary()["alignment"]["standard"]) == ("best-fit", False)
    for name, value in positions(fitted, "AP").items():
        assert value.value < positions(tied, "AP")[name].value
        assert positions(fitted, "RP")[name].value == pytest.approx(positions(tied, "RP")[name].value)
    assert "tied to the robot's base is not known" in str(refusal_of({**small, "alignment": None}, "forces"))


def test_fewer_and_more_cycles_than_planned_are_said_and_the_values_stand(small: Arguments) -> None:
    whole = evaluated(small, "poses")
    assert "too-few-cycles" not in notices(whole)
    assert cycle_notices(whole.plan, whole.evaluation) == []
    plan = replace(whole.plan, tests=tuple(replace(test, cycles=test.cycles - 1) for test in whole.plan.tests))
    (more,) = [notice for notice in cycle_notices(plan, whole.evaluation) if notice.code == "more-cycles"]
    assert more.level == "note"
    assert re.match(r"More cycles than planned were measured: AP P1: (\d+) of \d+; ", more.message)

    lines = small["poses"].read_text().splitlines()
    small["poses"].write_text("\n".join(lines[:-1]) + "\n")
    fewer = evaluated(small, "poses")
    notice = notices(fewer)["too-few-cycles"]
    assert notice.level == "warning"
    match = re.fullmatch(r"Fewer cycles .* measured: AP (P\d): (\d+) of (\d+); RP \1: \2 of \3. .*", notice.message)
    assert match is not None
    assert int(match[2]) == int(match[3]) - 1
    assert {"too-few-cycles", "measured"} <= {value.status for value in positions(fewer, "AP").values()}
    assert all(np.isfinite(value.value) for value in positions(fewer, "AP").values())


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


def test_an_outlying_row_is_said_with_the_value_without_it(small: Arguments) -> None:
    assert not {"outlying-row", "two-places", "places-missing"} & {*notices(evaluated(small, "poses"))}
    lines: list[Row] = []

    def off_on_line_9(row: Row) -> None:
        lines.append(row)
        if len(lines) == 8:
            row["y [mm]"] = str(float(row["y [mm]"]) + 5.0)

    each_row(small["poses"], off_on_line_9)
    notice = notices(evaluated(small, "poses"))["outlying-row"]
    assert notice.level == "warning"
    assert re.search(
        rf"^Cycle 2 of AP {lines[7]['pose']}, 100 %, load 100 %, on line 9 lies 5(\.\d+)? mm from the others, which "
        r"scatter by 0\.\d+ mm: RP is \d\.\d{4} mm, without it 0\.\d{4}; AP is \d\.\d{4} mm, without it \d\.\d{4}\. ",
        notice.message,
    )


def test_two_places_of_rest_are_said_with_the_rows_of_the_fewer(tmp_path: Path) -> None:
    arguments = planned_in(tmp_path, small_plan(["AP"], cycles={"AP": 24}), noise=1e-6)
    rows: list[Row] = []
    lines = []

    def elsewhere(row: Row) -> None:
        rows.append(row)
        if row["pose"] == "P4" and int(row["cycle"]) % 4 == 0:
            row["z [mm]"] = str(float(row["z [mm]"]) + 0.3)
            lines.append(str(len(rows) + 1))

    each_row(arguments["poses"], elsewhere)
    (notice,) = [
        warning for warning in evaluated(arguments, "poses").warnings if warning.code in ("two-places", "outlying-row")
    ]
    assert (notice.code, notice.level) == ("two-places", "warning")
    assert "AP P4, 100 %, load 100 % (6 and 18 cycles, 0.3" in notice.message
    assert f"the 6 on lines {', '.join(lines)})" in notice.message


def test_orientations_that_are_degrees_off_are_said(small: Arguments) -> None:
    assert "orientation-far-off" not in notices(evaluated(small, "poses", noise_rot=1e-5))
    turn = rotation_from_vector(np.array([0, 0, 0.1]))

    def turned(row: Row) -> None:
        names = ("qw", "qx", "qy", "qz")
        rotation = rotation_from_quaternion(np.array([[float(row[name]) for name in names]]))
        row.update(zip(names, map(str, quaternion_from_rotation(rotation @ turn)[0]), strict=True))

    each_row(small["poses"], turned)
    notice = notices(evaluated(small, "poses", noise_rot=1e-5))["orientation-far-off"]
    off_by = re.search(r"up to -?(\d\.\d+) deg \(AP c of P\d\)", notice.message)
    assert notice.level == "warning"
    assert off_by
    assert float(off_by[1]) == pytest.approx(5.73, abs=0.5)


def test_a_pose_without_a_row_is_said_and_stands_in_the_table(small: Arguments) -> None:
    each_row(small["poses"], lambda row: row["pose"] != "P3")
    result = evaluated(small, "poses")
    notice = notices(result)["places-missing"]
    assert (notice.level, notice.message.split(". ")[0]) == ("warning", "Planned and without a row: AP: P3")
    (row,) = [line for line in result.lines() if line.startswith("  AP ")]
    assert "worst of 4 of 5" in row
    assert row.endswith("not-measured: P3")
    assert "worst of 4 of 5" in str(result.contents()["report.html"]).replace("\N{NO-BREAK SPACE}", " ")


def test_places_and_velocities_of_other_tests_without_a_value_are_said() -> None:
    plan = small_plan(["AT", "posing-time", "AV"], velocities=(1.0, 0.5))

    def value(id_: str, place: str, velocity: float | None) -> Value:
        return Value(id_, "position", place, 1.0, "length", None, 3, Conditions(velocity, 1.0), "measured")

    values = [value("AT", place, v) for place in ("line", "rectangle", "large-circle") for v in (1.0, 0.5)]
    values += [value("AT", "small-circle", 0.5), value("posing-time", "P1-D50", None)]
    assert [missing.words for missing in missing_places(plan, values)] == [
        "AT: small-circle at 100 %",
        "posing-time: P1-D10",
    ]


def test_a_result_is_compared_with_itself_and_with_a_better_one(small: Arguments, tmp_path: Path) -> None:
    result = tmp_path / "first" / RESULT
    first = evaluated(small, "poses", out=result.parent)
    again = evaluated(small, "poses", compare=result).comparison
    assert again is not None
    assert {row.verdict for row in again.rows} <= {"not told apart", "no interval"}
    assert len(again.rows) == len([value for value in first.values if np.isfinite(value.value)])

    other = json.loads(result.read_text())
    for entry in other["criteria"]:
        if entry["id"] == "AP" and entry["component"] == "position":
            factor = {"P1": 10.0, "P2": 0.1}.get(entry["where"], 1.0)
            entry["value"] *= factor
            entry["interval_95"] = [end * factor for end in entry["interval_95"]]
    result.write_text(json.dumps(other))
    beside = evaluated(small, "poses", compare=result)
    assert beside.comparison is not None
    rows = [row for row in beside.comparison.rows if (row.id, row.component) == ("AP", "position")]
    verdicts = {row.where: row.verdict for row in rows}
    assert (verdicts["P1"], verdicts["P2"], verdicts["P3"]) == ("smaller", "larger", "not told apart")
    text = "\n".join(beside.lines())
    assert "smaller by more than both intervals leave open: 1" in text
    assert re.search(r"AP P1, 100 %, load 100 %: \d+\.\d+ -> \d\.\d+ mm", text)
    assert f"Beside {result}" in beside.contents()["report.html"]


def test_results_that_were_tied_differently_are_not_compared_where_it_matters(small: Arguments, tmp_path: Path) -> None:
    truearm.iso9283_evaluate(small["plan"], poses=small["poses"], out=tmp_path / "fitted")
    tied = evaluated(small, "poses", compare=tmp_path / "fitted" / RESULT)
    assert tied.comparison is not None
    assert {row.id for row in tied.comparison.rows} == {"RP"}
    notice = notices(tied)["alignment-differs"]
    assert (notice.level, "AP" in notice.message) == ("warning", True)


def _entry(entry: str, value: object) -> Callable[[dict[str, object]], object]:
    return lambda result: result.update({entry: value})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_entry("robot", "kr5"), "of another robot"),
        (_entry("truearm", "truearm-iso9283-result/2"), "no result of tests by ISO 9283"),
        (lambda result: result["criteria"].insert(0, {}), "no result of tests by ISO 9283"),
        (_entry("truearm", "truearm-calibration/1"), "got a file of the kind truearm-calibration/1"),
        (lambda result: result.pop("robot"), "got a result without robot"),
        ("not json", "got a text that is not JSON"),
        ('{"a": 1}', "got JSON of something else"),
        ("[]", "got JSON of something else"),
    ],
)
def test_what_is_no_other_result_is_refused(
    small: Arguments, tmp_path: Path, change: str | Callable[[Any], object], words: str
) -> None:
    evaluated(small, "forces", out=tmp_path / "first")
    text = (tmp_path / "first" / RESULT).read_text()
    if isinstance(change, str):
        text = change
    else:
        result = json.loads(text)
        change(result)
        text = json.dumps(result)
    (tmp_path / RESULT).write_text(text)
    refusal = refusal_of(small, "forces", compare=tmp_path / RESULT)
    assert refusal.parameter == "compare"
    assert words in str(refusal)


def test_values_of_criteria_that_are_not_known_are_left_out_of_a_comparison(small: Arguments, tmp_path: Path) -> None:
    evaluated(small, "forces", out=tmp_path)
    text = (tmp_path / RESULT).read_text()
    (tmp_path / RESULT).write_text(text.replace('"id": "AP"', '"id": "XX"', 1))
    assert evaluated(small, "forces", compare=tmp_path / RESULT).comparison is not None


def test_nothing_measured_is_refused(small: Arguments) -> None:
    with pytest.raises(InputError, match="nothing was measured") as refusal:
        evaluated(small)
    assert refusal.value.parameter == "poses, paths, settling, forces"


def test_a_file_that_is_missing_is_refused_by_its_parameter(small: Arguments) -> None:
    for name in (*FILES, "plan", "alignment"):
        refusal = refusal_of({**small, name: small["plan"].with_name("none.csv")})
        assert (refusal.parameter, "no such file" in str(refusal)) == (name, True)
    for name in ("noise", "noise_rot"):
        refusal = refusal_of(small, "poses", **{name: 0.0})
        assert (refusal.parameter, "no instrument is without noise" in str(refusal)) == (name, True)
