"""Poses that lie as those of another cube: measured for another plan, most likely."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.validation.iso9283.poses import PoseCloud

#: No robot makes all distances larger or smaller by this share.
_SCALE: Final = 0.01
#: Nor does it bring all poses this share of the cube's side aside; a tie to the base may.
_ASIDE: Final = 0.05
#: What another size and place of the cube leave of the errors, at most.
_LEFT: Final = 0.2


@dataclass(frozen=True)
class OtherCube:
    """How a cube lies that explains where the poses of a test are."""

    test: str  #: Its id.
    scale: float  #: So many times as large as the planned one.
    aside: float  #: How far its middle is from where the planned one has it [m].


def other_cube(clouds: tuple[PoseCloud, ...], side: float) -> OtherCube | None:
    """Return the cube that explains errors of poses which no robot has; None where there is none.

    Args:
        clouds: Attained poses.
        side: Of the planned cube [m].
    """
    groups: dict[tuple[object, ...], list[PoseCloud]] = {}
    for cloud in clouds:
        key = cloud.test, cloud.robot, cloud.approach, cloud.velocity, cloud.load
        groups.setdefault(key, []).append(cloud)
    for (test, *_), members in groups.items():
        if len(members) < 2:
            continue
        commanded, attained = (np.array([getattr(one, name) for one in members]) for name in ("command", "barycentre"))
        found = _explained(commanded, attained - commanded, side)
        if found is not None:
            return OtherCube(str(test), *found)
    return None


def _explained(commanded: Array, error: Array, side: float) -> tuple[float, float] | None:
    """Return scale and shift that explain errors ``(k, 3)`` of poses, two or more, beside a turn of the frame.

    Two poses have a distance alone, which tells the scale.
    """
    out = commanded - commanded.mean(axis=0)
    shift = error.mean(axis=0)
    moved = error - shift
    if len(out) > 2:
        turns = np.stack([np.cross(axis, out).ravel() for axis in np.eye(3)], axis=1)
        moved = moved - (turns @ np.linalg.lstsq(turns, moved.ravel(), rcond=None)[0]).reshape(-1, 3)
    scale = float((moved * out).sum() / (out**2).sum())
    left = np.linalg.norm(moved - scale * out) if len(out) > 2 else 0.0
    aside = float(np.linalg.norm(shift))
    larger = abs(scale) > _SCALE and left <= _LEFT * abs(scale) * np.linalg.norm(out)
    beside = aside > _ASIDE * side and left <= _LEFT * aside * np.sqrt(len(out))
    return (1.0 + scale, aside) if larger or beside else None
