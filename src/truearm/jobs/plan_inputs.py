"""The files that a plan is made from, by their hashes."""

from __future__ import annotations

from pathlib import Path

from truearm.compensation.program_files import companions
from truearm.errors import refusals_of
from truearm.files import exists, read_bytes
from truearm.jobs.arguments import hashes_of
from truearm.manifest import hash_of


def plan_inputs(
    robot: object,
    candidates_from: object,
    constraints: object,
    accurate_at: object,
    tools: object,
    frames: object,
) -> dict[str, str]:
    """Return the SHA-256 of each file that :func:`truearm.plan` is given, by its parameter, before they are read.

    Of a program in several files all count.

    Raises:
        InputError: If a file cannot be read; one that is not there has no hash.
    """
    found = hashes_of(
        robot=robot,
        candidates_from=candidates_from,
        constraints=constraints,
        accurate_at=accurate_at,
        tools=tools,
        frames=frames,
    )
    if isinstance(accurate_at, str | Path) and "accurate_at" in found:
        with refusals_of("accurate_at"):
            beside = [path for path in companions(Path(accurate_at)) if exists(path) and path.is_file()]
            if beside:
                parts = [found["accurate_at"], *(hash_of(read_bytes(path)) for path in sorted(beside))]
                found["accurate_at"] = hash_of("".join(parts).encode())
    return found
