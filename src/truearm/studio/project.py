"""A project: a folder of plain files, and one small file that says which of them are meant."""

from __future__ import annotations

import os
from codecs import BOM_UTF8
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from filecmp import cmp
from pathlib import Path, PurePosixPath
from typing import Any, Final, Literal

from truearm.engine.base.errors import InputError, is_one_line, refusals_at, refusals_of
from truearm.engine.base.files import exists, path_argument, read_bytes, read_text, read_yaml
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.base.manifest import MANIFEST, hash_of
from truearm.engine.base.schemas import validated
from truearm.engine.base.writing import put_back_old, put_in_place, remove_known, writable_folder, write_text_over
from truearm.studio.settings import Settings
from truearm.studio.uploads import clear_uploads

#: What makes a folder a project.
PROJECT_FILE: Final = "truearm-studio.yaml"
#: So many edits can be undone.
_KEPT: Final = 100
#: Settings that name a file of the folder, or a folder in it; those of the tests.
_PATHS: Final = ("data", "exclude", "result", "program", "cell", "corrected", "constraints", "path", "meshes")
_TESTED: Final = ("plan", "poses", "paths", "settling", "forces", "alignment", "compare", "result")


@dataclass(frozen=True)
class ChangedFile:
    """A file of the project that another program has changed, made or removed."""

    name: str  #: In the folder.
    how: Literal["changed", "new", "gone"]  #: ``changed``, ``new`` or ``gone``.
    stamp: tuple[int, int] | None  #: Size [bytes] and time of its last change [ns]; None if it is gone.


@dataclass(frozen=True)
class _Edit:
    """What an edit changes: settings, and the texts of files by their names, None where there is none."""

    settings_before: Settings
    settings: Settings
    files_before: Mapping[str, str | None]
    files: Mapping[str, str | None]

    def back(self) -> _Edit:
        """Return the edit that takes it back."""
        return _Edit(self.settings, self.settings_before, self.files, self.files_before)

    def changed(self) -> tuple[str, ...]:
        """Return the names of the settings and files that it changes."""
        before, new = self.settings_before, self.settings
        settings = [name for name in Settings.model_fields if getattr(before, name) != getattr(new, name)]
        return (*settings, *(name for name, text in self.files.items() if self.files_before[name] != text))


class Project:
    """A folder with its settings, their history, and what the files were like when they were last looked at.

    Not safe for several threads: the studio holds its lock around every call.

    Args:
        written: Hash of the file as it was before it was read: another program that writes meanwhile is noticed.

    Attributes:
        folder: Its absolute path, links followed.
        settings: What holds now; it is what the file says.
        theirs: Files, and folders, into which other programs write as they shall: what they change there is not told.
    """

    def __init__(self, folder: Path, settings: Settings, written: str | None) -> None:
        self.folder, self.settings = folder, settings
        self.theirs: tuple[str, ...] = ()
        self._undone: list[_Edit] = []
        self._before: list[_Edit] = []
        self._written = written
        self._seen = self._stamps()

    def path(self, name: str, parameter: str | None = None) -> Path:
        """Return the path of a file or folder of the project by its name.

        Raises:
            InputError: If the name leads out of the folder, by ``..``, as a whole path or over links.
        """
        parts = PurePosixPath(name.replace("\\", "/"))
        inside = is_one_line(name.replace(" ", "x")) and not parts.is_absolute() and ".." not in parts.parts
        path = self.folder / parts
        try:
            inside = inside and ":" not in name[:2] and path.resolve().is_relative_to(self.folder)
        except (OSError, RuntimeError, ValueError):
            inside = False
        if not inside:
            raise InputError(
                "this is no place in the project's folder",
                parameter=parameter,
                came=name,
                allowed="the name of a file in the folder, also one below it",
            )
        return path

    def relative(self, path: Path) -> str:
        """Return the name of a path in the project."""
        return path.relative_to(self.folder).as_posix()

    def robot_source(self) -> str | Path:
        """Return the robot's library id, or the path of its file in the folder."""
        from truearm.engine.robot.library import library

        name = self.settings.robot
        return name if name in library() else self.path(name, "robot")

    def robot_file(self) -> Path:
        """Return the path of the robot's file, without the part of it that is named; of a library id none is there."""
        return self.path(self.settings.robot.partition("#")[0], "robot")

    def file(self, setting: str) -> Path | None:
        """Return the path that a setting names; None if it names none."""
        name = getattr(self.settings, setting)
        return None if name is None else self.path(name, setting)

    def edit(
        self,
        files: Mapping[str, str] | None = None,
        *,
        known: Mapping[str, str | None] | None = None,
        **changes: Any,
    ) -> bool:
        """Change settings and write the file; return whether anything changed.

        Args:
            files: Texts of other small files of the project that are part of the edit, by their names: they are undone
                too.
            known: Texts that some of these files have had when the edit was made of them, None for no file; otherwise
                those that they have now.

        Raises:
            InputError: For a value that cannot be, or if another program has changed a file: it is not overwritten.
        """
        content = {**self.settings.model_dump(mode="json"), **changes}
        new = validated(content, Settings, PROJECT_FILE)
        _check_paths(self, new)
        texts = known or {}
        before = {name: texts[name] if name in texts else self._text_of(name) for name in files or {}}
        edit = _Edit(self.settings, new, before, dict(files or {}))
        if new == self.settings and edit.files == before:
            return False
        self._make(edit)
        self._before = [*self._before, edit][-_KEPT:]
        self._undone.clear()
        return True

    def undo(self) -> tuple[str, ...]:
        """Take back the last edit; return which settings and files that changed, none if there is no edit."""
        if not self._before:
            return ()
        self._make(self._before[-1].back())
        self._undone.append(self._before.pop())
        return self._undone[-1].changed()

    def redo(self) -> tuple[str, ...]:
        """Do an undone edit again; return which settings and files that changed, none if there is no such edit."""
        if not self._undone:
            return ()
        self._make(self._undone[-1])
        self._before.append(self._undone.pop())
        return self._before[-1].changed()

    def reload(self) -> None:
        """Take the settings from the file as it is now; edits before are no longer undone."""
        written = _hash_of_file(self.folder)
        settings = read_yaml(self.folder / PROJECT_FILE, Settings)
        with refusals_at(str(self.folder / PROJECT_FILE)):
            _check_paths(self, settings)
        self.settings, self._before, self._undone = settings, [], []
        self._written = written
        self.look()

    def look(self, *names: str) -> None:
        """Take note of files as they are now, those of some names and in folders of these; without names, of all.

        The studio itself has written them, with the manifests beside them.
        """
        now = self._stamps()
        if names:
            meant = (*names, *(str(PurePosixPath(name).parent / MANIFEST) for name in names))
            stay = {name: stamp for name, stamp in self._seen.items() if not _is_among(name, meant)}
            now = stay | {name: stamp for name, stamp in now.items() if _is_among(name, meant)}
        self._seen = now

    def seen(self, changes: Iterable[ChangedFile]) -> None:
        """Take note of changes that are shown; what has been changed once more since is not among them."""
        for change in changes:
            if change.stamp is None:
                self._seen.pop(change.name, None)
            else:
                self._seen[change.name] = change.stamp

    def changes(self) -> tuple[ChangedFile, ...]:
        """Return which files other programs have changed since the last look."""
        now, seen = self._stamps(), self._seen
        changed_files = [ChangedFile(name, "new", stamp) for name, stamp in now.items() if name not in seen]
        changed_files += [ChangedFile(name, "gone", None) for name in seen if name not in now]
        changed_files += [
            ChangedFile(name, "changed", stamp) for name, stamp in now.items() if name in seen and seen[name] != stamp
        ]
        told = [one for one in changed_files if not _is_among(one.name, self.theirs)]
        return tuple(sorted(told, key=lambda one: one.name))

    def names(self, *suffixes: str) -> list[str]:
        """Return the names of files of the project, those of some endings, three folders deep."""
        found = [name for name in self._stamps() if not suffixes or name.lower().endswith(suffixes)]
        return sorted(name for name in found if name != PROJECT_FILE and name.rpartition("/")[2] != MANIFEST)

    def take_in(self, name: str, came: Path) -> str:
        """Move a file that has come into the folder to its name there, and return that; it replaces none.

        Raises:
            InputError: If the name has folders in it or is one that truearm writes itself, if the file is too large, or
                if another file of that name stands there.
        """
        plain = PurePosixPath(name.replace("\\", "/"))
        if plain.name != name or name.startswith(".") or name in (PROJECT_FILE, MANIFEST):
            raise InputError("a file cannot be taken in under this name", came=name, cure="Rename it.")
        path = self.path(name)
        refuse_beyond("upload", came.stat().st_size, where=name)
        if exists(path):
            if not path.is_file() or not cmp(path, came, shallow=False):
                raise InputError(
                    "another file of this name stands in the project, and is not overwritten",
                    where=name,
                    cure="Rename the one or the other.",
                )
        else:
            put_in_place(came, path)
        self.look(name)
        return name

    def _make(self, edit: _Edit) -> None:
        """Write what an edit changes, all or nothing: files first, for the settings may name them."""
        standing = {name: self._standing(name, text) for name, text in edit.files_before.items()}
        done: list[str] = []
        try:
            for name, text in edit.files.items():
                self._put(name, text, standing[name])
                done.append(name)
            if edit.settings != self.settings:
                self._write(edit.settings)
        except InputError:
            for name in reversed(done):
                with suppress(InputError):  # another program has changed it since, and that stays
                    self._put(name, edit.files_before[name], _hash_of_text(edit.files[name]))
            raise
        self.settings = edit.settings

    def _standing(self, name: str, text: str | None) -> str | None:
        """Return the hash of the file of a name, or refuse one that holds another text; None if there shall be none."""
        path = self.path(name)
        content = read_bytes(path) if exists(path) else None
        if (None if content is None else content.removeprefix(BOM_UTF8)) != (None if text is None else text.encode()):
            raise InputError(
                "another program has changed this file, and it is not overwritten",
                where=name,
                cure="Reload the project, and make the edit again.",
            )
        return None if content is None else hash_of(content)

    def _put(self, name: str, text: str | None, standing: str | None) -> None:
        """Write or remove a file, unless another stands there by now than the one of a hash."""
        path = self.path(name)
        if text is not None:
            write_text_over(path, text, standing)
        elif standing is not None:
            remove_known(path, standing)
        self.look(name)

    def _text_of(self, name: str) -> str | None:
        path = self.path(name)
        return read_text(path) if exists(path) else None

    def _write(self, settings: Settings) -> None:
        """Write the file, unless it is not as this project has left it."""
        text = settings.text()
        write_text_over(self.folder / PROJECT_FILE, text, self._written)
        self._written = hash_of(text.encode())
        self.look(PROJECT_FILE)

    def _stamps(self) -> dict[str, tuple[int, int]]:
        """Return size and time of the last change of every file that is no hidden one, three folders deep."""
        found: dict[str, tuple[int, int]] = {}
        for place, folders, files in os.walk(self.folder):
            here = Path(place)
            depth = len(here.relative_to(self.folder).parts)
            folders[:] = [name for name in folders if not name.startswith(".") and depth < 2]
            for name in files:
                if name.startswith(".") or not is_one_line(name.replace(" ", "x")):
                    continue
                try:
                    known = (here / name).stat()
                except OSError:
                    continue
                found[self.relative(here / name)] = (known.st_size, known.st_mtime_ns)
        return found


def stamp_of(path: Path | None) -> tuple[str, int, int] | None:
    """Return path, size and time of the last change of a file, which tell whether it changed; None if none is there."""
    try:
        known = None if path is None else path.stat()
    except (OSError, ValueError):
        known = None
    return None if known is None else (str(path), known.st_size, known.st_mtime_ns)


def _is_among(name: str, names: Iterable[str]) -> bool:
    """Return whether a file is one of some, or in a folder that is."""
    return any(name == one or name.startswith(f"{one}/") for one in names)


def open_project(folder: object, first: Mapping[str, Any] | None = None) -> Project:
    """Open a project's folder; a new one is made of an empty folder, or of one that is missing.

    Args:
        first: Settings of a new project.

    Raises:
        InputError: If the folder holds other things and no project, or its file cannot be read.
    """
    with refusals_of("folder"):
        path = writable_folder(path_argument(folder, "folder"))
        is_new = refuse_no_project(path)
        if is_new:
            path.mkdir(parents=True, exist_ok=True)
        path = path.resolve()
        put_back_old(path)
        clear_uploads(path)
        if not exists(path / PROJECT_FILE):
            settings = validated(dict(first or {"truearm": "truearm-studio/1"}), Settings, PROJECT_FILE)
            try:
                write_text_over(path / PROJECT_FILE, settings.text(), None)
            except InputError:
                if not exists(path / PROJECT_FILE):  # another studio has just made it
                    raise
        written = _hash_of_file(path)
        project = Project(path, read_yaml(path / PROJECT_FILE, Settings), written)
        settings = project.settings
        with refusals_at(str(path / PROJECT_FILE)):
            _check_paths(project, settings)
        return project


def _hash_of_text(text: str | None) -> str | None:
    return None if text is None else hash_of(text.encode())


def _hash_of_file(folder: Path) -> str | None:
    """Return the hash of a project's file; None if there is none."""
    path = folder / PROJECT_FILE
    return hash_of(path.read_bytes()) if path.is_file() else None


def refuse_no_project(path: Path) -> bool:
    """Refuse a folder that holds other things and is no project; return whether there is nothing there yet."""
    if not path.is_dir():
        return True
    if exists(path / PROJECT_FILE):
        return False
    there = sorted(entry.name for entry in path.iterdir() if not entry.name.startswith("."))
    if there:
        raise InputError(
            "this folder holds other things and is no project of the studio",
            where=str(path),
            came=there[0],
            allowed=f"a folder with a {PROJECT_FILE}, an empty folder, or a new name",
            cure="Name another folder, and take your files in from there.",
        )
    return True


def _check_paths(project: Project, settings: Settings) -> None:
    """Refuse settings that lead out of the folder."""
    from truearm.engine.robot.library import library

    for name in _PATHS:
        value = getattr(settings, name)
        if value is not None:
            project.path(value, name)
    for name in ("candidates_from", "accurate_at", "out"):
        value = getattr(settings.plan, name)
        if value is not None:
            project.path(value, name)
    for name in ("plan", "truth", "watch", "mapping", "about", "out"):
        value = getattr(settings.measure, name)
        if value is not None:
            project.path(value, name)
    for name in _TESTED:
        value = getattr(settings.performance, name)
        if value is not None:
            project.path(value, f"performance.{name}")
    if settings.robot not in library():
        project.path(settings.robot, "robot")
    if settings.wrench_file is not None:
        project.path(settings.wrench_file, "wrench")
    if settings.controller_kinematics not in (None, "nominal", "proprietary", "unknown"):
        project.path(str(settings.controller_kinematics), "controller_kinematics")
