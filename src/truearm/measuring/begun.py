"""What was fixed when the measuring of a plan began, and where its readings come from."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from truearm.engine.base.errors import InputError, refusals_of
from truearm.engine.base.files import path_argument, read_text
from truearm.engine.base.writing import write_text
from truearm.engine.command.arguments import payload_argument
from truearm.engine.command.driving import constraints_argument
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.measuring.reading_log import LOG, About
from truearm.measuring.session import Quality, Session

if TYPE_CHECKING:
    from truearm.measuring.measure import Measure
    from truearm.measuring.virtual_instrument import VirtualInstrument
    from truearm.measuring.watched_folder import WatchedFolder


#: What was fixed when the measuring began.
BEGUN: Final = "measuring.json"
_SCHEMA: Final = "truearm-measuring/1"


def begin(
    folder: Path, plan: list[Any], robot: Robot, session: Session, virtual: dict[str, Any] | None, about: About
) -> None:
    """Write down what is fixed from now on, or refuse what is not as it was when the measuring began.

    Args:
        plan: What it holds, as JSON writes it.
        virtual: The virtual instrument and its twin; None for a real instrument.

    Raises:
        InputError: If the folder holds the measuring of another plan or robot, or one that began otherwise.
    """
    current: dict[str, Any] = {
        "truearm": _SCHEMA,
        "plan": hash_of(plan),
        "robot": f"{robot.name} {hash_of([[p.name, p.value] for p in robot.parameters.values()])}",
        "targets": [*session.targets],
        "nests": [*session.nests],
        "every": session.every,
        "quality": session.quality.__dict__,
        "source": virtual or "instrument",
        "about": about.fixed,
    }
    path = folder / BEGUN
    if not path.exists():
        if (folder / LOG).exists():
            raise InputError(
                "there are readings in this folder, and nothing says of which plan",
                parameter="out",
                where=str(folder / LOG),
                cure="Choose another folder.",
            )
        write_text(path, json.dumps(current, indent=2) + "\n")
        return
    with refusals_of("out"):
        then = _then(path)
    for name, value in current.items():
        was: Any = then.get(name)
        if name == "about":
            changed = [k for k, v in value.items() if v is not None and was.get(k) not in (None, v)]
            if not changed:
                continue
            value, was = value[changed[0]], f"{was[changed[0]]} ({changed[0]})"
        elif was == json.loads(json.dumps(value)):
            continue
        came, allowed = json.dumps(value), f"{was if name == 'about' else json.dumps(was)}"
        if name == "plan":  # a hash
            came, allowed = "the plan as it is now", "the plan as it was then"
        elif name == "robot":  # a name and a hash
            came, allowed = (str(text).rpartition(" ")[0] for text in (value, was))
            if came == allowed:
                came, allowed = f"{came} with other values", f"{allowed} as it was then"
        raise InputError(
            f"the measuring in this folder began with another {_CALLED.get(name, name)}",
            parameter="out",
            where=str(path),
            came=came,
            allowed=allowed,
            cure="Go on as it began, or measure into another folder.",
        )


_CALLED: Final = {"quality": "limit of what is kept", "source": "source of readings", "about": "instrument or robot"}


def _then(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(read_text(path))
    except ValueError:
        content = None
    if isinstance(content, dict) and content.get("truearm") == _SCHEMA and isinstance(content.get("about"), dict):
        return content
    raise InputError("this does not say how a measuring began", where=str(path), cure="Choose another folder.")


def hash_of(content: object) -> str:
    """Return by what contents that JSON can write are known again."""
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()


# -- a virtual instrument --------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class VirtualSource:
    """A virtual instrument, and what must be the same when the measuring goes on."""

    source: VirtualInstrument  #: The instrument.
    placed: Robot  #: The nominal robot where it sees it.
    entries: dict[str, Any]  #: What the readings depend on.


def virtual_source(
    asked: Measure, nominal: Robot, joints: Array, before: Array | None, nests: tuple[str, ...]
) -> VirtualSource:
    """Return a virtual instrument that measures a twin.

    Args:
        joints: Of the plan, as the model counts them [rad or m], ``(n, joints)``.
        before: Where the arm stops right before each of them, as `joints`; None if it comes from the one before.
        nests: Their names.

    Raises:
        InputError: If there is no such device, or it cannot measure a plan, or a number cannot be meant.
    """
    from truearm.engine.twin.devices.device import seen_by
    from truearm.engine.twin.truths import truth_twin
    from truearm.measuring.virtual_instrument import VirtualInstrument, virtual_device

    truth = "random" if asked.truth is None else asked.truth
    seed, disturbed, drift = asked.seed or 0, asked.disturbed or 0.0, asked.drift or 0.0
    device = virtual_device(str(asked.device))
    rules = constraints_argument(asked.constraints)
    with refusals_of("truth"):
        arm = truth if isinstance(truth, Robot) else str(truth)
        twin = truth_twin(nominal, arm, np.random.default_rng(seed))
    twin = replace(twin, robot=twin.robot.with_payload(payload_argument(asked.payload)))
    twin, placed = seen_by(device, nominal, twin)
    source = VirtualInstrument(device, twin, placed, joints, nests, seed, disturbed, drift, asked.noise, before)
    boxes: dict[str, Any] = {}
    if rules is not None:
        from truearm.engine.motion.constraints import keep_out

        with refusals_of("constraints"):
            boxes = keep_out(rules, str(asked.constraints))
    if nests and source.looks:
        from truearm.engine.motion.cell import boxes_of
        from truearm.measuring.lines_of_sight import hidden

        source.hides = hidden(placed, joints, np.zeros(3), source.nests, boxes_of(boxes))
    entries = {
        "device": asked.device,
        "truth": truth.name if isinstance(truth, Robot) else Path(truth).name,
        "noise": asked.noise,
        "seed": seed,
        "disturbed": disturbed,
        "drift": drift,
        "twin": hash_of([[p.name, p.value] for p in twin.robot.parameters.values()] + [repr(twin.robot.payload)]),
        "boxes": {name: [[repr(v) for v in corner.tolist()] for corner in box] for name, box in boxes.items()},
    }
    return VirtualSource(source, placed, entries)


def quality_of_device(asked: Measure, source: VirtualInstrument) -> Quality:
    """Return what is asked of the readings of a virtual device: what is expected of it where nothing else is said."""
    from truearm.measuring.virtual_instrument import SAMPLES

    expected = Quality.of_instrument(source.sigma, SAMPLES) if source.sigma else Quality(samples=SAMPLES // 2)
    return Quality(
        expected.deviation if asked.most_deviation is None else asked.most_deviation,
        expected.settling if asked.most_settling is None else asked.most_settling,
        expected.samples if asked.fewest_samples is None else asked.fewest_samples,
    )


# -- a real one ------------------------------------------------------------------------------------------------


def watched_source(asked: Measure, labels: tuple[str, ...], out: Path) -> WatchedFolder:
    """Return the folder that is watched, its rows read as a mapping says."""
    from truearm.measuring.watched_folder import WatchedFolder

    folder = path_argument(asked.watch, "watch")
    if asked.mapping is None:
        raise InputError(
            "nobody says what the columns of the rows mean",
            parameter="mapping",
            allowed="a mapping file, as `truearm import table` takes it",
            cure="Let `truearm import guess` write one for a file of the instrument.",
        )
    if folder.exists() and out.exists() and folder.resolve() == out.resolve():
        raise InputError(
            "the folder that is watched is written to", parameter="out", came=str(out), cure="Choose another."
        )
    with refusals_of("mapping"):
        return WatchedFolder(folder, Path(asked.mapping), labels)
