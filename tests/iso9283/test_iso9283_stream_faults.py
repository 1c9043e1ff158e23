"""Samples that cannot be right: where no tip can have been, in another unit of time, or as in no other cycle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.iso9283.known_motions import (
    LENGTH,
    PLAN,
    V,
    cornering,
    damped,
    notices_of,
    notices_of_paths,
    part,
    runs,
    to_rest,
)
from tests.moving_tip import CENTRE, EXACT, HERE, NORMAL, TRACKER, along, samples_of, stream_of, the, times

from truearm.engine.base.errors import InputError, Notice
from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.corners import corner_values
from truearm.iso9283.criteria.paths import path_values
from truearm.iso9283.criteria.rows import Instrument, copied_blocks
from truearm.iso9283.criteria.runs import runs_of
from truearm.iso9283.criteria.settling import settling_values
from truearm.iso9283.criteria.velocity import velocity_values
from truearm.iso9283.evaluating.doubts import unusual_samples
from truearm.iso9283.evaluating.evaluate import value_summary
from truearm.iso9283.evaluating.table import copied_notices
from truearm.iso9283.planning.criteria import Way
from truearm.iso9283.planning.records import Samples

DAMPING = 0.4


def resting(rate: float = 500.0, sigma: float = 5e-6) -> Samples:
    """Return three cycles that come to rest from 50 mm away."""
    t = times(2.0, rate)
    tau = 10 * np.maximum(t - 0.2, 0.0)
    return to_rest(0.05 * np.exp(-tau) * (1 + tau), t, sigma=sigma, seed=4)


def moved(samples: Samples, rows: list[int] | slice, by: float) -> Samples:
    position = samples.position.copy()
    position[rows] += by * NORMAL
    return replace(samples, position=position)


def refusal_of_path(samples: Samples) -> str:
    with pytest.raises(InputError) as caught:
        path_values(PLAN, samples, HERE, TRACKER)
    return str(caught.value)


def notices_of_settling(samples: Samples) -> dict[str, Notice]:
    return notices_of(settling=tuple(settling_values(PLAN, samples, HERE, Instrument(5e-6))[1]))


# -- where no tip can have been ------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [10.0, 25.0, 100.0, 1000.0])
def test_a_sample_where_no_tip_can_have_been_is_refused_by_its_line(rate: float) -> None:
    samples = runs(rate=rate)
    row = int(np.flatnonzero(samples.cycle == 3)[len(samples.time) // 10])
    text = refusal_of_path(moved(samples, [row], 0.8))
    assert f"paths.csv, line {row + 2}: cycle 3 of AT on line has samples where no tip can have been" in text
    assert "got '800" in text
    assert "Remove these lines: samples may be missing" in text
    fewer = part(samples, np.arange(len(samples.time)) != row)
    assert the(path_values(PLAN, fewer, HERE, TRACKER)[0], "AT").value < 0.1e-3


def test_outlying_samples_in_a_row_in_several_places_and_at_both_ends_are_named() -> None:
    samples = runs()
    last = int((samples.cycle == 1).sum()) - 1
    stream = replace(samples, cycle=0 * samples.cycle, time=samples.time + 10.0 * samples.cycle)
    for read, rows, words in (
        (samples, slice(50, 55), "lines 52 to 56: cycle 1"),
        (samples, [0], "line 2: cycle 1"),
        (samples, [last], f"line {last + 2}: cycle 1"),
        (samples, [30, 60, 90, 120, 150], "line 32, line 62, line 92 and 2 more such places"),
        (stream, [50], "line 52: the stream of AT on line"),
    ):
        assert words in refusal_of_path(moved(read, rows, 0.3))


def test_a_record_that_jumps_and_stays_or_is_outlying_all_over_is_refused() -> None:
    samples = runs()
    text = refusal_of_path(moved(samples, slice(60, int((samples.cycle == 1).sum())), 0.03))
    assert "lines 61 and 62: cycle 1 of AT on line jumps" in text
    assert "Check that times are in seconds." in text
    assert "measure the cycle again" in text
    rng = np.random.default_rng(0)
    off = 0.05 * rng.normal(size=samples.position.shape) * (rng.random(len(samples.time)) < 0.1)[:, None]
    assert "no tip can have been" in refusal_of_path(replace(samples, position=samples.position + off))


def test_an_outlying_sample_on_the_way_to_rest_is_refused() -> None:
    samples = resting()
    with pytest.raises(InputError, match=r"line 2802: cycle 3 of t at P1 has samples where no tip can have been"):
        settling_values(PLAN, moved(samples, [2800], 5e-3), HERE, EXACT)


# -- as in no other cycle ------------------------------------------------------------------------------


@pytest.mark.parametrize(("size", "rows"), [(2e-3, [310]), (0.4e-3, [310]), (1e-3, [310, 311])])
def test_a_sample_that_lies_apart_as_in_no_other_cycle_is_said(size: float, rows: list[int]) -> None:
    samples = runs()
    assert not notices_of_paths(samples)
    notice = notices_of_paths(moved(samples, rows, size))["unusual-samples"]
    assert notice.level == "warning"
    cycle = int(samples.cycle[rows[0]])
    assert any(
        f"line {row + 2} (cycle {cycle} of AT on line" in notice.message for row in (*rows, rows[0] - 1, rows[-1] + 1)
    )
    assert "remove these lines" in notice.message


def test_a_small_spike_at_rest_is_said() -> None:
    samples = resting()
    assert "unusual-samples" not in notices_of_settling(samples)
    notice = notices_of_settling(moved(samples, [2700], 0.1e-3))["unusual-samples"]
    assert "line 2702 (cycle 3 of t at P1" in notice.message


def test_many_unusual_samples_are_counted() -> None:
    message = notices_of_paths(moved(runs(), [30, 60, 250, 280, 310, 340], 2e-3))["unusual-samples"].message
    assert message.count("cycle 1 of") + message.count("cycle 2 of") == 5
    assert "and 1 more" in message


def test_what_all_cycles_have_is_not_unusual_nor_anything_of_two_cycles() -> None:
    assert not notices_of_paths(moved(runs(cycles=2), [60], 1e-3))
    samples = runs()
    everywhere = [60 + k * int((samples.cycle == 1).sum()) for k in range(5)]
    assert not notices_of_paths(moved(samples, everywhere, 2e-3))


def test_clean_streams_have_no_unusual_sample() -> None:
    for seed in range(8):
        rng = np.random.default_rng(seed)
        rate = (25.0, 50.0, 100.0, 250.0)[seed % 4]
        name = ("rectangle", "line", "large-circle")[seed % 3]
        wave = 2 * np.pi / Way(PLAN.paths[name]).length

        def aside(s: Array, wave: float = wave) -> Array:
            return np.outer(3e-4 * np.sin(wave * s), NORMAL)

        t, p, _ = stream_of(PLAN, name, rate, rng, cycles=5, offset=aside, velocity=V, sigma=(2e-5, 1e-4)[seed % 2])
        (run,) = runs_of(PLAN, samples_of("AT", name, [(0, t, p)]), HERE, "AT")
        cycles = run.cycles
        assert len(cycles) == 5, seed
        unusual = unusual_samples([c.time for c in cycles], [c.position for c in cycles], [c.along for c in cycles])
        assert not unusual, seed


# -- cycles as a whole ---------------------------------------------------------------------------------


def test_a_cycle_that_lies_apart_as_a_whole_is_said_with_what_is_without_it() -> None:
    samples = runs()
    notice = notices_of_paths(moved(samples, slice(0, int((samples.cycle == 1).sum())), 1e-3))["outlying-cycle"]
    assert notice.level == "warning"
    assert "cycle 1 of AT on line by 0.99" in notice.message
    assert "RT is 1.1" in notice.message
    assert "without it 0.0" in notice.message


def test_cycles_that_scatter_are_not_outlying() -> None:
    rng = np.random.default_rng(1)
    samples = runs(cycles=10, shape="small-circle")  # the shortest path
    for scale in (1e-5, 1e-3):
        for _ in range(20):
            off = scale * rng.standard_normal((11, 3))[samples.cycle]
            assert "outlying-cycle" not in notices_of_paths(replace(samples, position=samples.position + off)), scale


def test_samples_that_are_missing_on_a_part_of_the_way_are_said() -> None:
    samples = runs()
    rows = np.arange(len(samples.time))
    notice = notices_of_paths(part(samples, (rows < 100) | (rows >= 130)))["gap-in-path"]
    assert notice.level == "warning"
    assert "77.5 mm between lines 101 and 102 (cycle 1 of AT on line)" in notice.message
    lost = np.random.default_rng(0).random(len(rows)) < 0.2
    assert not notices_of_paths(part(samples, ~lost))


def test_two_runs_or_ways_to_rest_under_one_number_are_refused() -> None:
    samples = runs()
    t, p = samples.time[samples.cycle == 1], samples.position[samples.cycle == 1]
    second = samples.position[samples.cycle == 2]
    # the way back lies between the two
    position = np.concatenate([p, p[::-1] + 0.05 * NORMAL, second])
    text = refusal_of_path(samples_of("AT", "line", [(1, np.concatenate([t, t + 3.0, t + 6.0]), position)]))
    assert "cycle 1 of line runs the path 2 times" in text
    assert "Number the cycles, or leave the cells" in text
    at_rest = part(resting(), resting().cycle == 1)
    time = np.concatenate([at_rest.time, at_rest.time + 3.0])
    both = np.concatenate([at_rest.position, CENTRE + 0.5 * (at_rest.position - CENTRE)])
    with pytest.raises(InputError, match=r"about line \d+: the tip goes away again after it came to rest; got '2[45]"):
        settling_values(PLAN, samples_of("t", "P1", [(1, time, both)]), HERE, EXACT)


# -- coming to rest ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("power", "rate"), [(2, 1000.0), (2, 100.0), (3, 1000.0), (3, 250.0), (2.5, 500.0)])
def test_the_begin_of_a_motion_is_found_whatever_power_of_time_it_grows_with(power: float, rate: float) -> None:
    t = times(3.0, rate)
    tau = np.maximum(t - 0.3, 0.0)
    x = np.where(tau < 0.2, 0.05 * (tau / 0.2) ** power, 0.1 - 0.05 * np.exp(-(tau - 0.2) * power / 0.2))
    _, curves = settling_values(PLAN, to_rest(x, t, test="posing-time", place="D100"), HERE, EXACT)
    assert [curve.start for curve in curves] == pytest.approx([0.3] * 3, abs=1e-3)


def test_the_begin_of_a_gentle_motion_is_found_in_noise() -> None:
    t = times(3.0, 1000.0)
    tau = np.clip(t - 0.3, 0.0, 0.4)
    x = 0.05 * (tau / 0.2) ** 3 * (tau < 0.2) + (tau >= 0.2) * (0.1 - 0.05 * (2 - tau / 0.2) ** 3)
    samples = to_rest(x, t, test="posing-time", place="D100", sigma=1e-5, seed=5, cycles=6)
    _, curves = settling_values(PLAN, samples, HERE, Instrument(1e-5))
    assert np.mean([curve.start for curve in curves]) == pytest.approx(0.3, abs=5e-3)


def ringing(rate: float, sigma: float, *, amplitude: float = 5e-3) -> Samples:
    """Return cycles of a damped oscillation, each sampled at other times."""
    rng, rows = np.random.default_rng(2), []
    for k in (1, 2, 3):
        t = times(1.5, rate) + k / 3 / rate
        cycle = to_rest(damped(t - 0.1, amplitude, 8.0, DAMPING), t, cycles=1)
        rows.append((k, t, cycle.position + rng.normal(0.0, sigma, cycle.position.shape)))
    return samples_of("t", "P1", rows)


def test_noise_makes_an_overshoot_little_larger() -> None:
    true = 5e-3 * np.exp(-DAMPING * np.pi / np.sqrt(1 - DAMPING**2))
    values, curves = settling_values(PLAN, ringing(1000.0, 1e-5), HERE, Instrument(1e-5))
    assert the(values, "OV").value == pytest.approx(true, rel=0.01)
    assert the(values, "OV").value < max(curve.distance[curve.time > 0.16].max() for curve in curves)


@pytest.mark.parametrize(("rate", "status"), [(500.0, "measured"), (50.0, "instrument-too-coarse")])
def test_an_oscillation_with_fewer_than_eight_samples_a_period_is_marked(rate: float, status: str) -> None:
    values, curves = settling_values(PLAN, ringing(rate, 0.0), HERE, EXACT)
    assert {value.status for value in values} == {status}
    assert ("sampled-too-slowly" in notices_of(settling=tuple(curves))) == (status != "measured")


def test_an_excursion_that_noise_puts_in_the_band_or_outside_is_marked() -> None:
    # the second excursion ends within noise of the band
    peak = np.exp(-2 * np.pi * DAMPING / np.sqrt(1 - DAMPING**2))
    for sigma, status in ((0.0, "measured"), (5e-6, "instrument-too-coarse")):
        samples = ringing(250.0, sigma, amplitude=1.02 * PLAN.limit_band / peak)
        values, _ = settling_values(PLAN, samples, HERE, Instrument(sigma))
        assert the(values, "t").status == status


def test_a_path_at_a_third_of_the_velocity_is_said_and_a_small_circle_or_a_pause_is_not() -> None:
    samples = runs()
    notice = notices_of_paths(replace(samples, time=3 * samples.time))["slow-path"]
    assert notice.level == "warning"
    assert "AT on line at 83." in notice.message
    assert "of 250 mm/s" in notice.message
    circle = runs(shape="small-circle")
    assert not notices_of_paths(replace(circle, time=3 * circle.time))
    t = times(LENGTH / V + 4.0, 100.0)
    s = np.where(t < 0.5, V * t, np.where(t < 4.5, V * 0.5, V * (t - 4.0)))
    assert not notices_of_paths(samples_of("AT", "line", [(1, t, along(PLAN, "line", s))]))


# -- times of another unit -----------------------------------------------------------------------------


@pytest.mark.parametrize(("factor", "word"), [(1e3, "slower"), (1e-3, "faster"), (1e6, "slower"), (60.0, "slower")])
def test_times_of_another_unit_are_refused(factor: float, word: str) -> None:
    samples = runs()
    text = refusal_of_path(replace(samples, time=samples.time * factor))
    assert f"the path line was run much {word} than commanded" in text
    assert "allowed: 5 to 500 mm/s; commanded are 250. Name the unit of the times" in text
    at_rest = resting()
    word = {"slower": "more slowly", "faster": "faster"}[word]
    with pytest.raises(InputError, match=rf"the tip would move {word} than any robot's.*Write the times in seconds"):
        settling_values(PLAN, replace(at_rest, time=at_rest.time * factor * (10 if factor > 1 else 0.1)), HERE, EXACT)


def test_orientations_in_another_order_are_refused() -> None:
    samples = runs()
    rotation = np.broadcast_to(np.diag([1.0, -1.0, -1.0]), (len(samples.time), 3, 3))
    with pytest.raises(InputError, match=r"columns qw to qz: .*180.0 deg off"):
        path_values(PLAN, replace(samples, rotation=rotation), HERE, TRACKER)


def test_samples_that_two_cycles_share_are_named() -> None:
    samples = runs()
    assert copied_blocks(samples) == () == copied_blocks(replace(samples, position=np.round(samples.position, 5)))
    position = samples.position.copy()
    first, second = (np.flatnonzero(samples.cycle == cycle)[20:60] for cycle in (2, 4))
    position[second] = position[first]
    (block,) = copied_blocks(replace(samples, position=position))
    assert (block.test, block.place, block.cycles, block.count) == ("AT", "line", (2, 4), 40)
    assert block.lines == (int(samples.line[first[0]]), int(samples.line[second[0]]))
    (notice,) = copied_notices([block])
    assert (notice.code, notice.level) == ("copied-samples", "warning")
    assert f"cycles 2 and 4 of AT line, 40 samples from lines {block.lines[0]} and {block.lines[1]}." in notice.message
    assert copied_notices([]) == []
    position[second[9:]] = samples.position[second[9:]]
    assert copied_blocks(replace(samples, position=position)) == ()


@pytest.mark.parametrize(("rate", "status"), [(250.0, "measured"), (12.5, "instrument-too-coarse")])
def test_corners_between_samples_are_marked(rate: float, status: str) -> None:
    values, corners = corner_values(PLAN, cornering(0.01, rate=rate, apart=1 / 3), HERE, EXACT)
    assert {value.status for value in values} == {status}
    if status == "measured":
        assert the(values, "CR", where="rectangle E3").value == pytest.approx((np.sqrt(2) - 1) * 0.01, rel=0.03)
        assert "sampled-too-slowly" not in notices_of(corners=tuple(corners))
    else:
        notice = notices_of(corners=tuple(corners))["sampled-too-slowly"]
        assert (notice.level, "CR, CO" in notice.message) == ("warning", True)


def test_a_path_with_fewer_samples_than_half_of_the_stations_is_marked() -> None:
    samples = runs(rate=10.0)
    values, records = path_values(PLAN, samples, HERE, EXACT)
    assert {value.status for value in values} == {"instrument-too-coarse"}
    assert "AT, RT" in notices_of(deviations=tuple(records))["sampled-too-slowly"].message


def test_a_corner_of_a_path_that_lies_beside_is_said_with_its_own() -> None:
    samples = cornering(0.005, apart=1 / 3)
    values, corners = corner_values(PLAN, samples, HERE, EXACT)
    assert not notices_of(corners=tuple(corners))
    off = np.array([1e-3, 0.0, 0.0]) + 2e-3 * NORMAL
    _, corners = corner_values(PLAN, replace(samples, position=samples.position + off), HERE, EXACT)
    for corner in corners:
        assert corner.aside == pytest.approx(np.tile(off, (3, 1)), abs=1e-6)
        assert corner.own == pytest.approx(the(values, "CR", where=corner.where).value, rel=0.02)
    notice = notices_of(corners=tuple(corners))["corner-offset"]
    assert notice.level == "note"
    assert "lies 2.236 mm beside" in notice.message


# -- fluctuation of the velocity -----------------------------------------------------------------------


@pytest.mark.parametrize(("rate", "sigma"), [(1000.0, 0.0), (1000.0, 1e-5), (250.0, 2e-5)])
@pytest.mark.parametrize("turns", [5.0, 20.0, 40.0, 80.0])
def test_the_interval_of_the_fluctuation_holds_every_swing_up_to_its_bandwidth(
    turns: float, rate: float, sigma: float
) -> None:
    rng = np.random.default_rng(3)
    t, w = times(LENGTH / V * 1.1, rate), 2 * np.pi * turns
    s = V * t + 0.01 / w * (1 - np.cos(w * t))
    p = along(PLAN, "line", np.minimum(s, LENGTH))
    rows = [(k, t, p + rng.normal(0.0, sigma, p.shape)) for k in range(1, 11)]
    values, curves = velocity_values(PLAN, samples_of("AV", "line", rows), HERE, Instrument(sigma))
    value = the(values, "FV")
    assert value.interval is not None
    assert value.bandwidth is not None
    if turns <= value.bandwidth:
        assert value.interval[0] <= 0.02 <= value.interval[1]
        assert value.interval[1] < 0.03
    else:
        assert (value.bandwidth > 5.0) == (turns > 5.0)
    assert value_summary(value)["bandwidth_hz"] == value.bandwidth
    notice = notices_of(velocities=tuple(curves))["velocity-bandwidth"]
    assert notice.level == "note"
    assert f"up to {value.bandwidth:.2g} Hz" in notice.message


@pytest.mark.parametrize(("cycles", "has_interval"), [(4, False), (5, True)])
def test_paths_have_intervals_from_five_cycles_on(cycles: int, has_interval: bool) -> None:
    samples = runs(cycles=cycles)
    values = path_values(PLAN, samples, HERE, TRACKER)[0]
    moving = replace(samples, criterion=replace(samples.criterion, names=("AV",)))
    values += velocity_values(PLAN, moving, HERE, TRACKER)[0]
    for id_ in ("AT", "RT", "AV", "RV", "FV"):
        assert (the(values, id_).interval is not None) == has_interval
        assert np.isfinite(the(values, id_).value)
