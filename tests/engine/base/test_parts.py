"""Parts of work: all of them done once, whoever dies."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from tests.engine.base.dying import deadly_once, divided, doubled, thread_setting

from truearm.engine.base.errors import InputError
from truearm.engine.base.parts import done_parts
from truearm.engine.base.workers import Given, Processes, processes, with_workers


class Breaking(Executor):
    """Does what it is given, but breaks as a pool does whose worker died, where a part is deadly."""

    def __init__(self, deadly: Callable[[Any], bool]) -> None:
        self.deadly, self.broken = deadly, False

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        if self.broken:
            raise BrokenExecutor
        future: Future[Any] = Future()
        if self.deadly(args[0]):
            self.broken = True
            future.set_exception(BrokenExecutor())
        else:
            future.set_result(fn(*args))
        return future


class Renewing(Given):
    """Workers of which some parts are deadly."""

    def __init__(self, deadly: Callable[[Any], bool]) -> None:
        super().__init__(Breaking(deadly), in_flight=4)
        self.deadly, self.renewed = deadly, 0

    def renew(self) -> None:
        self.renewed += 1
        self._executor = Breaking(self.deadly)


def collected(workers: Any, numbers: range, told: list[str]) -> dict[int, int | None]:
    found: dict[int, int | None] = {}
    for one in done_parts(doubled, numbers, workers, told.append):
        assert one.part not in found
        found[one.part] = one.result
    return found


def test_parts_are_done_here_one_by_one() -> None:
    assert collected(processes(1), range(5), []) == {n: 2 * n for n in range(5)}


def test_no_more_parts_are_taken_than_may_be_done_at_once() -> None:
    taken: list[int] = []

    def parts() -> Any:
        for number in range(100):
            taken.append(number)
            yield number

    with ThreadPoolExecutor(2) as pool:
        run = done_parts(doubled, parts(), Given(pool, in_flight=3))
        assert [next(run).result is not None for _ in range(10)] == [True] * 10
        assert len(taken) <= 10 + 2 * 3


def test_a_part_that_kills_its_worker_again_and_again_is_given_up_and_the_others_are_done() -> None:
    told: list[str] = []
    workers = Renewing(lambda number: number == 3)
    assert collected(workers, range(10), told) == {n: None if n == 3 else 2 * n for n in range(10)}
    assert workers.renewed == 4
    assert told[0].startswith("a worker died, and ")
    assert told[-1] == "a worker died of the same part again, and the part is given up"


def test_workers_that_die_of_everything_are_given_up() -> None:
    with pytest.raises(InputError, match="end before they have done anything") as caught:
        collected(Renewing(lambda _: True), range(10), [])
    assert caught.value.parameter == "workers"


def test_an_executor_of_somebody_else_is_not_replaced() -> None:
    with pytest.raises(InputError, match="the workers of the executor are gone") as caught:
        collected(Given(Breaking(lambda number: number == 1)), range(5), [])
    assert caught.value.parameter == "executor"
    assert "Make a new one" in str(caught.value.cure)


class Odd(Executor):
    """Raises an error, or returns something, in the place of a future."""

    def __init__(self, found: object) -> None:
        self.found = found

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Any:
        if isinstance(self.found, Exception):
            raise self.found
        return self.found


def failed(error: Exception) -> Future[Any]:
    future: Future[Any] = Future()
    future.set_exception(error)
    return future


def shut_down() -> Executor:
    pool = ThreadPoolExecutor(1)
    pool.shutdown()
    return pool


@pytest.mark.parametrize(
    ("executor", "words", "came"),
    [
        (shut_down(), "the executor takes no work", "RuntimeError: cannot schedule new futures after shutdown"),
        (Executor(), "the executor takes no work", "NotImplementedError"),
        (ThreadPoolExecutor.__new__(ThreadPoolExecutor), "the executor takes no work", "AttributeError: "),
        (Odd(MemoryError()), "the executor takes no work", "MemoryError"),
        (Odd(42), "does not return futures as concurrent.futures has them", "int"),
        (Odd(failed(MemoryError())), "the executor has not done a part of the work", "MemoryError"),
        (Odd(failed(TypeError("cannot pickle 'x'"))), "the executor has not done a part", "TypeError: cannot pickle"),
    ],
    ids=["shut down", "no executor at all", "not begun", "no memory", "no future", "no memory there", "not pickled"],
)
def test_executors_that_do_nothing_are_refused_by_what_they_raise(executor: Executor, words: str, came: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        collected(Given(executor), range(5), [])
    assert caught.value.parameter == "executor"
    assert str(caught.value.came).startswith(came)


def test_a_refusal_of_the_work_is_no_fault_of_the_executor() -> None:
    with pytest.raises(InputError, match="there is no such file"):
        collected(Given(Odd(failed(InputError("there is no such file")))), range(5), [])


def test_an_error_of_the_work_comes_out() -> None:
    with pytest.raises(ZeroDivisionError):
        list(done_parts(divided, [0, 1], processes(1)))


def test_a_process_that_dies_is_replaced_and_its_part_repeated(tmp_path: Path) -> None:
    told: list[str] = []
    before = os.environ.get("OPENBLAS_NUM_THREADS")
    with with_workers(Processes(1)) as workers:
        tasks = [(tmp_path / "mark", number) for number in range(5)]
        found = {one.part[1]: one.result for one in done_parts(deadly_once, tasks, workers, told.append)}
        assert {one.result for one in done_parts(thread_setting, [1], workers)} == {"1"}
    assert found == {n: 2 * n for n in range(5)}
    assert len(told) == 1
    assert told[0].startswith("a worker died, and ")
    assert os.environ.get("OPENBLAS_NUM_THREADS") == before
