"""Every observation from everything it can be measured from: its value by 4x4 matrices, its Jacobian by differences."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation
from tests.expecting import refusing

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import OBSERVATIONS, compared
from truearm.engine.fit.problem import SETUP, Problem
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.truths import joint_truths
from truearm.engine.twin.twin import Twin

COUNT = 7
SIGMA = {"position": 2e-5, "orientation": 3e-4, "distance": 1e-6, "height": 5e-6}
#: What can be measured from what.
FROM = {
    "position": (None, "point", "frame"),
    "orientation": (None, "frame"),
    "distance": ("point", "frame"),
    "height": ("plane", "frame"),
}
COMBINATIONS = [(name, fixture) for name, fixtures in FROM.items() for fixture in fixtures]
EFFECTS = {
    "rigid": {},
    "effects": {
        "compliance_2": 4e-6, "compliance_3": 6e-6, "gain_1": 1.001, "fourier_sin1_4": 2e-4, "fourier_cos2_5": -1e-4,
        "bearing_compliance_2": 3e-6, "bearing_compliance_3": 2e-6,
    },
}  # fmt: skip


def robot_with(effects: str) -> Robot:
    """Return a robot that stands askew, with a point and a frame on its flange and every kind of fixture beside it."""
    rng = np.random.default_rng(1)
    askew = Transform((0.3, -0.2, 0.1), (0.8, 0.36, -0.48, 0.0))
    names = {"rigid": (), "effects": ("gain", "compliance", "fourier", "bearing-compliance")}[effects]
    robot = (
        load_robot("irb120")
        .with_effects(names)
        .with_frames(askew, {"ball": (0.02, 0.01, 0.12), "plate": Transform((0.0, 0.05, 0.1), (0.6, 0.0, 0.8, 0.0))})
        .with_fixtures(
            {
                "point": ("point", Transform((0.5, 0.1, 0.2))),
                "plane": ("plane", Transform((0.5, 0.1, -0.2), (0.6, 0.64, -0.48, 0.0))),
                "frame": ("frame", Transform((-0.4, 0.3, 0.2), (0.1, 0.7, -0.1, 0.7))),
                "other": ("point", Transform((0.1, -0.4, 0.3))),
            }
        )
    )
    off = {
        p.name: p.value + 2e-3 * float(rng.standard_normal())
        for p in robot.parameters.values()
        if p.group in ("base", "joint zero", "geometry", "target", "fixture")
    }
    return robot.with_values(off | EFFECTS[effects])


def truth(robot: Robot, joints: Array, target: str, fixture: str | None) -> Array:
    """Return the target's frame in the fixture's, ``(n, 4, 4)``, by the twin and an inverted matrix."""
    frames = Twin(robot, joint_truths(robot)).frames(joints)[target]
    if fixture is None:
        return frames
    kinematics, T = robot.fixture_kinematics(fixture), np.eye(4)
    T[:3, :3], T[:3, 3] = kinematics.matrix()[0], kinematics.position[:, 0]
    return np.asarray(np.linalg.inv(T) @ frames)


def readings_of(robot: Robot, combinations: list[tuple[str, str | None]], seed: int = 3) -> Dataset:
    """Return readings of both targets at seven configurations, each combination in rows of its own."""
    rng = np.random.default_rng(seed)
    joints = robot.random_configurations(COUNT, rng)
    fixtures = tuple(dict.fromkeys(fixture for _, fixture in combinations if fixture))
    rows: list[tuple[str, str | None, str]] = [(n, f, t) for n, f in combinations for t in ("ball", "plate")]
    size = len(rows) * COUNT
    of = {name: np.full((size, n), np.nan) for name, n in (("position", 3), ("quaternion", 4), ("length", 2))}
    for k, (name, fixture, target) in enumerate(rows):
        place, T = slice(k * COUNT, (k + 1) * COUNT), truth(robot, joints, target, fixture)
        if name == "position":
            of["position"][place] = T[:, :3, 3]
        elif name == "orientation" and target == "plate":
            of["quaternion"][place] = Rotation.from_matrix(T[:, :3, :3]).as_quat(scalar_first=True)
        elif name == "distance":
            of["length"][place, 0] = np.sqrt((T[:, :3, 3] ** 2).sum(axis=1))
        elif name == "height":
            of["length"][place, 1] = T[:, 2, 3]
    return Dataset(
        source="here",
        labels=tuple(map(str, range(1, COUNT + 1))),
        joints=joints,
        joint_kinds=tuple(joint.kind for joint in robot.joints),
        targets=("ball", "plate"),
        configuration=np.tile(np.arange(COUNT), len(rows)),
        target=np.repeat([("ball", "plate").index(t) for _, _, t in rows], COUNT),
        position=of["position"],
        quaternion=of["quaternion"] if np.isfinite(of["quaternion"]).any() else None,
        distance=of["length"][:, 0] if np.isfinite(of["length"][:, 0]).any() else None,
        height=of["length"][:, 1] if np.isfinite(of["length"][:, 1]).any() else None,
        fixtures=fixtures,
        fixture=np.repeat([fixtures.index(f) if f else -1 for _, f, _ in rows], COUNT) if fixtures else None,
    )  # fmt: skip


def problem_of(robot: Robot, data: Dataset) -> Problem:
    """Return the problem with everything free that can be."""
    return Problem(robot, data, FreeParameters(tuple(robot.parameters.values())), SIGMA, priors=False)


def away(problem: Problem, trials: int, seed: int = 5) -> Array:
    """Return vectors ``(trials, parameters)`` some way from the robot's own values."""
    free = problem.free
    size = np.array([1e-3 if p.unit in ("m", "rad") else 1e-1 * abs(p.value) + 1e-9 for p in free.parameters])
    return free.start + size * np.random.default_rng(seed).standard_normal((trials, len(size)))


def every_problem() -> Iterator[tuple[str, str | None, str, Problem]]:
    """Give the problem of each observation from each fixture, of a rigid arm and one with effects."""
    assert {o.name for o in OBSERVATIONS} == set(FROM)
    for effects in EFFECTS:
        robot = robot_with(effects)
        for name, fixture in COMBINATIONS:
            yield name, fixture, effects, problem_of(robot, readings_of(robot, [(name, fixture)]))


def test_predicts_what_the_twin_shows() -> None:
    for name, fixture, effects, problem in every_problem():
        assert {(block.observation.name, block.fixture) for block in problem.blocks} == {(name, fixture)}
        components = problem.blocks[0].observation.components
        assert problem.rows == (1 if name == "orientation" else 2) * COUNT * components
        # loads of the robot are found to 1e-9 rad; without effects everything is rounding
        small = 1e-13 if effects == "rigid" else 2e-9
        residual = problem.residual(problem.free.start) * SIGMA[name]
        assert np.abs(residual).max() < small, (name, fixture, effects)


def test_jacobian_by_central_differences() -> None:
    for name, fixture, effects, problem in every_problem():
        x = away(problem, 1)[0]
        free, sigma = problem.free, SIGMA[name]
        J = problem.linearised(x)[1] * sigma
        groups = {p.group for p, column in zip(free.parameters, J.T, strict=True) if column.any()}
        assert {"base", "joint zero", "geometry", "target"} <= groups
        assert ("fixture" in groups) == (fixture is not None)
        for i, p in enumerate(free.parameters):
            h = {"m": 1e-4, "rad": 1e-4, "1": 1e-4}.get(p.unit, 1e-7)
            e = h * (np.arange(len(x)) == i)
            # Richardson: the error of the plain difference is h^2, that of this h^4
            near = (problem.residual(x + e / 2) - problem.residual(x - e / 2)) / h
            far = (problem.residual(x + e) - problem.residual(x - e)) / (2 * h)
            difference, case = (4 * near - far) / 3 * sigma, f"{name} from {fixture}, {effects}: {p.name}"
            np.testing.assert_allclose(J[:, i], difference, rtol=2e-8, atol=2e-9 * max(1.0, 1e-5 / h), err_msg=case)


def with_setup(robot: Robot, data: Dataset) -> Dataset:
    """Add what is known of the fixtures: the place of one, and its distance from another."""
    fixtures = (*data.fixtures, "other")
    places = {name: robot.fixture_kinematics(name).position[:, 0] for name in ("point", "other", "frame")}
    apart = float(np.linalg.norm(places["other"] - places["frame"]))
    known = Dataset(
        source="here",
        labels=("",),
        joints=np.zeros((1, len(robot.joints))),
        joint_kinds=data.joint_kinds,
        targets=("point", "other"),
        configuration=np.zeros(2, dtype=np.intp),
        target=np.array([0, 1]),
        position=np.array([places["point"], [np.nan] * 3]),
        distance=np.array([np.nan, apart]),
        fixtures=fixtures,
        fixture=np.array([-1, fixtures.index("frame")]),
        sigma=np.array([1e-5, 1e-6]),
    )
    return replace(data, fixtures=fixtures, setup=known)


def test_many_trials_at_once_are_each_alone() -> None:
    kinds = ("", "base", "target", "fixture")
    for effects, chosen in (("effects", ""), *(("rigid", kind) for kind in kinds)):
        robot = robot_with(effects)
        data = with_setup(robot, readings_of(robot, COMBINATIONS))
        free = FreeParameters(tuple(p for p in robot.parameters.values() if chosen in ("", p.group)))
        problem = Problem(robot, data, free, SIGMA, priors=False)
        trials = away(problem, 4)
        together = problem.at(trials)
        residual, jacobian = together.residual, together.jacobian
        assert jacobian.shape == (4, problem.rows, len(free.names))
        for k, vector in enumerate(trials):
            alone = problem.at(vector)
            np.testing.assert_allclose(residual[k], alone.residual, rtol=1e-12, atol=1e-8, err_msg=chosen)
            np.testing.assert_allclose(jacobian[k], alone.jacobian, rtol=1e-10, atol=1e-6, err_msg=chosen)


def test_what_is_known_of_fixtures_is_rows_of_their_own() -> None:
    robot = robot_with("rigid")
    data = with_setup(robot, readings_of(robot, [("distance", "point"), ("position", "frame")]))
    problem = problem_of(robot, data)
    beside = [block for block in problem.blocks if problem.kind(block) == SETUP]
    assert [(b.observation.name, b.target, b.fixture, b.rows) for b in beside] == [
        ("position", "point", None, 3), ("distance", "other", "frame", 1)
    ]  # fmt: skip
    assert problem.blocks[-2:] == tuple(beside)
    assert np.abs(problem.residual(problem.free.start)[-4:]).max() < 1e-9
    x = away(problem, 1)[0]
    J = problem.linearised(x)[1]
    felt = np.abs(J[-4:]).max(axis=0) > 1e-9 * np.abs(J[-4:]).max()
    own = {name for name, is_felt in zip(problem.free.names, felt.tolist(), strict=True) if is_felt}
    assert own == {robot.fixture(f).parameter(a) for f in ("point", "other", "frame") for a in "xyz"}
    for i, name in enumerate(problem.free.names):
        e = 1e-4 * (np.arange(len(x)) == i)
        difference = (problem.residual(x + e) - problem.residual(x - e))[-4:] / 2e-4
        np.testing.assert_allclose(J[-4:, i], difference, rtol=1e-5, atol=1e-3, err_msg=name)


def test_readings_declare_their_own_deviations_and_the_setup_its_own() -> None:
    robot = robot_with("rigid")
    data = with_setup(robot, readings_of(robot, [("distance", "point"), ("orientation", "frame")]))
    data = replace(data, sigma=np.full(len(data.target), 7e-6))
    declared = {problem_of(robot, data).kind(b): (b.declared, set(b.sigma)) for b in problem_of(robot, data).blocks}
    assert declared["distance"] == (True, {7e-6})
    assert declared["orientation"] == (False, {SIGMA["orientation"]})
    assert {s for b in problem_of(robot, data).blocks if b.data is data.setup for s in b.sigma} == {1e-5, 1e-6}


def test_an_unknown_fixture_is_refused() -> None:
    robot = robot_with("rigid")
    problem = problem_of(robot.with_fixtures({}), readings_of(robot, [("distance", "point")]))
    with refusing("no fixture of this name; got 'point'"):
        problem.residual(problem.free.start)


def test_a_target_at_the_very_point_moves_no_distance_and_makes_no_fuss() -> None:
    """Where the distance is zero it has no direction; a solver may pass there and must get numbers."""
    robot = robot_with("rigid")
    data = readings_of(robot, [("distance", "point")])
    here = truth(robot, data.joints[:1], "ball", None)[0, :3, 3]
    there = robot.with_fixtures({"point": ("point", Transform(tuple(here.tolist())))})
    J = problem_of(there, data).linearised(problem_of(there, data).free.start)[1]
    assert np.isfinite(J).all()


def test_readings_that_are_missing_are_no_rows() -> None:
    robot = robot_with("rigid")
    data = readings_of(robot, COMBINATIONS)
    assert data.distance is not None
    assert data.height is not None
    data.position[::3] = np.nan
    data.distance[::2] = np.nan
    data.height[:] = np.nan
    counted = dict.fromkeys(FROM, 0)
    for _, _, observation, readings in compared(data):
        counted[observation.name] += len(readings)
    held = np.isfinite(data.position).all(axis=1).sum(), np.isfinite(data.distance).sum()
    assert (counted["position"], counted["distance"]) == held
    assert (counted["orientation"], counted["height"]) == (2 * COUNT, 0)
    assert problem_of(robot, data).rows == 3 * held[0] + held[1] + 3 * 2 * COUNT
