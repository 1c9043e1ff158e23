"""The hexapod device against the printed figures, and against paths that are not its own."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.data.hexapod import (
    CUPS,
    DEVICE,
    Design,
    assemblies,
    designs,
    distance,
    distinct,
    leg_lengths,
    near_equal,
    poses,
    tool_cups,
    triangle,
    tripod,
)
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import rigid_motion
from truearm.hexapod.places import all_solutions, cup_monte_carlo, cup_uncertainty, radius_95, world_frame
from truearm.hexapod.rehearsal import ballbar, measured_legs, measured_sides

#: Nubiola, section 3.2: the three groups of near pairs, from the closest.
PRINTED = [
    [(10, 37), (46, 49), (2, 70), (34, 61), (22, 25), (13, 58)],
    [(14, 59), (35, 62), (11, 38), (47, 50), (23, 26), (3, 71)],
    [(1, 72), (12, 39), (15, 60), (48, 51), (24, 27), (36, 63)],
]
CROSSED_OUT = [1, 2, 3, 10, 11, 12, 13, 14, 15, 22, 23, 24, 34, 35, 36, 46, 47, 48]


def some_lengths(rng: np.random.Generator, n: int) -> tuple[Array, Array, Array]:
    """Base, tool and legs within +/- 1 mm of nominal."""
    base, tool, legs = (rng.uniform(-1e-3, 1e-3, (k, n)) for k in (3, 3, 6))
    return 0.300 + base, 0.150 + tool, 0.300 + legs


# -- counting -------------------------------------------------------------------------------------------------


def test_the_counts_and_the_printed_pairs() -> None:
    all_poses = poses()
    assert len(designs()) == len({design.name for design in designs()}) == 36
    assert len(set(assemblies())) == len(list(assemblies())) == 144
    assert [pose.number for pose in all_poses] == list(range(1, 73))
    assert sorted(near_equal(all_poses)) == sorted(pair for group in PRINTED for pair in group)
    numbers = [pose.number for pose in distinct(all_poses)]
    assert sorted(set(range(1, 73)) - set(numbers)) == CROSSED_OUT


def test_the_groups_lie_where_they_should_and_the_next_is_only_just_apart() -> None:
    by_number = {pose.number: pose for pose in poses()}
    for group, apart in zip(PRINTED, (11.1, 27.0, 35.7), strict=True):
        for a, b in group:
            angle, way = distance(by_number[a], by_number[b])
            assert np.degrees(angle) == pytest.approx(8.35, abs=0.005)
            assert way * 1e3 == pytest.approx(apart, abs=0.06)
    near = {pair for group in PRINTED for pair in group}
    others = [distance(by_number[a], by_number[b]) for a, b in combinations(by_number, 2) if (a, b) not in near]
    angle, way = min((angle, way) for angle, way in others if way < 0.050)
    assert np.degrees(angle) == pytest.approx(30.14, abs=0.01)
    assert way * 1e3 == pytest.approx(39.8, abs=0.05)


def test_the_names_are_the_documents() -> None:
    names = {design.name for design in designs()}
    assert {"112212331", "123223132", "131231233", "132232133"} <= names
    assert Design((0, 1, 2), (0, 1, 2)).leg_names == ("B1-T1", "B2-T1", "B3-T1", "B1-T2", "B2-T2", "B2-T3")


def test_every_pose_has_nominal_legs_and_its_flange_beyond_the_tool() -> None:
    base = triangle([0.3] * 3, "B")
    for pose in poses():
        assert leg_lengths(pose.design, base, pose.cups) == pytest.approx(np.full(6, 0.3), abs=1e-15)
        assert CUPS @ pose.rotation.T + pose.position == pytest.approx(pose.cups, abs=1e-15)
        assert np.linalg.det(pose.rotation) == pytest.approx(1)
        normal = np.cross(*(pose.cups[1:] - pose.cups[0]))
        heights = (np.vstack([base, pose.position]) - pose.cups[0]) @ normal
        assert (np.sign(heights[:3]) == -np.sign(heights[3])).all()


def test_a_flange_in_the_plane_of_the_cups_is_refused() -> None:
    with pytest.raises(InputError, match="flange lies in the plane"):
        poses(triangle([0.150] * 3, "T"))
    with pytest.raises(InputError, match="T1-T2 is beyond the range"):
        poses(CUPS * 1.01)


# -- kinematics -----------------------------------------------------------------------------------------------


def test_lengths_give_the_pose_and_the_pose_its_lengths() -> None:
    rng = np.random.default_rng(1)
    base, tool, legs = some_lengths(rng, 200)
    for design, solution in assemblies():
        cups = tool_cups(design, solution, base, tool, legs)
        assert (cups[:, 2] > 0).all()
        assert np.abs(leg_lengths(design, triangle(base, "B"), cups) - legs).max() < 1e-12  # 1e-9 mm
        for row, (a, b) in enumerate(((0, 1), (1, 2), (2, 0))):
            assert np.abs(np.linalg.norm(cups[a] - cups[b], axis=0) - tool[row]).max() < 1e-12


def test_the_four_solutions_are_different_and_one_alone_has_the_same_cups() -> None:
    design = designs()[7]
    lengths = some_lengths(np.random.default_rng(2), 1)
    cups = [tool_cups(design, solution, *(part[:, 0] for part in lengths)) for solution in (1, 2, 3, 4)]
    assert min(np.abs(a - b).max() for a, b in combinations(cups, 2)) > 0.05


def test_the_tripod_finds_a_known_point_on_either_side() -> None:
    rng = np.random.default_rng(3)
    feet = rng.uniform(-0.3, 0.3, (3, 3))
    point = rng.uniform(-0.3, 0.3, 3)
    legs = np.linalg.norm(feet - point, axis=1)
    points = [tripod(feet, legs, side, ("a", "b", "c")) for side in (1, -1)]
    assert min(np.abs(p - point).max() for p in points) < 1e-14
    for p in points:
        assert np.linalg.norm(feet - p, axis=1) == pytest.approx(legs, abs=1e-14)


def test_cups_on_a_line_and_legs_that_do_not_meet_are_refused_by_name() -> None:
    with pytest.raises(InputError, match=r"B3-B1: the cups B1, B2, B3 lie on one line"):
        triangle([0.3, 0.3, 0.6], "B")
    with pytest.raises(InputError, match=r"T2-T3: the cups T1, T2, T3 lie on one line, or no triangle"):
        triangle([0.15, 0.4, 0.15], "T")
    with pytest.raises(InputError, match=r"B1-T1, B2-T1, B3-T1: legs of these lengths do not meet; got 'B1-T1 100.000"):
        tool_cups(Design((0, 1, 2), (0, 1, 2)), 1, [0.3] * 3, [0.15] * 3, np.array([0.1] * 3 + [0.3] * 3))
    with pytest.raises(InputError, match=r"T2-T3, B2-T3, T1-T3: legs of these lengths do not meet.*B2-T3 60.000"):
        tool_cups(Design((0, 1, 2), (0, 1, 2)), 1, [0.3] * 3, [0.15] * 3, np.array([0.3] * 5 + [0.06]))
    with pytest.raises(InputError, match="three feet of these legs lie on one line"):
        tripod(np.outer([0.0, 1.0, 2.0], [1.0, 1.0, 0.0]), np.ones(3), 1, ("a", "b", "c"))


def test_a_reading_beyond_the_range_is_refused_by_name() -> None:
    DEVICE.check(0.300, 0.2990, "B1-T1")
    for length in (0.30101, 0.2989, float("nan")):
        with pytest.raises(InputError, match=r"the length B1-T1 is beyond.*allowed: 300 mm \+/- 1 mm"):
            DEVICE.check(0.300, length, "B1-T1")


# -- uncertainty ----------------------------------------------------------------------------------------------


def test_table_3_1_with_correlation_and_as_printed() -> None:
    norms = np.array([u.norms for u in all_solutions().values()])
    assert norms[:, 0] == pytest.approx([2.309] * 4, abs=5e-4)
    assert norms[:, 1] == pytest.approx([2.646, 2.646, 2.480, 2.480], abs=5e-4)
    assert norms[:, 2] == pytest.approx([3.359, 3.052, 2.886, 3.331], abs=5e-4)
    printed = [float(np.linalg.norm(u.third_as_printed)) for u in all_solutions().values()]
    assert printed == pytest.approx([3.179, 3.054, 2.853, 3.180], abs=7e-4)
    per_axis = [u.third_as_printed.tolist() for u in all_solutions().values()]
    assert per_axis[0] == pytest.approx([1.6, 2.6, 1.0], abs=0.05)
    assert per_axis[3] == pytest.approx([1.6, 2.2, 1.7], abs=0.05)


def test_monte_carlo_finds_the_correlated_figures() -> None:
    rng = np.random.default_rng(4)
    for solution, u in all_solutions().items():
        assert cup_monte_carlo(solution, 40_000, rng) == pytest.approx(u.norms, rel=0.01)
    with pytest.raises(InputError, match="two trials"):
        cup_monte_carlo(1, 1, rng)


def test_radii_of_95_percent_hold_that_many_of_measured_cups() -> None:
    """1.96 times the root of the summed variances does not: it is a half-width along a line."""
    rng, nominal = np.random.default_rng(8), np.repeat([DEVICE.base, DEVICE.tool, DEVICE.leg], (3, 3, 6))
    d = nominal[:, None] + DEVICE.sigma * rng.standard_normal((12, 200_000))
    worst = []
    for solution, u in all_solutions().items():
        cups, true = (tool_cups(Design((0, 1, 2), (0, 1, 2)), solution, x[:3], x[3:6], x[6:]) for x in (d, nominal))
        away = np.linalg.norm(cups - true[:, :, None], axis=1)
        radii = np.array(u.radii) * DEVICE.sigma
        assert (away < radii[:, None]).mean(axis=1) == pytest.approx([0.95] * 3, abs=0.002)
        worst.append((radii[2], (away[2] < 1.96 * u.norms[2] * DEVICE.sigma).mean()))
    assert worst[0] == pytest.approx((3.024e-6, 0.972), rel=2e-3)
    assert max(radius for radius, _ in worst) == worst[0][0]


def test_a_radius_of_95_percent_is_that_of_the_tables() -> None:
    """Of chi with one, two and three degrees of freedom."""
    for sizes, radius in (((4.0, 0.0, 0.0), 2 * 1.959964), ((0.0, 1.0, 1.0), 2.447747), ((1.0, 1.0, 1.0), 2.795483)):
        R, _ = np.linalg.qr(np.random.default_rng(9).standard_normal((3, 3)))
        assert radius_95(R @ np.diag(sizes) @ R.T) == pytest.approx(radius, rel=1e-6)


def test_the_covariance_is_that_of_central_differences_at_other_lengths() -> None:
    rng = np.random.default_rng(5)
    d = np.concatenate([part[:, 0] for part in some_lengths(rng, 1)])
    step = 1e-6 * np.eye(12)
    for design, solution in list(assemblies())[::31]:

        def at(x: Array, design: Design = design, solution: int = solution) -> Array:
            return tool_cups(design, solution, x[:3], x[3:6], x[6:]).reshape(9, -1)

        J = (at(d[:, None] + step) - at(d[:, None] - step)) / 2e-6
        assert cup_uncertainty(solution, design, lengths=d).covariance == pytest.approx(J @ J.T, abs=1e-7)


def test_other_designs_are_not_quite_as_the_document_takes_them() -> None:
    worst = [max(cup_uncertainty(solution, design).norms) for design, solution in assemblies()]
    assert min(worst) == pytest.approx(2.828, abs=1e-3)
    assert max(worst) == pytest.approx(3.521, abs=1e-3)


# -- the base fixture -----------------------------------------------------------------------------------------


def test_the_closed_form_is_the_best_fit_in_space() -> None:
    rng = np.random.default_rng(6)
    sides = 0.3 + rng.uniform(-1e-3, 1e-3, 3)
    triangle_ = triangle(sides, "B")
    R, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    R *= np.linalg.det(R)
    exact = triangle_ @ R.T + [0.4, -0.1, 0.05]
    fitted = world_frame(exact, sides)
    assert fitted.frame.rotation == pytest.approx(R, abs=1e-12)
    assert fitted.frame.translation == pytest.approx([0.4, -0.1, 0.05], abs=1e-13)
    assert np.abs(fitted.residual).max() < 1e-13
    points = exact + rng.normal(0, 2e-4, (3, 3))
    fitted = world_frame(points, sides)
    best, place = rigid_motion(triangle_, points)
    assert fitted.frame.rotation == pytest.approx(best, abs=1e-12)
    assert fitted.frame.translation == pytest.approx(place, abs=1e-13)
    assert fitted.plain.translation == pytest.approx(points[0], abs=1e-15)
    with pytest.raises(InputError, match="one line"):
        world_frame(np.outer([0.0, 1.0, 2.0], [1.0, 1.0, 0.0]), sides)


def test_the_distances_make_the_frame_better_by_a_tenth_and_more() -> None:
    """About 15 % in the document; 12 % with errors of the same size in all directions, 34 % with none across."""
    rng = np.random.default_rng(7)
    cups = triangle([0.3] * 3, "B")
    places = np.array([0.15, 0.087, 0.245]) + rng.normal(0, 0.1, (100, 3))

    def gain(across: float) -> float:
        errors = np.zeros(2)
        for _ in range(400):
            fitted = world_frame(cups + rng.normal(0, 1e-4, (3, 3)) * [1, 1, across], [0.3] * 3)
            for n, frame in enumerate((fitted.plain, fitted.frame)):
                off = places @ frame.rotation.T + np.array(frame.translation) - places
                errors[n] += np.linalg.norm(off, axis=1).mean()
        return float(1 - errors[1] / errors[0])

    assert 0.08 < gain(1.0) < 0.16
    assert 0.28 < gain(0.0) < 0.40


# -- the ballbar ----------------------------------------------------------------------------------------------


def test_the_ballbar_reads_within_its_range_and_drifts_until_it_is_initialised() -> None:
    pose = poses()[20]
    base = triangle([0.3] * 3, "B")
    shifted = pose.cups + np.array([0, 0, 2e-3])
    bar = ballbar(np.random.default_rng(8))
    legs = measured_legs(bar, pose.design, base, pose.cups)
    assert list(legs) == list(pose.design.leg_names)
    assert np.array(list(legs.values())) == pytest.approx(0.3, abs=3e-6)
    assert len(measured_legs(bar, pose.design, base, shifted)) < 6
    assert measured_sides(bar, base * 1.01, "B") == {}
    drifting = ballbar(np.random.default_rng(8), drift=1e-4)
    first, second = (drifting.read(np.full(4, 0.3), 0.3) for _ in range(2))
    drifting.initialise()
    assert np.diff([first.mean(), second.mean()])[0] == pytest.approx(4e-4, abs=2e-6)
    assert drifting.read(np.full(4, 0.3), 0.3).mean() == pytest.approx(first.mean(), abs=2e-6)
