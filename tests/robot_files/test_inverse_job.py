"""The job that finds joints for poses, from a file and from arrays."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.document.records import first_screen
from truearm.engine.robot.transform import quaternion_from_rotation

Q = np.radians([[10.0, 20.0, -30.0, 40.0, 50.0, 60.0], [-70.0, 30.0, 0.0, -20.0, 40.0, 0.0]])


def poses() -> tuple[np.ndarray, np.ndarray]:
    """Two poses of the IRB 120."""
    at = truearm.load_robot("irb120").forward_kinematics(Q)
    return at.position.T, at.matrix()


def test_arrays_and_a_file_give_the_same_joints(tmp_path: Path) -> None:
    p, R = poses()
    rows = np.hstack([p * 1e3, quaternion_from_rotation(R)]).tolist()
    file = tmp_path / "poses.csv"
    lines = [f"{n},{','.join(map(repr, row))}" for n, row in enumerate(rows, 1)]
    file.write_text("\n".join(["pose,x [mm],y [mm],z [mm],qw,qx,qy,qz", *lines]) + "\n")
    table = truearm.inverse("irb120", p, R, seed_joints=Q)
    assert table.joints == pytest.approx(Q, abs=1e-9)
    assert table.complete
    assert table.lines() == ["2 of 2 poses reached. Rows: 2 reached"]
    read = truearm.inverse("irb120", file, seed_joints=Q[0], branch="front-up-noflip", out=tmp_path / "joints.csv")
    assert read.joints == pytest.approx(Q, abs=1e-9)
    assert (tmp_path / "joints.csv").read_text().count("\n") == 3


def test_every_pose_out_of_reach_is_told() -> None:
    table = truearm.inverse("irb120", np.full((12, 3), 5.0), orientation="free")
    assert not table.complete
    assert len(table.attention) == 12
    assert len(table.lines()) == 13
    assert len(first_screen(table)) < 10
    assert table.summary()["poses_reached"] == 0


def test_orientations_and_branches_that_cannot_be_are_refused(tmp_path: Path) -> None:
    p, R = poses()
    file = tmp_path / "poses.csv"
    file.write_text("pose,x [mm],y [mm],z [mm]\nA,300,100,500\n")
    cases: list[tuple[tuple[Any, ...], dict[str, Any], str, str]] = [
        ((p,), {}, "rotations", r"the poses have no orientation.*`orientation=free`"),
        ((p, R * [[[1.0]], [[-1.0]]]), {}, "rotations", "rotations, row 1: the matrix is a reflection"),
        ((file,), {}, "poses", r"poses.csv: the poses have no orientation; allowed: the columns"),
        ((file, R), {}, "rotations", "the file says how the poses are turned"),
        ((file,), {"orientation": "free", "out": file}, "out", "would be overwritten"),
        ((p,), {"orientation": "free", "branch": "all"}, "branch", "have no names for this robot or pose"),
    ]
    for arguments, more, parameter, words in cases:
        with pytest.raises(InputError, match=words) as refusal:
            truearm.inverse("irb120", *arguments, **more)
        assert refusal.value.parameter == parameter
