"""Tilting first, geometry second: what comes back, what is said of it, and data that lie."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.tilting import TRUTH

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.inclinations import Inclinations
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.inclinometers.fit import TiltingFit
from truearm.inclinometers.pairs import InclinometerSimulation
from truearm.inclinometers.reading import inclinations_text
from truearm.inclinometers.tilting import Tilting

KATANA = load_robot("katana450")


@cache
def simulated(pull: float = 20.0, poses: int = 48) -> InclinometerSimulation:
    return truearm.simulate_inclinometers(KATANA, truth="tilting", poses=poses, pull=pull)


def inclinations() -> Inclinations:
    return simulated().inclinations


@cache
def measured() -> Dataset:
    return truearm.simulate(KATANA, truth="tilting", poses=60, noise=1e-5).data


@cache
def tilting_result() -> Tilting:
    return truearm.tilting(KATANA, inclinations(), measured(), pushed=simulated().pushed)


def codes(result: Tilting) -> dict[str, str]:
    return {notice.code: notice.level for notice in result.notices}


def test_constants_come_back_within_their_deviations() -> None:
    result = tilting_result()
    away = [
        (p.value - TRUTH[p.name]) / (p.deviation or 0.0)
        for p in (result.fit.robot.parameters[name] for name in result.fit.names)
    ]
    assert len(away) == 15
    assert np.abs(away).max() < 4.5
    assert np.sqrt(np.mean(np.square(away))) < 1.8
    assert all(row["seen"] for row in result.constants())
    assert result.fit.robot.parameters["backlash_3"].deviation == pytest.approx(math.radians(1e-4), rel=0.5)


def test_without_poses_the_robot_has_joints_that_tilt_and_nothing_else_is_new() -> None:
    result = truearm.tilting(KATANA, inclinations())
    assert result.geometry is None
    assert codes(result) == {"upright-unseen": "warning"}
    assert "as `pushed`" in result.notices[0].message
    assert result.robot.values["a_3"] == KATANA.values["a_3"]
    assert result.robot.effect_names == ("compliance", "backlash", "clearance")
    assert result.robot.proof is not None
    assert result.robot.proof.lower_bound
    assert "joint 1: tilt 0.02" in "\n".join(result.lines())
    assert "backlash not seen" in "\n".join(result.lines())


def test_pushing_that_does_not_turn_the_upright_joint_is_told() -> None:
    pushed = simulated().pushed
    assert pushed is not None
    wrench = np.array(pushed.wrench)
    wrench[:, :3], wrench[:, 2] = 0.0, 20.0 * np.tile([1.0, -1.0], len(wrench) // 2)
    downwards = truearm.tilting(KATANA, inclinations(), pushed=pushed)
    assert "upright-unseen" not in codes(downwards)
    with pytest.raises(InputError, match="no pair of poses can be used") as refusal:
        truearm.tilting(KATANA, inclinations(), pushed=replace(pushed, wrench=wrench))
    assert refusal.value.parameter == "pushed"


def test_gravity_alone_leaves_tilts_open() -> None:
    result = truearm.tilting(KATANA, simulated(pull=0.0).inclinations)
    assert codes(result) == {"upright-unseen": "warning", "tilting-unseen": "warning"}
    messages = " ".join(notice.message for notice in result.notices)
    for name in ("backlash_1", "compliance_1", "clearance_3"):
        assert name in messages
    assert result.fit.robot.values["backlash_2"] == pytest.approx(TRUTH["backlash_2"], abs=math.radians(1e-3))


def with_angles(change: Callable[[Array], Array]) -> Inclinations:
    return replace(inclinations(), angle=change(inclinations().angle.copy()))


def test_one_joint_only_says_what_it_does_not_tell() -> None:
    def of_link_3(angle: Array) -> Array:
        angle[:, [0, 1, 3, 4]] = math.nan
        return angle

    result = truearm.tilting(KATANA, with_angles(of_link_3))
    messages = {notice.code: notice.message for notice in result.notices}
    for name in ("backlash_4", "clearance_5", "clearance_2"):
        assert name in messages["tilting-unseen"]
    assert "backlash_2" not in messages["tilting-unseen"]
    assert result.fit.robot.values["backlash_3"] == pytest.approx(TRUTH["backlash_3"], abs=math.radians(1e-3))


def test_zeros_of_instruments_and_relative_readings_change_nothing() -> None:
    def zeroed(angle: Array) -> Array:
        relative = angle - np.radians(20.0) * np.array([1.0, -1.0, 0.0])
        return np.where(np.abs(relative) < math.pi / 2, relative, math.nan)

    plain, other = tilting_result(), truearm.tilting(KATANA, with_angles(zeroed))
    assert other.seats()[1]["zero_deg"]["x"] == pytest.approx(-20.0, abs=1.0)
    for name in ("backlash_3", "clearance_4", "compliance_2"):
        p = plain.fit.robot.parameters[name]
        assert other.fit.robot.values[name] == pytest.approx(p.value, abs=p.deviation)
    assert plain.seats()[2]["zero_deg"].keys() == {"x", "y"}


def test_an_instrument_that_sits_askew_is_told_and_taken_into_account() -> None:
    def askew(angle: Array) -> Array:
        """Turn the instrument of link 3, which sees all three axes here, by 8 deg about its z."""
        up = np.sin(simulated_in_space()[:, 2])
        c, s = math.cos(math.radians(8.0)), math.sin(math.radians(8.0))
        angle[:, 2, 0] = np.arcsin(np.clip(c * up[:, 0] + s * up[:, 1], -1.0, 1.0))
        angle[:, 2, 1] = np.arcsin(np.clip(c * up[:, 1] - s * up[:, 0], -1.0, 1.0))
        return angle

    result = truearm.tilting(KATANA, with_angles(askew))
    assert codes(result) == {"upright-unseen": "warning", "instrument-turned": "note"}
    assert "link 3 by " in result.notices[-1].message
    assert result.fit.robot.values["backlash_3"] == pytest.approx(TRUTH["backlash_3"], abs=math.radians(1e-3))
    assert result.fit.excess < 1.5


@cache
def simulated_in_space() -> Array:
    """What three axes of each link read in the same postures."""
    from truearm.engine.twin.truths import truth_twin
    from truearm.inclinometers.pairs import inclinations as angles

    twin, rng = truth_twin(KATANA, "tilting", np.random.default_rng(0)), np.random.default_rng(0)
    return angles(twin, inclinations().joints, 0.0, rng, wrench=inclinations().wrench)


def exchanged(angle: Array) -> Array:
    angle[:, 2, [0, 1]] = angle[:, 2, [1, 0]]
    return angle


def reversed_x(angle: Array) -> Array:
    angle[:, 3, 0] *= -1.0
    return angle


def wrong_link(angle: Array) -> Array:
    angle[:, [2, 3]] = angle[:, [3, 2]]
    return angle


@pytest.mark.parametrize(
    ("lie", "says"),
    [
        pytest.param(exchanged, "link 3: the axes .* exchanged or reversed.*x is y, y is x", id="axes exchanged"),
        pytest.param(reversed_x, "link 4: the axes .* exchanged or reversed.*x is -x", id="sign reversed"),
        pytest.param(lambda angle: -angle, "axes .* exchanged or reversed.*x is -x, y is -y", id="all reversed"),
        pytest.param(lambda _: -simulated_in_space(), "exchanged or reversed", id="read downwards"),
        pytest.param(wrong_link, "link 3: the angles .* do not follow.*They fit link 4", id="another link"),
        pytest.param(lambda angle: angle[::-1], "do not follow the robot.*Check the robot", id="other joint positions"),
    ],
)
def test_angles_that_do_not_follow_the_robot_are_refused(lie: Callable[[Array], Array], says: str) -> None:
    with pytest.raises(InputError, match=f"(?s){says}") as refusal:
        truearm.tilting(KATANA, with_angles(lie))
    assert refusal.value.parameter == "inclinations"


def test_forces_of_the_wrong_sign_are_an_error() -> None:
    result = truearm.tilting(KATANA, replace(inclinations(), wrench=-inclinations().wrench))
    assert codes(result)["tilting-below-zero"] == "error"
    assert codes(result)["inclinations-scatter"] == "error"
    assert not result.finished


def test_an_instrument_that_shifts_is_told() -> None:
    def shifted(angle: Array) -> Array:
        angle[1::2, 2] += math.radians(0.002)
        return angle

    result = truearm.tilting(KATANA, with_angles(shifted))
    assert codes(result)["inclinations-scatter"] == "warning"
    assert "link 3" in next(n.message for n in result.notices if n.code == "inclinations-scatter")


def test_joints_that_hardly_tilt_are_better_left_alone() -> None:
    read = truearm.simulate_inclinometers(KATANA, truth="standard", poses=8, pull=0.0).inclinations
    data = truearm.simulate(KATANA, truth="standard", poses=30, noise=1e-5).data
    result = truearm.tilting(KATANA, read, data)
    assert codes(result)["tilting-not-better"] == "warning"
    assert "tilting-not-better" not in codes(tilting_result())


def test_configurations_without_a_partner_are_told() -> None:
    result = truearm.tilting(KATANA, replace(inclinations(), order=inclinations().order + 1))
    assert codes(result)["unpaired"] == "note"
    assert "1, 48" in next(n.message for n in result.notices if n.code == "unpaired")
    alone = replace(inclinations(), order=2 * inclinations().order)
    with pytest.raises(InputError, match="no two configurations can be compared"):
        truearm.tilting(KATANA, alone)


def test_a_fit_that_does_not_converge_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    from truearm.inclinometers import tilting as job

    def unsettled(*arguments: Any) -> TiltingFit:
        return replace(known, converged=False)

    known = tilting_result().fit
    monkeypatch.setattr(job, "calibrate_tilting", unsettled)
    result = truearm.tilting(KATANA, inclinations())
    assert codes(result)["not-converged"] == "error"
    assert result.summary()["status"] == "not-converged"


def test_sliding_joints_do_not_lean() -> None:
    gantry = replace(load_robot("li3"), name="gantry")
    joints = tuple(replace(joint, kind="prismatic", limits=(0.0, 0.5)) for joint in gantry.joints)
    with pytest.raises(InputError, match="no joint of this robot turns") as refusal:
        truearm.plan_inclinometers(replace(gantry, joints=joints), poses=8)
    assert refusal.value.parameter == "robot"


@pytest.mark.parametrize(
    ("options", "parameter", "says"),
    [
        ({"inclinations": "irb120"}, "inclinations", "this is a robot"),
        ({"robot": "irb120"}, "inclinations", "number of joints differs"),
        ({"model": "elastic"}, "model", "offsets, joints, geometric"),
        ({"train": 10}, "train", "no poses to split"),
        ({"poses": "measured", "train": 1000}, "train", "must leave some held out"),
        ({"pushed": "unpaired"}, "pushed", "not in pairs"),
        ({"pushed": "no sigma"}, "pushed", "standard deviation"),
    ],
)
def test_refusals(options: dict[str, Any], parameter: str, says: str) -> None:
    pushed = simulated().pushed
    assert pushed is not None
    known = {
        "measured": measured(),
        "unpaired": pushed.of_configurations(range(1, 16)),
        "no sigma": replace(pushed, sigma=None),
    }
    options_given: dict[str, Any] = {"robot": KATANA, "inclinations": inclinations()} | {
        n: known.get(v, v) for n, v in options.items()
    }
    with pytest.raises(InputError, match=says) as refusal:
        truearm.tilting(**options_given)
    assert refusal.value.parameter == parameter


def test_files_hold_both_stages(tmp_path: Path) -> None:
    result = tilting_result()
    written = result.save(tmp_path)
    names = ["calibrated.yaml", "result.json", "report.html", "calibrated.urdf", "geometry.html"]
    assert [path.name for path in written] == names
    content = json.loads((tmp_path / "result.json").read_text())
    assert content["truearm"] == "truearm-tilting/1"
    assert [row["name"] for row in content["constants"][:3]] == ["clearance_1", "backlash_1", "compliance_1"]
    assert (
        content["geometry"]["validation"]["position_mm"]["mean"]
        < 0.2 * (content["geometry_alone"]["validation"]["position_mm"]["mean"])
    )
    again = truearm.load_robot(tmp_path / "calibrated.yaml")
    assert again.values == pytest.approx(result.robot.values)
    page = (tmp_path / "report.html").read_text()
    for place in ("angles", "compliances", "changes", "errors"):
        assert f'id="{place}"' in page
    assert "geometry.html" in page


def test_a_page_without_poses_and_with_odd_names(tmp_path: Path) -> None:
    read = replace(inclinations(), source="<b>.csv")
    sensors = replace(read.instruments, names=tuple(f"{name}, sensor <i>" for name in read.instruments.names))
    truearm.tilting(KATANA, replace(read, instruments=sensors), out=tmp_path, notes={"serial": "<u>"})
    page = (tmp_path / "report.html").read_text()
    assert "<u>" not in page.partition("<script")[0]
    assert "sensor <i>" not in page
    assert not (tmp_path / "geometry.html").exists()


def test_controllers_joints_are_the_models(tmp_path: Path) -> None:
    robot = load_robot("lrmate200ic")
    options: dict[str, Any] = {"truth": "nominal", "poses": 16, "payload": "1kg,80mm,0mm,50mm"}
    model = truearm.simulate_inclinometers(robot, **options).inclinations
    shown = truearm.simulate_inclinometers(robot, **options, joints="controller", out=tmp_path / "data.csv")
    assert "axis_3 [deg]" in inclinations_text(shown.inclinations)
    assert [file.name for file in shown.files] == ["data.csv", "data-pushed.csv"]
    result = truearm.tilting(robot, tmp_path / "data.csv", payload="1kg,80mm,0mm,50mm")
    assert result.changes.pairs.in_turn.joints == pytest.approx(model.joints, abs=1e-9)


def test_poses_that_were_not_seen_are_better_met_and_the_robot_keeps_the_constants() -> None:
    result = tilting_result()
    assert result.geometry is not None
    assert result.geometry_alone is not None
    after, alone = result.geometry.validation, result.geometry_alone.validation
    assert after is not None
    assert alone is not None
    assert after.configurations == 18
    assert after.position_norms.mean() < 0.2 * alone.position_norms.mean()
    assert result.finished
    for name in result.fit.names:
        assert result.robot.parameters[name] == result.fit.robot.parameters[name]
    proof = result.robot.proof
    assert proof is not None
    assert {*result.fit.names, "a_3"} <= {*proof.names}
    assert [line.split(" by ")[0] for line in result.robot.history] == ["tilt, backlash and compliance", "calibrated"]
    deviation = proof.deviations[proof.names.index("backlash_3")]
    assert deviation == pytest.approx(result.robot.parameters["backlash_3"].deviation, rel=1e-6)
