"""A fleet of simulated robots: one worker, two, a Dask cluster on this machine; and killed at random moments.

Arguments: robots (10 000), moments at which parent, worker and scheduler are killed (20), repetitions (3). Writes
benchmarks/fleet.json. Needs the extra ``truearm[fleet]``. Times are those of the fastest repetition; the ways take
turns, so that whatever else the machine does meets all of them.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
import random
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

MANIFEST = """\
truearm: truearm-fleet/1
units: {{length: mm}}
experiment: {{robot: irb120, count: {count}, configurations: 20, targets: 1, noise: 0.05, held_out: 50, seed: 1}}
chunk: {chunk}
"""
#: Of the runs that are killed.
KILLED, KILLED_CHUNK = 1500, 50
THREADS = {"OPENBLAS_NUM_THREADS": "1"}


def one_run(manifest: str, out: str, how: dict[str, Any]) -> None:
    """Run a fleet in this process, and print how long its steps took and the most memory that it had."""
    began = time.perf_counter()
    from truearm.fleets.fleet import fleet

    if "process" in how:  # one worker as the others are, and not this process
        how = {"executor": ProcessPoolExecutor(how["process"], mp_context=multiprocessing.get_context("spawn"))}
    steps: list[tuple[str, float]] = []
    found = fleet(manifest, out=out, progress=lambda words: steps.append((words, time.perf_counter())), **how)
    ended = time.perf_counter()
    parts = [moment for words, moment in steps if words.startswith("part ")]
    told = {
        "load": steps[0][1] - began,
        "parts": parts[-1] - parts[0],
        "result": ended - parts[-1],
        "all": ended - began,
        "first": parts[1] - parts[0],
        "cpu": sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)),
        "memory_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "told": [*found.run.told],
    }
    sys.stdout.write(json.dumps(told) + "\n")


def words_of(manifest: Path, out: Path, how: dict[str, Any]) -> list[str]:
    return [sys.executable, __file__, "--one", str(manifest), str(out), json.dumps(how)]


def run(manifest: Path, out: Path, how: dict[str, Any]) -> dict[str, Any]:
    done = subprocess.run(words_of(manifest, out, how), capture_output=True, text=True, check=True, env=environment())
    return dict(json.loads(done.stdout.splitlines()[-1]))


def environment() -> dict[str, str]:
    return {**os.environ, **THREADS}


def digest(out: Path) -> str:
    """Return a hash of everything that was found, to the last digit; how long it took is left out."""
    told = hashlib.sha256()
    for path in sorted((out / "parts").rglob("*.jsonl")):
        for line in path.read_text().splitlines():
            content = json.loads(line)
            if "sha256" in content:
                continue
            content.pop("seconds", None)
            told.update(json.dumps(content, sort_keys=True).encode())
    for name in ("fleet.json", "robots.csv"):
        told.update((out / name).read_bytes())
    return told.hexdigest()


def port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


class Cluster:
    """A scheduler and worker processes on this machine."""

    def __init__(self, folder: Path, workers: int) -> None:
        self.folder, self.port = folder, port()
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.processes: list[subprocess.Popen[bytes]] = []
        self.start(workers)

    def start(self, workers: int) -> None:
        place = ("--host", "127.0.0.1", "--port", str(self.port), "--dashboard-address", "127.0.0.1:0")
        self._started("scheduler", *place, "--no-dashboard")
        while socket.socket().connect_ex(("127.0.0.1", self.port)):
            time.sleep(0.1)
        for _ in range(workers):
            self._started(
                "worker",
                self.address,
                "--nthreads",
                "1",
                "--no-nanny",
                "--no-dashboard",
                "--local-directory",
                str(self.folder),
            )
        from distributed import Client

        with Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=60)

    def _started(self, kind: str, *words: str) -> None:
        with (self.folder / f"{kind}.log").open("ab") as log:
            self.processes.append(
                subprocess.Popen(
                    [sys.executable, "-m", f"distributed.cli.dask_{kind}", *words],
                    stdout=log,
                    stderr=log,
                    stdin=subprocess.DEVNULL,
                    env=environment(),
                )
            )

    def stop(self) -> None:
        for process in self.processes:
            process.kill()
            process.wait()
        self.processes.clear()


@contextmanager
def cluster(folder: Path, workers: int) -> Iterator[Cluster]:
    made = Cluster(folder, workers)
    try:
        yield made
    finally:
        made.stop()


def compared(folder: Path, count: int, repetitions: int) -> dict[str, Any]:
    """Return times, memory and digests of one worker, two and a cluster of two."""
    manifest = folder / "fleet.yaml"
    manifest.write_text(MANIFEST.format(count=count, chunk=250))
    runs: dict[str, list[dict[str, Any]]] = {"1": [], "one process": [], "2": [], "dask": []}
    digests = set()
    with cluster(folder, 2) as there:
        for repetition in range(repetitions):
            for name in runs:
                ways: dict[str, dict[str, Any]] = {"dask": {"scheduler": there.address}, "one process": {"process": 1}}
                how = ways[name] if name in ways else {"workers": int(name)}
                out = folder / f"{name.replace(' ', '-')}-{repetition}"
                runs[name].append(run(manifest, out, how))
                digests.add(digest(out))
                sys.stdout.write(f"{name}: {runs[name][-1]}\n")
                sys.stdout.flush()
    best = {
        name: {step: min(one[step] for one in found) for step in ("load", "first", "parts", "result", "all", "cpu")}
        for name, found in runs.items()
    }
    few = folder / "few.yaml"
    few.write_text(MANIFEST.format(count=count // 5, chunk=250))
    less = [run(few, folder / f"few-{repetition}", {"workers": 1}) for repetition in range(repetitions)]
    size = sum(path.stat().st_size for path in (folder / "2-0" / "parts").rglob("*.jsonl"))
    return {
        "robots": count,
        "seconds": best,
        "memory_of_parent_MB": {name: max(one["memory_MB"] for one in found) for name, found in runs.items()},
        "two_workers_against_one": {step: best["1"][step] / best["2"][step] for step in ("parts", "all")},
        "two_workers_against_one_process": {
            step: best["one process"][step] / best["2"][step] for step in ("parts", "all")
        },
        "dask_against_two_workers": {step: best["dask"][step] / best["2"][step] for step in ("parts", "all")},
        "same_to_the_last_digit": len(digests) == 1,
        "bytes_a_robot": size / count,
        "model": model(best, min(one["result"] for one in less), count),
    }


def model(best: dict[str, dict[str, float]], result_of_a_fifth: float, count: int) -> dict[str, float | None]:
    """Return t = s + w N / n + e N of N robots and n workers, and for how many robots two are 1.8 times one.

    One worker is the command itself; others are processes, whose start `start` is added to s: it is the time to the
    first part of one process, less that of a part.
    """
    chunks = count / 250
    part = best["1"]["parts"] / chunks
    start = best["one process"]["first"] - part
    e = (best["1"]["result"] - result_of_a_fifth) / (0.8 * count)
    fixed = best["1"]["load"] + best["1"]["result"] - e * count
    w = best["1"]["parts"] / count
    gain = 0.1 * w - 0.8 * e
    return {
        "s_seconds": fixed,
        "start_seconds": start,
        "w_milliseconds": w * 1e3,
        "e_milliseconds": e * 1e3,
        "two_against_one_at_count": (fixed + (w + e) * count) / (fixed + start + (w / 2 + e) * count),
        "most_that_two_can_reach": (w + e) / (w / 2 + e),
        "robots_from_which_on_1.8": (0.8 * fixed + 1.8 * start) / gain if gain > 0.0 else None,
    }


def children(of: int) -> list[int]:
    """Return the processes that a process has started to do parts."""
    found = []
    for task in Path(f"/proc/{of}/task").iterdir():
        with suppress(OSError):
            found += [int(word) for word in (task / "children").read_text().split()]
    return [child for child in found if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]


def killed(folder: Path, moments: int) -> dict[str, Any]:
    """Kill the parent, one worker and the scheduler at random moments, run again, and compare what is found."""
    rng = random.Random(1)
    manifest = folder / "killed.yaml"
    manifest.write_text(MANIFEST.format(count=KILLED, chunk=KILLED_CHUNK))
    run(manifest, folder / "whole", {"workers": 2})
    wanted = digest(folder / "whole")
    told: dict[str, Any] = {"robots": KILLED, "parts": KILLED // KILLED_CHUNK}
    for who in ("parent", "worker", "scheduler"):
        same = running = said = before = 0
        for number in range(moments):
            out = folder / f"{who}-{number}"
            place = folder / f"cluster-{number}"
            place.mkdir(exist_ok=True)
            there = Cluster(place, 1) if who == "scheduler" else None
            how: dict[str, Any] = {"workers": 2} if there is None else {"scheduler": there.address}
            process = subprocess.Popen(
                words_of(manifest, out, how),
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                env=environment(),
            )
            while not (out / "record.json").exists() and process.poll() is None:
                time.sleep(0.01)
            until = rng.randrange(told["parts"])
            while process.poll() is None and len([*(out / "parts").rglob("*.jsonl")]) < until:
                time.sleep(0.002)
            time.sleep(rng.uniform(0.0, 0.2))
            alive = process.poll() is None
            running += alive
            if who == "parent":
                process.kill()
            elif there is not None:
                there.processes[0].kill()
            elif alive and (found := children(process.pid)):
                with suppress(ProcessLookupError):
                    os.kill(rng.choice(found), signal.SIGKILL)
            printed, refused = process.communicate()
            on_disk = len([*(out / "parts").rglob("*.jsonl")]) if (out / "parts").exists() else 0
            before += on_disk
            if who == "worker":
                assert process.returncode == 0, refused
                said += "a worker died" in printed
            elif who == "scheduler":
                said += "InputError" in refused
                assert process.returncode == 0 or "InputError" in refused, refused
                if there is not None:
                    there.stop()
                    there.start(1)
            again = run(manifest, out, how)
            same += digest(out) == wanted
            if there is not None:
                there.stop()
            sys.stdout.write(f"{who} {number}: {on_disk} parts on disk, again in {again['all']:.1f} s, {same} same\n")
            sys.stdout.flush()
        told[who] = {
            "killed": moments,
            "while_it_ran": running,
            "told": said,
            "same_result": same,
            "parts_kept": before,
        }
    return told


def main() -> None:
    if sys.argv[1:2] == ["--one"]:
        one_run(sys.argv[2], sys.argv[3], json.loads(sys.argv[4]))
        return
    count, moments, repetitions = (int(word) for word in (*sys.argv[1:], *("10000", "20", "3")[len(sys.argv) - 1 :]))
    file = Path(__file__).with_suffix(".json")
    found = json.loads(file.read_text()) if file.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        if repetitions:
            found["compared"] = compared(Path(folder), count, repetitions)
        if moments:
            found["killed"] = killed(Path(folder), moments)
    file.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
