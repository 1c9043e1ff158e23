"""Files of tests by ISO 9283 that are none, were read elsewhere, in another unit or under another plan."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.house.examples import performance_files
from tests.iso9283.campaign_files import (
    FILES,
    Arguments,
    Row,
    arguments_in,
    each_row,
    evaluated,
    notices,
    planned_in,
    refusal_of,
)
from tests.performance_plan import small_plan

from truearm.engine.base.writing import write_files
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.iso9283.evaluating.evaluate import RESULT, Iso9283Evaluation
from truearm.iso9283.planning.plan_file import PLAN, ROBOT, plan_text


def added(column: str, amount: float) -> Callable[[Row], None]:
    return lambda row: row.update({column: str(float(row[column]) + amount)})


def forces_of(arguments: Arguments, change: Callable[[Row], object]) -> Iso9283Evaluation:
    each_row(arguments["forces"], change)
    return evaluated(arguments, "forces")


@pytest.mark.parametrize("name", FILES)
def test_separators_and_columns_that_do_not_fit_are_named_with_what_to_do(small: Arguments, name: str) -> None:
    text = small[name].read_text()
    first, *rows = text.splitlines()
    for spoilt, stated, cure in (
        (text.replace(",", ";"), "semicolons", "Save the file with commas and decimal points."),
        ("\n".join([f"{first},note", *(f"{row},a" for row in rows)]), "note", "Rename it, or leave it out."),
        (text.replace("cycle", "cycel", 1), "cycel", "Did you mean cycle?"),
    ):
        small[name].write_text(spoilt)
        refusal = refusal_of(small)
        assert (refusal.parameter, refusal.came, refusal.cure) == (name, stated, cure)


def test_a_pose_that_is_like_none_is_not_taken_for_another(small: Arguments) -> None:
    small["poses"].write_text(small["poses"].read_text().replace(",P1,", ",P9,", 1))
    refusal = refusal_of(small)
    assert refusal.came == "P9"
    assert "Did you mean" not in str(refusal)


def test_an_alignment_in_another_unit_is_named_and_no_path(small: Arguments) -> None:
    text = small["alignment"].read_text()
    numbers = re.search(r"position: \[(.*)\]", text)
    assert numbers is not None
    metres = ", ".join(str(float(number) / 1e3) for number in numbers[1].split(","))
    small["alignment"].write_text(text.replace(numbers[1], metres))
    refusal = refusal_of(small)
    assert refusal.parameter == "alignment"
    assert str(small["alignment"]) in str(refusal)
    assert "Is the position in m where the file says mm?" in str(refusal)


def test_readings_elsewhere_than_their_pose_are_refused(small: Arguments) -> None:
    each_row(small["forces"], added("y [mm]", 60.0))
    message = str(refusal_of(small, "forces"))
    assert re.search(r"line 2: the tip is not at P1 where it is pushed least in cycle 1 of .* \+x", message)
    each_row(small["settling"], added("z [mm]", 120.0))
    message = str(refusal_of(small, "settling"))
    assert re.search(r"at another place than P1 in cycle 1 of t; got '1[12].* mm from P1'", message)


@pytest.mark.parametrize("poses", [True, False])
def test_pushes_in_another_unit_are_refused(small: Arguments, poses: bool) -> None:
    small["forces"].write_text(small["forces"].read_text().replace("[mm]", "[m]"))
    refusal = refusal_of(small, "forces", *(("poses",) if poses else ()))
    assert refusal.parameter == ("forces" if poses else "alignment")
    assert "from its centre" in str(refusal)


@pytest.mark.parametrize(("factor", "kilograms"), [(1 / 9.80665, True), (0.5, False)])
def test_forces_well_below_the_rated_ones_are_said(small: Arguments, factor: float, kilograms: bool) -> None:
    result = forces_of(small, lambda row: row.update({"force [N]": str(factor * float(row["force [N]"]))}))
    message = notices(result)["low-forces"].message
    assert ("are these kg?" in message) == kilograms
    assert "29.42 N" in message


def test_directions_under_the_name_of_another_axis_are_said(small: Arguments) -> None:
    assert not {"sideways-push", "low-forces"} & {*notices(evaluated(small, "forces"))}
    names = {"x": "y", "y": "x", "z": "z"}
    result = forces_of(small, lambda row: row.update(direction=row["direction"][0] + names[row["direction"][1]]))
    assert "most along y" in notices(result)["sideways-push"].message
    assert "+z" not in notices(result)["sideways-push"].message


def test_a_push_beside_the_line_of_the_others_is_said_with_and_without_it(small: Arguments) -> None:
    rows: list[Row] = []

    def off_on_line_4(row: Row) -> None:
        rows.append(row)
        if len(rows) == 3:
            row["x [mm]"] = str(float(row["x [mm]"]) + 3.0)

    assert "outlying-push" not in notices(evaluated(small, "forces"))
    notice = notices(forces_of(small, off_on_line_4))["outlying-push"]
    assert (notice.level, notice.summary()["formerly"]) == ("warning", "wild-push")
    assert "line 4" in notice.message
    assert "without it" in notice.message


def test_poses_of_another_cube_are_said(small: Arguments) -> None:
    rows: list[Row] = []
    each_row(small["poses"], rows.append)
    columns = ("x [mm]", "y [mm]", "z [mm]")
    middle = {name: sum(float(row[name]) for row in rows) / len(rows) for name in columns}

    def larger(row: Row) -> None:
        row.update({name: str(middle[name] + 1.05 * (float(row[name]) - middle[name])) for name in columns})

    assert "other-cube" not in notices(evaluated(small, "poses"))
    each_row(small["poses"], larger)
    message = notices(evaluated(small, "poses"))["other-cube"].message
    assert "lie as those of a cube of" in message
    assert "Give the plan.yaml that was measured." in message


def test_posing_times_are_held_against_the_planned_distance(tmp_path: Path) -> None:
    arguments = planned_in(tmp_path, small_plan(["posing-time"], cycles={"posing-time": 1}), rate=100.0)
    settling = arguments["settling"]
    whole = settling.read_text()
    assert len(evaluated(arguments, "settling").values) == 2
    swapped = {"D10": "D50", "D50": "D10"}
    each_row(settling, lambda row: row.update(pose=swapped[row["pose"]]))
    message = str(refusal_of(arguments, "settling"))
    assert re.search(r"at another place than D50 .* mm from D50, .* mm from D10", message)
    settling.write_text(whole)
    places: list[np.ndarray] = []

    def has_begun(row: Row) -> bool:
        places.append(np.array([float(row[f"{axis} [mm]"]) for axis in "xyz"]) if row["pose"] == "D50" else np.zeros(3))
        began = next((place for place in places if place.any()), places[-1])
        return bool(row["pose"] == "D50" and np.linalg.norm(places[-1] - began) > 15.0)

    each_row(settling, has_begun)
    message = str(refusal_of(arguments, "settling"))
    assert "the way to D50 in cycle 1 of posing-time is not the planned one" in message


def drift(folder: Path, times: list[str], cycles: list[int] | None = None) -> Arguments:
    """Return the arguments of ten cycles at each hour, or at other times."""
    plan = small_plan(["dAP"], hours=4.0)
    rng = np.random.default_rng(3)
    rows = ["criterion,pose,cycle,velocity [%],load [%],time [s],x [mm],y [mm],z [mm]"]
    for k, time in enumerate(times):
        x, y, z = (1e3 * plan.poses["P1"].position + 0.01 * rng.standard_normal(3)).tolist()
        rows.append(f"dAP,P1,{cycles[k] if cycles else k % 10 + 1},100,100,{time},{x:.4f},{y:.4f},{z:.4f}")
    tie = (
        "truearm: truearm-alignment/1\nunits: {length: mm, angle: deg}\nkind: base-features\nposition: [0, 0, 0]\n"
        "quaternion: [1, 0, 0, 0]\nsigma: 0.01\nsigma_rot: 0.001\n"
    )
    files = {PLAN: plan_text(plan), ROBOT: robot_text(plan.robot), "alignment.yaml": tie}
    return arguments_in(folder, {**files, "poses.csv": "\n".join(rows) + "\n"})


def hourly(*, unit: float = 1.0, start: float = 0.0, day: float = np.inf) -> list[str]:
    return [f"{(start + 3600.0 * group + 10.0 * k) / unit % day:.3f}" for group in range(5) for k in range(10)]


def in_order(arguments: Arguments, order: np.ndarray) -> None:
    head, *rows = arguments["poses"].read_text().splitlines()
    arguments["poses"].write_text("\n".join([head, *(rows[k] for k in order)]) + "\n")


@pytest.mark.parametrize(
    ("times", "words"),
    [
        (hourly()[:20], "2 groups over 1 h."),
        (hourly(unit=60.0), "5 groups over 0.0667 h (are the times in minutes?)"),
        (hourly(unit=0.2), "5 groups over 20 h."),
        ([""] * 50, "the rows of dAP have no times"),
    ],
)
def test_drift_over_another_time_than_planned_is_said(tmp_path: Path, times: list[str], words: str) -> None:
    message = notices(evaluated(drift(tmp_path, times), "poses"))["drift-time"].message
    assert "planned over 4 h" in message
    assert words in message


def test_drift_as_planned_is_not_said_and_the_order_of_rows_does_not_matter(tmp_path: Path) -> None:
    arguments = drift(tmp_path, hourly())
    result = evaluated(arguments, "poses")
    assert not {"drift-time", "single-drift-group"} & {*notices(result)}
    order = np.random.default_rng(1).permutation(50)
    for other in (order, order[::-1], np.arange(50)[::-1]):
        in_order(arguments, other)
        assert evaluated(arguments, "poses").values[0].value == pytest.approx(result.values[0].value, rel=1e-9)


def test_times_of_drift_that_cannot_be_are_refused(tmp_path: Path) -> None:
    message = str(refusal_of(drift(tmp_path, hourly(start=79000.0, day=86400.0)), "poses"))
    assert re.search(r"lines 31 and 32: the time of drift falls by hours .* add 86400 s", message)
    arguments = drift(tmp_path, hourly(start=86400.0 - 2 * 3600.0 - 45.0, day=86400.0))
    in_order(arguments, np.random.default_rng(1).permutation(50))
    assert "the times of drift contradict the numbers of its cycles" in str(refusal_of(arguments, "poses"))
    times = hourly()
    times[7] = ""
    message = str(refusal_of(drift(tmp_path, times), "poses"))
    assert "line 9, column time: 1 row of drift without a time beside rows with one" in message


def test_drift_of_one_group_says_why_there_is_no_value(tmp_path: Path) -> None:
    result = evaluated(drift(tmp_path, [""] * 20, list(range(1, 21))), "poses")
    assert result.values[0].status == "not-measured"
    assert "P1, 100 %, load 100 % (20 cycles)" in notices(result)["single-drift-group"].message


def test_a_plan_that_was_changed_by_hand_is_said(small: Arguments, tmp_path: Path) -> None:
    write_files(tmp_path, {name: (tmp_path / name).read_text() for name in (PLAN, ROBOT)})
    assert "plan-changed" not in notices(evaluated(small, "forces"))
    (tmp_path / PLAN).write_text((tmp_path / PLAN).read_text().replace("limit_band: 0.1", "limit_band: 0.2"))
    assert notices(evaluated(small, "forces"))["plan-changed"].level == "note"
    (tmp_path / "truearm.manifest.json").write_text("no manifest")
    assert "plan-changed" not in notices(evaluated(small, "forces"))


@pytest.fixture(scope="module")
def beside(tmp_path_factory: pytest.TempPathFactory) -> Arguments:
    """Return the arguments of a campaign, and its own result beside it."""
    folder = tmp_path_factory.mktemp("beside")
    arguments = arguments_in(folder, performance_files())
    evaluated(arguments, *FILES, out=folder / "first")
    return {**arguments, "compare": folder / "first" / RESULT}


def _bandwidth(result: dict[str, Any]) -> None:
    for value in result["criteria"]:
        if value["id"] == "FV":
            value["bandwidth_hz"] *= 2.0


def _moved(place: str, row: int) -> Callable[[dict[str, Any]], None]:
    def change(result: dict[str, Any]) -> None:
        result["plan"]["places"][place]["points_mm"][row][0] += 5.0

    return change


@pytest.mark.parametrize(
    ("change", "ids", "words"),
    [
        (
            lambda result: result["plan"].update(limit_band_mm=0.5),
            {"t", "OV"},
            "the limit band was 0.5 mm there, and is 0.1 mm here",
        ),
        (_moved("P2", 0), {"AP", "RP"}, "poses or paths were planned elsewhere"),
        (_moved("line", 1), {"AV", "RV", "FV"}, "poses or paths were planned elsewhere"),
        (
            lambda result: result["rated"].update(velocity_mm_s=500.0),
            {"AV", "RV", "FV"},
            "the rated velocity was 500 mm/s there, and is 1000 mm/s here",
        ),
        (_bandwidth, {"FV"}, "fluctuation was read up to"),
    ],
)
def test_what_was_planned_otherwise_is_not_compared(
    beside: Arguments, tmp_path: Path, change: Callable[[dict[str, Any]], None], ids: set[str], words: str
) -> None:
    other = json.loads(beside["compare"].read_text())
    change(other)
    (tmp_path / RESULT).write_text(json.dumps(other))
    result = evaluated(beside, *FILES, compare=tmp_path / RESULT)
    assert result.comparison is not None
    ((why, named),) = result.comparison.unlike.items()
    assert words in why
    assert set(named) == ids
    assert words in notices(result)["plan-differs"].message
    compared = {(row.id, row.where) for row in result.comparison.rows}
    assert (("AP", "P2") in compared, ("AP", "P1") in compared) == ("AP" not in ids, True)


def test_results_of_another_tip_or_load_are_refused_and_older_ones_said(beside: Arguments, tmp_path: Path) -> None:
    same = evaluated(beside, *FILES, compare=beside["compare"])
    assert not {"plan-differs", "plan-unknown"} & {*notices(same)}
    other = json.loads(beside["compare"].read_text())
    file = tmp_path / RESULT
    file.write_text(json.dumps({**other, "rated": {**other["rated"], "load_kg": 5.0}}))
    message = str(refusal_of(beside, compare=file))
    assert re.search("no value of the same kind; got .*the rated load was 5 kg there", message)
    file.write_text(json.dumps({name: value for name, value in other.items() if name != "plan"}))
    assert "cannot be told" in notices(evaluated(beside, *FILES, compare=file))["plan-unknown"].message
    other["plan"]["tip"]["points_mm"][0][2] += 1.0
    file.write_text(json.dumps(other))
    assert "of another tip; got 0, 0, 1 mm in the flange frame" in str(refusal_of(beside, compare=file))
