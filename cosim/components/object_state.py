"""What a Python object holds, remembered and brought back in place: who refers to a part of it still does so afterwards."""

from __future__ import annotations

import copy
import random
from collections.abc import Callable, Collection
from types import BuiltinFunctionType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

Restore = Callable[[], object]

#: what does not change, or is nobody's own
_OPAQUE_TYPES = (type, str, bytes, int, float, complex, FunctionType, BuiltinFunctionType, MethodType, ModuleType)


def snapshot(thing: object, exclude: Collection[str] = ()) -> Restore:
    """Everything that can be reached through attributes (`besides` some), lists, dicts, sets, arrays and random generators.

    What is returned brings it back, as often as it is called. Files, iterators and whatever else does not show what it holds stay
    as they are.
    """
    restores: list[Restore] = []
    _snapshot_object(thing, restores, set(), exclude)

    def restore_all() -> None:
        for restore in restores:
            restore()

    return restore_all


def _snapshot_object(thing: Any, restores: list[Restore], seen: set[int], exclude: Collection[str] = ()) -> None:
    if id(thing) in seen or isinstance(thing, _OPAQUE_TYPES):
        return
    seen.add(id(thing))
    parts: list[Any] = []
    if isinstance(thing, np.ndarray):
        if thing.flags.writeable:
            values = thing.copy()
            restores.append(lambda: thing.__setitem__(..., values))
        parts = thing.ravel().tolist() if thing.dtype.hasobject else []
    elif isinstance(thing, random.Random):
        state = thing.getstate()
        restores.append(lambda: thing.setstate(state))
    elif isinstance(thing, np.random.Generator):
        bits, drawn = thing.bit_generator, copy.deepcopy(thing.bit_generator.state)
        restores.append(lambda: setattr(bits, "state", drawn))
    elif isinstance(thing, tuple):
        parts = list(thing)
    elif hasattr(thing, "clear") and isinstance(thing, Collection):
        parts = _snapshot_members(thing, restores)
    parts += _snapshot_attributes(thing, restores, exclude)
    for part in parts:
        _snapshot_object(part, restores, seen)


def _snapshot_members(thing: Any, restores: list[Restore]) -> list[Any]:
    """Of a dict, list, deque or set."""
    refill = next((getattr(thing, name) for name in ("update", "extend") if hasattr(thing, name)), None)
    if refill is None:
        return []
    members = dict(thing) if hasattr(thing, "items") else list(thing)

    def restore() -> None:
        thing.clear()
        refill(members)

    restores.append(restore)
    return [*members.values()] if isinstance(members, dict) else members


def _snapshot_attributes(thing: Any, restores: list[Restore], exclude: Collection[str]) -> list[Any]:
    if not hasattr(thing, "__dict__"):
        return []
    own = vars(thing)
    held = {name: value for name, value in own.items() if name not in exclude}

    def restore() -> None:
        for name in own.keys() - held.keys() - set(exclude):
            del own[name]
        own.update(held)

    restores.append(restore)
    return list(held.values())
