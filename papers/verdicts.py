"""How one of our figures stands to a printed one.

A verdict follows from three things: the figure as it is printed, with its digits; ours over the seeds; and what kind of
claim it is. No study states how far off a figure may be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from functools import cached_property
from statistics import median, stdev
from typing import Final, Literal, get_args

#: What a row says of a printed figure: ours should equal it; ours should be of its order, because the document prints
#: an order only, or the robot is invented; ours should be no more, or no less; or something was chosen, or put in, to
#: give it.
Claim = Literal["equal", "order", "at most", "at least", "construction"]
#: How our median stands to a printed figure, best first.
Verdict = Literal["agrees", "same order", "not worse", "by construction", "undecided", "differs"]
VERDICTS: Final[tuple[Verdict, ...]] = get_args(Verdict)
#: What stands in place of a verdict where the document prints nothing.
SILENT: Final = "no figure published"

#: No figure agrees that is further off than this share of the printed one, however much ours scatter.
_SHARE: Final = 0.2
#: Of the same order is what lies between the printed figure over this and the printed figure times this.
_ORDER: Final = 2.0
#: Rounding of binary numbers, as a share of the last printed digit.
_ROUNDING: Final = 1e-6


@dataclass(frozen=True)
class Comparison:
    """Ours beside a printed figure.

    Raises:
        ValueError: If `printed` is no number, or is zero where an order is claimed.
    """

    ours: Sequence[float] | float  #: One value a seed; a single number is a figure that no chance enters.
    printed: str  #: The figure as the document prints it, all digits: "0.50" is not "0.5".
    claim: Claim = "equal"  #: What is said of it.

    def __post_init__(self) -> None:
        """Refuse what cannot be compared."""
        try:
            finite = Decimal(self.printed).is_finite()
        except InvalidOperation:
            finite = False
        if not finite:
            raise ValueError(f"a printed figure is a number, not {self.printed!r}")
        if self.claim == "order" and self.value == 0.0:
            raise ValueError("zero has no order")

    @property
    def value(self) -> float:
        """The printed figure."""
        return float(self.printed)

    @property
    def rounding(self) -> float:
        """Half of its last digit."""
        exponent = Decimal(self.printed).as_tuple().exponent
        return 0.5 * 10.0 ** int(exponent)

    @cached_property
    def median(self) -> float:
        """Median of ours."""
        return float(self.ours if isinstance(self.ours, float | int) else median(self.ours))

    @cached_property
    def scatter(self) -> float | None:
        """Twice the standard deviation of ours over the seeds; None from one seed, 0 where no chance enters."""
        if isinstance(self.ours, float | int):
            return 0.0
        return 2.0 * stdev(self.ours) if len(self.ours) > 1 else None

    @property
    def most(self) -> float:
        """The largest tolerance that any figure may have."""
        return max(self.rounding, _SHARE * abs(self.value))

    @property
    def tolerance(self) -> float | None:
        """How far our median may be from the printed figure; None for an order, which is a factor."""
        scatter = self.scatter or 0.0
        match self.claim:
            case "equal":
                return max(self.rounding, min(scatter, _SHARE * abs(self.value)))
            case "construction":
                return max(self.most, scatter)
            case "order":
                return None
            case _:
                return self.rounding

    @property
    def verdict(self) -> Verdict:
        """How our median stands to the printed figure."""
        match self.claim:
            case "order":
                low, high = sorted((self.value / _ORDER, self.value * _ORDER))
                return "same order" if low <= self.median <= high else "differs"
            case "at most":
                return "not worse" if self.median <= self.value + self._allowed else "differs"
            case "at least":
                return "not worse" if self.median >= self.value - self._allowed else "differs"
            case "construction":
                return "by construction" if self._off <= self._allowed else "differs"
            case _:
                return self._equal()

    def _equal(self) -> Verdict:
        if self.scatter is None:
            return "agrees" if self._off <= self._allowed else "undecided"
        if self.scatter > self.most:
            return "undecided" if self._off <= self.scatter else "differs"
        return "agrees" if self._off <= self._allowed else "differs"

    @property
    def _off(self) -> float:
        return abs(self.median - self.value)

    @property
    def _allowed(self) -> float:
        return (self.tolerance or 0.0) + _ROUNDING * self.rounding
