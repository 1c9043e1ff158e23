"""What the numbers of FANUC positions mean."""

from __future__ import annotations

import math
from typing import Final

from truearm.compensation.programs.program import Form
from truearm.modeling.orientations import FIXED_XYZ_ANGLES

POSE: Final = Form("XYZWPR", "pose", angle=math.pi / 180, orientation=FIXED_XYZ_ANGLES)
JOINTS: Final = Form("joints", "joints", angle=math.pi / 180)
