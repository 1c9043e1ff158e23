"""Readings and times with few decimals: no outlying rows, no unusual samples, and figures that stand or are marked."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.iso9283.known_motions import PLAN, cornering, evaluation_of, notices_of
from tests.moving_tip import ALONG, CENTRE, HERE, along, duration_of, plan_of, ramp, samples_of, the, times

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.corners import corner_values
from truearm.iso9283.criteria.rows import Instrument
from truearm.iso9283.criteria.runs import outlying_steps, refuse_outlying
from truearm.iso9283.criteria.settling import settling_values
from truearm.iso9283.criteria.streams import clock_of
from truearm.iso9283.criteria.velocity import velocity_values
from truearm.iso9283.evaluating.data_notices import rounding_notices
from truearm.iso9283.evaluating.doubts import unusual_samples
from truearm.iso9283.evaluating.reading import read_attained_poses
from truearm.iso9283.evaluating.samples import read_settling_samples
from truearm.iso9283.planning.criteria import Way
from truearm.iso9283.planning.records import Samples, resolution_of

FAST = plan_of(velocity=1.0)
LENGTH = Way(FAST.paths["line"]).length


# -- the clock -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rate", "resolution", "lost"), [(120, 1e-3, 0.0), (240, 1e-3, 0.05), (333, 1e-3, 0.02), (60, 1e-2, 0.0)]
)
def test_rounded_times_of_an_even_clock_are_found_again(rate: int, resolution: float, lost: float) -> None:
    rng = np.random.default_rng(3)
    true = times(3.0, rate, rng, lost) + 12.3456
    clock = clock_of(np.round(true / resolution) * resolution)
    assert clock.even
    assert clock.sigma == 0.0
    assert np.abs(np.diff(clock.time) - np.diff(true)).max() < 0.02 * resolution


def test_times_that_are_not_rounded_or_not_even_stay_as_they_are() -> None:
    rng = np.random.default_rng(4)
    true = np.arange(400.0) / 240.0
    uneven: Array = np.round(np.sort(true + rng.normal(0.0, 1e-3, 400)), 3).astype(np.float64)
    fine, thousand = np.round(true, 6), np.arange(400.0) / 1000.0
    cases: list[tuple[Array, float]] = [(true, 0.0), (fine, 0.0), (thousand, 0.0), (uneven, 1e-3 / 12**0.5)]
    for time, sigma in cases:
        clock = clock_of(time)
        assert (clock.time == time).all()
        assert clock.sigma == pytest.approx(sigma)


def on_the_line(rate: float, resolution: float, jitter: float = 0.0) -> Samples:
    rng = np.random.default_rng(5)
    rows = []
    for k in range(1, 11):
        t = times(duration_of(LENGTH, 1.0, 8.0), rate) + rng.random() / rate
        x = along(FAST, "line", ramp(t, LENGTH, 1.0, 8.0)) + rng.normal(0.0, 1e-5, (len(t), 3))
        stamp = np.sort(t + rng.normal(0.0, jitter, len(t)))
        rows.append((k, np.round(stamp / resolution) * resolution if resolution else t, x))
    return samples_of("AV", "line", rows)


@pytest.mark.parametrize(("rate", "resolution"), [(120.0, 1e-3), (240.0, 1e-3), (300.0, 1e-3), (60.0, 1e-2)])
def test_velocity_from_rounded_times_is_that_from_exact_ones(rate: float, resolution: float) -> None:
    exact, _ = velocity_values(FAST, on_the_line(rate, 0.0), HERE, Instrument(1e-5))
    rounded, curves = velocity_values(FAST, on_the_line(rate, resolution), HERE, Instrument(1e-5))
    assert the(rounded, "FV").value == pytest.approx(the(exact, "FV").value, rel=0.35, abs=1e-3)
    assert the(rounded, "AV").value == pytest.approx(the(exact, "AV").value, abs=2e-3)
    (notice,) = rounding_notices(evaluation_of(velocities=tuple(curves)), Instrument(1e-5))
    assert (notice.code, notice.level) == ("times-rounded", "note")
    assert "AV on line" in notice.message
    assert "on an even clock" in notice.message


def test_velocity_from_rounded_times_of_an_uneven_clock_is_marked() -> None:
    values, curves = velocity_values(FAST, on_the_line(240.0, 1e-3, 4e-4), HERE, Instrument(1e-5))
    assert the(values, "FV").status == the(values, "RV").status == "instrument-too-coarse"
    (notice,) = rounding_notices(evaluation_of(velocities=tuple(curves)), Instrument(1e-5))
    assert "no even clock fits" in notice.message


def test_times_with_enough_decimals_are_no_matter() -> None:
    _, curves = velocity_values(FAST, on_the_line(240.0, 1e-6), HERE, Instrument(1e-5))
    assert rounding_notices(evaluation_of(velocities=tuple(curves)), Instrument(1e-5)) == ()


def test_times_too_coarse_to_say_how_fast_the_tip_is_are_refused_as_such() -> None:
    rng = np.random.default_rng(6)
    t = times(1.0, 250.0, rng, 0.05)
    x = CENTRE + np.outer(0.5 * t, ALONG)
    x[100] += 0.5
    samples = samples_of("t", "P1", [(1, np.round(t, 2), x)])
    clock = clock_of(samples.time)
    steps = outlying_steps(clock.time, x, None)
    assert clock.is_coarse
    assert len(steps.before)
    with pytest.raises(InputError, match=r"rounded too coarsely.*more decimals"):
        refuse_outlying(samples, np.arange(len(t)), x, steps, 1, clock)


def test_times_that_are_the_same_by_rounding_are_not_called_written_twice(tmp_path: Path) -> None:
    file = tmp_path / "settling.csv"
    head = "criterion,pose,cycle,time [s],x [mm],y [mm],z [mm]"
    coarse = [f"{0.004 * k:.2f}" for k in range(100)]
    twice = [f"{0.004 * (k - (k > 50)):.3f}" for k in range(100)]
    for stamps, text in ((coarse, r"rounded so coarsely.*more decimals"), (twice, "written twice")):
        rows = [f"t,P1,1,{time},{k},0,0" for k, time in enumerate(stamps)]
        file.write_text("\n".join([head, *rows]) + "\n")
        with pytest.raises(InputError, match=text):
            read_settling_samples(file)


# -- the resolution of readings ------------------------------------------------------------------------


def test_the_step_of_rounded_numbers_is_found() -> None:
    rng = np.random.default_rng(7)
    one_group = np.zeros(60, dtype=np.intp)
    numbers = 350.0 + rng.normal(0.0, 0.02, (60, 3))
    assert resolution_of(numbers, one_group) == 0.0
    for step in (0.1, 0.01, 0.005, 0.0001):
        assert resolution_of(np.round(numbers / step) * step, one_group) == pytest.approx(step)
    assert resolution_of(np.tile([[350.0, 0.0, 350.0]], (60, 1)), one_group) == 0.0
    groups = np.arange(60) % 2
    assert resolution_of(np.column_stack([100.0 * groups, 200.0 * groups]), groups) == 0.0


def rounded_file(folder: Path, decimals: int, digits: int) -> Path:
    rng = np.random.default_rng(8)
    rows = []
    for cycle in range(1, 31):
        for k in range(1, 6):
            x = 100.0 * k + rng.normal(0.0, 0.003, 3)
            q = np.array([0.6, 0.0, 0.8, 0.0]) + rng.normal(0.0, 5e-5, 4)
            q /= np.linalg.norm(q)
            cells = [f"{v:.{decimals}f}" for v in x] + [f"{v:.{digits}f}" for v in q]
            rows.append(f"AP,P{k},{cycle},100,100,{','.join(cells)}")
    file = folder / "poses.csv"
    head = "criterion,pose,cycle,velocity [%],load [%],x [mm],y [mm],z [mm],qw,qx,qy,qz\n"
    file.write_text(head + "\n".join(rows) + "\n")
    return file


def test_files_know_to_what_their_readings_were_rounded(tmp_path: Path) -> None:
    read = read_attained_poses(rounded_file(tmp_path, 2, 4))
    assert (read.resolution, read.resolution_rot) == pytest.approx((1e-5, 1e-4))
    instrument = Instrument(1e-6, 1e-5)
    reading = instrument.reading(read.resolution, read.resolution_rot)
    assert reading.sigma == pytest.approx(1e-5 / np.sqrt(12))
    assert reading.sigma_rot == pytest.approx(2e-4 / np.sqrt(12))
    (notice,) = rounding_notices(evaluation_of(readings={"poses": reading}), instrument)
    assert (notice.code, notice.level) == ("readings-rounded", "note")
    assert "positions of poses to 0.01 mm" in notice.message
    assert "quaternions of poses to 0.0001 " in notice.message
    assert rounding_notices(evaluation_of(readings={"poses": reading}), Instrument(1e-5, 1e-4)) == ()


def resting(seed: int, step: float) -> Samples:
    rng = np.random.default_rng(seed)
    rows = []
    for k in (1, 2, 3):
        t = times(1.5, 1000.0) + rng.random() * 1e-3
        tau = np.maximum(t - 0.2, 0.0) / 0.02
        x = CENTRE + np.outer(-0.1 * (1.0 + tau + 0.5 * tau**2) * np.exp(-tau), [0.8, 0.5, -0.3])
        x += rng.normal(0.0, 1e-6, x.shape)
        rows.append((k, t, np.round(x / step) * step))
    return replace(samples_of("t", "P1", rows), resolution=step)


def test_the_last_digit_of_a_rounded_record_is_nothing_unusual() -> None:
    for seed in range(4):
        samples = resting(seed, 1e-5)
        _, curves = settling_values(PLAN, samples, HERE, Instrument(1e-5))
        readings = {"settling": Instrument(1e-5).reading(samples.resolution)}
        assert "unusual-samples" not in notices_of(settling=tuple(curves), readings=readings), seed


# -- a corner that is an arc ---------------------------------------------------------------------------


def test_arcs_round_corners_have_no_unusual_samples_and_a_spike_beside_them_has() -> None:
    for seed in range(6):
        samples = cornering(0.02, plan=FAST, rate=1000.0, sigma=5e-6, seed=seed, apart=0.37)
        _, corners = corner_values(FAST, samples, HERE, Instrument(5e-6))
        assert "unusual-samples" not in notices_of(corners=tuple(corners)), seed
    cycles = corners[0].run.cycles
    moved = [cycle.position.copy() for cycle in cycles]
    row = int(np.searchsorted(cycles[1].along, 0.1))
    moved[1][row] += 4e-4
    (unusual,) = unusual_samples([c.time for c in cycles], moved, [c.along for c in cycles])
    assert (unusual.cycle, unusual.sample) == (1, row)
