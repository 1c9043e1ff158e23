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

#: How often workers that die take a part with them before it is given up.
_MOST_DEATHS: Final = 3
#: Pools whose workers all died one after the other before any part was done.
_MOST_POOLS: Final = 3
#: How long to wait before looking after the workers [s].
_PATIENCE: Final = 1.0


class WorkerLost(Exception):
    """What an executor raises that has repeated a part on several workers and lost them all."""


@dataclass(frozen=True)
class Done(Generic[Part, Result]):
    """A part with its result; None if the workers that did it died again and again."""

    part: Part
    result: Result | None


def done_parts(
    work: Callable[[Part], Result],
    parts: Iterable[Part],
    workers: Workers,
    tell: Callable[[str], None] = lambda _: None,
    lost: tuple[type[BaseException], ...] = (),
) -> Iterator[Done[Part, Result]]:
    """Do parts of work, and return each as soon as it is done.

    Where a worker dies, new ones are started. Nobody knows which of the parts that were being done killed it, so they
    are repeated one by one; the one that kills its worker again and again is given up.

    Parameters
    ----------
    work
        A function of a module; it and the parts go to other processes.
    parts
        Taken as workers ask for them.
    workers
        Who does them.
    tell
        Called with what happened to workers.
    lost
        What the executor raises for a part that its workers died of.

    Raises
    ------
    InputError
        If the workers are gone and cannot be replaced.
    """
    return _Run(work, iter(parts), workers, tell, (WorkerLost, *lost)).results()


class _Run(Generic[Part, Result]):
    """Parts that are waiting, being done, and suspected of having killed a worker."""

    def __init__(
        self,
        work: Callable[[Part], Result],
        parts: Iterator[Part],
        workers: Workers,
        tell: Callable[[str], None],
        lost: tuple[type[BaseException], ...],
    ) -> None:
        self.work, self.parts, self.workers, self.tell, self.lost = work, parts, workers, tell, lost
        self.running: dict[Future[Result], Part] = {}
        self.suspects: deque[tuple[Part, int]] = deque()
        self.alone = 0  # deaths of the one suspect that runs by itself
        self.pools = 0

    def results(self) -> Iterator[Done[Part, Result]]:
        try:
            while self._hand_out():
                finished, _ = wait(self.running, _PATIENCE, FIRST_COMPLETED)
                for words in self.workers.news():
                    self.tell(words)
                broken = False
                for future in finished:
                    part = self.running[future]
                    try:
                        result = future.result()
                    except self.lost:
                        del self.running[future]
                        yield Done(part, None)
                        continue
                    except (BrokenExecutor, CancelledError) as error:
                        broken = True
                        reason = error
                        continue
                    del self.running[future]
                    self.alone = self.pools = 0
                    yield Done(part, result)
                if broken:
                    yield from self._again(reason)
        finally:
            for future in self.running:
                future.cancel()

    def _hand_out(self) -> bool:
        """Hand out as many parts as may be done at once; return whether any is being done."""
        try:
            if self.suspects:
                if not self.running:
                    part, self.alone = self.suspects[0]
                    self.running[self.workers.executor.submit(self.work, part)] = part
                    self.suspects.popleft()
                return True
            while len(self.running) < self.workers.in_flight:
                part = next(self.parts, None)  # type: ignore[arg-type]
                if part is None:
                    break
                try:
                    future = self.workers.executor.submit(self.work, part)
                except BrokenExecutor:  # a worker has died meanwhile
                    self.suspects.append((part, 0))
                    if not self.running:
                        self._renew()
                    return True
                self.running[future] = part
        except BrokenExecutor:
            self._renew()
            return True
        return bool(self.running)

    def _again(self, reason: BaseException) -> Iterator[Done[Part, Result]]:
        """Put the parts that were being done among the suspects; give up the one that was alone too often."""
        held = [*self.running.values()]
        self.running.clear()
        if len(held) == 1 and self.alone + 1 >= _MOST_DEATHS:
            self.tell("a worker died of the same part again, and the part is given up")
            self._renew()
            yield Done(held[0], None)
            self.alone = 0
            return
        deaths = self.alone + 1 if len(held) == 1 else 0
        self.tell(f"a worker died, and {counted(len(held), 'part')} will be repeated")
        self.suspects.extendleft((part, deaths) for part in reversed(held))
        self.alone = 0
        try:
            self._renew()
        except InputError as error:
            raise error from reason

    def _renew(self) -> None:
        self.pools += 1
        if self.pools > _MOST_POOLS * _MOST_DEATHS:
            raise InputError(
                "worker processes end before they have done anything",
                parameter="workers",
                cure="Look at what they print. In a script that Python runs, call the job below: "
                "if __name__ == '__main__'.",
            )
        if not self.workers.renew():
            raise InputError(
                "the workers are gone",
                parameter="workers",
                cure="Start them again and run this again: what is on disk is not computed twice.",
            )
