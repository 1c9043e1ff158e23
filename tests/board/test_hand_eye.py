"""A camera and a board: robot, mount and board found together, against the truth and OpenCV; and their tables."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.expecting import known, refused
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
from tests.house.examples import EXAMPLES

import truearm
from truearm.board.pictures import DICTIONARIES, Charuco
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
from truearm.engine.robot.transform import (
    Transform,
    quaternion_from_rotation,
    rigid_motion,
    rotation_from_quaternion,
    rotation_from_vector,
)

UR5E = load_robot("ur5e")
GEOMETRIC = named_model("geometric")
PX = 0.3
VIEWS = 30


@cache
def campaign(on_flange: str, seed: int, scale: float = 1.0) -> tuple[Cell, Array, Array, Array]:
    """Return a cell, 30 configurations and where the board is in them by corners that are off by 0.3 px, 40 unseen."""
    seen_cell, rng = cell(seed, on_flange), np.random.default_rng(100 + seed)
    q = configurations(seen_cell, VIEWS + 40, rng)
    true = seen_cell.views(q[:VIEWS])
    corners = projected(true, scale) + PX * rng.standard_normal((VIEWS, BOARD.corners, 2))
    views, sigma, sigma_rot = poses_of(corners, true, PX)
    return seen_cell, q, views, np.array([sigma, sigma_rot])


def imported(folder: Path, on_flange: str, seed: int, scale_sigma: float | None = None) -> ImportedHandEye:
    _, q, views, (sigma, sigma_rot) = campaign(on_flange, seed)
    path = folder / "views.csv"
    path.write_text(table_of(q[:VIEWS], views, sigma, sigma_rot))
    return truearm.import_hand_eye(path, on_flange=on_flange, scale_sigma=scale_sigma)  # type: ignore[arg-type]


def seen_from_the_other(seen_cell: Cell, joints: Array) -> Array:
    """Return the true place of what is on the flange, from what stands beside the robot, ``(n, 4, 4)``."""
    return np.asarray(np.linalg.inv(seen_cell.beside) @ seen_cell.twin.frames(joints)[seen_cell.on_flange])


def without_gauge(frame: Array, true: Array) -> Array:
    """Return a frame turned about z and moved along it, on the left, so that it fits another one best."""
    D = true[:3, :3] @ frame[:3, :3].T
    angle = np.arctan2(D[1, 0] - D[0, 1], D[0, 0] + D[1, 1])
    G = np.eye(4)
    G[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    moved = G @ frame
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
    seen_cell, q, _, _ = campaign(on_flange, seed)
    read = imported(tmp_path, on_flange, seed)
    fit = identify(UR5E, read.data, GEOMETRIC)
    assert fit.status is Status.CONVERGED
    assert fit.excess == 1.0  # the deviations are what the corners leave
    unseen, base = q[VIEWS:], product(fit.robot.base_elements, fit.robot)
    other = without_gauge(np.asarray(np.linalg.inv(base)), seen_cell.beside)  # in the base: what theta_1 and d_1 leave
    in_base = other @ frames(fit.robot, unseen, on_flange, read.ahead)
    assert errors(in_base, seen_cell.twin.frames(unseen)[on_flange])[0] < 0.2e-3
    assert errors(other[None], seen_cell.beside[None])[0] < 0.2e-3
    true_mount = behind_axis_6(seen_cell.twin.robot, on_flange, 0.0)
    mount = without_gauge(behind_axis_6(fit.robot, on_flange, read.ahead), true_mount)
    apart, turned = errors(mount[None], true_mount[None])
    assert (apart < 0.2e-3, turned < 1e-3) == (True, True)
    nominal = errors(frames(fit.start, unseen, on_flange, read.ahead), seen_from_the_other(seen_cell, unseen))
    ours = errors(frames(fit.robot, unseen, on_flange, read.ahead), seen_from_the_other(seen_cell, unseen))
    assert ours[0] < 0.1 * nominal[0]


@pytest.mark.parametrize(("on_flange", "seed"), [("camera", 0), ("board", 1)])
def test_it_is_better_than_opencv_with_the_robot_as_it_is_named(on_flange: str, seed: int, tmp_path: Path) -> None:
    cv2 = pytest.importorskip("cv2", reason="OpenCV (truearm[vision]) is not installed")
    seen_cell, q, views, _ = campaign(on_flange, seed)
    read = imported(tmp_path, on_flange, seed)
    fit = identify(UR5E, read.data, GEOMETRIC)
    unseen = q[VIEWS:]
    true = seen_from_the_other(seen_cell, unseen)

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
    seen_cell, q, views, (sigma, sigma_rot) = campaign("camera", 2, 1.002)
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
    stored = read_robot(_written(tmp_path / "robot.yaml", robot_text(doubting.robot)))
    assert stored.parameters["instrument_scale"] == scale
    with_it, without = (errors_of(stored, d).position_norms.mean() for d in (again, exact))
    assert with_it < without
    # an instrument whose scale is exact leaves none behind
    assert "instrument_scale" not in identify(stored, exact, GEOMETRIC).robot.parameters
    assert "instrument_scale" not in identify(UR5E, loose, GEOMETRIC, redundancy="drop").free.names
    assert seen_cell.on_flange == "camera"


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


def aligned(seen_cell: Cell, robot: Robot, joints: Array, ahead: float) -> float:
    """Return the mean error behind a rigid motion [m]: what the lens is wrong by is where the camera seems to be."""
    true = seen_from_the_other(seen_cell, joints)[:, :3, 3]
    positions = frames(robot, joints, seen_cell.on_flange, ahead)[:, :3, 3]
    R, t = rigid_motion(positions, true)
    return float(np.linalg.norm(positions @ R.T + t - true, axis=1).mean())


@pytest.mark.parametrize("on_flange", ["camera", "board"])
def test_pictures_calibrate_the_lens_and_the_robot(on_flange: str, tmp_path: Path) -> None:
    pytest.importorskip("cv2", reason="OpenCV (truearm[vision]) is not installed")
    seen_cell, rng = cell(3, on_flange), np.random.default_rng(1)
    q = configurations(seen_cell, 30, rng)
    size = (SIZE[0] // 3, SIZE[1] // 3)
    lens = np.array([[770.0, 0.0, size[0] / 2 + 4], [0.0, 771.0, size[1] / 2 - 3], [0.0, 0.0, 1.0]])
    distortion = np.array([-0.08, 0.03, 4e-4, -3e-4, 0.0])
    pictures(tmp_path, seen_cell.views(q[:12]), rng, size, lens, distortion)
    table = _written(tmp_path / "views.csv", table_of_pictures(q[:12]))
    read = truearm.import_hand_eye(table, on_flange=on_flange, board=PICTURED_TEXT)  # type: ignore[arg-type]
    lens_found = known(read.lens)
    assert lens_found.noise < 0.3
    true = {"fx": 770.0, "fy": 771.0, "cx": lens[0, 2], "cy": lens[1, 2], "k1": -0.08, "p1": 4e-4, "p2": -3e-4}
    for name, value in true.items():
        assert abs(lens_found.values[name] - value) < 4.0 * lens_found.deviations[name], name
    assert lens_found.deviations["fx"] < 2.0
    views = read_hand_eye(table, on_flange, PICTURED).views  # type: ignore[arg-type]
    apart = views.position - seen_cell.views(q[:12])[:, :3, 3]  # the lens is a little long or short in all of them
    assert np.ptp(apart, axis=0).max() < 4e-3
    fit = identify(UR5E, read.data, GEOMETRIC)
    unseen = q[12:]
    assert aligned(seen_cell, fit.robot, unseen, read.ahead) < 0.35 * aligned(seen_cell, fit.start, unseen, read.ahead)
    text = "\n".join(read.lines())
    assert ("12 configurations, target" in text, "lens: fx 7" in text) == (True, True)
    assert read.summary()["lens"]["noise_px"] == lens_found.noise


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


# -- tables --------------------------------------------------------------------------------------------------------


def example(folder: Path, **other: Any) -> dict[str, Any]:
    return {**EXAMPLES["import_hand_eye"](folder), **other}


def changed(folder: Path, before: str, after: str) -> dict[str, Any]:
    arguments = example(folder)
    text = arguments["file"].read_text()
    assert before in text
    arguments["file"].write_text(text.replace(before, after))
    return arguments


# -- poses -------------------------------------------------------------------------------------------------


def test_a_camera_on_the_flange_is_seen_from_the_board(tmp_path: Path) -> None:
    read = truearm.import_hand_eye(**example(tmp_path), out=tmp_path / "data.csv")
    assert read.ahead == pytest.approx(0.425)
    assert read.data.targets == ("camera",)
    # T_board_camera (0, 0, ahead) is R' (ahead z - t)
    R = rotation_from_quaternion(np.array([[1.0, 0, 0, 0], [0.6, 0.8, 0, 0]]))
    t = np.array([[5.0, -3, 400], [4, 8, 450]]) / 1e3
    places = np.einsum("nji,nj->ni", R, np.array([0, 0, 0.425]) - t)
    np.testing.assert_allclose(read.data.position, places, rtol=0, atol=1e-15)
    turned = quaternion_from_rotation(np.swapaxes(R, 1, 2))
    np.testing.assert_allclose(known(read.data.quaternion), turned, rtol=0, atol=1e-15)
    lever = np.linalg.norm(np.array([0, 0, 0.425]) - t, axis=1)
    expected = np.sqrt(5e-5**2 + 2.0 / 3.0 * (lever * 2e-4) ** 2)
    np.testing.assert_allclose(known(read.data.sigma), expected, rtol=1e-12)
    np.testing.assert_allclose(known(read.data.sigma_rot), 2e-4, rtol=1e-12)
    assert read.lines() == [
        f"2 configurations, target camera: {tmp_path / 'data.csv'}",
        "  the target is a point on the camera's axis, 425.0 mm before it",
        "  deviations 0.050 mm a coordinate, 0.200 mrad an axis",
        "  the board's size is taken as exact",
    ]
    assert truearm.load_data(tmp_path / "data.csv").configurations == 2


def test_a_board_on_the_flange_is_seen_by_the_camera(tmp_path: Path) -> None:
    read = truearm.import_hand_eye(**example(tmp_path, on_flange="board", scale_sigma=2e-4))
    assert read.data.targets == ("board",)
    assert read.ahead == 0.0
    np.testing.assert_allclose(read.data.position[0], [0.005, -0.003, 0.4], rtol=0, atol=1e-15)
    assert read.data.scale_sigma == 2e-4
    assert "  the board's size is known to 200 ppm" in read.lines()
    assert read.summary()["scale_sigma_ppm"] == pytest.approx(200.0)
    # deviations may be left out, both of them
    arguments = changed(tmp_path, ",sigma [mm],sigma_rot [mrad]", "")
    text = arguments["file"].read_text().replace(",0.05,0.2", "")
    arguments["file"].write_text(text)
    read = truearm.import_hand_eye(**arguments)
    assert (read.data.sigma, read.data.sigma_rot, read.sigma, read.sigma_rot) == (None, None, None, None)


def test_a_table_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    for before, after, words in (
        ("x [mm]", "x", r"line 1, column 4, x: no unit is given; allowed: mm, m, um, in\. Units are never guessed"),
        ("x [mm]", "x [px]", r"this unit does not fit here; got 'px'"),
        ("joint_1 [deg]", "joint_1", r"no unit is given; allowed: deg, rad"),
        (",qw", ",q", r"the column is not known; got 'q'.*Did you mean q"),
        (",z [mm]", ",y [mm]", r"the column y appears twice"),
        (",sigma_rot [mrad]", ",configuration", r"the column configuration appears twice"),
        ("0.6,0.8", "0.6,0.7", r"line 3, .*the quaternion \(qw, qx, qy, qz\) does not have length 1"),
        (",450,", ",-450,", r"line 3, column z \[mm\]: the board is behind the camera; got '-450'; .*T_camera_board"),
        ("\n2,", "\n1,", r"the joints of configuration '1' differ"),
        ("\n2,12,22", "\n1,10,20", r"lines 2 and 3: the configuration '1' appears twice"),
        (",0.05,0.2\n2", ",0,0.2\n2", r"a standard deviation must be above zero"),
    ):
        refused("file", words, truearm.import_hand_eye, **changed(tmp_path, before, after))
    arguments = changed(tmp_path, ",sigma_rot [mrad]", "")
    arguments["file"].write_text(arguments["file"].read_text().replace(",0.05,0.2", ",0.05"))
    words = r"column sigma_rot is missing; got 'sigma'; .*or leave sigma out"
    refused(None, words, truearm.import_hand_eye, **arguments)
    for board, words in (
        ("14x10,25mm,18mm,5X5_250", r"a board is named, and the table names no pictures"),
        (5, r"a board belongs here"),
    ):
        refused("board", words, truearm.import_hand_eye, **example(tmp_path, board=board))


def test_a_scale_is_one_for_a_file(tmp_path: Path) -> None:
    data_file = tmp_path / "data.csv"
    truearm.import_hand_eye(**example(tmp_path, scale_sigma=2e-4), out=data_file)
    data_file.write_text(data_file.read_text().replace(",200.0\n", ",100.0\n", 1))
    words = r"line 3, column scale_sigma \[ppm\]: the scale is of the instrument, .*one of"
    refused(None, words, truearm.load_data, data_file)
    data_file.write_text(data_file.read_text().replace("[ppm]", "[mm]"))
    refused(None, r"this unit does not fit here; got 'mm'; allowed: ppm", truearm.load_data, data_file)


# -- boards ------------------------------------------------------------------------------------------------


def test_a_board_is_named_by_a_text() -> None:
    board = Charuco.of_text("14x10, 25mm, 0.018m, DICT_5X5_250")
    assert board == Charuco(14, 10, 0.025, 0.018, "5X5_250")
    assert board.corners == 117
    np.testing.assert_allclose(board.places.mean(axis=0), 0.0, atol=1e-15)
    np.testing.assert_allclose(board.places[1] - board.places[0], [0.025, 0, 0], atol=1e-15)
    np.testing.assert_allclose(board.places[13] - board.places[0], [0, 0.025, 0], atol=1e-15)
    for text, words in (
        ("14x10,25mm,18mm", r"a board is its squares.*allowed: 14x10,25mm,18mm,5X5_250"),
        ("14,25mm,18mm,5X5_250", r"a board is its squares"),
        ("2x10,25mm,18mm,5X5_250", r"squares in several rows; got '2x10'"),
        ("14x10,25,18mm,5X5_250", r"no unit that fits is given; got '25'"),
        ("14x10,25mm,25mm,5X5_250", r"a marker is smaller than the square"),
        ("14x10,25mm,18mm,5X5_50", r"fewer markers than the board; got '70 markers of 5X5_50'; allowed: 50 or fewer"),
        ("14x10,25mm,18mm,5X5_251", r"no such dictionary of markers; got '5X5_251'.*Did you mean 5X5_250"),
    ):
        refused("board", words, Charuco.of_text, text)


# -- pictures ----------------------------------------------------------------------------------------------


def table(folder: Path, count: int, joints: str = "10,20") -> Path:
    path = folder / "some_views.csv"
    rows = "".join(f"{k},{joints},{k}.png\n" for k in range(1, count + 1))
    path.write_text(f"configuration,joint_1 [deg],joint_2 [deg],picture\n{rows}")
    return path


def some_views(count: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    frames_of_board = np.tile(np.eye(4), (count, 1, 1))
    frames_of_board[:, :3, :3] = rotation_from_vector(np.random.default_rng(0).uniform(-0.6, 0.6, (count, 3)))
    frames_of_board[:, 2, 3] = 0.45
    return frames_of_board


def rendered(folder: Path, count: int = 8) -> Path:
    pytest.importorskip("cv2", reason="OpenCV (truearm[vision]) is not installed")
    lens = np.array([[500.0, 0, 240], [0, 500, 180], [0, 0, 1]])
    pictures(folder, some_views(count), np.random.default_rng(1), (480, 360), lens, np.zeros(5))
    return table(folder, count)


def test_pictures_need_a_board_and_opencv(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read = partial(truearm.import_hand_eye, table(tmp_path, 8), on_flange="camera")
    refused(None, r"no board is named, and the table names pictures; allowed: its squares", read)
    (tmp_path / "3.png").touch()
    refused(None, "would be overwritten", read, board=PICTURED_TEXT, out=tmp_path / "3.png")
    monkeypatch.setitem(sys.modules, "cv2", None)
    words = r'read by OpenCV, and it is not installed.*pip install "truearm\[vision\]"'
    refused(None, words, read, board=PICTURED_TEXT)


def test_pictures_that_do_not_show_the_board_are_refused(tmp_path: Path) -> None:
    path = rendered(tmp_path)
    import cv2

    def wrong(words: str, board: str = PICTURED_TEXT, count: int = 8) -> None:
        refused(None, words, truearm.import_hand_eye, table(tmp_path, count), on_flange="camera", board=board)

    assert truearm.import_hand_eye(path, on_flange="camera", board=PICTURED_TEXT).lens is not None
    wrong(r"too few pictures to know the lens; got 5; allowed: 8 or more", count=5)
    wrong(r"9\.png: .*(there is no such file|No such file)", count=9)
    wrong(r"1\.png: this is another board: its markers are of another dictionary; got '4X4_", "8x6,40mm,30mm,6X6_50")
    wrong(r"1\.png: (too few corners|the corners do not fit the board|the board is not seen)", "7x9,40mm,30mm,4X4_50")
    wrong(r"1\.png: columns and rows of the board are exchanged; got '6x8'; allowed: 8x6", "6x8,40mm,30mm,4X4_50")
    contents = {k: (tmp_path / f"{k}.png").read_bytes() for k in (1, 2, 3)}
    small = cv2.imdecode(np.frombuffer(contents[2], np.uint8), cv2.IMREAD_GRAYSCALE)
    cv2.imwrite(str(tmp_path / "2.png"), small[:300])
    wrong(r"2\.png: the pictures are not of one size; got '480 x 300 px'; allowed: 480 x 360 px, as 1\.png")
    cv2.imwrite(str(tmp_path / "2.png"), np.full_like(small, 128))
    wrong(r"2\.png: the board is not seen in this picture; allowed: markers of 4X4_50")
    cv2.imwrite(str(tmp_path / "2.png"), np.ascontiguousarray(small[:, ::-1]))
    wrong(r"2\.png: this picture is mirrored; got 'markers of 4X4_50 in its mirror image'\. Switch off")
    cropped = np.full_like(small, 128)
    cropped[:, :190] = small[:, :190]
    cv2.imwrite(str(tmp_path / "2.png"), cropped)
    wrong(r"2\.png: too few corners of the board are seen; got '\d corners, \d+ markers'; allowed: 8 corners or more")
    (tmp_path / "2.png").write_bytes(b"no picture")
    wrong(r"2\.png: this is no picture; allowed: PNG, JPEG, TIFF or BMP")


def test_a_board_of_other_squares_does_not_fit(tmp_path: Path) -> None:
    path = rendered(tmp_path)
    import cv2

    image = cv2.imread(str(tmp_path / "3.png"), cv2.IMREAD_GRAYSCALE)
    u, v = np.meshgrid(np.arange(480, dtype=np.float32), np.arange(360, dtype=np.float32))
    warped = cv2.remap(image, u, (v + 25 * np.sin(u / 60)).astype(np.float32), cv2.INTER_LINEAR, borderValue=150.0)
    cv2.imwrite(str(tmp_path / "3.png"), warped)
    words = r"\d\.png: the corners do not fit the board: it is another board, bent, or was"
    refused(None, words, truearm.import_hand_eye, path, on_flange="camera", board=PICTURED_TEXT)


def test_every_dictionary_is_one_of_opencv() -> None:
    cv2 = pytest.importorskip("cv2", reason="OpenCV (truearm[vision]) is not installed")
    for name, count in DICTIONARIES.items():
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name}"))
        assert len(dictionary.bytesList) == count, name
    assert PICTURED.dictionary in DICTIONARIES


def test_later_sessions_follow_the_same_point(tmp_path: Path) -> None:
    """The point ahead of the camera is where the board was on average, unless the first session's is given."""
    first = truearm.import_hand_eye(**example(tmp_path))
    again = truearm.import_hand_eye(**example(tmp_path), working_distance=first.ahead)
    assert again.data.position == pytest.approx(first.data.position)
    farther = truearm.import_hand_eye(**example(tmp_path), working_distance=first.ahead + 0.1)
    assert farther.ahead == pytest.approx(first.ahead + 0.1)
    apart = np.linalg.norm(farther.data.position - first.data.position, axis=1)
    assert apart == pytest.approx(np.full(len(apart), 0.1))
    words, board = "only a camera on the flange has a point ahead", example(tmp_path, on_flange="board")
    refused(None, words, truearm.import_hand_eye, **board, working_distance=0.5)
