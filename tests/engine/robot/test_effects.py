"""Every registered joint effect: against the twin, against central differences, and where it is off."""

from __future__ import annotations

import ast
import re
import runpy
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import brentq
from tests.expecting import refusing

import truearm
from truearm.engine.robot.balancers import Anchor, Balancer
from truearm.engine.robot.effects import EFFECTS, NON_NEGATIVE
from truearm.engine.robot.effects.backlash import SEATED
from truearm.engine.robot.effects.effect import Effect, LinearEffect
from truearm.engine.robot.effects.joint_curve import HIGHEST, JointCurve, curve_names, curve_waves
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.loads import joint_loads
from truearm.engine.robot.parts import LinkMass, Payload
from truearm.engine.robot.postures import Postures, approach_of
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.twin.truths import joint_truths
from truearm.engine.twin.twin import Twin
from truearm.engine.twin.twin_joint import JointTruth
from truearm.robot_files.formats import exported

#: All together; of clearance in one form.
SPRING = Balancer("spring", Anchor(1, (-0.15, 0.05, 0.1)), Anchor(2, (0.2, 0.08, 0.03)), 400.0, 0.2, 1000.0)
NAMES = tuple(effect.name for effect in EFFECTS if effect.name != "clearance-linear-contact")


def loaded_arm(effects: tuple[str, ...], seed: int) -> Robot:
    """An arm with masses on every link, a payload and effects of the size of their priors."""
    rng = np.random.default_rng(seed)
    plain = load_robot("irb120").with_frames(load_robot("irb120").base, {"tip": (0.05, 0.02, 0.15)})
    masses = tuple(LinkMass(i, float(rng.uniform(1, 4)), tuple(rng.uniform(-0.1, 0.1, 3))) for i in range(1, 7))
    if "balancer" in effects:  # which moves nothing that does not give way
        plain, effects = replace(plain, balancers=(SPRING,)), (*effects, "compliance")
    robot = replace(plain, masses=masses, payload=Payload(2.0, (0.05, 0.03, 0.1))).with_effects(effects)
    own = [p for effect in robot.effects for p in effect.parameters]
    return robot.with_values({p.name: p.nominal + 0.3 * p.prior * abs(rng.normal()) for p in own})


def circumstances(robot: Robot, count: int, seed: int) -> Postures:
    """Postures in which every joint carries a moment, so that play is taken up."""
    rng = np.random.default_rng(seed)
    wrench = np.column_stack([rng.uniform(-20, 20, (count, 3)), rng.uniform(-8, 8, (count, 3))])
    signs = rng.choice([-1.0, 1.0], (count, 6))
    joints = robot.random_configurations(count, rng)
    at = Postures(
        joints, approach=signs, temperature=rng.uniform(10, 40, count), wrench=wrench, number=np.arange(float(count))
    )
    loads = robot.with_effects(("compliance",)).loaded(at).loads  # of the arm as it has bent
    assert loads is not None
    seated = (np.abs(loads[:, 5]) > 20 * SEATED).all(axis=0)
    seated &= (np.hypot(loads[:, 3], loads[:, 4]) > 20 * SEATED).all(axis=0)
    return at.at(np.flatnonzero(seated))


@pytest.mark.parametrize("effects", [*((name,) for name in NAMES), NAMES, ("compliance", "clearance-linear-contact")])
def test_effects_are_those_of_the_twin(effects: tuple[str, ...]) -> None:
    robot = loaded_arm(effects, 1)
    at = circumstances(robot, 60, 2)
    assert len(at) >= 10
    assert at.approach is not None
    assert at.temperature is not None
    assert at.wrench is not None
    assert at.number is not None
    twin = Twin(robot, joint_truths(robot), "document" if "clearance-linear-contact" in effects else "exact")
    postures = twin.postures(
        at.joints, approach=at.approach, number=at.number, temperature=at.temperature, wrench=at.wrench
    )
    true = np.array([posture.targets["tip"] for posture in postures])
    position, rotation = robot.world_poses(at, "tip")
    assert_allclose(position, true[:, :3, 3], rtol=0, atol=1e-11)
    assert_allclose(rotation, true[:, :3, :3], rtol=0, atol=1e-11)
    plain, _ = replace(robot, effect_names=()).world_poses(at, "tip")
    assert np.abs(position - plain).max() > 1e-6


def with_many_lines(robot: Robot) -> Robot:
    """The same robot with gears that err at several numbers of periods, or at none that is known."""
    many = ((240, 30), (), (200, 400, 101), (100, 300), (100,), ())
    joints = (replace(j, transmission_periods=periods) for j, periods in zip(robot.joints, many, strict=True))
    return replace(robot, joints=tuple(joints))


def test_gears_that_err_at_several_numbers_of_periods_are_those_of_the_twin() -> None:
    geared = with_many_lines(loaded_arm((), 1)).with_effects(("transmission-error",))
    names = [p.name for p in geared.effects[0].parameters]
    assert names[:4] == ["transmission_sin_1", "transmission_cos_1", "transmission_sin30_1", "transmission_cos30_1"]
    assert len(names) == 2 * 8
    drawn = {name: 1e-4 * n for n, name in enumerate(names, 1)}
    q = geared.random_configurations(20, np.random.default_rng(3))
    for values in (*({name: value} for name, value in drawn.items()), drawn):
        robot = geared.with_values(values)
        true = np.array([posture.targets["tip"] for posture in Twin(robot, joint_truths(robot)).postures(q)])
        position, rotation = robot.world_poses(q, "tip")
        assert_allclose(position, true[:, :3, 3], rtol=0, atol=1e-11)
        assert_allclose(rotation, true[:, :3, :3], rtol=0, atol=1e-11)
    turned = geared.effects[0].deflection(Postures(q), {**geared.values, "transmission_cos101_3": 2e-4})
    assert_allclose(turned[2], 2e-4 * np.cos(101 * q[:, 2]), rtol=0, atol=1e-15)
    assert not turned[0].any()
    assert set(turned) == {0, 2, 3, 4}


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_derivatives_are_central_differences_under_load(effect: type[Effect]) -> None:
    robot = loaded_arm((effect.name,), 3)
    at = robot.loaded(circumstances(robot, 40, 4))
    names = [p.name for e in robot.effects for p in e.parameters]
    kinematics = robot.forward_kinematics(at, "tip")
    linear, angular = robot.jacobians(kinematics, at, names)
    for i, name in enumerate(names):
        h = 1e-3 * robot.parameters[name].prior
        values = ({**robot.values, name: robot.values[name] + step} for step in (h, -h))
        ahead, behind = (robot.forward_kinematics(at, "tip", trial) for trial in values)
        turned = (ahead.matrix() - behind.matrix()) @ np.swapaxes(kinematics.matrix(), 1, 2)
        vee = np.stack([turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]])
        for own, moved in ((linear[i], ahead.position - behind.position), (angular[i], vee)):
            atol = 1e-6 * np.abs(own).max() + 1e-13 / h
            assert_allclose(own, moved / (2 * h), rtol=0, atol=atol, err_msg=name)
    assert np.abs(linear).max() > 0


@pytest.mark.parametrize("effects", [(effect.name,) for effect in EFFECTS] + [NAMES])
def test_effects_that_are_off_change_nothing_at_all(effects: tuple[str, ...]) -> None:
    plain = replace(load_robot("irb120"), payload=Payload(2.0, (0.05, 0.03, 0.1)), balancers=(SPRING,))
    robot = plain.with_effects(effects)
    assert set(robot.parameters) > set(plain.parameters)
    at = circumstances(robot, 20, 5)
    for actual, expected in zip(robot.world_poses(at), plain.world_poses(at), strict=True):
        assert_array_equal(actual, expected)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_nothing_is_nan_where_a_moment_is_zero(effect: type[Effect]) -> None:
    laden = loaded_arm((effect.name,), 6)
    straight_up = np.zeros((1, 6))  # no moment about joint 1, nearly none about the others
    for robot in (laden, replace(laden, masses=(), payload=Payload())):
        kinematics = robot.forward_kinematics(straight_up, "tip")
        for result in (kinematics.position, *robot.jacobians(kinematics, straight_up, list(robot.parameters))):
            assert np.isfinite(result).all()


def test_approach_follows_the_numbers_of_the_configurations() -> None:
    joints = np.array([[0.0, 1.0], [2.0, 1.0], [1.0, 0.0], [5.0, 5.0]])
    assert_array_equal(approach_of(joints, np.arange(4)), [[0, 0], [1, 0], [-1, -1], [1, 1]])
    # measured in another order, and the one before the last row is missing
    assert_array_equal(approach_of(joints, np.array([3, 2, 1, 9])), [[-1, 1], [1, 1], [0, 0], [0, 0]])


def test_an_arm_that_warms_up_is_one_that_was_colder() -> None:
    robot = loaded_arm(("warm-up",), 9)
    at = circumstances(robot, 60, 10)
    assert at.number is not None
    assert at.wrench is not None
    growth = {number: JointTruth(growth=robot.values.get(f"warm_up_{number}", 0.0)) for number in range(1, 7)}
    colder = 20.0 - np.exp(-at.number * robot.values["warm_up_rate"])
    twin = Twin(robot, growth).postures(at.joints, wrench=at.wrench, temperature=colder)
    true = np.array([posture.targets["tip"][:3, 3] for posture in twin])
    assert_allclose(robot.world_poses(at, "tip")[0], true, rtol=0, atol=1e-12)
    assert np.abs(robot.world_poses(at.joints, "tip")[0] - true).max() > 1e-6


@pytest.mark.parametrize("effect", ["approach", "thermal-growth", "warm-up"])
def test_what_is_not_known_does_nothing(effect: str) -> None:
    robot = loaded_arm((effect,), 7)
    if effect == "warm-up":  # what a session's middle leaves of it
        robot = robot.with_values({"warm_up_left": 0.0})
    q = robot.random_configurations(5, np.random.default_rng(8))
    for actual, expected in zip(robot.world_poses(q), replace(robot, effect_names=()).world_poses(q), strict=True):
        assert_array_equal(actual, expected)


# -- where loads and deflections depend on each other


@pytest.mark.parametrize("effects", [*((effect.name,) for effect in EFFECTS), NAMES], ids="+".join)
def test_readings_are_those_that_the_variables_came_from(effects: tuple[str, ...]) -> None:
    for name in ("irb120", "katana450"):
        rng = np.random.default_rng(1)
        plain = replace(load_robot(name), payload=Payload(2.0, (0.05, 0.03, 0.1))).with_effects(effects)
        own = [p for effect in plain.effects for p in effect.parameters]
        robot = plain.with_values({p.name: p.nominal + 0.3 * p.prior * rng.standard_normal() for p in own})
        q = robot.random_configurations(200, rng)
        variables = robot.variables(q, robot.values)
        assert len(variables) == len(robot.moving)
        assert_allclose(robot.joints_of(variables), q, rtol=0, atol=1e-12, err_msg=name)


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_equilibrium_in_the_play_of_a_joint_is_a_root_of_its_equation(up: float) -> None:
    """An arm whose second joint has play carries a weight that balances at `up` = 1, and hangs at -1.

    The moment of the weight is m g l sin(v), about an axis that no other deflection moves.
    """
    plain = replace(load_robot("irb120"), masses=(LinkMass(2, 4.0, (0.3 * up, 0.0, 0.0)),)).with_effects(["backlash"])
    stiffness = up * 4.0 * 0.3 * -plain.gravity[2]
    q = np.linspace(-0.02, 0.02, 41)[:, None] * np.eye(6)[1]
    for play in (1e-3, 8e-3, 2e-2):
        robot = plain.with_values({"backlash_2": play})

        def sideways(v: float, reading: float, play: float = play) -> float:
            return float(v - reading - 0.5 * play * np.tanh(stiffness * np.sin(v) / SEATED))

        variables = robot.variables(q, robot.values)
        loads = joint_loads(robot, variables)
        assert (np.abs(loads[1, 5]) < SEATED).any()
        assert_allclose(loads[1, 5], stiffness * np.sin(variables[1]), rtol=0, atol=1e-12)
        if up < 0.0:
            roots = [brentq(sideways, -0.1, 0.1, args=(reading,), xtol=1e-15) for reading in q[:, 1]]
            assert_allclose(variables[1], roots, rtol=0, atol=5e-12)
        else:  # above its axis a weight may balance on either side of the play: any root will do
            left = [sideways(*pair) for pair in zip(variables[1], q[:, 1], strict=True)]
            assert_allclose(left, 0.0, rtol=0, atol=5e-12)
        assert_allclose(robot.joints_of(variables), q, rtol=0, atol=5e-12)


def test_tilts_under_their_own_loads_are_those_of_the_variables() -> None:
    robot = loaded_arm(("compliance", "bearing-compliance", "clearance"), 3)
    q = robot.random_configurations(100, np.random.default_rng(4))
    variables = robot.variables(q, robot.values)
    assert np.abs(variables[6:18]).max() > 1e-5
    for part, expected in zip(robot.tilted(variables, q.T), (variables, q.T), strict=True):
        assert_allclose(part, expected, rtol=0, atol=1e-11)


def test_variables_of_another_number_are_refused() -> None:
    robot = load_robot("irb120").with_effects(["bearing-compliance"])
    for variables in (np.zeros((6, 5)), np.zeros(23)):
        with refusing("wrong number of variables", "allowed: (18, n)"):
            robot.joints_of(variables)


# -- what an effect says about itself


def test_names_are_unlike() -> None:
    assert len({effect.name for effect in EFFECTS}) == len(EFFECTS)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_it_depends_on_moves_and_is_called_what_it_says(effect: type[Effect]) -> None:
    robot = loaded_arm((effect.name,), 3)
    own = next(each for each in robot.effects if each.name == effect.name)
    assert {p.group for p in own.parameters if p.group != "session"} == {effect.name}
    at = circumstances(robot, 40, 4)
    assert at.wrench is not None
    assert at.approach is not None
    assert at.number is not None
    assert at.temperature is not None

    def matters(**changed: Any) -> bool:
        """Whether the effect moves the arm otherwise in other circumstances."""
        return bool(np.abs(robot.world_poses(replace(at, **changed))[0] - robot.world_poses(at)[0]).max() > 1e-9)

    assert matters(wrench=2.0 * at.wrench) == effect.loaded
    assert matters(approach=-at.approach, number=at.number[::-1]) == effect.ordered
    assert matters(temperature=at.temperature + 5.0) == effect.warmed
    fallen = replace(robot, gravity=(9.8, 0.0, 0.0))
    leans = np.abs(fallen.world_poses(at)[0] - robot.world_poses(at)[0]).max() > 1e-9
    assert leans == (effect.loaded or effect.falls)

    rates = robot.effects[0].derivative(robot.loaded(at), robot.values).values()
    moved = {variable for rate in rates for variable in rate}
    layout = robot.layout
    tilts = {variable for joint in layout.joints for variable in layout.tilt(joint)}
    lengths = {layout.length(number) for number in range(len(layout.lengths))}
    assert bool(moved & tilts) == effect.tilts
    shifts = {variable for joint in layout.joints for variable in layout.shift(joint)}
    assert bool(moved & lengths) == effect.stretches
    assert bool(moved & shifts) == effect.shifts
    beside = effect.tilts or effect.stretches or effect.shifts
    assert bool(moved & set(layout.joints)) == (not beside or effect.falls)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_only_what_can_be_negative_may_be_stated_so(effect: type[Effect], tmp_path: Path) -> None:
    robot = replace(loaded_arm((effect.name,), 3), history=())
    own = robot.effects[0].parameters[0]
    assert (effect.name in NON_NEGATIVE) == effect.non_negative
    for field in ("nominal", "value"):
        negative = replace(robot.parameters[own.name], **{field: -1e-5})  # type: ignore[arg-type]
        (tmp_path / "robot.yaml").write_text(robot_text(robot.with_parameters([negative])))
        if effect.non_negative:
            with refusing(f"{own.name}.{field}: no joint has a negative one", "allowed: 0 or more"):
                read_robot(tmp_path / "robot.yaml")
        else:
            assert getattr(read_robot(tmp_path / "robot.yaml").parameters[own.name], field) == pytest.approx(-1e-5)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_the_python_file_computes_it_or_says_that_it_does_not(effect: type[Effect], tmp_path: Path) -> None:
    robot = replace(loaded_arm((effect.name,), 3), targets=())
    export = exported(robot, "python")
    left = [sentence for sentence in export.left_out if f"the joint effect {effect.name};" in sentence]
    assert len(left) == (0 if effect.exportable else 1)
    (tmp_path / "arm.py").write_text(export.text)
    q = robot.random_configurations(20, np.random.default_rng(5))
    position, _ = runpy.run_path(str(tmp_path / "arm.py"))["forward"](q)
    counterpart = robot if effect.exportable else robot.rigid
    away = {name: p for name, p in counterpart.known.items() if p.group != "base"}
    in_base = replace(counterpart, known=away, base_quaternion=(1.0, 0.0, 0.0, 0.0))
    assert_allclose(position, in_base.world_poses(q)[0], rtol=0, atol=1e-9)
    assert effect.exportable == bool(np.abs(position - in_base.rigid.world_poses(q)[0]).max() > 1e-9)


#: Modules outside of truearm.engine.robot.effects that name several effects, and why.
NAMED_ELSEWHERE = {
    "truearm.engine.fit.models": "a model is a choice of effects",
    "truearm.engine.diagnose.next_steps": "a list of notices, one of which is called like an effect",
    "truearm.engine.diagnose.unmodelled": "compliance is what a payload that nobody gave is seen by",
    "truearm.engine.robot.robot_file": "a truth of a robot file has constants of joints, by what they are",
    "truearm.engine.twin.truths": "and a twin is made with them",
    "truearm.inclinometers": "the method with inclinometers has a model of its own, and tells what it found",
    "truearm.studio.cell_rules": "what keeps clear of a cell is called like an effect",
    "truearm.studio.plan_fields": "and its field",
    "truearm.studio.planned": "and its option",
    "truearm.planning.plan": "an option is called like an effect",
    "truearm.engine.motion": "a stop of a tour is called like an effect",
    "truearm.iso9283": "a criterion of ISO 9283 is called like an effect",
}


def spelled_lists(source: str, names: frozenset[str]) -> Iterator[int]:
    """Return the lines of lists that spell the name of a joint effect, and of tables that spell several."""
    if not re.search(rf"""['"]({"|".join(map(re.escape, names))})['"]""", source):
        return  # a text without such a name need not be parsed
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Dict):
            entries = [*(key for key in node.keys if key is not None), *node.values]
        elif isinstance(node, ast.Tuple | ast.List | ast.Set):
            entries = node.elts
        else:
            continue
        spelled = sum(isinstance(entry, ast.Constant) and entry.value in names for entry in entries)
        if spelled >= (2 if isinstance(node, ast.Dict) else 1):
            yield node.lineno


def test_no_other_module_lists_effects() -> None:
    names = frozenset(effect.name for effect in EFFECTS)
    assert list(spelled_lists('x = ("gain", 1)\ny = {"gain": "backlash"}\nz = ["other"]\n', names)) == [1, 2]
    package = Path(truearm.__file__).parent
    places = [
        f"{'.'.join(path.relative_to(package.parent).with_suffix('').parts)}.{line}"
        for path in sorted(package.rglob("*.py"))
        if package / "engine" / "robot" / "effects" not in path.parents
        for line in spelled_lists(path.read_text("utf-8"), names)
    ]
    assert [place for place in places if not place.startswith(tuple(f"{name}." for name in NAMED_ELSEWHERE))] == []
    for allowed in NAMED_ELSEWHERE:
        assert any(place.startswith(f"{allowed}.") for place in places), f"{allowed} needs no exception any more"


# -- the curve of a joint: its waves, its sum, its lines in a robot file, and its inverse


def curved(seed: int, size: float = 1e-4, joints: tuple[int, ...] = (1, 2, 5)) -> Robot:
    rng = np.random.default_rng(seed)
    robot = load_robot("irb120").with_effects(["joint-curve"])
    names = [name for number in joints for name in curve_names(number)]
    return robot.with_parameters(
        replace(
            robot.parameters[name],
            value=size * rng.normal() / (1 + n // 2),
            prior=float(rng.uniform(1e-6, 1e-4)),
            deviation=float(rng.uniform(1e-7, 1e-5)),
            informed=float(rng.uniform()),
        )
        for n, name in enumerate(names)
    )


@given(st.floats(-50.0, 50.0), st.integers(1, 200))
def test_waves_are_sines_and_cosines(angle: float, highest: int) -> None:
    waves = curve_waves(np.array([angle]), highest)[:, 0]
    k = np.arange(1, highest + 1)
    assert_allclose(waves[0::2], np.sin(k * angle), atol=1e-12 + 1e-16 * highest * abs(angle) * 8)
    assert_allclose(waves[1::2], np.cos(k * angle), atol=1e-12 + 1e-16 * highest * abs(angle) * 8)


def test_the_sum_is_that_of_parameters_times_shapes() -> None:
    robot, rng = curved(1), np.random.default_rng(2)
    effect = robot.effects[0]
    assert isinstance(effect, JointCurve)
    for count in (0, 1, 7, 5000):
        at = Postures(robot.random_configurations(count, rng))
        plain = LinearEffect.deflection(effect, at, robot.values)
        for joint, part in effect.deflection(at, robot.values).items():
            assert part.shape == (count,)
            assert_allclose(part, plain[joint], rtol=0, atol=1e-17 * 120 + 1e-15)
    trials = {name: value * rng.normal(size=(3, 1)) for name, value in robot.values.items()}
    moved = effect.deflection(at, trials)
    assert sorted(moved) == [0, 1, 4]
    for number in range(3):
        deflection = effect.deflection(at, {name: float(value[number, 0]) for name, value in trials.items()})
        for joint, part in moved.items():
            assert_allclose(part[number], deflection[joint], rtol=0, atol=1e-15)


def test_forward_of_inverse_is_the_pose() -> None:
    robot = curved(3, 1e-3).with_effects(["compliance"]).with_values({"compliance_2": 1e-5})
    q = robot.random_configurations(200, np.random.default_rng(4))
    p, R = robot.world_poses(q)
    assert np.abs(p - robot.rigid.world_poses(q)[0]).max() > 1e-4
    solution = inverse(robot, p, R, frame="world", seed=q)
    assert solution.complete
    assert np.abs(robot.world_poses(solution.joints)[0] - p).max() < 1e-9
    regular = solution.singular_value > 0.05
    assert regular.sum() > 90
    assert np.abs(solution.joints - q)[regular].max() < 1e-9


def test_a_file_holds_a_curve_in_a_few_lines(tmp_path: Path) -> None:
    robot = curved(5)
    coefficient = replace(robot.parameters["curve_sin7_5"], nominal=1e-6)
    for given_robot in (robot, robot.with_parameters([coefficient])):
        text = robot_text(given_robot)
        path = tmp_path / "robot.yaml"
        path.write_text(text)
        again = read_robot(path)
        assert again.known.keys() == given_robot.known.keys()
        for name, p in given_robot.known.items():
            for field in ("nominal", "value", "prior", "deviation"):
                assert getattr(again.known[name], field) == pytest.approx(getattr(p, field), rel=1e-15)
            assert again.known[name].informed == p.informed
        assert robot_text(again) == text
        assert text.count("\n") < robot_text(load_robot("irb120")).count("\n") + 30


def test_terms_that_are_known_differently_stand_one_by_one(tmp_path: Path) -> None:
    robot = curved(6, joints=(1,))
    robot = robot.with_parameters([replace(robot.parameters["curve_cos9_1"], deviation=None)])
    path = tmp_path / "robot.yaml"
    path.write_text(robot_text(robot))
    assert "joint_curves" not in path.read_text()
    assert read_robot(path).known["curve_cos9_1"].deviation is None


ENTRY = '\njoint_curves:\n  - {joint: 2, terms: "sin1 cos3", value: "0.01 0.02", prior: "0.1 0.1"}\n'


def small_file(change: Callable[[str], str]) -> str:
    text = robot_text(load_robot("irb120").with_effects(["joint-curve"]))
    return change(text + ENTRY)


def test_a_curve_may_be_written_by_hand(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(small_file(str))
    robot = read_robot(tmp_path / "robot.yaml")
    q = np.array([[0.0, 0.4, 0.0, 0.0, 0.0, 0.0]])
    expected = np.radians(0.01 * np.sin(0.4) + 0.02 * np.cos(1.2))
    assert robot.variables(q, robot.values)[1, 0] - 0.4 == pytest.approx(expected, rel=1e-12)
    assert_array_equal(robot.variables(q, robot.values)[[0, 2, 3, 4, 5], 0], 0.0)


SINGLE = "parameters: {curve_sin1_2: {unit: deg, nominal: 0, value: VALUE, prior: 1, informed: SHARE}}\n"


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("  - joint-curve\n", "  - gain\n", ["joint_curves[1]", "Add the joint effect joint-curve"]),
        ("joint: 2", "joint: 7", [".joint", "allowed: 1, 2, 3, 4, 5, 6"]),
        ("sin1 cos3", "sin1 cos61", [".terms", f"cos{HIGHEST}"]),
        ("sin1 cos3", "sin1 sin1", [".terms", "twice"]),
        ("0.01 0.02", "0.01", [".value", "one for each term"]),
        ("0.01 0.02", "0.01 nan", [".value"]),
        ("0.01 0.02", "0.01 x", [".value"]),
        ("0.1 0.1", "0.1 -0.1", [".prior", "0 or more"]),
        ("0.1 0.1", "0.1 0.0", [".prior"]),
        ("0.01 0.02", "0.01 -1000", [".value", "allowed: 30 deg or less"]),
        ("0.1 0.1", "0.1 31", [".prior", "too large for a curve"]),
        ('"0.1 0.1"', '"0.1 0.1", nominal: "99 0"', [".nominal", "got '99 deg'"]),
        ('"0.1 0.1"', '"0.1 0.1", informed: "0.5 2"', [".informed", "allowed: 0 to 1"]),
        ('"0.1 0.1"', '"0.1 0.1", informed: "-0.5 1"', [".informed", "got '-0.5'"]),
        (ENTRY, "\n" + SINGLE.replace("VALUE", "31"), ["curve_sin1_2.value", "too large for a curve"]),
        (ENTRY, "\n" + SINGLE.replace("SHARE", "2"), ["curve_sin1_2.informed", "too large"]),
        (ENTRY, ENTRY + SINGLE, ["the parameter stands in joint_curves too; got 'curve_sin1_2'"]),
    ],
)
def test_a_wrong_entry_is_refused(tmp_path: Path, old: str, new: str, told: list[str]) -> None:
    text = small_file(lambda text: text.replace(old, new)).replace("VALUE", "0").replace("SHARE", "0.9")
    (tmp_path / "robot.yaml").write_text(text)
    with refusing(*told):
        read_robot(tmp_path / "robot.yaml")


def test_a_term_may_stand_alone(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(
        small_file(lambda text: text.replace(ENTRY, "\n" + SINGLE.replace("VALUE", "0.1").replace("SHARE", "0.9")))
    )
    assert read_robot(tmp_path / "robot.yaml").parameters["curve_sin1_2"].informed == 0.9
