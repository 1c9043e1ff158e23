"""One case: a kind and a number say all of it."""

from __future__ import annotations

import shutil
import signal
import tempfile
import time
import traceback
import zlib
from collections.abc import Iterator
from contextlib import chdir, contextmanager
from pathlib import Path
from types import FrameType
from typing import Final

import numpy as np
from tests.fuzz import commands, samples, verdicts
from tests.fuzz.calls import bent_arguments
from tests.fuzz.mutations import Random, damaged
from tests.fuzz.readers import READERS

import truearm
from truearm import JOBS
from truearm.engine.base.errors import InputError
from truearm.engine.document.records import Record

KINDS: Final = (*(f"read-{name}" for name in READERS), *(f"job-{name}" for name in JOBS), "command")


class TooLongError(BaseException):
    """Raised when a case has used up its time: what catches every error does not catch it."""


def findings(kind: str, number: int, keep: Path | None = None) -> list[str]:
    """Run a case and return what is wrong, nothing if all is well.

    Parameters
    ----------
    keep
        Folder for the files of the case; one that is removed if None.
    """
    rng = np.random.default_rng([zlib.crc32(kind.encode()), number])
    samples.folder()
    folder = Path(tempfile.mkdtemp(prefix="case-", dir=samples.folder())) if keep is None else keep
    try:
        what, _, name = kind.partition("-")
        began = time.process_time()
        with _seconds(commands.SECONDS), chdir(folder):  # odd texts are good names of files
            found = _command(rng, folder) if what == "command" else _in_process(rng, what, name, folder)
        if time.process_time() - began > commands.SECONDS:
            found.append("it took too long")
        return found
    finally:
        if keep is None:
            shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _seconds(most: float) -> Iterator[None]:
    """Stop what takes more time of the processor."""

    def stop(_: int, __: FrameType | None) -> None:
        raise TooLongError

    old = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, most)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, old)


def _in_process(rng: Random, what: str, name: str, folder: Path) -> list[str]:
    try:
        return _read(rng, name, folder) if what == "read" else _call(rng, name, folder)
    except InputError as error:
        return verdicts.of_refusal(error)
    except (Exception, TooLongError) as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return [f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}: {str(error)[:300]}"]


def _read(rng: Random, name: str, folder: Path) -> list[str]:
    reader = READERS[name]
    hit = int(rng.integers(len(reader.files)))
    for place, (file, sample) in enumerate(reader.files.items()):
        content = samples.content(sample)
        (folder / file).write_bytes(damaged(rng, file, content) if place == hit or rng.random() < 0.1 else content)
    reader.read(folder)
    return []


def _call(rng: Random, name: str, folder: Path) -> list[str]:
    given = bent_arguments(rng, name, folder)
    before = verdicts.state(folder)
    texts = " ".join(file.read_text("latin-1") for file in folder.iterdir() if file.is_file()) + repr(given)
    try:
        result = getattr(truearm, name)(**given)
    except InputError as error:
        found = verdicts.of_files(before, verdicts.state(folder), done=False)
        if error.parameter is None:
            found.append(f"no parameter is named: {error}")
        return found + verdicts.of_refusal(error)
    found = verdicts.of_files(before, verdicts.state(folder), done=True)
    assert repr(result)
    if isinstance(result, Record):
        if verdicts.not_finite(result.summary()):
            found.append("the summary holds a number that is none")
        printed = "\n".join(result.lines())
        found += [word for word in verdicts.of_printed(printed, texts) if "is printed" not in word]
    return found


def _command(rng: Random, folder: Path) -> list[str]:
    words = commands.bent_words(rng, folder)
    before = verdicts.state(folder)
    texts = " ".join(file.read_text("latin-1") for file in folder.iterdir()) + " ".join(words)
    ended = commands.run(words, folder)
    done = ended.code in (0, 3)
    found = verdicts.of_files(before, verdicts.state(folder), done=done)
    if ended.code not in (0, 2, 3):
        found.append(f"exit code {ended.code}: {(ended.err or ended.out)[-1500:]}")
    if ended.code == 2 and not ended.err:
        found.append("exit code 2, and nothing is said")
    if len(ended.err) > verdicts.LONGEST:
        found.append(f"the message has {len(ended.err)} characters: {ended.err[:200]}")
    told = "" if ended.err.startswith("Usage:") else ended.err  # the words of the library that reads options
    helped = bool({"--help", "-h", "--version"} & set(words))
    found += verdicts.of_printed(told, texts + told)
    found += verdicts.of_printed(ended.out, texts + ended.out * helped)
    if done and "--json" in words and not helped:
        found += verdicts.of_json(ended.out)
    return [f"truearm {' '.join(words)[:300]}: {word}" for word in found]
