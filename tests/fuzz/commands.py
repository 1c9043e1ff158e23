"""Whole commands, each in a process of its own that begins with everything loaded."""

from __future__ import annotations

import os
import resource
import select
import signal
import sys
import time
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.fuzz import samples
from tests.fuzz.mutations import ODD, Random, damaged, one_of

from truearm.commands import main

#: Words of a command; what is a sample is copied beside it.
COMMANDS: Final[tuple[str, ...]] = (
    "check data.csv",
    "check irb120 data.csv --json",
    "check irb120.yaml fixtures.csv --device tracker",
    "calibrate irb120 data.csv --out out --model offsets",
    "calibrate robot.yaml data.csv --out out --json --train 12 --seed 3 --loss huber --redundancy drop",
    "calibrate arm.urdf data.csv --out out --bounds bounds.yaml --effect compliance --payload 1kg,0mm,0mm,50mm",
    "calibrate irb120 data.csv --out out --model offsets --hold base --frames cell.yaml --loss l1-components",
    "calibrate irb120.yaml data.csv --out out --model frames --train all --gravity 0,0,-9.81",
    "calibrate irb120 data.csv --out out --model offsets --exclude excluded.csv",
    "calibrate irb120 data.csv --out out --model offsets --zones zones.yaml --monte-carlo 100",
    "validate calibrated.yaml data.csv",
    "validate calibrated.yaml data.csv --out out",
    "validate calibrated.yaml data.csv --json --payload 2kg,0mm,0mm,50mm",
    "distances calibrated.yaml data.csv --json",
    "compensate calibrated.yaml plate.mod --out out",
    "compensate calibrated.yaml plate.mod --out out --tools cell.yaml --taught none --json",
    "compensate calibrated.yaml plate.mod --out out --split 0.05",
    "compensate calibrated.yaml plate.mod --out out --wrench 0,0,9,0,0,0.1 --wrench-frame tool",
    "compensate calibrated.yaml plate.mod --out out --wrench forces.yaml",
    "ik irb120 poses.csv --out joints-out.csv --wrench 0N,9N,0N,0Nm,0Nm,0Nm --wrench-frame world --json",
    "compensate calibrated.yaml done.mod --out out --again",
    "compensate calibrated.yaml done.mod --out out --revert",
    "ik irb120 poses.csv --out joints-out.csv --branch front-up-noflip",
    "ik calibrated.yaml poses.csv --out joints-out.csv --seed-joints 0,0,0,0,0,0 --position-only --json",
    "plan irb120 --poses 8 --candidates 30 --out plan.csv --objective O1 --device tracker --seed 1",
    "plan calibrated.yaml --poses 10 --candidates 60 --out plan.csv --constraints constraints.yaml --noise 0.1",
    "plan irb120 --poses 8 --from data.csv --out plan.csv --model joints",
    "plan irb120 --poses 8 --candidates 40 --out out --program rapid --approach --speed 99,5 --dwell 1 --wait time",
    "plan irb120 --poses 8 --from data.csv --model joints --out out --program rapid --no-floor --clearance 0",
    "plan irb120 --poses 8 --candidates 30 --out plan.csv --floor -400 --clearance 30 --home 0,-10,20,0,30,0",
    "plan katana450 --device inclinometers --poses 8 --candidates 60 --out plan.csv --pull 20",
    "simulate katana450 --truth tilting --device inclinometers --poses 8 --out simulated.csv --pull 30",
    "tilting katana450 inclinations.csv --out out",
    "tilting katana450 inclinations.csv --out out --json --payload 0.1kg,0mm,0mm,50mm",
    "influence irb120 data.csv --out out --model offsets --train 12",
    "influence irb120.yaml --poses 20 --angle 0.1 --json",
    "poses irb120 --set diagonal --count 4 --centre 350,0,350 --side 200 --out set.csv --tip-orientation down",
    "poses irb120.yaml --set p1-p5 --centre 350,0,350 --side 200 --tip 0,0,50 --out set.csv --json",
    "fleet fleet.yaml --out out --workers 1 --json",
    "path irb120 path.yaml --out out --program all --seed-joints 0,10,20,0,50,0",
    "path calibrated.yaml path.yaml --out out --program rapid --move-to poses --spacing 0.5 --json",
    "sphere irb120 ballbar.csv --tip 0,0,125 --out page.html",
    "axes axes.csv kr5 --out out --measurement-frame robot",
    "axes axes.csv kr5.yaml --out out --json",
    "tolerance joint-errors.yaml --depth 50 --lean 0.01 --position 0.1",
    "lines kr5 --centre 850,0,600 --size 300,400,200 --joint-errors joint-errors.yaml --truth axis-tests --repeats 2",
    "lines kr5.yaml --centre 850,0,600 --size 300,400,200 --joint-errors joint-errors.yaml --out lines.csv",
    "simulate irb120 --truth random --poses 5 --noise 0.02 --device tracker --out simulated.csv --seed 2",
    "measure measured-plan.csv irb120 --device measurement-arm --noise 0.01 --nest n --every 2 --about about.yaml "
    "--disturbed 0.2 --timeout 0 --out out --json",
    "simulate robot.yaml --truth calibrated.yaml --poses 5 --out simulated.csv --payload 1kg,0mm,0mm,5mm",
    "iso9283 plan irb120 --cube cube.yaml --criteria ap --constraints constraints.yaml --clearance 20 --out out",
    "iso9283 plan irb120 --cube cube.yaml --criteria ap,t --velocities 50 --tip 0,0,50 --out out",
    "iso9283 simulate tested.yaml --plan performance.yaml --rate 100 --seed 1 --out out",
    "iso9283 evaluate performance.yaml --poses attained.csv --forces pushes.csv --out out",
    "iso9283 evaluate performance.yaml --poses attained.csv --paths along.csv --settling settling.csv "
    "--alignment alignment.yaml --noise 0.001 --json --out out",
    "devices",
    "robots",
    "robots irb-1200 --maker abb --axes 6 --json",
    "show irb120.yaml",
    "show calibrated.yaml --json",
    "show arm.urdf",
    "convert irb120.yaml --convention hayati --out converted.yaml",
    "convert joint-errors.yaml --convention product-of-exponentials --out converted.yaml",
    "export calibrated.yaml --format dh --out new.csv",
    "export calibrated.yaml --format hayati --out new.csv --json",
    "export calibrated.yaml --format urdf --out new.urdf",
    "export calibrated.yaml --format json --out new.json",
    "export joint-errors.yaml --format py --out new.py",
    "new-robot new.yaml",
    "example out",
    "import matrices --joints-file joints.txt --target 1=points.txt --reference base=points.txt --angle-unit deg "
    "--length-unit mm --out made.csv",
    "import table table.csv --map mapping.yaml --out made.csv",
    "import table points.csv --map spatial.yaml --out made.csv",
    "import sockets sockets.csv --apart 200mm,0.02mm --ball 25mm --sigma 0.02 --out made.csv",
    "import ros cell.bag --target tip=/tracker/pose --out made.csv",
    "import hand-eye views.csv --on-flange camera --out made.csv",
    "import table whole.csv --map whole.yaml --out made.csv",
    "import table points.xlsx --map workbook.yaml --joints-file driven.csv --out made.csv",
    "import guess whole.csv --out guessed.yaml --json",
    "import circle --scan a=page.png --points a=page.csv --dpi 300 --sigma 0.02 --out made.csv",
    "hexapod enumerate --json",
    "hexapod uncertainty --trials 50",
    "hexapod solve sheet.csv --out made.csv",
    "hexapod solve --pose 7 --lengths 300,300,300,300,300,300 --json",
    "hexapod plan irb120 --fixture 220,0,100,-30 --tool triangular --distinct --branches front-up --out plan.csv",
    "hexapod plan irb120 --fixture 220,0,300,-30 --fixture 150,250,300,20 --fourth-cup --attachments 2 --out plan.csv",
    "hexapod world-frame irb120 touches.csv --base-sides 300.3,300,299.6 --cup 1",
)
#: Files that a sample cannot do without.
_WITH: Final = {
    "performance.yaml": ("tested.yaml",),
    "done.mod": ("done.mod.truearm.json",),
    "spatial.yaml": ("joints.csv",),
}
SECONDS: Final = 30.0
GROWTH: Final = 1_000_000_000


@dataclass(frozen=True)
class Ended:
    """How a command ended: code (negative for a signal), and what it printed."""

    code: int
    out: str
    err: str


def bent_words(rng: Random, folder: Path) -> list[str]:
    """Return the words of a command whose files lie in a folder; files, words or both are bent."""
    words = str(one_of(rng, COMMANDS)).split()
    names = [name for word in words for name in (word, word.partition("=")[2]) if _is_sample(name)]
    for name in [*names, *(more for sample in names for more in _WITH.get(sample, ()))]:
        content = samples.content(name)
        (folder / name).write_bytes(damaged(rng, name, content) if rng.random() < 0.5 else content)
    for _ in range(int(rng.integers(3))):
        at, way = int(rng.integers(1, len(words) + 1)) - 1, int(rng.integers(8))
        if way == 0 and len(words) > 1:
            del words[at]
        elif way == 1:
            words.insert(at, words[at])
        elif way == 2:
            words[at] = str(one_of(rng, ODD)).replace("\0", "")
        elif way == 3:
            words.append(str(one_of(rng, ("--json", "--help", "--", "-h", "--version", "--outt", "x"))))
        elif way == 4 and "--out" in words[:-1]:
            place = one_of(rng, (*names, ".", "/dev/null", "no/where/x", "/proc/x", "x" * 300, "out/../out2"))
            words[words.index("--out") + 1] = str(place)
        elif way == 5 and names:
            words[at] = str(one_of(rng, names))
        elif way == 6:
            words[at] = str(one_of(rng, ("irb120", "ur5", "kr5", "katana450", "li3", "nominal", "random", "all")))
        else:
            words[at] = str(
                one_of(rng, ("0", "-1", "nan", "inf", "1e400", "1e-9", "0,0", "1,2,3", "0,0,nan", "9" * 30))
            )
    return words


def _is_sample(name: str) -> bool:
    return bool(name) and "/" not in name and (samples.folder() / name).is_file()


def run(words: Sequence[str], folder: Path) -> Ended:
    """Run a command in a folder, with bounds on memory and time."""
    (out, to_out), (err, to_err) = os.pipe(), os.pipe()
    child = os.fork()
    if child == 0:
        _be(words, folder, to_out, to_err)
    os.close(to_out)
    os.close(to_err)
    texts = {out: bytearray(), err: bytearray()}
    end = time.monotonic() + 4 * SECONDS  # its own clock stops it earlier, unless it sleeps
    while texts.keys() - (closed := {fd for fd, text in texts.items() if text.endswith(b"\0\0end")}):
        ready, _, _ = select.select([fd for fd in texts if fd not in closed], [], [], max(0.0, end - time.monotonic()))
        if not ready:
            os.kill(child, signal.SIGKILL)
            break
        for fd in ready:
            texts[fd] += os.read(fd, 1 << 16) or b"\0\0end"
    _, status = os.waitpid(child, 0)
    os.close(out)
    os.close(err)
    printed = [texts[fd].removesuffix(b"\0\0end").decode("utf-8", "backslashreplace") for fd in (out, err)]
    return Ended(os.waitstatus_to_exitcode(status), *printed)


def _be(words: Sequence[str], folder: Path, out: int, err: int) -> None:
    """Become the command; does not return."""
    code: object = 99
    try:
        os.dup2(out, 1)
        os.dup2(err, 2)
        os.chdir(folder)
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
        sys.stderr = open(2, "w", encoding="utf-8", closefd=False, errors="backslashreplace")  # noqa: SIM115
        sys.argv = ["truearm", *words]
        signal.signal(signal.SIGXCPU, signal.SIG_DFL)
        used = int(time.process_time() + SECONDS) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (used, used + 5))
        limit_memory()
        try:
            main()
            code = 0
        except SystemExit as stop:
            code = 0 if stop.code is None else stop.code
        except BaseException:
            traceback.print_exc()
            code = 98
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code if isinstance(code, int) else 97)


def limit_memory() -> None:
    """Let this process grow by a gigabyte and no more."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + GROWTH
    resource.setrlimit(resource.RLIMIT_AS, (most, resource.getrlimit(resource.RLIMIT_AS)[1]))
