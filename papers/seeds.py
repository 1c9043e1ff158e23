"""The frame of every study: the loop over seeds, here or by workers, and the figures that the seeds found."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, Final, TypeVar

import numpy as np

from papers import Progress
from truearm.engine.base.errors import InputError
from truearm.engine.base.parts import done_parts
from truearm.engine.base.workers import Workers

Outcome = TypeVar("Outcome")
Drawn = TypeVar("Drawn")
#: What one seed finds: a figure for each row, by table and row (as :data:`papers.texts.Rows` has it).
Figures = dict[str, dict[str, float]]

#: Who does the seeds of the study that runs; None where they are done here.
_WORKERS: Final[ContextVar[Workers | None]] = ContextVar("_WORKERS", default=None)


@contextmanager
def seeds_done_by(workers: Workers | None) -> Iterator[None]:
    """Let workers do the seeds of what runs within; the outcomes are the same."""
    mark = _WORKERS.set(workers)
    try:
        yield
    finally:
        _WORKERS.reset(mark)


@dataclass(frozen=True)
class Seed:
    """One repetition of a study."""

    number: int  #: 0, 1, 2 and so on.
    of: int  #: How many seeds there are.
    progress: Progress  #: Called with a few words at each step.
    what: str = "seed"  #: What one of them is called when progress is shown.

    def generator(self) -> np.random.Generator:
        """Return the random numbers of this seed, from their beginning."""
        return np.random.default_rng(self.number)

    def step(self, words: str = "") -> None:
        """Say which seed runs, and with `words` what it does."""
        self.progress(f"{self.what} {self.number + 1} of {self.of}{': ' if words else ''}{words}")


def over_seeds(
    seeds: int, progress: Progress, one: Callable[[Seed], Outcome], what: str = "seed"
) -> tuple[Outcome, ...]:
    """Do something once a seed.

    Args:
        seeds: How often.
        progress: Called with a few words at each seed.
        one: Returns the record of one seed's outcome. It may go to another process: a function of a module, perhaps
            with arguments that it has already (``functools.partial``).
        what: What one seed is called when progress is shown.

    Returns:
        What `one` returned, in the order of the seeds.
    """
    workers = _WORKERS.get()
    if workers is not None:
        return _by_workers(workers, seeds, progress, one, what)
    outcomes = []
    for number in range(seeds):
        seed = Seed(number, seeds, progress, what)
        seed.step()
        outcomes.append(one(seed))
    return tuple(outcomes)


def _by_workers(
    workers: Workers, seeds: int, progress: Progress, one: Callable[[Seed], Outcome], what: str
) -> tuple[Outcome, ...]:
    outcomes: dict[int, Outcome] = {}
    parts = ((one, Seed(number, seeds, _silent, what)) for number in range(seeds))
    progress(f"{what} 0 of {seeds} done")
    for done in done_parts(_outcome, parts, workers, progress):
        if done.result is None:
            raise InputError(
                f"workers died again and again of {what} {done.part[1].number + 1}",
                parameter="workers",
                cure="Take fewer workers, so that each has more memory.",
            )
        outcomes[done.part[1].number] = done.result[0]
        progress(f"{what} {len(outcomes)} of {seeds} done")
    return tuple(outcomes[number] for number in range(seeds))


def _outcome(part: tuple[Callable[[Seed], Any], Seed]) -> tuple[Any]:
    one, seed = part
    return (one(seed),)


def _silent(_: str) -> None:
    """Say nothing: nobody looks at what a worker says."""


def gathered(outcomes: Iterable[tuple[Figures, Drawn]]) -> tuple[dict[str, dict[str, list[float]]], tuple[Drawn, ...]]:
    """Return the figures of all seeds by table and row, one value a seed that has it, and what else seeds found."""
    tables: dict[str, dict[str, list[float]]] = {}
    rest = []
    for figures, more in outcomes:
        rest.append(more)
        for table, rows in figures.items():
            for row, value in rows.items():
                tables.setdefault(table, {}).setdefault(row, []).append(float(value))
    return tables, tuple(rest)
