"""What a study found: our figures beside the published ones, with the reasons where they differ."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from statistics import median

from papers.verdicts import SILENT, VERDICTS, Claim, Comparison, Verdict
from truearm.engine.base.units import Marked
from truearm.engine.base.writing import output_folder, write_files
from truearm.engine.document.document import Block, Words, detail, each, say
from truearm.engine.document.drawing import Figure
from truearm.engine.document.page import page
from truearm.engine.document.records import Record

#: What a study writes into its folder.
STUDY_FILES = ("report.html", "study.json")


@dataclass(frozen=True)
class Row:
    """One figure, ours beside the published one.

    Raises:
        ValueError: If `published` is no number.
    """

    what: str  #: what, unit: what it is of.
    unit: str
    ours: Sequence[float] | float  #: One value a seed; a single number is a figure that no chance enters.
    #: What the document prints, with all its digits ("0.50"); None where it prints nothing.
    published: str | None = None
    source: str = ""  #: Where it prints it.
    claim: Claim = "equal"  #: What is said of the printed figure.
    explanation: str = ""  #: Why it differs, or what it means, in plain words.

    def __post_init__(self) -> None:
        """Refuse a published figure that is no number."""
        _ = self.comparison

    @cached_property
    def comparison(self) -> Comparison | None:
        """Ours beside the published figure; None where nothing is published."""
        return None if self.published is None else Comparison(self.ours, self.published, self.claim)

    @property
    def values(self) -> tuple[float, ...]:
        """Ours, one value a seed."""
        return (float(self.ours),) if isinstance(self.ours, float | int) else tuple(map(float, self.ours))

    @property
    def median(self) -> float:
        """Median of ours."""
        return float(median(self.values))

    @property
    def lowest(self) -> float:
        """Lowest of ours."""
        return min(self.values)

    @property
    def highest(self) -> float:
        """Highest of ours."""
        return max(self.values)

    @property
    def verdict(self) -> Verdict | None:
        """How our median stands to the published figure; None where nothing is published."""
        return None if self.comparison is None else self.comparison.verdict

    def block(self) -> Words:
        """Return it as a line where something is published, and as ``study.json`` holds it."""
        shown = self.comparison
        line = ""
        if shown is not None:
            within = "" if shown.tolerance is None else f", within {shown.tolerance:.2g}"
            line = f"  {self.verdict:16}{self.what}: {self.median:.3g}, published {self.published} {self.unit}".rstrip()
            line += within
        return detail(
            line,
            what=self.what,
            unit=self.unit,
            ours=list(self.values),
            median=self.median,
            lowest=self.lowest,
            highest=self.highest,
            published=None if shown is None else shown.value,
            printed=self.published,
            source=self.source,
            claim=None if shown is None else self.claim,
            tolerance=None if shown is None else shown.tolerance,
            verdict=self.verdict or SILENT,
            explanation=self.explanation,
        )


@dataclass(frozen=True)
class Table:
    """Rows that belong together."""

    title: str  #: Their heading.
    words: str  #: What they are, in plain words.
    rows: tuple[Row, ...]  #: At least one.

    @property
    def compares(self) -> bool:
        """Whether the document prints any of it."""
        return any(row.published is not None for row in self.rows)

    def blocks(self) -> Iterator[Block]:
        """Give its heading, and its rows."""
        yield detail(f"{self.title}:" if self.compares else "", title=self.title, words=self.words)
        yield each("rows", (row.block() for row in self.rows))


@dataclass(frozen=True)
class Picture:
    """A figure with its heading and words. `name` is its place on the page."""

    name: str
    title: str
    words: str
    figure: Figure


@dataclass(frozen=True, repr=False)
class Study(Record):
    """A finished study."""

    name: str  #: As the command line spells it.
    title: str  #: Of the report.
    source: str  #: The document.
    answer: str  #: What came out, in a few sentences.
    seeds: int  #: How many.
    tables: tuple[Table, ...]  #: tables, pictures: what was found.
    pictures: tuple[Picture, ...] = ()
    notes: tuple[str, ...] = ()  #: How it was done, and what a reader must know, one thing each.
    #: What else is written, by its name: robots and readings to try on one's own.
    files: Mapping[str, str] = field(default_factory=dict)
    command: str = ""  #: How to make it again, as whoever asked for it calls it; empty if that is not known.

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """``data``: every study repeats a published experiment on a twin."""
        return ("data",)

    @property
    def written(self) -> tuple[str, ...]:
        """Names of the files that hold it."""
        return (*STUDY_FILES, *self.files)

    @property
    def rows(self) -> tuple[Row, ...]:
        """All rows."""
        return tuple(row for table in self.tables for row in table.rows)

    @property
    def counts(self) -> dict[Verdict, int]:
        """How many rows have each verdict, those that none has included."""
        found = [row.verdict for row in self.rows]
        return {verdict: found.count(verdict) for verdict in VERDICTS}

    def blocks(self) -> Iterator[Block]:
        """Give every figure that has a published one beside it, and how many have which verdict."""
        yield say(self.title, truearm="truearm-study/2", name=self.name, title=self.title, source=self.source)
        yield say(answer=self.answer, seeds=self.seeds, notes=list(self.notes))
        yield each("tables", (table.blocks() for table in self.tables))
        counted = ", ".join(f"{verdict} {count}" for verdict, count in self.counts.items())
        yield say(f"Verdicts: {counted}.", counts=self.counts)
        yield say(pictures={picture.name: picture.figure for picture in self.pictures})

    def html(self) -> str:
        """Return the report as one HTML page."""
        figures = {picture.name: picture.figure for picture in self.pictures}
        return page(
            Path(__file__).with_name("study.html.jinja"), figures, self, study=self, number=number, silent=SILENT
        )

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write ``report.html``, ``study.json`` and the study's own files into a folder.

        Returns:
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
