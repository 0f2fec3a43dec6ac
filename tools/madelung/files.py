"""Writing files whole or not at all, and reading JSON."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from madelung.errors import InputError


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path beside ``path`` that takes its place when the block ends well.

    A link stays, and the file that it leads to is replaced.

    Raises
    ------
    InputError
        The folder does not exist or cannot be written, ``path`` is a folder or a device, or the
        block runs into an `OSError`.
    """
    target = Path(os.path.realpath(path))
    try:
        if target.exists() and not target.is_file():  # as root, /dev/null could be replaced
            raise InputError(f"{path}: cannot be written: it is not a regular file")
        handle, name = tempfile.mkstemp(
            prefix=".madelung-", suffix=target.suffix, dir=target.parent
        )
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from error
    os.close(handle)
    part = Path(name)
    umask = os.umask(0)
    os.umask(umask)
    try:
        yield part
        part.chmod(0o666 & ~umask)
        part.replace(target)
    except OSError as error:  # the disk is full, say
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        with suppress(FileNotFoundError):
            part.unlink()


def write_atomically(path: Path, text: str) -> None:
    """Write ``text`` (UTF-8) to ``path``, whole or not at all."""
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")


def read_json(path: Path) -> Any:
    """What a JSON file holds.

    Raises
    ------
    InputError
        The file cannot be read, or is not JSON.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not a JSON file: {error}") from error
