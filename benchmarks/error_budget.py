"""Holds the error budget, the intervals by Monte Carlo and zones against simulated robots whose truth is known.

Arguments: campaigns for each case of the budget (20), of Monte Carlo (100) and of zones (30); 0 leaves a part out.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from truearm.calibration.calibrate import calibrate
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.error_budget import ErrorBudget, error_budget
from truearm.engine.diagnose.simulated_calibrations import simulated_calibrations
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import named_model
from truearm.engine.fit.zones import error_sizes, flange_places
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parameters import PLACES
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure

GEOMETRIC = named_model("geometric")
nominal = load_robot("irb120")


def say(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def campaign(
    truth: str, poses: int, noise: float, seed: int, repeat: float = 0.0, visits: int = 1, held_out: int = 200
) -> tuple[Twin, Dataset, Dataset, Dataset]:
    """Return a twin, all readings, and those of both parts."""
    rng = np.random.default_rng(seed)
    twin = truth_twin(nominal, truth, rng)
    joints = np.repeat(nominal.random_configurations(poses + held_out, rng), visits, axis=0)
    data = replace(measure(twin, joints + repeat * rng.standard_normal(joints.shape), noise, rng), joints=joints)
    first, rest = np.split(np.arange(len(joints)), [poses * visits])
    return twin, data, data.of_configurations(first), data.of_configurations(rest)


def true_square(fit: Fit, twin: Twin, data: Dataset) -> float:
    """Return the true mean square of what the robot mispredicts [m^2]."""
    return float(
        np.mean(errors_of(fit.robot, measure(twin, data.joints, 0.0, np.random.default_rng(0))).position_norms ** 2)
    )


def budgets(count: int) -> None:
    """Print the shares of each kind of campaign beside the truth [mm^2]."""
    small = np.radians(0.01)
    kinds: dict[str, Callable[[int], tuple[Twin, Dataset, Dataset, Dataset]]] = {
        "noise alone, 100 configurations": lambda seed: campaign("random", 100, 0.05e-3, seed),
        "14 configurations": lambda seed: campaign("random", 14, 0.05e-3, seed),
        "an arm that gives way, 80": lambda seed: campaign("tracker-triangular", 80, 0.02e-3, seed),
        "repeatability 0.01 deg, 3 visits to 30": lambda seed: campaign("random", 30, 0.02e-3, seed, small, 3, 60),
    }
    for kind, made in kinds.items():
        found: list[ErrorBudget] = []
        true = []
        for seed in range(100, 100 + count):
            twin, data, first, rest = made(seed)
            fit = identify(nominal, first, GEOMETRIC)
            budget = error_budget(fit, data, first, rest)
            assert budget is not None
            found.append(budget)
            true.append(true_square(fit, twin, rest))
        say(f"{kind}: true square of the model's errors {np.mean(true) * 1e6:.4g} mm2")
        for share in found[0].shares:
            if share.square is not None:
                squares = np.array([budget.share(share.source).square or 0.0 for budget in found]) * 1e6
                stated = np.mean([budget.share(share.source).deviation for budget in found]) * 1e6
                say(f"  {share.source:14} {squares.mean():.4g} mm2, scatter {squares.std():.2g}, stated {stated:.2g}")
        rest_of = np.array([(b.share("remainder").square or 0.0) / b.share("remainder").deviation for b in found])
        beyond = np.mean(abs(rest_of) > 2.0)
        say(f"  remainder per deviation: rms {np.sqrt(np.mean(rest_of**2)):.2f}, beyond 2: {beyond:.0%}")


def monte_carlo(count: int) -> None:
    """Print how often intervals of 95 % hold the truth."""
    for poses, repeat in ((50, 0.0), (12, 0.0), (30, np.radians(0.01))):
        held, linear, number = 0, 0, 0
        for seed in range(1000, 1000 + count):
            twin, _, first, rest = campaign("random", poses, 0.05e-3, seed, repeat, held_out=30)
            fit = identify(nominal, first, GEOMETRIC)
            found = simulated_calibrations(fit, first, rest, 200, priors=True, seed=seed)
            for i, name in enumerate(found.names):
                p = fit.robot.parameters[name]
                if p.group not in PLACES and (p.informed or 0.0) > 0.5 and name in twin.robot.values:
                    truth = twin.robot.values[name]
                    held += found.interval_95[i, 0] <= truth <= found.interval_95[i, 1]
                    linear += found.linear_interval_95[i, 0] <= truth <= found.linear_interval_95[i, 1]
                    number += 1
        say(
            f"{poses} configurations, repeatability {np.degrees(repeat):g} deg: by Monte Carlo {held / number:.1%}, "
            f"linear {linear / number:.1%} of {number}"
        )


def zones(count: int) -> None:
    """Print how many zones are kept, and what the error on new data is with them."""
    for truth, number in (("tracker-triangular", 4), ("random", 4), ("random", 8)):
        kept, ratios = 0, []
        for seed in range(100, 100 + count):
            rng = np.random.default_rng(seed)
            twin = truth_twin(nominal, truth, rng)
            run = calibrate(
                nominal, measure(twin, nominal.random_configurations(240, rng), 0.02e-3, rng), zones=number, seed=seed
            )
            assert run.zones is not None
            new = measure(twin, nominal.random_configurations(100, rng), 0.02e-3, rng)
            one = error_sizes(errors_of(run.fit.robot, new))
            zoned, places = one.copy(), flange_places(run.fit.start, new.joints)
            for verdict in run.zones.kept:
                mine = np.flatnonzero(verdict.box.holds(places))
                if verdict.fit is not None and len(mine):
                    part = error_sizes(errors_of(verdict.fit.robot, new.of_configurations(mine)))
                    zoned[np.isin(new.configuration, mine)] = part
            kept += len(run.zones.kept)
            ratios.append(float(zoned.mean() / one.mean()))
        say(
            f"{truth}, {number} zones: {kept} of {number * count} kept; error on new data {np.median(ratios):.3f} of "
            f"that of one model, {max(ratios):.3f} at most"
        )


if __name__ == "__main__":
    numbers = [*map(int, sys.argv[1:]), 20, 100, 30][: 3 if len(sys.argv) < 2 else len(sys.argv) - 1]
    for part, campaigns in zip((budgets, monte_carlo, zones), numbers, strict=False):
        if campaigns:
            part(campaigns)
