"""Files of attained poses, of pushes and of samples over time: what is read, and what is refused with its place."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.iso9283.evaluating.reading import read_attained_poses, read_pushes
from truearm.iso9283.evaluating.samples import TESTS_OF, read_path_samples, read_settling_samples
from truearm.iso9283.planning.criteria import TESTS

POSES = "criterion,pose,cycle,velocity [%],load [%],x [mm],y [mm],z [mm]"
FORCES = "direction,force [N],cycle,x [mm],y [mm],z [mm]"
PATHS = "criterion,path,cycle,time [s],x [mm],y [mm],z [mm]"
SETTLING = PATHS.replace("path", "pose")
TURNED = ",qw,qx,qy,qz"
ROWS = ["AT,line,1,0.000,1,2,3", "AT,line,1,0.001,1.5,2,3", "AT,line,2,0.0,1,2,3", "AV,line,1,0.5,-1e1,2,3"]
poses, pushes, paths, settling = read_attained_poses, read_pushes, read_path_samples, read_settling_samples


@pytest.fixture
def written(tmp_path: Path) -> Callable[..., Path]:
    def write(*rows: str, header: str = PATHS) -> Path:
        path = tmp_path / "rows.csv"
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


def test_poses_are_read(written: Callable[..., Path]) -> None:
    header = "criterion,robot,pose,cycle,approach,velocity [%],load [%],time [ms],x [um],y [mm],z [m],qw,qx,qy,qz"
    rows = "vAP,one,P1,2,x,50,100,,1000,2,3,0,1,0,0", "AP,,P2,1,,100,10,7500,0,0,0,1,0,0,0"
    read = read_attained_poses(written(*rows, header=header))
    assert read.position == pytest.approx(np.array([[1e-3, 2e-3, 3.0], [0, 0, 0]]))
    assert read.rotation is not None
    assert np.diag(read.rotation[0]) == pytest.approx([1, -1, -1])
    assert (read.robot.names, read.approach.names, read.criterion.names) == (("one", ""), ("x", ""), ("vAP", "AP"))
    assert (read.velocity.tolist(), read.load.tolist()) == ([0.5, 1.0], [1.0, 0.1])
    assert np.isnan(read.time[0])
    assert read.time[1] == 7.5
    assert read.line.tolist() == [2, 3]
    read = read_attained_poses(written("AP,P1,1,100,100,1,2,3", header=POSES))
    assert read.rotation is None
    assert read.robot.names == read.approach.names == ("",)
    drift = written(*["dAP,P1,1,100,100,1,2,3"] * 2, header=POSES)  # groups have the same cycles
    assert read_attained_poses(drift).cycle.tolist() == [1, 1]


def test_pushes_are_read(written: Callable[..., Path]) -> None:
    read = read_pushes(written("+x,10,1,1,2,3", "-z,0,2,4,5,6", header=FORCES))
    assert read.direction.names == ("+x", "-z")
    assert read.force.tolist() == [10.0, 0.0]
    assert read.position[1] == pytest.approx([4e-3, 5e-3, 6e-3])


def test_samples_are_read_with_their_names_in_si_units(written: Callable[..., Path]) -> None:
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
    path = written()
    path.write_bytes("\r".join([PATHS, *ROWS, ""]).encode())  # the ends of lines of old files
    again = read_path_samples(path)
    assert (again.line.tolist(), again.time.tolist()) == (samples.line.tolist(), samples.time.tolist())
    assert read_settling_samples(written("t,P1,1,0,1,2,3", header=SETTLING)).place.names == ("P1",)


def test_quotes_blanks_and_the_order_of_columns_change_nothing(written: Callable[..., Path]) -> None:
    plain = read_path_samples(written(*ROWS))
    rows = [
        "0.001, 2, 3, 0, 1, line, AT, 100",
        "",
        '0.0015, 2, 3, 1, 1, "line", AT, 100',
        "0.001, 2, 3, 0, 2, line, AT, 100",
        "-0.01, 2, 3, 500, 1, line, AV, 100",
    ]
    header = "x [m], y [mm], z [mm], time [ms], cycle, path, criterion, load [%]"
    samples = read_path_samples(written(*rows, header=header))
    assert samples.position == pytest.approx(plain.position, abs=1e-18)
    assert samples.time == pytest.approx(plain.time)
    assert samples.cycle.tolist() == plain.cycle.tolist()
    assert samples.criterion.code.tolist() == plain.criterion.code.tolist()
    assert samples.line.tolist() == [2, 4, 5, 6]


def test_a_stream_of_a_whole_test_has_no_cycles(written: Callable[..., Path]) -> None:
    assert read_path_samples(written("AT,line,,0,1,2,3", "AT,line,,1,1,2,3")).cycle.tolist() == [0, 0]
    without = written("AT,line,0,1,2,3", header=PATHS.replace(",cycle", ""))
    assert read_path_samples(without).cycle.tolist() == [0]


def test_orientations_velocities_and_loads_are_read(written: Callable[..., Path]) -> None:
    header = f"{PATHS}{TURNED},velocity [%],load [%]"
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
    ("read", "header", "row", "words"),
    [
        (poses, POSES, "AP,P1,1.5,100,100,1,2,3", "line 2, column cycle: a cycle is a whole number"),
        (poses, POSES, "AP,P1,0,100,100,1,2,3", "a cycle is a whole number"),
        (poses, POSES, "AP,P1,1,101,100,1,2,3", "the velocity must be a share of the rated one"),
        (poses, POSES, "AP,P1,1,0,100,1,2,3", "above 0 to 100 %"),
        (poses, POSES, "AP,P1,1,100,120,1,2,3", "the load is not between none and the rated one; got '120'"),
        (poses, POSES, "AP,P1,1,100,100,1,2,3\nAP,P1,1,100,100,1,2,3", "lines 2 and 3: cycle 1 of pose 'P1'"),
        (poses, POSES, "AP,P1,1,100,100,1,2,", "the cell is empty"),
        (poses, POSES, ",P1,1,100,100,1,2,3", "the cell is empty"),
        (poses, POSES + TURNED, "AP,P1,1,100,100,1,2,3,1,1,0,0", "does not have length 1"),
        (poses, POSES + TURNED, "AP,P1,1,100,100,1,2,3,,,,", "column qw: the cell is empty"),
        (poses, POSES + ",qw", "AP,P1,1,100,100,1,2,3,1", "the column qx is missing"),
        (poses, POSES.replace(" [%]", "", 1), "AP,P1,1,100,100,1,2,3", "no unit is given"),
        (poses, POSES.replace("pose", "place"), "AP,P1,1,100,100,1,2,3", "the column is not known"),
        (poses, POSES.replace("cycle", "cycle [1]"), "AP,P1,1,100,100,1,2,3", "this column takes no unit"),
        (poses, POSES.replace(",load [%]", ""), "AP,P1,1,100,1,2,3", "the column load is missing"),
        (pushes, FORCES, "x,10,1,1,2,3", "the direction is not known"),
        (pushes, FORCES, "+x,-10,1,1,2,3", "the force is below zero"),
        (pushes, FORCES, "+x,10,first,1,2,3", "a number belongs here"),
        (pushes, FORCES, "+x,10,1.2,1,2,3", "line 2, column cycle: a cycle is a whole number"),
        (paths, PATHS, "AP,line,1,0,1,2,3", "line 2, column criterion: there is no such test in this file"),
        (paths, PATHS, "RT,line,1,0,1,2,3", "got 'RT'; allowed: AT, AT-reorientation, CR, AV, WS. Name the test: AT."),
        (paths, PATHS, "AT,line,first,0,1,2,3", "allowed: 1, 2, 3 and so on, or nothing where"),
        (paths, PATHS, "WT,line,1,0,1,2,3", "AT, AT-reorientation, CR, AV, WS"),
        (paths, PATHS, "t,line,1,0,1,2,3", "Samples of t belong into the file of settling"),
        (paths, PATHS, "AT,,1,0,1,2,3", "line 2, column path: the cell is empty"),
        (paths, PATHS, "AT,line,0,0,1,2,3", "line 2, column cycle: this is no number of a cycle"),
        (paths, PATHS, "AT,line,1.5,0,1,2,3", "column cycle: this is no number of a cycle"),
        (paths, PATHS, f"{ROWS[0]}\nAT,line,3,0,1,nan,3", "line 3, column y: a number belongs here"),
        (paths, PATHS, "AT,line,3,0,1,,3", "line 2, column y: the cell is empty"),
        (paths, PATHS, "AT,line,3,0,1,inf,3", "line 2, column y: a number belongs here"),
        (paths, PATHS, "AT,line,3,0,1,1e9,3000000000", "line 2: the number is too large to be plausible"),
        (paths, PATHS, "AT,line,3,0,1,2", "line 2: the row does not have as many cells as the header"),
        (paths, PATHS, "AT,line,3,0,1,2,3,4", "line 2: the row does not have as many cells as the header"),
        (paths, PATHS, f"{ROWS[0]}\nAT,line,1,0.0,1,2,3", "lines 2 and 3: two samples of a cycle have the same time"),
        (paths, PATHS, f"{ROWS[0]}\nAT,line,1,-1,1,2,3", "lines 2 and 3: samples of a cycle are out of order"),
        (paths, PATHS.replace("time [s]", "time"), ROWS[0], "no unit is given"),
        (paths, PATHS.replace("x [mm]", "x [deg]"), ROWS[0], "this unit does not fit here"),
        (paths, PATHS.replace("path", "path [mm]"), ROWS[0], "this column takes no unit"),
        (paths, PATHS.replace(",z [mm]", ""), ROWS[0], "the column z is missing"),
        (paths, PATHS.replace("path", "pathe"), ROWS[0], "Did you mean path?"),
        (paths, f"{PATHS},qw", ROWS[0], "the column qx is missing"),
        (paths, f"{PATHS},x [mm]", ROWS[0], "the column x appears twice"),
        (paths, PATHS.replace(",", ";"), ROWS[0], "the columns are not separated by commas"),
        (paths, f"{PATHS},", ROWS[0], "the column has no name"),
        (paths, f"{PATHS}\rAT,line,1,0,1,2,3", ROWS[0], "the names of the columns cannot be read"),
        (paths, PATHS + TURNED, "AT,line,1,0,1,2,3,1,1,0,0", "line 2, columns qw qx qy qz: the quaternion"),
        (paths, PATHS, "\n", "a header and no rows"),
        (paths, PATHS, "AT,line,1,0.002,1\r5,2,3,\r", "line 2: the cells of the row cannot be read; got a carr"),
        (paths, PATHS, 'AT,"' + 140_000 * "x" + '",1,0.002,1,2,3', "cells of the row cannot be read; got field larger"),
        (settling, SETTLING, "t,P1,,0,1,2,3", "column cycle: this is no number"),
        (settling, PATHS, ROWS[0], "the column is not known"),
    ],
)
def test_what_cannot_be_used_is_refused_with_its_place(
    written: Callable[..., Path], read: Callable[[Path], object], header: str, row: str, words: str
) -> None:
    assert words in refused(written(row, header=header), read)


@pytest.mark.parametrize(("velocity", "load"), [("0", "9"), ("120", "9"), ("9", "110"), ("9", "-1"), ("x", "1")])
def test_a_load_or_velocity_beyond_the_rated_one_is_refused(
    written: Callable[..., Path], velocity: str, load: str
) -> None:
    path = written(f"AT,line,1,0,1,2,3,{velocity},{load}", header=f"{PATHS},velocity [%],load [%]")
    assert "line 2" in refused(path)
    assert "percent of the rated" in refused(path)


def test_too_many_samples_and_empty_files_are_refused(
    written: Callable[..., Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("TRUEARM_LIMITS", "samples_read=3")
    assert "the file has too many samples" in refused(written(*ROWS))
    empty = tmp_path / "empty.csv"
    empty.write_text("\n")
    assert "the file is empty" in refused(empty)
    empty.write_bytes(PATHS.encode() + b"\nAT,line,1,0,1,2,3\nAT,li\xff")
    assert "line 3: the file is not UTF-8 text" in refused(empty)
