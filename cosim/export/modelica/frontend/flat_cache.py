"""Cache of the front end, below the user's cache folder.

Flat models by the contents of their sources, and links to libraries.
"""

from __future__ import annotations

import gzip
import json
import shutil
from collections.abc import Sequence
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from secrets import token_hex
from typing import Any

from ....core.errors import CosimError, write_error
from ....core.resources import cache_directory
from ....results.files import write_file
from .libraries import Library


def read_document(key: Sequence[Any]) -> str | None:
    """Return the flat model with a key as JSON text, or None if the cache does not contain it undamaged."""
    with suppress(OSError, EOFError, ValueError):
        return gzip.decompress(_document_file(key).read_bytes()).decode()
    return None


def store_document(key: Sequence[Any], document: str) -> None:
    """Store a flat model under a key, if the cache can be written."""
    with suppress(CosimError):
        content = gzip.compress(document.encode(), compresslevel=1, mtime=0)
        write_file(_document_file(key), content)


def link_libraries(libraries: Sequence[Library]) -> Path:
    """Return a folder that contains a link to each library under its plain name and nothing else.

    The folder depends on names and places of the libraries only, so that names of files in messages
    of the front end are the same in each call.

    Raises:
        InputError: The cache cannot be written.
        OutputError: The disk is full or defective.
    """
    links = {library.link_name: str(library.path) for library in libraries}
    folder = _folder() / f"libraries-{_digest(links)}"
    if folder.is_dir():
        return folder
    temporary = folder.with_name(f"{folder.name}.{token_hex(8)}")
    try:
        temporary.mkdir(parents=True)
        for name, target in links.items():
            (temporary / name).symlink_to(target)
        with suppress(OSError):  # another process has created it
            temporary.rename(folder)
    except OSError as error:
        raise write_error(f"cannot write {temporary}: {error}", error) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return folder


def _folder() -> Path:
    return cache_directory() / "modelica"


def _document_file(key: Sequence[Any]) -> Path:
    return _folder() / f"{_digest(key)}.json.gz"


def _digest(value: Any) -> str:
    return sha256(json.dumps(value).encode()).hexdigest()[:24]
