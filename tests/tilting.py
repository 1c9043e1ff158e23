"""The Katana of the thesis with the joints of its tables 4.3 and 4.4, seen only through readings."""

from __future__ import annotations

import math
from functools import cache
from typing import Final

import numpy as np

from truearm.engine.robot.library import load_robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin
from truearm.engine.twin.twin_joint import JointTruth

DEGREE: Final = math.radians(1.0)
#: Of the document's inclinometers.
RESOLUTION: Final = 0.001 * DEGREE
_TABLE: Final = zip(
    (0.022, 0.024, 0.017, 0.015, 0.018),  # clearance [deg]
    (0.063, 0.061, 0.057, 0.046, 0.051),  # backlash [deg]
    (122, 90, 75, 78, 80),  # stiffness [kgf m/deg]
    strict=True,
)
JOINTS: Final = {
    i: JointTruth(compliance=DEGREE / (k * 9.80665), backlash=b * DEGREE, clearance=c * DEGREE)
    for i, (c, b, k) in enumerate(_TABLE, 1)
}
TRUTH: Final = {
    f"{name}_{i}": float(getattr(joint, name))
    for i, joint in JOINTS.items()
    for name in ("compliance", "backlash", "clearance")
}


@cache
def tilting_katana(truth: str = "standard") -> Twin:
    """Return the Katana with the geometry of table 3.2, or another truth, and joints that tilt."""
    return Twin(truth_twin(load_robot("katana450"), truth, np.random.default_rng(0)).robot, JOINTS)
