"""What a study found: our figures beside the published ones, with the reasons where they differ."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any, Literal

from truearm.reporting.drawing import Figure
from truearm.reporting.page import page
from truearm.results.record import Record
from truearm.writing import output_folder, write_files

#: What a study writes into its folder.
STUDY_FILES = ("report.html", "study.json")

Verdict = Literal["agrees", "differs", "no figure published"]


@dataclass(frozen=True)
class Row:
    """One figure, ours beside the published one.

    Attributes
    ----------
    what, unit
        What it is of.
    ours
        One value a seed.
    published
        What the document prints; None where it prints nothing.
    source
        Where it prints it.
    absolute, relative
        How far our median may be from it: in `unit`, and as a share of it. The larger of both counts.
    explanation
        Why it differs, or what it means, in plain words.
    """

    what: str
    unit: str
    ours: Sequence[float]
    published: float | None = None
    source: str = ""
    absolute: float = 0.0
    relative: float = 0.0
    explanation: str = ""

    @property
    def median(self) -> float:
        """Median of ours."""
        return float(median(self.ours))

    @property
    def lowest(self) -> float:
        """Lowest of ours."""
        return float(min(self.ours))

    @property
    def highest(self) -> float:
        """Highest of ours."""
        return float(max(self.ours))

    @property
    def tolerance(self) -> float | None:
        """How far our median may be from the published figure, in `unit`; None where nothing is published."""
        return None if self.published is None else max(self.absolute, self.relative * abs(self.published))

    @property
    def verdict(self) -> Verdict:
        """How our median stands to the published figure."""
        if self.published is None or self.tolerance is None:
            return "no figure published"
        return "agrees" if abs(self.median - self.published) <= self.tolerance else "differs"

    def summary(self) -> dict[str, Any]:
        """Return the row as ``study.json`` holds it."""
        return {
            "what": self.what,
            "unit": self.unit,
            "ours": [float(value) for value in self.ours],
            "median": self.median,
            "lowest": self.lowest,
            "highest": self.highest,
            "published": self.published,
            "source": self.source,
            "tolerance": self.tolerance,
            "verdict": self.verdict,
            "explanation": self.explanation,
        }


@dataclass(frozen=True)
class Table:
    """Rows that belong together.

    Attributes
    ----------
    title
        Their heading.
    words
        What they are, in plain words.
    rows
        At least one.
    """

    title: str
    words: str
    rows: tuple[Row, ...]

    @property
    def compares(self) -> bool:
        """Whether the document prints any of it."""
        return any(row.published is not None for row in self.rows)


@dataclass(frozen=True)
class Picture:
    """A figure with its heading and words. `name` is its place on the page."""

    name: str
    title: str
    words: str
    figure: Figure


@dataclass(frozen=True, repr=False)
class Study(Record):
    """A finished study.

    Attributes
    ----------
    name
        As the command line spells it.
    title
        Of the report.
    source
        The document.
    answer
        What came out, in a few sentences.
    seeds
        How many.
    tables, pictures
        What was found.
    notes
        How it was done, and what a reader must know, one thing each.
    files
        What else is written, by its name: robots and readings to try on one's own.
    command
        How to make it again, as whoever asked for it calls it; empty if that is not known.
    """

    name: str
    title: str
    source: str
    answer: str
    seeds: int
    tables: tuple[Table, ...]
    pictures: tuple[Picture, ...] = ()
    notes: tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)
    command: str = ""

    @property
    def rows(self) -> tuple[Row, ...]:
        """All rows."""
        return tuple(row for table in self.tables for row in table.rows)

    def count(self, verdict: Verdict) -> int:
        """Return how many rows have this verdict."""
        return sum(row.verdict == verdict for row in self.rows)

    def summary(self) -> dict[str, Any]:
        """Return what ``study.json`` holds."""
        return {
            "truearm": "truearm-study/1",
            "name": self.name,
            "title": self.title,
            "source": self.source,
            "answer": self.answer,
            "seeds": self.seeds,
            "tables": [
                {"title": table.title, "words": table.words, "rows": [row.summary() for row in table.rows]}
                for table in self.tables
            ],
            "pictures": {picture.name: picture.figure for picture in self.pictures},
            "notes": list(self.notes),
        }

    def lines(self) -> list[str]:
        """Return the title, and every figure that has a published one beside it."""
        text = [self.title]
        for table in self.tables:
            if table.compares:
                text.append(f"{table.title}:")
            for row in table.rows:
                if row.published is not None:
                    allowed = "" if row.tolerance is None else f", may differ by {row.tolerance:.2g}"
                    ours = f"{row.what}: {row.median:.3g}, published {row.published:g} {row.unit}{allowed}"
                    text.append(f"  {row.verdict:8}{ours}")
        return text

    def html(self) -> str:
        """Return the report as one HTML page."""
        figures = {picture.name: picture.figure for picture in self.pictures}
        return page("study.html.jinja", figures, study=self, number=number)

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write ``report.html``, ``study.json`` and the study's own files into a folder.

        Returns
        -------
        The files written.
        """
        folder = output_folder(folder)
        text = json.dumps(self.summary(), indent=2, allow_nan=False) + "\n"
        files = {**dict(zip(STUDY_FILES, (self.html(), text), strict=True)), **self.files}
        write_files(folder, files, self.command or None)
        return tuple(folder / name for name in files)


def number(value: float) -> str:
    """Write one of our figures with three significant digits; what is smaller than 1e-12 is rounding."""
    if abs(value) >= 100:
        return f"{value:.0f}"
    return "0" if abs(value) < 1e-12 else f"{value:#.3g}".rstrip(".")
