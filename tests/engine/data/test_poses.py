"""Pose files: what they may look like, and a refusal for everything else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.engine.robot.refusing import refused

from truearm.engine.data.readers.configurations import read_poses

HEAD = "pose,x [mm],y [mm],z [mm],qw,qx,qy,qz\n"
ROW = "P1,300,0,500,1,0,0,0\n"


def test_any_order_and_unit(tmp_path: Path) -> None:
    file = tmp_path / "poses.csv"
    file.write_text("qz,qy,qx,qw,z [m],y [mm],x [um],pose\n0,0.6,0,0.8002,0.5,-20,300000,a b\n")
    poses = read_poses(file)
    assert poses.labels == ("a b",)
    assert poses.position == pytest.approx(np.array([[0.3, -0.02, 0.5]]))
    assert poses.quaternion is not None
    assert np.linalg.norm(poses.quaternion) == pytest.approx(1, abs=1e-15)
    assert poses.quaternion[0] == pytest.approx([0.8, 0, 0.6, 0], abs=2e-4)
    file.write_text("pose,x [mm],y [mm],z [mm]\n1,1,2,3\n")
    assert read_poses(file).quaternion is None


def test_refusals(tmp_path: Path) -> None:
    for words, text in (
        ("no unit is given", HEAD.replace("x [mm]", "x") + ROW),
        ("does not fit here", HEAD.replace("x [mm]", "x [deg]") + ROW),
        ("takes no unit", HEAD.replace("qw", "qw [1]") + ROW),
        ("Did you mean pose", HEAD.replace("pose", "poses") + ROW),
        ("appears twice", HEAD.replace("qx", "qw") + ROW),
        ("column z is missing", HEAD.replace("z [mm],", "") + ROW.replace("500,", "")),
        ("column qz is missing", HEAD.replace(",qz", "") + ROW.replace(",0\n", "\n")),
        ("'P1' appears twice", HEAD + ROW + ROW),
        ("does not have length 1", HEAD + ROW.replace(",1,", ",1.002,")),
        ("NaN and infinity", HEAD + ROW.replace("300", "nan")),
        ("cell is empty", HEAD + ROW.replace("300", "")),
        ("cell is empty", HEAD + ROW.replace("P1", "")),
        ("not separated by commas", HEAD.replace(",", ";") + ROW.replace(",", ";")),
        ("a header and no rows", HEAD),
        ("file is empty", ""),
    ):
        file = tmp_path / "poses.csv"
        file.write_text(text)
        with refused(words, of=text):
            read_poses(file)
