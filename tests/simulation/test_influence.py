from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pytest
from tests.katana import katana

from papers.katana.robot import NAMES, PERTURBATIONS
from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin
from truearm.simulation.influences import Influence, influence

HALF = math.radians(0.025)
EIGHTY = math.radians(80)


def configurations(n: int = 40) -> Array:
    return katana().random_configurations(n, np.random.default_rng(5))


def at(**degrees: float) -> Array:
    return np.deg2rad([[degrees.get(f"q{i}", 0.0) for i in range(1, 6)]])


def test_lengths_move_the_tip_by_as_much_as_they_change() -> None:
    names = [f"{column}_{i}" for column in "ad" for i in range(1, 6)]
    size = influence(katana(), configurations(), names, "tip").size
    np.testing.assert_allclose(size, 1e-4, rtol=1e-9)


@pytest.mark.parametrize(
    ("q", "name", "distance"),
    [
        (at(q2=70, q5=33), "theta_offset_5", 0.2),  # the attachment stands across axis 5
        (at(q4=80), "theta_offset_4", 0.1473),
        (at(q4=80, q5=90), "theta_offset_4", math.hypot(0.1473, 0.2)),
        (at(q4=80), "theta_offset_3", math.hypot(0.139 - 0.1473 * math.sin(EIGHTY), 0.1473 * math.cos(EIGHTY))),
        (at(q4=-90), "theta_offset_2", 0.19 + 0.139 + 0.1473),  # stretched
        (at(q4=-90, q5=-90), "alpha_3", 0.2),  # the attachment stands across the stretched arm
    ],
)
def test_angles_move_the_tip_by_the_chord_about_their_axis(q: Array, name: str, distance: float) -> None:
    size = influence(katana(), q, [name], "tip").size
    assert size[0, 0] == pytest.approx(2 * distance * math.sin(HALF), rel=1e-6)


def test_at_80_degrees_joint_4_has_more_influence_than_joint_3() -> None:
    """The example of section 3.6."""
    result = influence(katana(), at(q4=80), NAMES, "tip", PERTURBATIONS)
    size = dict(zip(result.names, result.size[:, 0], strict=True))
    assert size["theta_offset_4"] > 4 * size["theta_offset_3"]


def test_in_a_cube_before_the_arm_the_averages_are_those_of_the_document() -> None:
    """Section 3.6: theta 2 has 0.34 mm and is the most influential, alpha 2, here alpha_3, has 0.59 of it.

    Where the document's 118 poses lie is not printed; these lie in a cube of 300 mm, 450 mm before the shoulder.
    """
    robot = katana()
    q = robot.random_configurations(60_000, np.random.default_rng(0))
    inside = (np.abs(robot.world_poses(q, "tip")[0] - [0.0, 0.45, 0.0]) < 0.15).all(axis=1)
    result = influence(robot, q[inside], NAMES, "tip", PERTURBATIONS)
    mean = dict(zip(result.names, 1e3 * result.mean, strict=True))
    assert inside.sum() > 118
    assert mean["theta_offset_2"] == pytest.approx(0.34, abs=0.02)
    assert mean["alpha_3"] / mean["theta_offset_2"] == pytest.approx(0.59, abs=0.04)


def test_the_most_influential_parameter_depends_on_the_configuration() -> None:
    result = influence(katana(), configurations(500), NAMES, "tip", PERTURBATIONS)
    theta_2, theta_3 = result.size[1], result.size[2]
    assert (theta_2 > theta_3).any()
    assert (theta_3 > theta_2).any()
    assert result.greatest[2] > result.least[1]


@pytest.mark.parametrize("robot", ["katana450", "irb120", "kr5"])
def test_influence_is_what_the_perturbed_twin_shows(robot: str) -> None:
    """Its frames are products of matrices, one configuration after the other."""
    true = truth_twin(load_robot(robot), "random", np.random.default_rng(2)).robot
    target = true.targets[0].name
    names = [n for n, p in true.parameters.items() if p.group in ("geometry", "joint zero", "target")]
    q = true.random_configurations(3, np.random.default_rng(3))
    result = influence(true, q, names, target)
    for row, name in zip(result.size, names, strict=True):
        step = {"rad": math.radians(0.05), "m": 1e-4}[true.parameters[name].unit]
        moved = Twin(true.with_values({name: true.values[name] + step}))
        apart = [moved.target_frames(r)[target] - Twin(true).target_frames(r)[target] for r in q]
        np.testing.assert_allclose(row, [np.linalg.norm(T[:3, 3]) for T in apart], rtol=0, atol=1e-14)


def test_where_the_robot_stands_does_not_matter() -> None:
    robot, q = katana(), configurations()
    station = truth_twin(robot, "nominal", np.random.default_rng(0)).robot.base
    moved = robot.with_frames(station, {"tip": (0.0, 0.0, 0.0)})
    size, elsewhere = (influence(r, q, NAMES, "tip", PERTURBATIONS).size for r in (robot, moved))
    np.testing.assert_allclose(elsewhere, size, rtol=1e-9)


def test_joint_effects_are_felt_and_can_be_perturbed() -> None:
    robot = katana().with_effects(["gain"])
    result = influence(robot, at(q5=90), ["gain_5", "gain_1"], "tip", {"gain_5": 1e-3, "gain_1": 1e-3})
    assert result.size[0, 0] == pytest.approx(2 * 0.2 * math.sin(1e-3 * math.pi / 4), rel=1e-9)
    assert result.size[1, 0] == 0.0


def test_the_influence_vector_is_relative_to_the_most_influential_of_each_configuration() -> None:
    size = np.array([[1.0, 4.0], [2.0, 1.0], [0.0, 2.0]])
    result = Influence(("a", "b", "c"), np.ones(3), size)
    np.testing.assert_array_equal(result.vector, [[0.5, 1.0], [1.0, 0.25], [0.0, 0.5]])
    np.testing.assert_array_equal([result.mean, result.least, result.greatest], [[2.5, 1.5, 1], [1, 1, 0], [4, 2, 2]])


def test_no_influence_at_all_has_no_most_influential_parameter() -> None:
    robot = load_robot("katana450")
    on_axis_5 = robot.with_frames(robot.base, {"tip": (0.0, 0.0, -0.2)})
    result = influence(on_axis_5, configurations(3), ["theta_offset_5"], "tip")
    assert result.greatest[0] < 1e-15
    with pytest.raises(InputError, match=r"configuration 1: none of the parameters moves the tip") as error:
        _ = result.vector
    assert error.value.cure


@pytest.mark.parametrize(
    ("names", "perturbations", "message"),
    [
        ([], None, "no parameter is named"),
        (["theta_ofset_2"], None, "no such parameter.*theta_offset_2"),
        (["a_3", "a_4", "a_3"], None, "named twice.*a_3"),
        (["gain_2"], None, r"gain_2: the document has no perturbation.*allowed: rad, m\. Give its perturbation"),
        (["a_3"], {"a_4": 1e-4}, "not named.*a_4"),
        (["a_3"], {"a_3": 0.0}, "a_3: the perturbation is no size.*allowed: above 0"),
        (["a_3"], {"a_3": -1e-4}, "no size"),
        (["a_3"], {"a_3": math.nan}, "no size"),
    ],
)
def test_what_cannot_be_perturbed_is_refused(
    names: list[str], perturbations: Mapping[str, float] | None, message: str
) -> None:
    robot = katana().with_effects(["gain"])
    with pytest.raises(InputError, match=message):
        influence(robot, configurations(), names, "tip", perturbations)


def test_no_configuration_is_refused() -> None:
    with pytest.raises(InputError, match="no configuration"):
        influence(katana(), np.zeros((0, 5)), NAMES, "tip")


def test_an_unknown_tip_is_refused() -> None:
    with pytest.raises(InputError, match=r"no target of this name.*tipp.*tip"):
        influence(katana(), configurations(), NAMES, "tipp")
