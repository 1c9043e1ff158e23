"""Arms that look alike are told apart by the lengths that readings determine; the right arm is never doubted."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from tests.lookalikes import PAIRS, campaign_of, sized

from truearm.calibration.calibrate import calibrate
from truearm.checking.check import check
from truearm.engine.base.errors import Notice
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import read_csv
from truearm.engine.diagnose.wrong_robot import Lengths, check_robot
from truearm.engine.fit.every_effect import identify_every_effect
from truearm.engine.fit.fit import identify
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.models import named_model
from truearm.engine.fit.rounds import Redundant
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure
from truearm.importing.files import read_matrices
from truearm.simulation.jobs import simulate

GEOMETRIC = named_model("geometric")
UR10, UR10E = load_robot("ur10"), load_robot("ur10e")


def doubts(robot: Robot, data: Dataset, model: str = "geometric", loss: Loss = "linear") -> list[Notice]:
    return check_robot(identify(robot, data, named_model(model), loss=loss), data)


@pytest.mark.parametrize(("real", "given"), PAIRS, ids=lambda robot: robot.name)
def test_arms_that_look_alike_are_told_apart(real: Robot, given: Robot) -> None:
    data = campaign_of(real, 40, 0)[1]
    (notice,) = doubts(given, data)
    assert (notice.code, notice.level) == ("wrong-robot", "error")
    assert notice.message.startswith(f"The readings are not of {given.name}, by its lengths: ")
    assert doubts(real, data) == []


def near(robot: Robot, rng: np.random.Generator) -> Robot:
    """Return a robot with joints that may move by 15 deg to either side of some posture."""
    ranges = [joint.range for joint in robot.joints]
    middle = [float(rng.uniform(0.7 * low + 0.3 * high, 0.3 * low + 0.7 * high)) for low, high in ranges]
    limits = [(m - 0.26, m + 0.26) for m in middle]
    return replace(robot, joints=tuple(replace(j, limits=pair) for j, pair in zip(robot.joints, limits, strict=True)))


def test_robots_as_good_as_their_priors_are_not_doubted() -> None:
    for name, seed in product(("irb120", "ur10", "kr5", "katana450", "li3"), range(5)):
        robot = load_robot(name)
        twin, data = campaign_of(robot, 30, seed, targets=3 if seed % 2 else 1)
        if seed > 2:
            rng = np.random.default_rng(seed)
            data = measure(twin, near(robot, rng).random_configurations(30, rng), 5e-5, rng)
        assert doubts(robot, data) == [], (name, seed)


def test_a_measured_irb_120_is_not_doubted(measured_data: Path) -> None:
    folder = measured_data / "irb120-faro"
    targets = {str(i): folder / f"target_{i}.txt" for i in (1, 2, 3)}
    data, _ = read_matrices(folder / "joints_commanded.txt", targets, {}, "deg", "mm")
    robot = load_robot("irb120")
    few = data.of_configurations(np.arange(0, data.configurations, 8))
    lengths = Lengths.of(identify(robot, few, GEOMETRIC), few)
    assert len(lengths.moved) == 8
    assert lengths.chi_squared < 2.0
    assert "wrong-robot" not in {notice.code for notice in check(robot, few).warnings}


def test_errors_that_readings_of_a_visit_share_are_no_other_robot(measured_data: Path) -> None:
    """The joints were read before the arm had settled; with every effect the noise of a reading is then tiny."""
    folder = measured_data / "irb120-faro"
    targets = {str(i): folder / f"target_{i}.txt" for i in (1, 2, 3)}
    data, _ = read_matrices(folder / "joints_read.txt", targets, {}, "deg", "mm")
    few = data.of_configurations(np.arange(0, data.configurations, 4))
    lengths = Lengths.of(identify_every_effect(load_robot("irb120"), few)[1], few)
    assert len(lengths.moved) == 8
    assert lengths.chi_squared < 2.0


def test_a_measured_ur5_is_not_doubted(measured_data: Path, tmp_path: Path) -> None:
    rows = np.genfromtxt(measured_data / "ur5-tracker" / "grid.csv", delimiter=",", skip_header=1)[::12]
    lines = ["configuration," + ",".join(f"joint_{i} [deg]" for i in range(1, 7)) + ",target,x [mm],y [mm],z [mm]"]
    for number, row in enumerate(rows, 1):
        reached = row[1:4] + row[4:7]
        lines.append(",".join([str(number), *map(repr, row[7:].tolist()), "1", *map(repr, reached.tolist())]))
    (tmp_path / "grid.csv").write_text("\n".join(lines) + "\n")
    data, robot = read_csv(tmp_path / "grid.csv"), load_robot("ur5")
    lengths = Lengths.of(identify(robot, data, GEOMETRIC), data)
    assert len(lengths.moved) >= 4
    assert lengths.chi_squared < 2.0
    assert "wrong-robot" not in {notice.code for notice in calibrate(robot, data, model="geometric").warnings}


def test_what_is_known_by_its_sum_is_judged_by_its_sum() -> None:
    data = campaign_of(UR10E, 40, 1)[1]
    fit = identify(UR10, data, GEOMETRIC)
    moved = {n: fit.robot.values[n] - fit.robot.parameters[n].nominal for n in ("d_2", "d_3", "d_4")}
    assert max(moved.values()) < 5e-3
    first, *_ = Lengths.of(fit, data).named()
    assert first == f"d_2 + d_3 + d_4 by {sum(moved.values()) * 1e3:+.3g} mm"


def test_the_way_it_was_fitted_does_not_matter() -> None:
    data, own = (campaign_of(robot, 40, 1)[1] for robot in (UR10E, UR10))
    ways: tuple[tuple[Redundant, Loss], ...] = (
        *(("prior", "linear"), ("prior", "cauchy"), ("prior", "l1"), ("drop", "linear"), ("drop", "huber")),
    )
    for redundancy, loss in ways:
        fit = identify(UR10, data, GEOMETRIC, redundancy=redundancy, loss=loss)
        assert Lengths.of(fit, data).named()[0].startswith("d_2 + d_3 + d_4 by +11."), (redundancy, loss)
        fit = identify(UR10, own, GEOMETRIC, redundancy=redundancy, loss=loss)
        assert check_robot(fit, own) == [], (redundancy, loss)


def test_angles_that_are_a_degree_off_do_not_pass_for_lengths() -> None:
    robot = load_robot("irb120")
    angles = [p for p in robot.parameters.values() if p.group in ("joint zero", "geometry") and p.unit == "rad"]
    badly_mastered = robot.with_parameters(replace(p, prior=10.0 * p.prior) for p in angles)
    for seed in range(3):
        twin = campaign_of(badly_mastered, 1, seed, targets=1)[0]
        rng = np.random.default_rng(seed)
        data = measure(twin, near(robot, rng).random_configurations(40, rng), 5e-5, rng)
        assert doubts(robot, data) == [], seed


def test_what_no_readings_or_wide_priors_tell_is_not_doubted() -> None:
    other = sized("ur10", "taller", d_1=180.7, d_6=116.55)  # the height of the base and the length of the flange
    assert doubts(UR10, campaign_of(other, 40, 0)[1]) == []
    rough = replace(UR10, priors={"m": 5e-3})
    assert doubts(rough, campaign_of(UR10E, 40, 0)[1]) == []
    data = campaign_of(UR10E, 20, 1)[1]
    lengths = Lengths.of(identify(UR10, data, named_model("offsets")), data)
    assert (lengths.chance, lengths.named()) == (1.0, [])  # a model without free lengths says nothing of them
    nominal = load_robot("irb120")
    rng = np.random.default_rng(3)
    data = measure(truth_twin(nominal, "tracker-triangular", rng), nominal.random_configurations(40, rng), 5e-5, rng)
    assert doubts(nominal, data, "geometric") == doubts(nominal, data, "elastic") == []
    data = campaign_of(UR10, 40, 2)[1]
    position = data.position.copy()  # outliers of a robust fit are left out of account
    position[::7] += np.random.default_rng(0).normal(0.0, 0.05, position[::7].shape)
    assert doubts(UR10, replace(data, position=position), loss="cauchy") == []


def test_readings_without_an_anchor_are_judged_too() -> None:
    ballbar = simulate(UR10E, truth="random", poses=32, device="ballbar", seed=2).data
    (notice,) = doubts(UR10, ballbar)
    assert "d_2 + d_3 + d_4 by +12." in notice.message
    assert doubts(UR10E, ballbar) == []


def test_a_fit_of_other_parameters_or_that_began_wrong_is_judged_by_the_table() -> None:
    run = calibrate(UR10, campaign_of(UR10E, 40, 1)[1], model="joints")
    assert [n.code for n in run.warnings if n.level == "error"] == ["wrong-robot"]
    data = campaign_of(UR10E, 60, 1)[1]
    first, second = (data.of_configurations(part) for part in np.split(np.arange(60), 2))
    once = calibrate(UR10, first)
    again = calibrate(once.robot, second)
    assert [n.code for n in again.warnings if n.level == "error"] == ["wrong-robot"]


def test_the_check_names_the_robot_where_a_entry_error_would_explain_it_too() -> None:
    for real, value in (("ur5", "ur10"), ("puma560", "irb120")):
        notices = check(value, campaign_of(load_robot(real), 30, 3)[1]).warnings
        assert [n.code for n in notices if n.level == "error"] == ["wrong-robot"]
        assert f"{real} of the library fits them" in notices[0].message


def test_a_entry_error_is_not_another_robot() -> None:
    data = campaign_of(UR10, 30, 3)[1]
    signs = np.array([1, 1, 1, -1, 1, 1])
    for spoilt in (replace(data, joints=data.joints * signs), replace(data, position=1e3 * data.position)):
        assert "wrong-robot" not in {notice.code for notice in check(UR10, spoilt).warnings}


def test_wrong_data_are_said_before_the_robot_is_doubted() -> None:
    data = campaign_of(UR10, 60, 4)[1]
    moved = replace(data, position=data.position + np.where(data.configuration >= 30, 0.03, 0.0)[:, None])
    errors = {notice.code for notice in calibrate(UR10, moved, model="geometric").warnings if notice.level == "error"}
    assert "instrument-moved" in errors
    assert "wrong-robot" not in errors


def test_one_factor_in_all_lengths_is_a_wrong_length_of_the_measurement() -> None:
    """Robots within their priors, read by an instrument that takes a millimetre for 0.985 mm, or for what it is."""
    robot = load_robot("irb120")
    codes: dict[float, list[str]] = {1.0: [], 1.015: []}
    for seed in range(6):
        rng = np.random.default_rng(seed)
        data = measure(truth_twin(robot, "random", rng), robot.random_configurations(30, rng), 5e-5, rng)
        for factor in codes:
            warnings = doubts(robot, replace(data, position=factor * data.position))
            assert all(n.level == "error" for n in warnings)
            codes[factor] += [n.code for n in warnings]
    assert codes[1.0] == []
    assert len(codes[1.015]) >= 5
    assert set(codes[1.015]) == {"lengths-scaled", "wrong-robot"}


def test_a_scale_that_is_known_is_known_of_lengths() -> None:
    """With a scale of 200 ppm a board 1 % too large still shows: it cannot be the instrument's."""
    robot = load_robot("irb120")
    rng = np.random.default_rng(0)
    data = measure(truth_twin(robot, "random", rng), robot.random_configurations(30, rng), 5e-5, rng)
    larger = replace(data, position=0.985 * data.position, scale_sigma=2e-4)
    assert {n.code for n in doubts(robot, larger)} & {"lengths-scaled", "wrong-robot"}
    assert doubts(robot, replace(data, scale_sigma=2e-4)) == []
