"""Reading files, and refusing in plain words what cannot be read or does not fit its schema."""

from __future__ import annotations

from pathlib import Path

from truearm.errors import InputError, nearest_names, wrong_kind
from truearm.schemas import Model, validated


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
        raise InputError(f"the file cannot be read ({reason_of(error)})", where=str(path)) from error


def _missing(path: Path) -> InputError:
    if path.is_symlink():
        return broken_link(path)
    try:
        siblings = [p.name for p in path.parent.iterdir()]
    except OSError:
        siblings = []
    near = nearest_names(path.name, siblings, count=2, likeness=0.75)
    cure = f"Did you mean {' or '.join(near)}?" if near else "Check the path."
    return InputError("there is no such file", where=str(path), cure=cure)


def broken_link(path: Path) -> InputError:
    """Return the refusal of a link that leads to nothing."""
    return InputError(
        "this is a link, and there is nothing where it points to",
        where=str(path),
        came=str(path.readlink()),
        cure="Remove or repair the link.",
    )


def reason_of(error: OSError | ValueError) -> str:
    """Return what the operating system says of a failure."""
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def exists(path: Path) -> bool:
    """Return whether there is something at `path`; a path that cannot be looked up leads to nothing."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


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


def path_argument(path: object, parameter: str) -> Path:
    """Return a path that was given as a text or a path."""
    if isinstance(path, str | Path) and _can_be_path(str(path)):
        if str(path):
            return Path(path)
        raise InputError("no file is given", parameter=parameter, came=str(path))
    raise wrong_kind(
        "a path belongs here", path, parameter, "the path of a file or folder, as a text in UTF-8 or a pathlib.Path"
    )


def _can_be_path(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:  # half a character
        return False
    return "\0" not in text
