"""Nubiola, chapter 2: an IRB 120 calibrated in three set-ups, with every other instrument, and zone by zone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from papers import Progress
from papers.irb120 import BETA
from papers.irb120_devices import setups
from papers.irb120_devices.instruments import accuracy, tool_alone
from papers.irb120_devices.setups import SETUPS, Calibrated, Gears, Setup, Truth, calibrate, driven, twin_of
from papers.seeds import Figures, Seed, gathered, over_seeds
from papers.study import Study
from papers.texts import Rows, told
from papers.traces import coordinates, in_space, scatter, scene
from truearm.engine.data.statistics import Spread
from truearm.engine.document.drawing import AFTER, BEFORE, COLOURS, Figure, axis, figure, logarithmic_axis, rounded
from truearm.engine.fit.models import named_model
from truearm.engine.fit.zones import identify_zones
from truearm.engine.robot.chain import Array
from truearm.engine.twin.devices import DEVICES
from truearm.engine.twin.devices.device import Device
from truearm.engine.twin.devices.touching import Artefact
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure

#: Set-ups in which a model without compliance is tried.
_RIGID: Final = ("tracker", "spatial artefact")
#: The tables of the parameters that each set-up identified.
_PARAMETERS: Final = {"tracker": "tracker", "planar artefact": "planar", "spatial artefact": "spatial"}
#: Twins with less that the document's model lacks, by the table of their rows: words, gears, and beta [rad].
_QUIETER: Final[dict[str, tuple[str, Gears, float]]] = {
    "least": ("the least run-out that Table 2.3 allows", "least", BETA),
    "true": ("no run-out", "true", BETA),
    "parallel": ("the least run-out, axes 2 and 3 parallel", "least", 0.0),
}
#: Every instrument gets as many configurations; those that read one number at a time also three times as many.
_COUNT: Final = 36
_COUNTS: Final = {"instruments": _COUNT, "more": 3 * _COUNT}
_ONE_NUMBER: Final = ("ballbar", "plane", "sphere", "two-spheres")
_TOUCHES: Final = (4, 10, 36)
#: How far zones overlap, and the deviation of a coordinate that is read for them [m].
_OVERLAP, _NOISE = 0.05, 1e-5
_SHOWN: Final = 20000
#: Ballbar tests of section 2.6.3, with how many points: Tables 2.12 and 2.13.
_SPHERES_2_12: Final = (
    *(("tracker", "1", 123), ("planar artefact", "1", 123)),
    *(("tracker", "2", 95), ("planar artefact", "2", 95)),
)
_SPHERES_2_13: Final = (("spatial artefact", "1", 108), ("spatial artefact", "3", 90))


@dataclass(frozen=True)
class _Settings:
    """How large the study is; see :func:`study`."""

    unseen: int
    candidates: int
    few: int
    devices: tuple[Device, ...]
    training: tuple[int, int]
    zoned: tuple[str, ...]
    divisions: tuple[tuple[int, int, int], ...]


@dataclass(frozen=True, eq=False)
class _Drawn:
    """What one seed shows beside its figures."""

    errors: Mapping[str, Array]  #: All errors after calibration [mm], by set-up.
    places: Mapping[str, Array]  #: Where the robot says nest 1 was measured [m], ``(n, 3)``, by set-up.
    why: Mapping[str, dict[str, str]]  #: What is to be said of instruments, by table and row.


def study(
    seeds: int,
    progress: Progress,
    unseen: int = 125,
    candidates: int = 600,
    few: int = 2,
    devices: Sequence[Device] = DEVICES,
    training: tuple[int, int] = (100, 300),
    zoned: tuple[str, ...] = ("offsets", "geometric", "elastic"),
    divisions: tuple[tuple[int, int, int], ...] = ((2, 1, 2), (3, 1, 3)),
) -> Study:
    """Calibrate in all ways, once a seed.

    Args:
        seeds: How many: of configurations and noise.
        progress: Called with a few words at each step.
        unseen: Configurations to judge by, and the most points of a ballbar test.
        candidates: Visible configurations to choose those of a calibration from.
        few: At how many seeds at most ballbar, instruments, tool and zones are looked at: they take long.
        devices: The instruments that are compared, a closed loop among them that reads one number at a time.
        training: Configurations that zones share, few and many.
        zoned: Models that are cut into zones, geometric and elastic among them.
        divisions: Numbers of zones along x, y and z of the base, from coarse to fine.
    """
    settings = _Settings(unseen, candidates, few, tuple(devices), training, zoned, divisions)
    found, drawn = gathered(over_seeds(seeds, progress, partial(_one, settings=settings)))
    tables: dict[str, Rows] = {**found}
    tests = [_sphere_words(*sphere) for sphere in (*_SPHERES_2_12, *_SPHERES_2_13)]
    tables["spheres"] = {
        row: of for test in tests for row, of in found["spheres"].items() if row.startswith(f"{test}: ")
    }

    def left(table: str, row: str) -> float:
        return float(np.median(found[table][row]))

    def in_zones(model: str, cut: tuple[int, int, int] | None) -> float:
        return left("zones", f"{_zones_words(model, training[1], cut)}: mean")

    quieter = {
        table: [left("after", f"{setup.name}, {words}: mean") for setup in SETUPS]
        for table, (words, *_) in _QUIETER.items()
    }
    alike = [left("instruments", row) for row in found["instruments"] if row.endswith(": mean")]
    figures = {
        "places": _places_figure(drawn[0].places),
        "errors": _errors_figure([one.errors for one in drawn]),
        "instruments": _instruments_figure(left, found),
    }
    texts: dict[str, object] = {**quieter, "best": min(alike), "worst": max(alike), "count": _COUNT}
    texts |= {"more_count": 3 * _COUNT, "whole": in_zones("geometric", None)}
    texts |= {"cut": in_zones("geometric", divisions[-1]), "elastic": in_zones("elastic", None)}
    texts |= {"candidates": candidates, "unseen": unseen, "few": min(seeds, few)}
    return told(
        __file__,
        seeds,
        tables,
        figures,
        texts,
        printed={_PARAMETERS[setup.name]: setups.printed(setup.truth) for setup in SETUPS},
        why=drawn[0].why,
    )


def _one(seed: Seed, settings: _Settings) -> tuple[Figures, _Drawn]:
    rng = seed.generator()
    further = seed.number < settings.few
    by_setup: Figures = {}
    spheres: dict[str, float] = {}
    errors, places = {}, {}
    seed.step("three set-ups")
    for setup in SETUPS:
        twin = twin_of(setup, setup.truth)
        robot, of_setup, errors[setup.name] = _one_setup(setup, twin, settings, rng)
        places[setup.name] = robot.places(robot.joints, "1")
        for table, rows in of_setup.items():
            by_setup.setdefault(table, {}).update(rows)
        if further:
            spheres |= _spheres(_SPHERES_2_13, twin, {setup.name: robot}, settings, rng)
    twin, alike, crossed = _crossed(settings, rng)
    after = ("after", "all reflectors", *_QUIETER, "by chance", "rigid")
    figures: Figures = {
        **by_setup,
        "after": {row: value for table in after for row, value in by_setup[table].items()},
        "numbers": {**by_setup["numbers"], **by_setup["nests found"]},
        "crossed": crossed,
        "nests": _nests(rng),
    }
    drawn = _Drawn(errors, places, {})
    if not further:
        return figures, drawn
    seed.step("ballbar")
    spheres |= _spheres(_SPHERES_2_12, twin, alike, settings, rng)
    seed.step("every instrument")
    instruments, why = _instruments(settings, rng)
    seed.step("zones")
    return {**figures, "spheres": spheres, **instruments, "zones": _zones(settings, rng)}, replace(drawn, why=why)


def _mean_and_maximum(name: str, errors: Spread) -> dict[str, float]:
    """Return mean and maximum [mm]."""
    return {f"{name}: mean": 1e3 * errors.mean, f"{name}: maximum": 1e3 * errors.max}


def _one_setup(
    setup: Setup, twin: Twin, settings: _Settings, rng: np.random.Generator
) -> tuple[Calibrated, Figures, Array]:
    """Calibrate in one set-up; return the robot, figures, and its errors [mm]."""
    name, candidates = setup.name, settings.candidates
    truth = Truth.of(twin, setups.visible_configurations(setup, settings.unseen, rng)[0])
    robot = calibrate(setup, twin, candidates, rng)
    errors = robot.errors(truth)
    left = Spread.of(errors)
    by_chance = Spread.of(calibrate(setup, twin, candidates, rng, chosen=False).errors(truth))
    figures: Figures = {
        "before": _mean_and_maximum(name, Spread.of(setups.uncalibrated(setup, truth))),
        "after": {f"{name}, {setup.configurations} configurations: mean": 1e3 * left.mean}
        | {f"{name}: maximum": 1e3 * left.max},
        "by chance": {f"{name}, configurations drawn by chance: mean": 1e3 * by_chance.mean},
    }
    if name in _RIGID:
        rigid = Spread.of(calibrate(setup, twin, candidates, rng, named_model("geometric")).errors(truth))
        figures["rigid"] = _mean_and_maximum(f"{name}, no compliance in the model", rigid)
    if setup is SETUPS[0]:
        # Cones that are open all round: every reflector at every configuration.
        open_cones = replace(setup, device=replace(setup.device, within=np.pi))
        everywhere = Spread.of(calibrate(open_cones, twin, candidates, rng).errors(truth))
        row = "tracker, all three reflectors at every configuration: mean"
        figures["all reflectors"] = {row: 1e3 * everywhere.mean}
    for table, (words, gears, beta) in _QUIETER.items():
        other = twin_of(setup, setup.truth, gears, beta)
        errors_of_it = calibrate(setup, other, candidates, rng).errors(Truth.of(other, truth.joints))
        figures[table] = {f"{name}, {words}: mean": 1e3 * Spread.of(errors_of_it).mean}
    for table, words, known in (
        ("numbers", "nests measured on the tool beforehand", True),
        ("nests found", "nests found with the robot", False),
    ):
        figures[table] = {f"{name}, {words}": setups.number_by_o1(setup, candidates, rng, tool_known=known)}
    figures["visible"] = {f"{name}, {what}": share for what, share in setups.shares(setup, _SHOWN, rng).items()}
    figures[_PARAMETERS[name]] = setups.deviations(robot.robot)
    return robot, figures, 1e3 * errors


def _nests(rng: np.random.Generator) -> dict[str, float]:
    """Return errors of the nests against a measuring machine [mm], by artefact and instrument."""
    tracker, planar, spatial = SETUPS
    found = {}
    for artefact, setup in (("triangular", planar), ("spatial", spatial)):
        device = setup.device
        size = device.size if isinstance(device, Artefact) else None
        by = {"laser tracker": (tracker.device.sigma, None), "C-Track": (device.sigma, size)}
        for instrument, noise in by.items():
            for nest, error in enumerate(setups.nest_errors(setup, *noise, rng), 1):
                found[f"{artefact} artefact, {instrument}, nest {nest}"] = 1e3 * float(error)
    return found


def _crossed(settings: _Settings, rng: np.random.Generator) -> tuple[Twin, dict[str, Calibrated], dict[str, float]]:
    """Calibrate one twin in all set-ups and judge each where the others see it."""
    alike = [replace(setup, payload=SETUPS[0].payload, nests=SETUPS[0].nests) for setup in SETUPS]
    twin = twin_of(alike[0], SETUPS[0].truth)
    truths = {
        setup.name: Truth.of(twin, setups.visible_configurations(setup, settings.unseen, rng)[0]) for setup in alike
    }
    made = {setup.name: calibrate(setup, twin, settings.candidates, rng) for setup in alike}
    rows: dict[str, float] = {}
    for one, robot in made.items():
        for other, truth in truths.items():
            words = f"calibrated with the {one}, judged where the {other} sees"
            rows |= _mean_and_maximum(words, Spread.of(robot.errors(truth)))
    return twin, made, rows


def _sphere_words(setup: str, nest: str, points: int) -> str:
    return f"{setup}, nest {nest}, {points} points"


def _spheres(
    tests: Sequence[tuple[str, str, int]],
    twin: Twin,
    made: Mapping[str, Calibrated],
    settings: _Settings,
    rng: np.random.Generator,
) -> dict[str, float]:
    """Return by how much a ballbar misses its length [mm], in set-ups that there are."""
    rows: dict[str, float] = {}
    for setup, nest, points in tests:
        if setup in made:
            missed = 1e3 * setups.sphere_test(made[setup], twin, nest, min(points, settings.unseen), rng)
            words = _sphere_words(setup, nest, points)
            rows |= {f"{words}: mean": float(missed.mean()), f"{words}: standard deviation": float(missed.std())}
            rows[f"{words}: maximum"] = float(np.abs(missed).max())
    return rows


def _instruments(settings: _Settings, rng: np.random.Generator) -> tuple[Figures, dict[str, dict[str, str]]]:
    """Return what every instrument makes of the robot and a tool calibrated alone [mm], and what is said of it."""
    nominal = driven()
    twin = truth_twin(nominal, SETUPS[0].truth, rng)
    nominal = nominal.with_payload(twin.robot.payload)
    truth = Truth.of(twin, nominal.random_configurations(settings.unseen, rng))
    figures: Figures = {**{table: {} for table in _COUNTS}, "loops": {}}
    why: dict[str, dict[str, str]] = {table: {} for table in figures}
    for device in settings.devices:
        for table, count in _COUNTS.items():
            if count == _COUNT or device.name in _ONE_NUMBER:
                rows, said = accuracy(table, device, nominal, twin, truth, count, rng)
                for into in rows if count == _COUNT else (table,):
                    figures[into] |= rows[into]
                    why[into] |= said[into]
    figures["tool"] = tool_alone(nominal, twin, truth, _TOUCHES, rng)
    return figures, why


def _zones_words(model: str, count: int, divisions: tuple[int, int, int] | None) -> str:
    zones = "one model" if divisions is None else f"{' x '.join(map(str, divisions))} zones"
    return f"{model}, {count} configurations, {zones}"


def _zones(settings: _Settings, rng: np.random.Generator) -> dict[str, float]:
    """Return errors of the models for zones, and of one for the whole [mm]."""
    nominal = driven()
    twin = setups.running_out(truth_twin(nominal, SETUPS[0].truth, rng))
    nominal = nominal.with_payload(twin.robot.payload)
    read = measure(twin, nominal.random_configurations(max(settings.training), rng), _NOISE, rng)
    truth = Truth.of(twin, nominal.random_configurations(settings.unseen, rng))
    nests = {t.name: tuple(twin.robot.values[t.parameter(axis)] for axis in "xyz") for t in twin.robot.targets}

    def spread(predicted: Sequence[Array]) -> Spread:
        apart = [places - truth.places(point) for places, point in zip(predicted, nests.values(), strict=True)]
        return Spread.of(np.linalg.norm(np.concatenate(apart), axis=1))

    rows: dict[str, float] = {}
    for count in settings.training:
        data = read.of_configurations(range(count))
        for name in settings.zoned:
            cuts = {
                divisions: identify_zones(nominal, data, named_model(name), divisions, _OVERLAP)
                for divisions in settings.divisions
            }
            whole = cuts[settings.divisions[-1]].whole.robot
            errors = spread([whole.world_poses(truth.joints, nest)[0] for nest in nests])
            rows |= _mean_and_maximum(_zones_words(name, count, None), errors)
            for divisions, cut in cuts.items():
                errors = spread([cut.positions(truth.joints, nest) for nest in nests])
                rows |= _mean_and_maximum(_zones_words(name, count, divisions), errors)
    return rows


def _places_figure(places: Mapping[str, Array]) -> Figure:
    """Draw where nests were measured."""
    traces = [
        in_space(f"{name}, {len(at)}", "markers", coordinates(at, 4), marker={"size": 4, "color": colour})
        for (name, at), colour in zip(places.items(), COLOURS, strict=True)
    ]
    return figure(traces, 460, scene=scene("m"))


def _errors_figure(drawn: Sequence[Mapping[str, Array]]) -> Figure:
    """Draw histograms of the errors after calibration, of all seeds together."""
    edges = np.linspace(0.0, 0.6, 41)
    traces = []
    for setup, colour in zip(SETUPS, COLOURS, strict=True):
        every = np.concatenate([errors[setup.name] for errors in drawn])
        share = 100.0 * np.histogram(np.clip(every, 0.0, edges[-1]), edges)[0] / len(every)
        x, y = rounded(0.5 * (edges[:-1] + edges[1:]), 4), rounded(share, 4)
        name = f"{setup.name}, {setup.configurations} configurations"
        traces.append(scatter(name, "lines", x, y, line={"color": colour, "shape": "hvh"}))
    return figure(traces, 340, xaxis=axis("position error [mm]"), yaxis=axis("share [%]"))


def _instruments_figure(left: Callable[[str, str], float], found: Mapping[str, Rows]) -> Figure:
    """Draw what every instrument leaves, as bars."""
    traces: list[Figure] = []
    for (table, count), colour in zip(_COUNTS.items(), (AFTER, BEFORE), strict=True):
        means = [row for row in found[table] if row.endswith(": mean")]
        traces.append(
            {
                **{"type": "bar", "orientation": "h", "name": f"{count} configurations"},
                "y": [row.removesuffix(": mean") for row in means],
                "x": rounded(np.array([left(table, row) for row in means]), 4),
                "marker": {"color": colour},
                "hovertemplate": "%{y}: %{x:.3g} mm<extra></extra>",
            }
        )
    across = logarithmic_axis("mean position error [mm]", 1e-3, 1.0)
    down = axis("") | {"autorange": "reversed"}
    return figure(traces, 520, xaxis=across, yaxis=down, barmode="group")
