"""A page of a few sentences, tables and pictures: what results have that need no page of their own kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from truearm.notices import Notice, worst_first
from truearm.reporting.drawing import Figure
from truearm.reporting.page import page
from truearm.simulated import without_mark


@dataclass(frozen=True, eq=False)
class Drawing:
    """A picture on a page."""

    name: str  #: Of its place on the page.
    title: str  #: title, words: above it.
    words: str
    figure: Figure  #: What is drawn.


@dataclass(frozen=True)
class Figures:
    """A table on a page."""

    title: str  #: Above it.
    heading: tuple[str, ...]  #: Names of the columns; those after the first are numbers, if they are not in `texts`.
    rows: tuple[tuple[str, ...], ...]  #: Its cells, row by row.
    texts: tuple[int, ...] = ()  #: Columns of words, from 0, whose cells go on in another line where there is no room.


def picture_page(
    title: str,
    subtitle: str,
    words: Sequence[str],
    command: str,
    of: object,
    *,
    pictures: Sequence[Drawing],
    tables: Sequence[Figures] = (),
    details: Sequence[Figures] = (),
    notices: Sequence[Notice] = (),
) -> str:
    """Return the page.

    Args:
        title, subtitle: At its head.
        words: What was found, a sentence each.
        command: How to run it again.
        of: The record that it tells about.
        pictures, tables: What is shown.
        details: Tables below the pictures.
        notices: What to know about the result.
    """
    return page(
        "pictures.html.jinja",
        {picture.name: picture.figure for picture in pictures},
        of,
        title=title,
        subtitle=subtitle,
        words=without_mark(words),
        command=command,
        pictures=pictures,
        tables=tables,
        details=details,
        notices=worst_first(notices),
    )
