"""What the command reads of a controller's kinematics, and how it asks for them."""

from __future__ import annotations

from pathlib import Path

from tests.commanding import Truearm
from tests.compensation.test_controller_model import POSES, program, worn
from tests.ur_controller import UR10_CONF

from truearm.engine.robot.robot_file.writing import robot_text


def test_the_command_names_its_option(truearm: Truearm, tmp_path: Path) -> None:
    (tmp_path / "worn.yaml").write_text(robot_text(worn("ur10")))
    given = (
        "compensate",
        tmp_path / "worn.yaml",
        program(tmp_path, POSES),
        "--taught",
        "none",
        "--out",
        tmp_path / "out",
    )
    refused = truearm(*given)
    assert refused.code == 2
    assert "--controller-kinematics nominal" in " ".join(refused.err.split())
    (tmp_path / "calibration.conf").write_text(UR10_CONF)
    other = truearm(*given, "--controller-kinematics", tmp_path / "calibration.conf")
    assert other.code == 2
    assert "--accept other-kinematics" in " ".join(other.err.split())
    accepted = ("--controller-kinematics", tmp_path / "calibration.conf", "--accept", "other-kinematics")
    assert truearm(*given, *accepted).code == 0


def test_the_command_imports(truearm: Truearm, tmp_path: Path) -> None:
    conf, out = tmp_path / "calibration.conf", tmp_path / "mine.yaml"
    conf.write_text(UR10_CONF)
    done = truearm("import", "ur-kinematics", conf, "--robot", "ur10e", "--out", out)
    assert done.code == 0
    assert "Warning (type-doubtful): The file is rather of an arm of type ur10." in " ".join(done.out.split())
    again = truearm("import", "ur-kinematics", conf, "--robot", "ur10", "--out", out)
    assert again.code == 2  # nothing is overwritten
    refused = truearm("import", "ur-kinematics", conf, "--robot", "ur5e", "--out", tmp_path / "no.yaml")
    assert refused.code == 2
    assert "Of the library, ur10 and ur10e fit." in " ".join(refused.err.split())
    assert not (tmp_path / "no.yaml").exists()
    told = truearm("import", "ur-kinematics", conf, "--robot", "ur10", "--out", tmp_path / "b.yaml", "--json")
    assert '"type-not-told"' in told.out
    assert '"joint_checksum": "0x6e0f7bf' in told.out
