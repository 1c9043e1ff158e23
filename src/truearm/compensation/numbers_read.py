"""Programs that compute with the numbers of their targets: what they compute changes with a correction."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final

from truearm.compensation.correction import Correction
from truearm.compensation.programs.program import Language

#: A name without index, or with the beginning of one: ``pRow``, ``P[13``.
_BEGINNINGS: Final = (re.compile(r"\w+"), re.compile(r"\w+\[\d+"))


def numbers_read(language: Language, corrections: Sequence[Correction]) -> list[str]:
    """Return where programs read numbers of targets that are corrected: file, line and what is read."""
    return [where for one in corrections for where in _read_in(language, one)]


def _read_in(language: Language, correction: Correction) -> Iterator[str]:
    program = correction.program
    corrected = {target.name for row, target in enumerate(program.targets) if correction.corrected[row]}
    names = {
        found[0].lower() for name in corrected for begins in _BEGINNINGS if (found := begins.match(name)) is not None
    }
    for source in program.sources:
        for found in language.reads.finditer(source.text) if language.reads is not None else ():
            if found[1] is not None and found[1].lower() in names:
                line = source.text.count("\n", 0, found.start()) + 1
                yield f"{source.where(line)}: {' '.join(found[0].split())}"
