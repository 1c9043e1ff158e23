"""Robot programs, one language a file: where the numbers of their targets stand and what they mean."""

from __future__ import annotations

from typing import Final

from truearm.compensation.programs.krl import KRL
from truearm.compensation.programs.program import Language

LANGUAGES: Final[tuple[Language, ...]] = (KRL,)
