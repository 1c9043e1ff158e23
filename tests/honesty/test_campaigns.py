"""What careless hands do to a campaign is told, by a name that helps; the same campaign without it is not doubted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from tests.honesty.telling import Told, told, written
from tests.simulated import campaign

from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.chain import Array
from truearm.engine.twin.twin import Twin, measure

CONFIGURATIONS: Final = 24
HALF: Final = CONFIGURATIONS // 2
NOISE: Final = 2e-5

Change = Callable[[Dataset], Dataset]


@cache
def honest() -> tuple[Twin, Dataset]:
    """Return a robot, three targets on it, and what a tracker read of them."""
    return campaign("irb120", CONFIGURATIONS, NOISE, 3)


def as_it_is(data: Dataset) -> Dataset:
    return data


@dataclass(frozen=True)
class Lie:
    """Something that went wrong with a campaign.

    Attributes
    ----------
    change
        Does it to honest data.
    command
        The command that has to tell, ``check`` or ``calibrate``.
    code, level, words
        Of the notice.
    ends
        Exit code.
    twin
        What makes the honest data like it: a column that is right here and wrong there.
    """

    change: Change
    command: str
    code: str
    level: str
    words: str = ""
    ends: int = 0
    twin: Change = as_it_is


def with_positions(change: Callable[[Array, Dataset], Array]) -> Change:
    return lambda data: replace(data, position=change(data.position.copy(), data))


def with_joints(change: Callable[[Array], Array]) -> Change:
    return lambda data: replace(data, joints=change(data.joints.copy()), approach=None, number=None)


def with_sigma(sigma: float) -> Change:
    return lambda data: replace(data, sigma=np.full(len(data.target), sigma))


def with_temperature(value: float) -> Change:
    return lambda data: replace(data, temperature=value + np.linspace(0.0, 2.0, data.configurations))


def late(data: Dataset) -> Array:
    """Return which readings are of the second half, as a column of 0 and 1."""
    return np.asarray(data.configuration >= HALF, dtype=float)[:, None]


def of_one_target(factor: float) -> Change:
    return with_positions(lambda p, data: np.where((data.target == 1)[:, None], p * factor, p))


def pasted_readings(p: Array, data: Dataset) -> Array:
    """Copy the readings of five configurations over those of five others."""
    p[np.isin(data.configuration, range(10, 15))] = p[np.isin(data.configuration, range(5))]
    return p


def stuck(p: Array, data: Dataset) -> Array:
    """Repeat the readings of one configuration at the next five."""
    p[np.isin(data.configuration, range(10, 15))] = np.tile(p[data.configuration == 9], (5, 1))
    return p


def from_the_ground(q: Array) -> Array:
    """Count joint 3 from the ground, as pendants of FANUC do."""
    return np.asarray(q - q[:, 1:2] * np.eye(6)[2])


def exchanged(q: Array) -> Array:
    """Exchange the rows of two configurations, and of two others."""
    q[[4, 9, 16, 17]] = q[[9, 4, 17, 16]]
    return q


def shifted_in_part(q: Array) -> Array:
    q[10:16] = np.roll(q[10:16], 1, axis=0)
    return q


def pasted_joints(q: Array) -> Array:
    q[10:15] = q[:5]
    return q


def two_robots(data: Dataset) -> Dataset:
    """Return data whose second half is of another robot of that make."""
    other, _ = campaign("irb120", 2, NOISE, 4)
    theirs = measure(other, data.joints, NOISE, np.random.default_rng(1))
    return replace(data, position=np.where(late(data) > 0, theirs.position, data.position))


def names_exchanged(data: Dataset) -> Dataset:
    """Exchange the names of two targets in the second half."""
    mixed = np.where(late(data)[:, 0] > 0, np.array([1, 0, 2])[data.target], data.target)
    return replace(data, target=np.asarray(mixed, dtype=np.intp))


def names_exchanged_at(*configurations: int) -> Change:
    """Exchange the names of two targets at some configurations."""

    def change(data: Dataset) -> Dataset:
        there = np.isin(data.configuration, configurations)
        return replace(data, target=np.where(there, np.array([1, 0, 2])[data.target], data.target).astype(np.intp))

    return change


def renamed_in_half(name: str, other: str) -> Change:
    """Call the second target by a name, and by another one at every second configuration."""

    def change(data: Dataset) -> Dataset:
        target = np.where((data.target == 1) & (data.configuration % 2 == 1), 3, data.target)
        return replace(data, targets=(data.targets[0], name, data.targets[2], other), target=target)

    return change


def a_fifth_off(p: Array, data: Dataset) -> Array:
    """Put a fifth of the readings off by twenty deviations."""
    rng = np.random.default_rng(5)
    wrong = rng.random(len(p)) < 0.2
    far = rng.standard_normal((int(wrong.sum()), 3))
    p[wrong] += 20 * NOISE * far / np.linalg.norm(far, axis=1, keepdims=True)
    return p


def lagging(q: Array) -> Array:
    """Return joint positions of a moment before: two per cent of the way is still to go."""
    return np.concatenate([q[:1], q[1:] - 0.02 * np.diff(q, axis=0)])


def as_thousands(p: Array, _: Dataset) -> Array:
    """Return lengths whose decimal comma was dropped: 1234,5 mm became 12345."""
    return np.array([int(f"{v * 1e3:.3f}".replace(".", "").rstrip("0") or "0") * 1e-3 for v in p.flat]).reshape(p.shape)


RIGHT_SIGMA: Final = with_sigma(NOISE)


def without_sigma(data: Dataset) -> Dataset:
    return replace(data, sigma=None)


def one_after_the_other(*changes: Change) -> Change:
    def changed(data: Dataset) -> Dataset:
        for change in changes:
            data = change(data)
        return data

    return changed


def missing_by(deviation: float, *, each_target: bool = False) -> Change:
    """Read the robot with joints that miss by so much [deg] at every visit, each target on one of its own or not."""

    def change(data: Dataset) -> Dataset:
        rng = np.random.default_rng(2)
        position = data.position.copy()
        for visit in range(len(data.targets) if each_target else 1):
            missed = np.radians(deviation) * rng.standard_normal(data.joints.shape)
            read = measure(honest()[0], data.joints + missed, NOISE, rng).position
            mine = data.target == visit if each_target else np.ones(len(data.target), dtype=bool)
            position[mine] = read[mine]
        return replace(data, position=position)

    return change


def rounded(step: float) -> Change:
    """Write joint positions in such steps [deg]."""
    return with_joints(lambda q: np.radians(np.round(np.degrees(q) / step) * step))


def commanded(step: float) -> Change:
    """Read the robot at joint positions that were commanded in such steps [deg]."""

    def change(data: Dataset) -> Dataset:
        joints = np.radians(np.round(np.degrees(data.joints) / step) * step)
        return replace(measure(honest()[0], joints, NOISE, np.random.default_rng(3)), approach=None, number=None)

    return change


def not_numbered(data: Dataset) -> Dataset:
    return replace(data, labels=tuple(f"pose-{label}" for label in data.labels), number=None, approach=None)


def shuffled(data: Dataset) -> Dataset:
    return not_numbered(data.of_configurations(np.random.default_rng(4).permutation(data.configurations)))


def moved_by_a_millimetre(data: Dataset) -> Dataset:
    return replace(data, position=data.position + late(data) * [1e-3, 0.0, 0.0])


#: One object for all who are held against it, so that it is calibrated once.
SHUFFLED: Final = one_after_the_other(without_sigma, shuffled)


#: The lies of data, each under the name that a metrologist would give it.
LIES: Final[dict[str, Lie]] = {
    # units
    "millimetres-called-metres": Lie(
        with_positions(lambda p, _: p * 1e3), "calibrate", "implausible", "error", "unit-length", 3
    ),
    "one-target-in-inches": Lie(of_one_target(1 / 25.4), "check", "unit-length", "error", "Target 2", 3),
    "one-column-in-micrometres": Lie(
        with_positions(lambda p, _: p * [1.0, 1.0, 1e3]), "check", "unit-length", "error", "column z", 3
    ),
    "decimal-commas-dropped": Lie(with_positions(as_thousands), "check", "unit-length", "error", "decimal", 3),
    "degrees-called-radians": Lie(with_joints(np.degrees), "check", "unit-angle", "error", "", 3),
    "temperature-in-kelvin": Lie(
        with_temperature(294.0), "check", "temperature-unlikely", "warning", "kelvin", 0, with_temperature(21.0)
    ),
    # deviations
    "micrometres-called-millimetres-in-sigma": Lie(
        with_sigma(20e-3), "calibrate", "sigma-too-large", "error", "", 3, RIGHT_SIGMA
    ),
    "three-sigma-called-sigma": Lie(
        with_sigma(3 * NOISE), "calibrate", "sigma-too-large", "warning", "", 0, RIGHT_SIGMA
    ),
    "a-third-of-sigma": Lie(
        with_sigma(NOISE / 3), "calibrate", "residuals-exceed-sigma", "warning", "", 0, RIGHT_SIGMA
    ),
    "data-sheet-error-called-sigma": Lie(
        one_after_the_other(missing_by(0.005), with_sigma(3 * NOISE)),
        "calibrate",
        "sigma-too-large",
        "warning",
        "maximum permissible error",
        0,
        missing_by(0.005),
    ),
    # visits
    "targets-read-on-separate-visits": Lie(
        one_after_the_other(missing_by(0.01, each_target=True), without_sigma),
        "calibrate",
        "separate-visits",
        "warning",
        "`visit`",
        0,
        one_after_the_other(missing_by(0.01), without_sigma),
    ),
    # digits
    "joints-rounded-to-tenths": Lie(rounded(0.1), "check", "joints-rounded", "warning", r"0\.1 deg", 0, commanded(0.1)),
    "joints-rounded-to-degrees": Lie(
        one_after_the_other(rounded(1.0), without_sigma),
        "calibrate",
        "joints-rounded",
        "warning",
        "multiples of 1 deg",
        0,
        commanded(1.0),
    ),
    # axes and signs
    "left-handed-instrument": Lie(with_positions(lambda p, _: p * [1, -1, 1]), "check", "mirrored", "error", "", 3),
    "sign-of-joint-6": Lie(
        with_joints(lambda q: q * [1, 1, 1, 1, 1, -1]), "check", "joint-sign", "error", "joint 6", 3
    ),
    "joint-3-counted-from-joint-2": Lie(
        with_joints(lambda q: q + q[:, 1:2] * np.eye(6)[2]), "check", "joint-sign", "error", r"joint 3 - joint 2 ", 3
    ),
    "zero-of-joint-2-off-by-a-quarter": Lie(
        with_joints(lambda q: q + np.radians(90.0) * np.eye(6)[1]),
        "check",
        "joint-sign",
        "error",
        "joint 2 - 90 deg ",
        3,
    ),
    "zero-of-joint-4-off-by-a-half": Lie(
        with_joints(lambda q: q + np.radians(180.0) * np.eye(6)[3]), "check", "joint-sign", "error", "joint 4 - 180 ", 3
    ),
    "zero-of-joint-3-and-sign-of-joint-2": Lie(
        with_joints(lambda q: q * [1, -1, 1, 1, 1, 1] - np.radians(90.0) * np.eye(6)[2]),
        "check",
        "joint-sign",
        "error",
        r"with -joint 2 instead of joint 2 and joint 3 \+ 90 deg instead of joint 3",
        3,
    ),
    "joint-3-from-the-ground-and-a-target-in-metres": Lie(
        one_after_the_other(with_joints(from_the_ground), of_one_target(1e-3)),
        "check",
        "joint-sign",
        "error",
        r"joint 3 \+ joint 2 ",
        3,
    ),
    "a-target-in-metres-and-joint-3-from-the-ground": Lie(
        one_after_the_other(with_joints(from_the_ground), of_one_target(1e-3)),
        "check",
        "unit-length",
        "error",
        "Target 2: .* as if m were called mm",
        3,
    ),
    "three-zeros-off": Lie(
        with_joints(lambda q: q + np.radians([0.0, 90.0, 90.0, 0.0, 90.0, 0.0])),
        "check",
        "implausible",
        "error",
        "signs, zeros and targets",
        3,
    ),
    # names
    "half-of-the-rows-in-another-spelling": Lie(
        renamed_in_half("T2", "t-2"), "check", "target-misspelt", "error", "T2 and t-2", 3, as_it_is
    ),
    "half-of-the-rows-misspelt": Lie(
        renamed_in_half("reflector", "reflecter"), "check", "target-misspelt", "error", "same point", 3
    ),
    # rows
    "joints-shifted-by-a-row": Lie(
        with_joints(lambda q: np.roll(q, 1, axis=0)), "check", "rows-shifted", "error", "", 3
    ),
    "two-pairs-of-rows-exchanged": Lie(
        with_joints(exchanged),
        "check",
        "rows-shifted",
        "warning",
        r"5 \(those of 10\), .*: put the joint positions back",
    ),
    "two-pairs-of-rows-exchanged-and-used": Lie(
        one_after_the_other(without_sigma, with_joints(exchanged)),
        "calibrate",
        "rows-shifted",
        "error",
        "put .* back",
        3,
    ),
    "block-of-joints-shifted": Lie(
        with_joints(shifted_in_part), "check", "rows-shifted", "warning", r"11 \(those of 12\).*16 \(those of 11\)"
    ),
    "joints-sorted": Lie(with_joints(lambda q: q[np.argsort(q[:, 0])]), "check", "rows-unrelated", "error", "", 3),
    "joints-of-a-moment-before": Lie(with_joints(lagging), "calibrate", "joints-not-settled", "warning", "", 3),
    "block-of-readings-pasted": Lie(with_positions(pasted_readings), "check", "joints-mistaken", "warning", "11 "),
    "block-of-joints-pasted": Lie(with_joints(pasted_joints), "check", "joints-repeated", "warning", "11 "),
    "instrument-stuck": Lie(with_positions(stuck), "check", "duplicates", "warning", "11"),
    "a-fifth-of-the-readings-off": Lie(with_positions(a_fifth_off), "check", "outliers", "warning", "1[0-9]%"),
    # half-way
    "instrument-moved": Lie(
        with_positions(lambda p, data: p + late(data) * [2e-3, 0.0, 0.0]),
        "calibrate",
        "instrument-moved",
        "error",
        rf"\b{HALF + 1}\b",
        3,
    ),
    "instrument-moved-and-nothing-numbered": Lie(
        one_after_the_other(moved_by_a_millimetre, without_sigma, not_numbered),
        "calibrate",
        "instrument-moved",
        "warning",
        f"configuration pose-{HALF + 1} .* order of the file",
        0,
        one_after_the_other(without_sigma, not_numbered),
    ),
    "instrument-moved-and-rows-shuffled": Lie(
        one_after_the_other(moved_by_a_millimetre, without_sigma, shuffled),
        "calibrate",
        "large-residual",
        "warning",
        "instrument or a base that moved",
        0,
        SHUFFLED,
    ),
    "another-robot-and-no-sigma": Lie(
        one_after_the_other(two_robots, without_sigma, shuffled),
        "calibrate",
        "large-residual",
        "warning",
        "another robot",
        0,
        SHUFFLED,
    ),
    "probe-bent": Lie(
        with_positions(lambda p, data: p + late(data) * (data.target == 1)[:, None] * [0.0, 0.0, 3e-3]),
        "check",
        "outliers",
        "warning",
        "/2",
    ),
    "targets-exchanged": Lie(names_exchanged, "check", "implausible", "error", "targets", 3),
    "another-robot": Lie(two_robots, "calibrate", "residuals-exceed-sigma", "warning", "times"),
}


@cache
def said(command: str, data: Change, folder: Path) -> Told:
    file = written(folder, data(honest()[1]))
    out = () if command == "check" else ("--model=geometric", "--out", folder)
    return told(command, "irb120", file, *out)


@pytest.mark.parametrize("lie", LIES)
def test_it_is_told(lie: str, tmp_path: Path) -> None:
    case = LIES[lie]
    found = said(case.command, case.change, tmp_path)
    assert found.says(case.code, case.level, case.words), found
    assert found.code == case.ends, found


@pytest.mark.parametrize("lie", [lie for lie, case in LIES.items() if case.command == "calibrate"])
def test_the_default_tells_it_too(lie: str, tmp_path: Path) -> None:
    case = LIES[lie]
    found = told("calibrate", "irb120", written(tmp_path, case.change(honest()[1])), "--out", tmp_path)
    assert found.says(case.code, case.level, case.words), found


MENDED: Final = {
    "names-exchanged": (names_exchanged_at(4, 9, 17), "targets-swapped"),
    "rows-exchanged": (with_joints(exchanged), "rows-shifted"),
}


@pytest.mark.parametrize("lie", MENDED)
def test_what_can_be_put_right_is_not_to_be_measured_again(lie: str, tmp_path: Path) -> None:
    change, code = MENDED[lie]
    checked = said("check", change, tmp_path)
    assert [*checked.levels] == [code]
    (step,) = checked.summary["next"]
    assert (step["code"], code in step["message"]) == ("see-warning", True)
    calibrated = said("calibrate", change, tmp_path)
    (step,) = calibrated.summary["next"]
    assert (step["code"], code in step["message"]) == ("fix-data", True)
    if "implausible" in calibrated.levels:
        assert f"The cause is most likely what {code} says" in calibrated.messages["implausible"]


def test_beside_them_what_is_wrong_is_measured_again(tmp_path: Path) -> None:
    """A wrong sign in a row: what the exchanged rows gain is not promised of measuring that one again."""
    data = campaign("irb120", 40, NOISE, 3)[1]
    joints = data.joints.copy()
    joints[[23, 24]] = joints[[24, 23]]
    joints[16, 3] *= -1
    found = told("check", "irb120", written(tmp_path, replace(data, joints=joints)))
    put_right, again = found.summary["next"][:2]
    assert (put_right["code"], "rows-shifted" in put_right["message"]) == ("see-warning", True)
    assert (again["code"], again["gain_mm"]) == ("measure-again", None)
    assert again["message"].endswith("the sign of joint 4 of configuration 17 looks wrong.")


def test_wrong_zeros_are_not_unrelated_rows(tmp_path: Path) -> None:
    found = said("check", LIES["three-zeros-off"].change, tmp_path)
    assert not {"rows-unrelated", "wrong-robot"} & found.levels.keys(), found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("honest")


@pytest.mark.parametrize("lie", LIES)
def test_the_honest_twin_is_not_doubted(lie: str, folder: Path) -> None:
    case = LIES[lie]
    found = said(case.command, case.twin, folder)
    assert case.code not in found.levels, found
    assert found.code == 0, found
