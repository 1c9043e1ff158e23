"""From lengths to the pose and back, in closed form (Nubiola, 3.3)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.measurement.hexapod.geometry import SIDES, Design, handedness, triangle
from truearm.modeling.chain import Array
from truearm.modeling.transform import cross, dot

#: On which side of their three feet the second and the third tool cup lie, for the document's solutions 1 to 4.
SOLUTIONS: Final = {1: (1, 1), 2: (1, -1), 3: (-1, 1), 4: (-1, -1)}


def tripod(feet: Iterable[Array], legs: Iterable[Array], side: int, names: Sequence[str]) -> Array:
    """Return the point at given distances from three others (Nubiola, 3.4 to 3.11; `Tri`).

    Args:
        feet: Three points, each ``(3, ...)`` [m].
        legs: Distance of the point from each [m], ``(...)``.
        side: 1 if, seen from the point, the feet go round against the clock, -1 for the other point.
        names: Of the three legs, for messages.

    Raises:
        InputError: If the feet lie on one line, or the legs do not meet; with their names.
    """
    v1, v2, v3 = feet
    l1, l2, l3 = legs
    u, w = v2 - v1, v3 - v1
    n = cross(u, w)
    square = dot(n, n)
    if not (square > 1e-8 * dot(u, u) * dot(w, w)).all():
        raise InputError(
            "the three feet of these legs lie on one line, and the point where they meet is not determined",
            where=", ".join(names),
            cure="Check the measured distances between the cups.",
        )
    # The document measures from the frame's origin; from the first foot there is less to cancel.
    xi1 = (l1 * l1 - l2 * l2 + dot(u, u)) / 2
    xi2 = (l1 * l1 - l3 * l3 + dot(w, w)) / 2
    p = (xi1 * cross(w, n) + xi2 * cross(n, u)) / square
    height = l1 * l1 - dot(p, p)
    apart = np.flatnonzero(~(np.atleast_1d(height) >= 0))
    if len(apart):
        lengths = [float(np.broadcast_to(leg, np.shape(height)).flat[apart[0]]) for leg in (l1, l2, l3)]
        raise InputError(
            "legs of these lengths do not meet",
            where=", ".join(names),
            came=", ".join(f"{name} {length * 1e3:.3f} mm" for name, length in zip(names, lengths, strict=True)),
            cure="Measure them again; check that the bar was between the cups that are named.",
        )
    return np.asarray(v1 + p + side * np.sqrt(height / square) * n)


def tool_cups(
    design: Design, solution: int, base: Sequence[float] | Array, tool: Sequence[float] | Array, legs: Array
) -> Array:
    """Return where the tool cups are in the frame of the base fixture (Nubiola, 3.12 to 3.14).

    Args:
        design: Between which cups the legs were measured.
        solution: Which of the four ways to assemble the design, 1 to 4; those below the base are left out.
        base, tool: Distances 12, 23 and 31 of the fixtures [m], ``(3,)`` or ``(3, n)``.
        legs: Lengths in the order of :attr:`~truearm.measurement.hexapod.geometry.Design.legs` [m], ``(6,)`` or ``(6,
            n)``.

    Returns:
        cups: T1, T2, T3: ``(3, 3)`` or ``(3, 3, n)``, cup first. The frame's origin is B1, x goes to B2, and z is the
            normal on whose side the tool is.

    Raises:
        InputError: If cups lie on one line, or legs do not meet; with the names of the lengths.
    """
    feet = triangle(base, "B")
    sides = dict(zip((frozenset(ends) for ends in SIDES), np.asarray(tool, float), strict=True))
    (i, j, k), (first, second, third) = design.base, design.tool
    hand = handedness(design.base)
    second_side, third_side = SOLUTIONS[solution]
    names = design.leg_names

    def between(a: int, b: int) -> tuple[Array, str]:
        return sides[frozenset((a, b))], f"T{min(a, b) + 1}-T{max(a, b) + 1}"

    t12, name12 = between(first, second)
    t23, name23 = between(second, third)
    t31, name31 = between(third, first)
    t1 = tripod((feet[i], feet[j], feet[k]), legs[:3], hand, names[:3])
    t2 = tripod((feet[i], feet[j], t1), (legs[3], legs[4], t12), hand * second_side, (*names[3:5], name12))
    t3 = tripod((t2, feet[j], t1), (t23, legs[5], t31), hand * third_side, (name23, names[5], name31))
    found = {first: t1, second: t2, third: t3}
    return np.array([found[cup] for cup in range(3)])


def leg_lengths(design: Design, base_cups: Array, tool_cups: Array) -> Array:
    """Return the length of each leg [m], ``(6,)`` or ``(6, n)``; the cups as :func:`tool_cups` returns them."""
    return np.array([np.linalg.norm(tool_cups[tool] - base_cups[base], axis=0) for base, tool in design.legs])
