"""A long day of the studio: whether it grows, and whether a project survives that it is killed.

``python benchmarks/studio_soak.py [--moves N] [--calibrations N] [--reconnects N] [--kills N] [--out FILE]`` starts
``truearm studio`` in a process of its own and opens a window beside it, without a browser. The window moves joints;
between the moves it calibrates 20 simulated configurations, closes and comes again. Printed and kept is the
memory that the process holds (resident, and that of its own), how many nodes and elements the page has, threads and
open files, from the 100th move on.

Then a studio is killed at random moments while its window edits, sends files and calibrates; each time the project must
open again with settings that the window has given it.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

from studio_line import Line, moved, studio

import truearm
from truearm.studio.project import PROJECT_FILE, open_project

_LOSSES = ("linear", "huber", "cauchy")
_BUTTON = "Take a file into the project"


def made(folder: Path) -> Path:
    """Return a project with a little to calibrate."""
    folder.mkdir()
    truearm.simulate("irb120", truth="random", poses=20, noise=5e-5, seed=1, out=folder / "data.csv")
    settings = "truearm: truearm-studio/1\nrobot: irb120\ndata: data.csv\nmodel: geometric\ntrain: 14\n"
    (folder / PROJECT_FILE).write_text(settings, encoding="utf-8")
    return folder


def held(process: subprocess.Popen[str]) -> dict[str, float]:
    """Return what a process holds: memory [MB], threads, open files."""
    place = Path(f"/proc/{process.pid}")
    lines = (place / "status").read_text().splitlines() + (place / "smaps_rollup").read_text().splitlines()[1:]
    values = {line.split()[0]: int(line.split()[1]) for line in lines if line.split()[1:] and line.split()[1].isdigit()}
    return {
        "resident_mb": round(values["VmRSS:"] / 1e3, 1),
        "own_mb": round((values["Private_Dirty:"] + values["Private_Clean:"]) / 1e3, 1),
        "threads": values["Threads:"],
        "open_files": len([*(place / "fd").iterdir()]),
    }


def calibrated(line: Line) -> bool:
    """Calibrate, and wait for the end."""
    line.give("Calibrate", True)
    said = "Calibrate: done in"
    done = line.until(lambda one: said in str(one.get("updates", {}).get("content", "")), 120.0)
    line.quiet()  # the robots are drawn anew, and have other elements
    return done


def soak(moves: int, calibrations: int, reconnects: int) -> dict[str, Any]:
    drawn = random.Random(0)
    rows: list[dict[str, Any]] = []
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder, studio(made(Path(folder) / "project")) as (process, address):
        line = Line(address)
        line.quiet(1.0)
        done, came = {"moves": 0, "calibrations": 0, "reconnects": 0}, 0
        for k in range(1, moves + 1):
            axis = f"axis_{1 + k % 6} [deg]"
            line.give(axis, drawn.uniform(-60.0, 60.0))
            done["moves"] += line.until(moved, 10.0)
            if k * calibrations // moves > (k - 1) * calibrations // moves:
                done["calibrations"] += calibrated(line)
            if k * reconnects // moves > (k - 1) * reconnects // moves:
                line.close()
                line = Line(address)
                came = -line.bytes
                line.quiet(1.0)
                came += line.bytes
                done["reconnects"] += bool(line.elements)
            if k % 100 == 0:
                line.quiet()
                rows.append({**done, **held(process), "window_bytes": came, "elements": len(line.contents)})
                print(rows[-1], flush=True)  # noqa: T201
        line.close()
    first, last = rows[0], rows[-1]
    grown = {name: round(last[name] - first[name], 1) for name in ("resident_mb", "own_mb", "threads", "open_files")}
    return {"grown": grown, "seconds": round(time.perf_counter() - begun), "rows": rows}


def kills(times: int) -> dict[str, Any]:
    """Kill studios at random moments of their work, and open each project again."""
    drawn, sound, edited, seen = random.Random(1), 0, 0, set()
    with tempfile.TemporaryDirectory() as above:
        folder = made(Path(above) / "project")
        for number in range(times):
            with studio(folder) as (process, address):
                line = Line(address)
                line.quiet(0.5)
                timer = threading.Timer(drawn.uniform(0.05, 3.0), os.kill, (process.pid, signal.SIGKILL))
                timer.start()
                given = 0
                try:
                    line.give("Calibrate", True)
                    while True:
                        given += 1
                        line.give("Loss", _LOSSES[given % 3])
                        sent(line, f"{number}-{given}.csv", b"x" * 50_000)
                        line.read(0.005)
                except Exception:  # the line ends with the process
                    edited += given
                timer.join()
                process.wait()
            settings = open_project(folder).settings
            left = [path.name for path in folder.iterdir() if path.name.startswith(".truearm")]
            whole = all(path.stat().st_size == 50_000 for path in folder.glob("*-*.csv"))
            sound += settings.loss in _LOSSES and settings.data == "data.csv" and not left and whole
            seen.add(settings.loss)
    return {"kills": times, "sound": sound, "edits": edited, "last_settings": sorted(seen)}


def sent(line: Line, name: str, content: bytes) -> None:
    """Send a file in two parts."""
    about = {"source_component_uuid": line.elements[_BUTTON]["uuid"], "transfer_uuid": name}
    half = len(content) // 2
    line.send(
        type="FileTransferStartUpload",
        filename=name,
        mime_type="",
        part_count=2,
        size_bytes=len(content),
        **about,
    )
    for k in range(2):
        line.send(type="FileTransferPart", part_index=k, content=content[k * half : (k + 1) * half], **about)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--moves", type=int, default=2000)
    parser.add_argument("--calibrations", type=int, default=50)
    parser.add_argument("--reconnects", type=int, default=20)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    found: dict[str, Any] = {"truearm": truearm.__version__}
    if given.moves:
        found["soak"] = soak(given.moves, given.calibrations, given.reconnects)
        print(found["soak"]["grown"])  # noqa: T201
    if given.kills:
        found["kills"] = kills(given.kills)
        print(found["kills"])  # noqa: T201
    if given.out:
        given.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
