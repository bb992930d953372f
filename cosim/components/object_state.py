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
_CLOSED = (type, str, bytes, int, float, complex, FunctionType, BuiltinFunctionType, MethodType, ModuleType)


def remember(thing: object, besides: Collection[str] = ()) -> Restore:
    """Everything that can be reached through attributes (`besides` some), lists, dicts, sets, arrays and random generators.

    What is returned brings it back, as often as it is called. Files, iterators and whatever else does not show what it holds stay
    as they are.
    """
    restores: list[Restore] = []
    _visit(thing, restores, set(), besides)

    def restore_all() -> None:
        for restore in restores:
            restore()

    return restore_all


def _visit(thing: Any, restores: list[Restore], seen: set[int], besides: Collection[str] = ()) -> None:
    if id(thing) in seen or isinstance(thing, _CLOSED):
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
        parts = _remember_members(thing, restores)
    parts += _remember_attributes(thing, restores, besides)
    for part in parts:
        _visit(part, restores, seen)


def _remember_members(thing: Any, restores: list[Restore]) -> list[Any]:
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


def _remember_attributes(thing: Any, restores: list[Restore], besides: Collection[str]) -> list[Any]:
    if not hasattr(thing, "__dict__"):
        return []
    own = vars(thing)
    held = {name: value for name, value in own.items() if name not in besides}

    def restore() -> None:
        for name in own.keys() - held.keys() - set(besides):
            del own[name]
        own.update(held)

    restores.append(restore)
    return list(held.values())
