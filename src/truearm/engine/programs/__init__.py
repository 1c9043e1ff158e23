"""Robot programs, one language a folder: where the numbers of their targets stand and what they mean."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from truearm.engine.programs.fanuc_ls import FANUC_LS
from truearm.engine.programs.jbi import JBI
from truearm.engine.programs.krl import KRL
from truearm.engine.programs.program import Language
from truearm.engine.programs.rapid import RAPID
from truearm.engine.programs.urscript import URSCRIPT
from truearm.engine.programs.val3 import VAL3

LANGUAGES: Final[tuple[Language, ...]] = (RAPID, KRL, FANUC_LS, URSCRIPT, JBI, VAL3)
#: What each language is called as an option.
BY_NAME: Final[Mapping[str, Language]] = {
    re.sub(r"[^a-z0-9]+", "-", language.name.lower()): language for language in LANGUAGES
}
#: What each language is called; FANUC's has a short name as well.
PROGRAM_LANGUAGES: Final[Mapping[str, Language]] = {**BY_NAME, "fanuc": BY_NAME["fanuc-ls"]}
