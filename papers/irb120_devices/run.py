"""An IRB 120 calibrated in three set-ups, with every instrument and zone by zone, once a seed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from papers import Progress
from papers.irb120_devices.identified import deviations
from papers.irb120_devices.instruments import Accuracy, ToolErrors, accuracy, tool_alone
from papers.irb120_devices.nests import nest_errors
from papers.irb120_devices.setups import (
    SETUPS,
    Calibrated,
    Setup,
    Shares,
    calibrate,
    number_by_o1,
    shares,
    sphere_test,
    twin_of,
    uncalibrated,
    visible_configurations,
)
from papers.irb120_devices.twin import Truth, driven, running_out
from papers.seeds import Seed, over_seeds
from truearm.engine.choosing.zones import identify_zones
from truearm.engine.data.statistics import Spread
from truearm.engine.fit.models import named_model
from truearm.engine.robot.chain import Array
from truearm.engine.twin.devices.device import Device
from truearm.engine.twin.devices.touching import Artefact
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure

#: Set-ups in which a model without compliance is tried.
_RIGID: Final = ("tracker", "spatial artefact")
#: Every instrument gets as many configurations; those that read one number at a time also three times as many.
COUNT: Final = 36
_ONE_NUMBER: Final = ("ballbar", "plane", "sphere", "two-spheres")
TOUCHES: Final = (4, 10, 36)
#: How far zones overlap, and the deviation of a coordinate that is read for them [m].
_OVERLAP, _NOISE = 0.05, 1e-5
_SHOWN: Final = 20000


@dataclass(frozen=True)
class Sphere:
    """A ballbar test of section 2.6.3: who was tested, where the bar hung, what came out [mm]."""

    setup: str
    nest: str
    points: int
    mean: str
    std: str
    max: str
    table: str


SPHERES: Final = (
    Sphere("tracker", "1", 123, "-0.105", "0.091", "0.327", "2.12"),
    Sphere("planar artefact", "1", 123, "0.022", "0.110", "0.250", "2.12"),
    Sphere("tracker", "2", 95, "-0.148", "0.118", "0.437", "2.12"),
    Sphere("planar artefact", "2", 95, "-0.048", "0.135", "0.363", "2.12"),
    Sphere("spatial artefact", "1", 108, "0.091", "0.126", "0.328", "2.13"),
    Sphere("spatial artefact", "3", 90, "0.146", "0.130", "0.385", "2.13"),
)


@dataclass(frozen=True)
class Settings:
    """How large the study is."""

    unseen: int  #: Configurations to judge by, and the most points of a ballbar test.
    candidates: int  #: Visible configurations to choose those of a calibration from.
    few: int  #: At how many seeds at most ballbar, instruments, tool and zones are looked at.
    devices: tuple[Device, ...]  #: The instruments that are compared.
    training: tuple[int, int]  #: Configurations that zones share, few and many.
    zoned: tuple[str, ...]  #: Models that are cut into zones.
    divisions: tuple[tuple[int, int, int], ...]  #: Numbers of zones along x, y and z of the base.


@dataclass(frozen=True, eq=False)
class SetupOutcome:
    """A set-up. Errors are position errors of the nests at unseen configurations [m]."""

    before: Spread  #: Of the nominal robot.
    after: Spread  #: after, by_chance: of the document's model from configurations chosen by O1, and drawn by chance.
    by_chance: Spread
    #: The same from configurations chosen by O1, of a twin whose gears run out no more than the test of single joints
    #: allows.
    least: Spread
    rigid: Spread | None  #: Of a model without compliance, where it is tried.
    all_reflectors: Spread | None  #: With every reflector read at every configuration; the tracker alone.
    #: number_tool_known, number_tool_free: how many configurations O1 asks for: nests measured on the tool beforehand,
    #: or found with the robot.
    number_tool_known: int
    number_tool_free: int
    shares: Shares  #: What the instrument sees.
    errors: Array  #: All errors that `after` sums up [mm].
    places: Array  #: Where the robot says nest 1 was measured [m], ``(n, 3)``.
    identified: Mapping[str, float]  #: Deviations from nominal, by the document's names and in its units.


@dataclass(frozen=True)
class Missed:
    """By how much a ballbar misses its length: mean, standard deviation and largest size [mm]."""

    mean: float
    std: float
    max: float


@dataclass(frozen=True)
class Cut:
    """A model from a number of configurations, for each zone of the workspace or for the whole of it."""

    model: str  #: Its name.
    configurations: int  #: How many the zones share.
    #: Numbers of zones along x, y and z of the base; None for one model of the whole.
    divisions: tuple[int, int, int] | None = None


@dataclass(frozen=True, eq=False)
class Further:
    """What takes long and is looked at for few seeds."""

    spheres: Mapping[Sphere, Missed]  #: The ballbar tests.
    instruments: tuple[Accuracy, ...]  #: What every instrument makes of the robot, in the same order for all seeds.
    tool: ToolErrors  #: A tool calibrated alone.
    zones: Mapping[Cut, Spread]  #: Errors of the models for zones [m].


@dataclass(frozen=True, eq=False)
class Outcome:
    """One seed."""

    setups: Mapping[str, SetupOutcome]  #: The document's set-ups, by name.
    #: Errors of one set-up's calibration where another one sees, by both names [m].
    crossed: Mapping[tuple[str, str], Spread]
    #: Errors of the nests against a measuring machine [m], by artefact and instrument, ``(4,)`` each.
    nests: Mapping[tuple[str, str], Array]
    further: Further | None  #: What is looked at for few seeds only.


def run(seeds: int, progress: Progress, settings: Settings) -> tuple[Outcome, ...]:
    """Calibrate in all ways, once a seed."""
    return over_seeds(seeds, progress, partial(_one, settings=settings))


def looked_at(outcomes: Iterable[Outcome]) -> tuple[Further, ...]:
    """Return what was looked at for few seeds only."""
    return tuple(one.further for one in outcomes if one.further is not None)


def by_instrument(outcomes: Iterable[Outcome]) -> tuple[tuple[Accuracy, ...], ...]:
    """Return for each instrument, and number of configurations, what it made of the robot at every seed."""
    return tuple(zip(*(further.instruments for further in looked_at(outcomes)), strict=True))


def _one(seed: Seed, settings: Settings) -> Outcome:
    rng = seed.generator()
    further = seed.number < settings.few
    setups: dict[str, SetupOutcome] = {}
    spheres: dict[Sphere, Missed] = {}
    seed.step("three set-ups")
    for setup in SETUPS:
        twin = twin_of(setup, setup.truth)
        robot, setups[setup.name] = _one_setup(setup, twin, settings, rng)
        if further:
            spheres |= _spheres("2.13", twin, {setup.name: robot}, settings, rng)
    twin, alike, crossed = _crossed(settings, rng)
    nests = _nests(rng)
    if not further:
        return Outcome(setups, crossed, nests, None)
    seed.step("ballbar")
    spheres |= _spheres("2.12", twin, alike, settings, rng)
    seed.step("every instrument")
    instruments, tool = _instruments(settings, rng)
    seed.step("zones")
    return Outcome(setups, crossed, nests, Further(spheres, instruments, tool, _zones(settings, rng)))


def _one_setup(
    setup: Setup, twin: Twin, settings: Settings, rng: np.random.Generator
) -> tuple[Calibrated, SetupOutcome]:
    candidates = settings.candidates
    truth = Truth.of(twin, visible_configurations(setup, settings.unseen, rng)[0])
    robot = calibrate(setup, twin, candidates, rng)
    errors = robot.errors(truth)
    by_chance = calibrate(setup, twin, candidates, rng, chosen=False).errors(truth)
    rigid, everywhere = None, None
    if setup.name in _RIGID:
        rigid = Spread.of(calibrate(setup, twin, candidates, rng, named_model("geometric")).errors(truth))
    if setup is SETUPS[0]:
        # Cones that are open all round: every reflector at every configuration.
        open_cones = replace(setup, device=replace(setup.device, within=np.pi))
        everywhere = Spread.of(calibrate(open_cones, twin, candidates, rng).errors(truth))
    quiet = twin_of(setup, setup.truth, least=True)
    least = calibrate(setup, quiet, candidates, rng).errors(Truth.of(quiet, truth.joints))
    return robot, SetupOutcome(
        least=Spread.of(least),
        before=Spread.of(uncalibrated(setup, truth)),
        after=Spread.of(errors),
        by_chance=Spread.of(by_chance),
        rigid=rigid,
        all_reflectors=everywhere,
        number_tool_known=number_by_o1(setup, candidates, rng, tool_known=True),
        number_tool_free=number_by_o1(setup, candidates, rng, tool_known=False),
        shares=shares(setup, _SHOWN, rng),
        errors=1e3 * errors,
        places=robot.places(robot.joints, "1"),
        identified=deviations(robot.robot),
    )


def _nests(rng: np.random.Generator) -> dict[tuple[str, str], Array]:
    tracker, planar, spatial = SETUPS
    found = {}
    for artefact, setup in (("triangular", planar), ("spatial", spatial)):
        device = setup.device
        size = device.size if isinstance(device, Artefact) else None
        found[artefact, "laser tracker"] = nest_errors(setup, tracker.device.sigma, None, rng)
        found[artefact, "C-Track"] = nest_errors(setup, device.sigma, size, rng)
    return found


def _crossed(
    settings: Settings, rng: np.random.Generator
) -> tuple[Twin, dict[str, Calibrated], dict[tuple[str, str], Spread]]:
    """Calibrate one twin in all set-ups and judge each where the others see it."""
    alike = [replace(setup, payload=SETUPS[0].payload, nests=SETUPS[0].nests) for setup in SETUPS]
    twin = twin_of(alike[0], SETUPS[0].truth)
    truths = {setup.name: Truth.of(twin, visible_configurations(setup, settings.unseen, rng)[0]) for setup in alike}
    made = {setup.name: calibrate(setup, twin, settings.candidates, rng) for setup in alike}
    errors = {(one, other): Spread.of(made[one].errors(truth)) for one in made for other, truth in truths.items()}
    return twin, made, errors


def _spheres(
    table: str, twin: Twin, made: Mapping[str, Calibrated], settings: Settings, rng: np.random.Generator
) -> dict[Sphere, Missed]:
    found = {}
    for sphere in SPHERES:
        if sphere.table == table and sphere.setup in made:
            points = min(sphere.points, settings.unseen)
            missed = 1e3 * sphere_test(made[sphere.setup], twin, sphere.nest, points, rng)
            found[sphere] = Missed(float(missed.mean()), float(missed.std()), float(np.abs(missed).max()))
    return found


def _instruments(settings: Settings, rng: np.random.Generator) -> tuple[tuple[Accuracy, ...], ToolErrors]:
    nominal = driven()
    twin = truth_twin(nominal, SETUPS[0].truth, rng)
    nominal = nominal.with_payload(twin.robot.payload)
    truth = Truth.of(twin, nominal.random_configurations(settings.unseen, rng))
    found = tuple(
        accuracy(device, nominal, twin, truth, count, rng)
        for device in settings.devices
        for count in ((COUNT, 3 * COUNT) if device.name in _ONE_NUMBER else (COUNT,))
    )
    return found, tool_alone(nominal, twin, truth, TOUCHES, rng)


def _zones(settings: Settings, rng: np.random.Generator) -> dict[Cut, Spread]:
    nominal = driven()
    twin = running_out(truth_twin(nominal, SETUPS[0].truth, rng))
    nominal = nominal.with_payload(twin.robot.payload)
    read = measure(twin, nominal.random_configurations(max(settings.training), rng), _NOISE, rng)
    truth = Truth.of(twin, nominal.random_configurations(settings.unseen, rng))
    nests = {t.name: tuple(twin.robot.values[t.parameter(axis)] for axis in "xyz") for t in twin.robot.targets}

    def spread(predicted: Sequence[Array]) -> Spread:
        apart = [places - truth.places(point) for places, point in zip(predicted, nests.values(), strict=True)]
        return Spread.of(np.linalg.norm(np.concatenate(apart), axis=1))

    found = {}
    for count in settings.training:
        data = read.of_configurations(range(count))
        for name in settings.zoned:
            for divisions in settings.divisions:
                cut = identify_zones(nominal, data, named_model(name), divisions, _OVERLAP)
                found[Cut(name, count, divisions)] = spread([cut.positions(truth.joints, nest) for nest in nests])
                whole = cut.whole.robot
            found[Cut(name, count)] = spread([whole.world_poses(truth.joints, nest)[0] for nest in nests])
    return found
