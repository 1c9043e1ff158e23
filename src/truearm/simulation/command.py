"""``truearm simulate``: with a pull that only inclinometers know."""

from __future__ import annotations

import inspect
from typing import Any, Final

from truearm.engine.command.options import Pull, command_of, refuse_pull
from truearm.simulation.jobs import Simulate

_MADE: Final = command_of(Simulate)


def simulate(*, pull: float | None, **given: Any) -> None:
    """Simulate, without a pull."""
    refuse_pull(pull)
    _MADE(**given)


_PULL: Final = inspect.Parameter("pull", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=Pull)
*_ASKED, _JSON = inspect.signature(_MADE).parameters.values()
simulate.__signature__ = inspect.Signature([*_ASKED, _PULL, _JSON])  # type: ignore[attr-defined]
simulate.__annotations__ = {one.name: one.annotation for one in (*_ASKED, _PULL, _JSON)}
simulate.__doc__ = _MADE.__doc__
