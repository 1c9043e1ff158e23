"""Samples over time of tests of performance: what is read, and what is refused with line and column."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.iso9283.evaluating.samples import TESTS_OF, read_path_samples, read_settling_samples
from truearm.iso9283.planning.criteria import TESTS

HEADER = "criterion,path,cycle,time [s],x [mm],y [mm],z [mm]"
SETTLING = "criterion,pose,cycle,time [s],x [mm],y [mm],z [mm]"
ROWS = ["AT,line,1,0.000,1,2,3", "AT,line,1,0.001,1.5,2,3", "AT,line,2,0.0,1,2,3", "AV,line,1,0.5,-1e1,2,3"]


@pytest.fixture
def written(tmp_path: Path) -> Callable[..., Path]:
    def write(*rows: str, header: str = HEADER) -> Path:
        path = tmp_path / "paths.csv"
        path.write_text("\n".join([header, *rows]) + "\n")
        return path

    return write


def refused(path: Path, read: Callable[[Path], object] = read_path_samples) -> str:
    with pytest.raises(InputError) as caught:
        read(path)
    return str(caught.value)


def test_each_file_takes_the_tests_that_are_planned_for_it() -> None:
    for place, file in (("path", "paths"), ("pose", "settling")):
        assert set(TESTS_OF[place]) == {test.id for test in TESTS.values() if test.readings == file}  # type: ignore[index]


def test_rows_are_read_with_their_names_in_si_units(written: Callable[..., Path]) -> None:
    samples = read_path_samples(written(*ROWS))
    assert samples.criterion.names == ("AT", "AV")
    assert samples.criterion.are("AV").tolist() == [False, False, False, True]
    assert samples.place.names == ("line",)
    assert samples.cycle.tolist() == [1, 1, 2, 1]
    assert samples.time.tolist() == [0.0, 0.001, 0.0, 0.5]
    assert samples.position[:, 0].tolist() == [0.001, 0.0015, 0.001, -0.01]
    assert samples.velocity.tolist() == samples.load.tolist() == [1.0] * 4
    assert samples.rotation is None
    assert samples.line.tolist() == [2, 3, 4, 5]


def test_quotes_blanks_and_the_order_of_columns_change_nothing(written: Callable[..., Path]) -> None:
    plain = read_path_samples(written(*ROWS))
    header = "x [m], y [mm], z [mm], time [s], cycle, path, criterion, load [%]"
    other = written(
        "0.001, 2, 3, 0.000, 1, line, AT, 100",
        "",
        '0.0015, 2, 3, 0.001, 1, "line", AT, 100',
        "0.001, 2, 3, 0.0, 2, line, AT, 100",
        "-0.01, 2, 3, 0.5, 1, line, AV, 100",
        header=header,
    )
    samples = read_path_samples(other)
    assert samples.position == pytest.approx(plain.position, abs=1e-18)
    assert samples.cycle.tolist() == plain.cycle.tolist()
    assert samples.criterion.code.tolist() == plain.criterion.code.tolist()
    assert samples.line.tolist() == [2, 4, 5, 6]


def test_a_stream_of_a_whole_test_has_no_cycles(written: Callable[..., Path]) -> None:
    assert read_path_samples(written("AT,line,,0,1,2,3", "AT,line,,1,1,2,3")).cycle.tolist() == [0, 0]
    without = written("AT,line,0,1,2,3", header="criterion,path,time [s],x [mm],y [mm],z [mm]")
    assert read_path_samples(without).cycle.tolist() == [0]


def test_orientations_velocities_and_loads_are_read(written: Callable[..., Path]) -> None:
    header = f"{HEADER},qw,qx,qy,qz,velocity [%],load [%]"
    samples = read_path_samples(written("AT,line,1,0,1,2,3,0.70711,0,0,0.70711,50,10", header=header))
    assert samples.rotation is not None
    assert samples.rotation[0] == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), abs=1e-12)
    assert (samples.velocity[0], samples.load[0]) == (0.5, 0.1)


def test_rows_are_the_same_whatever_the_size_of_the_blocks(
    written: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = [f"AT,line,{1 + k // 50},{k % 50},{k},{k * 0.5},3" for k in range(200)]
    whole = read_path_samples(written(*rows))
    monkeypatch.setattr("truearm.iso9283.evaluating.samples._BLOCK", 100)
    parts = read_path_samples(written(*rows))
    assert np.array_equal(whole.position, parts.position)
    assert np.array_equal(whole.cycle, parts.cycle)
    assert parts.line.tolist() == list(range(2, 202))


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("AP,line,1,0,1,2,3", "line 3, column criterion: there is no such test in this file"),
        ("RT,line,1,0,1,2,3", "got 'RT'; allowed: AT, AT-reorientation, CR, AV, WS. Name the test: AT."),
        ("AT,line,first,0,1,2,3", "allowed: 1, 2, 3 and so on, or nothing where"),
        ("WT,line,1,0,1,2,3", "AT, AT-reorientation, CR, AV, WS"),
        ("t,line,1,0,1,2,3", "Samples of t belong into the file of settling"),
        ("AT,,1,0,1,2,3", "line 3, column path: the cell is empty"),
        ("AT,line,0,0,1,2,3", "line 3, column cycle: this is no number of a cycle"),
        ("AT,line,1.5,0,1,2,3", "column cycle: this is no number of a cycle"),
        ("AT,line,3,0,1,nan,3", "line 3, column y: a number belongs here"),
        ("AT,line,3,0,1,,3", "line 3, column y: the cell is empty"),
        ("AT,line,3,0,1,inf,3", "line 3, column y: a number belongs here"),
        ("AT,line,3,0,1,1e9,3000000000", "line 3: the number is too large to be plausible"),
        ("AT,line,3,0,1,2", "line 3: the row does not have as many cells as the header"),
        ("AT,line,3,0,1,2,3,4", "line 3: the row does not have as many cells as the header"),
        ("AT,line,1,0.0,1,2,3", "lines 2 and 3: two samples of a cycle have the same time"),
        ("AT,line,1,-1,1,2,3", "lines 2 and 3: samples of a cycle are out of order"),
    ],
)
def test_a_row_that_cannot_be_used_is_refused_with_its_line(written: Callable[..., Path], row: str, said: str) -> None:
    assert said in refused(written(ROWS[0], row))


@pytest.mark.parametrize(
    ("header", "said"),
    [
        (HEADER.replace("time [s]", "time"), "no unit is given"),
        (HEADER.replace("x [mm]", "x [deg]"), "this unit does not fit here"),
        (HEADER.replace("path", "path [mm]"), "this column takes no unit"),
        (HEADER.replace(",z [mm]", ""), "the column z is missing"),
        (HEADER.replace("path", "pathe"), "Did you mean path?"),
        (f"{HEADER},qw", "the column qx is missing"),
        (f"{HEADER},x [mm]", "the column x appears twice"),
        (HEADER.replace(",", ";"), "the columns are not separated by commas"),
        (f"{HEADER},", "the column has no name"),
        (f"{HEADER}\rAT,line,1,0,1,2,3", "the names of the columns cannot be read"),
    ],
)
def test_a_header_that_cannot_be_used_is_refused(written: Callable[..., Path], header: str, said: str) -> None:
    assert said in refused(written(ROWS[0], header=header))


@pytest.mark.parametrize(("velocity", "load"), [("0", "9"), ("120", "9"), ("9", "110"), ("9", "-1"), ("x", "1")])
def test_a_load_or_velocity_beyond_the_rated_one_is_refused(
    written: Callable[..., Path], velocity: str, load: str
) -> None:
    path = written(f"AT,line,1,0,1,2,3,{velocity},{load}", header=f"{HEADER},velocity [%],load [%]")
    assert "line 2" in refused(path)
    assert "percent of the rated" in refused(path)


def test_quaternions_that_are_none_are_refused(written: Callable[..., Path]) -> None:
    path = written("AT,line,1,0,1,2,3,1,1,0,0", header=f"{HEADER},qw,qx,qy,qz")
    assert "line 2, columns qw qx qy qz: the quaternion" in refused(path)


def test_settling_needs_a_pose_and_a_cycle(written: Callable[..., Path]) -> None:
    samples = read_settling_samples(written("t,P1,1,0,1,2,3", header=SETTLING))
    assert samples.place.names == ("P1",)
    assert "column cycle: this is no number" in refused(
        written("t,P1,,0,1,2,3", header=SETTLING), read_settling_samples
    )
    assert "the column is not known" in refused(written(ROWS[0]), read_settling_samples)


def test_too_many_samples_and_empty_files_are_refused(
    written: Callable[..., Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("TRUEARM_LIMITS", "samples_read=3")
    assert "the file has too many samples" in refused(written(*ROWS))
    assert "a header and no rows" in refused(written())
    empty = tmp_path / "empty.csv"
    empty.write_text("\n")
    assert "the file is empty" in refused(empty)
    empty.write_bytes(HEADER.encode() + b"\nAT,line,1,0,1,2,3\nAT,li\xff")
    assert "line 3: the file is not UTF-8 text" in refused(empty)


def test_lines_that_end_in_a_carriage_return_alone_are_read(tmp_path: Path) -> None:
    path = tmp_path / "paths.csv"
    path.write_bytes("\r".join([HEADER, *ROWS, ""]).encode())
    samples = read_path_samples(path)
    assert samples.line.tolist() == [2, 3, 4, 5]
    assert samples.time.tolist() == [0.0, 0.001, 0.0, 0.5]


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("AT,line,1,0.002,1\r5,2,3,\r", "line 3: the cells of the row cannot be read; got a carriage return within it"),
        ('AT,"' + 140_000 * "x" + '",1,0.002,1,2,3', "line 3: the cells of the row cannot be read; got field larger"),
    ],
)
def test_cells_that_cannot_be_read_are_refused_with_their_line(tmp_path: Path, row: str, said: str) -> None:
    path = tmp_path / "paths.csv"
    path.write_bytes("\n".join([HEADER, ROWS[0], row, ""]).encode())
    assert said in refused(path)
