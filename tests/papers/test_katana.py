"""The Katana's studies, and what they share."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.papers.small import row, small

from papers import katana_influence, katana_tilting
from papers.katana.pose_errors import pose_errors, tip_poses, true_poses, zxz
from papers.katana.robot import NAMES, TIP, Published, deviations, katana, published
from papers.katana.tilting import TILTING, compliance, twin, with_tilting
from papers.study import Study
from papers.texts import printed_in
from truearm.engine.twin.twin import Twin


def turn(axis: str, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]] if axis == "z" else [[1, 0, 0], [0, c, -s], [0, s, c]])


@pytest.mark.parametrize("angles", [(0.3, 1.2, -2.5), (-3.0, 0.1, 3.0), (2.0, 3.0, 1.0)])
def test_zxz_angles_come_back(angles: tuple[float, float, float]) -> None:
    phi, theta, psi = angles
    R = turn("z", phi) @ turn("x", theta) @ turn("z", psi)
    assert zxz(R[None])[0] == pytest.approx(angles)


def test_errors_of_angles_go_the_short_way_round() -> None:
    rotations = [turn("z", phi) @ turn("x", 1.0) for phi in (math.pi - 0.01, 0.01 - math.pi)]
    here, there = ((np.zeros((1, 3)), R[None]) for R in rotations)
    errors = pose_errors(here, there)
    assert errors["dPhi"] == pytest.approx(math.degrees(0.02))
    assert errors["dTheta"] == pytest.approx(0.0, abs=1e-9)


def test_errors_of_positions_are_in_millimetres() -> None:
    R = turn("x", 1.0)[None]
    errors = pose_errors((np.array([[1e-3, -2e-3, 2e-3]]), R), (np.zeros((1, 3)), R))
    assert [float(errors[name][0]) for name in ("dX", "dY", "dZ", "dP")] == pytest.approx([1, 2, 2, 3])


def test_a_point_that_stands_for_the_tool_link_leans_like_it() -> None:
    """Table 3.2: as a point with y and z, and as a frame of a twin that composes matrices."""
    true = published("standard")
    point = katana().with_values({n: true.values[n] for n in NAMES})
    q = katana().random_configurations(5, np.random.default_rng(0))
    (p, R), (p_true, R_true) = tip_poses(point, q), true_poses(Twin(true), q)
    assert p == pytest.approx(p_true, abs=1e-12)
    assert pytest.approx(R_true, abs=1e-7) == R
    assert np.abs(tip_poses(katana(), q)[1] - R_true).max() > 1e-4


def test_the_tool_link_of_table_3_2_ends_where_the_document_has_it() -> None:
    """Rx(alpha_6) Tz(d_6) behind frame 5, by hand."""
    lean = math.radians(90.03)
    end = np.array([0.0, -math.sin(lean), math.cos(lean)]) * 0.200001
    robot = published("standard")
    q = np.zeros((1, 5))
    fifth = Twin(robot).postures(q)[0].links[-1]
    assert robot.world_poses(q, TIP)[0][0] == pytest.approx(fifth[:3, :3] @ end + fifth[:3, 3], abs=1e-12)


def test_a_stiffness_of_table_4_4_is_kilogram_force_metres_a_degree() -> None:
    moment = 122 * 9.80665  # N m turn joint 1 by a degree
    assert compliance(122.0) * moment == pytest.approx(math.radians(1.0))


def test_twin_and_model_tilt_alike() -> None:
    q = katana().random_configurations(20, np.random.default_rng(3))
    model = with_tilting(katana(), TILTING)
    true = true_poses(twin(katana()), q)[0]
    left = np.linalg.norm(model.world_poses(q, TIP)[0] - true, axis=1)
    assert np.quantile(left, 0.1) < 1e-9  # elsewhere some moment is near zero, where the twin's backlash jumps
    assert np.median(np.linalg.norm(katana().world_poses(q, TIP)[0] - true, axis=1)) > 1e-4


@pytest.mark.parametrize(("table", "name"), [("least_squares_3_2", "standard"), ("influence_3_3", "influence")])
def test_printed_tables_are_those_of_the_robot_file(table: str, name: Published) -> None:
    found = deviations({**published(name).values, "target_tip_y": 0.0, "target_tip_z": 0.0})
    printed = printed_in(katana_influence.__file__, table)
    assert len(printed) == 17
    for parameter, value in printed.items():
        if parameter not in ("alpha 5", "d 6"):  # of the tool link, which is the tip here
            assert found[parameter] == pytest.approx(float(value), abs=1e-9)


@pytest.mark.parametrize("method", ["before", "conventional, geometry alone", "two-stage, tilting first"])
def test_means_of_table_4_6_are_those_of_its_ten_rows(method: str) -> None:
    ten, unseen = (printed_in(katana_tilting.__file__, table) for table in ("ten", "unseen"))
    rows = [float(ten[f"{method}, {rank} of 10"]) for rank in range(1, 11)]
    assert rows == sorted(rows)
    assert f"{sum(rows) / 10:.3f}" == unseen[f"{method}, mean"]
    assert rows[-1] == float(unseen[f"{method}, largest"])


def median(found: Study, words: str, what: str) -> float:
    return row(found, words, what).median


def test_influence() -> None:
    found = small("katana-influence")
    assert found.seeds == 2
    assert {"agrees", "differs"} <= {one.verdict for one in found.rows}
    table = "The methods side by side, on unseen poses"
    joint, one_by_one = (
        median(found, table, f"Table 3.2: {method}")
        for method in ("joint least squares", "influence-based, pose by pose")
    )
    assert joint < 0.02 < 0.2 < one_by_one < median(found, table, "Table 3.2: before")
    assert "does not beat" in found.answer
    tables = {table.title: table.rows for table in found.tables}
    theta = {
        method: tables[f"Table 3.{n} parameter by parameter: {method}"][1]
        for n, method in ((2, "joint least squares"), (3, "influence-based, pose by pose"))
    }
    assert theta["joint least squares"].verdict == "by construction"
    assert theta["influence-based, pose by pose"].verdict == "differs"
    influence = "Influence of +0.05 deg and +0.1 mm"
    assert median(found, influence, "a 3, a 4, d 5, d 6") == pytest.approx(0.1)
    third, fourth = (
        median(found, influence, what) for what in ("theta 3, at theta 4 = 80 deg and all others 0", "theta 4, there")
    )
    assert fourth > third
    assert "Plotly" in found.html()


def test_tilting() -> None:
    found = small("katana-tilting")
    left = "What is left of the conventional calibration's error on unseen poses"
    assert median(found, left, "two-stage, tilting first") < 15
    assert median(found, left, "before any calibration") > 100
    constants = next(table for table in found.tables if table.title.startswith("Constants"))
    for constant in constants.rows[:-1]:
        assert constant.verdict == "by construction"
    (ten,) = (table.rows for table in found.tables if table.title.startswith("|dP| of ten"))
    assert len(ten) == 30
    for column in range(3):
        ranked = [one.median for one in ten[10 * column : 10 * column + 10]]
        assert ranked == sorted(ranked)
    side_by_side = "The methods side by side, on unseen poses"
    by_influence, tilting, conventional = (
        median(found, side_by_side, method)
        for method in (
            "tilting first, then influence-based pose by pose",
            "two-stage, tilting first",
            "conventional, geometry alone",
        )
    )
    assert tilting < 0.1 * by_influence
    assert tilting < 0.15 * conventional
    contradictions = found.tables[-1].rows
    assert [one.median < 0 for one in contradictions[:3]] == [False, False, True]
    assert contradictions[-1].verdict == "differs"
    assert {picture.name for picture in found.pictures} == {"poses", "errors"}


def test_trajectory() -> None:
    found = small("katana-trajectory")
    predicted = "Predicted distance from the circle, by cause"
    half, full, stiffness = (
        median(found, predicted, f"{cause}, mean") for cause in ("tilting", "tilting, full gap", "stiffness alone")
    )
    assert stiffness < 0.07 < 0.3 < half < full
    slow, fast = (median(found, predicted, f"tilting, {speed} m/s against rest, largest") for speed in ("0.1", "1"))
    assert 0 < slow < fast
    followed = "Corrected and followed by the twin: geometry from poses"
    before, geometric, tilting = (
        median(found, followed, f"{what}, mean") for what in ("before", "geometric", "with tilting")
    )
    assert tilting < geometric < before
    left = "What is left when all tilting is corrected"
    assert median(found, left, "joint 1 without backlash, model told exactly") < 0.02
    moments = "Moments of the load along the circle"
    about, across = (median(found, moments, f"joint 1, {way} its axis, largest") for way in ("about", "across"))
    assert about < 0.1 * across
    assert {picture.name for picture in found.pictures} == {
        "robot",
        "joints",
        "about",
        "across",
        "predicted",
        "followed",
    }
