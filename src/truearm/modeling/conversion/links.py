"""What a conversion works out: the rows of the new robot, and its base where that has to move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from truearm.modeling.chain import Array


@dataclass(frozen=True)
class Links:
    """The links of a robot in another convention; what is left behind the last row becomes the flange."""

    rows: tuple[Mapping[str, float], ...]  #: From base to flange [m and rad].
    #: ``T_world_base`` ``(4, 4)`` of a convention whose base frame lies on the first axis; None if the base stays.
    base: Array | None = None
