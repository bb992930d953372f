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

#: parameters of a new client that a reset keeps
_ENGINE_DEFAULTS = {"fixedTimeStep": 1 / 240, "numSubSteps": 0}

#: connected clients without bodies; at most one is kept
_empty_clients: list[int] = []


def connect(owner: object) -> tuple[int, weakref.finalize[[int], object]]:
    """Connect a Bullet client, or take the empty one.

    The client holds 60 MB that Python's garbage collector does not count, so it is also released when `owner` is collected.

    Returns:
        Number of the client, and a function without arguments that releases it once.
    """
    client = _take_client()
    release = weakref.finalize(owner, _release, client)
    release.atexit = False
    return client, release


def _take_client() -> int:
    return _empty_clients.pop() if _empty_clients else int(pybullet.connect(pybullet.DIRECT))


def _release(client: int) -> None:
    """Keep one client for the next owner, because a connection takes 5 to 10 ms and a reset 1 ms; disconnect the others."""
    if _empty_clients:
        pybullet.disconnect(client)
    else:
        pybullet.resetSimulation(physicsClientId=client)
        pybullet.setPhysicsEngineParameter(**_ENGINE_DEFAULTS, physicsClientId=client)
        _empty_clients.append(client)


def preconnect() -> None:
    """Connect a Bullet client that forked processes inherit; this saves most of 25 ms per run."""
    if not _empty_clients:
        _empty_clients.append(_take_client())
