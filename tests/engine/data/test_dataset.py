"""A dataset checks itself, is made from arrays, and gives parts of itself by index or mask."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from tests.expecting import refusing

from truearm import calibrate, check
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.thinning import repeated_joints
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform

NAN, INFINITY = float("nan"), float("inf")
N = 6


def joints(count: int = N) -> Array:
    return np.random.default_rng(1).uniform(-0.5, 0.5, (count, 6))


def positions(count: int = N, targets: int = 2) -> Array:
    return np.random.default_rng(2).uniform(0.2, 0.8, (count, targets, 3))


def off_nominal() -> Robot:
    robot = load_robot("irb120").with_frames(Transform(), {"1": (0.0, 0.05, 0.1)})
    return robot.with_values({"theta_offset_2": robot.values["theta_offset_2"] + 0.01})


def sound() -> Dataset:
    """Return a dataset in which every field is there and no two numbers are the same."""
    rng = np.random.default_rng(3)
    data = Dataset.of(
        joints(),
        positions(),
        targets=["ball", "cup"],
        sigma=rng.uniform(1e-5, 2e-5, (N, 2)),
        sigma_rot=1e-4,
        quaternions=np.broadcast_to([1.0, 0.0, 0.0, 0.0], (N, 2, 4)),
        order=range(1, N + 1),
        temperature=rng.uniform(20, 22, N),
    )
    beside = replace(data, targets=("p", "q"), quaternion=None, position=data.position + 1.0)
    return replace(
        data,
        distance=np.full(2 * N, NAN),
        height=rng.uniform(0, 1, 2 * N),
        fixtures=("plate",),
        fixture=np.zeros(2 * N, dtype=np.intp),
        wrench=rng.uniform(0, 1, (N, 6)),
        references=beside,
    )


# -- from arrays ------------------------------------------------------------------------------------------


def test_of_one_target() -> None:
    data = Dataset.of(joints().tolist(), positions()[:, 0].tolist())
    assert data.configurations == N
    assert data.labels == ("1", "2", "3", "4", "5", "6")
    assert data.targets == ("1",)
    assert data.joint_kinds == ("revolute",) * 6
    assert_array_equal(data.position, positions()[:, 0])
    assert_array_equal(data.configuration, np.arange(N))
    assert data.sigma is None
    assert data.number is None
    assert data.source == "arrays"


def test_of_several_targets() -> None:
    p = positions()
    p[1, 0, 2] = NAN
    sigma = np.arange(1.0, N + 1)
    data = Dataset.of(
        joints(), p, targets=("a", "b"), configurations=[10, 11, 12, 13, 14, 15], sigma=sigma, joint_kinds=None
    )
    assert data.labels == ("10", "11", "12", "13", "14", "15")
    assert data.targets == ("a", "b")
    assert_array_equal(data.position[[0, 1, 3]], p[[0, 0, 1], [0, 1, 1]])
    assert np.isnan(data.position[2]).all()
    assert data.has_reading.sum() == 2 * N - 1
    assert_array_equal(data.configuration, np.repeat(np.arange(N), 2))
    assert_array_equal(data.target, np.tile([0, 1], N))
    assert_array_equal(data.sigma, np.repeat(sigma, 2))
    assert_array_equal(Dataset.of(joints(), p, sigma=2e-5).sigma, np.full(2 * N, 2e-5))


def test_of_an_order_knows_the_last_moves() -> None:
    q, order = joints(), [2, 1, 3, 4, 5, 6]
    data = Dataset.of(q, positions(), order=order, temperature=21.0)
    assert_array_equal(data.number, [1, 0, 2, 3, 4, 5])
    assert data.approach is not None
    assert_array_equal(data.approach[1], np.zeros(6))
    assert_array_equal(data.approach[0], np.sign(q[0] - q[1]))
    assert_array_equal(data.approach[2], np.sign(q[2] - q[0]))
    assert_array_equal(data.temperature, np.full(N, 21.0))
    assert_array_equal(Dataset.of(q, positions(), order=np.array(order) - 1).number, data.number)


def test_arrays_that_do_not_fit_are_refused() -> None:
    wrong: dict[str, list[Any]] = {
        "joints": [np.full((N, 6), NAN), np.zeros(6), np.zeros((0, 6)), "q", 1e7 * np.ones((N, 6))],
        "positions": [
            *(positions()[:4], positions()[:, :, :2], positions()[:, 0, 0], np.full((N, 3), INFINITY)),
            *(np.zeros((N, 0, 3)), [[0.0] * 3, [0.0] * 2], None, 1e200 * positions()),
        ],
        "targets": [["a"], ["a", "a"], "ab", [None, "a"]],
        "configurations": [range(3), [1, 2, 3, 4, 5, 5], 6],
        "quaternions": [np.ones((N, 2, 4)), np.ones((N, 4))],
        "sigma": [0.0, -1e-5, NAN, np.ones(2), "0.02 mm", 1e-200, 2e3],
        "sigma_rot": [0.0, 11.0],
        "order": [[1, 2, 3, 4, 5, 5], [1, 2, 3, 4, 5, 6.5], [-1, 2, 3, 4, 5, 6], "rows", 1e200 * np.arange(N)],
        "temperature": [[20.0] * 5, NAN, 1e7],
        "joint_kinds": [["revolute"] * 5, ["revolut"] * 6, "revolute"],
        "visit": [[1, 2], [1.5] * N, [-1] * N, [NAN] * N],
    }
    given: dict[str, Any] = {"joints": joints(), "positions": positions(), "order": np.arange(N)}
    given |= {"sigma": np.ones(N), "temperature": np.ones(N)}
    for parameter in ("joints", "sigma", "temperature", "order"):  # where nothing may be missing
        wrong[parameter].append(np.ma.array(given[parameter], mask=given[parameter] == given[parameter].flat[0]))
    for parameter, values in wrong.items():
        for value in values:
            with refusing(parameter=parameter, of=f"{parameter} {value!r}"):
                Dataset.of(**given | {parameter: value})
    for parameter, value in (("joints", 1e7 * np.ones((N, 6))), ("sigma", 2e3), ("order", 1e200 * np.arange(N))):
        with refusing("plausible", of=parameter):  # they ended in LinAlgError and OverflowError far from here
            Dataset.of(**given | {parameter: value})


def test_masked_positions_and_quaternions_are_missing() -> None:
    p, turned = positions(), np.tile([1.0, 0.0, 0.0, 0.0], (N, 2, 1))
    hidden = np.zeros(p.shape, dtype=bool)
    hidden[1, 0, 2] = True
    masked: list[Any] = [
        np.ma.array(p, mask=hidden),
        [np.ma.array(row, mask=off) for row, off in zip(p, hidden, strict=True)],
    ]
    expected = np.where(hidden.any(axis=2, keepdims=True), NAN, p).reshape(-1, 3)
    for given in masked:
        assert_array_equal(Dataset.of(joints(), given).position, expected)
    whole = np.ma.array((1e3 * p).astype(int), mask=hidden)
    assert Dataset.of(joints(), whole).has_reading.sum() == 2 * N - 1
    quaternions = np.ma.array(turned, mask=turned < 2.0)
    assert not Dataset.of(joints(), p, quaternions=quaternions).has_orientation.any()
    assert_array_equal(Dataset.of(np.ma.array(joints()), p).joints, joints())


def test_a_dataset_keeps_its_own_arrays() -> None:
    given: dict[str, Any] = {
        "joints": joints(),
        "positions": positions(),
        "quaternions": np.tile([1.0, 0.0, 0.0, 0.0], (N, 2, 1)),
    }
    data, before = Dataset.of(**given), Dataset.of(**{name: values.copy() for name, values in given.items()})
    for values in given.values():
        values[:] = NAN
    same(data, before)


def test_names_that_no_file_can_hold_are_refused() -> None:
    q, p = joints(1), positions(1, 1)
    for name in ("", " ", "a\nb", "a\x00", "\ud800", "\u2028"):
        for parameter in ("targets", "configurations"):
            with refusing(parameter=parameter, of=ascii(name)):
                Dataset.of(q, p, **{parameter: [name]})  # type: ignore[arg-type]
        for field in ("targets", "labels", "fixtures"):
            if (field, name) != ("labels", ""):  # what is known of fixtures belongs to no configuration
                with refusing(parameter=field, of=ascii(name)):
                    replace(Dataset.of(q, p), **{field: (name,)})  # type: ignore[arg-type]
    assert Dataset.of(q, p, targets=["Kugel\u00a01 \u00fc"]).targets == ("Kugel\u00a01 \u00fc",)


def test_times_may_say_the_order() -> None:
    data = Dataset.of(joints(), positions(), order=1_700_000_000 + np.arange(N))
    assert data.number is not None
    assert_array_equal(np.diff(data.number), np.ones(N - 1))


# -- checks of its own ------------------------------------------------------------------------------------


def test_a_dataset_checks_itself() -> None:
    kinds = ("revolute",) * 5
    wrong: dict[str, list[Any]] = {
        "labels": [("1", "1", "2", "3", "4", "5"), None, "abcdef", [1, 2, 3, 4, 5, 6], (1, 2, 3, 4, 5, 6)],
        "joints": [np.full((N, 6), NAN), np.zeros((N, 5)), [[0.0] * 6] * N],
        "joint_kinds": [(*kinds, "sliding"), (*kinds, None), 5, None, ["revolute"] * 6],
        "targets": [("a", "a"), None, (1, 2)],
        "configuration": [np.full(2 * N, N), np.full(2 * N, -1), np.zeros(2 * N), None],
        "target": [np.full(2 * N, 2), np.array(0), None],
        "position": [
            *(np.zeros((2 * N, 2)), np.full((2 * N, 3), INFINITY), None, np.ma.array(np.zeros((2 * N, 3)))),
            np.full((2 * N, 3), 1e7),
        ],
        "quaternion": [np.zeros((2 * N, 4)), np.zeros((2 * N, 3))],
        "distance": [np.zeros(2), np.full(2 * N, 1e200)],
        "height": [np.full(2 * N, INFINITY)],
        "fixtures": [5],
        "fixture": [np.full(2 * N, 1), np.full(2 * N, -2)],
        "sigma": [np.zeros(2 * N), np.ones(N)],
        "sigma_rot": [np.full(2 * N, -1.0)],
        "approach": [np.zeros((N, 5)), np.full((N, 6), 7.0), np.full((N, 6), 0.5)],
        "number": [np.zeros(N + 1)],
        "temperature": [np.full(N, NAN)],
        "wrench": [np.full((N, 6), NAN)],
        "visit": [np.ones(3), np.full(2 * N, 1.5), np.full(2 * N, -1)],
        "references": [Dataset.of(joints(2), positions(2)), "p"],
        "setup": [5],
        "source": [None],
    }
    for field, values in wrong.items():
        data = replace(sound(), references=None) if field in ("labels", "joints") else sound()
        for value in values:
            with refusing(parameter=field, of=f"{field} {value!r}"):
                replace(data, **{field: value})
    with refusing(parameter="joints"):  # of which there are six
        replace(sound(), joint_kinds=kinds, references=None)


def test_wrong_arrays_are_refused_before_a_job_starts() -> None:
    """They ended in LinAlgError, ValueError or IndexError far from here."""
    data = Dataset.of(joints(40), positions(40))
    jobs: tuple[Callable[[Dataset], object], ...] = (lambda d: calibrate("irb120", d), check)
    for field, value in (("joints", data.joints * NAN), ("sigma", np.zeros(80)), ("position", np.zeros((80, 2)))):
        for job in jobs:
            with refusing(parameter=field):
                job(replace(data, **{field: value}))  # type: ignore[arg-type]


# -- parts ------------------------------------------------------------------------------------------------


def same(one: Dataset, other: Dataset) -> None:
    for field, value in vars(one).items():
        if isinstance(value, Dataset):
            same(value, getattr(other, field))
        else:
            assert_array_equal(value, getattr(other, field), err_msg=field)


def test_a_mask_of_configurations_chooses_where_it_is_true() -> None:
    data, mask = sound(), np.array([False, True, True, False, False, True])
    same(data.of_configurations(mask), data.of_configurations([1, 2, 5]))
    same(data.of_configurations(mask.tolist()), data.of_configurations(np.array([1, 2, 5])))
    assert data.of_configurations(mask).labels == ("2", "3", "6")


def test_configurations_come_in_the_order_asked_for() -> None:
    data = sound()
    part = data.of_configurations([4, 0])
    assert part.labels == ("5", "1")
    assert_array_equal(part.joints, data.joints[[4, 0]])
    assert_array_equal(part.configuration, [1, 1, 0, 0])
    assert_array_equal(part.position, data.position[[0, 1, 8, 9]])
    assert part.references is not None
    assert part.references.labels == part.labels


def test_repeated_configurations_are_configurations_of_their_own() -> None:
    data, chosen = sound(), [3, 1, 3, 3, 0]
    part = data.of_configurations(chosen)
    assert part.labels == ("4", "2", "4#2", "4#3", "1")
    assert len(part.target) == 2 * len(chosen)
    for field in ("joints", "approach", "number", "temperature", "wrench"):
        assert_array_equal(getattr(part, field), getattr(data, field)[chosen])
    for row, original in enumerate(chosen):
        here, there = part.configuration == row, data.configuration == original
        for field in ("target", "position", "quaternion", "height", "fixture", "sigma", "sigma_rot"):
            assert_array_equal(getattr(part, field)[here], getattr(data, field)[there], err_msg=field)
    assert part.references is not None
    assert_array_equal(part.references.position, part.position + 1.0)


def test_repeated_labels_stay_distinct() -> None:
    data = Dataset.of(joints(3), positions(3), configurations=["7", "7#2", "8"])
    assert data.of_configurations([0, 0, 1, 0]).labels == ("7", "7#3", "7#2", "7#4")
    again = data.of_configurations([0, 0]).of_configurations([1, 1, 0])
    assert again.labels == ("7#2", "7#2#2", "7")


def test_a_bootstrap_is_the_fit_with_weights() -> None:
    """Drawing a configuration twice is as good as declaring its readings better by the square root of two."""
    rng, true = np.random.default_rng(4), off_nominal()
    q = true.random_configurations(40, rng)
    position = true.forward(q, frame="world", target="1")[0] + rng.normal(0.0, 1e-5, (40, 3))
    drawn = np.array([*range(40), *range(0, 40, 2)])
    times = np.bincount(drawn, minlength=40)
    data = Dataset.of(q, position, sigma=1e-5)
    options: Any = {"train": "all", "model": "geometric"}
    twice, weighed, plain = (
        calibrate("irb120", part, **options).robot.forward(q, frame="world", target="1")[0]
        for part in (data.of_configurations(drawn), replace(data, sigma=1e-5 / np.sqrt(times)), data)
    )
    assert np.abs(twice - weighed).max() < 1e-11
    assert np.abs(twice - plain).max() > 1e-6


def test_copies_are_not_held_out_from_what_they_are_copies_of() -> None:
    rng, true = np.random.default_rng(4), off_nominal()
    q = true.random_configurations(40, rng)
    data = Dataset.of(q, true.forward(q, frame="world", target="1")[0] + rng.normal(0.0, 1e-5, (40, 3)))
    drawn = calibrate("irb120", data.of_configurations(rng.integers(0, 40, 40)), model="geometric")
    origins = np.array([label.partition("#")[0] for label in drawn.data.labels])
    assert len({*origins}) < 30
    assert not {*origins[drawn.training]} & {*origins[drawn.held_out]}


def test_a_bootstrap_is_not_told_to_remove_its_copies() -> None:
    data = Dataset.of(joints(3), positions(3)[[0, 1, 0]], configurations=["7", "8", "9"])
    assert "2 readings repeat" in repr(check(data))
    assert "1 at 7 and 9" in repr(check(data.of_configurations([0, 0, 2])))
    assert "7#2" not in repr(check(data.of_configurations([0, 0, 2])))
    assert "repeat" not in repr(check(data.of_configurations([1, 1, 1]).of_configurations([0, 2, 2])))


def test_a_check_of_nothing_is_refused() -> None:
    with refusing(parameter="data"):
        check(sound().of_configurations([]))
    with refusing(parameter="data"):
        check(load_robot("irb120"), Dataset.of(joints(), positions() * NAN))


def test_readings_by_mask_by_index_and_twice() -> None:
    data = sound()
    mask = data.target == 1
    same(data.of_readings(mask), data.of_readings(np.flatnonzero(mask)))
    twice = data.of_readings([3, 3, 0])
    assert twice.configurations == N
    assert_array_equal(twice.position, data.position[[3, 3, 0]])
    assert_array_equal(twice.configuration, [1, 1, 0])


def test_nothing_chosen_is_nothing() -> None:
    data = sound()
    nothing: tuple[Any, ...] = ([], np.zeros(0, dtype=np.intp), np.zeros(N, dtype=bool), range(0))
    for none in nothing:
        assert data.of_configurations(none).configurations == 0
        assert len(data.of_configurations(none).target) == 0


def test_what_chooses_nothing_that_is_there_is_refused() -> None:
    masked = np.ma.array([0, 1], mask=[False, True])
    wrong: list[Any] = [
        *([2 * N], [-1], [0.0, 1.0], [NAN], [True] * (N - 1), np.ones(2 * N + 1, dtype=bool), [[0, 1]], 3, "1"),
        *(None, ["1"], [True, 2], (2, False), np.array(0), masked),
    ]
    for chosen in wrong:
        for part in (sound().of_configurations, sound().of_readings):
            with refusing(parameter="chosen", of=repr(chosen)):
                part(chosen)
    with refusing(parameter="chosen"):
        sound().of_configurations([N])


# -- what it shows of itself ------------------------------------------------------------------------------


def test_a_dataset_is_short() -> None:
    assert repr(sound()) == (
        "arrays: 6 configurations of 6 joints\n"
        "2 targets: ball, cup\n"
        "readings: 12 positions, 12 orientations, 0 distances, 12 heights\n"
        "with: order of measurement, standard deviations, temperature, external forces, fixtures, reference points"
    )
    turned = Dataset.of(joints(), positions(), sigma_rot=1e-4)
    assert repr(turned).endswith("with: standard deviations")
    many = Dataset.of(joints(1), positions(1, 3000), targets=[f"<{i}>" for i in range(3000)])
    assert len(repr(many)) < 300
    assert repr(many).splitlines()[1] == "3000 targets: <0>, <1>, <2>, <3>, <4>, <5>, <6> and 2993 more"
    assert repr(many).splitlines()[3] == "with: nothing else"
    assert "&lt;0&gt;" in many._repr_html_()
    assert repr(Dataset.of(joints(1), positions(1, 1))).startswith("arrays: 1 configuration of 6 joints\n1 target: 1")


def test_visits_are_given_for_each_configuration_or_each_target() -> None:
    data = Dataset.of(joints(3), positions(3), visit=[1, 1, 2])
    np.testing.assert_array_equal(data.visit, [1, 1, 1, 1, 2, 2])
    several = Dataset.of(joints(2), np.zeros((2, 3, 3)), visit=[[1, 2, 3], [1, 1, 2]])
    np.testing.assert_array_equal(several.visit, [1, 2, 3, 1, 1, 2])
    assert "visits" in repr(several)


def test_joints_copied_many_times_are_found_without_comparing_every_pair(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    postures, visits, targets = 40, 25, 3
    posture = np.tile(np.arange(postures), visits)
    far = rng.random(len(posture)) < 0.1
    far[:postures] = False
    position = rng.normal(size=(postures, targets, 3))[posture] + 1e-5 * rng.normal(size=(len(posture), targets, 3))
    position[far, rng.integers(targets, size=len(posture))[far], 0] += 0.02
    rows = rng.permutation(len(posture) * targets)  # a table need not be sorted
    data = Dataset(
        source="many.csv",
        labels=tuple(f"{c}" for c in range(len(posture))),
        joints=rng.uniform(-1, 1, size=(postures, 6))[posture],
        joint_kinds=("revolute",) * 6,
        targets=("A", "B", "C"),
        configuration=np.repeat(np.arange(len(posture)), targets)[rows],
        target=np.tile(np.arange(targets), len(posture))[rows],
        position=position.reshape(-1, 3)[rows],
    )
    compared: list[int] = []
    norm = np.linalg.norm

    def counted(values: Array, axis: int) -> Array:
        compared.append(len(values))
        return np.asarray(norm(values, axis=axis))

    monkeypatch.setattr(np.linalg, "norm", counted)
    assert repeated_joints(data) == [(f"{posture[c]}", f"{c}") for c in np.flatnonzero(far)]
    assert sum(compared) == len(rows)
