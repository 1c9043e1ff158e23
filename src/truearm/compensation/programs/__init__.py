"""Robot programs, one language a folder: where the numbers of their targets stand and what they mean."""

from __future__ import annotations

from typing import Final

from truearm.compensation.programs.fanuc_ls import FANUC_LS
from truearm.compensation.programs.jbi import JBI
from truearm.compensation.programs.krl import KRL
from truearm.compensation.programs.program import Language
from truearm.compensation.programs.rapid import RAPID
from truearm.compensation.programs.urscript import URSCRIPT
from truearm.compensation.programs.val3 import VAL3

LANGUAGES: Final[tuple[Language, ...]] = (RAPID, KRL, FANUC_LS, URSCRIPT, JBI, VAL3)
