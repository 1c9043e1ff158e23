"""Texts of the window: everything that came from files, names and messages is escaped here, and only here.

The window shows texts as HTML alone. Its markdown is never used: what it makes of brackets and braces in a name of a
target nobody can foresee.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import Final

from truearm.engine.base.errors import InputError, Notice, printable, with_parameters, with_short_words, worst_first

#: Colours that can be read on white and on dark grey.
_COLOURS: Final = {"note": "#4682b4", "warning": "#c77700", "error": "#d6453d"}
_STYLE: Final = "margin:0.25em 0.75em;font-size:0.85em;overflow-wrap:anywhere"

#: Cells of a table with so few letters stay on one line.
_WHOLE: Final = 18


def plain(text: object) -> str:
    """Return a text as HTML in which nothing is markup, whatever it holds."""
    return escape(with_short_words(printable(str(text))), quote=True)


def one_line(text: object) -> str:
    """Return a text for a label, which is no HTML: what cannot be printed is written out."""
    return printable(str(text))


def paragraph(text: object) -> str:
    """Return a paragraph."""
    return f'<p style="{_STYLE}">{plain(text)}</p>'


def lines(texts: Iterable[str]) -> str:
    """Return what a record prints, line by line, in letters of one width."""
    shown = "\n".join(plain(spelled(text)) for text in texts)
    return f'<pre style="{_STYLE};white-space:pre-wrap;font-family:monospace;font-size:0.78em">{shown}</pre>'


def notices(found: Sequence[Notice]) -> str:
    """Return notices, the worst first, as commands print them."""
    return "".join(notice(one) for one in worst_first(found))


def notice(one: Notice) -> str:
    """Return one notice as commands print it."""
    colour = _COLOURS.get(one.level, _COLOURS["note"])
    return (
        f'<p style="{_STYLE};border-left:3px solid {colour};padding-left:0.5em">'
        f"<b>{plain(one.level.capitalize())} ({plain(one.code)})</b>: {plain(spelled(one.message))}</p>"
    )


def refused(text: str) -> str:
    """Return the words of a refusal, as they stand below an element of a page."""
    edge = f"margin:0 0.75em 0.6em;border-left:3px solid {_COLOURS['error']};padding-left:0.5em"
    return f'<p role="alert" style="{_STYLE};{edge}">{plain(text)}</p>'


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table; cells of numbers stand to the right, as those do whose heads have a unit in brackets."""
    right = ["[" in name for name in head]

    def cell(tag: str, text: object, number: bool) -> str:
        whole = ";white-space:nowrap" if len(str(text)) <= _WHOLE else ""
        style = f"padding:0.15em 0.5em;text-align:{'right' if number else 'left'}{whole}"
        return f'<{tag} style="{style}">{plain(text)}</{tag}>'

    def cells(tag: str, texts: Sequence[object]) -> str:
        return "".join(cell(tag, text, number) for text, number in zip(texts, right, strict=True))

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return (
        f'<div style="{_STYLE};overflow-x:auto"><table style="border-collapse:collapse;width:100%">'
        f"<thead><tr>{cells('th', head)}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def refusal(error: InputError) -> str:
    """Return a refusal in the words of a job: a parameter by its name, as the pages label it."""
    return spelled(error.message(str))


def spelled(text: str) -> str:
    """Return a text of a job in which parameters stand by their names, without backticks."""
    return with_parameters(text, lambda name, value: name if value is None else f"{name}={value}")
