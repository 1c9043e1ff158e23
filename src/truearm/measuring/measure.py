"""Measuring a plan with an instrument, reading by reading."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Final

from truearm.engine.base.arrays import finite_number
from truearm.engine.base.errors import wrong_kind
from truearm.engine.command.arguments import progress_argument
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.measuring.open_campaign import Asked, OpenCampaign, Sight, open_campaign, sight
from truearm.measuring.result import Measured

__all__ = ["OpenCampaign", "Sight", "measure", "open_campaign", "sight"]

#: How long a source is waited for before somebody is asked whether to stop [s].
_TURN: Final = 0.5


def measure(
    plan: str | Path,
    robot: Robot | str | Path,
    *,
    out: str | Path,
    device: str | None = None,
    truth: Robot | str | Path | None = None,
    noise: float | None = None,
    seed: int | None = None,
    disturbed: float | None = None,
    drift: float | None = None,
    payload: Payload | str | None = None,
    constraints: str | Path | None = None,
    watch: str | Path | None = None,
    mapping: str | Path | None = None,
    listen: int | None = None,
    token: str | None = None,
    targets: Sequence[str] | None = None,
    nests: Sequence[str] | None = None,
    every: int = 10,
    most_deviation: float | None = None,
    most_settling: float | None = None,
    fewest_samples: int | None = None,
    about: str | Path | None = None,
    wait: float | None = None,
    command: str | None = None,
    tell: Callable[[str], None] = lambda _: None,
    progress: Callable[[str], None] = lambda _: None,
) -> Measured:
    """Go through a plan with an instrument and write what it read as a canonical CSV.

    Every reading is on disk before the next one is asked for, in the log ``readings.csv``. It is kept or set aside for
    reasons of the instrument alone: nothing here knows how well it fits. The same call in the same folder goes on where
    it was stopped, by Ctrl-C or otherwise.

    Parameters
    ----------
    plan
        The configurations in the order of measuring, as :func:`truearm.plan` writes them: ``configuration`` and
        ``joint_1 [deg]`` .. or ``axis_1 [deg]`` ..
    robot
        The nominal robot, or what :func:`truearm.load_robot` takes.
    out
        Folder for the log, the measurements and the report.
    device
        Readings of a virtual instrument: one of ``truearm.devices()`` that reads where targets are. A plan of which it
        can read nothing is refused.
    truth, noise, seed, payload
        The twin that it measures, its standard deviation of a coordinate [m], what is drawn, and what the robot
        carries, as for :func:`truearm.simulate`; a random truth, the device's deviation and seed 0 if None.
    disturbed
        Share of its readings with a broken beam, an arm that still moves, or too much scatter, up to 0.9.
    drift
        How far it moves until the last configuration [m].
    constraints
        Constraints file whose boxes hide nests from it, as the arm does.
    watch
        Or readings that an instrument's software writes into this folder, in files or rows at the end of files.
    mapping
        What their columns mean, as for :func:`truearm.import_table`; the joint positions are the plan's, so that
        the entry ``joints`` may be left out.
    listen
        Or readings that programs of this machine send to this port of 127.0.0.1; 0 for any that is free.
    token
        Which they must send first; a new one if None. It is told once.
    targets
        What is measured at each configuration; those of the device or robot if None, else those that the mapping fixes.
        A plan that says in its column ``reads`` which of them the instrument sees is followed.
    nests
        Fixed points beside the robot that are measured at the start, along the way and at the end; the mapping's
        ``references``, or none, if None.
    every
        How many configurations lie between two rounds of the nests.
    most_deviation, most_settling, fewest_samples
        What a reading must be to be kept: scatter of a sample, and way between the halves of a dwell, at most [m]; how
        many samples there must be. None asks for nothing; of a virtual device what is expected of it.
    about
        File that says what was measured with, and in what air (schema ``truearm-about/1``).
    wait
        End after so many seconds without a reading; None waits until all is measured, or Ctrl-C.
    command
        How to run it again, for the report; None writes the call in Python.
    tell
        Called with a line for each reading, and for what could not be read.
    progress
        Called with a few words at each step.

    Returns
    -------
    Measured
        What is there, whether the plan was finished or not.

    Raises
    ------
    InputError
        If anything cannot be used, the folder holds the measuring of another plan, or the log cannot be written.
    """
    progress_argument(progress)
    if not callable(tell):
        raise wrong_kind("a function belongs here", tell, "tell", "a function that takes a text")
    patience = None if wait is None else finite_number(wait, "wait", lowest=0.0, allowed="seconds, 0 or more")
    given: Asked = {
        "device": device,
        "truth": truth,
        "noise": noise,
        "seed": seed,
        "disturbed": disturbed,
        "drift": drift,
        "payload": payload,
        "constraints": constraints,
        "watch": watch,
        "mapping": mapping,
        "listen": listen,
        "token": token,
        "targets": targets,
        "nests": nests,
        "every": every,
        "most_deviation": most_deviation,
        "most_settling": most_settling,
        "fewest_samples": fewest_samples,
        "about": about,
    }
    with open_campaign(plan, robot, out, **given, command=command) as campaign:
        _begun(campaign, tell, told_token=token is None)
        with _stopped_by_hand() as stopped:
            last = time.monotonic()
            while not campaign.session.done and not stopped():
                step = campaign.session.next
                if step is not None:
                    progress(f"{step.number} of {step.of}: {step.label} {step.names[0]}, {campaign.source.waiting}")
                turn = _TURN if patience is None else max(0.0, min(_TURN, patience - (time.monotonic() - last)))
                entries = campaign.step(turn)
                for line in campaign.source.told():
                    tell(line)
                for entry in entries:
                    tell(entry.line())
                if entries:
                    last = time.monotonic()
                elif patience is not None and time.monotonic() - last >= patience:
                    break
        progress("writing the measurements")
        return campaign.finish()


def _begun(campaign: OpenCampaign, tell: Callable[[str], None], *, told_token: bool) -> None:
    from truearm.measuring.sources import HOST, Listener

    session = campaign.session
    if campaign.before:
        tell(f"Going on after {campaign.before} entries of the log: {session.outstanding} readings are still to come.")
    if isinstance(campaign.source, Listener):
        said = f", token {campaign.source.token}" if told_token else ""
        tell(f"Listening on {HOST} port {campaign.source.port}{said}")


@contextmanager
def _stopped_by_hand() -> Iterator[Callable[[], bool]]:
    """Tell whether Ctrl-C was pressed, instead of ending in the middle of a line; the second one ends at once."""
    pressed = threading.Event()

    def press(number: int, frame: FrameType | None) -> None:
        if pressed.is_set():
            raise KeyboardInterrupt
        pressed.set()

    if threading.current_thread() is not threading.main_thread():
        yield pressed.is_set
        return
    before = signal.signal(signal.SIGINT, press)
    try:
        yield pressed.is_set
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)
