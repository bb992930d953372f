"""PyBullet, imported without the build date that it writes to the standard error stream, and its clients."""

from __future__ import annotations

import os
import weakref
from types import ModuleType
from typing import NamedTuple

_STANDARD_ERROR = 2

_MISSING = (
    "PyBullet is not installed, and the world needs it; use Python 3.11 to 3.13, for which wheels "
    "exist, "
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

#: parameters of a new client, some of which a reset keeps; the order of pairs must not depend on
#: their history
_ENGINE_PARAMETERS = {
    "fixedTimeStep": 1 / 240,
    "numSubSteps": 0,
    "deterministicOverlappingPairs": 1,
}


#: largest number of bodies for the exact broad phase, whose time grows with its square
MAX_EXACT_BODIES = 100


class _SpareClient(NamedTuple):
    """Connected client without owner; the flags of its broad phase, or None if it must be reset."""

    number: int
    flags: int | None


#: connected clients without owner; at most one is kept
_spare_clients: list[_SpareClient] = []


def connect(owner: object, body_count: int = 0) -> tuple[int, weakref.finalize[[int], object]]:
    """Connect a Bullet client, or take the spare one.

    The client holds 60 MB that Python's garbage collector does not count, so it is also released
    when `owner` is collected.

    Args:
        owner: Object for which the client is connected.
        body_count: Number of bodies that it will get.

    Returns:
        Number of the client, which has no bodies, and a function without arguments that releases it
        once.
    """
    client = _take_client(_broad_phase(body_count))
    release = weakref.finalize(owner, _release, client)
    release.atexit = False
    return client, release


def _broad_phase(body_count: int) -> int:
    """Return the flags of a reset for a number of bodies.

    Bullet's default keeps pairs of bodies that are apart for some steps. They join islands, and
    saved states do not contain them.
    """
    return int(pybullet.RESET_USE_SIMPLE_BROADPHASE) if body_count <= MAX_EXACT_BODIES else 0


def _take_client(flags: int) -> int:
    """Return an empty client: a reset takes 1 ms, a connection 5 to 10 ms."""
    client, present = (
        _spare_clients.pop()
        if _spare_clients
        else _SpareClient(int(pybullet.connect(pybullet.DIRECT)), None)
    )
    if present != flags:
        pybullet.resetSimulation(flags, physicsClientId=client)
        pybullet.setPhysicsEngineParameter(**_ENGINE_PARAMETERS, physicsClientId=client)
    return client


def _release(client: int) -> None:
    """Keep one client for the next owner, who resets it, because most processes end before.

    Disconnect the others.
    """
    if _spare_clients:
        pybullet.disconnect(client)
    else:
        _spare_clients.append(_SpareClient(client, None))


def preconnect() -> None:
    """Connect a Bullet client that forked processes inherit; this saves most of 25 ms per run."""
    flags = _broad_phase(0)
    _spare_clients.append(_SpareClient(_take_client(flags), flags))
