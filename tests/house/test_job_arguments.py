"""What jobs refuse beyond a wrong kind of value, each time naming the parameter and what helps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.expecting import refused
from tests.house.examples import EXAMPLES
from tests.simulated import campaign

import truearm
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.fit.bounds import Bounds
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.transform import Transform

DATA: Dataset = campaign("irb120", 20, 0.05e-3, 1)[1]
EMPTY = replace(DATA, position=np.full_like(DATA.position, np.nan))
BOUNDS = Bounds.model_validate(
    {"truearm": "truearm-bounds/1", "units": {"length": "mm", "angle": "deg"}, "within": {"nothing": 1.0}}
)
TWO_FORMS = ["clearance", "clearance-linear-contact"]
FIXTURE = (0.22, 0.0, 0.1, -0.5)


def plan(**given: Any) -> object:
    return truearm.plan("irb120", **{"poses": 12, "candidates": 60, **given})


def device(**given: Any) -> object:
    return truearm.hexapod_plan("irb120", **{"fixture": FIXTURE, "tool": "triangular", **given})


@pytest.mark.parametrize(
    ("parameter", "words", "call"),
    [
        ("robot", "has no targets", lambda: truearm.validate("irb120", DATA)),
        ("robot", "has no targets", lambda: truearm.distances("irb120", DATA)),
        ("data", "number of joints differs", lambda: truearm.calibrate("li3", DATA)),
        ("data", "there is no reading", lambda: truearm.calibrate("irb120", EMPTY, model="geometric")),
        ("data", "one configuration", lambda: truearm.calibrate("irb120", DATA.of_configurations(np.array([0])))),
        (
            "data",
            "same name",
            lambda: truearm.calibrate("irb120", replace(DATA, targets=("x", "target_x", "3")), model="geometric"),
        ),
        ("bounds", "no free parameter", lambda: truearm.calibrate("irb120", DATA, bounds=BOUNDS, model="geometric")),
        ("bounds", "no such file", lambda: truearm.calibrate("irb120", DATA, bounds="nothing.yaml")),
        ("effects", "take one of them", lambda: truearm.calibrate("irb120", DATA, effects=TWO_FORMS)),
        ("data", "there is no reading", lambda: truearm.check("irb120", EMPTY)),
        ("noise", "nothing can be identified", lambda: plan(noise=0.1)),
        ("poses", "allowed: 4 or more", lambda: plan(poses=1)),
        ("candidates", "too few", lambda: plan(candidates=5)),
        ("candidates_from", "too few", lambda: plan(candidates_from=DATA.of_configurations(np.arange(5)))),
        ("candidates_from", "number of joints differs", lambda: truearm.plan("li3", poses=12, candidates_from=DATA)),
        ("fixture", "reach none", lambda: device(fixture=(2.0, 0.0, 0.1, 0.0))),
        ("fixture, arm_radius", "reach none", lambda: device(arm_radius=5.0)),
        ("fixture", "NaN", lambda: device(fixture=Transform((np.nan, 0, 0)))),
        ("fixture", "length 1", lambda: device(fixture=Transform((0.3, 0, 0), (0, 0, 0, 0)))),
        ("branches", "Did you mean front", lambda: device(branches=["frnt"])),
        ("target", "^target: there is no target; got 'x'.$", lambda: _inverse(target="x")),
    ],
)
def test_the_parameter_is_named(parameter: str, words: str, call: Callable[[], object]) -> None:
    refused(parameter, words, call)


def _inverse(**given: Any) -> Any:
    good = EXAMPLES["inverse"](Path())
    return truearm.inverse(**{**good, **given})


def test_a_seed_is_an_array_or_rows() -> None:
    seed = EXAMPLES["inverse"](Path())["seed_joints"]
    assert np.array_equal(
        _inverse(seed_joints=seed.tolist()).solutions.joints, _inverse(seed_joints=seed).solutions.joints
    )


def test_robot_and_data_the_wrong_way_round(tmp_path: Path) -> None:
    file = tmp_path / "data.csv"
    file.write_text(csv_text(DATA))
    for job in ("check", "calibrate", "validate", "distances", "axes"):
        words = rf"robot and measurements are exchanged.*Write 'truearm {job} irb120"
        refused("robot", words, getattr(truearm, job), file, "irb120")


def test_a_program_is_restored_once_and_one_configuration_is_singular(tmp_path: Path) -> None:
    program = EXAMPLES["revert"](tmp_path)["programs"][0]
    refused("programs", "given twice", truearm.revert, [program, program])
    robot = EXAMPLES["validate"](tmp_path)["robot"]
    assert truearm.validate(robot, DATA.of_configurations(np.array([0]))).lines()[1].startswith("On 1 configuration of")


def test_an_effect_counts_once() -> None:
    made = truearm.calibrate("irb120", DATA, model="offsets", effects=["gain", "gain"])
    assert "model offsets + gain, " in made.history
    assert "effects=['gain']" in made.command


def test_a_number_is_named_beside_what_it_belongs_to() -> None:
    good: dict[str, Any] = {"name": "a", "unit": "m", "group": "geometry", "nominal": 0.0, "prior": 1.0, "value": 0.0}
    for parameter, number in (("prior", -1.0), ("prior", 10**400), ("nominal", np.nan)):
        refused(parameter, f"^a, {parameter}: the number", Parameter, **{**good, parameter: number})


def test_what_came_is_shown_as_it_is() -> None:
    for came, shown in (
        (None, "got None;"),
        (b"x", "got b'x';"),
        (np.str_("irb12"), "got 'irb12';"),
        (object(), "got an object of type object;"),
        (np.array([1, 2]), "got an object of type ndarray of 2 that holds int64;"),
        (np.array(1), "got an object of type ndarray that holds int64;"),
    ):
        refused(None, shown, truearm.calibrate, came, DATA)
