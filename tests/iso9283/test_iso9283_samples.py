"""Path criteria and the way to rest against motions known in closed form, without noise and with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.iso9283.known_motions import LENGTH, PLAN, V, cornering, damped, to_rest
from tests.moving_tip import ACROSS, ALONG, EXACT, HERE, NORMAL, TRACKER, along, samples_of, stream_of, the, times

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import rotation_from_vector
from truearm.iso9283.criteria.corners import corner_values, weaving_values
from truearm.iso9283.criteria.paths import path_values
from truearm.iso9283.criteria.rows import Instrument
from truearm.iso9283.criteria.runs import in_base
from truearm.iso9283.criteria.settling import settling_values
from truearm.iso9283.criteria.streams import _apart, largest_top, top_of
from truearm.iso9283.criteria.velocity import velocity_values
from truearm.iso9283.planning.criteria import PerformancePlan, Way
from truearm.iso9283.planning.records import Samples

# -- path accuracy and repeatability -------------------------------------------------------------------


def offset_runs(name: str, offsets: Array, *, start: float = 0.0) -> Samples:
    """Return cycles of a path, each of them off by its own vector."""
    t = times(Way(PLAN.paths[name]).length / V * 1.02, 100.0)
    rows = [(k, t + start, along(PLAN, name, V * t) + off) for k, off in enumerate(offsets, 1)]
    return samples_of("AT", name, rows)


def test_a_path_off_by_a_vector_has_its_part_across_the_path_as_accuracy() -> None:
    tangent = Way(PLAN.paths["line"]).direction(np.array([0.1]))[0]
    vector = 0.3e-3 * NORMAL + 0.4e-3 * np.cross(NORMAL, tangent) + 0.7e-3 * tangent
    values, (record,) = path_values(PLAN, offset_runs("line", np.tile(vector, (10, 1))), HERE, EXACT)
    assert the(values, "AT").value == pytest.approx(0.5e-3, rel=1e-9)
    assert the(values, "AT").interval == pytest.approx((0.5e-3, 0.5e-3), rel=1e-6)
    assert the(values, "RT").value == pytest.approx(0.0, abs=1e-12)
    assert record.distance == pytest.approx(np.full(50, 0.5e-3), rel=1e-9)
    assert {value.status for value in values} == {"measured"}


def test_repeatability_is_the_mean_distance_and_three_standard_deviations() -> None:
    offsets = 1e-4 * np.random.default_rng(0).normal(size=(10, 1)) * NORMAL
    values, _ = path_values(PLAN, offset_runs("line", offsets), HERE, EXACT)
    away = np.linalg.norm(offsets - offsets.mean(axis=0), axis=1)
    assert the(values, "RT").value == pytest.approx(away.mean() + 3 * away.std(ddof=1), rel=1e-9)
    low, high = the(values, "RT").interval or (0.0, 0.0)
    assert low < the(values, "RT").value < high


def test_a_path_read_through_another_frame_in_another_order_is_the_same() -> None:
    rng = np.random.default_rng(1)
    samples = offset_runs("rectangle", 1e-4 * rng.normal(size=(6, 3)))
    turned = np.eye(4)
    turned[:3, :3], turned[:3, 3] = rotation_from_vector(np.array([[0.3, -1.0, 2.0]]))[0], (1.0, -2.0, 0.5)
    seen = replace(samples, position=in_base(np.asarray(np.linalg.inv(turned), float), samples.position))
    order = np.argsort(-samples.cycle, kind="stable")
    mixed = replace(samples, cycle=samples.cycle[order], time=samples.time[order], position=samples.position[order])
    plain = path_values(PLAN, samples, HERE, EXACT)[0]
    for values in (path_values(PLAN, seen, turned, EXACT)[0], path_values(PLAN, mixed, HERE, EXACT)[0]):
        for a, b in zip(plain, values, strict=True):
            assert a.value == pytest.approx(b.value, rel=1e-7)
            assert a.interval == pytest.approx(b.interval, rel=1e-6)
            assert a.status == b.status == "too-few-cycles"


def test_stations_that_a_path_shifted_along_itself_does_not_reach_are_left_out() -> None:
    t = times(Way(PLAN.paths["small-circle"]).length / V, 500.0)
    rng = np.random.default_rng(0)
    off = 3e-3 * ACROSS  # along the circle where it begins and ends
    rows = [(k, t, along(PLAN, "small-circle", V * t) + off + rng.normal(0, 1e-5, (len(t), 3))) for k in range(1, 11)]
    values, (record,) = path_values(PLAN, samples_of("AT", "small-circle", rows), HERE, TRACKER)
    assert the(values, "AT").value == pytest.approx(3e-3, rel=0.05)
    assert the(values, "RT").value < 0.1e-3
    assert len(record.along) < 50


def test_one_cycle_has_a_value_and_no_interval() -> None:
    values, _ = path_values(PLAN, offset_runs("line", np.array([1e-4 * NORMAL])), HERE, EXACT)
    assert (the(values, "AT").status, the(values, "AT").interval) == ("too-few-cycles", None)
    assert the(values, "RT").status == "not-measured"


def test_orientations_are_compared_with_those_that_alternate_along_the_line() -> None:
    way = Way(PLAN.paths["line"], reoriented=True)
    t = times(LENGTH / V * 1.02, 200.0)
    off = np.array([1e-3, -2e-3, 0.5e-3])
    p, R = along(PLAN, "line", V * t), rotation_from_vector(off[None])[0] @ way.rotation(V * t)
    rows = [(k, t, p) for k in range(1, 11)]
    samples = samples_of("AT-reorientation", "line", rows, [R] * 10)
    values, (record,) = path_values(PLAN, samples, HERE, EXACT, "AT-reorientation")
    assert record.angles is not None
    accuracies = [the(values, "AT-reorientation", angle).value for angle in "abc"]
    assert accuracies == pytest.approx(np.abs(off), rel=1e-3)
    with pytest.raises(InputError, match=r"line 2: the samples have no orientations"):
        path_values(PLAN, replace(samples, rotation=None), HERE, EXACT, "AT-reorientation")


def test_an_instrument_or_a_tie_that_is_too_uncertain_is_said() -> None:
    samples = offset_runs("line", np.tile(1e-4 * NORMAL, (10, 1)))
    assert the(path_values(PLAN, samples, HERE, Instrument(1e-3))[0], "AT").status == "instrument-too-coarse"
    tied = path_values(PLAN, samples, HERE, EXACT, tie=np.full(3, 5e-5))[0]
    assert the(tied, "AT").status == "instrument-too-coarse"
    low, high = the(tied, "AT").interval or (0.0, 0.0)
    assert low < 0.7e-4
    assert high > 1.8e-4


# -- streams and synchronisation -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "rate"),
    [("line", 25.0), ("rectangle", 100.0), ("large-circle", 25.0), ("small-circle", 50.0), ("rectangle", 1000.0)],
)
def test_cycles_dwells_and_the_deviation_are_found_in_a_stream(name: str, rate: float) -> None:
    rng = np.random.default_rng(5)
    length = Way(PLAN.paths[name]).length

    def aside(s: Array) -> Array:
        return np.outer(4e-4 * (0.6 + 0.4 * np.sin(2 * np.pi * s / length)), NORMAL)

    t, p, truth = stream_of(PLAN, name, rate, rng, cycles=10, offset=aside, velocity=V)
    values, (record,) = path_values(PLAN, samples_of("AT", name, [(0, t, p)]), HERE, TRACKER)
    stream = record.run.stream
    assert stream is not None
    motions = 20 if name == "line" else 10
    assert (len(stream.cycles), len(stream.motions), len(stream.dwells)) == (10, motions, motions + 1)
    ends = np.array([[t[first], t[last]] for first, last in stream.cycles])
    assert ends == pytest.approx(np.array(truth), abs=0.15)
    assert the(values, "AT").value == pytest.approx(4e-4, rel=0.05)
    for cycle in record.run.cycles:
        assert np.diff(cycle.along).min() > -1e-3  # noise and nothing else


def test_cycles_of_a_robot_that_is_far_off_are_found_on_a_small_circle() -> None:
    off = 4e-3 * ALONG + 3e-3 * NORMAL
    rng = np.random.default_rng(1)
    t, p, _ = stream_of(PLAN, "small-circle", 100.0, rng, cycles=10, offset=lambda s: off + 0 * s[:, None], velocity=V)
    values, (record,) = path_values(PLAN, samples_of("AT", "small-circle", [(0, t, p)]), HERE, TRACKER)
    assert len(record.run.cycles) == 10
    assert the(values, "AT").value == pytest.approx(5e-3, rel=0.02)


def test_a_pause_on_the_way_leaves_one_cycle() -> None:
    t = times(LENGTH / V + 1.0, 100.0)
    s = np.where(t < 0.5, V * t, np.where(t < 1.3, V * 0.5, V * (t - 0.8)))
    rows = [(0, t, along(PLAN, "line", s) + 1e-4 * NORMAL)]
    values, (record,) = path_values(PLAN, samples_of("AT", "line", rows), HERE, EXACT)
    assert len(record.run.cycles) == 1
    assert the(values, "AT").value == pytest.approx(1e-4, rel=1e-6)


def refused(samples: Samples, transform: Array = HERE, plan: PerformancePlan = PLAN) -> str:
    with pytest.raises(InputError) as caught:
        path_values(plan, samples, transform, EXACT)
    return str(caught.value)


def test_a_path_that_is_not_the_planned_one_is_refused() -> None:
    samples = offset_runs("line", np.zeros((2, 3)))
    away = np.eye(4)
    away[:3, 3] = 0.5 * NORMAL
    assert "never come near the path line; got '500.0 mm" in refused(samples, away)
    assert "lines 2 to" in refused(samples, away)
    first = samples.cycle == 1
    t, p = samples.time[first], samples.position[first]
    assert "no cycle of the path line is found" in refused(samples_of("AT", "line", [(0, t, p)]), away)
    for rows, text in (
        ((1, t, p[::-1]), "the samples run the path line backwards"),
        ((1, t[:80], p[:80]), "run only a part of the path line"),
        ((1, t[:10], p[:10]), "too few samples of this cycle"),
    ):
        assert text in refused(samples_of("AT", "line", [rows]))
    for name in ("small-circle", "large-circle", "rectangle"):
        ahead = offset_runs(name, np.tile(1e-3 * NORMAL, (2, 1)))
        back = [(k, ahead.time[ahead.cycle == k], ahead.position[ahead.cycle == k][::-1]) for k in (1, 2)]
        assert f"the samples run the path {name} backwards. Run it" in refused(samples_of("AT", name, back))


def test_a_small_circle_is_judged_by_its_shape_where_the_robot_is_off_as_far_as_it_is_wide() -> None:
    extent = 2.0 * float(np.linalg.norm(np.diff(PLAN.paths["small-circle"].points[:2], axis=0)))
    for off in (0.21, 0.3, 0.39):
        values, _ = path_values(PLAN, offset_runs("small-circle", np.tile(off * extent * NORMAL, (3, 1))), HERE, EXACT)
        assert the(values, "AT").value == pytest.approx(off * extent, rel=1e-6)
    beside = refused(offset_runs("small-circle", np.tile(0.41 * extent * NORMAL, (3, 1))))
    assert "run the path small-circle too far beside it for planes through it to tell anything; got" in beside
    assert f"{410 * extent:.1f} mm beside it as a whole'; allowed: {400 * extent:.1f} mm" in beside


def test_two_lengths_that_differ_are_never_shown_alike() -> None:
    assert _apart(5.00001e-3, 5e-3) == ("5.00001", "5.00000")
    assert _apart(7e-3, 5e-3) == ("7.0", "5.0")


def test_a_place_or_a_test_that_is_not_planned_is_refused() -> None:
    samples = offset_runs("line", np.zeros((2, 3)))
    other = replace(samples, place=replace(samples.place, names=("lines",)))
    assert "line 2: the plan has no such place for AT; got 'lines'" in refused(other)
    assert "Did you mean line?" in refused(other)
    assert "AT is not planned" in refused(samples, plan=replace(PLAN, tests=()))


# -- velocity ------------------------------------------------------------------------------------------


def swinging(drawn: Array, size: float, turns: float, rate: float, sigma: float = 0.0) -> Samples:
    """Return cycles of the line whose velocity is ``V (1 + drawn) + size sin``."""
    rng = np.random.default_rng(3)
    t, w = times(LENGTH / V * 1.1, rate), 2 * np.pi * turns
    rows = []
    for number, d in enumerate(drawn, 1):
        s = V * (1 + d) * t + size / w * (1 - np.cos(w * t))
        p = along(PLAN, "line", np.minimum(s, LENGTH)) + rng.normal(0.0, sigma, (len(t), 3))
        rows.append((number, t, p))
    return samples_of("AV", "line", rows)


def test_mean_velocities_give_accuracy_and_repeatability() -> None:
    drawn = 0.01 + 0.002 * np.random.default_rng(2).normal(size=10)
    values, _ = velocity_values(PLAN, swinging(drawn, 0.0, 1.0, 200.0), HERE, EXACT)
    assert the(values, "AV").value == pytest.approx(drawn.mean(), rel=1e-6)
    assert the(values, "RV").value == pytest.approx(3 * drawn.std(ddof=1), rel=1e-6)
    low, high = the(values, "AV").interval or (0.0, 0.0)
    assert high - drawn.mean() == pytest.approx(2.2622 * drawn.std(ddof=1) / np.sqrt(10), rel=1e-4)
    assert drawn.mean() - low == pytest.approx(high - drawn.mean(), rel=1e-6)


def test_a_swing_of_the_velocity_is_its_fluctuation() -> None:
    samples = swinging(np.zeros(10), 0.01, 3.0, 1000.0)
    values, (curves,) = velocity_values(PLAN, samples, HERE, EXACT)
    assert the(values, "FV").value == pytest.approx(0.02, rel=1e-3)
    # noise calls for a window, which flattens a swing by what the window's docstring says
    values, (curves,) = velocity_values(PLAN, samples, HERE, TRACKER)
    x = 3.0 * 2 * np.pi * curves.window[0] / 2
    flattened = 3 * (np.sin(x) - x * np.cos(x)) / x**3
    assert the(values, "FV").value == pytest.approx(0.02 * flattened, rel=2e-3)


def test_a_fluctuation_of_noise_alone_is_the_instruments() -> None:
    values, _ = velocity_values(PLAN, swinging(np.zeros(10), 0.0, 1.0, 100.0, 0.05e-3), HERE, Instrument(0.05e-3))
    assert the(values, "FV").status == "instrument-too-coarse"
    assert (the(values, "FV").interval or (1.0, 1.0))[0] == 0.0
    assert the(values, "RV").status == "instrument-too-coarse"


def test_intervals_of_velocity_hold_the_truth_and_are_not_wide() -> None:
    rng = np.random.default_rng(7)
    inside, width = np.zeros((40, 2), bool), np.zeros((40, 2))
    for trial in range(40):
        values, _ = velocity_values(PLAN, swinging(0.01 + 0.002 * rng.normal(size=10), 0.0, 1.0, 50.0), HERE, EXACT)
        for k, (id_, true) in enumerate((("AV", 0.01), ("RV", 0.006))):
            low, high = the(values, id_).interval or (0.0, 0.0)
            inside[trial, k], width[trial, k] = low <= true <= high, high - low
    assert (inside.mean(axis=0) >= 0.9).all()
    oracle = 2 * 2.2622 * 0.002 / np.sqrt(10), 0.006 * (1.826 - 0.688)
    assert (width.mean(axis=0) <= 1.5 * np.array(oracle)).all()


def test_one_cycle_has_no_repeatability_of_velocity() -> None:
    values, _ = velocity_values(PLAN, swinging(np.array([0.01]), 0.0, 1.0, 100.0), HERE, EXACT)
    assert the(values, "AV").value == pytest.approx(0.01)
    assert [the(values, id_).interval for id_ in ("AV", "RV", "FV")] == [None, None, None]
    assert the(values, "RV").status == "not-measured"


# -- corners


def test_a_corner_cut_by_an_arc_is_rounded_by_what_geometry_says() -> None:
    values, curves = corner_values(PLAN, cornering(0.02), HERE, EXACT)
    assert [value.where for value in values if value.id == "CR"] == [f"rectangle E{k}" for k in (2, 3, 4)]
    for value in values:
        assert (value.interval, value.least is not None) == (None, True)
        assert value.value == pytest.approx((np.sqrt(2) - 1) * 0.02 if value.id == "CR" else 0.0, rel=0.005, abs=1e-9)
    # where the arc is less than the limit band away from the side
    gone = 0.02 - np.sqrt(0.02**2 - (0.02 - PLAN.limit_band) ** 2)
    assert curves[0].stabilisation == pytest.approx(np.full(3, gone), abs=2 * V / 500 + 0.2e-3)


def test_an_overshoot_is_the_height_beyond_the_second_side() -> None:
    values, curves = corner_values(PLAN, cornering(0.0, 0.5e-3), HERE, EXACT)
    for value in values:
        assert value.value == pytest.approx(0.5e-3 if value.id == "CO" else 0.0, rel=0.01, abs=0.2e-3)
    assert curves[1].stabilisation[0] == pytest.approx(0.03 * (1 - np.arcsin(0.2) / np.pi), abs=1e-3)


@pytest.mark.parametrize("beyond", [0.1e-3, 0.5e-3])
def test_noise_makes_an_overshoot_of_a_corner_little_larger(beyond: float) -> None:
    values, _ = corner_values(PLAN, cornering(0.0, beyond, sigma=1e-5), HERE, Instrument(1e-5))
    overshoots = [value for value in values if value.id == "CO"]
    assert np.mean([value.value for value in overshoots]) == pytest.approx(beyond, rel=0.05)
    assert {value.status for value in overshoots} == {"measured"}


def test_an_overshoot_that_noise_would_make_is_marked() -> None:
    values, curves = corner_values(PLAN, cornering(0.0, 0.03e-3, sigma=6e-6), HERE, Instrument(6e-6))
    overshoots = [value for value in values if value.id == "CO"]
    assert all(
        0.25 * value.value > 6e-6 for value in overshoots
    )  # a reading is good enough, the largest of many is not
    doubtful = {v.status for v, c in zip(overshoots, curves, strict=True) if c.noise > 0.25 * v.value}
    assert doubtful <= {"instrument-too-coarse"}
    assert "instrument-too-coarse" in {value.status for value in overshoots}


def test_noise_beside_a_path_without_overshoot_is_no_overshoot() -> None:
    values, _ = corner_values(PLAN, cornering(0.02, sigma=TRACKER.sigma), HERE, TRACKER)
    assert {value.status for value in values if value.id == "CO"} == {"instrument-too-coarse"}
    assert the(values, "CR", where="rectangle E3").value == pytest.approx((np.sqrt(2) - 1) * 0.02, rel=0.01)
    time = np.arange(10.0) / 1000.0
    for beyond, inside in ((np.zeros((10, 3)), np.ones(10, bool)), (np.ones((10, 3)), np.zeros(10, bool))):
        assert largest_top(time, beyond, inside, 1e-6) == (0.0, 0.0)


# -- weaving -------------------------------------------------------------------------------------------


def weaving(stroke: float, faster: float, rate: float = 400.0, sharp: bool = False) -> Samples:
    path = PLAN.paths["weave"]
    t = times(0.4 / (V * faster), rate)
    phase = 2 * np.pi * V * faster / path.wavelength * t
    swing = 2 / np.pi * np.arcsin(np.sin(phase)) if sharp else np.sin(phase)
    p = path.points[0] + np.outer(V * faster * t, ALONG) + np.outer(stroke / 2 * swing, ACROSS)
    return samples_of("WS", "weave", [(k, t, p) for k in (1, 2, 3)])


@pytest.mark.parametrize(("sharp", "within"), [(False, 1e-3), (True, 0.02)])
def test_a_weave_is_read_by_its_stroke_and_its_frequency(sharp: bool, within: float) -> None:
    values, (curves,) = weaving_values(PLAN, weaving(0.019, 1.02, sharp=sharp), HERE, EXACT)
    assert the(values, "WS").value == pytest.approx(-0.05, abs=within)
    assert the(values, "WF").value == pytest.approx(0.02, abs=1e-4)
    assert curves.frequency == pytest.approx(np.full(3, 1.02 * V / 0.04), rel=1e-4)
    assert (the(values, "WS").interval, the(values, "WS").status) == (None, "measured")


@pytest.mark.parametrize(("rate", "sigma"), [(500.0, 1e-5), (1000.0, 5e-5), (2000.0, 5e-5)])
def test_noise_makes_a_weave_no_wider(rate: float, sigma: float) -> None:
    rng, noise = np.random.default_rng(9), 0.5 * sigma / PLAN.paths["weave"].stroke
    strokes = []
    for _ in range(4):
        clean = weaving(0.019, 1.0, rate)
        noisy = replace(clean, position=clean.position + rng.normal(0.0, sigma, clean.position.shape))
        value = the(weaving_values(PLAN, noisy, HERE, Instrument(sigma))[0], "WS")
        strokes.append(value.value)
        assert (value.least or 0.0) - noise <= -0.05 <= (value.largest or 0.0) + noise
    # the largest samples would be three standard deviations beyond, on either side
    assert np.mean(strokes) == pytest.approx(-0.05, abs=noise)


def test_a_weave_sampled_too_slowly_is_said_and_one_without_periods_refused() -> None:
    values, _ = weaving_values(PLAN, weaving(0.019, 1.02, rate=70.0), HERE, EXACT)
    assert the(values, "WS").status == "instrument-too-coarse"
    with pytest.raises(InputError, match="the weave has too few whole periods"):
        weaving_values(PLAN, weaving(0.0, 1.0), HERE, EXACT)


# -- coming to rest ------------------------------------------------------------------------------------

DAMPING, OWN = 0.2, 2 * np.pi * 8


def oscillating(rate: float, *, end: float = 2.5, sigma: float = 0.0, **place: str) -> Samples:
    """Return cycles of a damped oscillation of 50 mm that begins after 0.1 s."""
    t = times(end, rate)
    return to_rest(damped(t - 0.1, 0.05, OWN / 2 / np.pi, DAMPING), t, sigma=sigma, **place)  # type: ignore[arg-type]


def closed_form() -> tuple[float, float, float]:
    """Return entry, stay [s] and overshoot [m] of that oscillation, on a fine grid."""
    t = np.linspace(0.0, 2.4, 2_400_001)
    outside = np.abs(damped(t, 0.05, OWN / 2 / np.pi, DAMPING)) > PLAN.limit_band
    entry, stay = t[(~outside).argmax()], t[np.flatnonzero(outside)[-1] + 1]
    return float(entry), float(stay), 0.05 * float(np.exp(-DAMPING * np.pi / np.sqrt(1 - DAMPING**2)))


def test_noise_well_within_the_band_and_single_samples_outside_change_little() -> None:
    entry, stay, overshoot = closed_form()
    samples = oscillating(1000.0, sigma=1e-5)
    values, _ = settling_values(PLAN, samples, HERE, Instrument(1e-5))
    assert the(values, "t").value == pytest.approx(stay - entry, abs=0.03)
    assert the(values, "OV").value == pytest.approx(overshoot, rel=0.002)
    samples.position[[2000, 2499, 7499]] += 0.11e-3 * NORMAL
    values, _ = settling_values(PLAN, samples, HERE, Instrument(1e-5))
    assert the(values, "t").value == pytest.approx(stay - entry, abs=0.03)


@pytest.mark.parametrize("rate", [4000.0, 1000.0, 250.0])
def test_a_damped_oscillation_has_its_stabilisation_time_and_overshoot(rate: float) -> None:
    entry, stay, overshoot = closed_form()
    values, curves = settling_values(PLAN, oscillating(rate), HERE, EXACT)
    assert the(values, "t").value == pytest.approx(stay - entry, abs=0.5 / rate)
    assert the(values, "OV").value == pytest.approx(overshoot, rel=(OWN * 0.5 / rate) ** 2 + 1e-4)
    assert curves[0].entry == pytest.approx(0.1 + entry, abs=0.5 / rate)
    assert curves[0].travelled == pytest.approx(0.05, rel=1e-3)
    assert {value.status for value in values} == {"measured"}
    assert the(values, "t").interval is None


def test_a_tip_that_does_not_leave_the_band_again_has_no_overshoot() -> None:
    t = times(2.0, 1000.0)
    values, _ = settling_values(PLAN, to_rest(0.05 * np.exp(-10 * t), t, cycles=2), HERE, EXACT)
    assert (the(values, "t").value, the(values, "OV").value) == pytest.approx((0.0, 0.0))
    assert the(values, "t").status == "too-few-cycles"


def test_a_tip_that_creeps_to_its_pose_has_no_overshoot_that_is_not_marked() -> None:
    t, marked = times(1.2, 1000.0), 0
    tau = np.maximum(t - 0.2, 0.0) / 0.02
    for seed in range(8):
        samples = to_rest(-0.1 * (1.0 + tau + 0.5 * tau**2) * np.exp(-tau), t, sigma=2e-5, seed=seed)
        values, curves = settling_values(PLAN, samples, HERE, Instrument(2e-5))
        furthest = max(float(curve.distance[curve.time > curve.entry].max()) for curve in curves)
        assert the(values, "OV").value <= 1.1 * furthest + 6e-5
        for id_ in ("t", "OV"):
            assert the(values, id_).value == 0.0 or the(values, id_).status == "instrument-too-coarse"
        marked += the(values, "OV").status == "instrument-too-coarse"
    assert marked


def test_a_top_is_not_far_beyond_the_largest_sample() -> None:
    # a parabola through three samples of which the last is far higher would have its top far beyond
    away = np.outer([0.60e-3, 1.0e-3, 0.999e-3], ALONG)
    assert 1.0e-3 < top_of(np.arange(3.0) / 1000.0, away, 1, 0.0)[0] <= 1.1e-3


def test_samples_too_slow_for_time_and_overshoot_are_said() -> None:
    assert the(settling_values(PLAN, oscillating(25.0), HERE, EXACT)[0], "OV").status == "instrument-too-coarse"
    t = times(6.0, 20.0)
    for samples, instrument, allowed in (
        (oscillating(10.0, end=6.0), EXACT, {"measured"}),
        (to_rest(0.05 * np.exp(-20 * t), t), EXACT, set()),
        (oscillating(1000.0), Instrument(0.03e-3), set()),
    ):
        statuses = {value.status for value in settling_values(PLAN, samples, HERE, instrument)[0]}
        assert statuses - allowed <= {"instrument-too-coarse"}
        assert statuses


def test_the_posing_time_goes_from_the_begin_of_the_motion_to_rest() -> None:
    _, stay, _ = closed_form()
    samples = oscillating(1000.0, test="posing-time", place="D100")
    values, curves = settling_values(PLAN, samples, HERE, EXACT)
    assert the(values, "posing-time").value == pytest.approx(stay, abs=2e-3)
    assert the(values, "posing-time").where == "P1-D100"
    assert curves[0].start == pytest.approx(0.1, abs=1e-3)


def test_a_record_that_ends_too_early_or_begins_too_late_is_refused() -> None:
    samples = oscillating(1000.0)
    late = np.flatnonzero(samples.time > 1.5)[:900]
    for wrong, text in (
        (oscillating(1000.0, end=0.4), "lines 2 to 401: the record ends before the tip stands"),
        (
            samples_of("t", "P1", [(1, samples.time[late], samples.position[late])]),
            "the record begins when the tip is in the limit band already",
        ),
        (oscillating(5.0), "too few samples of this cycle"),
    ):
        with pytest.raises(InputError, match=text):
            settling_values(PLAN, wrong, HERE, EXACT)
