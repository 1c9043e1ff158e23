"""The CSV of what inclinometers read: what was written comes back, and what cannot be is refused with its place."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from truearm.engine.base.errors import InputError
from truearm.engine.robot.library import load_robot
from truearm.inclinometers.reading import inclinations_text, read_inclinations

HEADER = "configuration,order,joint_1 [deg],joint_2 [deg],payload [g],link,sensor,x [deg],y [mrad],sigma [deg]"
ROWS = """\
a,3,10,20,0,1,,1,17.5,0.001
a,3,10,20,0,2,left,-2,,0.001
a,3,10,20,0,2,right,3,0,0.002
b,4,10,20,1500,1,,1.01,17,0.001
c,9,10,20,0,1,,1,17.5,0.001
"""


SOUND = f"{HEADER}\n{ROWS}"


def read(folder: Path, text: str) -> object:
    path = folder / "inclinations.csv"
    path.write_text(text)
    return read_inclinations(path)


def test_columns_become_angles_instruments_and_pairs(tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_text(SOUND)
    inclinations = read_inclinations(tmp_path / "data.csv")
    assert inclinations.labels == ("a", "b", "c")
    assert inclinations.instruments.names == ("link 1", "link 2, sensor left", "link 2, sensor right")
    assert inclinations.instruments.links == (0, 1, 1)
    assert_allclose(inclinations.angle[0, :, 0], np.radians([1.0, -2.0, 3.0]))
    assert_allclose(inclinations.angle[0, 0, :2], [math.radians(1.0), 0.0175])
    assert math.isnan(inclinations.angle[0, 0, 2])
    assert np.isnan(inclinations.angle[1, 1:]).all()
    assert_allclose(inclinations.sigma[0], np.radians([0.001, 0.001, 0.002]))
    assert inclinations.payload.tolist() == [[0, 0, 0, 0], [1.5, 0, 0, 0], [0, 0, 0, 0]]
    assert inclinations.pairs.tolist() == [[0, 1]]
    assert inclinations.unpaired == ("c",)


def test_what_was_written_is_read_again(tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_text(SOUND)
    inclinations = read_inclinations(tmp_path / "data.csv")
    text = inclinations_text(inclinations)
    (tmp_path / "again.csv").write_text(text)
    again = read_inclinations(tmp_path / "again.csv")
    assert inclinations_text(again) == text
    assert_allclose(again.angle, inclinations.angle)
    assert again.order.tolist() == [3, 4, 9]
    forces = "force_x [N],force_y [N],force_z [N],moment_x [N m],moment_y [N m],moment_z [N m]"
    rows = "a,10,1,2,3,4,5,6,1,2,0.001\nb,10,0,0,0,0,0,0,1,2,0.001\n"
    (tmp_path / "forced.csv").write_text(f"configuration,joint_1 [deg],{forces},link,x [deg],sigma [deg]\n{rows}")
    pushed = read_inclinations(tmp_path / "forced.csv")
    assert pushed.wrench.tolist() == [[1, 2, 3, 4, 5, 6], [0] * 6]
    (tmp_path / "once-more.csv").write_text(inclinations_text(pushed))
    assert read_inclinations(tmp_path / "once-more.csv").wrench.tolist() == pushed.wrench.tolist()


def test_a_payload_is_a_weight_at_the_flange(tmp_path: Path) -> None:
    robot = load_robot("li3")
    head = "configuration,joint_1 [deg],joint_2 [deg],joint_3 [deg],payload [kg],payload_x [mm],payload_y [mm]"
    (tmp_path / "data.csv").write_text(
        f"{head},payload_z [mm],link,x [deg],y [deg],sigma [deg]\n1,10,20,30,2,100,0,50,1,0,0,0.001\n"
    )
    inclinations = read_inclinations(tmp_path / "data.csv")
    wrench = inclinations.postures(robot).wrench
    assert wrench is not None
    assert_allclose(wrench[0, :3], [0.0, 0.0, -2 * 9.81], rtol=1e-3)
    _, rotation = robot.with_frames(robot.base, {}).forward(inclinations.joints[0])
    arm = robot.base.rotation.T @ rotation.reshape(3, 3) @ np.array([0.1, 0.0, 0.05])
    assert_allclose(wrench[0, 3:], np.cross(arm, wrench[0, :3]).reshape(3), atol=1e-9)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        pytest.param(SOUND.replace(",link,", ",leg,"), "not known.*allowed: .* link,", id="leg"),
        pytest.param("configuration,joint_1 [deg],link,sigma [deg]\n1,2,1,1\n", "column x is missing", id="no angle"),
        pytest.param("configuration,joint_1 [deg],link,x [deg]\n1,2,1,1\n", "column sigma is missing", id="no sigma"),
        pytest.param("configuration,joint_1 [deg],x [deg],sigma [deg]\n1,2,1,1\n", "column link is missing", id="link"),
        pytest.param("joint_1 [deg],link,x [deg],sigma [deg]\n1,2,1,1\n", "configuration is missing", id="label"),
        pytest.param("configuration,link,x [deg],sigma [deg]\n1,2,1,1\n", "joint_1 is missing", id="no joints"),
        pytest.param(SOUND.replace("x [deg]", "x"), "no unit", id="angle without unit"),
        pytest.param(SOUND.replace("x [deg]", "x [mm]"), "allowed: mrad, rad, deg", id="length"),
        pytest.param(SOUND.replace("sigma [deg]", "sigma"), "no unit", id="sigma without unit"),
        pytest.param(SOUND.replace("link,", "link [1],"), "takes no unit", id="unit of a link"),
        pytest.param(SOUND.replace("sensor", "link"), "appears twice", id="column twice"),
        pytest.param(SOUND.replace(",2,left", ",3,left"), r"no such link; got '3'.*1 to 2", id="link 3"),
        pytest.param(SOUND.replace(",2,left", ",two,left"), "no such link", id="link two"),
        pytest.param(SOUND.replace(",2,left", ",0,left"), "this is the base", id="base"),
        pytest.param(SOUND.replace("left,-2", "left,-90.1"), "so high.*line 3|line 3.*so high", id="90"),
        pytest.param(SOUND.replace("left,-2", "left,nan"), "NaN", id="NaN"),
        pytest.param(SOUND.replace("right,", "left,"), "read twice.*sensor", id="twice"),
        pytest.param(SOUND.replace("a,3", "a,0"), "order of measurement", id="order 0"),
        pytest.param(SOUND.replace("b,4", "b,3"), "same place in the order", id="same order"),
        pytest.param(SOUND.replace("1500", "-1500"), "mass cannot be negative", id="mass"),
        pytest.param(SOUND.replace("0.002", "0"), "above zero", id="sigma of zero"),
        pytest.param(SOUND.replace("a,3,10,20,0,2,left", "a,3,10,21,0,2,left"), "differ", id="joints"),
        pytest.param(HEADER.replace("payload [g]", "payload_x [mm]") + "\n" + ROWS, "payload is missing", id="cog"),
        pytest.param(HEADER.replace("payload [g]", "force_x [N]") + "\n" + ROWS, "force_y is missing", id="force"),
        pytest.param(HEADER.replace(",", ";") + "\n" + ROWS.replace(",", ";"), "separated by commas", id="semicolons"),
    ],
)  # fmt: skip
def test_refusals(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(InputError, match=f"(?s){says}") as refusal:
        read(tmp_path, text)
    assert "inclinations.csv" in str(refusal.value)


def test_objects_that_do_not_fit_together_are_refused(tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_text(SOUND)
    inclinations = read_inclinations(tmp_path / "data.csv")
    other = replace(inclinations.instruments, links=(0, 1, 2))
    wrong: dict[str, tuple[dict[str, Any], str]] = {
        "shape": ({"sigma": inclinations.sigma[:, :2]}, "wrong number of values: sigma"),
        "joints": ({"joints": inclinations.joints * math.nan}, "joint position"),
        "wrench": ({"wrench": inclinations.wrench + math.inf}, "force or a moment"),
        "payload": ({"payload": inclinations.payload - 1.0}, "payload"),
        "angle": ({"angle": inclinations.angle + 2.0}, "beyond the vertical"),
        "sigma": ({"sigma": 0.0 * inclinations.sigma}, "deviation"),
        "order": ({"order": 0 * inclinations.order}, "same place"),
        "links": ({"instruments": other}, "no such link"),
    }
    for change, says in wrong.values():
        with pytest.raises(InputError, match=says):
            replace(inclinations, **change)
