"""What a robot answers to its users: poses, joints and Jacobians in a frame by name, and what it refuses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from tests.arms import ARMS
from tests.engine.robot.test_effects import NAMES as EVERY_EFFECT
from tests.expecting import refusing

from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.frames import FRAMES
from truearm.engine.robot.inverse.pose_solver import PoseStatus
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.parts import LinkMass, Payload
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform

NAN, INFINITY = float("nan"), float("inf")
#: Every effect that can be selected; of clearance the one form or the other.
EXACT, LINEAR = (
    tuple(effect.name for effect in EFFECTS if effect.name != other)
    for other in ("clearance-linear-contact", "clearance")
)
#: By unit: joints and bearings that bend by some mrad under the 100 N m of these arms.
STIFF = {"rad/(N m)": 2e-5, "rad/(N m)^2": 1e-7, "rad/(N m)^3": 1e-9}
#: A posture counts as singular where a joint motion of norm 1 moves the pose by less [reach lengths, rad].
SINGULAR = 0.03
#: A shaft that carries less across its axis [N m] lies in the middle of its clearance, where a hair of load turns it.
SEATED = 0.1
BASE = Transform((0.7, -0.4, 0.2), (0.5, 0.5, -0.5, 0.5))
TOOL = Transform((0.02, 0.01, 0.15), (0.8, 0.0, 0.6, 0.0))


def calibrated(name: str, effects: tuple[str, ...]) -> Robot:
    """Return a library robot with other geometry, every effect, masses and a payload, and not at the origin."""
    rng, plain = np.random.default_rng(5), load_robot(name)
    masses = plain.masses or tuple(LinkMass(i, 3.0, (0.05, 0.02, -0.03)) for i in range(1, len(plain.joints) + 1))
    robot = replace(plain, masses=masses, payload=Payload(2.0, (0.02, 0.03, 0.1))).with_effects(effects)
    robot = robot.with_frames(BASE, {"tool": TOOL, "ball": (0.05, 0.02, 0.15)})
    values = {}
    for p in robot.parameters.values():
        if p.group in ("geometry", "joint zero"):
            values[p.name] = p.value + p.prior * rng.standard_normal()
        elif p.group not in ("base", "target"):
            size = STIFF.get(p.unit, 0.3 * p.prior)
            values[p.name] = p.value + size * abs(rng.standard_normal())
    return robot.with_values(values)


def regular(robot: Robot, count: int) -> Array:
    """Return joint positions ``(count, joints)`` drawn within the limits, away from singular postures.

    Postures in which a shaft with clearance is not seated are left out too: they are as good as singular.
    """
    rng, length = np.random.default_rng(7), robot.forward(np.zeros(len(robot.joints)))[0]
    q = robot.random_configurations(3 * count, rng)
    scale = np.array([1.0 / np.linalg.norm(length)] * 3 + [1.0] * 3)[:, None]
    weakest = np.linalg.svd(robot.rigid.jacobian(q) * scale, compute_uv=False)[:, -1]
    chosen = weakest > SINGULAR
    if any(effect.tilts for effect in robot.effects):
        loads = robot.loaded(q).joint_loads
        chosen &= (np.hypot(loads[:, 3], loads[:, 4]) > SEATED).all(axis=0)
    return q[chosen][:count]


# -- forward and inverse ----------------------------------------------------------------------------------


CASES = [*((name, ()) for name in ARMS), *((name, EXACT) for name in ARMS), ("katana450", LINEAR)]


@pytest.mark.parametrize(("name", "effects"), CASES, ids=lambda v: v if isinstance(v, str) else f"{len(v)} effects")
def test_inverse_of_forward_is_where_the_joints_are(name: str, effects: tuple[str, ...]) -> None:
    robot = calibrated(name, effects) if effects else load_robot(name)
    count = 100 if effects else 400
    q = regular(robot, count)
    assert len(q) == count
    pose = robot.forward(q)
    for beside in (0.0, 0.05):
        seed = q + np.random.default_rng(8).uniform(-beside, beside, q.shape)
        solution = robot.inverse(*pose, seed=seed)
        assert solution.complete
        if len(robot.joints) <= 6:
            assert np.abs(solution.joints - q).max() < 1e-8
        else:  # a redundant arm reaches the pose in more than one way
            again = robot.forward(solution.joints)
            assert np.abs(again[0] - pose[0]).max() < 1e-8
            assert np.abs(again[1] - pose[1]).max() < 1e-8


def test_base_and_world_are_a_rigid_motion_apart() -> None:
    robot = calibrated("irb1600", ("compliance", "gain"))
    q = regular(robot, 20)
    for target in (None, "tool", "ball"):
        (p, R), (p_world, R_world) = robot.forward(q, target=target), robot.forward(q, frame="world", target=target)
        assert_allclose(p @ BASE.rotation.T + np.array(BASE.translation), p_world, rtol=0, atol=1e-12)
        assert_allclose(BASE.rotation @ R, R_world, rtol=0, atol=1e-12)
        assert_array_equal(p_world, robot.forward_kinematics(q, target).position.T)
        for frame, pose in (("base", (p, R)), ("world", (p_world, R_world))):
            solution = robot.inverse(*pose, frame=frame, seed=q, target=target)  # type: ignore[arg-type]
            assert_allclose(solution.joints, q, rtol=0, atol=1e-8, err_msg=f"{target} in {frame}")


def test_one_configuration_a_list_and_none_at_all() -> None:
    robot = load_robot("irb120")
    q = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    p, R = robot.forward(q)
    assert p.shape == (1, 3)
    assert R.shape == (1, 3, 3)
    assert_array_equal(robot.forward([q, q])[0], np.vstack([p, p]))
    assert_allclose(robot.inverse(p[0], R[0], seed=q).joints, [q], rtol=0, atol=1e-10)
    assert robot.forward(np.zeros((0, 6)))[0].shape == (0, 3)
    assert robot.jacobian(q).shape == (1, 6, 6)
    none = np.zeros((0, 3))
    for arm in (robot, robot.with_effects(["gain", "compliance"])):
        for frame in FRAMES:
            assert arm.jacobian(np.zeros((0, 6)), frame=frame).shape == (0, 6, 6)  # type: ignore[arg-type]
        assert arm.inverse(none, np.zeros((0, 3, 3))).joints.shape == (0, 6)


def test_forward_takes_what_is_known_of_the_postures() -> None:
    robot = load_robot("irb120").with_effects(["thermal-growth"]).with_values({"thermal_growth_3": 2e-5})
    warm = Postures(np.zeros((1, 6)), temperature=np.array([30.0]))
    middle = Postures(np.zeros((1, 6)), temperature=np.array([20.0]))
    grown = robot.forward(warm)[0] - robot.forward(np.zeros(6))[0]
    assert grown[0, 2] == pytest.approx(2e-5 * 10 * 0.27)  # the length of link 3 [m]
    assert_array_equal(robot.forward(middle)[0], robot.forward(np.zeros(6))[0])


def test_a_pose_out_of_reach_has_no_joints() -> None:
    robot = load_robot("irb120")
    p, R = robot.forward(np.array([[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]] * 2))
    solution = robot.inverse(p * [[1.0], [9.0]], R)
    assert solution.status[1] is PoseStatus.UNREACHABLE
    assert np.isfinite(solution.joints[0]).all()
    assert np.isnan(solution.joints[1]).all()
    assert repr(solution).startswith("1 of 2 poses can be reached (1 reached, 1 unreachable)\npose 1: ")
    assert "<pre>1 of 2 poses" in solution._repr_html_()
    assert "No joints give the pose: move it" in solution.advice(1)
    assert "nearest" not in repr(solution)


def test_what_is_said_to_be_reached_is_where_the_arm_goes() -> None:
    """The solver turns joints; a gain near zero leaves no joint positions that turn them so."""
    plain = load_robot("li3")
    poses = plain.forward(np.random.default_rng(0).uniform(-0.3, 0.3, (8, 3)))
    for gain in (-1.0, 0.0, 0.0015, 0.1, 1.9):
        arm = plain.with_effects(["gain"]).with_values({f"gain_{i}": gain for i in range(1, 4)})
        solution = arm.inverse(*poses)
        usable = solution.usable
        assert usable.any() is np.bool_(gain > 1.0), gain
        assert_allclose(arm.forward(solution.joints[usable])[0], poses[0][usable], rtol=0, atol=1e-9)
        assert (solution.position_error[usable] <= 1e-9).all()
        assert ((solution.position_error > 1e-9) | (solution.orientation_error > 1e-9))[~usable].all()


# -- the Jacobian -----------------------------------------------------------------------------------------


def test_jacobian_is_the_difference_of_poses() -> None:
    for effects in ((), EVERY_EFFECT):
        robot, h = calibrated("irb120", effects), 2e-6
        q = regular(robot, 40)
        for place in ({"frame": frame, "target": target} for frame in ("base", "world") for target in (None, "tool")):
            where: Any = place
            J, (_, R) = robot.jacobian(q, **where), robot.forward(q, **where)
            for joint in range(6):
                way = h * np.eye(6)[joint]
                (p1, R1), (p0, R0) = (robot.forward(q + s * way, **where) for s in (1, -1))
                turned = (R1 - R0) @ np.swapaxes(R, 1, 2) / (2 * h)
                turns = [turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]]
                expected = np.column_stack([(p1 - p0) / (2 * h), *turns])
                assert_allclose(J[:, :, joint], expected, rtol=0, atol=2e-7, err_msg=f"{effects}, {place}, {joint}")
            assert bool(np.abs(J - robot.rigid.jacobian(q, **where)).max() > 1e-4) is bool(effects)


# -- refusals ---------------------------------------------------------------------------------------------

P, R = np.array([[0.3, 0.0, 0.5]]), np.eye(3)[None]
MASKED = np.ma.array(np.zeros(6), mask=np.eye(6, dtype=bool)[0])
WRONG_JOINTS: list[Any] = [
    *(np.zeros(5), np.zeros((2, 7)), np.zeros((1, 2, 6)), [[0.0] * 6, [0.0] * 5], [NAN] * 6, [[INFINITY] * 6], []),
    *(0.0, "q", ["0"] * 6, [True] * 6, np.zeros((2, 6), dtype=complex), slice(None), {"joint_1": 0.0}, MASKED),
    np.full(6, 1e200),
]


def test_what_is_none_is_refused_with_its_parameter() -> None:
    robot, rng = load_robot("irb120"), np.random.default_rng(0)
    known = robot.parameters["base_x"]
    unknown = Parameter.plain("nowhere", "m", "base", 0.0, 1.0)
    other = Postures(np.zeros((3, 5)))
    wrong: list[tuple[str, Callable[[Any], object], list[Any]]] = [
        ("joints", robot.forward, [*WRONG_JOINTS, None, other]),
        ("joints", robot.jacobian, [*WRONG_JOINTS, None, Postures(np.full((3, 6), NAN))]),
        ("seed", lambda v: robot.inverse(P, R, seed=v), [*WRONG_JOINTS, np.zeros((2, 6))]),
        (
            "positions",
            lambda v: robot.inverse(v, R),
            [P[:, :2], P * NAN, "here", None, 1e160 * P, np.ma.array(P, mask=P == 0.0)],
        ),
        (
            "rotations",
            lambda v: robot.inverse(P, v),
            [np.full((1, 3, 3), INFINITY), 1.01 * R, -R, np.vstack([R, R]), [[1.0, 0.0, 0.0, 0.0]], None],
        ),
        ("frame", lambda v: robot.inverse(P, R, frame=v), [None, ["base"], np.array(["base", "world"])]),
        ("target", lambda v: robot.inverse(P, R, target=v), ["gripper", 3, np.array(["a", "b"])]),
        ("orientation", lambda v: robot.inverse(P, R, orientation=v), [np.array(["full", "free"]), "ful", None]),
        ("effects", robot.with_effects, ["compliance", None, 3, [3], [None], {"compliance": 1}]),
        ("values", robot.with_values, [[("base_x", 0.0)]]),
        ("values", lambda v: robot.with_values({"base_x": v}), [NAN, INFINITY, "1", None, True, [1.0]]),
        *(
            (field, lambda v, field=field: replace(known, **{field: v}), [NAN, INFINITY, "1", True, [1.0]])
            for field in ("nominal", "value", "prior", "deviation", "informed")
        ),
        ("value", lambda v: replace(known, value=v), [None]),
        ("parameters", robot.with_parameters, [None, 5, [None], ["base_x"], known, [unknown]]),
        ("prior", lambda v: Parameter.plain("base_x", "m", "base", 0.0, v), [-1.0]),
        ("base", lambda v: robot.with_frames(v, {}), [None]),
        (
            "targets",
            lambda v: robot.with_frames(BASE, v),
            [None, [("a", (0.0, 0.0, 0.0))], {1: (0.0,) * 3}, {"a": (1.0, 2.0)}, {"a": None}, {"a": (0.0, 0.0, NAN)}],
        ),
        (
            "places",
            robot.with_fixtures,
            [None, {"a": None}, {"a": ("point", None)}, {"a": ("line", BASE)}, {1: ("point", BASE)}, {"a": ([], BASE)}],
        ),
        ("count", lambda v: robot.random_configurations(v, rng), [-1, 1.5, None, True, "2"]),
        ("rng", lambda v: robot.random_configurations(2, v), [0]),
        ("payload", robot.with_payload, ["2.7kg", "nankg,0mm,0mm,0mm", "-1kg,0mm,0mm,0mm", 2.7, ["2.7kg"], {}]),
        ("mass", lambda v: Payload(v, (0.0, 0.0, 0.0)), [-1.0, NAN, "1"]),
        ("cog", lambda v: Payload(1.0, v), [(0.0, NAN, 0.0), (0.0, 0.0), None]),
        (
            "gravity",
            lambda v: robot.with_payload(None, v),
            [(0.0, 0.0, NAN), (0.0, 0.0), 9.81, "down", (0.0, 0.0, 0.0), (0, 0, -9810)],
        ),
    ]
    for parameter, call, values in wrong:
        for value in values:
            with refusing(parameter=parameter, of=f"{parameter} {value!r}"):
                call(value)


def test_misspelt_names_are_offered() -> None:
    robot = load_robot("irb120").with_frames(Transform(), {"ball": (0.0, 0.0, 0.1)})
    calls: list[tuple[str, Callable[[], object]]] = [
        ("world?", lambda: robot.forward(np.zeros(6), frame="wrold")),  # type: ignore[arg-type]
        ("world?", lambda: robot.jacobian(np.zeros(6), frame="wrold")),  # type: ignore[arg-type]
        ("ball?", lambda: robot.forward(np.zeros(6), target="bal")),
        ("ball?", lambda: robot.jacobian(np.zeros(6), target="bal")),
        ("full?", lambda: robot.inverse(P, R, orientation="ful")),  # type: ignore[arg-type]
        ("compliance", lambda: robot.with_effects(["complience"])),
        ("base_x", lambda: robot.with_values({"base_xx": 0.0})),
    ]
    for meant, call in calls:
        with refusing(f"Did you mean {meant}", of=meant):
            call()


def test_payloads_are_arrays_or_texts_in_which_zero_needs_no_unit() -> None:
    payload = Payload(1, np.zeros(3))  # type: ignore[arg-type]
    assert payload == Payload(1.0, (0.0, 0.0, 0.0))
    assert {payload, Payload(1, [0, 0, 0])} == {payload}  # type: ignore[arg-type]
    robot = load_robot("irb120")
    assert robot.with_payload("2.7kg,50mm,25mm,100mm").payload == Payload(2.7, (0.05, 0.025, 0.1))
    assert robot.with_payload(None).payload == robot.payload
    assert Payload.of_text("3kg,0,0,120mm") == Payload(3.0, (0.0, 0.0, 0.12))
    assert Payload.of_text("300g,0.0,-0,0.1m") == Payload(0.3, (0.0, 0.0, 0.1))
    assert Payload.of_text("0,0,0,0") == Payload(0.0, (0.0, 0.0, 0.0))
    for text in ("3kg,0,0,120", "3,0,0,120mm", "3kg,0kg,0,120mm", "3kg,0,,120mm", "3kg,0 cm,0,120mm"):
        with refusing("unit", of=text):
            Payload.of_text(text)


# -- what a robot shows of itself -------------------------------------------------------------------------


def test_a_robot_shows_what_is_not_nominal_and_is_short() -> None:
    robot = load_robot("irb120").with_values({"base_x": 0.1}).with_payload("1kg,0mm,0mm,100mm")
    assert repr(robot) == (
        "irb120: ABB IRB 120-3/0.6\n"
        "6 joints (modified-hayati), 1 of 31 parameters not at the nominal value\n"
        "joint effects: none\n"
        "targets: none\n"
        "payload: 1kg,0mm,0mm,100mm"
    )
    robot = calibrated("irb120", EXACT)
    assert "targets: tool, ball" in repr(robot)
    many = robot.with_frames(BASE, {f"a target of the name {i}": (0.0, 0.0, 0.1) for i in range(300)})
    assert len(repr(many)) <= 2000
    assert len(repr(replace(robot, title="x" * 5000))) == 2000
    assert robot._repr_html_() == f"<pre>{repr(robot).replace('&', '&amp;')}</pre>"
