"""Parts of great work, done by whoever there is: a bounded number at once, results as they come, the lost repeated."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

from truearm.errors import InputError
from truearm.executing.workers import Workers
from truearm.shown import counted

Part = TypeVar("Part")
Result = TypeVar("Result")

#: How often workers may die of a part that is done alone before it is given up.
_MOST_DEATHS: Final = 3
#: How often workers may die one after the other before any part is done.
_MOST_IN_A_ROW: Final = 10
#: How long to wait before looking after the workers [s].
_PATIENCE: Final = 1.0


@dataclass(frozen=True)
class Done(Generic[Part, Result]):
    """A part with its result; lost, and without one, if the workers that did it died again and again."""

    part: Part
    result: Result | None
    lost: bool = False


def done_parts(
    work: Callable[[Part], Result],
    parts: Iterable[Part],
    workers: Workers,
    tell: Callable[[str], None] = lambda _: None,
) -> Iterator[Done[Part, Result]]:
    """Do parts of work, and return each as soon as it is done.

    Where a worker dies, new ones are started. Nobody knows of which of the parts that were being done it died, so they
    are repeated one by one; one that kills its worker again and again is given up.

    Args:
        work: A function of a module; it and the parts go to other processes.
        parts: Taken as workers ask for them.
        workers: Who does them.
        tell: Called with what happened to workers.

    Raises:
        InputError: If the workers are gone and cannot be replaced, or all end before they have done anything.
    """
    run = _Run(work, iter(parts), workers, tell)
    try:
        yield from run.results()
    finally:
        for future in run.running:
            future.cancel()


class _Run(Generic[Part, Result]):
    """What is being done, and what will be repeated alone because a worker died while it was done."""

    def __init__(
        self,
        work: Callable[[Part], Result],
        parts: Iterator[Part],
        workers: Workers,
        tell: Callable[[str], None],
    ) -> None:
        self._work, self._parts, self._workers, self._tell = work, parts, workers, tell
        self.running: dict[Future[Result], Part] = {}
        self._suspects: deque[tuple[Part, int]] = deque()  # with how often a worker died of them alone
        self._alone: int | None = None  # of the suspect that is being done
        self._in_a_row = 0

    def results(self) -> Iterator[Done[Part, Result]]:
        """Go on until every part is done or given up."""
        while self._hand_out():
            finished, _ = wait(self.running, _PATIENCE, FIRST_COMPLETED)
            for words in self._workers.news():
                self._tell(words)
            broken: BaseException | None = None
            for future in finished:
                try:
                    result = future.result()
                except self._workers.lost:
                    yield Done(self._taken(future), None, lost=True)
                except (BrokenExecutor, CancelledError) as error:
                    broken = error
                except InputError:
                    raise
                except Exception as error:
                    refusal = self._workers.refusal(error)
                    if refusal is None:
                        raise
                    raise refusal from error
                else:
                    self._in_a_row = 0
                    yield Done(self._taken(future), result)
            if broken is not None:
                yield from self._broken(broken)

    def _taken(self, future: Future[Result]) -> Part:
        self._alone = None
        return self.running.pop(future)

    def _hand_out(self) -> bool:
        """Hand out as many parts as may be done at once; return whether any is being done."""
        while not self._suspects and len(self.running) < self._workers.in_flight:
            found = next(((part,) for part in self._parts), None)
            if found is None:
                break
            if not self._handed(found[0]):
                self._suspects.append((found[0], 0))
        while self._suspects and not self.running:
            part, self._alone = self._suspects[0]
            if self._handed(part):
                self._suspects.popleft()
            else:
                self._renew()
        return bool(self.running)

    def _handed(self, part: Part) -> bool:
        """Hand out a part; False if a worker has just died."""
        future = self._workers.handed(self._work, part)
        if future is None:
            return False
        self.running[future] = part
        return True

    def _broken(self, reason: BaseException) -> Iterator[Done[Part, Result]]:
        """Repeat what was being done, or give up the part of which a worker died alone too often."""
        held = [*self.running.values()]
        self.running.clear()
        deaths = 0 if self._alone is None else self._alone + 1
        self._alone = None
        given_up = deaths == _MOST_DEATHS
        if given_up:
            self._tell("a worker died of the same part again, and the part is given up")
        else:
            self._tell(f"a worker died, and {counted(len(held), 'part')} will be repeated")
            self._suspects.extendleft((part, deaths) for part in reversed(held))
        try:
            self._renew()
        except InputError as error:
            raise error from reason
        if given_up:
            yield Done(held[0], None, lost=True)

    def _renew(self) -> None:
        self._in_a_row += 1
        if self._in_a_row > _MOST_IN_A_ROW:
            raise InputError(
                "worker processes end before they have done anything",
                parameter="workers",
                cure="Look at what they print. In a script that Python runs, call the job below: "
                "if __name__ == '__main__'.",
            )
        self._workers.renew()
