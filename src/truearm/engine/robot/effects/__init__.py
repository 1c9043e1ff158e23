"""Joint effects: what moves a joint by something else than its commanded position.

One effect a file, which knows all about itself: its parameters, what it needs to know, and where it may be used. A new
one is a file here and a line in `EFFECTS`; the order there is that of parameters and of trials.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from truearm.engine.base.errors import InputError, did_you_mean, wrong_kind
from truearm.engine.robot.effects.approach import Approach
from truearm.engine.robot.effects.backlash import Backlash
from truearm.engine.robot.effects.balancing import Balancing
from truearm.engine.robot.effects.bearing import BearingCompliance
from truearm.engine.robot.effects.clearance import Clearance
from truearm.engine.robot.effects.compliance import Compliance
from truearm.engine.robot.effects.effect import Effect, Layout
from truearm.engine.robot.effects.fourier import Fourier
from truearm.engine.robot.effects.gain import Gain
from truearm.engine.robot.effects.hardening import Hardening
from truearm.engine.robot.effects.joint_curve import JointCurve
from truearm.engine.robot.effects.linear_contact import LinearContactClearance
from truearm.engine.robot.effects.link_bending import LinkBending
from truearm.engine.robot.effects.run_out import RunOut
from truearm.engine.robot.effects.thermal import ThermalGrowth
from truearm.engine.robot.effects.transmission import TransmissionError
from truearm.engine.robot.effects.warm_up import WarmUp

EFFECTS: Final[tuple[type[Effect], ...]] = (
    Gain,
    Fourier,
    TransmissionError,
    JointCurve,
    Compliance,
    Hardening,
    Backlash,
    BearingCompliance,
    Clearance,
    LinearContactClearance,
    LinkBending,
    RunOut,
    Balancing,
    Approach,
    ThermalGrowth,
    WarmUp,
)

#: Groups of parameters that no joint has negative ones of. An identified value may come out so all the same.
NON_NEGATIVE: Final = frozenset(effect.name for effect in EFFECTS if effect.non_negative)

__all__ = ["EFFECTS", "NON_NEGATIVE", "Effect", "Layout", "checked_effects"]


def checked_effects(names: Sequence[str], parameter: str = "effects") -> tuple[str, ...]:
    """Return names of joint effects, refusing those that there are not."""
    known = [effect.name for effect in EFFECTS]
    if isinstance(names, str | bytes) or not isinstance(names, Sequence):
        raise wrong_kind("a sequence of names belongs here", names, parameter, ", ".join(known))
    for name in names:
        if name not in known:
            raise InputError(
                "there is no joint effect of this name",
                parameter=parameter,
                came=name,
                allowed=", ".join(known),
                cure=did_you_mean(name, known) if isinstance(name, str) else None,
            )
    return tuple(names)
