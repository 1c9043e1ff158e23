"""One seed of the study katana-devices: a Katana twin calibrated with one instrument after the other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from papers import Progress
from papers.katana.robot import TIP, katana, published
from papers.katana.tilting import tilting_from_inclinometers, twin
from papers.katana_devices.page import Corrector, Pages, drawn_pages
from papers.katana_devices.setup import (
    ATTACHMENT,
    DOCUMENT,
    LOW_COST,
    MIDDLE,
    PLACE,
    POINT,
    RADIUS,
    REFLECTORS,
    STARTS,
    USED,
    VIEWS,
    Counts,
    DocumentInstrument,
    Start,
    View,
)
from papers.seeds import Seed, over_seeds
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import FRAMES, MODELS
from truearm.engine.fit.problem import gauge_freedoms
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rigid_motion
from truearm.engine.twin.devices.device import Device, measured_with
from truearm.engine.twin.devices.lengths import TOUCH_UP
from truearm.engine.twin.devices.pencil import DRAWN_CIRCLE, PencilCircle
from truearm.engine.twin.devices.touching import MARKERS
from truearm.engine.twin.twin import Twin

_DRAWN_AT_RANDOM: Final = 10_000
_TRIES: Final = 10
_GEOMETRIC: Final = next(model for model in MODELS if model.name == "geometric")


@dataclass(frozen=True)
class Errors:
    """Mean and largest of some errors [mm]; NaN where there is nothing to compare with."""

    mean: float
    largest: float


@dataclass(frozen=True, eq=False)
class Reached:
    """What a calibration with one instrument reaches."""

    configurations: int  #: How many were measured.
    own: Errors  #: On unseen configurations in the instrument's own frame; NaN where it has none.
    moved: Errors  #: Likewise after the best rigid motion of all predictions.
    size: float  #: By how much predicted lengths are too long [1].
    gauge: tuple[str, ...]  #: What nobody measured: the base, the size.
    unobservable: tuple[str, ...]  #: Parameters that predictions need and the instrument does not determine.


@dataclass(frozen=True, eq=False)
class OfDocument:
    """One of the document's instruments."""

    from_nominal: Errors  #: Distances between what it measured and the nominal robot where it stands.
    reached: Mapping[Start, Reached]  #: By start.


@dataclass(frozen=True, eq=False)
class Outcome:
    """What one seed gives."""

    #: before_optotrak, before_markers: the nominal robot with base and tool fitted to the document's markers, and to
    #: the registry's on the pencil.
    before_optotrak: Reached
    before_markers: Reached
    document: Mapping[DocumentInstrument, OfDocument]  #: The document's instruments.
    reached: Mapping[tuple[str, Start], Reached]  #: By name of the instrument, and by start.
    views: Mapping[View, float]  #: Share of random configurations that an instrument sees [%].
    pages: Pages  #: The circle on the page.


def run(seeds: int, progress: Progress, counts: Counts) -> tuple[Outcome, ...]:
    """Calibrate a twin with every instrument, compare it elsewhere and on the circle, once a seed.

    Args:
        seeds: How many: of the configurations, of the noise, and of the posture in which the circle is drawn.
        progress: Called with a few words at each step.
        counts: How much is measured and judged.
    """
    return over_seeds(seeds, progress, partial(_one, counts=counts))


def _one(seed: Seed, counts: Counts) -> Outcome:
    rng = seed.generator()
    nominal = katana()
    fit = tilting_from_inclinometers(nominal, twin(published("standard")), rng)
    starts: dict[Start, Robot] = {"geometry alone": nominal, "tilting first": fit.robot}
    others = nominal.random_configurations(counts.unseen, rng)
    at_end, with_pencil = (_placed(published("standard"), places) for places in (ATTACHMENT.targets, REFLECTORS))
    end, tip = (truth.frames(others)[TIP][:, :3, 3] for truth in (at_end, with_pencil))

    def before(data: Dataset, true: Array) -> Reached:
        data = _without_deviations(data)
        return _reached(identify(nominal, data, FRAMES), data, others, true)

    def fitted(data: Dataset) -> dict[Start, Fit]:
        return {name: identify(start, _without_deviations(data), _GEOMETRIC) for name, start in starts.items()}

    in_place = nominal.with_frames(PLACE, ATTACHMENT.targets)
    printed = {name: _measured(device, nominal, at_end, count, rng) for name, (device, count) in DOCUMENT.items()}
    document = {
        name: OfDocument(
            from_nominal=_errors(np.linalg.norm(data.position - in_place.world_poses(data.joints, TIP)[0], axis=1)),
            reached={start: _reached(found, data, others, end) for start, found in fitted(data).items()},
        )
        for name, data in printed.items()
    }
    campaigns = {}
    for device in USED:
        led = device if device.tool is None else replace(device, tool=POINT)
        if isinstance(led, PencilCircle):
            led = replace(led, centre=MIDDLE, radius=RADIUS)
        campaigns[device.name] = _measured(led, nominal, with_pencil, counts.of(device), rng)
    campaigns[LOW_COST] = together(campaigns[TOUCH_UP.name], campaigns[DRAWN_CIRCLE.name])
    fits = {(name, start): found for name, data in campaigns.items() for start, found in fitted(data).items()}
    correctors: tuple[Corrector, ...] = ("markers", "low-cost")
    corrections = {(name, start): fits[name, start] for name in correctors for start in STARTS}
    views = _views(nominal, nominal.random_configurations(_DRAWN_AT_RANDOM, rng))
    return Outcome(
        before_optotrak=before(printed["optotrak"], end),
        before_markers=before(campaigns[MARKERS.name], tip),
        document=document,
        reached={key: _reached(found, campaigns[key[0]], others, tip) for key, found in fits.items()},
        views=views,
        pages=drawn_pages(corrections, rng),
    )


def _without_deviations(data: Dataset) -> Dataset:
    """Return data whose deviations are estimated from what the fit leaves."""
    return replace(data, sigma=None, sigma_rot=None)


def together(first: Dataset, second: Dataset) -> Dataset:
    """Return two campaigns with the same robot and target and with fixtures of their own as one."""
    k, n = first.configurations, len(first.target)

    def stacked(a: Array | None, b: Array | None) -> Array:
        whole = [np.full(size, np.nan) if v is None else v for v, size in ((a, n), (b, len(second.target)))]
        return np.concatenate(whole)

    return replace(
        first,
        source=f"{first.source} and {second.source}",
        labels=tuple(str(i + 1) for i in range(k + second.configurations)),
        joints=np.concatenate([first.joints, second.joints]),
        configuration=np.concatenate([first.configuration, k + second.configuration]),
        target=np.concatenate([first.target, second.target]),
        position=np.concatenate([first.position, second.position]),
        distance=stacked(first.distance, second.distance),
        height=stacked(first.height, second.height),
        fixtures=(*first.fixtures, *second.fixtures),
        fixture=np.concatenate([first.against, len(first.fixtures) + second.against]),
        setup=second.setup,
        sigma=stacked(first.sigma, second.sigma),
        approach=None,
        number=None,
    )


def _measured(device: Device, nominal: Robot, truth: Twin, count: int, rng: np.random.Generator) -> Dataset:
    """Return a campaign; where an arm cannot be jogged to a place because a joint falls to and fro there, another."""
    for _ in range(_TRIES - 1):
        try:
            return measured_with(device, nominal, truth, count, rng)
        except InputError:
            continue
    return measured_with(device, nominal, truth, count, rng)


def _placed(robot: Robot, places: Mapping[str, tuple[float, float, float]]) -> Twin:
    return twin(robot.with_frames(PLACE, places))


def _views(nominal: Robot, joints: Array) -> dict[View, float]:
    """Return what share of configurations instruments see [%]."""
    return {
        view: 100 * float(device.visible(nominal.with_frames(PLACE, places), joints).any(axis=1).mean())
        for view, (device, places) in VIEWS.items()
    }


def _reached(fit: Fit, data: Dataset, joints: Array, true: Array) -> Reached:
    """Compare a robot with the true places ``(n, 3)`` of its tip in the world."""
    predicted = fit.robot.world_poses(joints, TIP)[0]
    R, p = rigid_motion(predicted, true)
    own = np.linalg.norm(predicted - true, axis=1) if data.anchored else np.full(len(true), np.nan)
    spread, truly = (places - places.mean(axis=0) for places in (predicted @ R.T, true))
    return Reached(
        data.configurations,
        _errors(own),
        _errors(np.linalg.norm(predicted @ R.T + p - true, axis=1)),
        float(np.sum(spread * truly) / np.sum(truly * truly)) - 1.0,
        gauge_freedoms(data),
        fit.unobservable,
    )


def _errors(errors: Array) -> Errors:
    """Return mean and largest of errors [m]."""
    return Errors(1e3 * float(errors.mean()), 1e3 * float(errors.max()))
