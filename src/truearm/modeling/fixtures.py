"""What stands beside the robot and its targets are measured against: a point, a plane, a frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from truearm.modeling.chain import Chain, Element
from truearm.modeling.parts import SLIDES, TURNS
from truearm.modeling.transform import Transform, fixed_rotation

FixtureKind = Literal["point", "plane", "frame"]


@dataclass(frozen=True)
class Fixture:
    """A point, a plane or a frame that stands still in the world.

    A point is three coordinates. A frame is three coordinates and three small rotations behind `quaternion`. A plane
    is two small rotations behind `quaternion` and its distance from the origin along the normal, which is z of what
    comes out: Hesse's normal form.
    """

    name: str  #: As the data call it.
    kind: FixtureKind  #: ``point``, ``plane`` or ``frame``.
    #: Reference orientation in the world; a point needs none.
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    def parameter(self, axis: str) -> str:
        """Return the name of the parameter for ``x``, ``y``, ``z``, ``rx``, ``ry`` or ``rz``."""
        prefix = self.name if self.name.startswith("fixture") else f"fixture_{self.name}"
        return f"{prefix}_{axis}"

    @cached_property
    def chain(self) -> Chain:
        """The way from the world to the fixture."""
        slides = tuple(Element(motion, parameter=self.parameter(axis)) for axis, motion in SLIDES)
        turns = tuple(Element(motion, parameter=self.parameter(axis)) for axis, motion in TURNS)
        if self.kind == "point":
            return Chain(slides)
        if self.kind == "plane":
            return Chain((*fixed_rotation(self.quaternion), *turns[:2], slides[2]))
        return Chain((*slides, *fixed_rotation(self.quaternion), *turns))

    def values_at(self, place: Transform) -> dict[str, float]:
        """Return the parameter values of a fixture at a place that is turned as `quaternion` says.

        Args:
            place: A point's or frame's; for a plane a frame with its origin in the plane and its z along the normal.
        """
        if self.kind == "plane":
            height = float(place.rotation[:, 2] @ place.translation)
            return {self.parameter("z"): height}
        return {self.parameter(axis): value for axis, value in zip("xyz", place.translation, strict=True)}
