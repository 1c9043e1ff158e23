"""Numbers in programs: as many decimals as before, never fewer than asked for, and untouched where nothing changes."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from truearm.engine.programs.program import decimals_of, rewritten


def test_decimals_are_counted() -> None:
    counted = {"600": 0, "600.": 0, "-0.50": 2, ".125": 3, "1.5e-3": 4, "1.25E+1": 1, "2e3": 0}
    assert {text: decimals_of(text) for text in counted} == counted


def test_a_number_gets_its_new_value() -> None:
    for text, value, fewest, new in (
        ("600", 600.41271, 3, "600.413"),
        ("600", 600.0000001, 3, "600"),
        ("600.0", 599.9996, 3, "600.0"),
        ("600.0", 599.9994, 3, "599.999"),
        ("12.34567", 12.345602, 3, "12.34560"),
        ("12.34567", 12.345668, 3, "12.34567"),
        ("-0.0004", 0.0004, 3, "0.0004"),
        ("0.001", -0.0001, 3, "0.000"),
        ("1.5e-3", 0.25, 3, "0.2500"),
        ("-4521", -4519.6, 0, "-4520"),
        ("+12.0", 12.5, 3, "12.500"),
    ):
        assert rewritten(text, value, fewest) == new, text


@given(st.decimals(-5000, 5000, places=6), st.integers(0, 9), st.integers(0, 7))
def test_the_same_value_is_not_rewritten(value: object, decimals: int, fewest: int) -> None:
    text = f"{float(str(value)):.{decimals}f}"
    assert rewritten(text, float(text), fewest) == text
    assert rewritten(text, float(text) + 0.004 * 10.0**-fewest, fewest) == text or decimals > fewest + 2


@given(st.floats(-5000, 5000), st.floats(-3, 3), st.integers(0, 9), st.integers(0, 7))
def test_what_is_written_is_right_to_its_last_decimal(value: float, change: float, decimals: int, fewest: int) -> None:
    text = f"{value:.{decimals}f}"
    new = rewritten(text, value + change, fewest)
    kept = max(decimals, fewest)
    # What stays may be off by the rounding of both.
    assert abs(float(new) - (value + change)) <= 1.001 * 10.0**-kept + 0.01 * 10.0**-fewest
    if new != text:
        assert abs(float(new) - (value + change)) <= 0.501 * 10.0**-kept
    assert new == text or decimals_of(new) == kept
    assert new == text or float(new) != 0.0 or not new.startswith("-")
