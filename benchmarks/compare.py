"""Runs the contenders in turn, round by round, and writes the comparison. Arguments: benchmarks/.env and the rounds.
Without any, only the sections on `auto` are written anew, from the files of results that are there.

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
    "truearm_curves": None,
    "pinocchio_inverse": "pinocchio",
    "truearm_inverse": None,
    "pair_distances": None,
    "programs": None,
}
Figures = dict[str, Any]


def main() -> None:
    if len(sys.argv) == 1:
        write_page()
        return
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
    write_page(page(record))


def write_page(before: str | None = None) -> None:
    """Write the page anew: what comes before the sections on `auto` (as it is if None), and those; the rest stays."""
    file = HERE.parent / "docs" / "benchmarks.md"
    old, by_hand = file.read_text().split(f"\n{BY_HAND}", 1)
    before = old.split(f"\n{MEASURED}", 1)[0] if before is None else before
    file.write_text(f"{before}{every_effect()}{every_effect_on_twins()}\n{BY_HAND}{by_hand}")


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
LARGE_FITS = """
## Geometric fit with a curve of every joint: one target, coefficients up to 60 periods a turn

| configurations | time | memory of the process |
|---|---|---|
{rows}

Beyond two million derivatives they are found in portions of whole configurations, and nothing keeps them: each portion
leaves a triangle. So memory hardly grows with the configurations. With all 576 coefficients of up to 48 periods free at
once, each with a prior that is given, 2500 configurations take half of the processor time that they took with all
derivatives in memory, and 0.4 instead of 1.1 GB; 10 000 take 0.5 GB.
"""
DISTANCES = """
## Distances between all pairs of 9905 points

truearm compares {pairs} distances with measured ones, and makes mean, deviation, maximum and a histogram of the errors,
in {ours}; SciPy's `pdist` makes one set of distances in {pdist}, into an array that is there already. The process with
truearm takes {memory} at most, NumPy and SciPy included; `pdist` alone needs 392 MB for each set.
"""


CURVES = """
## Joint curves

Mean error of unseen positions in mm, with and without the effect `joint-curve` (`benchmarks/joint_curves.py`). A UR5
measured with a laser tracker (Jacobi 2025): 700 configurations of a grid for training, judged at the other 300 and at
20 random ones, with their standard error, medians over {seeds} draws of the 700.

| model | 300 of the grid | the 20 random ones |
|---|---|---|
{ur5}

The measured IRB 120, judged at the rest of 500 configurations, medians over {irb_seeds} draws. The six effects are
bearing-compliance, hardening, warm-up, transmission-error, approach, and fourier or joint-curve:

| model | trained on 40 | trained on 300 |
|---|---|---|
{irb120}

Twins whose encoders and gears err (truths `gear-errors` and `tooth-errors`), 200 configurations x 3 targets,
{twin_seeds} seeds: error of unseen readings divided by what the noise alone makes. In the last two rows of a robot
joint 2 turns through 60 deg in the training; they are judged there, and over its whole range (outside).

| twin | geometric, median | worst | joint curves, median | worst |
|---|---|---|---|---|
{twins}
"""


def curves_section(record: Figures) -> str:
    """Return the section on joint curves, from what benchmarks/joint_curves.py wrote."""

    def cell(found: list[list[float]]) -> str:
        return f"{median(mean for mean, _ in found):.3f} +- {median(error for _, error in found):.3f}"

    def row(name: str, *columns: list[list[float]]) -> str:
        return f"| {name} | {' | '.join(map(cell, columns))} |"

    ur5, irb120 = record["ur5"], record["irb120"]
    twins = []
    for case, found in record["twins"].items():
        for part in ("inside", "outside"):
            if part in found[0]["geometric"]:
                ratios = [[one[model][part] for one in found] for model in found[0]]
                cells = " | ".join(f"{median(r):.2f} | {max(r):.2f}" for r in ratios)
                twins.append(f"| {case}{', outside' if part == 'outside' else ''} | {cells} |")
    of_ur5 = [row(m, [r[m]["grid"] for r in ur5], [r[m]["random"] for r in ur5]) for m in ur5[0]]
    of_irb120 = [row(m, *([r[n][m]["held out"] for r in irb120] for n in ("40", "300"))) for m in irb120[0]["40"]]
    return CURVES.format(
        seeds=len(ur5),
        irb_seeds=len(irb120),
        twin_seeds=len(found),
        ur5="\n".join(of_ur5),
        irb120="\n".join(of_irb120),
        twins="\n".join(twins),
    )


# -- the page --------------------------------------------------------------------------------------------


def page(record: dict[str, Any]) -> str:
    written = HERE / "joint_curves.json"
    curves = curves_section(json.loads(written.read_text())) if written.exists() else ""
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
                60.0,
                over(("figaroh_fit", fit), lambda a, b, k=kind: median(a[k]["fit"]) / median(b[k]["solver"])),
            )
            for kind in ("simulated", "measured")
            if kind in rounds[0].get(fit, {}).get("figures", {})
        ),
        goal(
            "1000 Monte-Carlo calibrations: times faster than ten FIGAROH fits",
            3.2,
            over(("figaroh_fit", fit), lambda a, b: 10 * median(a["simulated"]["fit"]) / b["monte_carlo_1000"]),
        ),
    ]
    large_fits = ""
    if "truearm_curves" in rounds[0]:
        large = ("truearm_curves",)
        goals += [
            goal(
                "2500 configurations with six curves: fits in 10 s",
                1.0,
                over(large, lambda a: 10 / a["2500"]["seconds"]),
            ),
            goal(
                "2500 configurations with six curves: fits in 1 GiB",
                1.0,
                over(large, lambda a: 2**30 / a["2500"]["memory"]),
            ),
        ]
        rows = [
            f"| {n} | {shown(over(large, lambda a, n=n: a[n]['seconds']))} "
            f"| {(over(large, lambda a, n=n: a[n]['memory']) or 0.0) / 1e6:.0f} MB |"
            for n in rounds[0]["truearm_curves"]["figures"]
        ]
        large_fits = LARGE_FITS.format(rows="\n".join(rows))
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

All targets of a configuration are swept together. Most of what the solver takes is the fixed cost of NumPy calls and
the QR decomposition of each step. truearm's solver alone ends at the solution; `identify` finds its derivatives too.

Medians over five campaigns. FIGAROH's fit starts at its own closed-form frames, as truearm's solver does at its
own; its evaluation and report are in no figure. Simulated: true robots drawn from the priors, 0.05 mm noise, judged
at 200 configurations without noise. Measured: a FARO tracker, commanded joints, judged at the other 450
configurations.

1000 Monte-Carlo calibrations of the same size take {shown(trials)}{ten}.
{large_fits}
## Would a compiled kernel be worth it?

How much of whole jobs is spent in the sweeps through the chain, Jacobian included, and what a kernel that took no time
at all would therefore gain at most (measured once, on the IRB 120 with 50 configurations and 3 targets):

| job | share of sweeps | at most faster |
|---|---|---|
| the solver alone | 43 % | 1.74 |
| `identify`, geometric | 16 % | 1.20 |
| `identify`, elastic | 16 % | 1.19 |
| `calibrate`, elastic, judged | 18 % | 1.22 |
| `calibrate --model auto` | 19 % | 1.24 |
| expected error of an elastic fit | 8 % | 1.09 |
| simulated calibrations | 33 % | 1.49 |
| forward kinematics of one configuration | 62 % | 2.6 |
| inverse of one pose near a seed (jogging) | 42 % | 1.72 |
| inverse of 1000 poses near seeds | 38 % | 1.61 |

So there is none. A fit, its judgement and the choice of effects would gain a fifth at most, and jogging goes from 15 to
9 ms a pose, which nobody feels. That is no reason for a second implementation of the chain, wheels for every system
and Python, or a compiler that takes half a second to import.

## Inverse kinematics of 10 000 poses of the IRB 120

| what | time | times truearm's on one branch |
|---|---|---|
{nl.join(inverses)}

Solved: Pinocchio as documented {100 * (documented or 0):.1f} % (measured on the first 1000 poses), from near seeds
{100 * (solved or 0):.2f} %; truearm solves them on the branch that is asked for, or says why not.
Which ratio counts depends on what one has: without a seed near the answer the documented loop is what there is.
{distances}{programs}{curves}"""


# -- what `auto` finds -----------------------------------------------------------------------------------


#: Headings of the page: what is between them is made from files of results, and what follows is written by hand.
MEASURED, BY_HAND = "## What `auto` predicts: measured robots", "## Tests by ISO 9283"
EVERY_EFFECT = """\
Mean held-out errors of positions [mm], medians over splits (`benchmarks/every_effect.py`). Each split trains all models
on the same configurations and judges them on the rest. The arms are measured by laser trackers, the positioner of two
joints by a 6D sensor. Nothing is known to load the positioner, so `elastic` and `tilting` are `geometric` there.

{errors}

Worst: of `auto`, over the splits. No order: of `auto`, where the place of a configuration in the campaign is not known.
Best: the model beside `auto` with the lowest median. Before: `auto` at commit {commit}, when cross-validation chose the
effects, on the same splits. Ratios are formed split by split, and their median is shown. Times are of the processor.

{ratios}
"""
RANDOM = """
The 20 random configurations of the UR5, after 700 of its grid: {figures}. Their order is not known.
"""
#: Commit with the effects that cross-validation chose, and what it left on the first splits [mm].
BEFORE_COMMIT = "04b7ffea"
BEFORE: dict[str, tuple[float, ...]] = {
    "IRB 120, 20": (0.0953, 0.1021, 0.1057, 0.1096, 0.0874, 0.0968, 0.1531, 0.0964, 0.1052, 0.0879),
    "IRB 120, 40": (0.0641, 0.0631, 0.0705, 0.0678, 0.0746, 0.0628, 0.0654, 0.0671, 0.0783, 0.0669),
    "IRB 120, 80": (0.0569, 0.0461, 0.0575, 0.0576, 0.0575, 0.0496, 0.0581, 0.054, 0.0508, 0.0558),
    "UR5, 20 of the grid": (0.1382, 0.1104, 0.1628, 0.1112, 0.1499, 0.1276, 0.1893, 0.1278, 0.1436, 0.1337),
    "UR5, 40 of the grid": (0.111, 0.1035, 0.1092, 0.1007, 0.1109, 0.1039, 0.1589, 0.1038, 0.1086, 0.1055),
    "UR5, 80 of the grid": (0.0703, 0.0808, 0.0717, 0.066, 0.0632, 0.0938, 0.0715, 0.0701, 0.0755, 0.1013),
    "positioner, 144": (0.3825, 0.417, 0.377, 0.4003, 0.3792, 0.3789, 0.4016, 0.3767, 0.4319, 0.3805),
    "IRB 120, 300": (0.0398, 0.0427, 0.0403, 0.041, 0.0406, 0.0423, 0.0431, 0.0427, 0.0418, 0.0399),
    "UR5, 300 of the grid": (0.0483, 0.0472, 0.0481, 0.0484, 0.047, 0.0472, 0.0471, 0.0482, 0.049, 0.0474),
}


def every_effect() -> str:
    """Return the section on measured robots, from what benchmarks/every_effect.py found; empty if it never ran."""
    file = HERE / "every_effect.json"
    if not file.exists():
        return ""
    found: dict[str, list[dict[str, Figures]]] = json.loads(file.read_text())

    def middle(rows: list[dict[str, Figures]], model: str, key: str = "mm") -> float:
        return float(median(row[model][key] for row in rows))

    models = list(next(iter(found.values()))[0])
    errors = [["robot, training configurations", "splits", *models, "worst", "no order"]]
    ratios = [["robot, training configurations", "best", "auto by best", "auto by before", "auto [s]", "elastic [s]"]]
    for name, rows in found.items():
        figures = [*(middle(rows, model) for model in models), max(row["auto"]["mm"] for row in rows)]
        errors.append([name, str(len(rows)), *(f"{mm:.3f}" for mm in (*figures, middle(rows, "auto", "no order")))])
        best = min((model for model in models if model != "auto"), key=lambda model: middle(rows, model))
        by_best = median(row["auto"]["mm"] / row[best]["mm"] for row in rows)
        pairs = [row["auto"]["mm"] / mm for row, mm in zip(rows, BEFORE.get(name, ()), strict=False)]
        by_before = f"{median(pairs):.2f}" if pairs else ""
        times = [f"{middle(rows, model, 'seconds'):.2g}" for model in ("auto", "elastic")]
        ratios.append([name, best, f"{by_best:.2f}", by_before, *times])
    text = EVERY_EFFECT.format(errors=table(errors), ratios=table(ratios), commit=BEFORE_COMMIT)
    for rows in found.values():
        if "random" in rows[0]["auto"]:
            text += RANDOM.format(figures=", ".join(f"{m} {middle(rows, m, 'random'):.3f}" for m in models))
    return f"\n{MEASURED}\n\n{text}"


ON_TWINS = """
## What `auto` predicts and lets expect: simulated robots

{count} robots like an IRB 120, simulated (`benchmarks/every_effect_on_twins.py`). Geometry and joint zeros are drawn
from the priors. The tracker's noise is 0.015 mm, one target or three are read, and joints repeat to 0.002 deg. The
truths:

- geometry: nothing else.
- elastic: joints give way to loads. All further truths have that too.
- bent: they harden, and bearings give way.
- worn: backlash and clearance.
- late: joints stop short of where they are sent, by the direction they come from, and links grow as the arm warms up.
- gears: sines of 1 and 2 periods in a turn, and of three numbers between 10 and 60, in each joint.
- teeth: the same with triangles in place of the three sines, and with four worn places of the turn.
- heavy: links are 1.4 times as heavy as the file says, and their centres of gravity some 30 mm off along each axis.
- all: bent, worn, late and gears.

How often the interval of 90 % of the expected error held the true mean error over the workspace: inside, true below it,
true above it. The true error contains that joints repeat. Neither the direction of approach nor the place in a session
is known. Bound: of those above, how many were said to be a lower bound only.

{intervals}

The true error of `auto`, by that of the model that knows the truth, fitted to the same readings: `geometric` with the
effects of the truth and no others, the true numbers of periods and the true masses. It does not know the worn places of
teeth, or that these are triangles. Here joints stop exactly where they are sent, and the order is known. Median, and in
brackets the 90th of 100:

{ratios}
"""


def every_effect_on_twins() -> str:
    """Return the section on twins, from what benchmarks/every_effect_on_twins.py found; empty if it never ran."""
    file = HERE / "every_effect_on_twins.json"
    if not file.exists():
        return ""
    record: Figures = json.loads(file.read_text())
    twins: list[Figures] = [dict(zip(record["columns"], row, strict=True)) for row in record["twins"]]
    counts = sorted({twin["configurations"] for twin in twins})
    truths = [*dict.fromkeys(twin["truth"] for twin in twins)]

    def of(truth: str, count: int | None = None) -> list[Figures]:
        return [
            twin for twin in twins if truth in (twin["truth"], "together") and count in (twin["configurations"], None)
        ]

    def held(some: list[Figures]) -> str:
        below = sum(twin["true"] < twin["low"] for twin in some)
        above = sum(twin["true"] > twin["high"] for twin in some)
        return f"{len(some) - below - above}, {below}, {above}"

    def ratio(some: list[Figures]) -> str:
        ratios = sorted(twin["auto"] / twin["knowing"] for twin in some)
        return f"{median(ratios):.2f} ({ratios[int(0.9 * (len(ratios) - 1) + 0.5)]:.2f})" if ratios else ""

    head = ["truth", *(f"{count} configurations" for count in counts)]
    intervals = [[*head, "all of them", "bound", "expected by true"]]
    ratios = [[*head, "one target", "three targets"]]
    for truth in (*truths, "together"):
        some = of(truth)
        bound = sum(twin["lower_bound"] for twin in some if twin["true"] > twin["high"])
        by_true = median(twin["expected"] / twin["true"] for twin in some)
        each = [of(truth, count) for count in counts]
        intervals.append([truth, *map(held, each), held(some), str(bound), f"{by_true:.2f}"])
        by_targets = ([twin for twin in some if twin["targets"] == targets] for targets in (1, 3))
        ratios.append([truth, *map(ratio, each), *map(ratio, by_targets)])
    return ON_TWINS.format(count=len(twins), intervals=table(intervals), ratios=table(ratios))


def table(rows: list[list[str]]) -> str:
    """Return a table; its first row is the head."""
    head, *rest = rows
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rest))


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
