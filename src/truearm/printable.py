"""Text from files and command lines as it may be shown: nothing in it steers a terminal or hides what stands there."""

from __future__ import annotations

import re
import unicodedata
from typing import Final

#: Controls, halves of characters, breaks of lines and paragraphs, by their Unicode categories.
_UNSEEN: Final = ("Cc", "Cs", "Zl", "Zp")
#: What turns the direction of the text around it (Unicode Standard Annex 9): ``gpj.exe`` is shown as ``exe.jpg``.
TURNING: Final = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
#: A word of more characters is no word that anybody reads; paths are shorter.
LONGEST_WORD: Final = 300
_LONG_WORD: Final = re.compile(rf"\S{{{LONGEST_WORD + 1},}}")


def is_one_line(text: str) -> bool:
    """Return whether a text is one line that can be seen: not blank, without breaks and control characters."""
    return bool(text.strip()) and not any(_steers(character) for character in text)


def printable(text: str) -> str:
    r"""Return a text as one line that can be shown: control characters as their escapes, such as ``\x1b``."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(_escaped(character) if _steers(character) else character for character in text)


def shortened(text: str, longest: int) -> str:
    """Return a text, without its middle if it has more than `longest` characters."""
    if len(text) <= longest:
        return text
    tail = longest // 4
    return f"{text[: longest - tail - 3]}...{text[-tail:]}"


def with_short_words(text: str) -> str:
    """Return a text in which very long words, such as a name of 5000 characters, have lost their middle."""
    return _LONG_WORD.sub(lambda found: shortened(found[0], LONGEST_WORD), text)


def _steers(character: str) -> bool:
    return unicodedata.category(character) in _UNSEEN or character in TURNING


def _escaped(character: str) -> str:
    return ascii(character)[1:-1]
