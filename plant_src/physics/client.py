"""PyBullet, imported without the build date that it writes to the standard error stream, and its clients."""

from __future__ import annotations

import os
import weakref
from types import ModuleType

_STANDARD_ERROR = 2

_MISSING = (
    "PyBullet is not installed, and the world needs it; use Python 3.11 to 3.13, for which wheels exist, "
    'build it with `pip install pybullet`, or replace the world by a plant FMU ("fmu" for "python")'
)


def _import_without_stderr() -> ModuleType:
    """Return the module `pybullet`.

    Raises:
        ModuleNotFoundError: If PyBullet is not installed; the message names the ways out.
    """
    saved, null = os.dup(_STANDARD_ERROR), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, _STANDARD_ERROR)
    try:
        import pybullet
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(_MISSING, name="pybullet") from error
    finally:
        os.dup2(saved, _STANDARD_ERROR)
        os.close(saved)
        os.close(null)
    module: ModuleType = pybullet
    return module


pybullet = _import_without_stderr()

_preconnected_clients: list[int] = []


def connect(owner: object) -> tuple[int, weakref.finalize[[int], object]]:
    """Connect a Bullet client, or take the preconnected one.

    The client holds 60 MB that Python's garbage collector does not count, so it is also disconnected when `owner` is collected.

    Returns:
        Number of the client, and a function without arguments that disconnects it once.
    """
    client = _take_client()
    disconnect = weakref.finalize(owner, pybullet.disconnect, client)
    disconnect.atexit = False
    return client, disconnect


def _take_client() -> int:
    return _preconnected_clients.pop() if _preconnected_clients else int(pybullet.connect(pybullet.DIRECT))


def preconnect() -> None:
    """Connect a Bullet client that forked processes inherit; this saves most of 25 ms per run."""
    if not _preconnected_clients:
        _preconnected_clients.append(_take_client())
