"""What to do next after a fit or a check: one step, and the order of several."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

#: Codes of the release before, which JSON has beside those of this one.
_FORMERLY: Final = {"fix-data": "mend-data"}
#: More steps than this nobody takes at once.
MOST: Final = 3


@dataclass(frozen=True)
class NextStep:
    """What to do next."""

    code: str  #: Stable short name, for programs: ``other-model``, ``stop``.
    message: str  #: What to do, and why.
    #: By how much the mean held-out error is expected to fall [m]; None where that cannot be told.
    gain: float | None = None

    @property
    def words(self) -> str:
        """The step with its gain."""
        return self.message if self.gain is None else f"{self.message} Expected gain: {_mm(self.gain)} mm."

    @property
    def line(self) -> str:
        """The step as the command prints it."""
        return f"Next ({self.code}): {self.words}"

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it, the gain in mm."""
        before = {"formerly": _FORMERLY[self.code]} if self.code in _FORMERLY else {}
        return {
            "code": self.code,
            **before,
            "message": self.message,
            "gain_mm": None if self.gain is None else float(_mm(self.gain)),
        }


def most_useful_first(steps: Iterable[NextStep]) -> tuple[NextStep, ...]:
    """Return at most three steps: by the gain where it is known, otherwise in their order and behind those."""
    ordered = sorted(steps, key=lambda step: -(step.gain or 0.0))
    return tuple(ordered[:MOST])


def _mm(length: float) -> str:
    """Write a length with two digits [mm]."""
    return f"{float(f'{length * 1e3:.2g}'):g}"
