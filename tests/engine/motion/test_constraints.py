"""Constraints against the twin and closed forms, and what they refuse."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.expecting import refusing

from truearm.engine.motion.cell import segment_distance, smallest_clearance
from truearm.engine.motion.constraints import Constraints, allowed, read_constraints, refuse_clearance_of
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import STATION, truth_twin
from truearm.engine.twin.twin import Twin

HEAD = {"truearm": "truearm-constraints/1", "units": {"length": "mm", "angle": "deg"}}
COUNT = 60


@pytest.fixture(scope="module")
def twin() -> Twin:
    """An IRB 120 that an instrument at the origin sees from 2.6 m."""
    return truth_twin(load_robot("irb120"), "nominal", np.random.default_rng(0))


@pytest.fixture(scope="module")
def arm(twin: Twin) -> Robot:
    return twin.robot


@pytest.fixture(scope="module")
def postures(arm: Robot) -> Postures:
    return Postures(arm.random_configurations(COUNT, np.random.default_rng(1)))


def kept(arm: Robot, postures: Postures, **entries: object) -> dict[str, np.ndarray]:
    rules = Constraints.model_validate(HEAD | entries)
    return dict(allowed(arm, postures, rules, "rules.yaml", seen_from_the_origin=True))


def test_limits_of_the_robot_and_of_the_file(arm: Robot, postures: Postures) -> None:
    beyond = replace(postures, joints=postures.joints + np.deg2rad([100.0, 0, 0, 0, 0, 0]))
    plain = allowed(arm, beyond, None, "", seen_from_the_origin=True)
    assert list(plain) == ["limits"]
    assert np.array_equal(plain["limits"], np.rad2deg(beyond.joints[:, 0]) <= 165)
    narrow = kept(arm, postures, limits={2: [-30, 200]})["limits"]
    assert np.array_equal(narrow, np.rad2deg(postures.joints[:, 1]) >= -30)
    assert narrow.any()
    assert not narrow.all()


def test_the_sign_of_the_moment_is_the_twins(arm: Robot, twin: Twin, postures: Postures) -> None:
    loads = np.array([posture.loads[:, 5] for posture in twin.postures(postures.joints)])
    found = kept(arm, postures, moments={2: "positive", 3: "negative"})
    assert np.array_equal(found["moment_2"], loads[:, 1] > 0)
    assert np.array_equal(found["moment_3"], loads[:, 2] < 0)
    assert 0 < found["moment_2"].sum() < COUNT


def test_box_and_floor_in_the_base_frame(arm: Robot, twin: Twin, postures: Postures) -> None:
    world_base = np.eye(4)
    world_base[:3, :3], world_base[:3, 3] = arm.base.rotation, arm.base.translation
    from_world = np.linalg.inv(world_base)
    places = np.array(
        [
            [(from_world @ frame)[:3, 3] for frame in posture.targets.values()]
            for posture in twin.postures(postures.joints)
        ]
    )
    inside = ((places[..., 0] >= 0) & (places[..., 2] <= 0.5)).all(axis=1)
    assert np.array_equal(kept(arm, postures, box={"of": "targets", "x": [0, 9e3], "z": [-9e3, 500]})["box"], inside)
    floor = kept(arm, postures, floor=200)["floor"]
    assert not floor[(places[..., 2] < 0.2).any(axis=1)].any()
    assert floor.any()
    flange = kept(arm, postures, box={"of": "flange", "y": [0, 9e3]})["box"]
    nominal = load_robot("irb120")
    assert np.array_equal(flange, nominal.world_poses(postures)[0][:, 1] >= 0)


def test_targets_look_at_the_instrument(arm: Robot, twin: Twin, postures: Postures) -> None:
    frames = [posture.targets["2"] for posture in twin.postures(postures.joints)]  # turned as the flange is
    rule = {"within": 60, "targets": {"2": [0, 1, 1]}}
    angle = [
        np.degrees(np.arccos(frame[:3, :3] @ [0, 1, 1] / np.sqrt(2) @ -frame[:3, 3] / np.linalg.norm(frame[:3, 3])))
        for frame in frames
    ]
    found = kept(arm, postures, visibility=rule)["visibility_2"]
    assert np.array_equal(found, np.array(angle) <= 60)
    assert 0 < found.sum() < COUNT
    base = arm.base
    place = 1e3 * -base.rotation.T @ np.array(base.translation)
    again = kept(arm, postures, visibility=rule | {"instrument": place.tolist()})["visibility_2"]
    assert np.array_equal(found, again)
    assert np.linalg.norm(place) == pytest.approx(1e3 * np.linalg.norm(STATION.translation))


def test_clearance_of_a_folded_arm() -> None:
    """An UR5 whose forearm, 392.25 mm long, is folded back to within 5 deg of the upper arm."""
    joints = np.zeros((2, 6))
    joints[:, 1], joints[:, 2] = -np.pi / 2, np.deg2rad([0, 175])
    straight, folded = smallest_clearance(load_robot("ur5"), joints, 0.12)
    assert straight > 0.12
    assert folded == pytest.approx(0.39225 * np.sin(np.deg2rad(5)))


def test_a_clearance_that_says_nothing_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "pendulum.yaml"
    file.write_text("""\
truearm: truearm-robot/1
name: pendulum
units: {length: mm, angle: deg}
convention: standard-dh
joints:
  - {name: a, theta_offset: 0, d: 100, a: 0, alpha: 90}
  - {name: b, theta_offset: 0, d: 0, a: 400, alpha: 0}
""")
    for name, clearance, words in (
        ("irb120", 1e9, ["links that can meet would count as neighbours", "up to 340 mm for irb120"]),
        ("irb120", 345, ["up to 340 mm"]),
        ("irb120", 0.06, ["1 mm or more", "Check its unit"]),
        (file, 60, ["no two links between which a clearance could be kept"]),
    ):
        rules = Constraints.model_validate(HEAD | {"clearance": clearance})
        with refusing("rules.yaml, clearance", *words, of=clearance):
            refuse_clearance_of(load_robot(name), rules, "rules.yaml")


def test_distances_of_links_by_brute_force() -> None:
    rng = np.random.default_rng(2)
    a, b, c, d = rng.normal(size=(4, 40, 3))
    d[:10] = c[:10] + (b - a)[:10]  # parallel ones
    s = np.linspace(0, 1, 201)
    first = a[:, None] + s[:, None] * (b - a)[:, None]
    second = c[:, None] + s[:, None] * (d - c)[:, None]
    brute = np.linalg.norm(first[:, :, None] - second[:, None], axis=3).min(axis=(1, 2))
    apart = segment_distance(a.T, b.T, c.T, d.T)
    assert apart == pytest.approx(brute, abs=0.02)
    assert (apart <= brute + 1e-12).all()


def test_what_does_not_fit_the_robot_is_refused(arm: Robot, postures: Postures) -> None:
    for entries, words in (
        ({"limits": {7: [0, 1]}}, ["no such joint", "1 to 6"]),
        ({"limits": {2: [10, 0]}}, ["the range is empty"]),
        ({"moments": {9: "positive"}}, ["no such joint"]),
        ({"box": {"of": "flange", "x": [1, 0]}}, ["the range is empty"]),
        ({"visibility": {"within": 30, "targets": {"4": [0, 0, 1]}}}, ["no target of this name"]),
    ):
        with refusing(*words, of=entries):
            kept(arm, postures, **entries)
    with refusing("no masses"):
        kept(load_robot("kr5"), postures, moments={2: "positive"})
    with refusing("the box is for targets, and the robot has none"):
        kept(arm.with_frames(arm.base, {}), postures, box={"of": "targets"})
    rules = Constraints.model_validate(HEAD | {"visibility": {"within": 30, "targets": {"1": [0, 0, 1]}}})
    with refusing("the position of the instrument is not known"):
        allowed(arm, postures, rules, "rules.yaml", seen_from_the_origin=False)


def test_entries_that_are_not_known_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "rules.yaml"
    for text, words in (
        ("flor: 3", ["not known", "floor"]),
        ("moments: {2: up}", ["moments"]),
        ("box: {of: flange, w: [0, 1]}", ["not known"]),
        ("visibility: {within: 30, targets: {}}", ["targets"]),
        ("visibility: {within: 30, targets: {'1': [0, 0, 0]}}", ["direction cannot be zero"]),
        ("clearance: -1", ["clearance"]),
        ("limits: {2: [0, .nan]}", ["limits"]),
        ("keep_out: {'': {x: [0, 1]}}", ["keep_out", "a name belongs here"]),
        ('keep_out: {"a\\nMoveAbsJ": {x: [0, 1]}}', ["keep_out", "without control characters"]),
    ):
        file.write_text(f"truearm: truearm-constraints/1\nunits: {{length: mm, angle: deg}}\n{text}\n")
        with refusing(*words, of=text):
            read_constraints(file)
