"""A session keeps readings for reasons of the instrument alone, says what comes next, and loses none."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.engine.data.readers.rows import Configurations
from truearm.measuring.campaign import nest_drift, session_notices
from truearm.measuring.kept_readings import kept_readings, stated_sigma
from truearm.measuring.session import REASONS, Entry, Quality, Reading, Session, dwell_figures

LABELS = ("P1", "P2", "P3", "P4")
QUALITY = Quality(deviation=3e-5, settling=5e-5, samples=5)


def session(targets: Iterable[str] = ("a", "b"), nests: Iterable[str] = (), every: int = 2) -> Session:
    return Session(LABELS, tuple(targets), tuple(nests), every, QUALITY)


def taken(of: Session, name: str, label: str | None = None, *, x: float | None = None, **more: Any) -> Entry:
    """Take a reading whose place is another one each time, and return what became of it."""
    place = np.array([0.1 + 0.01 * len(of) if x is None else x, 0.2, 0.3])
    options = {"time": 10.0 * len(of), "samples": 20, "deviation": 1e-5, "settling": 1e-5} | more
    entry = of.judged(Reading(name, position=place, label=label, **options))
    of.add(entry)
    return entry


def notice_of(of: Session, code: str) -> tuple[str, str]:
    """Return the level and the words of the one notice with this code."""
    (notice,) = [notice for notice in session_notices(of) if notice.code == code]
    return notice.level, notice.message


def stored_readings(of: Session, stops: Configurations | None = None) -> Dataset:
    data = kept_readings(of, replace(plan(of.labels), before=stops), "kept")
    assert data is not None
    return data


def through(of: Session, most: int = 200) -> list[tuple[str, str, str]]:
    """Measure whatever comes next until nothing is left, and return what was asked for."""
    asked: list[tuple[str, str, str]] = []
    while (step := of.next) is not None and len(asked) < most:
        asked.append((step.kind, step.label, step.names[0]))
        taken(of, step.names[0], step.label)
    return asked


def plan(labels: tuple[str, ...] = LABELS) -> Configurations:
    joints = np.radians(10.0 * np.arange(1.0, len(labels) + 1))[:, None] * [1.0, 2.0]
    return Configurations(labels, joints, ("revolute", "revolute"), np.arange(len(labels)))


def test_targets_come_in_the_order_of_the_plan_and_nests_first_along_the_way_and_last() -> None:
    of = session(nests=("n1", "n2"))
    assert of.rounds == 3
    assert of.outstanding == 3 * 2 + 4 * 2
    asked = through(of)
    kinds = [kind for kind, _, _ in asked]
    assert kinds == [*["nests"] * 2, *["configuration"] * 4, *["nests"] * 2, *["configuration"] * 4, *["nests"] * 2]
    assert [label for kind, label, _ in asked if kind == "nests"] == ["P1", "P1", "P2", "P2", "P4", "P4"]
    assert [(label, name) for kind, label, name in asked if kind != "nests"] == [
        (label, name) for label in LABELS for name in ("a", "b")
    ]
    assert of.done
    assert (of.outstanding, of.missed_rounds) == (0, 0)
    short = Session(("P1",), ("a",), ("n",), 10, QUALITY)
    assert [name for _, _, name in through(short)] == ["n", "a", "n"]


def test_a_reading_that_names_no_configuration_belongs_to_the_first_that_is_open() -> None:
    of = session()
    found = [taken(of, name) for name in ("a", "b", "a", "b")]
    assert [(entry.label, entry.reason) for entry in found] == [("P1", ""), ("P1", ""), ("P2", ""), ("P2", "")]


def test_a_reading_of_another_configuration_is_kept_where_it_belongs() -> None:
    of = session(targets=("a",))
    assert taken(of, "a", "P3").label == "P3"
    step = of.next
    assert step is not None
    assert step.label == "P1"
    taken(of, "a", "P1")
    level, words = notice_of(of, "other-order")
    assert level == "note"
    assert "P1" in words
    data = stored_readings(of)
    assert data.labels == ("P3", "P1")
    assert "order" in csv_text(data)
    assert data.number is not None
    assert data.number.tolist() == [0, 1]
    # Stops before the configurations count in the order.
    of = session(targets=("a",))
    through(of)
    data = stored_readings(of, plan())
    assert data.number is not None
    assert data.approach is not None
    assert data.number.tolist() == list(range(1, 2 * len(LABELS), 2))
    assert not data.approach.any()


def test_nests_that_are_passed_over_or_hidden_are_counted_and_told() -> None:
    of = session(targets=("a",), nests=("n",), every=2)
    for label in LABELS[:3]:
        taken(of, "a", label)
    assert of.missed_rounds == 1
    assert notice_of(of, "nests-missed")[0] == "warning"
    step = of.next
    assert step is not None
    assert step.names == ("n",)  # the second round is still to be measured
    of = session(targets=("a",), nests=("n1", "n2"), every=2)
    of.add(of.leave_out("P1", "n1", "the arm is in the line of sight"))
    through(of)
    assert (of.done, of.missed_rounds, of.left_out) == (True, 1, ())
    level, words = notice_of(of, "nests-missed")
    assert level == "warning"
    assert "In 1 of 3 rounds" in words
    assert "Left out: n1 at P1 (the arm is in the line of sight)." in words


def test_a_plan_that_says_what_is_read_asks_for_nothing_else_and_takes_it_all_the_same() -> None:
    of = Session(LABELS, ("a", "b"), (), 2, QUALITY, {"P1": ("a",), "P2": ("b",), "P3": ("a", "b"), "P4": ("b",)})
    assert (of.outstanding, of.planned) == (5, 5)
    assert taken(of, "b", "P1").kept
    assert [f"{label}/{name}" for _, label, name in through(of)] == ["P1/a", "P2/b", "P3/a", "P3/b", "P4/b"]
    assert (of.done, len(of.kept), of.left_out) == (True, 6, ())


def test_what_is_left_out_is_not_asked_for_but_may_come_all_the_same() -> None:
    of = session()
    of.add(of.leave_out("P1", "b", "behind the arm"))
    taken(of, "a")
    step = of.next
    assert step is not None
    assert (step.label, step.names) == ("P2", ("a", "b"))
    assert of.left_out == (("P1", "b"),)
    assert taken(of, "b", "P1").kept
    assert not of.left_out


def test_targets_left_out_at_most_configurations_are_told_and_one_of_two_seen_at_each_is_not() -> None:
    of = session()
    for label, name in (*((label, "b") for label in LABELS), ("P1", "a"), ("P2", "a")):
        of.add(of.leave_out(label, name, "the tracker does not see it"))
    assert "many-left-out" not in {n.code for n in session_notices(of)}
    of.add(of.leave_out("P3", "a", "the tracker does not see it"))
    level, words = notice_of(of, "many-left-out")
    assert level == "warning"
    assert "At 3 of 4 configurations" in words
    assert "7 of 8 readings of targets are missing" in words
    taken(of, "a", "P3")
    assert "many-left-out" not in {n.code for n in session_notices(of)}


FAULTS: dict[str, dict[str, Any]] = {
    "beam-break": {"breaks": 2},
    "few-samples": {"samples": 4},
    "not-settled": {"settling": 6e-5},
    "scatter": {"deviation": 4e-5},
    "unknown-configuration": {"label": "P9"},
    "unknown-name": {"name": "c"},
}


def test_every_fault_of_the_instrument_sets_a_reading_aside_and_it_is_asked_for_again() -> None:
    for reason in FAULTS:
        of = session()
        assert taken(of, **{"name": "a", **FAULTS[reason]}).reason == reason, reason
        assert of.aside_by_reason == {reason: 1}, reason
        step = of.next
        assert step is not None, reason
        assert (step.label, step.names[0]) == ("P1", "a"), reason
        assert taken(of, "a").kept, reason


def test_a_second_reading_never_replaces_one_that_is_kept() -> None:
    of = session()
    first = taken(of, "a", "P1", x=0.5)
    again = taken(of, "a", "P1")
    assert (again.reason, again.words) == ("measured-already", "reading 1")
    assert taken(of, "a", "P2", x=0.5).reason == "copy"  # of another place, to the last digit
    of.add(of.set_aside(first.number, "the nest was not clean"))
    assert of.reason_of(first) == "operator"
    third = taken(of, "a", "P1")
    assert third.kept
    assert [entry.number for entry in of.kept] == [third.number]
    assert of.aside_by_reason == {"measured-already": 1, "copy": 1, "operator": 1}


def test_every_reading_stays_with_its_reason() -> None:
    of = session()
    for name, breaks in (("a", 0), ("a", 1), ("zz", 0), ("b", 0)):
        taken(of, name, breaks=breaks)
    assert [entry.reason for entry in of.entries] == ["", "beam-break", "unknown-name", ""]
    assert {"beam-break", "unknown-name"} <= {*REASONS}
    drawn = of.drawn()
    assert drawn.position.shape == (4, 3)
    assert drawn.kept.tolist() == [entry.kept for entry in of.entries]
    assert len(drawn.names) == len(drawn.labels) == len(drawn.reasons) == len(drawn.time) == 4
    # One that does not follow is none of this session.
    other = session()
    with pytest.raises(InputError, match="does not follow"):
        other.add(of.entries[1])
    other.add(of.entries[0])
    with pytest.raises(InputError, match="does not follow"):
        other.add(Entry(2, "aside", "P1", "b", reason="operator", of=1))
    with pytest.raises(InputError, match="number 5: this does not follow"):
        other.add(Entry(5, "aside", "P1", "a", reason="operator", of=4))  # the reading that it takes back is missing


def test_readings_of_which_nothing_is_told_are_kept_and_a_clock_that_goes_back_is_told() -> None:
    of = session()
    taken(of, "a", samples=None, deviation=None, settling=None)
    level, words = notice_of(of, "not-judged")
    assert level == "note"
    assert "1 of 1" in words
    taken(of, "b", time=-5.0)
    assert "reading 2" in notice_of(of, "clock-back")[1]


def test_words_of_the_operator_that_cannot_be_are_refused() -> None:
    of = session()
    taken(of, "a", breaks=1)
    taken(of, "b")
    of.add(of.set_aside(2))
    calls: tuple[tuple[Callable[[], Entry], str], ...] = (
        (lambda: of.set_aside(1), "number"),
        (lambda: of.set_aside(2), "number"),
        (lambda: of.leave_out("P7", "a"), "label"),
        (lambda: of.leave_out("P1", "c"), "name"),
        (lambda: of.leave_out("P2", "b", "two\nlines"), "words"),
    )
    for number, (call, parameter) in enumerate(calls):
        with pytest.raises(InputError) as refusal:
            call()
        assert refusal.value.parameter == parameter, number
    taken(of, "b", "P1")
    with pytest.raises(InputError) as refusal:
        of.leave_out("P1", "b")
    assert refusal.value.parameter == "name"


def test_the_figures_of_a_dwell() -> None:
    rng = np.random.default_rng(0)
    samples = 1e-5 * rng.standard_normal((4000, 3))
    mean, deviation, settling = dwell_figures(samples)
    assert np.abs(mean).max() < 1e-6
    assert deviation == pytest.approx(1e-5, rel=0.03)
    assert settling < 1e-6
    samples[2000:, 0] += 5e-5
    assert dwell_figures(samples)[2] == pytest.approx(5e-5, rel=0.02)


def test_kept_readings_are_a_file_that_reads_back(tmp_path: Any) -> None:
    of = session(nests=("n",))
    through(of)
    data = stored_readings(of)
    assert (data.configurations, len(data.target)) == (4, 8)
    assert data.references is not None
    assert data.references.targets == ("n",)
    path = tmp_path / "data.csv"
    path.write_text(csv_text(data))
    assert csv_text(read_csv(path)) == path.read_text()


def test_what_was_not_measured_is_missing_or_not_there() -> None:
    of = session()
    taken(of, "a", breaks=1)
    assert kept_readings(of, plan(), "kept") is None
    taken(of, "a")
    assert taken(of, "b", "P1", x=np.nan).reason == "no-reading"
    assert of.left_out == (("P1", "b"),)
    taken(of, "b")
    data = stored_readings(of)
    assert data.labels == ("P1", "P2")  # nobody came to the others
    assert data.has_position.tolist() == [True, False, False, True]


def test_a_configuration_to_which_the_robot_comes_again_has_visits() -> None:
    of = session()
    taken(of, "a", "P1")
    taken(of, "b", "P1", breaks=1)
    taken(of, "a", "P2")
    taken(of, "b", "P1")
    data = stored_readings(of)
    assert data.visit is not None
    assert data.visit.tolist() == [1, 2, 1, 1]


def test_the_deviation_is_the_instruments_or_that_of_the_nests_and_never_that_of_a_dwell() -> None:
    stated = session()
    taken(stated, "a", sigma=2e-5)
    assert stated_sigma(stated).own
    dwells = session(nests=("n",))
    through(dwells)
    assert (stated_sigma(dwells).value, stated_sigma(dwells).own) == (None, False)
    rng = np.random.default_rng(1)
    of = Session([f"P{k}" for k in range(200)], ("a",), ("n1", "n2"), 2, QUALITY)
    while (step := of.next) is not None:
        place = 2e-5 * rng.standard_normal(3) + (1.0 if step.names[0] == "n1" else 2.0)
        of.add(of.judged(Reading(step.names[0], 1.0, place, label=step.label, deviation=1e-6)))
    result = stated_sigma(of).value
    assert result == pytest.approx(2e-5, rel=0.1)
    data = stored_readings(of)
    assert data.sigma is not None
    assert set(data.sigma.tolist()) == {result}


def test_the_drift_of_nests_is_what_they_moved() -> None:
    without = session()
    taken(without, "a")
    assert nest_drift(without) is None
    assert notice_of(without, "no-nests")
    of = session(targets=("a",), nests=("n1", "n2"), every=1)
    moved = 0.0
    while (step := of.next) is not None:
        if step.kind == "nests":
            at = np.array([1.0 + moved, float(step.names[0][1]), 0.0])
            of.add(of.judged(Reading(step.names[0], 60.0 * len(of), at, label=step.label)))
        else:
            taken(of, "a")
            moved += 1e-5
    drift = nest_drift(of)
    assert drift is not None
    assert drift.rounds == (0, 1, 2, 3, 4)
    assert drift.largest == pytest.approx(4e-5)
    np.testing.assert_allclose(drift.common[:, 0], 1e-5 * np.arange(5), atol=1e-12)
    assert drift.time[0] == 0.0
    assert drift.sigma is not None
    assert drift.noise() is None or drift.noise() < 1e-9  # type: ignore[operator]


def test_one_nest_tells_its_scatter_from_round_to_round_and_a_drift_beside_it() -> None:
    rng = np.random.default_rng(2)
    for drift, most in ((0.0, 1.3e-5), (5e-4, 4e-5)):
        of = Session([f"P{k}" for k in range(12)], ("a",), ("n",), 1, QUALITY)
        while (step := of.next) is not None:
            place = 1e-5 * rng.standard_normal(3) + (1.0 if step.names[0] == "n" else 2.0)
            place[0] += drift * step.configuration / 11
            of.add(of.judged(Reading(step.names[0], 1.0, place, label=step.label)))
        result = nest_drift(of)
        assert result is not None
        noise = result.noise()
        assert noise is not None
        assert 0.7e-5 < noise < most
    few = session(nests=("n",))
    through(few)
    seldom = nest_drift(few)
    assert seldom is not None
    assert seldom.noise() is None
