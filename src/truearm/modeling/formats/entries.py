"""What the entries of a robot file are made of: numbers, names, quaternions and places, checked."""

from __future__ import annotations

import math
import re
from typing import Annotated, Final

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints

from truearm.errors import InputError
from truearm.modeling.transform import IDENTITY, Transform
from truearm.printable import is_one_line
from truearm.units import sized_si, written

#: What a robot and a joint may be called.
NAME: Final = r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}"
NAME_IN_WORDS: Final = "up to 100 letters, digits, _ . and -, starting with a letter or digit"

#: Checksums of a controller have fewer characters: those of six joints about 70.
LONGEST_CHECKSUM: Final = 200

#: Of an entry that has known keys only.
STRICT: Final = ConfigDict(extra="forbid", frozen=True)

Number = Annotated[float, Field(allow_inf_nan=False, strict=True)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False, strict=True)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False, strict=True)]
Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False, strict=True)]
Triple = tuple[Number, Number, Number]


def _name(text: str) -> str:
    if not re.fullmatch(NAME, text):
        raise InputError("this cannot be a name", came=text, allowed=NAME_IN_WORDS)
    return text


Name = Annotated[str, StringConstraints(strict=True), AfterValidator(_name)]


def checksum(text: str) -> str:
    """Return a text that tells the kinematics of controllers apart, as it is printed: one line, and short.

    Raises:
        InputError: If it is another text.
    """
    if not is_one_line(text) or len(text) > LONGEST_CHECKSUM:
        raise InputError(
            "this is no checksum",
            came=text,
            allowed=f"one line of up to {LONGEST_CHECKSUM} characters",
            cure="Copy it, or the file that it stands in, again.",
        )
    return text


Checksum = Annotated[str, StringConstraints(strict=True), AfterValidator(checksum)]


def _unit_length(q: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    if abs(math.hypot(*q) - 1.0) > 1e-6:
        raise InputError(
            f"a quaternion (w, x, y, z) must have length 1, this one has {math.hypot(*q):.6g}",
            came=list(q),
            cure="Divide its numbers by that length, or correct them.",
        )
    return q


Quaternion = Annotated[tuple[Number, Number, Number, Number], AfterValidator(_unit_length)]


class Place(BaseModel):
    """Where a frame stands in another one."""

    model_config = STRICT
    translation: Triple = (0.0, 0.0, 0.0)
    quaternion: Quaternion | None = None

    def transform(self, length: str, where: str) -> Transform:
        """Return the transform; `length` is the file's unit, `where` names the entry in messages."""
        x, y, z = (sized_si(v, length, f"{where}.translation") for v in self.translation)
        return Transform((x, y, z), self.quaternion or IDENTITY.quaternion)


def place_entry(place: Transform) -> dict[str, list[float]]:
    """Return the entry of a place, in mm."""
    return {"translation": [written(v, "mm") for v in place.translation], "quaternion": list(place.quaternion)}
