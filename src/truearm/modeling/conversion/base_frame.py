"""Into the zero-reference model and the product of exponentials: axes in the base frame at zero joint positions."""

from __future__ import annotations

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.conversion.links import Links
from truearm.modeling.lines import base_and_flange, joint_axes
from truearm.modeling.robot import Robot


def zero_reference(robot: Robot) -> Links:
    """Return direction and point of every axis."""
    return Links(tuple(_named("axis_", along) | _named("", point) for _, along, point in _axes_in_base(robot)))


def exponentials(robot: Robot) -> Links:
    """Return the twist of every joint, ``v = -w x p``; of a sliding one only its direction v."""
    return Links(
        tuple(
            _named("v_", along) if slides else _named("w_", along) | _named("v_", -np.cross(along, point))
            for slides, along, point in _axes_in_base(robot)
        )
    )


def _axes_in_base(robot: Robot) -> list[tuple[bool, Array, Array]]:
    """Return for each joint whether it slides, its direction and a point of its axis [m] in the base frame."""
    base = base_and_flange(robot)[0]
    R, origin = base[:3, :3], base[:3, 3]
    return [
        (axis.joint.kind == "prismatic", R.T @ axis.along, R.T @ (axis.point - origin)) for axis in joint_axes(robot)
    ]


def _named(prefix: str, vector: Array) -> dict[str, float]:
    return {f"{prefix}{a}": float(v) for a, v in zip("xyz", vector, strict=True)}
