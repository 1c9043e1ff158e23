"""What a flange carries, as a text says it."""

from __future__ import annotations

import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.robot.parts import Payload


@pytest.mark.parametrize(
    ("text", "mass", "cog"),
    [
        ("3kg,0,0,120mm", 3.0, (0.0, 0.0, 0.12)),
        ("300g,0.0,-0,0.1m", 0.3, (0.0, 0.0, 0.1)),
        ("0,0,0,0", 0.0, (0.0, 0.0, 0.0)),
    ],
)
def test_zero_needs_no_unit(text: str, mass: float, cog: tuple[float, float, float]) -> None:
    assert Payload.of_text(text) == Payload(mass, cog)


@pytest.mark.parametrize("text", ["3kg,0,0,120", "3,0,0,120mm", "3kg,0kg,0,120mm", "3kg,0,,120mm", "3kg,0 cm,0,120mm"])
def test_every_other_number_needs_one(text: str) -> None:
    with pytest.raises(InputError, match="unit"):
        Payload.of_text(text)
