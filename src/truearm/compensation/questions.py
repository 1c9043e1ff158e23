"""What only the user can say of a program or its controller, asked before anything is written."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from truearm.errors import InputError


@dataclass(frozen=True)
class Question:
    """A question whose answer decides whether a correction helps or harms."""

    parameter: str  #: Of the job, which answers it.
    text: str  #: The question, and why it is asked.
    answers: str  #: How the parameter answers it.
    kept: str  #: Where an answer can be kept, in a sentence.


def refuse_unanswered(questions: Iterable[Question | None]) -> None:
    """Ask all that was not answered, in one message.

    Raises:
        InputError: If there is a question.
    """
    asked = [question for question in questions if question is not None]
    if not asked:
        return
    texts = [f"{one.text} Answer with {one.answers}. {one.kept}" for one in asked]
    raise InputError(
        "nothing is corrected before this is answered",
        parameter=", ".join(question.parameter for question in asked),
        cure=" ".join(f"({number}) {text}" for number, text in enumerate(texts, 1)) if texts[1:] else texts[0],
    )
