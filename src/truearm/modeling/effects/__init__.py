"""Joint effects: what makes a joint turn by something else than its reading. One effect a file."""

from __future__ import annotations

from typing import Final

from truearm.modeling.effects.effect import Effect
from truearm.modeling.effects.gain import Gain

EFFECTS: Final[tuple[type[Effect], ...]] = (Gain,)

__all__ = ["EFFECTS", "Effect", "Gain"]
