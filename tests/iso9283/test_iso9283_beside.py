"""Two results of tests by ISO 9283 in one picture, and what a report says in its first lines."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.iso9283.campaign_files import Arguments, evaluated, notices, planned_in
from tests.performance_plan import small_plan

from truearm.engine.document.document import Picture, Section, Words
from truearm.iso9283.evaluating.evaluate import RESULT, Iso9283Evaluation
from truearm.iso9283.evaluating.figures import pose_pictures
from truearm.iso9283.evaluating.report import path_pictures

READ = ("poses", "paths")


@pytest.fixture(scope="module")
def arguments(tmp_path_factory: pytest.TempPathFactory) -> Arguments:
    """Return the arguments of poses and paths that were measured, and a first result beside them."""
    folder = tmp_path_factory.mktemp("beside")
    plan = small_plan(["AP", "AT"], cycles={"AP": 5, "AT": 3}, velocities=(1.0, 0.5))
    arguments = planned_in(folder, plan, rate=100.0)
    evaluated(arguments, "poses", "paths", out=folder / "first")
    return arguments | {"compare": folder / "first" / RESULT}


def pictures(result: Iso9283Evaluation) -> dict[str, Section]:
    inside = result.evaluation
    drawn = [
        *pose_pictures(result.plan, inside.clouds, inside.drift, inside.settling, inside.pushes, result.comparison),
        *path_pictures(inside, result.comparison),
    ]
    return {block.name: section for section in drawn for block in section.blocks if isinstance(block, Picture)}


def named(drawing: Section, name: str) -> list[dict[str, Any]]:
    traces = next(block.figure["data"] for block in drawing.blocks if isinstance(block, Picture))
    return [trace for trace in traces if trace["name"] == name]


def words(drawing: Section) -> str:
    return "".join(block.text for block in drawing.blocks if isinstance(block, Words))


def test_deviations_of_both_results_are_in_one_picture(arguments: Arguments) -> None:
    result = evaluated(arguments, *READ, compare=arguments["compare"])
    drawn = pictures(result)
    other, own = named(drawn["paths"], "other result"), named(drawn["paths"], "barycentre")
    assert len(other) == len(own) == 4
    for trace, beside in zip(own, other, strict=True):  # it is beside itself
        assert beside["y"] == pytest.approx(trace["y"], abs=1e-3)
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


def test_a_result_alone_has_no_other_one_in_its_pictures(arguments: Arguments) -> None:
    drawn = pictures(evaluated(arguments, *READ))
    assert named(drawn["paths"], "other result") == named(drawn["accuracy"], "of the other result") == []
    assert "other" not in words(drawn["paths"]) + words(drawn["accuracy"])


def _holes(result: dict[str, Any]) -> None:
    for curve in result["curves"]:
        curve["distance_mm"][3] = None


@pytest.mark.parametrize(
    ("change", "curves"),
    [
        (lambda result: [result.pop(name) for name in ("curves", "offsets")], 0),
        (lambda result: result["alignment"].update(kind="controller-frame"), 0),
        (_holes, 4),
    ],
)
def test_what_the_other_result_does_not_have_is_not_drawn(
    change: Callable[[dict[str, Any]], object], curves: int, arguments: Arguments, tmp_path: Path
) -> None:
    other = json.loads(arguments["compare"].read_text())
    change(other)
    (tmp_path / RESULT).write_text(json.dumps(other))
    result = evaluated(arguments, *READ, compare=tmp_path / RESULT)
    assert len(named(pictures(result)["paths"], "other result")) == curves
    assert ("of the other result" in result.contents()["report.html"]) == (curves > 0)


def test_several_velocities_are_broken_behind_commas(arguments: Arguments) -> None:
    page = evaluated(arguments, *READ, compare=arguments["compare"]).contents()["report.html"]
    assert "<td>50\u00a0%:\u00a0" in page
    assert '<td class="n">50\u00a0%' not in page


def test_the_warning_names_the_components_that_the_instrument_is_too_coarse_for(small: Arguments) -> None:
    result = evaluated(small, "poses", noise=1e-3)
    notice = notices(result)["instrument-too-coarse"]
    assert notice.level == "warning"
    coarse = {(value.id, value.component) for value in result.values if value.status == "instrument-too-coarse"}
    assert ("RP", "position") in coarse
    assert "more" not in notice.message.partition("values of")[2].partition(". They")[0]
    for id_, component in coarse:
        inside = notice.message.partition(f" {id_}")[2]
        assert component == "position" or component in inside.partition(")")[0]
