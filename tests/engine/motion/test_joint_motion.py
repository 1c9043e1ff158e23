"""Joint motions against finite differences, Pinocchio's tip accelerations, and a minimiser that shares no code."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares
from tests.expecting import refusing
from tests.pinocchio_oracle import PinocchioChain

from truearm.engine.base.errors import InputError
from truearm.engine.motion.joint_motion import JointMotion, Tip, joint_motion
from truearm.engine.motion.paths import Circle, Line, Trajectory, timed
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.pose_solver import Orientation
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform

TILTED = Transform((0.4, -0.2, 0.7), (0.8, 0.0, 0.6, 0.0))


def sliding() -> Robot:
    """Turn, turn, slide, turn: one joint more than a position asks for."""
    rows: list[Any] = [
        ("revolute", {"alpha": 0.0, "a": 0.0, "d": 0.4, "theta_offset": 0.0}, (-2.5, 2.5)),
        ("revolute", {"alpha": 0.0, "a": 0.3, "d": 0.0, "theta_offset": 0.0}, (-2.5, 2.5)),
        ("prismatic", {"alpha": np.pi, "a": 0.25, "d": 0.0, "theta_offset": 0.0}, (-0.2, 0.4)),
        ("revolute", {"alpha": 0.4, "a": 0.2, "d": 0.1, "theta_offset": 0.0}, (-2.5, 2.5)),
    ]
    joints = tuple(Joint(f"j{i}", kind, row, limits) for i, (kind, row, limits) in enumerate(rows, 1))
    robot = Robot("sliding", "Sliding", "invented", "modified-dh", joints)
    return robot.with_frames(TILTED, {"tip": (0.1, 0.0, 0.05)})


def katana() -> Robot:
    """The Katana with the pencil, which is 330 mm from the last joint's axis to the tip."""
    return load_robot("katana450").with_frames(IDENTITY, {"tip": (0.0, 0.0, 0.13)})


def with_tip(name: str) -> Robot:
    return load_robot(name).with_frames(TILTED, {"tip": Transform((0.03, 0.02, 0.1), (0.8, 0.6, 0.0, 0.0))})


CASES: dict[str, tuple[Robot, Orientation, list[float]]] = {
    "katana free": (katana(), "free", [-20, 40, 50, 30, 20]),
    "katana axis": (katana(), "axis", [-40, 20, 60, 60, -30]),
    "irb120 full": (with_tip("irb120"), "full", [10, 20, 10, 40, 50, -30]),
    "irb120 free": (with_tip("irb120"), "free", [10, 20, 10, 40, 50, -30]),
    "ur5 axis": (with_tip("ur5"), "axis", [10, -110, 110, -80, 70, -30]),
    "sliding free": (sliding(), "free", [20, 50, 0.1 * 180 / np.pi, 30]),
}


def motion_of(robot: Robot, orientation: Orientation, degrees: list[float]) -> tuple[Trajectory, JointMotion]:
    """Follow a small circle that begins where the readings put the tip."""
    q = np.radians(degrees)
    state = Tip(robot, "tip").at(q[None])
    start, R = state.position[0], state.rotation[0]
    circle = Circle(start + np.array([0.02, 0.02, 0.01]), start, np.array([1.0, -2.0, 2.0]))
    path = timed(circle, speed=0.1, acceleration=0.4, step=0.004)
    return path, joint_motion(robot, path, target="tip", orientation=orientation, rotation=R, seed=q)


@pytest.fixture(scope="module", params=CASES, ids=lambda name: str(name).replace(" ", "-"))
def case(request: pytest.FixtureRequest) -> tuple[Robot, Orientation, Trajectory, JointMotion]:
    robot, orientation, degrees = CASES[request.param]
    return robot, orientation, *motion_of(robot, orientation, degrees)


def differences(values: Array, step: float) -> Array:
    """Central differences of sixth order, without the three samples at either end."""
    weights = np.array([-1, 9, -45, 0, 45, -9, 1]) / 60
    return np.asarray(sum(w * values[k : len(values) - 6 + k] for k, w in enumerate(weights)) / step)


def test_the_tip_follows_the_path_and_returns_with_the_same_readings(case: Any) -> None:
    robot, orientation, path, motion = case
    state = Tip(robot, "tip").at(motion.joints)
    assert np.abs(state.position - path.position).max() < 1e-12
    if orientation != "free":
        kept = state.rotation if orientation == "full" else state.rotation[:, :, 2]
        assert np.abs(kept - kept[0]).max() < 1e-12
    assert np.abs(motion.joints[-1] - motion.joints[0]).max() < 1e-9
    assert np.ptp(motion.joints, axis=0).max() > 0.05


def test_velocities_and_accelerations_are_derivatives_of_the_readings(case: Any) -> None:
    _, _, path, motion = case
    step = path.time[1]
    ramp = 1.5 * 0.1 / 0.4
    # Where the ramps begin and end the path's jerk jumps, and differences are worth less.
    t, end = path.time[3:-3], path.time[-1]
    smooth = np.min([np.abs(t - place) for place in (0, ramp, end - ramp, end)], axis=0) > 5 * step
    assert smooth.sum() > 0.9 * len(t)
    for values, rates, size in (
        (motion.joints, motion.velocity, 1e-9),
        (motion.velocity, motion.acceleration, 1e-7),
    ):
        error = np.abs(differences(values, step) - rates[3:-3])
        assert error[smooth].max() < size * np.abs(rates).max()


def test_pinocchio_gives_the_tip_the_velocity_and_acceleration_of_the_path(case: Any) -> None:
    robot, orientation, path, motion = case
    chain = robot.trunk.elements + robot.target("tip").chain.elements
    oracle = PinocchioChain(replace(robot.trunk, elements=chain), robot.values)
    R = robot.base.rotation
    for k in range(0, len(path.time), 40):
        velocity, acceleration = oracle.tip_motion(motion.joints[k], motion.velocity[k], motion.acceleration[k])
        assert R.T @ velocity[:3] == pytest.approx(path.velocity[k], abs=1e-11)
        assert R.T @ acceleration[:3] == pytest.approx(path.acceleration[k], abs=1e-10)
        if orientation == "full":
            assert np.abs(np.concatenate([velocity[3:], acceleration[3:]])).max() < 1e-10


def test_a_redundant_arm_stays_as_near_to_its_start_as_it_can() -> None:
    robot, orientation, degrees = CASES["katana free"]
    path, motion = motion_of(robot, orientation, degrees)
    far = int(np.argmax(np.abs(motion.joints - motion.joints[0]).max(axis=1)))
    nearest = motion.joints[far] + 0.02 * np.random.default_rng(0).standard_normal(5)

    def missing(x: Array) -> Array:
        """The path's point, and a way to the start that is at right angles to all that keep the point."""
        q, multipliers = x[:5], x[5:]
        (p, _), J = robot.world_poses(q[None], "tip"), robot.joint_jacobian(q[None], "tip")[0, :3]
        return np.concatenate([p[0] - path.position[far], q - motion.joints[0] - J.T @ multipliers])

    best = least_squares(missing, np.append(nearest, np.zeros(3)), xtol=1e-14, gtol=1e-14)
    assert motion.joints[far] == pytest.approx(best.x[:5], abs=1e-8)
    assert np.abs(motion.joints[far] - motion.joints[0]).max() > 0.1


def test_joint_effects_are_not_planned_for() -> None:
    robot = load_robot("li3")
    path = line((0.3, 0.0, 0.3), (0.3, 0.1, 0.3))
    gained = robot.with_effects(["gain"]).with_values({"gain_2": 1.01})
    assert (joint_motion(gained, path).joints == joint_motion(robot, path).joints).all()


def test_postures_carry_rates_and_the_direction_of_the_last_move() -> None:
    _, motion = motion_of(*CASES["katana free"])
    postures = motion.postures()
    assert postures.velocity is motion.velocity
    assert postures.acceleration is motion.acceleration
    assert postures.approach is not None
    moving = np.abs(motion.velocity[5:-5]) > 0.01
    assert (postures.approach[5:-5] == np.sign(motion.velocity[5:-5]))[moving].all()
    assert motion.postures(motion.joints + 1).joints == pytest.approx(motion.joints + 1)


# -- refusals ---------------------------------------------------------------------------------------------


def line(start: Any, end: Any, step: float = 0.01) -> Trajectory:
    return timed(Line(start, end), speed=0.2, acceleration=1.0, step=step)


def changed(**parts: Any) -> Trajectory:
    return replace(line((0.3, 0, 0.3), (0.4, 0, 0.3)), **parts)


#: The z axis at right angles to the plane of the thesis' circle.
NORMAL = np.array([[1, 0, 0], [0, -np.sqrt(0.5), np.sqrt(0.5)], [0, -np.sqrt(0.5), -np.sqrt(0.5)]])


def test_the_katana_cannot_hold_its_tool_across_the_circle() -> None:
    path = line((0.0, -0.3707107, 0.21), (0.0, -0.36, 0.2))
    for turned in (NORMAL, NORMAL @ np.diag([1.0, -1.0, -1.0])):
        with refusing("0.0 mm along the path, at 0 s (sample 0): the motion cannot start", "free"):
            joint_motion(katana(), path, target="tip", orientation="axis", rotation=turned)
    assert len(joint_motion(katana(), path, target="tip").time) == len(path.time)


def test_a_path_that_leaves_the_reach_says_where() -> None:
    path = line((0.3, 0.1, 0.3), (1.2, 0.1, 0.3))
    with pytest.raises(InputError) as refusal:
        joint_motion(load_robot("li3"), path)
    assert refusal.value.cure == "Move the path towards the arm, or start elsewhere (`seed_joints`)."
    assert 0.4 < np.linalg.norm([0.3 + travelled(refusal.value), 0.1, 0.3]) < 1.2
    with refusing("cannot start", "are missing"):
        joint_motion(load_robot("li3"), line((1.2, 0.1, 0.3), (0.3, 0.1, 0.3)))


def travelled(refusal: InputError) -> float:
    """How far along the path it was refused [m]."""
    return float(str(refusal).split(" mm along the path")[0]) / 1e3


def test_a_path_beyond_a_limit_names_the_joint() -> None:
    robot = load_robot("li3")
    q = np.radians([10.0, 40, 60])
    high = np.degrees((robot.joints[0].limits or (0, 0))[1])
    start = Tip(robot).positions(q[None])[0]
    path = timed(Circle((0, 0, start[2]), start, (0, 0, 1)), 0.3, 1.0, 0.01)
    with pytest.raises(InputError, match=r"a joint beyond its limits; got 'joint_1 at .* deg'") as refusal:
        joint_motion(robot, path, seed=q)
    first = travelled(refusal.value) / np.linalg.norm(start[:2]) - np.radians(high - 10)
    assert 0 < first < 0.3 * 0.01 / np.linalg.norm(start[:2])


def test_a_path_through_a_singular_wrist_is_refused_there_though_no_sample_is_in_it() -> None:
    robot = load_robot("irb120")
    state = Tip(robot).at(np.radians([[0.0, 10, 0, 0, 0, 0]]))  # axes 4 and 6 in line
    middle, R = state.position[0], state.rotation[0]
    begin = np.radians([5.0, 10, 0, -90, 5, 90])
    for aside in (0.0, 1e-4):
        path = line(middle + np.array([aside, -0.03, 0]), middle + np.array([aside, 0.03, 0]))
        with pytest.raises(InputError, match=r"passes a singular posture; got 'axis_[46] would have to") as refusal:
            joint_motion(robot, path, orientation="full", rotation=R, seed=begin)
        assert travelled(refusal.value) == pytest.approx(0.03, abs=0.01)
        assert "free more of the orientation" in str(refusal.value)
    up = np.array([0, 0, 0.05])
    with refusing("singular posture"):
        joint_motion(robot, line(middle + up, middle - up, step=0.07), orientation="full", rotation=R)


def test_steps_too_long_are_refused() -> None:
    path = line((0.3, -0.3, 0.3), (0.3, 0.3, 0.3), step=1.0)
    with refusing("have to jump; got 'axis_3 by ", "shorter steps"):
        joint_motion(load_robot("irb120"), path)


NAN = np.full((3, 3), np.nan)


def test_refusals() -> None:
    wrong: list[tuple[str, Callable[[], object]]] = [
        ("too few joints", lambda: joint_motion(katana(), changed(), orientation="full", rotation=np.eye(3))),
        ("no orientation is given", lambda: joint_motion(katana(), changed(), orientation="axis")),
        ("wrong shape", lambda: joint_motion(katana(), changed(), orientation="axis", rotation=[1, 0, 0])),
        ("not orthonormal", lambda: joint_motion(katana(), changed(), orientation="axis", rotation=2 * np.eye(3))),
        ("no such choice", lambda: joint_motion(katana(), changed(), orientation="half")),  # type: ignore[arg-type]
        ("no target of this name", lambda: joint_motion(katana(), changed(), target="gripper")),
        ("times do not rise", lambda: joint_motion(katana(), changed(time=np.zeros(0)))),
        ("times do not rise", lambda: joint_motion(katana(), changed(time=-changed().time))),
        ("trajectory, velocity: a trajectory needs three", lambda: joint_motion(katana(), changed(velocity=NAN))),
        ("NaN or infinity", lambda: joint_motion(katana(), changed(position=np.nan * changed().position))),
        ("wrong shape", lambda: joint_motion(katana(), changed(), seed=[0.0, 1.0])),
    ]
    for words, make in wrong:
        with refusing(words, of=words):
            make()
