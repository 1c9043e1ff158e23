"""Two results of tests by ISO 9283 in one picture, and what a report says in its first lines."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.house.examples import performance_files
from tests.performance_plan import small_plan

import truearm
from truearm.engine.document.document import Picture, Section, Words
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.iso9283.evaluate.evaluate import RESULT, Iso9283Evaluation
from truearm.iso9283.evaluate.figures import pose_pictures
from truearm.iso9283.evaluate.report import path_pictures
from truearm.iso9283.plan.plan_file import PLAN, ROBOT, plan_text

Arguments = dict[str, Any]


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> Arguments:
    """Return the arguments of poses and paths that were measured, and a first result beside them."""
    folder = tmp_path_factory.mktemp("beside")
    plan = small_plan(["AP", "AT"], cycles={"AP": 5, "AT": 3}, velocities=(1.0, 0.5))
    (folder / PLAN).write_text(plan_text(plan))
    (folder / ROBOT).write_text(robot_text(plan.robot))
    truearm.iso9283_simulate("irb120", folder / PLAN, seed=1, rate=100.0, out=folder / "read")
    files = {name: folder / "read" / f"{name}.csv" for name in ("poses", "paths")}
    arguments: Arguments = {"plan": folder / PLAN, "alignment": folder / "read" / "alignment.yaml", **files}
    truearm.iso9283_evaluate(**arguments, out=folder / "first")
    return arguments | {"compare": folder / "first" / RESULT}


def pictures(found: Iso9283Evaluation) -> dict[str, Section]:
    inside = found.evaluation
    drawn = [
        *pose_pictures(found.plan, inside.clouds, inside.drift, inside.settling, inside.pushes, found.comparison),
        *path_pictures(inside, found.comparison),
    ]
    return {block.name: one for one in drawn for block in one.blocks if isinstance(block, Picture)}


def named(drawing: Section, name: str) -> list[dict[str, Any]]:
    traces = next(block.figure["data"] for block in drawing.blocks if isinstance(block, Picture))
    return [trace for trace in traces if trace["name"] == name]


def words(drawing: Section) -> str:
    return "".join(block.text for block in drawing.blocks if isinstance(block, Words))


def test_deviations_of_both_results_are_in_one_picture(given: Arguments) -> None:
    found = truearm.iso9283_evaluate(**given)
    drawn = pictures(found)
    other, own = named(drawn["paths"], "other result"), named(drawn["paths"], "barycentre")
    assert len(other) == len(own) == 4
    for one, beside in zip(own, other, strict=True):  # it is beside itself
        assert beside["y"] == pytest.approx(one["y"], abs=1e-3)
        assert beside["line"]["dash"] == "dash"
    assert "Dashed: the barycentre of the other result." in words(drawn["paths"])
    arrows = named(drawn["accuracy"], "of the other result")
    assert len(arrows) == 1
    np.testing.assert_allclose(
        np.array(arrows[0]["z"], dtype=float)[1::3],
        np.array(named(drawn["accuracy"], "barycentre")[0]["z"], dtype=float),
        atol=0.05,
    )
    assert "The pale ones are those of the other result." in words(drawn["accuracy"])


def test_a_result_alone_has_no_other_one_in_its_pictures(given: Arguments) -> None:
    drawn = pictures(truearm.iso9283_evaluate(**{**given, "compare": None}))
    assert named(drawn["paths"], "other result") == []
    assert named(drawn["accuracy"], "of the other result") == []
    assert "other" not in words(drawn["paths"]) + words(drawn["accuracy"])


def _older(result: dict[str, Any]) -> None:
    del result["curves"], result["offsets"]


def _tied_otherwise(result: dict[str, Any]) -> None:
    result["alignment"]["kind"] = "controller-frame"


def _holes(result: dict[str, Any]) -> None:
    for curve in result["curves"]:
        curve["distance_mm"][3] = None


@pytest.mark.parametrize(("change", "curves"), [(_older, 0), (_tied_otherwise, 0), (_holes, 4)])
def test_what_the_other_result_does_not_have_is_not_drawn(
    change: Callable[[dict[str, Any]], None], curves: int, given: Arguments, tmp_path: Path
) -> None:
    other = json.loads(given["compare"].read_text())
    change(other)
    (tmp_path / RESULT).write_text(json.dumps(other))
    found = truearm.iso9283_evaluate(**{**given, "compare": tmp_path / RESULT})
    assert len(named(pictures(found)["paths"], "other result")) == curves
    assert ("of the other result" in found.contents()["report.html"]) == (curves > 0)


def test_several_velocities_are_broken_behind_commas(given: Arguments) -> None:
    page = truearm.iso9283_evaluate(**given).contents()["report.html"]
    assert "<td>50\u00a0%:\u00a0" in page
    assert '<td class="n">50\u00a0%' not in page


def test_the_warning_names_the_components_that_the_instrument_is_too_coarse_for(tmp_path: Path) -> None:
    for name, text in performance_files().items():
        (tmp_path / name).write_text(text)
    files: Arguments = {"poses": tmp_path / "poses.csv", "alignment": tmp_path / "alignment.yaml"}
    found = truearm.iso9283_evaluate(tmp_path / PLAN, **files, noise=1e-3)
    (said,) = [notice.message for notice in found.warnings if notice.code == "instrument-too-coarse"]
    coarse = {(value.id, value.component) for value in found.values if value.status == "instrument-too-coarse"}
    assert ("RP", "position") in coarse
    assert "more" not in said.partition("values of")[2].partition(". They")[0]
    for id_, component in coarse:
        inside = said.partition(f" {id_}")[2]
        assert component == "position" or component in inside.partition(")")[0]
