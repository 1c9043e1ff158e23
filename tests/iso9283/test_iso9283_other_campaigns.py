"""Files of tests by ISO 9283 that were read elsewhere, in another unit or under another plan: refused, or said."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.house.examples import performance_files
from tests.performance_plan import small_plan

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.base.writing import write_files
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.iso9283.evaluating.evaluate import RESULT, Iso9283Evaluation
from truearm.iso9283.planning.plan_file import PLAN, ROBOT, plan_text

Arguments = dict[str, Any]
Row = dict[str, str]


@cache
def _files() -> dict[str, str]:
    return performance_files()


@pytest.fixture
def small(tmp_path: Path) -> Arguments:
    """Return the arguments of a small campaign that a test may change."""
    for name, text in _files().items():
        (tmp_path / name).write_text(text)
    return {"plan": tmp_path / PLAN, "alignment": tmp_path / "alignment.yaml"}


def changed(path: Path, change: Callable[[Row], object]) -> Path:
    """Change every row of a file."""
    rows = list(csv.DictReader(io.StringIO(path.read_text())))
    for row in rows:
        change(row)
    with path.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    return path


def added(column: str, amount: float) -> Callable[[Row], None]:
    return lambda row: row.update({column: str(float(row[column]) + amount)})


def notices(found: Iso9283Evaluation) -> dict[str, str]:
    return {notice.code: notice.message for notice in found.warnings}


def forces_of(given: Arguments, change: Callable[[Row], object]) -> Iso9283Evaluation:
    forces = changed(given["plan"].parent / "forces.csv", change)
    return truearm.iso9283_evaluate(**given, forces=forces)


def test_pushes_elsewhere_than_the_pose_are_refused(small: Arguments) -> None:
    with pytest.raises(InputError, match=r"line 2: the tip is not at P1 where it is pushed least in cycle 1 of .* \+x"):
        forces_of(small, added("y [mm]", 60.0))


@pytest.mark.parametrize("poses", [True, False])
def test_pushes_in_another_unit_are_refused(small: Arguments, poses: bool) -> None:
    forces = small["plan"].parent / "forces.csv"
    forces.write_text(forces.read_text().replace("[mm]", "[m]"))
    others = {"poses": small["plan"].parent / "poses.csv"} if poses else {}
    with pytest.raises(InputError) as refusal:
        truearm.iso9283_evaluate(**small, **others, forces=forces)
    assert refusal.value.parameter == ("forces" if poses else "alignment")
    assert "from its centre" in str(refusal.value)


@pytest.mark.parametrize(("factor", "kilograms"), [(1 / 9.80665, True), (0.5, False)])
def test_forces_well_below_the_rated_ones_are_said(small: Arguments, factor: float, kilograms: bool) -> None:
    said = notices(forces_of(small, lambda row: row.update({"force [N]": str(factor * float(row["force [N]"]))})))
    assert ("are these kg?" in said["low-forces"]) == kilograms
    assert "29.42 N" in said["low-forces"]


def test_directions_under_the_name_of_another_axis_are_said(small: Arguments) -> None:
    said = notices(forces_of(small, lambda row: None))
    assert not {"sideways-push", "low-forces"} & set(said)
    names = {"x": "y", "y": "x", "z": "z"}
    found = forces_of(small, lambda row: row.update(direction=row["direction"][0] + names[row["direction"][1]]))
    assert "most along y" in notices(found)["sideways-push"]
    assert "+z" not in notices(found)["sideways-push"]


def test_a_rest_elsewhere_than_the_pose_is_refused(small: Arguments) -> None:
    settling = changed(small["plan"].parent / "settling.csv", added("z [mm]", 120.0))
    with pytest.raises(InputError, match=r"at another place than P1 in cycle 1 of t; got '1[12].* mm from P1'"):
        truearm.iso9283_evaluate(**small, settling=settling)


def test_posing_times_are_held_against_the_planned_distance(tmp_path: Path) -> None:
    plan = small_plan(["posing-time"], cycles={"posing-time": 1})
    truearm.iso9283_simulate("irb120", plan, rate=100.0, seed=1, out=tmp_path)
    write_files(tmp_path, {PLAN: plan_text(plan), ROBOT: robot_text(plan.robot)})
    given: Arguments = {"plan": tmp_path / PLAN, "alignment": tmp_path / "alignment.yaml"}
    settling = tmp_path / "settling.csv"
    whole = settling.read_text()
    assert len(truearm.iso9283_evaluate(**given, settling=settling).values) == 2
    swapped = {"D10": "D50", "D50": "D10"}
    changed(settling, lambda row: row.update(pose=swapped[row["pose"]]))
    with pytest.raises(InputError, match=r"at another place than D50 .* mm from D50, .* mm from D10"):
        truearm.iso9283_evaluate(**given, settling=settling)
    settling.write_text(whole)
    rows = whole.splitlines()
    far = [row for row in rows if ",D50," in row]
    places = np.array([[float(cell) for cell in row.split(",")[4:7]] for row in far])
    begun = int((np.linalg.norm(places - places[0], axis=1) > 15.0).argmax())
    settling.write_text("\n".join([rows[0], *far[begun:]]) + "\n")
    with pytest.raises(InputError, match="the way to D50 in cycle 1 of posing-time is not the planned one"):
        truearm.iso9283_evaluate(**given, settling=settling)


def _drift(tmp_path: Path, times: list[str], cycles: list[int] | None = None) -> Arguments:
    """Return the arguments of ten cycles at each hour, or at other times."""
    plan = small_plan(["dAP"], hours=4.0)
    rng = np.random.default_rng(3)
    numbers = cycles or [k % 10 + 1 for k in range(len(times))]
    rows = ["criterion,pose,cycle,velocity [%],load [%],time [s],x [mm],y [mm],z [mm]"]
    for time, number in zip(times, numbers, strict=True):
        x, y, z = (1e3 * plan.poses["P1"].position + 0.01 * rng.standard_normal(3)).tolist()
        rows.append(f"dAP,P1,{number},100,100,{time},{x:.4f},{y:.4f},{z:.4f}")
    (tmp_path / "poses.csv").write_text("\n".join(rows) + "\n")
    (tmp_path / "alignment.yaml").write_text(
        "truearm: truearm-alignment/1\nunits: {length: mm, angle: deg}\nkind: base-features\nposition: [0, 0, 0]\n"
        "quaternion: [1, 0, 0, 0]\nsigma: 0.01\nsigma_rot: 0.001\n"
    )
    (tmp_path / PLAN).write_text(plan_text(plan))
    (tmp_path / ROBOT).write_text(robot_text(plan.robot))
    return {name: tmp_path / file for name, file in (("plan", PLAN), ("alignment", "alignment.yaml"))} | {
        "poses": tmp_path / "poses.csv"
    }


def hourly(*, unit: float = 1.0, start: float = 0.0) -> list[float]:
    return [(start + 3600.0 * group + 10.0 * k) / unit for group in range(5) for k in range(10)]


@pytest.mark.parametrize(
    ("times", "said"),
    [
        (hourly()[:20], "2 groups over 1 h."),
        (hourly(unit=60.0), "5 groups over 0.0667 h (are the times in minutes?)"),
        (hourly(unit=0.2), "5 groups over 20 h."),
        (None, "the rows of dAP have no times"),
    ],
)
def test_drift_over_another_time_than_planned_is_said(tmp_path: Path, times: list[float] | None, said: str) -> None:
    given = _drift(tmp_path, [""] * 50 if times is None else [f"{time:.3f}" for time in times])
    message = notices(truearm.iso9283_evaluate(**given))["drift-time"]
    assert "planned over 4 h" in message
    assert said in message


def test_drift_as_planned_is_not_said_and_the_order_of_rows_does_not_matter(tmp_path: Path) -> None:
    given = _drift(tmp_path, [f"{time:.3f}" for time in hourly()])
    one = truearm.iso9283_evaluate(**given)
    assert not {"drift-time", "single-drift-group"} & set(notices(one))
    head, *rows = given["poses"].read_text().splitlines()
    order = np.random.default_rng(1).permutation(len(rows))
    for other in (order, order[::-1], np.arange(len(rows))[::-1]):
        given["poses"].write_text("\n".join([head, *(rows[k] for k in other)]) + "\n")
        assert truearm.iso9283_evaluate(**given).values[0].value == pytest.approx(one.values[0].value, rel=1e-9)


def test_a_clock_that_passes_midnight_is_refused(tmp_path: Path) -> None:
    times = [f"{time % 86400:.0f}" for time in hourly(start=79000.0)]
    with pytest.raises(InputError, match=r"lines 31 and 32: the time of drift falls by hours .* add 86400 s"):
        truearm.iso9283_evaluate(**_drift(tmp_path, times))
    within = [f"{time % 86400:.0f}" for time in hourly(start=86400.0 - 2 * 3600.0 - 45.0)]
    given = _drift(tmp_path, within)
    head, *rows = given["poses"].read_text().splitlines()
    order = np.random.default_rng(1).permutation(len(rows))
    given["poses"].write_text("\n".join([head, *(rows[k] for k in order)]) + "\n")
    with pytest.raises(InputError, match="the times of drift contradict the numbers of its cycles"):
        truearm.iso9283_evaluate(**given)


def test_a_row_of_drift_without_a_time_is_refused(tmp_path: Path) -> None:
    times = [f"{time:.0f}" for time in hourly()]
    times[7] = ""
    with pytest.raises(InputError, match=r"line 9, column time: 1 row of drift without a time beside rows with one"):
        truearm.iso9283_evaluate(**_drift(tmp_path, times))


def test_drift_of_one_group_says_why_there_is_no_value(tmp_path: Path) -> None:
    found = truearm.iso9283_evaluate(**_drift(tmp_path, [""] * 20, list(range(1, 21))))
    assert found.values[0].status == "not-measured"
    assert "P1, 100 %, load 100 % (20 cycles)" in notices(found)["single-drift-group"]


def test_a_plan_that_was_changed_by_hand_is_said(tmp_path: Path) -> None:
    for name, text in _files().items():
        (tmp_path / name).write_text(text)
    write_files(tmp_path, {name: _files()[name] for name in (PLAN, ROBOT)})
    given: Arguments = {"forces": tmp_path / "forces.csv", "alignment": tmp_path / "alignment.yaml"}
    assert "plan-changed" not in notices(truearm.iso9283_evaluate(tmp_path / PLAN, **given))
    (tmp_path / PLAN).write_text((tmp_path / PLAN).read_text().replace("limit_band: 0.1", "limit_band: 0.2"))
    (said,) = [one for one in truearm.iso9283_evaluate(tmp_path / PLAN, **given).warnings if one.code == "plan-changed"]
    assert said.level == "note"
    (tmp_path / "truearm.manifest.json").write_text("no manifest")
    assert "plan-changed" not in notices(truearm.iso9283_evaluate(tmp_path / PLAN, **given))


@pytest.fixture(scope="module")
def beside(tmp_path_factory: pytest.TempPathFactory) -> Arguments:
    """Return the arguments of a campaign, and its own result beside it."""
    folder = tmp_path_factory.mktemp("beside")
    for name, text in _files().items():
        (folder / name).write_text(text)
    given: Arguments = {name: folder / f"{name}.csv" for name in ("poses", "paths", "settling", "forces")}
    given |= {"plan": folder / PLAN, "alignment": folder / "alignment.yaml"}
    truearm.iso9283_evaluate(**given, out=folder / "first")
    return {**given, "compare": folder / "first" / RESULT}


def _band(result: dict[str, Any]) -> None:
    result["plan"]["limit_band_mm"] = 0.5


def _moved(result: dict[str, Any]) -> None:
    result["plan"]["places"]["P2"]["points_mm"][0][0] += 5.0


def _path(result: dict[str, Any]) -> None:
    result["plan"]["places"]["line"]["points_mm"][1][0] += 5.0


def _velocity(result: dict[str, Any]) -> None:
    result["rated"]["velocity_mm_s"] = 500.0


def _bandwidth(result: dict[str, Any]) -> None:
    for value in result["criteria"]:
        if value["id"] == "FV":
            value["bandwidth_hz"] *= 2.0


@pytest.mark.parametrize(
    ("change", "ids", "said"),
    [
        (_band, {"t", "OV"}, "the limit band was 0.5 mm there, and is 0.1 mm here"),
        (_moved, {"AP", "RP"}, "poses or paths were planned elsewhere"),
        (_path, {"AV", "RV", "FV"}, "poses or paths were planned elsewhere"),
        (_velocity, {"AV", "RV", "FV"}, "the rated velocity was 500 mm/s there, and is 1000 mm/s here"),
        (_bandwidth, {"FV"}, "fluctuation was read up to"),
    ],
)
def test_what_was_planned_otherwise_is_not_compared(
    beside: Arguments, tmp_path: Path, change: Callable[[dict[str, Any]], None], ids: set[str], said: str
) -> None:
    other = json.loads(beside["compare"].read_text())
    change(other)
    (tmp_path / RESULT).write_text(json.dumps(other))
    found = truearm.iso9283_evaluate(**{**beside, "compare": tmp_path / RESULT})
    assert found.comparison is not None
    ((why, named),) = found.comparison.unlike.items()
    assert said in why
    assert set(named) == ids
    assert said in notices(found)["plan-differs"]
    there = {(row.id, row.where) for row in found.comparison.rows}
    assert (("AP", "P2") in there, ("AP", "P1") in there) == (change is not _moved, True)


def test_results_of_another_tip_or_load_are_refused_and_older_ones_said(beside: Arguments, tmp_path: Path) -> None:
    same = truearm.iso9283_evaluate(**beside)
    assert not {"plan-differs", "plan-unknown"} & set(notices(same))
    other = json.loads(beside["compare"].read_text())
    file = tmp_path / RESULT
    given = {**beside, "compare": file}
    file.write_text(json.dumps({**other, "rated": {**other["rated"], "load_kg": 5.0}}))
    with pytest.raises(InputError, match=r"no value of the same kind; got .*the rated load was 5 kg there"):
        truearm.iso9283_evaluate(**given)
    older = {name: value for name, value in other.items() if name != "plan"}
    file.write_text(json.dumps(older))
    assert "cannot be told" in notices(truearm.iso9283_evaluate(**given))["plan-unknown"]
    other["plan"]["tip"]["points_mm"][0][2] += 1.0
    file.write_text(json.dumps(other))
    with pytest.raises(InputError, match="of another tip; got 0, 0, 1 mm in the flange frame"):
        truearm.iso9283_evaluate(**given)
