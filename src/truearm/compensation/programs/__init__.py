"""Robot programs, one language a file: where the numbers of their targets stand and what they mean."""

from __future__ import annotations

from typing import Final

from truearm.compensation.programs.program import Language
from truearm.compensation.programs.urscript import URSCRIPT

LANGUAGES: Final[tuple[Language, ...]] = (URSCRIPT,)
