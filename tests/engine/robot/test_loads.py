from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.arms import ARMS
from tests.engine.robot.test_chain import random_frame, random_robot, random_unit
from tests.expecting import refusing
from tests.pinocchio_oracle import Body, PinocchioChain

from truearm import InputError
from truearm.engine.robot.chain import Array, Chain, Direction, Element, across, axis_of
from truearm.engine.robot.conventions import CONVENTIONS
from truearm.engine.robot.conventions.convention import Convention, JointKind
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.loads import joint_efforts, joint_loads
from truearm.engine.robot.parts import Joint, LinkMass, Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.seal import is_intact
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import Transform
from truearm.engine.robot.wrench import WRENCH_FRAMES, Wrench, WrenchFrame
from truearm.engine.twin.twin import Twin, carried, directions_at, measure, with_wrench_read
from truearm.engine.twin.twin_joint import JointTruth
from truearm.robot_files.jobs import export

CONFIGURATIONS = 7
CONVENTION = {c.name: c for c in CONVENTIONS}


def random_triple(rng: np.random.Generator, size: float) -> Direction:
    x, y, z = (float(v) for v in rng.uniform(-size, size, 3))
    return x, y, z


def random_link(joint: int, rng: np.random.Generator) -> LinkMass:
    """A body of eight point masses, so that its inertia is one that a body can have."""
    masses, points = rng.uniform(0.1, 1, 8), rng.uniform(-0.2, 0.2, (8, 3))
    cog = masses @ points / masses.sum()
    arms = points - cog
    tensor = sum(m * (arm @ arm * np.eye(3) - np.outer(arm, arm)) for m, arm in zip(masses, arms, strict=True))
    xx, yy, zz, xy, xz, yz = (float(np.asarray(tensor)[e]) for e in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
    x, y, z = (float(v) for v in cog)
    return LinkMass(joint, float(masses.sum()), (x, y, z), (xx, yy, zz, xy, xz, yz))


def laden(robot: Robot, rng: np.random.Generator) -> Robot:
    """The robot with another base, a payload and gravity in any direction."""
    return replace(
        robot.with_frames(random_frame(rng), {}),
        payload=Payload(float(rng.uniform(0.5, 3)), random_triple(rng, 0.2)),
        gravity=random_triple(rng, 10),
    )


def with_bearings(robot: Robot, rng: np.random.Generator) -> Robot:
    """The robot with the bearing of every joint that turns somewhere on its axis."""
    joints = [
        replace(joint, bearing=float(rng.uniform(-0.3, 0.3))) if joint.kind == "revolute" else joint
        for joint in robot.joints
    ]
    return replace(robot, joints=tuple(joints))


def heavy_robot(convention: Convention, rng: np.random.Generator) -> Robot:
    """Up to seven joints of both kinds with bearings anywhere; masses on most links, two on some."""
    kinds: tuple[JointKind, ...] = tuple(
        "revolute" if rng.random() < 0.7 else "prismatic" for _ in range(int(rng.integers(2, 8)))
    )
    robot = with_bearings(random_robot(convention, (), rng, kinds), rng)
    links = [i + 1 for i in range(len(kinds)) for _ in range(int(rng.choice([0, 1, 1, 1, 2])))]
    return laden(replace(robot, masses=tuple(random_link(i, rng) for i in links)), rng)


def motion(robot: Robot, rng: np.random.Generator, count: int = CONFIGURATIONS) -> tuple[Array, Array, Array, Array]:
    """Random joint variables, velocities, accelerations and external wrenches."""
    joints = len(robot.joints)
    variables = robot.variables(robot.random_configurations(count, rng), robot.values)
    return variables, rng.normal(size=(joints, count)), rng.normal(size=(joints, count)), rng.normal(size=(6, count))


# -- against Pinocchio -----------------------------------------------------------------------------------


def stayed(elements: Sequence[Element], end: int, point: Direction, robot: Robot) -> Array:
    """Where a point of the link that ends there is, by the twin's way to tell how far slides have carried it."""
    axes = directions_at(elements, end)
    return np.array(point) - sum((carried(elements, end, a, robot.values) * a for a in axes), np.zeros(3))


def bearing_of(elements: Sequence[Element], place: int, robot: Robot) -> float:
    """How far from its origin the bearing of the joint at a place lies, by the twin's way."""
    if not elements[place].turns:
        return 0.0
    bearing = robot.joints[elements[place].variable or 0].bearing or 0.0
    return bearing - carried(elements, place, np.array(axis_of(elements[place])), robot.values)


def by_pinocchio(robot: Robot, variables: Array, velocity: Array, acceleration: Array, wrench: Array) -> Array:
    elements = [e for link in robot.link_elements for e in link]
    ends = np.cumsum([len(link) for link in robot.link_elements])
    whole = Chain((*elements, *robot.flange_elements))
    bodies = []
    for link in robot.masses:
        xx, yy, zz, xy, xz, yz = link.inertia
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        end = int(ends[link.joint - 1])
        bodies.append(Body(end, link.mass, stayed(elements, end, link.cog, robot), tensor))
    bodies.append(Body(len(whole.elements), robot.payload.mass, np.array(robot.payload.cog), np.zeros((3, 3))))
    oracle = PinocchioChain(whole, robot.values, bodies)
    joints = [e for e in whole.elements if e.variable is not None]
    own_axes = [np.array([*across(e), axis_of(e)]) for e in joints]
    lever = [bearing_of(elements, elements.index(e), robot) * np.array(axis_of(e)) for e in joints]
    loads = np.empty((len(joints), 6, variables.shape[1]))
    for k in range(variables.shape[1]):
        reactions = oracle.reactions(
            variables[:, k], velocity[:, k], acceleration[:, k], np.array(robot.gravity), wrench[:, k]
        )
        for i, axes in enumerate(own_axes):
            moment = reactions[i, 3:] - np.cross(lever[i], reactions[i, :3])
            loads[i, :3, k], loads[i, 3:, k] = -axes @ reactions[i, :3], -axes @ moment
    return loads


def compare_with_pinocchio(robot: Robot, rng: np.random.Generator) -> None:
    variables, velocity, acceleration, wrench = motion(robot, rng)
    still, none = np.zeros_like(velocity), np.zeros_like(wrench)
    for v, a, w in ((None, None, None), (None, None, wrench), (velocity, acceleration, None), (velocity, None, wrench)):
        actual = joint_loads(robot, variables, velocity=v, acceleration=a, wrench=w)
        inputs = (default if values is None else values for values, default in ((v, still), (a, still), (w, none)))
        expected = by_pinocchio(robot, variables, *inputs)
        for part in (slice(0, 3), slice(3, 6)):
            size = np.abs(expected[:, part]).max()
            assert size > 0.1
            assert_allclose(actual[:, part], expected[:, part], rtol=0, atol=1e-10 * size)


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda c: c.name)
def test_random_robot_agrees_with_pinocchio(convention: Convention) -> None:
    for seed in range(4):
        rng = np.random.default_rng(seed)
        compare_with_pinocchio(heavy_robot(convention, rng), rng)


def test_library_robot_agrees_with_pinocchio() -> None:
    robots = [robot for robot_id in ARMS if (robot := load_robot(robot_id)).masses]
    assert {"irb120", "katana450"} <= {robot.name for robot in robots}
    for robot in robots:
        rng = np.random.default_rng(1)
        compare_with_pinocchio(robot, rng)
        off = robot.with_values({n: p.value + 1e-3 * rng.normal() for n, p in robot.parameters.items()})
        compare_with_pinocchio(with_bearings(laden(off, rng), rng), rng)


# -- closed forms ----------------------------------------------------------------------------------------


def lever(**changes: object) -> Robot:
    """A level axis along y of the base and, at zero, a weightless arm of 0.8 m along x with 2 kg at its end."""
    robot = Robot(
        name="lever",
        title="lever",
        source="made up",
        convention_name="modified-dh",
        joints=(Joint("swing", "revolute", {"alpha": -np.pi / 2, "a": 0.0, "theta_offset": 0.0, "d": 0.0}),),
        flange=Transform((0.8, 0.0, 0.0)),
        payload=Payload(2.0),
    )
    return replace(robot, **changes)  # type: ignore[arg-type]


def test_level_arm_sags_forward() -> None:
    q = np.radians([[0.0, 60.0, 90.0, -30.0]])
    loads = joint_loads(lever(), q)
    weight = 2.0 * 9.80665
    assert_allclose(loads[0, 5], weight * 0.8 * np.cos(q[0]), rtol=1e-15, atol=1e-14)
    assert_allclose(loads[0, :2], weight * np.array([np.sin(q[0]), np.cos(q[0])]), rtol=0, atol=1e-14)
    assert_allclose(loads[0, 2:5], 0.0, rtol=0, atol=1e-14)
    assert loads[0, 5, 0] > 0  # turning forward, about y of the base, lowers the arm
    straight, sagged = (lever().world_poses(np.array([[turn]]))[0][0, 2] for turn in (0.0, 1e-4 * loads[0, 5, 0]))
    assert sagged < straight


def test_weight_beside_the_plane_of_an_arm_twists_its_bearing() -> None:
    loads = joint_loads(lever(payload=Payload(2.0, (0.0, 0.0, 0.3))), np.zeros((1, 1)))
    # 0.3 m along the axis, which is y of the base, and the weight is along y of the joint
    assert_allclose(loads[0, 3:, 0], 2.0 * 9.80665 * np.array([-0.3, 0.0, 0.8]), rtol=0, atol=1e-14)


def test_turning_mass_pulls_outwards_and_resists() -> None:
    weightless = lever(gravity=(0.0, 0.0, 0.0))
    loads = joint_loads(weightless, np.array([[0.3]]), velocity=np.array([[4.0]]), acceleration=np.array([[5.0]]))
    # m w^2 r outwards along x of the joint, m r alpha backwards, m r^2 alpha against the turn
    assert_allclose(loads[0, :, 0], [2 * 16 * 0.8, -2 * 0.8 * 5, 0, 0, 0, -2 * 0.64 * 5], rtol=0, atol=1e-13)


# -- what must hold for every arm ------------------------------------------------------------------------


def centre_of(robot: Robot, link: LinkMass) -> list[Element]:
    """The way from a link's frame to its centre of gravity."""
    every = [e for each in robot.link_elements for e in each]
    end = sum(len(each) for each in robot.link_elements[: link.joint])
    x, y, z = (float(v) for v in stayed(every, end, link.cog, robot))
    return [Element("Tx", x), Element("Ty", y), Element("Tz", z)]


def height_of_weight(robot: Robot, bodies: Array, elements: tuple[tuple[Element, ...], ...]) -> Array:
    """Potential energy [J] of the links, by the poses of their centres of gravity."""
    energy = np.zeros(bodies.shape[1])
    for link in robot.masses:
        way = [e for each in elements[: link.joint] for e in each]
        way += centre_of(robot, link)
        energy -= (
            link.mass * np.array(robot.gravity) @ Chain(tuple(way)).forward_kinematics(bodies, robot.values).position
        )
    return energy


@pytest.mark.parametrize("name", ["standard-dh", "modified-hayati", "product-of-exponentials", "urdf"])
def test_power_of_the_loads_is_what_kinetic_and_potential_energy_lose(name: str) -> None:
    rng = np.random.default_rng(4)
    count = 256
    robot = replace(heavy_robot(CONVENTION[name], rng), payload=Payload())
    joints = len(robot.joints)
    phase = 2 * np.pi * np.arange(count) / count  # one period of a motion that comes back: derivatives by Fourier
    wave = 2 * np.pi * np.fft.fftfreq(count, d=2 * np.pi / count)

    def rate(series: Array) -> Array:
        return np.real(np.fft.ifft(1j * wave * np.fft.fft(series)))

    variables = np.array([[a] * count + b * np.sin(phase + c) for a, b, c in rng.uniform(-0.5, 0.5, (joints, 3))])
    velocity = np.array([rate(row) for row in variables])
    acceleration = np.array([rate(row) for row in velocity])
    energy = height_of_weight(robot, variables, robot.link_elements)
    for link in robot.masses:
        way = [e for each in robot.link_elements[: link.joint] for e in each]
        way += centre_of(robot, link)
        kinematics = Chain(tuple(way)).forward_kinematics(variables, robot.values)
        R = kinematics.matrix()
        energy += 0.5 * link.mass * (rate(kinematics.position) ** 2).sum(axis=0)
        body_rates = np.swapaxes(R, 1, 2) @ np.moveaxis(rate(np.moveaxis(R, 0, -1)), -1, 0)
        spin = np.stack([body_rates[:, 2, 1], body_rates[:, 0, 2], body_rates[:, 1, 0]])
        xx, yy, zz, xy, xz, yz = link.inertia
        energy += 0.5 * np.einsum("in,ij,jn->n", spin, [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], spin)
    loads = joint_loads(robot, variables, velocity=velocity, acceleration=acceleration)
    along = [5 if j.kind == "revolute" else 2 for j in robot.joints]
    power = sum(loads[i, k] * velocity[i] for i, k in enumerate(along))
    assert np.abs(power).max() > 0.1
    assert_allclose(power, -rate(energy), rtol=0, atol=1e-9 * np.abs(power).max())


def test_nothing_weighs_nothing() -> None:
    robot = load_robot("irb120")
    q = robot.random_configurations(CONFIGURATIONS, np.random.default_rng(6)).T
    for masses in ((), tuple(replace(m, mass=0.0) for m in robot.masses)):
        loads = joint_loads(replace(robot, masses=masses), q, velocity=np.ones_like(q), acceleration=np.ones_like(q))
        assert loads.shape == (6, 6, CONFIGURATIONS)
        assert not loads.any()


def test_further_variables_of_the_chain_are_no_joints() -> None:
    rng = np.random.default_rng(13)
    robot = load_robot("irb120")
    variables, velocity, _, _ = motion(robot, rng)
    more = np.vstack([variables, rng.normal(size=(4, CONFIGURATIONS))])
    expected = joint_loads(robot, variables, velocity=velocity)
    assert_allclose(joint_loads(robot, more, velocity=velocity), expected, rtol=0, atol=0)


# -- refusals --------------------------------------------------------------------------------------------


def test_array_of_another_shape_is_refused() -> None:
    for name, shape in (("velocity", (7, 6)), ("acceleration", (5, 7)), ("wrench", (7, 6))):
        with refusing(name, "irb120", str(shape), "(6, 7)", of=name):
            joint_loads(load_robot("irb120"), np.zeros((6, 7)), **{name: np.zeros(shape)})


# -- the joint's own axes --------------------------------------------------------------------------------


def test_axes_across_a_plain_axis_are_the_two_others() -> None:
    x, y, z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    expected = {"x": (y, z), "y": (z, x), "z": (x, y)}
    for way in ("Rx", "Ry", "Rz", "Tx", "Ty", "Tz"):
        assert across(Element(way)) == expected[way[1]], way


def test_axes_across_any_axis_are_right_handed() -> None:
    rng = np.random.default_rng(14)
    plain = [s * row for s in (1.0, -1.0) for row in np.eye(3)]
    almost = [np.array([1e-9, -1e-9, s]) for s in (1.0, -1.0)]
    for axis in (*plain, *almost, *(np.array(random_unit(rng, 3)) for _ in range(200))):
        a, b, c = (float(v) for v in axis)
        element = Element("R", axis=(a, b, c))
        own = np.array([*across(element), axis_of(element)])
        assert_allclose(own @ own.T, np.eye(3), rtol=0, atol=1e-14)
        assert np.linalg.det(own) > 0


def test_axes_across_do_not_jump_near_z() -> None:
    assert across(Element("R", axis=(0.0, 0.0, 1.0))) == across(Element("Rz"))
    rng = np.random.default_rng(15)
    for _ in range(50):
        x, y = rng.normal(size=2) * 1e-4
        z = float(np.sqrt(1 - x * x - y * y))
        for own, plain in zip(across(Element("R", axis=(float(x), float(y), z))), np.eye(3), strict=False):
            assert np.linalg.norm(own - plain) < 2 * np.hypot(x, y)


# -- a force and a moment at the tool: how they are given, what they do to the joints, and what is refused

FORCE, MOMENT = (11.0, -7.0, 5.0), (0.6, -0.8, 1.1)


def drawn_place(rng: np.random.Generator) -> Transform:
    """A tool that leans, some 0.2 m from the flange."""
    frame = random_frame(rng)
    return Transform((0.05, -0.03, 0.18), frame.quaternion)


def springy(name: str, rng: np.random.Generator) -> tuple[Robot, Twin]:
    """A robot anywhere, all of whose joints give way, as a model and as a twin; turning ones about z lean, too."""
    robot = load_robot(name)
    robot = replace(robot.with_frames(random_frame(rng), {"tip": (0.03, 0.02, 0.1)}), rated_load=None)
    robot = robot.with_payload("0.5kg,10mm,20mm,60mm")
    truths = {i: JointTruth(compliance=c) for i, c in enumerate(rng.uniform(1e-5, 2e-4, len(robot.joints)), 1)}
    arm = robot.with_effects(["compliance"])
    return arm.with_values({f"compliance_{i}": t.compliance for i, t in truths.items()}), Twin(robot, truths)


# -- how it is given -------------------------------------------------------------------------------------


def test_a_text_is_in_newtons_or_in_the_units_it_says() -> None:
    for text, force, moment in (
        ("1,2,3,4,5,6", (1, 2, 3), (4, 5, 6)),
        (" 0 , -8e1, +3 ,0,0, 1.5", (0, -80, 3), (0, 0, 1.5)),
        ("1N,0.2kN,0N,1Nm,2 N m,30N mm", (1, 200, 0), (1, 2, 0.03)),
        ("0lbf,0,1lbf,0,0,500Nmm", (0, 0, 4.4482216152605), (0, 0, 0.5)),
    ):
        read = Wrench.of(text, "tool")
        assert (*read.force, *read.moment) == pytest.approx((*force, *moment)), text
        assert Wrench.of(read.text, "tool") == read
        assert Wrench.of([*force, *moment]) == replace(read, frame="base")


def test_what_is_no_wrench_is_refused() -> None:
    wrong: list[tuple[object, str]] = [
        ("1,2,3,4,5", "three forces and three moments belong here"),
        ("1,2,3,4,5,6,7", "three forces and three moments belong here"),
        ("1,2,nan,4,5,6", "a number belongs here; got 'nan'"),
        ("1,2,,4,5,6", "a number belongs here; got ''"),
        (
            "1,2,3kg,4,5,6",
            "this is no unit of a force; got '3kg'; allowed: N, kN, lbf",
        ),
        ("1,2,3,4,5,6N", "this is no unit of a moment; got '6N'; allowed: N m, Nm, N mm, Nmm"),
        ("1,2,3Nm,4,5,6", "this is no unit of a force"),
        ("1,2,3e9,4,5,6", "too large to be plausible"),
        ([1, 2, 3, 4, 5], "wrong shape"),
        ([1, 2, 3, 4, 5, math.inf], "NaN and infinity cannot be used"),
        (80, "a wrench belongs here"),
    ]
    for value, words in wrong:
        with refusing(words, parameter="wrench", of=value):
            Wrench.of(value)
    with refusing("no frame of this name", "allowed: base, tool, world, controller"):
        Wrench(FORCE, MOMENT, "tol")  # type: ignore[arg-type]


# -- by hand ---------------------------------------------------------------------------------------------


def test_a_sideways_force_turns_the_first_joint() -> None:
    """An IRB 120 stretched out to the front: the tip is r from axis 1, and F along y turns it by C F r cos(turn)."""
    compliance = 2e-4
    robot = load_robot("irb120").with_effects(["compliance"]).with_values({"compliance_1": compliance})
    tool = Transform((0.0, 0.0, 0.126))
    r = 0.302 + 0.072 + 0.126  # forearm, wrist and tool; the upper arm is upright
    for force in (0.0, 25.0, -29.0):
        turn = 0.0
        for _ in range(20):
            turn = compliance * force * r * math.cos(turn)
        pushed = robot.with_wrench(Wrench((0.0, force, 0.0)), tool)
        (position,), (rotation,) = pushed.forward(np.zeros((1, 6)))
        tip = position + rotation @ np.array(tool.translation)
        assert_allclose(tip, [r * math.cos(turn), r * math.sin(turn), 0.63], atol=1e-12)
        assert_allclose(joint_efforts(pushed, np.zeros((1, 6)))[0, 0], force * r * math.cos(turn), atol=1e-12)


# -- against Pinocchio and the twin ----------------------------------------------------------------------


@pytest.mark.parametrize("frame", WRENCH_FRAMES)
@pytest.mark.parametrize("name", ["irb120", "katana450", "ur5", "sliding"])
def test_joints_carry_the_transposed_jacobian_times_the_wrench(name: str, frame: WrenchFrame) -> None:
    rng = np.random.default_rng(3)
    if name == "sliding":
        robot = random_robot(CONVENTIONS[0], (), rng, ("revolute", "prismatic", "revolute", "prismatic"))
        robot = replace(robot, controller=replace(robot.controller, base=drawn_place(rng)))
    else:
        robot = load_robot(name)
    robot = replace(robot.with_frames(random_frame(rng), {}), rated_load=None)
    if frame == "controller" and name == "katana450":
        with pytest.raises(InputError, match="not known where the controller of katana450 has its frames"):
            robot.with_wrench(Wrench(FORCE, MOMENT, frame))
        return
    tool, q = drawn_place(rng), robot.random_configurations(5, rng)
    pushed = robot.with_wrench(Wrench(FORCE, MOMENT, frame), tool)
    added = joint_efforts(pushed, q) - joint_efforts(robot, q)
    oracle = PinocchioChain(Chain(robot.arm.elements), robot.values)  # its world is the robot's base
    for row, joints in zip(added, q, strict=True):
        position, R, jacobian = oracle.tip(joints)
        axes = {
            "base": np.eye(3),
            "tool": R @ tool.rotation,
            "world": robot.base.rotation.T,
            "controller": robot.controller.base.rotation,
        }[frame]
        force, moment = axes @ FORCE, axes @ MOMENT
        moment = moment + np.cross(R @ np.array(tool.translation), force)
        assert np.isfinite(position).all()
        assert_allclose(row, jacobian.T @ np.concatenate([force, moment]), atol=1e-10)


@pytest.mark.parametrize("name", ["irb120", "katana450", "puma560"])
def test_the_arm_bends_as_the_twin_does(name: str) -> None:
    frames: tuple[WrenchFrame, ...] = ("base", "tool", "world")
    for frame in frames:
        rng = np.random.default_rng(4)
        model, twin = springy(name, rng)
        tool, q = drawn_place(rng), model.random_configurations(8, rng)
        wrench = Wrench(FORCE, MOMENT, frame)
        result = replace(twin, robot=twin.robot.with_wrench(wrench, tool)).frames(q)["tip"]
        position, rotation = model.with_wrench(wrench, tool).world_poses(q, "tip")
        assert_allclose(result[:, :3, 3], position, rtol=0, atol=1e-9, err_msg=frame)
        assert_allclose(result[:, :3, :3], rotation, rtol=0, atol=1e-9, err_msg=frame)
        assert np.linalg.norm(position - model.world_poses(q, "tip")[0], axis=1).min() > 1e-5


def test_the_data_say_what_acts_on_the_flange() -> None:
    """The model that is told of the flange bends as the one that is told of the tool."""
    for frame in WRENCH_FRAMES:
        rng = np.random.default_rng(5)
        model, twin = springy("irb120", rng)
        wrench = Wrench(FORCE, MOMENT, frame)
        pushed = replace(twin, robot=twin.robot.with_wrench(wrench, "tip"))
        data = with_wrench_read(pushed, measure(pushed, model.random_configurations(6, rng), 0.0, rng))
        assert data.wrench is not None
        at_flange = model.world_poses(data.postures, "tip")[0]
        assert_allclose(at_flange, data.position, atol=1e-9, err_msg=frame)
        assert_allclose(at_flange, model.with_wrench(wrench, "tip").world_poses(data.joints, "tip")[0], atol=1e-9)


# -- inverse kinematics ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["irb120", "ur5"])
def test_poses_are_reached_under_the_force(name: str) -> None:
    frames: tuple[WrenchFrame, ...] = ("base", "tool", "world")
    for frame in frames:
        rng = np.random.default_rng(6)
        model, _ = springy(name, rng)
        pushed = model.with_wrench(Wrench(FORCE, MOMENT, frame), "tip")
        q = rng.uniform(-1.0, 1.0, (6, 6))
        wanted = model.forward(q, target="tip")
        solution = pushed.inverse(*wanted, target="tip", seed=q)
        assert solution.complete
        for own, pose in zip(pushed.forward(solution.joints, target="tip"), wanted, strict=True):
            assert np.abs(own - pose).max() < 2e-9, frame
        assert np.abs(solution.joints - q).max() > 1e-5


def test_the_jacobian_is_the_derivative_under_the_force() -> None:
    model, _ = springy("irb120", np.random.default_rng(7))
    pushed = model.with_wrench(Wrench(FORCE, MOMENT, "tool"), "tip")
    q, step = np.full((1, 6), 0.3), 1e-4
    ahead, behind = (pushed.forward(q + way * step * np.eye(6), target="tip")[0] for way in (1, -1))
    assert_allclose(pushed.jacobian(q, target="tip")[0, :3], (ahead - behind).T / (2 * step), atol=1e-7)


# -- what the arm is rated for, and files ----------------------------------------------------------------


def test_more_than_the_rated_load_is_refused() -> None:
    robot = load_robot("irb120")
    assert robot.rated_load == 3.0
    assert robot.with_wrench(Wrench((0.0, 29.4, 0.0))).wrench is not None
    with refusing("force is larger than irb120 is rated for; got '29.5 N'", "29.42 N"):
        robot.with_wrench(Wrench((0.0, 29.5, 0.0)))
    with refusing("moment is larger than irb120 is rated for; got '40 N m'"):
        robot.with_wrench(Wrench((0.0, 0.0, 0.0), (0.0, 0.0, 40.0)))
    unknown = replace(robot, rated_load=None)
    assert unknown.with_wrench(Wrench((0.0, 500.0, 0.0))).wrench is not None


def test_nothing_is_taken_away_by_none_or_zero() -> None:
    robot = load_robot("irb120").with_wrench(Wrench((0.0, 5.0, 0.0)))
    assert robot.with_wrench(None).wrench is None
    assert robot.with_wrench(Wrench()).wrench is None
    assert "wrench at the tool: 0N,5N,0N,0Nm,0Nm,0Nm, base" in repr(robot)
    with pytest.raises(InputError, match="a wrench belongs here"):
        robot.with_wrench("0,5,0,0,0,0")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="no target of this name"):
        robot.with_wrench(Wrench((0.0, 5.0, 0.0)), "tip")


def test_no_file_holds_what_acts_on_the_tool() -> None:
    robot = load_robot("irb120").with_wrench(Wrench((0.0, 5.0, 0.0)))
    for written in (robot_text, lambda robot: export(robot, "json")):
        with refusing("no file of a robot holds an external force"):
            written(robot)


def test_the_rated_load_is_in_the_file_and_says_nothing_of_the_arm(tmp_path: Path, calibrated: Robot) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(robot_text(calibrated))
    assert "rated_load: 3" in file.read_text()
    again = read_robot(file)
    assert again.rated_load == 3.0
    assert is_intact(again)
    assert is_intact(replace(again, rated_load=4.0))
    assert is_intact(again.with_wrench(Wrench((0.0, 5.0, 0.0))))
    for text in ("rated_load: 0", "rated_load: 3kg", "rated_load: -2"):
        file.write_text(robot_text(load_robot("irb120")).replace("rated_load: 3.0", text))
        with pytest.raises(InputError, match="rated_load"):
            read_robot(file)


@pytest.fixture(scope="module")
def calibrated() -> Robot:
    from tests.simulated import campaign

    from truearm.calibration.calibrate import calibrate

    return calibrate("irb120", campaign("irb120", 20, 0.05e-3, 1)[1], model="offsets").robot


def test_a_calibration_keeps_what_loaded_its_joints(tmp_path: Path, calibrated: Robot) -> None:
    assert calibrated.proof is not None
    loads: Array = np.array(calibrated.proof.loads)
    assert loads.shape == (6, 2)
    assert_allclose(loads[0], 0.0, atol=1e-9)  # gravity never turns the upright axis
    assert loads[1, 1] - loads[1, 0] > 5.0
    text = robot_text(calibrated)
    file = tmp_path / "robot.yaml"
    file.write_text(text)
    again = read_robot(file)
    assert again.proof is not None
    assert again.proof.loads == calibrated.proof.loads
    assert robot_text(again) == text
    row = next(line for line in text.splitlines() if line.startswith("  loads:") or "loads:" in line)
    file.write_text(text.replace(row, "  loads:\n    - [0.0, 1.0]"))
    with pytest.raises(InputError, match="one entry belongs here for each joint"):
        read_robot(file)
