"""How far identified slides have carried a place of the digital twin along an axis, by walking from it both ways.

A slide between axes that are parallel to it may be exchanged for another one without a change of any pose. What the
file says of bearings and centres of gravity is about the nominal slides, so it is counted back by what they differ.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from truearm.modeling.chain import Array, Element
from truearm.simulation.twin_body import exponential, generator

_ALIKE: Final = 1.0 - 1e-12


def carried(elements: Sequence[Element], place: int, direction: Array, values: Mapping[str, float]) -> float:
    """Return how far a place was carried along a direction [m].

    Args:
        elements: Of all links, one behind the other.
        place: Between the elements before this number and those from it on.
        direction: Unit vector ``(3,)`` in the frame there, along the axis of a joint.
        values: What the parameters are.
    """
    ahead = [e for e, along in _reached(elements, place, direction, forward=True) if abs(along) > _ALIKE]
    if not ahead:
        return 0.0  # the last of them moves everything beyond, wherever it stands
    behind = _reached(elements, place, direction, forward=False)
    return sum(along * (values[str(e.parameter)] - e.value) for e, along in behind if abs(along) > _ALIKE)


def directions_at(elements: Sequence[Element], place: int) -> list[Array]:
    """Return the axes of the turning joints before and behind a place, in the frame there; parallel ones once."""
    found = [axis for forward in (False, True) for axis in _next_axis(elements, place, forward=forward)]
    if len(found) == 2 and abs(float(found[0] @ found[1])) > _ALIKE:
        return found[:1]
    return found


def _reached(
    elements: Sequence[Element], place: int, direction: Array, *, forward: bool
) -> Iterator[tuple[Element, float]]:
    """Give the slides with a parameter on the way to the next joint about another axis, with cosines to a direction."""
    v = direction
    for element in _way(elements, place, forward=forward):
        along = float(v @ _axis(element))
        if element.turns:
            if element.variable is not None and abs(along) < _ALIKE:
                return
            v = _seen(v, element, forward=forward)
        elif element.parameter is not None:
            yield element, along


def _next_axis(elements: Sequence[Element], place: int, *, forward: bool) -> Iterator[Array]:
    passed = np.eye(3)
    for element in _way(elements, place, forward=forward):
        if element.turns and element.variable is not None:
            yield passed @ _axis(element)
            return
        if element.turns:
            R = _turn(element)
            passed = passed @ (R if forward else R.T)


def _way(elements: Sequence[Element], place: int, *, forward: bool) -> Sequence[Element]:
    return elements[place:] if forward else elements[:place][::-1]


def _seen(v: Array, element: Element, *, forward: bool) -> Array:
    R = _turn(element)
    return np.asarray(R.T @ v if forward else R @ v)


def _turn(element: Element) -> Array:
    return exponential(generator(element), element.value, turns=True)[:3, :3]


def _axis(element: Element) -> Array:
    return np.array(element.axis) if element.axis else np.eye(3)["xyz".index(element.motion[1])]
