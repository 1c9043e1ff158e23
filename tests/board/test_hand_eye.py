"""A camera and a board: robot, mount and board identified together, against the truth and against OpenCV."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.expecting import known
from tests.hand_eye import (
    BOARD,
    PICTURED,
    PICTURED_TEXT,
    SIZE,
    Cell,
    cell,
    configurations,
    errors,
    frames,
    pictures,
    poses_of,
    projected,
    table_of,
    table_of_pictures,
)

import truearm
from truearm.board.readings import ImportedHandEye, read_hand_eye
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.fit import Status, identify
from truearm.engine.fit.models import named_model
from truearm.engine.fit.problem import Problem
from truearm.engine.robot.chain import Array, Chain, Element
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import Transform, rigid_motion

UR5E = load_robot("ur5e")
GEOMETRIC = named_model("geometric")
PX = 0.3
VIEWS = 30


@cache
def campaign(on_flange: str, seed: int, scale: float = 1.0) -> tuple[Cell, Array, Array, Array]:
    """Return a cell, 30 configurations and where the board is in them by corners that are off by 0.3 px, 40 unseen."""
    there, rng = cell(seed, on_flange), np.random.default_rng(100 + seed)
    q = configurations(there, VIEWS + 40, rng)
    true = there.views(q[:VIEWS])
    corners = projected(true, scale) + PX * rng.standard_normal((VIEWS, BOARD.corners, 2))
    views, sigma, sigma_rot = poses_of(corners, true, PX)
    return there, q, views, np.array([sigma, sigma_rot])


def imported(folder: Path, on_flange: str, seed: int, scale_sigma: float | None = None) -> ImportedHandEye:
    _, q, views, (sigma, sigma_rot) = campaign(on_flange, seed)
    path = folder / "views.csv"
    path.write_text(table_of(q[:VIEWS], views, sigma, sigma_rot))
    return truearm.import_hand_eye(path, on_flange=on_flange, scale_sigma=scale_sigma)  # type: ignore[arg-type]


def seen_from_the_other(there: Cell, joints: Array) -> Array:
    """Return the true place of what is on the flange, from what stands beside the robot, ``(n, 4, 4)``."""
    return np.asarray(np.linalg.inv(there.beside) @ there.twin.frames(joints)[there.on_flange])


def without_gauge(found: Array, true: Array) -> Array:
    """Return a frame turned about z and moved along it, on the left, so that it fits another one best."""
    D = true[:3, :3] @ found[:3, :3].T
    angle = np.arctan2(D[1, 0] - D[0, 1], D[0, 0] + D[1, 1])
    G = np.eye(4)
    G[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    moved = G @ found
    moved[2, 3] = true[2, 3]
    return np.asarray(moved)


def product(elements: tuple[Element, ...], robot: Robot) -> Array:
    k = Chain(elements).forward_kinematics(np.zeros((6, 1)), robot.values)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = k.matrix()[0], k.position[:, 0]
    return T


def behind_axis_6(robot: Robot, target: str, ahead: float) -> Array:
    """Return the camera or board in the frame before joint 6: what a turn about that and a slide along it leave."""
    T = product(robot.link_elements[-1], robot) @ product((*robot.target(target).chain.elements,), robot)
    T[:3, 3] -= ahead * T[:3, 2]
    return T


@pytest.mark.parametrize(("on_flange", "seed"), [("camera", 0), ("board", 1)])
def test_robot_mount_and_the_other_one_are_found_together(on_flange: str, seed: int, tmp_path: Path) -> None:
    there, q, _, _ = campaign(on_flange, seed)
    read = imported(tmp_path, on_flange, seed)
    fit = identify(UR5E, read.data, GEOMETRIC)
    assert fit.status is Status.CONVERGED
    assert fit.excess == 1.0  # the deviations are what the corners leave
    unseen, base = q[VIEWS:], product(fit.robot.base_elements, fit.robot)
    other = without_gauge(np.asarray(np.linalg.inv(base)), there.beside)  # in the base: what theta_1 and d_1 leave
    in_base = other @ frames(fit.robot, unseen, on_flange, read.ahead)
    assert errors(in_base, there.twin.frames(unseen)[on_flange])[0] < 0.2e-3
    assert errors(other[None], there.beside[None])[0] < 0.2e-3
    true_mount = behind_axis_6(there.twin.robot, on_flange, 0.0)
    mount = without_gauge(behind_axis_6(fit.robot, on_flange, read.ahead), true_mount)
    apart, turned = errors(mount[None], true_mount[None])
    assert (apart < 0.2e-3, turned < 1e-3) == (True, True)
    nominal = errors(frames(fit.start, unseen, on_flange, read.ahead), seen_from_the_other(there, unseen))
    ours = errors(frames(fit.robot, unseen, on_flange, read.ahead), seen_from_the_other(there, unseen))
    assert ours[0] < 0.1 * nominal[0]


@pytest.mark.parametrize(("on_flange", "seed"), [("camera", 0), ("board", 1)])
def test_it_is_better_than_opencv_with_the_robot_as_it_is_named(on_flange: str, seed: int, tmp_path: Path) -> None:
    cv2 = pytest.importorskip("cv2", reason="OpenCV (truearm[vision]) is not installed")
    there, q, views, _ = campaign(on_flange, seed)
    read = imported(tmp_path, on_flange, seed)
    fit = identify(UR5E, read.data, GEOMETRIC)
    unseen = q[VIEWS:]
    true = seen_from_the_other(there, unseen)

    def by_opencv(robot: Robot) -> float:
        bare = robot.with_frames(Transform(), {"flange": Transform()})
        flange = frames(bare, q[:VIEWS], "flange")
        moving = flange if on_flange == "camera" else np.linalg.inv(flange)
        parts = [[*block] for block in (moving[:, :3, :3], moving[:, :3, 3], views[:, :3, :3], views[:, :3, 3])]
        R, t = cv2.calibrateHandEye(*parts, method=cv2.CALIB_HAND_EYE_PARK)
        X = np.eye(4)
        X[:3, :3], X[:3, 3] = R, t[:, 0]
        U, _, Vt = np.linalg.svd((moving @ X @ views)[:, :3, :3].mean(axis=0))
        far = np.eye(4)
        far[:3, :3] = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
        far[:3, 3] = (moving @ X @ views)[:, :3, 3].mean(axis=0)
        at = frames(bare, unseen, "flange")
        predicted = np.linalg.inv(far) @ at @ X if on_flange == "camera" else np.linalg.inv(X) @ at @ far
        return errors(predicted, true)[0]

    ours = errors(frames(fit.robot, unseen, on_flange, read.ahead), true)[0]
    assert 3.0 * ours < by_opencv(fit.start)
    assert ours < by_opencv(fit.robot)


def test_a_scale_that_is_not_known_exactly_is_a_parameter(tmp_path: Path) -> None:
    there, q, views, (sigma, sigma_rot) = campaign("camera", 2, 1.002)
    path = tmp_path / "views.csv"
    path.write_text(table_of(q[:VIEWS], views, sigma, sigma_rot))
    exact = truearm.import_hand_eye(path, on_flange="camera").data
    loose = truearm.import_hand_eye(path, on_flange="camera", scale_sigma=5e-3).data
    trusting, doubting = identify(UR5E, exact, GEOMETRIC), identify(UR5E, loose, GEOMETRIC)
    assert "instrument_scale" not in trusting.robot.parameters
    scale = doubting.robot.parameters["instrument_scale"]
    assert doubting.status is Status.CONVERGED
    assert abs(scale.value - 0.002) < 2.5 * known(scale.deviation)
    assert 2e-4 < known(scale.deviation) < 4e-3  # the nominal lengths, good to 1 mm each, tell that much
    spread = [f.robot.parameters["a_2"].deviation or 0.0 for f in (trusting, doubting)]
    assert spread[1] > 2.0 * spread[0]

    # files keep it, and held-out readings of the same board are compared with it
    again = read_csv(_written(tmp_path / "data.csv", csv_text(loose)))
    assert again.scale_sigma == 5e-3
    assert csv_text(again) == csv_text(loose)
    kept = read_robot(_written(tmp_path / "robot.yaml", robot_text(doubting.robot)))
    assert kept.parameters["instrument_scale"] == scale
    with_it, without = (errors_of(kept, d).position_norms.mean() for d in (again, exact))
    assert with_it < without
    # an instrument whose scale is exact leaves none behind
    assert "instrument_scale" not in identify(kept, exact, GEOMETRIC).robot.parameters
    assert "instrument_scale" not in identify(UR5E, loose, GEOMETRIC, redundancy="drop").free.names
    assert there.on_flange == "camera"


def test_the_scale_moves_readings_as_its_derivative_says() -> None:
    _, q, _, _ = campaign("camera", 0)
    robot = UR5E.with_frames(Transform((0.1, 0.2, 0.3)), {"tip": (0.1, 0.0, 0.2)}).with_scale(1e-3)
    data = replace(Dataset.of(q[:5], np.ones((5, 3)), targets=["tip"], sigma=1.0), scale_sigma=1e-3)
    problem = Problem(robot, data, GEOMETRIC.free(robot), {"position": 1.0})
    at = problem.free.start
    at[problem.free.names.index("instrument_scale")] = 2e-3
    _, J = problem.linearised(at)
    for k in range(len(at)):
        step = np.zeros(len(at))
        step[k] = 1e-6
        ahead, back = problem.residual(at + step), problem.residual(at - step)
        np.testing.assert_allclose(J[:, k], (ahead - back) / 2e-6, rtol=0, atol=1e-8)
    many = problem.at(np.array([at, problem.free.start])).residual
    np.testing.assert_allclose(many[0], problem.residual(at), rtol=0, atol=1e-15)


def aligned(there: Cell, robot: Robot, joints: Array, ahead: float) -> float:
    """Return the mean error behind a rigid motion [m]: what the lens is wrong by is where the camera seems to be."""
    true = seen_from_the_other(there, joints)[:, :3, 3]
    found = frames(robot, joints, there.on_flange, ahead)[:, :3, 3]
    R, t = rigid_motion(found, true)
    return float(np.linalg.norm(found @ R.T + t - true, axis=1).mean())


@pytest.mark.parametrize("on_flange", ["camera", "board"])
def test_pictures_calibrate_the_lens_and_the_robot(on_flange: str, tmp_path: Path) -> None:
    pytest.importorskip("cv2", reason="OpenCV (truearm[vision]) is not installed")
    there, rng = cell(3, on_flange), np.random.default_rng(1)
    q = configurations(there, 30, rng)
    size = (SIZE[0] // 3, SIZE[1] // 3)
    lens = np.array([[770.0, 0.0, size[0] / 2 + 4], [0.0, 771.0, size[1] / 2 - 3], [0.0, 0.0, 1.0]])
    bent = np.array([-0.08, 0.03, 4e-4, -3e-4, 0.0])
    pictures(tmp_path, there.views(q[:12]), rng, size, lens, bent)
    table = _written(tmp_path / "views.csv", table_of_pictures(q[:12]))
    read = truearm.import_hand_eye(table, on_flange=on_flange, board=PICTURED_TEXT)  # type: ignore[arg-type]
    found = known(read.lens)
    assert found.noise < 0.3
    true = {"fx": 770.0, "fy": 771.0, "cx": lens[0, 2], "cy": lens[1, 2], "k1": -0.08, "p1": 4e-4, "p2": -3e-4}
    for name, value in true.items():
        assert abs(found.values[name] - value) < 4.0 * found.deviations[name], name
    assert found.deviations["fx"] < 2.0
    kept = read_hand_eye(table, on_flange, PICTURED).views  # type: ignore[arg-type]
    apart = kept.position - there.views(q[:12])[:, :3, 3]  # the lens is a little long or short in all of them
    assert np.ptp(apart, axis=0).max() < 4e-3
    fit = identify(UR5E, read.data, GEOMETRIC)
    unseen = q[12:]
    assert aligned(there, fit.robot, unseen, read.ahead) < 0.35 * aligned(there, fit.start, unseen, read.ahead)
    text = "\n".join(read.lines())
    assert ("12 configurations, target" in text, "lens: fx 7" in text) == (True, True)
    assert read.summary()["lens"]["noise_px"] == found.noise


def test_the_point_before_the_camera_is_known_better_than_the_camera(tmp_path: Path) -> None:
    read = imported(tmp_path, "camera", 0)
    views = read_hand_eye(tmp_path / "views.csv", "camera", None).views
    _, _, at_camera, turned = views.camera_in_board(0.0)
    _, _, ahead, same = views.camera_in_board(read.ahead)
    assert known(ahead).mean() < 0.5 * known(at_camera).mean()
    np.testing.assert_array_equal(known(turned), known(same))


def _written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path
