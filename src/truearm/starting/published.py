"""Where the published experiments are: beside the package in a checkout, and in no installation."""

from __future__ import annotations

import sys
from pathlib import Path

import truearm
from truearm.engine.base.errors import InputError


def find_papers() -> None:
    """Let the published experiments be imported, which lie beside the package in a checkout.

    Raises:
        InputError: If this is an installation, which has none.
    """
    root = Path(truearm.__file__).parents[2]
    if not (root / "papers" / "__init__.py").is_file():
        raise InputError(
            "the published experiments are no part of an installation",
            parameter="study",
            cure="Get the source of truearm, where they are in papers/, and run the command there.",
        )
    if str(root) not in sys.path:
        sys.path.insert(0, str(root))
