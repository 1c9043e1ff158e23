"""The help of ``truearm study``, which is made where the studies are."""

from __future__ import annotations

from truearm.engine.base.errors import InputError
from truearm.starting.published import find_papers


def study_help() -> str:
    """Return the help of ``truearm study``, which lists the studies where they are."""
    told = [
        "Make a published experiment again and set our figures beside the printed ones, over several seeds.",
        "Writes report.html and study.json into DIR. The studies:",
    ]
    try:
        find_papers()
    except InputError as error:
        return "\n\n".join([*told, error.message(str)])
    from papers import STUDIES

    return "\n\n".join(
        [*told, *(f"{entry.name}: {entry.about}{' (with --data)' if entry.files else ''}" for entry in STUDIES)]
    )
