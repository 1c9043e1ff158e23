"""Where the measuring of a plan stands: what was read, what of it is kept, and what comes next."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, did_you_mean
from truearm.engine.robot.chain import Array

#: Why a reading is not kept. Every reason is the instrument's or the operator's; none asks how well a reading fits.
REASONS: Final[dict[str, str]] = {
    "beam-break": "the beam was interrupted",
    "few-samples": "too few samples were taken",
    "scatter": "it scattered too much while the arm stood",
    "not-settled": "it still moved while it was measured",
    "no-reading": "nothing was measured",
    "unknown-name": "there is no target or nest of this name",
    "unknown-configuration": "the plan has no configuration of this name",
    "measured-already": "there is a reading of it",
    "copy": "it repeats a reading taken elsewhere to the last digit",
    "operator": "the operator set it aside",
    "left-out": "it cannot be measured here",
}
#: How far two halves of a dwell may be apart by scatter alone, in deviations of a sample over the root of samples.
_HALVES: Final = 2.0
#: So many samples of a dwell can be asked for.
MOST_SAMPLES: Final = 1_000_000


@dataclass(frozen=True, eq=False)
class Reading:
    """What an instrument read of one point."""

    name: str  #: Of the target or nest.
    time: float  #: When [s], counted from any moment that is the same for all readings.
    position: Array  #: In the instrument's frame [m], ``(3,)``; NaN if nothing was measured.
    quaternion: Array | None = None  #: (w, x, y, z), ``(4,)``; None for a point.
    label: str | None = None  #: Of the configuration, as the source names it; None if it does not.
    #: sigma, sigma_rot: standard deviations that the instrument states [m], [rad]; None if it states none.
    sigma: float | None = None
    sigma_rot: float | None = None
    samples: int | None = None  #: How many were taken while the arm stood; None if it is not told.
    #: Standard deviation of a coordinate of one sample about their mean [m]: the root of the mean square over the
    #: coordinates; None if it is not told.
    deviation: float | None = None
    #: How far the mean of the second half of the samples is from that of the first [m]; None if it is not told.
    settling: float | None = None
    breaks: int = 0  #: How often the beam was interrupted.
    origin: str = ""  #: Where it comes from, such as a file and a line.
    mark: str = ""  #: By which the same row is known again; empty if it has none.

    @property
    def is_empty(self) -> bool:
        """Whether nothing was measured."""
        return not bool(np.isfinite(self.position).all())


def dwell_figures(samples: Array) -> tuple[Array, float, float]:
    """Return mean, deviation and settling of the samples of a dwell.

    Args:
        samples: Positions in the order in which they were taken [m], ``(n, 3)``, two or more.

    Returns:
        The mean ``(3,)``; the deviation of a coordinate of one sample; how far the means of the two halves are apart.
    """
    mean, half = samples.mean(axis=0), len(samples) // 2
    deviation = float(np.sqrt(samples.var(axis=0, ddof=1).mean()))
    apart = samples[len(samples) - half :].mean(axis=0) - samples[:half].mean(axis=0)
    return mean, deviation, float(np.linalg.norm(apart))


@dataclass(frozen=True)
class Quality:
    """What a reading must be by itself to be kept; None asks for nothing."""

    deviation: float | None = None  #: Largest deviation of a sample [m].
    settling: float | None = None  #: How far the means of the two halves of a dwell may be apart [m].
    samples: int = 1  #: Fewest samples.

    @classmethod
    def of_instrument(cls, sigma: float, samples: int) -> Quality:
        """Return what a reading of an instrument of a known deviation [m] is expected to be, by the number of samples.

        Three times the deviation of a sample. Of the two halves the difference has, coordinate by coordinate, the
        variance ``4 sigma^2 / samples``; five times the root of its sum is allowed.
        """
        return cls(3.0 * sigma, 5.0 * _HALVES * np.sqrt(3.0 / samples).item() * sigma, samples // 2)

    def fault(self, reading: Reading) -> tuple[str, str]:
        """Return for which reason a reading is not kept, with the figures in words; two empty texts if it is."""
        if reading.is_empty:
            return "no-reading", ""
        if reading.breaks:
            return "beam-break", f"{reading.breaks} times" if reading.breaks > 1 else ""
        if reading.samples is not None and reading.samples < self.samples:
            return "few-samples", f"{reading.samples}, {self.samples} or more are needed"
        for reason, value, most in (
            ("scatter", reading.deviation, self.deviation),
            ("not-settled", reading.settling, self.settling),
        ):
            if value is not None and most is not None and value > most:
                return reason, f"{value * 1e3:.4f} mm, up to {most * 1e3:.4f} mm is allowed"
        return "", ""

    def unasked(self, reading: Reading) -> bool:
        """Return whether nothing of how a reading was taken could be judged."""
        asked = (
            (reading.samples, self.samples if self.samples > 1 else None),
            (reading.deviation, self.deviation),
            (reading.settling, self.settling),
        )
        return not any(value is not None and most is not None for value, most in asked)


Event = Literal["reading", "aside", "left"]
Kind = Literal["nests", "configuration"]
#: Kind, number of the round or index of the configuration, and name of a point that is measured there.
Place = tuple[Kind, int, str]
_AT: Final[Kind] = "configuration"
#: Configurations between two rounds of the nests, at most.
LONGEST_ROUND: Final = 10_000
#: What may be written of a reading by hand.
_LONGEST_WORDS: Final = 200


@dataclass(frozen=True, eq=False)
class Entry:
    """One line of the log."""

    number: int  #: Counted from 1.
    #: ``reading``; ``aside``, the operator takes back a reading that was kept; ``left``, a point that cannot be
    #: measured.
    event: Event
    label: str  #: Of the configuration; empty if it is not known.
    name: str  #: Of the target or nest.
    is_nest: bool = False  #: Whether it is a nest.
    reading: Reading | None = None  #: What was read; None for other events.
    reason: str = ""  #: Why it is not kept, of ``REASONS``; empty for what is kept.
    words: str = ""  #: More about that.
    of: int | None = None  #: Number of the reading that is taken back.

    @property
    def kept(self) -> bool:
        """Whether it is a reading that was kept when it came."""
        return self.event == "reading" and not self.reason

    def line(self) -> str:
        """Return it as one line of text."""
        head = f"{self.number:4d}  {self.label or '?'} {self.name}"
        if self.event == "aside":
            return f"{head}: reading {self.of} set aside by the operator" + (f" ({self.words})" if self.words else "")
        figures = ""
        reading = self.reading
        if reading is not None and not reading.is_empty:
            x, y, z = (reading.position * 1e3).tolist()
            figures = f"  {x:.4f} {y:.4f} {z:.4f} mm"
            if reading.deviation is not None:
                figures += f"  deviation {reading.deviation * 1e3:.4f} mm"
        if not self.reason:
            return f"{head}{figures}"
        reason = f"{REASONS[self.reason]}{f': {self.words}' if self.words else ''}"
        return f"{head}{figures}  {'left out' if self.event == 'left' else 'set aside'}: {reason}"


@dataclass(frozen=True)
class Step:
    """What is measured together: a round of the nests, or the targets at a configuration."""

    kind: Kind  #: ``nests`` or ``configuration``.
    configuration: int  #: Index of the configuration at which the robot stands.
    label: str  #: Its name.
    names: tuple[str, ...]  #: What is still to be measured, in order.
    number: int  #: number, of: which of the steps it is, from 1.
    of: int


@dataclass(frozen=True, eq=False)
class Drawn:
    """All readings as arrays, in the order in which they came."""

    names: tuple[str, ...]  #: names, labels: of the points and the configurations, ``(k,)`` each.
    labels: tuple[str, ...]
    is_nest: NDArray[np.bool_]  #: is_nest, kept: whether it is a nest, and whether it is kept now, ``(k,)``.
    kept: NDArray[np.bool_]
    reasons: tuple[str, ...]  #: Why not, empty for what is kept, ``(k,)``.
    time: Array  #: [s], ``(k,)``.
    position: Array  #: In the instrument's frame [m], ``(k, 3)``, NaN where nothing was measured.
    deviation: Array  #: deviation, settling, samples: [m], [m] and a count, ``(k,)``, NaN where it is not told.
    settling: Array
    samples: Array


class Session:
    """The measuring of a plan.

    A reading belongs to the configuration that it names, else to the first one at which its target is still to be
    measured. It is kept or set aside as it comes, for a reason of the instrument alone; what was kept is not replaced
    before the operator sets it aside. The nests are measured at the start, after every so many configurations, and at
    the end.

    Args:
        labels: Of the configurations, in the order of the plan.
        targets: What is measured at each.
        nests: Fixed points beside the robot.
        every: How many configurations lie between two rounds of the nests.
        quality: What a reading must be to be kept.
        reads: Which of the targets are asked for at each configuration, by its label; all of them where nothing is
            said. One that is not asked for may be read all the same.
    """

    def __init__(
        self,
        labels: Sequence[str],
        targets: Sequence[str],
        nests: Sequence[str],
        every: int,
        quality: Quality,
        reads: Mapping[str, Collection[str]] | None = None,
    ) -> None:
        self.labels, self.targets, self.nests = tuple(labels), tuple(targets), tuple(nests)
        some = reads or {}
        self._asked = [tuple(n for n in self.targets if n in some.get(label, self.targets)) for label in self.labels]
        self.every, self.quality = every, quality
        self._index = {label: number for number, label in enumerate(self.labels)}
        self._entries: list[Entry] = []
        self._held: dict[Place, int] = {}  # numbers of the readings that are kept
        self._left: set[Place] = set()
        self._aside: dict[int, Entry] = {}
        self._places: list[Place | None] = []  # of each entry
        self._positions: dict[tuple[str, bytes], Entry] = {}
        self._visited: dict[int, None] = {}  # configurations in the order in which the robot came to them first
        self._at: int | None = None  # where it stands
        self._whole: set[tuple[Kind, int]] = set()  # rounds and configurations of which nothing is left
        self._from = 0  # no configuration before this one has anything left

    # -- what there is -------------------------------------------------------------------------------------

    @property
    def entries(self) -> tuple[Entry, ...]:
        """Everything in the log."""
        return tuple(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    @property
    def kept(self) -> tuple[Entry, ...]:
        """The readings that are kept now."""
        return tuple(self._entries[number - 1] for number in sorted(self._held.values()))

    @property
    def aside_by_reason(self) -> dict[str, int]:
        """How many readings are not kept, by the reason."""
        counter = Counter(self.reason_of(entry) for entry in self._entries if entry.event == "reading")
        return {reason: counter[reason] for reason in REASONS if counter[reason]}

    @property
    def left_out(self) -> tuple[tuple[str, str], ...]:
        """Configuration and name of the targets that were asked for and left out."""
        gone = sorted(place for place in self._left - {*self._held} if place[0] == "configuration")
        return tuple((self.labels[k], name) for _, k, name in gone if name in self._asked[k])

    @property
    def without_reading(self) -> tuple[str, ...]:
        """Configurations at which every target was left out."""
        read = {self.labels[k] for kind, k, _ in self._held if kind == "configuration"}
        left = {label for label, _ in self.left_out} - read
        return tuple(label for k, label in enumerate(self.labels) if label in left and not self._open(_AT, k))

    def reason_of(self, entry: Entry) -> str:
        """Return why a reading is not kept now, empty if it is."""
        return self._aside[entry.number].reason if entry.number in self._aside else entry.reason

    @property
    def next(self) -> Step | None:
        """What is to be measured now; None if nothing is left."""
        targets = self._open("configuration", self._at) if self._at is not None else ()
        if targets and self._at is not None:
            return self._step("configuration", self._at, targets)
        if nests := self._open("nests", self._round):
            return self._step("nests", self._standing, nests)
        k = self._first_open()
        return None if k is None else self._step("configuration", k, self._open("configuration", k))

    @property
    def done(self) -> bool:
        """Whether nothing is left to be measured."""
        return self.next is None

    @property
    def outstanding(self) -> int:
        """How many readings are still to be taken."""
        configurations = sum(len(self._open("configuration", k)) for k in range(len(self.labels)))
        return configurations + sum(len(self._open("nests", r)) for r in range(self._round, self.rounds))

    @property
    def rounds(self) -> int:
        """How many rounds of the nests there shall be."""
        return 1 + -(-len(self.labels) // self.every) if self.nests else 0

    @property
    def missed_rounds(self) -> int:
        """How many rounds of the nests are over, and were not measured as a whole."""
        over = [r for r in range(self.rounds) if r < self._round or ("nests", r) in self._whole]
        return sum(any(("nests", r, name) not in self._held for name in self.nests) for r in over)

    @property
    def nests_left_out(self) -> tuple[Entry, ...]:
        """Words that a nest cannot be measured in a round, where it was not measured later."""
        places = zip(self._entries, self._places, strict=True)
        return tuple(e for e, at in places if e.event == "left" and e.is_nest and at not in self._held)

    @property
    def asked(self) -> tuple[tuple[str, ...], ...]:
        """Names of the targets that are asked for at each configuration."""
        return tuple(self._asked)

    @property
    def planned(self) -> int:
        """How many readings of targets are asked for."""
        return sum(map(len, self._asked))

    def round_of(self, entry: Entry) -> int:
        """Return in which round a nest was read, counted from 0."""
        place = self._places[entry.number - 1]
        return -1 if place is None else place[1]

    def drawn(self) -> Drawn:
        """Return all readings as arrays."""
        entries = [entry for entry in self._entries if entry.reading is not None]
        readings = [entry.reading for entry in entries if entry.reading is not None]
        accepted = {*self._held.values()}

        def figures(name: str) -> Array:
            values = [getattr(reading, name) for reading in readings]
            return np.array([np.nan if value is None else value for value in values], float)

        return Drawn(
            names=tuple(entry.name for entry in entries),
            labels=tuple(entry.label for entry in entries),
            is_nest=np.array([entry.is_nest for entry in entries], bool),
            kept=np.array([entry.number in accepted for entry in entries], bool),
            reasons=tuple(self.reason_of(entry) for entry in entries),
            time=figures("time"),
            position=np.array([reading.position for reading in readings]).reshape(-1, 3),
            deviation=figures("deviation"),
            settling=figures("settling"),
            samples=figures("samples"),
        )

    # -- what comes ----------------------------------------------------------------------------------------

    def judged(self, reading: Reading) -> Entry:
        """Return what becomes of a reading; it is not part of the session before it is :meth:`add`-ed."""
        place = self._place(reading.name, reading.label)
        label = reading.label or "" if place is None else self._label(place)
        reason, words = self._refusal(reading, place)
        return Entry(len(self) + 1, "reading", label, reading.name, reading.name in self.nests, reading, reason, words)

    def set_aside(self, number: int, words: str = "") -> Entry:
        """Return the operator's word that a kept reading is none.

        Raises:
            InputError: If there is no such reading, or it is not kept.
        """
        if number not in self._held.values():
            raise InputError(
                "there is no kept reading of this number",
                parameter="number",
                came=number,
                allowed="the number of a reading that is kept",
            )
        of = self._entries[number - 1]
        words = _one_line(words)
        return Entry(len(self) + 1, "aside", of.label, of.name, of.is_nest, None, "operator", words, number)

    def leave_out(self, label: str, name: str, words: str = "") -> Entry:
        """Return the word that a point cannot be measured at a configuration.

        Raises:
            InputError: If the plan has no such configuration or point, or it was measured.
        """
        known = (*self.targets, *self.nests)
        for came, allowed, parameter in ((label, self.labels, "label"), (name, known, "name")):
            if came not in allowed:
                raise InputError(
                    "the plan has no such configuration" if parameter == "label" else "there is no such point",
                    parameter=parameter,
                    came=came,
                    allowed=", ".join(allowed[:20]),
                    cure=did_you_mean(str(came), allowed),
                )
        if self._place(name, label) in self._held:
            raise InputError("this was measured", parameter="name", came=name, cure="Set the reading aside instead.")
        return Entry(len(self) + 1, "left", label, name, name in self.nests, None, "left-out", _one_line(words))

    def add(self, *entries: Entry) -> None:
        """Take what is in the log into account, in its order.

        Raises:
            InputError: If an entry does not follow from those before: the log was changed.
        """
        for entry in entries:
            in_turn = entry.number == len(self) + 1
            place = self._place_in_log(entry) if in_turn else None
            if not in_turn or not self._follows(entry, place):
                raise InputError("this does not follow from what stands before it", where=f"number {entry.number}")
            self._entries.append(entry)
            self._places.append(place)
            if place is None:
                continue
            if entry.event == "aside":
                self._aside[int(entry.of or 0)] = entry
                del self._held[place]
            elif entry.event == "left" or entry.reason == "no-reading":
                self._left.add(place)
            elif entry.kept and entry.reading is not None:
                self._held[place] = entry.number
                self._positions.setdefault((entry.name, entry.reading.position.tobytes()), entry)
            if self._open(*place[:2]):
                self._whole.discard(place[:2])
                self._from = min(self._from, place[1]) if place[0] == "configuration" else self._from
            else:
                self._whole.add(place[:2])
            if place[0] == "configuration" and entry.event != "aside":
                self._at = place[1]
                self._visited.setdefault(self._at)

    def _place_in_log(self, entry: Entry) -> Place | None:
        if entry.event == "aside":
            return self._places[entry.of - 1] if entry.of is not None and 0 < entry.of < entry.number else None
        return self._place(entry.name, entry.label) if entry.label else None

    def _follows(self, entry: Entry, place: Place | None) -> bool:
        if entry.event == "aside":
            return place is not None and place[2] == entry.name and self._held.get(place) == entry.of
        if entry.event == "left" or entry.kept:
            return place is not None and place not in self._held
        return True

    def _refusal(self, reading: Reading, place: Place | None) -> tuple[str, str]:
        """Return why a reading is set aside, with more words; nothing if it is kept."""
        if reading.name not in (*self.targets, *self.nests):
            return "unknown-name", f"allowed: {', '.join((*self.targets, *self.nests))}"
        if reading.name in self.targets and reading.label is not None and reading.label not in self._index:
            return "unknown-configuration", f"{reading.label}; the plan begins with {self.labels[0]}"
        fault = self.quality.fault(reading)
        if fault[0]:
            return fault
        if place is None:
            return "measured-already", "at every configuration"
        if place in self._held:
            return "measured-already", f"reading {self._held[place]}"
        like = self._positions.get((reading.name, reading.position.tobytes()))
        if place[0] == "configuration" and like is not None and like.number not in self._aside:
            return "copy", f"reading {like.number}, of {like.label}"
        return "", ""

    def _place(self, name: str, label: str | None) -> Place | None:
        """Return where a point was measured; None if that cannot be told."""
        if name in self.nests:
            return "nests", self._round, name
        if name not in self.targets or (label is not None and label not in self._index):
            return None
        k = self._first_open() if label is None else self._index[label]
        return None if k is None else ("configuration", k, name)

    def _label(self, place: Place) -> str:
        return self.labels[self._standing if place[0] == "nests" else place[1]]

    @property
    def _standing(self) -> int:
        """Where the robot is, or goes first."""
        return self._at if self._at is not None else 0

    @property
    def _round(self) -> int:
        """Which round of the nests a nest that is read now belongs to."""
        if self._first_open() is None:
            return self.rounds - 1
        return len(self._visited) // self.every

    def _first_open(self) -> int | None:
        """Return the configuration at which a target is measured that names none; None if all are."""
        if self._at is not None and self._open("configuration", self._at):
            return self._at
        while self._from < len(self.labels) and ("configuration", self._from) in self._whole:
            self._from += 1
        return self._from if self._from < len(self.labels) else None

    def _open(self, kind: Kind, k: int) -> tuple[str, ...]:
        names = self.nests if kind == "nests" else self._asked[k]
        return tuple(n for n in names if (kind, k, n) not in self._held and (kind, k, n) not in self._left)

    def _step(self, kind: Kind, k: int, names: tuple[str, ...]) -> Step:
        return Step(kind, k, self.labels[k], names, len(self._whole) + 1, len(self.labels) + self.rounds)


def _one_line(words: str) -> str:
    if not isinstance(words, str) or len(words) > _LONGEST_WORDS or not (words == "" or words.isprintable()):
        raise InputError(
            "a few words of one line belong here",
            parameter="words",
            came=words if isinstance(words, str) else type(words).__name__,
            allowed=f"up to {_LONGEST_WORDS} characters",
        )
    return words
