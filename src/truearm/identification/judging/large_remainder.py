"""Is what a fit leaves more than joints miss by, where no deviation is declared that would say so.

Without a declared deviation all that is left counts as noise or as errors of the joints, however large it is. What
joints of sound arms miss by is known: makers state a pose repeatability (RP of ISO 9283) of 0.01 mm for the ABB IRB
120, which reaches 0.58 m, and of 0.1 mm for the UR5, which reaches 0.85 m. If one joint did all of that, it would miss
by 0.001 and 0.007 deg.
"""

from __future__ import annotations

import math
from typing import Final

from truearm.identification.judging.arrival_likelihood import joints_as_far_off
from truearm.identification.judging.left_over import LeftOver
from truearm.notices import Notice

#: Errors of every joint, as the readings are left off, from which something else than repeatability is looked for.
_LARGEST: Final = math.radians(0.02)


def check_remainder(left: LeftOver) -> list[Notice]:
    """Return a notice if readings without declared deviations are left farther off than joints miss by.

    Nothing is said of models that leave the geometry alone: they leave it by design.
    """
    fit = left.fit
    if "geometry" not in fit.model.groups or any(block.declared for block in left.problem.blocks):
        return []
    seeming = joints_as_far_off(left)
    if seeming <= _LARGEST:
        return []
    off, more = math.degrees(seeming), "" if fit.model.tried else " (try `model=auto`)"
    return [
        Notice(
            "large-remainder",
            f"The readings are left as far off as if every joint missed by {off:.2g} deg at each arrival. Arms repeat "
            "to less than 0.01 deg. No deviation is declared, so all of that counts as noise and errors of the joints. "
            f"Look for what the {fit.model.name} model lacks{more}, for joint positions that were rounded "
            "or taken before the arm stood still, for an instrument or a base that moved, and for readings of another "
            "robot. If the instrument is no better, declare its deviation as sigma.",
        )
    ]
