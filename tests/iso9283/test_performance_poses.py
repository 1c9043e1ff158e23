"""Files of attained poses and of pushes: what is read, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.iso9283.evaluating.reading import read_attained_poses, read_pushes

HEADER = "criterion,pose,cycle,velocity [%],load [%],x [mm],y [mm],z [mm]"
TURNED = HEADER + ",qw,qx,qy,qz"
FORCES = "direction,force [N],cycle,x [mm],y [mm],z [mm]"


def written(folder: Path, *lines: str) -> Path:
    path = folder / "rows.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_poses_are_read(tmp_path: Path) -> None:
    header = "criterion,robot,pose,cycle,approach,velocity [%],load [%],time [s],x [um],y [mm],z [m],qw,qx,qy,qz"
    path = written(tmp_path, header, "vAP,one,P1,2,x,50,100,,1000,2,3,0,1,0,0", "AP,,P2,1,,100,10,7.5,0,0,0,1,0,0,0")
    read = read_attained_poses(path)
    assert read.position == pytest.approx(np.array([[1e-3, 2e-3, 3.0], [0, 0, 0]]))
    assert read.rotation is not None
    assert np.diag(read.rotation[0]) == pytest.approx([1, -1, -1])
    assert (read.robot.names, read.approach.names, read.criterion.names) == (("one", ""), ("x", ""), ("vAP", "AP"))
    assert read.velocity.tolist() == [0.5, 1.0]
    assert read.load.tolist() == [1.0, 0.1]
    assert np.isnan(read.time[0])
    assert read.time[1] == 7.5
    assert read.line.tolist() == [2, 3]


def test_columns_that_may_be_left_out(tmp_path: Path) -> None:
    read = read_attained_poses(written(tmp_path, HEADER, "AP,P1,1,100,100,1,2,3"))
    assert read.rotation is None
    assert read.robot.names == read.approach.names == ("",)


def test_groups_of_drift_have_the_same_cycles(tmp_path: Path) -> None:
    read = read_attained_poses(written(tmp_path, HEADER, *["dAP,P1,1,100,100,1,2,3"] * 2))
    assert read.cycle.tolist() == [1, 1]


@pytest.mark.parametrize(
    ("lines", "text"),
    [
        ((HEADER, "AP,P1,1.5,100,100,1,2,3"), "line 2, column cycle: a cycle is a whole number"),
        ((HEADER, "AP,P1,0,100,100,1,2,3"), "a cycle is a whole number"),
        ((HEADER, "AP,P1,1,101,100,1,2,3"), "the velocity must be a share of the rated one"),
        ((HEADER, "AP,P1,1,0,100,1,2,3"), "above 0 to 100 %"),
        ((HEADER, "AP,P1,1,100,120,1,2,3"), "the load is not between none and the rated one; got '120'"),
        ((HEADER, *["AP,P1,1,100,100,1,2,3"] * 2), "lines 2 and 3: cycle 1 of pose 'P1' appears twice"),
        ((HEADER, "AP,P1,1,100,100,1,2,"), "the cell is empty"),
        ((HEADER, ",P1,1,100,100,1,2,3"), "the cell is empty"),
        ((TURNED, "AP,P1,1,100,100,1,2,3,1,1,0,0"), "does not have length 1"),
        ((TURNED, "AP,P1,1,100,100,1,2,3,,,,"), "column qw: the cell is empty"),
        ((HEADER + ",qw", "AP,P1,1,100,100,1,2,3,1"), "the column qx is missing"),
        ((HEADER.replace(" [%]", "", 1), "AP,P1,1,100,100,1,2,3"), "no unit is given"),
        ((HEADER.replace("pose", "place"), "AP,P1,1,100,100,1,2,3"), "the column is not known"),
        ((HEADER.replace("cycle", "cycle [1]"), "AP,P1,1,100,100,1,2,3"), "this column takes no unit"),
        ((HEADER.replace(",load [%]", ""), "AP,P1,1,100,1,2,3"), "the column load is missing"),
    ],
)
def test_poses_that_cannot_be_used_are_refused(tmp_path: Path, lines: tuple[str, ...], text: str) -> None:
    with pytest.raises(InputError) as refused:
        read_attained_poses(written(tmp_path, *lines))
    assert text in str(refused.value)


def test_pushes_are_read(tmp_path: Path) -> None:
    read = read_pushes(written(tmp_path, FORCES, "+x,10,1,1,2,3", "-z,0,2,4,5,6"))
    assert read.direction.names == ("+x", "-z")
    assert read.force.tolist() == [10.0, 0.0]
    assert read.position[1] == pytest.approx([4e-3, 5e-3, 6e-3])


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("x,10,1,1,2,3", "the direction is not known"),
        ("+x,-10,1,1,2,3", "the force is below zero"),
        ("+x,10,first,1,2,3", "a number belongs here"),
        ("+x,10,1.2,1,2,3", "a cycle is a whole number"),
    ],
)
def test_pushes_that_cannot_be_used_are_refused(tmp_path: Path, line: str, text: str) -> None:
    with pytest.raises(InputError) as refused:
        read_pushes(written(tmp_path, FORCES, line))
    assert text in str(refused.value)
    assert "line 2" in str(refused.value)
