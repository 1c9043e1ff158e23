"""The one exception for input that cannot be used."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class InputError(ValueError):
    """Input that truearm refuses, with everything a person needs to mend it.

    Parameters
    ----------
    what
        What is wrong, in plain words.
    where
        File, row, column or option.
    came
        What was found there.
    allowed
        What would have been valid.
    cure
        What to do.
    """

    def __init__(
        self,
        what: str,
        *,
        where: str | None = None,
        came: object = None,
        allowed: str | None = None,
        cure: str | None = None,
    ) -> None:
        self.what, self.where, self.came, self.allowed, self.cure = what, where, came, allowed, cure
        parts = [f"{where}: {what}" if where else what]
        if came is not None:
            parts.append(f"got {_shown(came)}")
        if allowed is not None:
            parts.append(f"allowed: {allowed}")
        message = "; ".join(parts).rstrip(".") + "."
        super().__init__(f"{message} {cure}" if cure else message)


def _shown(came: object) -> str:
    if isinstance(came, int) and came.bit_length() > 300:  # Python may refuse to write it out
        return "a number of very many digits"
    text = repr(came) if isinstance(came, str) else str(came)
    return text if len(text) <= 500 else f"{text[:497]}..."


def nearest_names(name: str, known: Iterable[str], count: int = 3, likeness: float = 0.5) -> list[str]:
    """Return the known names most like `name`, best first, for a message that offers them.

    Parameters
    ----------
    likeness
        How like they must be, 0 to 1.
    """
    by_folded = {candidate.lower(): candidate for candidate in known}
    return [by_folded[match] for match in difflib.get_close_matches(name.lower(), by_folded, count, likeness)]
