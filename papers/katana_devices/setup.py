"""The set-up of the study katana-devices: place and tools of the Katana, and the instruments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from papers.katana.circle import PENCIL
from papers.katana.robot import NOISE, TIP
from truearm.engine.robot.parts import Tool
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.devices import DEVICES
from truearm.engine.twin.devices.device import TRACKER, Device, Tracker
from truearm.engine.twin.devices.lengths import HEXAPOD, TOUCH_UP
from truearm.engine.twin.devices.pencil import DRAWN_CIRCLE
from truearm.engine.twin.devices.touching import MARKERS, PLANAR_ARTEFACT, SPATIAL_ARTEFACT, Artefact

#: Where the robot stands before an instrument at the origin: 2.6 m away (the Optotrak sees from 2 to 7 m), turned.
PLACE: Final = Transform((2.5, 0.2, -0.7), (0.5**0.5, 0.0, 0.0, 0.5**0.5))
POINT: Final = Tool({TIP: (0.0, 0.0, PENCIL)})
#: The attachment of chapters 3 and 4, whose end is the point that the document's tables are of.
ATTACHMENT: Final = Tool({TIP: (0.0, 0.0, 0.0)})
REFLECTORS: Final = {TIP: (0.0, 0.0, PENCIL), "left": (0.08, 0.0, 0.05), "right": (-0.08, 0.0, 0.05)}
#: The circle of section 5.5.1 in the base frame [m].
MIDDLE: Final = (0.0, -0.3, 0.1392893)
RADIUS: Final = 0.1
_CONE: Final = float(np.deg2rad(45.0))

OPTOTRAK: Final = "three active markers (Optotrak)"
_TRACKED: Final = "laser tracker, one reflector seen within 45 deg"
#: The document's instruments with their configurations: 118 poses (section 3.4), 30 points (section 3.3).
DOCUMENT: Final[Mapping[str, tuple[Device, int]]] = {
    OPTOTRAK: (replace(MARKERS, sigma=NOISE, tool=ATTACHMENT), 118),
    f"{OPTOTRAK}, 30 points": (replace(MARKERS, sigma=NOISE, tool=ATTACHMENT), 30),
    f"{_TRACKED}, 30 points": (replace(TRACKER, within=_CONE, tool=ATTACHMENT), 30),
    "optical CMM of 0.060 mm, 30 points": (replace(SPATIAL_ARTEFACT, sigma=6e-5, tool=ATTACHMENT), 30),
}
#: The hexapod's tool has to take whole poses, which five joints cannot.
USED: Final = tuple(device for device in DEVICES if device.name != HEXAPOD.name)
#: The document's low-cost set-up, made a measurement: touch-up and drawn circle together.
LOW_COST: Final = "low-cost set-up: touch-up and drawn circle"

#: Instruments that see only a part of the configurations, in words.
VIEWS: Final[Mapping[str, tuple[Tracker | Artefact, Mapping[str, tuple[float, float, float]]]]] = {
    _TRACKED: (replace(TRACKER, within=_CONE), POINT.targets),
    "laser tracker, three reflectors seen within 30 deg": (TRACKER, REFLECTORS),
    PLANAR_ARTEFACT.name: (PLANAR_ARTEFACT, POINT.targets),
    SPATIAL_ARTEFACT.name: (SPATIAL_ARTEFACT, POINT.targets),
    OPTOTRAK: (MARKERS, POINT.targets),
}

#: What is known when an instrument's data are fitted.
Start = Literal["geometry alone", "tilting first"]
STARTS: Final[tuple[Start, ...]] = ("geometry alone", "tilting first")


@dataclass(frozen=True)
class Counts:
    """How much is measured and judged."""

    registry: int  #: Configurations of each device of the registry but the two of the low-cost set-up.
    touched: int  #: touched, drawn: contacts of the touch-up, and points of the drawn circles.
    drawn: int
    unseen: int  #: Configurations to judge by.

    def of(self, name: str) -> int:
        """Return how many configurations a device of the registry gets, or both of the low-cost set-up."""
        few = {TOUCH_UP.name: self.touched, DRAWN_CIRCLE.name: self.drawn, LOW_COST: self.touched + self.drawn}
        return few.get(name, self.registry)
