"""PyBullet, imported without the line about its build date that it writes to the standard error stream."""

from __future__ import annotations

import os
import weakref
from types import ModuleType

_STANDARD_ERROR = 2


def _import_without_stderr() -> ModuleType:
    kept, nowhere = os.dup(_STANDARD_ERROR), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, _STANDARD_ERROR)
    try:
        import pybullet
    finally:
        os.dup2(kept, _STANDARD_ERROR)
        os.close(kept)
        os.close(nowhere)
    return pybullet


pybullet = _import_without_stderr()

_preconnected_clients: list[int] = []


def connect(owner: object) -> tuple[int, weakref.finalize]:
    """A client (the one that was kept in stock, if there is any), and what disconnects it once.

    It ends with its owner too: Python does not see the 60 MB that a forgotten client holds.
    """
    client = _take_client()
    disconnect = weakref.finalize(owner, pybullet.disconnect, client)
    disconnect.atexit = False
    return client, disconnect


def _take_client() -> int:
    return _preconnected_clients.pop() if _preconnected_clients else int(pybullet.connect(pybullet.DIRECT))


def preconnect() -> None:
    """Connect a client for who will be forked from this process: most of its 25 ms go into memory touched for the first time."""
    if not _preconnected_clients:
        _preconnected_clients.append(_take_client())
