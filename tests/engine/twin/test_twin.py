"""The twin's physics against closed forms, and its loads against Pinocchio."""

from __future__ import annotations

import ast
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.arms import ARMS
from tests.engine.robot.test_loads import by_pinocchio, motion, random_link, random_triple
from tests.expecting import refusing

from truearm.engine.data import inclinations as inclinometer
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.effects.gain import Gain
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.parts import GRAVITY, Joint, LinkMass, Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.twin import gear_errors, twin_joint
from truearm.engine.twin import twin as twin_module
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import measured_with
from truearm.engine.twin.gear_errors import DRAWN
from truearm.engine.twin.truths import joint_truths, truth_twin
from truearm.engine.twin.twin import Conditions, Posture, Twin, directions, measure
from truearm.engine.twin.twin_joint import Contact, JointTruth

G = 9.80665
RNG = np.random.default_rng  # noise is zero in most of these tests


def planar(*lengths: float, masses: tuple[LinkMass, ...] = (), payload: float = 0.0) -> Robot:
    """Return an arm in a vertical plane: x forward, y up, all joints about the horizontal z."""
    joints = tuple(Joint(f"J{i}", "revolute", {"a": length}) for i, length in enumerate(lengths, 1))
    arm = Robot("planar", "", "", "standard-dh", joints, masses=masses, payload=Payload(payload))
    return replace(arm, gravity=(0.0, -G, 0.0)).with_frames(Transform(), {"tip": (0.0, 0.0, 0.0)})


def post(mass: float = 2.0, length: float = 0.5) -> Robot:
    """Return one joint about a vertical axis, and a mass at the end of its horizontal arm."""
    joints = (Joint("J1", "revolute", {"a": length}),)
    arm = Robot("post", "", "", "standard-dh", joints, payload=Payload(mass))
    return arm.with_frames(Transform(), {"tip": (0.0, 0.0, 0.0)})


def at(twin: Twin, *reading: float) -> Posture:
    return twin.postures(np.array([reading]))[0]


# -- loads ---------------------------------------------------------------------------------------------------


def test_static_loads_of_two_links_by_hand() -> None:
    masses = (LinkMass(1, 3.0, (-0.2, 0.0, 0.0)), LinkMass(2, 1.5, (-0.1, 0.05, 0.0)))
    arm = planar(0.5, 0.4, masses=masses, payload=2.0)
    q1, q2 = 0.3, -0.8
    elbow, tip = 0.5 * math.cos(q1), 0.5 * math.cos(q1) + 0.4 * math.cos(q1 + q2)
    forearm = elbow + 0.3 * math.cos(q1 + q2) - 0.05 * math.sin(q1 + q2)
    loads = at(Twin(arm), q1, q2).loads
    assert loads[0, 5] == pytest.approx(-G * (3.0 * 0.3 * math.cos(q1) + 1.5 * forearm + 2.0 * tip), rel=1e-14)
    assert loads[1, 5] == pytest.approx(-G * (1.5 * (forearm - elbow) + 2.0 * (tip - elbow)), rel=1e-14)
    turned = [-math.sin(q1 + q2), -math.cos(q1 + q2), 0.0]
    assert_allclose(loads[1, :3], 3.5 * G * np.array(turned), rtol=1e-14, atol=1e-14)
    assert_allclose(loads[:, 3:5], 0.0, atol=1e-14)


def test_a_mass_on_a_turntable_pulls_outward_and_lags() -> None:
    mass, length, speed, gain = 2.0, 0.5, 3.0, 7.0
    posture = Twin(post()).postures(np.array([[0.7]]), velocity=np.array([[speed]]), acceleration=np.array([[gain]]))[0]
    force = mass * np.array([length * speed**2, -length * gain, -G])
    assert_allclose(posture.loads[0], [*force, *np.cross([length, 0.0, 0.0], force)], rtol=1e-14, atol=1e-13)


def test_a_wrench_on_the_flange_reaches_every_joint() -> None:
    arm = planar(0.5, 0.4)
    wrench = np.array([[3.0, 5.0, 7.0, 0.1, 0.2, 0.3]])
    loads = Twin(arm).postures(np.array([[math.pi / 2, -math.pi / 2]]), wrench=wrench)[0].loads
    # upper arm upright (x of joint 1 is up, y back), forearm level, tip at (0.4, 0.5, 0)
    assert_allclose(loads[1, :3], [3.0, 5.0, 7.0], atol=1e-13)
    assert_allclose(loads[1, 3:], np.cross([0.4, 0.0, 0.0], wrench[0, :3]) + wrench[0, 3:], atol=1e-13)
    x, y, z = np.cross([0.4, 0.5, 0.0], wrench[0, :3]) + wrench[0, 3:]
    assert_allclose(loads[0], [5.0, -3.0, 7.0, y, -x, z], atol=1e-13)


@pytest.mark.parametrize("kinds", ["RRRRRR", "RPRRPR", "PPPRRR"])
def test_moving_loads_are_those_of_pinocchio(kinds: str) -> None:
    columns = ("alpha", "a", "theta_offset", "d")
    for seed in (0, 1):
        rng = RNG(seed)
        rows = [{name: float(rng.uniform(-1, 1)) for name in columns} for _ in kinds]
        joints = [
            Joint(f"J{number}", "revolute" if kind == "R" else "prismatic", row)
            for number, (kind, row) in enumerate(zip(kinds, rows, strict=True), 1)
        ]
        masses = [random_link(number, rng) for number in range(1, len(kinds) + 1) for _ in range(number % 3)]
        flange, payload = Transform((0.1, -0.2, 0.3), (0.5, 0.5, -0.5, 0.5)), Payload(1.3, (0.05, 0.02, 0.1))
        arm = Robot("random", "", "", "modified-dh", tuple(joints), flange, tuple(masses), payload)
        arm = replace(arm, gravity=random_triple(rng, 8.0))
        q, velocity, acceleration, wrench = motion(arm, rng)
        expected = by_pinocchio(arm, q, velocity, acceleration, 20 * wrench)
        at_work: Conditions = {"wrench": 20 * wrench.T, "velocity": velocity.T, "acceleration": acceleration.T}
        for k, posture in enumerate(Twin(arm).postures(q.T, **at_work)):
            own = expected[:, :, k]
            assert_allclose(posture.loads, own, rtol=0, atol=1e-11 * np.abs(own).max(), err_msg=f"seed {seed}")


def test_axes_of_a_joint_in_any_direction() -> None:
    rng = RNG(5)
    for axis in ([1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.6, 0.0, 0.8], [0.0, 1.0, 0.0]):
        row = dict(zip(("axis_x", "axis_y", "axis_z"), axis, strict=True))
        arm = Robot("arm", "", "", "urdf", (Joint("J1", "revolute", row),), payload=Payload(2.0, (0.3, 0.2, 0.1)))
        wrench = rng.normal(size=(1, 6))
        load = Twin(arm).postures(np.zeros((1, 1)), wrench=wrench)[0].loads[0]
        force = wrench[0, :3] + [0.0, 0.0, -2.0 * G]
        moment = wrench[0, 3:] + np.cross([0.3, 0.2, 0.1], [0.0, 0.0, -2.0 * G])
        assert load[[2, 5]] == pytest.approx([force @ axis, moment @ axis], abs=1e-13)
        assert np.linalg.norm(load[:3]) == pytest.approx(np.linalg.norm(force))
        assert load[:3] @ load[3:] == pytest.approx(force @ moment)  # neither mirrored nor mixed


def test_the_twin_goes_a_way_of_its_own() -> None:
    for module in (twin_module, twin_joint, inclinometer):
        tree = ast.parse(Path(str(module.__file__)).read_text())
        imports = [n for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)]
        names = {a.name for n in imports if n.module and n.module.startswith("truearm.engine.robot") for a in n.names}
        assert names <= {"Array", "Element", "LinkMass", "Postures", "Robot", "Wrench"}  # data: nothing that computes


# -- deflection about the axis --------------------------------------------------------------------------------


def test_with_nothing_true_but_the_robot_the_twin_is_the_model() -> None:
    rng = RNG(0)
    for name in ARMS:
        twin = truth_twin(load_robot(name), "random", rng)
        twin = replace(twin, robot=twin.robot.with_effects(["gain"]).with_values({"gain_2": 1.01}))
        q = twin.robot.random_configurations(3, rng)
        seen = measure(twin, q, 0.0, rng)
        for i, target in enumerate(seen.targets):
            assert_allclose(seen.position[seen.target == i], twin.robot.world_poses(q, target)[0], rtol=0, atol=1e-13)
        zeros = replace(twin, joints={i: JointTruth() for i in range(1, len(twin.robot.joints) + 1)})
        assert np.array_equal(measure(zeros, q, 0.0, rng).position, seen.position)


def test_two_links_sag_in_equilibrium() -> None:
    c1, c2 = 1e-3, 3e-3
    twin = Twin(planar(0.5, 0.4, payload=3.0), {1: JointTruth(compliance=c1), 2: JointTruth(compliance=c2)})
    d1, d2 = at(twin, 0.2, 0.4).deflection[:, 2]
    inner, outer = 0.5 * math.cos(0.2 + d1), 0.4 * math.cos(0.6 + d1 + d2)
    assert d2 == pytest.approx(-c2 * 3.0 * G * outer, rel=1e-11)
    assert d1 == pytest.approx(-c1 * 3.0 * G * (inner + outer), rel=1e-11)


def test_an_arm_that_hangs_or_stands_stays_as_it_is() -> None:
    truth = JointTruth(compliance=1e-3, cubic=1e-6, backlash=0.01, clearance=0.01)
    twin = Twin(planar(0.5, 0.4, payload=3.0), {1: truth, 2: truth})
    for up in (-1, 1):
        posture = at(twin, up * math.pi / 2, 0.0)
        assert np.abs(posture.deflection).max() < 1e-15
        assert_allclose(posture.targets["tip"][:3, 3], [0.0, up * 0.9, 0.0], atol=1e-15)


def test_hardening_is_odd_in_the_load() -> None:
    soft = JointTruth(compliance=1e-3, quadratic=-1e-5, cubic=2e-7)
    assert soft.turn(0.3, 0.0, 20.0) == pytest.approx(1e-3 * 20 - 1e-5 * 400 + 2e-7 * 8000)
    assert soft.turn(0.3, 0.0, -20.0) == -soft.turn(0.3, 0.0, 20.0)


def test_a_compliant_slide_gives_way_along_the_force() -> None:
    arm = Robot("lift", "", "", "standard-dh", (Joint("J1", "prismatic", {}),), payload=Payload(10.0))
    arm = arm.with_frames(Transform(), {"tip": (0.0, 0.0, 0.0)})
    posture = at(Twin(arm, {1: JointTruth(compliance=1e-6)}), 0.3)
    assert posture.targets["tip"][2, 3] == pytest.approx(0.3 - 1e-6 * 10 * G, rel=1e-14)


def test_backlash_falls_to_the_side_of_the_load_and_a_reversal_shows_the_whole_gap() -> None:
    gap = 1e-3
    twin = Twin(planar(0.5, payload=1.0), {1: JointTruth(backlash=gap)})
    assert at(twin, 0.2).deflection[0, 2] == -gap / 2
    assert at(twin, math.pi - 0.2).deflection[0, 2] == gap / 2
    assert abs(at(twin, -math.pi / 2 + gap / 4).deflection[0, 2]) == gap / 2  # without rest it ends on one side
    light = Twin(planar(0.5), {1: JointTruth(backlash=gap)})
    for side in (-1.0, 0.0, 1.0):
        wrench = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, side]])
        assert light.postures(np.array([[0.2]]), wrench=wrench)[0].deflection[0, 2] == side * gap / 2


def test_the_direction_of_approach_is_that_of_the_last_move() -> None:
    q = np.array([[0.1, 0.0], [0.2, 0.0], [0.2, -0.3], [0.1, -0.1]])
    assert_allclose(directions(q), [[0, 0], [1, 0], [1, -1], [-1, 1]])
    twin = Twin(planar(0.5, 0.4), {1: JointTruth(hysteresis=1e-4), 2: JointTruth(hysteresis=-2e-4)})
    deflections = np.array([posture.deflection[:, 2] for posture in twin.postures(q)])
    assert_allclose(deflections, directions(q) * [1e-4, -2e-4])
    asked = twin.postures(q, approach=-np.ones((4, 2)))
    assert_allclose([posture.deflection[:, 2] for posture in asked], [[-1e-4, 2e-4]] * 4)


def test_a_warm_link_is_longer() -> None:
    twin = Twin(planar(0.5, 0.4), {1: JointTruth(growth=2e-5), 2: JointTruth(growth=1e-5)})
    seen = measure(twin, np.zeros((3, 2)), 0.0, RNG(0), temperature=np.array([20.0, 30.0, 15.0]))
    assert_allclose(seen.position[:, 0], [0.9, 0.9 + 10 * (1e-5 + 0.4e-5), 0.9 - 5 * (1e-5 + 0.4e-5)], rtol=1e-15)


# -- clearance tilt ----------------------------------------------------------------------------------------------


def test_a_loose_vertical_joint_lets_its_arm_fall() -> None:
    clearance = 0.01
    lean = math.sin(clearance)  # all of it about y, on which the weight acts
    for q in (0.0, 0.7, -2.0):
        x, y, z = at(Twin(post(length=0.5), {1: JointTruth(clearance=clearance)}), q).targets["tip"][:3, 3]
        assert (z, math.atan2(y, x)) == pytest.approx((-0.5 * math.sin(lean), q), rel=1e-12)


@pytest.mark.parametrize(("contact", "gamma"), [("exact", math.atan2(3, 4)), ("document", math.pi / 2 * 3 / 7)])
def test_contact_between_x_and_y(contact: Contact, gamma: float) -> None:
    t = math.tan(0.02)
    alpha = t * math.sin(gamma) / math.sqrt(1 + (t * math.sin(gamma)) ** 2)
    beta = t * math.cos(gamma) / math.sqrt(1 + (t * math.cos(gamma)) ** 2)
    twin = Twin(post(mass=0.0), {1: JointTruth(clearance=0.02)}, contact)
    for x, y in ((1, 1), (-1, 1), (1, -1), (-1, -1)):
        moment = np.array([[0.0, 0.0, 0.0, 3.0 * x, 4.0 * y, 0.0]])
        posture = twin.postures(np.zeros((1, 1)), wrench=moment)[0]
        assert_allclose(posture.deflection[0], [x * alpha, y * beta, 0.0], rtol=1e-13)
        ca, sa, cb, sb = math.cos(x * alpha), math.sin(x * alpha), math.cos(y * beta), math.sin(y * beta)
        assert_allclose(posture.links[0, :3, 2], [sb, -sa * cb, ca * cb], rtol=1e-13)


def test_exact_contact_has_the_whole_tilt_and_no_preferred_direction() -> None:
    loose = JointTruth(clearance=4e-4)
    for angle in np.linspace(0.1, 6.2, 7):
        moment = math.cos(angle), math.sin(angle)
        assert loose.tilt(*moment, "exact") == pytest.approx([4e-4 * m for m in moment], rel=1e-6)
    contact: Contact
    for contact in ("exact", "document"):
        assert_allclose(loose.tilt(0.0, 0.0, contact), 0.0)


# -- the Katana of the thesis ---------------------------------------------------------------------------------------

STIFFNESS = (122, 90, 75, 78, 80)  # Table 4.4 [kgf m/deg]
BACKLASH = (0.063, 0.061, 0.057, 0.046, 0.051)  # Table 4.3 [deg]
CLEARANCE = (0.022, 0.024, 0.017, 0.015, 0.018)  # Table 4.3 [deg]


def katana_on_the_circle() -> tuple[Robot, Array]:
    """Return the arm with the pencil and joints on the circle of section 5.5.1, each point from the same posture."""
    robot = load_robot("katana450").with_frames(Transform(), {"tip": (0.0, 0.0, 0.130)})
    centre, postures = np.array([0.0, -0.3, 0.1392893]), []
    for angle in np.linspace(0, 2 * math.pi, 24, endpoint=False):
        up, across = 0.1 * math.cos(angle) * math.sqrt(0.5), 0.1 * math.sin(angle)
        point, q = centre + np.array([across, -up, up]), np.radians([0.0, 30.0, 60.0, 60.0, 0.0])
        for _ in range(100):
            missing = point - robot.world_poses(q[None], "tip")[0][0]
            if np.linalg.norm(missing) < 1e-10:
                break
            step = np.linalg.lstsq(robot.joint_jacobian(q[None], "tip")[0, :3], missing, rcond=None)[0]
            q = q + step * min(1.0, 0.2 / float(np.abs(step).max()))
        else:
            raise AssertionError("a point of the circle cannot be reached")
        postures.append(q)
    return robot, np.array(postures)


def test_the_katana_on_its_circle_is_as_far_off_as_the_document_measured() -> None:
    robot, q = katana_on_the_circle()
    exact = measure(Twin(robot), q, 0.0, RNG(0)).position

    def mean_mm(gaps: float, tilts: float) -> float:
        rows = zip(STIFFNESS, np.radians(BACKLASH), np.radians(CLEARANCE), strict=True)
        joints = {
            i: JointTruth(math.radians(1 / k) / G, backlash=gaps * gap, clearance=tilts * tilt)
            for i, (k, gap, tilt) in enumerate(rows, 1)
        }
        return float(np.linalg.norm(measure(Twin(robot, joints), q, 0.0, RNG(0)).position - exact, axis=1).mean()) * 1e3

    # The thesis measured 0.653 mm in all and prints no orientations; other postures give 0.46 to 0.86.
    assert mean_mm(1.0, 1.0) == pytest.approx(0.666, abs=0.01)
    # With the printed gap on either side, as equation 5.19 has it, it would be half as much again.
    assert mean_mm(2.0, 1.0) == pytest.approx(0.953, abs=0.01)
    assert 0.01 < mean_mm(0.0, 0.0) < 0.06


# -- the twin of a robot ---------------------------------------------------------------------------------------------


def test_a_truth_carries_the_tool_unless_the_robot_carries_something() -> None:
    robot = load_robot("irb120")
    twin = truth_twin(robot, "tracker-triangular", RNG(0))
    assert twin.robot.payload == Payload(2.7, (0.05, 0.025, 0.1))
    assert twin.joints[3] == JointTruth(compliance=0.130e-3)
    loaded = replace(robot, payload=Payload(0.3))
    assert truth_twin(loaded, "tracker-triangular", RNG(0)).robot.payload == Payload(0.3)
    assert robot.gravity == GRAVITY


# -- refusals ---------------------------------------------------------------------------------------------------------


def test_joints_and_shapes_that_are_not_there_are_refused() -> None:
    for number in (0, 3):
        with refusing(f"joint {number} of the twin of planar: the robot has no such", "1 to 2"):
            Twin(planar(0.5, 0.4), {number: JointTruth()})
    twin = Twin(planar(0.5, 0.4))
    for name in ("approach", "temperature", "wrench", "velocity", "acceleration"):
        with refusing(name, "shape (2, 7)"):
            measure(twin, np.zeros((3, 2)), 0.0, RNG(0), **{name: np.zeros((2, 7))})  # type: ignore[arg-type]
    with refusing("joint positions; got 'an array of shape (3, 1)'; allowed: (3, 2)"):
        measure(twin, np.zeros((3, 1)), 0.0, RNG(0))


def test_only_joints_about_z_tilt() -> None:
    loose = {1: JointTruth(clearance=1e-3)}
    slide = Robot("lift", "", "", "standard-dh", (Joint("J1", "prismatic", {}),))
    row = {"axis_x": 0.0, "axis_y": 1.0, "axis_z": 0.0}
    about_y = Robot("arm", "", "", "urdf", (Joint("J1", "revolute", row),))
    for robot in (slide, about_y):
        with refusing("only a joint that turns about its frame's z can tilt", of=robot.name):
            Twin(robot, loose)
    about_z = replace(about_y, joints=(Joint("J1", "revolute", {**row, "axis_y": 0.0, "axis_z": 1.0}),))
    assert Twin(about_z, loose).joints == loose


# -- the order of measurement --------------------------------------------------------------------------------


def warming_up() -> Robot:
    """An arm whose links are a thousandth short when a campaign begins."""
    arm = load_robot("irb120").with_effects(["warm-up"])
    grown = {name: 1e-3 for name in arm.parameters if name.startswith("warm_up_") and name[8:].isdigit()}
    return arm.with_values({**grown, "warm_up_rate": 0.05})


def test_links_grow_while_a_campaign_is_measured() -> None:
    rng = RNG(0)
    twin = truth_twin(warming_up(), "nominal", rng)
    data = measure(twin, twin.robot.random_configurations(30, rng), 0.0, rng)
    for name in data.targets:
        read = data.position[data.target == data.targets.index(name)]
        assert_allclose(twin.robot.world_poses(data.postures, name)[0], read, rtol=0, atol=1e-12)
        warm = np.linalg.norm(twin.robot.world_poses(data.joints, name)[0] - read, axis=1)
        assert warm[0] > 1e-4
        assert warm[-1] < 0.5 * warm[:5].mean()
    later = measure(twin, data.joints, 0.0, rng, number=np.arange(100.0, 130.0))
    assert later.number is not None
    assert later.number[0] == 100.0
    assert np.abs(later.position - data.position).max() > 1e-4
    shown = twin.frames(data.joints)["1"][:, :3, 3]
    assert_allclose(twin.robot.world_poses(data.joints, "1")[0], shown, rtol=0, atol=1e-12)


def test_devices_measure_in_order() -> None:
    nominal = load_robot("irb120")
    for device in ("tracker", "hexapod", "touch-up"):
        read = []
        for arm in (nominal, warming_up()):
            rng = RNG(1)
            twin = truth_twin(arm, "nominal", rng)
            read.append(measured_with(named_device(device), nominal, twin, 12, rng, 0.0))
        plain, warm = (data.position if device == "tracker" else data.joints for data in read)  # others are jogged
        assert np.abs(warm[:3] - plain[:3]).max() > 1e-4, device


def test_the_twin_computes_every_effect_and_refuses_another(monkeypatch: pytest.MonkeyPatch) -> None:
    for effect in EFFECTS:
        assert joint_truths(load_robot("irb120").with_effects([effect.name])), effect.name

    class Wobble(Gain):
        name = "wobble"

        @property
        def parameters(self) -> tuple[Parameter, ...]:
            return (self.parameter("wobble_1", "rad", 1e-3),)

    monkeypatch.setattr("truearm.engine.robot.robot_data.EFFECTS", (Wobble,))
    with refusing("does not compute this joint effect; got 'wobble_1'"):
        joint_truths(replace(load_robot("irb120"), effect_names=("wobble",)))


def test_a_configuration_stands_alone_as_it_does_among_others() -> None:
    """Configurations are followed together, and each comes to rest in a round of its own."""
    rng, count = np.random.default_rng(5), 20
    robot = load_robot("katana450")
    loose = JointTruth(
        compliance=1e-3, backlash=1e-3, clearance=4e-4, gear=((2, 1e-4, 0.3),), growth=1e-5, warm_up=1e-4
    )
    twin = Twin(robot, {2: loose, 3: JointTruth(bearing=1e-4, hysteresis=1e-4), 4: JointTruth(backlash=2e-3)})
    joints = robot.random_configurations(count, rng)
    conditions: Conditions = {
        "approach": np.sign(rng.normal(size=joints.shape)),
        "number": np.arange(float(count)),
        "temperature": np.where(np.arange(count) < 3, 20.0, 20.0 + rng.normal(size=count)),
        "wrench": rng.normal(size=(count, 6)),
        "velocity": np.where(np.arange(count)[:, None] < 10, 0.0, rng.normal(size=joints.shape)),
        "acceleration": rng.normal(size=joints.shape),
    }
    together = twin.postures(joints, **conditions)
    for row in range(count):
        own = {name: np.asarray(values)[row : row + 1] for name, values in conditions.items()}
        (alone,) = twin.postures(joints[row : row + 1], **own)
        for field in ("links", "loads", "deflection", "wrench"):
            assert_allclose(getattr(together[row], field), getattr(alone, field), rtol=1e-12, atol=1e-12)
        for name, at in alone.targets.items():
            assert_allclose(together[row].targets[name], at, rtol=1e-12, atol=1e-12)


def test_more_configurations_than_are_followed_at_a_time() -> None:
    twin = Twin(load_robot("li3"))
    joints = twin.robot.random_configurations(1030, np.random.default_rng(0))
    links = np.array([posture.links for posture in twin.postures(joints)])
    one_by_one = np.array([twin.postures(joints[[row]])[0].links for row in (0, 511, 512, 1023, 1024, 1029)])
    assert_allclose(links[[0, 511, 512, 1023, 1024, 1029]], one_by_one, rtol=1e-13, atol=1e-15)
    assert len(links) == 1030


# -- truths whose encoders and gears err: their amplitudes are those stated, and they go a way of their own

TURN = np.linspace(-math.pi, math.pi, 7200, endpoint=False)


def curve(joint: JointTruth) -> np.ndarray:
    """Return what a joint turns beyond its position over a turn, 20 places a degree [deg]."""
    remaining = np.zeros(len(TURN))
    return np.degrees(joint.turn(TURN, remaining, remaining))


def strengths(joint: JointTruth) -> np.ndarray:
    """Return the amplitude [deg] of each number of periods in a turn, from 0."""
    return 2.0 * np.abs(np.fft.rfft(curve(joint))) / len(TURN)


def geared(truth: str, seed: int = 0, robot: str = "irb120") -> Twin:
    return truth_twin(load_robot(robot), truth, np.random.default_rng(seed))


def test_gears_err_as_often_and_as_much_as_stated() -> None:
    drawn = geared("gear-errors")
    for number in range(1, 7):
        result = strengths(drawn.joints[number])
        often = np.flatnonzero(result > 1e-9)
        assert len(often) == 5
        assert often[:2].tolist() == [1, 2]
        assert ((often[2:] >= 10) & (often[2:] <= 60)).all()
        assert result[often] == pytest.approx([0.010, 0.004, 0.006, 0.006, 0.006])
        assert curve(drawn.joints[number]).std() == pytest.approx(0.0106, abs=1e-4)
    periods = {tuple(k for k, _, _ in joint.gear) for joint in drawn.joints.values()}
    assert len(periods) == 6  # no joint like another


def test_teeth_and_worn_places_are_no_series_that_ends() -> None:
    for joint in geared("tooth-errors").joints.values():
        result = strengths(joint)
        assert 0.009 < curve(joint).std() < 0.016
        assert np.sqrt((result[61:] ** 2).sum() / 2) > 1e-4  # some is beyond 60 periods


def test_a_triangle_is_straight_between_its_ends() -> None:
    rising = JointTruth(teeth=((4, 2e-4, 0.0),))
    assert [rising.turn(q, 0.0, 0.0) for q in (0.0, math.pi / 16, math.pi / 8, 3 * math.pi / 8)] == pytest.approx(
        [0.0, 1e-4, 2e-4, -2e-4], abs=1e-15
    )


def test_a_worn_place_ends_where_it_is_said_to_and_comes_again_after_a_turn() -> None:
    worn = JointTruth(bumps=((3.0, 0.2, 1e-4),))
    at = {q: worn.turn(q, 0.0, 0.0) for q in (3.0, 3.1, 3.3, 2.79, 3.0 - 2 * math.pi, -math.pi + 0.01)}
    assert at[3.0] == pytest.approx(1e-4)
    assert at[3.1] == pytest.approx(0.5e-4)
    assert at[3.3] == at[2.79] == 0.0
    assert at[3.0 - 2 * math.pi] == pytest.approx(1e-4)
    assert at[-math.pi + 0.01] == pytest.approx(0.5e-4 * (1.0 + math.cos(math.pi * (math.pi + 0.01 - 3.0) / 0.2)))


@pytest.mark.parametrize("name", DRAWN)
def test_the_arm_itself_is_that_of_a_random_truth_and_the_seed_decides_what_is_drawn(name: str) -> None:
    drawn, plain = geared(name, 4), geared("random", 4)
    assert drawn.robot.values == plain.robot.values
    q = plain.robot.random_configurations(50, np.random.default_rng(1))
    away = [drawn.frames(q)[t.name][:, :3, 3] - plain.frames(q)[t.name][:, :3, 3] for t in plain.robot.targets]
    assert 2e-5 < float(np.linalg.norm(away, axis=2).mean()) < 4e-4  # 0.011 deg at half a metre, of six joints
    assert geared(name, 1).joints == geared(name, 1).joints != geared(name, 2).joints


def test_a_joint_that_slides_has_no_gear() -> None:
    joints = (Joint("J1", "revolute", {"a": 0.3}), Joint("J2", "prismatic", {}))
    drawn = truth_twin(Robot("lift", "", "", "standard-dh", joints), "gear-errors", np.random.default_rng(0))
    assert drawn.joints[1].gear
    assert drawn.joints[2] == JointTruth()


def test_errors_are_drawn_without_the_models() -> None:
    text = Path(gear_errors.__file__).read_text()
    imports = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom)]
    names = {alias.name for node in imports if node.module and "engine.robot" in node.module for alias in node.names}
    assert names == {"Robot"}  # whose joints turn
