"""Robots without meshes: closed links that hang together, drawn where the robot's model says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.studio.arms import GANTRY, ODD, SCARA

from truearm.engine.robot.library import library, load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rotation_from_quaternion
from truearm.studio.joint_layout import THICKNESS, layout
from truearm.studio.robot_shape import RobotShape, link_poses, robot_shape
from truearm.studio.solids import Mesh, ball, box, drum, together, tube

ARMS = [*(load_robot(name) for name in library()), *ODD]
Array = np.ndarray


def is_closed(mesh: Mesh) -> bool:
    """Return whether every edge has a triangle to either side, corners at one place taken as one."""
    _, of = np.unique(np.round(mesh.vertices, 9), axis=0, return_inverse=True)
    faces = of.reshape(-1)[mesh.faces]
    ways = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there, back = (np.unique(w[:, 0] * len(mesh.vertices) + w[:, 1], return_counts=True) for w in (ways, ways[:, ::-1]))
    return np.array_equal(there[0], back[0]) and np.array_equal(there[1], back[1])


def volume(mesh: Mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("ni,ni->n", a, np.cross(b, c)).sum() / 6.0)


def configurations(robot: Robot) -> Array:
    return robot.random_configurations(5, np.random.default_rng(3))


def placed(robot: Robot, shape: RobotShape, q: Array) -> list[tuple[Array, Array]]:
    positions, quaternions = link_poses(robot, q[None])
    rotations = rotation_from_quaternion(quaternions)
    assert positions.shape[1] == len(shape.links)
    return list(zip(rotations[0], positions[0], strict=True))


def drawn(shape: RobotShape, places: list[tuple[Array, Array]], number: int) -> Array:
    link = shape.links[number]
    rotation, position = places[number]
    return np.asarray(together([link.bodies, link.joints]).vertices @ rotation.T + position)


def test_an_open_surface_is_not_taken_for_a_closed_one() -> None:
    whole = ball(np.zeros(3), 0.1)
    assert is_closed(whole)
    assert not is_closed(Mesh(whole.vertices, whole.faces[1:]))


def test_solids_are_closed_and_seen_from_outside() -> None:
    corners = [np.zeros(3), np.array([0.0, 0, 0.3]), np.array([0.4, 0, 0.3])]
    solids = [
        (tube(corners[:2], (0.05, 0.05)), np.pi * 0.05**2 * 0.3 + 4 / 3 * np.pi * 0.05**3),
        (ball(corners[2], 0.1), 4 / 3 * np.pi * 0.1**3),
        (drum(corners[1], corners[2], 0.1), np.pi * 0.1**2 * 0.4),
        (box(corners[2], np.eye(3), (0.1, 0.2, 0.3)), 8 * 0.006),
        (tube(corners, (0.06, 0.04), flat_end=True), None),
    ]
    for solid, size in solids:
        assert is_closed(solid)
        assert volume(solid) > 0.0
        if size is not None:
            assert volume(solid) == pytest.approx(size, rel=0.05)


def test_a_tube_bends_at_its_corners_and_cuts_those_that_are_too_near() -> None:
    path = [np.zeros(3), np.array([0.0, 0, 0.3]), np.array([0.3, 0, 0.3])]
    straight = tube([path[0], path[2]], (0.05, 0.05))
    bent = tube(path, (0.05, 0.05))
    near = tube([path[0], np.array([0.0, 0.0, 0.02]), path[2]], (0.05, 0.05))
    assert len(bent.vertices) > len(near.vertices) == len(straight.vertices)
    # The bend stays inside its corner, and has no fold: no triangle has turned inside out.
    assert np.linalg.norm(bent.vertices - path[1], axis=1).min() > 0.0
    assert volume(bent) == pytest.approx(np.pi * 0.05**2 * 0.55 + 4 / 3 * np.pi * 0.05**3, rel=0.08)


@pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.name)
def test_every_link_is_closed(robot: Robot) -> None:
    for link in robot_shape(robot).links:
        for mesh in (link.bodies, link.joints):
            assert is_closed(mesh)
            assert np.isfinite(mesh.vertices).all()
            assert not len(mesh.faces) or volume(mesh) > 0.0


@pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.name)
def test_links_hang_together_in_every_posture(robot: Robot) -> None:
    shape = robot_shape(robot)
    joints = shape.layout.joints
    for q in configurations(robot):
        places = placed(robot, shape, q)
        for number, joint in enumerate(joints, 1):
            line, before = shape.layout.lines[number], shape.layout.lines[number - 1]
            (R, p), (R0, p0) = places[number], places[number - 1]
            assert line.axis is not None
            assert before.next_axis is not None
            # The end of the link before lies on the axis of the joint, and within its drum or on its rail.
            end = R0 @ (before.origin + joint.before * before.next_axis) + p0
            along = R.T @ (end - p)
            assert np.linalg.norm(np.cross(along, line.axis)) < 1e-9
            if joint.slides:
                assert joint.reach[0] - 1e-9 <= joint.before <= joint.reach[1] + 1e-9
            else:
                low, high = sorted((joint.before, joint.behind))
                assert low - 1e-9 <= along @ line.axis <= high + 1e-9
            # And what is drawn of the two touches: a corner of one is within a radius of a corner of the other.
            one, other = drawn(shape, places, number - 1), drawn(shape, places, number)
            nearest = np.linalg.norm(one[:, None, ::1] - other[None, ::3], axis=2).min()
            assert nearest < (2.0 * joint.radius if not joint.slides else np.inf)


@pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.name)
def test_the_flange_is_drawn_where_the_model_has_it(robot: Robot) -> None:
    moved = robot.with_frames(Transform((0.4, -0.2, 0.1), (0.8, 0.0, 0.6, 0.0)), {"ball": (0.01, 0.02, 0.1)})
    shape, q = robot_shape(moved), configurations(robot)
    positions, quaternions = link_poses(moved, q)
    p, R = moved.forward(q, frame="world")
    flange = [link.name for link in shape.links].index("flange")
    assert np.abs(positions[:, flange] - p).max() < 1e-12
    assert np.abs(rotation_from_quaternion(quaternions[:, flange]) - R).max() < 1e-9
    disc = shape.links[flange].joints.vertices
    assert disc[:, 2].max() == pytest.approx(0.0, abs=1e-12)
    seen = R[0] @ shape.links[-1].joints.vertices.mean(axis=0) + p[0]
    assert np.abs(seen - moved.forward(q[0], frame="world", target="ball")[0][0]).max() < 1e-3
    # The base is drawn in the base frame, whatever the joints do.
    assert np.abs(positions[:, 0] - [0.4, -0.2, 0.1]).max() < 1e-12


def test_an_elastic_arm_is_drawn_bent() -> None:
    robot = load_robot("irb120").with_effects(["compliance"])
    robot = robot.with_values({name: 1e-4 for name in robot.parameters if name.startswith("compliance")})
    q = configurations(robot)[:1]
    bent, straight = link_poses(robot, q)[0], link_poses(robot.rigid, q)[0]
    assert np.abs(bent[0, -1] - robot.forward(q, frame="world")[0][0]).max() < 1e-12
    drop = np.linalg.norm(bent - straight, axis=2)[0]
    assert drop[0] == 0.0
    assert drop[-1] > 1e-4
    assert (np.diff(drop)[2:] > -1e-4).all()


def test_arms_grow_thinner_from_base_to_flange() -> None:
    for robot in ARMS[:-1]:
        plan = layout(robot)
        radii = [joint.radius for joint in plan.joints]
        assert radii == sorted(radii, reverse=True)
        assert radii[0] <= THICKNESS[0] * plan.length * (1.0 + 1e-9)
        assert radii[-1] >= 0.4 * THICKNESS[1] * plan.length


def test_links_of_a_universal_robot_pass_each_other() -> None:
    plan = layout(load_robot("ur5e"))
    shoulder, elbow, wrist = plan.joints[1:4]
    # Upper arm and forearm are beside each other, and the wrist at the offset of the table.
    assert abs(shoulder.behind - shoulder.before) > 1.5 * elbow.radius
    assert abs(elbow.behind - elbow.before) > 1.2 * elbow.radius
    assert wrist.behind == pytest.approx(0.0, abs=1e-9) or wrist.behind == pytest.approx(0.1333, abs=1e-9)


def test_a_base_frame_in_the_shoulder_is_put_on_a_pedestal() -> None:
    assert layout(load_robot("katana450")).pedestal > 0.1
    assert layout(load_robot("irb120")).pedestal == 0.0
    foot = robot_shape(load_robot("puma560")).links[0].joints.vertices[:, 2]
    assert foot.min() == pytest.approx(-layout(load_robot("puma560")).pedestal)


def test_sliding_joints_run_on_rails() -> None:
    shape = robot_shape(GANTRY)
    low, high = np.array([joint.limits for joint in GANTRY.joints if joint.limits]).T
    for q in (low, high, (low + high) / 2.0):
        places = placed(GANTRY, shape, q)
        for number in range(3):
            # The middle of the carriage lies within what is drawn of the rail.
            rail = drawn(shape, places, number)
            carriage = places[number + 1][1]
            assert (carriage >= rail.min(axis=0) - 1e-9).all()
            assert (carriage <= rail.max(axis=0) + 1e-9).all()
    column = robot_shape(SCARA)
    assert column.links[1].bodies.vertices[:, 2].max() > 0.4


def test_identified_geometry_does_not_change_the_shape() -> None:
    robot = load_robot("irb120")
    changed = robot.with_values({"alpha_3": 1e-4, "a_3": 0.2703, "theta_offset_2": -1.569})
    for one, other in zip(robot_shape(robot).links, robot_shape(changed).links, strict=True):
        assert np.array_equal(one.bodies.vertices, other.bodies.vertices)


def test_nearly_parallel_axes_count_as_parallel() -> None:
    """A maker's calibrated table puts origins hundreds of metres away along axes that are all but parallel."""
    robot = load_robot("ur5e")
    joints = list(robot.joints)
    joints[1] = replace(joints[1], row={**joints[1].row, "alpha": 0.002})
    plan, plain = layout(replace(robot, joints=tuple(joints))), layout(robot)
    for one, other in zip(plan.joints, plain.joints, strict=True):
        assert one.before == pytest.approx(other.before, abs=5e-3)
