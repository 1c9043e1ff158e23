"""``--device inclinometers`` of ``truearm plan`` and ``truearm simulate``: other jobs, other words on some options."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Final

import typer

from truearm.errors import InputError

#: The device, which reads links and no targets as the others do.
INCLINOMETERS: Final = "inclinometers"

Pull = Annotated[
    float | None,
    typer.Option(
        metavar="N",
        min=0.0,
        help="Of a string or weight on the flange under which inclinometers are read; 0: gravity alone.",
        show_default="20",
    ),
]


def refuse_pull(pull: float | None) -> None:
    """Refuse a pull for any other device."""
    if pull is not None:
        raise InputError(
            "only inclinometers are read under a pull",
            parameter="pull",
            came=pull,
            cure=f"Leave `pull` out, or use `device={INCLINOMETERS}`.",
        )


def refuse_beside(given: Mapping[str, object]) -> None:
    """Refuse what says nothing for inclinometers; None was not given."""
    for name, came in given.items():
        if came is not None:
            raise InputError(
                "this says nothing for inclinometers", parameter=name, came=str(came), cure=f"Leave `{name}` out."
            )


def even_poses(text: str) -> int:
    """Return how many configurations a text names."""
    try:
        return int(text)
    except ValueError:
        raise InputError(
            "for inclinometers a number of configurations belongs here",
            parameter="poses",
            came=text,
            allowed="an even number",
        ) from None
