"""Could an arm of this size carry the payload that is given."""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform
from truearm.notices import Notice

#: Payload over the cube of the reach that no arm carries [kg/m^3]. Strong ones carry 45 (2300 kg at 3.7 m), the IRB 120
#: 15 (3 kg at 0.58 m).
_MOST: Final = 450.0
#: Configurations at which the reach is looked for.
_PLACES: Final = 200


def check_payload(robot: Robot) -> list[Notice]:
    """Return a notice if the payload is ten times beyond what the strongest arms of this reach carry."""
    mass = robot.payload.mass
    if mass <= 0.0:
        return []
    joints = robot.random_configurations(_PLACES, np.random.default_rng(0))
    reach = float(np.linalg.norm(robot.with_frames(Transform(), {}).world_poses(joints)[0], axis=1).max())
    if mass <= _MOST * reach**3:
        return []
    return [
        Notice(
            "payload-unlikely",
            f"The payload is {mass:.4g} kg, and {robot.name} reaches {reach:.2g} m: no arm of that size carries more "
            f"than {_MOST * reach**3:.2g} kg. Were grams called kilograms? What loads the joints follows from it.",
        )
    ]
