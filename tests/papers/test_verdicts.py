"""A verdict follows from the printed digits, ours over the seeds and the kind of claim, and from nothing else."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from papers.verdicts import Claim, Comparison, Verdict


@pytest.mark.parametrize(
    ("printed", "half"), [("46", 0.5), ("0.50", 0.005), ("0.5", 0.05), ("-90.010", 0.0005), ("240", 0.5)]
)
def test_half_the_last_printed_digit_is_rounding(printed: str, half: float) -> None:
    assert Comparison(1.0, printed).rounding == pytest.approx(half)


@pytest.mark.parametrize(
    ("ours", "printed", "tolerance"),
    [
        (1.0, "1.00", 0.005),  # no chance: its digits
        ([1.0], "1.00", 0.005),  # one seed tells no scatter
        ([0.98, 1.0, 1.02], "1.00", 0.04),  # two standard deviations
        ([0.8, 1.0, 1.2], "1.00", 0.2),  # a fifth, however much they scatter
        ([0.8, 1.0, 1.2], "1", 0.5),  # coarser digits than that
    ],
)
def test_no_tolerance_is_larger_than_digits_scatter_and_a_fifth_allow(
    ours: Sequence[float] | float, printed: str, tolerance: float
) -> None:
    assert Comparison(ours, printed).tolerance == pytest.approx(tolerance)


@pytest.mark.parametrize(
    ("ours", "printed", "verdict"),
    [
        (1.0049, "1.00", "agrees"),
        (1.0051, "1.00", "differs"),
        (46, "46", "agrees"),
        (45, "46", "differs"),
        (0.146, "0.1455", "differs"),
        ([0.95, 1.0, 1.05], "1.09", "agrees"),
        ([0.95, 1.0, 1.05], "1.11", "differs"),
        ([0.5, 1.0, 1.5], "1.00", "undecided"),  # two deviations are as much as the figure itself
        ([0.5, 1.0, 1.5], "1.90", "undecided"),
        ([0.5, 1.0, 1.5], "2.10", "differs"),  # further off than they scatter
        ([1.001], "1.00", "agrees"),
        ([1.1], "1.00", "undecided"),
        ([0, 0, 1], "0", "undecided"),
        ([0, 0, 0], "0", "agrees"),
    ],
)
def test_a_figure_agrees_within_digits_scatter_and_a_fifth(
    ours: Sequence[float] | float, printed: str, verdict: Verdict
) -> None:
    assert Comparison(ours, printed).verdict == verdict


@pytest.mark.parametrize(
    ("ours", "printed", "claim", "verdict"),
    [
        (0.5, "1.0", "order", "same order"),
        (2.0, "1.0", "order", "same order"),
        (2.1, "1.0", "order", "differs"),
        (-2.0, "-1.0", "order", "same order"),
        (-0.1, "1.0", "order", "differs"),
        (0.0, "0.004", "at most", "not worse"),
        (0.0044, "0.004", "at most", "not worse"),
        (0.005, "0.004", "at most", "differs"),
        (90.0, "89.9", "at least", "not worse"),
        (80.0, "89.9", "at least", "differs"),
        ([1.0, 1.1, 1.2], "1.00", "construction", "by construction"),
        ([1.0, 1.0, 1.3], "2.00", "construction", "differs"),
        ([0.5, 1.0, 1.5], "1.90", "construction", "by construction"),
    ],
)
def test_looser_claims_have_names_of_their_own(
    ours: Sequence[float] | float, printed: str, claim: Claim, verdict: Verdict
) -> None:
    assert Comparison(ours, printed, claim).verdict == verdict


@pytest.mark.parametrize("printed", ["about 1", "", "nan", "1..2"])
def test_what_is_no_number_is_refused(printed: str) -> None:
    with pytest.raises(ValueError, match="a printed figure is a number"):
        Comparison(1.0, printed)


def test_zero_has_no_order() -> None:
    with pytest.raises(ValueError, match="zero has no order"):
        Comparison(1.0, "0.0", "order")
