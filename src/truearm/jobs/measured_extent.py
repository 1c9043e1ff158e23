"""Whether the readings of a plan reach as far as its configurations do: a slip with units shows, and nothing else."""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.measurement.measuring.session import Session
from truearm.modeling.chain import Array
from truearm.notices import Notice

#: Of so many configurations the extent is compared, and it is told from so many times on.
_FEWEST: Final = 3
_TIMES: Final = 10.0


def extent_notices(session: Session, flange: Array) -> list[Notice]:
    """Return whether a target reaches ten times as far as the flange, or a tenth of it: its unit may be another one.

    That is no word on how well a reading fits.

    Args:
        flange: Where the nominal flange is at the configurations of the plan [m], ``(n, 3)``.
    """
    places = {label: number for number, label in enumerate(session.labels)}
    for name in session.targets:
        kept = [e for e in session.kept if e.name == name and e.reading is not None]
        if len(kept) < _FEWEST:
            continue
        read = _extent(np.array([e.reading.position for e in kept if e.reading is not None]))
        driven = _extent(flange[[places[e.label] for e in kept]])
        if driven and not 1.0 / _TIMES < read / driven < _TIMES:
            return [
                Notice(
                    "units-unlikely",
                    f"The readings of {name} at {len(kept)} configurations are {read * 1e3:.4g} mm apart, root mean "
                    f"square about their middle, and the flange of the robot {driven * 1e3:.4g} mm. Check the unit of "
                    "lengths, and that it is this plan.",
                )
            ]
    return []


def _extent(places: Array) -> float:
    """Return how far places ``(n, 3)`` are from their middle [m], the root of the mean square."""
    return float(np.sqrt(((places - places.mean(axis=0)) ** 2).sum(axis=1).mean()))
