"""Tables of a camera and a board: what they say, and what is refused."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.expecting import known, refused
from tests.hand_eye import PICTURED, PICTURED_TEXT, pictures
from tests.house.examples import EXAMPLES

import truearm
from truearm.board.pictures import DICTIONARIES, Charuco
from truearm.engine.robot.transform import quaternion_from_rotation, rotation_from_quaternion, rotation_from_vector


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
    made = tmp_path / "data.csv"
    truearm.import_hand_eye(**example(tmp_path, scale_sigma=2e-4), out=made)
    made.write_text(made.read_text().replace(",200.0\n", ",100.0\n", 1))
    words = r"line 3, column scale_sigma \[ppm\]: the scale is of the instrument, .*one of"
    refused(None, words, truearm.load_data, made)
    made.write_text(made.read_text().replace("[ppm]", "[mm]"))
    refused(None, r"this unit does not fit here; got 'mm'; allowed: ppm", truearm.load_data, made)


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
    path = folder / "views.csv"
    rows = "".join(f"{k},{joints},{k}.png\n" for k in range(1, count + 1))
    path.write_text(f"configuration,joint_1 [deg],joint_2 [deg],picture\n{rows}")
    return path


def views(count: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    made = np.tile(np.eye(4), (count, 1, 1))
    made[:, :3, :3] = rotation_from_vector(np.random.default_rng(0).uniform(-0.6, 0.6, (count, 3)))
    made[:, 2, 3] = 0.45
    return made


def rendered(folder: Path, count: int = 8) -> Path:
    pytest.importorskip("cv2", reason="OpenCV (truearm[vision]) is not installed")
    lens = np.array([[500.0, 0, 240], [0, 500, 180], [0, 0, 1]])
    pictures(folder, views(count), np.random.default_rng(1), (480, 360), lens, np.zeros(5))
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
    kept = {k: (tmp_path / f"{k}.png").read_bytes() for k in (1, 2, 3)}
    small = cv2.imdecode(np.frombuffer(kept[2], np.uint8), cv2.IMREAD_GRAYSCALE)
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
    bent = cv2.remap(image, u, (v + 25 * np.sin(u / 60)).astype(np.float32), cv2.INTER_LINEAR, borderValue=150.0)
    cv2.imwrite(str(tmp_path / "3.png"), bent)
    words = r"\d\.png: the corners do not fit the board: it is another board, bent, or was"
    refused(None, words, truearm.import_hand_eye, path, on_flange="camera", board=PICTURED_TEXT)


def test_every_dictionary_is_one_of_opencv() -> None:
    cv2 = pytest.importorskip("cv2", reason="OpenCV (truearm[vision]) is not installed")
    for name, count in DICTIONARIES.items():
        found = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name}"))
        assert len(found.bytesList) == count, name
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
