"""Where the bearing of a joint lies on its axis, which no reading can tell.

The moments across an axis depend on the point they are taken about, and a shaft tilts about its bearing. A robot file
says how far along the axis the bearing lies, counted from the joint's origin: the origin of the frame right behind the
joint's own turn, as the nominal rows place it (for DH before the slide d along the joint's own axis).

An identified slide must not carry the bearing along. Where a slide along an axis can be shifted to another one without
a change that readings see (``d_2`` and ``d_3`` between parallel axes 2, 3 and 4), the least squares put what they find
on either. Bearings, and the masses on the links between such slides, therefore stay where the nominal slides have
them, and only the sum of the slides moves what lies beyond all of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate
from typing import Final

import numpy as np

from truearm.engine.robot.chain import Array, Chain, Direction, Element, Motion, Offset

#: Sine of the angle below which two directions are parallel.
_PARALLEL: Final = 1e-9
_SLIDES: Final[tuple[Motion, ...]] = ("Tx", "Ty", "Tz")


@dataclass(frozen=True)
class AxialSlides:
    """How far identified slides have carried joints and links along axes, beyond their nominal places."""

    joints: tuple[tuple[Offset, ...], ...]  #: Of each joint's origin along its own axis.
    #: Of each link's frame: directions in that frame, and how far along each.
    links: tuple[tuple[tuple[Direction, tuple[Offset, ...]], ...], ...]

    @classmethod
    @lru_cache(maxsize=64)
    def of(cls, links: tuple[tuple[Element, ...], ...]) -> AxialSlides:
        """Return those of the links of a robot, without its joint effects; robots of one make share them."""
        elements = [element for link in links for element in link]
        kinematics = Chain(tuple(elements)).forward_kinematics(np.zeros((len(links), 1)))
        along = [kinematics.axis(place)[:, 0] for place in range(len(elements))]
        runs = _runs(elements, along)
        joints = []
        for start, link in zip(_ends(links)[:-1], links, strict=True):
            place = start + next(i for i, element in enumerate(link) if element.variable is not None)
            joints.append(next((run.before(place, along[place]) for run in runs if place in run.turns), ()))
        frames = []
        for end in _ends(links)[1:]:
            R = kinematics.matrix(end)[0]
            slides = [(R.T @ run.along, run.before(end, run.along)) for run in runs if run.start <= end <= run.stop]
            frames.append(tuple(((float(x), float(y), float(z)), offsets) for (x, y, z), offsets in slides if offsets))
        return cls(tuple(joints), tuple(frames))

    def stayed(self, link: int, point: Direction, values: Mapping[str, float]) -> Direction:
        """Return a point of a link (from 1; 0 is the base) given with nominal slides, in the link's frame [m]."""
        x, y, z = point
        for (a, b, c), offsets in self.links[link - 1] if link else ():
            carried = carried_by(offsets, values)
            x, y, z = x - a * carried, y - b * carried, z - c * carried
        return x, y, z


def carried_by(offsets: Iterable[Offset], values: Mapping[str, float]) -> float:
    """Return the sum of what slides differ from their nominal values, each with its sign [m]."""
    return sum(sign * (values[name] - nominal) for name, sign, nominal in offsets)


@dataclass(frozen=True, eq=False)
class _Run:
    """Neighbouring joints that turn about parallel axes, and the slides along these."""

    along: Array
    turns: tuple[int, ...]
    start: int
    stop: int
    slides: tuple[tuple[int, Offset], ...]

    def before(self, place: int, along: Array) -> tuple[Offset, ...]:
        """Return the slides before an element; none behind the last of them, which all others move.

        Args:
            along: The direction in which they count, that of the run or its opposite.
        """
        if not self.slides or place > self.slides[-1][0]:
            return ()
        sense = float(np.sign(self.along @ along))
        return tuple((name, sense * sign, nominal) for at, (name, sign, nominal) in self.slides if at < place)


def _runs(elements: Sequence[Element], along: Sequence[Array]) -> list[_Run]:
    turning = [i for i, element in enumerate(elements) if element.turns and element.variable is not None]
    groups: list[list[int]] = []
    for place in turning:
        if groups and _are_parallel(along[groups[-1][0]], along[place]):
            groups[-1].append(place)
        else:
            groups.append([place])
    runs = []
    for number, group in enumerate(groups):
        start = groups[number - 1][-1] + 1 if number else 0
        stop = groups[number + 1][0] if number + 1 < len(groups) else len(elements)
        direction = along[group[0]]
        slides = []
        for i in range(start, stop):
            element = elements[i]
            if element.parameter and not element.turns and _are_parallel(direction, along[i]):
                slides.append((i, (element.parameter, float(np.sign(direction @ along[i])), element.value)))
        runs.append(_Run(direction, tuple(group), start, stop, tuple(slides)))
    return runs


def _are_parallel(a: Array, b: Array) -> bool:
    return float(np.linalg.norm(np.cross(a, b))) < _PARALLEL


def _ends(links: Sequence[Sequence[Element]]) -> list[int]:
    return list(accumulate((len(link) for link in links), initial=0))


def bearing_elements(joint: Element, bearing: float, offsets: Sequence[Offset]) -> tuple[Element, Element] | None:
    """Return the slides from a joint's origin to its bearing and back, None if they are the same point."""
    if not bearing and not offsets:
        return None
    back = tuple((name, -sign, nominal) for name, sign, nominal in offsets)
    motion: Motion = "T" if joint.axis is not None else _SLIDES[joint.along]
    return (
        Element(motion, bearing, axis=joint.axis, offsets=back),
        Element(motion, -bearing, axis=joint.axis, offsets=tuple(offsets)),
    )
