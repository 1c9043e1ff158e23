"""Record what the commands do: ``python -m tests.recordings --record [GROUP...]``; without ``--record`` only compare.

What differs from the old recordings is printed, for the message of the commit that changes them.
"""

from __future__ import annotations

import sys

from tests.recordings.comparing import differences
from tests.recordings.recording import BASELINE, GROUPS, baseline_of, recorded, written_out


def main(words: list[str]) -> None:
    names = [word for word in words if not word.startswith("-")]
    for group in GROUPS:
        if names and group.name not in names:
            continue
        found = recorded(group)
        old, text = baseline_of(group), written_out(found) + "\n"
        for line in differences(old, found, group.name) if old else [f"{group.name}: {len(found)} new commands"]:
            sys.stdout.write(f"{line}\n")
        if "--record" in words:
            (BASELINE / f"{group.name}.json").write_text(text, "utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
