"""Rows that are measured against fixtures, and rows that say what is known of these: meaning, round trip, refusals."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text, read_csv

DISTANCES = """configuration,joint_1 [deg],target,fixture,distance [mm]
1,10.0,ball,cup,300.0
1,10.0,ball,cap,299.5
2,20.0,ball,cup,
"""
#: Of every sort something: the instrument, a point, a plane, a frame, a reference, and what is known of two points.
MIXED = """configuration,joint_1 [deg],target,role,fixture,x [mm],y [mm],z [mm],qw,qx,qy,qz,distance [mm],height [mm],\
sigma [mm],sigma_rot [mrad],temperature [degC]
1,10.0,tcp,target,,1.0,2.0,3.0,,,,,,,0.01,,21.5
1,10.0,tip,target,plate,,,,,,,,,0.0,0.005,,21.5
1,10.0,corner,reference,,5.0,5.0,5.0,,,,,,,0.01,,21.5
2,-20.0,ball,target,cup,,,,,,,,300.25,,0.001,,22.0
2,-20.0,part,target,table,1.0,0.0,-1.0,0.5,0.5,0.5,0.5,,,0.02,0.3,22.0
2,-20.0,tip,target,plate,,,,,,,,,-0.75,0.005,,22.0
,,cup,fixture,,100.0,200.0,300.0,,,,,,,0.02,,
,,cap,fixture,cup,,,,,,,,250.0,,0.001,,
3,0.0,ball,target,cap,,,,,,,,299.75,,0.001,,22.5
"""


def read(text: str, folder: Path) -> Dataset:
    path = folder / "data.csv"
    path.write_text(text, encoding="utf-8")
    return read_csv(path)


def test_distances_need_no_position_columns(tmp_path: Path) -> None:
    data = read(DISTANCES, tmp_path)
    assert data.fixtures == ("cup", "cap")
    np.testing.assert_array_equal(data.fixture, [0, 1, 0])
    assert data.distance is not None
    assert data.distance[:2].tolist() == [0.3, 0.2995]
    assert np.isnan(data.distance[2])
    assert np.isnan(data.position).all()
    assert (data.height, data.setup, data.sigma) == (None, None, None)
    assert data.has_reading.tolist() == [True, True, False]
    assert not data.anchored


def test_every_sort_of_row_means_what_it_says(tmp_path: Path) -> None:
    data = read(MIXED, tmp_path)
    assert data.targets == ("tcp", "tip", "ball", "part")
    assert data.fixtures == ("plate", "cup", "table", "cap")
    assert data.against.tolist() == [-1, 0, 1, 2, 0, 3]
    assert data.sigma is not None
    np.testing.assert_array_equal(data.distance, [np.nan, np.nan, 0.30025, np.nan, np.nan, 0.29975])
    np.testing.assert_array_equal(data.height, [np.nan, 0.0, np.nan, np.nan, -0.75e-3, np.nan])
    np.testing.assert_allclose(data.sigma, [1e-5, 5e-6, 1e-6, 2e-5, 5e-6, 1e-6])
    # positions and orientations in a fixture's frame are none in the instrument's
    assert data.has_position.tolist() == [True, False, False, False, False, False]
    assert not data.has_orientation.any()
    assert data.anchored
    assert data.configurations == 3
    assert data.references is not None
    assert data.references.targets == ("corner",)
    assert data.references.fixtures == ()
    assert data.references.distance is None


def test_rows_of_the_role_fixture_are_the_setup(tmp_path: Path) -> None:
    setup = read(MIXED, tmp_path).setup
    assert setup is not None
    assert setup.targets == ("cup", "cap")
    assert setup.fixtures == ("plate", "cup", "table", "cap")
    assert setup.against.tolist() == [-1, 1]
    np.testing.assert_allclose(setup.position, [[0.1, 0.2, 0.3], [np.nan] * 3])
    np.testing.assert_array_equal(setup.distance, [np.nan, 0.25])
    assert setup.sigma is not None
    np.testing.assert_allclose(setup.sigma, [2e-5, 1e-6])
    assert setup.configurations == 1


@pytest.mark.parametrize("text", [DISTANCES, MIXED])
def test_what_was_read_is_written_as_the_same_text(tmp_path: Path, text: str) -> None:
    written = csv_text(read(text, tmp_path))
    lines, expected = written.splitlines(), text.splitlines()
    assert lines[0] == expected[0]
    assert sorted(lines) == sorted(expected)  # what is known of fixtures comes last
    assert lines == [line for line in expected if ",fixture," not in line[1:] or line == expected[0]] + [
        line for line in expected[1:] if line.startswith(",,")
    ]
    assert csv_text(read(written, tmp_path)) == written


def test_other_units_are_written_and_read_as_they_say(tmp_path: Path) -> None:
    data = read(MIXED, tmp_path)
    again = read(csv_text(data, length_unit="m", angle_unit="rad"), tmp_path)
    assert data.distance is not None
    assert again.distance is not None
    assert again.height is not None
    assert again.setup is not None
    np.testing.assert_allclose(again.distance, data.distance, rtol=1e-15)
    assert again.height[4] == pytest.approx(-0.75e-3, rel=1e-15)
    assert again.setup.position[0].tolist() == pytest.approx([0.1, 0.2, 0.3], rel=1e-15)


def test_some_configurations_keep_all_that_is_known_of_fixtures(tmp_path: Path) -> None:
    data = read(MIXED, tmp_path)
    some = data.of_configurations([2, 0])
    assert some.setup is data.setup
    assert some.fixtures == data.fixtures
    np.testing.assert_array_equal(some.distance, [np.nan, np.nan, 0.29975])
    assert some.against.tolist() == [-1, 0, 3]


def changed(line: int, cell: str, value: str, text: str = MIXED) -> str:
    """Return the text with another entry in one cell; lines count from 1."""
    lines = text.splitlines()
    heading = [name.split(" [")[0] for name in lines[0].split(",")]
    cells = lines[line - 1].split(",")
    cells[heading.index(cell)] = value
    lines[line - 1] = ",".join(cells)
    return "\n".join(lines) + "\n"


CUPLESS = DISTANCES.replace("cup,", "").replace("cap,", "").replace("fixture,", "")
TWICE = DISTANCES.replace("fixture,", "fixture,distance [m],").replace("cup,", "cup,,").replace("cap,", "cap,,")
REFUSED = [
    (changed(5, "fixture", ""), r"line 5, column distance .*names no fixture.*fixture"),
    (changed(3, "fixture", ""), r"line 3, column height .*names no fixture"),
    (changed(5, "distance", "0"), r"line 5, column distance.*above zero.*got '0'"),
    (changed(5, "distance", "-1"), r"line 5.*above zero; got '-1'"),
    (changed(5, "x", "1"), r"line 5: the row holds more than one reading"),
    (changed(5, "height", "1"), r"line 5: the row holds more than one.*one of them"),
    (changed(4, "fixture", "cup"), r"line 4, column fixture: a reference point is"),
    (changed(5, "distance", "far"), r"line 5, column distance.*'far'"),
    (changed(3, "height", "inf"), r"line 3, column height"),
    (changed(5, "fixture", '"a\nb"'), r"column fixture: the text has a line break"),
    (changed(8, "role", "cup"), r"line 8, column role.*target, reference or fixture"),
    (changed(8, "configuration", "4"), r"line 8, column configuration: this cell does not"),
    (changed(8, "joint_1", "1.0"), r"line 8, column joint_1 \[deg\]: this cell does not"),
    (changed(8, "height", "1.0"), r"line 8: the row does not say where"),
    (changed(8, "qw", "1.0"), r"line 8, column qw: this cell does not.*Empty the cell"),
    (changed(8, "temperature", "20.0"), r"line 8, column temperature.*: this cell does not"),
    (changed(9, "distance", ""), r"line 9: the row does not say where"),
    (changed(8, "y", ""), r"line 8: the row does not say where"),
    (changed(9, "fixture", "cap"), r"line 9: the row does not say where"),
    (changed(9, "fixture", ""), r"line 9: the row does not say where"),
    (changed(9, "distance", "0.0"), r"line 9, column distance.*above zero; got '0.0'"),
    (changed(8, "sigma", ""), r"line 8, column sigma.*no standard deviation.*above 0"),
    (changed(8, "sigma", "0"), r"line 8, column sigma"),
    (changed(8, "target", "cupp"), r"line 8, column target: nothing is.*Did you mean cup or"),
    (changed(9, "fixture", "xyz"), r"line 9, column fixture: nothing is.*'xyz'"),
    ("\n".join([MIXED.splitlines()[0], *MIXED.splitlines()[7:9]]), r"all rows are fixtures"),
    (CUPLESS, r"the column fixture is missing.*Add fixture"),
    (DISTANCES.replace("distance [mm]", "distance"), r"distance"),
    (DISTANCES.replace("distance [mm]", "height [deg]"), r"height \[deg\].*mm"),
    (DISTANCES.replace("fixture", "fixture [mm]"), r"this column takes no unit"),
    (TWICE, r"the column distance appears twice"),
    (changed(3, "sigma", ""), r"line 3, column sigma: this reading has no sigma"),
]


def test_refuses(tmp_path: Path) -> None:
    for text, said in REFUSED:
        with pytest.raises(InputError) as refusal:
            read(text, tmp_path)
        assert re.search(rf"data\.csv.*{said}", str(refusal.value)), (said, str(refusal.value))
