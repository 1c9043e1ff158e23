"""What a file says beside its numbers: what it cannot hold, and which frames the numbers refer to."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Final

from truearm.modeling.effects.balancing import Balancing
from truearm.modeling.parts import NO_PAYLOAD
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform
from truearm.simulated import said_of

#: Two frames less than this apart [m, rad] are the same to any instrument.
_SAME_FRAME: Final = 1e-9


def left_out(robot: Robot, format_: str, held: Collection[str] = ()) -> list[str]:
    """Say what of a robot a file cannot hold: joint effects, balancers, the place of the base, targets.

    Args:
        format_: What the file is, as a sentence begins: ``A URDF``.
        held: Names of the joint effects that it holds after all; with that of balancers the balancers themselves.
    """
    said = []
    for effect in robot.effects:
        names = [plain.name for plain in effect.parameters if robot.values[plain.name] != plain.value]
        if names and effect.name not in held:
            said.append(f"{format_} cannot hold the joint effect {effect.name}; left out: {', '.join(names)}.")
    if robot.balancers and Balancing.name not in held:
        names = [balancer.name for balancer in robot.balancers]
        said.append(f"{format_} cannot hold balancers; left out: {', '.join(names)}.")
    base = [name for name, p in robot.parameters.items() if p.group == "base" and p.value != 0.0]
    if base or robot.base_quaternion != Transform().quaternion:
        names = [*(["base_quaternion"] if robot.base_quaternion != Transform().quaternion else []), *base]
        said.append(
            f"{format_} cannot hold where the base stands in the instrument's frame; left out: {', '.join(names)}."
        )
    if robot.targets:
        names = [target.name for target in robot.targets]
        said.append(f"{format_} cannot hold the targets on the flange; left out: {', '.join(names)}.")
    return said


def masses_left_out(robot: Robot, format_: str) -> list[str]:
    """Say which masses a file cannot hold."""
    links = [str(number) for number in sorted({mass.joint for mass in robot.masses if mass.mass})]
    names = [
        *([f"those of link {', '.join(links)}"] if links else []),
        *(["the payload"] if robot.payload != NO_PAYLOAD else []),
    ]
    return [f"{format_} cannot hold masses; left out: {' and '.join(names)}."] if names else []


def frames(robot: Robot) -> str:
    """Say which frames, and whose joint positions, all numbers of a file refer to."""
    counted = " Joint positions are the model's, not those that the controller shows."
    return (
        f"Poses are those of the flange in the base frame, both as in the robot file of {robot.name}."
        f"{counted if robot.controller.counts_otherwise else ''}"
    )


def first_frame_remark(base: Transform) -> str:
    """Say where the frame that a table starts from stands in the base frame."""
    turned = 2.0 * math.atan2(math.hypot(*base.quaternion[1:]), abs(base.quaternion[0]))
    if math.hypot(*base.translation) < _SAME_FRAME and turned < _SAME_FRAME:
        return "The table starts at the base frame."
    x, y, z = (f"{1e3 * v:.6g}" for v in base.translation)
    return (
        f"The table starts at a frame on the first axis, which in the base frame stands at x {x}, y {y}, z {z} mm, "
        f"turned by {math.degrees(turned):.6g} deg."
    )


def comments(robot: Robot, frame: str, left: Sequence[str]) -> list[str]:
    """Return what the head of a file says in its comments, each one line without control characters."""
    title = robot.title if robot.title == robot.name else f"{robot.name}: {robot.title}"
    said = [
        *said_of(robot.simulated_from),
        f"{title}, written by truearm",
        frame,
        *left,
        *(f"History: {line}" for line in robot.history),
    ]
    return [" ".join("".join(c if c.isprintable() else " " for c in line).split()) for line in said]
