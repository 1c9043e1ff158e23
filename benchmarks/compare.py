"""Runs the contenders in turn, round by round, and writes the comparison. Arguments: benchmarks/.env and the rounds.

A ratio is formed within a round and the median over the rounds is reported, so that a machine whose speed drifts
compares fairly.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

HERE = Path(__file__).parent
#: Script of each contender, and the environment it runs in; None is the project's own.
CONTENDERS = {
    "truearm_kinematics": None,
    "pinocchio_kinematics": "pinocchio",
    "pybotics_forward": "pybotics",
    "truearm_fit": None,
    "figaroh_fit": "figaroh",
    "pinocchio_inverse": "pinocchio",
    "truearm_inverse": None,
    "pair_distances": None,
    "programs": None,
}
Figures = dict[str, Any]


def main() -> None:
    made, rounds = Path(sys.argv[1]), int(sys.argv[2])
    absent: dict[str, str] = {}
    results: list[dict[str, Figures]] = []
    for number in range(rounds):
        results.append({})
        for name in CONTENDERS:
            if name not in absent:
                print(f"round {number + 1} of {rounds}: {name}", file=sys.stderr)  # noqa: T201
                outcome = run(name, made)
                if isinstance(outcome, str):
                    absent[name] = outcome
                else:
                    results[-1][name] = outcome
    record = {"machine": machine(), "absent": absent, "rounds": results}
    (HERE / "results.json").write_text(json.dumps(record, indent=1) + "\n")
    (HERE.parent / "docs" / "benchmarks.md").write_text(page(record) + choices())


def run(name: str, made: Path) -> Figures | str:
    """Run a contender; return its figures, or why there are none."""
    environment = CONTENDERS[name]
    if environment is not None and not (made / environment / "installed").exists():
        log = made / f"{environment}.log"
        return "not installed: " + (log.read_text().strip().splitlines() or ["no reason given"])[-1]
    python = HERE.parent / ".venv" / "bin" / "python"
    if environment is not None:
        python = made / environment / "bin" / "python"
    output = made / "outputs" / f"{name}.json"
    output.unlink(missing_ok=True)
    command = [python, HERE / "contenders" / f"{name}.py", made / "inputs", output]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return "failed: " + (done.stderr.strip().splitlines() or ["no message"])[-1]
    found: Figures = json.loads(output.read_text())
    return found


def machine() -> dict[str, str]:
    """Describe the machine."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    model = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.processor())
    pages = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return {
        "processor": model,
        "cores": str(os.cpu_count()),
        "memory": f"{pages / 2**30:.0f} GiB",
        "system": f"{platform.system()} {platform.machine()}",
    }


PROGRAMS = """
## Programs of 100 000 targets

| language | targets | size | read | corrected by nothing | both, in passes of one regex for numbers |
|---|---|---|---|---|---|
{languages}
"""
DISTANCES = """
## Distances between all pairs of 9905 points

truearm compares {pairs} distances with measured ones, and makes mean, deviation, maximum and a histogram of the errors,
in {ours}; SciPy's `pdist` makes one set of distances in {pdist}, into an array that is there already. The process with
truearm takes {memory} at most, NumPy and SciPy included; `pdist` alone needs 392 MB for each set.
"""


# -- the page --------------------------------------------------------------------------------------------


def page(record: dict[str, Any]) -> str:
    rounds: list[dict[str, Figures]] = record["rounds"]
    absent: dict[str, str] = record["absent"]

    def over(contenders: tuple[str, ...], figure: Callable[..., float]) -> float | None:
        """Return the median over the rounds of a figure of some contenders, None where one is absent."""
        if any(name in absent for name in contenders):
            return None
        return median(figure(*(r[name]["figures"] for name in contenders)) for r in rounds)

    def row(what: str, contender: str, figure: Callable[..., float], ratio: Callable[..., float], own: str) -> str:
        seconds = over((contender,), figure)
        if seconds is None:
            return f"| {what} | {absent[contender]} | |"
        times = "" if contender == own else f"{over((contender, own), ratio):.3g}"
        return f"| {what} | {shown(seconds)} | {times} |"

    kin, fit = "truearm_kinematics", "truearm_fit"
    both = "position_and_jacobian_1000"

    def speed_up(a: Figures, b: Figures) -> float:
        return float(a["position_and_jacobian"] / b[both])

    kinematics = [
        row("truearm, position and Jacobian by 34 parameters", kin, lambda a: a[both], lambda a, b: 1, kin),
        row("truearm, position alone", kin, lambda a: a["position_1000"], lambda a, b: 1, kin),
        row(
            "Pinocchio from Python, position and Jacobian by 6 joints",
            "pinocchio_kinematics",
            lambda a: a["position_and_jacobian"],
            speed_up,
            kin,
        ),
        row(
            "pybotics, forward kinematics alone",
            "pybotics_forward",
            lambda a: a["position"],
            lambda a, b: a["position"] / b[both],
            kin,
        ),
    ]
    sizes = [
        f"| {n:,} | {shown(over((kin,), lambda a, n=n: a[f'position_{n}']))} "
        f"| {shown(over((kin,), lambda a, n=n: a[f'position_and_jacobian_{n}']))} |".replace(",", " ")
        for n in (1, 50, 1000, 100_000)
    ]
    fits = []
    for kind in ("simulated", "measured"):
        if kind not in rounds[0].get(fit, {}).get("figures", {}):
            fits.append(f"| {kind} data: not at hand | | | |")
            continue
        for what, contender, part in (
            ("truearm, `identify`: frames, fit, covariance", fit, "fit"),
            ("truearm, the solver alone", fit, "solver"),
            ("FIGAROH, `least_squares` alone", "figaroh_fit", "fit"),
            ("FIGAROH, choice of parameters and start besides", "figaroh_fit", "start"),
        ):
            if contender in absent:
                fits.append(f"| {kind}: {what} | {absent[contender]} | | |")
                continue
            seconds = over((contender,), lambda a, k=kind, p=part: median(a[k][p]))
            error = over((contender,), lambda a, k=kind: median(a[k]["held_out"]))
            ratio = ""
            if contender == fit and "figaroh_fit" not in absent:
                figaroh = over(("figaroh_fit", fit), lambda a, b, k=kind, p=part: median(a[k]["fit"]) / median(b[k][p]))
                ratio = f"{figaroh:.3g}"
            fits.append(f"| {kind}: {what} | {shown(seconds)} | {ratio} | {1e3 * (error or 0):.4f} mm |")
    trials = over((fit,), lambda a: a["monte_carlo_1000"])
    if "figaroh_fit" in absent:
        ten = ""
    else:
        tenfold = over(("figaroh_fit", fit), lambda a, b: 10 * median(a["simulated"]["fit"]) / b["monte_carlo_1000"])
        ten = f", and ten FIGAROH fits take {tenfold:.2g} times as long"
    size = rounds[0][kin]["figures"]["jacobian_bytes"]
    bandwidth = over((kin,), lambda a: a["copy_bytes_per_second"]) or 0.0
    filled = over((kin,), lambda a: a["fill_in_cache"])
    bound = over((kin,), lambda a: a[both] / (a["jacobian_bytes"] / a["copy_bytes_per_second"]))
    goals = [
        goal("1000 configurations: times faster than Pinocchio", 3.0, over(("pinocchio_kinematics", kin), speed_up)),
        goal(
            "1000 configurations, Jacobian included: times faster than pybotics without",
            50.0,
            over(("pybotics_forward", kin), lambda a, b: a["position"] / b[both]),
        ),
        *(
            goal(
                f"geometric fit, {kind} data: times faster than FIGAROH, solver against solver",
                50.0,
                over(("figaroh_fit", fit), lambda a, b, k=kind: median(a[k]["fit"]) / median(b[k]["solver"])),
            )
            for kind in ("simulated", "measured")
            if kind in rounds[0].get(fit, {}).get("figures", {})
        ),
        goal(
            "1000 Monte-Carlo calibrations: times faster than ten FIGAROH fits",
            1.0,
            over(("figaroh_fit", fit), lambda a, b: 10 * median(a["simulated"]["fit"]) / b["monte_carlo_1000"]),
        ),
    ]
    goals.append(
        goal(
            "inverse of 10 000 poses: times faster than Pinocchio's documented damped Newton",
            20.0,
            over(("pinocchio_inverse", "truearm_inverse"), lambda a, b: a["documented_seconds"] / b["seconds"]),
        )
    )
    distances = ""
    if "pair_distances" in rounds[0]:
        all_pairs = ("pair_distances",)
        share = over(all_pairs, lambda a: a["pdist_seconds"] / a["seconds"])
        goals.append(goal("49 million distances: time of SciPy's pdist over truearm's", 1 / 3, share))
        distances = DISTANCES.format(
            pairs=f"{rounds[0]['pair_distances']['figures']['pairs']:,}".replace(",", " "),
            ours=shown(over(all_pairs, lambda a: a["seconds"])),
            pdist=shown(over(all_pairs, lambda a: a["pdist_seconds"])),
            memory=f"{(over(all_pairs, lambda a: a['memory']) or 0.0) / 1e6:.0f} MB",
        )
    programs = ""
    if "programs" in rounds[0]:
        languages = []
        for name, first in rounds[0]["programs"]["figures"].items():
            read, compared, regex = (
                over(("programs",), lambda a, n=name, k=key: a[n][k]) or 0.0 for key in ("read", "compared", "regex")
            )
            cells = (name, f"{first['targets']}", f"{first['bytes'] / 1e6:.1f} MB", shown(read), shown(compared))
            languages.append(f"| {' | '.join(cells)} | {(read + compared) / regex:.2g} |")
        programs = PROGRAMS.format(languages="\n".join(languages))
    kilobytes, speed = f"{size / 1e3:.0f} kB", f"{bandwidth / 1e9:.0f} GB/s"
    fastest, fill = shown(size / bandwidth), shown(filled)
    own, other = "truearm_inverse", "pinocchio_inverse"
    inverses = [
        row("truearm, one branch, no seed, to 1e-9", own, lambda a: a["seconds"], lambda a, b: 1, own),
        row("truearm, nearest to a seed up to 0.1 rad away", own, lambda a: a["near_seconds"], lambda a, b: 1, own),
        row(
            "Pinocchio from Python, as documented: from neutral, to 1e-4",
            other,
            lambda a: a["documented_seconds"],
            lambda a, b: a["documented_seconds"] / b["seconds"],
            own,
        ),
        row(
            "Pinocchio from Python, whole steps from a seed up to 0.1 rad away, to 1e-9",
            other,
            lambda a: a["seconds"],
            lambda a, b: a["seconds"] / b["seconds"],
            own,
        ),
    ]
    solved = over((other,), lambda a: a["solved"])
    documented = over((other,), lambda a: a["documented_solved"])
    versions = sorted({f"{k} {v}" for r in rounds for c in r.values() for k, v in c["versions"].items()})
    here = record["machine"]
    python = rounds[0][kin]["python"]
    apart = over(("pinocchio_kinematics",), lambda a: max(a["fused_difference"], a["step_by_step_difference"]))
    agreement = "" if apart is None else f" Positions and joint Jacobians agree with Pinocchio's to {apart:.0e}."
    nl = "\n"
    return f"""# Benchmarks

Made by `benchmarks/run`, rounds: {len(rounds)}. Each contender runs in its own environment and process, on one core and
the same arrays. Times are medians; ratios are formed within a round.

Machine: {here["processor"]}, {here["cores"]} cores, {here["memory"]}, {here["system"]}, Python {python}.
Versions: {", ".join(versions)}.

| goal | at least | reached |
|---|---|---|
{nl.join(goals)}

## Kinematics of 1000 configurations of the IRB 120

| what | time | times truearm's position and Jacobian |
|---|---|---|
{nl.join(kinematics)}

truearm's Jacobian has a column for every named parameter (base, joints, one target), Pinocchio's one for every joint.
pybotics computes no Jacobian here.{agreement}

| configurations | position | position and Jacobian |
|---|---|---|
{nl.join(sizes)}

The Jacobian of 1000 configurations is {kilobytes}. At the {speed} that copying large arrays reaches here (bytes
read and written), no program could deliver it to memory in less than {fastest}; filling an array of that size in
the cache takes {fill}. truearm takes {bound:.2g} times the former. What is between is some 300 calls of NumPy with
operands of a few kilobytes: about half of it is their fixed cost (the time for one configuration), the other half
arithmetic whose every operand passes through the cache. A compiled kernel that keeps a configuration's frame in
registers would avoid most of both; NumPy alone cannot. At 100 000 configurations most of the time goes to the operating
system, which hands out the memory of the Jacobian page by page; computing in portions into an array that is used
again avoids that.

## Geometric fit of the IRB 120: 50 configurations, 3 targets, position

| data and what | time | FIGAROH's fit takes times | mean held-out error |
|---|---|---|---|
{nl.join(fits)}

Most of what the solver takes is the fixed cost of NumPy calls again: it computes the forward kinematics of the three
targets one after the other, though they share all but their last three slides.

Medians over five campaigns. FIGAROH's fit starts at its own closed-form frames, as truearm's solver does at its
own; its evaluation and report are in no figure. Simulated: true robots drawn from the priors, 0.05 mm noise, judged
at 200 configurations without noise. Measured: a FARO tracker, commanded joints, judged at the other 450
configurations.

1000 Monte-Carlo calibrations of the same size take {shown(trials)}{ten}.

## Inverse kinematics of 10 000 poses of the IRB 120

| what | time | times truearm's on one branch |
|---|---|---|
{nl.join(inverses)}

Solved: Pinocchio as documented {100 * (documented or 0):.1f} % (measured on the first 1000 poses), from near seeds
{100 * (solved or 0):.2f} %; truearm solves them on the branch that is asked for, or says why not.
Which ratio counts depends on what one has: without a seed near the answer the documented loop is what there is.
{distances}{programs}"""


def choices() -> str:
    """Return the section on what `auto` chooses, from what benchmarks/choosing.py found; empty if it never ran."""
    file = HERE / "choosing.json"
    if not file.exists():
        return ""
    found: dict[str, list[dict[str, Any]]] = json.loads(file.read_text())

    def middle(rows: list[dict[str, Any]], key: str) -> str:
        values = [row[key] for row in rows if key in row]
        return f"{median(values):.3f}" if values else ""

    table = [
        f"| {name} | {len(rows)} | {' | '.join(middle(rows, key) for key in ('geometric', 'elastic', 'auto'))} "
        f"| {max(row['auto'] for row in rows):.3f} | {middle(rows, 'auto, no order')} "
        f"| {median(row['ratio'] for row in rows):.0f} |"
        for name, rows in found.items()
    ]
    random = [
        f"The 20 random configurations of the {name}: geometric {middle(rows, 'geometric, random')}, `auto` "
        f"{middle(rows, 'auto, random')} mm, each good to {middle(rows, 'auto, random, standard error')}.\n"
        for name, rows in found.items()
        if "auto, random" in rows[0]
    ]
    return "\n".join(["", "## What `auto` chooses: measured robots", "", CHOICES, *table, "", *random, BEFORE])


#: Measured once, on the same splits.
BEFORE = """\
Before, a greedy search by fits in five folds: 0.070 mm from 40 (worst 0.098) in 156 times the time of an elastic fit,
0.040 from 300 in 293 times, 0.083 on the UR5's grid in 197 times, and on its 20 random ones 0.087, or 0.12 if they were
taken for the beginning of the session.
"""


CHOICES = """\
Mean held-out errors [mm], medians over splits (`benchmarks/choosing.py`); worst: of `auto` over the splits; no order:
of `auto` where the place of a configuration in the campaign is not known; and the processor's time of the choice and
its fit, by that of one elastic `identify` on the same data.

| robot, training configurations | splits | geometric | elastic | auto | worst | no order | times an elastic fit |
|---|---|---|---|---|---|---|---|"""


def goal(what: str, least: float, reached: float | None) -> str:
    """Return the row of a goal."""
    figure = "no contender" if reached is None else f"{reached:.3g}" + ("" if reached >= least else ", missed")
    return f"| {what} | {least:g} | {figure} |"


def shown(seconds: float | None) -> str:
    """Return a time in the unit that suits it."""
    if seconds is None:
        return ""
    for unit, scale in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= scale:
            return f"{seconds / scale:.3g} {unit}"
    return f"{seconds * 1e6:.3g} us"


if __name__ == "__main__":
    main()
