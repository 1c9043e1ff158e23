"""A Dask cluster on this machine: a real scheduler and worker processes; and addresses that are refused."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.expecting import refused

import truearm
from truearm.engine.base import parts as cluster
from truearm.engine.base.errors import InputError
from truearm.engine.base.parts import Cluster, checked_address, done_parts
from truearm.engine.base.workers import with_workers

SERIES = """\
truearm: truearm-fleet/1
units: {length: mm}
experiment: {robot: irb120, count: 5, configurations: 12, noise: 0.05, held_out: 5, model: offsets}
chunk: 2
"""


def test_addresses_of_schedulers() -> None:
    for address, full in (
        ("127.0.0.1:8786", "tcp://127.0.0.1:8786"),
        ("tcp://localhost:8786", "tcp://localhost:8786"),
        ("tcp://[::1]:8786", "tcp://[::1]:8786"),
        ("tls://cell.example:8786", "tls://cell.example:8786"),
    ):
        assert checked_address(address, insecure=False) == full
    none = ("", "8786", "localhost", "http://localhost:1", "tcp://:8786", "tcp://[::1:8786", "a:b", "tcp:// :1")
    secret = ("tcp://me:secret@10.0.0.1:8786", "me:secret@localhost:1", "tls://secret@h:1", "secret@")
    for address in (*none, "tcp://a b:1", *secret):  # a password is not told
        message = refused("scheduler", "no address of a scheduler", checked_address, address, insecure=True)
        assert "secret" not in message
    for address in ("tcp://cell.example:8786", "10.0.0.1:8786", "localhost.example:1"):
        refused(None, "reached without TLS.*`insecure`", checked_address, address, insecure=False)
        assert checked_address(address, insecure=True).endswith(address)


def series(folder: Path) -> Path:
    file = folder / "fleet.yaml"
    file.write_text(SERIES)
    return file


def free_port() -> int:
    with socket.socket() as opened:
        opened.bind(("127.0.0.1", 0))
        return int(opened.getsockname()[1])


def test_where_nobody_listens_the_run_is_refused_and_nothing_written(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    words, nobody = "no Dask scheduler answers there.*dask scheduler", f"127.0.0.1:{free_port()}"
    refused(None, words, truearm.fleet, series(tmp_path), out=tmp_path / "out", scheduler=nobody)
    assert not (tmp_path / "out").exists()


def test_something_else_that_listens_is_no_scheduler_and_tls_needs_certificates(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "PATIENCE", 0.4)
    monkeypatch.setattr(cluster, "_MARGIN", 0.1)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"127.0.0.1:{silent.getsockname()[1]}"
        refused(None, "no Dask scheduler", Cluster, address, insecure=False)
        refused(None, "no certificates.*distributed.comm.tls", Cluster, f"tls://{address}", insecure=False)


def greeted(*, frames: list[bytes]) -> bytes:
    """Return a message as Dask sends it: its length, the number of frames, their lengths, frames."""
    lengths = [len(frames), *map(len, frames)]
    body = struct.pack(f"<{len(lengths)}Q", *lengths) + b"".join(frames)
    return struct.pack("<Q", len(body)) + body


#: What may be sent in place of a greeting: by SSH, HTTP and TLS, half a message, many frames, zeros, noise.
ODD = (
    struct.pack("<Q", 60),
    struct.pack("<Q", 60) + b"and then nothing",
    b"SSH-2.0-OpenSSH_9.2p1 Debian\r\n",
    b"HTTP/1.0 400 Bad Request\r\n\r\n",
    b"\x15\x03\x03\x00\x02\x02\x46",
    bytes(200),
    struct.pack("<Q", 20) + bytes(range(100, 120)),
    struct.pack("<3Q", 16, 10**6, 5) + bytes(50),
    greeted(frames=[b"", b"no dictionary"]),
    np.random.default_rng(3).bytes(300),
)


@pytest.mark.parametrize("words", ODD, ids=range(len(ODD)))
def test_odd_greetings_are_refused_in_seconds_and_in_one_line(
    words: bytes, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "PATIENCE", 0.4)
    monkeypatch.setattr(cluster, "_MARGIN", 0.1)
    with socket.create_server(("127.0.0.1", 0)) as odd:
        address = f"127.0.0.1:{odd.getsockname()[1]}"
        connections = []

        def speak() -> None:
            with contextlib.suppress(OSError):
                while True:
                    connections.append(odd.accept()[0])
                    connections[-1].sendall(words)

        threading.Thread(target=speak, daemon=True).start()
        with pytest.raises(InputError, match="no Dask scheduler answers there") as caught:
            Cluster(address, insecure=False)
    for connection in connections:
        connection.close()
    assert caught.value.came == f"tcp://{address}"
    assert capfd.readouterr().err == ""


def test_a_scheduler_with_another_dask_is_refused_with_the_cure(monkeypatch: pytest.MonkeyPatch) -> None:
    distributed = pytest.importorskip("distributed")

    def refuse(*_: object, **__: object) -> None:
        raise ImportError("versions differ")

    monkeypatch.setattr(distributed.Client, "__init__", refuse)
    refused(None, "another version of Dask.*same versions of dask", Cluster, "127.0.0.1:1", insecure=False)


def test_without_dask_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    words = r"Dask, and it is not installed.*truearm\[fleet\]"
    refused(None, words, Cluster, "127.0.0.1:1", insecure=False)


def started(*words: str, folder: Path) -> subprocess.Popen[bytes]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    with (folder / f"{words[0]}.log").open("wb") as log:
        return subprocess.Popen(
            [sys.executable, "-m", *words],
            cwd=folder,
            env=environment,
            stdout=log,
            stderr=log,
            stdin=subprocess.DEVNULL,
        )


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A scheduler with one worker, each a process of its own."""
    pytest.importorskip("distributed")
    folder, port = tmp_path_factory.mktemp("cluster"), free_port()
    address = f"tcp://127.0.0.1:{port}"
    lead = started(
        "distributed.cli.dask_scheduler",
        *("--host", "127.0.0.1", "--port", str(port), "--no-dashboard", "--dashboard-address", "127.0.0.1:0"),
        folder=folder,
    )
    worker = None
    try:
        for _ in range(200):
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.1)
        worker = started(
            "distributed.cli.dask_worker",
            *(address, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(folder)),
            folder=folder,
        )
        yield address, lead
    finally:
        for process in (worker, lead):
            if process is not None:
                process.kill()
                process.wait()


@pytest.fixture
def scheduler(running: tuple[str, subprocess.Popen[bytes]], monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setattr(cluster, "PATIENCE", 30.0)
    return running[0]


def test_a_cluster_finds_what_this_process_finds(scheduler: str, tmp_path: Path) -> None:
    file = series(tmp_path)
    local = truearm.fleet(file, out=tmp_path / "here", workers=1)
    remote = truearm.fleet(file, out=tmp_path / "there", scheduler=scheduler)
    assert remote.content() == local.content()
    assert (tmp_path / "there" / "robots.csv").read_bytes() == (tmp_path / "here" / "robots.csv").read_bytes()
    rows = [[*fleet.recorded.rows()] for fleet in (local, remote)]
    assert [row.parameters for row in rows[0]] == [row.parameters for row in rows[1]]
    assert json.loads((tmp_path / "there" / "fleet.json").read_text())["calibrated"] == 5


def test_workers_with_another_version_or_that_do_not_answer_are_refused(
    scheduler: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "__version__", "99.0")
    words = "1 worker of the scheduler has another version of truearm.*tcp://127.0.0.1:.*allowed: 99.0"
    assert truearm.__version__ in refused(None, words, Cluster, scheduler, insecure=False)
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "_ANSWER", 0.2)
    monkeypatch.setattr(distributed.Client, "run", lambda *_, **__: time.sleep(1.0))
    words = "workers of the scheduler do not answer.*start them again"
    refused(None, words, Cluster, scheduler, insecure=False)


def test_a_scheduler_that_does_not_answer_any_more_is_told(scheduler: str, monkeypatch: pytest.MonkeyPatch) -> None:
    workers = Cluster(scheduler, insecure=False)
    monkeypatch.setattr(cluster, "_ANSWER", 0.2)
    monkeypatch.setattr(cluster, "_LOOK", 0.0)
    monkeypatch.setattr(workers._client, "scheduler_info", lambda **_: time.sleep(1.0))
    refused(None, "the scheduler does not answer any more.*not computed twice", workers.news)
    workers.close(finish=False)


def test_a_scheduler_that_is_killed_is_told_once_and_without_tracebacks(
    scheduler: str,
    running: tuple[str, subprocess.Popen[bytes]],
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """The last test: its scheduler is the others'."""

    def work() -> None:
        with with_workers(Cluster(scheduler, insecure=False)) as workers:
            monkeypatch.setattr(cluster, "PATIENCE", 1.0)
            for finished in done_parts(abs, range(10**6), workers):
                assert finished.result == finished.part
                running[1].terminate()

    with pytest.raises(InputError, match="the scheduler is gone") as caught:
        work()
    assert caught.value.came == scheduler
    assert "not computed twice" in str(caught.value.cure)
    assert capfd.readouterr().err == ""
