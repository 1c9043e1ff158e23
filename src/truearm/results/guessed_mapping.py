"""A mapping file that was guessed from a table."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from truearm.measurement.readers.guessing.guess import Guessed
from truearm.measurement.readers.guessing.mapping_text import Guess
from truearm.results.record import Record
from truearm.shown import counted, listed


@dataclass(frozen=True, eq=False, repr=False)
class GuessedMapping(Record):
    """A mapping file that a table seems to need."""

    guessed: Guessed  #: The mapping and what would come of it.
    out: Path | None = None  #: The file that holds it; None if none was written.

    @property
    def text(self) -> str:
        """The mapping file."""
        return self.guessed.text

    @property
    def guesses(self) -> tuple[Guess, ...]:
        """Every entry that was guessed, and what the guess rests on."""
        return self.guessed.guesses

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "guesses": [{"entry": g.entry, "value": g.value, "because": g.because} for g in self.guesses],
            "open": list(self.guessed.open),
            "refusal": self.guessed.refusal,
            "configurations": self.guessed.configurations,
            "targets": list(self.guessed.targets),
        }

    def lines(self) -> list[str]:
        """Return what was guessed, and what is to be done."""
        where = "" if self.out is None else f": {self.out}"
        text = [f"Guessed {counted(len(self.guesses), 'entry').replace('entrys', 'entries')}{where}"]
        if self.guessed.open:
            text.append(f"Nothing in the file tells {listed(self.guessed.open)}: answer each '?'.")
        elif self.guessed.refusal is not None:
            text.append(f"An import with it would be refused: {self.guessed.refusal}")
        elif self.guessed.configurations:
            many = counted(self.guessed.configurations, "configuration")
            text.append(f"An import with it would read {many}, targets {listed(self.guessed.targets)}.")
        else:
            text.append("No columns are called like joint positions: name them, or the file that holds them.")
        text.append("Nothing is imported before every guess is confirmed: look at each, then write confirmed: yes.")
        return text
