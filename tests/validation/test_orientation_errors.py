"""Orientation errors by their parts: a rotation vector in the base frame, and differences of ZXZ angles."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.document.drawing import significant
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, quaternion_from_rotation, rotation_from_vector
from truearm.validation.jobs import validate
from truearm.validation.region import orientation_block, orientation_errors, zxz_angles
from truearm.validation.report import validation_figures, validation_html


def about(axis: str, angle: Array) -> Array:
    return rotation_from_vector(np.outer(angle, np.eye(3)["xyz".index(axis)]))


def zxz(angles: Array) -> Array:
    return np.asarray(about("z", angles[:, 0]) @ about("x", angles[:, 1]) @ about("z", angles[:, 2]))


def test_angles_come_back_in_every_quadrant() -> None:
    rng = np.random.default_rng(0)
    angles = rng.uniform([-np.pi, 0.01, -np.pi], [np.pi, np.pi - 0.01, np.pi], (200, 3))
    assert np.abs(zxz_angles(zxz(angles)) - angles).max() < 1e-12


def test_angles_without_a_middle_one() -> None:
    turned = zxz(np.array([[0.3, 0.0, 0.4], [0.3, np.pi, 0.4]]))
    result = zxz_angles(turned)
    assert np.abs(zxz(result) - turned).max() < 1e-12
    assert result[:, 2].tolist() == [0.0, 0.0]


def with_poses(turned: Array, joints: Array) -> tuple[Robot, Dataset]:
    """Return a robot before an instrument that is turned, and readings that miss it by turns in its base frame."""
    half = np.sqrt(0.5)
    robot = load_robot("irb120").with_frames(
        Transform((0.4, -0.3, 0.2), (half, 0.0, 0.0, half)), {"tool": Transform((0.1, 0.0, 0.05), (1.0, 0.0, 0.0, 0.0))}
    )
    position, R = robot.world_poses(joints, "tool")
    in_base = robot.base.rotation.T @ R
    measured = robot.base.rotation @ np.swapaxes(turned, 1, 2) @ in_base
    data = Dataset(
        source="made",
        labels=tuple(str(i) for i in range(len(joints))),
        joints=joints,
        joint_kinds=("revolute",) * 6,
        targets=("tool",),
        configuration=np.arange(len(joints)),
        target=np.zeros(len(joints), dtype=np.intp),
        position=position,
        quaternion=quaternion_from_rotation(measured),
    )
    return robot, data


def test_a_turn_about_an_axis_of_the_base_shows_there() -> None:
    rng = np.random.default_rng(1)
    joints = load_robot("irb120").random_configurations(20, rng)
    robot, data = with_poses(about("x", np.full(20, 0.01)), joints)
    result = orientation_errors(robot, data, errors_of(robot, data))
    assert result is not None
    assert result.vector == pytest.approx(np.tile([0.01, 0.0, 0.0], (20, 1)), abs=1e-9)
    # A turn about the base's z axis is an error of Phi alone.
    robot, data = with_poses(about("z", np.full(20, 0.01)), joints)
    result = orientation_errors(robot, data, errors_of(robot, data))
    assert result is not None
    assert result.zxz[np.isfinite(result.zxz[:, 0])] == pytest.approx(
        np.tile([0.01, 0.0, 0.0], (20 - result.locked, 1)), abs=1e-9
    )
    held = orientation_block(result).in_json["orientation_parts_deg"]
    assert held["rotation_vector"]["rz"]["mean"] == pytest.approx(np.degrees(0.01))
    assert held["zxz"]["phi"]["max"] == pytest.approx(np.degrees(0.01))


def test_angles_across_half_a_turn_differ_by_little() -> None:
    joints = np.radians([[0.0, 0.0, 0.0, 0.0, 45.0, 0.0]])
    robot, _ = with_poses(about("z", np.zeros(1)), joints)
    phi = float(zxz_angles(robot.base.rotation.T @ robot.world_poses(joints, "tool")[1])[0, 0])
    joints[0, 0] = np.pi - 0.5e-3 - phi  # joint 1 turns about the base's z axis, so Phi goes with it
    robot, data = with_poses(about("z", np.full(1, -1e-3)), joints)
    result = orientation_errors(robot, data, errors_of(robot, data))
    assert result is not None
    assert result.zxz[0] == pytest.approx([-1e-3, 0.0, 0.0], abs=1e-9)


def test_where_the_middle_angle_is_nearly_zero_the_others_are_left_out() -> None:
    joints = np.radians([[0.0, 0.0, 0.0, 0.0, 90.0, 0.0], [0.0, 0.0, 0.0, 0.0, 45.0, 0.0]])
    robot, data = with_poses(about("x", np.full(2, 1e-4)), joints)
    result = orientation_errors(robot, data, errors_of(robot, data))
    assert result is not None
    assert result.locked == 1
    assert np.isnan(result.zxz[0, [0, 2]]).all()
    assert np.isfinite(result.zxz[1]).all()
    (line,) = orientation_block(result).lines
    assert "(Phi and Psi without 1 readings near Theta 0 or 180)" in line
    alone = orientation_errors(robot, data.of_configurations([0]), errors_of(robot, data.of_configurations([0])))
    assert alone is not None
    assert alone.parts["phi"] is None
    assert "Phi –" in orientation_block(alone).text


def test_positions_alone_have_no_orientation() -> None:
    robot, data = with_poses(about("x", np.zeros(2)), np.zeros((2, 6)))
    plain = replace(data, quaternion=None)
    assert orientation_errors(robot, plain, errors_of(robot, plain)) is None


def test_parts_are_drawn_and_tabled_in_degrees() -> None:
    joints = load_robot("irb120").random_configurations(8, np.random.default_rng(2))
    joints[0] = np.radians([0.0, 0.0, 0.0, 0.0, 90.0, 0.0])  # Theta is nearly zero there
    robot, data = with_poses(about("x", np.linspace(1e-3, 3e-3, 8)), joints)
    judged = validate(robot, data)
    result = judged.orientations
    assert result is not None
    assert result.locked == 1
    traces = validation_figures(judged)["orientation-parts"]["data"]
    assert [trace["name"] for trace in traces] == ["rx", "ry", "rz", "Φ", "Θ", "Ψ"]
    for trace, values in zip(traces, [*result.vector.T, *result.zxz.T], strict=True):
        assert trace["y"] == pytest.approx(np.degrees(values[np.isfinite(values)]), abs=1e-4)
    assert len({trace["marker"]["color"] for trace in traces}) == 4  # one for all three angles
    page = validation_html(judged)
    for name, part in result.parts.items():
        assert part is not None
        shown = {"phi": "Φ", "theta": "Θ", "psi": "Ψ"}.get(name, name)
        count = 7 if name in ("phi", "psi") else 8
        sizes = '</td><td class="n">'.join(f"{part[key]:.4f}" for key in ("mean_size", "rms", "max"))
        assert re.search(rf">{shown}</td><td[^>]*>{count}</td><td[^>]*>{part['mean']:+.4f}".replace("+", r"\+"), page)
        assert sizes in page
    assert "1 readings with Θ within 3 deg of 0 or 180 are left out" in page
    assert judged.orientation is not None
    assert f">{significant(1e3 * judged.orientation.mean)}</td>" in page
