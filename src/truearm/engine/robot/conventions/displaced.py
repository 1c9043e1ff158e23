"""A joint whose axis has any direction, with the small slides and turns that can displace it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal

from truearm.engine.robot.chain import Element, Motion

_SLIDES: Final[tuple[Motion, ...]] = ("Tx", "Ty", "Tz")
_TURNS: Final[tuple[Motion, ...]] = ("Rx", "Ry", "Rz")


def closest(axis: Sequence[float]) -> int:
    """Return which of x, y and z lies closest to a direction, the first of equals."""
    return max(range(3), key=lambda k: abs(axis[k]))


def small_turns(number: int, axis: Sequence[float]) -> tuple[Element, ...]:
    """Return the turns that tilt an axis: without the one that lies closest to it, where the joint zero does the same.

    Args:
        number: Of the link, for the names ``rx_i``, ``ry_i``, ``rz_i``.
        axis: Unit vector in the frame of the turns.
    """
    return tuple(
        Element(motion, parameter=f"r{motion[1]}_{number}") for k, motion in enumerate(_TURNS) if k != closest(axis)
    )


def slides_across(number: int, axis: Sequence[float], point: Sequence[float]) -> tuple[Element, ...]:
    """Return the slides to a point [m] of an axis; the one closest to the axis moves nothing and stays fixed."""
    return tuple(
        Element(motion, point[k], None if k == closest(axis) else f"{motion[1]}_{number}")
        for k, motion in enumerate(_SLIDES)
    )


def slides_back(point: Sequence[float]) -> tuple[Element, ...]:
    """Return the fixed slides from a point [m] back to the origin."""
    return tuple(Element(motion, -point[k]) for k, motion in enumerate(_SLIDES) if point[k] != 0.0)


def joint(zero: str, number: int, kind: Literal["revolute", "prismatic"], axis: tuple[float, float, float]) -> Element:
    """Return the joint itself, with its zero as a parameter."""
    return Element("R" if kind == "revolute" else "T", parameter=f"{zero}_{number}", variable=number - 1, axis=axis)
