"""Reading text and writing files so that nothing is ever half-written."""

from __future__ import annotations

import os
import tempfile
import unicodedata
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from truearm.errors import InputError, nearest_names

Model = TypeVar("Model", bound=BaseModel)


def read_bytes(path: Path) -> bytes:
    """Return the content of a file, or refuse with the reason it cannot be read."""
    try:
        if path.is_dir():
            raise InputError("this is a folder, a file is needed", where=str(path))
        return path.read_bytes()
    except FileNotFoundError as error:
        raise _missing(path) from error
    except InputError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the path
        raise InputError(f"the file cannot be read ({_reason(error)})", where=str(path)) from error


def _missing(path: Path) -> InputError:
    if path.is_symlink():
        return _broken_link(path)
    try:
        siblings = [p.name for p in path.parent.iterdir()]
    except OSError:
        siblings = []
    near = nearest_names(path.name, siblings, count=2, likeness=0.75)
    cure = f"Did you mean {' or '.join(near)}?" if near else "Check the path."
    return InputError("there is no such file", where=str(path), cure=cure)


def _broken_link(path: Path) -> InputError:
    return InputError(
        "this is a link, and there is nothing where it points to",
        where=str(path),
        came=str(path.readlink()),
        cure="Remove the link, or mend it.",
    )


def _reason(error: OSError | ValueError) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def exists(path: Path) -> bool:
    """Return whether there is something at `path`; a path that cannot be looked up leads to nothing."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def is_one_line(text: str) -> bool:
    """Return whether a text is one line that can be seen: not blank, without breaks and control characters."""
    return bool(text.strip()) and not any(unicodedata.category(c) in ("Cc", "Cs", "Zl", "Zp") for c in text)


def read_text(path: Path) -> str:
    """Return the text of a UTF-8 file without its byte order mark."""
    content = read_bytes(path)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"the file is not UTF-8 text (byte {error.start})", where=str(path), cure="Save it as UTF-8."
        ) from error
    if not text.strip():
        raise InputError("the file is empty", where=str(path))
    return text


def read_yaml(path: Path, schema: type[Model]) -> Model:
    """Read a YAML file into a pydantic model, refusing what does not fit it.

    ``1e-3`` is a number, as YAML 1.2 says; a key given twice is refused.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    text = read_text(path)
    try:
        content = YAML(typ="safe", pure=True).load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark
        where = f"{path}, line {mark.line + 1}" if mark else str(path)
        problem = " ".join(str(error.problem or "not valid").split())
        raise InputError(f"this is not valid YAML ({problem})", where=where) from error
    except YAMLError as error:
        raise InputError(f"this is not valid YAML ({' '.join(str(error).split())})", where=str(path)) from error
    except RecursionError as error:
        raise InputError("the entries are nested too deep", where=str(path)) from error
    except Exception as error:  # the parser lets pass what its conversions raise: 30 February, 5000 digits
        reason = " ".join(str(error).partition(";")[0].split())
        raise InputError(
            f"a value cannot be understood ({reason})", where=str(path), cure="Put text into quotes."
        ) from error
    return validated(content, schema, str(path))


def validated(content: object, schema: type[Model], where: str) -> Model:
    """Return `content` as `schema`, or refuse it naming the entry that is wrong."""
    if not isinstance(content, Mapping):
        raise InputError("the file must hold named entries (name: value)", where=where, came=type(content).__name__)
    try:
        return schema.model_validate(dict(content))
    except ValidationError as error:
        raise _refusal(error, content, schema, where) from error


def _refusal(error: ValidationError, content: Any, schema: type[BaseModel], where: str) -> InputError:
    first = error.errors(include_url=False)[0]
    entry = ""
    for part in first["loc"]:  # items of a list count from 1, keys stand as they are
        if isinstance(content, list) and isinstance(part, int):
            entry += f"[{part + 1}]"
            content = content[part] if part < len(content) else None  # of six numbers the fourth may be missing
        else:
            entry += f".{part}"
            content = content.get(part) if isinstance(content, Mapping) else None
    entry = entry.lstrip(".")
    came: Any = first.get("input")
    if isinstance(came, dict | list):
        came = None
    cure = None
    if first["type"] == "extra_forbidden":
        what = "this entry is not known here"
        known = list(schema.model_fields) if len(first["loc"]) == 1 else []
        near = nearest_names(str(first["loc"][-1]), known)
        came = None
        cure = f"Did you mean {' or '.join(near)}?" if near else None
    elif first["type"] == "missing":
        what, came = "this entry is missing", None
    else:
        what = first["msg"].removeprefix("Value error, ")
        what = what[0].lower() + what[1:]
    return InputError(what, where=f"{where}, {entry}" if entry else where, came=came, cure=cure)


def write_text(path: Path, text: str) -> None:
    """Write a whole file or nothing: a reader never sees half of it, and a failure leaves the old one."""
    write_files(path.parent, {path.name: text})


def write_new_text(path: Path, text: str) -> None:
    """Write a file that does not exist yet; nothing is overwritten."""
    write_text(new_file(path), text)


def new_file(path: Path) -> Path:
    """Make sure that a file does not exist yet and can be written at `path`, before any long work, and return it."""
    if exists(path):
        raise InputError("this exists already and is not overwritten", where=str(path), cure="Choose another name.")
    return writable_file(path)


def writable_folder(folder: Path) -> Path:
    """Make sure that files can be written in `folder`, before any long work, and return it."""
    try:
        for parent in (folder, *folder.parents):
            if parent.is_symlink() and not parent.exists():
                raise _broken_link(parent)
            if parent.exists():
                if not parent.is_dir():
                    raise InputError("this is a file, a folder is needed", where=str(parent))
                if not os.access(parent, os.W_OK | os.X_OK):
                    raise InputError("the folder cannot be written to", where=str(parent), cure="Choose another --out.")
                break
    except OSError as error:
        raise InputError(f"the folder cannot be used ({_reason(error)})", where=str(folder)) from error
    return folder


def writable_file(path: Path) -> Path:
    """Make sure that a file can be written at `path`, before any long work, and return it."""
    writable_folder(path.parent)
    try:
        if path.is_symlink() and not path.exists():
            raise _broken_link(path)
        if path.is_dir():
            raise InputError("this is a folder, a file is to be written here", where=str(path))
        if path.exists() and not path.is_file():
            raise InputError("this is a device or a pipe, a file is to be written here", where=str(path))
    except OSError as error:
        raise InputError(f"the file cannot be written ({_reason(error)})", where=str(path)) from error
    return path


def refuse_overwriting(out: Path, inputs: Iterable[Path]) -> None:
    """Refuse an output that is one of the inputs, by whatever path."""
    for path in inputs:
        try:
            same = out.samefile(path)
        except (OSError, ValueError):  # where one of them does not exist they are not the same
            same = False
        if same:
            raise InputError(
                "this file is read, and would be overwritten", where=str(out), cure="Choose another --out."
            )


def write_files(folder: Path, files: Mapping[str, str | bytes]) -> None:
    """Write several files into a folder; they are put in place only once all of them are on disk.

    Their names may begin with folders in that folder.
    """
    for name in files:
        writable_file(folder / name)
    staged: list[tuple[Path, Path]] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            target = folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            handle, temporary = tempfile.mkstemp(prefix=".truearm.", dir=folder)
            staged.append((Path(temporary), target))
            with os.fdopen(handle, "wb") as stream:
                stream.write(text if isinstance(text, bytes) else text.encode())
            Path(temporary).chmod(0o666 & ~_umask())
        for temporary_path, target in staged:
            temporary_path.replace(target)
    except OSError as error:
        raise InputError(
            f"the file cannot be written ({_reason(error)})", where=str(error.filename or folder)
        ) from error
    finally:
        for temporary_path, _ in staged:
            temporary_path.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
