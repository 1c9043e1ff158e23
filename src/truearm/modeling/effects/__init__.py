"""Joint effects: what moves a joint by something else than its reading. One effect a file."""

from __future__ import annotations

from typing import Final

from truearm.modeling.effects.approach import Approach
from truearm.modeling.effects.backlash import Backlash
from truearm.modeling.effects.bearing import BearingCompliance
from truearm.modeling.effects.clearance import Clearance, LinearContactClearance
from truearm.modeling.effects.compliance import Compliance
from truearm.modeling.effects.effect import Effect, Layout
from truearm.modeling.effects.fourier import Fourier
from truearm.modeling.effects.gain import Gain
from truearm.modeling.effects.hardening import Hardening
from truearm.modeling.effects.thermal import ThermalGrowth
from truearm.modeling.effects.transmission import TransmissionError
from truearm.modeling.effects.warm_up import WarmUp

EFFECTS: Final[tuple[type[Effect], ...]] = (
    Gain,
    Fourier,
    TransmissionError,
    Compliance,
    Hardening,
    Backlash,
    BearingCompliance,
    Clearance,
    LinearContactClearance,
    Approach,
    ThermalGrowth,
    WarmUp,
)

__all__ = ["EFFECTS", "Effect", "Gain", "Layout"]
