"""A ball in two sockets: what is read, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.data.readers.canonical import csv_text, read_csv

ROWS = "configuration,joint_1 [deg],joint_2 [deg],socket\n1,10,20,left\n2,12,22,right\n3,15,25,left\n"


def written(folder: Path, text: str = ROWS) -> Path:
    path = folder / "touches.csv"
    path.write_text(text)
    return path


def test_joints_and_sockets_become_readings_at_two_points(tmp_path: Path) -> None:
    out = tmp_path / "data.csv"
    made = truearm.import_sockets(written(tmp_path), apart="200mm,0.02mm", ball="25mm", sigma=3e-5, out=out)
    data = made.data
    assert made.lines() == [f"3 configurations, targets ball: {out}"]
    assert data.fixtures == ("left", "right")
    assert data.against.tolist() == [0, 1, 0]
    assert not data.position.any()
    assert data.sigma is not None
    assert data.sigma.tolist() == [3e-5] * 3
    assert data.number is not None
    assert data.number.tolist() == [0, 1, 2]
    assert data.setup is not None
    assert data.setup.distance is not None
    assert data.setup.sigma is not None
    assert (data.setup.targets, data.setup.distance.tolist(), data.setup.sigma.tolist()) == (("right",), [0.2], [2e-5])
    again = read_csv(out)
    assert csv_text(again) == out.read_text() == csv_text(data)
    np.testing.assert_allclose(again.joints, np.radians([[10, 20], [12, 22], [15, 25]]), rtol=0, atol=1e-15)


def test_numbers_and_texts_mean_the_same(tmp_path: Path) -> None:
    one = truearm.import_sockets(written(tmp_path), apart=(0.2, 2e-5), ball=0.025).data
    other = truearm.import_sockets(written(tmp_path), apart="20e-2 m, 20um", ball="25mm").data
    assert csv_text(one) == csv_text(other)
    assert one.sigma is None


def test_joint_positions_of_the_controller_stay_the_controllers(tmp_path: Path) -> None:
    path = written(tmp_path, ROWS.replace("joint_", "axis_"))
    assert truearm.import_sockets(path, apart="200mm,0.02mm", ball="25mm").data.joints_are == "controller"


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("apart", "20mm,0.02mm", r"run into each other; got '20 mm'; allowed: 25 mm, the diameter of the ball"),
        ("apart", "200,0.02", r"no unit that fits is given; got '200'; allowed: 200mm or .*write 200mm,0\.02mm"),
        ("apart", "200mm,0.02", r"no unit that fits is given; got '0\.02'"),
        ("apart", "200mm", r"a distance and its standard deviation belong here; got '200mm'; allowed: 200mm,0\.02mm"),
        ("apart", "200mm,0mm", r"the number is too small to be plausible"),
        ("apart", "200mm,500mm", r"hardly known.*got '200 mm with a standard deviation of 500 mm'.*up to 10%"),
        ("apart", (0.2, 0.021), r"hardly known"),
        ("apart", "far,0.02mm", r"a number with its unit belongs here; got 'far'"),
        ("apart", [0.2], r"2 numbers belong here; got 1"),
        ("apart", (0.2, -1e-5), r"the number is too small to be plausible"),
        ("ball", "25", r"no unit that fits is given; got '25'; allowed: 25mm"),
        ("ball", 0.0, r"the ball has no size; got '0 mm'; allowed: above 0 mm"),
        ("ball", "-3mm", r"the ball has no size"),
    ],
)
def test_what_sockets_cannot_be_is_refused(tmp_path: Path, name: str, value: object, words: str) -> None:
    arguments: dict[str, object] = {"apart": "200mm,0.02mm", "ball": "25mm", name: value}
    with pytest.raises(InputError, match=words) as refusal:
        truearm.import_sockets(written(tmp_path), **arguments)  # type: ignore[arg-type]
    assert refusal.value.parameter == name


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (ROWS.replace("right", "left"), r"column socket: two sockets are needed: .*; got '1: left'.*both sockets"),
        (ROWS + "4,16,26,third\n", r"got '3: left, right, third'; allowed: two names"),
        (ROWS.replace(",socket", ",cup"), r"line 1, column 4: the column is not known; got 'cup'"),
        (ROWS.replace(",socket", ",").replace("2 [deg],", "2 [deg],"), r"the column has no name"),
        (ROWS.replace(",socket", ",configuration"), r"the column configuration appears twice"),
        (ROWS.replace("joint_1 [deg]", "joint_1"), r"no unit is given; allowed: deg, rad"),
        (ROWS.replace("configuration", "configuration [m]"), r"this column takes no unit"),
        ("configuration,joint_1 [deg]\n1,10\n", r"the column socket is missing; .*Add socket\."),
        (
            ROWS.replace("joint_1 [deg],", "").replace(",20", "").replace(",22", "").replace(",25", ""),
            r"joint_1 is mis",
        ),
        (ROWS + "1,10,20,right\n", r"lines 2 and 5: the configuration '1' appears twice.*a label of its own"),
        (ROWS + "4,16,,right\n", r"line 5, column joint_2 \[deg\]: the cell is empty"),
        (ROWS.replace(",", ";"), r"the columns are not separated by commas; got 'semicolons'"),
    ],
)
def test_a_table_that_does_not_fit_is_refused(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as refusal:
        truearm.import_sockets(written(tmp_path, text), apart="200mm,0.02mm", ball="25mm")
    assert refusal.value.parameter == "file"
