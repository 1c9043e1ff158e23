"""What other programs change in the folder of a project while it is open."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import Any, Final

from truearm.engine.base.errors import Notice, Rule
from truearm.studio import words
from truearm.studio.project import PROJECT_FILE, ChangedFile, Project

#: So often the folder is looked at [s].
_LOOK: Final = 2.0
#: So many files are named.
_NAMED: Final = 8


FILES_CHANGED: Final = Rule(
    "files-changed",
    ("note", "warning"),
    "another program has changed files of the project: they are shown as they are now (note), or not yet (warning)",
)


class OtherPrograms:
    """Tells of changes of other programs: of those that are not shown yet where `said` is, of others in the notices.

    Args:
        lock: Held while the project is looked at.
        busy: Whether a long action of the studio writes there now.
        said: An element of HTML.
        tell: Says something in the notices.
    """

    def __init__(
        self,
        project: Project,
        lock: threading.RLock,
        busy: Callable[[], bool],
        said: Any,
        tell: Callable[[Notice], None],
    ) -> None:
        self._project, self._lock, self._busy, self._said, self._tell = project, lock, busy, said, tell
        self._told: Sequence[ChangedFile] = ()
        self._stopped = threading.Event()

    def start(self) -> None:
        """Look at the folder again and again."""
        threading.Thread(target=self._watch, daemon=True).start()

    def stop(self) -> None:
        """Look no longer."""
        self._stopped.set()

    def look(self) -> None:
        """Tell of files that other programs have changed, and that are not shown as they are now."""
        with self._lock:
            if self._busy():
                return
            changes = self._project.changes()
            if changes != self._told:
                self._told = changes
                text = f"{_words(changes)} Press reload to see them as they are now."
                self._said.content = words.notice(FILES_CHANGED(text, "warning"))
                self._said.visible = bool(changes)

    def shown(self, before: Sequence[ChangedFile]) -> None:
        """Take note that the pages show every file as it is now, but for the project's own; that is told as well.

        Args:
            before: The changes when the pages began to show them: what is changed meanwhile stays to be told.
        """
        files = [one for one in before if one.name != PROJECT_FILE]
        if files and not self._busy():
            self._project.seen(files)
            self._tell(FILES_CHANGED(f"{_words(files)} The pages show them as they are now."))
        if files or self._told:
            self.look()

    def _watch(self) -> None:
        while not self._stopped.wait(_LOOK):
            self.look()


def _words(changes: Sequence[ChangedFile]) -> str:
    told = ", ".join(f"{change.name} ({change.how})" for change in changes[:_NAMED])
    more = f" and {len(changes) - _NAMED} more" if len(changes) > _NAMED else ""
    return f"Another program has changed files: {told}{more}."
