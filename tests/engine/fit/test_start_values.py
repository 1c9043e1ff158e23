"""Where everything stands before anything is identified: from the nominal robot's own readings the very places."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tests.expecting import refusing

from papers.katana.tilting import twin as tilting_twin
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.fit import Status, identify
from truearm.engine.fit.models import FRAMES, MODELS
from truearm.engine.fit.problem import gauge_freedoms
from truearm.engine.fit.start_values import start_from_readings, unanchored
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.devices import DEVICES, named_device
from truearm.engine.twin.devices.device import measured_with, recorded
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin

NOMINAL = load_robot("irb120")
GEOMETRIC = {m.name: m for m in MODELS}["geometric"]
ASKEW = Transform((0.5, -0.4, 0.3), (0.5, 0.5, -0.5, 0.5))
#: What the device does not tell as it stands, because it is the world that is the robot's base.
LOOPS = (
    *("ballbar", "hexapod", "stereo", "five-lasers", "gauges", "plane", "sphere", "two-spheres", "point"),
    *("two-sockets", "calibration-table", "touch-up", "drawn-circle"),
)


@cache
def read_by(name: str, truth: str = "nominal", count: int = 40, sigma: float = 0.0) -> tuple[Twin, Dataset]:
    rng, device = np.random.default_rng(4), named_device(name)
    twin = truth_twin(NOMINAL, truth, rng)
    data = measured_with(device, NOMINAL, twin, count, rng, sigma)
    if device.tool is not None:
        twin = replace(twin, robot=twin.robot.with_frames(twin.robot.base, device.tool.targets))
    return twin, data


def place_of(robot: Robot, target: str) -> Array:
    return np.array([robot.values[robot.target(target).parameter(axis)] for axis in "xyz"])


@pytest.mark.parametrize("device", [d.name for d in DEVICES])
def test_readings_of_the_nominal_robot_give_its_own_places_and_name_what_is_taken_on_trust(device: str) -> None:
    twin, data = read_by(device)
    start = start_from_readings(NOMINAL, data)
    values, true = (np.array([place_of(robot, name) for name in data.targets]) for robot in (start, twin.robot))
    # the search for a touching tip keeps to 1 m a little, and more where lines are nearly flat about their middles
    np.testing.assert_allclose(values, true, atol=1e-4 if device == "drawn-circle" else 1e-6)
    if data.anchored:
        np.testing.assert_allclose(start.base.translation, twin.robot.base.translation, atol=1e-9)
        np.testing.assert_allclose(start.base.rotation, twin.robot.base.rotation, atol=1e-9)
    else:
        assert start.base == NOMINAL.base
    assert [f.name for f in start.fixtures] == list(data.fixtures)
    assert data.anchored == (device not in LOOPS)
    trusted = () if data.anchored else ("base", "size") if device in ("plane", "point") else ("base",)
    assert gauge_freedoms(data) == trusted


@pytest.mark.parametrize("device", ["ballbar", "five-lasers", "plane", "two-spheres", "point"])
def test_the_world_of_a_closed_loop_is_the_base_wherever_that_is(device: str) -> None:
    """The same readings, the base elsewhere: the fixtures go with it, targets and what is identified do not."""
    _, data = read_by(device, "random", sigma=1e-5)
    moved = NOMINAL.with_frames(ASKEW, {})
    at_origin, at_moved = (identify(robot, data, GEOMETRIC) for robot in (NOMINAL, moved))
    assert at_moved.robot.base.translation == ASKEW.translation
    assert not any(name.startswith("base_") for name in at_moved.free.names)
    for name in data.fixtures:
        if at_origin.robot.fixture(name).kind != "plane":
            before, after = (fit.robot.fixture_kinematics(name).position[:, 0] for fit in (at_origin, at_moved))
            np.testing.assert_allclose(ASKEW.rotation @ before + ASKEW.translation, after, atol=1e-8)
    values = {n: v for n, v in at_origin.robot.values.items() if not n.startswith(("base_", "fixture_"))}
    assert {n: at_moved.robot.values[n] for n in values} == pytest.approx(values, abs=1e-8)


def strings_of(data: Dataset, strings: tuple[int, ...]) -> Dataset:
    return data.of_readings(np.isin(data.against, strings))


def test_strings_from_one_plane_tell_on_which_side_the_robot_is() -> None:
    """Distances to points in a plane have two solutions; the robot itself says which, upright or hanging."""
    twin, _ = read_by("strings")
    at = twin.robot.base.translation
    for base in (Transform(at), Transform(at, (0.0, 1.0, 0.0, 0.0))):
        hung = twin.robot.with_frames(base, {"string": place_of(twin.robot, "string").tolist()})
        rng = np.random.default_rng(1)
        data = measured_with(named_device("strings"), NOMINAL, replace(twin, robot=hung), 30, rng, 0.0)
        for count in (3, 4):
            start = start_from_readings(NOMINAL, strings_of(data, tuple(range(count))))
            np.testing.assert_allclose(start.base.translation, base.translation, atol=1e-9, err_msg=f"{base}, {count}")
            np.testing.assert_allclose(start.base.rotation, base.rotation, atol=1e-9, err_msg=f"{base}, {count}")


def test_four_strings_that_are_not_in_a_plane() -> None:
    twin, data = read_by("strings")
    assert data.setup is not None
    anchors = data.setup.position.copy()
    anchors[0] += [0.1, 0.2, 0.9]
    tips = twin.frames(data.joints)["string"][:, :3, 3]
    length = np.linalg.norm(tips[data.configuration] - anchors[data.against], axis=1)
    data = replace(data, distance=length, setup=replace(data.setup, position=anchors))
    start = start_from_readings(NOMINAL, data)
    np.testing.assert_allclose(start.base.translation, twin.robot.base.translation, atol=1e-9)


def joined(first: Dataset, other: Dataset) -> Dataset:
    """Return the readings of two campaigns with one robot as one dataset without deviations."""

    def both(name: str, *width: int) -> Array | None:
        parts = [getattr(d, name) for d in (first, other)]
        if parts[0] is None and parts[1] is None:
            return None
        empty = [np.full((len(d.target), *width), np.nan) for d in (first, other)]
        return np.concatenate([e if p is None else p for p, e in zip(parts, empty, strict=True)])

    n = first.configurations
    against = [first.against, np.where(other.against < 0, -1, other.against + len(first.fixtures))]
    return Dataset(
        source="both",
        labels=tuple(map(str, range(n + other.configurations))),
        joints=np.concatenate([first.joints, other.joints]),
        joint_kinds=first.joint_kinds,
        targets=(*first.targets, *other.targets),
        configuration=np.concatenate([first.configuration, other.configuration + n]),
        target=np.concatenate([first.target, other.target + len(first.targets)]),
        position=np.concatenate([first.position, other.position]),
        quaternion=both("quaternion", 4),
        distance=both("distance"),
        height=both("height"),
        fixtures=(*first.fixtures, *other.fixtures),
        fixture=np.concatenate(against),
        setup=other.setup,
    )


def test_two_devices_with_targets_of_their_own_stand_in_one_world() -> None:
    for first, second in (
        ("tracker", "plane"),
        ("tracker", "five-lasers"),
        ("tracker", "point"),
        ("strings", "ballbar"),
        ("touch-up", "plane"),
        ("sphere", "five-lasers"),
    ):
        (twin, one), (other_twin, other) = read_by(first), read_by(second)
        data, case = joined(one, other), f"{first} and {second}"
        if one.setup is not None:
            data = replace(data, setup=replace(one.setup, fixtures=data.fixtures))
        start = start_from_readings(NOMINAL, data)
        for robot, names in ((twin.robot, one.targets), (other_twin.robot, other.targets)):
            for name in names:
                np.testing.assert_allclose(place_of(start, name), place_of(robot, name), atol=1e-6, err_msg=case)
        if one.anchored:
            base = twin.robot.base.translation
            np.testing.assert_allclose(start.base.translation, base, atol=1e-8, err_msg=case)
            assert "base_x" in unanchored(GEOMETRIC.free(start), data).names


def test_missing_readings_do_no_harm() -> None:
    for device, field in (("sphere", "distance"), ("plane", "height"), ("ballbar", "distance")):
        twin, data = read_by(device)
        lengths = getattr(data, field).copy()
        lengths[[3, 11]] = np.nan
        start = start_from_readings(NOMINAL, replace(data, **{field: lengths}))
        result, true = (place_of(robot, data.targets[0]) for robot in (start, twin.robot))
        np.testing.assert_allclose(result, true, atol=1e-6, err_msg=device)


def test_a_target_that_two_strings_hold_is_found_around_one_that_four_do() -> None:
    twin, data = read_by("strings")
    away = data.of_readings(data.against < 2)
    other = replace(away, targets=("ring",), setup=None)
    both = replace(joined(data, replace(other, fixtures=(), fixture=None)), setup=data.setup)
    both = replace(both, fixtures=data.fixtures, fixture=np.concatenate([data.against, other.against]))
    start = start_from_readings(NOMINAL, both)
    np.testing.assert_allclose(place_of(start, "string"), place_of(twin.robot, "string"), atol=1e-8)
    np.testing.assert_allclose(place_of(start, "ring"), place_of(twin.robot, "string"), atol=1e-6)


def test_the_known_place_of_a_frame_says_nothing_of_how_it_is_turned() -> None:
    twin, dataset = read_by("tracker")
    _, other = read_by("five-lasers")
    plain = start_from_readings(NOMINAL, joined(dataset, other))
    fixture = plain.fixture("place_2")
    x, y, z = plain.fixture_kinematics("place_2").position[:, 0].tolist()
    known = recorded(
        NOMINAL, "known", np.zeros((1, 6)), [0], ["place_2"], position=np.array([[x + 1e-4, y, z]]),
        fixtures=other.fixtures, sigma=1e-5,
    )  # fmt: skip
    start = start_from_readings(NOMINAL, replace(joined(dataset, other), setup=known))
    assert start.fixture("place_2").quaternion == pytest.approx(fixture.quaternion)
    assert start.values["fixture_place_2_x"] == x + 1e-4
    assert twin.robot.base.translation == pytest.approx(start.base.translation, abs=1e-9)


# -- what nobody measured ----------------------------------------------------------------------------------


def test_a_dial_that_moves_gives_the_size_of_all() -> None:
    _, data = read_by("plane")
    assert data.height is not None
    up = np.where(np.arange(len(data.height)) % 2, 0.01, 0.0)
    assert gauge_freedoms(replace(data, height=up)) == ("base",)


@pytest.mark.parametrize("still", [[5], [1, 2], [4, 5]])
@pytest.mark.parametrize("device", ["plane", "ballbar", "five-lasers"])
def test_a_closed_loop_names_what_joints_that_never_moved_leave_open(device: str, still: list[int]) -> None:
    _, data = read_by(device)
    robot = start_from_readings(NOMINAL, data)
    joints = NOMINAL.random_configurations(60, np.random.default_rng(0))
    joints[:, still] = 0.3
    frames = Twin(robot).frames(joints)[data.targets[0]]
    against = np.arange(60) % len(data.fixtures)
    seen = []
    for name in data.fixtures:
        kinematics, T = robot.fixture_kinematics(name), np.eye(4)
        T[:3, :3], T[:3, 3] = kinematics.matrix()[0], kinematics.position[:, 0]
        seen.append(np.linalg.inv(T) @ frames)
    at = np.array([seen[f][c, :3, 3] for c, f in enumerate(against.tolist())])
    readings = recorded(
        NOMINAL, "still", joints, range(60), data.targets * 60, fixtures=data.fixtures, fixture=against, sigma=1e-5,
        position=at if data.distance is None and data.height is None else None,
        distance=None if data.distance is None else np.linalg.norm(at, axis=1),
        height=None if data.height is None else at[:, 2],
    )  # fmt: skip
    fit = identify(NOMINAL, readings, GEOMETRIC)
    assert fit.status is Status.RANK_LOSS
    assert fit.unobservable
    assert not any(name.startswith(("base_", "fixture_")) for name in fit.unobservable)
    assert all(fit.parameter_status(name) == "not-determined" for name in fit.unobservable)


# -- refusals ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("device", LOOPS)
def test_postures_that_are_all_alike_or_too_few_are_refused(device: str) -> None:
    _, data = read_by(device, count=12)
    alike = replace(data, joints=np.tile(data.joints[:1], (12, 1)))
    with refusing("too few or too much alike; got '12 postures that determine ", of=device):
        start_from_readings(NOMINAL, alike)
    with pytest.raises(InputError, match=r"measured too few times|too few or too much alike"):
        start_from_readings(NOMINAL, data.of_configurations([0, 1]))


def test_strings_and_fixtures_that_say_too_little_are_refused() -> None:
    _, data = read_by("strings")
    with refusing("no target was measured from enough known points", "three known fixtures"):
        start_from_readings(NOMINAL, strings_of(data, (0, 1)))
    _, data = read_by("ballbar")
    with refusing("ballbar, fixture cup_2: a fixture was measured too few times", "0 readings"):
        start_from_readings(NOMINAL, data.of_readings(data.against != 1))
    few = data.against.copy()
    few[0] = len(data.fixtures)
    for name, offered in (
        ("cupp_1", True),
        ("cup_12", False),
        ("cup_x", False),
    ):  # two on purpose, or a data-entry error
        with pytest.raises(InputError, match="measured too few times") as refusal:
            start_from_readings(NOMINAL, replace(data, fixture=few, fixtures=(*data.fixtures, name)))
        assert ("Did you mean cup_1?" in str(refusal.value)) == offered, name


def test_planes_that_are_points_too_or_whose_place_is_known_are_refused() -> None:
    _, data = read_by("plane")
    assert data.height is not None
    height, distance = data.height.copy(), np.full(len(data.height), np.nan)
    distance[::2], height[::2] = 0.3, np.nan
    with refusing("fixture plate_level: the readings disagree", "got 'plane and point'"):
        start_from_readings(NOMINAL, replace(data, height=height, distance=distance))
    position = np.array([[0.3, 0.0, 0.1]])
    place = recorded(NOMINAL, "known", np.zeros((1, 6)), [0], ["plate_level"], position=position, sigma=1e-5)
    away = replace(place, targets=("peg",), fixtures=("plate_level",), fixture=np.array([0]))
    away = replace(away, position=np.full((1, 3), np.nan), distance=np.array([0.2]))
    for known in (place, away):
        with refusing("fixture plate_level: a plane has no place and no distance"):
            start_from_readings(NOMINAL, replace(data, setup=known))


def test_only_places_are_fitted_where_nothing_else_is_asked() -> None:
    twin, data = read_by("ballbar", "random")
    fit = identify(NOMINAL, data, FRAMES)
    assert {fit.robot.parameters[n].group for n in fit.free.names} == {"target", "fixture"}
    geometry = [p for p in fit.robot.parameters.values() if p.group in ("geometry", "joint zero")]
    assert all(p.value == NOMINAL.values[p.name] != twin.robot.values[p.name] for p in geometry)


@pytest.mark.parametrize("device", ["stereo", "plane"])
def test_readings_that_the_model_cannot_follow_do_not_overrule_the_priors(device: str) -> None:
    """The joints lean and have play, the model is rigid, and the readings claim micrometres."""
    arm = load_robot("katana450")
    twin = tilting_twin(arm)
    data = measured_with(named_device(device), arm, twin, 48, np.random.default_rng(3))
    fit = identify(arm.with_payload(twin.robot.payload), data, GEOMETRIC)
    moved = [abs(p.value - p.nominal) / p.prior for p in fit.robot.parameters.values() if p.group in GEOMETRIC.groups]
    assert max(moved) < 3.0  # believed to the letter, they moved lengths by more than ten
    if fit.excess < 5.0:  # errors of the joints may be all there is
        assert fit.joint_error.any()
        return
    residual = errors_of(fit.robot, data)
    lengths = np.zeros(0) if residual.length_errors is None else residual.length_errors
    off = np.concatenate([residual.position_errors.reshape(-1), lengths])
    assert fit.excess == pytest.approx(np.sqrt(np.nanmean(off**2)) / named_device(device).sigma, rel=0.4)
