"""The search among joint effects by cross-validation in closed form: every choice, or one by one of many."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.choosing.candidates import Ground
from truearm.engine.choosing.cross_validation import Extensions, Folds, LinearFit
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.effects.joint_curve import JointCurve

CURVE: Final = JointCurve.name
#: Effects that say how something differs from its base, which a model without the base would have them stand in for.
BASES: Final = {effect.name: effect.part_of for effect in EFFECTS if effect.part_of}
#: So many choices are all looked at; of more, one effect after the other is added, or two.
_ALL: Final = 1024
#: Standard errors, and share of the held-out error, that curves have to gain: hundreds of coefficients are looked at no
#: further for less.
CLEAR: Final = 3.0
_WORTH_IT: Final = 0.05
#: Share of the held-out error below which a gain is none.
_NEGLIGIBLE: Final = 0.02


@dataclass(frozen=True)
class Gain:
    """What a choice gains over another."""

    mean: float  #: mean, error: mean and standard error of the paired differences of held-out errors [m].
    error: float
    before: float = 0.0  #: Mean held-out error of the other [m].

    @property
    def believed(self) -> bool:
        """Whether it is larger than its standard error, and more than a negligible share of the error."""
        return self.mean > max(self.error, _NEGLIGIBLE * self.before)

    def clear(self, errors: float) -> bool:
        """Return whether it is larger than so many standard errors, and more than a negligible share of the error."""
        return self.mean > max(errors * self.error, _NEGLIGIBLE * self.before)

    @property
    def harms(self) -> bool:
        """Whether it is a loss, larger than its standard error."""
        return -self.mean > self.error


def gain(before: Array, after: Array, folds: Folds) -> Gain:
    """Return what errors of configurations ``(n,)`` [m] gained.

    The standard error is the larger one of two: over the groups of configurations that lie together, and over the
    folds, whose configurations share a fit.
    """
    known = np.isfinite(before) & np.isfinite(after)
    if not known.any():
        return Gain(0.0, 0.0)
    apart = (before - after)[known]
    error = max(_standard_error(apart, of[known]) for of in (folds.group, folds.of))
    return Gain(float(apart.mean()), error, float(before[known].mean()))


def mean_over(draws: Sequence[Array]) -> Array:
    """Return the mean of errors of configurations over draws of the folds, NaN where there is none, ``(n,)``."""
    every = np.stack(draws)
    known = np.isfinite(every)
    count = known.sum(axis=0)
    return np.where(count > 0, np.where(known, every, 0.0).sum(axis=0) / np.maximum(count, 1), np.nan)


def complete(chosen: frozenset[str]) -> bool:
    """Return whether every effect of a choice is there with what it is a part of."""
    return all(BASES.get(name, name) in chosen for name in chosen)


def without(chosen: frozenset[str], name: str) -> frozenset[str]:
    """Return a choice without an effect, and without those that are nothing without it."""
    return frozenset(one for one in chosen if one != name and BASES.get(one) != name)


def with_bases(chosen: frozenset[str]) -> frozenset[str]:
    """Return a choice with what its effects are parts of."""
    return chosen.union(BASES.get(name, name) for name in chosen)


def _standard_error(apart: Array, group: NDArray[np.intp]) -> float:
    """Return the standard error of the mean of numbers that hang together in groups."""
    count = np.bincount(group)
    sums = np.bincount(group, apart - apart.mean())[count > 0]
    return float(np.sqrt(np.sum(sums**2) * len(sums) / max(len(sums) - 1, 1)) / len(apart))


@dataclass(frozen=True, eq=False)
class Draw:
    """Folds as they were drawn once: held-out errors of every choice among some columns."""

    ground: Ground  #: What turns rows into errors.
    fit: LinearFit  #: What columns are added to.
    columns: Array  #: Of all effects beside each other, per prior.
    unordered: Array  #: The same where the order of a campaign is not known.

    @cached_property
    def extensions(self) -> Extensions:
        """The fit, and the columns that could be added."""
        return Extensions(replace(self.fit, fold=self.ground.fold), self.columns)

    @cached_property
    def _without_order(self) -> Extensions:
        return replace(self.extensions, predicting=self.unordered)

    def errors(self, places: NDArray[np.intp]) -> Array:
        """Return the mean held-out error of each configuration with some columns [m], ``(n,)``."""
        return self._found(self.extensions, self._shown, places)

    def errors_without_order(self, places: NDArray[np.intp]) -> Array:
        """Return the same where the order of the held-out configurations is not known."""
        return self._found(self._without_order, self._shown_without_order, places)

    def _found(self, extensions: Extensions, shown: Array, places: NDArray[np.intp]) -> Array:
        left = shown[:, -1].copy()
        for fold, mine in zip(extensions.folds, self._of_fold, strict=True):
            if len(places):
                left[mine] += shown[np.ix_(mine, places)] @ fold.values(places)
        return self.ground.by_configuration(left)

    @cached_property
    def _of_fold(self) -> tuple[NDArray[np.intp], ...]:
        """Compared rows of each fold, among the compared ones."""
        fold = self.ground.fold[self.ground.compared[0]]
        return tuple(np.flatnonzero(fold == number) for number in range(self.extensions.fit.folds))

    @cached_property
    def _shown(self) -> Array:
        return self._in_metres(self.extensions)

    @cached_property
    def _shown_without_order(self) -> Array:
        return self._in_metres(self._without_order)

    def _in_metres(self, extensions: Extensions) -> Array:
        """Return what each held-out column adds and what is left without any [m], ``(compared rows, k + 1)``."""
        rows = np.zeros((len(self.ground.fold), extensions.columns.shape[1] + 1))
        for fold in extensions.folds:
            rows[fold.rows, :-1], rows[fold.rows, -1] = fold.columns, fold.residual
        return np.asarray(self.ground.in_metres(rows)[self.ground.compared[0]])


@dataclass(frozen=True, eq=False)
class Search:
    """A linear fit, effects that could be added to it, and the held-out errors of every choice asked for."""

    grounds: tuple[Ground, ...]  #: What turns rows into errors: one for each draw of the folds.
    fit: LinearFit  #: What effects are added to.
    columns: dict[str, Array]  #: Of each effect, per prior.
    #: Columns of the effects that follow the order of a campaign, where the order is not known.
    unordered: dict[str, Array] = field(default_factory=dict)
    _errors: dict[frozenset[str], Array] = field(default_factory=dict, init=False)
    _means: dict[frozenset[str], float] = field(default_factory=dict, init=False)

    @cached_property
    def draws(self) -> tuple[Draw, ...]:
        """The folds of each draw."""
        changed = {name: self.unordered.get(name, columns) for name, columns in self.columns.items()}
        together, unordered = self.together(self.columns), self.together(changed)
        return tuple(Draw(ground, self.fit, together, unordered) for ground in self.grounds)

    @property
    def _extensions(self) -> Extensions:
        return self.draws[0].extensions

    def together(self, columns: dict[str, Array]) -> Array:
        """Return the columns of some effects beside each other, ``(rows, k)``."""
        return np.concatenate([np.zeros((len(self.fit.fold), 0)), *columns.values()], axis=1)

    @cached_property
    def _places(self) -> dict[str, NDArray[np.intp]]:
        found, first = {}, 0
        for name, columns in self.columns.items():
            found[name] = np.arange(first, first + columns.shape[1])
            first += columns.shape[1]
        return found

    def places(self, chosen: Sequence[str] | frozenset[str]) -> NDArray[np.intp]:
        """Return the places of the columns of some effects."""
        mine = [self._places[name] for name in self.columns if name in chosen]
        return np.concatenate([np.zeros(0, np.intp), *mine])

    def errors(self, chosen: Sequence[str] | frozenset[str]) -> Array:
        """Return the mean held-out error of each configuration with some effects over the draws [m], ``(n,)``."""
        key = frozenset(chosen)
        if key not in self._errors:
            self._errors[key] = mean_over([draw.errors(self.places(key)) for draw in self.draws])
        return self._errors[key]

    def errors_without_order(self, chosen: Sequence[str] | frozenset[str]) -> Array:
        """Return the same where the order of the held-out configurations is not known."""
        return mean_over([draw.errors_without_order(self.places(chosen)) for draw in self.draws])

    def gain(self, before: Sequence[str] | frozenset[str], after: Sequence[str] | frozenset[str]) -> Gain:
        """Return what one choice gains over another."""
        return gain(self.errors(before), self.errors(after), self.grounds[0].folds)

    def excited(self, name: str) -> bool:
        """Return whether the readings know any parameter of an effect better than its prior does."""
        return self._extensions.excited(self._places[name])

    def left(self, chosen: Sequence[str] | frozenset[str]) -> Array:
        """Return the residual of every row with some effects, ``(rows,)``."""
        return self._extensions.solved(self.places(chosen))

    def left_without(self, draw: int, number: int, chosen: Sequence[str] | frozenset[str]) -> Array:
        """Return the residual of every row as the fit without a fold of a draw leaves it, ``(rows,)``."""
        return self.draws[draw].extensions.without_fold(number, self.places(chosen))

    def spent(self, chosen: Sequence[str] | frozenset[str]) -> float:
        """Return how many equations' worth of residual the fit uses up with some effects, at most."""
        return self.fit.spent + len(self.places(chosen))

    def best(self, among: Sequence[str]) -> frozenset[str]:
        """Return the choice with the fewest parameters that is not worse than the best one by a standard error.

        That is the rule of one standard error (Breiman and others 1984, "Classification and Regression Trees", section
        3.4.3), over paired differences.
        """
        looked_at = self._every(among) if 2 ** len(among) <= _ALL else self._one_by_one(among)
        looked_at = [chosen for chosen in looked_at if complete(chosen)]
        lowest = min(looked_at, key=self._mean)
        limit = self._mean(lowest)
        fewest = sorted(looked_at, key=lambda chosen: (len(self.places(chosen)), self._mean(chosen)))
        return next((one for one in fewest if self._mean(one) <= limit or not self.gain(one, lowest).believed), lowest)

    def _mean(self, chosen: frozenset[str]) -> float:
        if chosen not in self._means:
            errors = self.errors(chosen)
            self._means[chosen] = float(np.nanmean(errors)) if np.isfinite(errors).any() else np.inf
        return self._means[chosen]

    @staticmethod
    def _every(among: Sequence[str]) -> list[frozenset[str]]:
        return [frozenset(some) for size in range(len(among) + 1) for some in combinations(among, size)]

    def _one_by_one(self, among: Sequence[str]) -> list[frozenset[str]]:
        """Add what helps most, or two that help together where none does alone; then try without each."""
        now: frozenset[str] = frozenset()
        seen = [now]
        while True:
            rest = [name for name in among if name not in now]
            for size in (1, 2):
                larger = [with_bases(now.union(some)) for some in combinations(rest, size)]
                seen += larger
                better = [one for one in larger if self.gain(now, one).believed]
                if better:
                    break
            if not rest or not better:
                break
            now = min(better, key=self._mean)
            smaller = [without(now, name) for name in now]
            seen += smaller
            idle = [one for one in smaller if not self.gain(one, now).believed]
            now = min(idle, key=self._mean) if idle and min(idle, key=self._mean) not in seen[: -len(smaller)] else now
        return list(dict.fromkeys(seen))


@dataclass(frozen=True, eq=False)
class Choices:
    """All choices among joint effects: those with joint curves, which contain much, and those without."""

    plain: Search  #: The search without curves.
    #: The search among what curves do not contain, added to a fit with curves; None where there are none.
    curved: Search | None = None

    def _of(self, chosen: frozenset[str]) -> tuple[Search, frozenset[str]]:
        if CURVE not in chosen:
            return self.plain, chosen
        if self.curved is None:
            raise ValueError("there are no curves to choose")
        return self.curved, chosen & frozenset(self.curved.columns)

    @property
    def names(self) -> tuple[str, ...]:
        """The effects that could be chosen."""
        return (*self.plain.columns, *(() if self.curved is None else (CURVE,)))

    def errors(self, chosen: frozenset[str]) -> Array:
        """Return the mean held-out error of each configuration with some effects [m], ``(n,)``."""
        search, effects = self._of(chosen)
        return search.errors(effects)

    def errors_without_order(self, chosen: frozenset[str]) -> Array:
        """Return the same where the order of the held-out configurations is not known."""
        search, effects = self._of(chosen)
        return search.errors_without_order(effects)

    def gain(self, before: frozenset[str], after: frozenset[str]) -> Gain:
        """Return what one choice gains over another."""
        return gain(self.errors(before), self.errors(after), self.plain.grounds[0].folds)

    def left(self, chosen: frozenset[str]) -> Array:
        """Return the residual of every row with some effects, ``(rows,)``."""
        search, effects = self._of(chosen)
        return search.left(effects)

    def spent(self, chosen: frozenset[str]) -> float:
        """Return how many equations' worth of residual a fit with some effects uses up."""
        search, effects = self._of(chosen)
        return search.spent(effects)

    def left_without(self, draw: int, number: int, chosen: frozenset[str]) -> Array:
        """Return the residual of every row as the fit without a fold of a draw leaves it, ``(rows,)``."""
        search, effects = self._of(chosen)
        return search.left_without(draw, number, effects)

    def best(self, without: Collection[str]) -> frozenset[str]:
        """Return the best choice without some effects; with curves if these gain clearly."""
        found = self.plain.best([name for name in self.plain.columns if name not in without])
        if self.curved is None or CURVE in without:
            return found
        curved = self.curved.best([name for name in self.curved.columns if name not in without]) | {CURVE}
        gained = self.gain(found, curved)
        least = max(CLEAR * gained.error, _WORTH_IT * float(np.nanmean(self.errors(found))))
        return curved if gained.mean > least else found
