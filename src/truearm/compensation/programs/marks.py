"""The comment by which a person, and truearm, knows a corrected program: by what it was corrected, and when."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date
from typing import Final

from truearm import __version__
from truearm.compensation.programs.lines import line_end

#: What stands in a program that was written corrected, in a comment of its own.
MARK: Final = "corrected by truearm"
#: FANUC's and Yaskawa's controllers take no longer comments [characters].
_LONGEST: Final = 32
#: Controllers and editors may change letters and blanks.
_MARKED: Final = re.compile(rf"({MARK.replace(' ', ' +')}(?: +\d[\w.+]*+)?)[ \t;>-]*(?=[\r\n]|\Z)", re.IGNORECASE)
_LINE_END: Final = re.compile(r"[\r\n]|\Z")
#: What ends a comment in some language, or what a controller may not read.
_UNSAFE: Final = re.compile(r"[^A-Za-z0-9 ./+-]|-(?=-)")


def correction_comment(day: date, robot: str = "", calibration: str = "") -> tuple[str, ...]:
    """Return the lines that name a program as corrected, in ASCII, 32 characters at most.

    Args:
        day: When it was corrected.
        robot: For which robot; empty if that stands there already.
        calibration: Hash of the robot's file; empty if it has none.
    """
    made = f"{day.isoformat()}, calibration {calibration[:8]}" if calibration else day.isoformat()
    lines = [f"{MARK} {__version__}", made, *([f"for {_UNSAFE.sub('_', robot)}"] if robot else [])]
    return tuple(line[:_LONGEST].rstrip() for line in lines)


def comment_of(text: str) -> str | None:
    """Return the words in a text that name it as corrected; None if there are none.

    They have a line of their own, without other words before them.
    """
    for found in _MARKED.finditer(text):
        before = max(text.rfind("\n", 0, found.start()), text.rfind("\r", 0, found.start())) + 1
        if not re.search("[A-Za-z]", text[before : found.start()]):
            return found[1]
    return None


def with_lines_behind(text: str, place: int, lines: Sequence[str], comment: str | None) -> str:
    """Return a text with lines of comment behind the one that a place is on.

    Args:
        place: Behind the last word that has to stand before them. What follows on its line goes to a line behind them,
            unless it is a comment.
        comment: How comments begin that last to the end of the line; None if no comment does.
    """
    end = _LINE_END.search(text, place)
    stop = end.start() if end else len(text)
    rest, break_ = text[place:stop].strip(), line_end(text, place)
    if not rest or (comment is not None and rest.startswith(comment)):
        return text[:stop] + "".join(break_ + line for line in lines) + text[stop:]
    return text[:place] + "".join(break_ + line for line in lines) + break_ + text[place:]
