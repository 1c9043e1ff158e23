"""What the command prints first: the answer, the next step, the gravest notices, and how much there is beside."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from truearm.engine.base.errors import Notice
from truearm.engine.base.units import Marked, mark_lines
from truearm.engine.diagnose.next_step import NextStep
from truearm.engine.document.document import Block, Table, detail, each, say, under
from truearm.engine.document.records import Record, first_screen


@dataclass(frozen=True, eq=False, repr=False)
class Found(Record):
    answer: int = 1
    warnings: tuple[Notice, ...] = ()
    next: tuple[NextStep, ...] = ()
    simulated_from: tuple[Marked, ...] = ()

    def blocks(self) -> Iterator[Block]:
        yield each("parts", (say(f"answer {k}", number=k) for k in range(self.answer)))
        yield detail("explained", "at length", why="so")
        yield under("table", [Table(("a", "b"), [("1", "22"), ("333", "4")], in_json={"rows": 2}, is_detail=True)])


NOTICES = (
    Notice("a", "first.", "note"),
    Notice("b", "second."),
    Notice("c", "third.", "error"),
    Notice("d", "fourth."),
    Notice("e", "fifth."),
    Notice("f", "sixth.", "note"),
)
STEPS = (NextStep("measure", "Measure more."), NextStep("stop", "Or stop."))


def test_text_and_json_are_made_of_the_same_blocks() -> None:
    found = Found(2, NOTICES[:1], STEPS[:1])
    assert found.lines() == [
        *("answer 0", "answer 1", "explained", "at length", "a    b", "1    22", "333  4"),
        *("Next (measure): Measure more.", "Note (a): first."),
    ]
    assert found.summary() == {
        "parts": [{"number": 0}, {"number": 1}],
        "why": "so",
        "table": {"rows": 2},
        "next": [STEPS[0].summary()],
        "warnings": [NOTICES[0].summary()],
    }


def test_details_notices_and_steps_that_are_left_out_are_counted() -> None:
    assert first_screen(Found(1, NOTICES, STEPS)) == [
        "Error (c): third.",  # before the figures that it is about
        *("answer 0", "explained", "at length"),  # for which there is room
        "Next (measure): Measure more.",
        "Warning (b): second.",
        "Warning (d): fourth.",
        "And 1 warning, 2 notes, 4 lines more, which `details` shows.",
    ]


@pytest.mark.parametrize("marked", [(), ("data",)])
@pytest.mark.parametrize("steps", [0, 1, 2])
@pytest.mark.parametrize("notices", [0, 1, 3, 6])
@pytest.mark.parametrize("answer", [1, 4, 8, 40])
def test_it_has_ten_lines_at_most_and_counts_the_rest(
    answer: int, notices: int, steps: int, marked: tuple[Marked, ...]
) -> None:
    found = Found(answer, NOTICES[:notices], STEPS[:steps], marked)
    shown, everything = first_screen(found), found.lines()
    assert len(shown) < 10  # the tenth says where files are
    assert mark_lines(marked) == shown[: len(marked)]
    assert "answer 0" in shown
    assert sum("(c)" in line for line in shown) == (notices > 2)
    if shown != everything:
        *told, more = shown
        assert told == [line for line in everything if line in told]
        assert sum(int(word) for word in more.split() if word.isdigit()) == len(everything) - len(told)


def test_what_is_whole_stays_whole() -> None:
    whole = type("Listed", (Found,), {"is_list": True})(40, NOTICES)
    assert first_screen(whole) == whole.lines()
