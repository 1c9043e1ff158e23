"""What the command prints first: the answer, the three gravest notices, and how many there are beside."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from truearm.engine.base.errors import Notice
from truearm.engine.document.records import Record, first_screen, notice_lines


@dataclass(frozen=True, eq=False, repr=False)
class Found(Record):
    warnings: tuple[Notice, ...]

    def summary(self) -> dict[str, Any]:
        return {}

    def lines(self) -> list[str]:
        return ["the answer", *notice_lines(self.warnings)]


NOTICES = (
    Notice("a", "first.", "note"),
    Notice("b", "second."),
    Notice("c", "third.", "error"),
    Notice("d", "fourth."),
    Notice("e", "fifth."),
    Notice("f", "sixth.", "note"),
)


def test_the_gravest_notices_are_first_and_the_others_are_counted() -> None:
    assert first_screen(Found(NOTICES)) == [
        "the answer",
        "Error (c): third.",
        "Warning (b): second.",
        "Warning (d): fourth.",
        "And 1 warning, 2 notes more, which `details` shows.",
    ]


@pytest.mark.parametrize("count", [0, 1, 3])
def test_few_notices_are_all_on_it(count: int) -> None:
    found = Found(NOTICES[:count])
    assert first_screen(found) == found.lines()
    assert len(found.lines()) == count + 1
