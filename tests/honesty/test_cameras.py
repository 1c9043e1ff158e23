"""What goes wrong with the poses of a camera and a board is named; nothing is said of right ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.hand_eye import cell, configurations, table_of
from tests.honesty.telling import Told, told

from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import rotation_from_vector

VIEWS = 24
#: Deviations of the places [m] and of the turns [rad].
NOISE = (3e-5, 2e-4)
#: A board whose z points to the camera, as other programs than OpenCV have it.
TOWARDS = np.diag([1.0, -1.0, -1.0, 1.0])
MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
OTHER = {"camera": "board", "board": "camera"}


@cache
def views(on_flange: str) -> tuple[Array, Array]:
    """Return joint positions, and where a camera saw the board, with noise."""
    rng, seen_cell = np.random.default_rng(7), cell(3, on_flange)
    joints = configurations(seen_cell, VIEWS, rng)
    seen = seen_cell.views(joints)
    seen[:, :3, :3] = rotation_from_vector(rng.normal(0.0, NOISE[1], (VIEWS, 3))) @ seen[:, :3, :3]
    seen[:, :3, 3] += rng.normal(0.0, NOISE[0], (VIEWS, 3))
    return joints, seen @ TOWARDS


@dataclass(frozen=True)
class Lie:
    """Something that is wrong with a table of views.

    Attributes
    ----------
    change
        Does it to the poses.
    code, words
        Of the error that names it; no code for none.
    last_first
        Whether the quaternions stand as x, y, z, w in the columns of w, x, y, z.
    exchanged
        Whether the other one is said to be on the flange.
    """

    change: Callable[[Array], Array]
    code: str = ""
    words: str = ""
    last_first: bool = False
    exchanged: bool = False


def as_it_is(poses: Array) -> Array:
    return poses


def inverted(poses: Array) -> Array:
    return np.asarray(np.linalg.inv(poses))


def mirrored(poses: Array) -> Array:
    return np.asarray(MIRROR @ poses @ MIRROR)


LIES = {
    "right": Lie(as_it_is),
    "inverted": Lie(inverted, "orientation-order", "The poses are inverted"),
    "x, y, z, w": Lie(as_it_is, "orientation-order", "in the order x, y, z, w", last_first=True),
    "the other on the flange": Lie(as_it_is, "orientation-order", "the other one is on the flange", exchanged=True),
    "mirrored": Lie(mirrored, "mirrored", "a camera mirrored its pictures"),
}


def imported(folder: Path, on_flange: str, lie: Lie) -> Path:
    """Return the measurements that come of a table of views."""
    joints, poses = views(on_flange)
    of_all = [np.full(VIEWS, deviation) for deviation in NOISE]
    header, *rows = [row.split(",") for row in table_of(joints, lie.change(poses), *of_all).splitlines()]
    if lie.last_first:
        w = header.index("qw")
        rows = [[*row[:w], *row[w + 1 : w + 4], row[w], *row[w + 4 :]] for row in rows]
    table = folder / "views.csv"
    table.write_text("".join(",".join(row) + "\n" for row in (header, *rows)), "utf-8")
    said = OTHER[on_flange] if lie.exchanged else on_flange
    assert told("import", "hand-eye", table, "--on-flange", said, "--out", folder / "data.csv").code == 0
    return folder / "data.csv"


def errors(found: Told) -> set[str]:
    return {code for code, level in found.levels.items() if level == "error"}


@pytest.mark.parametrize("on_flange", ["camera", "board"])
@pytest.mark.parametrize("name", LIES)
def test_a_wrong_table_of_views_is_named(name: str, on_flange: str, tmp_path: Path) -> None:
    lie = LIES[name]
    found = told("check", "ur5e", imported(tmp_path, on_flange, lie))
    assert errors(found) == ({lie.code} if lie.code else set())
    assert not lie.code or found.says(lie.code, "error", lie.words)


@pytest.mark.parametrize("name", ["inverted", "x, y, z, w"])
def test_a_calibration_names_it_as_the_cause(name: str, tmp_path: Path) -> None:
    lie = LIES[name]
    data = imported(tmp_path, "camera", lie)
    found = told("calibrate", "ur5e", data, "--model", "geometric", "--out", tmp_path / "out")
    assert found.code == 3
    assert found.says(lie.code, "error", lie.words)
    assert found.says("implausible", "error", f"what {lie.code} says")
    assert not errors(found) & {"wrong-robot", "rows-unrelated"}


def test_inverted_poses_that_put_the_board_behind_the_camera_are_refused(tmp_path: Path) -> None:
    joints, poses = views("camera")
    of_all = [np.full(VIEWS, deviation) for deviation in NOISE]
    table = tmp_path / "views.csv"
    table.write_text(table_of(joints, inverted(poses @ TOWARDS), *of_all), "utf-8")
    found = told("import", "hand-eye", table, "--on-flange", "camera", "--out", tmp_path / "data.csv")
    assert found.code == 2
    assert "Give poses of the board in the camera, T_camera_board, and not of the camera" in found.refusal
