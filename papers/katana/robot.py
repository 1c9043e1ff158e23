"""The Katana 450 of Patel's thesis as its four studies have it: parameters, published values, noise and cubes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import Final, Literal

from truearm.engine.motion.cube import Cube
from truearm.engine.motion.largest_cube import largest_cube
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform

TIP: Final = "tip"
#: The length of the tool link, d_6 [m].
TOOL: Final = 0.2
#: The 17 parameters of Table 3.2. The document's alpha_0 to alpha_4 are alpha_1 to alpha_5 here. Its tool link is the
#: flange here, so d_6 is z of the tip, and alpha_6, a turn with an arm of 200 mm, is y of the tip.
NAMES: Final = (
    *(f"theta_offset_{i}" for i in range(1, 6)),
    *(f"alpha_{i}" for i in range(1, 6)),
    "target_tip_y",
    "beta_3",
    "beta_4",
    "a_3",
    "a_4",
    "d_5",
    "target_tip_z",
)
#: As the document calls them.
DOCUMENT_NAMES: Final = (
    *(f"theta {i}" for i in range(1, 6)),
    *(f"alpha {i}" for i in range(6)),
    *("beta 2", "beta 3", "a 3", "a 4", "d 5", "d 6"),
)
#: What the tip's y is counted in, so that it counts like the turn that it stands for, and how far it is perturbed.
UNITS: Final = {"target_tip_y": TOOL}
PERTURBATIONS: Final = {"target_tip_y": TOOL * math.radians(0.05)}
#: Resolution of the Optotrak, taken as one standard deviation of a coordinate [m].
NOISE: Final = 1e-5
#: Cube of ISO 9283 whose circle of 0.8 times the side is the circle of section 5.5.1.
CHAPTER_5_CUBE: Final = Cube((0.0, -0.3, 0.1392893), 0.25)

#: Whose values: Table 3.2 (all poses at once) or Table 3.3 (by influence).
Published = Literal["standard", "influence"]
#: The tool link's alpha_6 [deg] and d_6 [mm], Tables 3.2 and 3.3.
_TOOL_LINK: Final[Mapping[Published, tuple[float, float]]] = {
    "standard": (90.03, 200.001),
    "influence": (90.01, 200.000),
}


def katana(beyond: float = 0.0) -> Robot:
    """Return the nominal Katana with its tip, some way beyond the 200 mm attachment [m]."""
    return load_robot("katana450").with_frames(IDENTITY, {TIP: (0.0, 0.0, beyond)})


def published(table: Published, beyond: float = 0.0) -> Robot:
    """Return the Katana with the parameters of Table 3.2 or 3.3; its tip has an orientation."""
    robot = katana()
    leaning, length = math.radians(_TOOL_LINK[table][0] - 90.0), _TOOL_LINK[table][1] * 1e-3 + beyond
    tip = Transform(
        (0.0, -length * math.sin(leaning), length * math.cos(leaning) - TOOL),
        (math.cos(leaning / 2), math.sin(leaning / 2), 0.0, 0.0),
    )
    return robot.with_frames(IDENTITY, {TIP: tip}).with_values(robot.truths[table].values)


@cache
def workspace_cube() -> Cube:
    """Return the largest cube in front of the Katana with its attachment."""
    return largest_cube(katana(), target=TIP)


def deviations(values: Mapping[str, float]) -> dict[str, float]:
    """Return how far the 17 parameters are from nominal by the document's names [deg, mm].

    The tip's y stands for a turn of the tool link, alpha 5 in the document.
    """
    nominal = katana().values
    found = {}
    for name, called in zip(NAMES, DOCUMENT_NAMES, strict=True):
        off = values[name] - nominal[name]
        if name == "target_tip_y":
            off = -off / TOOL
        found[called] = 1e3 * off if called[0] in "ad" and not called.startswith("alpha") else math.degrees(off)
    return found
