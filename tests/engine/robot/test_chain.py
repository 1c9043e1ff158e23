from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.arms import ARMS
from tests.pinocchio_oracle import PinocchioChain

from truearm.engine.robot.chain import Array, Chain, Element, Motion, together
from truearm.engine.robot.conventions import CONVENTIONS
from truearm.engine.robot.conventions.convention import Convention, JointKind
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.effects.effect import Effect
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parameters import by_parameters_together, effect_rates
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform

MOTIONS: tuple[Motion, ...] = get_args(Motion)
CONFIGURATIONS = 7


def random_unit(rng: np.random.Generator, size: int) -> tuple[float, ...]:
    v = rng.normal(size=size)
    return tuple(float(x) for x in v / np.linalg.norm(v))


def random_quaternion(rng: np.random.Generator) -> tuple[float, float, float, float]:
    w, x, y, z = random_unit(rng, 4)
    return w, x, y, z


def random_frame(rng: np.random.Generator) -> Transform:
    x, y, z = (float(v) for v in rng.uniform(-0.3, 0.3, 3))
    return Transform((x, y, z), random_quaternion(rng))


def random_chain(rng: np.random.Generator) -> tuple[Chain, dict[str, float], int]:
    """A chain no longer than 1 m, values for its parameters, and the number of its variables."""
    count = int(rng.integers(3, 16))
    elements: list[Element] = []
    values: dict[str, float] = {}
    variables = 0
    for i in range(count):
        motion = MOTIONS[int(rng.integers(len(MOTIONS)))]
        reach = np.pi if motion[0] == "R" else 0.5 / count
        x, y, z = random_unit(rng, 3)
        variable = None
        if i == 0 or rng.random() < 0.4:
            variable, variables = variables, variables + 1
        parameter = f"p{i}" if rng.random() < 0.5 else None
        if parameter is not None and rng.random() < 0.7:
            values[parameter] = float(rng.uniform(-reach, reach))
        value = float(rng.uniform(-reach, reach))
        elements.append(Element(motion, value, parameter, variable, (x, y, z) if len(motion) == 1 else None))
    return Chain(tuple(elements)), values, variables


def compare_with_pinocchio(
    chain: Chain, values: dict[str, float], variables: Array, position: Array, rotation: Array, jacobian: Array, of: str
) -> None:
    oracle = PinocchioChain(chain, values)
    for i in range(variables.shape[1]):
        for own, expected in zip((position[i], rotation[i], jacobian[i]), oracle.tip(variables[:, i]), strict=True):
            assert_allclose(own, expected, rtol=0, atol=1e-12, err_msg=of)


# -- against Pinocchio -----------------------------------------------------------------------------------


def test_random_chain_agrees_with_pinocchio() -> None:
    for seed in range(30):
        rng = np.random.default_rng(seed)
        chain, values, count = random_chain(rng)
        scale = [[np.pi if e.turns else 0.05] for e in chain.elements if e.variable is not None]
        variables = rng.uniform(-1, 1, (count, CONFIGURATIONS)) * np.array(scale)
        kinematics = chain.forward_kinematics(variables, values)
        moving = [i for i, e in enumerate(chain.elements) if e.variable is not None]
        jacobian = np.moveaxis(np.concatenate(kinematics.jacobians(moving), axis=1), (0, 1), (2, 1))
        poses = kinematics.position.T, kinematics.matrix()
        compare_with_pinocchio(chain, values, variables, *poses, jacobian, f"seed {seed}")


@pytest.mark.parametrize("robot_id", ARMS)
def test_library_robot_agrees_with_pinocchio(robot_id: str) -> None:
    for seed in range(3):
        rng = np.random.default_rng(seed)
        robot = load_robot(robot_id).with_frames(random_frame(rng), {"tip": random_frame(rng)})
        step = {"m": 1e-3, "rad": np.radians(0.1)}
        robot = robot.with_values({n: p.value + step[p.unit] * rng.normal() for n, p in robot.parameters.items()})
        q = robot.random_configurations(CONFIGURATIONS, rng)
        for target in (None, "tip"):
            behind = robot.target("tip").chain.elements if target else ()
            chain, poses = Chain((*robot.trunk.elements, *behind)), robot.world_poses(q, target)
            jacobian = robot.joint_jacobian(q, target)
            compare_with_pinocchio(chain, dict(robot.values), q.T, *poses, jacobian, f"seed {seed}, {target}")


# -- derivatives -----------------------------------------------------------------------------------------


def random_robot(
    convention: Convention,
    effects: tuple[str, ...],
    rng: np.random.Generator,
    kinds: tuple[JointKind, ...] = ("revolute", "prismatic", "revolute", "revolute"),
) -> Robot:
    """A robot with turning and sliding joints, every column of the convention given, and two targets."""
    joints = []
    for number, kind in enumerate(kinds, 1):
        units = convention.row_units(kind)
        row = {
            column: float(rng.uniform(-1, 1) if unit == "rad" else rng.uniform(-0.3, 0.3))
            for column, unit in units.items()
        }
        for name in convention.vectors:
            if units.get(f"{name}_x") == "1":
                row |= dict(zip((f"{name}_x", f"{name}_y", f"{name}_z"), random_unit(rng, 3), strict=True))
        if "w_x" in row:  # a turning twist does not slide
            moment = np.cross([row[f"w_{a}"] for a in "xyz"], rng.uniform(-0.3, 0.3, 3))
            row |= dict(zip(("v_x", "v_y", "v_z"), map(float, moment), strict=True))
        joints.append(Joint(f"joint_{number}", kind, row))
    robot = Robot(
        name="random",
        title="random",
        source="random",
        convention_name=convention.name,
        joints=tuple(joints),
        flange=random_frame(rng),
        effect_names=effects,
    ).with_frames(random_frame(rng), {"tip": random_frame(rng), "point": (0.1, -0.2, 0.05)})
    return robot.with_values(
        {n: p.value + (0.05 if p.unit != "1" else 0.01) * rng.normal() for n, p in robot.parameters.items()}
    )


def vee(matrices: Array) -> Array:
    """The vectors of the skew parts of matrices ``(n, 3, 3)``, ``(3, n)``."""
    skew = (matrices - np.swapaxes(matrices, 1, 2)) / 2
    return np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]])


def check_derivatives(robot: Robot, rng: np.random.Generator) -> None:
    q = robot.random_configurations(CONFIGURATIONS, rng)
    loaded = robot.loaded(q)  # loads are held, and found once
    names = list(robot.parameters)
    h = 1e-5  # truncation and rounding are both of the order of 1e-11 here

    def stepped(step: float) -> dict[str, float | Array]:
        """Values of as many trials as there are parameters: in each another one is moved."""
        moved = step * np.eye(len(names))[:, :, None]
        return {name: robot.values[name] + moved[:, i] for i, name in enumerate(names)}

    for target in ("tip", "point"):
        kinematics = robot.forward_kinematics(q, target)
        linear, angular = robot.jacobians(kinematics, q, names)
        ahead, behind = (robot.forward_kinematics(loaded, target, stepped(step)) for step in (h, -h))
        turns = (ahead.matrix() - behind.matrix()) @ np.swapaxes(kinematics.matrix(), 1, 2)
        moves = np.moveaxis(ahead.position - behind.position, 1, 0)
        for i, name in enumerate(names):
            assert_allclose(linear[i], moves[i] / (2 * h), rtol=0, atol=1e-9, err_msg=name)
            assert_allclose(angular[i], vee(turns[i]) / (2 * h), rtol=0, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda c: c.name)
def test_derivatives_of_convention_are_central_differences(convention: Convention) -> None:
    for seed in range(3):
        rng = np.random.default_rng(seed)
        check_derivatives(random_robot(convention, (), rng), rng)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_derivatives_of_effect_are_central_differences(effect: type[Effect]) -> None:
    for convention in CONVENTIONS:
        rng = np.random.default_rng(1)
        check_derivatives(random_robot(convention, (effect.name,), rng), rng)


# -- trial axis ------------------------------------------------------------------------------------------


#: All effects that one robot can have; of clearance one form.
TOGETHER = tuple(effect.name for effect in EFFECTS if effect.name != "clearance-linear-contact")


def check_trials(robot: Robot, names: list[str], rng: np.random.Generator) -> None:
    trials = 4
    q = robot.random_configurations(CONFIGURATIONS, rng)
    values: dict[str, float | Array] = {
        name: value + 0.01 * rng.normal(size=(trials, 1)) if name in names else value
        for name, value in robot.values.items()
    }
    together = robot.forward_kinematics(q, "tip", values)
    linear, angular = robot.jacobians(together, q, list(robot.parameters), values)
    assert together.position.shape == (3, trials, CONFIGURATIONS)
    assert together.matrix().shape == (trials, CONFIGURATIONS, 3, 3)
    for k in range(trials):
        own: dict[str, float | Array] = {n: v if isinstance(v, float) else float(v[k, 0]) for n, v in values.items()}
        alone = robot.forward_kinematics(q, "tip", own)
        jacobians = robot.jacobians(alone, q, list(robot.parameters), own)
        ours = together.position[:, k], together.matrix()[k], linear[:, :, k], angular[:, :, k]
        for first, other in zip(ours, (alone.position, alone.matrix(), *jacobians), strict=True):
            assert_allclose(first, other, rtol=0, atol=1e-14, err_msg=f"{names}, trial {k}")


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda c: c.name)
def test_trials_together_equal_trials_alone(convention: Convention) -> None:
    rng = np.random.default_rng(4)
    robot = random_robot(convention, TOGETHER, rng)
    check_trials(robot, list(robot.parameters), rng)


def test_trials_of_one_parameter_equal_trials_alone() -> None:
    for name in ("base_x", "base_rz", "theta_offset_3", "alpha_2", "gain_1", "target_tip_z", "target_tip_rx"):
        rng = np.random.default_rng(5)
        check_trials(random_robot(CONVENTIONS[0], TOGETHER, rng), [name], rng)


# -- the chain itself ------------------------------------------------------------------------------------


def test_parameter_given_twice_is_refused() -> None:
    with pytest.raises(ValueError, match="'a' occurs twice"):
        Chain((Element("Tx", parameter="a"), Element("Ty", parameter="a")))


@pytest.mark.parametrize("trials", [0, 3])
def test_targets_swept_together_are_where_each_is_alone(trials: int) -> None:
    rng = np.random.default_rng(7)
    targets: dict[str, Transform | tuple[float, ...]] = {"tip": random_frame(rng), "point": (0.1, -0.2, 0.05)}
    targets["other"] = (0.0, 0.3, -0.1)
    robot = load_robot("irb120").with_effects(["compliance"]).with_frames(random_frame(rng), targets)
    q = robot.loaded(robot.random_configurations(CONFIGURATIONS, rng))
    names = tuple(robot.parameters)
    values = {
        name: p.value + p.prior * (rng.standard_normal((trials, 1)) if trials else float(rng.standard_normal()))
        for name, p in robot.parameters.items()
    }
    variables = robot.variables(q, values)
    trunk = robot.trunk.forward_kinematics(variables, values)
    ends = {t: robot.target(t).chain.forward_kinematics(variables, values, trunk) for t in targets}
    whole = together([*ends.values()])
    moved = by_parameters_together(robot, whole, ends, names, effect_rates(robot, q, names, values))
    for k, target in enumerate(targets):
        alone = robot.forward_kinematics(q, target, values)
        assert_allclose(ends[target].position, alone.position, rtol=0.0, atol=1e-15)
        assert_allclose(moved[:, :, k], robot.position_jacobian(alone, q, names, values), rtol=1e-14, atol=1e-15)
