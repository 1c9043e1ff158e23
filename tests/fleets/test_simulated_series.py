"""A series simulated: robot by robot what one calibration finds, whatever is computed beside it; resumed; refused."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import shutil
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from threading import Barrier
from typing import Any

import numpy as np
import pytest
from tests.expecting import known
from tests.expecting import refused as said_of

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import named_model
from truearm.fleets import recorded
from truearm.fleets.manifest import experiment, read_manifest
from truearm.fleets.parts import Task
from truearm.fleets.parts import finished as done_part
from truearm.fleets.recorded import Recorded
from truearm.fleets.result import Fleet, Run
from truearm.fleets.series import Experiment, ExperimentEntry, Row, Series, calibrated

ASKED = ExperimentEntry("irb120", 6, 15, 1, "geometric", 5e-5, 8, 3)


def manifest(folder: Path, chunk: int = 2, name: str = "fleet.yaml", **entries: Any) -> Path:
    asked = {"robot": "irb120", "count": 5, "configurations": 12, "noise": 0.05, "held_out": 5, "model": "offsets"}
    text = json.dumps(
        {"truearm": "truearm-fleet/1", "units": {"length": "mm"}, "experiment": {**asked, **entries}, "chunk": chunk}
    )
    (folder / name).write_text(text)
    return folder / name


def refused(file: Path, out: Path, **options: Any) -> InputError:
    """Return what is said of a fleet that is refused; of one worker, if nothing else is said."""
    with pytest.raises(InputError) as caught:
        truearm.fleet(file, out=out, **(options or {"workers": 1}))
    return caught.value


def without_seconds(rows: list[Row]) -> list[dict[str, Any]]:
    return [{name: value for name, value in row.content().items() if name != "seconds"} for row in rows]


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a fleet that is done."""
    folder = tmp_path_factory.mktemp("finished")
    truearm.fleet(manifest(folder), out=folder / "out", workers=1)
    return folder / "out"


def test_each_robot_is_what_one_calibration_of_it_finds() -> None:
    series = Series(experiment(ASKED))
    free, rng = series.problem.free, np.random.default_rng(0)
    truth = free.nominal + free.prior * series.drawn * rng.standard_normal((1, len(free.names)))
    readings = series.problem.at(truth).residual + rng.standard_normal((1, series.problem.rows))
    estimates, _, settled = calibrated(series.problem, readings)
    data = series.problem.data
    moved = data.position + readings[0].reshape(-1, 3) * known(data.sigma)[:, None]
    fit = identify(series.experiment.robot, replace(data, position=moved), named_model("geometric"))
    alone = np.array([fit.robot.parameters[name].value for name in free.names])
    assert settled.all()
    assert np.abs((estimates[0] - alone) / free.prior).max() < 0.05


def test_errors_are_those_of_the_drawn_robot() -> None:
    series = Series(experiment(ASKED))
    rows = series.rows(range(6))
    for row in rows:
        assert (row.status, known(row.truth).n) == ("calibrated", 8)
        assert known(row.truth).mean < known(row.held_out).mean < known(row.nominal).mean / 5
        off = [abs(p.value - (p.truth or 0.0)) / p.deviation for p in row.parameters.values() if p.deviation > 0]
        assert np.mean(np.array(off) < 3.0) > 0.9
    assert len({row.parameters["a_2"].truth for row in rows}) == 6


def test_robots_beside_it_change_no_digit() -> None:
    series = Series(experiment(ASKED))
    together = without_seconds(series.rows(range(6)))
    alone = [row for number in (5, 4, 3, 2, 1, 0) for row in without_seconds(series.rows([number]))]
    assert together == alone[::-1]


def test_parts_and_who_computes_them_change_no_digit(tmp_path: Path) -> None:
    by_one = truearm.fleet(manifest(tmp_path, 5), out=tmp_path / "one", workers=1)
    with ThreadPoolExecutor(2) as executor:
        other = truearm.fleet(manifest(tmp_path, 1), out=tmp_path / "other", executor=executor)
    two = truearm.fleet(manifest(tmp_path, 3), out=tmp_path / "two", workers=2)
    rows = [without_seconds([*fleet.recorded.rows()]) for fleet in (by_one, other, two)]
    assert rows[0] == rows[1] == rows[2]
    (table,) = {(tmp_path / folder / "robots.csv").read_text() for folder in ("one", "other", "two")}
    assert table.startswith("name,of,date,status,")


class Counting(Executor):
    """Does what it is given at once, and counts."""

    def __init__(self, inner: Executor) -> None:
        self.inner, self.count = inner, 0

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Any:
        self.count += 1
        return self.inner.submit(fn, *args, **kwargs)


def test_what_is_on_disk_is_not_computed_twice(tmp_path: Path) -> None:
    file, out = manifest(tmp_path), tmp_path / "out"

    def stop(words: str) -> None:
        if words.startswith("part 2 of 3"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        truearm.fleet(file, out=out, workers=1, progress=stop)
    assert str(caught.value) == "Stopped: 2 of 3 parts are on disk; run it again to go on."
    assert len([*out.rglob("*.jsonl")]) == 2
    assert not (out / "fleet.json").exists()
    with ThreadPoolExecutor(1) as inner:
        executor = Counting(inner)
        fleet = truearm.fleet(file, out=out, executor=executor)
        assert executor.count == 1
        assert fleet.run == Run(3, 2)
        again = truearm.fleet(file, out=out, executor=executor)
        assert executor.count == 1
    whole = truearm.fleet(file, out=tmp_path / "whole", workers=1)
    assert again.content() == fleet.content() == whole.content()


def test_a_full_disk_is_named_and_what_was_written_before_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, out = manifest(tmp_path), tmp_path / "out"
    right = os.fsync

    def full(handle: int) -> None:
        if len([*out.rglob("*.jsonl")]) == 1:
            raise OSError(errno.ENOSPC, "No space left on device")
        right(handle)

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(InputError, match="No space left on device"):
            truearm.fleet(file, out=out, workers=1)
    assert [path.name for path in out.rglob("*") if path.is_file()] == ["record.json", "0000001.jsonl"]
    assert truearm.fleet(file, out=out, workers=1).run.before == 1


def test_a_folder_belongs_to_its_manifest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = tmp_path / "plan.csv"
    truearm.simulate("irb120", truth="nominal", poses=12, noise=0.0, out=plan)
    file, out = manifest(tmp_path, configurations="plan.csv"), tmp_path / "out"
    truearm.fleet(file, out=out, workers=1)
    truearm.fleet(file, out=out, workers=1)
    other = manifest(tmp_path, name="other.yaml", configurations="plan.csv", seed=2)
    assert "of another manifest" in str(refused(other, out))
    truearm.simulate("irb120", truth="nominal", poses=12, noise=0.0, seed=1, out=plan)
    refusal = refused(file, out)
    assert "has changed since" in str(refusal)
    assert refusal.came == "plan.csv"
    monkeypatch.setattr(recorded, "__version__", "99.0")
    assert "another version of truearm" in str(refused(file, out))


def test_folders_of_others_are_refused(tmp_path: Path) -> None:
    file = manifest(tmp_path)
    for name, content in (("record.json", "{}"), ("record.json", "no JSON"), ("fleet.json", "mine")):
        out = tmp_path / f"out-{content}"
        out.mkdir()
        (out / name).write_text(content)
        assert refused(file, out).where is not None
        assert (out / name).read_text() == content
    (tmp_path / "out" / "parts" / "mine").mkdir(parents=True)
    assert "whose it is" in str(refused(file, tmp_path / "out"))


DAMAGES: dict[str, Callable[[str], str]] = {
    "another file": lambda _: "{}\n",
    "no JSON": lambda _: "no JSON\n",
    "a robot less": lambda text: "".join(text.splitlines(keepends=True)[:-2]),
    "no hash": lambda text: "".join(text.splitlines(keepends=True)[:-1]),
    "another figure": lambda text: re.sub(r'"mean_mm":[0-9.]+', '"mean_mm":0.001', text, count=1),
    "a figure that is none": lambda text: re.sub(r'"mean_mm":[0-9.]+', '"mean_mm":NaN', text, count=1),
    "a huge figure": lambda text: re.sub(r'"mean_mm":[0-9.]+', '"mean_mm":1e308', text, count=1),
    "a list for a figure": lambda text: re.sub(r'"mean_mm":[0-9.]+', '"mean_mm":[]', text, count=1),
    "an unknown unit": lambda text: text.replace('"rad"', '"ft"', 1),
    "a robot beside it": lambda text: text.replace('"robot-3"', '"robot-9"'),
    "files elsewhere": lambda text: text.replace('"written": []', '"written": ["../../x"]'),
    "a number for files": lambda text: text.replace('"written": []', '"written": 3'),
    "robots that changed": lambda text: text.replace('"changed": []', '"changed": ["robot-1"]'),
    "a number for names": lambda text: text.replace('"changed": []', '"changed": 3'),
    "another number": lambda text: text.replace('"part": 2', '"part": 1'),
    "a negative deviation": lambda text: re.sub(r'"deviation":\[[0-9.]+', '"deviation":[-1', text, count=1),
    "an infinite value": lambda text: re.sub(r'"value":\[[-0-9.e]+', '"value":[1e999', text, count=1),
    "no values": lambda text: re.sub(r'"value":\[[^]]*\],', "", text, count=1),
    "a text for a time": lambda text: re.sub(r'"seconds":[0-9.e-]+', '"seconds":"1"', text, count=1),
    "another status": lambda text: text.replace('"calibrated"', '"fine"', 1),
    "an entry more": lambda text: text.replace('"status"', '"more":1,"status"', 1),
    "a list for a robot": lambda text: "[]\n".join(text.splitlines(keepends=True)[:1]) + "[]\n",
}


#: Only the hash tells of these.
HASH_ALONE = ("a robot less", "no hash", "another figure")


def test_a_part_that_is_not_as_it_was_written_is_named(
    tmp_path: Path, finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, out = manifest(tmp_path), shutil.copytree(finished, tmp_path / "out")
    part = out / "parts" / "0000" / "0000002.jsonl"
    whole, begun = part.read_text(), list[object]()
    monkeypatch.setattr("truearm.fleets.running._computed", lambda *arguments: begun.append(arguments))
    for damage, damaged in DAMAGES.items():
        begun.clear()
        part.write_text(damaged(whole))
        refusal = refused(file, out)
        assert (refusal.where, refusal.parameter, begun) == (str(part), "out", []), damage
        if damage not in HASH_ALONE:  # and it is named with the hash of its changes too
            text = damaged("".join(whole.splitlines(keepends=True)[:-1]))
            assert text != "".join(whole.splitlines(keepends=True)[:-1]), damage
            part.write_text(text + json.dumps({"sha256": hashlib.sha256(text.encode()).hexdigest()}) + "\n")
            refusal = refused(file, out)
            message_and_place = (refusal.what, refusal.where)
            assert message_and_place == ("this part of the fleet is not as it was written", str(part)), damage


class Exchanging(Executor):
    """Returns something else than it was asked for."""

    def __init__(self, wrong: Callable[[Any, Any], object]) -> None:
        self.wrong = wrong

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Any:
        future: Future[Any] = Future()
        future.set_result(self.wrong(fn, args[0]))
        return future


@pytest.mark.parametrize(
    ("wrong", "stated"),
    [
        (lambda work, task: "foo", "an object of type str came back"),
        (lambda work, task: None, "an object of type NoneType came back"),
        (lambda work, task: replace(work(task), text=None), "an object of type Finished came back"),
        (lambda work, task: replace(work(task), text="foo"), "a result of another part"),
        (lambda work, task: work(replace(task, numbers=(7, 8))), "a result of another part"),
        (lambda work, task: replace(work(task), text=work(task).text.replace("mean_mm", "mm")), "or a changed one"),
    ],
    ids=["a text", "nothing", "no text", "another text", "another part", "changed"],
)
def test_what_an_executor_must_not_return_is_refused_and_not_written(
    tmp_path: Path, wrong: Callable[[Any, Any], object], stated: str
) -> None:
    refusal = refused(manifest(tmp_path), tmp_path / "out", executor=Exchanging(wrong))
    assert (refusal.parameter, stated in str(refusal.came)) == ("executor", True)
    assert [*(tmp_path / "out").rglob("*.jsonl")] == []


def test_a_part_that_was_removed_is_computed_again_and_one_of_another_fleet_is_named(
    tmp_path: Path, finished: Path
) -> None:
    file, out = manifest(tmp_path), shutil.copytree(finished, tmp_path / "out")
    part = Path("parts") / "0000" / "0000002.jsonl"
    (out / part).unlink()
    assert truearm.fleet(file, out=out, workers=1).run.before == 2
    other = tmp_path / "other"
    truearm.fleet(manifest(tmp_path, name="other.yaml", seed=7), out=other, workers=1)
    shutil.copy(other / part, out / part)  # a part of another fleet
    assert refused(file, out).where == str(out / part)


def test_a_link_for_the_parts_is_refused(tmp_path: Path) -> None:
    file, out = manifest(tmp_path), tmp_path / "out"
    (tmp_path / "elsewhere").mkdir()
    out.mkdir()
    (out / "parts").symlink_to(tmp_path / "elsewhere")
    assert "this is a link" in str(refused(file, out))


def test_a_file_that_changes_between_its_hash_and_its_use_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = tmp_path / "plan.csv"
    truearm.simulate("irb120", truth="nominal", poses=12, noise=0.0, out=plan)

    def late(asked: ExperimentEntry, place: str) -> Experiment:
        plan.write_text(plan.read_text() + "\n")
        return experiment(asked, place)

    monkeypatch.setattr("truearm.fleets.running.experiment", late)
    file = manifest(tmp_path, configurations="plan.csv")
    refusal = refused(file, tmp_path / "out")
    assert ("changed while it was read" in str(refusal), refusal.where) == (True, "plan.csv")


def test_two_runs_at_once_in_one_folder_are_refused(tmp_path: Path) -> None:
    pytest.importorskip("fcntl")
    file, out = manifest(tmp_path), tmp_path / "out"
    truearm.fleet(file, out=out, workers=1)
    with Recorded(out, read_manifest(file)).alone():
        assert "another run computes parts there" in str(refused(file, out))


@pytest.mark.parametrize("other", ["the same manifest", "another manifest"])
def test_of_two_runs_that_begin_at_once_one_is_told_of_the_other(tmp_path: Path, other: str) -> None:
    pytest.importorskip("fcntl")
    first, out = read_manifest(manifest(tmp_path)), tmp_path / "out"
    changed = {"seed": 7} if other == "another manifest" else {}
    two = manifest(tmp_path, name="two.yaml", **changed)
    second = Recorded(out, read_manifest(two))
    assert second.missing() == 3
    with Recorded(out, first).alone():
        for begin in (second.missing, second.alone().__enter__):
            said_of(None, "another run computes parts there", begin)
        assert "another run computes parts there" in str(refused(two, out))
    if changed:
        said_of(None, "the parts there are of another manifest", second.alone().__enter__)


@pytest.mark.parametrize("kind", ["same", "other"])
def test_many_runs_that_begin_at_once_leave_one_fleet(tmp_path: Path, kind: str) -> None:
    pytest.importorskip("fcntl")
    file = manifest(tmp_path)
    others = [manifest(tmp_path, name=f"{n}.yaml", **({} if kind == "same" else {"seed": n})) for n in range(1, 4)]
    for turn in range(3):
        out, gate = tmp_path / f"out-{turn}", Barrier(4)
        working: list[Path] = []

        def run(path: Path, out: Path = out, gate: Barrier = gate, working: list[Path] = working) -> str:
            gate.wait()
            try:
                with Recorded(out, read_manifest(path)).alone():
                    assert working == []
                    working.append(path)
                    time.sleep(0.02)
                    working.remove(path)
            except InputError as error:
                return error.what
            return ""

        with ThreadPoolExecutor(4) as pool:
            messages = [*pool.map(run, [file, *others])]
        assert "" in messages
        assert {*messages} <= {"", "another run computes parts there", "the parts there are of another manifest"}


def test_robots_of_lost_parts_are_named_and_an_error(tmp_path: Path) -> None:
    file, out = manifest(tmp_path), tmp_path / "out"
    fleet = truearm.fleet(file, out=out, workers=1)
    (out / "parts" / "0000" / "0000002.jsonl").unlink()
    less = Fleet(fleet.recorded, Run(3, 0, ("a worker died",), ("robot-3", "robot-4")))
    assert ("workers-died", "error") in [(notice.code, notice.level) for notice in less.warnings]
    assert less.content()["missing"] == ["robot-3", "robot-4"]
    assert "A worker died." in less.lines()


def test_a_calibration_that_does_not_settle_is_a_row_and_without_any_result_it_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unsettled(*arguments: Any) -> Any:
        estimates, deviation, settled = calibrated(*arguments)
        settled[:lost] = False
        return estimates, deviation, settled

    monkeypatch.setattr("truearm.fleets.series.calibrated", unsettled)
    lost = 1
    fleet = truearm.fleet(manifest(tmp_path), out=tmp_path / "out", workers=1)
    assert fleet.content()["calibrated"] == 2
    assert "robots-failed" in [notice.code for notice in fleet.warnings]
    assert next(fleet.recorded.rows()).message == "the calibration did not settle"
    lost = 9
    fleet = truearm.fleet(manifest(tmp_path), out=tmp_path / "none", workers=1)
    assert ("no-result", "error") in [(notice.code, notice.level) for notice in fleet.warnings]


def test_what_cannot_be_meant_is_refused_and_nothing_written(tmp_path: Path) -> None:
    out = tmp_path / "out"
    wrong: tuple[tuple[dict[str, Any], str], ...] = (
        ({"robot": "irb12"}, "irb12"),
        ({"robot": "missing.yaml"}, "no such file"),
        ({"configurations": "missing.csv"}, "no such file"),
        ({"configurations": 0}, "experiment.configurations: a number of configurations or a file"),
        ({"configurations": 2.5}, "got 2.5; allowed: 1 or more, or a file"),
        ({"configurations": True}, "got true; allowed"),
        ({"count": 0}, "too small"),
        ({"count": 2_000_000}, "too many robots"),
        ({"held_out": 100_000}, "out of range"),
        ({"noise": -0.1}, "0 or more"),
        ({"noise": 0.0}, "noise"),
        ({"model": "geometrc"}, "no model of this name"),
        ({"targets": 4}, "fewer targets"),
        ({"seed": -1}, "0 or more"),
        ({"truth": "random"}, "not known here"),
    )
    for entries, message in wrong:
        file = manifest(tmp_path, **entries)
        refusal = refused(file, out)
        assert (refusal.parameter, message in str(refusal)) == ("manifest", True), refusal
        assert str(refusal.where).startswith(f"{file}, experiment"), refusal
    for text, message in (
        ("truearm: truearm-fleet/1\n", "one of them"),
        ("truearm: truearm-fleet/1\nexperiment: {robot: irb120, count: 2, noise: 1}\n", "has a unit"),
        (
            "truearm: truearm-fleet/1\nunits: {length: mm}\noptions: {train: 3}\n"
            "experiment: {robot: irb120, count: 2, noise: 1}\n",
            "only robots that were measured have options",
        ),
        ("truearm: truearm-fleet/2\n", "truearm-fleet/1"),
    ):
        (tmp_path / "fleet.yaml").write_text(text)
        assert message in str(refused(tmp_path / "fleet.yaml", out))
    assert not out.exists()


def test_one_of_several_does_the_parts(tmp_path: Path) -> None:
    file = manifest(tmp_path)
    refusal = refused(file, tmp_path / "out", workers=2, scheduler="127.0.0.1:1")
    assert refusal.parameter == "workers, scheduler"
    wrong: Any = "four"
    assert refused(file, tmp_path / "out", executor=wrong).parameter == "executor"
    assert refused(file, tmp_path / "out", workers=5000).parameter == "workers"


def test_a_worker_with_another_version_is_refused() -> None:
    said_of("scheduler", "99.0", done_part, Task(0, "99.0"))
