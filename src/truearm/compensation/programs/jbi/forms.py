"""What the numbers of positions in a job mean."""

from __future__ import annotations

from math import radians
from typing import Final

from truearm.compensation.programs.program import Form
from truearm.modeling.orientations import FIXED_XYZ_ANGLES

PULSES: Final = Form("pulses", "pulses", decimals=(0, 0))
ANGLES: Final = Form("joint angles", "joints", angle=radians(1.0))
POSE: Final = Form("rectangular position", "pose", angle=radians(1.0), orientation=FIXED_XYZ_ANGLES)
