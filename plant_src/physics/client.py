"""PyBullet, imported without the build date that it writes to the standard error stream, and its clients."""

from __future__ import annotations

import os
import weakref
from types import ModuleType
from typing import NamedTuple

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


class _SpareClient(NamedTuple):
    """Connected client without owner, and whether it must be reset."""

    number: int
    is_used: bool


#: connected clients without owner; at most one is kept
_spare_clients: list[_SpareClient] = []


def connect(owner: object) -> tuple[int, weakref.finalize[[int], object]]:
    """Connect a Bullet client, or take the spare one.

    The client holds 60 MB that Python's garbage collector does not count, so it is also released when `owner` is collected.

    Returns:
        Number of the client, which has no bodies, and a function without arguments that releases it once.
    """
    client = _take_client()
    release = weakref.finalize(owner, _release, client)
    release.atexit = False
    return client, release


def _take_client() -> int:
    """Return an empty client: a reset takes 1 ms, a connection 5 to 10 ms."""
    if not _spare_clients:
        return int(pybullet.connect(pybullet.DIRECT))
    client, is_used = _spare_clients.pop()
    if is_used:
        pybullet.resetSimulation(physicsClientId=client)
        pybullet.setPhysicsEngineParameter(**_ENGINE_DEFAULTS, physicsClientId=client)
    return client


def _release(client: int) -> None:
    """Keep one client for the next owner, who resets it, because most processes end before; disconnect the others."""
    if _spare_clients:
        pybullet.disconnect(client)
    else:
        _spare_clients.append(_SpareClient(client, is_used=True))


def preconnect() -> None:
    """Connect a Bullet client that forked processes inherit; this saves most of 25 ms per run."""
    _spare_clients.append(_SpareClient(_take_client(), is_used=False))
