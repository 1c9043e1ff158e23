"""Kill every job that writes files at every operation, and look at what it leaves: ``python -m tests.kill_every_job``.

A killed process leaves what is on disk at that moment. So the folder is copied before every operation that changes
files (:mod:`tests.killing` counts them), and each copy is what a kill there leaves behind. In each of them all files
that belong together must be old, or new, or refused with the cure; no program may be corrected a second time; the same
job must be done in it afterwards, and leave nothing but its files. Jobs can be named on the command line.
"""

from __future__ import annotations

import os
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

from tests.house.examples import EXAMPLES
from tests.killing import contents, done, found, killed_copies, leftovers

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.base.manifest import MANIFEST, sets_in
from truearm.engine.data.hexapod import poses
from truearm.engine.programs.program_files import program_files

Arguments = dict[str, Any]


def _sheet(folder: Path) -> Arguments:
    """Plan a sheet and fill it in."""
    sheet = folder / "sheet.csv"
    truearm.hexapod_plan(**EXAMPLES["hexapod_plan"](folder), out=sheet)
    header, *rows = (line.split(",") for line in sheet.read_text().splitlines())
    for row in rows:
        design = next(p.design for p in poses() if str(p.number) == row[header.index("pose")])
        for name in (*design.leg_names, "B1-B2", "B2-B3", "B3-B1"):
            row[header.index(f"{name} [mm]")] = "300"
        for name in ("T1-T2", "T2-T3", "T3-T1"):
            row[header.index(f"{name} [mm]")] = "150"
    sheet.write_text("\n".join(",".join(row) for row in [header, *rows]) + "\n")
    return {"sheet": sheet, "pose": None, "legs": None}


#: Where each job writes; `.` is the folder itself.
PLACES: dict[str, Arguments] = {
    "import_table": {"out": "data.csv"},
    "import_guess": {"out": "mapping.yaml"},
    "import_matrices": {"out": "data.csv"},
    "import_robodk": {"out": "data.csv"},
    "import_circle": {"out": "data.csv"},
    "import_sockets": {"out": "data.csv"},
    "import_hand_eye": {"out": "data.csv"},
    "import_ros": {"out": "data.csv"},
    "import_ur_kinematics": {"out": "robot.yaml"},
    "calibrate": {"out": "."},
    "tilting": {"out": "."},
    "validate": {"out": "."},
    "plan": {"out": "plan.csv"},
    "plan with a program": {"out": "."},
    "plan_inclinometers": {"out": "pairs.csv"},
    "poses": {"out": "set.csv"},
    "path": {"out": "."},
    "sphere": {"out": "page.html"},
    "measure": {"out": "."},
    "simulate": {"out": "data.csv"},
    "simulate_inclinometers": {"out": "inclinations.csv"},
    "inverse": {"out": "joints.csv"},
    "axes": {"out": "."},
    "lines": {"out": "lines.csv"},
    "influence": {"out": "."},
    "hexapod_plan": {"out": "sheet.csv", "steps": "steps.txt"},
    "hexapod_solve": {"out": "cups.csv"},
    "iso9283_plan": {"out": "."},
    "iso9283_simulate": {"out": "."},
    "iso9283_evaluate": {"out": "."},
    "compensate": {"out": "."},
    "revert": {"out": "."},
    "convert": {"out": "robot.yaml"},
    "export": {"out": "robot.csv"},
    "export_robodk": {"out": "table.csv"},
    "study": {"out": "."},
    "fleet": {"out": "."},
    "new_robot": {"file": "robot.yaml"},
    "example": {"folder": "."},
    "demo": {"out": "."},
}
#: Other arguments with which an earlier run has written the old files; jobs that overwrite nothing have none.
EARLIER: dict[str, Arguments] = {
    "calibrate": {"seed": 2},
    "plan": {"seed": 2},
    "plan with a program": {"seed": 2},
    "poses": {"count": 6},
    "path": {"languages": ["rapid"]},
    "simulate": {"seed": 2},
    "simulate_inclinometers": {"seed": 2},
    "influence": {"seed": 2},
    "axes": {"measurement_frame": "instrument"},
    "hexapod_plan": {"fixture": (0.24, 0.0, 0.1, -0.5)},
    "iso9283_plan": {"criteria": ["ap"]},
    "iso9283_simulate": {"seed": 2},
    "iso9283_evaluate": {"noise": 2e-5},
    "compensate": {"split": None, "accept": ["not-better-here"]},
    "study": {"seeds": 2},
}

#: The same job with other arguments, by which it writes other files.
ALSO: dict[str, tuple[str, Arguments]] = {"plan with a program": ("plan", {"program": "rapid", "device": None})}


def arguments(job: str, folder: Path, out: Path) -> Arguments:
    known, more = ALSO.get(job, (job, {}))
    given = EXAMPLES[known](folder) | more
    if job == "hexapod_solve":
        given = _sheet(folder)
    return given | {name: out / place for name, place in PLACES[job].items()}


def state(folder: Path) -> object:
    """Return what stands in a folder, without the names that are drawn."""
    return sorted(
        (path.name if not path.name.startswith(".truearm.") else "", path.read_bytes())
        for path in folder.rglob("*")
        if path.is_file() and path.name != "truearm.unfinished.json"
    ), (folder / "truearm.unfinished.json").exists()


def together(folder: Path) -> list[set[str]]:
    """Return the names of the files in a folder that were written together."""
    sets = []
    for manifest in folder.rglob(MANIFEST):
        place = manifest.parent.relative_to(folder)
        sets += [{str(place / name) for name in one.files} for one in sets_in(manifest.parent)]
    known = {name for names in sets for name in names}
    return [*sets, *({name} for name in contents(folder) if name not in known)]


def tried(job: str, folder: Path, *, earlier: bool) -> str:
    """Kill a job everywhere, and return the figures in a line."""
    inputs, out, kept = folder / "inputs", folder / "out", folder / "kept"
    inputs.mkdir()
    call = getattr(truearm, ALSO.get(job, (job, {}))[0])
    given = arguments(job, inputs, out)
    if earlier:
        call(**given | EARLIER[job])
    old = contents(out) if out.exists() else {}
    copies = killed_copies(lambda: call(**given), out, kept)
    written = together(out)
    new = contents(out)
    names = {*new}
    seen: dict[str, int] = {}
    healed: list[object] = []
    for copy in copies:
        word = found(copy, old, new, written)
        seen[word] = seen.get(word, 0) + 1
        if job == "compensate" and (copy / "plate.mod").exists():
            try:
                program_files([copy / "plate.mod"])
            except InputError:
                pass
            else:
                raise AssertionError("a corrected program is taken for an original")
        here = state(copy)
        if here in healed:
            continue
        healed.append(here)
        again = arguments(job, inputs, copy)
        finished = done(partial(call, **again))
        assert finished or word == "new", f"the next run was refused after {copy.name}"
        assert {*contents(copy)} == names, f"other files than before after {copy.name}: {[*contents(copy)]}"
        assert leftovers(copy) == [], f"left after {copy.name}: {leftovers(copy)}"
    words = ", ".join(f"{count} {word}" for word, count in sorted(seen.items()))
    return f"{len(copies):4} kills, {len(healed):3} states ({words})"


def main(jobs: list[str]) -> None:
    """Try the jobs that are named, or all."""
    os.fsync = lambda fd: None
    for job in jobs or PLACES:
        for earlier in (False, True) if job in EARLIER else (False,):
            with tempfile.TemporaryDirectory() as folder:
                line = tried(job, Path(folder), earlier=earlier)
            sys.stdout.write(f"{job:22}{'over an earlier result' if earlier else '':24}{line}\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
